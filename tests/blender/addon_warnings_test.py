"""What the library warns of stands on the nodes and in the bake's result, and settled bodies begin at rest."""
import contextlib
import ctypes
import os
import tempfile

import bmesh
import bpy
import numpy as np

from addon_case import AddonCase, addon, main, positions
from addon_rows_test import Recorder


@contextlib.contextmanager
def printed():
    """A list that holds in the end what was printed, by Blender's own code, too, which writes what operators report."""
    found, libc = [], ctypes.CDLL(None)
    libc.fflush(None)
    with tempfile.TemporaryFile("w+") as file:
        before = os.dup(1)
        os.dup2(file.fileno(), 1)
        try:
            yield found
        finally:
            libc.fflush(None)
            os.dup2(before, 1)
            os.close(before)
        file.seek(0)
        found.append(file.read())


class Warned(AddonCase):
    def shelf(self, **body):
        """A plank that is held at one end, weighs and settles, and a floor far below; nodes by their type, and the result."""
        bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 1))
        plank = bpy.context.object
        plank.scale = (1.2, 0.2, 0.2)
        tree, nodes = self.tree(plank, pieces=24, fall_speed=0)
        nodes["body"].set_parameters(**{"angular_velocity": (0, 0, 0), "density": 2000, "youngs_modulus": 1e7, "settle": True,
                                        "yield": None, "fracture_energy": None, "toughness": None, **body})
        pin = self.node(tree, "pin", region="box", box_min=(-1, -1, 0), box_max=(-0.4, 1, 2))
        self.connect(nodes["body"], "body", pin, "body")
        self.connect(pin, "pin", nodes["solver"], "pins")
        result, = self.results(tree)
        return tree, nodes, result

    def drawn(self, node):
        layout = Recorder()
        node.draw_buttons(bpy.context, layout)
        return " ".join(layout.drawn)

    def sag(self, result, frame):
        self.scene.frame_set(frame)
        return 1.1 - positions(result)[:, 2].max(), 0.9 - positions(result)[:, 2].min()

    def test_what_settles_hangs_from_the_first_frame_on(self):
        tree, nodes, result = self.shelf()
        self.bake(tree)
        self.assertEqual(nodes["solver"].warnings, [])
        first, last = self.sag(result, 1)[1], self.sag(result, 6)[1]
        self.assertGreater(first, 0.005)
        self.assertAlmostEqual(last, first, delta=0.1 * first)
        nodes["body"].settle = False
        self.assertTrue(self.status(tree).is_stale)
        self.bake(tree)
        self.assertAlmostEqual(self.sag(result, 1)[1], 0, delta=1e-6)

    def test_what_its_weight_would_break_stands_on_the_solver_and_in_the_result(self):
        tree, nodes, _ = self.shelf(toughness=0.002)
        with printed() as text:
            self.assertEqual(self.bake(tree), {"FINISHED"})
        sentence, = nodes["solver"].warnings
        self.assertIn(f"Warning: Sunder: 6 frames baked; solver: {sentence}\n", text[0])
        self.assertIn("break under the weight that they settled to", sentence)
        self.assertEqual(addon("bake.bake_warnings").of_bake(tree), {"solver": [sentence]})
        self.assertIn("under the weight", self.drawn(nodes["solver"]))
        self.assertNotIn("under the weight", self.drawn(nodes["body"]))
        panel = Recorder()
        addon("interface.bake_buttons").draw_tree(panel, tree, self.scene)
        self.assertIn("Solver:", " ".join(panel.drawn))
        # It is of the bake: kept in files and where a bake goes on, gone with its cause and with the bake.
        name = tree.name
        self.save()
        self.reopen()
        tree = bpy.data.node_groups[name]
        solver = next(n for n in tree.nodes if n.sunder_type == "solver")
        self.assertEqual(solver.warnings, [sentence])
        self.scene.frame_end = 8
        self.bake(tree)
        self.assertEqual([self.manifest(tree).numbers[-1], solver.warnings], [8, [sentence]])
        next(n for n in tree.nodes if n.sunder_type == "body").set_parameters(toughness=None)
        self.bake(tree)
        self.assertEqual(solver.warnings, [])
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertEqual(solver.warnings, [])

    def test_a_blast_before_the_shot_and_what_a_method_leaves_out_are_told(self):
        tree, nodes = self.tree(material={"toughness": 0.01, "fracture_energy": 3.0})
        blast = self.node(tree, "blast", frame=0)
        blast.source = "VALUES"
        self.connect(blast, "force", nodes["solver"], "forces")
        nodes["solver"].set_parameters(method="jacobi")
        self.bake(tree)
        self.assertEqual(blast.warnings, ["never goes off: its frame 0 lies before the first, 1"])
        self.assertIn("never goes off", self.drawn(blast))
        told, = nodes["solver"].warnings
        self.assertIn("breaks as with fracture_energy null", told)

    def test_a_mesh_that_was_mended_is_told_on_the_node_that_mended_it(self):
        block = self.cube()
        edit = bmesh.new()
        edit.from_mesh(block.data)
        bmesh.ops.subdivide_edges(edit, edges=edit.edges, cuts=4, use_grid_fill=True)
        edit.faces.ensure_lookup_table()
        bmesh.ops.delete(edit, geom=[edit.faces[0]], context="FACES_ONLY")
        edit.to_mesh(block.data)
        edit.free()
        tree, nodes = self.tree(block)
        nodes["prefracture"].set_parameters(repair="auto")
        self.bake(tree)
        self.assertEqual(len(nodes["prefracture"].warnings), 1, nodes["prefracture"].warnings)
        self.assertIn("hole", nodes["prefracture"].warnings[0])
        self.assertEqual(nodes["solver"].warnings, [])
        self.assertIn("hole", self.drawn(nodes["prefracture"]))

    def test_all_fields_at_once_move_things_in_a_bake_as_the_program_does_without_blender(self):
        tree, nodes = self.tree()
        kinds = {"point_force": "FORCE", "vortex": "VORTEX", "turbulence": "TURBULENCE", "force": "WIND"}
        for kind, field in kinds.items():
            bpy.ops.object.effector_add(type=field, location=(1, 0.5, 0.5))
            bpy.context.object.field.strength = 9
            node = self.node(tree, kind, **({"drag": 3} if kind == "force" else {}))
            node.source, node.object = "OBJECT", bpy.context.object
            self.connect(node, "force", nodes["solver"], "forces")
        result, = self.results(tree)
        self.bake(tree)
        self.assertEqual(nodes["solver"].warnings, [])
        self.scene.frame_set(6)
        blown = positions(result)
        sunder = addon("base.core").sunder()
        graph = sunder.Graph.load(str(self.cached(tree) / "graph.json"))
        np.testing.assert_array_equal(blown, graph.evaluate("deformer.mesh", 6).positions)
        for node in [n for n in tree.nodes if n.sunder_type in kinds]:
            tree.nodes.remove(node)
        self.bake(tree)
        self.scene.frame_set(6)
        still = positions(result)
        self.assertGreater(np.abs(blown.mean(0) - still.mean(0)).max(), 0.01)


if __name__ == "__main__":
    main()
