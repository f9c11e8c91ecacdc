"""A user's session in Blender's window under Xvfb; its screenshots stay in build/blender/ui to be looked at."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from run_in_blender import ADDON_ROOT, BLENDER, environment

PICTURES = Path(ADDON_ROOT) / "ui"
SIZE = "1280x900"


class Window(unittest.TestCase):
    def test_a_session(self):
        shutil.rmtree(PICTURES, ignore_errors=True)
        PICTURES.mkdir(parents=True)
        read, write = os.pipe()
        screen = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", SIZE + "x24", "-nolisten", "tcp",
                                   "+extension", "GLX", "-noreset"], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        self.addCleanup(screen.wait), self.addCleanup(screen.terminate)
        with os.fdopen(read) as told:
            display = told.readline().strip()
        self.assertTrue(display, "Xvfb did not start")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        names = environment(Path(folder.name), ADDON_ROOT) | {"DISPLAY": ":" + display}
        done = subprocess.run(
            [*BLENDER, "--factory-startup", "--window-geometry", "0", "0", *SIZE.split("x"), "--addons", "sunder_addon",
             "--python", str(Path(__file__).with_name("ui_script.py")), "--", str(PICTURES)],
            env=names, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=540)
        print(done.stdout)
        for report in Path(folder.name).rglob("*.crash.txt"):
            print(report.read_text())
        self.assertTrue((PICTURES / "told.json").exists(), f"Blender ended with {done.returncode}")
        told = json.loads((PICTURES / "told.json").read_text())
        print(json.dumps(told["times"], indent=1))
        self.assertEqual(told["failed"], [])
        self.assertEqual(told["handler_errors"], [])
        steps = re.search(r"^STEPS = \[(.*)\]$", Path(__file__).with_name("ui_script.py").read_text(), re.MULTILINE)[1]
        self.assertEqual(told["passed"], steps.split(", "))
        self.assertNotIn("Traceback", done.stdout)


if __name__ == "__main__":
    unittest.main()
