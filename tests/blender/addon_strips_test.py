"""Strips in the sequencer play the shots of the scenes that they show, each at its own frame."""
import bpy
import numpy as np
from mathutils import Matrix

from addon_case import main
from link_case import HEIGHT, WIDTH, LinkCase


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
        scene.frame_set(int(np.floor(frame)), subframe=frame % 1)
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

    def test_times_between_frames_are_those_of_the_scene(self):
        scene = self.linked("scenes", "Scene")
        strip = self.strip(scene)
        names = self.strips().bl_rna.functions["new_effect"].parameters.keys()
        end = {"length": 6} if "length" in names else {"frame_end": 16}  # 5.0 and later; before
        of = {"input1" if "input1" in names else "seq1": strip}  # 4.5 and later; before
        speed = self.strips().new_effect("speed", "SPEED", 2, frame_start=10, **end, **of)
        speed.speed_control, speed.speed_factor, speed.use_frame_interpolate = "MULTIPLY", 0.5, False
        asked = []
        note = lambda changed, *_: asked.append(float(changed.frame_current_final)) if changed == scene else None
        bpy.app.handlers.frame_change_post.append(note)
        self.addCleanup(bpy.app.handlers.frame_change_post.remove, note)
        for frame in (11, 13):  # halfway between two; 4.2 takes the one before
            picture = self.picture(self.edit, frame)
            self.assertIn(asked[-1], ((frame - 8) / 2, (frame - 9) // 2))
            np.testing.assert_array_equal(picture, self.picture(scene, asked[-1]))

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
