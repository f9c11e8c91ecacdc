"""What a mesh carries by name (docs/files.md, layers) reaches pieces, frames, Python and exports."""
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import sunder as package
from conftest import CUBE_FACES, CUBE_VERTICES, contents
from test_export import Glb, export, readings

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin_src/blender"))
from bake_reader import read_mesh_frame, read_ply  # noqa: E402

WALL = "Wände .001"
PROPERTIES = {  # of a cube's vertices, of its faces: what a program writes that knows no more than the document
    "vertex": ["float point_float:heat", "float point_weight:top%20half", "list uchar float point_color:tint"],
    "face": ["list uchar float corner_uv:W%C3%A4nde%20.001", "int face_int:side", "int face_bool:is%20top"],
}


def heat(p):
    return 1 + p @ np.array([1, -2, 3])


def cube(with_layers=True):
    lines = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {n}" for n in "xyz")]
    lines += [f"property {p}" for p in PROPERTIES["vertex"] if with_layers]
    lines += ["element face 6", "property list uchar int vertex_indices"]
    lines += [f"property {p}" for p in PROPERTIES["face"] if with_layers] + ["end_header"]
    for v in CUBE_VERTICES:
        row = [*v]
        if with_layers:
            row += [heat(np.array(v)), v[2], 4, v[0], v[1], v[2], 1]
        lines.append(" ".join(map(str, row)))
    for i, face in enumerate(CUBE_FACES):
        row = [4, *(v - 1 for v in face)]
        if with_layers:
            uvs = [x for v in face for x in (CUBE_VERTICES[v - 1][0] + i, CUBE_VERTICES[v - 1][1])]
            row += [8, *uvs, 1_000_000_000 + i, int(i == 1)]
        lines.append(" ".join(map(str, row)))
    return "\n".join(lines) + "\n"


def graph(**skin):
    """A cube that hits the floor and breaks."""
    return {"sunder": 1, "frame_range": [1, 8], "nodes": {
        "file": {"type": "mesh_file", "path": "cube.ply"},
        "cut": {"type": "prefracture", "mesh": "@file.mesh", "pieces": 10},
        "clay": {"type": "body", "fragments": "@cut.fragments", "position": [0, 0, 0.05], "velocity": [0, 0, -12],
                 "youngs_modulus": 1e6, "angular_velocity": [200, 100, 0], "toughness": 1e-4},
        "floor": {"type": "collider", "shape": "plane"},
        "sim": {"type": "solver", "bodies": ["@clay.body"], "colliders": ["@floor.collider"], "substeps": 4},
        "skin": {"type": "deformer", "body": "@clay.body", "state": "@sim.state", **skin},
        "out": {"type": "bake_mesh", "mesh": "@skin.mesh", "path": "mesh/cube.####.ply"}}}


def check_surface(points, triangles, is_break, values, domains):
    """values: {name: a row each point, corner or face} of a surface whose points lie where the cube's do."""
    assert domains == {"heat": "point", "tint": "point", WALL: "corner", "side": "face", "is top": "face"}
    outer = np.unique(triangles[~is_break])
    inner = np.setdiff1d(np.arange(len(points)), outer)
    np.testing.assert_allclose(values["heat"][outer], heat(points[outer]), atol=1e-6)
    np.testing.assert_allclose(values["tint"][outer, :3], points[outer], atol=1e-6)
    np.testing.assert_array_equal(values["heat"][inner], 0)
    np.testing.assert_array_equal(values["tint"][inner], 1)
    side = values["side"] - 1_000_000_000
    middle = points[triangles].mean(1)
    for i, (axis, at) in enumerate([(2, 0), (2, 1), (1, 0), (1, 1), (0, 0), (0, 1)]):
        np.testing.assert_array_equal(side[~is_break] == i, np.abs(middle[~is_break, axis] - at) < 1e-6)
    np.testing.assert_array_equal(values["side"][is_break], 0)
    np.testing.assert_array_equal(values["is top"], side == 1)
    corners = values[WALL].reshape(-1, 3, 2)[~is_break]
    wanted = points[triangles[~is_break]][:, :, :2] + np.stack([side[~is_break], 0 * side[~is_break]], 1)[:, None]
    np.testing.assert_allclose(corners, wanted, atol=1e-6)


def of_file(path):
    frame = read_mesh_frame(path)
    attributes = {l.name: l.values[:, 0] if l.values.shape[1] == 1 else l.values for l in frame.mesh_layers}
    return frame, attributes, {l.name: l.domain for l in frame.mesh_layers}


@pytest.mark.parametrize("topology", ["compact", "constant"])
def test_frames_and_python_have_what_the_file_of_the_mesh_has(sunder, scene, tmp_path, topology):
    (tmp_path / "cube.ply").write_text(cube(), encoding="utf-8")
    scene(graph(topology=topology))
    run = sunder("bake", "scene.json", "-o", "bake")
    assert run.status == 0, run.err
    loaded = package.Graph.load(str(tmp_path / "scene.json"))
    broke = set()
    for number in (1, 8):
        frame, attributes, domains = of_file(tmp_path / f"bake/mesh/cube.{number:04}.ply")
        top = attributes.pop("top half")
        assert domains.pop("top half") == "point"
        is_break = frame.interface >= 0
        broke.add(int((is_break & ~frame.hidden).sum()))
        check_surface(frame.rest, frame.triangles, is_break, attributes, domains)
        mesh = loaded.evaluate("skin.mesh", number)
        assert mesh.attribute_domains == domains
        assert mesh.attributes["is top"].dtype == bool and mesh.attributes["side"].dtype == np.int32
        for name, values in attributes.items():
            np.testing.assert_array_equal(mesh.attributes[name], values)
        assert list(mesh.vertex_weights) == ["top half"]
        np.testing.assert_array_equal(mesh.vertex_weights["top half"], top)
        outer = np.unique(frame.triangles[~is_break])
        np.testing.assert_allclose(top[outer], frame.rest[outer, 2], atol=1e-6)
    assert len(broke) == 2  # it tore in between


def test_pieces_have_them_and_keep_them_when_they_are_read_again(sunder, tmp_path):
    (tmp_path / "cube.ply").write_text(cube(), encoding="utf-8")
    run = sunder("fracture", "cube.ply", "-o", "cut", "--pieces", "6")
    assert run.status == 0, run.err
    interior = json.loads((tmp_path / "cut/fragments.json").read_text())["interior_material"]
    for path in sorted((tmp_path / "cut/pieces").glob("*.ply")):
        rows = read_ply(path)
        points = np.stack([rows["vertex"][n] for n in "xyz"], 1)
        graph = package.Graph()
        graph.add("mesh_file", "file", path=str(path))
        mesh = graph.evaluate("file.mesh")
        welded = points[np.sort(np.unique(points, axis=0, return_index=True)[1])]
        np.testing.assert_array_equal(mesh.positions, welded)
        is_break = mesh.face_material == interior
        check_surface(mesh.positions, mesh.triangles, is_break, mesh.attributes, mesh.attribute_domains)


def test_a_mesh_without_layers_gives_every_file_as_one_that_only_lacks_them(sunder, scene, tmp_path):
    files = []
    for with_layers in (False, True):
        (tmp_path / "cube.ply").write_text(cube(with_layers), encoding="utf-8")
        scene(graph())
        assert sunder("bake", "scene.json", "-o", "bake", "--restart").status == 0
        files.append(contents(tmp_path / "bake/mesh"))
    for name, plain in files[0].items():
        assert b":" not in plain.split(b"end_header\n")[0]
        frames = []
        for which, data in (("plain", plain), ("full", files[1][name])):
            (tmp_path / f"{which}.ply").write_bytes(data)
            frames.append(read_ply(tmp_path / f"{which}.ply"))
        for element, rows in frames[0].items():
            for field in rows.dtype.names:
                np.testing.assert_array_equal(rows[field], frames[1][element][field])


def test_usd_has_them_as_primvars_and_glb_the_uv_maps(sunder, scene, tmp_path):
    (tmp_path / "cube.ply").write_text(cube(), encoding="utf-8")
    scene(graph(topology="constant"))
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    export(sunder, "-o", "shot.usda")
    frame, attributes, _ = of_file(tmp_path / "bake/mesh/cube.0001.ply")
    expected = {"heat": ("float[]", "vertex", "heat"), "top_half": ("float[]", "vertex", "top half"),
                "tint": ("color4f[]", "vertex", "tint"), "W__nde__001": ("texCoord2f[]", "faceVarying", WALL),
                "side": ("int[]", "uniform", "side"), "is_top": ("bool[]", "uniform", "is top")}
    for root, rtol in readings(tmp_path / "shot.usda", has_meshes=False)[0]:
        mesh = root["shot/clay"]
        for primvar, (kind, interpolation, name) in expected.items():
            found = mesh.attributes["primvars:" + primvar]
            assert (found.kind, found.metadata["interpolation"]) == (kind, interpolation)
            assert found.metadata.get("displayName", primvar) == name
            np.testing.assert_allclose(found.value.astype(attributes[name].dtype), attributes[name], rtol=rtol)
    export(sunder, "-o", "shot.glb", "--tolerance", "1")
    glb = Glb(tmp_path / "shot.glb")
    seen = set()
    for mesh in glb.json["meshes"]:
        for primitive in mesh["primitives"]:
            if mesh["name"].startswith("clay"):
                uvs = glb.array(primitive["attributes"]["TEXCOORD_1"])[glb.array(primitive["indices"])]
                seen |= {tuple(uv) for uv in np.stack([uvs[:, 0], 1 - uvs[:, 1]], 1).round(5).tolist()}
    assert {tuple(uv) for uv in attributes[WALL].round(5).tolist()} <= seen


def test_info_lists_them(sunder, tmp_path):
    (tmp_path / "cube.ply").write_text(cube(), encoding="utf-8")
    told = sunder("info", "cube.ply").out.splitlines()
    assert [line.split(None, 1)[1] for line in told if line.startswith("layer ")] == [
        "point_float:heat", "point_weight:top half", "point_color:tint", f"corner_uv:{WALL}", "face_int:side", "face_bool:is top"]


def test_what_is_damaged_is_told(sunder, tmp_path):
    text = cube().replace("\n4 0 2 3 1 8 0", "\n4 0 2 3 1 6 0")
    (tmp_path / "cube.ply").write_text(text, encoding="utf-8")
    run = sunder("fracture", "cube.ply", "-o", "cut")
    assert run.status == 3 and "'corner_uv:W%C3%A4nde%20.001'" in run.errors[0].what
