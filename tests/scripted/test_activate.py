"""Fragments wait until a frame, an object, a touch or a break; seams break at their frame; bakes go on to the same bits."""
import numpy as np
import pytest

import sunder as package
from conftest import contents


def shot(*between, body=None, rigid=None, solver=None):
    """A wall of cubes, with what comes between it and its solver."""
    cut = {"type": "lattice", "size": [0.8, 0.1, 0.8], "cells": [8, 1, 8], "center": [0, 0, 0.5]}
    nodes = {"cut": cut, "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e6, **(body or {})}}
    last = "@body.body"
    for k, (node_type, given) in enumerate(between):
        nodes[f"it{k}"] = {"type": node_type, "body": last, **given}
        last = f"@it{k}.body"
    nodes["ball"] = {"type": "collider", "shape": "sphere", "radius": 0.12,
                     "position": {"keys": [[1, [-0.9, 0, 0.45]], [13, [0.3, 0, 0.45]]]}}
    nodes["solver"] = {"type": "solver", "bodies": [last], **(solver or {})}
    if rigid:
        nodes["weight"] = {"type": "rigid_body", "radius": 0.1, **rigid}
        nodes["solver"]["rigid_bodies"] = ["@weight.rigid_body"]
    nodes["cache"] = {"type": "bake_state", "state": "@solver.state", "path": "sim.####.ply"}
    return {"sunder": 2, "frame_rate": 24, "frame_range": [1, 14], "nodes": nodes}


def states(graph, *frames):
    graph = package.Graph.from_dict(graph)
    return [graph.evaluate("solver.state", frame=frame) for frame in frames]


def moved(state):
    return (state.position != state.rest_position).any(axis=1)


def test_a_sphere_wakes_what_it_touches_in_that_frame_and_nothing_else():
    hangs_on_nothing = {"region": "all", "until": "object", "object": "@ball.collider"}
    graph = package.Graph.from_dict(shot(("activate", hangs_on_nothing), ("seam", {"between": "all"})))
    touched = np.zeros(64, bool)
    for frame in range(1, 13):
        state = graph.evaluate("solver.state", frame=frame)
        centers = state.rest_position
        for share in np.linspace(0, 1, 200) if frame > 1 else ():
            ball = np.array([-0.9 + 0.1 * (frame - 2 + share), 0, 0.45])
            away = np.maximum(np.abs(centers - ball) - 0.05, 0)
            touched |= np.linalg.norm(away, axis=1) < 0.12
        assert np.array_equal(state.kept == 0, touched), frame
        assert np.array_equal(moved(state), touched), frame
    assert 10 < touched.sum() < 40


def test_a_block_lets_go_at_its_frame_and_falls_from_standstill():
    six, seven = states(shot(("activate", {"frame": 7}), body={"velocity": [3, 0, 0]}), 6, 7)
    assert not moved(six).any() and not six.velocity.any() and (six.kept == 1).all()
    assert moved(seven).all() and not seven.kept.any()
    assert np.allclose(seven.velocity, [0, 0, -9.81 / 24], atol=1e-9)


@pytest.mark.parametrize("impulse,lets_go", [(0, True), (7, True), (9, False)])
def test_a_hit_lets_go_above_its_impulse_and_not_below(impulse, lets_go):
    hit = {"position": [0.05, -0.5, 0.55], "velocity": [0, 4, 0], "mass": 2}  # the middle of a cube
    wait = ("activate", {"until": "contact", "impulse": impulse})
    state, = states(shot(wait, rigid=hit, solver={"gravity": [0, 0, 0]}), 10)
    assert (state.kept == 0).any() == lets_go


def test_asleep_wakes_as_a_whole_and_all_momentum_is_there():
    hit = {"position": [0.05, -0.5, 0.55], "velocity": [0, 4, 0], "mass": 2}
    first, last = states(shot(("activate", {"mode": "asleep", "frame": 99}), rigid=hit, solver={"gravity": [0, 0, 0]}), 2, 10)
    assert first.asleep[:64].all() and not last.asleep.any() and not last.kept.any()
    momentum = (last.mass[:, None] * last.velocity).sum(axis=0) + 2 * last.rigid_velocity[0]
    assert np.allclose(momentum, [0, 8, 0], atol=1e-7)


def test_a_seam_breaks_all_its_edges_at_its_frame_and_no_other():
    line = {"between": "curve", "points": [[0, 0, 0], [0, 0, 1]], "distance": 0.04, "frame": 12}
    before, at, after = states(shot(("seam", line)), 11, 12, 13)
    middle = before.rest_position[before.edges].mean(axis=1)
    wanted = np.flatnonzero(np.abs(middle[:, 0]) < 0.04)
    assert len(wanted) == 8 and before.edge_intact.all()
    assert np.array_equal(np.sort(at.broken_edge), wanted)
    assert np.array_equal(np.flatnonzero(after.edge_intact == 0), wanted)


@pytest.mark.parametrize("effort", [{"substeps": 1}, {"substeps": 4}, {"error_budget": 0.1}])
def test_what_waits_beside_a_seam_goes_in_the_frame_in_which_it_is_cut(effort):
    waits = ("activate", {"mode": "held", "until": "neighbour"})
    cut = ("seam", {"between": "box", "box_min": [-0.05, -1, -1], "box_max": [0.05, 1, 2], "frame": 5})
    row = shot(waits, cut, solver=effort)
    row["nodes"]["cut"] = {"type": "lattice", "size": [0.6, 0.1, 0.1], "cells": [6, 1, 1], "center": [0, 0, 1]}
    four, five = states(row, 4, 5)
    assert four.edge_intact.all() and four.kept.all()
    assert five.edge_intact.tolist() == [1, 1, 0, 1, 1] and five.kept.tolist() == [1, 0, 0, 0, 0, 1]
    assert (five.position[1:-1, 2] < 1).all()


def test_a_report_names_the_seam(sunder, scene, tmp_path):
    scene(shot(("seam", {"between": "curve", "points": [[0, 0, 0], [0, 0, 1]], "distance": 0.04, "frame": 5})))
    assert sunder("bake", "scene.json", "-o", "shot", "--frames", "1:6").status == 0
    told = package.report(tmp_path / "shot")
    assert {(b["by_kind"], b["by"], b["frame"]) for b in told["breaks"]} == {("seam", "it0", 5)} and told["broken"] == 8
    first, row = [line for line in sunder("report", "shot").out.splitlines() if "seam it0" in line]
    assert first.endswith(", told to by seam it0") and row.split()[:3] == ["5", f"{3 / 24:.4f}", "8"]


def test_a_report_knows_what_glue_and_seams_make_of_toughness(sunder, scene, tmp_path):
    half = {"region": "box", "box_min": [-1, -1, -1], "box_max": [0, 1, 1]}
    scene(shot(("activate", {**half, "mode": "glued", "frame": 99}), ("seam", {"between": "all", "frame": 1, "frames": 100}),
               body={"toughness": 0.02, "fracture_energy": None, "velocity": [0, 0, 1]}))
    assert sunder("bake", "scene.json", "-o", "shot", "--frames", "1:6").status == 0
    rows = package.report(tmp_path / "shot", fragments="all")["fragments"]
    glued = [r for r in rows if r["position"][0] < 0]
    assert len(glued) == 32 and all(r["toughness"] is None and r["share"] == 0 for r in glued)
    free = [r for r in rows if r["position"][0] > 0.11]  # not beside glue
    assert len(free) == 24 and all(0.019 <= r["toughness"] <= 0.02 + 1e-12 for r in free)


def test_glue_holds_until_its_frame():
    weak = {"toughness": 0.001, "fracture_energy": None}
    pinned = shot(("activate", {"region": "box", "box_min": [-1, -1, 0.8], "box_max": [1, 1, 1], "frame": 99}),
                  ("activate", {"mode": "glued", "frame": 8}), body={**weak, "youngs_modulus": 5e4})
    before, after = states(pinned, 7, 10)
    assert before.edge_intact.all() and before.strain.max() > 0.01
    assert (after.edge_intact == 0).any()


def test_the_later_of_two_counts():
    early, late = ("activate", {"frame": 3}), ("activate", {"frame": 9, "region": "box", "box_min": [0, -1, 0], "box_max": [1, 1, 1]})
    for order, half in (((early, late), 32), ((late, early), 0)):
        graph = shot(*order, ("seam", {"between": "all"}))
        state, = states(graph, 5)
        assert (state.kept != 0).sum() == half


def test_what_is_wrong_is_told_of_its_node():
    graph = package.Graph.from_dict(shot(("activate", {"region": "group", "group": "Hand"})))
    with pytest.raises(package.Error, match="no vertex group 'Hand'") as caught:
        graph.evaluate("solver.state", frame=1)
    assert "it0" in str(caught.value)
    with pytest.raises(package.Error, match="is not wired"):
        states(shot(("activate", {"until": "object"})), 1)
    nothing, = states(shot(("activate", {"region": "box", "box_min": [5, 5, 5], "box_max": [6, 6, 6]})), 1)
    told, = nothing.warnings
    assert "'it0' keeps nothing" in told and "body 'body'" in told
    told, = states(shot(("seam", {"between": "clusters"})), 1)[0].warnings
    assert "'it0' has no interface" in told


def test_it_holds_what_a_pin_lets_go_and_says_so():
    graph = shot(("activate", {"frame": 9}))
    graph["nodes"]["pin"] = {"type": "pin", "body": "@body.body", "box_min": [-1, -1, 0.8], "release_frame": 4}
    graph["nodes"]["solver"]["pins"] = ["@pin.pin"]
    held, gone = states(graph, 8, 9)
    assert not moved(held).any() and moved(gone).all()
    told, = held.warnings
    assert "'it0' holds 8 fragments that pin 'pin' lets go" in told


@pytest.mark.parametrize("between", [
    [("activate", {"until": "object", "object": "@ball.collider", "delay": 1, "growth": 2})],
    [("activate", {"until": "contact", "impulse": 1}), ("activate", {"mode": "glued", "until": "neighbour"})],
    [("activate", {"mode": "asleep", "frame": 6}), ("seam", {"between": "curve", "points": [[0, 0, 0.5]], "distance": 0.3, "frame": 4,
                                                            "frames": 6})],
])
def test_resumed_it_has_the_same_bits(sunder, scene, tmp_path, between):
    hit = {"position": [0.05, -0.5, 0.55], "velocity": [0, 4, 0], "mass": 2}
    scene(shot(*between, rigid=hit, body={"toughness": 0.01}))
    for folder, frames in (("whole", ["1:14"]), ("parts", ["1:1", "1:4", "1:8", "1:14"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")


def test_what_keeps_nothing_changes_no_bit():
    hit = {"position": [0.05, -0.5, 0.55], "velocity": [0, 4, 0], "mass": 2}
    nowhere = ("activate", {"region": "box", "box_min": [5, 5, 5], "box_max": [6, 6, 6], "mode": "glued"})
    whole = ("seam", {"between": "all", "mode": "hold", "frame": 1})  # it has let go before the first frame
    plain, same = (states(shot(*between, rigid=hit, body={"toughness": 0.01}), 12)[0] for between in ((), (nowhere, whole)))
    assert not plain.edge_intact.all()
    for name in ("position", "orientation", "velocity", "strain", "edge_intact", "edge_damage", "rigid_velocity"):
        assert getattr(plain, name).tobytes() == getattr(same, name).tobytes(), name


def test_a_body_that_comes_before_and_behind_its_node_is_refused():
    graph = shot(("activate", {"frame": 9}))
    graph["nodes"]["solver"]["bodies"] = ["@body.body", "@it0.body"]
    with pytest.raises(package.Error, match="body 'body' comes by two wires") as caught:
        states(graph, 1)
    assert (caught.value.node, caught.value.parameter) == ("solver", "bodies")
