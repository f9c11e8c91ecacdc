"""Reads what `sunder bake` wrote, with numpy alone: the manifest, mesh frames and state frames (docs/files.md). Compressed
frames need the system's libzstd besides."""
import ctypes
import json
import os
import urllib.parse

import numpy as np

_TYPES = {"char": "i1", "uchar": "u1", "short": "<i2", "ushort": "<u2", "int": "<i4", "uint": "<u4", "float": "<f4",
          "double": "<f8", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4",
          "uint32": "<u4", "float32": "<f4", "float64": "<f8"}


class BakeError(Exception):
    """A file is missing or is not what it should be; the text starts with its path."""


def _decompress(data, path):
    try:
        zstd = ctypes.CDLL("libzstd.so.1")
    except OSError as error:
        raise BakeError(f"{path}: is compressed, and libzstd is not there to read it; install libzstd1, "
                        "or unpack it with zstd -d") from error
    zstd.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    zstd.ZSTD_decompress.restype = ctypes.c_size_t
    size = zstd.ZSTD_getFrameContentSize(data, ctypes.c_size_t(len(data)))
    # Both errors are above 2^63. No frame of ours is packed a thousandfold: a damaged size shall not fill the memory.
    if size > 1000 * len(data):
        raise BakeError(f"{path}: is damaged: not a compressed frame")
    out = bytearray(size)
    room = (ctypes.c_char * size).from_buffer(out)
    got = zstd.ZSTD_decompress(room, ctypes.c_size_t(size), data, ctypes.c_size_t(len(data)))
    if zstd.ZSTD_isError(ctypes.c_size_t(got)) or got != size:
        raise BakeError(f"{path}: is damaged or cut off")
    del room
    return out


def read_ply(path):
    """Binary little-endian PLY, compressed where its name ends in .zst, as {element: structured array}; a list property of k entries is a (k,) field.

    Lists must have the same length in all rows of an element, as all that we write have.
    """
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise BakeError(f"{path}: {error.strerror}") from error
    if os.fspath(path).endswith(".zst"):
        data = _decompress(data, path)
    end = data.find(b"end_header\n")
    lines = data[:end].decode("ascii", "replace").split("\n") if end >= 0 else []
    if lines[:2] != ["ply", "format binary_little_endian 1.0"]:
        raise BakeError(f"{path}: not a binary little-endian PLY file")
    elements = []
    try:
        for words in map(str.split, lines[2:]):
            if words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
            elif words[:1] == ["property"]:
                types = [_TYPES[t] for t in (words[2:4] if words[1] == "list" else words[1:2])]
                elements[-1][2].append((types, words[1 + len(types) + (words[1] == "list")]))
    except (KeyError, IndexError, ValueError) as error:
        raise BakeError(f"{path}: its header is not understood") from error
    at = end + len(b"end_header\n")
    result = {}
    for name, count, properties in elements:
        row_type, counts = _row_type(data, at, count, properties)
        if at + count * row_type.itemsize > len(data):
            raise BakeError(f"{path}: ends within its {name} rows")
        rows = np.frombuffer(data, row_type, count, at)
        for field, length in counts.items():
            if np.any(rows[field] != length):
                raise BakeError(f"{path}: lists of different lengths in {name}")
        at += rows.nbytes
        result[name] = rows
    if at != len(data):
        raise BakeError(f"{path}: {len(data) - at} bytes too many")
    return result


class Layer:
    """name; domain: point, corner or face; kind: float, uv, color, weight (of a vertex group), int or bool; values: (n, width)
    of float32 or int32, a row each vertex, corner or face."""

    def __init__(self, name, domain, kind, values):
        self.name, self.domain, self.kind, self.values = name, domain, kind, values


def _layers(rows, domains):
    found = []
    for field in rows.dtype.names:
        prefix, colon, name = field.partition(":")
        domain, _, kind = prefix.partition("_")
        if not colon or domain not in domains or field.endswith(" count"):
            continue
        n = len(rows) * (3 if domain == "corner" else 1)
        values = np.ascontiguousarray(rows[field]).reshape(n, -1) if n else np.zeros((0, 1), np.float32)
        found.append(Layer(urllib.parse.unquote(name, errors="replace"), domain, kind, values))
    return found


class MeshFrame:
    """positions (v, 3) f32, vertex_fragment (v,), velocities and accelerations (v, 3) f32 or None, rest (v, 3) f32, in the mesh
    that was cut, or None; triangles (t, 3), corner_normals (3t, 3) f32, uvs (3t, 2) f32 or None, material and fragment (t,), hidden (t,)
    bool; interface (t,), rim (3t,) f32 and colors (3t, 4) f32 or None; whole numbers are int32. mesh_layers: what else the
    artist's mesh has, [Layer]. Of a part `whole_rest` is rest of all."""


def _list(rows, name, kind):
    """Entries of a list property (n, k). Taken as one block a row they come in a third of the time."""
    entries = rows.dtype[name]
    if entries.itemsize == 0 or entries.base != np.dtype(kind):
        return np.ascontiguousarray(rows[name], kind)
    block = np.dtype({"names": [name], "formats": [f"V{entries.itemsize}"], "offsets": [rows.dtype.fields[name][1]],
                      "itemsize": rows.dtype.itemsize})
    return np.ascontiguousarray(rows.view(block)[name]).view(entries.base).reshape(len(rows), *entries.shape)


def _rest(vertex):
    return np.stack([vertex["rest_" + n] for n in "xyz"], 1) if "rest_x" in vertex.dtype.names else None


def _part(vertex, face, corners, is_wanted):
    """Rows of the wanted triangles, of their vertices, and those by their new numbers."""
    corners = corners[is_wanted]
    is_used = np.zeros(len(vertex), bool)
    is_used[corners.ravel()] = True
    return vertex[is_used], face[is_wanted], (np.cumsum(is_used) - 1)[corners]


def read_mesh_frame(path, choose=None, needs_normals=True):
    """`choose`: (materials of triangles) -> which of them are wanted, bool; None: all, with every vertex.
    (Of the vertices that are left out `whole_rest` tells.) Normals that nobody needs are None."""
    ply, mesh = read_ply(path), MeshFrame()
    try:
        vertex, face = ply["vertex"], ply["face"]
        corners = _list(face, "vertex_indices", np.int32)
        if corners.size and (corners.min() < 0 or corners.max() >= len(vertex)):
            raise BakeError(f"{path}: a triangle names a vertex that is not there")
        mesh.whole_rest = _rest(vertex) if choose is not None else None
        if choose is not None:
            vertex, face, corners = _part(vertex, face, corners, choose(face["material"]))
        mesh.positions = np.stack([vertex["x"], vertex["y"], vertex["z"]], 1).astype(np.float32)
        mesh.vertex_fragment = np.ascontiguousarray(vertex["fragment"], np.int32)
        mesh.velocities, mesh.accelerations = (
            np.stack([vertex[p + n] for n in "xyz"], 1) if p + "x" in vertex.dtype.names else None for p in "va")
        mesh.rest = _rest(vertex)
        mesh.triangles = np.ascontiguousarray(corners, np.int32)
        mesh.corner_normals = _list(face, "corner_normals", np.float32).reshape(-1, 3) if needs_normals else None
        mesh.material, mesh.fragment = (np.ascontiguousarray(face[n], np.int32) for n in ("material", "fragment"))
        has_hidden = "hidden" in face.dtype.names  # constant topology: break surfaces that are not open yet
        mesh.hidden = face["hidden"] != 0 if has_hidden else np.zeros(len(face), bool)
        has_uvs = "texcoord" in face.dtype.names
        mesh.uvs = _list(face, "texcoord", np.float32).reshape(-1, 2) if has_uvs else None
        there = face.dtype.names
        mesh.interface = np.ascontiguousarray(face["interface"], np.int32) if "interface" in there else None
        mesh.rim = _list(face, "rim", np.float32).ravel() if "rim" in there else None
        has_colors = "corner_colors" in there
        mesh.colors = _list(face, "corner_colors", np.float32).reshape(-1, 4) if has_colors else None
        mesh.mesh_layers = _layers(vertex, ("point",)) + _layers(face, ("corner", "face"))
    except (KeyError, ValueError) as error:
        raise BakeError(f"{path}: not a mesh frame ({error})") from error
    return mesh


def interior_material(first):
    """The id of break surfaces, from the first frame of a bake."""
    return int(first.material[~first.hidden].max(initial=0)) + 1


def _row_type(data, at, count, properties):
    """numpy type of one row, list lengths taken from the first row, and {length field: length}."""
    fields, lengths = [], {}
    for types, name in properties:
        if len(types) == 1:
            fields.append((name, types[0]))
            continue
        count_type, entry_type = types
        offset = at + np.dtype(fields).itemsize
        whole = count > 0 and offset + np.dtype(count_type).itemsize <= len(data)
        length = int(np.frombuffer(data, count_type, 1, offset)[0]) if whole else 0
        lengths[name + " count"] = length
        fields += [(name + " count", count_type), (name, entry_type, (length,))]
    return np.dtype(fields), lengths


def scene_time(state):
    """(simulated frame, time scale) of a state that `read_ply` has read: keys of all but the scale are in simulated frames."""
    clock = state["clock"][0]
    if "simulated_frame" not in clock.dtype.names:
        return float(clock["frame"]), 1.0
    return float(clock["simulated_frame"]), float(clock["time_scale"])


def value_at(value, frame):
    """A number or list of numbers of a graph file at a frame, keys worked out; None for null."""
    if not isinstance(value, dict):
        return value
    keys = value["keys"]
    after = next((i for i, (at, _) in enumerate(keys) if at > frame), len(keys))
    if after in (0, len(keys)):
        return keys[min(after, len(keys) - 1)][1]
    (t0, v0), (t1, v1) = keys[after - 1], keys[after]
    if value.get("interpolation") == "step" or v0 is None or v1 is None:
        return v0
    share = (frame - t0) / (t1 - t0)
    return [a + (b - a) * share for a, b in zip(v0, v1)] if isinstance(v0, list) else v0 + (v1 - v0) * share


def body_of(nodes, wire):
    """The body node whose body comes along a wire ("@NODE.body"), through nodes that pass it on, of a graph file's nodes."""
    name = wire[1:].rsplit(".", 1)[0]
    while nodes[name]["type"] != "body":
        name = nodes[name]["body"][1:].rsplit(".", 1)[0]
    return name


class Bake:
    """A bake folder. `meshes` and `states` are path patterns with ####, `rigid_bodies` the graph's nodes in the
    solver's order, `colliders` its collider nodes, `frames` the numbers of the whole frames."""

    def __init__(self, folder):
        self.folder = folder
        path = os.path.join(folder, "manifest.json")
        try:
            with open(path, encoding="utf-8") as file:
                manifest = json.load(file)
            nodes = manifest["graph"]["nodes"]
            self.frames = [frame["frame"] for frame in manifest["frames"]]
        except OSError as error:
            raise BakeError(f"{path}: {error.strerror}") from error
        except (ValueError, KeyError, TypeError) as error:
            raise BakeError(f"{path}: not a manifest of a bake") from error
        def patterns(kind, default):
            return [n.get("path", default) + (".zst" if n.get("compression") == "zstd" else "")
                    for n in nodes.values() if n["type"] == kind]

        self.meshes = patterns("bake_mesh", "mesh/mesh.####.ply")
        self.states = patterns("bake_state", "state/sim.####.ply")
        solvers = [n for n in nodes.values() if n["type"] == "solver"]
        wires = solvers[0].get("rigid_bodies", []) if solvers else []
        self.rigid_bodies = [nodes[w[1:].split(".")[0]] for w in ([wires] if isinstance(wires, str) else wires)]
        self.colliders = [n for n in nodes.values() if n["type"] == "collider"]
        if not self.meshes or not self.frames:
            raise BakeError(f"{folder}: has no whole mesh frame")

    def path(self, pattern, frame):
        """The file of a frame: #### becomes the number, with zeros in front."""
        width = pattern.count("#")
        return os.path.join(self.folder, pattern.replace("#" * width, f"{frame:0{width}d}"))

    def mesh_frame(self, pattern, frame):
        """Positions (v, 3), triangles (t, 3), corner normals (3t, 3), material and fragment (t,) of one mesh."""
        mesh = read_mesh_frame(self.path(pattern, frame))
        return mesh.positions, mesh.triangles, mesh.corner_normals, mesh.material, mesh.fragment

    def interior_material(self, pattern):
        """The id of break surfaces: one more than the last outer one, and the first frame shows only outer ones."""
        return interior_material(read_mesh_frame(self.path(pattern, self.frames[0])))

    def rigid_body_poses(self, frame):
        """Position (n, 3) and quaternion w x y z (n, 4) of each rigid body."""
        if not self.states or not self.rigid_bodies:
            return np.zeros((0, 3)), np.zeros((0, 4))
        path = self.path(self.states[0], frame)
        rows = read_ply(path).get("rigid_body")
        if rows is None or len(rows) != len(self.rigid_bodies):
            raise BakeError(f"{path}: holds {0 if rows is None else len(rows)} rigid bodies, "
                            f"the graph {len(self.rigid_bodies)}")
        return (np.stack([rows[n] for n in ("x", "y", "z")], 1),
                np.stack([rows[n] for n in ("qw", "qx", "qy", "qz")], 1))

    def collider_pose(self, node, frame):
        """Position (m) and Euler angles XYZ (degrees) of a collider."""
        return [value_at(node.get(name, (0.0, 0.0, 0.0)), frame) for name in ("position", "rotation")]

    def edges_broken(self, frame):
        """How many edges broke in that frame; 0 for a bake without states."""
        return sum(len(read_ply(self.path(p, frame)).get("broken_edge", ())) for p in self.states)
