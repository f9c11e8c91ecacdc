"""Files come and go: caches are neither lost nor mixed by saving, reopening, undo, copies, appending and renaming."""
import bpy
import numpy as np

from addon_case import AddonCase, addon, main, positions


class FileCase(AddonCase):
    def shot(self):
        """A tree that is baked and shown at frame 6."""
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(6)
        return tree, nodes, result

    def only_tree(self):
        tree, = addon("tree.trees").trees()
        return tree

    def rebake(self, toughness):
        tree = self.only_tree()
        next(n for n in tree.nodes if n.sunder_type == "body").toughness = toughness
        self.bake(tree)

    def result(self):
        thing, = addon("tree.trees").result_objects()
        return thing

    def note(self, tree):
        return next(n for n in tree.nodes if n.sunder_type == "deformer").note


class Saved(FileCase):
    def test_a_saved_shot_plays_when_it_is_opened_again(self):
        self.save()
        tree, _, result = self.shot()
        there = positions(result)
        self.assertEqual(self.cached(tree).parent, self.folder / "sunder_cache")
        self.save()
        self.reopen()
        self.assertIs(self.status(self.only_tree()).is_stale, False)
        self.scene.frame_set(2)
        self.assertFalse(np.array_equal(positions(self.result())[: len(there)], there[: len(positions(self.result()))]))
        self.scene.frame_set(6)
        np.testing.assert_array_equal(positions(self.result()), there)
        self.assertTrue(self.scene.render.use_lock_interface)

    def test_a_bake_made_before_the_first_save_moves_beside_the_file(self):
        tree, _, result = self.shot()
        old, there = self.cached(tree), positions(result)
        self.save()
        self.assertFalse(old.exists())
        self.assertEqual([self.cached(tree).parent, self.status(tree).state], [self.folder / "sunder_cache", "complete"])
        self.reopen()
        self.scene.frame_set(1), self.scene.frame_set(6)
        np.testing.assert_array_equal(positions(self.result()), there)

    def test_a_file_first_saved_while_it_bakes(self):
        tree, _ = self.tree()
        job = addon("bake.bake_job").BakeJob(tree, self.scene)
        old = self.cached(tree)
        job.start()
        self.save()
        self.assertEqual(self.cached(tree), old)
        job.finish(tree)
        self.assertEqual([job.error, self.cached(tree).parent], ["", self.folder / "sunder_cache"])
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale, old.exists()], ["complete", False, False])

    def test_a_stopped_bake_goes_on_after_the_file_was_opened_again(self):
        self.save()
        tree, _ = self.tree()
        self.scene.frame_end = 3
        self.bake(tree)
        first = (self.cached(tree) / "mesh/deformer.0002.ply").stat().st_mtime_ns
        self.scene.frame_end = 6
        self.save()
        self.reopen()
        tree = self.only_tree()
        self.assertEqual(self.status(tree).state, "partial")
        self.bake(tree)
        self.assertEqual([self.status(tree).state, (self.cached(tree) / "mesh/deformer.0002.ply").stat().st_mtime_ns],
                         ["complete", first])

    def test_a_moved_project_plays(self):
        self.save()
        self.shot()
        self.save()
        self.folder.rename(self.folder.with_name("moved"))
        self.folder = self.folder.with_name("moved")
        self.reopen()
        tree = self.only_tree()
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        self.bake(tree)  # nothing is left to do
        self.assertEqual(self.status(tree).text, "baked 1 to 6")

    def test_a_new_file_has_nothing_of_the_old_one(self):
        tree, _, _ = self.shot()
        name = tree.name_full
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.scene = bpy.context.scene
        runtime = addon("base.runtime")
        self.assertEqual([runtime.node_notes, runtime.node_errors, runtime.signatures, runtime.jobs], [{}, {}, {}, {}])
        tree, _ = self.tree()
        self.assertEqual([tree.name_full, self.status(tree).state], [name, "none"])


class Before(FileCase):
    """Trees that were saved before damping could be automatic: their nodes have nothing of the switch."""

    def body(self):
        return next(n for n in self.only_tree().nodes if n.sunder_type == "body")

    def compiled(self):
        return addon("bake.compiler").compile_tree(self.only_tree(), self.scene).description

    def test_they_keep_the_damping_that_they_had(self):
        _, nodes = self.tree()
        self.assertEqual(nodes["body"].parameter("damping_time"), "auto")
        nodes["body"].property_unset("auto_damping_time")
        self.save()
        self.reopen()
        self.assertEqual(self.body().parameter("damping_time"), 0.002)
        self.assertEqual(self.compiled()["nodes"]["body"]["damping_time"], 0.002)
        self.body().damping_time = 0.01
        self.save()
        self.reopen()
        self.assertEqual(self.compiled()["nodes"]["body"]["damping_time"], 0.01)

    def test_they_break_as_they_did(self):
        _, nodes = self.tree()
        self.assertEqual(nodes["body"].parameter("fracture_energy"), "auto")
        nodes["body"].property_unset("auto_fracture_energy")
        nodes["body"].property_unset("use_fracture_energy")
        self.save()
        self.reopen()
        self.assertIsNone(self.body().parameter("fracture_energy"))
        self.assertIsNone(self.compiled()["nodes"]["body"]["fracture_energy"])

    def test_new_ones_and_their_copies_stay_automatic(self):
        _, nodes = self.tree()
        for node in nodes.values():
            node.select = node == nodes["body"]
        self.save()
        self.reopen()
        self.assertEqual(self.body().parameter("damping_time"), "auto")
        self.assertEqual([self.compiled()["sunder"], self.compiled()["nodes"]["body"].get("damping_time")], [2, None])
        self.body().set_parameters(damping_time=0.005)
        self.assertEqual(self.body().parameter("damping_time"), 0.005)
        self.body().set_parameters(damping_time="auto")
        self.assertEqual(self.body().parameter("damping_time"), "auto")


class Versions(FileCase):
    def test_a_second_version_plays_the_first_ones_bake_and_never_writes_into_it(self):
        self.save("v1.blend")
        tree, nodes, _ = self.shot()
        self.save("v1.blend")
        first = self.cached(tree)
        content = {p: p.read_bytes() for p in first.rglob("*") if p.is_file()}
        self.save("v2.blend")
        self.assertEqual([self.cached(tree), self.status(tree).is_stale], [first, False])
        nodes["body"].toughness = 0.4
        self.bake(tree)
        self.assertNotEqual(self.cached(tree), first)
        self.assertEqual(self.status(tree).state, "complete")
        now = {p: p.read_bytes() for p in first.rglob("*") if p.is_file() and p.name != "players.json"}
        self.assertEqual(now, content)
        self.save("v2.blend")
        self.reopen("v1.blend")
        self.assertEqual([self.cached(self.only_tree()), self.status(self.only_tree()).is_stale], [first, False])

    def test_a_first_version_does_not_replace_what_the_second_one_plays(self):
        self.save("v1.blend")
        tree, _, result = self.shot()
        self.save("v1.blend")
        first, there = self.cached(tree), positions(result)
        self.save("v2.blend")
        self.reopen("v1.blend")
        self.rebake(toughness=0.4)
        self.assertNotEqual(self.cached(self.only_tree()), first)
        self.save("v1.blend")
        self.reopen("v2.blend")
        self.assertEqual([self.cached(self.only_tree()), self.status(self.only_tree()).is_stale], [first, False])
        self.scene.frame_set(1), self.scene.frame_set(6)
        np.testing.assert_array_equal(positions(self.result()), there)

        self.rebake(toughness=0.3)  # it is the second version's alone by now
        self.assertEqual(self.cached(self.only_tree()), first)
        bpy.ops.sunder.free_bake(tree=self.only_tree().name)
        self.assertFalse(first.exists())

    def test_an_export_tells_todays_materials_also_where_a_second_version_plays_the_bake(self):
        self.save("v1.blend")
        tree, _, _ = self.shot()
        self.save("v1.blend")
        looks = self.cached(tree) / "looks.json"
        self.save("v2.blend")
        self.reopen("v1.blend")
        paint = bpy.data.materials.new("Paint of Today")
        self.result().data.materials[0] = paint
        bpy.ops.sunder.export(tree=self.only_tree().name, filepath=str(self.folder / "shot.usda"))
        self.assertIn("Paint of Today", looks.read_text(encoding="utf-8"))

    def test_a_bake_is_its_owners_alone_when_other_versions_play_another_or_are_gone(self):
        self.save("v1.blend")
        tree, _, _ = self.shot()
        self.save("v1.blend")
        first = self.cached(tree)
        self.save("v2.blend")
        self.rebake(toughness=0.4)
        self.save("v2.blend")
        self.save("v3.blend")
        self.reopen("v1.blend")
        self.rebake(toughness=0.3)
        self.assertEqual(self.cached(self.only_tree()), first)

        self.reopen("v3.blend")
        second = self.cached(self.only_tree())
        (self.folder / "v2.blend").unlink()
        self.rebake(toughness=0.2)
        self.assertEqual(self.cached(self.only_tree()), second)

    def test_a_version_that_was_not_saved_since_it_left_a_bake_still_plays_it(self):
        self.save("v1.blend")
        tree, _, _ = self.shot()
        self.save("v1.blend")
        first = self.cached(tree)
        self.save("v2.blend")
        self.reopen("v1.blend")
        self.rebake(toughness=0.4)  # and Blender ends without saving
        self.reopen("v2.blend")
        self.rebake(toughness=0.3)
        self.assertNotEqual(self.cached(self.only_tree()), first)
        self.reopen("v1.blend")
        self.assertEqual([self.cached(self.only_tree()), self.status(self.only_tree()).is_stale], [first, False])

    def test_freeing_a_second_versions_bake_leaves_the_first_its_own(self):
        self.save("v1.blend")
        tree, _, _ = self.shot()
        self.save("v1.blend")
        self.save("v2.blend")
        bpy.ops.sunder.free_bake(tree=tree.name)
        self.assertEqual(self.status(tree).state, "none")
        self.reopen("v1.blend")
        self.assertEqual(self.status(self.only_tree()).state, "complete")

    def test_a_renamed_file_keeps_its_bake_as_its_own(self):
        self.save("shot.blend")
        tree, _, _ = self.shot()
        self.save("shot.blend")
        (self.folder / "shot.blend").rename(self.folder / "take.blend")
        self.reopen("take.blend")
        tree = self.only_tree()
        before = self.cached(tree)
        next(n for n in tree.nodes if n.sunder_type == "body").toughness = 0.4
        self.bake(tree)
        self.assertEqual(self.cached(tree), before)

    def test_a_file_saved_in_another_folder_plays_until_it_bakes_its_own(self):
        self.save()
        tree, nodes, result = self.shot()
        self.save()
        first, there = self.cached(tree), positions(result)
        (self.folder / "elsewhere").mkdir()
        self.save("elsewhere/shot.blend")
        self.reopen("elsewhere/shot.blend")
        tree = self.only_tree()
        self.assertEqual([self.cached(tree), self.status(tree).state], [first, "complete"])
        self.scene.frame_set(1), self.scene.frame_set(6)
        np.testing.assert_array_equal(positions(self.result()), there)
        next(n for n in tree.nodes if n.sunder_type == "body").toughness = 0.4
        self.bake(tree)
        self.assertEqual(self.cached(tree).parent, self.folder / "elsewhere/sunder_cache")
        self.reopen()
        self.assertIs(self.status(self.only_tree()).is_stale, False)

    def test_a_copy_saved_elsewhere_changes_nothing_here(self):
        self.save()
        tree, _, _ = self.shot()
        (self.folder / "elsewhere").mkdir()
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "elsewhere/copy.blend"), copy=True)
        self.assertEqual([self.cached(tree).parent, self.status(tree).state], [self.folder / "sunder_cache", "complete"])
        self.reopen("elsewhere/copy.blend")
        self.assertEqual(self.status(self.only_tree()).state, "complete")


class Copies(FileCase):
    def test_a_copied_tree_plays_the_bake_until_it_bakes_its_own(self):
        tree, nodes, _ = self.shot()
        first = self.cached(tree)
        twin = tree.copy()
        self.assertEqual([self.status(twin).state, self.status(twin).is_stale], ["complete", False])
        next(n for n in twin.nodes if n.sunder_type == "body").toughness = 0.4
        self.assertEqual([self.status(t).is_stale for t in (tree, twin)], [False, True])
        self.bake(twin)
        self.assertNotEqual(self.cached(twin), first)
        self.assertEqual([self.cached(tree), self.status(tree).is_stale], [first, False])
        bpy.ops.sunder.free_bake(tree=twin.name)
        self.assertEqual([self.status(t).state for t in (tree, twin)], ["complete", "none"])

    def test_errors_and_notes_stay_with_the_tree_they_are_of(self):
        tree, _, _ = self.shot()
        twin = tree.copy()
        broken = next(n for n in twin.nodes if n.sunder_type == "mesh_file")
        broken.object = None
        self.refusal(twin)
        self.assertTrue(broken.error)
        self.assertEqual([n.name for n in tree.nodes if n.error], [])

    def test_a_renamed_tree_keeps_its_bake(self):
        tree, nodes, _ = self.shot()
        folder = self.cached(tree)
        tree.name, nodes["mesh_file"].object.name, nodes["deformer"].name = "Crash", "Car", "Skin"
        self.assertEqual([self.cached(tree), self.status(tree).state, self.status(tree).is_stale], [folder, "complete", False])
        self.scene.frame_set(2)
        self.assertEqual(self.note(tree), "baked 1 to 6")

    def test_a_copied_result_plays_too(self):
        tree, _, result = self.shot()
        twin = result.copy()
        twin.data = result.data.copy()
        self.scene.collection.objects.link(twin)
        self.scene.frame_set(3)
        np.testing.assert_array_equal(positions(twin), positions(result))

    def test_an_appended_shot_plays_beside_its_file_and_does_not_mix_with_its_own_tree(self):
        self.save("a.blend")
        tree, _, _ = self.shot()
        first = self.cached(tree)
        self.save("a.blend")
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.scene = bpy.context.scene
        self.scene.frame_end = 6
        self.save("b.blend")
        with bpy.data.libraries.load(str(self.folder / "a.blend")) as (there, here):
            here.objects = [n for n in there.objects if n.endswith("fractured")]
        self.scene.collection.objects.link(here.objects[0])
        tree = self.only_tree()
        self.scene.frame_set(4)
        self.assertEqual([self.cached(tree), self.note(tree)], [first, "baked 1 to 6"])
        before = {p: p.stat().st_mtime_ns for p in first.rglob("*")}
        path = str(self.folder / "appended.usda")
        self.assertEqual(bpy.ops.sunder.export(tree=tree.name, filepath=path), {"FINISHED"})
        self.assertIn("Block_fractured", (self.folder / "appended.usda").read_text())
        self.assertEqual({p: p.stat().st_mtime_ns for p in first.rglob("*")}, before)  # an export writes nothing into another file's bake
        # What the tree was cut from came along as data, but stands in no view layer: link it before baking.
        source = next(n for n in tree.nodes if n.sunder_type == "mesh_file").object
        self.assertIn("not in this view layer", self.refusal(tree))
        self.scene.collection.objects.link(source)
        next(n for n in tree.nodes if n.sunder_type == "body").toughness = 0.4
        self.bake(tree)
        self.assertNotEqual(self.cached(tree), first)
        self.reopen("a.blend")
        self.assertIs(self.status(self.only_tree()).is_stale, False)

    def test_a_shot_that_was_saved_once_is_appended_to_a_file_that_never_was(self):
        tree, _, _ = self.shot()  # baked before there was a file
        self.save("a.blend")
        first = self.cached(tree)
        self.assertEqual(first.parent, self.folder / "sunder_cache")
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.scene = bpy.context.scene
        bpy.ops.wm.append(filepath=str(self.folder / "a.blend/Object/Block fractured"), filename="Block fractured",
                          directory=str(self.folder / "a.blend/Object") + "/")
        tree = self.only_tree()
        self.scene.frame_set(4)
        self.assertEqual([self.cached(tree), self.note(tree)], [first, "baked 1 to 6"])


class Disabled(FileCase):
    def test_the_addon_turned_off_and_on_leaves_trees_and_results_as_they_were(self):
        tree, _, result = self.shot()
        there, folder = positions(result), self.cached(tree)
        for _ in range(3):
            bpy.ops.preferences.addon_disable(module="sunder_addon")
            bpy.context.view_layer.update()
            self.scene.frame_set(4)  # Blender evaluates its copies of the tree, whose type is gone
            self.scene.frame_set(6)
            bpy.ops.preferences.addon_enable(module="sunder_addon")
        tree = self.only_tree()
        self.assertEqual([self.cached(tree), self.status(tree).state, self.status(tree).is_stale], [folder, "complete", False])
        self.assertEqual(self.result().sunder.tree, tree)
        self.scene.frame_set(2), self.scene.frame_set(6)
        np.testing.assert_array_equal(positions(self.result()), there)


class Undone(FileCase):
    def setUp(self):
        super().setUp()
        bpy.context.preferences.edit.use_global_undo = True

    def test_undo_brings_parameters_staleness_and_results_back(self):
        tree, nodes, result = self.shot()
        there = positions(result)
        bpy.ops.ed.undo_push(message="baked")
        nodes["body"].toughness = 0.4
        bpy.ops.ed.undo_push(message="tougher")
        self.assertIs(self.status(tree).is_stale, True)
        bpy.ops.ed.undo()
        self.scene = bpy.context.scene
        tree = self.only_tree()
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        np.testing.assert_array_equal(positions(self.result()), there)
        bpy.ops.ed.redo()
        self.scene = bpy.context.scene
        self.assertIs(self.status(self.only_tree()).is_stale, True)

    def test_a_bake_after_undo_leaves_a_whole_cache(self):
        tree, nodes, _ = self.shot()
        bpy.ops.ed.undo_push(message="baked")
        nodes["body"].toughness = 0.4
        bpy.ops.ed.undo_push(message="tougher")
        self.bake(tree)
        bpy.ops.ed.undo()
        self.scene = bpy.context.scene
        tree = self.only_tree()
        self.assertIs(self.status(tree).is_stale, True)  # what lies in the cache is the tougher one
        self.bake(tree)
        self.assertIs(self.status(tree).is_stale, False)
        self.assertEqual(addon("base.core").sunder().verify(str(self.cached(tree)))["faults"], [])

    def test_a_deleted_tree_that_is_undone_still_has_its_bake(self):
        tree, _, _ = self.shot()
        bpy.ops.ed.undo_push(message="baked")
        bpy.data.node_groups.remove(tree)
        bpy.ops.ed.undo_push(message="deleted")
        self.scene.frame_set(2)
        bpy.ops.ed.undo()
        self.scene = bpy.context.scene
        self.scene.frame_set(3)
        self.assertEqual([self.status(self.only_tree()).state, self.note(self.only_tree())], ["complete", "baked 1 to 6"])

    def test_undo_while_a_bake_is_at_work(self):
        tree, nodes = self.tree()
        bpy.ops.ed.undo_push(message="made")
        nodes["body"].toughness = 0.4
        bpy.ops.ed.undo_push(message="tougher")
        job = addon("bake.bake_job").BakeJob(tree, self.scene)
        job.start()
        bpy.ops.ed.undo()
        self.scene = bpy.context.scene
        tree = self.only_tree()
        job.finish(tree)
        self.assertEqual([job.error, self.status(tree).state, self.status(tree).is_stale], ["", "complete", True])


if __name__ == "__main__":
    main()
