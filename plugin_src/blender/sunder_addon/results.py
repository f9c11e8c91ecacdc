"""Makes result objects: the mesh of a deformer, the moving twin of a rigid body's object."""
import types

import bpy

from . import core, interiors, player, runtime, scene_input, wiring

_NO_SLOT = types.SimpleNamespace(material=None)


def _sources(deformer):
    """The objects that a deformer's body was cut from; empty for lattices and files."""
    mesh = wiring.upstream(deformer, "mesh_file")
    try:
        return scene_input.mesh_objects(mesh) if mesh and mesh.source != "VALUES" else []
    except core.Refused:
        return []


def _link(thing, scene, tree, graph_name):
    thing.sunder.tree, thing.sunder.node = tree, graph_name
    scene.collection.objects.link(thing)
    # Without the lock Blender draws the viewport while a render's frame change writes meshes, and crashes.
    scene.render.use_lock_interface = True


def _is_there(tree, graph_name):
    return any(o.sunder.node == graph_name for o in player.result_objects(tree))


def add_mesh_result(deformer, scene):
    """A mesh object that plays a deformer: outer materials in the slots of its sources, then the interior one."""
    sources = _sources(deformer)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    if sources:
        mesh = bpy.data.meshes.new_from_object(sources[0].evaluated_get(depsgraph), depsgraph=depsgraph)
        mesh.transform(sources[0].matrix_world)
    else:
        mesh = bpy.data.meshes.new("result")
    layer = mesh.uv_layers.active
    mesh.materials.clear()
    outer = [slot.material for source in sources for slot in source.material_slots or (_NO_SLOT,)] or [None]
    outer, interior = interiors.materials(deformer.id_data.preset, outer)
    for material in (*outer, interior):
        mesh.materials.append(material)
    name = f"{sources[0].name} fractured" if sources else f"{deformer.id_data.name} {deformer.graph_name}"
    mesh.name = name
    thing = bpy.data.objects.new(name, mesh)
    thing.sunder.interior_slot = len(outer)
    thing.sunder.uv_map = layer.name if layer else "UVMap"
    _link(thing, scene, deformer.id_data, deformer.graph_name)
    return thing


def add_rigid_results(node, scene):
    """One object for each object of a rigid body node, sharing its data, that moves as simulated."""
    made = []
    for i, source in enumerate(scene_input.objects_of(node) if node.source != "VALUES" else ()):
        graph_name = node.graph_name if i == 0 else f"{node.graph_name}:{i + 1}"
        if _is_there(node.id_data, graph_name):
            continue
        thing = source.copy()  # with its modifiers, on the same data
        thing.name = f"{source.name} moving"
        thing.animation_data_clear()
        thing.constraints.clear()
        thing.parent, thing.hide_render = None, False
        _link(thing, scene, node.id_data, graph_name)
        thing.matrix_world = source.matrix_world
        made.append((source, thing))
    return made


def stand_back(source):
    """A source is hidden and not rendered: its result stands in its place. (The eye hides without turning off what
    modifiers and animation do.)"""
    source.hide_render = True
    if source.name in bpy.context.view_layer.objects:
        source.hide_set(True)


def add_missing(tree, scene):
    """Result objects for all deformers and rigid bodies that have none yet; their sources stand back."""
    made = []
    for node in wiring.needed(tree):
        if node.sunder_type == "deformer" and not _is_there(tree, node.graph_name):
            made.append(add_mesh_result(node, scene))
            for source in _sources(node):
                stand_back(source)
        if node.sunder_type == "rigid_body":
            for source, thing in add_rigid_results(node, scene):
                stand_back(source)
                made.append(thing)
    player.show_all(scene, tree)
    runtime.signatures.pop(tree.name_full, None)
    return made
