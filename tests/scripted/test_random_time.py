"""Shots of any kind whose time runs in any way: what lies between simulated frames, and how bakes of it resume."""
import random

import numpy as np
import pytest

import sunder as package
from conftest import contents
from test_time import same

RATE = 24.0


def random_scale(draw, start):
    kind = draw.randrange(4)
    if kind == 0:
        return draw.choice([0, 0.1, 1 / 7, 1 / 3, 0.5, 1, 2, draw.uniform(0.05, 2)])
    if kind == 1:
        return 1
    frames = sorted(draw.sample(range(start - 2, start + 16), draw.randrange(1, 5)))
    keys = [[f + draw.choice([0, 0, 0.5]), draw.choice([0, 1 / 7, 1 / 3, 1, 2, draw.uniform(0, 2)])] for f in frames]
    return {"keys": keys, "interpolation": draw.choice(["linear", "step"])}


def random_shot(seed):
    """A block that is thrown at the floor or hit by a ball, stiff or soft, tough or not."""
    draw = random.Random(seed)
    start, last = draw.choice([0, -3, 1, 1001]), draw.randrange(6, 11)
    any_of = lambda most: [draw.uniform(-most, most) for _ in range(3)]  # noqa: E731
    return {"sunder": 2, "frame_rate": draw.choice([RATE, [24000, 1001], 30]), "frame_range": [start, start + last], "nodes": {
        "block": {"type": "lattice", "size": [0.3, 0.2, 0.2], "cells": [draw.randrange(1, 4) for _ in range(3)],
                  "center": [0, 0, draw.uniform(0.16, 0.6)]},
        "clay": {"type": "body", "fragments": "@block.fragments", "youngs_modulus": 10 ** draw.uniform(5, 9),
                 "yield": draw.choice([None, 0.02]), "toughness": draw.choice([None, 0.005, 0.05]), "velocity": any_of(4),
                 "angular_velocity": any_of(draw.choice([0, 300, 3000]))},
        "ball": {"type": "rigid_body", "shape": "sphere", "radius": 0.08, "mass": 3, "position": [0.4, 0, draw.uniform(0.1, 0.6)],
                 "velocity": [draw.uniform(-20, 0), 0, 0]},
        "floor": {"type": "collider", "shape": "plane"},
        "sim": {"type": "solver", "bodies": ["@clay.body"], "rigid_bodies": ["@ball.rigid_body"], "colliders": ["@floor.collider"],
                "substeps": draw.choice([2, 4, 8]), "time_scale": random_scale(draw, start),
                "accelerations": draw.random() < 0.5},
        "skin": {"type": "deformer", "body": "@clay.body", "state": "@sim.state", "topology": draw.choice(["constant", "compact"])},
        "out": {"type": "bake_mesh", "mesh": "@skin.mesh", "subframes": draw.choice([1, 2, 3, 5])},
        "cache": {"type": "bake_state", "state": "@sim.state", "subframes": draw.choice([1, 2])}}}


def plain_of(graph):
    nodes = {name: dict(fields) for name, fields in graph["nodes"].items()}
    nodes["sim"].update(time_scale=1, accelerations=False)
    nodes["skin"]["topology"] = "constant"
    return package.Graph.from_dict({**graph, "nodes": nodes})


def shown_frames(graph):
    first, last = graph["frame_range"]
    return [f + i / n for n in [graph["nodes"]["out"]["subframes"]] for f in range(first, last) for i in range(n)] + [last]


def means(values, state):
    """Of each particle's piece as the state has it, by mass (n, 3)."""
    of_piece = {p: np.average(values[state.piece == p], axis=0, weights=state.mass[state.piece == p]) for p in set(state.piece)}
    return np.stack([of_piece[p] for p in state.piece])


def box(a, b, x_a, x_b, follows, slack=0.0):
    """Between what lies at x_a (n, 3) in one state and at x_b in the next, and follows these particles: a box about both, larger
    by how far the way may lie beside the straight one. That is by its piece's parabola, an eighth of the change of velocity, and by
    the arm's turn about the piece's centre, 1 - cos of half its angle, or, beyond half a turn, across the whole circle."""
    seconds = b.time - a.time
    v_a, v_b, w_a, w_b = (means(getattr(s, name), b)[follows] for name in ("velocity", "angular_velocity") for s in (a, b))
    arm = np.maximum(*(np.linalg.norm(x - means(s.position, b)[follows], axis=1) for s, x in ((a, x_a), (b, x_b))))
    angle = seconds * np.maximum(np.linalg.norm(w_a, axis=1), np.linalg.norm(w_b, axis=1)) + 0.2  # a spin is not its turn
    around = np.where(angle < np.pi, 1 - np.cos(angle / 2), 2)
    beside = (np.linalg.norm(v_b - v_a, axis=1) * seconds / 8 + around * arm + slack)[:, None]
    return np.minimum(x_a, x_b) - beside, np.maximum(x_a, x_b) + beside


SEEDS = range(16)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_shown_lies_where_it_must(seed):
    graph = random_shot(seed)
    shot, plain = package.Graph.from_dict(graph), plain_of(graph)
    start = graph["frame_range"][0]
    n_between = 0
    for frame in shown_frames(graph):
        state, mesh = shot.evaluate_all(["sim.state", "skin.mesh"], frame)
        at = state.simulated_frame
        assert start <= at and state.frame == frame
        for name in ("position", "orientation", "velocity", "angular_velocity", "plastic_deformation", "rigid_position"):
            assert np.isfinite(getattr(state, name)).all()
        for values in (mesh.positions, mesh.velocities, mesh.normals, mesh.accelerations):
            assert np.isfinite(values).all()
        assert len(mesh.accelerations) == (len(mesh.positions) if graph["nodes"]["sim"]["accelerations"] else 0)
        a, b = plain.evaluate("sim.state", int(np.floor(at))), plain.evaluate("sim.state", int(np.ceil(at)))
        if a.frame == b.frame:
            assert same(state, a)
            continue
        n_between += 1
        assert a.time < state.time < b.time
        low, high = box(a, b, a.position, b.position, np.arange(len(a.position)), 1e-9)
        assert (state.position >= low).all() and (state.position <= high).all()
        if graph["nodes"]["skin"]["topology"] == "constant":
            check_vertices(plain, a, b, mesh)
    if graph["nodes"]["sim"]["time_scale"] == 1:
        steps = graph["nodes"]["out"]["subframes"]
        assert n_between == (graph["frame_range"][1] - start) * (steps - 1)


def check_vertices(plain, a, b, mesh):
    """Of a frame in which nothing breaks, so that vertices follow the same particles. They lie off them by a fragment's size at
    most, 0.3 m: of that a twentieth is left for strains, which are blended before they are skinned."""
    if (a.edge_intact != b.edge_intact).any():
        return
    before, after = (plain.evaluate("skin.mesh", s.frame).positions for s in (a, b))
    low, high = box(a, b, before, after, mesh.vertex_fragment, 0.05 * 0.3)
    assert (mesh.positions >= low).all() and (mesh.positions <= high).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_bakes_resume_after_any_frame_to_the_same_bits(seed, tmp_path):
    graph, draw = random_shot(seed), random.Random(1000 + seed)
    first, last = graph["frame_range"]
    package.Graph.from_dict(graph).bake(tmp_path / "whole")
    for end in [*sorted(draw.sample(range(first, last), 3)), last]:
        package.Graph.from_dict(graph).bake(tmp_path / "parts", frames=(first, end), resume=True)
    assert package.verify(tmp_path / "parts")["faults"] == []
    whole, parts = contents(tmp_path / "whole"), contents(tmp_path / "parts")
    assert {n: d for n, d in whole.items() if n != "manifest.json"} == {n: d for n, d in parts.items() if n != "manifest.json"}
