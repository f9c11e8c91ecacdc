"""Edges are selected, made weaker, glued, broken and painted; edits are kept by place, undone, and found again in another cut."""
import math

import bpy
import gpu
import numpy as np
from mathutils import Matrix

from addon_case import AddonCase, addon, main
from addon_preview_test import HEIGHT, WIDTH, PreviewCase
from addon_rows_test import Recorder

WEAK = np.float32(0.2)


class EdgesCase(AddonCase):
    def setUp(self):
        super().setUp()
        block = self.cube(size=1, location=(3, 2, 1))
        block.rotation_euler = (0, 0, math.radians(30))
        bpy.context.view_layer.update()
        self.shot, self.nodes = self.tree(block, pieces=60, material={"toughness": 0.1})
        self.block = block

    @property
    def body(self):
        return next(n for n in self.shot.nodes if n.sunder_type == "body")

    def edges(self):
        return addon("bake.edges").of(self.shot, self.scene, self.body)

    def selected(self):
        return addon("bake.edges").selected(self.shot, self.body.graph_name, self.edges())

    def select(self, **how):
        return bpy.ops.sunder.select_edges(tree=self.shot.name, **how)

    def edits(self):
        return addon("tree.edits").of_body(self.body)

    def scaled(self, factor=0.2):
        return np.isclose(self.edges().toughness, 0.1 * factor, rtol=1e-5)

    def refused(self, operator, **given):
        with self.assertRaises(RuntimeError) as caught:
            operator(tree=self.shot.name, **given)
        return str(caught.exception)

    def lower_corner(self):
        """Selects a corner's edges; which these are."""
        self.select(by="BOX", box_min=(0, 0, 0), box_max=(3, 2.1, 1.1))
        return self.selected()


class Selecting(EdgesCase):
    def test_all_none_and_what_is_not(self):
        self.select(by="ALL")
        self.assertTrue(self.selected().all())
        self.select(by="INVERT")
        self.assertFalse(self.selected().any())
        chosen = self.lower_corner()
        self.assertTrue(10 < chosen.sum() < len(chosen) / 2)
        self.select(by="INVERT")
        np.testing.assert_array_equal(self.selected(), ~chosen)
        self.select(by="NONE")
        self.assertFalse(self.selected().any())

    def test_by_box_angle_area_and_one_within_another(self):
        found = self.edges()
        inside = (found.middle <= np.array([3, 2.1, 1.1])).all(1)
        np.testing.assert_array_equal(self.lower_corner(), inside)
        self.select(by="ANGLE", direction=(0, 0, 2), angle=math.radians(40), action="FILTER")
        lying = np.abs(found.normal[:, 2]) >= math.cos(math.radians(40))
        np.testing.assert_array_equal(self.selected(), inside & lying)
        self.select(by="AREA", least_area=0.2, most_area=0.5, action="ADD")
        small = (found.share >= np.float32(0.2)) & (found.share <= np.float32(0.5))
        np.testing.assert_array_equal(self.selected(), inside & lying | small)
        self.assertIn("has no length", self.refused(bpy.ops.sunder.select_edges, by="ANGLE", direction=(0, 0, 0)))

    def test_by_cluster(self):
        self.nodes["prefracture"].clusters = 4
        found = self.edges()
        first, second = found.cluster[found.pairs].T
        self.select(by="CLUSTERS")
        np.testing.assert_array_equal(self.selected(), first != second)
        self.select(by="CLUSTER", cluster=2)
        np.testing.assert_array_equal(self.selected(), (first == 2) & (second == 2))
        self.assertTrue(self.selected().any())

    def test_by_a_box_of_pixels(self):
        screen = Matrix([[1, 0, 0, -3], [0, 0, 1, -1], [0, 1, 0, 0], [0, 0, 0, 1]])  # x to the right, z up
        found = self.edges()
        inside = addon("interface.edge_strokes").in_rectangle(found.middle, screen, (200, 100), (100, 0), (200, 50))
        np.testing.assert_array_equal(inside, (found.middle[:, 0] >= 3) & (found.middle[:, 2] <= 1) & (found.middle[:, 2] >= 0))
        self.assertTrue(inside.any())
        self.assertIn("needs a 3D view", self.refused(bpy.ops.sunder.box_select_edges))

    def test_another_cut_has_another_selection(self):
        self.select(by="ALL")
        self.nodes["prefracture"].seed = 5
        self.assertFalse(self.selected().any())
        self.assertIn("select edges first", self.refused(bpy.ops.sunder.glue_edges))
        self.block.location.x += 2  # the same cut elsewhere
        self.select(by="ALL")
        self.block.location.x -= 1
        bpy.context.view_layer.update()
        self.assertTrue(self.selected().all())

    def test_what_is_not_there_is_told(self):
        self.assertIn("no body 'other'", self.refused(bpy.ops.sunder.select_edges, body="other"))
        with self.assertRaises(RuntimeError) as caught:
            bpy.ops.sunder.select_edges(tree="None Such")
        self.assertIn("no Sunder tree 'None Such'", str(caught.exception))


class Editing(EdgesCase):
    def test_strength_is_set_for_those_that_are_selected_and_no_other(self):
        chosen = self.lower_corner()
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name)
        np.testing.assert_array_equal(self.scaled(), chosen)
        np.testing.assert_allclose(self.edges().toughness[~chosen], 0.1, rtol=1e-6)
        edit, = self.edits()
        self.assertEqual([edit.mode, edit.between, edit.parameter("toughness")], ["scale", "places", 0.2])
        self.assertAlmostEqual(edit.distance, 0.75 / 60 ** (1 / 3), delta=0.001)
        np.testing.assert_array_equal(self.selected(), chosen)  # a selection outlives what is made of it

    def test_what_is_set_last_counts_and_the_tree_stays_tidy(self):
        chosen = self.lower_corner()
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name, toughness=0.2)
        self.select(by="ANGLE", angle=math.radians(35), action="FILTER")
        lying = self.selected()
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name, toughness=5)
        np.testing.assert_array_equal(self.scaled(5), lying)
        np.testing.assert_array_equal(self.scaled(0.2), chosen & ~lying)
        self.select(by="INVERT")
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name, toughness=5)  # the same again: no other node
        self.assertEqual(len(self.edits()), 1)
        self.assertTrue(self.scaled(5).all())
        self.select(by="ALL")
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name, toughness=1)
        self.assertEqual(self.edits(), [])
        np.testing.assert_allclose(self.edges().toughness, 0.1, rtol=1e-6)

    def test_nodes_stand_between_body_and_solver_and_leave_no_gap(self):
        before = {n.name: tuple(n.location) for n in self.shot.nodes}
        wires = {(l.from_node.name, l.to_node.name) for l in self.shot.links}
        self.lower_corner()
        bpy.ops.sunder.glue_edges(tree=self.shot.name)
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name)
        first, second = self.edits()
        chain = [("Body", first.name), (first.name, second.name), (second.name, "Solver")]
        self.assertLessEqual(set(chain), {(l.from_node.name, l.to_node.name) for l in self.shot.links})
        boxes = [(n.location.x, n.location.x + n.width, n.location.y) for n in self.shot.nodes]
        for i, (left, right, y) in enumerate(boxes):
            for other_left, other_right, other_y in boxes[:i]:
                self.assertTrue(right <= other_left or other_right <= left or abs(y - other_y) > 100)
        bpy.ops.sunder.free_edges(tree=self.shot.name)
        self.assertEqual({n.name: tuple(n.location) for n in self.shot.nodes}, before)
        self.assertEqual({(l.from_node.name, l.to_node.name) for l in self.shot.links}, wires)

    def test_glue_and_breaking_exclude_one_another_and_are_baked(self):
        self.results(self.shot)
        chosen = self.lower_corner()
        bpy.ops.sunder.glue_edges(tree=self.shot.name)
        self.assertTrue(np.isinf(self.edges().toughness[chosen]).all())
        self.select(by="ANGLE", angle=math.radians(35), action="FILTER")
        lying = self.selected()
        bpy.ops.sunder.break_edges(tree=self.shot.name, frame=3)
        np.testing.assert_array_equal(np.isinf(self.edges().toughness), chosen & ~lying)
        modes = {n.mode: n for n in self.edits()}
        self.assertEqual([sorted(modes), modes["break"].frame, modes["hold"].parameter("frame")], [["break", "hold"], 3, None])
        self.nodes["body"].set_parameters(toughness=None)
        self.bake(self.shot)
        told = addon("base.core").sunder().report(str(self.cached(self.shot)))
        self.assertEqual({(b["frame"], b["by_kind"]) for b in told["breaks"]}, {(3, "seam")})
        self.assertEqual({b["edge"] for b in told["breaks"]}, set(np.flatnonzero(lying).tolist()))

    def test_another_cut_has_the_edit_at_the_same_place_also_where_the_block_was_moved(self):
        chosen = self.lower_corner()
        middle = self.edges().middle[chosen]
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name)
        self.block.location.x += 10
        bpy.context.view_layer.update()
        for seed, pieces in ((7, 60), (1, 130), (3, 35)):
            self.nodes["prefracture"].seed, self.nodes["prefracture"].pieces = seed, pieces
            found, weak = self.edges(), self.scaled()
            away = np.linalg.norm(found.middle[:, None] - (10, 0, 0) - middle[None], axis=2).min(1)
            within = ((found.middle - (10, 0, 0)) <= np.array([3, 2.1, 1.1])).all(1)
            self.assertGreater((found.share * weak)[within].sum(), 0.8 * found.share[within].sum(), (seed, pieces))
            self.assertFalse(weak[away > 0.75 / 60 ** (1 / 3) + 1e-4].any(), (seed, pieces))
            self.assertFalse(self.selected().any())

    def test_edits_are_undone(self):
        bpy.context.preferences.edit.use_global_undo = True
        name = self.shot.name
        bpy.ops.ed.undo_push(message="as it was")
        chosen = self.lower_corner()
        bpy.ops.ed.undo_push(message="selected")
        bpy.ops.sunder.set_edge_strength(tree=name)
        bpy.ops.ed.undo_push(message="weaker")
        self.assertEqual(len(self.edits()), 1)
        bpy.ops.ed.undo()
        self.shot, self.scene = bpy.data.node_groups[name], bpy.context.scene
        self.assertEqual(self.edits(), [])
        np.testing.assert_allclose(self.edges().toughness, 0.1, rtol=1e-6)
        np.testing.assert_array_equal(self.selected(), chosen)
        bpy.ops.ed.undo()
        self.shot, self.scene = bpy.data.node_groups[name], bpy.context.scene
        self.assertFalse(self.selected().any())
        bpy.ops.ed.redo(), bpy.ops.ed.redo()
        self.shot, self.scene = bpy.data.node_groups[name], bpy.context.scene
        np.testing.assert_array_equal(self.scaled(), chosen)

    def test_files_keep_edits(self):
        chosen = self.lower_corner()
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name)
        self.save()
        self.reopen()
        self.shot, = addon("tree.trees").trees()
        np.testing.assert_array_equal(self.scaled(), chosen)

    def test_of_two_bodies_the_named_one_is_edited_and_their_order_stays(self):
        self.cube(location=(-1, 0, 0.5), name="Other")
        tree = addon("interface.quick_fracture").build([self.block, bpy.data.objects["Other"]], "CLAY", 12)
        self.shot = tree
        solver = next(n for n in tree.nodes if n.sunder_type == "solver")
        order = addon("tree.wiring").sources(solver, "bodies")
        bodies = [node.graph_name for node, _ in order]
        bpy.context.view_layer.objects.active = None
        self.assertIn("not clear which body", self.refused(bpy.ops.sunder.select_edges, by="ALL"))
        for name in bodies:
            self.select(by="ALL", body=name)
            bpy.ops.sunder.glue_edges(tree=tree.name, body=name)
        chain = [addon("tree.wiring").upstream(node, "body").graph_name for node, _ in addon("tree.wiring").sources(solver, "bodies")]
        self.assertEqual(chain, bodies)
        bpy.context.view_layer.objects.active = bpy.data.objects["Other"]
        self.select(by="ALL")
        self.assertEqual(tree.edges_of, bodies[1])

    def test_what_is_kept_and_is_no_list_of_places_is_told_on_its_node(self):
        self.lower_corner()
        bpy.ops.sunder.glue_edges(tree=self.shot.name)
        edit, = self.edits()
        for text in ("1 2", "1 2 x", "1 2 nan"):
            edit.points_values = text
            self.assertIn("no list of places", self.refusal(self.shot))
            self.assertIn("no list of places", edit.error)


class Seams(EdgesCase):
    """Seams that artists add by hand: what objects stand for lies in the scene, wherever the block stands."""

    def seam(self, **given):
        edits = addon("tree.edits")
        node = edits.insert(self.body, {"mode": "scale", "toughness": 0.2}, 0.3)
        node.points_source = node.spared_source = "OBJECT"
        for name, value in given.items():
            setattr(node, name, value)
        return node

    def empty(self, location):
        thing = bpy.data.objects.new("Region", None)
        thing.location, thing.empty_display_size = location, 0.3
        self.scene.collection.objects.link(thing)
        bpy.context.view_layer.update()
        return thing

    def test_points_of_a_curve_and_regions_are_objects_in_the_scene(self):
        there = np.array([3.2, 2.1, 1.2])
        region = self.empty(there)
        node = self.seam(between="curve", points_object=region)
        away = np.linalg.norm(self.edges().middle - there, axis=1)
        np.testing.assert_array_equal(self.scaled(), away < 0.3)
        self.assertTrue(self.scaled().any())
        node.between, node.source, node.object = "sphere", "OBJECT", region
        np.testing.assert_array_equal(self.scaled(), away <= 0.3)
        node.between = "box"
        np.testing.assert_array_equal(self.scaled(), (np.abs(self.edges().middle - there) <= 0.3).all(1))
        region.location.x += 0.2
        bpy.context.view_layer.update()
        np.testing.assert_array_equal(self.scaled(), (np.abs(self.edges().middle - there - (0.2, 0, 0)) <= 0.3).all(1))

    def test_a_node_shows_the_rows_that_count(self):
        node = self.seam(between="clusters")
        for between, shown in (("clusters", False), ("box", True), ("places", False)):
            node.between = between
            layout = Recorder()
            node.draw_buttons(bpy.context, layout)
            self.assertEqual("source" in layout.drawn, shown)
        node.points_source = "VALUES"
        layout = Recorder()
        node.draw_buttons(bpy.context, layout)
        self.assertIn("Points: 0 places", layout.drawn)


class Painting(EdgesCase):
    STROKE = [{"name": "", "location": (3 + 0.1 * k, 2, 1.5)} for k in range(-3, 4)]

    def paint(self, **how):
        return bpy.ops.sunder.paint_edges(tree=self.shot.name, stroke=self.STROKE, radius=0.25, **how)

    def under(self):
        points = np.array([p["location"] for p in self.STROKE], float)
        return np.linalg.norm(self.edges().middle[:, None] - points[None], axis=2).min(1) < 0.25

    def test_a_stroke_weakens_what_lies_near_it_in_every_cut(self):
        self.paint()
        for seed in (0, 4):
            self.nodes["prefracture"].seed = seed
            np.testing.assert_array_equal(self.scaled(), self.under())
            self.assertTrue(5 < self.under().sum() < 0.6 * len(self.under()))
        edit, = self.edits()
        self.assertEqual(len(addon("tree.edits").places(edit, "points")), len(self.STROKE))

    def test_a_stroke_selects_glues_and_clears(self):
        self.paint(kind="SELECT")
        np.testing.assert_array_equal(self.selected(), self.under())
        self.assertEqual(self.edits(), [])
        self.select(by="ALL")
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name, toughness=0.5)
        self.paint(toughness=3)
        np.testing.assert_array_equal(self.scaled(3), self.under())
        np.testing.assert_array_equal(self.scaled(0.5), ~self.under())
        self.paint(kind="GLUE")
        np.testing.assert_array_equal(np.isinf(self.edges().toughness), self.under())
        self.paint(kind="FREE")
        np.testing.assert_array_equal(np.isclose(self.edges().toughness, 0.1), self.under())
        self.paint(kind="BREAK", frame=4)
        edit, = [n for n in self.edits() if n.mode == "break"]
        self.assertEqual(edit.frame, 4)

    def test_wrong_strokes_are_told(self):
        self.assertIn("no point", self.refused(bpy.ops.sunder.paint_edges))
        for at, why in (((9, 9, 9), "no interface"), ((float("nan"), 0, 0), "not finite")):
            self.assertIn(why, self.refused(bpy.ops.sunder.paint_edges, stroke=[{"name": "", "location": at}]))
        self.assertEqual(self.edits(), [])


class Shown(PreviewCase):
    def test_the_overlay_draws_what_is_selected_bright(self):
        overlay, edges = addon("preview.edge_overlay"), addon("bake.edges")
        bpy.ops.sunder.select_edges(tree=self.shot.name, by="BOX", box_min=(29, -21, 0), box_max=(30, -19, 1))
        self.assertIsNone(self.picture(overlay))
        bpy.ops.sunder.show_edges(tree=self.shot.name)
        self.assertTrue(self.shot.shows_edges)
        picture = self.picture(overlay)
        bright = (picture[..., 0] > 0.8) & (picture[..., 2] < 0.4)
        grey = (picture.max(-1) > 0.1) & (np.ptp(picture, -1) < 0.15)
        self.assertTrue(bright.sum() > 30 and grey.sum() > 30, (bright.sum(), grey.sum()))
        self.assertLess(np.argwhere(bright)[:, 1].mean(), np.argwhere(grey)[:, 1].mean())
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name, toughness=0.1)
        bpy.ops.sunder.select_edges(tree=self.shot.name, by="NONE")
        weak = self.picture(overlay)
        self.assertGreater(((weak[..., 0] > 2 * weak[..., 2]) & (weak[..., 0] > 0.3)).sum(), 30)
        body, = [n for n in self.shot.nodes if n.sunder_type == "body"]
        found = edges.at_hand(self.shot, self.scene)[body.graph_name]
        ends, colors = overlay.lines(found, np.zeros(len(found.pairs), bool))
        np.testing.assert_allclose(ends, found.center[found.pairs].reshape(-1, 3), rtol=1e-6)
        bpy.ops.sunder.show_edges(tree=self.shot.name)
        self.assertIsNone(self.picture(overlay))

    def picture(self, overlay):
        """The overlay on a black ground, seen from the front; None where nothing is drawn."""
        place = Matrix.Translation((-30, 20, -0.5))
        flat = Matrix([[2, 0, 0, 0], [0, 0, 2, 0], [0, 0.1, 0, 0], [0, 0, 0, 1]])

        def work():
            target = gpu.types.GPUOffScreen(WIDTH, HEIGHT)
            with target.bind():
                buffer = gpu.state.active_framebuffer_get()
                buffer.clear(color=(0, 0, 0, 1), depth=1.0)
                with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
                    gpu.matrix.load_matrix(place), gpu.matrix.load_projection_matrix(flat)
                    overlay.draw(self.scene)
                pixels = buffer.read_color(0, 0, WIDTH, HEIGHT, 4, 0, "FLOAT")
            target.free()
            pixels.dimensions = WIDTH * HEIGHT * 4
            return np.array(pixels, np.float32).reshape(HEIGHT, WIDTH, 4)[..., :3]

        drawn = self.on_card(work)
        return drawn if drawn.max() > 0 else None

    def test_edges_of_a_bake_tell_strength_and_load(self):
        bpy.ops.sunder.select_edges(tree=self.shot.name, by="BOX", box_min=(29, -21, 0), box_max=(30, -19, 1))
        chosen = addon("bake.edges").selected(self.shot, "body", addon("bake.edges").of(self.shot, self.scene, self.nodes["body"]))
        bpy.ops.sunder.set_edge_strength(tree=self.shot.name, toughness=0.1)
        self.bake(self.shot)
        data, source = addon("preview.preview_source"), self.source()
        for n in (1, 6):
            path = str(self.cached(self.shot) / f"state/solver.{n:04d}.ply")
            state = addon("base.core").sunder().read_state(path)
            intact = state.edge_intact.astype(bool)
            edges, ratio = state.edges[intact], np.where(chosen, 0.1, 1.0)[intact]
            for shows in ("STRENGTH", "LOAD"):
                f = source.frame(path, "EDGES", 0.0, shows)
                ends = data.skinned(f.edges, f.particles)[f.edges.lines] + f.center
                np.testing.assert_allclose(ends, state.position[edges], atol=1e-5)  # what broke is left out
                shades = f.particles[f.edges.follows[f.edges.lines[:, 0], 2], 3, :3]
                load = np.clip(state.strain[edges].max(1) / (0.009 * ratio), 0, 1)
                wanted = data.strength(ratio) if shows == "STRENGTH" else data.heat(load)
                np.testing.assert_allclose(shades, wanted, atol=1e-4)
            weakest = np.ones(len(state.position))
            np.minimum.at(weakest, edges, ratio[:, None])
            shown = source.frame(path, "TOUGHNESS").particles[:len(weakest), 3, :3]
            wanted = data.traffic_light(1 - np.clip(state.strain / (0.009 * weakest), 0, 1))
            np.testing.assert_allclose(shown, wanted, atol=1e-4)
        self.assertTrue(intact.any() and not intact.all())

    def test_colours_of_strength(self):
        data = addon("preview.preview_source")
        red, grey, blue, glued = data.strength(np.array([0.01, 1, 50, np.inf]))
        self.assertTrue(red[0] > 3 * red[2] and blue[2] > 2 * blue[0] and np.ptp(grey) < 0.15)
        np.testing.assert_array_equal(glued, data._GLUED)

    def test_panels_draw(self):
        for shows in (False, True):
            if shows:
                bpy.ops.sunder.select_edges(tree=self.shot.name, by="ALL")
                bpy.ops.sunder.show_edges(tree=self.shot.name)
            layout = Recorder()
            addon("interface.edge_panels")._draw(layout, self.shot, bpy.context)
            self.assertEqual(any("selected" in t for t in layout.drawn if isinstance(t, str)), shows)


if __name__ == "__main__":
    main()
