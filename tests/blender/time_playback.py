"""Playing a bake beside Blender's own Alembic of the same frames, in each Blender of the matrix. Not one of the tests.

    python3 tests/blender/time_playback.py [HOST]...      (after ./sunder has built; hosts as in tests/hosts/hosts.py)

A ball of 3,000 pieces tears on a floor. The host exports what it plays, and imports it again as a Mesh Sequence Cache; both
are played by turns. Each frame counts with its least time. Frames are worked out whole, as a viewport asks for them; nothing is
drawn.
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "hosts")]
LAST, PIECES, ROUNDS = 14, 3000, 2


def bake(folder):
    from time_largest import sphere_graph

    body = {"position": [0, 0, 1.2], "velocity": [0, 0, -12], "angular_velocity": [0, 0, 7200], "youngs_modulus": 1e6,
            "toughness": 0.3}
    sphere_graph(folder, LAST, PIECES, body, {"preset": "preview"}).bake(str(folder / "bake"))


class _Played:
    """An object in a scene of its own: frames of another play nothing of it."""

    def __init__(self, scene, objects):
        self.scene, self.objects, self.times = scene, objects, None

    def play(self):
        import time

        import bpy

        bpy.context.window.scene = self.scene
        times = []
        for frame in range(1, LAST + 1):
            begin = time.perf_counter()
            self.scene.frame_set(frame)
            times.append(1000 * (time.perf_counter() - begin))
        self.times = times if self.times is None else list(map(min, self.times, times))


def _imported(path, fps):
    import bpy

    bpy.context.window.scene = scene = bpy.data.scenes.new(path.stem)
    scene.render.fps = fps
    bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    return _Played(scene, list(scene.objects))


def in_blender(folder):
    import bpy
    import numpy as np

    from time_largest import addon, result_object

    scene, result = bpy.context.scene, result_object(folder, LAST)
    faces = []
    for frame in range(1, LAST + 1):
        scene.frame_set(frame)
        faces.append(len(result.data.polygons))
    changes = np.array([True] + [a != b for a, b in zip(faces, faces[1:])])
    print(f"ROW {faces[0]} to {faces[-1]} triangles; in {changes.sum()} of {LAST} frames edges broke")
    if not addon("base.blender_versions").has_operator("wm", "alembic_export"):
        print("ROW this Blender was built without Alembic: there is nothing to compare with")
    for is_exact in (True, False):
        result.sunder.use_exact_normals = is_exact
        players = {"Sunder": _Played(scene, [result])}
        if addon("base.blender_versions").has_operator("wm", "alembic_export"):
            path = folder / f"{'normals' if is_exact else 'plain'}-{bpy.app.version_string.split()[0]}.abc"
            bpy.context.window.scene = scene
            result.select_set(True)
            bpy.ops.wm.alembic_export(filepath=str(path), selected=True, start=1, end=LAST, normals=is_exact,
                                      as_background_job=False)
            players["Alembic"] = _imported(path, scene.render.fps)
        for _ in range(ROUNDS):
            for player in players.values():
                player.play()
        for name, player in players.items():
            shown = [len(o.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.polygons) for o in player.objects]
            times = np.array(player.times)
            print(f"ROW {'with' if is_exact else 'without'} normals, {name}: {times.sum():.0f} ms for {LAST} frames; median where "
                  f"edges broke {np.median(times[changes]):.0f}, where none {np.median(times[~changes]):.0f}; "
                  f"{sum(shown)} triangles")
        if "Alembic" in players:
            ratio = sum(players["Sunder"].times) / sum(players["Alembic"].times)
            print(f"ROW {'with' if is_exact else 'without'} normals, Sunder / Alembic: {ratio:.2f}", flush=True)
    os._exit(0)


def main(names):
    os.environ.setdefault("SUNDER_ADDON_ROOT", str(HERE.parents[1] / "build/blender"))
    import hosts
    from run_in_blender import environment

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bake(folder)
        for host in (hosts.HOSTS[n] for n in names or hosts.HOSTS):
            try:
                host.prepare()
            except hosts.Unavailable as error:
                print(f"{host.name}: NOT RUN: {error}", flush=True)
                continue
            command = [*host.command(), "-b", "--factory-startup", "--addons", "sunder_addon", "--python", __file__, "--", name]
            done = subprocess.run(command, env=environment(folder, os.environ["SUNDER_ADDON_ROOT"]), text=True,
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            rows = [line[4:] for line in done.stdout.splitlines() if line.startswith("ROW ")]
            print(*[f"{host.name}: {row}" for row in rows], sep="\n", flush=True)
            if done.returncode:
                print(f"{host.name}: FAILED\n{done.stdout[-2000:]}")


if __name__ == "__main__":
    if "--" in sys.argv:
        in_blender(Path(sys.argv[sys.argv.index("--") + 1]))
    else:
        main(sys.argv[1:])
