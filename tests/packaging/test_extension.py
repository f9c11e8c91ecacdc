"""The zip is an extension of Blender 4.2 and later: valid, installed by Blender's own command, and at work in a Debian 13 that has
Blender and nothing else."""
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ZIP = next((ROOT / "build/package").glob("sunder_addon-*-linux-x64.zip"))

sys.path.insert(0, str(ROOT / "tests/hosts"))
import hosts  # noqa: E402

WORKS = """
import bpy
names = [name for name in bpy.context.preferences.addons.keys() if name.endswith(".sunder_addon")]
assert bpy.context.preferences.addons[names[0]].preferences  # they are registered under the name that the extension got
bpy.context.scene.frame_end = 2
bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0, 0, 0.5))
bpy.ops.sunder.quick_fracture(pieces=4)
print("FRAMES", names, [n.note for n in bpy.data.node_groups[0].nodes if n.bl_idname == "SunderDeformerNode"])
"""


@pytest.fixture(scope="module")
def blender(tmp_path_factory):
    """Calls Blender there with a profile of its own; returns what it says."""
    try:
        hosts.BLENDER_ALONE.prepare()
    except hosts.Unavailable as error:
        pytest.skip(str(error))
    folder = tmp_path_factory.mktemp("extension")  # /tmp is the same in every root
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("SUNDER_", "BLENDER_", "PYTHON"))}

    def call(*words):
        done = subprocess.run([*hosts.BLENDER_ALONE.command(), *map(str, words)], text=True, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300,
                              env={**kept, "BLENDER_USER_RESOURCES": str(folder / "profile"), "TMPDIR": str(folder)})
        assert done.returncode == 0, done.stdout
        return done.stdout

    return call


def test_it_is_valid(blender):
    assert "Success" in blender("--command", "extension", "validate", ZIP)


def test_installed_by_the_command_it_bakes(blender):
    assert 'Installed "sunder_addon"' in blender("--command", "extension", "install-file", "-r", "user_default", "-e", ZIP)
    assert "FRAMES ['bl_ext.user_default.sunder_addon'] ['baked 1 to 2']" in blender("-b", "--python-exit-code", "9", "--python-expr", WORKS)
