"""What leaves Blender: files of other programs, and shots that play without the add-on."""
