"""sunder fracture --check: what is wrong with a mesh, what repair does about it, and the faulty faces to look at."""
import json

import numpy as np

from conftest import CUBE_FACES, CUBE_VERTICES, contents, obj_text


def read_faults(path):
    """Positions (v, 3) and per face: vertices (f, 3), fault (f,), colour (f, 3)."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    count = {w[1]: int(w[2]) for w in (line.split() for line in header.decode().splitlines()) if w[0] == "element"}
    positions = np.frombuffer(body, "<f8", 3 * count["vertex"]).reshape(-1, 3)
    row = [("n", "u1"), ("v", "<i4", 3), ("fault", "<i4"), ("colour", "u1", 3)]
    faces = np.frombuffer(body, row, count["face"], positions.nbytes)
    assert positions.nbytes + faces.nbytes == len(body)
    return positions, faces["v"], faces["fault"], faces["colour"]


def test_a_mesh_in_order_has_no_faults_and_nothing_is_written(sunder, tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())
    before = contents(tmp_path)
    run = sunder("fracture", "cube.obj", "--check")
    assert run.status == 0, run.err
    assert run.out == "cube.obj: 12 triangles, no faults\n"
    assert contents(tmp_path) == before


def test_faults_that_are_repaired_are_listed_and_their_faces_written(sunder, tmp_path):
    vertices = [*CUBE_VERTICES, (0.5, 0.5, 2)]
    faces = [CUBE_FACES[0][::-1], *CUBE_FACES[1:], CUBE_FACES[2], (5, 6, 9)]  # turned, doubled, a fin
    (tmp_path / "bad.obj").write_text(obj_text(vertices, faces))
    run = sunder("fracture", "bad.obj", "--check", "--pieces", "5", "-o", "look")
    assert run.status == 0, run.err
    assert "with faults:" in run.out and "non_manifold_edge" in run.out and "duplicate_triangle" in run.out
    assert "repair: 1 triangle of walls and fins dropped" in run.out
    assert [p.name for p in (tmp_path / "look").iterdir()] == ["faults.ply"]

    listed = sunder("fracture", "bad.obj", "--check", "--json", "--pieces", "5")
    assert listed.status == 0, listed.err
    report = json.loads(listed.out)
    assert report["can_be_cut"] and report["repairs"] and report["triangles"] == 15
    positions, triangles, fault, colour = read_faults(tmp_path / "look" / "faults.ply")
    for entry in report["faults"]:
        mine = fault == entry["id"]
        assert mine.sum() == entry.get("triangles", 0), entry
        assert len(np.unique(colour[mine], axis=0)) <= 1
        if entry["kind"] == "duplicate_triangle":
            assert np.allclose(positions[triangles[mine]][..., 1], 0)  # the doubled face is at y = 0
    assert np.isfinite(positions).all() and triangles.max() < len(positions)


def test_a_mesh_that_cannot_be_cut_is_told_with_status_3_and_what_would_help(sunder, tmp_path):
    (tmp_path / "open.obj").write_text(obj_text(faces=CUBE_FACES[1:]))
    run = sunder("fracture", "open.obj", "--check")
    assert run.status == 3
    assert "open_edge" in run.out and "thickness" in run.lines[0]
    report = json.loads(sunder("fracture", "open.obj", "--check", "--json").out)
    assert not report["can_be_cut"] and "open" in report["error"]
    run = sunder("fracture", "open.obj", "--check", "--thickness", "0.1", "--pieces", "5")
    assert run.status == 0 and "repair: 1 sheet given walls of 0.1 m" in run.out
    assert sorted(p.name for p in tmp_path.iterdir()) == ["open.obj"]


def test_json_without_check_is_wrong_usage(sunder, tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())
    assert sunder("fracture", "cube.obj", "--json").status == 2


def test_a_file_that_is_no_mesh_is_refused(sunder, tmp_path):
    (tmp_path / "letter.obj").write_text("this is a letter\n")
    assert sunder("fracture", "letter.obj", "--check").status == 3
    assert sunder("fracture", "gone.obj", "--check").status == 3


def test_seams_that_do_not_meet_are_told_with_the_distance_that_welds_them(sunder, tmp_path):
    # Each face with vertices of its own, moved by up to 1e-5.
    vertices = [[x + 1e-5 * ((7 * k + axis) % 3 - 1) for axis, x in enumerate(CUBE_VERTICES[v - 1])]
                for k, face in enumerate(CUBE_FACES) for v in face]
    faces = [tuple(range(4 * k + 1, 4 * k + 5)) for k in range(len(CUBE_FACES))]
    (tmp_path / "apart.obj").write_text(obj_text(vertices, faces))
    options = ("fracture", "apart.obj", "--check", "--json", "--pieces", "5", "--repair", "keep")
    for found in ((), ("--weld-distance", "auto")):
        report = json.loads(sunder(*options, *found).out)
        assert report["can_be_cut"] and any("m apart welded (weld_distance, found)" in r for r in report["repairs"])
    report = json.loads(sunder(*options, "--weld-distance", "0.001").out)
    assert report["repairs"][0] == "borders up to 0.001 m apart welded (weld_distance)"
    run = sunder(*options, "--weld-distance", "0")
    assert run.status == 3 and "weld_distance" in run.lines[0]
    run = sunder(*options, "--weld-distance", "some")
    assert run.status == 3 and "takes a number, not \"some\" (or \"auto\")" in run.lines[0]
