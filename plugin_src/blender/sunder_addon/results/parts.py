"""What makes result objects leave Blender whole: break surfaces as an object of their own, and things that count as moving.

Blender's exporters write at the first frame alone which faces have which material, and there a shot has no break surfaces
yet. An object of one material keeps it.
"""
import bpy

from ..tree import trees
from . import rest_coordinates

_MOVES = "Moves"  # a constraint that constrains nothing


def count_as_moving(thing):
    """Blender's exporters take an object without keys and constraints, and a mesh without modifiers, for one that stands
    still."""
    node = trees.find_node(thing.sunder.tree, thing.sunder.node)
    if node is None or thing.library is not None:
        return
    if node.sunder_type == "deformer":
        rest_coordinates.prepare(thing)
    elif node.sunder_type == "rigid_body" and _MOVES not in thing.constraints:
        thing.constraints.new("LIMIT_LOCATION").name = _MOVES


def shows_mesh(thing):
    """Whether a result object shows meshes of a deformer, and does not move as a whole."""
    node = trees.find_node(thing.sunder.tree, thing.sunder.node)
    return thing.type == "MESH" and node is not None and node.sunder_type == "deformer"


def has_motion(thing):
    """Whether a result object may move besides what it shows."""
    return thing.parent is not None or thing.animation_data is not None or len(thing.constraints) > 0


def can_split(thing):
    """Whether a result object shows outer and break surfaces as one."""
    return shows_mesh(thing) and thing.sunder.part == "ALL" and thing.library is None and thing.data.library is None


def split(thing):
    """Makes an object of its break surfaces, which leaves `thing` the outer ones. Their slot there is emptied: an exporter
    gives a mesh the first material that it finds."""
    if thing.data.users > 1:  # another object goes on showing both
        thing.data = thing.data.copy()
    inside, slot = thing.copy(), thing.sunder.interior_slot
    inside.data = bpy.data.meshes.new(f"{thing.name} inside")
    inside.name = inside.data.name
    material = thing.material_slots[slot].material if slot < len(thing.material_slots) else None
    inside.data.materials.append(material)
    if material is not None:
        thing.material_slots[slot].material = None
    inside.sunder.interior_slot, inside.sunder.part, inside.sunder.preview = 0, "INSIDE", "OFF"
    thing.sunder.part = "OUTSIDE"
    for collection in thing.users_collection:
        collection.objects.link(inside)
    return inside


def unite(thing, inside):
    """Break surfaces back into an object, with the material that they have in `inside` (None: with none)."""
    slot = thing.sunder.interior_slot
    if inside is not None and inside.material_slots and slot < len(thing.material_slots):
        thing.material_slots[slot].material = inside.material_slots[0].material
    thing.sunder.part = "ALL"


def remove(inside):
    mesh = inside.data
    bpy.data.objects.remove(inside)
    if mesh.users == 0:
        rest_coordinates.remove(mesh)


def give_back(thing, mesh):
    """The mesh that an object had before `split`, where that was shared."""
    copy = thing.data
    if copy != mesh:
        thing.data = mesh
        rest_coordinates.remove(copy)
