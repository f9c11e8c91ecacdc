"""Draws cuts side by side, their fragments moved apart: what `sunder fracture` writes, without the add-on.

    blender -b --factory-startup --python-exit-code 9 --python draw_fragments.py -- OUT.png CUT_DIR [CUT_DIR ...] [options]

Each cut is turned to one size and drawn in a colour of its own, break surfaces in bright orange.
"""
import argparse
import json
import os
import sys
from math import radians

import bpy
import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../plugin_src/blender"))
import render_bake  # noqa: E402
from bake_reader import read_ply  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(prog="draw_fragments.py")
    parser.add_argument("out")
    parser.add_argument("cuts", nargs="+")
    parser.add_argument("--apart", type=float, default=0.35, help="how far fragments move, as a share of the distance")
    parser.add_argument("--turn", type=float, nargs="*", default=[], help="degrees about z, one a cut")
    parser.add_argument("--width", type=int, default=1440, help="pixels; the picture is 16:9")
    parser.add_argument("--samples", type=int, default=48, help="light paths per pixel")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:])


class Cut:
    """All fragments of one folder as one soup, `shift` being each vertex's fragment centroid."""

    def __init__(self, folder):
        with open(os.path.join(folder, "fragments.json"), encoding="utf-8") as file:
            listing = json.load(file)
        self.interior = listing["interior_material"]
        points, triangles, normals, materials, centroids, n = [], [], [], [], [], 0
        for fragment in listing["fragments"]:
            piece = read_ply(os.path.join(folder, fragment["file"]))
            vertex, face = piece["vertex"], piece["face"]
            position = np.stack([vertex["x"], vertex["y"], vertex["z"]], axis=1)
            corners = face["vertex_indices"].astype(np.int32)
            if "corner_normals" in face.dtype.names:
                normals.append(face["corner_normals"].reshape(-1, 3))
            else:
                a, b, c = (position[corners[:, i]] for i in range(3))
                flat = np.cross(b - a, c - a)
                normals.append(np.repeat(flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30), 3, axis=0))
            points.append(position)
            triangles.append(corners + n)
            materials.append(face["material"])
            centroids.append(np.broadcast_to(fragment["centroid"], position.shape))
            n += len(position)
        self.points, self.triangles = np.concatenate(points), np.concatenate(triangles)
        self.normals, self.material = np.concatenate(normals).astype(np.float32), np.concatenate(materials)
        self.centroids = np.concatenate(centroids)

    def exploded(self, apart):
        """Around the origin, the longest side 1."""
        low, high = self.points.min(0), self.points.max(0)
        moved = self.points + apart * (self.centroids - (low + high) / 2)
        low, high = moved.min(0), moved.max(0)
        return (moved - (low + high) / 2) / (high - low).max()


def main():
    options = arguments()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    options.engine = "cycles"
    render_bake.set_engine(options)
    scene = bpy.context.scene
    scene.render.resolution_y = int(options.width * 0.36)
    inner = render_bake.material("inside", render_bake.INNER_COLOR, 0.7)
    right, ground = 0.0, []
    for i, folder in enumerate(options.cuts):
        cut = Cut(folder)
        points = cut.exploded(options.apart)
        angle = radians(options.turn[i]) if i < len(options.turn) else 0.0
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        points, cut.normals = points @ turn.T, (cut.normals @ turn.T).astype(np.float32)
        points[:, 0] += right - points[:, 0].min()
        points[:, 2] -= points[:, 2].min()
        right = points[:, 0].max() + 0.18
        ground.append(points)
        mesh = bpy.data.meshes.new(folder)
        outer = render_bake.material(f"outside {i}", render_bake.OUTER_COLORS[i % len(render_bake.OUTER_COLORS)], 0.5)
        thing = render_bake.add_object(folder, mesh, outer, inner)
        render_bake.write_mesh(thing.data, points.astype(np.float32), np.ascontiguousarray(cut.triangles, np.int32),
                               cut.normals, (cut.material >= cut.interior).astype(np.int32))
    everything = np.concatenate(ground)
    low, high = everything.min(0), everything.max(0)
    low[2] = 0
    distance = render_bake.add_camera(low, high)
    render_bake.add_light(low, high, distance)
    floor = bpy.data.meshes.new("floor")
    s = 20 * distance
    floor.from_pydata([(-s, -s, -0.02), (s, -s, -0.02), (s, s, -0.02), (-s, s, -0.02)], [], [(0, 1, 2, 3)])
    render_bake.add_object("floor", floor, render_bake.material("floor", render_bake.FLOOR_COLOR, 0.9))
    scene.render.filepath = os.path.abspath(options.out)
    bpy.ops.render.render(write_still=True)


main()
