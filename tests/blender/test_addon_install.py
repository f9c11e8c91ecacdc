"""The add-on installs as users install it, and says what is wrong when its library is."""
import ast
import re
import shutil
import tempfile
import tomllib
import unittest
import zipfile
from pathlib import Path

from run_in_blender import ADDON_ROOT, blender

ROOT = Path(ADDON_ROOT)
SOURCE = Path(__file__).resolve().parents[2] / "plugin_src/blender/sunder_addon"
# A node of the tree that only the library can describe, baked by it.
WORKS = """
import bpy
bpy.context.scene.frame_end = 2
bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0, 0, 0.5))
bpy.ops.sunder.quick_fracture(pieces=4)
print('FRAMES', sorted(n.note for n in bpy.data.node_groups[0].nodes if n.bl_idname == 'SunderDeformerNode'))
"""
TELLS = """
import bpy, importlib, sys
core = importlib.import_module('sunder_addon.core')
print('PROBLEM', core.problem())
bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0, 0, 0.5))
try:
    bpy.ops.sunder.quick_fracture(pieces=4)
except RuntimeError as error:
    print('REPORTED', error)
print('NODES', len(bpy.data.node_groups[0].nodes))
"""


class Install(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_blender(self, *arguments, scripts=None):
        done = blender(self.folder, *arguments, scripts=scripts)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def test_a_zip_installs_into_a_clean_profile_and_stays(self):
        archive, = ROOT.glob("sunder_addon-*.zip")
        self.run_blender("--python-exit-code", "9", "--python-expr", f"""
import bpy
bpy.ops.preferences.addon_install(filepath={str(archive)!r}, overwrite=True)
bpy.ops.preferences.addon_enable(module='sunder_addon')
bpy.ops.wm.save_userpref()
""")
        told = self.run_blender("--python-exit-code", "9", "--python-expr", WORKS)
        self.assertIn("FRAMES ['baked 1 to 2']", told)

    def test_a_folder_works_in_place_and_can_be_turned_off_and_on(self):
        told = self.run_blender("--factory-startup", "--addons", "sunder_addon", "--python-exit-code", "9",
                                "--python-expr", """
import bpy
for _ in range(2):
    bpy.ops.preferences.addon_disable(module='sunder_addon')
    assert bpy.types.NodeTree.bl_rna_get_subclass_py('SunderTree') is None
    assert not any(h.__module__.startswith('sunder_addon') for l in (bpy.app.handlers.frame_change_post,
        bpy.app.handlers.load_post, bpy.app.handlers.depsgraph_update_post) for h in l)
    bpy.ops.preferences.addon_enable(module='sunder_addon')
    assert bpy.context.preferences.addons['sunder_addon'].preferences  # they are registered under the add-on's own name
""" + WORKS, scripts=ROOT)
        self.assertIn("FRAMES ['baked 1 to 2']", told)

    def broken(self, change):
        """What is told by a copy of the add-on to which `change` was done."""
        shutil.copytree(ROOT / "addons", self.folder / "scripts/addons")
        change(self.folder / "scripts/addons/sunder_addon")
        told = self.run_blender("--factory-startup", "--addons", "sunder_addon", "--python-exit-code", "9",
                                "--python-expr", TELLS, scripts=self.folder / "scripts")
        self.assertIn("NODES 6", told)  # trees can be opened and drawn, whatever the library is
        self.assertRegex(told, r"REPORTED Error: Sunder's library")
        return re.search("^PROBLEM (.*)$", told, re.MULTILINE)[1]

    def test_a_missing_library_is_told(self):
        told = self.broken(lambda addon: (addon / "sunder/libsunder.so").unlink())
        self.assertRegex(told, r"cannot be loaded: libsunder.so: is not there .*Install the add-on's zip again")

    def test_a_foreign_library_is_told(self):
        told = self.broken(lambda addon: (addon / "sunder/libsunder.so").write_bytes(b"not a library"))
        self.assertRegex(told, r"libsunder.so: is not Sunder's library.*Install the add-on's zip again")

    def test_a_library_of_another_version_is_told(self):
        def change(addon):
            nodes = addon / "nodes.json"
            nodes.write_text(re.sub(r'"sunder": "[\d.]+"', '"sunder": "0.0.9"', nodes.read_text(), count=1))

        told = self.broken(change)
        self.assertRegex(told, r"library has version [\d.]+, this add-on 0\.0\.9.*restart Blender")

    def lacking(self, change):
        """What stands in the preferences of a copy of the add-on to which `change` was done, which can be turned off and on."""
        shutil.copytree(ROOT / "addons", self.folder / "scripts/addons")
        change(self.folder / "scripts/addons/sunder_addon")
        told = self.run_blender("--factory-startup", "--addons", "sunder_addon", "--python-exit-code", "9",
                                "--python-expr", """
import bpy, sys
for _ in range(2):
    print('LACK', sys.modules['sunder_addon'].SunderLack.sentence)
    bpy.ops.preferences.addon_disable(module='sunder_addon')
    bpy.ops.preferences.addon_enable(module='sunder_addon')
""", scripts=self.folder / "scripts")
        self.assertNotIn("Traceback", told)
        lines = re.findall("^LACK (.*)$", told, re.MULTILINE)
        self.assertEqual(len(lines), 2)
        self.assertEqual(lines[0], lines[1])
        return lines[0]

    def test_a_missing_file_of_descriptions_is_told(self):
        self.assertRegex(self.lacking(lambda addon: (addon / "nodes.json").unlink()), "nodes.json of Sunder's add-on is missing: install")

    def test_a_missing_module_is_told(self):
        told = self.lacking(lambda addon: (addon / "tree/wiring.py").unlink())
        self.assertRegex(told, "missing or damaged .*wiring.*install its zip again")

    def test_versions_agree(self):
        tree = ast.parse((SOURCE / "__init__.py").read_text())
        info, = (ast.literal_eval(s.value) for s in tree.body if isinstance(s, ast.Assign) and s.targets[0].id == "bl_info")
        version = ".".join(map(str, info["version"]))
        self.assertRegex((SOURCE / "blender_manifest.toml").read_text(), f'(?m)^version = "{re.escape(version)}"$')
        archive, = ROOT.glob("sunder_addon-*.zip")
        packaged = tomllib.loads((ROOT / "addons/sunder_addon/blender_manifest.toml").read_text())
        self.assertEqual(archive.name, f"sunder_addon-{packaged['version']}-{packaged['platforms'][0]}.zip")
        with zipfile.ZipFile(archive) as zipped:
            self.assertEqual({n: zipped.read(n) for n in zipped.namelist()},
                             {f"sunder_addon/{p.relative_to(ROOT / 'addons/sunder_addon').as_posix()}": p.read_bytes()
                              for p in (ROOT / "addons/sunder_addon").rglob("*") if p.is_file() and p.suffix != ".pyc"})


if __name__ == "__main__":
    unittest.main()
