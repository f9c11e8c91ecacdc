"""What bodies hit and hang on deforms with an animation: colliders push with the speed of their skin, pins go where it takes them."""
import numpy as np
import pytest

import sunder as package
from conftest import contents, obj_text

RATE = 24
CELLS = 8   # of the plate, along each side
THICK = 0.01


def plate():
    """(v, 3) vertices and faces of a closed plate of 1 m in the plane z = 0, its vertices as an OBJ file is read: by first use."""
    n = CELLS + 1
    grid = np.array([(x / CELLS - 0.5, y / CELLS - 0.5) for x in range(n) for y in range(n)])
    vertices = np.concatenate([np.c_[grid, np.zeros(n * n)], np.c_[grid, np.full(n * n, -THICK)]])
    top = [(x * n + y, (x + 1) * n + y, (x + 1) * n + y + 1, x * n + y + 1) for x in range(CELLS) for y in range(CELLS)]
    rim = [k * n for k in range(CELLS)] + [CELLS * n + k for k in range(CELLS)] + \
        [k * n + CELLS for k in range(CELLS, 0, -1)] + list(range(CELLS, 0, -1))
    sides = [(a + n * n, b + n * n, b, a) for a, b in zip(rim, rim[1:] + rim[:1])]
    faces = top + [tuple(v + n * n for v in reversed(face)) for face in top] + sides
    order = list(dict.fromkeys(v for face in faces for v in face))
    number = {old: new + 1 for new, old in enumerate(order)}
    return vertices[order], [tuple(number[v] for v in face) for face in faces]


VERTICES, FACES = plate()


def swept(points, frame, speed=10.0):
    """Where points of the plate are: its middle goes at `speed` (m/s), its rim at two thirds of that."""
    lag = (points[..., :2] ** 2).sum(axis=-1)
    out = np.array(points, float)
    out[..., 2] += -0.05 + speed * (frame - 1) / RATE * (1 - 0.67 * lag)
    return out


def frames_of(motion, last=12):
    return np.stack([motion(VERTICES, frame) for frame in range(1, last + 1)])


@pytest.fixture
def rig(tmp_path):
    (tmp_path / "plate.obj").write_text(obj_text(VERTICES.tolist(), FACES))
    np.save(tmp_path / "motion.npy", frames_of(swept))
    return tmp_path


CRUMBS = {"type": "lattice", "size": [0.06, 0.06, 0.06], "cells": [6, 6, 6], "center": [0, 0, 0.03]}


def shot(plate=None, body=None, solver=None, **others):
    """A brittle block of fragments of 10 mm, above a plate that comes from below at 10 m/s: 417 mm a frame."""
    nodes = {
        "mesh": {"type": "mesh_file", "path": "plate.obj"},
        "cut": CRUMBS,
        "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e6, "toughness": 0.003, **(body or {})},
        "plate": {"type": "collider", "shape": "mesh", "mesh": "@mesh.mesh", "motion": "vertices", "motion_path": "motion.npy",
                  **(plate or {})},
        "solver": {"type": "solver", "bodies": ["@body.body"], "colliders": ["@plate.collider"], "gravity": [0, 0, 0],
                   **(solver or {})},
        "cache": {"type": "bake_state", "state": "@solver.state", "path": "state/sim.####.ply"},
        **others,
    }
    return {"sunder": 2, "frame_rate": RATE, "frame_range": [1, 8], "nodes": nodes}


def state_of(description, folder, frame, threads=1):
    graph = package.Graph.from_dict(description, str(folder))
    graph.set_threads(threads)
    return graph.evaluate("solver.state", frame=frame)


def test_nothing_tunnels_at_10_m_per_s(rig):
    for frame in (2, 3, 5):
        state = state_of(shot(), rig, frame)
        above = state.position[:, 2] - swept(state.position * [1, 1, 0], frame)[:, 2]
        assert above.min() > -0.005, frame  # half a fragment
        assert state.velocity[:, 2].min() > 8
    assert not state.edge_intact.all()


def test_a_motion_as_one_gives_what_keys_give(rig):
    def rising(points, frame):
        return points + [0, 0, -0.03 + 2.0 * (frame - 1) / RATE]

    np.save(rig / "motion.npy", frames_of(rising))
    keys = {"keys": [[1, [0, 0, -0.03]], [12, [0, 0, -0.03 + 2.0 * 11 / RATE]]]}
    body = {"toughness": None}
    ours = state_of(shot(body=body), rig, 6)
    grid = state_of(shot({"motion": "transform", "position": keys, "voxel_size": 0.005}, body), rig, 6)
    momenta = [(s.mass[:, None] * s.velocity).sum(axis=0) for s in (ours, grid)]
    # A grid has its surface where single precision has it, and rounds edges off that nothing touches here.
    assert np.linalg.norm(momenta[0] - momenta[1]) < 1e-3 * np.linalg.norm(momenta[1])
    assert np.abs(ours.position - grid.position).max() < 1e-4
    assert momenta[0][2] > 1.9 * ours.mass.sum()


def test_it_rests_on_what_does_not_move_and_goes_with_what_carries_it(rig):
    def carrying(points, frame):  # stands for 20 frames, then bends its rim up and goes along x
        t = max(0, frame - 20)
        out = points + [0.01 * t, 0, 0]
        out[:, 2] += 0.002 * t * points[:, 0] ** 2
        return out

    np.save(rig / "motion.npy", frames_of(carrying, 40))
    wanted = shot(body={"toughness": None, "friction": 1}, solver={"gravity": [0, 0, -9.81]}, plate={"friction": 1})
    wanted["frame_range"] = [1, 40]
    still, carried = state_of(wanted, rig, 20), state_of(wanted, rig, 40)
    assert np.abs(still.velocity).max() < 1e-3
    assert abs((carried.position - still.position)[:, 0].mean() - 0.2) < 0.01


@pytest.mark.parametrize("given", [{}, {"motion_source": "values"}])
def test_any_number_of_threads_a_resume_and_values_give_the_same_bits(sunder, scene, rig, given):
    if given:
        given = {**given, "motion_path": "", "positions": frames_of(swept).reshape(-1, 3).tolist()}
    whole = state_of(shot(), rig, 5)
    assert np.array_equal(whole.position, state_of(shot(given), rig, 5, threads=3).position)
    scene(shot(given))
    for folder, frames in (("whole", ["1:6"]), ("parts", ["1:2", "1:3", "1:6"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(rig / "whole") == contents(rig / "parts")


def test_it_is_told_in_simulated_frames(rig):
    slow = shot(solver={"time_scale": 0.25})
    slow["frame_range"] = [1, 20]
    for frame, at in ((9, 3), (17, 5)):
        assert np.array_equal(state_of(slow, rig, frame).position, state_of(shot(), rig, at).position)


def test_activations_wake_what_it_comes_over(rig):
    wait = {"type": "activate", "body": "@body.body", "until": "object", "object": "@plate.collider"}
    wanted = shot(wait=wait, solver={"bodies": ["@wait.body"], "colliders": []})
    kept = [state_of(wanted, rig, frame).kept.all() for frame in (1, 2)]
    assert kept == [True, False]


def test_a_sheet_needs_a_thickness(rig):
    top = [face for face in FACES if all(abs(VERTICES[v - 1][2]) < 1e-9 for v in face)]
    used = sorted({v for face in top for v in face}, key=[v for face in top for v in face].index)
    number = {v: k + 1 for k, v in enumerate(used)}
    sheet = VERTICES[np.array(used) - 1]
    (rig / "plate.obj").write_text(obj_text(sheet.tolist(), [tuple(number[v] for v in face) for face in top]))
    np.save(rig / "motion.npy", np.stack([swept(sheet, frame) for frame in range(1, 13)]))
    with pytest.raises(package.Error, match="'plate', parameter 'mesh'.*open edges.*thickness"):
        state_of(shot(), rig, 2)
    state = state_of(shot({"thickness": 0.01}), rig, 3)
    assert (state.position[:, 2] - swept(state.position * [1, 1, 0], 3)[:, 2]).min() > 0


def wrong(rig, array=None, **plate):
    if array is not None:
        np.save(rig / "motion.npy", array)
    with pytest.raises(package.Error) as caught:
        state_of(shot(plate), rig, 2)
    assert "plate" in str(caught.value)
    return str(caught.value)


def test_what_is_wrong_is_told_with_its_place(rig):
    good = frames_of(swept)
    assert "vertices a frame, the mesh has" in wrong(rig, good[:, :-1])
    bad = good.copy()
    bad[4, 17, 1] = np.inf
    assert "vertex 17 is not finite at frame 5" in wrong(rig, bad)
    inside = good.copy()
    inside[6] *= [-1, 1, 1]
    assert "turned inside out at frame 7" in wrong(rig, inside)
    flat = good.copy()
    a, b, c = (v - 1 for v in FACES[0][:3])
    flat[6, a] = (flat[6, b] + flat[6, c]) / 2
    assert "squeezed flat at frame 7" in wrong(rig, flat)
    assert "(frames, vertices, 3)" in wrong(rig, good[0])
    assert "it has no frame" in wrong(rig, good[:0])
    assert "no file is given" in wrong(rig, motion_path="")
    assert "positions for" in wrong(rig, motion_source="values", positions=[[0, 0, 0]] * 3)


# Pins.

def bar(tmp_path, pin=None, last=12):
    """A bar of 2 m along x, cut in pieces, pinned at its left end to its own mesh, which bends there."""
    box = np.array([(x, y, z) for x in np.linspace(0, 2, 9) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    quads = []
    for k in range(8):
        p, q = 4 * k, 4 * k + 4
        quads += [(p, q, q + 1, p + 1), (p + 2, p + 3, q + 3, q + 2), (p, p + 2, q + 2, q), (p + 1, q + 1, q + 3, p + 3)]
    quads += [(0, 1, 3, 2), (32, 34, 35, 33)]
    order = list(dict.fromkeys(v for quad in quads for v in quad))
    number = {old: new + 1 for new, old in enumerate(order)}
    rest = box[order]
    (tmp_path / "bar.obj").write_text(obj_text(rest.tolist(), [tuple(number[v] for v in quad) for quad in quads]))
    np.save(tmp_path / "bar.npy", np.stack([waved(rest, frame) for frame in range(1, last + 1)]))
    nodes = {
        "mesh": {"type": "mesh_file", "path": "bar.obj"},
        "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": 20},
        "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e6},
        "pin": {"type": "pin", "body": "@body.body", "mesh": "@mesh.mesh", "region": "box", "box_min": [-1, -1, -1],
                "box_max": [1, 1, 1], "motion": "vertices", "motion_path": "bar.npy", **(pin or {})},
        "solver": {"type": "solver", "bodies": ["@body.body"], "pins": ["@pin.pin"], "gravity": [0, 0, 0]},
        "cache": {"type": "bake_state", "state": "@solver.state", "path": "state/sim.####.ply"},
    }
    return {"sunder": 2, "frame_rate": RATE, "frame_range": [1, 12], "nodes": nodes}


def waved(points, frame):
    """Left of x = 1 it shears up and is drawn along; right of that it is turned inside out, which no pin asks for."""
    out = np.array(points, float)
    t = 0.02 * (frame - 1)
    out[:, 2] += t * out[:, 0]
    out[:, 0] += 2 * t
    far = points[:, 0] > 1.6
    out[far, 2] *= -1
    return out


def held(state):
    return state.rest_position[:, 0] < 1


def test_pinned_fragments_go_with_the_mesh(tmp_path):
    graph = package.Graph.from_dict(bar(tmp_path), str(tmp_path))
    for frame in (2, 7, 12):
        state = graph.evaluate("solver.state", frame=frame)
        near = state.rest_position[:, 0] < 0.8  # whose skin is all in what shears evenly
        t = 0.02 * (frame - 1)
        wanted = state.rest_position + np.c_[0 * state.rest_position[:, 0] + 2 * t, 0 * state.rest_position[:, 0],
                                            t * state.rest_position[:, 0]]
        assert near.sum() > 3
        assert np.abs(state.position - wanted)[near].max() < 1e-9
    moved = 0.02 * RATE * np.c_[0 * state.mass + 2, 0 * state.mass, state.rest_position[:, 0]]
    # Between frames it turns as a whole, by 0.01 rad: so the last step's way is off the frame's by half of that.
    assert np.linalg.norm(state.velocity - moved, axis=1)[near].max() < 0.005 * 0.5


def test_a_pin_lets_go_of_what_the_mesh_took_along(tmp_path):
    for extra in ({}, {"release_frames": 3}):
        graph = package.Graph.from_dict(bar(tmp_path, {"release_frame": 5, **extra}), str(tmp_path))
        at, after = (graph.evaluate("solver.state", frame=frame) for frame in (5, 12))
        near = at.rest_position[:, 0] < 0.8
        away = [np.abs(s.position - (s.rest_position + 0.02 * (s.frame - 1) * np.c_[
            0 * s.mass + 2, 0 * s.mass, s.rest_position[:, 0]]))[near].max() for s in (at, after)]
        assert away[0] < 1e-9 and away[1] > 0.003
        # It goes on along x by itself: as fast as it was drawn, or up to twice, as what springs does that was at rest.
        speed = (after.mass * after.velocity[:, 0]).sum() / after.mass.sum()
        assert 0.5 * 0.96 < speed < 2 * 0.96
        assert np.abs(after.position - after.rest_position)[:, 0].mean() > 0.2


def test_a_hinge_holds_places_alone(tmp_path):
    clamp, hinge = (package.Graph.from_dict(bar(tmp_path, {"hold": hold}), str(tmp_path)).evaluate("solver.state", frame=8)
                    for hold in ("pose", "position"))
    assert np.abs(clamp.position - hinge.position)[held(clamp)].max() < 1e-9
    assert np.abs(clamp.orientation - hinge.orientation)[held(clamp)].max() > 1e-6


def test_a_pin_resumes_to_the_same_bits(sunder, scene, tmp_path):
    scene(bar(tmp_path, {"release_frame": 6, "release_frames": 2}))
    for folder, frames in (("whole", ["1:9"]), ("parts", ["1:3", "1:7", "1:9"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")


def test_a_pin_says_what_is_wrong_of_its_own_fragments_alone(tmp_path):
    description = bar(tmp_path)
    motion = np.load(tmp_path / "bar.npy")
    motion[5] *= [1, 1, 0]
    np.save(tmp_path / "bar.npy", motion)
    with pytest.raises(package.Error, match="'pin'.*squeezed flat at frame 6"):
        package.Graph.from_dict(description, str(tmp_path)).evaluate("solver.state", frame=7)
    np.save(tmp_path / "bar.npy", motion[:, :-1])
    with pytest.raises(package.Error, match="'pin', parameter 'motion_path'.*vertices a frame"):
        package.Graph.from_dict(description, str(tmp_path)).evaluate("solver.state", frame=2)
    description["nodes"]["pin"].pop("mesh")
    with pytest.raises(package.Error, match="'pin', parameter 'mesh'.*is not wired"):
        package.Graph.from_dict(description, str(tmp_path)).evaluate("solver.state", frame=2)


# Pins that go with another mesh.

def carried(tmp_path, motion, pin=None, last=12):
    """The bar, pinned to the plate, which lies 0.37 m above it and goes as `motion`(points, frame) says."""
    description = bar(tmp_path)
    (tmp_path / "plate.obj").write_text(obj_text(VERTICES.tolist(), FACES))
    np.save(tmp_path / "motion.npy", np.stack([motion(VERTICES + [0.521, 0.013, 0.37], frame) for frame in range(1, last + 1)]))
    description["nodes"]["plate"] = {"type": "mesh_file", "path": "plate.obj"}
    description["nodes"]["pin"].update(mesh="@plate.mesh", motion="surface", motion_path="motion.npy", **(pin or {}))
    return description


def turned(axis, angle):
    x, y, z = axis / np.linalg.norm(axis)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def swinging(points, frame):
    return points @ turned(np.array([1.0, 2, -1]), 0.2 * (frame - 1)).T + np.array([0.1, 0, 0.03]) * (frame - 1)


def curling(points, frame):
    """Bends about y, is sheared and stretched in its plane, and swings besides."""
    t = 0.05 * (frame - 1)
    angle = (t + 1e-9) * points[:, 0]
    out = np.c_[np.sin(angle) * (1 / (t + 1e-9) - points[:, 2]), points[:, 1] * (1 + t) + t * points[:, 0],
                (1 - np.cos(angle)) / (t + 1e-9) + points[:, 2] * np.cos(angle)]
    return swinging(out, frame)


def matrices(orientation):
    w, x, y, z = orientation.T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def triangles_of_plate():
    return np.array([(face[0], *pair) for face in FACES for pair in zip(face[1:], face[2:])]) - 1


def in_the_plate(points, corners):
    """Of triangles that lie in a plane of equal z, which each point lies above, and its weights there."""
    a, b, c = corners.transpose(1, 0, 2)
    edges = np.stack([b - a, c - a], axis=2)[:, :2]
    flat = np.abs(np.linalg.det(edges)) > 1e-9
    found = []
    for point in points:
        u, v = np.einsum("nij,nj->in", np.linalg.inv(edges[flat]), (point - a[flat])[:, :2])
        inside = np.flatnonzero(flat)[(u >= 0) & (v >= 0) & (u + v <= 1)]
        best = inside[np.argmin(np.abs(a[inside, 2] - point[2]))]
        at = np.flatnonzero(np.flatnonzero(flat) == best)[0]
        found.append((best, np.array([1 - u[at] - v[at], u[at], v[at]])))
    return found


def frame_matrix(a, b, c):
    normal = np.cross(b - a, c - a)
    return np.stack([b - a, c - a, normal / np.linalg.norm(normal)], axis=1)


@pytest.mark.parametrize("motion", [swinging, curling])
def test_pinned_fragments_go_as_the_nearest_triangle_takes_them(tmp_path, motion):
    graph = package.Graph.from_dict(carried(tmp_path, motion), str(tmp_path))
    rest = graph.evaluate("solver.state", frame=1)
    pinned = held(rest)
    center, own = rest.rest_position[pinned], matrices(rest.orientation[pinned])
    places = np.load(tmp_path / "motion.npy")
    triangles = triangles_of_plate()
    ties = in_the_plate(center, places[0][triangles])
    assert pinned.sum() > 5 and len({triangle for triangle, _ in ties}) > 3
    for frame in (1, 2, 7, 12):
        state = graph.evaluate("solver.state", frame=frame)
        for k, (triangle, weight) in enumerate(ties):
            before, now = (places[f][triangles[triangle]] for f in (0, frame - 1))
            left, _, right = np.linalg.svd(frame_matrix(*now) @ np.linalg.inv(frame_matrix(*before)))
            turn = left @ right  # its best rotation
            wanted = weight @ now + turn @ (center[k] - weight @ before)
            assert np.abs(state.position[pinned][k] - wanted).max() < 1e-9, frame
            assert np.abs(matrices(state.orientation[pinned][k:k + 1])[0] - turn @ own[k]).max() < 1e-9, frame


def test_it_is_let_go_as_fast_as_the_other_mesh_took_it_along(tmp_path):
    graph = package.Graph.from_dict(carried(tmp_path, swinging, {"release_frame": 6, "box_max": [3, 1, 1]}), str(tmp_path))
    at, after = (graph.evaluate("solver.state", frame=frame) for frame in (6, 7))
    assert np.abs(at.position - swinging(at.rest_position, 6)).max() < 1e-12
    drawn = (swinging(at.rest_position, 6) - swinging(at.rest_position, 5)) * RATE  # in a frame the centre goes straight
    going, wanted = ((at.mass[:, None] * v).sum(axis=0) / at.mass.sum() for v in (after.velocity, drawn))
    assert np.linalg.norm(going - wanted) < 1e-9 * np.linalg.norm(wanted)
    assert np.abs(after.position - swinging(at.rest_position, 7)).max() > 0.003  # it goes on by itself


def test_a_pin_on_another_mesh_has_the_same_bits_by_any_threads_and_resumed(sunder, scene, tmp_path):
    description = carried(tmp_path, curling, {"release_frame": 6, "release_frames": 2})
    assert np.array_equal(state_of(description, tmp_path, 9).position, state_of(description, tmp_path, 9, threads=3).position)
    scene(description)
    for folder, frames in (("whole", ["1:9"]), ("parts", ["1:3", "1:7", "1:9"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(tmp_path / "whole") == contents(tmp_path / "parts")


def test_a_pin_on_another_mesh_belongs_to_it_as_both_are_at_the_first_frame(tmp_path):
    description = carried(tmp_path, swinging)
    states = {}
    for start in (1, 4):
        description["frame_range"] = [start, 12]
        states[start] = state_of(description, tmp_path, start)
        assert np.abs(states[start].position - states[start].rest_position).max() < 1e-12
    later = state_of(description, tmp_path, 7)
    pinned = held(later)
    turn = turned(np.array([1.0, 2, -1]), 0.6)
    assert np.abs(matrices(later.orientation)[pinned] - turn @ matrices(states[4].orientation)[pinned]).max() < 1e-9


def test_what_is_wrong_with_another_mesh_is_told(tmp_path):
    description = carried(tmp_path, swinging)
    places = np.load(tmp_path / "motion.npy")

    def refused(given, match, frame=8):
        np.save(tmp_path / "motion.npy", given)
        with pytest.raises(package.Error, match=match):
            state_of(description, tmp_path, frame)

    refused(places[:, :-1], "'pin', parameter 'motion_path'.*vertices a frame")
    infinite = places.copy()
    infinite[3, 5, 0] = np.inf
    refused(infinite, "vertex 5 is not finite at frame 4")
    flat = places.copy()
    flat[6] = flat[6, :1] + (flat[6] - flat[6, :1]) * 0  # all of it is a point
    refused(flat, "'pin'.*triangle of vertices [0-9]+, [0-9]+ and [0-9]+, with which fragment [0-9]+ goes, is squeezed flat at frame 7")
    np.save(tmp_path / "motion.npy", flat)
    state_of(description, tmp_path, 6)  # and not before
    far = places.copy()  # a corner of the plate, with which nothing goes
    corner = np.argmax(places[0] @ [1, 1, -1])
    far[6, corner] = far[6, (corner + 1) % len(VERTICES)]
    np.save(tmp_path / "motion.npy", far)
    state_of(description, tmp_path, 8)
    description["nodes"]["pin"].pop("mesh")
    refused(places, "'pin', parameter 'mesh'.*is not wired", 2)
    description["nodes"]["pin"]["motion_path"] = ""
    refused(places, "no file is given", 2)
