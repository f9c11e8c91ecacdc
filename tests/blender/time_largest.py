"""Times in Blender at the size of the paper's largest scene (479K vertices, 246K triangles). Not one of the tests.

    python3 tests/blender/time_largest.py [--pieces N]      (after ./sunder has built)

A sphere is cut into as many pieces as give that many triangles once all is broken, and shattered; a row of times is printed
for each stage. What a mesh of exactly the paper's counts costs Blender is timed with vertices of its own for most corners.
"""
import argparse
import importlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ADDON = Path(os.environ.get("SUNDER_ADDON_ROOT", ROOT / "build/blender"))
PAPER = (479_000, 246_000)  # vertices, triangles
SIZE = (960, 540)
REPEATS = 7
LAST = 14  # frame at which nearly all edges broke


def sphere_graph(folder, last, pieces, body, solver):
    """A ball of 48,000 triangles over a floor, cut into pieces; `body` and `solver`: parameters of these nodes."""
    import numpy as np

    sys.path.insert(0, str(ADDON / "addons/sunder_addon"))
    import sunder

    rings, segments = 110, 220
    up, around = np.meshgrid(np.linspace(0, np.pi, rings + 1)[1:-1], np.arange(segments) * 2 * np.pi / segments, indexing="ij")
    p = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], -1).reshape(-1, 3)
    p = np.concatenate([p, [(0, 0, 1), (0, 0, -1)]])
    top, bottom, k = len(p) - 2, len(p) - 1, np.arange(segments)
    faces = [(top, i, (i + 1) % segments) for i in range(segments)]
    for r in range(rings - 2):
        a, b = r * segments + k, r * segments + (k + 1) % segments
        faces += np.stack([a, a + segments, b + segments], 1).tolist() + np.stack([a, b + segments, b], 1).tolist()
    lowest = (rings - 2) * segments
    faces += [(lowest + i, bottom, lowest + (i + 1) % segments) for i in range(segments)]
    with open(folder / "sphere.obj", "w") as file:
        file.writelines("v %.9g %.9g %.9g\n" % tuple(v) for v in p)
        file.writelines("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces)
    return sunder.Graph.from_dict({"sunder": 1, "frame_range": [1, last], "nodes": {
        "mesh": {"type": "mesh_file", "path": str(folder / "sphere.obj")},
        "pieces": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": pieces},
        "body": {"type": "body", "fragments": "@pieces.fragments", **body},
        "floor": {"type": "collider"},
        "solver": {"type": "solver", "bodies": ["@body.body"], "colliders": ["@floor.collider"], **solver},
        "deformer": {"type": "deformer", "body": "@body.body", "state": "@solver.state"},
        "deformer:bake": {"type": "bake_mesh", "mesh": "@deformer.mesh", "path": "mesh/deformer.####.ply"},
        "solver:bake": {"type": "bake_state", "state": "@solver.state", "path": "state/solver.####.ply"}}},
        base_folder=str(folder))


def in_python(folder, pieces):
    """Bakes, and times the library by itself."""
    import time

    body = {"position": [0, 0, 3], "angular_velocity": [0, 0, 7200], "youngs_modulus": 1e8, "toughness": 1e-6}
    graph = sphere_graph(folder, LAST, pieces, body, {"preset": "preview"})
    begin = time.perf_counter()
    graph.evaluate("pieces.fragments")
    print(f"cut into pieces                      {time.perf_counter() - begin:8.2f} s")
    for frame in (1, LAST - 1, LAST):
        begin = time.perf_counter()
        graph.evaluate("solver.state", frame)
        middle = time.perf_counter()
        mesh = graph.evaluate("deformer.mesh", frame)
        print(f"frame {frame}: solver {middle - begin:6.2f} s, evaluate mesh {time.perf_counter() - middle:6.3f} s: "
              f"{len(mesh.positions)} vertices, {len(mesh.triangles)} triangles")
    graph.bake(str(folder / "bake"))


def addon(name):
    return importlib.import_module("sunder_addon." + name)


def result_object(folder, last):
    """In Blender, in a scene that has nothing else: an object that plays the bake, without a tree that could bake."""
    import bpy

    scene = bpy.context.scene
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    tree = bpy.data.node_groups.new("Largest", "SunderTree")
    addon("base.runtime").former_homes.clear()
    tree.cache_id = "bake"
    addon("bake.cache").home = lambda library=None: str(folder)
    result = bpy.data.objects.new("result", bpy.data.meshes.new("result"))
    addon("results.rest_coordinates").prepare(result)
    scene.collection.objects.link(result)
    result.sunder.tree, result.sunder.node = tree, "deformer"
    scene.frame_start, scene.frame_end = 1, last
    return result


def in_blender(folder):
    import time

    import bpy
    import gpu
    import numpy as np
    from mathutils import Matrix, Vector

    def row(what, work, setup=lambda: None):
        best = []
        for _ in range(REPEATS):
            setup()
            begin = time.perf_counter()
            work()
            best.append(1000 * (time.perf_counter() - begin))
        print(f"{what:52s}{min(best):9.0f} ms", flush=True)

    scene = bpy.context.scene
    result = result_object(folder, LAST)
    scene.collection.objects.unlink(result)
    reader, write, player = addon("base.bake_reader"), addon("results.result_mesh"), addon("results.player")
    manifest = addon("bake.cache").manifest(str(folder / "bake"))
    bake = str(folder / "bake")
    path = os.path.join(bake, manifest.frames[LAST]["deformer:bake"])
    frame = reader.read_mesh_frame(path)
    print(f"shattered: {len(frame.positions)} vertices, {len(frame.triangles)} triangles")
    row("read a mesh frame", lambda: reader.read_mesh_frame(path))

    # The paper's counts: corners get vertices of their own until there are that many.
    v, t = PAPER
    big = reader.MeshFrame()
    corners = np.arange(3 * t) % v
    big.positions = np.random.default_rng(1).random((v, 3), np.float32)
    big.triangles = corners.reshape(-1, 3).astype(np.int32)
    mesh = bpy.data.meshes.new("big")
    thing = bpy.data.objects.new("big", mesh)
    scene.collection.objects.link(thing)
    row(f"write {v} v, {t} t: all new", lambda: write.write_geometry(mesh, big), mesh.clear_geometry)
    for name in ("material", "fragment", "hidden", "uvs", "interface", "rim", "colors", "rest"):
        setattr(big, name, None)
    mesh[write.FACES] = "same"
    row("write: positions alone, same faces", lambda: write.write_geometry(mesh, big, "same"))
    row("Blender's own evaluation after it", lambda: (mesh.update_tag(), bpy.context.view_layer.update()))
    bpy.data.objects.remove(thing)

    scene.collection.objects.link(result)
    for exact in (False, True):
        result.sunder.use_exact_normals = exact
        what = "with" if exact else "without"
        row(f"frame change, {what} exact normals, edges broke", lambda: scene.frame_set(LAST),
            lambda: scene.frame_set(LAST - 1))
        row(f"frame change, {what} exact normals, none broke", lambda: scene.frame_set(2), lambda: scene.frame_set(1))

    for what in ("cut and skin anew", "skin what was cut before"):
        source = addon("preview.preview_source").Source(bake, manifest.graph, "deformer")
        begin = time.perf_counter()
        source.start(), source.wait()
        print(f"{'preview: ' + what:52s}{1000 * (time.perf_counter() - begin):9.0f} ms {source.error}")

    class Card(bpy.types.RenderEngine):
        bl_idname, bl_label, bl_use_gpu_context = "SUNDER_TIME", "time", True

        def render(self, _depsgraph):
            shader = addon("preview.preview_shader")

            def frame_of(n):
                return source.frame(os.path.join(bake, manifest.frames[n]["solver:bake"]), "STRAIN")

            row("preview: frame change in which edges broke", lambda: frame_of(LAST), lambda: frame_of(LAST - 1))
            row("preview: frame change in which none broke", lambda: frame_of(LAST))
            f = frame_of(LAST)
            row("preview: vertices and weights to the card", lambda: shader.Skin(f.surface))
            row("preview: particle texture to the card", lambda: shader.texture(f.particles, "RGBA32F"))
            preview = addon("preview.preview")
            drawn = preview._Drawn()
            drawn.skin, drawn.particles, drawn.frame = shader.Skin(f.surface), shader.texture(f.particles, "RGBA32F"), f
            result.sunder.preview = "STRAIN"
            target = gpu.types.GPUOffScreen(*SIZE)
            view = Matrix([[1.2, 0, 0, 0], [0, 0, 2.1, -1.5], [0, 1.002, 0, 3.7], [0, 1, 0, 4]])

            def draw():
                with target.bind():
                    buffer = gpu.state.active_framebuffer_get()
                    buffer.clear(color=(0, 0, 0, 1), depth=1.0)
                    preview.draw_object(result, drawn, view, Vector((0, -1, 0.5)))
                    self.pixels = buffer.read_color(0, 0, 8, 8, 4, 0, "FLOAT")

            row(f"preview: draw, {SIZE[0]} x {SIZE[1]} (software rendering)", draw)

    bpy.utils.register_class(Card)
    scene.render.engine = "SUNDER_TIME"
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(scene.camera)
    bpy.ops.render.render()
    os._exit(0)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--pieces", type=int, default=3000)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        in_python(folder, given.pieces)
        os.environ["SUNDER_ADDON_ROOT"] = str(ADDON)
        from run_in_blender import environment

        subprocess.run(["blender", "-b", "--factory-startup", "--addons", "sunder_addon", "--python", __file__, "--", name],
                       env=environment(folder, ADDON), check=True)


if __name__ == "__main__":
    if "--" in sys.argv:
        in_blender(Path(sys.argv[sys.argv.index("--") + 1]))
    else:
        main()
