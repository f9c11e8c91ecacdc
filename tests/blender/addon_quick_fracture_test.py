"""Quick Fracture gives a shot that works as it is, and presets do what their sentences say."""
import bpy
import numpy as np

from addon_case import AddonCase, addon, main, versions


class QuickFracture(AddonCase):
    def quick(self, thing, **options):
        bpy.context.view_layer.objects.active = thing
        self.assertEqual(bpy.ops.sunder.quick_fracture(**options), {"FINISHED"})
        return bpy.context.object, bpy.context.object.sunder.tree

    def last_state(self, tree):
        folder, frame = self.cached(tree), self.manifest(tree).numbers[-1]
        return addon("base.core").sunder().read_state(str(folder / f"state/solver.{frame:04d}.ply"))

    def plastic_strain(self, state):
        f = state.plastic_deformation
        return np.sqrt(2 / 3) * np.linalg.norm(np.log(np.linalg.eigvalsh(f.swapaxes(1, 2) @ f)) / 2, axis=1)

    def test_one_step_makes_tree_bake_and_result(self):
        self.scene.frame_end = 8
        thing = self.cube(size=1, location=(0, 0, 0.8))
        result, tree = self.quick(thing, pieces=20)
        self.assertEqual([self.status(tree).state, self.status(tree).is_stale], ["complete", False])
        self.assertEqual([result.name, result.select_get(), thing.hide_render, thing.hide_get()],
                         ["Block fractured", True, True, True])
        self.assertFalse(any(n.error for n in tree.nodes))
        self.assertEqual(sorted(n.sunder_type for n in tree.nodes),
                         ["body", "collider", "deformer", "mesh_file", "prefracture", "solver"])
        self.scene.frame_set(8)
        low = min((v.co.z for v in result.data.vertices))
        self.assertGreater(low, -0.05)  # the floor held; a contact may sink in by a part of a particle's radius
        self.assertLess(self.last_state(tree).position[:, 2].mean(), 0.75)

    def test_what_reaches_below_the_ground_does_not_begin_inside_the_floor(self):
        result, tree = self.quick(self.cube(size=2, location=(0, 0, 0)), pieces=8, bake=False)
        self.assertAlmostEqual(tree.nodes["Floor"].position[2], -1)
        _, tree = self.quick(self.cube(location=(0, 0, 3)), pieces=8, bake=False)
        self.assertEqual(tree.nodes["Floor"].position[2], 0)

    def test_without_a_floor_it_falls_through(self):
        self.scene.frame_end = 8
        _, tree = self.quick(self.cube(), pieces=4, has_floor=False)
        self.assertLess(self.last_state(tree).position[:, 2].max(), 0)

    def test_two_shots_in_one_file_are_two(self):
        first, a = self.quick(self.cube(), pieces=4)
        second, b = self.quick(self.cube(location=(2, 0, 0.5)), pieces=4)
        self.assertNotEqual(self.cached(a), self.cached(b))
        self.scene.frame_set(4)
        self.assertGreater(np.mean([v.co.x for v in second.data.vertices]), 1)
        self.assertLess(np.mean([v.co.x for v in first.data.vertices]), 1)

    def test_what_cannot_be_cut_is_told_and_leaves_a_tree_to_mend(self):
        bpy.ops.mesh.primitive_plane_add()
        bpy.ops.sunder.quick_fracture(pieces=4, bake=False)
        tree, = addon("tree.trees").trees()
        tree.nodes["Pre-Fracture"].thickness = 0
        with self.assertRaisesRegex(RuntimeError, "the mesh is open"):
            self.bake(tree)
        self.assertEqual([n.sunder_type for n in tree.nodes if n.error], ["prefracture"])
        bpy.ops.curve.primitive_bezier_circle_add()
        with self.assertRaisesRegex(RuntimeError, "has no faces.*depth"):
            bpy.ops.sunder.quick_fracture(pieces=4)

    def test_what_is_squeezed_flat_is_refused_and_nothing_is_left_behind(self):
        thing = self.cube()
        thing.scale.z = 0
        with self.assertRaisesRegex(RuntimeError, "'Block' is squeezed flat"):
            bpy.ops.sunder.quick_fracture(pieces=4)
        self.assertEqual([thing.hide_get(), thing.hide_render], [False, False])
        self.assertEqual([list(bpy.data.objects), addon("tree.trees").trees()], [[thing], []])

    def test_sheets_get_walls_whatever_their_mesh(self):
        for make in (lambda: bpy.ops.mesh.primitive_plane_add(location=(0, 0, 1)),
                     lambda: bpy.ops.mesh.primitive_grid_add(x_subdivisions=20, y_subdivisions=20, location=(0, 0, 1)),
                     lambda: bpy.ops.mesh.primitive_cylinder_add(end_fill_type="NOTHING", location=(0, 0, 2)),
                     lambda: bpy.ops.object.text_add(location=(0, 0, 1))):
            make()
            thing = bpy.context.object
            result, tree = self.quick(thing, pieces=6)
            self.assertGreater(tree.nodes["Pre-Fracture"].thickness, 0, thing.name)
            self.assertEqual([tree.nodes["Pre-Fracture"].repair, self.status(tree).state], ["auto", "complete"])

    def test_texts_and_curves_with_depth_are_cut_as_they_look(self):
        bpy.ops.object.text_add(location=(0, 0, 1), rotation=(1.57, 0, 0))
        text = bpy.context.object
        text.data.extrude, text.data.bevel_depth, text.data.body = 0.1, 0.01, "e8"
        bpy.ops.curve.primitive_bezier_circle_add(location=(0, 3, 1))
        ring = bpy.context.object
        ring.data.bevel_depth = 0.2
        for thing in (text, ring):
            result, tree = self.quick(thing, pieces=6)
            self.assertEqual([tree.nodes["Pre-Fracture"].thickness, self.status(tree).state], [0, "complete"])
            self.assertFalse(self.status(tree).is_stale)
            low, high = (addon("scene.scene_input").world_bounds(thing, bpy.context.evaluated_depsgraph_get()))
            self.scene.frame_set(1)
            shown = np.array([v.co for v in result.data.vertices])
            np.testing.assert_allclose([shown.min(0), shown.max(0)], [low, high], atol=1e-4)
            thing.data.bevel_depth *= 2
            bpy.context.view_layer.update()
            self.assertTrue(self.status(tree).is_stale, thing.name)

    def test_selected_objects_break_together(self):
        self.scene.frame_end = 8
        lower, upper = self.cube(size=1, location=(0, 0, 0.51), name="Lower"), self.cube(size=1, location=(0, 0, 1.6), name="Upper")
        for thing in (lower, upper):
            thing.select_set(True)
        result, tree = self.quick(upper, pieces=8, fall_speed=8)
        self.assertEqual(result.name, "Upper fractured")
        self.assertEqual(sorted(o.name for o in self.results_of(tree)), ["Lower fractured", "Upper fractured"])
        self.assertEqual(sorted(n.sunder_type for n in tree.nodes), sorted(
            ["solver", "collider"] + 2 * ["mesh_file", "prefracture", "body", "deformer"]))
        self.assertIn("Lower: Body", [n.label for n in tree.nodes])
        self.scene.frame_set(8)
        state = self.last_state(tree)
        self.assertGreater(state.position[state.body == 0][:, 2].mean(), state.position[state.body == 1][:, 2].mean())
        self.assertGreater(state.position[state.body == 0][:, 2].mean(), 0.5)  # it lies on the other

    def results_of(self, tree):
        return addon("tree.trees").result_objects(tree)

    def test_a_head_with_holes_gets_a_closed_skin(self):
        bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 1.5))
        _, tree = self.quick(bpy.context.object, pieces=10, bake=True)
        self.assertEqual([tree.nodes["Pre-Fracture"].repair, self.status(tree).state], ["wrap", "complete"])
        _, tree = self.quick(self.cube(), pieces=4, bake=False)
        self.assertEqual(tree.nodes["Pre-Fracture"].repair, "auto")

    def test_it_wants_a_mesh_that_is_no_result(self):
        bpy.ops.object.empty_add()
        self.assertFalse(bpy.ops.sunder.quick_fracture.poll())
        with self.assertRaisesRegex(RuntimeError, "poll"):
            bpy.ops.sunder.quick_fracture()
        result, _ = self.quick(self.cube(), pieces=4, bake=False)
        self.assertFalse(bpy.ops.sunder.quick_fracture.poll())

    def test_the_result_takes_over_what_the_source_is_besides_its_mesh(self):
        hero = bpy.data.collections.new("Hero")
        self.scene.collection.children.link(hero)
        thing = self.cube()
        self.scene.collection.objects.unlink(thing)
        hero.objects.link(thing)
        thing.pass_index, thing.color, thing.visible_shadow, thing.is_holdout = 7, (1, 0, 0, 0.5), False, True
        thing["seed"], thing["tags"], thing["group"] = 3.0, ["a", "b"], {"x": 1}
        thing.id_properties_ui("seed").update(max=9)
        result, _ = self.quick(thing, pieces=4, bake=False)
        self.assertEqual([c.name for c in result.users_collection], ["Hero"])
        self.assertEqual([result.pass_index, list(result.color), result.is_holdout], [7, [1, 0, 0, 0.5], True])
        self.assertEqual([result.visible_shadow, result.visible_camera], [False, True])
        self.assertEqual([result["seed"], list(result["tags"]), result["group"].to_dict()], [3, ["a", "b"], {"x": 1}])
        self.assertEqual(result.id_properties_ui("seed").as_dict()["max"], 9)
        self.assertEqual([result.hide_render, result.sunder.node], [False, "deformer"])

    def test_it_can_be_undone(self):
        bpy.context.preferences.edit.use_global_undo = True
        hero = bpy.data.collections.new("Hero")
        self.scene.collection.children.link(hero)
        thing = self.cube()
        hero.objects.link(thing)
        thing["seed"] = 3.0
        bpy.ops.ed.undo_push(message="cube")
        self.quick(thing, pieces=4)
        bpy.ops.ed.undo_push(message="fracture")
        bpy.ops.ed.undo()
        self.scene = bpy.context.scene
        self.assertEqual([t.name for t in addon("tree.trees").trees()], [])
        self.assertEqual([o.name for o in bpy.data.objects], ["Block"])
        self.assertEqual([o.name for o in bpy.data.collections["Hero"].objects], ["Block"])
        self.assertFalse(bpy.data.objects["Block"].hide_render)

    def test_break_surfaces_suit_the_preset(self):
        for preset in addon("interface.presets").PRESETS:
            for has_material in (False, True):
                thing = self.cube()
                if has_material:
                    paint = bpy.data.materials.new("Paint")
                    versions().turn_on_nodes(paint)
                    paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.1, 0.2, 0.8, 1)
                    thing.data.materials.append(paint)
                result, _ = self.quick(thing, preset=preset, pieces=4, bake=False)
                outer, inner = result.data.materials
                self.assertEqual(result.sunder.interior_slot, 1)
                outside, inside = (addon("bake.looks").surface(m) for m in (outer, inner))
                if has_material:
                    self.assertEqual(outer, paint)  # the artist's stay
                if preset == "GLASS":
                    self.assertEqual(inner, outer)
                    self.assertEqual(inside["transmission"], 0 if has_material else 1)
                elif preset in ("STEEL", "SHEET_METAL", "STEEL_BEAM", "LEAD"):
                    self.assertEqual([inside["metallic"], outside["metallic"]], [1, 0 if has_material else 1])
                    self.assertGreater(min(inside["color"][:3]), 0.45)  # bright
                elif preset == "CLAY":
                    np.testing.assert_allclose(inside["color"][:3], 0.55 * np.array(outside["color"][:3]), rtol=1e-5)
                    self.assertEqual(outside["color"][:3], addon("bake.looks").surface(outer)["color"][:3])
                else:
                    self.assertGreater(inside["color"][0], 0.6)  # pale
                tree = result.sunder.tree
                bpy.data.objects.remove(result)
                bpy.ops.sunder.add_results(tree=tree.name)  # made again, it looks the same
                again, = self.results_of(tree)
                self.assertEqual(list(again.data.materials), [outer, inner])
        self.assertNotIn("Sunder Interior", bpy.data.materials)

    def painted(self, name, color=None):
        """A material, and its shader's Base Color."""
        material = bpy.data.materials.new(name)
        versions().turn_on_nodes(material)
        socket = material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
        if color:
            socket.default_value = (*color, 1)
        return material, socket

    def test_break_surfaces_suit_the_slot_that_covers_most_of_the_source(self):
        slots = [self.painted(name)[0] for name in ("Sticker", "Stone")]
        for preset, wanted in (("CLAY", "Stone Inside"), ("GLASS", "Stone")):
            thing = self.cube()
            for material in slots:
                thing.data.materials.append(material)
            for polygon in thing.data.polygons:
                polygon.material_index = polygon.index > 0
            result, _ = self.quick(thing, preset=preset, pieces=4, bake=False)
            self.assertEqual(result.data.materials[-1].name, wanted)
        thing = self.cube()  # area counts, not the number of faces
        for material in slots:
            thing.data.materials.append(material)
        thing.scale = (10, 10, 0.1)
        for polygon in thing.data.polygons:
            polygon.material_index = abs(polygon.normal.z) > 0.5
        result, _ = self.quick(thing, preset="CLAY", pieces=4, bake=False)
        self.assertEqual(result.data.materials[-1].name, "Stone Inside")

    def inside(self, material, paint=None):
        """Base Color that clay gets inside, as a share of what it is outside; `paint`: colour of an attribute 'Col'."""
        thing = self.cube()
        thing.data.materials.append(material)
        if paint:
            for point in thing.data.color_attributes.new("Col", "FLOAT_COLOR", "POINT").data:
                point.color = (*paint, 1)
        result, _ = self.quick(thing, preset="CLAY", pieces=4, bake=False)
        inner = result.data.materials[-1]
        np.testing.assert_allclose(inner.diffuse_color[:3], addon("bake.looks").surface(inner)["color"][:3], rtol=1e-5)
        return np.array(addon("bake.looks").surface(inner)["color"][:3]) / 0.55

    def test_clay_inside_has_the_mean_colour_of_what_gives_it_outside(self):
        for is_float, space, wanted in ((False, "sRGB", 0.0331), (False, "Non-Color", 0.2), (True, "sRGB", 0.2)):
            material, socket = self.painted("Image")
            links, image = material.node_tree.links, bpy.data.images.new("i", 64, 32, float_buffer=is_float)
            image.colorspace_settings.name = space
            image.pixels = ([0.2, 0.2, 0, 1] + [0.2, 0.2, 0.0, 1] + [0.9, 0.9, 0.9, 0.0]) * 682 + [0, 0, 0, 0] * 2
            texture, tint = (material.node_tree.nodes.new("ShaderNode" + n) for n in ("TexImage", "HueSaturation"))
            texture.image = image
            links.new(texture.outputs["Color"], tint.inputs["Color"]), links.new(tint.outputs["Color"], socket)
            np.testing.assert_allclose(self.inside(material), (wanted, wanted, 0), atol=2e-3)  # 8 bits a channel
        material, socket = self.painted("Attribute")
        node = material.node_tree.nodes.new("ShaderNodeVertexColor")
        material.node_tree.links.new(node.outputs["Color"], socket)
        np.testing.assert_allclose(self.inside(material, (0.3, 0.1, 0.6)), (0.3, 0.1, 0.6), rtol=1e-5)

    def test_clay_inside_without_such_a_mean_takes_what_was_set_by_hand(self):
        for color, wanted in (((0.4, 0.1, 0.2), (0.4, 0.1, 0.2)), (None, (0.5, 0.6, 0.7))):
            material, socket = self.painted("Noise", color)
            material.diffuse_color = (0.5, 0.6, 0.7, 1)
            noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
            material.node_tree.links.new(noise.outputs["Color"], socket)
            np.testing.assert_allclose(self.inside(material), wanted, rtol=1e-5)

    def test_presets_do_what_they_say(self):
        self.scene.frame_end = 16
        seen = {}
        for preset in addon("interface.presets").PRESETS:
            bpy.ops.mesh.primitive_torus_add(location=(0, 0, 1.2), rotation=(1.2, 0, 0), major_radius=0.7,
                                             minor_radius=0.2, major_segments=24, minor_segments=8)
            result, tree = self.quick(bpy.context.object, preset=preset, pieces=60)
            state = self.last_state(tree)
            self.assertTrue(np.isfinite(state.position).all(), preset)
            # Nothing flies away; chips of what is brittle go on at 11 m/s for half a second.
            self.assertLess(np.abs(state.position).max(), 9 if preset in ("GLASS", "STONE") else 5, preset)
            seen[preset] = (len(set(state.piece)), self.plastic_strain(state).max())
        self.assertEqual([seen["STEEL"][0], seen["LEAD"][0]], [1, 1], seen)  # they dent and hold
        self.assertTrue(0.03 < seen["STEEL"][1] < seen["LEAD"][1], seen)
        self.assertLess(seen["GLASS"][1], 1e-9, seen)  # it never dents, and breaks into most pieces
        self.assertGreater(seen["GLASS"][0], 3 * max(seen["CLAY"][0], seen["WOOD"][0]) / 2, seen)
        self.assertTrue(min(seen["CLAY"][0], seen["WOOD"][0]) > 1, seen)  # they do both
        self.assertLess(seen["STONE"][1], 1e-9, seen)  # it never dents either, and leaves chunks
        self.assertTrue(1 < seen["STONE"][0] < 0.75 * seen["GLASS"][0], seen)
        self.assertTrue(seen["CLAY"][1] > seen["WOOD"][1] > 0.01, seen)

    def test_sheet_metal_that_falls_on_an_edge_stays_bent(self):
        self.scene.frame_end = 30
        left = {}
        for preset in ("SHEET_METAL", "GLASS"):
            bpy.ops.mesh.primitive_plane_add(location=(0, 0, 1.2), rotation=(1.2, 0.2, 0), size=1.5)
            _, tree = self.quick(bpy.context.object, preset=preset, pieces=120, fall_speed=12)
            state = self.last_state(tree)
            self.assertLess(np.abs(state.position).max(), {"SHEET_METAL": 5, "GLASS": 20}[preset])
            left[preset] = (np.linalg.norm(state.plastic_curvature, axis=(1, 2)).max(), np.bincount(state.piece).max())
        self.assertGreater(left["SHEET_METAL"][0], 0.5)  # rad/m
        self.assertGreater(left["SHEET_METAL"][1], 100)
        self.assertEqual(left["GLASS"][0], 0)

    def test_a_ring_of_steel_that_falls_on_its_edge_is_bent_and_stays_whole(self):
        self.scene.frame_end = 24
        bpy.ops.mesh.primitive_torus_add(location=(0, 0, 1.2), rotation=(1.3, 0.2, 0), major_radius=0.8, minor_radius=0.03,
                                         major_segments=48, minor_segments=8)
        _, tree = self.quick(bpy.context.object, preset="STEEL_BEAM", pieces=60, fall_speed=15)
        state = self.last_state(tree)
        self.assertEqual(len(set(state.piece)), 1)
        self.assertLess(np.abs(state.position).max(), 5)
        self.assertGreater(np.linalg.norm(state.plastic_curvature, axis=(1, 2)).max(), 0.1)  # rad/m


if __name__ == "__main__":
    main()
