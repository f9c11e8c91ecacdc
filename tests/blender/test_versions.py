"""The add-on runs in Blender 3.4 here and is meant for 4.x: names that came or went stand only where their absence is met.

No 4.x can be run in these tests. What is checked is the list below, taken from the release notes of 3.5 to 5.0.
"""
import ast
import re
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2] / "plugin_src/blender/sunder_addon"

# Name: what happened to it. Use is allowed in a function that asks first: hasattr, getattr with a default, bpy.app.version,
# `in ....bl_rna.properties`, `is_readonly`, or except AttributeError.
GUARDED = {
    "use_auto_smooth": "gone in 4.1",
    "auto_smooth_angle": "gone in 4.1",
    "calc_normals_split": "gone in 4.1",
    "free_normals_split": "gone in 4.1",
    "fcurves": "of an action: gone in 5.0",
    "layers": "of an action: new in 4.4",
    "loop_total": "of a polygon: read-only from 3.6",
    "draw_color": "of a socket: draw_color_simple from 4.0",
    "draw_color_simple": "new in 4.0",
    "2D_FLAT_COLOR": "FLAT_COLOR from 4.0",
}
NEVER = {
    "bgl": "gone in 5.0",
    "calc_normals": "gone in 4.0",
    "vertex_colors": "gone in 4.x, color_attributes in its place",
    "face_maps": "gone in 4.0",
    "GPUShader": "made from sources: gone in 5.0, create_from_info in its place",
    "2D_UNIFORM_COLOR": "UNIFORM_COLOR from 4.0",
    "2D_SMOOTH_COLOR": "SMOOTH_COLOR from 4.0",
    "3D_UNIFORM_COLOR": "UNIFORM_COLOR from 4.0",
    "use_bloom": "gone in 4.2",
    "nodeitems_utils": "menus are drawn without it",
    "import_mesh": "operators gone in 4.2",
    "export_mesh": "operators gone in 4.2",
}
GUARD = re.compile(r"hasattr\(|getattr\([^)]*,[^)]*,|bpy\.app\.version|bl_rna\.properties|is_readonly|except AttributeError")


def names(tree):
    """(name, line, innermost function) of every attribute, import and string."""

    def visit(node, function):
        if isinstance(node, ast.FunctionDef):
            function = node
        if isinstance(node, ast.Attribute):
            yield node.attr, node.lineno, function
        elif isinstance(node, ast.alias):
            yield node.name, node.lineno, function
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value, node.lineno, function
        for child in ast.iter_child_nodes(node):
            yield from visit(child, function)

    return visit(tree, None)


def unguarded(source):
    """Names of the lists that stand in a source without a guard: [(name, line, what happened to it)]."""
    found = []
    for name, line, function in names(ast.parse(source)):
        if name in NEVER:
            found.append((name, line, NEVER[name]))
        if name in GUARDED:
            text = ast.get_source_segment(source, function) if function else source.splitlines()[line - 1]
            if not GUARD.search(text):
                found.append((name, line, GUARDED[name]))
    return found


class Versions(unittest.TestCase):
    def test_names_that_came_or_went_are_asked_for_first(self):
        for path in sorted(SOURCE.glob("*.py")):
            with self.subTest(path.name):
                self.assertEqual(unguarded(path.read_text()), [])

    def test_the_check_itself_sees_them(self):
        self.assertEqual(unguarded("def f(m):\n    m.calc_normals_split()"), [("calc_normals_split", 2, "gone in 4.1")])
        self.assertEqual(unguarded("def f(m):\n    if hasattr(m, 'use_auto_smooth'):\n        m.use_auto_smooth = True"), [])
        self.assertEqual([n for n, *_ in unguarded("import bgl\nbuiltin('2D_UNIFORM_COLOR')")], ["bgl", "2D_UNIFORM_COLOR"])

    def test_the_package_has_whatever_name_blender_gives_it(self):
        """An extension of 4.2 and later is called bl_ext.REPOSITORY.sunder_addon."""
        for path in sorted(SOURCE.glob("*.py")):
            tree = ast.parse(path.read_text())
            with self.subTest(path.name):
                absolute = [n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level == 0 and n.module]
                absolute += [a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names]
                self.assertFalse([m for m in absolute if m.split(".")[0] in ("sunder_addon", "sunder")])
                strings = [n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)]
                self.assertNotIn("sunder_addon", strings)

    def test_the_manifest_asks_for_what_4_2_knows(self):
        import tomllib

        manifest = tomllib.loads((SOURCE / "blender_manifest.toml").read_text())
        self.assertEqual(manifest["schema_version"], "1.0.0")
        self.assertEqual(manifest["type"], "add-on")
        self.assertRegex(manifest["id"], r"^[a-z_]+$")
        self.assertGreaterEqual(tuple(map(int, manifest["blender_version_min"].split("."))), (4, 2, 0))
        self.assertLessEqual(len(manifest["tagline"]), 64)
        self.assertFalse(manifest["tagline"].endswith("."))
        self.assertTrue(manifest["license"][0].startswith("SPDX:"))


if __name__ == "__main__":
    unittest.main()
