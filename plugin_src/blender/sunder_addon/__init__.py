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

from . import registration


def register():
    registration.register()


def unregister():
    registration.unregister()
