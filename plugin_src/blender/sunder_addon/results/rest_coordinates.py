"""Where the points of a result were before the shot: an attribute, and what textures by Generated coordinates go by.

Blender takes Generated coordinates of a mesh whose points move from its texture mesh, but only where a modifier may have
moved them. So a result has one that moves nothing.
"""
import bpy
import numpy as np
from mathutils import Matrix

from ..base import blender_versions
from . import result_mesh

ATTRIBUTE = "rest_position"
MODIFIER, _OF = "Rest Coordinates", "sunder_of"


def _is_own(mesh):
    return mesh.texco_mesh is not None and mesh.texco_mesh.get(_OF) == mesh.name


def is_whole(mesh):
    """Whether a mesh that has rest positions has a texture mesh of its own: a copy of a result shares that of the first.
    (One that is linked uses what it was saved with.)"""
    return _is_own(mesh) or ATTRIBUTE not in mesh.attributes or not result_mesh.is_local(mesh)


def _texture_mesh(mesh):
    """None for a linked mesh that was saved without: Blender lets it use no local one."""
    if not _is_own(mesh):
        if not result_mesh.is_local(mesh):
            return None
        made = bpy.data.meshes.new(f"{mesh.name} at rest")
        made[_OF] = mesh.name
        result_mesh.set_property(mesh, "texco_mesh", made)
        result_mesh.set_property(mesh, "sunder_at_rest", made)  # a use that Blender counts: a file keeps what is used
    return mesh.texco_mesh


def prepare(thing):
    """The modifier that makes Blender look at a result object's texture mesh."""
    if MODIFIER not in thing.modifiers:
        nothing = thing.modifiers.new(MODIFIER, "CAST")
        nothing.factor, nothing.radius, nothing.use_radius_as_size = 1e-30, 1e-6, False  # 0 would switch it off
        nothing.show_expanded = False


def remove(mesh):
    """Removes a mesh, and its texture mesh where it has one of its own."""
    own = mesh.texco_mesh if _is_own(mesh) else None
    if own is not None and own.users > 1:  # Blender counts it as a texture mesh, too, which one of a file is not
        mesh.texco_mesh = None
    bpy.data.meshes.remove(mesh)
    if own is not None:
        bpy.data.meshes.remove(own)


def _moved(points, matrix):
    return (points @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)


def _matrix(note):
    return np.array(note.get("matrix", Matrix.Identity(4)), np.float64)


def write(mesh, positions, note):
    """positions (v, 3) f32: rest positions in the cut's coordinates, None of bakes that tell none. note: of compiler.py, {}
    for none. Returns them in those of what was cut."""
    if positions is None:
        return None
    rest = _moved(positions, _matrix(note))
    result_mesh.write_attribute(mesh, ATTRIBUTE, "FLOAT_VECTOR", "POINT", rest)
    return rest


def write_texture_space(mesh, rest, note, whole=None):
    """rest: as `write` returns it. whole: rest positions, in the cut's coordinates, of all that was cut, where the mesh shows
    a part of it."""
    if rest is None:
        result_mesh.set_property(mesh, "texco_mesh", None)
        return
    shape = _texture_mesh(mesh)
    if shape is None:
        return
    before = np.empty(3 * len(shape.vertices), np.float32)
    shape.vertices.foreach_get("co", before)
    if not np.array_equal(before, rest.ravel()):
        with result_mesh.written(shape) as points:
            if len(points.vertices) != len(rest):
                points.clear_geometry()
                points.vertices.add(len(rest))
            blender_versions.write_positions(points, rest)
    space = rest if whole is None else _moved(whole, _matrix(note))
    low, high = (space.min(0), space.max(0)) if len(space) else (np.zeros(3), np.ones(3))
    size = (high - low) / 2
    for thing in (mesh, shape):
        result_mesh.set_property(thing, "use_auto_texspace", False)
        result_mesh.set_property(thing, "texspace_location", note.get("location", ((low + high) / 2).tolist()))
        result_mesh.set_property(thing, "texspace_size", note.get("size", np.where(size > 0, size, 1).tolist()))
