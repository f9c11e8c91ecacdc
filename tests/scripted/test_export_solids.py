"""Rigid bodies and colliders in exports: where the states and keys have them, as the shape or the look that they have."""
import json

import numpy as np
import pytest

import sunder as package
from conftest import block_scene
from test_export import Glb, baked, export, readings, rotated  # noqa: F401 (a fixture)

from bake_reader import read_ply

FRAMES = 6


def crowded_scene(tmp_path):
    """Every kind of solid: spheres and boxes that move freely, and colliders that rest, travel and turn."""
    (tmp_path / "wedge.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    graph = block_scene((1, FRAMES))
    nodes = graph["nodes"]
    nodes["skin"]["topology"] = "constant"
    nodes["clay"].update(toughness=1e-7, youngs_modulus=1e7, **{"yield": None})
    nodes["crate"] = {"type": "rigid_body", "shape": "box", "size": [0.2, 0.3, 0.4], "mass": 3, "position": [2, 0, 2],
                      "rotation": [10, 20, 30], "velocity": [1, 0, 2], "angular_velocity": [100, 300, 50]}
    nodes["post"] = {"type": "collider", "shape": "capsule", "radius": 0.1, "height": 0.5, "position": [-2, 0, 1],
                     "rotation": {"keys": [[1, [0, 0, 0]], [FRAMES, [90, 0, 200]]]}}
    nodes["ramp"] = {"type": "collider", "shape": "mesh", "path": "wedge.obj", "scale": 0.5, "resolution": 16,
                     "position": {"keys": [[2, [3, 3, 0]], [5, [3, 4, 0]]]}, "rotation": [0, 0, 90]}
    nodes["wall"] = {"type": "collider", "shape": "box", "size": [0.1, 2, 1], "position": [-3, 0, 0]}
    nodes["sim"].update(rigid_bodies=["@ball.rigid_body", "@crate.rigid_body"],
                        colliders=["@floor.collider", "@post.collider", "@ramp.collider", "@wall.collider"])
    return graph


def wanted_poses(tmp_path, graph):
    """{node: [(position, quaternion w x y z) of each frame]}: of rigid bodies by the state files, of colliders by keys."""
    poses = {}
    for i, name in enumerate(("ball", "crate")):
        rows = [read_ply(str(tmp_path / f"bake/state/sim.{f:04}.ply"))["rigid_body"][i] for f in range(1, FRAMES + 1)]
        poses[name] = [(np.array([r[n] for n in "xyz"]), np.array([r["q" + n] for n in "wxyz"])) for r in rows]
    shot = package.Graph.from_dict(graph, base_folder=str(tmp_path))
    for name in ("floor", "post", "ramp", "wall"):
        poses[name] = []
        for frame in range(1, FRAMES + 1):
            q = np.array([1.0, 0, 0, 0])
            for axis, angle in enumerate(np.radians(shot[name].at("rotation", frame)) / 2):
                turn = np.zeros(4)
                turn[0], turn[1 + axis] = np.cos(angle), np.sin(angle)
                w, v = turn[0] * q[0] - turn[1:] @ q[1:], turn[0] * q[1:] + q[0] * turn[1:] + np.cross(turn[1:], q[1:])
                q = np.array([w, *v])
            poses[name].append((np.array(shot[name].at("position", frame)), q))
    return poses


def check_shape(name, points):
    """Vertices in the solid's own frame, Z up, against what the graph says."""
    low, high = points.min(0), points.max(0)
    if name == "ball":
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.1, rtol=1e-5)
        assert len(np.unique(points.round(6), axis=0)) > 100
    elif name == "crate":
        np.testing.assert_allclose([low, high], np.array([[-1], [1]]) * [0.1, 0.15, 0.2], rtol=1e-6)
    elif name == "post":
        axis = np.clip(points[:, 2], -0.25, 0.25)
        np.testing.assert_allclose(np.linalg.norm(points - np.stack([0 * axis, 0 * axis, axis], 1), axis=1), 0.1, rtol=1e-5)
        np.testing.assert_allclose([low[2], high[2]], [-0.35, 0.35], rtol=1e-6)
    elif name == "ramp":
        np.testing.assert_allclose([low, high], [[0, 0, 0], [0.5, 0.5, 1]], atol=1e-7)
    elif name == "wall":
        np.testing.assert_allclose([low, high], np.array([[-1], [1]]) * [0.05, 1, 0.5], rtol=1e-6)
    else:
        assert name == "floor" and np.all(points[:, 2] == 0) and high[0] - low[0] > 3


def check_is_turned_outwards(points, triangles, normals):
    """By volume, and by its normals: faces of solids look outwards."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    assert np.all((flat[:, None] * normals[triangles]).sum(2) > 0)
    if np.ptp(points[:, 2]) > 0:
        assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0


def test_glb_holds_rigid_bodies_and_colliders(sunder, baked, tmp_path):  # noqa: F811
    graph = crowded_scene(tmp_path)
    baked(graph)
    export(sunder, "-o", "shot.glb", "--tolerance", "0.5", "--graph-folder", ".")
    glb, poses = Glb(tmp_path / "shot.glb"), wanted_poses(tmp_path, graph)
    animation, = glb.json["animations"]
    tracks = {(c["target"]["node"], c["target"]["path"]): glb.array(animation["samplers"][c["sampler"]]["output"])
              for c in animation["channels"]}
    roots = {glb.json["nodes"][i]["name"]: i for i in glb.json["scenes"][0]["nodes"]}
    assert list(roots) == ["clay", "ball", "crate", "floor", "post", "ramp", "wall"]
    for name, wanted in poses.items():
        index, node = roots[name], glb.json["nodes"][roots[name]]
        primitive, = glb.json["meshes"][node["mesh"]]["primitives"]
        local = glb.array(primitive["attributes"]["POSITION"]).astype(float)
        x, y, z = local.T
        upright = np.stack([x, -z, y], 1)
        check_shape(name, upright)
        nx, ny, nz = glb.array(primitive["attributes"]["NORMAL"]).T
        check_is_turned_outwards(upright, glb.array(primitive["indices"]).reshape(-1, 3), np.stack([nx, -nz, ny], 1))
        assert ((index, "rotation") in tracks) == (name not in ("floor", "wall"))  # what rests has no keys
        for k, (at, (w, *v)) in enumerate(wanted):
            q = tracks[index, "rotation"][k] if (index, "rotation") in tracks else np.array(node["rotation"])
            t = tracks[index, "translation"][k] if (index, "translation") in tracks else np.array(node["translation"])
            shown = rotated(q.astype(float), local) + t
            x, y, z = shown.T
            expected = rotated(np.array([*v, w]), upright) + at
            np.testing.assert_allclose(np.stack([x, -z, y], 1), expected, atol=2e-6)
    names = [glb.json["materials"][glb.json["meshes"][glb.json["nodes"][roots[n]]["mesh"]]["primitives"][0]["material"]]["name"]
             for n in ("ball", "floor")]
    assert names == ["Rigid Body", "Collider"]


def test_usda_holds_rigid_bodies_and_colliders(sunder, baked, tmp_path):  # noqa: F811
    graph = crowded_scene(tmp_path)
    baked(graph)
    export(sunder, "-o", "shot.usda", "--graph-folder", ".", "--frames", "2:5")
    poses = wanted_poses(tmp_path, graph)
    for root, _ in readings(tmp_path / "shot.usda")[0]:
        shot = root["shot"]
        assert [n for n in shot.children if n != "Looks"] == ["clay", "ball", "crate", "floor", "post", "ramp", "wall"]
        for name, wanted in poses.items():
            prim = shot.children[name]
            attributes = prim.attributes
            points = attributes["points"].value.astype(float)
            check_shape(name, points)
            assert attributes["points"].samples == {}
            assert list(attributes["xformOpOrder"].value) == ["xformOp:translate", "xformOp:orient"]
            for frame in range(2, 6):
                at, q = wanted[frame - 1]
                np.testing.assert_allclose(attributes["xformOp:translate"].at(frame), at, atol=1e-6)
                shown = np.asarray(attributes["xformOp:orient"].at(frame), float)
                assert abs(shown @ q) > 1 - 1e-6  # the same turn
            assert (attributes["xformOp:translate"].samples == {}) == (name in ("floor", "wall"))


@pytest.mark.parametrize("scale", [1, 0.25])
def test_a_collider_that_deforms_is_a_mesh_of_samples_in_usda_and_told_of_in_glb(sunder, baked, tmp_path, scale):  # noqa: F811
    graph = crowded_scene(tmp_path)
    rest = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 2]], float)  # as the file's faces use them first

    def places(frame):  # it swings as a whole by 0.3 rad a frame, and its tip goes
        angle = 0.3 * (frame - 1)
        c, s = np.cos(angle), np.sin(angle)
        moved = rest + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0.2 * (frame - 1), 0, 0]]
        return moved @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [3, 3, 0]

    np.save(tmp_path / "ramp.npy", np.stack([places(frame) for frame in range(1, FRAMES + 2)]))
    graph["nodes"]["ramp"] = {"type": "collider", "shape": "mesh", "path": "wedge.obj", "motion": "vertices", "motion_path": "ramp.npy"}
    graph["nodes"]["sim"]["time_scale"] = scale
    baked(graph)
    export(sunder, "-o", "shot.usda", "--graph-folder", ".")
    for root, _ in readings(tmp_path / "shot.usda")[0]:
        ramp = root["shot"].children["ramp"].attributes
        assert "xformOp:translate" not in ramp
        for frame in range(1, FRAMES + 1):
            shown = 1 + scale * (frame - 1)
            points = np.asarray(ramp["points"].at(frame), float)
            if shown == int(shown):
                np.testing.assert_allclose(points, places(shown), atol=1e-6)
            else:  # on its way, turned with the whole, which its tip leans: a chord would be 11 mm off
                np.testing.assert_allclose(points, places(shown), atol=6e-3)
            faces = np.asarray(ramp["faceVertexIndices"].value).reshape(-1, 3)
            normals = np.asarray(ramp["normals"].at(frame), float).reshape(-1, 3, 3)
            a, b, c = points[faces].transpose(1, 0, 2)
            wanted = np.cross(b - a, c - a)
            wanted /= np.linalg.norm(wanted, axis=1)[:, None]
            assert np.abs(normals - wanted[:, None]).max() < 1e-5
            assert np.abs(np.asarray(ramp["extent"].at(frame), float) - [points.min(0), points.max(0)]).max() < 1e-6
        assert len(ramp["points"].samples) == FRAMES
    note = export(sunder, "-o", "shot.glb", "--graph-folder", ".", "--tolerance", "1").out
    assert "'ramp' is left out, for it deforms" in note
    (tmp_path / "ramp.npy").unlink()
    note = export(sunder, "-o", "again.usda", "--graph-folder", ".").out
    assert "'ramp' is left out, for its mesh or motion cannot be read" in note and "motion_path" in note


def test_what_cannot_be_there_is_told(sunder, baked, tmp_path):  # noqa: F811
    graph = crowded_scene(tmp_path)
    del graph["nodes"]["cache"]
    baked(graph)
    note = export(sunder, "-o", "shot.usda").out  # the bake folder has no wedge.obj
    assert "rigid bodies of 'sim' are left out" in note and "'ramp' is left out" in note and "--graph-folder" in note
    root = readings(tmp_path / "shot.usda")[0][0][0]
    assert [n for n in root["shot"].children if n != "Looks"] == ["clay", "floor", "post", "wall"]
    export(sunder, "-o", "clay.usda", "--node", "out")  # one mesh alone
    assert [n for n in readings(tmp_path / "clay.usda")[0][0][0]["shot"].children if n != "Looks"] == ["clay"]


def test_a_bake_nodes_own_export_finds_what_the_graph_names(sunder, scene, tmp_path):
    graph = crowded_scene(tmp_path)
    graph["nodes"]["out"]["export"] = "usda"
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    made = readings(tmp_path / "bake/mesh/block.usda")[0][0][0]["shot"].children
    assert [n for n in made if n != "Looks"] == ["clay", "ball", "crate", "floor", "post", "ramp", "wall"]
    export(sunder, "-o", "shot.usda", "--graph-folder", ".")
    assert (tmp_path / "shot.usda").read_bytes() == (tmp_path / "bake/mesh/block.usda").read_bytes()


def test_a_bake_tells_what_its_exports_leave_out(sunder, scene, tmp_path):
    graph = crowded_scene(tmp_path)
    graph["nodes"]["out"]["export"] = "usda"
    del graph["nodes"]["cache"]
    scene(graph)
    run = sunder("bake", "scene.json", "-o", "bake")
    assert run.status == 0 and "note: mesh/block.usda: rigid bodies of 'sim' are left out" in run.out
    assert "note:" not in sunder("bake", "scene.json", "-o", "bake", "--resume").out  # nothing is made again


LOOKS = {"sunder_looks": 1, "nodes": {
    "clay": {"name": "Vase 1", "materials": [{"name": "Glaze", "color": [0.1, 0.2, 0.3, 1], "metallic": 0.5, "roughness": 0.25}],
             "interior": {"name": "Shard", "transmission": 1.0}},
    "ball": {"name": "Anvil", "mesh": "looks/anvil.obj", "materials": [{"name": "Iron", "metallic": 1.0}]}}}


def test_looks_of_a_host(sunder, baked, tmp_path):  # noqa: F811
    graph = crowded_scene(tmp_path)
    baked(graph)
    (tmp_path / "bake/looks").mkdir()
    (tmp_path / "bake/looks/anvil.obj").write_text((tmp_path / "wedge.obj").read_text())
    (tmp_path / "bake/looks.json").write_text(json.dumps(LOOKS))
    export(sunder, "-o", "shot.glb", "--tolerance", "0.5")
    glb = Glb(tmp_path / "shot.glb")
    roots = [glb.json["nodes"][i] for i in glb.json["scenes"][0]["nodes"]]
    assert [r["name"] for r in roots] == ["Vase 1", "Anvil", "crate", "floor", "post", "wall"]  # no ramp: see the note
    assert glb.json["nodes"][roots[0]["children"][0]]["name"].startswith("Vase 1.0")
    primitive, = glb.json["meshes"][roots[1]["mesh"]]["primitives"]
    x, y, z = glb.array(primitive["attributes"]["POSITION"]).T
    np.testing.assert_allclose([x.max(), -z.min(), y.max()], [1, 1, 2])
    by_name = {m["name"]: m for m in glb.json["materials"]}
    assert by_name["Glaze"]["pbrMetallicRoughness"] == {
        "baseColorFactor": [0.1, 0.2, 0.3, 1], "metallicFactor": 0.5, "roughnessFactor": 0.25}
    assert by_name["Shard"]["extensions"] == {"KHR_materials_transmission": {"transmissionFactor": 1}}
    assert glb.json["extensionsUsed"] == ["KHR_materials_transmission"]
    assert by_name["Iron"]["pbrMetallicRoughness"]["metallicFactor"] == 1
    export(sunder, "-o", "shot.usda")
    for root, _ in readings(tmp_path / "shot.usda")[0]:
        surface = root["shot/Looks/Glaze/surface"].attributes
        np.testing.assert_allclose(surface["inputs:diffuseColor"].value, [0.1, 0.2, 0.3], rtol=1e-6)
        assert root["shot/Looks/Shard/surface"].attributes["inputs:opacity"].value == 0
        assert {"Vase_1", "Anvil"} <= set(root["shot"].children)


@pytest.mark.parametrize("text,words", [
    ("{", "looks.json"),
    ('{"sunder_looks": 2, "nodes": {}}', "no looks"),
    ('{"sunder_looks": 1, "nodes": {"ball": {"mesh": "../x.ply"}}}', "leaves the bake folder"),
    ('{"sunder_looks": 1, "nodes": {"ball": {"mesh": "gone.ply"}}}', "gone.ply"),
    ('{"sunder_looks": 1, "nodes": {"ball": {"materials": [{"color": [1, 2, 3]}]}}}', "node 'ball', material 0"),
    ('{"sunder_looks": 1, "nodes": {"ball": {"materials": [{"roughness": "x"}]}}}', "from 0 to 1"),
])
def test_looks_that_cannot_be_read_are_refused(sunder, baked, tmp_path, text, words):  # noqa: F811
    baked(block_scene((1, 2)))
    (tmp_path / "bake/looks.json").write_text(text)
    run = sunder("export", "bake", "-o", "shot.usda")
    assert run.status == 3 and words in run.err, run.err
    assert not (tmp_path / "shot.usda").exists()
