"""Bodies follow a place or each vertex of an animation, are let go with its speed, and go on to the same bits."""
import numpy as np
import pytest

import sunder as package
from conftest import contents, obj_text

LAST = 20          # the frame at which what follows is still where the artist has it
SIZE = 2.0         # m, of the cylinder
RATE = 24


def cylinder(sides=16, rings=17, radius=0.25):
    """(v, 3) vertices and faces of a closed cylinder along z, its ends fans about a middle."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    heights = np.linspace(0, SIZE, rings)
    vertices = np.concatenate([ring + [0, 0, z] for z in heights] + [[[0, 0, 0]], [[0, 0, SIZE]]])
    faces = []
    for k in range(rings - 1):
        for i in range(sides):
            a, b = k * sides + i, k * sides + (i + 1) % sides
            faces.append((a + 1, b + 1, b + sides + 1, a + sides + 1))
    top, end = (rings - 1) * sides, len(vertices)
    for i in range(sides):
        j = (i + 1) % sides
        faces += [(j + 1, i + 1, end - 1), (top + i + 1, top + j + 1, end)]
    order = list(dict.fromkeys(i for face in faces for i in face))  # as an OBJ file is read: by first use
    number = {old: new + 1 for new, old in enumerate(order)}
    return vertices[np.array(order) - 1], [tuple(number[i] for i in face) for face in faces]


def bent(points, frame, most=0.9):
    """Where a cylinder's points are that bends in the xz plane, rises and turns."""
    curvature = most * 0.5 * (1 - np.cos(np.pi * (frame - 1) / 30)) + 1e-9
    angle, x = curvature * points[:, 2], points[:, 0]
    out = np.stack([(1 - np.cos(angle)) / curvature + x * np.cos(angle), points[:, 1],
                    np.sin(angle) / curvature - x * np.sin(angle)], axis=1)
    turn = 0.03 * (frame - 1)
    c, s = np.cos(turn), np.sin(turn)
    return out @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [0.02 * frame, 0, 1 + 0.001 * frame ** 2]


VERTICES, FACES = cylinder()


def frames_of(last=30, vertices=VERTICES):
    return np.stack([bent(vertices, frame) for frame in range(1, last + 1)])


@pytest.fixture
def rig(tmp_path):
    """The mesh and its motion beside a graph file."""
    (tmp_path / "mesh.obj").write_text(obj_text(VERTICES.tolist(), FACES))
    np.save(tmp_path / "motion.npy", frames_of())
    return tmp_path


def shot(follow=None, after=(), body=None, solver=None, pieces=24):
    """A cylinder cut in pieces that follows its motion, in which nothing falls."""
    nodes = {
        "mesh": {"type": "mesh_file", "path": "mesh.obj"},
        "cut": {"type": "prefracture", "mesh": "@mesh.mesh", "pieces": pieces},
        "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e5, **(body or {})},
        "rig": {"type": "follow", "body": "@body.body", "mesh": "@mesh.mesh", "motion": "vertices", "path": "motion.npy",
                "frame": LAST + 1, **(follow or {})},
    }
    last = "@rig.body"
    for k, given in enumerate(after):
        nodes[f"it{k}"] = {"type": "activate", "body": last, **given}
        last = f"@it{k}.body"
    nodes["solver"] = {"type": "solver", "bodies": [last], "gravity": [0, 0, 0], **(solver or {})}
    nodes["deformer"] = {"type": "deformer", "body": last, "state": "@solver.state"}
    nodes["skin"] = {"type": "bake_mesh", "mesh": "@deformer.mesh", "path": "mesh/skin.####.ply"}
    nodes["cache"] = {"type": "bake_state", "state": "@solver.state", "path": "state/sim.####.ply"}
    return {"sunder": 2, "frame_rate": RATE, "frame_range": [1, 28], "nodes": nodes}


def graph_of(description, folder):
    return package.Graph.from_dict(description, str(folder))


def artists(mesh):
    """Which vertices of a visual mesh are the artist's, and which of his each is."""
    away = np.linalg.norm(mesh.rest_positions[:, None] - VERTICES[None], axis=2)
    return np.flatnonzero(away.min(axis=1) < 1e-6), away.argmin(axis=1)[away.min(axis=1) < 1e-6]


def test_the_mesh_is_the_artists_until_it_is_let_go(rig):
    graph = graph_of(shot(), rig)
    for frame in (1, 2, 9, LAST):
        mesh = graph.evaluate("deformer.mesh", frame=frame)
        own, of = artists(mesh)
        assert len(set(of)) == len(VERTICES)
        assert np.abs(mesh.positions[own] - bent(VERTICES, frame)[of]).max() < 1e-6 * SIZE, frame
        state = graph.evaluate("solver.state", frame=frame)
        assert (state.kept == 1).all() and state.edge_intact.all()
        # Centres lie within the cut, so that the formula takes them to where the skin's best map does but for the bend in a piece.
        assert np.abs(state.position - bent(state.rest_position, frame)).max() < 0.02 * SIZE


def test_it_goes_on_as_fast_as_the_artist_had_it(rig):
    graph = graph_of(shot(), rig)
    at, after = (graph.evaluate("solver.state", frame=frame) for frame in (LAST, LAST + 1))
    wanted = (bent(at.rest_position, LAST + 1e-3) - bent(at.rest_position, LAST - 1e-3)) / 2e-3 * RATE
    mass = at.mass[:, None]
    going, mean = ((mass * v).sum(axis=0) / mass.sum() for v in (after.velocity, wanted))
    assert np.linalg.norm(going - mean) < 0.01 * np.linalg.norm(mean)
    assert not after.kept.any()


def test_nothing_jumps_where_it_is_let_go(rig):
    # Too soft to swing in a frame: then all of it goes on as it was, but that a fragment moves as one.
    graph = graph_of(shot(body={"youngs_modulus": 0.01}), rig)
    meshes = {frame: graph.evaluate("deformer.mesh", frame=frame) for frame in (LAST, LAST + 1)}
    own, of = artists(meshes[LAST])
    velocity = (bent(VERTICES, LAST + 1e-3) - bent(VERTICES, LAST - 1e-3))[of] / 2e-3
    moved = meshes[LAST + 1].positions[own] - meshes[LAST].positions[own]
    fastest = np.linalg.norm(velocity, axis=1).max()
    away = np.linalg.norm(moved - velocity, axis=1)
    assert away.max() < 0.05 * fastest and away.mean() < 0.01 * fastest
    told = meshes[LAST].velocities[own] / RATE
    assert np.linalg.norm(told - (bent(VERTICES, LAST) - bent(VERTICES, LAST - 1))[of], axis=1).max() < 1e-4 * fastest


def slowly(graph, scaled):
    """Where each of the artist's vertices is in tenths of frames 18 to 23, of slow motion or between frames, and how fast."""
    places, rates = [], []
    for tenth in range(10 * (LAST - 2), 10 * (LAST + 3) + 1):
        mesh = graph.evaluate("deformer.mesh", tenth - 9 if scaled else tenth / 10)
        own, which = artists(mesh)
        for values, all_of in ((mesh.positions, places), (mesh.velocities, rates)):
            row = np.full((len(VERTICES), 3), np.nan)
            row[which] = values[own]
            all_of.append(row)
    return np.array(places), np.array(rates) / RATE * (1 if scaled else 0.1)


# What is let go, and when: all as frame 21 begins; half of it; all within that frame, by what it hits.
LEAVING = {
    "soft": {"body": {"youngs_modulus": 0.01}},
    "stiff": {},
    "elastic": {"follow": {"source_strain": "elastic"}},
    "half": {"follow": {"frame": None}, "after": [{"region": "box", "box_min": [-1, -1, 1], "box_max": [1, 1, 3], "frame": LAST + 1}]},
    "hit": {"body": {"toughness": 1e6}, "follow": {"frame": None}, "after": [{"mode": "held", "until": "contact"}]},
}


@pytest.mark.parametrize("scaled", [False, True], ids=["between", "slow"])
@pytest.mark.parametrize("case", LEAVING)
def test_nothing_jumps_between_the_frames_in_which_it_is_let_go(rig, case, scaled):
    description = shot(**LEAVING[case])
    nodes = description["nodes"]
    if case == "hit":
        reach = bent(VERTICES, LAST + 0.4)[:, 0].max()
        nodes["wall"] = {"type": "collider", "shape": "box", "size": [1, 9, 9], "position": [reach + 0.5, 0, 0]}
        nodes["solver"]["colliders"] = ["@wall.collider"]
    whole = graph_of(description, rig)
    kept = [whole.evaluate("solver.state", frame).kept.sum() for frame in (LAST, LAST + 1)]
    assert kept[0] > kept[1]
    meshes = [whole.evaluate("deformer.mesh", frame) for frame in range(LAST - 2, LAST + 4)]
    if scaled:
        nodes["solver"]["time_scale"] = 0.1
    places, rates = slowly(graph_of(description, rig), scaled)
    for mesh, shown in zip(meshes, places[::10]):  # common times have their bits
        own, of = artists(mesh)
        assert np.array_equal(mesh.positions[own], shown[of].astype(np.float32))
    steps = np.linalg.norm(np.diff(places, axis=0), axis=2)
    frames = np.linalg.norm(places[10::10] - places[:-10:10], axis=2)
    assert np.isfinite(steps).all() and len(frames) == 5
    # A tenth of the way there, but for arcs of 0.06 rad and what gains speed on the way.
    for k, way in enumerate(frames):
        assert steps[10 * k:10 * k + 10].max() < 1.05 * way.max() / 10, k
    # What springs back gains speed in the next frames, too.
    across, around = steps[20:30].max(), max(steps[:20].max(), steps[30:].max())
    assert across < 1.05 * around
    # Velocities are those of what is seen.
    seen = (places[22:30] - places[20:28]) / 2
    assert np.abs(rates[21:29] - seen).max() < 0.02 * across


def test_its_momentum_is_kept_from_there(rig):
    graph = graph_of(shot(), rig)
    states = [graph.evaluate("solver.state", frame=frame) for frame in range(LAST + 1, 29)]
    momenta = np.array([(s.mass[:, None] * s.velocity).sum(axis=0) for s in states])
    assert np.abs(momenta - momenta[0]).max() < 1e-9 * np.linalg.norm(momenta[0])


SPIN = 2.4 * np.array([0.48, 0.6, 0.64])  # rad/s, of the cylinder that spins about its middle


def swung(points, frame):
    """Where a cylinder's points are that is rigid, spins by SPIN and swings on an arc of 1.5 m."""
    time, rate = (frame - 1) / RATE, np.linalg.norm(SPIN)
    x, y, z = SPIN / rate
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + np.sin(rate * time) * across + (1 - np.cos(rate * time)) * across @ across
    swing = 0.8 * np.sin(2.5 * time)
    return (points - [0, 0, SIZE / 2]) @ turn.T + 1.5 * np.array([np.sin(swing), 0, 1 - np.cos(swing)])


def spun(state):
    """Angular momentum about the centre, its inertia there, and kinetic energy, of fragments as ellipsoids: kg m2/s, kg m2, J."""
    m = state.mass[:, None]
    r = state.position - (m * state.position).sum(axis=0) / m.sum()
    u = state.velocity - (m * state.velocity).sum(axis=0) / m.sum()
    w, x, y, z = state.orientation.T
    axes = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)
    moment = np.einsum("nij,nj,nkj->nik", axes, m / 5 * state.radii ** 2, axes)
    inertia = np.trace(moment, axis1=1, axis2=2)[:, None, None] * np.eye(3) - moment
    own = np.einsum("nij,nj->ni", inertia, state.angular_velocity)
    whole = inertia.sum(axis=0) + np.einsum("n,nij->ij", state.mass, (r ** 2).sum(axis=1)[:, None, None] * np.eye(3)
                                            - r[:, :, None] * r[:, None, :])
    energy = 0.5 * (m * state.velocity ** 2).sum() + 0.5 * (own * state.angular_velocity).sum()
    return (m * np.cross(r, u)).sum(axis=0) + own.sum(axis=0), whole, energy


def test_what_spins_and_swings_keeps_its_angular_momentum_and_its_energy(rig):
    np.save(rig / "motion.npy", np.stack([swung(VERTICES, frame) for frame in range(1, 31)]))
    graph = graph_of(shot(body={"youngs_modulus": 1e8, "density": 1000}), rig)
    states = [graph.evaluate("solver.state", frame=frame) for frame in range(LAST, 29)]
    momenta, inertias, energies = zip(*(spun(state) for state in states))
    assert not states[1].kept.any() and all(state.edge_intact.all() for state in states)
    size = np.linalg.norm(momenta[1])
    assert max(np.linalg.norm(L - momenta[1]) for L in momenta[2:]) < 1e-6 * size
    # What is let go spins as it was animated, and goes as fast. A free cylinder's spin wanders about its angular momentum.
    let_go = np.linalg.solve(inertias[0], momenta[1])
    assert np.linalg.norm(let_go - SPIN) < 0.01 * np.linalg.norm(SPIN)
    center = np.array([[0, 0, SIZE / 2]])
    going = np.linalg.norm(swung(center, LAST + 1e-3) - swung(center, LAST - 1e-3)) / 2e-3 * RATE
    animated = 0.5 * states[0].mass.sum() * going ** 2 + 0.5 * SPIN @ inertias[0] @ SPIN
    assert abs(energies[1] - animated) < 0.01 * animated
    assert np.ptp(energies[1:]) < 1e-3 * animated


@pytest.mark.parametrize("strain,keeps", [("rest", True), ("elastic", False)])
def test_the_shape_is_kept_or_springs_back(rig, strain, keeps):
    graph = graph_of(shot({"source_strain": strain}, body={"slender": "never"}), rig)
    state = graph.evaluate("solver.state", frame=LAST + 1)
    at = graph.evaluate("solver.state", frame=LAST)
    rest = np.abs(at.plastic_deformation - np.eye(3)).max()
    assert (rest > 0.02) == keeps
    assert (np.median(state.strain) < 0.03) == keeps


@pytest.mark.parametrize("strain,keeps", [("rest", True), ("elastic", False)])
def test_what_bends_by_its_curvature_keeps_its_bend_or_springs_back(rig, strain, keeps):
    graph = graph_of(shot({"source_strain": strain}), rig)
    at, free = (graph.evaluate("solver.state", frame=frame) for frame in (LAST, LAST + 4))
    assert (np.abs(at.plastic_curvature).max() > 0.1) == keeps  # rad/m: it is bent
    apart = [np.linalg.norm(state.position[:, None] - state.position[None], axis=2) for state in (at, free)]
    assert (np.abs(apart[1] - apart[0]).max() < 0.02 * SIZE) == keeps


def test_a_place_is_followed_round_a_turn(tmp_path):
    cut = {"type": "lattice", "size": [0.4, 0.4, 0.4], "cells": [4, 4, 4]}
    nodes = {
        "cut": cut, "body": {"type": "body", "fragments": "@cut.fragments", "youngs_modulus": 1e7, "toughness": 0.001},
        "rig": {"type": "follow", "body": "@body.body", "frame": 11,
                "position": {"keys": [[1, [0, 0, 1]], [13, [1.2, 0, 1]]]},
                "rotation": {"keys": [[1, [0, 0, 0]], [13, [0, 0, 240]]]}},
        "solver": {"type": "solver", "bodies": ["@rig.body"], "gravity": [0, 0, 0]},
    }
    graph = package.Graph.from_dict({"sunder": 2, "frame_rate": RATE, "frame_range": [1, 16], "nodes": nodes}, str(tmp_path))
    state = graph.evaluate("solver.state", frame=7)
    assert state.edge_intact.all()
    turn = np.radians(120)
    c, s = np.cos(turn), np.sin(turn)
    wanted = state.rest_position @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [0.6, 0, 1]
    assert np.abs(state.position - wanted).max() < 1e-12
    gone = graph.evaluate("solver.state", frame=11)
    assert not gone.kept.any() and gone.edge_intact.all()
    assert np.allclose(gone.velocity.mean(axis=0), [2.4, 0, 0], atol=1e-9)
    assert np.allclose(gone.angular_velocity, [0, 0, np.radians(20) * RATE], rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("last_key", [9, 10, 20])
def test_keys_that_end_where_it_is_let_go_take_no_speed_from_it(tmp_path, last_key):
    """10 is let go: keys to 9 tell of no later frame, as an array of vertices that ends there."""
    turn, way = 5, 0.2  # degrees, m a frame
    nodes = {
        "cut": {"type": "lattice", "size": [0.4, 0.4, 0.4], "cells": [2, 2, 2]},
        "body": {"type": "body", "fragments": "@cut.fragments"},
        "rig": {"type": "follow", "body": "@body.body", "frame": 10,
                "position": {"keys": [[1, [0, 0, 0]], [last_key, [way * (last_key - 1), 0, 0]]]},
                "rotation": {"keys": [[1, [0, 0, 0]], [last_key, [0, 0, turn * (last_key - 1)]]]}},
        "solver": {"type": "solver", "bodies": ["@rig.body"], "gravity": [0, 0, 0]},
    }
    graph = package.Graph.from_dict({"sunder": 2, "frame_rate": RATE, "frame_range": [1, 12], "nodes": nodes}, str(tmp_path))
    gone = graph.evaluate("solver.state", frame=10)
    assert not gone.kept.any()
    assert np.allclose(gone.velocity.mean(axis=0), [way * RATE, 0, 0], atol=1e-9)
    assert np.allclose(gone.angular_velocity, [0, 0, np.radians(turn) * RATE], rtol=1e-3, atol=1e-6)


def test_activations_say_what_goes_and_the_rest_goes_on(rig):
    upper = {"region": "box", "box_min": [-1, -1, 1], "box_max": [1, 1, 3], "frame": 10}
    graph = graph_of(shot({"frame": None}, after=[upper]), rig)
    mesh, state = graph.evaluate("deformer.mesh", frame=15), graph.evaluate("solver.state", frame=15)
    assert set(state.kept) == {0, 1}
    own, of = artists(mesh)
    low = VERTICES[of][:, 2] < 0.4
    assert np.abs(mesh.positions[own][low] - bent(VERTICES, 15)[of][low]).max() < 1e-6 * SIZE
    # At the moment itself nothing moves but as the artist has it.
    at = graph.evaluate("deformer.mesh", frame=9)
    own, of = artists(at)
    assert np.abs(at.positions[own] - bent(VERTICES, 9)[of]).max() < 1e-6 * SIZE


def test_it_crashes_where_it_meets_a_wall(tmp_path):
    nodes = {
        "cut": {"type": "lattice", "size": [0.4, 0.4, 0.4], "cells": [4, 4, 4]},
        "body": {"type": "body", "fragments": "@cut.fragments"},
        "rig": {"type": "follow", "body": "@body.body", "position": {"keys": [[1, [0, 0, 0]], [13, [2.4, 0, 0]]]}},
        "wait": {"type": "activate", "body": "@rig.body", "mode": "asleep", "until": "contact"},
        "wall": {"type": "collider", "shape": "box", "size": [0.2, 2, 2], "position": [1.5, 0, 0]},
        "solver": {"type": "solver", "bodies": ["@wait.body"], "colliders": ["@wall.collider"], "gravity": [0, 0, 0]},
    }
    graph = package.Graph.from_dict({"sunder": 2, "frame_rate": RATE, "frame_range": [1, 12], "nodes": nodes}, str(tmp_path))
    before, after = (graph.evaluate("solver.state", frame=frame) for frame in (6, 12))
    assert before.kept.all() and np.allclose(before.position - before.rest_position, [1, 0, 0])
    assert not after.kept.any() and (after.position[:, 0] < 1.45).all()


@pytest.mark.parametrize("after", [(), [{"until": "contact", "region": "box", "box_min": [-1, -1, 1], "frame": 9}]])
def test_resumed_it_has_the_same_bits(sunder, scene, rig, after):
    scene(shot(after=after))
    for folder, frames in (("whole", ["1:26"]), ("parts", ["1:1", "1:12", f"1:{LAST}", f"1:{LAST + 1}", "1:26"])):
        for some in frames:
            done = sunder("bake", "scene.json", "-o", folder, "--frames", some, "--resume")
            assert done.status == 0, done.err
    assert contents(rig / "whole") == contents(rig / "parts")


def wrong(rig, array=None, frame=1, **follow):
    if array is not None:
        np.save(rig / "motion.npy", array)
    with pytest.raises(package.Error) as caught:
        graph_of(shot(follow), rig).evaluate("solver.state", frame=frame)
    assert "rig" in str(caught.value)
    return str(caught.value)


def test_what_is_wrong_is_told_with_its_place(rig):
    good = frames_of()
    assert "290 vertices a frame, the mesh has" in wrong(rig, np.concatenate([good, good[:, :16]], axis=1))
    bad = good.copy()
    bad[4, 17, 1] = np.nan
    assert "vertex 17 is not finite at frame 5" in wrong(rig, bad)
    inside = good.copy()
    inside[6] = inside[6] * [1, 1, -1]
    told = wrong(rig, inside, frame=8)
    assert "turned inside out at frame 7" in told and "about vertex" in told
    flat = good.copy()
    flat[6] = flat[6] * [1, 1, 0]
    assert "squeezed flat at frame 7" in wrong(rig, flat, frame=8)
    assert "(frames, vertices, 3)" in wrong(rig, good[0])
    assert "floats" in wrong(rig, good.astype(int))
    assert "Fortran" in wrong(rig, np.asfortranarray(good))
    np.save(rig / "motion.npy", good)
    (rig / "motion.npy").write_bytes((rig / "motion.npy").read_bytes()[:5000])
    assert "ends before its last frame" in wrong(rig)
    assert "there are 3 positions for" in wrong(rig, source="values", positions=[[0, 0, 0]] * 3)
    assert "no file is given" in wrong(rig, path="")


def test_values_in_the_graph_are_as_a_file(rig):
    rows = frames_of().reshape(-1, 3).tolist()
    a, b = (graph_of(shot(given, body={"toughness": 0.05}), rig).evaluate("solver.state", frame=24).position
            for given in ({}, {"source": "values", "positions": rows}))
    assert np.array_equal(a, b)
