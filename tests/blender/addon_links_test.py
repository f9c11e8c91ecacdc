"""Where others pick a shot up it plays: linked, instanced, overridden, of a linked scene."""
import os

import bpy
import numpy as np

from addon_case import addon, attribute, main, positions
from link_case import AS_WRITTEN, FRAMES, PLACE, LinkCase


class Linked(LinkCase):
    def test_a_collection(self):
        self.linked_shot()
        self.plays()
        self.assertEqual(self.note(), "baked 1 to 6")
        self.plays_when_opened_again()

    def test_instances_stay_where_they_are_put(self):
        shot = self.linked()
        self.instance(shot), self.instance(shot)
        self.plays(PLACE, 2)
        self.plays_when_opened_again(PLACE, 2)

    def test_an_override_stays_where_it_is_moved(self):
        shot = self.linked_shot()
        shot.override_hierarchy_create(self.scene, bpy.context.view_layer)
        if shot in list(self.scene.collection.children):
            self.scene.collection.children.unlink(shot)
        self.plays()
        empty = bpy.data.objects.new("Handle", None)
        empty.matrix_world = PLACE
        self.scene.collection.objects.link(empty)
        own = [o for o in bpy.data.objects if o.override_library and o.sunder.node == "deformer"]
        own[0].parent = empty
        bpy.context.view_layer.update()
        shown = next(one for one in self.seen(self.scene, 6) if one[0] == "Block fractured")
        place = np.array(PLACE)
        wanted = self.there[6][1][1] @ place[:3, :3].T + place[:3, 3]
        np.testing.assert_allclose(shown[1], wanted, rtol=0, atol=AS_WRITTEN)
        own[0].parent = None
        self.plays_when_opened_again()

    def test_an_override_of_the_mesh(self):
        shot = self.linked_shot()
        shot.override_hierarchy_create(self.scene, bpy.context.view_layer)
        if shot in list(self.scene.collection.children):
            self.scene.collection.children.unlink(shot)
        own = next(o for o in bpy.data.objects if o.override_library and o.sunder.node == "deformer")
        own.data.override_create(remap_local_usages=True)
        self.assertTrue(own.data.override_library)
        self.plays()
        self.plays_when_opened_again()

    def test_a_scene(self):
        scene = self.linked("scenes", "Scene")
        self.plays(scene=scene)
        bpy.context.window.scene = scene
        self.plays_when_opened_again()

    def test_a_library_of_a_library(self):
        self.instance(self.linked())
        outer = bpy.data.collections.new("Outer")
        self.scene.collection.children.link(outer)
        outer.objects.link(bpy.data.objects["Instance"])
        self.save("x/b.blend")
        self.second("y/z/c.blend")
        self.scene.collection.children.link(self.linked("collections", "Outer", "x/b.blend"))
        self.plays(PLACE)
        self.plays_when_opened_again(PLACE, name="y/elsewhere.blend")

    def test_a_library_that_is_packed(self):
        if bpy.app.version < (5, 0, 0):
            return  # there are none
        self.scene.collection.children.link(self.linked(pack=True))
        self.plays()
        self.plays_when_opened_again()

    def test_what_the_mesh_carries_arrives_to_the_bit(self):
        def carried():
            self.scene.frame_set(6)
            mesh = self.result().data
            normals = addon("base.blender_versions").corner_normals(mesh)
            uvs = np.empty(2 * len(mesh.loops), np.float32)
            mesh.uv_layers["UVMap"].data.foreach_get("uv", uvs)
            slots = np.empty(len(mesh.polygons), np.int32)
            mesh.polygons.foreach_get("material_index", slots)
            rest = np.empty(3 * len(mesh.texco_mesh.vertices), np.float32)
            mesh.texco_mesh.vertices.foreach_get("co", rest)
            names = ("fragment", "interior", "interface", "rim", "strain", "toughness_left", "plastic_strain", "velocity",
                     "rest_position")
            return {"normals": normals, "uvs": uvs, "slots": slots, "rest": rest,
                    **{name: attribute(self.result(), name) for name in names}}

        self.linked_shot()
        linked = carried()
        self.reopen("a.blend")
        for name, values in carried().items():
            np.testing.assert_array_equal(linked[name], values, name)
        self.assertGreater(len(np.unique(linked["slots"])), 1)

    def test_vertex_groups_arrive_with_their_weights(self):
        """Blender drops weights that are written through a linked object; in a whole mesh they come."""
        def weights(frame):
            self.scene.frame_set(frame)
            return [[(g.group, g.weight) for g in v.groups] for v in self.result().data.vertices]

        self.second("groups.blend")
        block = self.cube()
        block.vertex_groups.new(name="Top").add([1, 3, 5, 7], 0.5, "REPLACE")
        block.vertex_groups.new(name="Corner").add([0], 1, "REPLACE")
        tree, _ = self.tree(block)
        self.results(tree)
        self.bake(tree)
        there = {frame: weights(frame) for frame in FRAMES}  # it is saved at another frame than the first visited
        self.assertGreater(len({len(found) for found in there.values()}), 1)
        self.assertTrue(all(any(found) for found in there.values()))
        self.save("groups.blend")
        self.second()
        self.scene.collection.objects.link(self.linked("objects", "Block fractured", "groups.blend"))
        for name in ("x/b.blend", None):
            self.assertEqual({frame: weights(frame) for frame in FRAMES}, there)
            self.assertEqual(self.result().vertex_groups.keys(), ["Top", "Corner"])
            if name:
                self.save(name)
                self.second("other.blend")
                with bpy.data.libraries.load(str(self.folder / name)) as (saved, _):
                    self.assertNotIn("Sunder stage", [*saved.objects, *saved.meshes])
                self.reopen(name)

    def test_without_exact_normals(self):
        self.reopen("a.blend")
        self.result().sunder.use_exact_normals = False
        self.scene.frame_set(1)
        self.save("a.blend")
        self.second()
        self.linked_shot()
        self.plays()
        self.assertFalse(self.result().data.has_custom_normals)

    def test_a_result_that_was_saved_before_the_bake(self):
        """Its mesh has no texture mesh, and a linked one gets none."""
        self.second("late.blend")
        tree, _ = self.tree()
        self.results(tree)
        self.save("late.blend")
        self.bake(tree)
        self.scene.frame_set(6)
        there = positions(self.result())
        self.second()
        self.scene.collection.objects.link(self.linked("objects", "Block fractured", "late.blend"))
        n = len(bpy.data.meshes)
        for frame in FRAMES[::-1]:
            self.scene.frame_set(frame)
        np.testing.assert_array_equal(positions(self.result()), there)
        self.assertIsNone(self.result().data.texco_mesh)
        self.assertLessEqual(len(bpy.data.meshes), n + 1)

    def test_where_a_frame_rests_it_is_shown_what_was_linked_or_read_again(self):
        """In the window, where no frame changes meanwhile."""
        handlers = addon("interface.handlers")

        def rest():
            for _ in range(2):
                handlers._notice(self.scene), handlers._catch_up(self.scene)

        self.scene.frame_set(6)
        self.scene.render.use_lock_interface = False
        rest()
        self.assertFalse(self.scene.render.use_lock_interface)
        self.linked_shot()
        self.assertNotEqual(len(positions(self.result())), len(self.there[6][1][1]))
        rest()
        np.testing.assert_array_equal(positions(self.result()), self.there[6][1][1].astype(np.float32))
        self.assertTrue(self.scene.render.use_lock_interface)
        self.scene.render.use_lock_interface = False
        bpy.data.libraries[0].reload()
        self.assertNotEqual(len(positions(self.result())), len(self.there[6][1][1]))
        rest()
        np.testing.assert_array_equal(positions(self.result()), self.there[6][1][1].astype(np.float32))
        self.assertFalse(self.scene.render.use_lock_interface)  # who turned it off knows these results

    def test_the_file_is_saved_elsewhere(self):
        self.linked_shot()
        os.makedirs(self.folder / "far/away")
        self.plays_when_opened_again(name="far/away/b.blend")


class Local(LinkCase):
    def make_local(self):
        thing = self.linked("objects", "Block fractured")
        self.scene.collection.objects.link(thing)
        self.scene.frame_set(6)
        thing.make_local().data.make_local()
        self.assertTrue(addon("results.result_mesh").is_local(self.result().data))
        return self.result()

    def test_a_local_copy_plays_the_linked_trees_bake(self):
        thing = self.make_local()
        for frame in (5, 6, 2, 3, 1):  # none takes faces of another for its own
            self.scene.frame_set(frame)
            np.testing.assert_array_equal(positions(thing), self.there[frame][1][1].astype(np.float32))
        self.assertEqual(self.cached(thing.sunder.tree).parent, self.folder / "sunder_cache")

    def test_another_result_of_a_linked_tree_is_local_and_plays(self):
        self.linked_shot()
        self.scene.frame_set(3)
        bpy.context.preferences.edit.use_global_undo = True
        bpy.ops.ed.undo_push(message="linked")
        tree = self.result().sunder.tree
        node = next(n.name for n in tree.nodes if n.sunder_type == "deformer")
        self.assertEqual(bpy.ops.sunder.add_results(tree=tree.name, node=node), {"FINISHED"})
        bpy.ops.ed.undo_push(message="added")
        own = [o for o in addon("tree.trees").result_objects() if o.library is None]
        self.assertEqual(len(own), 1)
        self.scene.frame_set(6)
        np.testing.assert_array_equal(positions(own[0]), self.there[6][1][1].astype(np.float32))
        bpy.ops.ed.undo()
        self.plays()
        bpy.ops.ed.redo()
        self.scene = bpy.context.scene
        self.scene.frame_set(5)
        for thing in addon("tree.trees").result_objects():
            if thing.sunder.node == "deformer":
                np.testing.assert_array_equal(positions(thing), self.there[5][1][1].astype(np.float32))

    def test_a_blender_that_drops_whole_meshes_says_so(self):
        self.linked_shot()
        self.addCleanup(setattr, addon("base.blender_versions"), "copy_geometry", addon("base.blender_versions").copy_geometry)
        addon("base.blender_versions").copy_geometry = lambda *_: None
        self.scene.frame_set(6)
        self.assertRegex(self.note(), "frame 6 cannot be shown: mesh 'Block fractured' is linked.* make .* local")

    def test_a_local_tree_of_the_same_name_is_told_apart(self):
        self.linked_shot()
        linked = self.result().sunder.tree
        own = bpy.data.node_groups.new(linked.name, linked.bl_idname)
        self.assertEqual(own.name, linked.name)
        tree_of = addon("tree.verbs").tree_of
        self.assertEqual([tree_of(bpy.context, t.name_full) for t in (own, linked)], [own, linked])

    def test_what_a_linked_tree_cannot_do_is_refused(self):
        self.linked_shot()
        tree = self.result().sunder.tree
        self.assertIn("bake it there", self.refusal(tree))
        with self.assertRaisesRegex(RuntimeError, "linked"):
            bpy.ops.sunder.free_bake(tree=tree.name)


class Broken(LinkCase):
    """Whatever comes of the library: nothing crashes, and what is there plays."""

    def test_undone_and_done_again(self):
        bpy.context.preferences.edit.use_global_undo = True
        bpy.ops.ed.undo_push(message="empty")
        self.linked_shot()
        bpy.ops.ed.undo_push(message="linked")
        self.scene.frame_set(6)
        self.scene.collection.objects.link(bpy.data.objects.new("Edit", None))
        bpy.ops.ed.undo_push(message="edited")
        for _ in range(10):
            bpy.ops.ed.undo()
            self.plays()
            bpy.ops.ed.undo()
            self.assertEqual(self.seen(bpy.context.scene, 3), [])
            bpy.ops.ed.redo()
            self.plays()
            bpy.ops.ed.redo()
            self.plays()

    def test_reloaded(self):
        self.linked_shot()
        for _ in range(5):
            self.scene.frame_set(6)
            bpy.data.libraries[0].reload()
            bpy.context.view_layer.update()
            self.plays()

    def test_missing_and_relocated(self):
        self.linked_shot()
        self.plays()
        self.save("x/b.blend")
        (self.folder / "a.blend").rename(self.folder / "moved.blend")
        self.reopen("x/b.blend")
        self.assertEqual(self.seen(self.scene, 3), [])
        library = bpy.data.libraries[0]
        library.filepath = str(self.folder / "moved.blend")
        library.reload()
        self.plays()

    def test_removed(self):
        self.linked_shot()
        self.plays()
        bpy.data.libraries.remove(bpy.data.libraries[0])
        self.assertEqual(self.seen(self.scene, 3), [])
        bpy.data.orphans_purge()
        self.assertEqual(self.seen(self.scene, 4), [])
        self.linked_shot()
        self.plays()

    def test_without_its_bake_it_says_what_is_missing(self):
        self.linked_shot()
        self.plays()
        (self.folder / "sunder_cache").rename(self.folder / "away")
        self.scene.frame_set(3)
        self.assertEqual(self.note(), "no bake lies beside a.blend: copy its sunder_cache there")
        (self.folder / "away").rename(self.folder / "sunder_cache")
        self.plays()

    def test_the_addon_is_off_for_a_while(self):
        self.instance(self.linked())
        self.save("x/b.blend")
        bpy.ops.preferences.addon_disable(module="sunder_addon")
        self.reopen("x/b.blend")
        self.scene.frame_set(6), self.scene.frame_set(2)
        bpy.ops.wm.save_mainfile()
        bpy.ops.preferences.addon_enable(module="sunder_addon")
        self.plays(PLACE)


class Shared(LinkCase):
    """One mesh in several scenes."""

    def test_a_scene_that_instances_what_another_one_holds(self):
        shot = self.linked_shot()
        other = bpy.data.scenes.new("Other")
        self.instance(shot, scene=other)
        other.view_layers[0].update()
        self.plays(PLACE, scene=other)
        self.plays(scene=self.scene)

    def test_a_background_scene(self):
        back = self.linked("scenes", "Scene")
        self.scene.background_set = back
        bpy.context.view_layer.update()
        self.plays()

    def test_other_scenes_are_left_at_their_frame(self):
        self.linked_shot()
        self.scene.frame_set(6)
        bpy.data.scenes.new("Other").frame_set(2)
        np.testing.assert_array_equal(positions(self.result()), self.there[6][1][1].astype(np.float32))


if __name__ == "__main__":
    main()
