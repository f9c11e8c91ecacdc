"""Where others pick a shot up it plays: linked, instanced, overridden, of a linked scene, in strips of the sequencer."""
import os

import bpy
import numpy as np
from mathutils import Matrix, Vector

from addon_case import AddonCase, addon, attribute, main, positions

FRAMES = (6, 2, 5, 1)  # the order in which they are visited
PLACE = Matrix.Translation((3, 1, 2)) @ Matrix.Rotation(0.5, 4, "Z")
WIDTH, HEIGHT = 64, 48
AS_WRITTEN = 1e-6  # m: places of instances are single precision, of a scene of 4 m


class LinkCase(AddonCase):
    """a.blend: a block that breaks and a ball that it hits, in a collection; x/b.blend: another file, open and empty."""

    def setUp(self):
        super().setUp()
        self.save("a.blend")
        shot = bpy.data.collections.new("Shot")
        self.scene.collection.children.link(shot)
        self.ball = self.cube(size=0.3, location=(0, 0.1, 1.4), name="Ball")
        tree, nodes = self.tree()
        rigid = self.node(tree, "rigid_body")
        rigid.object = self.ball
        self.connect(rigid, "rigid_body", nodes["solver"], "rigid_bodies")
        for thing in self.results(tree):
            self.scene.collection.objects.unlink(thing)
            shot.objects.link(thing)
        self.bake(tree)
        self.dress(self.scene)
        self.there = {frame: self.seen(self.scene, frame) for frame in range(1, 7)}
        self.assertEqual([name for name, _, _ in self.there[1]], ["Ball moving", "Block fractured"])
        self.assertNotEqual(len(self.there[1][1][2]), len(self.there[6][1][2]))  # it broke
        self.assertGreater(np.abs(self.there[6][0][1] - self.there[1][0][1]).max(), 0.1)  # and moved
        self.scene.frame_set(1)
        self.save("a.blend")
        self.second()

    def dress(self, scene):
        """What a render needs."""
        render = scene.render
        render.engine, render.resolution_x, render.resolution_y = "BLENDER_WORKBENCH", WIDTH, HEIGHT
        render.image_settings.color_mode, render.film_transparent = "RGBA", True
        scene.display.shading.light, scene.display.render_aa = "FLAT", "OFF"
        scene.view_settings.view_transform = "Standard"
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        camera.location = (1.5, -3, 2)
        camera.rotation_euler = (Vector((0, 0, 0.4)) - camera.location).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(camera)
        scene.camera = camera

    def second(self, name="x/b.blend"):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.scene = bpy.context.scene
        self.scene.frame_end = 6
        os.makedirs((self.folder / name).parent, exist_ok=True)
        self.save(name)

    def linked(self, kind="collections", name="Shot", file="a.blend", **options):
        with bpy.data.libraries.load(str(self.folder / file), link=True, relative=True, **options) as (_, here):
            setattr(here, kind, [name])
        return getattr(here, kind)[0]

    def linked_shot(self):
        shot = self.linked()
        self.scene.collection.children.link(shot)
        return shot

    def instance(self, shot, place=PLACE, scene=None):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection, empty.matrix_world = "COLLECTION", shot, place
        (scene or self.scene).collection.objects.link(empty)
        return empty

    @staticmethod
    def seen(scene, frame):
        """[(name, corners of the results' meshes in the world, triangles)] as renders get them at a frame."""
        scene.frame_set(frame)
        graph = scene.view_layers[0].depsgraph
        found = []
        for instance in graph.object_instances:
            mesh = instance.object.data
            if not instance.object.original.sunder.tree:
                continue
            corners = np.empty(3 * len(mesh.vertices), np.float32)
            mesh.vertices.foreach_get("co", corners)
            triangles = np.empty(len(mesh.loops), np.int32)
            mesh.loops.foreach_get("vertex_index", triangles)
            place = np.array(instance.matrix_world)
            found.append((instance.object.name, corners.reshape(-1, 3) @ place[:3, :3].T + place[:3, 3], triangles))
        return sorted(found, key=lambda one: one[0])

    def plays(self, place=Matrix.Identity(4), times=1, scene=None):
        """What the scene shows is what a.blend shows, `times` times, moved by `place`."""
        place = np.array(place)
        for frame in FRAMES:
            shown = self.seen(scene or bpy.context.scene, frame)
            self.assertEqual([one[0] for one in shown], [one[0] for one in self.there[frame] for _ in range(times)])
            for (name, corners, triangles), at in zip(shown, np.repeat(range(len(self.there[frame])), times)):
                _, wanted, faces = self.there[frame][at]
                np.testing.assert_array_equal(triangles, faces, f"{name} at {frame}")
                np.testing.assert_allclose(corners, wanted @ place[:3, :3].T + place[:3, 3], rtol=0, atol=AS_WRITTEN)
        self.assertEqual(addon("runtime").handler_errors, [])

    def plays_when_opened_again(self, *arguments, name="x/b.blend"):
        self.save(name)
        self.reopen(name)
        self.assertTrue(self.scene.render.use_lock_interface)
        self.plays(*arguments)

    def result(self):
        return next(o for o in addon("player").result_objects() if o.sunder.node == "deformer")

    def note(self):
        return addon("runtime").node_notes[self.result().sunder.tree.name_full, "deformer"]


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
            normals = addon("blender_versions").corner_normals(mesh)
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
        handlers = addon("handlers")

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
        self.assertTrue(addon("result_mesh").is_local(self.result().data))
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
        own = [o for o in addon("player").result_objects() if o.library is None]
        self.assertEqual(len(own), 1)
        self.scene.frame_set(6)
        np.testing.assert_array_equal(positions(own[0]), self.there[6][1][1].astype(np.float32))
        bpy.ops.ed.undo()
        self.plays()
        bpy.ops.ed.redo()
        self.scene = bpy.context.scene
        self.scene.frame_set(5)
        for thing in addon("player").result_objects():
            if thing.sunder.node == "deformer":
                np.testing.assert_array_equal(positions(thing), self.there[5][1][1].astype(np.float32))

    def test_a_blender_that_drops_whole_meshes_says_so(self):
        self.linked_shot()
        self.addCleanup(setattr, addon("blender_versions"), "copy_geometry", addon("blender_versions").copy_geometry)
        addon("blender_versions").copy_geometry = lambda *_: None
        self.scene.frame_set(6)
        self.assertRegex(self.note(), "frame 6 cannot be shown: mesh 'Block fractured' is linked.* make .* local")

    def test_a_local_tree_of_the_same_name_is_told_apart(self):
        self.linked_shot()
        linked = self.result().sunder.tree
        own = bpy.data.node_groups.new(linked.name, linked.bl_idname)
        self.assertEqual(own.name, linked.name)
        tree_of = addon("operators").tree_of
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


class Strips(LinkCase):
    """What a strip of the sequencer renders is what its scene renders at that frame."""

    def setUp(self):
        super().setUp()
        self.make_edit()

    def make_edit(self):
        self.edit = bpy.data.scenes.new("Edit")
        self.dress(self.edit)
        self.edit.render.use_sequencer = True
        self.edit.sequence_editor_create()

    def strips(self):
        editor = self.edit.sequence_editor
        return editor.strips if hasattr(editor, "strips") else editor.sequences  # their name until 4.4

    def strip(self, scene, channel=1, start=10):
        made = self.strips().new_scene("strip", scene, channel, start)
        made.frame_final_duration = 6
        return made

    def picture(self, scene, frame):
        bpy.context.window.scene = scene
        scene.frame_set(frame)
        scene.render.filepath = str(self.folder / "still.png")
        bpy.ops.render.render(write_still=True)
        return self.pixels(self.folder / "still.png")

    def pixels(self, path):
        image = bpy.data.images.load(str(path))
        array = np.empty(4 * WIDTH * HEIGHT, np.float32)
        image.pixels.foreach_get(array)
        bpy.data.images.remove(image)
        return array.reshape(HEIGHT, WIDTH, 4)

    def pictures(self, scene):
        """{frame: picture} of a scene by itself, which is then left at frame 2; each is another one."""
        found = {frame: self.picture(scene, frame) for frame in range(1, 7)}
        for frame in range(1, 6):
            self.assertGreater(np.abs(found[frame] - found[frame + 1]).max(), 0.5)
        scene.frame_set(2)
        return found

    def strips_play(self, scene):
        there = self.pictures(scene)
        self.strip(scene)
        for frame in (12, 15, 10, 13):
            np.testing.assert_array_equal(self.picture(self.edit, frame), there[frame - 9])
        self.edit.frame_start, self.edit.frame_end = 10, 15
        self.edit.render.filepath = str(self.folder / "r_")
        bpy.ops.render.render(animation=True)
        for frame in range(10, 16):
            np.testing.assert_array_equal(self.pixels(self.folder / f"r_{frame:04d}.png"), there[frame - 9])
        self.assertEqual(scene.frame_current, 2)

    def test_a_scene_of_the_same_file(self):
        self.reopen("a.blend")
        self.make_edit()
        self.strips_play(self.scene)

    def test_a_linked_scene(self):
        self.strips_play(self.linked("scenes", "Scene"))

    def test_a_scene_that_holds_linked_results(self):
        self.dress(self.scene)
        self.instance(self.linked(), Matrix.Identity(4))
        self.strips_play(self.scene)
        self.save("x/b.blend")
        self.reopen("x/b.blend")
        self.edit = bpy.data.scenes["Edit"]
        there = self.pictures(bpy.data.scenes["Scene"])
        np.testing.assert_array_equal(self.picture(self.edit, 14), there[5])

    def test_two_frames_of_a_scene_in_one_picture(self):
        scene = self.linked("scenes", "Scene")
        there = self.pictures(scene)
        left, right = self.strip(scene, 1, 10), self.strip(scene, 2, 7)
        left.crop.max_x = right.crop.min_x = WIDTH // 2
        left.blend_type = right.blend_type = "ALPHA_OVER"
        picture = self.picture(self.edit, 11)
        np.testing.assert_array_equal(picture[:, :WIDTH // 2 - 1], there[2][:, :WIDTH // 2 - 1])
        np.testing.assert_array_equal(picture[:, WIDTH // 2 + 1:], there[5][:, WIDTH // 2 + 1:])
        self.assertGreater(np.abs(there[2] - there[5])[:, :WIDTH // 2 - 1].max(), 0.5)
        self.assertGreater(np.abs(there[2] - there[5])[:, WIDTH // 2 + 1:].max(), 0.5)

    def test_two_scenes_that_show_one_mesh_in_one_picture(self):
        self.dress(self.scene)
        held = self.linked("scenes", "Scene")
        there = self.pictures(held)
        self.instance(self.linked(), Matrix.Identity(4))
        left, right = self.strip(held, 1, 10), self.strip(self.scene, 2, 7)
        left.crop.max_x = right.crop.min_x = WIDTH // 2
        left.blend_type = right.blend_type = "ALPHA_OVER"
        picture = self.picture(self.edit, 11)
        np.testing.assert_array_equal(picture[:, :WIDTH // 2 - 1], there[2][:, :WIDTH // 2 - 1])
        np.testing.assert_array_equal(picture[:, WIDTH // 2 + 1:], there[5][:, WIDTH // 2 + 1:])

    def test_times_between_frames_show_the_nearest(self):
        scene = self.linked("scenes", "Scene")
        there, strip = self.pictures(scene), self.strip(scene)
        names = self.strips().bl_rna.functions["new_effect"].parameters.keys()
        end = {"length": 6} if "length" in names else {"frame_end": 16}  # 5.0 and later; before
        of = {"input1" if "input1" in names else "seq1": strip}  # 4.5 and later; before
        speed = self.strips().new_effect("speed", "SPEED", 2, frame_start=10, **end, **of)
        speed.speed_control, speed.speed_factor, speed.use_frame_interpolate = "MULTIPLY", 0.5, False
        asked = []
        note = lambda changed, *_: asked.append(changed.frame_current_final) if changed == scene else None
        bpy.app.handlers.frame_change_post.append(note)
        self.addCleanup(bpy.app.handlers.frame_change_post.remove, note)
        for frame in (11, 13):  # halfway between two; 4.2 takes the one before
            picture = self.picture(self.edit, frame)
            self.assertIn(asked[-1], ((frame - 8) / 2, (frame - 9) // 2))
            np.testing.assert_array_equal(picture, there[int(np.floor(asked[-1] + 0.5))])

    def test_a_strip_of_a_sequence_of_strips(self):
        scene = self.linked("scenes", "Scene")
        there = self.pictures(scene)
        self.strip(scene)
        inner = self.edit
        self.make_edit()
        outer = self.strip(inner, start=1)
        outer.scene_input, outer.frame_final_duration = "SEQUENCER", 20
        np.testing.assert_array_equal(self.picture(self.edit, 13), there[4])

    def test_sub_frames_of_motion_blur(self):
        scene = self.linked("scenes", "Scene")
        scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
        scene.render.use_motion_blur = True
        there = self.picture(scene, 4)
        scene.frame_set(2)
        self.strip(scene)
        np.testing.assert_array_equal(self.picture(self.edit, 13), there)


if __name__ == "__main__":
    main()
