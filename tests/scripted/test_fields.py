"""Forces that differ from place to place, by graphs: what they do, that they resume to the bit, and what is refused."""
import json

import numpy as np
import pytest

import sunder
from conftest import block_scene, contents
from test_cracks import write_ball

ARMS = np.array([[np.cos(2.4 * k), np.sin(2.4 * k), 0.3 * k - 1.5] for k in range(2, 11)])
ARMS *= (0.5 * np.arange(2, 11) / np.linalg.norm(ARMS, axis=1))[:, None]  # 2 to 10 times 0.5 m


def spheres(places, **nodes):
    """Small free things at places, nothing else but what is given, and no gravity."""
    graph = {"ball": {"type": "lattice", "size": [0.01] * 3, "cells": [1, 1, 1]}}
    for k, place in enumerate(places):
        graph[f"b{k}"] = {"type": "body", "fragments": "@ball.fragments", "position": list(map(float, place))}
    solver = {"type": "solver", "bodies": [f"@b{k}.body" for k in range(len(places))], "gravity": [0, 0, 0]}
    for name, node in nodes.items():
        graph[name] = node
        outputs = [s["name"] for s in sunder.node_types()[node["type"]]["outputs"]]
        socket = "forces" if "force" in outputs else "colliders"
        solver.setdefault(socket, []).append(f"@{name}.{outputs[0]}")
    graph["sim"] = solver
    return sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 20], "nodes": graph})


def test_a_blast_throws_free_spheres_as_its_falloff_says():
    bomb = {"type": "blast", "frame": 4, "position": [0.2, 0.1, -0.3], "speed": 7, "radius": 0.5, "falloff": 1.5}
    graph = spheres(ARMS + bomb["position"], bomb=bomb)
    assert not graph.evaluate("sim.state", frame=4).velocity.any()
    velocity = graph.evaluate("sim.state", frame=5).velocity
    distance = np.linalg.norm(ARMS, axis=1)
    wanted = (7 * (0.5 / distance) ** 1.5 / distance)[:, None] * ARMS
    np.testing.assert_allclose(velocity, wanted, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(graph.evaluate("sim.state", frame=9).velocity, velocity, rtol=1e-9, atol=1e-12)  # once


def test_a_blast_before_the_first_frame_is_told():
    for frame, is_missed in ((-3, True), (0, True), (1, False), (40, False)):
        graph = spheres([(1, 0, 0)], bomb={"type": "blast", "frame": frame}, wind={"type": "force", "wind": [0, 1, 0]})
        told = [f"node 'bomb': never goes off: its frame {frame} lies before the first, 1"] if is_missed else []
        assert graph.evaluate("sim.state", frame=1).warnings == graph.evaluate("sim.state", frame=3).warnings == told
        graph.frame_range = (-3, 20)
        assert graph.evaluate("sim.state", frame=1).warnings == []
        graph.frame_range = (-2, 20)
        assert len(graph.evaluate("sim.state", frame=1).warnings) == (frame == -3)


def test_a_wall_keeps_a_blast_off_where_it_is_told_to():
    wall = {"type": "collider", "shape": "box", "size": [0.1, 2, 2], "position": [1, 0, 0]}
    for shadow, thrown in (("none", [1, 1]), ("solids", [0, 1]), ("all", [0, 1])):
        graph = spheres([(2, 0, 0), (-2, 0, 0)], wall=wall, bomb={"type": "blast", "shadow": shadow})
        assert (graph.evaluate("sim.state", frame=2).velocity.any(axis=1) == thrown).all(), shadow


def test_a_blast_gives_the_energy_that_it_has():
    graph = spheres(ARMS, bomb={"type": "blast", "strength": "energy", "energy": 3.5, "radius": 2})
    state = graph.evaluate("sim.state", frame=2)
    assert (0.5 * state.mass * (state.velocity**2).sum(1)).sum() == pytest.approx(3.5, rel=1e-9)


FORCES = {
    "blast": {"type": "blast", "frame": 3, "position": [0.05, 0, 0.1], "speed": 6, "shadow": "all"},
    "point_force": {"type": "point_force", "position": [0.05, 0, 0.1], "strength": {"keys": [[1, 0], [4, 40]]}},
    "vortex": {"type": "vortex", "position": {"keys": [[1, [0, 0, 0]], [8, [0.1, 0, 0]]]}, "swirl": 6, "lift": 2, "drag": 4},
    "turbulence": {"type": "turbulence", "strength": 6, "size": 0.2, "period": 0.1, "acts_as": "acceleration"},
    "guide": {"type": "guide", "body": "@clay.body", "strength": {"keys": [[2, 0], [6, 30]]}, "rotation": {"keys": [[1, [0, 0, 0]], [8, [0, 0, 40]]]}},
    "grid_force": {"type": "grid_force", "nodes": [2, 2, 2], "acts_as": "acceleration", "first_frame": 3,
                   "values": [[0, 0, 0]] * 8 + [[20, 0, 9]] * 4 + [[0, 30, 9]] * 4},
    "force": {"type": "force", "wind": [8, 0, 0], "drag": 2, "gusts": 0.7, "gust_time": 0.05},
}


def blown(kind):
    graph = block_scene((1, 8))
    graph["nodes"]["field"] = FORCES[kind]
    graph["nodes"]["sim"]["forces"] = ["@field.force"]
    return graph


@pytest.mark.parametrize("kind", FORCES)
def test_resumed_bakes_and_any_number_of_threads_have_the_same_bits(kind, tmp_path):
    graph = sunder.Graph.from_dict(blown(kind))
    for folder, threads, parts in (("whole", 1, [(1, 8)]), ("threads", 2, [(1, 8)]), ("parts", 1, [(1, 2), (1, 3), (1, 4), (1, 8)])):
        for frames in parts:
            sunder.bake(sunder.Graph.from_dict(blown(kind)), tmp_path / folder, frames=frames, threads=threads,
                        resume=frames != parts[0])
    whole, threads, parts = (contents(tmp_path / name) for name in ("whole", "threads", "parts"))
    assert whole == threads == parts
    plain = sunder.Graph.from_dict(block_scene((1, 8)))
    assert (graph.evaluate("sim.state", frame=6).position != plain.evaluate("sim.state", frame=6).position).any()


def test_until_a_blast_goes_off_it_changes_no_bit():
    plain, blasted = (sunder.Graph.from_dict(g) for g in (block_scene((1, 8)), blown("blast")))
    for frame in (1, 2, 3):
        one, other = (g.evaluate("sim.state", frame=frame) for g in (plain, blasted))
        for name in one._arrays:
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), (frame, name)


def test_a_gust_grows_and_drops_the_wind_alike_on_every_run():
    def speeds(**given):
        graph = spheres([(0, 0, 0)], air={"type": "force", "wind": [3, 0, 0], "drag": 1e4, **given})
        return [graph.evaluate("sim.state", frame=f).velocity[0, 0] for f in range(2, 20)]

    steady, gusty = speeds(), speeds(gusts=0.5, gust_time=0.1)
    assert np.ptp(steady) < 0.02 and min(gusty) < 2.6 and max(gusty) > 3.4 and 1.49 < min(gusty) and max(gusty) < 4.51
    assert gusty == speeds(gusts=0.5, gust_time=0.1) != speeds(gusts=0.5, gust_time=0.1, gust_seed=1)


@pytest.mark.parametrize("air", [{"type": "force", "wind": [3, 0, 0], "drag": 5, "gusts": 0.5, "gust_time": 0.1},
                                 {"type": "turbulence", "period": 0.2, "drag": 5}], ids=["gusts", "turbulence"])
@pytest.mark.parametrize("first", [0, -5, 1001])
def test_noise_is_the_same_wherever_the_shot_begins(air, first):
    def way(first):
        description = spheres(ARMS, air=air).to_dict()
        description["frame_range"] = [first, first + 9]
        graph = sunder.Graph.from_dict(description)
        return np.array([graph.evaluate("sim.state", frame=first + f).velocity for f in range(10)])

    assert np.array_equal(way(first), way(1)) and np.ptp(way(1)) > 1


def broken_scene(**guide):
    """A block that a ball breaks, and a guide to it."""
    graph = block_scene((1, 60))
    nodes = graph["nodes"]
    del nodes["skin"], nodes["out"], nodes["cache"]
    nodes["clay"].update({"yield": None, "toughness": 0.01})
    nodes["guide"] = {"type": "guide", "body": "@clay.body", **guide}
    nodes["sim"].update(forces=["@guide.force"], rigid_bodies=["@ball.rigid_body"])
    return graph


def test_a_guide_puts_together_what_broke():
    free, guided = (sunder.Graph.from_dict(broken_scene(strength=s)) for s in (0, {"keys": [[20, 0], [30, 40]]}))
    start = free.evaluate("sim.state", frame=1).position
    assert np.abs(free.evaluate("sim.state", frame=60).position - start).max() > 0.1
    assert (guided.evaluate("sim.state", frame=20).position == free.evaluate("sim.state", frame=20).position).all()
    back = guided.evaluate("sim.state", frame=60)
    assert not back.edge_intact.any()
    off = np.linalg.norm(back.position - start, axis=1)
    assert np.quantile(off, 0.8) < 0.02 and off.max() < 0.1, off  # the ball is in the way of some


def test_a_guide_leads_to_a_frame_of_another_solver():
    graph = broken_scene(strength=60, target="state", target_frame=9)
    nodes = graph["nodes"]
    nodes["other"] = {"type": "solver", "bodies": ["@clay.body"], "gravity": [2, 0, 0]}
    nodes["guide"]["state"] = "@other.state"
    nodes["sim"].update(rigid_bodies=[], colliders=[], gravity=[0, 0, 0])
    shot = sunder.Graph.from_dict(graph)
    there, target = shot.evaluate("sim.state", frame=40).position, shot.evaluate("other.state", frame=9).position
    np.testing.assert_allclose(there, target, atol=1e-4)
    del nodes["guide"]["state"]
    with pytest.raises(sunder.Error, match="no state is wired"):
        sunder.Graph.from_dict(graph).evaluate("sim.state", frame=2)


def test_a_guide_of_a_body_that_is_not_moved_is_refused():
    graph = broken_scene()
    graph["nodes"]["stone"] = {"type": "body", "fragments": "@block.fragments"}
    graph["nodes"]["guide"]["body"] = "@stone.body"
    with pytest.raises(sunder.Error, match="'guide' acts on body 'stone', which this solver does not move"):
        sunder.Graph.from_dict(graph).evaluate("sim.state", frame=2)


def saddle(places):
    """Linear, so that a grid of it is exact."""
    return np.stack([1 + 2 * places[:, 0], -places[:, 2], places[:, 0] + places[:, 1]], axis=1)


def accelerations(graph, places):
    """What free things at places gain in the first step."""
    graph["sim"].set(substeps=1, iterations=1)
    return graph.evaluate("sim.state", frame=2).velocity * 24


@pytest.mark.parametrize("in_file", [False, True])
def test_a_function_of_places_is_a_grid_force(in_file, tmp_path):
    places = np.array([(0.1, 0.2, 0.3), (-0.9, 0.9, -0.9), (1.0, -1.0, 1.0), (0.5, 1.01, 0)])
    given = sunder.sample_field(saddle, (-1, -1, -1), (1, 1, 1), (3, 4, 5), path=tmp_path / "saddle.json" if in_file else None)
    assert (("values" in given), given["source"]) == (not in_file, "file" if in_file else "values")
    graph = spheres(places)
    graph.add("grid_force", "field", acts_as="acceleration", strength=0.5, **given)
    graph["sim"]["forces"] = ["@field.force"]
    wanted = 0.5 * saddle(places) * (np.abs(places).max(1) <= 1)[:, None]
    np.testing.assert_allclose(accelerations(graph, places), wanted, rtol=1e-9, atol=1e-11)


def test_a_function_is_asked_once_a_frame():
    asked = []

    def storm(places, frame):
        asked.append((frame, places.shape))
        return np.full(places.shape, [frame, 0, 0])

    given = sunder.sample_field(storm, (-1, -1, -1), (1, 1, 1), (2, 2, 2), frames=(3, 5))
    assert asked == [(f, (8, 3)) for f in (3, 4, 5)] and given["first_frame"] == 3 and len(given["values"]) == 24
    graph = spheres([(0, 0, 0)])
    graph.add("grid_force", "field", acts_as="acceleration", **given)
    graph["sim"]["forces"] = ["@field.force"]
    speeds = [graph.evaluate("sim.state", frame=f).velocity[0, 0] for f in range(1, 9)]
    np.testing.assert_allclose(np.diff(speeds) * 24, [3, 3, 4, 5, 5, 5, 5], rtol=1e-9)


@pytest.mark.parametrize("field, needle", [(lambda x: x[:, :2], "shape"), (lambda x: x * np.nan, "finite"),
                                           (lambda x: x * 1e9, "million"), (lambda x: np.where(x > 0, np.inf, x), "finite")])
def test_a_function_that_gives_no_field_is_refused(field, needle):
    with pytest.raises(sunder.Error, match=needle):
        sunder.sample_field(field, (-1, -1, -1), (1, 1, 1))


@pytest.mark.parametrize("text, needle", [
    ("{", "JSON"), ("[1]", "holds no object"), ('{"values": [[1, 2, 3]], "colour": 3}', "'colour', which no grid has"),
    ('{"values": [[1, 2, 3]]}', "1 vectors for 8 nodes"), ('{"values": [[1, 2, 1e7]]}', "out of range"),
    ('{"values": [[1, 2, NaN]]}', "JSON"), ('{"nodes": [1, 2, 2]}', "out of range"),
    ('{"values": [[1, 2, 3], [1]]}', "a list of vectors")])
def test_a_file_that_holds_no_grid_is_refused_on_its_node(text, needle, tmp_path):
    (tmp_path / "grid.json").write_text(text)
    graph = spheres([(0, 0, 0)], field={"type": "grid_force", "source": "file", "path": str(tmp_path / "grid.json")})
    with pytest.raises(sunder.Error, match=needle) as caught:
        graph.evaluate("sim.state", frame=2)
    assert caught.value.node == "field" and caught.value.parameter == "path"


BALL = {"radius": 0.5, "thickness": 0.02, "stiffness": 1e7, "toughness": 0.01}
BURSTS = 2 * BALL["stiffness"] * BALL["thickness"] * BALL["toughness"] / ((BALL["radius"] - 0.01) * (1 - 0.3))  # Pa, by Laplace


@pytest.fixture(scope="module")
def shell(tmp_path_factory):
    """A hollow ball: a sphere, and one inside turned inwards."""
    folder = tmp_path_factory.mktemp("shell")
    rows = []
    for name, radius in (("outer", BALL["radius"]), ("inner", BALL["radius"] - BALL["thickness"])):
        write_ball(folder / f"{name}.obj", 3, radius)
        rows.append([line.split() for line in (folder / f"{name}.obj").read_text().splitlines()])
    n = sum(row[0] == "v" for row in rows[0])
    inner = [["f", *(str(int(i) + n) for i in reversed(row[1:]))] if row[0] == "f" else row for row in rows[1]]
    (folder / "shell.obj").write_text("\n".join(" ".join(row) for row in rows[0] + inner) + "\n")
    return folder / "shell.obj"


def evenly(shell):
    """Sites of an even cut: the corners of the sphere's triangles, in the middle of the shell."""
    rows = [line.split() for line in (shell.parent / "outer.obj").read_text().splitlines()]
    points = np.array([row[1:] for row in rows if row[0] == "v"], float)
    return {"sites": "points", "points": ((BALL["radius"] - BALL["thickness"] / 2) / BALL["radius"] * points).tolist()}


def blown_up(shell, frames=60, cut=None, **gas):
    return sunder.Graph.from_dict({"sunder": 2, "frame_rate": 240, "frame_range": [1, frames], "nodes": {
        "mesh": {"type": "mesh_file", "path": str(shell)},
        "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "clusters": 0, **(cut or {"pieces": 300})},
        "ball": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": BALL["stiffness"], "poisson_ratio": 0.3,
                 "toughness": BALL["toughness"], "fracture_energy": None},
        "gas": {"type": "pressure", "body": "@ball.body", **gas},
        "sim": {"type": "solver", "bodies": ["@ball.body"], "forces": ["@gas.force"], "gravity": [0, 0, 0]}}})


def test_a_ball_that_is_blown_up_grows_as_a_membrane_and_bursts_where_that_breaks(shell):
    graph = blown_up(shell, cut=evenly(shell), pressure={"keys": [[1, 0], [60, 1.5 * BURSTS]]})
    start, states = None, {}
    for frame in range(1, 61):
        states[frame] = state = graph.evaluate("sim.state", frame=frame)
        start = state if start is None else start
        if not state.edge_intact.all():
            break
    at = graph["gas"].at("pressure", frame)
    assert abs(at / BURSTS - 1) < 0.1, (frame, at, BURSTS)
    half = states[frame // 2]
    grown = np.linalg.norm(half.position, axis=1).mean() / np.linalg.norm(start.position, axis=1).mean() - 1
    assert abs(grown / (BALL["toughness"] * graph["gas"].at("pressure", frame // 2) / BURSTS) - 1) < 0.15, grown


def test_a_ball_of_uneven_fragments_is_strained_as_much_and_less_evenly(shell):
    graph = blown_up(shell, frames=90, pressure={"keys": [[1, 0], [60, 0.6 * BURSTS]]})
    strain = graph.evaluate("sim.state", frame=90).strain / (0.6 * BALL["toughness"])
    assert abs(np.median(strain) - 1) < 0.05 and 1.1 < strain.max() < 1.25  # so it bursts that much earlier


def test_edges_that_fade_begin_to_where_its_stress_is_their_strength(shell):
    graph = blown_up(shell, cut=evenly(shell), pressure={"keys": [[1, 0], [60, 1.5 * BURSTS]]})
    graph["ball"]["fracture_energy"] = "auto"
    frame = next(f for f in range(2, 61) if (graph.evaluate("sim.state", frame=f).edge_damage > 0).any())
    fades = BURSTS * (1 - 0.3)  # Pa: 2 E t toughness / R
    assert abs(graph["gas"].at("pressure", frame) / fades - 1) < 0.1, frame


def test_what_is_blown_up_resumes_to_the_bit(shell, sunder, scene, tmp_path):
    graph = blown_up(shell, frames=34, pressure={"keys": [[1, 0], [24, 1.3 * BURSTS]]}).to_dict()
    graph["nodes"]["cache"] = {"type": "bake_state", "state": "@sim.state", "path": "sim.####.ply"}
    scene(graph)
    for folder, frames in (("whole", ["1:34"]), ("parts", ["1:12", "1:28", "1:34"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")


def test_a_ball_that_burst_loses_its_pressure(shell):
    graph = blown_up(shell, pressure={"keys": [[1, 0], [30, 1.5 * BURSTS]]})
    burst, later = (graph.evaluate("sim.state", frame=f) for f in (40, 60))
    assert not burst.edge_intact.all()
    speeds = [np.linalg.norm(s.velocity, axis=1) for s in (burst, later)]
    assert np.isfinite(speeds[1]).all() and speeds[1].max() < 60


def test_a_body_without_a_hollow_is_refused():
    graph = block_scene()
    graph["nodes"]["gas"] = {"type": "pressure", "body": "@clay.body"}
    graph["nodes"]["sim"]["forces"] = ["@gas.force"]
    with pytest.raises(sunder.Error, match="encloses no hollow") as caught:
        sunder.Graph.from_dict(graph).evaluate("sim.state", frame=2)
    assert caught.value.node == "gas"


BAD = {
    "a field of NaN": ("grid_force", {"values": [[float("nan"), 0, 0]] * 8}, "values"),
    "too few vectors": ("grid_force", {"values": [[1, 0, 0]] * 7}, "values"),
    "no vectors": ("grid_force", {}, "values"),
    "a box without volume": ("grid_force", {"values": [[1, 0, 0]] * 8, "box_max": [1, -1, 1]}, "box_min"),
    "no file": ("grid_force", {"source": "file"}, "path"),
    "a file that is not there": ("grid_force", {"source": "file", "path": "nowhere.json"}, "path"),
    "an axis without a direction": ("vortex", {"axis": [0, 0, 0]}, "axis"),
    "eddies of no size": ("turbulence", {"size": 0}, "size"),
    "a strength that is no number": ("point_force", {"strength": float("nan")}, "strength"),
    "a cone without a direction": ("blast", {"spread": "cone", "direction": [0, 0, 0]}, "direction"),
    "an empty cone": ("blast", {"spread": "cone", "angle": 0}, "angle"),
    "a place that is nowhere": ("blast", {"position": [float("nan"), 0, 0]}, "position"),
    "no radius": ("blast", {"radius": 0}, "radius"),
    "more energy than there is": ("blast", {"frame": 1, "strength": "energy", "energy": 1e14}, "energy"),
}


@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize("name", BAD)
def test_what_makes_no_sense_is_named_on_its_node(name, whole):
    kind, given, parameter = BAD[name]
    with pytest.raises(sunder.Error) as caught:
        graph = spheres(ARMS)
        if whole:
            description = graph.to_dict()
            description["nodes"]["field"] = {"type": kind, **given}
            graph = sunder.Graph.from_dict(description)
        else:
            graph.add(kind, "field", **given)
        graph["sim"]["forces"] = ["@field.force"]
        graph.evaluate("sim.state", frame=3)
    assert caught.value.node == "field" and caught.value.parameter == parameter, caught.value
    assert "'field'" in str(caught.value)


def test_graph_files_hold_them(tmp_path):
    path = tmp_path / "shot.json"
    path.write_text(json.dumps(blown("blast")))
    assert sunder.Graph.load(str(path))["field"]["speed"] == 6


def test_gas_pushes_no_closed_shell_that_it_bends(tmp_path):
    """A hollow box in empty space, blown up beyond its yield. Its fragments' linings, each turned by itself, left over what drove it
    at 4 m/s, and turned it."""
    lines = []
    for size, turned in ((0.5, 1), (0.36, -1)):
        lines += ["v %g %g %g" % (x * size, y * size, z * size) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        first = 0 if turned > 0 else 8
        quads = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
        lines += ["f %d %d %d %d" % tuple(first + i for i in quad[::turned]) for quad in quads]
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 48], "nodes": {
        "mesh": {"type": "mesh_file", "path": "box.obj"},
        "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": 200, "sheets": "off"},
        "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e7, "poisson_ratio": 0.3, "yield": 0.005,
                 "flow_rate": 2000, "hardening": 0.1},
        "gas": {"type": "pressure", "body": "@body.body", "pressure": {"keys": [[1, 0], [20, 1e5]]}},
        "sim": {"type": "solver", "bodies": ["@body.body"], "forces": ["@gas.force"], "gravity": [0, 0, 0], "sleeping": False}}},
        base_folder=str(tmp_path))
    rest = graph.evaluate("sim.state", 1).position
    for frame in (12, 24, 48):
        state = graph.evaluate("sim.state", frame)
        share = state.mass / state.mass.sum()
        assert np.linalg.norm(share @ state.velocity) < 1e-9, frame
        spin = share @ np.cross(state.position - share @ state.position, state.velocity)  # over the mass
        assert np.linalg.norm(spin) < 1e-3, frame  # m2/s; fragments that turn have some of their own, 0.2 m/s go to and fro
    assert np.linalg.norm(state.position - rest, axis=1).max() > 0.02  # it was bent
