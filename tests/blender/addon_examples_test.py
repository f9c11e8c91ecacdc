"""examples/blend.py: the tree that it makes of an example is the example's graph, by its description and by its numbers."""
import importlib.util
import json
import sys
from pathlib import Path
from unittest import mock

import bpy
import numpy as np

from addon_case import ObjectCase, addon, main

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAMES = ("pawn", "bridge", "tank", "vase", "arch", "mend", "arm", "blast")

_spec = importlib.util.spec_from_file_location("blend", EXAMPLES / "blend.py")
blend = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(blend)


def expanded(value, frame):
    """What keys, linear between frames, give at one; a value is itself."""
    if not blend.is_keyed(value):
        return value
    keys = value["keys"]
    columns = np.array([np.ravel(v) for _, v in keys], float)
    found = [float(np.interp(frame, [f for f, _ in keys], column)) for column in columns.T]
    return found if isinstance(keys[0][1], list) else found[0]


class Examples(ObjectCase):
    def plain(self, name):
        return addon("base.core").sunder().Graph.load(str(EXAMPLES / (name + ".json")))

    def test_each_says_what_its_graph_file_says(self):
        for name in NAMES:
            with self.subTest(name):
                self.setUp()
                compiled = self.compiled(blend.build(name)).description
                wanted = json.loads((EXAMPLES / (name + ".json")).read_text())
                self.assertEqual(compiled["frame_range"], wanted["frame_range"])
                self.assertEqual(compiled["frame_rate"], wanted["frame_rate"])
                for node, fields in wanted["nodes"].items():
                    if fields["type"] in blend.BAKES or fields["type"] == "mesh_file":
                        continue
                    self.same_fields(f"{name}.{node}", compiled["nodes"][node], fields)

    def same_fields(self, where, found, wanted):
        defaults = {p["name"]: p["default"] for p in addon("base.descriptions").parameters(wanted["type"])}
        for parameter, value in wanted.items():
            if parameter == "path":
                self.assertTrue(Path(found["path"]).samefile(EXAMPLES / value))
                continue
            there = found.get(parameter, defaults.get(parameter))
            for frame in (1, 4, 13, 20, 34) if blend.is_keyed(value) else (1,):
                a, b = expanded(value, frame), expanded(there, frame)
                if isinstance(a, (int, float)) and not isinstance(a, bool) or isinstance(a, list) and not isinstance(a[0], str):
                    np.testing.assert_allclose(b, a, rtol=1e-5, atol=1e-5, err_msg=f"{where}.{parameter} at {frame}")
                else:
                    self.assertEqual(b, a, f"{where}.{parameter}")

    def test_each_has_the_numbers_of_its_graph_file(self):
        for name in NAMES:
            with self.subTest(name):
                self.setUp()
                mine, plain = self.graph(blend.build(name)), self.plain(name)
                for frame in (1, 2):
                    a, b = (graph.evaluate("solver.state", frame=frame) for graph in (mine, plain))
                    self.assertEqual(len(a.edge_intact), len(b.edge_intact), name)
                    self.assertLess(np.abs(a.position - b.position).max(), 1e-5, (name, frame))

    def test_the_file_that_it_writes_bakes(self):
        out = self.folder / "arch.blend"
        with mock.patch.object(sys, "argv", ["blender", "--", "arch", str(out)]):
            blend.main()
        self.reopen("arch.blend")
        self.scene.frame_end = 3
        tree = bpy.data.node_groups["Arch"]
        self.assertEqual(self.bake(tree), {"FINISHED"})
        self.assertEqual((self.status(tree).state, self.manifest(tree).numbers), ("complete", [1, 2, 3]))
        self.scene.frame_set(2)
        shown = {thing.name for thing in addon("tree.trees").result_objects(tree)}
        self.assertEqual(len(shown), 2, shown)  # the arch and the ball
        self.assertTrue(bpy.data.objects["Mesh"].hide_get())

    def test_an_example_that_is_not_there_is_refused_with_the_names_of_all(self):
        with mock.patch.object(sys, "argv", ["blender", "--", "castle", "x.blend"]), self.assertRaises(SystemExit) as caught:
            blend.main()
        self.assertRegex(str(caught.exception), "arch.*pawn")


main()
