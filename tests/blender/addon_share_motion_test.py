"""What a result does besides what its mesh shows is in the shared file, too: modifiers, places, visibility, what is keyed."""
import bpy
import numpy as np
from mathutils import Matrix, kdtree

from addon_case import addon, main
from share_case import FRAMES, SHARE, ShareCase


def far(points, others):
    """How far the points are from the nearest of others, at most."""
    tree = kdtree.KDTree(len(others))
    for i, point in enumerate(others):
        tree.insert(point, i)
    tree.balance()
    return max(tree.find(point)[2] for point in points)


class MotionCase(ShareCase):
    def setUp(self):
        super().setUp()
        self.block = bpy.data.objects["Block fractured"]

    def key(self, thing, path, *values):
        """Values of a property at the first and at the last frame."""
        owner, _, name = path.rpartition(".")
        for frame, value in zip((1, 6), values):
            setattr(thing.path_resolve(owner) if owner else thing, name, value)
            thing.keyframe_insert(path, frame=frame)

    def empty(self, **properties):
        made = bpy.data.objects.new("Empty", None)
        self.scene.collection.objects.link(made)
        for name, value in properties.items():
            setattr(made, name, value)
        return made

    def here(self, name, frame):
        """Points that a result shows here, in the scene."""
        self.scene.frame_set(frame)
        evaluated = bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get())
        points = np.array([(*v.co, 1) for v in evaluated.data.vertices])
        return (points @ np.array(evaluated.matrix_world).T)[:, :3]

    def there(self, shown, name="Block fractured"):
        """Points of what was shared of a result, but for those that hold the place of what has no faces yet."""
        found = [s["points"] for n, s in shown.items() if n.startswith(f"{name} shared")]
        return np.concatenate([points for points in found if np.ptp(points, axis=0).any()])

    def assert_same(self, points, others, told=None):
        self.assertLess(max(far(points, others), far(others, points)), SHARE * self.size, told)

    def kinds(self):
        return ("CACHE", "MESHES") if self.has_alembic() else ("MESHES",)

    def plays_as_here(self, kinds=None):
        wanted = {(name, frame): self.here(name, frame) for name in ("Block fractured", "Crate moving") for frame in FRAMES}
        for kind in kinds or self.kinds():
            self.notes = self.shared(kind)[1]
            found = self.elsewhere("link")
            for (name, frame), points in wanted.items():
                with self.subTest(kind, name=name, frame=frame):
                    self.assert_same(self.there(found[frame], name), points)


class Modifiers(MotionCase):
    def test_keys_and_drivers_of_modifiers(self):
        twist = self.block.modifiers.new("A. \"b\"", "SIMPLE_DEFORM")
        twist.deform_method, twist.deform_axis = "TWIST", "Z"
        self.key(self.block, 'modifiers["A. \\"b\\""].angle', 0.0, 1.0)
        cast = self.block.modifiers.new("Cast", "CAST")
        cast.factor = 0
        self.block.driver_add('modifiers["Cast"].factor').driver.expression = "frame / 10"
        crate = bpy.data.objects["Crate moving"]
        crate.modifiers.new("Cast", "CAST")
        self.key(crate, 'modifiers["Cast"].factor', 0.0, 0.5)
        self.plays_as_here()

    def test_outer_and_break_surfaces_stay_together(self):
        self.block.modifiers.new("Puffed", "DISPLACE").strength = 0.05
        self.plays_as_here()

    def test_what_renders_show_is_cached(self):
        smooth = self.block.modifiers.new("Smooth", "SUBSURF")
        smooth.levels, smooth.render_levels = 2, 2
        wanted = self.here("Block fractured", 6)
        smooth.levels = 1
        if self.has_alembic():
            self.shared("CACHE")
            self.assert_same(self.there(self.elsewhere("open", frames=(6,))[6]), wanted)

    def test_what_begins_anew_at_each_mesh_is_told(self):
        self.block.modifiers.new("Cloth", "CLOTH")
        self.assertRegex(self.shared("MESHES")[1][0], "begin anew at each: Block fractured")


    def test_what_modifiers_leave_nothing_of_is_told(self):
        build = self.block.modifiers.new("Build", "BUILD")
        build.frame_start, build.frame_duration = 2, 3
        for kind in self.kinds():
            self.assertEqual("leave no faces at the first frame" in " ".join(self.shared(kind)[1]), kind == "CACHE")


class Places(MotionCase):
    def test_shear_that_stays(self):
        self.block.parent = self.empty(scale=(1, 2, 1), rotation_euler=(0.2, 0, 0))
        self.block.rotation_euler = (0, 0.5, 0.7)
        crate = bpy.data.objects["Crate moving"]
        self.key(self.block.parent, "location", (0, 0, 0), (3, 0, 1))
        self.key(self.block.parent, "rotation_euler", (0, 0, 0), (1, 2, 3))
        self.plays_as_here()
        self.assertNotIn("shear", " ".join(self.notes))
        self.assertIsNone(crate.parent)

    def test_shear_that_changes(self):
        self.block.parent = self.empty(scale=(1, 2, -1))
        self.key(self.block, "rotation_euler", (0, 0, 0), (0, 0.5, 1))
        self.plays_as_here(("MESHES",))
        if self.has_alembic():
            self.assertIn("shear that changes is kept as at the first frame", self.shared("CACHE")[1][0])

    def test_parents_with_an_inverse_and_deltas(self):
        parent = self.empty(location=(1, 2, 3), rotation_euler=(0.1, 0.2, 0.3))
        bpy.context.view_layer.update()
        self.block.parent, self.block.matrix_parent_inverse = parent, Matrix(parent.matrix_world).inverted()
        self.block.delta_location, self.block.delta_scale = (0, 1, 0), (1, 1, 2)
        self.key(parent, "location", (1, 2, 3), (2, 2, 3))
        self.plays_as_here()

    def test_deltas_alone(self):
        self.block.delta_location, self.block.delta_rotation_euler = (0, 1, 0), (0, 0, 1)
        self.plays_as_here()

    def test_where_it_is_hidden_it_goes_on_moving(self):
        self.key(self.block, "location", (0, 0, 0), (2, 0, 0))
        self.block.hide_viewport = False
        wanted = self.here("Block fractured", 6)
        for frame, is_hidden in ((1, False), (3, True), (6, False)):
            self.block.hide_viewport = is_hidden
            self.block.keyframe_insert("hide_viewport", frame=frame)
        for kind in self.kinds():
            self.shared(kind)
            found = self.elsewhere("open")
            shown = [frame for frame in sorted(FRAMES) if any(n.startswith("Block") for n in found[frame])]
            self.assertEqual(shown, [1, 2, 6], kind)
            self.assert_same(self.there(found[6]), wanted)

    def test_what_has_no_break_surface_yet_lies_in_the_result(self):
        if not self.has_alembic():
            return
        self.block.location = (5, 6, 7)
        for is_split in (False, True):
            if is_split:
                bpy.ops.sunder.split_inside(tree=self.block_tree.name)
            self.shared("CACHE")
            points = [s["points"] for n, s in self.elsewhere("open", frames=(1,))[1].items() if "inside" in n]
            wanted = self.here("Block fractured", 1)
            self.assertTrue(((points[0] >= wanted.min(0) - 1e-5) & (points[0] <= wanted.max(0) + 1e-5)).all(), points)

    def test_a_scene_of_another_time(self):
        self.scene.render.frame_map_old, self.scene.render.frame_map_new = 100, 200
        wanted = {frame: self.here("Block fractured", frame) for frame in (2, 8, 12)}
        for kind in self.kinds():
            self.shared(kind)
            found = self.elsewhere("open", frames=tuple(wanted))
            self.assertEqual(self.range, [2, 12, 24])
            for frame, points in wanted.items():
                self.assert_same(self.there(found[frame]), points, (kind, frame))


class Looks(MotionCase):
    def open(self):
        """Objects of the shared file that show the block."""
        bpy.ops.wm.open_mainfile(filepath=str(self.paths()[1]))
        self.scene = bpy.context.scene
        return [o for o in self.scene.objects if o.name.startswith("Block fractured shared") and o.type == "MESH"]

    def test_what_an_object_is_to_renders(self):
        looks = {"color": (1, 0, 0, 1), "pass_index": 7, "visible_shadow": False, "display_type": "WIRE", "hide_render": True}
        for name, value in looks.items():
            setattr(self.block, name, value)
        self.block["glow"] = 0.5
        self.save("a.blend")
        for kind in self.kinds():
            self.assertEqual(self.click(kind=kind), {"FINISHED"})
            for thing in self.open():
                self.assertEqual({name: getattr(thing, name) for name in looks} | {"color": tuple(thing.color)}, looks)
                self.assertEqual(thing["glow"], 0.5)
            self.reopen("a.blend")
            self.block_tree = bpy.data.objects["Block fractured"].sunder.tree

    def test_what_is_keyed(self):
        self.block["glow"] = 0.0
        self.key(self.block, "color", (1, 0, 0, 1), (0, 0, 1, 1))
        for frame, glow in ((1, 0.0), (6, 5.0)):
            self.block["glow"] = glow
            self.block.keyframe_insert('["glow"]', frame=frame)
        for curve in addon("base.blender_versions").curves_of(self.block.animation_data):
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
        for frame, is_hidden in ((1, False), (4, True)):
            self.block.hide_render = is_hidden
            self.block.keyframe_insert("hide_render", frame=frame)
        for kind in self.kinds():
            self.shared(kind)
            found = self.elsewhere("link")
            for frame in FRAMES:
                for shown in (s for n, s in found[frame].items() if n.startswith("Block")):
                    share = (frame - 1) / 5
                    np.testing.assert_allclose(shown["color"], (1 - share, 0, share, 1), atol=1e-5)
                    self.assertAlmostEqual(float(shown["glow"]), 5 * share, 5)
                    self.assertEqual(bool(shown["is_rendered"]), frame < 4, (kind, frame))

    def test_light_linking_is_told(self):
        if not hasattr(self.block, "light_linking"):
            return
        lit = bpy.data.collections.new("Lit")
        lit.objects.link(self.block)
        lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
        lamp.light_linking.receiver_collection = lit
        crate = bpy.data.objects["Crate moving"]
        crate.light_linking.blocker_collection = lit
        for kind in self.kinds():
            self.assertEqual(self.shared(kind)[1], ["light linking does not come along: Block fractured, Crate moving"])
            with bpy.data.libraries.load(str(self.paths()[1])) as (there, _):
                self.assertNotIn("Lit", there.collections)

    def test_what_stood_back_for_what_was_shared_is_shown_when_shared_again(self):
        for _ in range(2):
            self.assertEqual(self.shared()[1], [])
            self.assertTrue(all(s["is_rendered"] for s in self.elsewhere("open", frames=(1,))[1].values()))
            bpy.ops.sunder.use_shared(tree=self.block_tree.name)
            self.assertTrue(self.block.hide_render)


if __name__ == "__main__":
    main()
