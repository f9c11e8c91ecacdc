"""The Python package's types: whole by themselves, and of use to whoever writes a script."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
PYTHON = HERE.parents[1] / "plugin_src/python"


class Types(unittest.TestCase):
    def test_the_package_and_a_script_of_it_are_typed(self):
        # What is wrong in the script is marked by `type: ignore`, and one that is not needed is an error.
        with tempfile.TemporaryDirectory() as cache:
            done = subprocess.run(
                [sys.executable, "-m", "mypy", "--config-file", HERE / "mypy.ini", "--cache-dir", cache, PYTHON / "sunder",
                 HERE / "typed_script.py"], env={**os.environ, "MYPYPATH": str(PYTHON)}, text=True, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
