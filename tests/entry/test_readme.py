"""What the documents show works as printed: the first graph bakes, scripts run, the node reference is up to date."""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM, LIBRARY = (os.environ[name] for name in ("SUNDER_PROGRAM", "SUNDER_LIBRARY"))


def block(document, language, marker):
    """The one fenced block of `language` that holds `marker`."""
    found = [b for b in re.findall(rf"```{language}\n(.*?)```", (ROOT / document).read_text(), re.S) if marker in b]
    assert len(found) == 1, (document, marker, len(found))
    return found[0]


class Readme(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        (self.folder / "beam.json").write_text(block("README.md", "json", '"sunder": 2'))

    def run_here(self, *command):
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "plugin_src/python"), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(command, cwd=self.folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def test_the_commands_bake_the_graph(self):
        for line in block("README.md", "sh", "bake beam.json").splitlines():
            words = line.split("#")[0].split()
            self.assertEqual(words[0], "./sunder")
            self.run_here(PROGRAM, *words[1:])
        broken = {}
        for name in ("beam", "hard"):
            manifest = json.loads((self.folder / name / "manifest.json").read_text())
            self.assertEqual([f["frame"] for f in manifest["frames"]], list(range(1, 37)))
            broken[name] = (self.folder / name / "mesh/beam.0036.ply").stat().st_size
        # Break surfaces make the file grow; with toughness null there are none.
        self.assertGreater(broken["beam"], broken["hard"])

    def test_the_script_runs(self):
        lines = self.run_here(sys.executable, "-c", block("README.md", "python", "import sunder")).splitlines()
        self.assertEqual(len(lines), 3)
        self.assertTrue(lines[2].startswith("None 0 edges broken"), lines)

    def test_the_node_reference_is_what_the_nodes_say(self):
        said = self.run_here(PROGRAM, "nodes", "--markdown")
        self.assertEqual(said, (ROOT / "docs/nodes.md").read_text(), "run: ./sunder nodes --markdown > docs/nodes.md")

    def test_the_types_of_the_python_package_are_what_the_nodes_say(self):
        python = ROOT / "plugin_src/python"
        (self.folder / "nodes.json").write_text(self.run_here(PROGRAM, "nodes", "--json"))
        said = self.run_here("sh", "-c", f"{sys.executable} {python / 'write_stubs.py'} < nodes.json")
        self.assertEqual(said, (python / "sunder/_nodes.pyi").read_text(), "run: ./sunder nodes --json | "
                         "python3 plugin_src/python/write_stubs.py > plugin_src/python/sunder/_nodes.pyi")

    def test_the_reader_of_states_reads_states(self):
        self.run_here(PROGRAM, "bake", "beam.json", "-o", "DIR", "--frames", "1:24")
        height = float(self.run_here(sys.executable, "-c", block("docs/files.md", "python", "def read_state")))
        self.assertTrue(0 < height < 1, height)  # the beam lies at 0.5 to 0.7 m and sags


if __name__ == "__main__":
    unittest.main()
