"""What the library is told of Blender's objects: meshes, where things stand at the first frame, how they move.

Lengths are metres (one Blender unit is one metre), rotations Euler XYZ in degrees.
"""
import math
from fractions import Fraction

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

from ..base import core
from ..tree import conditions, edits, pickers, wiring
from . import leaders, mesh_export


def _is_enabled(thing, layer):
    """Whether a layer collection, or one below it, has the object and is enabled in viewports."""
    if layer.exclude or layer.collection.hide_viewport:
        return False
    return thing.name in layer.collection.objects or any(_is_enabled(thing, child) for child in layer.children)


def check_evaluated(thing, depsgraph, node):
    """Blender works out modifiers, animation and place of what is enabled in the view layer alone."""
    scene = depsgraph.scene.original
    if scene not in thing.users_scene and thing.users_scene:
        raise core.Refused(
            f"object '{thing.name}' is of scene '{thing.users_scene[0].name}', not of '{scene.name}': pick one of this scene",
            node.graph_name)
    if thing.hide_viewport or not _is_enabled(thing, depsgraph.view_layer.layer_collection):
        raise core.Refused(
            f"object '{thing.name}' is disabled in viewports, or not in this view layer: enable it (it may be hidden "
            "with the eye)", node.graph_name)
    _check_leaders(thing, node)


def _check_leaders(thing, node):
    """What goes round in a circle is where Blender happens to have begun; what a bake takes from itself, where the last one left it."""
    circle = leaders.circle(thing)
    if circle:
        names = ", ".join(f"'{o.name}'" for o in circle)
        raise core.Refused(f"objects {names} have their places by one another: remove a parent or a constraint", node.graph_name)
    made = leaders.results_of(thing, node.id_data)
    if made:
        raise core.Refused(f"object '{thing.name}' goes by '{made[0].name}', which shows what this tree makes", node.graph_name)


def objects_of(node):
    """The objects that a node stands for, in the order of their names."""
    if node.source == pickers.COLLECTION:
        if node.collection is None:
            raise core.Refused("no collection is picked", node.graph_name)
        found = sorted((o for o in node.collection.all_objects if o.type == "MESH" and not o.sunder.tree),
                       key=lambda o: o.name)
        if not found:
            raise core.Refused(f"collection '{node.collection.name}' has no mesh object", node.graph_name)
        return found
    if node.object is None:
        raise core.Refused("no object is picked", node.graph_name)
    return [node.object]


def mesh_objects(node):
    found = objects_of(node)
    for thing in found:  # pickers offer what fits, but scripts may set anything
        if thing.type not in pickers.SURFACES:
            raise core.Refused(f"object '{thing.name}' is a {thing.type.lower()}, not a mesh", node.graph_name)
        if thing.sunder.tree:
            raise core.Refused(f"object '{thing.name}' shows a result and cannot be its own source", node.graph_name)
        if thing.mode == "EDIT":
            raise core.Refused(f"object '{thing.name}' is in edit mode: leave it first", node.graph_name)
    return found


def degrees(rotation, before=None):
    """Euler XYZ of a quaternion or matrix in degrees, next to `before` so that it does not jump by a turn."""
    near = Euler([math.radians(a) for a in before], "XYZ") if before else None
    euler = rotation.to_euler("XYZ", near) if near else rotation.to_euler("XYZ")
    return [decimal(math.degrees(a)) for a in euler]


def decimal(value):
    """Seven digits, so that noise of matrix products does not make a bake another one."""
    return float(f"{value:.7g}") if abs(value) > 1e-7 else 0.0


_LARGEST_TERM = 10_000_000  # of a ratio, as the library has it


def frame_rate(scene):
    """Frames per second: a number, or the ratio that Blender's base stands for, 24 / 1.001 being [24000, 1001]."""
    ratio = scene.render.fps / Fraction(repr(decimal(scene.render.fps_base)))
    if ratio.denominator == 1:
        return ratio.numerator
    if max(ratio.numerator, ratio.denominator) > _LARGEST_TERM:
        return decimal(float(ratio))
    return [ratio.numerator, ratio.denominator]


def vector(v):
    return [decimal(c) for c in v]


def _rigid(matrix):
    location, rotation, _ = matrix.decompose()
    return Matrix.Translation(location) @ rotation.to_matrix().to_4x4()


def placement(matrix):
    """A matrix as location, rotation (quaternion) and what is left: scale, shear, mirror (3x3 as 4x4)."""
    location, rotation, _ = matrix.decompose()
    return location, rotation, _rigid(matrix).inverted() @ matrix


def _extremes(thing, depsgraph, matrix):
    if thing.type == "EMPTY":
        size = thing.empty_display_size
        corners = [Vector((x, y, z)) * size for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    else:
        corners = [Vector(c) for c in thing.evaluated_get(depsgraph).bound_box]
    taken = np.array([matrix @ c for c in corners])
    return Vector(taken.min(0)), Vector(taken.max(0))


def bounds(thing, depsgraph):
    """Lowest and highest corner of an object's bounding box in its own axes, scale in; empties are their size."""
    return _extremes(thing, depsgraph, placement(thing.matrix_world)[2])


def world_bounds(thing, depsgraph):
    """The same along the world's axes."""
    return _extremes(thing, depsgraph, thing.matrix_world)


def shape(kind, thing, depsgraph, node):
    """Parameters of size of a rigid body or collider, and its centre in the object's axes."""
    check_evaluated(thing, depsgraph, node)
    if kind == "plane":  # an object's own xy plane, whatever its size
        return {}, Vector((0, 0, 0))
    low, high = bounds(thing, depsgraph)
    size, center = high - low, (high + low) / 2
    if min(size) <= 0 and kind == "box" or max(size) <= 0:
        raise core.Refused(f"object '{thing.name}' is flat: its bounding box holds no {kind}", node.graph_name)
    if kind == "sphere":
        return {"radius": decimal(max(size) / 2)}, center
    if kind == "box":
        return {"size": vector(size)}, center
    radius = max(size.x, size.y) / 2
    return {"radius": decimal(radius), "height": decimal(max(size.z - 2 * radius, 1e-4))}, center


def pose(matrix, center, before=None):
    """Position and rotation of a shape whose centre is given in the object's axes (scale in)."""
    location, rotation, _ = placement(matrix)
    return vector(location + rotation @ center), degrees(rotation, before)


def motion(before, now, center, rate):
    """Velocity (m/s) of a point of the object's axes (scale in) and angular velocity (degrees/s) from one frame to the
    next."""
    was, was_turned, _ = placement(before)
    at, turned, _ = placement(now)
    velocity = (at + turned @ center - was - was_turned @ center) * rate
    axis, angle = (turned @ was_turned.inverted()).to_axis_angle()
    if angle > math.pi:  # the shorter way round
        angle -= 2 * math.pi
    return {"velocity": vector(velocity), "angular_velocity": vector(axis * math.degrees(angle) * rate)}


def own_bounds(thing, node, depsgraph):
    """Lowest and highest corner of an object's bounding box along the axes of the mesh that comes up the wires."""
    source = placed_by(node)
    matrix = Matrix() if source is None else _rigid(source.matrix_world).inverted()
    return _extremes(thing, depsgraph, matrix @ thing.matrix_world)


def wanted(tree, node, parameters_of):
    """Names of vertex groups, or of maps, that other nodes ask of the mesh that `node` gives."""
    found = set()
    for n in wiring.needed(tree):
        names = [g for g in parameters_of(n.sunder_type) if conditions.counts(n, g)]
        if names and wiring.upstream(n, "mesh_file") == node:
            found.update(getattr(n, g) for g in names)
    return sorted(found - {""})


def points_objects(node, name):
    """The objects that a list of points is taken from; results that stand beside their sources are none."""
    if getattr(node, name + "_source") == pickers.VALUES:
        return []
    source = getattr(node, f"{name}_{getattr(node, name + '_source').lower()}")
    if source is None:
        return []
    if not isinstance(source, bpy.types.Collection):
        return [source]
    return sorted((o for o in source.all_objects if not o.sunder.tree), key=lambda o: o.name)


def points(node, name, depsgraph):
    """A list of points in the coordinates of the mesh that comes up the wires; of a seam in the scene."""
    if getattr(node, name + "_source") == pickers.VALUES:
        placed = body_matrix(node)
        return [vector(placed @ Vector(p)) for p in edits.places(node, name)]
    found = []
    for thing in points_objects(node, name):
        check_evaluated(thing, depsgraph, node)
        is_whole = getattr(node, f"{name}_source") == pickers.OBJECT and thing.type in ("MESH", "CURVE")
        found += _vertices(thing, depsgraph) if is_whole else [thing.matrix_world.translation]
    source = placed_by(node) if node.sunder_type != "seam" else None
    inverse = Matrix() if source is None else _rigid(source.matrix_world).inverted()
    return [vector(inverse @ p) for p in found]


def body_matrix(node):
    """Where the body that comes up the wires stands at the first frame, which is now."""
    body = wiring.upstream(node, "body")
    if body is None:
        return Matrix()
    source = placed_by(body)
    if body.source == pickers.OBJECT and source is not None:
        return _rigid(source.matrix_world)
    turned = Euler([math.radians(a) for a in body.parameter("rotation")], "XYZ").to_matrix().to_4x4()
    return Matrix.Translation(body.parameter("position")) @ turned


def _vertices(thing, depsgraph):
    """Vertices in the scene of a mesh or a curve with its modifiers; those of a curve follow it from end to end."""
    evaluated = thing.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        return [thing.matrix_world @ v.co for v in mesh.vertices] if mesh else []
    finally:
        evaluated.to_mesh_clear()


def mesh(node, depsgraph):
    """The geometry of a mesh node. One object keeps its own axes (scale in): a body may stand elsewhere."""
    found = mesh_objects(node)
    for thing in found:
        check_evaluated(thing, depsgraph, node)
    groups, maps = (wanted(node.id_data, node, of) for of in (pickers.group_parameters, pickers.map_parameters))
    parts = []
    for thing in found:
        own = placement(thing.matrix_world)[2] if node.source == pickers.OBJECT else thing.matrix_world
        try:
            part = mesh_export.geometry(thing, depsgraph, own, node.use_modifiers, groups, maps, with_layers=True)
            mesh_export.check(part, f"object '{thing.name}'")
        except core.Refused as error:
            raise core.Refused(str(error), node.graph_name) from error
        parts.append(part)
    for part, first in zip(parts, slot_offsets(found)):
        part.material += np.int32(first)
    return mesh_export.joined(parts)


def slot_offsets(found):
    """Where each object's materials begin in the list of all."""
    offsets, first = [], 0
    for thing in found:
        offsets.append(first)
        first += max(1, len(thing.material_slots))
    return offsets


def placed_by(node):
    """The object that a body was cut from; None if that is a collection, a file or a lattice."""
    source = wiring.upstream(node, "mesh_file")
    return source.object if source is not None and source.source == pickers.OBJECT else None


def body_placement(node):
    """Position and rotation of a body that stands as the object it was cut from."""
    source = placed_by(node)
    if source is None:
        return {}
    location, rotation, _ = placement(source.matrix_world)
    return {"position": vector(location), "rotation": degrees(rotation)}
