"""The documented script: builds the demo shot with nodes, bakes and renders it without a window, and goes on when run again."""
import json
import tempfile
import unittest
from pathlib import Path

from run_in_blender import ADDON_ROOT, blender

ROOT = Path(__file__).resolve().parents[2]


class DemoShot(unittest.TestCase):
    def shoot(self, out, frames):
        done = blender(out.parent, "--factory-startup", "--addons", "sunder_addon", "--python-exit-code", "9", "--python",
                       ROOT / "plugin_src/blender/demo_shot.py", "--", ROOT / "tests/data/bunny.obj", out, "--frames", frames,
                       "--pieces", "12", "--width", "96", scripts=ADDON_ROOT)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertNotIn("Traceback", done.stdout)
        return json.loads(next(out.glob("sunder_cache/*/manifest.json")).read_text())

    def test_it_builds_bakes_renders_and_goes_on(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "demo"
            manifest = self.shoot(out, "1:3")
            self.assertEqual([f["frame"] for f in manifest["frames"]], [1, 2, 3])
            types = [n["type"] for n in manifest["graph"]["nodes"].values()]
            self.assertEqual([types.count(t) for t in ("body", "rigid_body", "deformer")], [2, 2, 2])
            pictures = [(out / f"render/frame_{n:04d}.png").read_bytes() for n in (1, 2, 3)]
            self.assertEqual(len(set(pictures)), 3)  # the balls fall
            second = next(out.glob("sunder_cache/*/state/*.0002.ply"))
            stamp = second.stat().st_mtime_ns
            manifest = self.shoot(out, "1:4")
            self.assertEqual([f["frame"] for f in manifest["frames"]], [1, 2, 3, 4])
            self.assertEqual(second.stat().st_mtime_ns, stamp)


if __name__ == "__main__":
    unittest.main()
