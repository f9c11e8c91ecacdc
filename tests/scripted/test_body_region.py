"""Factors on a body's material in a part of it, which may change with time."""
import numpy as np
import pytest

import sunder as package
from conftest import contents

UPPER = {"region": "box", "box_min": [-1, -1, 0.6], "box_max": [1, 1, 2]}


def pulled(*regions, frames=(1, 20), speed=0.005, **body):
    """A strip of twelve cubes, its foot held, its head pulled up by so much a frame."""
    nodes = {"cut": {"type": "lattice", "size": [0.1, 0.1, 1.2], "cells": [1, 1, 12], "center": [0, 0, 0.6]},
             "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e6, "fracture_energy": None, **body},
             "foot": {"type": "pin", "body": "@body.body", "box_min": [-1, -1, -1], "box_max": [1, 1, 0.1]},
             "head": {"type": "pin", "body": "@body.body", "box_min": [-1, -1, 1.1], "box_max": [1, 1, 2],
                      "position": {"keys": [[1, [0, 0, 0]], [101, [0, 0, 100 * speed]]]}}}
    last = "@body.body"
    for k, region in enumerate(regions):
        nodes[f"it{k}"] = {"type": "body_region", "body": last, **region}
        last = f"@it{k}.body"
    nodes["sim"] = {"type": "solver", "bodies": [last], "pins": ["@foot.pin", "@head.pin"], "gravity": [0, 0, 0], "error_budget": 0.01}
    nodes["cache"] = {"type": "bake_state", "state": "@sim.state", "path": "sim.####.ply"}
    return {"sunder": 2, "frame_rate": 24, "frame_range": list(frames), "nodes": nodes}


def states(graph, *frames):
    graph = package.Graph.from_dict(graph)
    return [graph.evaluate("sim.state", frame=frame) for frame in frames]


def strain(state, low, high):
    z, rest = state.position[:, 2], state.rest_position[:, 2]
    some = (rest > low) & (rest < high)
    return np.polyfit(rest[some], z[some], 1)[0] - 1


def test_a_soft_half_stretches_as_much_more_as_it_is_softer_until_its_key():
    keys = {"keys": [[1, 0.25], [12, 0.25], [13, 1]]}
    graph = pulled({**UPPER, "stiffness": keys})
    soft, even = states(graph, 12, 40)
    assert strain(soft, 0.7, 1.05) / strain(soft, 0.15, 0.5) == pytest.approx(4, rel=0.1)
    assert strain(even, 0.7, 1.05) / strain(even, 0.15, 0.5) == pytest.approx(1, rel=0.02)


def test_what_turns_brittle_breaks_there_and_not_before():
    keys = {"keys": [[1, 1], [12, 1], [13, 0.1]]}
    before, after, plain = *states(pulled({**UPPER, "toughness": keys}, toughness=0.1), 12, 13), *states(pulled(toughness=0.1), 13)
    assert before.edge_intact.all() and before.strain.max() > 0.03 and plain.edge_intact.all()
    broken = after.edges[after.edge_intact == 0]
    assert len(broken) > 0 and (after.rest_position[broken][..., 2].mean(axis=1) > 0.55).all()
    assert np.allclose(after.broken_toughness, 0.01, rtol=0.6)  # at the border between the two


def test_yields_follow_their_keys_and_keep_what_they_hardened_by():
    keys = {"keys": [[1, 0.5], [8, 0.5], [9, 2]]}
    soft = {"yield": 0.02, "hardening": 0.5, "flow_rate": 200}
    start, before, after = states(pulled({**UPPER, "yield": keys}, **soft), 1, 8, 9)
    upper = start.rest_position[:, 2] > 0.6
    assert np.allclose(start.yield_, np.where(upper, 0.01, 0.02), rtol=1e-12)
    hardened = before.yield_ / np.where(upper, 0.01, 0.02)
    assert hardened[upper].max() > 1.01
    assert np.allclose(after.yield_[upper], 4 * before.yield_[upper], rtol=0.02)  # and hardly any flow, so high
    assert (after.yield_[upper] >= 4 * before.yield_[upper] - 1e-12).all()


def test_factors_multiply_where_regions_overlap():
    middle = {"region": "box", "box_min": [-1, -1, 0.4], "box_max": [1, 1, 0.8], "yield": 3}
    state, = states(pulled({**UPPER, "yield": 0.5}, middle, **{"yield": 0.1}), 1)
    z = state.rest_position[:, 2]
    wanted = 0.1 * np.where(z > 0.6, 0.5, 1) * np.where((z > 0.4) & (z < 0.8), 3, 1)
    assert np.allclose(state.yield_, wanted, rtol=1e-12)


def test_factors_of_one_change_no_bit():
    soft = {"yield": 0.02, "hardening": 0.5, "toughness": 0.03, "fracture_energy": 20}
    plain, same = states(pulled(**soft), 15)[0], states(pulled(UPPER, **soft), 15)[0]
    assert not plain.edge_intact.all()
    for name in ("position", "velocity", "yield_", "edge_intact", "edge_damage", "plastic_deformation"):
        assert getattr(plain, name).tobytes() == getattr(same, name).tobytes(), name


def same_bits(one, other):
    return all(getattr(one, name).tobytes() == getattr(other, name).tobytes()
               for name in ("position", "velocity", "edge_intact", "edge_damage", "broken_time"))


def test_of_an_automatic_fracture_energy_the_length_stays():
    """A region of all is the body with these numbers; halves and doubles round nothing."""
    auto = {"fracture_energy": "auto", "damping_time": 0.002}
    half, soft = (states(pulled({"region": "all", **factors}, toughness=0.06, **auto), 12)[0]
                  for factors in ({"toughness": 0.5}, {"stiffness": 0.5}))
    body = states(pulled(toughness=0.03, **auto), 12)[0]
    softer = states(pulled(toughness=0.06, **{**auto, "youngs_modulus": 5e5}), 12)[0]
    assert half.edge_damage.max() > 0.1 and same_bits(half, body) and same_bits(soft, softer)


def test_a_given_fracture_energy_has_a_factor_of_its_own():
    given = {"toughness": 0.03, "fracture_energy": 40}
    less, weaker = (states(pulled({"region": "all", **factors}, **given), 12)[0]
                    for factors in ({"fracture_energy": 0.25}, {"toughness": 0.5}))
    assert less.edge_damage.max() > 0.1 and same_bits(less, states(pulled(toughness=0.03, fracture_energy=10), 12)[0])
    assert same_bits(weaker, states(pulled(toughness=0.015, fracture_energy=40), 12)[0])
    never, = states(pulled({"region": "all", "fracture_energy": 0.01}, toughness=0.03), 12)
    assert len(never.edge_damage) == 0 and not never.edge_intact.all()  # null stays null


def test_what_rots_takes_less_energy_from_its_key_on():
    """L is 2 m at first, twenty edges: they fade from a strain of 0.02 on, and would be parted at 0.42."""
    keys = {"keys": [[1, 1], [12, 1], [13, 0.01]]}
    before, after = states(pulled({**UPPER, "fracture_energy": keys}, toughness=0.02, fracture_energy=400), 12, 13)
    assert before.edge_intact.all() and before.edge_damage.max() > 0.1
    broken = after.edges[after.edge_intact == 0]
    assert len(broken) > 0 and (after.rest_position[broken][..., 2].max(axis=1) > 0.6).all()


def test_a_seam_that_weakens_parts_before_its_end():
    """A strip drawn by 0.05 m and held so, its edges of 0.1 m with L 2 m. All of that drawn out of one edge is a strain of 0.5, at
    which it parts where its toughness has fallen to 0.5 / (1 + L / d0) = 0.024 of 0.1: at frame 25 or 26 of 10 to 30. It begins to
    fade at 0.045 of 0.1: at frame 21."""
    graph = pulled(toughness=0.1, fracture_energy=1e4)
    graph["nodes"]["head"]["position"] = {"keys": [[1, [0, 0, 0]], [6, [0, 0, 0.05]]]}
    graph["nodes"]["seam"] = {"type": "seam", "body": "@body.body", "between": "curve", "points": [[0, 0, 0.6]], "distance": 0.01,
                              "frame": 10, "frames": 20}
    graph["nodes"]["sim"]["bodies"] = ["@seam.body"]
    graph = package.Graph.from_dict(graph)
    seam, = np.flatnonzero(graph.evaluate("sim.state", frame=10).rest_position[:, 2] < 0.6)[-1:]
    parted = next(frame for frame in range(10, 40) if not graph.evaluate("sim.state", frame=frame).edge_intact.all())
    damage = [graph.evaluate("sim.state", frame=frame).edge_damage for frame in (19, 23)]
    assert not damage[0].any() and np.flatnonzero(damage[1]).tolist() == [seam]
    assert 24 <= parted <= 27
    broken = graph.evaluate("sim.state", frame=parted)
    assert broken.edges[broken.edge_intact == 0].tolist() == [[seam, seam + 1]]


def test_keys_cut_nothing_anew():
    graph = package.Graph.from_dict(pulled({**UPPER, "toughness": 1}))
    graph.evaluate("sim.state", frame=2)
    rest = graph.evaluate("it0.body", frame=2).rest_position
    graph["it0"]["toughness"] = {"keys": [[1, 1], [5, 0.5]]}
    graph.evaluate("sim.state", frame=6)
    assert np.shares_memory(rest, graph.evaluate("it0.body", frame=6).rest_position)


def test_a_region_without_fragments_is_refused():
    with pytest.raises(package.Error, match="no fragment of body 'body' lies in it") as caught:
        states(pulled({"region": "sphere", "center": [5, 5, 5]}), 2)
    assert caught.value.node == "it0"


def test_resumed_it_has_the_same_bits(sunder, scene, tmp_path):
    keyed = {name: {"keys": [[1, 1], [12, 0.3]]} for name in ("toughness", "yield", "stiffness")}
    scene(pulled({**UPPER, **keyed}, frames=(1, 16), toughness=0.1, **{"yield": 0.03}))
    for folder, frames in (("whole", ["1:16"]), ("parts", ["1:4", "1:9", "1:16"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")
    assert package.report(tmp_path / "whole")["broken"] > 0
