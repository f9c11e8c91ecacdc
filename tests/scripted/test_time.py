"""Frame rates as ratios, first frames of any number, time that runs slower or faster than the frames."""
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


# Time that runs at another pace than the frames. The plain shot of the block is hit, dents and breaks in frames 1 to 8.


@pytest.fixture(scope="module")
def plain():
    return states(package.Graph.from_dict(block_scene((1, 9))), range(1, 10))


def scaled(time_scale, frames=(1, 9), **fields):
    graph = {**block_scene(frames), **fields}
    graph["nodes"]["sim"]["time_scale"] = time_scale
    return package.Graph.from_dict(graph)


def test_a_tenth_over_ten_times_the_frames_has_the_bits_of_the_plain_shot(plain):
    found = states(scaled(0.1, (1, 81)), range(1, 82))
    assert all(same(found[1 + 10 * i], plain[1 + i]) for i in range(9))
    assert (plain[9].edge_intact == 0).any()  # or else it would be no trial
    for f, s in found.items():
        assert s.simulated_frame == pytest.approx(1 + (f - 1) / 10) and s.time_scale == 0.1 and s.frame == f
        assert s.time == pytest.approx((s.simulated_frame - 1) / 24)


@pytest.mark.parametrize("scale,n", [(0.5, 2), (1 / 3, 3), (1 / 7, 7)])
def test_other_scales_have_its_bits_at_common_times(plain, scale, n):
    graph = scaled(scale, (1, 60))
    assert all(same(graph.evaluate("sim.state", 1 + n * i), plain[1 + i]) for i in range(0, 9))


def test_twice_as_fast_and_standing_still(plain):
    fast = states(scaled(2), range(1, 6))
    assert all(same(fast[1 + i], plain[1 + 2 * i]) for i in range(5))
    # A frame's report is of all that was simulated for it.
    assert fast[3].report["edges_broken"] == plain[4].report["edges_broken"] + plain[5].report["edges_broken"]
    still = states(scaled({"keys": [[1, 1], [4, 0], [9, 1]], "interpolation": "step"}, (1, 12)), range(1, 13))
    assert [still[f].simulated_frame for f in still] == [1, 2, 3, 4, 4, 4, 4, 4, 4, 5, 6, 7]
    assert all(same(still[f], plain[int(still[f].simulated_frame)]) for f in still)


def test_a_ramp_is_integrated_exactly(plain):
    """From 1 to 0 in 8 frames: 1 + t - t^2 / 16, which is on grid points at t = 4 and 8."""
    found = states(scaled({"keys": [[1, 1], [9, 0]]}, (1, 20)), range(1, 13))
    for f, s in found.items():
        t = min(f - 1, 8)
        assert s.simulated_frame == 1 + t - t * t / 16
    assert same(found[5], plain[4]) and same(found[9], plain[5]) and same(found[12], plain[5])
    # Sums of keys that binary numbers round come back to the grid.
    uneven = {"keys": [[1, 1], [4, 0.1], [17, 0.1], [20, 1]]}  # 3 * 0.55 + 13 * 0.1 + 3 * 0.55 = 4.6; then whole frames
    assert scaled(uneven, (1, 40)).evaluate("sim.state", 20).simulated_frame == pytest.approx(5.6)


def test_an_edit_of_the_scale_simulates_nothing_anew(plain):
    graph = scaled(1)
    graph.evaluate("sim.state", 9)
    told = []
    for scale in (0.5, {"keys": [[1, 1], [9, 0.2]]}, 1):
        graph["sim"]["time_scale"] = scale
        graph.evaluate("sim.state", 9, progress=lambda _, text: told.append(text))
    assert not [text for text in told if text.startswith("simulating")]


def test_frames_between_lie_between(plain):
    """Within the two states about them, but for what a parabola is beside its chord: an eighth of the change of velocity."""
    found = states(scaled(0.1, (1, 81)), range(1, 82))
    for i in range(8):
        a, b = plain[1 + i], plain[2 + i]
        for name in ("position", "rigid_position"):
            start, end = getattr(a, name), getattr(b, name)
            low, high = np.minimum(start, end).min(0), np.maximum(start, end).max(0)
            bow = np.abs(b.velocity - a.velocity).max() / 24 / 8 if name == "position" else \
                np.abs(b.rigid_velocity - a.rigid_velocity).max() / 24 / 8
            for j in range(1, 10):
                s = found[1 + 10 * i + j]
                assert (getattr(s, name) >= low - bow - 1e-9).all() and (getattr(s, name) <= high + bow + 1e-9).all()
                assert np.allclose(np.linalg.norm(s.orientation, axis=1), 1, atol=1e-12)
                assert np.allclose(np.linalg.det(s.plastic_deformation), 1, atol=1e-6)


def test_edges_break_at_their_time(plain):
    found = states(scaled(0.1, (1, 81)), range(1, 82))
    n = 0
    for i in range(8):
        end = plain[2 + i]
        for j in range(1, 10):
            s = found[1 + 10 * i + j]
            gone = end.broken_edge[end.broken_time <= s.time]
            assert set(s.broken_edge) == set(gone) and (s.edge_intact[gone] == 0).all()
            assert (s.edge_intact == 0).sum() == (plain[1 + i].edge_intact == 0).sum() + len(gone)
            n += len(gone)
    assert n > 0


def spinning(turns, **solver):
    """A bar that flies and turns so often a frame, of eight particles in a row."""
    return {"sunder": 2, "frame_rate": 24, "frame_range": [1, 100], "nodes": {
        "cut": {"type": "lattice", "size": [0.8, 0.1, 0.1], "cells": [8, 1, 1]},
        "bar": {"type": "body", "fragments": "@cut.fragments", "velocity": [0, 1, 4], "angular_velocity": [0, 0, turns * 360 * 24],
                "youngs_modulus": 1e9, "yield": None, "toughness": None},
        "sim": {"type": "solver", "bodies": ["@bar.body"], "substeps": 64, **solver}}}


@pytest.mark.parametrize("turns", [0.05, 0.45, 0.8])
def test_a_spinning_piece_keeps_its_shape(turns):
    graph = package.Graph.from_dict(spinning(turns, time_scale=0.1))
    found = states(graph, range(1, 32))
    length = {f: np.linalg.norm(s.position[7] - s.position[0]) for f, s in found.items()}
    at_grid = [length[f] for f in (1, 11, 21, 31)]
    for f in found:
        assert min(at_grid) - 1e-6 <= length[f] <= max(at_grid) + 1e-6
    # It turns steadily, as often as it does, and flies along a parabola.
    angles = np.unwrap([np.arctan2(*(s.position[7] - s.position[0])[1::-1]) for s in found.values()])
    assert np.allclose(np.diff(angles), 2 * np.pi * turns / 10, rtol=0.02)
    height = np.array([np.average(s.position[:, 2], weights=s.mass) for s in found.values()])
    assert np.abs(np.diff(height, 2) + 9.81 / 240**2).max() < 0.2 * 9.81 / 240**2


def test_keys_of_all_else_are_in_simulated_frames():
    """A pinned plank is moved as far at half the pace, twice as late."""
    def shot(scale):
        graph = {"sunder": 2, "frame_rate": 24, "frame_range": [1, 20], "nodes": {
            "cut": {"type": "lattice", "size": [1.2, 0.2, 0.2], "cells": [6, 1, 1]},
            "plank": {"type": "body", "fragments": "@cut.fragments"},
            "hand": {"type": "pin", "body": "@plank.body", "region": "box", "box_min": [-1, -1, -1], "box_max": [1, 1, 1],
                     "position": {"keys": [[2, [0, 0, 0]], [6, [0, 0, 0.4]]]}},
            "sim": {"type": "solver", "bodies": ["@plank.body"], "pins": ["@hand.pin"], "time_scale": scale,
                    "gravity": {"keys": [[1, [0, 0, 0]], [5, [0, 0, -9.81]]]}}}}
        return package.Graph.from_dict(graph)
    slow, fast = shot(0.5), shot(1)
    for f in range(1, 8):
        assert same(slow.evaluate("sim.state", 2 * f - 1), fast.evaluate("sim.state", f))
    z = [slow.evaluate("sim.state", f).position[:, 2].mean() for f in range(1, 14)]
    assert z[6] == pytest.approx(0.2, abs=1e-6) and z[7] == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize("moves", [{}, {"position": {"keys": [[1, [0, 0, 0]], [11, [0.5, 0, 0.3]]]}},
                                   {"rotation": {"keys": [[1, [0, 0, 0]], [11, [0, 0, 90]]]}}], ids=["still", "moved", "turned"])
def test_what_is_pinned_is_where_its_pin_is_between_frames(moves):
    """A plank falls about its clamp, and is torn to and fro: its clamped end is where a shot of ten times the rate has it."""
    def shot(n, **solver):
        slow = {name: {"keys": [[1 + (f - 1) * n, v] for f, v in keys["keys"]]} for name, keys in moves.items()}
        return package.Graph.from_dict({"sunder": 2, "frame_rate": 24 * n, "frame_range": [1, 200], "nodes": {
            "cut": {"type": "lattice", "size": [1.2, 0.2, 0.2], "cells": [12, 2, 2], "center": [0.6, 0, 0]},
            "plank": {"type": "body", "fragments": "@cut.fragments"},
            "clamp": {"type": "pin", "body": "@plank.body", "region": "box", "box_min": [-1, -1, -1], "box_max": [0.1, 1, 1], **slow},
            "sim": {"type": "solver", "bodies": ["@plank.body"], "pins": ["@clamp.pin"], **solver}}})
    slow, fine = states(shot(1, time_scale=0.1), range(1, 102)), states(shot(10), range(1, 102))
    pinned = slow[1].rest_position[:, 0] < 0.1
    assert pinned.sum() == 4
    # Euler angles go by their keys in ten steps, or turn steadily in one: the same about one axis.
    for f, s in slow.items():
        assert np.abs(s.position[pinned] - fine[f].position[pinned]).max() < 1e-12, f
    tip = np.array([s.position[-1] for s in slow.values()])
    assert np.linalg.norm(np.diff(tip[::10], axis=0), axis=1).max() > 0.1  # m a frame: or else it would be no trial
    if not moves:
        assert all(np.array_equal(s.position[pinned], slow[1].position[pinned]) for s in slow.values())


def test_velocities_of_meshes_are_those_that_are_seen():
    graph = spinning(0.01, time_scale=0.25)
    graph["nodes"]["skin"] = {"type": "deformer", "body": "@bar.body", "state": "@sim.state"}
    shot = package.Graph.from_dict(graph)
    for frame in (5, 6, 7):  # 5 is a grid point
        before, mesh, after = (np.array(shot.evaluate("skin.mesh", f).positions, float) for f in (frame - 1, frame, frame + 1))
        seen = (after - before) * 12
        velocity = shot.evaluate("skin.mesh", frame).velocities
        assert np.abs(velocity - seen).max() < 0.03 * np.linalg.norm(seen, axis=1).max()


RAMP = {"keys": [[1, 1], [3, 0.4], [9, 0.1], [12, 0], [14, 0], [15, 2]]}


@pytest.mark.parametrize("scale", [0.3, RAMP])
@pytest.mark.parametrize("has_states", [True, False])
def test_a_bake_resumes_to_the_same_bits(sunder, scene, tmp_path, scale, has_states):
    graph = block_scene((0, 17))
    graph["nodes"]["sim"]["time_scale"] = scale
    if not has_states:
        del graph["nodes"]["cache"]
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "whole").status == 0
    for end in (0, 1, 5, 13, 17):
        done = sunder("bake", "scene.json", "-o", "parts", "--resume", "--frames", f"0:{end}")
        assert done.status == 0, done.err
        assert sunder("verify", "parts").status == 0
    done = contents(tmp_path / "whole"), contents(tmp_path / "parts")
    assert {n: d for n, d in done[0].items() if n != "manifest.json"} == {n: d for n, d in done[1].items() if n != "manifest.json"}
    if has_states:
        state = package.read_state(tmp_path / "whole/state/sim.0005.ply")
        assert state.frame == 5 and state.simulated_frame == package.Graph.from_dict(graph).evaluate("sim.state", 5).simulated_frame
        clock = b"property double simulated_frame"
        assert clock in done[0]["state/sim.0005.ply"] and (scale == 0.3) == (clock in done[0]["state/sim.0000.ply"])


def test_exports_have_colliders_where_they_were(sunder, scene, tmp_path):
    graph = block_scene((1, 9))
    graph["nodes"]["sim"]["time_scale"] = 0.5
    graph["nodes"]["floor"] = {"type": "collider", "shape": "box", "size": [1, 1, 0.1], "position": {"keys": [[1, [0, 0, -1]], [5, [0, 0, -0.6]]]}}
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    export(sunder, "-o", "shot.usda")
    text = (tmp_path / "shot.usda").read_text()
    at = text.index("xformOp:translate.timeSamples", text.index('"floor"'))
    z = [float(line.split(",")[-1 if line.rstrip().endswith(")") else -2].strip(" )")) for line in text[at:].split("\n")[1:10]]
    assert z == pytest.approx([-1 + 0.05 * i for i in range(9)])


def test_bad_scales_are_refused():
    for wrong in (-0.1, "slow", None, {"keys": [[1, -1]]}):
        with pytest.raises(package.Error) as caught:
            scaled(wrong)
        assert caught.value.parameter == "time_scale"
    far = scaled(1000, (1, 5000))
    with pytest.raises(package.Error, match="beyond simulated frame 1000000"):
        far.evaluate("sim.state", 5000)
