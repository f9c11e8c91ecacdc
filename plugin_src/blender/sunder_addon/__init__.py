"""Sunder in Blender: a node tree for ductile fracture, its bake, and mesh objects that play the bake.

A thin layer: what nodes there are comes from the library's own descriptions, what they do from the library.
"""
bl_info = {
    "name": "Sunder",
    "author": "Sunder",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "Node editors > Sunder; 3D View > Object > Quick Effects > Quick Fracture",
    "description": "Ductile fracture with nodes: solids that dent, tear and shatter",
    "category": "Physics",
}

import sys
import textwrap

import bpy


def _lack():
    """What keeps the add-on from working, with the cure; empty if nothing does. Without the library it works (base/core.py)."""
    try:
        import numpy  # noqa: F401
    except ImportError:
        return (f"Sunder needs numpy, which Blender's Python in {sys.prefix} has not; where Blender takes the first python3 on "
                "PATH for its own (Debian's does), start it with PATH=/usr/bin:$PATH")
    try:
        from . import registration  # noqa: F401
    except FileNotFoundError as error:
        return f"{error.filename} of Sunder's add-on is missing: install its zip again"
    except ImportError as error:
        return f"A file of Sunder's add-on is missing or damaged ({error}): install its zip again"
    return ""


class SunderLack(bpy.types.AddonPreferences):
    """What stands in the preferences where the add-on cannot work."""

    bl_idname = __package__
    sentence = ""

    def draw(self, _context):
        for i, line in enumerate(textwrap.wrap(self.sentence, 90)):
            self.layout.label(text=line, icon="BLANK1" if i else "ERROR")


def register():
    SunderLack.sentence = _lack()
    if SunderLack.sentence:
        print(f"sunder: error: {SunderLack.sentence}")
        bpy.utils.register_class(SunderLack)
    else:
        from . import registration

        registration.register()


def unregister():
    if SunderLack.sentence:
        bpy.utils.unregister_class(SunderLack)
    else:
        from . import registration

        registration.unregister()
