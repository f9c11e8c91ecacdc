"""What bodies hit and hang on is rigged: colliders and pins are where Blender has the armature's skin, and what is baked needs no rig."""
import io
import math

import bpy
import numpy as np

from addon_case import main, versions
from rigged_case import RiggedCase

LAST = 6


class Deforming(RiggedCase):
    def struck(self, **parameters):
        """A cube of crumbs beside the arm's end, which swings into it."""
        thing, rig = self.arm(degrees=50, shift=0)
        cube = self.cube(size=0.2, location=(0, -0.35, 1.1))
        tree, nodes = self.tree(cube, pieces=8)
        collider = self.node(tree, "collider", shape="mesh", motion="vertices", **parameters)
        collider.source, collider.object = "OBJECT", thing
        self.connect(collider, "collider", nodes["solver"], "colliders")
        nodes["solver"].set_parameters(gravity=(0, 0, 0))
        nodes["body"].set_parameters(velocity=(0, 0, 0), angular_velocity=(0, 0, 0))
        return tree, collider, thing, rig

    def read(self, tree, node):
        """(frames, vertices, 3) of what is beside the bake for a node."""
        compiled = self.compiled(tree)
        fields = compiled.description["nodes"][node]
        self.assertEqual(fields["motion"], "vertices")
        self.assertEqual(fields["first_frame"], 1)
        return np.load(io.BytesIO(compiled.files[fields["motion_path"]]))

    def test_a_rigged_collider_is_where_blender_has_it_and_strikes(self):
        tree, collider, thing, _ = self.struck()
        frames = self.read(tree, collider.graph_name)
        for frame in (1, 3, LAST):
            wanted = self.shown(thing, frame)
            away = np.linalg.norm(wanted[:, None] - frames[frame - 1][None], axis=2)
            self.assertLess(away.min(axis=1).max(), 1e-9, frame)
        graph = self.graph(tree)
        state = graph.evaluate("solver.state", frame=LAST)
        # The arm's end goes at 0.6 m * 50 degrees in 5 frames: 2.5 m/s. It turns about x, towards -y.
        self.assertLess(state.velocity[:, 1].mean(), -0.5)
        end = self.shown(thing, LAST)[-8:].mean(axis=0)
        self.assertGreater(np.linalg.norm(state.position - end, axis=1).min(), 0.05)

    def test_what_is_baked_needs_no_rig_and_knows_when_it_moves_otherwise(self):
        tree, _, _, rig = self.struck()
        self.bake(tree)
        files = sorted(p.suffix for p in (self.cached(tree) / "inputs").iterdir())
        self.assertEqual(files, [".npy", ".ply", ".ply"])
        self.assertIs(self.status(tree).is_stale, False)
        versions().curves_of(rig.animation_data)[0].keyframe_points[1].co.y += 0.2
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)

    def test_another_number_of_vertices_is_refused_on_the_node_with_the_frame(self):
        tree, collider, thing, _ = self.struck()
        levels = thing.modifiers.new("more", "SUBSURF")
        for frame, value in ((1, 1), (3, 2)):
            levels.levels = value
            levels.keyframe_insert("levels", frame=frame)
        self.refusal(tree)
        self.assertRegex(collider.error, "vertices at frame [23].*must keep their number")

    def test_a_pin_holds_what_the_rig_takes_along(self):
        thing, _ = self.arm(degrees=50, shift=0)
        tree, nodes = self.tree(thing, pieces=12)
        pin = self.node(tree, "pin", motion="vertices", region="box", box_min=(-1, -1, 0.8), box_max=(1, 1, 2))
        pin.source = "VALUES"
        self.connect(nodes["body"], "body", pin, "body")
        self.connect(pin, "pin", nodes["solver"], "pins")
        nodes["solver"].set_parameters(gravity=(0, 0, 0))
        nodes["body"].set_parameters(velocity=(0, 0, 0), angular_velocity=(0, 0, 0))
        graph = self.graph(tree)
        state = graph.evaluate("solver.state", frame=LAST)
        held = state.rest_position[:, 2] > 0.95
        self.assertGreater(held.sum(), 1)
        angle = math.radians(50)
        rest = state.rest_position[held] - [0, 0, 0.6]
        c, s = math.cos(angle), math.sin(angle)
        wanted = rest @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) + [0, 0, 0.6]
        # The upper bone has their skin from 0.9 m on: what bends below that is in their best map. They went 0.3 m and more.
        self.assertLess(np.abs(state.position[held] - wanted).max(), 0.005)
        pin.from_object = False
        self.refusal(tree)


    def on_the_arm(self):
        """A cube beside the arm's upper end, all of it pinned to the arm's mesh."""
        thing, rig = self.arm(degrees=50, shift=0)
        cube = self.cube(size=0.2, location=(0.25, 0, 1.1))
        tree, nodes = self.tree(cube, pieces=8)
        pin = self.node(tree, "pin", motion="surface", region="box", box_min=(-1, -1, 0), box_max=(1, 1, 2))
        pin.source, pin.motion_object = "VALUES", thing
        self.connect(nodes["body"], "body", pin, "body")
        self.connect(pin, "pin", nodes["solver"], "pins")
        nodes["solver"].set_parameters(gravity=(0, 0, 0))
        return tree, pin, thing, rig

    def test_a_pin_holds_what_another_objects_rig_takes_along(self):
        tree, pin, thing, rig = self.on_the_arm()
        state = self.graph(tree).evaluate("solver.state", frame=LAST)
        angle = math.radians(50)
        c, s = math.cos(angle), math.sin(angle)
        wanted = (state.rest_position - [0, 0, 0.6]) @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) + [0, 0, 0.6]
        # The arm is rigid from 0.9 m on, and the cube lies beside that.
        self.assertLess(np.abs(state.position - wanted).max(), 1e-5)
        self.assertGreater(np.abs(state.position - state.rest_position).max(), 0.3)
        self.bake(tree)
        self.assertIs(self.status(tree).is_stale, False)
        rig.animation_data.action.fcurves[0].keyframe_points[1].co.y += 0.2
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)

    def test_a_pin_refuses_another_object_that_is_no_mesh_or_changes_its_vertices(self):
        tree, pin, thing, _ = self.on_the_arm()
        levels = thing.modifiers.new("more", "SUBSURF")
        for frame, value in ((1, 1), (3, 2)):
            levels.levels = value
            levels.keyframe_insert("levels", frame=frame)
        self.refusal(tree)
        self.assertRegex(pin.error, "vertices at frame [23].*must keep their number")
        bpy.ops.object.empty_add()
        pin.motion_object = bpy.context.object
        self.refusal(tree)
        self.assertIn("not a mesh", pin.error)


main()
