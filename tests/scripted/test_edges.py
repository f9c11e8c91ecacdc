"""Interfaces by place, angle and area: made weaker or tougher, glued, broken; edits stay where they are when the cut is another."""
import numpy as np
import pytest

import sunder as package
from conftest import contents, obj_text

WEAK = {"mode": "scale", "toughness": 0.2}


def pulled(*seams, cells=(10, 1, 1), toughness=0.05, cut=None, **body):
    """A strip along x that is drawn apart at both ends, with seams in it."""
    nodes = {"cut": cut or {"type": "lattice", "size": [1, 0.1, 0.1], "cells": list(cells)},
             "body": {"type": "body", "fragments": "@cut.fragments", "toughness": toughness, "fracture_energy": None, **body}}
    last = "@body.body"
    for k, given in enumerate(seams):
        nodes[f"it{k}"] = {"type": "seam", "body": last, **given}
        last = f"@it{k}.body"
    for name, low, high, way in (("held", -1, -0.41, 0), ("drawn", 0.41, 1, 0.12)):
        nodes[name] = {"type": "pin", "body": last, "region": "box", "box_min": [low, -1, -1], "box_max": [high, 1, 1],
                       "position": {"keys": [[1, [0, 0, 0]], [24, [way, 0, 0]]]}}
    nodes["sim"] = {"type": "solver", "bodies": [last], "pins": ["@held.pin", "@drawn.pin"], "gravity": [0, 0, 0]}
    nodes["cache"] = {"type": "bake_state", "state": "@sim.state", "path": "sim.####.ply"}
    return {"sunder": 2, "frame_rate": 24, "frame_range": [1, 24], "nodes": nodes}


def block(*seams, seed=0, pieces=60):
    """A cube of pieces with seams in it; its body as the solver has it."""
    nodes = {"file": {"type": "mesh_file", "path": "cube.obj"},
             "cut": {"type": "prefracture", "mesh": "@file.mesh", "pieces": pieces, "seed": seed},
             "body": {"type": "body", "fragments": "@cut.fragments", "toughness": 0.1, "position": [3, 2, 1], "rotation": [0, 0, 30]}}
    last = "@body.body"
    for k, given in enumerate(seams):
        nodes[f"it{k}"] = {"type": "seam", "body": last, **given}
        last = f"@it{k}.body"
    return {"sunder": 2, "frame_range": [1, 4], "nodes": nodes}, last[1:]


@pytest.fixture
def body_of(tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())

    def made(*seams, frame=1, **cut):
        graph, output = block(*seams, **cut)
        return package.Graph.from_dict(graph, base_folder=tmp_path).evaluate(output, frame=frame)

    return made


def scaled(body):
    return body.edge_toughness != 0.1


def first_broken(graph):
    graph = package.Graph.from_dict(graph)
    for frame in range(1, 25):
        state = graph.evaluate("sim.state", frame=frame)
        if len(state.broken_edge):
            return state
    return None


def broken_middles(state):
    return state.rest_position[state.edges[state.broken_edge]].mean(axis=1)


@pytest.mark.parametrize("energy", [None, "auto"])
def test_what_is_weak_in_a_sphere_breaks_first(energy):
    sphere = {**WEAK, "between": "sphere", "center": [0.2, 0, 0], "radius": 0.06}
    state = first_broken(pulled(sphere, fracture_energy=energy))
    assert state is not None and (np.abs(broken_middles(state)[:, 0] - 0.2) < 0.06).all()
    assert np.allclose(state.broken_toughness, 0.01)
    plain = first_broken(pulled(fracture_energy=energy))
    assert plain is None or plain.frame > state.frame


def test_an_edge_opens_as_far_whatever_its_factor():
    """Its energy goes by the factor's square: it begins to fade, and parts, at the factor times the strain."""
    parts = {}
    for factor in (1, 0.5):
        scale = {"mode": "scale", "toughness": factor, "between": "curve", "points": [[0, 0, 0]], "distance": 0.02}
        glue = {"mode": "hold", "frame": None, "between": "all"}
        other = [{**glue, "between": "box", "box_min": [low, -1, -1], "box_max": [high, 1, 1]} for low, high in ((-1, -0.02), (0.02, 1))]
        state = first_broken(pulled(scale, *other, toughness=0.04, fracture_energy="auto"))
        parts[factor] = state.broken_strain[0] / state.broken_toughness[0]
        assert state.broken_toughness[0] == pytest.approx(0.04 * factor)
    assert parts[0.5] == pytest.approx(parts[1], rel=0.1)


def test_factors_multiply_with_one_another_and_with_regions(body_of):
    half = {"mode": "scale", "toughness": 0.5, "between": "box", "box_min": [2.8, 1, 0], "box_max": [9, 9, 9]}
    both = body_of({**half, "between": "all"}, half)
    inside = (both.edge_middle >= [2.8, 1, 0]).all(axis=1)
    assert 0 < inside.sum() < len(inside)
    assert np.allclose(both.edge_toughness, np.where(inside, 0.025, 0.05), rtol=1e-12)
    held = body_of(half, {"mode": "hold", "frame": 3, "between": "all"}, frame=2)
    assert np.isinf(held.edge_toughness).all()
    assert np.isfinite(body_of(half, {"mode": "hold", "frame": 3, "between": "all"}, frame=3).edge_toughness).all()


def test_a_state_tells_what_all_nodes_make_of_an_edge():
    """Regions, seams, and glue until it lets go; of the particles, the edge of theirs that tears first."""
    graph = pulled({"mode": "scale", "toughness": 0.5, "between": "box", "box_min": [-9, -9, -9], "box_max": [-0.25, 9, 9]}, toughness=0.4)
    nodes = graph["nodes"]
    nodes["soft"] = {"type": "body_region", "body": "@it0.body", "region": "box", "box_min": [-0.1, -9, -9], "box_max": [0.1, 9, 9],
                     "toughness": 0.5}
    nodes["glue"] = {"type": "activate", "body": "@soft.body", "mode": "glued", "region": "box", "box_min": [0.2, -9, -9],
                     "box_max": [9, 9, 9], "until": "frame", "frame": 5}
    nodes["sim"]["bodies"] = ["@glue.body"]
    for pin in ("held", "drawn"):
        nodes[pin]["body"] = "@glue.body"
    made = package.Graph.from_dict(graph)
    for frame, glued in ((2, np.inf), (8, 0.4)):
        state, body = made.evaluate("sim.state", frame=frame), made.evaluate("glue.body", frame=frame)
        wanted = np.array([0.2, 0.2, 0.4, 0.3, 0.2, 0.3, glued, glued, glued])  # between fragments k and k + 1
        assert np.allclose(state.edge_toughness, wanted) and np.array_equal(body.edge_toughness, state.edge_toughness)
        own = np.array([0.4] * 4 + [0.2] * 2 + [0.4] * 4)
        factor = np.where(np.isinf(wanted), np.inf, [0.5, 0.5, 1, 1, 1, 1, 1, 1, 1])
        assert np.allclose(state.toughness, own * np.minimum(np.append(factor, np.inf), np.append(np.inf, factor)))


def test_a_frame_of_a_bake_keeps_toughness_where_it_differs(tmp_path):
    for name, seams, has in (("plain", (), False), ("weak", ({**WEAK, "between": "all"},), True)):
        package.bake(package.Graph.from_dict(pulled(*seams)), tmp_path / name, frames=(1, 3))
        assert (b"element strength 10" in (tmp_path / name / "sim.0003.ply").read_bytes()) == has
    package.bake(package.Graph.from_dict(pulled({**WEAK, "between": "all"})), tmp_path / "weak", resume=True)  # it is read again


def test_an_edit_by_place_stays_where_it_is_when_the_cut_is_another(body_of):
    middle, radius = np.array([3.1, 2.1, 1.2]), 0.35

    def shares(body):
        """Of the interfaces' area: what is weak within the place, and outside of it by more than the reach."""
        area, weak = body.edge_share * np.cbrt(body.volume[body.edges].prod(axis=1)), scaled(body)
        away = np.linalg.norm(body.edge_middle - middle, axis=1)
        inside, outside = away < radius, away > radius + reach
        return area[weak & inside].sum() / area[inside].sum(), area[weak & outside].sum() / area.sum()

    plain = body_of()
    chosen = np.linalg.norm(plain.edge_middle - middle, axis=1) < radius
    reach = 0.75 * np.cbrt(plain.volume.mean())
    near = {"points": plain.edge_middle[chosen].tolist(), "spared": plain.edge_middle[~chosen].tolist(), "distance": reach}
    edit = {**WEAK, "between": "places", **near}
    assert np.array_equal(scaled(body_of(edit)), chosen) and 10 < chosen.sum() < len(chosen) / 2
    for seed, pieces in ((7, 60), (0, 150), (3, 30)):
        within, without = shares(body_of(edit, seed=seed, pieces=pieces))
        assert within > 0.8 and without == 0, (seed, pieces, within)


def test_a_stroke_takes_what_lies_within_its_distance(body_of):
    stroke = [[2.6, 2 + 0.1 * k, 1.5] for k in range(-6, 7)]
    weak = body_of({**WEAK, "between": "places", "points": stroke, "distance": 0.25})
    away = np.linalg.norm(weak.edge_middle[:, None] - np.array(stroke), axis=2).min(axis=1)
    assert np.array_equal(scaled(weak), away < 0.25) and scaled(weak).any()


def test_glue_without_end_never_breaks():
    glue = {"mode": "hold", "between": "all", "frame": None}
    assert first_broken(pulled(glue, {"between": "all", "frame": 4})) is None
    assert first_broken(pulled({**glue, "frame": 12})).frame == 12
    assert first_broken(pulled({"between": "all", "frame": None}, toughness=None)) is None


def test_a_factor_takes_keys():
    rots = {"mode": "scale", "between": "curve", "points": [[0, 0, 0]], "distance": 0.02,
            "toughness": {"keys": [[1, 1], [8, 1], [9, 0.001]], "interpolation": "step"}}
    state = first_broken(pulled(rots))
    assert state.frame == 9 and len(state.broken_edge) == 1 and np.abs(broken_middles(state)[:, 0]) < 0.02


@pytest.mark.parametrize("angle,axes", [(0, (2,)), (45, (2,)), (90, (0, 1, 2))])
def test_the_angle_takes_horizontal_interfaces_of_a_lattice(angle, axes):
    only = {**WEAK, "between": "all", "angle": angle}
    graph = pulled(only, cells=(4, 3, 3), cut={"type": "lattice", "size": [1, 1, 1], "cells": [4, 3, 3]})
    body = package.Graph.from_dict(graph).evaluate("it0.body", frame=1)
    x = body.rest_position[body.edges]
    across = np.abs(x[:, 1] - x[:, 0]).argmax(axis=1)
    assert np.array_equal(body.edge_toughness != 0.05, np.isin(across, axes))


def test_areas_take_what_lies_between_them(body_of):
    body = body_of({**WEAK, "between": "all", "least_area": 0.2, "most_area": 0.5})
    share = body.edge_share
    assert np.array_equal(scaled(body), (share >= 0.2) & (share <= 0.5)) and 0 < scaled(body).sum() < len(share)


def test_a_report_tells_the_scaled_toughness(sunder, scene, tmp_path):
    scene(pulled({**WEAK, "between": "sphere", "center": [0.2, 0, 0], "radius": 0.06}))
    assert sunder("bake", "scene.json", "-o", "shot", "--frames", "1:4").status == 0
    rows = package.report(tmp_path / "shot", fragments="all")["fragments"]
    weak = [r for r in rows if r["position"][0] in (0.15000000000000002, 0.25) or abs(r["position"][0] - 0.2) < 0.06]
    assert len(weak) == 2 and all(r["toughness"] == pytest.approx(0.01) for r in weak)
    assert all(r["toughness"] == pytest.approx(0.05) for r in rows if abs(r["position"][0] - 0.2) > 0.11)


@pytest.mark.parametrize("seam", [
    {"mode": "scale", "between": "box", "box_min": [-0.3, -1, -1], "box_max": [0, 1, 1],
     "toughness": {"keys": [[1, 1], [12, 0.1]]}},
    {"mode": "hold", "frame": None, "between": "places", "points": [[0, 0, 0]], "distance": 0.2},
])
def test_resumed_and_by_any_threads_it_has_the_same_bits(sunder, scene, tmp_path, seam):
    scene(pulled(seam, cells=(10, 2, 2), fracture_energy="auto"))
    for folder, frames, threads in (("whole", ["1:24"], 1), ("parts", ["1:1", "1:7", "1:13", "1:24"], 2)):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume", "--threads", str(threads))
            assert done.status == 0, done.err
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")


def test_a_factor_of_one_changes_no_bit():
    plain, same = (package.Graph.from_dict(pulled(*seams, fracture_energy="auto")).evaluate("sim.state", frame=20)
                   for seams in ((), ({"mode": "scale", "between": "all"},)))
    assert not plain.edge_intact.all() or plain.strain.max() > 0.01
    for name in ("position", "orientation", "velocity", "strain", "edge_intact", "edge_damage"):
        assert getattr(plain, name).tobytes() == getattr(same, name).tobytes(), name


@pytest.mark.parametrize("given,parameter", [
    ({"between": "curve", "points": [[0, 0, 0]], "distance": -1}, "distance"),
    ({"between": "places", "points": []}, "points"),
    ({"between": "places", "points": [[0, 2e6, 0]]}, "points"),
    ({"between": "places", "points": [[0, 0, 0]], "spared": [[0, 0]]}, "spared"),
    ({"between": "box", "box_min": [1, 0, 0], "box_max": [0, 1, 1]}, "box_min"),
    ({"between": "sphere", "radius": 0}, "radius"),
    ({"between": "all", "angle": 91}, "angle"),
    ({"between": "all", "angle": 10, "direction": [0, 0, 0]}, "direction"),
    ({"between": "all", "least_area": 2, "most_area": 1}, "most_area"),
    ({"mode": "scale", "between": "all", "toughness": 0}, "toughness"),
    ({"between": "groups", "group": "Hand"}, "group"),
    ({"between": "groups"}, "group"),
])
def test_what_is_wrong_is_told_of_its_parameter(given, parameter):
    with pytest.raises(package.Error) as caught:
        package.Graph.from_dict(pulled(given)).evaluate("sim.state", frame=1)
    assert "it0" in str(caught.value) and parameter in str(caught.value)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
@pytest.mark.parametrize("parameter", ["points", "spared"])
def test_places_are_finite(parameter, value):
    graph = package.Graph.from_dict(pulled({"between": "places", "points": [[0, 0, 0]]}))
    with pytest.raises(package.Error, match="not finite"):
        graph["it0"][parameter] = [[0, value, 0]]
    with pytest.raises(package.Error, match="not finite"):
        package.Graph.from_dict(pulled({"between": "places", parameter: [[0, value, 0]]}))
