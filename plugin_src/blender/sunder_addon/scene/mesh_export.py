"""Blender meshes as PLY files that the library reads: vertices as Blender numbers them, normals, UVs, colours, materials."""
import hashlib
import io
import os
import re

import numpy as np

from ..base import blender_versions, core
from . import mesh_layers

_MOST_SQUEEZED = 1e6  # largest scale over smallest: matrices have seven digits
_VERTEX = np.dtype([(n, "<f8") for n in "xyz"] + [(n, "<f4") for n in ("nx", "ny", "nz")])


class Geometry:
    """positions (v, 3) f64, corners (t, 3) int32, corner_normals (3t, 3) f32, uvs (3t, 2) f32 or None,
    colors (3t, 4) f32, linear, or None; material (t,) int32; groups {name: [vertex, ...]}; maps {name: (v,) f32};
    mesh_layers: what else it carries, a row each vertex, corner (3t) or triangle; order: how artists find it
    (mesh_layers.order)."""

    def __init__(self, positions, corners, corner_normals, uvs, colors, material, groups, maps, layers=(), order=None):
        self.positions, self.corners, self.corner_normals = positions, corners, corner_normals
        self.uvs, self.colors, self.material, self.groups, self.maps = uvs, colors, material, groups, maps
        self.mesh_layers, self.order = list(layers), order or {}


def _read(sequence, attribute, width, dtype):
    array = np.empty(len(sequence) * width, dtype)
    sequence.foreach_get(attribute, array)
    return array.reshape(-1, width) if width > 1 else array


def render_uvs(mesh):
    """The UV map that renders show, whichever is selected; None if there is none."""
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)


def render_colors(mesh):
    """The colour attribute that renders show where a material names none; None if there is none."""
    index = mesh.color_attributes.render_color_index
    return mesh.color_attributes[index] if 0 <= index < len(mesh.color_attributes) else None


def layer_uvs(layer):
    return _read(layer.data, "uv", 2, np.float32)


def layer_colors(layer):
    """(n, 4) f32 of a colour attribute's points or corners, linear whether it holds bytes or floats."""
    return _read(layer.data, "color", 4, np.float32)


def check_scale(thing, matrix):
    """Refuses an object without extent along an axis: it has no inside, and its normals no direction."""
    linear = np.array(matrix.to_3x3(), np.float64)
    if np.all(np.isfinite(linear)) and np.linalg.cond(linear) > _MOST_SQUEEZED:
        raise core.Refused(f"object '{thing.name}' is squeezed flat: its scale, or that of a parent, is 0 along an axis; "
                           "give it another one")


def vertex_numbers(thing, mesh, name):
    """(v,) f32 of a vertex group (0 outside) or of an attribute of `mesh`, colours by their mean; None if there is none."""
    if name in thing.vertex_groups:
        index = thing.vertex_groups[name].index
        return np.array([next((g.weight for g in v.groups if g.group == index), 0.0) for v in mesh.vertices], np.float32)
    attribute = mesh.attributes.get(name) if hasattr(mesh, "attributes") else None  # texts and curves have none
    if attribute is None or attribute.domain != "POINT":
        return None
    if attribute.data_type in ("FLOAT_COLOR", "BYTE_COLOR"):
        return layer_colors(attribute)[:, :3].mean(1)
    if attribute.data_type in ("FLOAT", "INT", "BOOLEAN"):
        kind = {"FLOAT": np.float32, "INT": np.int32, "BOOLEAN": bool}[attribute.data_type]
        return _read(attribute.data, "value", 1, kind).astype(np.float32)
    return None


def map_property(name):
    """What a map is called in the file, where names have neither blanks nor a meaning of their own."""
    clean = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return "map_" + clean + ("" if clean == name else "_" + content_hash(name.encode())[:6])


def geometry(thing, depsgraph, matrix, use_modifiers, group_names=(), map_names=(), with_layers=False):
    """An object's mesh, its vertices taken through `matrix`. Refuses maps that it has not, and what is squeezed flat."""
    check_scale(thing, matrix)
    source = thing.evaluated_get(depsgraph) if use_modifiers else thing
    mesh = source.to_mesh()
    try:
        mesh.calc_loop_triangles()
        local = _read(mesh.vertices, "co", 3, np.float32).astype(np.float64)
        linear = np.array(matrix.to_3x3(), np.float64)
        positions = local @ linear.T + np.array(matrix.translation, np.float64)
        corners = _read(mesh.loop_triangles, "vertices", 3, np.int32)
        loops = _read(mesh.loop_triangles, "loops", 3, np.int32)
        material = _read(mesh.loop_triangles, "material_index", 1, np.int32)
        normals = blender_versions.corner_normals(mesh).astype(np.float64) @ np.linalg.inv(linear)
        uv_map, colors = render_uvs(mesh), render_colors(mesh)
        if np.linalg.det(linear) < 0:  # a mirror turns the surface inside out
            corners, loops = corners[:, ::-1], loops[:, ::-1]
        length = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        flat = loops.ravel()
        painted = corners.ravel() if colors and colors.domain == "POINT" else flat
        indices = {g.name: g.index for g in thing.vertex_groups}
        groups = {name: [] for name in group_names if name in indices}
        if groups:
            for v in mesh.vertices:
                held = {g.group for g in v.groups if g.weight > 0}
                for name, members in groups.items():
                    if indices[name] in held:
                        members.append(v.index)
        maps = {name: vertex_numbers(thing, mesh, name) for name in map_names}
        for name, values in maps.items():
            if values is None:
                raise core.Refused(f"object '{thing.name}' has neither a vertex group nor a vertex attribute '{name}'")
        carried = mesh_layers.read(thing, mesh, uv_map, colors, use_modifiers) if with_layers else []
        rows = {"corner": flat, "face": _read(mesh.loop_triangles, "polygon_index", 1, np.int32)}
        for layer in carried:
            layer.values = layer.values[rows.get(layer.domain, slice(None))]
        return Geometry(positions, corners.astype(np.int32), (normals / length)[flat].astype(np.float32),
                        layer_uvs(uv_map)[flat] if uv_map else None, layer_colors(colors)[painted] if colors else None,
                        material, groups, maps, carried, mesh_layers.order(thing, mesh, uv_map, colors))
    finally:
        source.to_mesh_clear()


def _joined_corners(parts, field, missing):
    """A field of all corners, `missing` for parts that have it not; None if none has."""
    found = [getattr(g, field) for g in parts]
    if all(values is None for values in found):
        return None
    return np.concatenate([np.tile(np.float32(missing), (len(g.corner_normals), 1)) if values is None else values
                           for g, values in zip(parts, found)])


def _maps_of_other_names(g, order):
    """What renders show of a part, as layers where that is not called as in the whole."""
    shown = ("render_uv_map", "uv", g.uvs), ("render_color", "color", g.colors)
    return [mesh_layers.Layer(g.order[field], "corner", kind, values) for field, kind, values in shown
            if values is not None and g.order[field] != order[field]]


def joined(parts):
    """Several geometries as one; materials keep their slot numbers, offset so that parts do not share them."""
    if len(parts) == 1:
        return parts[0]
    offset = np.cumsum([0] + [len(g.positions) for g in parts[:-1]])
    order = mesh_layers.joined_order([g.order for g in parts])
    groups = {}
    for g, first in zip(parts, offset):
        for name, members in g.groups.items():
            groups.setdefault(name, []).extend(int(first) + m for m in members)
    return Geometry(
        np.concatenate([g.positions for g in parts]),
        np.concatenate([g.corners + np.int32(first) for g, first in zip(parts, offset)]),
        np.concatenate([g.corner_normals for g in parts]),
        _joined_corners(parts, "uvs", (0, 0)),
        _joined_corners(parts, "colors", (1, 1, 1, 1)),
        np.concatenate([g.material for g in parts]),
        groups,
        {name: np.concatenate([g.maps[name] for g in parts]) for name in parts[0].maps},
        mesh_layers.joined([g.mesh_layers + _maps_of_other_names(g, order) for g in parts],
                      [{"point": len(g.positions), "corner": 3 * len(g.corners), "face": len(g.corners)} for g in parts],
                      {order["render_uv_map"], order["render_color"]}),
        order,
    )


class _Column:
    """A layer in a file of `t` triangles; rows: (vertices or triangles, numbers)."""

    def __init__(self, layer, t):
        self.name = mesh_layers.property_name(layer)
        self.rows = layer.values.reshape(t, -1) if layer.domain == "corner" else layer.values
        kind, self.width = "int" if self.rows.dtype == np.int32 else "float", self.rows.shape[1]
        entry = "<i4" if kind == "int" else "<f4"
        self.fields = [(self.name, entry)] if self.width == 1 else [
            (self.name + " count", "u1"), (self.name, entry, self.width)]
        self.line = f"{'' if self.width == 1 else 'list uchar '}{kind} {self.name}"

    def fill(self, table, rows):
        if self.width > 1:
            table[self.name + " count"] = self.width
        table[self.name] = rows if self.width > 1 else rows[:, 0]


def ply_bytes(g):
    """The file: Blender's vertices first, which number the welded mesh, then one vertex a corner: normal, colour."""
    n, t = len(g.positions), len(g.corners)
    flat = g.corners.ravel()
    maps = {map_property(name): values for name, values in g.maps.items()}
    channels = () if g.colors is None else ("red", "green", "blue", "alpha")
    of_vertices, of_faces = ([_Column(l, t) for l in g.mesh_layers if (l.domain == "point") == is_of_vertices]
                             for is_of_vertices in (True, False))
    vertex = np.zeros(n + 3 * t, np.dtype(_VERTEX.descr + [(name, "<f4") for name in (*channels, *maps)]
                                          + [f for column in of_vertices for f in column.fields]))
    for axis, name in enumerate("xyz"):
        vertex[name] = np.concatenate([g.positions[:, axis], g.positions[flat, axis]])
        vertex["n" + name][n:] = g.corner_normals[:, axis]
    for k, name in enumerate(channels):
        vertex[name][n:] = g.colors[:, k]
    for name, values in maps.items():
        vertex[name] = np.concatenate([values, values[flat]])
    for column in of_vertices:
        column.fill(vertex, np.concatenate([column.rows, column.rows[flat]]))
    fields = [("count", "u1"), ("vertex_indices", "<i4", 3), ("material", "<i4")]
    lines = ["list uchar int vertex_indices", "int material"]
    if g.uvs is not None:
        fields += [("texcoords", "u1"), ("texcoord", "<f4", 6)]
        lines.append("list uchar float texcoord")
    face = np.zeros(t, np.dtype(fields + [f for column in of_faces for f in column.fields]))
    face["count"], face["material"] = 3, g.material
    face["vertex_indices"] = np.arange(n, n + 3 * t, dtype=np.int32).reshape(-1, 3)
    if g.uvs is not None:
        face["texcoords"], face["texcoord"] = 6, g.uvs.reshape(-1, 6)
    for column in of_faces:
        column.fill(face, column.rows)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertex)}"]
    header += [f"property double {n}" for n in "xyz"] + [f"property float {n}" for n in ("nx", "ny", "nz", *channels, *maps)]
    header += [f"property {column.line}" for column in of_vertices]
    lines += [column.line for column in of_faces]
    header += [f"element face {t}", *(f"property {line}" for line in lines), "end_header\n"]
    return "\n".join(header).encode() + vertex.tobytes() + face.tobytes()


def _welded(positions):
    """The first vertex of each place, in the order of places; and the place of each vertex."""
    _, first, inverse = np.unique(positions + 0.0, axis=0, return_index=True, return_inverse=True)
    return first, inverse.ravel()  # numpy 2.0 gives a column


def placed_vertices(thing, depsgraph, g, frame):
    """(v, 3) where the vertices of an object's mesh are in the scene now, as the library numbers those of `g`, which was
    read of it at another frame. Refuses another number of them, and what is not finite."""
    evaluated = thing.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        local = _read(mesh.vertices, "co", 3, np.float32).astype(np.float64)
    finally:
        evaluated.to_mesh_clear()
    if len(local) != len(g.positions):
        raise core.Refused(f"object '{thing.name}' has {len(local)} vertices at frame {frame}, and {len(g.positions)} where it "
                           "was cut: what it follows must keep their number (is Apply Modifiers on in the mesh node?)")
    matrix = np.array(evaluated.matrix_world, np.float64)
    placed = local @ matrix[:3, :3].T + matrix[:3, 3]
    if not np.isfinite(placed).all():
        bad = int(np.flatnonzero(~np.isfinite(placed).all(axis=1))[0])
        raise core.Refused(f"object '{thing.name}': vertex {bad} is not finite at frame {frame}")
    return placed[np.sort(_welded(g.positions)[0])]


def npy_bytes(frames):
    """A .npy file of some frames of vertices."""
    file = io.BytesIO()
    np.save(file, np.ascontiguousarray(np.stack(frames), "<f8"))
    return file.getvalue()


def welded_groups(g):
    """{name: [vertex]} as the library numbers them: vertices at one position are one, in the order of the file."""
    if not g.groups:
        return {}
    first, inverse = _welded(g.positions)
    number = np.empty(len(first), np.int64)
    number[np.argsort(first)] = np.arange(len(first))
    return {name: sorted({int(number[inverse[m]]) for m in members}) for name, members in g.groups.items()}


def content_hash(data):
    return hashlib.blake2b(data, digest_size=8).hexdigest()


def path_of(name, data, ending=".ply"):
    """Where a file that a bake reads lies, seen from the bake folder: another content has another name."""
    return f"inputs/{name}-{content_hash(data)}{ending}"


def write(folder, files):
    """Writes {path seen from `folder`: bytes}, each whole or not at all; what is there already stays."""
    for relative, data in files.items():
        path = os.path.join(folder, relative)
        if os.path.exists(path):
            continue
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path + ".part", "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(path + ".part", path)


def centroid(g):
    """Centre of the solid that the surface bounds; of its corners if it bounds none."""
    a, b, c = (g.positions[g.corners[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))  # six times the signed volume towards the origin
    if not abs(volume.sum()) > 0:
        return g.positions.mean(0)
    return ((a + b + c) * volume[:, None]).sum(0) / (4 * volume.sum())


def check(g, what):
    """Refuses what the library would refuse with a less telling place."""
    if len(g.corners) == 0:
        raise core.Refused(f"{what} has no faces (a curve or text needs depth: extrude or bevel it)")
    if not np.all(np.isfinite(g.positions)):
        raise core.Refused(f"{what} has a vertex whose position is no finite number")
