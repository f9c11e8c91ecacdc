"""Attributes of results: what an activate node glues does not tear, in the preview's colours, too; what fragments have lost."""
import numpy as np

from addon_case import AddonCase, addon, attribute, main

GLUED_TO = 4  # the last frame at which it is glued


class Glued(AddonCase):
    def setUp(self):
        super().setUp()
        self.shot, nodes = self.tree(pieces=20)
        glue = self.node(self.shot, "activate", mode="glued", region="box", box_min=(-9, -9, 0.6), box_max=(9, 9, 9),
                         until="frame", frame=GLUED_TO + 1)
        for link in [link for link in self.shot.links if link.from_node == nodes["body"]]:
            self.shot.links.remove(link)
        self.connect(nodes["body"], "body", glue, "body")
        for name, socket in (("solver", "bodies"), ("deformer", "body")):
            self.connect(glue, "body", nodes[name], socket)
        self.shown, = self.results(self.shot)
        self.bake(self.shot)
        self.graph = addon("base.core").sunder().Graph.load(str(self.cached(self.shot) / "graph.json"))

    def left(self, frame, has_glue):
        """What is missing to the toughness, of each particle: worked out one after the other, from the library's state."""
        state, tough = self.graph.evaluate("solver.state", frame), self.graph["body"].at("toughness", frame)
        glued = (state.kept & 4) != 0
        self.assertEqual([glued.any(), glued.all()], [has_glue, False])
        self.assertGreater(state.strain.max(), 0)
        left = 1 - np.clip(state.strain / tough, 0, 1)
        for p in range(len(glued)):
            others = [a + b - p for (a, b), holds in zip(state.edges, state.edge_intact) if holds and p in (a, b)]
            if others and (glued[p] or glued[others].all()):
                left[p] = 1
        return left

    def test_the_attribute_is_whole_of_what_is_glued_and_of_no_more(self):
        for frame, has_glue in ((GLUED_TO, True), (6, False)):
            self.scene.frame_set(frame)
            follows = self.graph.evaluate("deformer.mesh", frame).vertex_fragment
            np.testing.assert_allclose(attribute(self.shown, "toughness_left"), self.left(frame, has_glue)[follows], atol=1e-5)

    def test_so_are_the_colours_of_the_preview(self):
        data, folder = addon("preview.preview_source"), self.cached(self.shot)
        source = data.Source(str(folder), self.manifest(self.shot).graph, "deformer")
        source.start(), source.wait()
        for frame, has_glue in ((GLUED_TO, True), (6, False)):
            drawn = source.frame(str(folder / f"state/solver.{frame:04d}.ply"), "TOUGHNESS")
            wanted = data.traffic_light(self.left(frame, has_glue))
            np.testing.assert_allclose(drawn.particles[:len(wanted), 3, :3], wanted, atol=1e-5)


class Changed(AddonCase):
    def test_seams_and_body_regions_count(self):
        """By hand, particle after particle: its own toughness, times the factor of the weakest edge that holds at it."""
        tree, nodes = self.tree(pieces=20)
        seam = self.node(tree, "seam", mode="scale", toughness=0.3, between="box", box_min=(-9, -9, 0.6), box_max=(9, 9, 9))
        region = self.node(tree, "body_region", toughness=2.0, region="box", box_min=(-9, -9, -9), box_max=(9, 9, 0.4))
        for link in [link for link in tree.links if link.from_node == nodes["body"]]:
            tree.links.remove(link)
        self.connect(nodes["body"], "body", seam, "body")
        self.connect(seam, "body", region, "body")
        for name, socket in (("solver", "bodies"), ("deformer", "body")):
            self.connect(region, "body", nodes[name], socket)
        shown, = self.results(tree)
        self.bake(tree)
        graph = addon("base.core").sunder().Graph.load(str(self.cached(tree) / "graph.json"))
        self.scene.frame_set(6)
        state, tough = graph.evaluate("solver.state", 6), graph["body"].at("toughness", 6)
        body = graph.evaluate("body.body", 6)
        low, weak = body.rest_position[:, 2] <= 0.4, body.edge_middle[:, 2] >= 0.6
        self.assertTrue(0 < low.sum() < len(low) and 0 < weak.sum() < len(weak))
        left = np.ones(len(low))
        for p in range(len(low)):
            held = [0.3 if w else 1 for (a, b), w, holds in zip(state.edges, weak, state.edge_intact) if holds and p in (a, b)]
            if held:
                left[p] = 1 - np.clip(state.strain[p] / (tough * (2 if low[p] else 1) * min(held)), 0, 1)
        follows = graph.evaluate("deformer.mesh", 6).vertex_fragment
        np.testing.assert_allclose(attribute(shown, "toughness_left"), left[follows], atol=1e-5)
        self.assertGreater(np.abs(left - (1 - np.clip(state.strain / tough, 0, 1))).max(), 0.01)


class Damage(AddonCase):
    def test_damage_is_the_share_of_its_edges_that_a_fragment_has_lost(self):
        tree, _ = self.tree()
        thing, = self.results(tree)
        self.bake(tree)
        self.scene.frame_set(1)
        self.assertEqual(attribute(thing, "damage").max(), 0)
        self.scene.frame_set(6)
        damage = attribute(thing, "damage")
        self.assertTrue(0 <= damage.min() and 0 < damage.max() <= 1)
        reader, write = addon("base.bake_reader"), addon("results.result_mesh")
        state = reader.read_ply(str(self.cached(tree) / "state/solver.0001.ply"))
        edge = state["edge"] = state["edge"].copy()
        edge["intact"][0] = 0
        state["damage"] = np.zeros(len(edge), [("damage", "f8"), ("hold", "f8")])
        state["damage"]["damage"][1] = 0.5
        wanted = np.zeros((len(state["particle"]), 2))
        for a, b, lost in zip(edge["a"], edge["b"], [1, 0.5] + [0] * (len(edge) - 2)):
            for end in (a, b):
                wanted[end] += lost, 1
        np.testing.assert_allclose(write.fragment_damage(state, 0), wanted[:, 0] / wanted[:, 1])


main()
