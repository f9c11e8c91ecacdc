"""The pictures of a bake show it: not empty, break surfaces only once broken, errors end with a status."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

import small_bake
from run_in_blender import BLENDER

SCRIPT = Path(__file__).resolve().parents[2] / "plugin_src/blender/render_bake.py"
WIDTH, HEIGHT = 320, 180


def pixels(picture):
    raw = subprocess.run(["convert", picture, "-depth", "8", "rgb:-"], check=True, capture_output=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, 3).astype(int)


def orange(picture):
    red, green, blue = pixels(picture).T
    return int(np.count_nonzero((red > 90) & (red > 1.5 * green) | (red > 90) & (red > 2 * blue)))


class RenderBake(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.bake = small_bake.write(self.folder / "a bake")
        self.out = self.folder / "pictures of it"

    def render(self, *options, path="/usr/bin"):
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(self.folder / "profile"), "TMPDIR": str(self.folder),
                       "PATH": path + ":/usr/bin:" + os.environ["PATH"]}
        environment.pop("DISPLAY", None)
        return subprocess.run(
            [*BLENDER, "-b", "--factory-startup", "--python-exit-code", "9", "--python", SCRIPT, "--", self.bake, self.out,
             "--width", str(WIDTH), *options], env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def check_pictures(self, *options):
        sheet = self.folder / "sheet.png"
        done = self.render(*options, "--sheet", sheet)
        self.assertEqual(done.returncode, 0, done.stdout)
        whole, broken = (self.out / f"frame_{n:04d}.png" for n in (1, 2))
        for picture in (whole, broken):
            self.assertEqual(len(pixels(picture)), WIDTH * HEIGHT)
            # An empty picture has one colour; a floor alone has a smooth ramp of about 5 levels.
            self.assertGreater(pixels(picture).std(), 10)
        # The cut is seen from the front at a slant: some hundred pixels of 57,600; none may show while whole.
        self.assertEqual(orange(whole), 0)
        self.assertGreater(orange(broken), 100)
        self.assertGreater(len(pixels(sheet)), 2 * WIDTH * HEIGHT)

    def test_break_surfaces_show_once_broken_in_workbench(self):
        self.check_pictures("--engine", "workbench")

    def test_break_surfaces_show_once_broken_in_cycles(self):
        self.check_pictures("--engine", "cycles", "--samples", "4")

    def test_colliders_are_drawn_where_they_are(self):
        """Of each shape, beside the cube: seen where none was before, and elsewhere once it has moved."""
        (self.bake / "inputs").mkdir()
        shutil.copy(self.bake / "mesh/cube.0001.ply", self.bake / "inputs/solid.ply")
        self.render("--engine", "workbench")
        bare = [pixels(self.out / f"frame_{n:04d}.png") for n in (1, 2)]
        manifest = json.loads((self.bake / "manifest.json").read_text())
        for shape in ({"shape": "sphere", "radius": 0.3}, {"shape": "box", "size": [0.4, 0.4, 0.6]},
                      {"shape": "capsule", "radius": 0.2, "height": 0.3},
                      {"shape": "mesh", "path": "inputs/solid.ply", "scale": 0.5}):
            with self.subTest(shape["shape"]):
                manifest["graph"]["nodes"]["post"] = {"type": "collider", **shape, "rotation": [0, 0, 20], "position": {
                    "keys": [[1, [-0.9, 0, 0.4]], [2, [-0.9, -0.5, 0.4]]]}}
                (self.bake / "manifest.json").write_text(json.dumps(manifest))
                self.render("--engine", "workbench")
                seen = [np.any(pixels(self.out / f"frame_{n:04d}.png") != bare[n - 1], 1) for n in (1, 2)]
                self.assertTrue(min(s.sum() for s in seen) > 150, [s.sum() for s in seen])
                self.assertGreater(np.count_nonzero(seen[0] != seen[1]), 50)
        manifest["graph"]["nodes"]["post"]["path"] = "nowhere.obj"
        (self.bake / "manifest.json").write_text(json.dumps(manifest))
        done = self.render("--engine", "workbench")
        self.assertEqual(done.returncode, 0)
        self.assertIn("warning: a collider is not drawn: nowhere.obj", done.stdout)

    def test_a_python_without_numpy_is_told_how_to_mend_it(self):
        bare = self.folder / "bare"
        subprocess.run(["/usr/bin/python3", "-m", "venv", "--without-pip", bare], check=True)
        done = self.render("--engine", "workbench", path=str(bare / "bin"))
        if BLENDER != ["blender"]:  # an official build brings its own Python, a root has its own PATH: neither looks here
            self.assertEqual(done.returncode, 0, done.stdout)
            return
        self.assertEqual(done.returncode, 3, done.stdout)
        self.assertIn("start it with PATH=/usr/bin:$PATH", done.stdout)

    def test_a_truncated_frame_is_named_and_ends_with_status_3(self):
        frame = self.bake / "mesh/cube.0002.ply"
        frame.write_bytes(frame.read_bytes()[:-1])
        done = self.render("--engine", "workbench")
        self.assertEqual(done.returncode, 3, done.stdout)
        self.assertIn("cube.0002.ply: ends within its face rows", done.stdout)

    def test_a_frame_that_is_not_there_is_refused_before_rendering(self):
        done = self.render("--engine", "workbench", "--frames", "1:3")
        self.assertEqual(done.returncode, 3, done.stdout)
        self.assertIn("frames [3] are not in the bake", done.stdout)
        self.assertFalse(self.out.exists())


if __name__ == "__main__":
    unittest.main()
