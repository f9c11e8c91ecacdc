"""What tests of linked shots share: a baked shot in one file, and another file that picks it up."""
import os

import bpy
import numpy as np
from mathutils import Matrix, Vector

from addon_case import AddonCase, addon

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
        self.assertEqual(addon("base.runtime").handler_errors, [])

    def plays_when_opened_again(self, *arguments, name="x/b.blend"):
        self.save(name)
        self.reopen(name)
        self.assertTrue(self.scene.render.use_lock_interface)
        self.plays(*arguments)

    def result(self):
        return next(o for o in addon("tree.trees").result_objects() if o.sunder.node == "deformer")

    def note(self):
        return addon("base.runtime").node_notes[self.result().sunder.tree.name_full, "deformer"]
