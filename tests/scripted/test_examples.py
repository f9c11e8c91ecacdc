"""The shots in examples/ go as docs/sheets.md, docs/cracks.md, docs/fields.md and docs/hand_off.md say."""
import importlib.util
from pathlib import Path

import numpy as np
import pytest

import sunder

EXAMPLES = Path(__file__).parents[2] / "examples"


def states(name, *frames, **changes):
    graph = sunder.Graph.load(str(EXAMPLES / (name + ".json")))
    for node, parameters in changes.items():
        graph[node].set(**parameters)
    return [graph.evaluate("solver.state", frame=frame) for frame in frames]


def sizes_of_pieces(state):
    return np.sort(np.unique(state.piece, return_counts=True)[1])


def test_meshes_are_those_that_the_script_writes(tmp_path):
    spec = importlib.util.spec_from_file_location("meshes", EXAMPLES / "meshes.py")
    meshes = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(meshes)
    meshes.HERE = tmp_path
    for make in (meshes.panel, meshes.door, meshes.can, meshes.roof, meshes.beam, meshes.wall, meshes.frame, meshes.arm):
        meshes.write(make.__name__, *make())
        written = (tmp_path / (make.__name__ + ".obj")).read_text()
        assert written == (EXAMPLES / (make.__name__ + ".obj")).read_text(), make.__name__
    meshes.write_motion("arm", meshes.arm_motion(meshes.arm()[0]))
    assert np.array_equal(np.load(tmp_path / "arm.npy"), np.load(EXAMPLES / "arm.npy"))


def test_the_ball_goes_through_the_panel_and_leaves_the_rest_of_it():
    start, torn = states("panel", 1, 4)
    sizes = sizes_of_pieces(torn)
    assert torn.rigid_velocity[0][2] < -15
    assert np.count_nonzero(sizes == 1) <= 0.03 * len(torn.piece)
    assert sizes[-1] > 0.94 * len(torn.piece)
    off = torn.piece != np.bincount(torn.piece).argmax()
    hit = np.array([0.05, 0.03, 0])
    assert np.linalg.norm(start.position[off] - hit, axis=1).max() < 0.25


@pytest.mark.parametrize("speed, least, most, tears", [(5, 0.015, 0.025, False), (15, 0.035, 0.06, False),
                                                       (30, 0.02, 1, True)])
def test_the_door_dents_and_then_tears(speed, least, most, tears):
    start, hit = states("door", 1, 6, ball={"velocity": [0, speed, 0]})
    kept = hit.piece == np.bincount(hit.piece).argmax()
    moved = np.linalg.norm((hit.position - start.position)[kept], axis=1).max()
    assert least < moved < most
    assert (len(sizes_of_pieces(hit)) > 1) == tears


def test_the_can_folds_and_does_not_tear():
    start, pressed = states("can", 1, 16)
    assert len(sizes_of_pieces(pressed)) == 1
    assert np.ptp(start.position[:, 2]) - np.ptp(pressed.position[:, 2]) > 0.02
    widths = [np.linalg.norm(state.position[:, :2], axis=1).max() for state in (start, pressed)]
    assert widths[1] > 1.05 * widths[0]


def test_the_roof_sags_under_the_block():
    start, pressed = states("roof", 1, 5)
    assert 0.05 < (start.position - pressed.position)[:, 2].max() < 0.3
    assert pressed.rigid_velocity[0][2] > -3


def test_the_beam_bends_over_the_edge():
    start, bent = states("beam", 1, 6)
    assert len(sizes_of_pieces(bent)) == 1
    assert np.linalg.norm(bent.position - start.position, axis=1).max() > 0.05
    assert bent.strain.max() > 0.002


def test_the_arm_swings_as_it_was_animated_and_then_breaks_its_back():
    graph = sunder.Graph.load(str(EXAMPLES / "arm.json"))
    motion = np.load(EXAMPLES / "arm.npy").astype(float)
    rest = graph.evaluate("mesh.mesh").positions
    for frame in (5, 21):
        mesh = graph.evaluate("deformer.mesh", frame=frame)
        away = np.linalg.norm(mesh.rest_positions[:, None] - rest[None], axis=2)
        own, of = np.flatnonzero(away.min(axis=1) < 1e-6), away.argmin(axis=1)
        assert np.abs(mesh.positions[own] - motion[frame - 1][of[own]]).max() < 2e-6
    last, gone = states("arm", 21, 48)
    assert last.edge_intact.all() and last.kept.all()
    assert len(sizes_of_pieces(gone)) == 2 and sizes_of_pieces(gone)[0] > 30
    assert (gone.position[:, 2] > 0).all()


def test_the_wall_parts_into_large_pieces_and_chunks():
    torn, = states("wall", 5)
    sizes = sizes_of_pieces(torn)
    n = len(torn.piece)
    assert sizes[-1] < 0.7 * n                          # a crack has gone through it
    assert np.sum(sizes[sizes >= 10]) > 0.8 * n         # 85 % of all fragments here; by groups a hole and crumbs
    assert np.count_nonzero(sizes >= 10) >= 5
    assert np.count_nonzero(sizes == 1) < 0.1 * n


def test_the_blast_makes_a_hole_and_throws_what_was_in_it():
    whole, blasted = states("blast", 3, 4)
    sizes, n = sizes_of_pieces(blasted), len(blasted.piece)
    assert len(sizes_of_pieces(whole)) == 1
    assert 0.6 * n < sizes[-1] < 0.95 * n and len(sizes) > 20
    off = blasted.piece != np.bincount(blasted.piece).argmax()
    near = np.linalg.norm((whole.position - [2.6, 0, 0.8])[:, [0, 2]], axis=1)
    assert near[off].mean() < 0.6 * near[~off].mean()
    assert blasted.velocity[off, 1].mean() > 2 and np.abs(blasted.velocity).max() < 30


def test_the_frame_stands():
    stood, = states("frame", 8, ball={"position": [-9, 0, 1], "velocity": [0, 0, 0]})
    assert len(sizes_of_pieces(stood)) == 1 and np.max(stood.edge_damage) == 0


def test_the_frame_loses_columns_and_keeps_its_slabs():
    hit, = states("frame", 5)
    sizes = sizes_of_pieces(hit)
    n = len(hit.piece)
    assert sizes[-1] > 0.75 * n and len(sizes) > 5
    assert np.count_nonzero(sizes == 1) < 0.04 * n
