"""Baking: blocking and beside other work, stopped and gone on with, out of date, freed."""
import threading
import time
import types
import unittest.mock

import bpy

from addon_case import AddonCase, addon, main, positions


def files(folder):
    """Bytes of every file of a bake but those that say when and by whom."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*.ply"))}


class Bake(AddonCase):
    def stopped(self, tree, frames):
        """A bake that was stopped once `frames` of it were whole."""
        job = addon("bake.bake_job").BakeJob(tree, self.scene)
        job.start()
        while job.is_running and len(getattr(self.manifest(tree), "numbers", ())) < frames:
            job.wait(0.002)
        job.cancel()
        job.finish(tree)
        return job

    def test_a_bake_says_what_it_has(self):
        tree, nodes = self.tree()
        self.assertEqual([self.status(tree).state, self.status(tree).text], ["none", "not baked"])
        self.assertEqual(self.bake(tree), {"FINISHED"})
        now = self.status(tree)
        self.assertEqual([now.state, now.is_stale, now.text], ["complete", False, "baked 1 to 6"])
        check = addon("base.core").sunder().verify(str(self.cached(tree)))
        self.assertEqual([check["faults"], check["missing_frames"]], [[], []])

    def test_a_stopped_bake_goes_on_to_the_same_bits(self):
        tree, _ = self.tree()
        self.scene.frame_end = 120  # more than are baked before it is stopped
        job = self.stopped(tree, 3)
        self.assertEqual([job.is_cancelled, job.error], [True, ""])
        part = self.manifest(tree).numbers
        self.assertTrue(3 <= len(part) < 120)
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

    def test_a_changed_material_goes_on_from_a_chosen_frame(self):
        tree, nodes = self.tree()
        self.bake(tree)
        before = files(self.cached(tree))
        nodes["body"].set_parameters(youngs_modulus=5e7, density=700)
        self.assertEqual(self.bake(tree, start="FROM_FRAME", frame=3), {"FINISHED"})
        after = files(self.cached(tree))
        for name in ("mesh/deformer", "state/solver"):
            for n in (1, 2, 3):
                self.assertEqual(after[f"{name}.{n:04d}.ply"], before[f"{name}.{n:04d}.ply"], (name, n))
            for n in (4, 5, 6):
                self.assertNotEqual(after[f"{name}.{n:04d}.ply"], before[f"{name}.{n:04d}.ply"], (name, n))
        self.assertEqual([self.status(tree).is_stale, self.status(tree).text],
                         [False, "baked 1 to 6 (to 3 as before the changes)"])
        self.assertEqual(addon("base.core").sunder().verify(str(self.cached(tree)))["faults"], [])
        self.scene.frame_end = 8
        self.bake(tree)  # goes on, and stays what it is
        longer = files(self.cached(tree))
        self.assertEqual({n: longer[n] for n in after}, after)
        self.bake(tree, start="RESTART")
        self.assertEqual(self.status(tree).text, "baked 1 to 8")
        self.assertNotEqual(files(self.cached(tree))["mesh/deformer.0003.ply"], before["mesh/deformer.0003.ply"])

    def test_a_bake_goes_on_only_with_the_same_pieces_from_a_frame_that_is_there(self):
        tree, nodes = self.tree()
        with self.assertRaisesRegex(RuntimeError, "frame 3 is not baked: there is nothing"):
            self.bake(tree, start="FROM_FRAME", frame=3)
        self.bake(tree)
        before = files(self.cached(tree))
        with self.assertRaisesRegex(RuntimeError, "frame 9 is not baked: there are frames 1 to 6"):
            self.bake(tree, start="FROM_FRAME", frame=9)
        nodes["prefracture"].pieces = 9
        with self.assertRaisesRegex(RuntimeError, "pieces, start and range"):
            self.bake(tree, start="FROM_FRAME", frame=3)
        self.assertIn("bake anew instead", nodes["prefracture"].error)
        self.assertEqual(files(self.cached(tree)), before)

    def test_a_bake_that_took_frames_over_is_not_resumed_without_them(self):
        tree, nodes = self.tree()
        self.bake(tree)
        nodes["body"].density = 700
        self.scene.frame_end = 300
        job = addon("bake.bake_job").BakeJob(tree, self.scene, "FROM_FRAME", 3)
        job.cancel()  # at once: what is taken over is written all the same
        job.start()
        job.finish(tree)
        self.assertEqual([job.is_cancelled, self.manifest(tree).numbers[:3]], [True, [1, 2, 3]])
        self.assertTrue(addon("bake.bake_job").BakeJob(tree, self.scene).is_resumed)
        note = self.cached(tree) / "blender.json"
        beyond = self.manifest(tree).numbers[-1] + 1  # a few more may have been baked before it was stopped
        note.write_text(note.read_text().replace('"taken_over": 3', f'"taken_over": {beyond}'))
        self.assertFalse(addon("bake.bake_job").BakeJob(tree, self.scene).is_resumed)

    def test_a_bake_that_cannot_be_leaves_the_one_that_is_there(self):
        tree, nodes = self.tree()
        self.bake(tree)
        before = files(self.cached(tree))
        bpy.ops.mesh.primitive_plane_add(size=0.3, location=(2, 0, 1))
        whole, nodes["mesh_file"].object = nodes["mesh_file"].object, bpy.context.object
        self.assertIn("open", self.refusal(tree))
        nodes["mesh_file"].object = whole
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        after = files(self.cached(tree))
        self.assertEqual({n: after[n] for n in before if not n.startswith("inputs/")},
                         {n: d for n, d in before.items() if not n.startswith("inputs/")})

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
        sunder, folder = addon("base.core").sunder(), self.cached(tree)
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
        tree, = addon("tree.trees").trees()
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        self.assertEqual(len(self.manifest(tree).graph["nodes"]["body"]["toughness"]["keys"]), 3)

    def test_two_bakes_of_one_tree_do_not_meet(self):
        tree, _ = self.tree()
        job = addon("bake.bake_job").BakeJob(tree, self.scene)
        job.start()
        addon("base.runtime").jobs[tree.cache_id] = job
        self.assertIn("being baked already", self.refusal(tree))
        self.assertEqual(self.status(tree).state, "baking")
        job.finish(tree)
        self.assertEqual([self.status(tree).state, addon("base.runtime").jobs], ["complete", {}])

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
        bake = addon("interface.operators").SUNDER_OT_bake
        told, manager, space = [], unittest.mock.Mock(), unittest.mock.Mock()
        window = types.SimpleNamespace(window_manager=manager, workspace=space, scene=self.scene, object=None,
                                       space_data=None, window=None)
        operator = types.SimpleNamespace(tree=tree.name, start="AUTO", frame=0, report=lambda kind, text: told.append((kind, text)))
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
        self.assertEqual([self.status(tree).state, addon("base.runtime").jobs], ["partial", {}])
        self.assertLess(len(self.manifest(tree).numbers), 500)

    def test_operators_under_another_context_while_a_bake_is_at_work(self):
        """Blender 3.4 takes Python's lock for its own then if any thread has it, and crashes: there must be no such thread."""
        tree, _ = self.tree()
        self.scene.frame_end = 200000
        job = addon("bake.bake_job").BakeJob(tree, self.scene)
        job.start()
        end = time.monotonic() + 1
        while time.monotonic() < end:
            with bpy.context.temp_override(scene=self.scene):
                for _ in range(50):
                    bpy.ops.object.select_all(action="TOGGLE")
            job.advance()
        self.assertEqual([job.is_running, threading.active_count()], [True, 1])
        job.cancel()
        job.finish(tree)
        self.assertTrue(job.is_cancelled)

    def test_turning_the_addon_off_ends_its_bakes(self):
        tree, _ = self.tree()
        self.scene.frame_end = 2000
        job = addon("bake.bake_job").BakeJob(tree, self.scene)
        job.start()
        bpy.ops.preferences.addon_disable(module="sunder_addon")
        self.assertFalse(job.is_running)
        bpy.ops.preferences.addon_enable(module="sunder_addon")


if __name__ == "__main__":
    main()
