"""sunder fracture: closed pieces that fill the mesh, and their listing."""
import json
import os

import numpy as np
import pytest

import sunder as package
from conftest import contents, obj_text


def read_piece(path):
    """Positions (v, 3) double, triangles (t, 3), material (t,)."""
    data = path.read_bytes()
    header, _, _ = data.partition(b"end_header\n")
    words = [line.split() for line in header.decode().splitlines()]
    count = {w[1]: int(w[2]) for w in words if w[0] == "element"}
    at = len(header) + len(b"end_header\n")
    positions = np.frombuffer(data, "<f8", 3 * count["vertex"], at).reshape(-1, 3)
    row = [("n", "u1"), ("v", "<i4", 3), ("material", "<i4")]
    if ["property", "list", "uchar", "float", "texcoord"] in words:
        row += [("k", "u1"), ("uv", "<f4", 6)]
    if ["property", "list", "uchar", "float", "corner_normals"] in words:
        row += [("l", "u1"), ("normals", "<f4", 9)]
    faces = np.frombuffer(data, row, count["face"], at + positions.nbytes)
    assert at + positions.nbytes + faces.nbytes == len(data)
    return positions, faces["v"], faces["material"]


def volume(positions, triangles):
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.fixture
def cut(sunder, tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())
    run = sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "12", "--seed", "3")
    assert run.status == 0, run.err
    return tmp_path / "cut"


def test_pieces_are_closed_and_fill_the_cube(cut):
    listing = json.loads((cut / "fragments.json").read_text())
    fragments = listing["fragments"]
    assert len(fragments) == 12 == len(list((cut / "pieces").iterdir()))
    assert listing["checks"]["closed"] and listing["source"]["path"].endswith("cube.obj")
    total, seen = 0, {}
    for fragment in fragments:
        positions, triangles, material = read_piece(cut / fragment["file"])
        directed = {(int(t[i]), int(t[(i + 1) % 3])) for t in triangles for i in range(3)}
        assert len(directed) == 3 * len(triangles) and all((b, a) in directed for a, b in directed)
        assert volume(positions, triangles) == pytest.approx(
            fragment["volume"], rel=1e-9
        )  # the same integral, other order
        assert set(material) <= {0, listing["interior_material"]}
        total += fragment["volume"]
        for p in positions:
            seen.setdefault(p.tobytes(), set()).add(fragment["id"])
    assert total == pytest.approx(1, rel=1e-6)  # the surface of a cube is kept; rounding only
    shared = {pair for owners in seen.values() for pair in ((a, b) for a in owners for b in owners if a < b)}
    for interface in listing["interfaces"]:  # what touches has vertices of the same bits
        assert (interface["a"], interface["b"]) in shared
        assert interface["area"] > 0 and np.linalg.norm(interface["normal"]) == pytest.approx(1, abs=1e-6)


def test_the_same_seed_gives_the_same_files(sunder, cut, tmp_path):
    assert sunder("fracture", "cube.obj", "-o", "again", "--pieces", "12", "--seed", "3").status == 0
    assert contents(tmp_path / "again") == contents(cut)
    assert sunder("fracture", "cube.obj", "-o", "other", "--pieces", "12", "--seed", "4").status == 0
    assert contents(tmp_path / "other") != contents(cut)


def test_a_second_cut_replaces_the_first_and_leaves_no_stale_piece(sunder, cut):
    (cut / "notes.txt").write_text("mine")
    assert sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "5").status == 0
    n = len(json.loads((cut / "fragments.json").read_text())["fragments"])
    assert n < 12
    assert len(list((cut / "pieces").iterdir())) == n
    assert (cut / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["fragments.json", "pieces/piece.0003.ply", "pieces"])
def test_foreign_files_are_not_replaced(sunder, tmp_path, name):
    (tmp_path / "cube.obj").write_text(obj_text())
    foreign = tmp_path / "cut" / name
    foreign.parent.mkdir(parents=True)
    foreign.write_text("mine")
    run = sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "5")
    assert run.status in (1, 3) and len(run.errors) == 1, run.err
    assert contents(tmp_path / "cut") == {name: b"mine"}


def test_the_package_cuts_the_same_pieces(cut, tmp_path):
    g = package.Graph()
    g.add("mesh_file", "file", path=str(tmp_path / "cube.obj"))
    g.add("prefracture", "pieces", mesh="@file.mesh", pieces=12, seed=3)
    fragments = g.evaluate("pieces.fragments")
    listing = json.loads((cut / "fragments.json").read_text())
    assert np.array_equal(fragments.volume, [f["volume"] for f in listing["fragments"]])
    assert np.array_equal(fragments.interfaces.pair, [[i["a"], i["b"]] for i in listing["interfaces"]])
    positions, triangles, _ = read_piece(cut / "pieces" / "piece.0004.ply")
    mesh = fragments.fragment_mesh(3)
    assert np.array_equal(mesh.positions, positions) and np.array_equal(mesh.triangles, triangles)
    fragments.save(tmp_path / "saved")
    assert contents(tmp_path / "saved")["pieces/piece.0004.ply"] == (cut / "pieces" / "piece.0004.ply").read_bytes()


@pytest.mark.parametrize("method", ["voronoi", "kmeans"])
def test_both_methods_cut_closed_pieces(sunder, tmp_path, method):
    (tmp_path / "cube.obj").write_text(obj_text())
    assert sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "9", "--method", method).status == 0
    checks = json.loads((tmp_path / "cut" / "fragments.json").read_text())["checks"]
    assert checks["closed"] and checks["fragments"] == 9
    assert abs(checks["volume_error"]) < (1e-12 if method == "voronoi" else 1e-6)


def test_an_impact_makes_small_pieces_where_it_hits(sunder, tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())
    run = sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "60", "--sites", "impact", "--points", "[[0, 0, 1]]",
                 "--impact-radius", "0.05")
    assert run.status == 0, run.err
    fragments = json.loads((tmp_path / "cut" / "fragments.json").read_text())["fragments"]
    distance = np.linalg.norm(np.array([f["centroid"] for f in fragments]) - [0, 0, 1], axis=1)
    volume = np.array([f["volume"] for f in fragments])
    assert volume[distance < 0.2].mean() < 0.05 * volume[distance > 0.7].mean()


def test_points_are_pieces(sunder, tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())
    run = sunder("fracture", "cube.obj", "-o", "cut", "--sites", "points", "--points", "[[0.1,0.5,0.5],[0.5,0.5,0.5]]")
    assert run.status == 0, run.err
    fragments = json.loads((tmp_path / "cut" / "fragments.json").read_text())["fragments"]
    assert [f["volume"] for f in fragments] == pytest.approx([0.3, 0.7], rel=1e-4)  # sites are jittered by 1e-6


@pytest.mark.parametrize(
    "arguments, needle",
    [
        (["--sites", "impact", "--points", "[[0, 0, 0]]", "--impact-radius", "1e-300"], "1 pieces were made instead of 20"),
        (["--sites", "points", "--points", "[[5, 5, 5], [7, 7, 7]]"], "1 pieces were made instead of 2"),
    ],
)
def test_sites_that_make_no_pieces_are_told(sunder, tmp_path, arguments, needle):
    (tmp_path / "cube.obj").write_text(obj_text())
    run = sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "20", *arguments)
    assert run.status == 0 and needle in run.err


@pytest.mark.parametrize(
    "arguments, needle",
    [
        (["--sites", "impact"], "points"),
        (["--sites", "points"], "points"),
        (["--sites", "density"], "density_group"),
        (["--sites", "density", "--density-group", "hat"], "hat"),
        (["--sites", "circles"], "poisson"),
        (["--sites", "points", "--points", "[[1, 2]]"], "points"),
        (["--grid-jitter", "2"], "grid_jitter"),
        (["--least-piece", "2"], "least_piece"),
    ],
)
def test_sites_that_cannot_be_chosen_are_refused(sunder, tmp_path, arguments, needle):
    (tmp_path / "cube.obj").write_text(obj_text())
    run = sunder("fracture", "cube.obj", "-o", "cut", *arguments)
    assert run.status == 3 and needle in run.err
    assert not (tmp_path / "cut").exists()


@pytest.mark.parametrize(
    "arguments, parameter",
    [(["--interior-detail", "1e-9"], "interior_detail"), (["--noise", "0.5", "--noise-scale", "0.05"], "noise_scale")],
)
def test_break_surfaces_that_no_memory_would_hold_are_refused(sunder, tmp_path, arguments, parameter):
    (tmp_path / "cube.obj").write_text(obj_text())
    run = sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "300", *arguments)
    assert run.status == 3 and parameter in run.err and "permitted for this cut" in run.err
    assert not (tmp_path / "cut").exists()


def test_pieces_do_not_leave_the_output_folder_through_a_link(sunder, tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())
    (tmp_path / "cut").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "cut" / "pieces").symlink_to(tmp_path / "elsewhere")
    run = sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "3")
    assert run.status == 3 and "cut/pieces" in run.err
    assert not any((tmp_path / "elsewhere").iterdir())


@pytest.mark.parametrize("name, shown", [
    ("Gr\u00fcn".encode("latin-1"), "Gr\u00fcn"),
    ("Gr\u00fcn \u2603 \U0001f9f1".encode(), "Gr\u00fcn \u2603 \U0001f9f1"),
    (b"cut off \xe2\x98", "cut off \u00e2\u0098"),
    (b"too long \xc0\xaf \xed\xa0\x80", "too long \u00c0\u00af \u00ed\u00a0\u0080"),
])
def test_names_that_are_no_utf8_are_taken_as_latin_1(sunder, tmp_path, name, shown):
    (tmp_path / "cube.mtl").write_bytes(b"newmtl " + name + b"\n")
    (tmp_path / "cube.obj").write_bytes(b"mtllib cube.mtl\n" + obj_text().replace("f ", "usemtl _\nf ", 1).encode().replace(b"_", name))
    run = sunder("fracture", "cube.obj", "-o", "cut", "--pieces", "4")
    assert run.status == 0, run.err
    assert json.loads((tmp_path / "cut/fragments.json").read_text(encoding="utf-8"))["materials"] == [shown]


def test_a_path_that_is_no_utf8_is_listed(sunder, tmp_path):
    path = os.fsencode(tmp_path) + b"/cube\xfc.obj"
    with open(path, "w") as file:
        file.write(obj_text())
    run = sunder("fracture", os.fsdecode(path), "-o", "cut", "--pieces", "4")
    assert run.status == 0, run.err
    assert json.loads((tmp_path / "cut/fragments.json").read_text(encoding="utf-8"))["source"]["path"].endswith("cube\ufffd.obj")
