"""What settles is at rest under its weight at the first frame; what would break is told; bakes go on to the same bits."""
import numpy as np
import pytest

import sunder as package
from conftest import contents


def shot(**body):
    """A plank that sticks out of a wall, and a ball that waits above it."""
    return {"sunder": 2, "frame_rate": 24, "frame_range": [1, 8], "nodes": {
        "cut": {"type": "lattice", "size": [1.2, 0.2, 0.2], "cells": [12, 2, 2], "neighbours": 26},
        "plank": {"type": "body", "fragments": "@cut.fragments", "density": 2000, "youngs_modulus": 1e7, **body},
        "wall": {"type": "pin", "body": "@plank.body", "region": "box", "box_min": [-1, -1, -1], "box_max": [-0.5, 1, 1]},
        "ball": {"type": "rigid_body", "radius": 0.1, "position": [0.5, 0, 2], "velocity": [0, 0, -1]},
        "solver": {"type": "solver", "bodies": ["@plank.body"], "rigid_bodies": ["@ball.rigid_body"], "pins": ["@wall.pin"]},
        "cache": {"type": "bake_state", "state": "@solver.state", "path": "sim.####.ply"}}}


def states(*frames, **body):
    graph = package.Graph.from_dict(shot(**body))
    return [graph.evaluate("solver.state", frame=frame) for frame in frames]


def farthest(a, b):
    return np.linalg.norm(a.position - b.position, axis=1).max()


def test_it_hangs_from_the_first_frame_on():
    loose, = states(1)
    first, last = states(1, 8, settle=True)
    sag = farthest(first, loose)
    assert sag > 0.01 and first.warnings == []
    assert farthest(first, last) < 2 * 0.04 * sag  # at rest is accelerated by less than 0.04 of a fall: it swings about that
    assert np.array_equal(first.rigid_velocity, loose.rigid_velocity)
    assert np.array_equal(first.rigid_position, loose.rigid_position)


def test_what_its_weight_would_break_is_told_and_broken_no_sooner_than_the_shot():
    first, last = states(1, 4, settle=True, toughness=0.003, fracture_energy=None)
    told, = first.warnings
    assert "body 'plank'" in told and "break under the weight" in told
    assert (first.edge_intact == 1).all() and (last.edge_intact == 0).any()


def test_what_falls_for_ever_is_told():
    graph = package.Graph.from_dict(shot(settle=True))
    graph["solver"]["pins"] = []
    told, = graph.evaluate("solver.state", frame=1).warnings
    assert "body 'plank' still moves" in told


def test_an_edit_of_what_it_settled_under_settles_anew():
    graph = package.Graph.from_dict(shot(settle=True))
    first = graph.evaluate("solver.state", frame=1)
    graph["solver"]["gravity"] = [0, 0, -3]
    lighter = graph.evaluate("solver.state", frame=1)
    assert lighter.position[:, 2].min() > first.position[:, 2].min() + 0.005


@pytest.mark.parametrize("settle", [True, False])
def test_resumed_it_has_the_same_bits(sunder, scene, tmp_path, settle):
    scene(shot(settle=settle))
    for folder, frames in (("whole", ["1:8"]), ("parts", ["1:1", "1:3", "1:8"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")
