"""What a bake depends on, as one hash that needs no step through the frames: tells when a bake is out of date.

The bake itself compares the whole graph (bake_job.py); this is for marking, quick enough to follow edits.
"""
import hashlib
import json

import bpy
import numpy as np

from ..base import core, descriptions, runtime
from ..tree import conditions, keys, parameters, pickers, wiring
from ..scene import animation, field_input, mesh_export, mesh_layers, scene_input


def _mesh_hash(thing, use_modifiers, with_layers=False):
    """Of an object's geometry; of its sources where it deforms from frame to frame."""
    hashes = runtime.mesh_hashes.setdefault((thing.name, use_modifiers), {})
    if with_layers in hashes:
        return hashes[with_layers]
    deforms = use_modifiers and animation.is_deforming(thing)
    evaluate = use_modifiers and not deforms
    source = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()) if evaluate else thing
    mesh = source.to_mesh()
    digest = hashlib.blake2b(digest_size=8)
    for sequence, attribute, width, dtype in (
        (mesh.vertices, "co", 3, np.float32),
        (mesh.loops, "vertex_index", 1, np.int32),
        (mesh.polygons, "loop_total", 1, np.int32),
        (mesh.polygons, "material_index", 1, np.int32),
        (mesh.polygons, "use_smooth", 1, bool),
    ):
        array = np.empty(len(sequence) * width, dtype)
        sequence.foreach_get(attribute, array)
        digest.update(array.tobytes())
    uv_map, colors = mesh_export.render_uvs(mesh), mesh_export.render_colors(mesh)
    if uv_map:
        digest.update(mesh_export.layer_uvs(uv_map).tobytes())
    if colors:
        digest.update(mesh_export.layer_colors(colors).tobytes())
    if with_layers:
        for layer in mesh_layers.read(thing, mesh, uv_map, colors, use_modifiers):
            digest.update(mesh_layers.property_name(layer).encode() + layer.values.tobytes())
    source.to_mesh_clear()
    if deforms:
        for m in thing.modifiers:
            plain = [m.type] + [repr(getattr(m, p.identifier)) for p in m.bl_rna.properties if p.type != "POINTER"]
            digest.update(repr(plain).encode())
        digest.update(repr([animation.describe(thing), animation.describe(thing.data)]).encode())
    hashes[with_layers] = digest.hexdigest()
    return hashes[with_layers]


def _groups(node):
    """Vertices and weights of the groups, and numbers of the maps, that a node names."""
    held = []
    for name in pickers.group_parameters(node.sunder_type) + pickers.map_parameters(node.sunder_type):
        source = wiring.upstream(node, "mesh_file") if conditions.counts(node, name) else None
        for thing in scene_input.mesh_objects(source) if source is not None and source.source != pickers.VALUES else ():
            values = mesh_export.vertex_numbers(thing, thing.data, getattr(node, name))
            if values is not None:
                held.append(hashlib.blake2b(values.tobytes(), digest_size=8).hexdigest())
    return held


def _points(node):
    """Where lists of points come from."""
    described = []
    for name in pickers.points_parameters(node.sunder_type):
        if not conditions.counts(node, name):
            continue
        if getattr(node, name + "_source") == pickers.VALUES:
            described.append(getattr(node, name + "_values"))
        for thing in scene_input.points_objects(node, name):
            described.append(animation.describe_motion(thing))
            if thing.type in ("MESH", "CURVE"):
                described.append(_mesh_hash(thing, True))
    return described


def _objects(node):
    described = _groups(node) + _points(node)
    if node.sunder_type == "follow" and node.from_object or node.sunder_type == "pin" and pickers.takes_vertices(node):
        is_another = node.sunder_type == "pin" and pickers.goes_with_another(node)
        thing = node.motion_object if is_another else scene_input.placed_by(node)
        if is_another:
            described.append(_mesh_hash(thing, True))
        described += [True] if thing is None else [animation.describe_motion(thing), *animation.describe_deformation(thing)]
    if not pickers.has_source(node):
        return described
    if node.sunder_type == "pin" and node.motion_object and node.motion == "transform":
        described.append(animation.describe_motion(node.motion_object))
    uses_objects = node.source != pickers.VALUES and hasattr(node, "object")
    if not uses_objects or pickers.region(node) not in ("box", "sphere"):
        return described
    for thing in scene_input.objects_of(node):
        described.append(animation.describe_motion(thing))
        if node.sunder_type in pickers.FIELDS:
            described.append(field_input.described(thing))
        elif node.sunder_type == "blast":
            continue
        elif node.sunder_type == "mesh_file":
            described.append(_mesh_hash(thing, node.use_modifiers, with_layers=True))
        elif thing.type in pickers.SURFACES:
            described.append(_mesh_hash(thing, True))
            if node.sunder_type == "collider" and pickers.takes_vertices(node):
                described += animation.describe_deformation(thing)
        else:
            described.append(getattr(thing, "empty_display_size", 0))
    return described


def _settings(tree, scene):
    """What a bake depends on that changes without an event of Blender's."""
    plain = scene.render.fps / scene.render.fps_base, tree.frames(scene)[0]
    return plain if tree.subframes == 1 else (*plain, tree.subframes)


def _compute(tree, scene):
    animated = keys.animated_attributes(tree)
    nodes = []
    for node in wiring.needed(tree):
        values = [
            None if parameters.attribute(p["name"]) in animated.get(node.name, ()) else parameters.value(p, node)
            for p in descriptions.parameters(node.sunder_type)
            if p["type"] not in parameters.NO_FIELD and conditions.counts(node, p["name"])
        ]
        wires = [[name, [(n.graph_name, output) for n, output in found]] for name, found in wiring.inputs(node)]
        own = [getattr(node, "source", ""), getattr(node, "use_modifiers", ""), pickers.uses_motion(node)]
        nodes.append([node.graph_name, node.sunder_type, values, wires, own, _objects(node)])
    # Paths of curves hold node names, which may change without changing anything.
    curves = [[c[1:] for c in group] if group and isinstance(group[0], list) else group
              for group in animation.describe(tree)]
    text = json.dumps([_settings(tree, scene), nodes, curves], default=list)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def signature(tree, scene):
    """Of the tree as it stands; empty while it cannot be baked (nothing picked, nothing wired)."""
    found = known(tree, scene)
    if found is None:
        try:
            found = _compute(tree, scene)
        except core.Refused:
            found = ""
        runtime.signatures[tree.name_full] = (_settings(tree, scene), found)
    return found


def known(tree, scene):
    """The same as far as it is known without work; None if something may have changed."""
    settings, found = runtime.signatures.get(tree.name_full, (None, None))
    return found if settings == _settings(tree, scene) else None
