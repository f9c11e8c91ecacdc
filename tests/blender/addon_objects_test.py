"""What the library is told of Blender's objects is where they stand, how large they are and how they move."""
import math
import unittest.mock

import bpy
import numpy as np
from mathutils import Euler, Matrix

from addon_case import AddonCase, addon, main


def volume(corners):
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


class ObjectCase(AddonCase):
    def compiled(self, tree):
        return addon("compiler").compile_tree(tree, self.scene)

    def graph(self, tree):
        """The tree as the library has it, meshes written where it looks for them."""
        compiled = self.compiled(tree)
        addon("mesh_export").write(str(self.folder), compiled.files)
        return addon("core").sunder().Graph.from_dict(compiled.description, base_folder=str(self.folder))

    def placed(self, tree):
        """Corners of all triangles of the first frame in the scene (t, 3, 3)."""
        mesh = self.graph(tree).evaluate("deformer.mesh")
        return mesh.positions[mesh.triangles].astype(float)

    def wired_collider(self, **parameters):
        """A tree with one collider that a test sets up."""
        tree, nodes = self.tree()
        for name, value in parameters.items():
            setattr(nodes["collider"], name, value)
        return tree


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
        known = {(tuple(np.round(thing.data.vertices[l.vertex_index].co, 4)), tuple(np.round(layer[l.index].uv, 4)))
                 for l in thing.data.loops}
        found = {(tuple(np.round(p, 4)), tuple(np.round(uv, 4)))
                 for p, uv in zip(corners.reshape(-1, 3), mesh.uvs.reshape(-1, 2))}
        self.assertEqual(found, known)

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
        for curve in thing.animation_data.action.fcurves:
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


class Points(ObjectCase):
    def cut(self, **parameters):
        """A cube of 0.4 m at (1, 0, 0.5), turned a quarter about z, and its pre-fracture node."""
        thing = self.cube(location=(1, 0, 0.5))
        thing.rotation_euler.z = math.radians(90)
        bpy.context.view_layer.update()
        tree, nodes = self.tree(thing)
        for name, value in parameters.items():
            setattr(nodes["prefracture"], name, value)
        return tree, nodes

    def test_vertices_of_a_mesh_are_points_in_the_meshs_own_axes(self):
        data = bpy.data.meshes.new("hits")
        data.from_pydata([(0, 0, 0), (0.1, 0, 0.05)], [], [])
        hits = bpy.data.objects.new("Hits", data)
        hits.location, hits.scale = (1, 0.1, 0.5), (1, 1, 2)
        self.scene.collection.objects.link(hits)
        tree, nodes = self.cut(sites="points", points_object=hits)
        graph = self.graph(tree)
        # The scene's y is the cube's x, its x the cube's -y.
        np.testing.assert_allclose(graph["prefracture"]["points"], [[0.1, 0, 0], [0.1, -0.1, 0.1]], atol=1e-6)
        self.assertEqual(len(graph.evaluate("prefracture.fragments")), 2)

    def test_a_curve_gives_its_points_in_order_and_others_their_origins(self):
        curve = bpy.data.curves.new("slash", "CURVE")
        curve.dimensions = "3D"
        line = curve.splines.new("POLY")
        line.points.add(2)
        for point, x in zip(line.points, (0.3, -0.1, 0.2)):
            point.co = (x, 0, 0, 1)
        slash = bpy.data.objects.new("Slash", curve)
        slash.location = (1, 0, 0.7)
        self.scene.collection.objects.link(slash)
        tree, nodes = self.cut(sites="impact", impact_shape="curve", points_object=slash, pieces=30)
        np.testing.assert_allclose(self.graph(tree)["prefracture"]["points"], [[0, -0.3, 0.2], [0, 0.1, 0.2], [0, -0.2, 0.2]],
                                   atol=1e-6)
        group = bpy.data.collections.new("Hits")
        self.scene.collection.children.link(group)
        for name, x in (("b", 1.1), ("a", 0.9)):
            group.objects.link(bpy.data.objects.new(name, None))
            group.objects[name].location = (x, 0, 0.5)
        nodes["prefracture"].points_source, nodes["prefracture"].points_collection = "COLLECTION", group
        bpy.context.view_layer.update()
        np.testing.assert_allclose(self.graph(tree)["prefracture"]["points"], [[0, 0.1, 0], [0, -0.1, 0]], atol=1e-6)

    def test_points_that_moved_make_the_bake_out_of_date(self):
        hit = bpy.data.objects.new("Hit", None)
        hit.location = (1.2, 0, 0.5)
        self.scene.collection.objects.link(hit)
        tree, nodes = self.cut(sites="impact", points_object=hit)
        self.bake(tree)
        self.assertIs(self.status(tree).is_stale, False)
        hit.location.z = 0.6
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)
        hit.location.z = 0.5
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, False)

    def test_missing_points_are_refused_on_the_node_and_scripts_are_told_the_way(self):
        tree, nodes = self.cut(sites="points")
        self.refusal(tree)
        self.assertIn("points", nodes["prefracture"].error)
        with self.assertRaisesRegex(AttributeError, "set `points_object`"):
            nodes["prefracture"].set_parameters(points=[(0, 0, 0)])

    def test_a_density_group_arrives_with_the_mesh(self):
        tree, nodes = self.cut(sites="density", density_group="Dense", pieces=30)
        thing = nodes["mesh_file"].object
        thing.vertex_groups.new(name="Dense").add([v.index for v in thing.data.vertices if v.co.z > 0], 1, "REPLACE")
        graph = self.graph(tree)
        self.assertEqual(len(graph["mesh_file"]["groups"]["Dense"]), 4)
        cut = graph.evaluate("prefracture.fragments")
        volume = cut.volume[cut.rest_position[:, 2] > 0.1].mean(), cut.volume[cut.rest_position[:, 2] < -0.1].mean()
        self.assertLess(volume[0], volume[1])

    def test_what_does_not_apply_is_neither_shown_nor_passed_on(self):
        tree, nodes = self.cut(method="kmeans", roughness=8)
        hidden = addon("pickers").is_hidden
        self.assertNotIn("roughness", self.compiled(tree).description["nodes"]["prefracture"])
        self.assertTrue(hidden(nodes["prefracture"], "points") and not hidden(nodes["prefracture"], "cells_per_piece"))
        nodes["prefracture"].method = "voronoi"
        self.assertEqual(self.compiled(tree).description["nodes"]["prefracture"]["roughness"], 8)


class Maps(ObjectCase):
    def numbered(self):
        """A block whose upper half is in a group by half and which has an attribute of its own."""
        thing = self.cube(location=(1, 0, 0.5))
        thing.vertex_groups.new(name="Upper half").add([v.index for v in thing.data.vertices if v.co.z > 0], 0.5, "REPLACE")
        values = thing.data.attributes.new("heavy", "FLOAT", "POINT")
        values.data.foreach_set("value", np.arange(1.0, 9.0, dtype=np.float32))
        return thing

    def test_groups_and_attributes_travel_with_the_mesh_under_names_that_a_file_can_have(self):
        thing = self.numbered()
        export, depsgraph = addon("mesh_export"), bpy.context.evaluated_depsgraph_get()
        made = export.geometry(thing, depsgraph, Matrix(), True, map_names=["Upper half", "heavy"])
        path = self.folder / "numbers.ply"
        path.write_bytes(export.ply_bytes(made))
        vertex = addon("bake_reader").read_ply(str(path))["vertex"]
        names = [export.map_property(n) for n in ("Upper half", "heavy")]
        self.assertEqual([n for n in vertex.dtype.names if n.startswith("map_")], names)
        self.assertEqual([names[1], " " in names[0]], ["map_heavy", False])
        np.testing.assert_array_equal(vertex["map_heavy"][:8], np.arange(1, 9))
        np.testing.assert_array_equal(vertex["map_heavy"][8:], np.arange(1, 9)[made.corners.ravel()])
        np.testing.assert_array_equal(vertex[names[0]][:8], [0.5 if v.co.z > 0 else 0 for v in thing.data.vertices])
        graph = addon("core").sunder().Graph.from_dict({"sunder": 1, "nodes": {"m": {"type": "mesh_file", "path": str(path)}}})
        self.assertEqual(len(graph.evaluate("m.mesh").positions), 8)
        with self.assertRaisesRegex(addon("core").Refused, "neither a vertex group nor a vertex attribute 'Nothing'"):
            export.geometry(thing, depsgraph, Matrix(), True, map_names=["Nothing"])


class Forces(ObjectCase):
    def blown(self, kind, **fields):
        bpy.ops.object.effector_add(type=kind, rotation=(math.radians(90), 0, 0))
        fan = bpy.context.object
        tree, nodes = self.tree()
        force = self.node(tree, "force", drag=3)
        force.source, force.object = "OBJECT", fan
        self.connect(force, "force", nodes["solver"], "forces")
        return tree, fan, force

    def test_a_wind_field_blows_along_its_axis_with_its_keys(self):
        tree, fan, _ = self.blown("WIND")
        fan.field.strength = 5
        self.assertEqual(self.graph(tree)["force"]["wind"], [0, -5, 0])
        fan.keyframe_insert("field.strength", frame=1)
        fan.field.strength = 15
        fan.keyframe_insert("field.strength", frame=6)
        node = self.graph(tree)["force"]
        self.assertEqual([node.at("wind", f)[1] for f in (1, 6)], [-5, -15])
        self.assertTrue(-15 < node.at("wind", 3)[1] < -5)

    def test_fields_that_are_no_wind_and_winds_without_drag_are_refused(self):
        tree, _, force = self.blown("VORTEX")
        self.assertIn("has a vortex force field", self.refusal(tree))
        force.object = self.cube(name="Still")
        self.assertIn("has no force field", self.refusal(tree))
        tree, _, force = self.blown("WIND")
        force.set_parameters(drag=0)
        self.assertIn("drag is 0", self.refusal(tree))
        self.assertIn("drag is 0", force.error)


class Motion(ObjectCase):
    def swinging(self, name):
        """Turns 9 degrees a frame about z and moves 0.1 m a frame along x until frame 1; its solid lies beside its origin."""
        thing = self.cube(size=0.4, location=(0, 0, 1), name=name)
        thing.data.transform(Matrix.Translation((1, 0, 0)))
        for frame in (-9, 1):
            thing.location.x, thing.rotation_euler.z = 0.1 * frame, math.radians(9 * frame)
            thing.keyframe_insert("location", frame=frame), thing.keyframe_insert("rotation_euler", frame=frame)
        for curve in thing.animation_data.action.fcurves:
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
        for key in tree.animation_data.action.fcurves[0].keyframe_points:
            key.interpolation = "LINEAR"
        node = self.graph(tree)["body"]
        np.testing.assert_allclose([node.at("toughness", f) for f in range(1, 7)], [.5, .5, .3, .1, .1, .1], rtol=1e-6)
        self.assertEqual(self.scene.frame_current, 1)

    def test_a_driver_arrives_whether_or_not_anything_shows_the_tree(self):
        tree, nodes = self.tree()
        driver = nodes["solver"].driver_add("gravity", 0).driver
        driver.expression = "frame * 0.5"
        node = self.graph(tree)["solver"]
        self.assertEqual([node.at("gravity", f)[0] for f in (1, 4, 6)], [0.5, 2, 3])

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
        with unittest.mock.patch.object(addon("scene_input"), "body_placement", side_effect=OSError):
            with self.assertRaises(OSError):
                self.compiled(tree)
        self.assertEqual([self.scene.frame_current, addon("runtime").is_sampling], [4, False])


if __name__ == "__main__":
    main()
