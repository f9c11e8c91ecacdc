"""Inside Blender's window: panels of the sidebars as pictures want them (ui_script.py)."""
import contextlib
import importlib

import bpy


def addon(name):
    return importlib.import_module("sunder_addon." + name)


def unfolded(panels):
    """Classes of the same panels that are not closed at first. (Blender keeps how those that it has drawn are.)"""
    made = []
    for cls in panels:
        named = {name: getattr(cls, name) + "_open" for name in ("bl_idname", "bl_parent_id") if hasattr(cls, name)}
        members = {name: vars(cls)[name] for name in ("bl_space_type", "bl_region_type", "bl_category", "bl_label", "poll", "draw")}
        made.append(type(cls.__name__ + "_open", (bpy.types.Panel,), {**members, **named, "bl_options": set()}))
    return made


@contextlib.contextmanager
def on_top(module):
    """The panels of a file are open, and those that stand above them are not there."""
    above = [addon("interface.panels").SUNDER_PT_tree, addon("interface.panels").SUNDER_PT_object]
    panels = unfolded(cls for cls in addon(module).classes if issubclass(cls, bpy.types.Panel))
    for cls in above:
        bpy.utils.unregister_class(cls)
    for cls in panels:
        bpy.utils.register_class(cls)
    yield
    for cls in reversed(panels):
        bpy.utils.unregister_class(cls)
    for cls in above:
        bpy.utils.register_class(cls)
