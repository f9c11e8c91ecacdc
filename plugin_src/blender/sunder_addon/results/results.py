"""Makes result objects: the mesh of a deformer, the moving twin of a rigid body's object."""
import types

import bpy
import numpy as np

from ..base import blender_versions, core, runtime
from ..tree import trees, wiring
from ..scene import mesh_export, scene_input
from . import interiors, parts, player, rest_coordinates

_NO_SLOT = types.SimpleNamespace(material=None)
_TAKEN_OVER = ("pass_index", "color", "is_holdout", "is_shadow_catcher", "visible_camera", "visible_diffuse", "visible_glossy",
               "visible_shadow", "visible_transmission", "visible_volume_scatter")


def _sources(deformer):
    """The objects that a deformer's body was cut from; empty for lattices and files."""
    mesh = wiring.upstream(deformer, "mesh_file")
    try:
        return scene_input.mesh_objects(mesh) if mesh and mesh.source != "VALUES" else []
    except core.Refused:
        return []


def _survey(sources, depsgraph):
    """(Area in the scene of the faces of each slot, m2, in the order of all slots; names of UV map and colour attribute: of
    the first source that has one)."""
    areas, uv_map, color_attribute = [], "", ""
    for source in sources:
        evaluated = source.evaluated_get(depsgraph)
        mesh = evaluated.to_mesh()
        mesh.transform(source.matrix_world)
        uvs, colors = mesh_export.render_uvs(mesh), mesh_export.render_colors(mesh)
        uv_map = uv_map or (uvs.name if uvs else "")
        color_attribute = color_attribute or (colors.name if colors else "")
        area, slot = np.empty(len(mesh.polygons), np.float32), np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("area", area)
        mesh.polygons.foreach_get("material_index", slot)
        evaluated.to_mesh_clear()
        last = max(0, len(source.material_slots) - 1)
        areas += list(np.bincount(np.minimum(slot, last), area, last + 1))
    return areas or [0], uv_map or "UVMap", color_attribute or "Color"


def take_over(thing, source):
    """What a source is to renders and scripts besides its mesh."""
    for name in _TAKEN_OVER:
        setattr(thing, name, getattr(source, name))
    for name in source.keys():
        if name in source.bl_rna.properties:  # no property of the artist's, but an add-on's
            continue
        thing[name] = source[name]
        try:
            thing.id_properties_ui(name).update_from(source.id_properties_ui(name))
        except TypeError:
            pass  # groups have no ranges


def _collections(source, scene):
    """The scene's collections that a source lies in; the scene's own if that is in none of them."""
    known = {scene.collection, *scene.collection.children_recursive}
    beside = [c for c in source.users_collection if c in known and not c.library and not c.override_library] if source else []
    return beside or [scene.collection]


def _link(thing, scene, tree, graph_name, source):
    thing.sunder.tree, thing.sunder.node = tree, graph_name
    for collection in _collections(source, scene):
        collection.objects.link(thing)
    player.lock_interface()


def _is_there(tree, graph_name):
    return any(o.sunder.node == graph_name for o in trees.result_objects(tree))


def add_mesh_result(deformer, scene):
    """A mesh object that plays a deformer: outer materials in the slots of its sources, then the interior one.
    For the rest it is what its first source is."""
    sources = _sources(deformer)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    if sources:
        mesh = bpy.data.meshes.new_from_object(sources[0].evaluated_get(depsgraph), depsgraph=depsgraph)
        mesh.transform(sources[0].matrix_world)
    else:
        mesh = bpy.data.meshes.new("result")
    mesh.materials.clear()
    outer = [slot.material for source in sources for slot in source.material_slots or (_NO_SLOT,)] or [None]
    areas, uv_map, color_attribute = _survey(sources, depsgraph)
    outer, interior = interiors.materials(deformer.id_data.preset, outer, areas, mesh)
    for material in (*outer, interior):
        mesh.materials.append(material)
    name = f"{sources[0].name} fractured" if sources else f"{deformer.id_data.name} {deformer.graph_name}"
    mesh.name = name
    thing = bpy.data.objects.new(name, mesh)
    thing.sunder.interior_slot = len(outer)
    thing.sunder.uv_map, thing.sunder.color_attribute = uv_map, color_attribute
    if sources:
        take_over(thing, sources[0])
    rest_coordinates.prepare(thing)
    _link(thing, scene, deformer.id_data, deformer.graph_name, sources[0] if sources else None)
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
        _link(thing, scene, node.id_data, graph_name, source)
        thing.matrix_world = source.matrix_world
        parts.count_as_moving(thing)
        made.append((source, thing))
    return made


def local_copy(thing):
    made = thing.copy()
    return made.make_local() if made.override_library is not None else made


def is_hidden(thing, name):
    """Whether a result is hidden by itself, and not for what was shared of it. name: hide_viewport or hide_render."""
    return getattr(thing, name) and not (name == "hide_render" and thing.sunder.stands_back)


def twin(thing, name, data=None):
    """A result's copy that plays nothing: where it stands now, with its modifiers, its own data, or `data`."""
    made, place = local_copy(thing), thing.matrix_world.copy()
    if data is not None:
        made.data = data
    elif made.data is not None and made.data.library is not None:
        made.data = made.data.copy()
    made.name = name
    made.sunder.tree, made.sunder.node = None, ""
    if made.sunder.preview != "OFF":
        made.sunder.preview = "OFF"
    made.animation_data_clear()
    made.constraints.clear()
    blender_versions.clear_light_collections(made)
    made.parent, made.parent_type = None, "OBJECT"
    made.delta_location, made.delta_rotation_euler, made.delta_scale = (0, 0, 0), (0, 0, 0), (1, 1, 1)
    made.delta_rotation_quaternion.identity()
    made.hide_render = is_hidden(thing, "hide_render")
    made.matrix_world = place
    return made


def player_of(thing, name, mesh):
    """A copy that plays what a result plays, into `mesh`; its materials are the mesh's."""
    made = twin(thing, name, mesh)
    made.sunder.tree, made.sunder.node = thing.sunder.tree, thing.sunder.node
    for slot in made.material_slots:
        slot.link = "DATA"
    rest_coordinates.prepare(made)
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
    for thing in trees.result_objects(tree):
        parts.count_as_moving(thing)
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
