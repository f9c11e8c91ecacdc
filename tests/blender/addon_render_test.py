"""What is rendered is what was baked: the tear is seen, twice the same picture, stills and animation alike."""
import bpy
import numpy as np
from mathutils import Vector

from addon_case import AddonCase, addon, main, versions

WIDTH, HEIGHT = 96, 72
GREEN, RED = (0.02, 0.6, 0.05, 1.0), (1.0, 0.02, 0.02, 1.0)


class Render(AddonCase):
    def setUp(self):
        super().setUp()
        self.scene.frame_end = 12
        thing = self.cube(size=1, location=(0, 0, 0.8))
        outer = bpy.data.materials.new("outer")
        outer.diffuse_color = GREEN
        thing.data.materials.append(outer)
        self.shot, nodes = self.tree(thing, pieces=30, fall_speed=12)
        nodes["solver"].set_parameters(substeps=8)
        self.result, = self.results(self.shot)
        addon("results.interiors").raw().diffuse_color = RED
        self.bake(self.shot)
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        camera.location = (1.5, -3, 2)
        camera.rotation_euler = (Vector((0, 0, 0.4)) - camera.location).to_track_quat("-Z", "Y").to_euler()
        self.scene.collection.objects.link(camera)
        self.scene.camera = camera
        render = self.scene.render
        render.engine, render.resolution_x, render.resolution_y = "BLENDER_WORKBENCH", WIDTH, HEIGHT
        render.image_settings.color_mode = "RGB"
        self.scene.display.shading.color_type, self.scene.display.shading.light = "MATERIAL", "FLAT"
        self.scene.view_settings.view_transform = "Standard"

    def still(self, frame, name="still"):
        self.scene.frame_set(frame)
        return self.rendered(name)

    def rendered(self, name):
        self.scene.render.filepath = str(self.folder / name)
        bpy.ops.render.render(write_still=True)
        return self.pixels(self.folder / f"{name}.png")

    def pixels(self, path):
        image = bpy.data.images.load(str(path))
        array = np.empty(4 * WIDTH * HEIGHT, np.float32)
        image.pixels.foreach_get(array)
        bpy.data.images.remove(image)
        return array.reshape(HEIGHT, WIDTH, 4)[..., :3]

    @staticmethod
    def count(picture):
        """Pixels of the outer material, and of break surfaces."""
        red, green = picture[..., 0], picture[..., 1]
        return int((green > 2 * red + 0.1).sum()), int((red > 2 * green + 0.1).sum())

    def test_the_tear_is_seen_and_only_once_it_tore(self):
        whole, torn, again = self.still(1), self.still(12), self.still(12)
        np.testing.assert_array_equal(torn, again)
        outer, inner = self.count(whole)
        self.assertTrue(outer > 500 and inner == 0, (outer, inner))  # of 6912
        self.assertGreater(self.count(torn)[1], 50)
        np.testing.assert_array_equal(self.still(1), whole)

    def test_an_animation_has_the_frames_that_stills_have(self):
        self.scene.frame_start, self.scene.frame_end = 4, 6
        self.scene.render.filepath = str(self.folder / "r_")
        bpy.ops.render.render(animation=True)
        pictures = [self.pixels(self.folder / f"r_{f:04d}.png") for f in (4, 5, 6)]
        for frame, picture in zip((4, 5, 6), pictures):
            np.testing.assert_array_equal(picture, self.still(frame))
        self.assertGreater(np.abs(pictures[0] - pictures[2]).sum(), 1)

    def test_an_animation_has_the_keys_of_a_result(self):
        """Blender makes a render's copy of an object anew when its mesh was written, from what keys are not written to."""
        rise = self.result.modifiers.new("rise", "DISPLACE")
        rise.direction, rise.mid_level = "Z", 0
        keys = [(rise, "strength", (0, 0.6)), (self.result, "location", ((0, 0, 0), (0.4, 0, 0)))]
        for holder, name, values in keys:
            for frame, value in zip((1, 12), values):
                setattr(holder, name, value)
                holder.keyframe_insert(name, frame=frame)
        self.scene.frame_set(1)
        self.scene.render.filepath = str(self.folder / "keyed_")
        bpy.ops.render.render(animation=True)
        for frame in (1, 6, 12):
            np.testing.assert_array_equal(self.pixels(self.folder / f"keyed_{frame:04}.png"), self.still(frame))

    def test_a_saved_file_renders_alike_when_it_is_opened_again(self):
        there = self.still(12)
        self.save()
        self.scene.frame_set(1)
        self.save()
        self.reopen()
        np.testing.assert_array_equal(self.still(12), there)

    def test_velocities_blur_what_moves_although_faces_come_and_go(self):
        self.scene.render.engine = "CYCLES"
        # Enough paths that their noise has no edges of its own, before a sky so bright that the block has.
        self.scene.cycles.samples, self.scene.cycles.use_denoising, self.scene.cycles.seed = 16, False, 1
        self.scene.world = bpy.data.worlds.new("sky")
        for thing, socket in ((self.scene.world, "Background"), (self.result.data.materials[0], "Principled BSDF")):
            versions().turn_on_nodes(thing)
            color = (1, 1, 1, 1) if thing == self.scene.world else (0.02, 0.02, 0.02, 1)
            thing.node_tree.nodes[socket].inputs[0].default_value = color
        self.scene.frame_set(2)  # it falls at 12 m/s: half a metre a frame

        def edges(name):
            grey = self.rendered(name).mean(2)
            return np.abs(np.diff(grey, axis=0)).max(0).sum()

        sharp = edges("sharp")
        self.scene.render.use_motion_blur = True
        self.scene.render.motion_blur_shutter = 1.0
        blurred = edges("blurred")
        self.assertEqual(addon("results.player").nearest_frame(self.scene), 2)
        self.assertLess(blurred, 0.8 * sharp)

    def test_outer_surfaces_are_lit_as_if_no_break_met_them(self):
        """Their points are those of break surfaces, too, whose normals are others: apart they cannot take these."""
        self.scene.render.engine = "CYCLES"
        self.scene.cycles.samples, self.scene.cycles.use_denoising, self.scene.cycles.seed = 16, False, 1
        sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
        sun.data.energy, sun.rotation_euler = 3, (0.6, 0.3, 0.2)
        self.scene.collection.objects.link(sun)
        whole = self.still(12, "whole")
        bpy.ops.sunder.split_inside(tree=self.shot.name)
        apart = self.still(12, "apart")
        self.assertLess((np.abs(whole - apart).max(2) > 0.1).mean(), 0.005)

    def test_eevee_blurs_it_too(self):
        """EEVEE takes points at the opening and the closing of the shutter: both must be nearest to the frame itself."""
        versions().set_eevee(self.scene)
        self.scene.eevee.taa_render_samples = 8
        self.scene.world = bpy.data.worlds.new("sky")
        versions().turn_on_nodes(self.scene.world)
        self.scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
        self.scene.frame_set(2)

        def edges(name):
            return np.abs(np.diff(self.rendered(name).mean(2), axis=0)).max(0).sum()

        sharp = edges("sharp")
        versions().set_motion_blur(self.scene, 0.9)
        self.assertLess(edges("blurred"), 0.8 * sharp)


if __name__ == "__main__":
    main()
