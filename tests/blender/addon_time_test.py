"""Frame rates, first frames and slow motion of Blender's scenes, as bakes have them."""
import bpy
import numpy as np

from addon_case import AddonCase, addon, main, versions


class TimeTest(AddonCase):
    def compiled(self, tree):
        return addon("bake.compiler").compile_tree(tree, self.scene).description

    def test_the_rate_is_the_ratio_that_blenders_base_stands_for(self):
        tree, _ = self.tree()
        for fps, base, wanted in ((24, 1, 24), (24, 1.001, [24000, 1001]), (30, 1.001, [30000, 1001]), (60, 1.001, [60000, 1001]),
                                  (24, 1.2, 20), (25, 2, [25, 2]), (24, 1.0833333, [8000000, 361111]), (97, 1.083331, 89.53865)):
            self.scene.render.fps, self.scene.render.fps_base = fps, base
            self.assertEqual(self.compiled(tree)["frame_rate"], wanted, (fps, base))

    def test_a_shot_of_a_ratio_is_baked_and_stays_up_to_date(self):
        self.scene.render.fps, self.scene.render.fps_base = 24, 1.001
        tree, _ = self.tree()
        self.bake(tree)
        self.assertEqual(self.manifest(tree).graph["frame_rate"], [24000, 1001])
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])

    def test_a_shot_may_begin_at_zero_before_it_or_far_behind(self):
        tree, _ = self.tree()
        result, = self.results(tree)
        shapes = []
        for start in (1, 0, -3, 1001):
            tree.use_scene_range, tree.frame_start, tree.frame_end = False, start, start + 5  # scenes begin at 0 at least
            self.bake(tree, start="RESTART")
            self.assertEqual(self.manifest(tree).numbers, list(range(start, start + 6)))
            played = self.played(result, range(start, start + 6))
            self.assertNotEqual(played[0], played[5])
            shapes.append(played)
        self.assertTrue(all(played == shapes[0] for played in shapes))

    def test_slow_motion_is_baked_played_and_gone_on_with(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        plain = self.played(result, range(1, 7))
        self.scene.frame_end = 12
        nodes["solver"].time_scale = 0.5
        self.assertTrue(self.status(tree).is_stale)
        self.bake(tree)
        slow = self.played(result, range(1, 13))
        for i in range(6):
            self.assertEqual(slow[2 * i], plain[i], i)
        self.assertNotIn(slow[3], plain)
        # With another material from a frame on: states that were simulated are taken over, and no others.
        nodes["body"].set_parameters(youngs_modulus=5e7)
        self.assertEqual(self.bake(tree, start="FROM_FRAME", frame=7), {"FINISHED"})
        changed = self.played(result, range(1, 13))
        self.assertEqual(changed[:7], slow[:7])
        self.assertNotEqual(changed[11], slow[11])

    def test_previews_have_the_strengths_of_the_frame_that_was_simulated(self):
        """At half the pace frame 7 is simulated frame 4, 8 lies before 5, and 9 is 5: there a seam has weakened."""
        tree, nodes = self.tree(pieces=20, material={"toughness": 10.0})
        seam = self.node(tree, "seam", mode="scale", between="all")
        for frame, factor in ((4, 1.0), (5, 0.5)):
            seam.toughness = factor
            self.assertTrue(seam.keyframe_insert("toughness", frame=frame))
        for link in [link for link in tree.links if link.from_node == nodes["body"]]:
            tree.links.remove(link)
        self.connect(nodes["body"], "body", seam, "body")
        for name, socket in (("solver", "bodies"), ("deformer", "body")):
            self.connect(seam, "body", nodes[name], socket)
        self.scene.frame_end = 11
        nodes["solver"].set_parameters(time_scale=0.5, accelerations=True)
        self.results(tree)
        self.bake(tree)
        data, folder = addon("preview.preview_source"), self.cached(tree)
        source = data.Source(str(folder), self.manifest(tree).graph, "deformer")
        source.start(), source.wait()
        for frame, factor in ((7, 1.0), (8, 0.5), (9, 0.5)):
            drawn = source.frame(str(folder / f"state/solver.{frame:04d}.ply"), "EDGES", 0.0, "STRENGTH")
            shades = drawn.particles[drawn.edges.follows[drawn.edges.lines[:, 0], 2], 3, :3]
            self.assertGreater(len(shades), 20)
            np.testing.assert_allclose(shades, data.strength(np.full(len(shades), factor)), atol=1e-4, err_msg=str(frame))

    def test_a_scale_that_is_keyed_plays_what_is_simulated_at_its_own_time(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        plain = self.played(result, range(1, 7))
        solver = nodes["solver"]
        for frame, scale in ((1, 1), (5, 0.5)):  # frame 5 shows 1 + 4 (1 + 0.5) / 2 = 4, frame 9 shows 6
            solver.time_scale = scale
            solver.keyframe_insert("time_scale", frame=frame)
        self.make_linear(tree)
        self.scene.frame_end = 9
        self.assertTrue(self.status(tree).is_stale)
        self.bake(tree)
        slow, whole = self.played(result, range(1, 10)), {}
        for frame in range(1, 10):
            path = self.manifest(tree).frames[frame]["solver:bake"]
            at = addon("base.core").sunder().read_state(str(self.cached(tree) / path)).simulated_frame
            if at == int(at):
                whole[frame] = int(at)
                self.assertEqual(slow[frame - 1], plain[int(at) - 1], frame)
            else:
                self.assertNotIn(slow[frame - 1], plain)
        self.assertEqual(whole, {1: 1, 5: 4, 7: 5, 9: 6})
        bpy.ops.sunder.report(tree=tree.name)  # what broke is told at the frames that show it
        told = addon("interface.report").lists()
        self.assertGreater(len(told.breaks), 0)
        self.assertTrue(all(row.frame <= 9 for row in told.breaks) and any(row.frame not in whole for row in told.breaks))

    def make_linear(self, tree):
        for curve in versions().curves_of(tree.animation_data):
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"

    def test_keys_of_the_scale_are_in_frames_and_those_of_objects_in_simulated_ones(self):
        tree, nodes = self.tree()
        wall = nodes["collider"]
        thing = self.cube(name="Wall")
        thing.keyframe_insert("location", frame=1)
        thing.location.x = 5
        thing.keyframe_insert("location", frame=11)
        wall.source, wall.object = "OBJECT", thing
        nodes["solver"].time_scale = 1
        nodes["solver"].keyframe_insert("time_scale", frame=1)
        nodes["solver"].time_scale = 3
        nodes["solver"].keyframe_insert("time_scale", frame=6)
        self.make_linear(tree)
        graph = self.compiled(tree)["nodes"]
        self.assertEqual([frame for frame, _ in graph["solver"]["time_scale"]["keys"]], [1, 2, 3, 4, 5, 6])
        self.assertEqual(graph["collider"]["position"]["keys"][-1][0], 11)  # 1 + 10 simulated frames
        tree.animation_data_clear()
        nodes["solver"].time_scale = 1
        self.assertEqual(self.compiled(tree)["nodes"]["collider"]["position"]["keys"][-1][0], 6)

    def test_sub_frames_are_baked_and_shown_between_frames(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        nodes["deformer"].topology, nodes["solver"].accelerations = "constant", True
        self.bake(tree)
        whole = self.played(result, range(1, 7))
        tree.subframes = 2
        self.assertTrue(self.status(tree).is_stale)
        self.bake(tree, start="RESTART")
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        self.assertEqual(self.played(result, range(1, 7)), whole)
        manifest, folder = self.manifest(tree), self.cached(tree)
        self.assertEqual(manifest.numbers, list(range(1, 7)))
        reader, node = addon("base.bake_reader"), result.sunder.node
        for frame in (2, 3, 5):
            self.scene.frame_set(frame, subframe=0.5)
            baked = reader.read_mesh_frame(folder / manifest.frames[frame + 0.5][f"{node}:bake"])
            np.testing.assert_array_equal([v.co for v in result.data.vertices], baked.positions)
            # What lies between two that are baked is drawn along a parabola.
            self.scene.frame_set(frame, subframe=0.625)
            t = np.float32(0.125 * self.scene.render.fps_base / self.scene.render.fps)
            drawn = baked.positions + t * baked.velocities + t * t / 2 * baked.accelerations
            np.testing.assert_allclose([v.co for v in result.data.vertices], drawn, atol=1e-6)
            values = [a.vector for a in result.data.attributes["acceleration"].data]
            np.testing.assert_array_equal(values, baked.accelerations)

    def test_a_mesh_whose_faces_change_stays_that_of_the_whole_frame(self):
        tree, _ = self.tree()
        result, = self.results(tree)
        tree.subframes = 2
        self.bake(tree)
        for frame in (3, 4, 5):
            self.scene.frame_set(frame)
            faces = len(result.data.polygons)
            for subframe in (0.2, 0.4):
                self.scene.frame_set(frame, subframe=subframe)
                self.assertEqual(len(result.data.polygons), faces)

    def played(self, result, frames):
        found = []
        for frame in frames:
            self.scene.frame_set(frame)
            found.append([tuple(v.co) for v in result.data.vertices])
        return found


if __name__ == "__main__":
    main()
