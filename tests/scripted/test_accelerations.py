"""Accelerations of vertices, for curved motion blur: those of what is blended between two simulated frames."""
import numpy as np
import pytest

import sunder as package
from test_export import export
from test_subframes import with_steps

RATE = 24.0
GRAVITY = np.array([0, 0, -9.81])


def thrown(turns=0.1, time_scale=1, gravity=GRAVITY, **solver):
    """A bar in one piece, thrown and spinning so often a frame about its axis of most inertia; drawn by its skin."""
    return {"sunder": 2, "frame_rate": RATE, "frame_range": [1, 12], "nodes": {
        "cut": {"type": "lattice", "size": [0.8, 0.2, 0.1], "cells": [4, 1, 1]},
        "bar": {"type": "body", "fragments": "@cut.fragments", "velocity": [3, 1, 4], "youngs_modulus": 1e9, "yield": None,
                "toughness": None, "angular_velocity": [0, 0, turns * 360 * RATE]},
        "sim": {"type": "solver", "bodies": ["@bar.body"], "substeps": 64, "gravity": list(gravity), "time_scale": time_scale,
                "accelerations": True, **solver},
        "skin": {"type": "deformer", "body": "@bar.body", "state": "@sim.state", "topology": "constant"},
        "out": {"type": "bake_mesh", "mesh": "@skin.mesh"}}}


def mesh_at(graph, frame):
    return graph.evaluate("skin.mesh", frame)


@pytest.mark.parametrize("turns", [0, 0.02, 0.1, 0.3])
@pytest.mark.parametrize("frame", [1, 5, 5.5])
@pytest.mark.parametrize("substeps", [4, 8, 64])
def test_a_thrown_fragment_accelerates_by_gravity_and_its_spin(turns, frame, substeps):
    graph = package.Graph.from_dict(thrown(turns, substeps=substeps))
    mesh = mesh_at(graph, frame)
    state = graph.evaluate("sim.state", frame)
    centre, spin = np.average(state.position, axis=0, weights=state.mass), np.array([0, 0, turns * 2 * np.pi * RATE])
    wanted = GRAVITY + np.cross(spin, np.cross(spin, mesh.positions - centre))
    error = np.linalg.norm(mesh.accelerations - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert error.max() < 0.01


def drawn(mesh, seconds, is_curved=True):
    moved = mesh.positions + seconds * mesh.velocities.astype(float)
    return moved + (seconds**2 / 2 * mesh.accelerations if is_curved else 0)


@pytest.mark.parametrize("turns,share,substeps", [(0, 0.001, 64), (0.02, 0.05, 64), (0.1, 0.12, 64), (0.2, 0.23, 64), (0, 0.001, 8),
                                                  (0.02, 0.07, 8), (0.1, 0.22, 8), (0.2, 0.35, 8), (0, 0.001, 4), (0.1, 0.4, 4)])
@pytest.mark.parametrize("scale", [1, 0.4])
def test_half_a_frame_drawn_with_them_is_nearer_to_what_is_shown_there(turns, share, substeps, scale):
    """share: of the error without them, which is that of what a fall or turn curves (with n substeps that of a fall is
    g h^2 / 8 +- g h^2 / 4n, for a state's velocities are of half a substep before)."""
    graph = package.Graph.from_dict(thrown(turns, scale, substeps=substeps))
    plain = package.Graph.from_dict(thrown(turns, scale, substeps=substeps, accelerations=False))
    for frame in (5, 6, 7.5) if scale == 1 else (5, 7.5):  # these are blended, with velocities of that motion
        mesh, without = mesh_at(graph, frame), mesh_at(plain, frame)
        for half in (-0.5, 0.5):
            shown = mesh_at(graph, frame + half).positions
            errors = [np.linalg.norm(drawn(m, half / RATE, curved) - shown, axis=1).max()
                      for m, curved in ((without, False), (mesh, True))]
            assert errors[1] < share * errors[0] + 1e-6, (frame, half, errors)  # m: single precision


@pytest.mark.parametrize("substeps", [4, 16])
@pytest.mark.parametrize("stiffness", [1e3, 1e5, 1e9])
def test_what_falls_is_as_fast_as_its_way_says_however_its_steps_go(substeps, stiffness):
    """Velocities of steps in pairs do not lag."""
    graph = thrown(0, substeps=substeps)
    graph["nodes"]["cut"] = {"type": "lattice", "size": [0.3, 0.3, 0.3], "cells": [3, 3, 3]}
    graph["nodes"]["bar"]["youngs_modulus"] = stiffness
    graph = package.Graph.from_dict(graph)
    before, mesh, after = (mesh_at(graph, frame) for frame in (5, 6, 7))
    error = mesh.velocities.mean(axis=0) - (after.positions - before.positions).astype(float).mean(axis=0) * RATE / 2
    assert np.linalg.norm(error) < 1e-2 * 9.81 / RATE / 16, error


def test_they_are_those_that_are_seen_where_the_time_scale_changes():
    """x(s(t)): v s'' + a s'^2, s'' from the keys. Without gravity and spin all of it is v s''."""
    ramp = {"keys": [[1, 1], [7, 0.4], [9, 0.4]]}
    graph = package.Graph.from_dict(thrown(0, ramp, gravity=(0, 0, 0)))
    for frame, slope in ((1, -0.1), (4, -0.1), (4.5, -0.1), (7, 0), (8, 0)):
        wanted = np.array([3, 1, 4]) * slope * RATE
        assert np.allclose(mesh_at(graph, frame).accelerations, wanted, atol=1e-4)
    # A ramp out of a standstill, where no velocity is seen.
    start = package.Graph.from_dict(thrown(0, {"keys": [[4, 0], [8, 1]]}))
    assert np.allclose(mesh_at(start, 4).velocities, 0)
    assert np.allclose(mesh_at(start, 4).accelerations, np.array([3, 1, 4]) * 0.25 * RATE, atol=1e-4)
    spinning = package.Graph.from_dict(thrown(0.05, ramp))
    mesh, (before, after) = mesh_at(spinning, 4), (mesh_at(spinning, 4 + d).positions.astype(float) for d in (-0.5, 0.5))
    seen = (after - 2 * mesh.positions + before) * (2 * RATE)**2
    assert np.abs(seen - mesh.accelerations).max() < 0.05 * np.linalg.norm(mesh.accelerations, axis=1).max()


def test_what_rests_and_what_lands():
    graph = thrown(0)
    graph["nodes"]["floor"] = {"type": "collider", "shape": "plane"}
    graph["nodes"]["sim"]["colliders"] = ["@floor.collider"]
    graph["nodes"]["cut"]["center"] = [0, 0, 0.05]
    graph["nodes"]["bar"]["velocity"] = [0, 0, 0]
    shot = package.Graph.from_dict(graph)
    # What stands does not begin to fall within a frame: a thousandth of gravity's 9 mm.
    assert np.abs(mesh_at(shot, 8).accelerations).max() / RATE**2 / 2 < 1e-5
    # Whatever part of a frame a hit comes at: what is drawn is no worse for it.
    for height in np.linspace(0.2, 0.4, 9):
        graph["nodes"]["cut"]["center"] = [0, 0, height]
        shot = package.Graph.from_dict(graph)
        for frame in range(1, 11):
            mesh, shown = mesh_at(shot, frame), mesh_at(shot, frame + 0.5).positions
            errors = [np.linalg.norm(drawn(mesh, 0.5 / RATE, curved) - shown, axis=1).max() for curved in (False, True)]
            assert errors[1] <= errors[0] + 1e-6


def test_nothing_is_told_unless_it_is_asked_for():
    graph = thrown(0.1)
    graph["nodes"]["sim"]["accelerations"] = False
    plain, asked = package.Graph.from_dict(graph), package.Graph.from_dict(thrown(0.1))
    told = []
    a, b = plain.evaluate("skin.mesh", 5, lambda _, text: told.append(text)), mesh_at(asked, 5)
    assert a.accelerations.size == 0 and len(b.accelerations) == len(b.positions)
    for name in ("positions", "normals", "triangles"):
        assert np.array_equal(getattr(a, name), getattr(b, name))
    # What a step tells of its way is by half of it earlier: velocities catch up with what accelerates.
    ahead = b.accelerations / (2 * 64 * RATE)
    assert np.abs(a.velocities + ahead - b.velocities).max() < 1e-5 and np.abs(ahead).max() > 0.01
    # Whoever asked before, without them velocities are the state's.
    asked["sim"]["accelerations"] = False
    assert np.array_equal(mesh_at(asked, 5).velocities, a.velocities)
    assert "simulating frame 5" in told and "simulating frame 6" not in told
    # Turned on, it simulates the next frame alone.
    plain["sim"]["accelerations"] = True
    told.clear()
    c = plain.evaluate("skin.mesh", 5, lambda _, text: told.append(text))
    assert np.array_equal(c.accelerations, b.accelerations)
    assert {text for text in told if text.startswith("simulating frame")} == {"simulating frame 6"}


def test_files_and_exports_have_them(sunder, scene, tmp_path):
    graph = with_steps(thrown(0.1), out=2)
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    for end in (3, 7, 12):
        assert sunder("bake", "scene.json", "-o", "parts", "--resume", "--frames", f"1:{end}").status == 0
    for path in (tmp_path / "bake/mesh").iterdir():
        assert path.read_bytes() == (tmp_path / "parts/mesh" / path.name).read_bytes()
    head, rows = (tmp_path / "bake/mesh/mesh.0005_500.ply").read_bytes().split(b"end_header\n", 1)
    names = [line.split()[-1] for line in head.decode().split("element face")[0].split("\n") if line.startswith("property")]
    assert names[-6:] == ["vx", "vy", "vz", "ax", "ay", "az"]
    mesh = package.Graph.from_dict(graph).evaluate("skin.mesh", 5.5)
    vertices = np.frombuffer(rows, np.dtype([(n, "<i4" if n == "fragment" else "<f4") for n in names]), len(mesh.positions))
    assert np.array_equal(np.stack([vertices["a" + n] for n in "xyz"], 1), mesh.accelerations)
    export(sunder, "-o", "shot.usda")
    text = (tmp_path / "shot.usda").read_text()
    at = text.index("vector3f[] accelerations.timeSamples")
    line = next(line for line in text[at:].split("\n") if line.strip().startswith("5.5:"))
    first = [float(x) for x in line.split("(")[1].split(")")[0].split(",")]
    assert np.allclose(first, mesh.accelerations[0], rtol=1e-6)
