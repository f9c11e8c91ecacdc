"""Frame rates as ratios, first frames of any number."""
import json
from fractions import Fraction

import numpy as np
import pytest

import sunder as package
from conftest import block_scene, contents
from test_export import export, shattering_scene


def states(graph, frames):
    return {f: graph.evaluate("sim.state", frame=f) for f in frames}


def same(a, b):
    """The bits of two states, whatever their frames are called."""
    return all(np.array_equal(getattr(a, name), getattr(b, name))
               for name in ("position", "orientation", "velocity", "edge_intact", "rigid_position", "strain", "edge_damage"))


def test_a_frame_rate_is_a_ratio_in_json_and_python(sunder, scene):
    graph = package.Graph.from_dict({**block_scene(), "frame_rate": [24000, 1001]})
    assert graph.to_dict()["frame_rate"] == [24000, 1001] and graph.frame_rate == 24000 / 1001
    for rate in (Fraction(30000, 1001), (30000, 1001), [60000, 2002]):
        graph.frame_rate = rate
        assert graph.to_dict()["frame_rate"] == [30000, 1001]
    graph.frame_rate = Fraction(25)
    assert graph.to_dict()["frame_rate"] == 25
    for wrong in ((24000,), (24000, 1.5), (1, 24), (0, 1)):
        with pytest.raises(package.Error):
            graph.frame_rate = wrong
    assert graph.frame_rate == 25
    scene({**block_scene(), "frame_rate": [24000, 1001]})
    assert "at 24000/1001 a second" in sunder("info", "scene.json").out


def test_a_ratio_does_not_drift():
    """What flies freely for 2400 frames of 1001/24000 s flew 100.1 s."""
    graph = package.Graph.from_dict({"sunder": 2, "frame_rate": [24000, 1001], "frame_range": [0, 2400], "nodes": {
        "cut": {"type": "lattice", "size": [0.1, 0.1, 0.1], "cells": [1, 1, 1]},
        "clay": {"type": "body", "fragments": "@cut.fragments", "velocity": [1, 0, 0]},
        "sim": {"type": "solver", "bodies": ["@clay.body"], "gravity": [0, 0, 0], "substeps": 1}}})
    last = graph.evaluate("sim.state", frame=2400)
    assert last.time == pytest.approx(100.1, rel=1e-13) and last.position[0, 0] == pytest.approx(100.1, rel=1e-12)


def test_exports_have_the_rate_of_the_shot(sunder, scene, tmp_path):
    scene({**shattering_scene(), "frame_range": [1001, 1003], "frame_rate": [30000, 1001]})
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    export(sunder, "-o", "shot.usda")
    text = (tmp_path / "shot.usda").read_text()
    for line in ("timeCodesPerSecond = 29.97002997002997", "startTimeCode = 1001", "endTimeCode = 1003"):
        assert line in text
    export(sunder, "-o", "shot.glb")
    data = (tmp_path / "shot.glb").read_bytes()
    gltf = json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])
    times = gltf["accessors"][gltf["animations"][0]["samplers"][0]["input"]]
    assert times["min"] == [0] and times["max"] == [pytest.approx(2 * 1001 / 30000, rel=1e-6)]


def test_a_bake_of_another_ratio_is_another_bake(sunder, scene):
    scene({**block_scene((1, 2)), "frame_rate": [24000, 1001]})
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    assert sunder("bake", "scene.json", "-o", "bake", "--resume").status == 0
    scene({**block_scene((1, 2)), "frame_rate": 24})
    assert "frame_rate: [24000,1001] was baked, now 24" in sunder("bake", "scene.json", "-o", "bake", "--resume").err


@pytest.mark.parametrize("start", [0, -3, 1001])
def test_a_shot_may_start_at_any_frame(sunder, scene, tmp_path, start):
    """The same shot as from frame 1 on, baked in two goes, and its files are named by its frames."""
    plain = states(package.Graph.from_dict(block_scene((1, 8))), range(1, 9))
    moved = states(package.Graph.from_dict(block_scene((start, start + 7))), range(start, start + 8))
    assert all(same(plain[1 + i], moved[start + i]) for i in range(8))

    scene(block_scene((start, start + 7)))
    assert sunder("bake", "scene.json", "-o", "whole").status == 0
    assert sunder("bake", "scene.json", "-o", "parts", "--frames", f"{start}:{start + 4}").status == 0
    assert sunder("bake", "scene.json", "-o", "parts", "--resume").status == 0
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")
    assert sunder("verify", "whole").status == 0
    names = {f"state/sim.{'-' if f < 0 else ''}{abs(f):0{3 if f < 0 else 4}d}.ply" for f in range(start, start + 8)}
    assert names < set(contents(tmp_path / "whole"))
    bake = package.read_state(tmp_path / "whole" / sorted(names)[0])
    assert same(bake, moved[bake.frame])
