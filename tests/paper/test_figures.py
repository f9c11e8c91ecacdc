"""The figures of the paper as numbers, through the Python package: real graphs, no shortcuts."""
import os
import sys
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "plugin_src", "python"))
import sunder

DATA = os.path.join(os.path.dirname(__file__), "..", "data")


def pieces(state):
    """Particles of each connected piece, largest first."""
    parent = np.arange(len(state.position))

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for (a, b), intact in zip(state.edges, state.edge_intact):
        if intact:
            parent[root(a)] = root(b)
    _, counts = np.unique([root(i) for i in range(len(parent))], return_counts=True)
    return sorted(counts, reverse=True)


def twisted_bar(**material):
    """Fig. 4: a vertical bar, its foot held, its head turned once in two seconds and let go."""
    return sunder.Graph.from_dict({
        "sunder": 1, "frame_rate": 24, "frame_range": [1, 144],
        "nodes": {
            "bar": {"type": "lattice", "size": [0.2, 0.2, 1.0], "cells": [4, 4, 20], "center": [0, 0, 0.5], "neighbours": 6},
            "body": {"type": "body", "fragments": "@bar.fragments", "density": 1000, "youngs_modulus": 2e6, **material},
            "foot": {"type": "pin", "body": "@body.body", "region": "box", "box_min": [-1, -1, -1], "box_max": [1, 1, 0.1]},
            "head": {"type": "pin", "body": "@body.body", "region": "box", "box_min": [-1, -1, 0.9], "box_max": [1, 1, 2], "pivot": [0, 0, 0.9],
                     "rotation": {"keys": [[1, [0, 0, 0]], [49, [0, 0, 360]]]}, "release_frame": 61},
            "sim": {"type": "solver", "bodies": ["@body.body"], "pins": ["@foot.pin", "@head.pin"], "gravity": [0, 0, 0], "damping": 2.0}}})


def twist_degrees(graph, frame):
    """Turn of the top layer against the bottom one, summed layer by layer."""
    rest, now = graph.evaluate("bar.fragments").rest_position, graph.evaluate("sim.state", frame=frame).position
    total, last = 0.0, 0.0
    for layer in range(20):
        a, b = rest[16 * layer:16 * layer + 16, :2], now[16 * layer:16 * layer + 16, :2]
        b = b - b.mean(axis=0)
        angle = np.degrees(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
        total += (angle - last + 180) % 360 - 180
        last = angle
    return total


class Fig4TwistedBars(unittest.TestCase):
    def test_counts_are_the_papers(self):
        state = twisted_bar().evaluate("sim.state")
        self.assertEqual(len(state.position), 320)
        self.assertEqual(len(state.position) + 2 * len(state.edges), 1888)  # members of groups: the paper's "edges"

    def test_residual_twist_grows_with_plasticity(self):
        twists = []
        for material in ({"yield": None}, {"yield": 0.2, "flow_rate": 1.2}, {"yield": 0.1, "flow_rate": 1.2}, {"yield": 0.05, "flow_rate": 1.2}):
            graph = twisted_bar(**material)
            self.assertAlmostEqual(twist_degrees(graph, 60), 360, delta=0.5)
            twists.append(twist_degrees(graph, 144))
        print("Fig. 4: residual twist, elastic / low / mid / high plasticity:", ", ".join(f"{t:.1f}" for t in twists), "degrees")
        self.assertAlmostEqual(twists[0], 0, delta=1)      # elastic: springs back
        self.assertTrue(10 < twists[1] < twists[2] - 20 < twists[3] - 40, twists)
        self.assertLess(twists[3], 300)                    # and part of it was elastic

    def test_high_plasticity_does_not_depend_on_the_substeps(self):
        twists = []
        for substeps in (4, 8, 16):
            graph = twisted_bar(**{"yield": 0.05, "flow_rate": 1.2})
            graph["sim"]["substeps"] = substeps
            twists.append(twist_degrees(graph, 144))
        self.assertLess(max(twists) - min(twists), 5, twists)


def struck_plate(**material):
    """Fig. 5: a plate of 299 particles, its rim held, and a projectile."""
    graph = sunder.Graph.from_dict({
        "sunder": 1, "frame_rate": 24, "frame_range": [1, 25],
        "nodes": {
            "plate": {"type": "lattice", "size": [1.3, 2.3, 0.1], "cells": [13, 23, 1], "center": [0, 0, 1], "neighbours": 26},
            "body": {"type": "body", "fragments": "@plate.fragments", "density": 1000, "youngs_modulus": 1e6, **{"toughness": 0.1, **material}},
            "ball": {"type": "rigid_body", "shape": "sphere", "radius": 0.15, "mass": 100, "position": [0.03, 0.02, 1.3], "velocity": [0, 0, -12]},
            "sim": {"type": "solver", "bodies": ["@body.body"], "rigid_bodies": ["@ball.rigid_body"]}}})
    rims = {"south": ([-9, -9, -9], [9, -1.05, 9]), "north": ([-9, 1.05, -9], [9, 9, 9])}
    for name, (low, high) in rims.items():
        graph.add("pin", name, body="@body.body", region="box", box_min=low, box_max=high)
        graph.connect(name + ".pin", "sim.pins")
    return graph


class Fig5StruckPlates(unittest.TestCase):
    # Plates that yield between 0.014 and 0.025 break into as many pieces at fine steps (of 64 substeps 55 at 0.025, 53 at
    # 0.018); that they differed was the doing of coarse ones.
    def test_pieces_become_fewer_with_ductility(self):
        counts = []
        for material in ({"yield": None}, {"yield": 0.025, "flow_rate": 60}, {"yield": 0.012, "flow_rate": 110}, {"yield": 0.008, "flow_rate": 130}):
            counts.append(0)
            for place in ([0.03, 0.02, 1.3], [0.22, 0.35, 1.3], [-0.31, -0.18, 1.3], [0.11, -0.42, 1.3],
                          [-0.12, 0.27, 1.3], [0.35, -0.05, 1.3], [-0.22, -0.51, 1.3], [0.05, 0.55, 1.3]):  # a single hit is a matter of luck
                plate = struck_plate(**material)
                plate["ball"].set(position=place)
                state = plate.evaluate("sim.state", frame=25)
                self.assertTrue(np.isfinite(state.position).all())
                counts[-1] += len(pieces(state))
        print("Fig. 5: pieces of eight plates, from brittle to ductile:", counts)
        self.assertGreater(counts[0], counts[-1])
        # What is left to luck in a count is about its root.
        self.assertTrue(all(a + a**0.5 >= b for a, b in zip(counts, counts[1:])), counts)


class Fig6StruckBunnies(unittest.TestCase):
    """The demo shot: 300 pieces each, one brittle, one ductile, a heavy ball on either."""

    @classmethod
    def setUpClass(cls):
        cls.graph = sunder.Graph.load(os.path.join(os.path.dirname(__file__), "..", "scenes", "demo.json"))

    def bunny(self, state, body):
        """Pieces of one bunny, and the plastic deformation of its groups."""
        mine = np.flatnonzero(state.body == body)
        edges = state.body[state.edges[:, 0]] == body

        class Slice:
            position = state.position[mine]
            edge_intact = state.edge_intact[edges]
        Slice.edges = state.edges[edges] - mine[0]
        return pieces(Slice), np.mean(Slice.edge_intact == 0), state.plastic_deformation[mine]

    def test_brittle_breaks_to_chunks_and_ductile_dents_and_tears(self):
        start, state = self.graph.evaluate("sim.state"), self.graph.evaluate("sim.state", frame=24)  # before the balls come down again
        self.assertEqual(len(start.position), 600)
        brittle, _, stored = self.bunny(state, 0)
        np.testing.assert_array_equal(stored, np.broadcast_to(np.eye(3), stored.shape))  # nothing flowed
        ductile, torn, stored = self.bunny(state, 1)
        dents = np.median([np.linalg.cond(f) for f in stored])
        print(f"Fig. 6: {len(start.edges) // 2} edges a bunny; brittle {len(brittle)} pieces, ductile {len(ductile)}, largest "
              f"{brittle[:2]} and {ductile[:2]}, {torn:.2f} of its edges torn, plastic stretch ratio {dents:.2f}")
        self.assertGreater(len(brittle), 1.5 * len(ductile))
        self.assertGreater(torn, 0.1)
        self.assertGreater(dents, 1.2)

    def test_the_mesh_is_the_bunny_until_it_tears_and_closed_after(self):
        source = self.graph.evaluate("pieces.fragments")
        first, torn = (self.graph.evaluate("ductile_skin.mesh", frame=f) for f in (1, 40))
        self.assertEqual(set(first.face_material), {0})       # nothing of the inside shows
        self.assertIn(1, set(torn.face_material))
        for mesh in (first, torn):
            a = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]]).astype(np.int64)
            key, back = (a[:, 0] << 32) | a[:, 1], (a[:, 1] << 32) | a[:, 0]
            np.testing.assert_array_equal(np.sort(key), np.sort(back))  # every edge has its opposite: no leak
        corners = first.positions[first.triangles].astype(np.float64)
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        self.assertAlmostEqual(volume / source.volume.sum(), 1, delta=1e-4)


class Section33FallenBody(unittest.TestCase):
    def test_it_comes_to_rest_and_does_not_keep_turning(self):
        graph = sunder.Graph.from_dict({
            "sunder": 1, "frame_rate": 24, "frame_range": [1, 240],
            "nodes": {
                "block": {"type": "lattice", "size": [0.4, 0.3, 0.2], "cells": [5, 4, 3], "neighbours": 18},
                "body": {"type": "body", "fragments": "@block.fragments", "position": [0, 0, 0.6], "rotation": [20, 10, 0], "youngs_modulus": 5e5},
                "floor": {"type": "collider", "shape": "plane"},
                "sim": {"type": "solver", "bodies": ["@body.body"], "colliders": ["@floor.collider"]}}})
        late, end = graph.evaluate("sim.state", frame=192), graph.evaluate("sim.state", frame=240)
        self.assertLess(np.linalg.norm(end.velocity, axis=1).max(), 1e-3)
        self.assertLess(np.linalg.norm(end.angular_velocity, axis=1).max(), 1e-3)
        self.assertLess(np.linalg.norm(end.position - late.position, axis=1).max(), 1e-3)  # a millimetre in two seconds


if __name__ == "__main__":
    unittest.main(verbosity=2)
