"""Result objects: which bake they play, and what they show at a frame. Reads files alone; needs no library."""
import os

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty
from mathutils import Matrix, Quaternion, Vector

from ..base import bake_reader, blender_versions, runtime
from ..tree import trees
from ..scene import mesh_layers
from ..bake import cache
from . import rest_coordinates, result_mesh

SHOWN = "sunder_shown"  # on the mesh, so that undo and files carry it along
# From so many on, exact normals wait until playing stops, where they take several times as long as the rest.
PLAYED_FACES = np.inf if blender_versions.HAS_QUICK_NORMALS else 20_000
PARTS = [
    ("ALL", "Whole", "The mesh as simulated"),
    ("OUTSIDE", "Outer Surface", "Without break surfaces"),
    ("INSIDE", "Break Surfaces", "Break surfaces alone"),
]
PREVIEWS = [
    ("OFF", "Mesh", "The mesh itself"),
    ("PIECES", "Pieces", "Every piece that hangs together in a colour of its own; break surfaces darker"),
    ("STRAIN", "Strain", "Elastic stretch or squeeze (principal logarithmic strain): cold is none, hot is the limit"),
    ("TOUGHNESS", "Toughness Left", "How close to breaking: green is unloaded, red is about to tear"),
    ("EDGES", "Edges", "What joins fragments, by what broke, by strength or by load"),
    ("SIMULATION", "Simulation Mesh", "The particles as ellipsoids, and the edges between them"),
]
EDGE_COLORS = [
    ("BREAKS", "What Broke", "What holds (grey), what broke before (red) and in this frame (yellow)"),
    ("STRENGTH", "Strength", "Toughness with all that was made of it, over the body's: red is weak, grey as it was, blue tough, violet never "
     "breaks"),
    ("LOAD", "Load", "Strain over toughness: cold is none, hot is about to break"),
]
_interiors = {}  # (folder, hash of the first frame's file): material number of break surfaces


def _switched(self, context):
    """The preview stands in for the object, of which Blender then draws its bounding box alone."""
    thing = self.id_data
    if self.preview != "OFF":
        if thing.display_type != "BOUNDS":
            self.display_before, thing.display_type = thing.display_type, "BOUNDS"
        return
    thing.display_type = self.display_before or "TEXTURED"
    show_all(context.scene)


class SunderObject(bpy.types.PropertyGroup):
    """What a result object plays."""

    tree: PointerProperty(type=bpy.types.NodeTree, name="Tree", description="The Sunder tree whose bake is played",
                          poll=lambda _self, tree: trees.is_tree(tree))
    node: StringProperty(name="Node", description="Graph name of the deformer or rigid body that is played")
    interior_slot: IntProperty(name="Interior Slot", description="Material slot of break surfaces, from 0", min=0,
                               options=set())
    uv_map: StringProperty(name="UV Map", description="Name of the UV map that is written", default="UVMap")
    color_attribute: StringProperty(name="Color Attribute", description="Name of the colour attribute that is written",
                                    default="Color")
    use_exact_normals: BoolProperty(
        name="Exact Normals", default=True, options=set(),
        description="Smooth outside and sharp at breaks, as simulated. Off: plays faster, shades across breaks",
    )
    part: EnumProperty(name="Shows", items=PARTS, default="ALL", options={"HIDDEN"},
                       description="Which faces: an object of one material is what every exporter keeps")
    preview: EnumProperty(
        name="Preview", items=PREVIEWS, default="OFF", options=set(), update=_switched,
        description="What viewports show. Previews are drawn by the graphics card and play faster than the mesh, which "
        "follows when the frame rests; renders show the mesh always",
    )
    preview_limit: FloatProperty(
        name="Hottest", description="Strain of the hottest colour; 0: the strain at which the body tears", default=0,
        min=0, soft_max=1, precision=3, options=set(),
    )
    edges_as: EnumProperty(name="Edges", items=EDGE_COLORS, default="BREAKS", options=set(), description="What colours of edges tell")
    display_before: StringProperty(options={"HIDDEN"})
    stands_back: BoolProperty(options={"HIDDEN"}, description="Whether it is hidden in renders for what was shared of it")


class SunderTreeUse(bpy.types.PropertyGroup):
    """A tree whose keys and drivers the scene evaluates."""

    tree: PointerProperty(type=bpy.types.NodeTree)


def show(thing, frame, is_playing=False, after=0.0):
    """Makes a result object show a frame, or the last baked one before it. Throws nothing: notes tell. `after`: seconds from
    that frame to the time that is asked for, through which everything goes on as it moves.

    Returns whether its exact normals were left out, because it is only played by.
    """
    is_draft = False
    tree, name = thing.sunder.tree, thing.sunder.node
    key = (tree.name_full, name.split(":")[0])
    folder = cache.folder(tree)
    manifest = cache.manifest(folder)
    shown = manifest.shown(frame) if manifest else None
    if shown is None:
        home = bpy.path.basename(tree.library.filepath) if tree.library else ""
        runtime.node_notes[key] = f"no bake lies beside {home}: copy its {cache.FOLDER} there" if home else "nothing baked yet"
        return False
    at, after = _moment(manifest, name, shown, after if shown == frame else 0.0)
    try:
        if thing.mode != "OBJECT":
            raise bake_reader.BakeError(f"object '{thing.name}' is in {thing.mode.lower().replace('_', ' ')} mode")
        if name in manifest.graph["nodes"] and manifest.graph["nodes"][name]["type"] == "rigid_body":
            _show_rigid_body(thing, folder, manifest, at, after)
        else:
            is_draft = _show_mesh(thing, folder, manifest, at, is_playing, after)
    except bake_reader.BakeError as error:
        runtime.node_notes[key] = f"frame {shown} cannot be shown: {error}"
        return False
    except Exception as error:
        runtime.node_notes[key] = f"frame {shown} cannot be shown: {runtime.fault(error)}"
        return False
    first, last = manifest.numbers[0], manifest.numbers[-1]
    note = f"baked {first} to {last}"
    if last < manifest.interval[1]:
        note += f" of {manifest.interval[1]}"
    runtime.node_notes[key] = note + (f"; frame {frame} shows {shown}" if shown != frame else "")
    return is_draft


def _moment(manifest, name, frame, after):
    """What is baked next to `after` seconds from a frame, and how long after it that is. A mesh whose faces change stays that of
    the whole frame: renderers blur nothing whose vertices are others from one end of the shutter to the other."""
    if not after or len(manifest.frames) == len(manifest.numbers):
        return frame, after
    if manifest.graph["nodes"].get(name, {}).get("topology") == "compact":
        return frame, after
    rate = manifest.graph["frame_rate"]
    rate = rate[0] / rate[1] if isinstance(rate, list) else rate
    at = frame + after * rate
    nearest = manifest.nearest(at)
    return nearest, (at - nearest) / rate if abs(at - nearest) > 1e-6 else 0.0


def fault(thing):
    """Why a result could not be shown when it was last asked for; empty if it was."""
    note = runtime.node_notes.get((thing.sunder.tree.name_full, thing.sunder.node.split(":")[0]), "")
    return note if "cannot be shown" in note else ""


def _file(folder, manifest, frame, node):
    name = f"{node}:bake"
    path = manifest.frames[frame].get(name)
    if path is None:
        raise bake_reader.BakeError(f"the bake has nothing of node '{node}'")
    return os.path.join(folder, path), manifest.hashes[frame][name]


def _solver_of(manifest, node):
    return manifest.graph["nodes"][node]["state"][1:].rsplit(".", 1)[0]


def state_file(folder, manifest, frame, node):
    """Path and hash of the state that a deformer's mesh was made from."""
    _file(folder, manifest, frame, node)  # refuses what is no deformer of this bake
    return _file(folder, manifest, frame, _solver_of(manifest, node))


def _interior_material(folder, manifest, node):
    """The number of break surfaces."""
    path, stamp = _file(folder, manifest, manifest.numbers[0], node)
    if (folder, stamp) not in _interiors:
        _interiors[folder, stamp] = bake_reader.interior_material(bake_reader.read_mesh_frame(path))
    return _interiors[folder, stamp]


def _show_mesh(thing, folder, manifest, shown, is_playing, after):
    node, mesh = thing.sunder.node, thing.data
    path, content = _file(folder, manifest, shown, node)
    part = thing.sunder.part
    key = f"{node} {content} {thing.sunder.use_exact_normals} {thing.sunder.interior_slot}"
    key += (f" {part}" if part != "ALL" else "") + (f" {after}" if after else "")
    is_whole = rest_coordinates.is_whole(mesh)
    if mesh.get(SHOWN) == key and is_whole:
        return False
    interior = _interior_material(folder, manifest, node)
    choose = {"OUTSIDE": lambda material: material < interior, "INSIDE": lambda material: material >= interior}.get(part)
    frame = bake_reader.read_mesh_frame(path, choose, thing.sunder.use_exact_normals)
    attributes = _attributes(folder, manifest, shown, node, frame)
    if after:
        frame.positions = frame.positions + np.float32(after) * attributes["velocity"][1]
        if frame.accelerations is not None:
            frame.positions += np.float32(after * after / 2) * frame.accelerations
    result_mesh.set_property(mesh, SHOWN, "")  # until all is written
    rest = cache.note(folder).get("rest_coordinates", {}).get(node, {})
    order = cache.note(folder).get("mesh_layers", {}).get(node, {})
    names = thing.sunder.uv_map, thing.sunder.color_attribute, *([order] if order else [])
    stamp = result_mesh.face_stamp(frame, content, part, *names, interior, thing.sunder.interior_slot, rest,
                                   mesh_name=mesh.name_full)
    is_written = is_whole and (thing.sunder.use_exact_normals or not blender_versions.keeps_corner_normals(mesh))
    is_draft = is_playing and thing.sunder.use_exact_normals and len(frame.triangles) >= PLAYED_FACES
    with result_mesh.written(mesh) as target:
        has_new_faces = result_mesh.write_geometry(target, frame, stamp if is_written else "")
        if has_new_faces:
            _write_faces(thing, target, frame, interior, order)
            if target != mesh and thing.vertex_groups:
                names = [group.name for group in thing.vertex_groups]
                mesh_layers.write_linked_groups(names, result_mesh.stage_object(target), frame.mesh_layers)
            at_rest = rest_coordinates.write(target, frame.rest, rest)
        for name, (kind, values) in attributes.items():
            result_mesh.write_attribute(target, name, kind, "POINT", values)
        if not is_draft:
            result_mesh.write_normals(target, frame.corner_normals)
    if has_new_faces:
        if result_mesh.is_local(mesh):
            mesh_layers.write_groups(thing, frame.mesh_layers, order)
        rest_coordinates.write_texture_space(mesh, at_rest, rest, frame.whole_rest)
        result_mesh.set_property(mesh, result_mesh.FACES, stamp)
    if not is_draft:  # else it is not marked as shown: it is written again once the frame rests
        result_mesh.set_property(mesh, SHOWN, key)
    return is_draft


def _write_faces(thing, mesh, frame, interior, order):
    """What faces and corners have besides normals, and all that the source's mesh carries."""
    uv_map, color = mesh_layers.render_names(frame.mesh_layers, order, thing.sunder.uv_map, thing.sunder.color_attribute)
    mesh_layers.write_uv_maps(result_mesh.write_uvs, mesh, frame.uvs, uv_map, frame.mesh_layers, order)
    result_mesh.write_materials(mesh, frame.material, interior, thing.sunder.interior_slot)
    for name, kind, domain, values in (
        ("fragment", "INT", "FACE", frame.fragment), ("interior", "BOOLEAN", "FACE", frame.material >= interior),
        ("hidden", "BOOLEAN", "FACE", frame.hidden), ("interface", "INT", "FACE", frame.interface),
        ("rim", "FLOAT", "CORNER", frame.rim),
        (color, "FLOAT_COLOR", "CORNER", frame.colors),
    ):
        if values is not None:
            result_mesh.write_attribute(mesh, name, kind, domain, values)
    mesh_layers.write_attributes(result_mesh.write_attribute, mesh, color, frame.mesh_layers, order)


def _attributes(folder, manifest, shown, node, frame):
    graph = manifest.graph["nodes"]
    solver, body = _solver_of(manifest, node), graph[node]["body"]
    path, _ = _file(folder, manifest, shown, solver)
    state = bake_reader.read_ply(path)
    bodies, name = graph[solver]["bodies"], bake_reader.body_of(graph, body)
    toughness = bake_reader.value_at(graph[name].get("toughness"), bake_reader.scene_time(state)[0])
    index = [bake_reader.body_of(graph, b) for b in ([bodies] if isinstance(bodies, str) else bodies)].index(name)
    if "strength" in state:  # where it differs within bodies
        toughness = state["strength"]["toughness"][state["particle"]["body"] == index]
    elif toughness is not None and (noted := cache.note(folder).get("toughness_factors", {}).get(name)):
        toughness = toughness * _noted_factors(state, index, noted)
    return result_mesh.state_attributes(state, index, frame, toughness)


def _noted_factors(state, body, noted):
    """Of each particle of a body, from what was noted beside bakes before states held `strength`, {"fragment", "edge"}: factors,
    None for infinite: the particle's own times that of the weakest edge that holds there."""
    of_fragment, of_edge = (np.array([np.inf if f is None else f for f in noted[n]]) for n in ("fragment", "edge"))
    mine, edge = np.flatnonzero(state["particle"]["body"] == body), state["edge"]
    edge = edge[np.isin(edge["a"], mine)]
    holds = edge["intact"] != 0
    if "inactive" in state:  # what is glued at the frame
        glued = (state["inactive"]["what"] & 4) != 0
        of_edge = np.where(glued[edge["a"]] | glued[edge["b"]], np.inf, of_edge)
    weakest = np.full(len(state["particle"]), np.inf)
    for end in "ab":
        np.minimum.at(weakest, edge[end][holds], of_edge[holds])
    weakest[~np.isin(np.arange(len(weakest)), (edge["a"][holds], edge["b"][holds]))] = 1
    return of_fragment[state["particle"]["fragment"][mine]] * weakest[mine]


def _show_rigid_body(thing, folder, manifest, shown, after):
    name = thing.sunder.node
    for solver, fields in manifest.graph["nodes"].items():
        wires = fields.get("rigid_bodies", [])
        wires = [wires] if isinstance(wires, str) else wires
        if f"@{name}.rigid_body" in wires:
            break
    else:
        raise bake_reader.BakeError(f"no solver moves rigid body '{name}'")
    index = wires.index(f"@{name}.rigid_body")
    start, now = (_pose(folder, manifest, f, solver, index, t) for f, t in ((manifest.numbers[0], 0.0), (shown, after)))
    rest = cache.note(folder).get("rest_matrices", {}).get(name)
    at_start = Matrix(rest) if rest else start
    result_mesh.set_property(thing, "matrix_world", now @ start.inverted() @ at_start)


def _pose(folder, manifest, frame, solver, index, after):
    """Place and rotation `after` seconds of the motion that a rigid body has at a frame."""
    path, _ = _file(folder, manifest, frame, solver)
    state = bake_reader.read_ply(path)
    row = state["rigid_body"][index]
    after *= bake_reader.scene_time(state)[1]  # velocities are of simulated time
    center, velocity, spin = (Vector([float(row[p + n]) for n in "xyz"]) for p in ("", "v", "w"))
    turned = Quaternion([float(row["q" + n]) for n in "wxyz"])
    if spin.length:
        turned = Quaternion(spin, spin.length * after) @ turned
    return Matrix.Translation(center + after * velocity) @ turned.to_matrix().to_4x4()


def nearest_frame(scene):
    """Motion blur asks for times between frames: the frame they belong to, whose velocities lead there."""
    return int(np.floor(scene.frame_current_final + 0.5))


def _is_shown(thing, scene, graphs):
    """Whether a scene shows an object, or nothing tells that it does not."""
    scenes = thing.users_scene  # none: it is there as part of an instanced collection
    return not scenes or scene in scenes or any(thing.evaluated_get(graph).is_evaluated for graph in graphs)


def shown_objects(scene, tree):
    """The tree's result objects that are in a scene, or in what it instances."""
    graphs = [layer.depsgraph for layer in scene.view_layers if layer.depsgraph]
    return [thing for thing in trees.result_objects(tree)
            if scene in thing.users_scene or any(thing.evaluated_get(graph).is_evaluated for graph in graphs)]


def show_all(scene, tree=None, skip_previewed=False, is_playing=False, depsgraph=None):
    """All result objects at the scene's frame but those of other scenes; meshes that two share are written once.

    `depsgraph`: what is evaluated for the scene now. Blender evaluates one scene at a time, also where strips in the
    sequencer show several in one picture, so that a mesh that all of them share is right in each.

    Returns whether some were skipped, because viewports show a preview in their place, or have no exact normals yet.
    """
    frame, is_late = nearest_frame(scene), False
    after = (scene.frame_current_final - frame) * scene.render.fps_base / scene.render.fps
    graphs = [depsgraph] if depsgraph else [layer.depsgraph for layer in scene.view_layers if layer.depsgraph]
    for thing in trees.result_objects(tree):
        if not _is_shown(thing, scene, graphs):
            continue
        if skip_previewed and thing.sunder.preview != "OFF":
            is_late = True
        else:
            is_late |= show(thing, frame, is_playing, after)
            if thing.animation_data:
                # Its mesh is new, so that a render's copy of it is made anew, from what keys have not been written to.
                thing.update_tag(refresh={"TIME"})
    return is_late


def lock_interface():
    """Without the lock Blender draws the viewport while a render's frame change writes meshes, and crashes. Any scene may
    show results: by an instanced collection, or by a strip in its sequencer."""
    for scene in bpy.data.scenes:
        scene.render.use_lock_interface = True


classes = [SunderObject, SunderTreeUse]


def register():
    bpy.types.Object.sunder = PointerProperty(type=SunderObject)
    bpy.types.Scene.sunder_trees = CollectionProperty(type=SunderTreeUse)


def unregister():
    del bpy.types.Scene.sunder_trees
    del bpy.types.Object.sunder
