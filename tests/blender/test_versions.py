"""The add-on is one for Blender 3.4 to 5.2: names that came or went stand in one file, where their absence is met.

The list below is taken from the release notes of 3.5 to 5.0, and from what the matrix of Blenders found (tests/hosts).
"""
import ast
import re
import sys
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2] / "plugin_src/blender/sunder_addon"
SCRIPTS = SOURCE.parent  # they run in Blender, without the add-on or beside it
DIFFERENCES = "blender_versions.py"  # where what differs between versions is used

# Name: what happened to it. Use is allowed in DIFFERENCES alone, in a function that asks first: hasattr, getattr with a default,
# bpy.app.version or a constant made of it, `in ....bl_rna.properties`, `is_readonly`, or except AttributeError.
GUARDED = {
    "use_auto_smooth": "gone in 4.1",
    "auto_smooth_angle": "gone in 4.1",
    "calc_normals_split": "gone in 4.1",
    "free_normals_split": "gone in 4.1",
    "fcurves": "of an action: gone in 5.0",
    "layers": "of an action: new in 4.4",
    "action_slot": "of animation data and strips: new in 4.4",
    "channelbags": "of an action's strip: new in 4.4",
    "BLENDER_EEVEE": "BLENDER_EEVEE_NEXT from 4.2 to 4.5",
    "BLENDER_EEVEE_NEXT": "from 4.2 to 4.5 alone",
    "use_gtao": "gone in 4.2",
    "use_soft_shadows": "gone in 4.2",
    "custom_normal": "normals of corners from 4.5 on",
    ".corner_vert": "an attribute of meshes from 3.6 on",
    "draw_color": "of a socket: draw_color_simple from 4.0",
    "draw_color_simple": "new in 4.0",
    "2D_FLAT_COLOR": "FLAT_COLOR from 4.0",
    "3D_FLAT_COLOR": "FLAT_COLOR from 4.0",
    "use_nodes": "of a material: always on from 5.0, to go in 6.0",
    "use_screen_space_refraction": "of a material: gone after 4.1",
    "use_raytrace_refraction": "of a material: new in 4.2",
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
    "2D_IMAGE": "IMAGE from 4.0",
    "3D_SMOOTH_COLOR": "SMOOTH_COLOR from 4.0",
    "3D_POLYLINE_UNIFORM_COLOR": "POLYLINE_UNIFORM_COLOR from 4.0",
    "create_normals_split": "gone in 4.1",
    "bevel_weight": "of vertices and edges: an attribute from 4.0",
    "crease": "of edges: an attribute from 4.0",
    "use_bloom": "gone in 4.2",
    "blend_method": "of a material: surface_render_method from 4.2",
    "shadow_method": "of a material: gone in 4.2",
    "sequences": "strips from 4.4",
    "compositing_node_group": "new in 5.0, where scene.node_tree went",
    "grease_pencils": "other data from 4.3",
    "nodeitems_utils": "menus are drawn without it",
    "import_mesh": "operators gone in 4.2",
    "export_mesh": "operators gone in 4.2",
}
GUARD = re.compile(r"hasattr\(|getattr\([^)]*,[^)]*,|bpy\.app\.version|HAS_[A-Z_]+|bl_rna\.properties|is_readonly|"
                   r"except (Attribute|Type)Error")


def _is_of_bmesh(node):
    """Whether an attribute is `layers` of a bmesh, which all versions have."""
    return node.attr == "layers" and getattr(node.value, "attr", "") in ("verts", "edges", "faces", "loops")


def names(tree):
    """(name, line, innermost function) of every attribute, import and string."""

    def visit(node, function):
        if isinstance(node, ast.FunctionDef):
            function = node
        if isinstance(node, ast.Attribute) and not _is_of_bmesh(node):
            yield node.attr, node.lineno, function
        elif isinstance(node, ast.alias):
            yield node.name, node.lineno, function
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value, node.lineno, function
        for child in ast.iter_child_nodes(node):
            yield from visit(child, function)

    return visit(tree, None)


def unguarded(source, may_guard=True):
    """Names of the lists that stand in a source without a guard: [(name, line, what happened to it)]. `may_guard`: with one
    they may stand there."""
    found = []
    for name, line, function in names(ast.parse(source)):
        if name in NEVER:
            found.append((name, line, NEVER[name]))
        if name in GUARDED:
            text = ast.get_source_segment(source, function) if function else source.splitlines()[line - 1]
            if not may_guard or not GUARD.search(text):
                found.append((name, line, GUARDED[name]))
    return found


class Versions(unittest.TestCase):
    def test_names_that_came_or_went_are_asked_for_first(self):
        for path in sorted([*SOURCE.rglob("*.py"), *SCRIPTS.glob("*.py")]):
            with self.subTest(path.name):
                self.assertEqual(unguarded(path.read_text(), path.name == DIFFERENCES), [])

    def test_operators_get_their_context_by_temp_override(self):
        """A dictionary as their first argument is refused from 4.0 on: what is handed on may be how they run, a text."""
        for path in sorted([*SOURCE.rglob("*.py"), *SCRIPTS.glob("*.py")]):
            for call in (n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Call)):
                if ast.unparse(call.func).startswith("bpy.ops."):
                    with self.subTest(path.name, line=call.lineno):
                        self.assertFalse(any(isinstance(a, (ast.Dict, ast.Call)) for a in call.args))
                        self.assertLessEqual(len(call.args), 1)

    def test_classes_that_blender_makes_have_no_makers_of_their_own(self):
        """From 4.4 on they would have to hand Blender's arguments on."""
        for path in sorted([*SOURCE.rglob("*.py"), *SCRIPTS.glob("*.py")]):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef) and any("bpy.types" in ast.unparse(b) for b in node.bases):
                    made = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
                    self.assertFalse(made & {"__init__", "__new__", "__del__"}, f"{path.name}: {node.name}")

    def test_no_property_of_ours_is_reached_by_subscript(self):
        """From 5.0 on what bpy.props defined is no longer there: only names that we write by subscript are read so."""
        for path in sorted(SOURCE.rglob("*.py")):
            source = path.read_text()
            self.assertNotRegex(source, r"\.sunder\[|\[\"(cache_id|former_home|use_exact_normals|preview|interior_slot)\"\]")

    def test_the_number_of_a_polygons_corners_is_written_in_one_place(self):
        """It is read-only from 3.6 on."""
        for path in sorted([*SOURCE.rglob("*.py"), *SCRIPTS.glob("*.py")]):
            if path.name != DIFFERENCES:
                self.assertNotRegex(path.read_text(), r"set\([^)]*\"loop_total\"")

    def test_the_check_itself_sees_them(self):
        self.assertEqual(unguarded("def f(m):\n    m.calc_normals_split()"), [("calc_normals_split", 2, "gone in 4.1")])
        self.assertEqual(unguarded("def f(m):\n    if hasattr(m, 'use_auto_smooth'):\n        m.use_auto_smooth = True"), [])
        self.assertEqual(len(unguarded("def f(m):\n    if hasattr(m, 'use_auto_smooth'):\n        m.use_auto_smooth = True", False)),
                         2)
        self.assertEqual([n for n, *_ in unguarded("action.layers\nedit.faces.layers.int", False)], ["layers"])
        self.assertEqual([n for n, *_ in unguarded("import bgl\nbuiltin('2D_UNIFORM_COLOR')")], ["bgl", "2D_UNIFORM_COLOR"])

    def test_of_an_action_with_slots_each_user_has_its_own_curves(self):
        """Stand-ins for what 4.4 and later give; an action of before has its curves in one list."""
        from importlib import util
        from types import SimpleNamespace as Thing
        from unittest import mock

        spec = util.spec_from_file_location("versions", SCRIPTS / DIFFERENCES)
        versions = util.module_from_spec(spec)
        with mock.patch.dict(sys.modules, bpy=Thing(app=Thing(version=(4, 4, 0))), bmesh=Thing()):
            spec.loader.exec_module(versions)
        bags = [Thing(slot_handle=7, fcurves=["a", "b"]), Thing(slot_handle=8, fcurves=["c"])]
        action = Thing(layers=[Thing(strips=[Thing(channelbags=bags)])], fcurves=["a", "b"])
        self.assertEqual(versions.curves_of(Thing(action=action, action_slot=Thing(handle=8))), ["c"])
        self.assertEqual(versions.curves_of(Thing(action=Thing(layers=[]), action_slot=None)), [])
        self.assertEqual(versions.curves_of(Thing(action=Thing(fcurves=["d"]))), ["d"])
        self.assertEqual(versions.curves_of(Thing(action=None)), [])

    def test_the_package_has_whatever_name_blender_gives_it(self):
        """An extension of 4.2 and later is called bl_ext.REPOSITORY.sunder_addon."""
        for path in sorted(SOURCE.rglob("*.py")):
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
