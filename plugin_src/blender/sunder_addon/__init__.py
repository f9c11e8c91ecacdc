"""Sunder in Blender: a node tree for ductile fracture, its bake, and mesh objects that play the bake.

A thin layer: what nodes there are comes from the library's own descriptions, what they do from the library.
"""
bl_info = {
    "name": "Sunder",
    "author": "Sunder",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Node editors > Sunder; 3D View > Object > Quick Effects > Quick Fracture",
    "description": "Ductile fracture with nodes: solids that dent, tear and shatter",
    "category": "Physics",
}

try:
    import numpy  # noqa: F401
except ImportError as error:
    import sys

    raise ImportError(
        f"Sunder needs numpy, which Blender's Python in {sys.prefix} has not; where Blender takes the first python3 on PATH "
        "for its own (Debian's does), start it with PATH=/usr/bin:$PATH"
    ) from error

from . import registration


def register():
    registration.register()


def unregister():
    registration.unregister()
