"""A bake of one frame pair written by hand: a cube, whole at frame 1, in two halves at frame 2 (docs/files.md)."""
import json
from pathlib import Path

import numpy as np

# A unit half-cube: 8 corners, 12 triangles; the first two triangles are its +X face.
CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
TRIANGLES = np.array([(4, 6, 7), (4, 7, 5), (0, 1, 3), (0, 3, 2), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6),
                      (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)], np.int32)
VERTEX = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("fragment", "<i4")])
FACE = np.dtype([("n", "u1"), ("vertex_indices", "<i4", 3), ("material", "<i4"), ("fragment", "<i4"),
                 ("t", "u1"), ("texcoord", "<f4", 6), ("c", "u1"), ("corner_normals", "<f4", 9)])
RIGID_BODY = np.dtype([(name, "<f8") for name in "x y z qw qx qy qz vx vy vz wx wy wz".split()])


def header(*elements):
    lines = ["ply", "format binary_little_endian 1.0", "comment sunder"]
    for name, rows, properties in elements:
        lines += [f"element {name} {len(rows)}", *(f"property {p}" for p in properties)]
    return ("\n".join(lines) + "\nend_header\n").encode()


def write_mesh_frame(path, gap):
    """Two halves of a cube, `gap` metres apart along x; with a gap the faces between them are there."""
    positions, triangles, materials, fragments = [], [], [], []
    for fragment, mirror in ((0, -1), (1, 1)):
        corners = CORNERS * (mirror, 1, 1) * (0.5, 1, 1) + (mirror * gap / 2, -0.5, 0)
        faces = TRIANGLES if mirror == 1 else TRIANGLES[:, ::-1]
        inside = np.isin(np.arange(len(faces)), (2, 3))  # x = 0
        kept = faces if gap else faces[~inside]
        triangles.append(kept + 8 * fragment)
        materials.append(inside.astype(int) if gap else np.zeros(len(kept), int))
        fragments.append(np.full(len(kept), fragment))
        positions.append(corners)
    positions, triangles = np.concatenate(positions), np.concatenate(triangles)
    vertex, face = np.zeros(len(positions), VERTEX), np.zeros(len(triangles), FACE)
    vertex["x"], vertex["y"], vertex["z"] = positions.T
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    face["n"], face["t"], face["c"] = 3, 6, 9
    face["vertex_indices"], face["corner_normals"] = triangles, np.tile(normals, 3)
    face["material"], face["fragment"] = np.concatenate(materials), np.concatenate(fragments)
    path.write_bytes(header(
        ("vertex", vertex, ["float x", "float y", "float z", "int fragment"]),
        ("face", face, ["list uchar int vertex_indices", "int material", "int fragment", "list uchar float texcoord",
                        "list uchar float corner_normals"])) + vertex.tobytes() + face.tobytes())


def write_state_frame(path, height):
    row = np.zeros(1, RIGID_BODY)
    row["x"], row["z"], row["qw"] = 1.5, height, 1
    path.write_bytes(header(("rigid_body", row, [f"double {n}" for n in RIGID_BODY.names])) + row.tobytes())


def write(folder):
    folder = Path(folder)
    for name in ("mesh", "state"):
        (folder / name).mkdir(parents=True)
    for frame, gap in ((1, 0.0), (2, 1.0)):
        write_mesh_frame(folder / f"mesh/cube.{frame:04d}.ply", gap)
        write_state_frame(folder / f"state/sim.{frame:04d}.ply", 0.4)
    (folder / "manifest.json").write_text(json.dumps({"frames": [{"frame": 1}, {"frame": 2}], "graph": {"sunder": 1, "frame_range": [1, 2], "nodes": {
        "ball": {"type": "rigid_body", "shape": "sphere", "radius": 0.4},
        "floor": {"type": "collider", "shape": "plane"},
        "sim": {"type": "solver", "rigid_bodies": ["@ball.rigid_body"], "colliders": ["@floor.collider"]},
        "out": {"type": "bake_mesh", "path": "mesh/cube.####.ply"},
        "cache": {"type": "bake_state", "path": "state/sim.####.ply"}}}}))
    return folder
