"""What nodes take from objects beyond their own place: points, numbers painted on vertices, force fields."""
import math

import bpy
import numpy as np
from mathutils import Matrix

from addon_case import ObjectCase, addon, main


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
        shown = addon("tree.conditions").is_shown
        self.assertNotIn("roughness", self.compiled(tree).description["nodes"]["prefracture"])
        self.assertTrue(not shown(nodes["prefracture"], "points") and shown(nodes["prefracture"], "cells_per_piece"))
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
        export, depsgraph = addon("scene.mesh_export"), bpy.context.evaluated_depsgraph_get()
        made = export.geometry(thing, depsgraph, Matrix(), True, map_names=["Upper half", "heavy"])
        path = self.folder / "numbers.ply"
        path.write_bytes(export.ply_bytes(made))
        vertex = addon("base.bake_reader").read_ply(str(path))["vertex"]
        names = [export.map_property(n) for n in ("Upper half", "heavy")]
        self.assertEqual([n for n in vertex.dtype.names if n.startswith("map_")], names)
        self.assertEqual([names[1], " " in names[0]], ["map_heavy", False])
        np.testing.assert_array_equal(vertex["map_heavy"][:8], np.arange(1, 9))
        np.testing.assert_array_equal(vertex["map_heavy"][8:], np.arange(1, 9)[made.corners.ravel()])
        np.testing.assert_array_equal(vertex[names[0]][:8], [0.5 if v.co.z > 0 else 0 for v in thing.data.vertices])
        graph = addon("base.core").sunder().Graph.from_dict({"sunder": 1, "nodes": {"m": {"type": "mesh_file", "path": str(path)}}})
        self.assertEqual(len(graph.evaluate("m.mesh").positions), 8)
        with self.assertRaisesRegex(addon("base.core").Refused, "neither a vertex group nor a vertex attribute 'Nothing'"):
            export.geometry(thing, depsgraph, Matrix(), True, map_names=["Nothing"])

    def test_groups_and_attributes_are_factors_on_the_material(self):
        thing = self.numbered()
        tree, nodes = self.tree(thing, pieces=30)
        nodes["prefracture"].toughness_map, nodes["prefracture"].density_map = "Upper half", "heavy"
        graph = self.graph(tree)
        cut = graph.evaluate("prefracture.fragments")
        upper = cut.rest_position[:, 2] > 0.1
        self.assertTrue(cut.toughness_factor[upper].min() > 0.3 > cut.toughness_factor[~upper].min())
        state = graph.evaluate("solver.state")
        nodes["prefracture"].density_map = ""
        plain = self.graph(tree).evaluate("solver.state")
        heavier = state.mass / plain.mass
        self.assertTrue(heavier.min() > 1 and heavier.max() > 1.5 * heavier.min())
        nodes["prefracture"].toughness_map = "Nothing"
        self.assertIn("neither a vertex group nor a vertex attribute 'Nothing'", self.refusal(tree))
        self.assertIn("Nothing", nodes["mesh_file"].error)

    def test_painting_a_map_makes_the_bake_out_of_date(self):
        thing = self.numbered()
        tree, nodes = self.tree(thing)
        nodes["prefracture"].toughness_map = "Upper half"
        self.bake(tree)
        self.assertIs(self.status(tree).is_stale, False)
        thing.vertex_groups["Upper half"].add([0], 0.25, "REPLACE")
        thing.data.update()
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)
        thing.vertex_groups["Upper half"].remove([0])
        thing.data.update()
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, False)

    def test_a_region_is_an_objects_bounding_box_along_the_fragments_axes(self):
        thing = self.cube(location=(1, 0, 0.5))
        thing.rotation_euler.z = math.radians(90)
        bpy.ops.object.empty_add(location=(1, 0.1, 0.5), radius=0.1)
        box = bpy.context.object
        bpy.context.view_layer.update()
        tree, nodes = self.tree(thing)
        region = self.node(tree, "fragment_region", toughness=0.5)
        region.source, region.object = "OBJECT", box
        tree.links.remove(nodes["body"].inputs["Fragments"].links[0])
        self.connect(nodes["prefracture"], "fragments", region, "fragments")
        self.connect(region, "fragments", nodes["body"], "fragments")
        node = self.graph(tree)["fragment_region"]
        np.testing.assert_allclose([node["box_min"], node["box_max"]], [[0, -0.1, -0.1], [0.2, 0.1, 0.1]], atol=1e-6)
        self.bake(tree)
        box.location.y = 0.15
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)


    def test_a_part_of_a_body_is_what_lies_in_an_objects_bounding_box(self):
        bpy.ops.object.empty_add(location=(0.1, 0.1, 0.5), radius=0.2)
        box = bpy.context.object
        bpy.context.view_layer.update()
        tree, nodes = self.tree(self.cube(location=(0, 0, 0.5)))
        soft = self.node(tree, "body_region", stiffness=0.5)
        wait = self.node(tree, "activate", frame=3, region="sphere")
        for part in (soft, wait):
            part.source, part.object = "OBJECT", box
        wired = [link for link in nodes["solver"].inputs["Bodies"].links if link.from_node == nodes["body"]]
        for link in wired:
            tree.links.remove(link)
        self.connect(nodes["body"], "body", soft, "body")
        self.connect(soft, "body", wait, "body")
        self.connect(wait, "body", nodes["solver"], "bodies")
        graph = self.graph(tree)
        np.testing.assert_allclose([graph["body_region"]["box_min"], graph["body_region"]["box_max"]],
                                   [[-0.1, -0.1, 0.3], [0.3, 0.3, 0.7]], atol=1e-6)
        np.testing.assert_allclose(graph["activate"]["center"], [0.1, 0.1, 0.5], atol=1e-6)
        self.assertAlmostEqual(graph["activate"]["radius"], 0.2, places=6)
        self.assertEqual(graph["solver"]["bodies"], ["@activate.body"])
        self.bake(tree)
        box.location.z = 0.6
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)


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
        self.assertIn("has a vortex force field: this node takes wind or drag", self.refusal(tree))
        force.object = self.cube(name="Still")
        self.assertIn("has no force field", self.refusal(tree))
        tree, _, force = self.blown("WIND")
        force.set_parameters(drag=0)
        self.assertIn("drag is 0", self.refusal(tree))
        self.assertIn("drag is 0", force.error)

    def test_a_drag_field_holds_things_back(self):
        tree, drag, force = self.blown("DRAG")
        drag.field.linear_drag = 0.4
        force.set_parameters(drag=0)
        node = self.graph(tree)["force"]
        np.testing.assert_allclose(node["drag"], 0.4, rtol=1e-6)
        self.assertEqual(node["wind"], [0, 0, 0])

    def placed(self, node_type, kind):
        """A field of Blender's at (1, 2, 3) that a node stands for, its z axis along -y."""
        bpy.ops.object.effector_add(type=kind, location=(1, 2, 3), rotation=(math.radians(90), 0, 0))
        thing = bpy.context.object
        tree, nodes = self.tree()
        node = self.node(tree, node_type)
        node.source, node.object = "OBJECT", thing
        self.connect(node, "force", nodes["solver"], "forces")
        return tree, thing

    def test_force_fields_are_point_forces_vortices_and_turbulence(self):
        tree, thing = self.placed("point_force", "FORCE")
        field = thing.field
        field.strength, field.falloff_power, field.use_max_distance, field.distance_max = -4, 1.5, True, 6
        thing.keyframe_insert("location", frame=1)
        thing.location.x = 3
        thing.keyframe_insert("location", frame=6)
        node = self.graph(tree)["point_force"]
        self.assertEqual([node["strength"], node["falloff"], node["reach"], node.at("position", 6)], [-4, 1.5, 6, [3, 2, 3]])

        tree, thing = self.placed("vortex", "VORTEX")
        thing.field.strength, thing.field.inflow = 7, 0.5
        node = self.graph(tree)["vortex"]
        self.assertEqual([node["swirl"], node["inflow"], node["reach"], node["position"]], [7, 0.5, None, [1, 2, 3]])
        np.testing.assert_allclose(node["axis"], [0, -1, 0], atol=1e-6)

        tree, thing = self.placed("turbulence", "TURBULENCE")
        thing.field.strength, thing.field.size, thing.field.seed = 3, 0.5, 12
        node = self.graph(tree)["turbulence"]
        self.assertEqual([node["strength"], node["size"], node["seed"]], [3, 0.5, 12])
        self.graph(tree).evaluate("solver.state", 2)

    def test_a_field_that_changed_makes_the_bake_out_of_date(self):
        tree, thing = self.placed("vortex", "VORTEX")
        self.bake(tree)
        self.assertIs(self.status(tree).is_stale, False)
        thing.field.inflow = 2
        thing.update_tag()
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)

    def test_a_blast_goes_off_where_its_object_is(self):
        tree, nodes = self.tree()
        bpy.ops.object.empty_add(location=(0.2, 0, 0.1), rotation=(0, math.radians(90), 0))
        blast = self.node(tree, "blast", frame=2, spread="cone")
        blast.source, blast.object = "OBJECT", bpy.context.object
        self.connect(blast, "force", nodes["solver"], "forces")
        graph = self.graph(tree)
        np.testing.assert_allclose(graph["blast"]["position"], [0.2, 0, 0.1], atol=1e-6)
        np.testing.assert_allclose(graph["blast"]["direction"], [1, 0, 0], atol=1e-6)
        before, after = (graph.evaluate("solver.state", frame).velocity for frame in (2, 3))
        self.assertGreater(np.abs(after - before).max(), 1)


class Solids(ObjectCase):
    def test_any_mesh_is_a_collider_that_moves_and_has_its_objects_scale(self):
        wedge = self.cube(size=1, location=(0, 0, -0.4), name="Wedge")
        wedge.scale, wedge.rotation_euler = (1, 2, 0.5), (0, 0, math.radians(90))
        wedge.keyframe_insert("location", frame=1)
        wedge.location.z = 0.1
        wedge.keyframe_insert("location", frame=6)
        tree, nodes = self.tree()
        node = nodes["collider"]
        node.shape, node.source, node.object = "mesh", "OBJECT", wedge
        graph = self.graph(tree)
        vertex = addon("base.bake_reader").read_ply(str(self.folder / graph["collider"]["path"]))["vertex"]
        np.testing.assert_allclose([np.ptp(vertex[a]) for a in "xyz"], [1, 2, 0.5], rtol=1e-6)
        np.testing.assert_allclose(graph["collider"].at("rotation", 1), [0, 0, 90], atol=1e-5)
        np.testing.assert_allclose([graph["collider"].at("position", f)[2] for f in (1, 6)], [-0.4, 0.1], atol=1e-6)
        state = graph.evaluate("solver.state", 6)
        self.assertGreater(state.position[:, 2].min(), 0.2)  # it rests on the wedge, whose top comes up to 0.35 m
        self.bake(tree)
        wedge.data.vertices[0].co.x -= 0.1
        wedge.data.update()
        bpy.context.view_layer.update()
        self.assertIs(self.status(tree).is_stale, True)


if __name__ == "__main__":
    main()
