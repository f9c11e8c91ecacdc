"""A body follows its object, rigged and animated, until it is let go: what Blender shows is what is baked."""
import math

import bpy
import numpy as np

from addon_case import main
from rigged_case import RiggedCase

LAST = 4  # the frame at which it follows for the last time


class Follow(RiggedCase):
    def following(self, thing, **parameters):
        tree, nodes = self.tree(thing, pieces=12)
        follow = self.node(tree, "follow", frame=LAST + 1, **parameters)
        solver = nodes["solver"]
        bodies = next(s for s in solver.inputs if s.identifier == "bodies")
        for link in list(bodies.links):
            tree.links.remove(link)
        self.connect(nodes["body"], "body", follow, "body")
        self.connect(follow, "body", solver, "bodies")
        return tree, follow, nodes

    def farthest(self, graph, thing, frame):
        """How far the artist's vertices are from those of the baked mesh."""
        wanted, mesh = self.shown(thing, frame), graph.evaluate("deformer.mesh", frame=frame)
        return np.linalg.norm(wanted[:, None] - mesh.positions[None], axis=2).min(axis=1).max()

    def test_a_rigged_body_is_where_blender_has_it_and_is_then_let_go(self):
        thing, _ = self.arm()
        tree, _, _ = self.following(thing, motion="vertices")
        graph = self.graph(tree)
        for frame in (1, 3, LAST):
            self.assertLess(self.farthest(graph, thing, frame), 2e-6, frame)
        self.assertTrue((graph.evaluate("solver.state", frame=LAST).kept == 1).all())
        gone = graph.evaluate("solver.state", frame=LAST + 1)
        self.assertFalse(gone.kept.any())
        self.assertGreater(gone.velocity[:, 0].mean(), 1)
        self.assertLess(gone.velocity[:, 2].mean(), 0)

    def test_an_animated_object_is_followed_as_one(self):
        thing = self.cube(location=(0, 0, 1))
        for frame, x, turn in ((1, 0, 0), (6, 1, 50)):
            thing.location.x, thing.rotation_euler.z = x, math.radians(turn)
            thing.keyframe_insert("location", frame=frame), thing.keyframe_insert("rotation_euler", frame=frame)
        tree, _, _ = self.following(thing)
        graph = self.graph(tree)
        for frame in (1, 2, LAST):
            self.assertLess(self.farthest(graph, thing, frame), 2e-6, frame)

    def test_what_is_baked_needs_no_rig(self):
        thing, rig = self.arm()
        tree, _, _ = self.following(thing, motion="vertices")
        self.bake(tree)
        files = sorted(p.suffix for p in (self.cached(tree) / "inputs").iterdir())
        self.assertEqual(files, [".npy", ".ply"])
        self.assertIs(self.status(tree).is_stale, False)
        rig.pose.bones["high"].keyframe_insert("rotation_euler", frame=3)
        rig.animation_data.action.fcurves[0].keyframe_points[1].co.y += 0.2
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)

    def test_another_number_of_vertices_is_refused_on_the_node_with_the_frame(self):
        thing = self.cube()
        levels = thing.modifiers.new("more", "SUBSURF")
        for frame, value in ((1, 1), (3, 2)):
            levels.levels = value
            levels.keyframe_insert("levels", frame=frame)
        tree, follow, _ = self.following(thing, motion="vertices")
        self.refusal(tree)
        self.assertRegex(follow.error, "vertices at frame [23].*must keep their number")

    def test_numbers_count_where_the_object_does_not(self):
        tree, follow, _ = self.following(self.cube())
        follow.from_object = False
        follow.set_parameters(position=(0, 0, 2))
        self.assertEqual(self.compiled(tree).description["nodes"]["follow"]["position"], [0, 0, 2])
        follow.from_object = True
        self.assertEqual(self.compiled(tree).description["nodes"]["follow"]["position"], [0, 0, 0.5])


main()
