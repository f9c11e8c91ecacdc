"""A shot as an Alembic file, by Blender's own exporter, and objects that read it: mesh sequence and transform caches.

Blender writes at the first frame alone which faces have which material, and in an order of its own; and it takes no
attributes along but UV maps, velocities and colours of bytes. So outer and break surfaces are objects of their own, slots are
found out by looking, numbers travel as colours and vectors as UV maps (share_materials.py).
"""
import os
import re

import bpy
import numpy as np

from ..base import blender_versions, core
from ..bake import looks
from ..results import parts, player, rest_coordinates, result_mesh, results
from . import share_materials, share_motion

_SLOT = "sunder_slot_"
_BYTES = "BYTE_COLOR"


def _free_name(name):
    """One that stands in the file as it is, and that no object or mesh has."""
    plain, taken = re.sub(r"[^A-Za-z0-9_]", "_", name), {thing.name for thing in (*bpy.data.objects, *bpy.data.meshes)}
    return next(n for n in (plain, *(f"{plain}_{i}" for i in range(2, len(taken) + 3))) if n not in taken)


class _Piece:
    """A result object, or its outer or its break surfaces. `copy` is what is written, `materials` are those that its slots
    stand for, `made` is what reads it. `mesh`: what a copy that plays plays into, None for what does not."""

    def __init__(self, thing, motion, stage, mesh=None, part="", suffix=""):
        self.thing, self.motion, self.part, self.suffix = thing, motion, part, suffix
        self.is_mesh, self.materials, self.made = mesh is not None, [], None
        name = _free_name(thing.name + suffix)
        if self.is_mesh:
            self.copy = results.player_of(thing, name, mesh)
            known, slot = [s.material for s in thing.material_slots], thing.sunder.interior_slot
            self.materials = known[:slot] if part == "OUTSIDE" else known[slot:slot + 1]
            for modifier in self.copy.modifiers:
                _show_as_rendered(modifier)
            if _is_modified(thing) and thing.sunder.part == "ALL":
                _part(self.copy, part)
            else:
                self.copy.sunder.part = part
        else:
            self.copy = results.twin(thing, name)
        self.copy.hide_viewport = self.copy.hide_render = self.copy.hide_select = False  # what is written is selected
        motion.key_place(self.copy)
        motion.key_values(self.copy, chosen=share_motion.of_modifiers)
        stage.collection.objects.link(self.copy)

    @property
    def name(self):
        """Of what reads it."""
        return f"{self.thing.name} shared{self.suffix}"

    @property
    def form_path(self):
        return f"/{self.copy.name}"

    @property
    def mesh_path(self):
        return f"/{self.copy.name}/{self.copy.data.name}"


def _is_modified(thing):
    return any(modifier.name != rest_coordinates.MODIFIER for modifier in thing.modifiers)


def _show_as_rendered(modifier):
    """The exporter writes what renders show; what is looked at here is what viewports do."""
    modifier.show_viewport = modifier.show_render
    if hasattr(modifier, "render_levels"):
        modifier.levels = modifier.render_levels


def _part(copy, part):
    """Takes all faces out but outer or break surfaces, after what modifiers do to the whole. (Exact normals as Blender keeps
    them before 4.5 turn a little where faces go: other results are read by parts.) Where there are none one is left, without
    extent: of a mesh without faces the exporter leaves out layers, and later ones move to its frame."""
    group, into, out = blender_versions.new_geometry_nodes(f"Sunder {part}")

    def node(kind, **settings):
        made = group.nodes.new(kind)
        for name, value in settings.items():
            setattr(made, name, value)
        return made

    def math(operation, *values):
        made = node("ShaderNodeMath", operation=operation)
        for value, socket in zip(values, made.inputs):
            if isinstance(value, bpy.types.NodeSocket):
                group.links.new(value, socket)
            else:
                socket.default_value = value
        return made.outputs[0]

    is_inside = math("GREATER_THAN", node("GeometryNodeInputMaterialIndex").outputs[0], copy.sunder.interior_slot - 0.5)
    is_kept = is_inside if part == "INSIDE" else math("SUBTRACT", 1.0, is_inside)
    count = node("GeometryNodeAttributeStatistic", data_type="FLOAT", domain="FACE")
    group.links.new(into, count.inputs["Geometry"])
    group.links.new(is_kept, count.inputs["Attribute"])
    is_none = math("LESS_THAN", count.outputs["Max"], 0.5)
    is_first = math("LESS_THAN", node("GeometryNodeInputIndex").outputs[0], 0.5)
    taken_out = node("GeometryNodeDeleteGeometry", domain="FACE")
    shrunk = node("GeometryNodeScaleElements", domain="FACE")
    shrunk.inputs["Scale"].default_value = 0
    group.links.new(into, taken_out.inputs["Geometry"])
    group.links.new(math("LESS_THAN", math("MULTIPLY_ADD", is_none, is_first, is_kept), 0.5), taken_out.inputs["Selection"])
    group.links.new(taken_out.outputs[0], shrunk.inputs["Geometry"])
    group.links.new(is_none, shrunk.inputs["Selection"])
    group.links.new(shrunk.outputs[0], out)
    copy.modifiers.new("Part", "NODES").node_group = group


def _pieces(thing, motion, stage):
    if not parts.shows_mesh(thing):
        return [_Piece(thing, motion, stage)]
    kinds = [("OUTSIDE", ""), ("INSIDE", " inside")] if thing.sunder.part == "ALL" else [(thing.sunder.part, "")]
    return [_Piece(thing, motion, stage, _mesh(thing), part, suffix) for part, suffix in kinds]


def _mesh(thing):
    """One whose slots an exporter tells apart."""
    mesh = bpy.data.meshes.new(_free_name(thing.name))
    for i in range(max(len(thing.material_slots), 1)):
        name = f"{_SLOT}{i}"
        mesh.materials.append(bpy.data.materials.get((name, None)) or bpy.data.materials.new(name))
    return mesh


def make(things, frames, stage, shared, written, path):
    """Writes the file `written`, that will be `path`, in scene `stage`, and fills collection `shared`. A generator of frames;
    returns notes."""
    motions = yield from share_motion.sample(things, frames, stage)
    stage.collection.children.link(shared)
    pieces = [piece for thing in things for piece in _pieces(thing, motions[thing], stage)]
    read, vectors = _read_attributes(things), share_materials.vectors_read(things)
    adapter = share_materials.Adapter(vectors)
    for piece in pieces:
        piece.materials = [adapter.material(material) for material in piece.materials]
    carrier = _Carrier({p.copy.data.name: p.thing for p in pieces if p.is_mesh}, read, vectors)
    bpy.app.handlers.frame_change_post.append(carrier.on_frame)
    try:
        _export(pieces, frames, stage, written)
        if carrier.faults:
            raise core.Refused(carrier.faults[0])
        _see(stage, frames[0])
        slots = [_slots(p.copy, stage) for p in pieces]
        counts = {frame: _counts(pieces, "copy", stage, frame) for frame in (frames[-1], frames[0])}
    finally:
        bpy.app.handlers.frame_change_post.remove(carrier.on_frame)
    file = _open(written)
    for piece in pieces:
        stage.collection.objects.unlink(piece.copy)
        piece.made = _reader(piece, file, shared)
    for frame, wanted in counts.items():
        if _counts(pieces, "made", stage, frame) != wanted:
            raise core.Refused(f"{path} did not become whole (is there room for it?); nothing was kept")
    for piece, wanted in zip(pieces, slots):  # at the first frame, as they were looked at
        _assign(piece, wanted, stage)
    file.filepath, file.name = bpy.path.relpath(path), os.path.basename(path)
    empty = [p.thing.name for p, (_, faces) in zip([p for p in pieces if p.is_mesh], counts[frames[0]]) if not faces]
    return share_motion.notes(motions, is_cache=True) + _notes(pieces, carrier, read, empty)


def _export(pieces, frames, stage, written):
    layer = stage.view_layers[0]
    for piece in pieces:
        piece.copy.select_set(True, view_layer=layer)
    normals = any(p.is_mesh and p.thing.sunder.use_exact_normals for p in pieces)
    try:
        with bpy.context.temp_override(scene=stage, view_layer=layer):
            bpy.ops.wm.alembic_export(
                filepath=written, selected=True, flatten=True, start=frames[0], end=frames[-1], face_sets=True, vcolors=True,
                orcos=True, packuv=False, normals=normals, as_background_job=False)
    except RuntimeError as error:
        raise core.Refused(f"Blender's Alembic exporter: {str(error).strip()}") from error
    if not os.path.isfile(written):
        raise core.Refused("Blender's Alembic exporter wrote nothing: is there room, and may this folder be written?")


def _see(stage, frame):
    stage.frame_set(frame)
    stage.view_layers[0].update()


def _evaluated(thing, stage):
    return thing.evaluated_get(stage.view_layers[0].depsgraph)


def _counts(pieces, which, stage, frame):
    """Vertices and faces of each mesh's `copy`, or of what was `made` of it, at a frame."""
    _see(stage, frame)
    found = [_evaluated(getattr(piece, which), stage).data for piece in pieces if piece.is_mesh]
    return [(len(mesh.vertices), len(mesh.polygons)) for mesh in found]


def _slots(thing, stage):
    """Slot of each face; None of what has none."""
    if thing.type != "MESH":
        return None
    polygons = _evaluated(thing, stage).data.polygons
    found = np.empty(len(polygons), np.int32)
    polygons.foreach_get("material_index", found)
    return found


def _open(path):
    """A cache file; the operator that makes one leaves its settings at nothing, where Blender's importer sets these."""
    before = set(bpy.data.cache_files)
    bpy.ops.cachefile.open(filepath=path)
    file, = set(bpy.data.cache_files) - before
    file.scale, file.velocity_name, file.velocity_unit = 1.0, ".velocities", "SECOND"
    return file


def _reader(piece, file, shared):
    """The object that shows a piece of the file."""
    if piece.is_mesh:
        mesh = bpy.data.meshes.new(piece.name)
        for material in piece.materials or [None]:
            mesh.materials.append(material)
        blender_versions.let_normals_count(mesh)
        _name_colors(mesh, piece.copy.data.color_attributes)
        made = results.twin(piece.thing, piece.name, mesh)
        made.modifiers.clear()
        for slot in made.material_slots:
            slot.link = "DATA"
        modifier = made.modifiers.new("Shared", "MESH_SEQUENCE_CACHE")
        modifier.cache_file, modifier.object_path, modifier.use_vertex_interpolation = file, piece.mesh_path, True
    else:
        made = results.twin(piece.thing, piece.name)
    piece.motion.key_values(made, chosen=lambda path: not (piece.is_mesh and share_motion.of_modifiers(path)))
    placed = piece.motion.holder(made, shared)
    piece.motion.place(placed)
    if piece.motion.moves():
        constraint = placed.constraints.new("TRANSFORM_CACHE")
        constraint.cache_file, constraint.object_path = file, piece.form_path
    shared.objects.link(made)
    return made


def _name_colors(mesh, colors):
    """The colours that renders show where a material names none: the reader goes by the mesh that it fills."""
    index = colors.render_color_index
    if 0 <= index < len(colors):
        mesh.color_attributes.new(colors[index].name, _BYTES, colors[index].domain)
        mesh.color_attributes.render_color_index = 0


def _assign(piece, wanted, stage):
    """Slots in the order in which the file's reader numbers what it finds there: looked up face by face."""
    if len(piece.materials) < 2:
        return
    found = _slots(piece.made, stage)
    wanted = np.minimum(wanted, len(piece.materials) - 1)
    order = [int(wanted[found == i][0]) for i in range(found.max(initial=-1) + 1) if (found == i).any()]
    order += [i for i in range(len(piece.materials)) if i not in order]  # of slots without a face
    for at, i in enumerate(order):
        piece.made.data.materials[at] = piece.materials[i]


def _read_attributes(things):
    """Names of the attributes that the results' materials read."""
    materials = {s.material for thing in things for s in thing.material_slots if s.material}
    return {name for material in materials for name in looks.attributes_read(material)}


class _Carrier:
    """After each frame is written: makes colours, and the numbers that materials read, colours of bytes, and the vectors UV
    maps; and puts a triangle without extent where a mesh has none. `meshes`: {name: result that it shows}."""

    def __init__(self, meshes, read, vectors):
        self._meshes, self._read, self.vectors = meshes, read, vectors
        self.carried, self.clipped, self.faults = set(), set(), []

    def on_frame(self, *_):
        self.faults += [note for note in map(player.fault, self._meshes.values()) if note]
        meshes = {bpy.data.meshes[name]: thing.sunder.node for name, thing in self._meshes.items() if name in bpy.data.meshes}
        for mesh, node in meshes.items():
            if not len(mesh.polygons):  # as in _part
                beside = [m.vertices[0].co for m, n in meshes.items() if n == node and len(m.polygons)]
                point = np.float32(beside[0] if beside else (0, 0, 0))
                blender_versions.fill_with_triangles(mesh, np.tile(point, (3, 1)), np.int32([[0, 1, 2]]))
            share_materials.write_maps(mesh, self.vectors)
            for name, kind in [(a.name, a.data_type) for a in mesh.attributes]:
                if kind == "FLOAT_COLOR" or kind == "FLOAT" and name in self._read:
                    self._replace(mesh, name, kind)

    def _replace(self, mesh, name, kind):
        attribute, colors = mesh.attributes[name], mesh.color_attributes
        rendered = colors[colors.render_color_index].name if 0 <= colors.render_color_index < len(colors) else ""
        width, field = (4, "color") if kind == "FLOAT_COLOR" else (1, "value")
        values = np.empty(width * len(attribute.data), np.float32)
        attribute.data.foreach_get(field, values)
        values = values.reshape(-1, width)
        if values.size and (values.min() < 0 or values.max() > 1):
            self.clipped.add(name)
        if width == 1:
            values = np.concatenate([np.repeat(values, 3, 1), np.ones_like(values)], 1)
        values = values[_of_corners(mesh, attribute.domain)]
        mesh.attributes.remove(attribute)
        result_mesh.write_attribute(mesh, name, _BYTES, "CORNER", np.clip(values, 0, 1))
        if rendered in colors:
            colors.render_color_index = colors.find(rendered)
        self.carried.add(name)


def _of_corners(mesh, domain):
    """Row of a domain that each corner has; triangles have three."""
    if domain == "POINT":
        vertices = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertices)
        return vertices
    return np.arange(len(mesh.loops)) // (3 if domain == "FACE" else 1)


def _notes(pieces, carrier, read, empty):
    """What is not there as it is with Sunder."""
    held = carrier.carried | carrier.vectors | {"velocity"} | {m.name for p in pieces if p.is_mesh for m in p.copy.data.uv_layers}
    notes = []
    if read - held:
        notes.append(f"materials read what Alembic does not hold: {', '.join(sorted(read - held))} "
                     "(with Holds set to A Mesh a Frame it comes along)")
    if carrier.clipped:
        notes.append(f"numbers below 0 and above 1 are cut off in {', '.join(sorted(carrier.clipped))}")
    if empty:
        notes.append(f"modifiers leave no faces at the first frame, so that UV maps and attributes come too early: "
                     f"{', '.join(dict.fromkeys(empty))} (with Holds set to A Mesh a Frame they do not)")
    mixed = [p.thing.name for p in pieces if p.part == "OUTSIDE" and len(p.materials) > 1 and _is_modified(p.thing)]
    if mixed:
        notes.append(f"modifiers that make faces may mix up the outer materials of {', '.join(mixed)}")
    return notes
