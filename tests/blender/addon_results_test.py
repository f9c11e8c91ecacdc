"""What result objects show is what the library made: geometry, normals, attributes, materials, at every frame."""
import shutil
import threading
from contextlib import ExitStack
from unittest.mock import patch

import bpy
import numpy as np
from mathutils import Matrix, Vector

from addon_case import ObjectCase, addon, attribute, main, positions, versions


class Shown(ObjectCase):
    def test_the_result_is_the_librarys_mesh_at_every_frame(self):
        tree, nodes = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        sunder = addon("base.core").sunder()
        graph = sunder.Graph.load(str(self.cached(tree) / "graph.json"))
        counts = set()
        for frame in (1, 4, 6, 2):
            self.scene.frame_set(frame)
            mesh, state = graph.evaluate("deformer.mesh", frame), graph.evaluate("solver.state", frame)
            np.testing.assert_array_equal(positions(thing), mesh.positions)
            corners = np.empty(len(thing.data.loops), np.int32)
            thing.data.loops.foreach_get("vertex_index", corners)
            np.testing.assert_array_equal(corners.reshape(-1, 3), mesh.triangles)
            np.testing.assert_array_equal(attribute(thing, "fragment"), mesh.face_fragment)
            np.testing.assert_allclose(attribute(thing, "strain"), state.strain[mesh.vertex_fragment], rtol=1e-6)
            np.testing.assert_array_equal(attribute(thing, "velocity"), mesh.velocities)
            # Before 4.5 Blender keeps custom normals in 16 bits an angle.
            tolerance = 1e-6 if versions().HAS_QUICK_NORMALS else 2e-3
            np.testing.assert_allclose(versions().corner_normals(thing.data), mesh.normals, atol=tolerance)
            self.assertFalse(thing.data.validate())
            counts.add(len(mesh.triangles))
        self.assertGreater(len(counts), 1)  # it tore, or this guards nothing

    def test_only_what_differs_between_two_frames_is_written(self):
        tree, _ = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(1)
        names = {"base.blender_versions": ("write_positions", "replace_triangles", "write_uvs"),
                 "results.result_mesh": ("write_attribute",)}
        written = []

        def noted(name, plain):
            return lambda *arguments: (written.append(name), plain(*arguments))

        with ExitStack() as stack:
            for module, functions in names.items():
                for name in functions:
                    stack.enter_context(patch.object(addon(module), name, noted(name, getattr(addon(module), name))))
            self.scene.frame_set(2)  # in the air: nothing broke
            at_rest, written[:] = list(written), []
            self.scene.frame_set(6)
        self.assertEqual(at_rest, ["write_positions"] + 5 * ["write_attribute"])
        self.assertEqual(written[:2], ["replace_triangles", "write_positions"])
        self.assertIn("write_uvs", written)
        thing.sunder.uv_map = "Other"  # what else faces are written from counts, too
        self.scene.frame_set(5)
        self.assertIn("Other", thing.data.uv_layers)

    def test_textures_by_generated_coordinates_stick_to_the_pieces(self):
        block = self.cube(size=1, location=(0.1, 0.2, 0.5))
        block.scale, block.rotation_euler = (0.4, 0.3, 0.2), (0.3, 0.4, 0.5)
        block.data.use_auto_texspace, block.data.texspace_size = False, (0.5, 0.25, 1)
        tree, _ = self.tree(block)
        thing, = self.results(tree)
        self.bake(tree)

        seen = []

        class Sees(bpy.types.RenderEngine):
            """What engines are given to render."""
            bl_idname, bl_label = "SUNDER_TEST", "Sees"

            def render(self, depsgraph):
                mesh = thing.evaluated_get(depsgraph).data
                at = lambda name: np.array([getattr(v, name) for v in mesh.vertices], np.float32)
                seen.append((at("co"), at("undeformed_co"), list(mesh.texspace_location), list(mesh.texspace_size)))

        bpy.utils.register_class(Sees)
        self.addCleanup(bpy.utils.unregister_class, Sees)
        self.scene.render.engine = "SUNDER_TEST"
        self.scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        self.scene.collection.objects.link(self.scene.camera)
        for frame in (1, 6):
            self.scene.frame_set(frame)
            bpy.ops.render.render()
            moved, rest, location, size = seen[-1]
            np.testing.assert_array_equal(moved, positions(thing))
            np.testing.assert_allclose(rest, attribute(thing, "rest_position"), atol=1e-6)
            np.testing.assert_allclose((location, size), ((0, 0, 0), (0.5, 0.25, 1)), atol=1e-7)
            # In the block's own axes: what is outside lies on its faces, all of it within.
            outer = np.unique(np.array([p.vertices for p, i in zip(thing.data.polygons, attribute(thing, "interior")) if not i]))
            np.testing.assert_allclose(np.abs(rest[outer]).max(1), 0.5, atol=1e-5)
            self.assertLess(np.abs(rest).max(), 0.5 + 1e-5)
            if frame == 1:  # as the block stands
                stands = np.array(block.matrix_world, np.float64)
                self.assertLess(np.abs(rest @ stands[:3, :3].T + stands[:3, 3] - moved).max(), 0.05)
        self.assertGreater(len(seen[1][0]), len(seen[0][0]))  # it tore
        copy = thing.copy()
        copy.data = thing.data.copy()
        self.scene.collection.objects.link(copy)
        self.scene.frame_set(2)
        self.assertNotEqual(copy.data.texco_mesh, thing.data.texco_mesh)
        rest = attribute(thing, "rest_position")
        for _ in range(2):  # Blender does not count texture meshes as used once they come from a file
            path = str(self.folder / "saved.blend")
            bpy.ops.wm.save_as_mainfile(filepath=path)
            bpy.ops.wm.open_mainfile(filepath=path)
            mesh = bpy.data.objects["Block fractured"].data
            np.testing.assert_array_equal([v.co for v in mesh.texco_mesh.vertices], rest)

    def test_normals_of_large_meshes_wait_until_playing_stops(self):
        tree, _ = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        player, handlers = addon("results.player"), addon("interface.handlers")
        self.scene.frame_set(2)
        exact = player.PLAYED_FACES
        self.scene.frame_current = 6  # torn: as playing in the window comes there
        self.assertFalse(player.show_all(self.scene, is_playing=True))  # a small one has its normals at once
        self.assertTrue(thing.data.has_custom_normals)
        wanted = player.show_all(self.scene)
        player.PLAYED_FACES = 0
        try:
            self.scene.frame_set(2)
            self.assertTrue(thing.data.has_custom_normals)  # scripts and renders have them whatever the size
            self.scene.frame_current = 6
            self.assertTrue(player.show_all(self.scene, is_playing=True))
            torn = len(thing.data.polygons)
            self.assertFalse(thing.data.has_custom_normals)
            handlers._late["frame"] = 6
            handlers._catch_up(self.scene)
            handlers._catch_up(self.scene)
        finally:
            player.PLAYED_FACES = exact
        self.assertEqual([len(thing.data.polygons), thing.data.has_custom_normals, wanted], [torn, True, False])

    def test_exact_normals_that_are_off_cost_nothing_more(self):
        """Also of faces that stay: each frame would have its normals worked out, which is most of its time."""
        tree, _ = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(1)
        self.assertTrue(thing.data.has_custom_normals)
        thing.sunder.use_exact_normals = False
        self.scene.frame_set(2)  # in the air: nothing broke
        self.assertFalse(thing.data.has_custom_normals)
        self.assertGreater(len(thing.data.polygons), 0)
        thing.sunder.use_exact_normals = True
        self.scene.frame_set(1)
        self.assertTrue(thing.data.has_custom_normals)

    def test_toughness_left_is_what_is_missing_to_the_toughness_at_the_frame(self):
        tree, nodes = self.tree(material={"toughness": 0.3})
        thing, = self.results(tree)
        for frame, value in ((1, 0.3), (5, 0.2)):
            nodes["body"].toughness = value
            nodes["body"].keyframe_insert("toughness", frame=frame)
        self.bake(tree)
        graph = addon("base.core").sunder().Graph.load(str(self.cached(tree) / "graph.json"))
        self.scene.frame_set(4)
        tough = graph["body"].at("toughness", 4)
        self.assertTrue(0.2 < tough < 0.3)
        left, strain = attribute(thing, "toughness_left"), attribute(thing, "strain")
        np.testing.assert_allclose(left, 1 - np.clip(strain / tough, 0, 1), atol=1e-5)
        self.assertLess(left.min(), 0.9)
        at = addon("base.bake_reader").value_at
        steps = {"keys": [[1, None], [3, 0.5]], "interpolation": "step"}
        self.assertEqual([at(steps, f) for f in (0, 2, 3, 9)], [None, None, 0.5, 0.5])
        self.assertEqual([at(0.4, 7), at(None, 7)], [0.4, None])
        self.assertEqual(at({"keys": [[1, [0, 0, 2]], [3, [1, 0, 4]]]}, 2), [0.5, 0, 3])

    def test_toughness_left_counts_factors_of_fragments_and_edges(self):
        thing = self.cube()
        group = thing.vertex_groups.new(name="Tough")
        group.add([v.index for v in thing.data.vertices if v.co.z > 0], 1, "REPLACE")
        tree, nodes = self.tree(thing, pieces=20)
        nodes["prefracture"].set_parameters(toughness_map="Tough", clusters=3, cluster_toughness=2.0)
        shown, = self.results(tree)
        self.bake(tree)
        folder = self.cached(tree)
        graph = addon("base.core").sunder().Graph.load(str(folder / "graph.json"))
        self.scene.frame_set(4)
        cut, body, state = (graph.evaluate(n, 4) for n in ("prefracture.fragments", "body.body", "solver.state"))
        mesh, tough = graph.evaluate("deformer.mesh", 4), graph["body"].at("toughness", 4)
        expected = []
        for p in range(len(state.strain)):  # by hand, particle after particle
            held = [f for (a, b), f, holds in zip(state.edges, body.edge_toughness_factor, state.edge_intact)
                    if holds and p in (a, b)]
            factor = cut.toughness_factor[state.fragment[p]] * (min(held) if held else 1)
            expected.append(1 - min(max(state.strain[p] / (tough * factor), 0), 1))
        self.assertTrue(body.edge_toughness_factor.max() > 1 and cut.toughness_factor.min() < 0.5)
        left = attribute(shown, "toughness_left")
        np.testing.assert_allclose(left, np.array(expected)[mesh.vertex_fragment], atol=1e-5)
        plain = 1 - np.clip(state.strain / tough, 0, 1)
        self.assertGreater(np.abs(left - plain[mesh.vertex_fragment]).max(), 0.01)

        for path in (folder / "state").iterdir():  # as before states held it, when the add-on noted factors
            data = path.read_bytes()
            header, rows = data.split(b"end_header\n", 1)
            at = header.index(b"element strength ")
            n = int(header[at:].split()[2])
            self.assertEqual(header[at:].split()[3:], [b"property", b"double", b"toughness"])
            path.write_bytes(header[:at] + b"end_header\n" + rows[:-8 * n])
        cache = addon("bake.cache")
        factors = {"fragment": cut.toughness_factor, "edge": body.edge_toughness_factor}
        noted = {"body": {n: [float(f) if f < np.inf else None for f in factors[n]] for n in factors}}
        cache.write_note(str(folder), {**cache.note(str(folder)), "toughness_factors": noted}, graph.to_dict())
        shown.sunder.use_exact_normals = False  # so that it is written anew
        self.scene.frame_set(4)
        np.testing.assert_allclose(attribute(shown, "toughness_left"), left, atol=1e-5)

    def test_break_surfaces_know_their_interface_and_how_near_the_rim_is(self):
        tree, nodes = self.tree()
        nodes["prefracture"].set_parameters(rim_width=0.05)
        thing, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(6)
        mesh = thing.data
        inner = attribute(thing, "interior")
        self.assertTrue(0 < inner.sum() < len(inner))
        self.assertTrue((attribute(thing, "interface")[~inner] == -1).all() and (attribute(thing, "interface")[inner] >= 0).all())
        rim = attribute(thing, "rim").reshape(-1, 3)
        self.assertEqual(mesh.attributes["rim"].domain, "CORNER")
        self.assertEqual(rim[~inner].max(), 0)
        self.assertEqual([rim[inner].min() < 0.5, rim[inner].max()], [True, 1])

    def test_plastic_strain_is_that_of_a_known_stretch(self):
        tree, _ = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        reader, write = addon("base.bake_reader"), addon("results.result_mesh")
        path = str(self.cached(tree) / "state/solver.0001.ply")
        state = reader.read_ply(path)
        rows = state["particle"] = state["particle"].copy()
        for i, value in enumerate((2.0, 0.5, 1.0)):  # ln: 0.693, -0.693, 0
            rows[f"fp{i}{i}"] = value
        frame = reader.read_mesh_frame(str(self.cached(tree) / "mesh/deformer.0001.ply"))
        kind, strain = write.state_attributes(state, 0, frame)["plastic_strain"]
        np.testing.assert_allclose(strain, np.sqrt(2 / 3) * np.sqrt(2) * np.log(2), rtol=1e-6)

    def test_outer_materials_stay_and_breaks_have_their_own(self):
        thing = self.cube()
        for name in ("Paint", "Primer", "Unused"):
            thing.data.materials.append(bpy.data.materials.new(name))
        thing.data.polygons[0].material_index = 1
        tree, _ = self.tree(thing)
        result, = self.results(tree)
        self.assertEqual([s.name for s in result.material_slots], ["Paint", "Primer", "Unused", "Sunder Interior"])
        self.bake(tree)
        for frame, wanted in ((1, {0, 1}), (6, {0, 1, 3})):
            self.scene.frame_set(frame)
            slots = np.array([p.material_index for p in result.data.polygons])
            self.assertEqual(set(slots), wanted)
            np.testing.assert_array_equal(attribute(result, "interior"), slots == 3)
        outer = result.data.uv_layers["UVMap"].data
        known = {tuple(np.round(l.uv, 4)) for l in thing.data.uv_layers.active.data}
        found = np.array([outer[i].uv for p in result.data.polygons if p.material_index < 3 for i in p.loop_indices])
        for uv in known:  # the library takes UVs a little inside a triangle, so that seams do not run across it
            self.assertLess(np.linalg.norm(found - uv, axis=1).min(), 2e-3, uv)
        self.assertTrue(0 <= found.min() and found.max() <= 1)

    def test_colours_and_the_uv_map_of_renders_come_back_under_their_own_names(self):
        thing = self.cube()
        thing.data.uv_layers.new(name="Wall").active_render = True
        thing.data.uv_layers.active_index = 0
        layer = thing.data.color_attributes.new("Col", "BYTE_COLOR", "CORNER")
        for loop in thing.data.loops:  # a colour for each side, none of which are the same in sRGB and linear
            side = thing.data.polygons[loop.index // 4].normal
            layer.data[loop.index].color = (*(0.5 + 0.3 * c for c in side), 1)
        wanted = {tuple(np.rint(np.multiply(d.color, 1000))) for d in layer.data}
        tree, _ = self.tree(thing)
        result, = self.results(tree)
        self.bake(tree)
        for frame in (1, 6):
            self.scene.frame_set(frame)
            mesh = result.data
            self.assertEqual([u.name for u in mesh.uv_layers if u.active_render], ["Wall"])
            self.assertEqual([c.name for c in mesh.color_attributes], ["Col"])
            self.assertEqual(mesh.color_attributes[mesh.color_attributes.render_color_index].name, "Col")
            colors = addon("scene.mesh_export").layer_colors(mesh.color_attributes["Col"]).reshape(-1, 3, 4)
            inner = attribute(result, "interior")
            self.assertEqual({tuple(np.rint(1000 * c)) for c in colors[~inner].reshape(-1, 4)}, wanted)
            self.assertEqual(inner.any(), frame == 6)
            np.testing.assert_array_equal(colors[inner], 1)  # break surfaces have none: white

    def test_names_of_maps_are_those_of_the_first_source_that_has_one(self):
        group = bpy.data.collections.new("Parts")
        self.scene.collection.children.link(group)
        for name in ("A", "B"):
            group.objects.link(self.cube(name=name, location=(0, 0, 0.5 + (name == "B"))))
        plain, painted = (bpy.data.objects[n].data for n in ("A", "B"))
        plain.uv_layers.remove(plain.uv_layers[0])
        plain.update_tag()  # removing does not tell it by itself
        painted.uv_layers[0].name = "Wall"
        painted.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
        tree, nodes = self.tree(bpy.data.objects["A"])
        nodes["mesh_file"].source, nodes["mesh_file"].collection = "COLLECTION", group
        result, = self.results(tree)
        self.bake(tree)
        self.assertEqual([[u.name for u in result.data.uv_layers], [c.name for c in result.data.color_attributes]],
                         [["Wall"], ["Paint"]])

    def test_results_stand_beside_their_sources(self):
        shelf, away = (bpy.data.collections.new(n) for n in ("Shelf", "Away"))  # the second is of no scene
        self.scene.collection.children.link(shelf)
        thing, ball = self.cube(), self.cube(size=0.2, location=(0.1, 0, 2), name="Ball")
        for source in (thing, ball):
            for collection in source.users_collection:
                collection.objects.unlink(source)
            shelf.objects.link(source), away.objects.link(source)
        tree, nodes = self.tree(thing)
        node = self.node(tree, "rigid_body", mass=5)
        node.source, node.collection = "COLLECTION", shelf
        self.connect(node, "rigid_body", nodes["solver"], "rigid_bodies")
        cut = nodes["prefracture"]
        cut.sites, cut.points_source, cut.points_collection = "points", "COLLECTION", shelf
        before = self.compiled(tree).description["nodes"]["prefracture"]["points"]
        for made in self.results(tree):
            self.assertEqual([c.name for c in made.users_collection], ["Shelf"], made.name)
        # Results are no sites.
        self.assertEqual(self.compiled(tree).description["nodes"]["prefracture"]["points"], before)

    def test_the_last_baked_frame_is_shown_and_the_node_says_so(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.assertEqual(nodes["deformer"].note, "nothing baked yet")
        self.assertGreater(len(result.data.vertices), 0)  # the source, for the time being
        self.scene.frame_end = 3
        self.bake(tree)
        self.scene.frame_end = 6
        self.scene.frame_set(3)
        there = positions(result)
        self.scene.frame_set(5)
        np.testing.assert_array_equal(positions(result), there)
        self.assertEqual(nodes["deformer"].note, "baked 1 to 3; frame 5 shows 3")
        self.scene.frame_set(-4)
        self.assertEqual(nodes["deformer"].note, "baked 1 to 3; frame -4 shows 1")

    def test_a_result_that_is_edited_or_sculpted_is_left_alone(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        bpy.context.view_layer.objects.active = result
        for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT"):
            bpy.ops.object.mode_set(mode=mode)
            self.scene.frame_set(5)
            self.assertRegex(nodes["deformer"].note, f"frame 5 cannot be shown: .* is in {mode.lower().replace('_', ' ')} mode")
            bpy.ops.object.mode_set(mode="OBJECT")
            self.scene.frame_set(4)
            self.assertEqual(nodes["deformer"].note, "baked 1 to 6")

    def test_a_scene_does_not_move_what_another_shows(self):
        tree, _ = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(2)
        there = positions(result)
        other = bpy.data.scenes.new("Other")
        other.frame_set(6)
        np.testing.assert_array_equal(positions(result), there)

    def test_sub_frames_show_the_nearest_frame_as_it_moves(self):
        """Motion blur by frames asks for times between them: the same points and faces, each where its velocity takes it."""
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        for frame, part, shown in ((3, 0.25, 3), (3, 0.75, 4), (4, 0.0, 4)):
            self.scene.frame_set(shown)
            there, speed, n_faces = positions(result), attribute(result, "velocity"), len(result.data.polygons)
            self.scene.frame_set(frame, subframe=part)
            self.assertEqual(addon("results.player").nearest_frame(self.scene), shown)
            self.assertEqual(len(result.data.polygons), n_faces)
            seconds = (frame + part - shown) / 24
            np.testing.assert_allclose(positions(result), there + seconds * speed, rtol=0, atol=1e-6)
            self.assertEqual(seconds != 0, np.abs(positions(result) - there).max() > 1e-4)
        self.scene.frame_set(6, subframe=0.25)
        self.scene.frame_set(6)
        at_last = positions(result)
        self.scene.frame_set(7, subframe=0.25)  # nothing is baked there: it holds still
        np.testing.assert_array_equal(positions(result), at_last)

    def test_a_rigid_body_moves_between_frames(self):
        tree, nodes = self.tree()
        ball = self.cube(size=0.2, location=(0, 0, 3), name="Ball")
        weight = self.node(tree, "rigid_body", shape="box", mass=5.0, velocity=(1, 0, -4), angular_velocity=(0, 0, 360))
        weight.source, weight.object = "OBJECT", ball
        self.connect(weight, "rigid_body", nodes["solver"], "rigid_bodies")
        self.results(tree)
        self.bake(tree)
        twin, = (o for o in addon("tree.trees").result_objects(tree) if o.sunder.node == "rigid_body")
        self.scene.frame_set(3)
        at, turned = twin.matrix_world.translation.copy(), twin.matrix_world.to_quaternion()
        self.scene.frame_set(3, subframe=0.25)
        np.testing.assert_allclose((twin.matrix_world.translation - at)[:1], [0.25 / 24], atol=1e-4)
        self.assertAlmostEqual(turned.rotation_difference(twin.matrix_world.to_quaternion()).angle, np.radians(360 / 96), 4)

    def test_a_damaged_frame_is_told_and_the_others_play(self):
        tree, nodes = self.tree()
        result, = self.results(tree)
        self.bake(tree)
        path = self.cached(tree) / "mesh/deformer.0004.ply"
        path.write_bytes(path.read_bytes()[:-1])
        self.scene.frame_set(4)
        self.assertRegex(nodes["deformer"].note, "frame 4 cannot be shown: .*deformer.0004.ply: ends within")
        self.scene.frame_set(5)
        self.assertEqual(nodes["deformer"].note, "baked 1 to 6")
        shutil.rmtree(self.cached(tree))
        self.scene.frame_set(6)
        self.assertEqual(nodes["deformer"].note, "nothing baked yet")

    def test_a_twin_looks_as_its_object_does_and_takes_over_nothing_that_would_move_it(self):
        tree, nodes = self.tree()
        bpy.ops.object.empty_add(location=(1, 2, 3), rotation=(0.5, 0, 0))
        parent = bpy.context.object
        ball = self.cube(size=0.3, location=(0, 0, 2), name="Ball")
        ball.modifiers.new("round", "SUBSURF").levels = 2
        ball.keyframe_insert("location", frame=1)
        ball.constraints.new("COPY_ROTATION").target = parent
        ball.parent = parent
        bpy.context.view_layer.update()
        node = self.node(tree, "rigid_body", mass=5)
        node.source, node.object = "OBJECT", ball
        self.connect(node, "rigid_body", nodes["solver"], "rigid_bodies")
        twin = next(o for o in self.results(tree) if o.sunder.node == "rigid_body")
        self.assertEqual([m.name for m in twin.modifiers], ["round"])
        self.assertEqual([twin.animation_data, [c.name for c in twin.constraints], twin.parent, twin.hide_render],
                         [None, ["Moves"], None, False])  # that one, for exports, moves nothing
        bpy.context.view_layer.update()
        np.testing.assert_allclose(twin.matrix_world, ball.matrix_world, atol=1e-6)
        self.assertTrue(twin.visible_get() and not ball.visible_get())

    def test_a_rigid_bodys_twin_moves_and_the_object_stays(self):
        tree, nodes = self.tree()
        ball = self.cube(size=0.2, location=(0.1, 0, 2), name="Ball")
        ball.data.transform(Matrix.Translation((0, 0, 0.1)))
        ball.scale, ball.rotation_euler = (1, 2, 1), (0.3, 0, 0)
        bpy.context.view_layer.update()
        node = self.node(tree, "rigid_body", shape="box", mass=5, velocity=(0, 0, -3))
        node.object = ball
        self.connect(node, "rigid_body", nodes["solver"], "rigid_bodies")
        twin = next(o for o in self.results(tree) if o.sunder.node == "rigid_body")
        self.bake(tree)
        state = addon("base.core").sunder().Graph.load(str(self.cached(tree) / "graph.json")).evaluate("solver.state", 6)
        self.scene.frame_set(1)
        self.assertLess((twin.matrix_world.translation - ball.matrix_world.translation).length, 1e-6)
        self.scene.frame_set(6)
        center = twin.matrix_world @ Vector((0, 0, 0.1))
        np.testing.assert_allclose(center, state.rigid_position[0], atol=1e-5)
        np.testing.assert_allclose(twin.matrix_world.to_scale(), (1, 2, 1), rtol=1e-5)
        self.assertAlmostEqual(ball.location.z, 2)
        self.assertTrue(ball.hide_render)
        self.assertIs(self.status(tree).is_stale, False)

    def test_a_render_in_the_window_waits_until_it_may_write(self):
        class Busy:
            """Refuses as Blender does while its main thread draws a panel."""

            left = 3

            def __setitem__(self, name, value):
                self.left -= 1
                if self.left >= 0:
                    raise AttributeError("Writing to ID classes in this context is not allowed")
                self.value = value

        busy = Busy()
        thread = threading.Thread(target=addon("results.result_mesh").set_property, args=(busy, "sunder_shown", "x"))
        thread.start()
        thread.join(10)
        self.assertEqual([busy.left, busy.value], [-1, "x"])
        with self.assertRaisesRegex(AttributeError, "not allowed"):  # here waiting would not help
            addon("results.result_mesh").set_property(Busy(), "sunder_shown", "x")

    def test_a_bodys_own_attributes_are_read_where_there_are_two(self):
        tree, nodes = self.tree(self.cube(location=(0, 0, 0.3)))
        other, _ = self.tree(self.cube(location=(2, 0, 3), name="Second"), pieces=5)
        mesh, cut = self.node(tree, "mesh_file"), self.node(tree, "prefracture", pieces=5)
        mesh.object = bpy.data.objects["Second"]
        body, skin = self.node(tree, "body", velocity=(7, 0, 0)), self.node(tree, "deformer")
        self.connect(mesh, "mesh", cut, "mesh"), self.connect(cut, "fragments", body, "fragments")
        self.connect(body, "body", nodes["solver"], "bodies"), self.connect(body, "body", skin, "body")
        self.connect(nodes["solver"], "state", skin, "state")
        nodes["body"].set_parameters(angular_velocity=(0, 0, 0))
        first, second = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(1)
        self.assertAlmostEqual(attribute(second, "velocity")[:, 0].mean(), 7, places=3)
        self.assertAlmostEqual(attribute(first, "velocity")[:, 0].mean(), 0, places=3)
        self.assertEqual(second.name, "Second fractured")


if __name__ == "__main__":
    main()
