"""Blender's objects as arrays and numbers: meshes with all that they carry, places, motion."""
