"""What is written, exported and evaluated between two frames."""
import json
import os

import numpy as np
import pytest

import sunder as package
from conftest import block_scene, contents
from test_export import export, shattering_scene
from test_time import RAMP, same


def with_steps(graph, **steps):
    """A graph whose bake nodes have so many steps a frame, by their names."""
    for name, n in steps.items():
        graph["nodes"][name]["subframes"] = n
    return graph


def frames_of(folder):
    """{frame: {node: path}} of a bake, what lies between two frames among them."""
    found = {}
    for frame in json.loads((folder / "manifest.json").read_text())["frames"]:
        for part in [*frame.get("subframes", []), frame]:
            found[part["frame"]] = {file["node"]: file["path"] for file in part["files"]}
    return found


@pytest.mark.parametrize("scale", [1, 0.3, RAMP])
def test_whole_frames_have_the_bits_of_a_bake_without(sunder, scene, tmp_path, scale):
    plain = block_scene((0, 9))
    plain["nodes"]["sim"]["time_scale"] = scale
    scene(plain)
    assert sunder("bake", "scene.json", "-o", "plain").status == 0
    scene(with_steps(plain, out=4, cache=2))
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    wanted, found = contents(tmp_path / "plain"), contents(tmp_path / "bake")
    assert {n: found[n] for n in wanted if n != "manifest.json"} == {n: d for n, d in wanted.items() if n != "manifest.json"}
    frames = frames_of(tmp_path / "bake")
    assert list(frames) == [f / 4 for f in range(37)]
    assert [f for f in frames if "cache" in frames[f]] == [f / 2 for f in range(19)]
    # Nothing but what the manifest lists is there, and it is what an evaluation gives.
    listed = {path for files in frames.values() for path in files.values()}
    assert {n for n in found if n.split("/")[0] in ("mesh", "state")} == listed
    graph = package.Graph.from_dict(plain)
    for f in (2.5, 4.0, 7.5):
        state, shown = package.read_state(tmp_path / "bake" / frames[f]["cache"]), graph.evaluate("sim.state", f)
        assert same(state, shown) and state.frame == shown.frame == f and state.simulated_frame == shown.simulated_frame
        assert state.time == shown.time


@pytest.mark.parametrize("start", [0, -3, 1001])
def test_names_are_in_the_order_of_time_and_whole_frames_keep_theirs(sunder, scene, tmp_path, start):
    scene(with_steps(block_scene((start, start + 3)), out=3))
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    frames = frames_of(tmp_path / "bake")
    names = [frames[f]["out"].split("/")[1] for f in sorted(frames)]
    if start >= 0:
        assert names == sorted(names) and names == sorted(os.listdir(tmp_path / "bake/mesh"))
        assert names[:4] == [f"block.{start:04d}.ply", f"block.{start:04d}_333.ply", f"block.{start:04d}_667.ply",
                             f"block.{start + 1:04d}.ply"]
    else:
        assert frames[-3 + 1 / 3]["out"] == "mesh/block.-003_333.ply" and frames[-1 + 2 / 3]["out"] == "mesh/block.-001_667.ply"
    assert sunder("verify", "bake").status == 0
    lost = tmp_path / "bake" / frames[start + 1 / 3]["out"]
    lost.write_bytes(lost.read_bytes()[:-1])
    told = sunder("verify", "bake")
    assert told.status != 0 and f"(frame {start + 1 / 3!r})" in told.out + told.err


@pytest.mark.parametrize("scale", [1, RAMP])
def test_a_bake_resumes_after_any_frame_to_the_same_bits(sunder, scene, tmp_path, scale):
    graph = with_steps(block_scene((0, 13)), out=3, cache=2)
    graph["nodes"]["sim"]["time_scale"] = scale
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "whole").status == 0
    for end in (0, 1, 5, 8, 13):
        done = sunder("bake", "scene.json", "-o", "parts", "--resume", "--frames", f"0:{end}")
        assert done.status == 0, done.err
        assert sunder("verify", "parts").status == 0
    whole, parts = contents(tmp_path / "whole"), contents(tmp_path / "parts")
    assert {n: d for n, d in whole.items() if n != "manifest.json"} == {n: d for n, d in parts.items() if n != "manifest.json"}
    scene(with_steps(graph, out=4))
    assert "'subframes': 3 was baked, now 4" in sunder("bake", "scene.json", "-o", "parts", "--resume").err
    # Another number of steps leaves nothing of this one.
    scene(with_steps(graph, out=1, cache=1))
    assert sunder("bake", "scene.json", "-o", "parts", "--restart").status == 0
    assert not [n for n in contents(tmp_path / "parts") if "_" in n.split("/")[-1]]


def test_a_cancelled_bake_leaves_nothing_between_frames(tmp_path):
    graph = package.Graph.from_dict(with_steps(block_scene((1, 6)), out=5))

    def until(_, text):
        return text != "frame 4.4"
    with pytest.raises(package.Error) as caught:
        graph.bake(tmp_path / "bake", progress=until)
    assert caught.value.code == "cancelled"
    frames = frames_of(tmp_path / "bake")
    assert sorted(os.listdir(tmp_path / "bake/mesh")) == sorted(f["out"].split("/")[1] for f in frames.values())
    assert 1 in frames and max(frames) == int(max(frames)) <= 4
    graph.bake(tmp_path / "bake", resume=True)
    package.Graph.from_dict(with_steps(block_scene((1, 6)), out=5)).bake(tmp_path / "whole")
    assert contents(tmp_path / "bake") == contents(tmp_path / "whole")


def test_what_a_killed_bake_began_goes_with_it(sunder, scene, tmp_path):
    graph = with_steps(block_scene((1, 4)), out=2)
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "bake", "--frames", "1:3").status == 0
    begun = tmp_path / "bake/mesh/block.0003_500.ply"
    begun.write_bytes((tmp_path / "bake/mesh/block.0002_500.ply").read_bytes())
    foreign = tmp_path / "bake/mesh/block.0004_500.ply"
    foreign.write_text("mine")
    scene(with_steps(graph, out=1))
    assert sunder("bake", "scene.json", "-o", "bake", "--restart").status == 0
    assert not begun.exists() and foreign.read_text() == "mine"


def test_two_nodes_of_one_file_are_refused(sunder, scene):
    graph = with_steps(block_scene((1, 3)), out=4)
    graph["nodes"]["other"] = {"type": "bake_mesh", "mesh": "@skin.mesh", "path": "mesh/block.####_500.ply"}
    scene(graph)
    assert "writes the same file as node" in sunder("bake", "scene.json", "-o", "bake").err
    for wrong in (0, 65, 1.5, "four", None):
        with pytest.raises(package.Error) as caught:
            package.Graph.from_dict(with_steps(block_scene(), out=wrong))
        assert caught.value.parameter == "subframes"


def times_of(text, attribute):
    lines = text[text.index(attribute + ".timeSamples"):].split("\n")[1:]
    return [float(line.split(":")[0]) for line in lines[:next(i for i, line in enumerate(lines) if line.strip() == "}")]]


def test_exports_have_their_samples(sunder, scene, tmp_path):
    scene(with_steps(shattering_scene(), out=4, cache=2))
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    export(sunder, "-o", "shot.usda")
    text = (tmp_path / "shot.usda").read_text()
    assert times_of(text, "point3f[] points") == [1 + i / 4 for i in range(21)] == times_of(text, "vector3f[] velocities")
    assert "startTimeCode = 1\n    endTimeCode = 6\n" in text
    export(sunder, "-o", "shot.glb")
    data = (tmp_path / "shot.glb").read_bytes()
    gltf = json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])
    times = gltf["accessors"][gltf["animations"][0]["samplers"][0]["input"]]
    assert times["count"] == 21 and times["max"] == [pytest.approx(5 / 24)]
    export(sunder, "-o", "shot.pc2")
    head = np.frombuffer((tmp_path / "shot.pc2").read_bytes()[20:32], "<f4,<f4,<i4")[0]
    assert list(head) == [1, 0.25, 21]
    export(sunder, "--frames", "2:3", "-o", "shot.####.ply")
    assert sorted(p.name for p in tmp_path.glob("shot.*.ply")) == [
        "shot.0002.ply", "shot.0002_250.ply", "shot.0002_500.ply", "shot.0002_750.ply", "shot.0003.ply"]


@pytest.mark.parametrize("steps", [1, 2])
def test_rigid_bodies_of_exports_go_straight_where_no_state_was_baked(sunder, scene, tmp_path, steps):
    scene(with_steps(block_scene((1, 5)), out=4, cache=steps))
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    export(sunder, "-o", "shot.usda")
    text = (tmp_path / "shot.usda").read_text()
    at = text.index("xformOp:translate.timeSamples", text.index('"ball"'))
    rows = [line.strip(" ),").split(": (") for line in text[at:].split("\n")[1:18]]
    found = {float(t): np.array([float(x) for x in p.split(",")]) for t, p in rows}
    assert list(found) == [1 + i / 4 for i in range(17)]
    state = package.Graph.from_dict(block_scene((1, 5))).evaluate
    for f in (2, 3, *([2.5] if steps == 2 else [])):
        assert np.array_equal(found[f], state("sim.state", f).rigid_position[0])
    low, high = (2, 2.5) if steps == 2 else (2, 3)
    share = (2.25 - low) / (high - low)
    assert np.allclose(found[2.25], (1 - share) * found[low] + share * found[high], atol=1e-12)


@pytest.mark.parametrize("limit", [1, 2**30])
def test_what_begins_at_a_state_goes_on_from_it_whatever_was_simulated_before(limit):
    graph, other = (package.Graph.from_dict(block_scene((1, 9))) for _ in range(2))
    third, plain = graph.evaluate("sim.state", 3), graph.evaluate("sim.state", 9)
    graph.evaluate("sim.state", 6.5)
    graph.set_cache_limit(limit)
    graph.evaluate("sim.state", 7)
    for each in (graph, other):
        each.seed_state("sim", 5, third)
    for frame in (7, 5, 5.5, 6, 6.5, 9, 5, 6, 3, 5):  # and again, when a small cache has forgotten what it could
        assert same(graph.evaluate("sim.state", frame), other.evaluate("sim.state", frame)), frame
        if frame == 5:
            assert np.array_equal(graph.evaluate("sim.state", 5).position, third.position)
    assert not np.array_equal(graph.evaluate("sim.state", 9).position, plain.position)


def test_nothing_goes_on_from_what_lies_between_two_frames():
    graph = package.Graph.from_dict(block_scene((1, 9)))
    with pytest.raises(package.Error, match="lies between two simulated frames"):
        graph.seed_state("sim", 5, graph.evaluate("sim.state", 5.5))


def test_what_lies_between_two_frames_can_be_looked_at():
    graph = package.Graph.from_dict(block_scene((1, 9)))
    between = graph.evaluate("sim.state", 5.5)
    mesh = graph.evaluate("skin.mesh", 5.5)
    other = package.Graph.from_dict(block_scene((1, 9)))
    other.show_state("sim", 6, between)
    state, skin = other.evaluate_all(["sim.state", "skin.mesh"], 6)
    assert same(state, between) and np.array_equal(skin.positions, mesh.positions)


@pytest.mark.parametrize("kept", [False, True])
@pytest.mark.parametrize("curvature", [False, True])
@pytest.mark.parametrize("fracture_energy", [None, 50])
def test_a_state_begins_where_more_is_simulated_than_made_it(kept, curvature, fracture_energy):
    """It has nothing of what keeps fragments, bends or fades; neither do the states that are blended from it."""
    def sheet(**body):
        return {"sunder": 2, "frame_rate": 24, "frame_range": [1, 12], "nodes": {
            "cut": {"type": "lattice", "size": [0.6, 0.6, 0.02], "cells": [6, 6, 1], "center": [0, 0, 0.012]},
            "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e6, **body},
            "floor": {"type": "collider", "shape": "plane"},
            "sim": {"type": "solver", "bodies": ["@body.body"], "colliders": ["@floor.collider"]}}}

    more = sheet(curvature=curvature, fracture_energy=fracture_energy)
    if kept:
        more["nodes"]["hold"] = {"type": "activate", "body": "@body.body", "mode": "glued", "until": "frame", "frame": 7}
        more["nodes"]["sim"]["bodies"] = ["@hold.body"]
    graph = package.Graph.from_dict(more)
    graph.seed_state("sim", 5, package.Graph.from_dict(sheet(curvature=False, fracture_energy=None)).evaluate("sim.state", 5))
    for frame in (5, 5.5, 6, 6.5):
        state, has = graph.evaluate("sim.state", frame), frame >= 6
        assert len(state.kept) == 36 * (kept and has), frame
        assert len(state.plastic_curvature) == 36 * (curvature and has), frame
        assert len(state.edge_damage) == 60 * (fracture_energy is not None and has), frame


def test_any_frame_may_be_asked_for():
    graph = package.Graph.from_dict(block_scene((1, 9)))
    tenths = {**block_scene((1, 81))}
    tenths["nodes"]["sim"]["time_scale"] = 0.5
    half = package.Graph.from_dict(tenths)
    for f in (2.5, 5.5, 7.5):
        assert same(graph.evaluate("sim.state", f), half.evaluate("sim.state", 2 * f - 1))
    assert same(graph.evaluate("sim.state", 5), graph.evaluate("sim.state", 5.0))
    assert graph.evaluate("sim.state", 5.0).frame == 5 and isinstance(graph.evaluate("sim.state", 5).frame, int)
    both = graph.evaluate_all(["sim.state", "skin.mesh"], 5.5)
    assert same(both[0], graph.evaluate("sim.state", 5.5)) and both[0].frame == 5.5
    assert np.array_equal(both[1].positions, graph.evaluate("skin.mesh", 5.5).positions)
    job = graph.start_evaluate("sim.state", 6.25)
    job.result()
    assert same(graph.evaluate("sim.state", 0.25), graph.evaluate("sim.state", 1))  # before the start all stands as there
    for wrong in (float("nan"), float("inf"), 2e6 + 0.5):
        with pytest.raises(package.Error, match="out of range"):
            graph.evaluate("sim.state", wrong)
