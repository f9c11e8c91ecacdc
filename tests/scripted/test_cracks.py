"""A ball that falls on a floor breaks into wedges and chunks where it has a fracture energy, else to crumbs."""
import numpy as np
import pytest

import sunder

SPEED, DENSITY, STIFFNESS = 10.0, 2000.0, 1e8


def write_ball(path, subdivisions=3, radius=0.5):
    """A sphere of triangles, from an icosahedron."""
    t = (1 + 5**0.5) / 2
    points = [np.array(p) / np.linalg.norm(p) for p in
              [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
               (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
             (8, 6, 7), (9, 8, 1)]
    for _ in range(subdivisions):
        middles, finer = {}, []
        for a, b, c in faces:
            mids = []
            for i, j in ((a, b), (b, c), (c, a)):
                key = min(i, j), max(i, j)
                if key not in middles:
                    middle = points[i] + points[j]
                    points.append(middle / np.linalg.norm(middle))
                    middles[key] = len(points) - 1
                mids.append(middles[key])
            x, y, z = mids
            finer += [(a, x, z), (b, y, x), (c, z, y), (x, y, z)]
        faces = finer
    lines = ["v %.9f %.9f %.9f" % tuple(radius * p) for p in points]
    path.write_text("\n".join(lines + ["f %d %d %d" % (a + 1, b + 1, c + 1) for a, b, c in faces]) + "\n")


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("ball") / "ball.obj"
    write_ball(path)
    return path


def shares(ball, load, fracture_energy):
    """Of the mass: in the largest piece, in others of 2 % and more, in single fragments; and damage of edges.

    `load`: the strain of the hit over the toughness."""
    toughness = SPEED / ((STIFFNESS / DENSITY) ** 0.5 * load)
    graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 16], "nodes": {
        "mesh": {"type": "mesh_file", "path": str(ball)},
        "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": 300, "clusters": 0},
        "body": {"type": "body", "fragments": "@cut.fragments", "density": DENSITY, "youngs_modulus": STIFFNESS,
                 "poisson_ratio": 0.2, "toughness": toughness, "fracture_energy": fracture_energy,
                 "position": [0, 0, 0.52], "velocity": [0, 0, -SPEED]},
        "floor": {"type": "collider", "shape": "plane"},
        "solver": {"type": "solver", "preset": "final", "bodies": ["@body.body"], "colliders": ["@floor.collider"]}}})
    state = graph.evaluate("solver.state", frame=16)
    piece = np.asarray(state.piece)[:len(state.mass)]
    counts = np.bincount(piece)
    mass = np.sort(np.bincount(piece, state.mass)) / np.sum(state.mass)
    alone = np.sum(np.asarray(state.mass)[counts[piece] == 1]) / np.sum(state.mass)
    return mass[-1], np.sum(mass[:-1][mass[:-1] >= 0.02]), alone, state.edge_damage


@pytest.mark.parametrize("load", [12.5, 14])
def test_with_a_fracture_energy_most_of_a_ball_is_in_large_pieces(ball, load):
    largest, others, alone, damage = shares(ball, load, "auto")
    assert largest < 0.9 and largest + others > 0.7
    assert alone < 0.2
    assert 0 < np.mean(damage > 0.5) < 1


def test_without_one_most_of_it_is_crumbs(ball):
    largest, others, alone, damage = shares(ball, 6, None)
    assert alone > 0.5 and others < 0.15
    assert len(damage) == 0


def test_a_small_hit_breaks_nothing(ball):
    largest, others, alone, damage = shares(ball, 2, "auto")
    assert largest > 0.999 and np.max(damage) < 0.05
