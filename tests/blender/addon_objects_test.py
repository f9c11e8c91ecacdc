"""What the library is told of Blender's objects is where they stand, how large they are and how they move."""
import math
import unittest.mock

import bpy
import numpy as np
from mathutils import Euler, Matrix

from addon_case import ObjectCase, addon, main, versions


def volume(corners):
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def rounded(*numbers):
    """As whole 10,000ths, to be looked for in a set."""
    return tuple(np.rint(np.multiply(numbers, 1e4)).astype(int))


class Meshes(ObjectCase):
    def test_a_body_stands_where_its_object_does_scaled_turned_and_sheared(self):
        parent = self.cube(name="Parent")
        parent.scale, parent.rotation_euler, parent.location = (1, 2, 1), (0.4, 0, 0.3), (1, 0, 2)
        thing = self.cube(name="Child")
        thing.parent = parent
        thing.rotation_euler, thing.scale = (0, 0.5, 0.7), (1.5, 0.5, 1)
        bpy.context.view_layer.update()
        tree, _ = self.tree(thing)
        corners = self.placed(tree)
        wanted = np.array([thing.matrix_world @ v.co for v in thing.data.vertices])
        # Single precision of positions near 3 m.
        np.testing.assert_allclose(corners.reshape(-1, 3).min(0), wanted.min(0), atol=2e-6)
        np.testing.assert_allclose(corners.reshape(-1, 3).max(0), wanted.max(0), atol=2e-6)
        self.assertAlmostEqual(volume(corners), 0.4**3 * thing.matrix_world.determinant(), places=6)

    def test_a_mirrored_object_is_not_inside_out(self):
        thing = self.cube()
        thing.scale = (1, -1.5, 1)
        bpy.context.view_layer.update()
        tree, _ = self.tree(thing)
        self.assertAlmostEqual(volume(self.placed(tree)), 1.5 * 0.4**3, places=6)

    def test_modifiers_are_applied_unless_told_otherwise(self):
        thing = self.cube()
        thing.modifiers.new("twice", "ARRAY").relative_offset_displace = (3, 0, 0)
        tree, nodes = self.tree(thing, pieces=4)
        self.assertAlmostEqual(volume(self.placed(tree)), 2 * 0.4**3, places=6)
        nodes["mesh_file"].use_modifiers = False
        self.assertAlmostEqual(volume(self.placed(tree)), 0.4**3, places=6)

    def test_a_hidden_object_keeps_its_modifiers_and_place(self):
        thing = self.cube(location=(0, 0, 0))
        thing.modifiers.new("twice", "ARRAY").relative_offset_displace = (3, 0, 0)
        tree, _ = self.tree(thing)
        thing.location.z = 2
        thing.hide_set(True)
        corners = self.placed(tree)
        self.assertAlmostEqual(volume(corners), 2 * 0.4**3, places=6)
        self.assertAlmostEqual(corners[..., 2].max(), 2.2, places=6)

    def test_an_object_that_blender_does_not_evaluate_is_refused(self):
        tree, nodes = self.tree()
        thing = nodes["mesh_file"].object
        group = bpy.data.collections.new("Shelf")
        self.scene.collection.children.link(group)
        self.results(tree)  # whose pointer alone makes Blender evaluate the object, but not its modifiers
        thing.hide_viewport = True
        self.assertIn("'Block' is disabled in viewports", self.refusal(tree))
        thing.hide_viewport = False
        self.scene.collection.objects.unlink(thing)
        self.assertIn("not in this view layer", self.refusal(tree))
        second = bpy.data.scenes.new("Second")
        second.collection.objects.link(thing)
        self.assertIn("'Block' is of scene 'Second', not of 'Scene'", self.refusal(tree))
        group.objects.link(thing)
        group.hide_viewport = True
        self.assertIn("disabled in viewports", self.refusal(tree))
        group.hide_viewport = False
        self.assertEqual(self.bake(tree), {"FINISHED"})

    def test_a_collection_is_one_mesh(self):
        group = bpy.data.collections.new("Parts")
        self.scene.collection.children.link(group)
        for name, x in (("A", 0.0), ("B", 1.0)):
            thing = self.cube(location=(x, 0, 1), name=name)
            group.objects.link(thing)
        tree, nodes = self.tree(bpy.data.objects["A"], pieces=4)
        nodes["mesh_file"].source, nodes["mesh_file"].collection = "COLLECTION", group
        corners = self.placed(tree)
        self.assertAlmostEqual(volume(corners), 2 * 0.4**3, places=6)
        self.assertAlmostEqual(corners[..., 0].max(), 1.2, places=6)
        nodes["mesh_file"].collection = bpy.data.collections.new("Nothing")
        self.assertIn("has no mesh object", self.refusal(tree))

    def test_materials_uvs_and_flat_or_smooth_faces_arrive(self):
        thing = self.cube()
        for name in ("first", "second"):
            thing.data.materials.append(bpy.data.materials.new(name))
        thing.data.polygons[2].material_index = 1
        tree, _ = self.tree(thing)
        mesh = self.graph(tree).evaluate("mesh_file.mesh")
        self.assertEqual(sorted(mesh.face_material), [0] * 10 + [1] * 2)
        corners = mesh.positions[mesh.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        np.testing.assert_allclose(mesh.normals.reshape(-1, 3, 3), np.repeat(normal[:, None], 3, 1), atol=1e-6)
        layer = thing.data.uv_layers.active.data
        known = {rounded(*thing.data.vertices[l.vertex_index].co, *layer[l.index].uv) for l in thing.data.loops}
        found = {rounded(*p, *uv) for p, uv in zip(corners.reshape(-1, 3), mesh.uvs.reshape(-1, 2))}
        self.assertEqual(found, known)

    def test_colours_of_corners_and_points_bytes_and_floats_arrive_linear(self):
        for kind, domain in (("BYTE_COLOR", "CORNER"), ("FLOAT_COLOR", "POINT"), ("FLOAT_COLOR", "CORNER")):
            thing = self.cube()
            thing.scale.x = -1  # mirrored: corners are taken in the other order
            thing.data.color_attributes.new("Other", "FLOAT_COLOR", "POINT")
            layer = thing.data.color_attributes.new("Paint", kind, domain)
            thing.data.color_attributes.render_color_index = thing.data.color_attributes.find("Paint")
            for n, point in enumerate(layer.data):
                point.color = (0.1 * (n % 10), 0.5, 0.02 * n, 1)
            tree, _ = self.tree(thing)
            mesh = self.graph(tree).evaluate("mesh_file.mesh")
            own = addon("scene.scene_input").placement(thing.matrix_world)[2]
            known = {rounded(*(own @ thing.data.vertices[l.vertex_index].co),
                             *layer.data[l.vertex_index if domain == "POINT" else l.index].color) for l in thing.data.loops}
            corners = mesh.positions[mesh.triangles].reshape(-1, 3)
            found = {rounded(*p, *c) for p, c in zip(corners, mesh.colors)}
            self.assertEqual(found, known, (kind, domain))

    def test_of_several_parts_those_without_colours_are_white(self):
        group = bpy.data.collections.new("Parts")
        self.scene.collection.children.link(group)
        for name, x in (("A", 0.0), ("B", 1.0)):
            group.objects.link(self.cube(location=(x, 0, 1), name=name))
        for point in bpy.data.objects["B"].data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT").data:
            point.color = (0.2, 0.3, 0.4, 1)
        tree, nodes = self.tree(bpy.data.objects["A"], pieces=4)
        nodes["mesh_file"].source, nodes["mesh_file"].collection = "COLLECTION", group
        mesh = self.graph(tree).evaluate("mesh_file.mesh")
        is_first = mesh.positions[mesh.triangles][..., 0].ravel() < 0.5
        np.testing.assert_allclose(mesh.colors[is_first], 1)
        np.testing.assert_allclose(mesh.colors[~is_first], np.tile((0.2, 0.3, 0.4, 1), (36, 1)), rtol=1e-6)

    def test_the_uv_map_that_renders_show_arrives_whichever_is_selected(self):
        thing = self.cube()
        layers = thing.data.uv_layers
        for point in layers.new(name="Selected").data:
            point.uv = (0.5, 0.5)
        layers.active_index, layers["UVMap"].active_render = 1, True
        tree, _ = self.tree(thing)
        uvs = self.graph(tree).evaluate("mesh_file.mesh").uvs
        self.assertEqual({tuple(np.round(uv, 4)) for uv in uvs}, {tuple(np.round(d.uv, 4)) for d in layers["UVMap"].data})

    def test_other_colours_and_another_map_to_render_make_a_bake_out_of_date(self):
        thing = self.cube()
        layers = thing.data.uv_layers
        for point in layers.new(name="Other").data:
            point.uv = (0.5, 0.5)
        layer = thing.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
        tree, _ = self.tree(thing, pieces=4)
        self.bake(tree)
        self.assertFalse(self.status(tree).is_stale)
        layer.data[0].color = (1, 0, 0, 1)
        thing.data.update()
        bpy.context.view_layer.update()
        self.assertTrue(self.status(tree).is_stale)
        self.bake(tree)
        layers["Other"].active_render = True
        bpy.context.view_layer.update()
        self.assertTrue(self.status(tree).is_stale)

    def test_what_is_squeezed_flat_is_told_by_its_name_on_its_node(self):
        thing = self.cube()
        tree, nodes = self.tree(thing)
        parent = self.cube(name="Parent")
        parent.scale, parent.rotation_euler = (1, 1, 0), (0.3, 0.2, 0)
        for scale, owner in (((1, 1, 0), None), ((0, 0, 0), None), ((1, 1, 1), parent)):
            thing.scale, thing.parent = scale, owner
            self.assertRegex(self.refusal(tree), "'Block' is squeezed flat: its scale, .* is 0 along an axis")
            self.assertIn("squeezed flat", nodes["mesh_file"].error)
        thing.parent, thing.scale = None, (1, 1, 1e-3)  # thin, but there
        self.assertEqual(self.bake(tree), {"FINISHED"})
        wall = self.cube(name="Wall")
        wall.scale.x = 0
        nodes["collider"].source, nodes["collider"].object, nodes["collider"].shape = "OBJECT", wall, "mesh"
        self.assertIn("'Wall' is squeezed flat", self.refusal(tree))
        self.assertIn("squeezed flat", nodes["collider"].error)

    def test_an_object_in_edit_mode_is_refused(self):
        tree, _ = self.tree()
        bpy.ops.object.mode_set(mode="EDIT")
        self.assertIn("is in edit mode", self.refusal(tree))


class Shapes(ObjectCase):
    def test_a_collider_has_place_and_size_of_its_object(self):
        thing = self.cube(size=2, location=(1, 2, 3), name="Wall")
        thing.scale, thing.rotation_euler = (1, 0.5, 3), (0, 0, math.radians(30))
        tree = self.wired_collider(source="OBJECT", object=thing, shape="box")
        node = self.graph(tree)["collider"]
        self.assertEqual([node["size"], node["position"]], [[2, 1, 6], [1, 2, 3]])
        np.testing.assert_allclose(node["rotation"], [0, 0, 30], atol=1e-5)
        tree.nodes["Floor"].shape = "capsule"
        node = self.graph(tree)["collider"]
        np.testing.assert_allclose([node["radius"], node["height"]], [1, 4], rtol=1e-6)

    def test_a_bounding_box_beside_the_origin_is_met(self):
        thing = self.cube(size=2, name="Off")
        thing.data.transform(Matrix.Translation((0, 0, 1)))  # the origin lies in its lower face
        thing.location, thing.rotation_euler = (0, 0, 0), (math.radians(90), 0, 0)
        bpy.context.view_layer.update()
        tree = self.wired_collider(source="OBJECT", object=thing, shape="sphere")
        np.testing.assert_allclose(self.graph(tree)["collider"]["position"], [0, -1, 0], atol=1e-6)

    def test_an_animated_collider_moves_between_its_keys_and_turns_more_than_once(self):
        thing = self.cube(size=1, location=(0, 0, 0), name="Tool")
        thing.keyframe_insert("location", frame=2), thing.keyframe_insert("rotation_euler", frame=2)
        thing.location, thing.rotation_euler = (0, 0, 2), (0, 0, math.radians(720))
        thing.keyframe_insert("location", frame=5), thing.keyframe_insert("rotation_euler", frame=5)
        for curve in versions().curves_of(thing.animation_data):
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
        tree = self.wired_collider(source="OBJECT", object=thing, shape="box")
        node = self.graph(tree)["collider"]
        heights = [node.at("position", f)[2] for f in range(1, 7)]
        np.testing.assert_allclose(heights, [0, 0, 2 / 3, 4 / 3, 2, 2], atol=1e-6)
        self.assertEqual([k[0] for k in node["position"]["keys"]], [2, 3, 4, 5])  # the still time is left out
        for f in range(1, 7):  # a frame's turn of 240 degrees is met, by whichever way round
            self.scene.frame_set(f)
            turned = Euler([math.radians(a) for a in node.at("rotation", f)]).to_quaternion()
            self.assertAlmostEqual(abs(turned.dot(thing.matrix_world.to_quaternion())), 1, places=5)

    def test_a_parents_motion_counts(self):
        parent = self.cube(name="Parent")
        thing = self.cube(size=1, location=(0, 0, 0), name="Tool")
        thing.parent = parent
        parent.location = (0, 0, 0)
        parent.keyframe_insert("location", frame=1)
        parent.location = (0, 0, 1)
        parent.keyframe_insert("location", frame=6)
        tree = self.wired_collider(source="OBJECT", object=thing, shape="box")
        self.assertAlmostEqual(self.graph(tree)["collider"].at("position", 6)[2], 1, places=6)

    def test_a_collection_makes_one_rigid_body_for_each_object(self):
        group = bpy.data.collections.new("Balls")
        self.scene.collection.children.link(group)
        for name, x in (("B", 3.0), ("A", 2.0)):
            group.objects.link(self.cube(size=0.2, location=(x, 0, 1), name=name))
        tree, nodes = self.tree(self.cube())
        balls = self.node(tree, "rigid_body", mass=3)
        balls.source, balls.collection = "COLLECTION", group
        self.connect(balls, "rigid_body", nodes["solver"], "rigid_bodies")
        graph = self.graph(tree)
        self.assertEqual(graph["solver"]["rigid_bodies"], ["@rigid_body.rigid_body", "@rigid_body:2.rigid_body"])
        self.assertEqual([graph[n]["position"][0] for n in ("rigid_body", "rigid_body:2")], [2, 3])
        self.assertEqual([graph[n]["mass"] for n in ("rigid_body", "rigid_body:2")], [3, 3])
        np.testing.assert_allclose(graph["rigid_body"]["radius"], 0.1, rtol=1e-6)

    def test_a_flat_box_is_refused_on_its_node(self):
        bpy.ops.mesh.primitive_plane_add()
        tree = self.wired_collider(source="OBJECT", object=bpy.context.object, shape="box")
        self.assertIn("holds no box", self.refusal(tree))
        self.assertIn("holds no box", tree.nodes["Floor"].error)


class Pins(ObjectCase):
    def pinned(self, **parameters):
        tree, nodes = self.tree(pieces=12)
        pin = self.node(tree, "pin")
        for name, value in parameters.items():
            setattr(pin, name, value)
        self.connect(nodes["body"], "body", pin, "body")
        self.connect(pin, "pin", nodes["solver"], "pins")
        return tree, nodes, pin

    def test_the_region_is_the_bounding_box_of_an_empty_or_a_mesh(self):
        bpy.ops.object.empty_add(location=(0.5, 0, 0), radius=0.25)
        tree, _, pin = self.pinned(source="OBJECT", object=bpy.context.object)
        node = self.graph(tree)["pin"]
        self.assertEqual([node["box_min"], node["box_max"]], [[0.25, -0.25, -0.25], [0.75, 0.25, 0.25]])
        pin.region = "sphere"
        node = self.graph(tree)["pin"]
        self.assertEqual([node["center"], node["radius"]], [[0.5, 0, 0], 0.25])

    def test_what_is_held_follows_the_mover(self):
        bpy.ops.object.empty_add(location=(0, 0, 1))
        mover = bpy.context.object
        mover.rotation_euler = (0, 0, 0.5)
        mover.keyframe_insert("location", frame=1), mover.keyframe_insert("rotation_euler", frame=1)
        mover.location, mover.rotation_euler = (0, 0, 3), (0, 0, 0.5 + math.radians(90))
        mover.keyframe_insert("location", frame=6), mover.keyframe_insert("rotation_euler", frame=6)
        tree, _, _ = self.pinned(motion_object=mover)
        node = self.graph(tree)["pin"]
        self.assertEqual([node["pivot"], node.at("position", 1), node.at("position", 6)], [[0, 0, 1], [0, 0, 0], [0, 0, 2]])
        np.testing.assert_allclose(node.at("rotation", 6), [0, 0, 90], atol=1e-4)

    def test_a_vertex_group_holds_the_fragments_at_its_vertices(self):
        tree, nodes, pin = self.pinned(region="group", group="Top")
        thing = nodes["mesh_file"].object
        thing.vertex_groups.new(name="Bottom")
        self.assertIn("no vertex group 'Top'", self.refusal(tree))
        group = thing.vertex_groups.new(name="Top")
        top = [v.index for v in thing.data.vertices if v.co.z > 0]
        group.add(top, 1.0, "REPLACE")
        graph = self.graph(tree)
        mesh = graph.evaluate("mesh_file.mesh")
        self.assertEqual(sorted(graph["mesh_file"]["groups"]["Top"]), sorted(top))
        self.assertTrue((mesh.positions[top, 2] > 0).all())
        state, held = graph.evaluate("solver.state"), graph.evaluate("pin.pin").particles
        self.assertTrue(0 < len(held) < 12)
        self.assertGreater(state.position[held, 2].mean(), state.position[:, 2].mean())

    def test_vertices_at_one_place_do_not_shift_the_group(self):
        tree, nodes, _ = self.pinned(region="group", group="Top")
        thing = nodes["mesh_file"].object
        thing.modifiers.new("split", "EDGE_SPLIT").split_angle = 0  # 24 vertices at 8 places
        group = thing.vertex_groups.new(name="Top")
        group.add([v.index for v in thing.data.vertices if v.co.z > 0], 1.0, "REPLACE")
        graph = self.graph(tree)
        mesh = graph.evaluate("mesh_file.mesh")
        self.assertEqual(len(mesh.positions), 8)
        held = graph["mesh_file"]["groups"]["Top"]
        self.assertEqual(sorted(held), sorted(np.flatnonzero(mesh.positions[:, 2] > 0)))


class Motion(ObjectCase):
    def swinging(self, name):
        """Turns 9 degrees a frame about z and moves 0.1 m a frame along x until frame 1; its solid lies beside its origin."""
        thing = self.cube(size=0.4, location=(0, 0, 1), name=name)
        thing.data.transform(Matrix.Translation((1, 0, 0)))
        for frame in (-9, 1):
            thing.location.x, thing.rotation_euler.z = 0.1 * frame, math.radians(9 * frame)
            thing.keyframe_insert("location", frame=frame), thing.keyframe_insert("rotation_euler", frame=frame)
        for curve in versions().curves_of(thing.animation_data):
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
        return thing

    # The centre of the solid is 1 m from the pivot, at 0 degrees in frame 0 and 9 degrees in frame 1.
    VELOCITY = 24 * np.array([0.1 + math.cos(math.radians(9)) - 1, math.sin(math.radians(9)), 0])

    def test_a_body_goes_on_as_its_object_moved(self):
        tree, nodes = self.tree(self.swinging("Bat"))
        nodes["body"].set_parameters(velocity=(5, 5, 5))
        nodes["body"].use_motion = True
        state = self.graph(tree).evaluate("solver.state", 1)
        momentum = (state.mass[:, None] * state.velocity).sum(0) / state.mass.sum()
        np.testing.assert_allclose(momentum, self.VELOCITY, atol=1e-3)
        np.testing.assert_allclose(state.angular_velocity, np.tile([0, 0, math.radians(9) * 24], (len(state.mass), 1)), atol=1e-3)
        self.assertEqual(self.scene.frame_current, 1)
        nodes["body"].source = "VALUES"
        self.assertEqual(self.graph(tree)["body"]["velocity"], [5, 5, 5])

    def test_a_rigid_body_goes_on_as_its_object_moved(self):
        tree, nodes = self.tree()
        ball = self.node(tree, "rigid_body")
        ball.object, ball.use_motion = self.swinging("Ball"), True
        self.connect(ball, "rigid_body", nodes["solver"], "rigid_bodies")
        node = self.graph(tree)["rigid_body"]
        np.testing.assert_allclose(node["velocity"], self.VELOCITY, atol=1e-4)
        np.testing.assert_allclose(node["angular_velocity"], [0, 0, 216], atol=1e-3)


class Animation(ObjectCase):
    def test_keys_of_a_node_arrive_frame_by_frame(self):
        tree, nodes = self.tree()
        body = nodes["body"]
        for frame, value in ((2, 0.5), (4, 0.1)):
            body.toughness = value
            self.assertTrue(body.keyframe_insert("toughness", frame=frame))
        for key in versions().curves_of(tree.animation_data)[0].keyframe_points:
            key.interpolation = "LINEAR"
        node = self.graph(tree)["body"]
        np.testing.assert_allclose([node.at("toughness", f) for f in range(1, 7)], [.5, .5, .3, .1, .1, .1], rtol=1e-6)
        self.assertEqual(self.scene.frame_current, 1)

    def test_a_driver_arrives_whether_or_not_anything_shows_the_tree(self):
        tree, nodes = self.tree()
        driver = nodes["solver"].driver_add("gravity", 0).driver
        driver.expression = "frame * 0.5"
        node = self.graph(tree)["solver"]
        np.testing.assert_allclose([node.at("gravity", f)[0] for f in (1, 4, 6)], [0.5, 2, 3], rtol=1e-6)  # 32 bits

    def test_a_driver_that_reads_an_object_arrives(self):
        tree, nodes = self.tree()
        bpy.ops.object.empty_add()
        thing = bpy.context.object
        thing.location.x = 4
        thing.keyframe_insert("location", frame=1)
        thing.location.x = 9
        thing.keyframe_insert("location", frame=6)
        driver = nodes["body"].driver_add("youngs_modulus").driver
        variable = driver.variables.new()
        variable.targets[0].id, variable.targets[0].data_path = thing, "location.x"
        driver.expression = "var * 1000"
        node = self.graph(tree)["body"]
        self.assertEqual([node.at("youngs_modulus", f) for f in (1, 6)], [4000, 9000])

    def test_what_is_no_start_value_cannot_be_keyed(self):
        _, nodes = self.tree()
        with self.assertRaises(TypeError):
            nodes["body"].keyframe_insert("density", frame=1)

    def test_the_frame_comes_back_when_the_steps_fail(self):
        tree, nodes = self.tree()
        nodes["body"].keyframe_insert("toughness", frame=2)
        nodes["body"].toughness = 0.9
        nodes["body"].keyframe_insert("toughness", frame=5)
        self.scene.frame_set(4)
        with unittest.mock.patch.object(addon("scene.scene_input"), "body_placement", side_effect=OSError):
            with self.assertRaises(OSError):
                self.compiled(tree)
        self.assertEqual([self.scene.frame_current, addon("base.runtime").is_sampling], [4, False])


if __name__ == "__main__":
    main()
