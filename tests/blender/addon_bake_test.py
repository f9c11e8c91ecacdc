"""Baking: blocking and in a thread, stopped and gone on with, out of date, freed; and what result objects show of it."""
import shutil
import threading
import types
import unittest.mock

import bpy
import numpy as np
from mathutils import Matrix, Vector

from addon_case import AddonCase, addon, attribute, main, positions


def files(folder):
    """Bytes of every file of a bake but those that say when and by whom."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*.ply"))}


class Bake(AddonCase):
    def stopped(self, tree, frames):
        """A bake that was stopped once `frames` of it were whole."""
        job = addon("bake_job").BakeJob(tree, self.scene)
        progress = job._progress

        def stop(fraction, text):
            known = self.manifest(tree)
            if known and len(known.numbers) >= frames:
                job.cancel()
            return progress(fraction, text)

        job._progress = stop
        job.start()
        job.finish(tree)
        return job

    def test_a_bake_says_what_it_has(self):
        tree, nodes = self.tree()
        self.assertEqual([self.status(tree).state, self.status(tree).text], ["none", "not baked"])
        self.assertEqual(self.bake(tree), {"FINISHED"})
        now = self.status(tree)
        self.assertEqual([now.state, now.is_stale, now.text], ["complete", False, "baked 1 to 6"])
        check = addon("core").sunder().verify(str(self.cached(tree)))
        self.assertEqual([check["faults"], check["missing_frames"]], [[], []])

    def test_a_stopped_bake_goes_on_to_the_same_bits(self):
        tree, _ = self.tree()
        job = self.stopped(tree, 3)
        self.assertEqual([job.is_cancelled, job.error], [True, ""])
        part = self.manifest(tree).numbers
        self.assertTrue(3 <= len(part) < 6)
        self.assertEqual(self.status(tree).state, "partial")
        stamps = {n: (self.cached(tree) / f"mesh/deformer.{n:04d}.ply").stat().st_mtime_ns for n in part}
        self.assertEqual(self.bake(tree), {"FINISHED"})
        for n, stamp in stamps.items():
            self.assertEqual((self.cached(tree) / f"mesh/deformer.{n:04d}.ply").stat().st_mtime_ns, stamp)
        resumed = files(self.cached(tree))
        self.bake(tree, start="RESTART")
        self.assertEqual(files(self.cached(tree)), resumed)

    def test_a_longer_range_goes_on_and_a_shorter_one_leaves_what_is_there(self):
        tree, _ = self.tree()
        self.scene.frame_end = 3
        self.bake(tree)
        first = (self.cached(tree) / "state/solver.0002.ply").stat().st_mtime_ns
        self.scene.frame_end = 5
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["partial", False])
        self.bake(tree)
        self.assertEqual(self.manifest(tree).numbers, [1, 2, 3, 4, 5])
        self.assertEqual((self.cached(tree) / "state/solver.0002.ply").stat().st_mtime_ns, first)

    def test_every_kind_of_change_makes_it_out_of_date_and_undone_up_to_date(self):
        thing = self.cube()
        bpy.ops.object.empty_add(location=(0, 0, 5))
        mover = bpy.context.object
        wall = self.cube(size=1, location=(3, 0, 0), name="Wall")
        tree, nodes = self.tree(thing)
        nodes["collider"].source, nodes["collider"].object = "OBJECT", wall
        self.bake(tree)

        def now():  # edits by scripts reach the handlers when Blender next evaluates
            bpy.context.view_layer.update()
            return self.status(tree).is_stale

        def moved(value):
            thing.location.x = value

        def shaped(value):
            thing.data.vertices[0].co.x = -0.2 + value
            thing.data.update()

        def set_to(node, name):
            before = getattr(nodes[node], name)
            return lambda value: setattr(nodes[node], name, value + before)

        def wired(value):
            if value:
                tree.links.remove(nodes["collider"].outputs[0].links[0])
            else:
                self.connect(nodes["collider"], "collider", nodes["solver"], "colliders")

        changes = {
            "object": moved, "mesh": shaped, "toughness": set_to("body", "toughness"), "pieces": set_to("prefracture", "pieces"),
            "collider": lambda v: setattr(wall, "location", (3, 0, v)), "wire": wired,
            "mute": lambda v: setattr(nodes["collider"], "mute", bool(v)),
            "start": lambda v: setattr(self.scene, "frame_start", 1 + int(v)),
            "rate": lambda v: setattr(self.scene.render, "fps", 24 + int(v)),
            "motion": lambda v: setattr(nodes["body"], "use_motion", bool(v)),
            "modifiers": lambda v: thing.modifiers.new("m", "BEVEL") if v else thing.modifiers.clear(),
        }
        for name, change in changes.items():
            self.assertIs(now(), False, name)
            change(1)
            self.assertIs(now(), True, name)
            change(0)
            self.assertIs(now(), False, name)
        mover.location.z = 7  # has no part in it
        nodes["body"].name, nodes["body"].location = "Clay", (500, 0)
        self.assertIs(now(), False)

    def test_a_change_bakes_anew_into_the_same_folder(self):
        tree, nodes = self.tree()
        self.bake(tree)
        before, folder = files(self.cached(tree)), self.cached(tree)
        nodes["body"].toughness = 0.5
        nodes["mesh_file"].object.data.vertices[0].co.x -= 0.05
        self.bake(tree)
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        self.assertEqual(self.cached(tree), folder)
        after = files(folder)
        self.assertEqual(len(after), len(before))  # the old input mesh is gone
        self.assertNotEqual(after, before)

    def test_a_bake_stands_without_blender(self):
        tree, _ = self.tree()
        self.bake(tree)
        sunder, folder = addon("core").sunder(), self.cached(tree)
        graph = sunder.Graph.load(str(folder / "graph.json"))
        graph.bake(str(self.folder / "again"))
        self.assertEqual({n: d for n, d in files(folder).items() if not n.startswith("inputs/")}, files(self.folder / "again"))

    def test_free_removes_what_was_written_and_nothing_else(self):
        tree, _ = self.tree()
        self.bake(tree)
        mine = self.cached(tree) / "mesh/notes.txt"
        mine.write_text("mine")
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertEqual([p for p in self.cached(tree).rglob("*") if p.is_file()], [mine])
        self.assertEqual(self.status(tree).state, "none")
        mine.unlink()
        self.bake(tree)
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertFalse(self.cached(tree).exists())

    def test_bake_nodes_of_the_artist_write_too_and_are_freed_too(self):
        tree, nodes = self.tree()
        out = self.node(tree, "bake_mesh", path="export/clay.####.obj")
        self.connect(nodes["deformer"], "mesh", out, "mesh")
        self.bake(tree)
        self.assertEqual([p.name for p in sorted((self.cached(tree) / "export").iterdir())],
                         [f"clay.{n:04d}.obj" for n in range(1, 7)])
        out.path = "mesh/deformer.####.ply"  # where the result's own frames lie
        self.assertIn("writes the same file", self.refusal(tree))
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertFalse(self.cached(tree).exists())

    def test_a_range_of_its_own_that_begins_below_zero(self):
        tree, nodes = self.tree()
        tree.use_scene_range, tree.frame_start, tree.frame_end = False, -3, 2
        result, = self.results(tree)
        self.bake(tree)
        self.assertEqual(self.manifest(tree).numbers, [-3, -2, -1, 0, 1, 2])
        self.scene.frame_set(-3)
        self.assertEqual([nodes["deformer"].note, self.status(tree).state], ["baked -3 to 2", "complete"])
        lowest = positions(result)[:, 2].min()
        self.scene.frame_set(-2)  # it falls 0.25 m a frame from a height of 0.3 m
        self.assertLess(positions(result)[:, 2].min(), lowest)

    def test_names_in_any_language_and_with_blanks(self):
        self.folder = self.folder / "Ein Würfel für 山"
        self.folder.mkdir()
        self.save("größe 1.blend")
        thing = self.cube(name="Würfel 'A' \\ \"B\"")
        thing.vertex_groups.new(name="öben").add([0], 1, "REPLACE")
        tree, nodes = self.tree(thing)
        nodes["body"].name = 'Ton "weich" \\ 1'
        nodes["body"].keyframe_insert("toughness", frame=2)
        nodes["body"].toughness = 0.2
        nodes["body"].keyframe_insert("toughness", frame=4)
        pin = self.node(tree, "pin", region="group", group="öben")
        self.connect(nodes["body"], "body", pin, "body"), self.connect(pin, "pin", nodes["solver"], "pins")
        result, = self.results(tree)
        self.bake(tree)
        self.save("größe 1.blend")
        self.reopen("größe 1.blend")
        tree, = addon("tree").trees()
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        self.assertEqual(len(self.manifest(tree).graph["nodes"]["body"]["toughness"]["keys"]), 3)

    def test_two_bakes_of_one_tree_do_not_meet(self):
        tree, _ = self.tree()
        job = addon("bake_job").BakeJob(tree, self.scene)
        job.start()
        addon("runtime").jobs[tree.cache_id] = job
        self.assertIn("being baked already", self.refusal(tree))
        self.assertEqual(self.status(tree).state, "baking")
        job.finish(tree)
        self.assertEqual([self.status(tree).state, addon("runtime").jobs], ["complete", {}])

    def test_a_cache_that_cannot_be_written_is_told(self):
        tree, _ = self.tree()
        self.save()
        (self.folder / "sunder_cache").write_text("a file where the folder should be")
        self.assertIn("sunder_cache", self.refusal(tree))
        self.assertTrue(tree.nodes["Deformer"].error)

    def test_in_the_window_esc_stops_it_and_the_tree_shows_it(self):
        """The operator's own functions, with stand-ins for the window, which background mode has not."""
        tree, _ = self.tree()
        self.scene.frame_end = 500
        bake = addon("operators").SUNDER_OT_bake
        told, manager, space = [], unittest.mock.Mock(), unittest.mock.Mock()
        window = types.SimpleNamespace(window_manager=manager, workspace=space, scene=self.scene, object=None,
                                       space_data=None, window=None)
        operator = types.SimpleNamespace(tree=tree.name, start="AUTO", report=lambda kind, text: told.append((kind, text)))
        for name in ("find", "_begin", "_end", "_leave"):
            setattr(operator, name, types.MethodType(getattr(bake, name), operator))
        with unittest.mock.patch.object(bpy, "app", types.SimpleNamespace(background=False, tempdir=bpy.app.tempdir)):
            self.assertEqual(bake.invoke(operator, window, None), {"RUNNING_MODAL"})
        event = types.SimpleNamespace(type="TIMER")
        while len(self.manifest(tree).numbers if self.manifest(tree) else ()) < 2:
            self.assertEqual(bake.modal(operator, window, event), {"PASS_THROUGH"})
        self.assertEqual(bake.modal(operator, window, types.SimpleNamespace(type="LEFTMOUSE")), {"PASS_THROUGH"})
        self.assertIn("Esc: stop", space.status_text_set.call_args[0][0])
        self.assertEqual(bake.modal(operator, window, types.SimpleNamespace(type="ESC")), {"RUNNING_MODAL"})
        operator._job.wait()
        self.assertEqual(bake.modal(operator, window, event), {"CANCELLED"})
        self.assertEqual(told, [({"INFO"}, "Sunder: stopped; what is baked stays")])
        manager.event_timer_remove.assert_called_once(), manager.progress_end.assert_called_once()
        self.assertEqual([self.status(tree).state, addon("runtime").jobs], ["partial", {}])
        self.assertLess(len(self.manifest(tree).numbers), 500)

    def test_turning_the_addon_off_ends_its_bakes(self):
        tree, _ = self.tree()
        self.scene.frame_end = 2000
        job = addon("bake_job").BakeJob(tree, self.scene)
        job.start()
        bpy.ops.preferences.addon_disable(module="sunder_addon")
        self.assertFalse(job.is_running)
        bpy.ops.preferences.addon_enable(module="sunder_addon")


class Shown(AddonCase):
    def test_the_result_is_the_librarys_mesh_at_every_frame(self):
        tree, nodes = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        sunder = addon("core").sunder()
        graph = sunder.Graph.load(str(self.cached(tree) / "graph.json"))
        counts = set()
        for frame in (1, 4, 6, 2):
            self.scene.frame_set(frame)
            mesh, state = graph.evaluate("deformer.mesh", frame), graph.evaluate("solver.state", frame)
            np.testing.assert_array_equal(positions(thing), mesh.positions)
            corners = np.empty(len(thing.data.loops), np.int32)
            thing.data.loops.foreach_get("vertex_index", corners)
            np.testing.assert_array_equal(corners.reshape(-1, 3), mesh.triangles)
            np.testing.assert_array_equal(attribute(thing, "fragment"), mesh.face_fragment)
            np.testing.assert_allclose(attribute(thing, "strain"), state.strain[mesh.vertex_fragment], rtol=1e-6)
            plain = mesh.positions - state.position[mesh.vertex_fragment]
            velocity = state.velocity[mesh.vertex_fragment] + np.cross(state.angular_velocity[mesh.vertex_fragment], plain)
            np.testing.assert_allclose(attribute(thing, "velocity"), velocity, rtol=1e-5, atol=1e-5)
            thing.data.calc_normals_split()
            normals = np.empty(3 * len(thing.data.loops), np.float32)
            thing.data.loops.foreach_get("normal", normals)
            # Blender keeps custom normals in 16 bits an angle.
            np.testing.assert_allclose(normals.reshape(-1, 3), mesh.normals, atol=2e-3)
            self.assertFalse(thing.data.validate())
            counts.add(len(mesh.triangles))
        self.assertGreater(len(counts), 1)  # it tore, or this guards nothing

    def test_plastic_strain_is_that_of_a_known_stretch(self):
        tree, _ = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        reader, write = addon("bake_reader"), addon("result_mesh")
        path = str(self.cached(tree) / "state/solver.0001.ply")
        rows = reader.read_ply(path)["particle"].copy()
        for i, value in enumerate((2.0, 0.5, 1.0)):  # ln: 0.693, -0.693, 0
            rows[f"fp{i}{i}"] = value
        frame = reader.read_mesh_frame(str(self.cached(tree) / "mesh/deformer.0001.ply"))
        kind, strain = write.state_attributes(rows, 0, frame)["plastic_strain"]
        np.testing.assert_allclose(strain, np.sqrt(2 / 3) * np.sqrt(2) * np.log(2), rtol=1e-6)

    def test_outer_materials_stay_and_breaks_have_their_own(self):
        thing = self.cube()
        for name in ("Paint", "Primer", "Unused"):
            thing.data.materials.append(bpy.data.materials.new(name))
        thing.data.polygons[0].material_index = 1
        tree, _ = self.tree(thing)
        result, = self.results(tree)
        self.assertEqual([s.name for s in result.material_slots], ["Paint", "Primer", "Unused", "Sunder Interior"])
        self.bake(tree)
        for frame, wanted in ((1, {0, 1}), (6, {0, 1, 3})):
            self.scene.frame_set(frame)
            slots = np.array([p.material_index for p in result.data.polygons])
            self.assertEqual(set(slots), wanted)
            np.testing.assert_array_equal(attribute(result, "interior"), slots == 3)
        outer = result.data.uv_layers["UVMap"].data
        known = {tuple(np.round(l.uv, 4)) for l in thing.data.uv_layers.active.data}
        found = np.array([outer[i].uv for p in result.data.polygons if p.material_index < 3 for i in p.loop_indices])
        for uv in known:  # the library takes UVs a little inside a triangle, so that seams do not run across it
            self.assertLess(np.linalg.norm(found - uv, axis=1).min(), 2e-3, uv)
        self.assertTrue(0 <= found.min() and found.max() <= 1)

    def test_the_last_baked_frame_is_shown_and_the_node_says_so(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.assertEqual(nodes["deformer"].note, "nothing baked yet")
        self.assertGreater(len(result.data.vertices), 0)  # the source, for the time being
        self.scene.frame_end = 3
        self.bake(tree)
        self.scene.frame_end = 6
        self.scene.frame_set(3)
        there = positions(result)
        self.scene.frame_set(5)
        np.testing.assert_array_equal(positions(result), there)
        self.assertEqual(nodes["deformer"].note, "baked 1 to 3; frame 5 shows 3")
        self.scene.frame_set(-4)
        self.assertEqual(nodes["deformer"].note, "baked 1 to 3; frame -4 shows 1")

    def test_a_result_that_is_edited_or_sculpted_is_left_alone(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        bpy.context.view_layer.objects.active = result
        for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT"):
            bpy.ops.object.mode_set(mode=mode)
            self.scene.frame_set(5)
            self.assertRegex(nodes["deformer"].note, f"frame 5 cannot be shown: .* is in {mode.lower().replace('_', ' ')} mode")
            bpy.ops.object.mode_set(mode="OBJECT")
            self.scene.frame_set(4)
            self.assertEqual(nodes["deformer"].note, "baked 1 to 6")

    def test_a_scene_does_not_move_what_another_shows(self):
        tree, _ = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(2)
        there = positions(result)
        other = bpy.data.scenes.new("Other")
        other.frame_set(6)
        np.testing.assert_array_equal(positions(result), there)

    def test_sub_frames_show_the_nearest_frame(self):
        tree, nodes = self.tree()
        self.results(tree)
        self.bake(tree)
        for frame, part, shown in ((3, 0.25, 3), (3, 0.75, 4), (4, 0.0, 4)):
            self.scene.frame_set(frame, subframe=part)
            self.assertEqual(addon("player").nearest_frame(self.scene), shown)

    def test_a_damaged_frame_is_told_and_the_others_play(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        path = self.cached(tree) / "mesh/deformer.0004.ply"
        path.write_bytes(path.read_bytes()[:-1])
        self.scene.frame_set(4)
        self.assertRegex(nodes["deformer"].note, "frame 4 cannot be shown: .*deformer.0004.ply: ends within")
        self.scene.frame_set(5)
        self.assertEqual(nodes["deformer"].note, "baked 1 to 6")
        shutil.rmtree(self.cached(tree))
        self.scene.frame_set(6)
        self.assertEqual(nodes["deformer"].note, "nothing baked yet")

    def test_a_rigid_bodys_twin_moves_and_the_object_stays(self):
        tree, nodes = self.tree()
        ball = self.cube(size=0.2, location=(0.1, 0, 2), name="Ball")
        ball.data.transform(Matrix.Translation((0, 0, 0.1)))
        ball.scale, ball.rotation_euler = (1, 2, 1), (0.3, 0, 0)
        bpy.context.view_layer.update()
        node = self.node(tree, "rigid_body", shape="box", mass=5, velocity=(0, 0, -3))
        node.object = ball
        self.connect(node, "rigid_body", nodes["solver"], "rigid_bodies")
        twin = next(o for o in self.results(tree) if o.sunder.node == "rigid_body")
        self.bake(tree)
        state = addon("core").sunder().Graph.load(str(self.cached(tree) / "graph.json")).evaluate("solver.state", 6)
        self.scene.frame_set(1)
        self.assertLess((twin.matrix_world.translation - ball.matrix_world.translation).length, 1e-6)
        self.scene.frame_set(6)
        center = twin.matrix_world @ Vector((0, 0, 0.1))
        np.testing.assert_allclose(center, state.rigid_position[0], atol=1e-5)
        np.testing.assert_allclose(twin.matrix_world.to_scale(), (1, 2, 1), rtol=1e-5)
        self.assertAlmostEqual(ball.location.z, 2)
        self.assertTrue(ball.hide_render)
        self.assertIs(self.status(tree).is_stale, False)

    def test_a_render_in_the_window_waits_until_it_may_write(self):
        class Busy:
            """Refuses as Blender does while its main thread draws a panel."""

            left = 3

            def __setitem__(self, name, value):
                self.left -= 1
                if self.left >= 0:
                    raise AttributeError("Writing to ID classes in this context is not allowed")
                self.value = value

        busy = Busy()
        thread = threading.Thread(target=addon("result_mesh").set_property, args=(busy, "sunder_shown", "x"))
        thread.start()
        thread.join(10)
        self.assertEqual([busy.left, busy.value], [-1, "x"])
        with self.assertRaisesRegex(AttributeError, "not allowed"):  # here waiting would not help
            addon("result_mesh").set_property(Busy(), "sunder_shown", "x")

    def test_a_bodys_own_attributes_are_read_where_there_are_two(self):
        tree, nodes = self.tree(self.cube(location=(0, 0, 0.3)))
        other, _ = self.tree(self.cube(location=(2, 0, 3), name="Second"), pieces=5)
        mesh, cut = self.node(tree, "mesh_file"), self.node(tree, "prefracture", pieces=5)
        mesh.object = bpy.data.objects["Second"]
        body, skin = self.node(tree, "body", velocity=(7, 0, 0)), self.node(tree, "deformer")
        self.connect(mesh, "mesh", cut, "mesh"), self.connect(cut, "fragments", body, "fragments")
        self.connect(body, "body", nodes["solver"], "bodies"), self.connect(body, "body", skin, "body")
        self.connect(nodes["solver"], "state", skin, "state")
        first, second = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(1)
        self.assertAlmostEqual(attribute(second, "velocity")[:, 0].mean(), 7, places=3)
        self.assertAlmostEqual(attribute(first, "velocity")[:, 0].mean(), 0, places=3)
        self.assertEqual(second.name, "Second fractured")


if __name__ == "__main__":
    main()
