"""The package's types: whole by themselves, what the nodes say, and of use to whoever writes a script."""
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

    def test_the_stubs_are_what_the_nodes_say(self):
        described = subprocess.run([os.environ["SUNDER_PROGRAM"], "nodes", "--json"], text=True, capture_output=True, check=True)
        written = subprocess.run([sys.executable, "-B", PYTHON / "write_stubs.py"], input=described.stdout, text=True,
                                 capture_output=True, check=True)
        self.assertEqual(written.stdout, (PYTHON / "sunder/_nodes.pyi").read_text(),
                         "run: ./sunder nodes --json | python3 plugin_src/python/write_stubs.py > plugin_src/python/sunder/_nodes.pyi")


if __name__ == "__main__":
    unittest.main()
