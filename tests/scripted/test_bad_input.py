"""What people can get wrong: an exit status, one sentence that says where and what, and no files left behind."""
import json

import pytest

from conftest import CUBE_FACES, CUBE_VERTICES, block_scene, contents, mesh_scene, obj_text


def refused(run, *needles, status=3):
    """The run ended with the status and one error line that holds all the needles."""
    assert run.status == status, run.err
    assert len(run.errors) == 1, run.err
    for needle in needles:
        assert needle in run.lines[0], run.lines[0]
    return run.errors[0]


def change(**nodes):
    """The block scene with fields of its nodes replaced (None of a node removes it)."""
    graph = block_scene()
    for name, fields in nodes.items():
        graph["nodes"].setdefault(name, {}).update(fields)
    return graph


BAD_GRAPHS = {
    "unknown_parameter": (change(clay={"tougness": 0.1}), ["'clay'", "tougness", "toughness"]),
    "unknown_node_type": (change(clay={"type": "boddy"}), ["'clay'", "boddy", "body"]),
    "unknown_node_in_wire": (change(sim={"bodies": ["@cley.body"]}), ["'sim'", "cley", "clay"]),
    "unknown_socket_in_wire": (change(sim={"bodies": ["@clay.bdy"]}), ["'sim'", "bdy", "body"]),
    "wire_of_wrong_type": (change(sim={"bodies": ["@block.fragments"]}), ["'sim'", "bodies", "fragments"]),
    "wire_missing": (change(sim={"bodies": []}), ["'sim'", "bodies"]),
    "text_for_number": (change(clay={"density": "heavy"}), ["'clay'", "density"]),
    "number_for_vector": (change(clay={"position": 3}), ["'clay'", "position"]),
    "short_vector": (change(clay={"position": [1, 2]}), ["'clay'", "position"]),
    "fraction_for_integer": (change(sim={"substeps": 2.5}), ["'sim'", "substeps"]),
    "boolean_for_number": (change(clay={"density": True}), ["'clay'", "density"]),
    "negative_density": (change(clay={"density": -1}), ["'clay'", "density"]),
    "negative_mass": (change(ball={"mass": -20}), ["'ball'", "mass"]),
    "poisson_ratio_too_large": (change(clay={"poisson_ratio": 0.6}), ["'clay'", "poisson_ratio"]),
    "no_such_choice": (change(floor={"shape": "cone"}), ["'floor'", "shape", "plane", "capsule"]),
    "null_where_none_may_be": (change(clay={"density": None}), ["'clay'", "density"]),
    "keys_out_of_order": (change(sim={"gravity": {"keys": [[5, [0, 0, 0]], [1, [0, 0, 1]]]}}), ["'sim'", "gravity"]),
    "keys_on_a_still_parameter": (change(clay={"density": {"keys": [[1, 5], [2, 6]]}}), ["'clay'", "density"]),
    "path_that_leaves_the_folder": (
        change(out={"path": "../x.####.ply"}),
        ["'out'", "path", "leaves the output folder"],
    ),
    "absolute_path": (change(out={"path": "/tmp/x.####.ply"}), ["'out'", "path"]),
    "path_without_frame": (change(out={"path": "x.ply"}), ["'out'", "path", "####"]),
    "unknown_mesh_format": (change(out={"path": "x.####.xyz"}), ["'out'", "path", ".ply or .obj"]),
    "two_nodes_one_file": (change(out={"path": "state/sim.####.ply"}), ["same file"]),
    "file_in_a_file": (change(out={"path": "state/sim.0002.ply/x.####.ply"}), ["'out'", "sim.0002.ply", "a file of node"]),
    "name_that_is_none": (change(**{"a@b": {"type": "lattice"}}), ["a@b"]),
    "range_reversed": (block_scene((10, 1)), ["frame_range", "reversed"]),
    "range_of_text": ({**block_scene(), "frame_range": ["a", "b"]}, ["frame_range"]),
    "frame_rate_zero": ({**block_scene(), "frame_rate": 0}, ["frame_rate"]),
    "unknown_setting": ({**block_scene(), "frame_rte": 24}, ["frame_rte", "frame_rate"]),
    "no_nodes": ({"sunder": 1}, ["nodes"]),
    "nothing_to_bake": ({"sunder": 1, "nodes": {}}, ["bake_mesh"]),
    "not_a_graph": ({"name": "a web page"}, ["not a graph"]),
    "later_version": ({"sunder": 3, "nodes": {}}, ["version 3", "versions 1 to 2"]),
    "cut_off": (json.dumps(block_scene())[:-20], ["JSON"]),
    "cut_off_between_values": (json.dumps(block_scene())[:-1], ["ends too early"]),
    "not_json": ("v 0 0 0\nf 1 2 3\n", ["JSON"]),
    "binary": ("\x00\x01\x02\xff", ["JSON"]),
    "blank": (" \n", ["JSON"]),
    "key_twice": ('{"sunder": 1, "nodes": {}, "nodes": {}}', ["twice"]),
    "too_large_a_number": (json.dumps(block_scene()).replace('"substeps": 4', '"substeps": 1e999'), ["finite"]),
    "huge_lattice": (change(block={"cells": [100000, 100000, 100000]}), ["'block'", "cells"]),
}


def test_an_empty_graph_is_told_as_one_that_was_cut_off(sunder, scene):
    refused(sunder("bake", scene(""), "-o", "out"), "JSON")


@pytest.mark.parametrize("name", BAD_GRAPHS)
def test_a_bad_graph_is_refused_by_name(sunder, scene, tmp_path, name):
    graph, needles = BAD_GRAPHS[name]
    refused(sunder("bake", scene(graph), "-o", "out"), *needles)
    assert not (tmp_path / "out").exists()


def test_a_cycle_is_told_with_its_nodes(sunder, scene):
    # No two of our node types form a cycle by their socket types, so the wire is refused for its type or for the cycle.
    refused(sunder("bake", scene(change(skin={"state": "@skin.mesh"})), "-o", "out"), "'skin'", "state")


NAN = obj_text([("nan", 0, 0), *CUBE_VERTICES[1:]])
BAD_MESHES = {
    "open": (obj_text(faces=CUBE_FACES[1:]), ["open"]),
    "one_triangle": (obj_text([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(1, 2, 3)]), []),
    "flat": (obj_text([(x, y, 0) for x, y, z in CUBE_VERTICES]), []),
    "nan": (NAN, []),
    "infinite": (obj_text([("1e999", 0, 0), *CUBE_VERTICES[1:]]), []),
    "no_faces": (obj_text(faces=[]), []),
    "empty": ("", []),
    "foreign": ("this is a letter, not a mesh\n", []),
    "missing_vertex": (obj_text(CUBE_VERTICES[:7]), []),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_a_bad_mesh_is_refused_with_its_fault(sunder, scene, tmp_path, name):
    text, needles = BAD_MESHES[name]
    (tmp_path / "mesh.obj").write_text(text)
    error = refused(sunder("bake", scene(mesh_scene(repair="refuse")), "-o", "out"), *needles)
    assert "mesh.obj" in error.where or "'file'" in error.where or "'pieces'" in error.where, error
    assert not list((tmp_path / "out").glob("state/*"))
    refused(sunder("fracture", "mesh.obj", "--pieces", "8", "--repair", "refuse", "-o", "cut"), *needles)
    assert not (tmp_path / "cut" / "fragments.json").exists()


def test_a_missing_mesh_is_refused_before_a_folder_is_made(sunder, scene, tmp_path):
    refused(sunder("bake", scene(mesh_scene("gone.obj")), "-o", "out"), "gone.obj", "'file'")
    assert not (tmp_path / "out").exists()
    refused(sunder("fracture", "gone.obj", "-o", "cut"), "gone.obj")
    assert not (tmp_path / "cut").exists()


@pytest.mark.parametrize(
    "pieces, needles",
    [("0", ["pieces"]), ("-5", ["pieces"]), ("many", ["pieces"]), ("2.5", ["pieces"]), ("100001", ["pieces"])],
)
def test_a_bad_number_of_pieces_is_refused(sunder, tmp_path, pieces, needles):
    (tmp_path / "mesh.obj").write_text(obj_text())
    refused(sunder("fracture", "mesh.obj", f"--pieces={pieces}", "-o", "cut"), *needles)
    assert not (tmp_path / "cut").exists()


def test_an_unknown_cut_method_is_refused(sunder, tmp_path):
    (tmp_path / "mesh.obj").write_text(obj_text())
    refused(sunder("fracture", "mesh.obj", "--method", "sawing", "-o", "cut"), "method", "kmeans")


@pytest.mark.parametrize(
    "arguments, status",
    [
        ([], 2),
        (["frobnicate"], 2),
        (["bake"], 2),
        (["bake", "--frob", "x.json"], 2),
        (["bake", "SCENE", "--frames", "a:b"], 2),
        (["bake", "SCENE", "--frames", "1:2:3"], 2),
        (["bake", "SCENE", "--frames", ":"], 2),
        (["bake", "SCENE", "--threads", "x"], 2),
        (["bake", "SCENE", "--resume", "--restart"], 2),
        (["bake", "SCENE", "--set", "substeps"], 2),
        (["bake", "SCENE", "--set", "sim=3"], 2),
        (["bake", "SCENE", "-o", ""], 2),
        (["fracture"], 2),
        (["info"], 2),
        (["verify"], 2),
        (["nodes", "--json", "--markdown"], 2),
        (["bake", "SCENE", "--frames", "9:2"], 3),
        (["bake", "SCENE", "--frames", "-3:2"], 3),
        (["bake", "SCENE", "--threads", "99999"], 3),
        (["bake", "SCENE", "--threads", "-7"], 3),
        (["bake", "SCENE", "--set", "sim.substeps=many"], 3),
        (["bake", "SCENE", "--set", "sum.substeps=3"], 3),
        (["bake", "gone.json"], 3),
        (["bake", "."], 3),
        (["info", "gone"], 3),
        (["info", "."], 3),
        (["verify", "gone"], 3),
        (["verify", "."], 3),
    ],
)
def test_wrong_usage_is_2_and_wrong_input_is_3(sunder, scene, tmp_path, arguments, status):
    path = scene()
    refused(sunder(*[path if a == "SCENE" else a for a in arguments]), status=status)
    assert contents(tmp_path).keys() == {"scene.json"}


def baked(sunder, scene, tmp_path):
    run = sunder("bake", scene(), "-o", "out", "--frames", "1:3")
    assert run.status == 0, run.err
    return tmp_path / "out"


@pytest.mark.parametrize(
    "damage, needles",
    [
        (lambda b: b[:-1], ["truncated"]),
        (lambda b: b[: len(b) // 2], ["truncated"]),
        (lambda b: b[:70], ["truncated"]),
        (lambda b: b + b"x", ["more than its header"]),
        (lambda b: b"", []),
        (lambda b: b.replace(b"state frame 3", b"state frame 9").replace(b"state frame 6", b"state frame 9"), ["state frame 9"]),
        (lambda b: b.replace(b"binary_little_endian", b"binary_big_endian"), ["another kind"]),
    ],
)
def test_a_damaged_state_frame_is_told(sunder, scene, tmp_path, damage, needles):
    frame = baked(sunder, scene, tmp_path) / "state" / "sim.0002.ply"
    frame.write_bytes(damage(frame.read_bytes()))
    refused(sunder("info", frame), "sim.0002.ply", *needles)
    refused(sunder("verify", "out"), "sim.0002.ply")
    refused(sunder("bake", "scene.json", "-o", "out", "--resume"), "sim.0002.ply", "--restart")


def test_a_state_of_another_bake_is_not_resumed_from(sunder, scene, tmp_path):
    out = baked(sunder, scene, tmp_path)
    other = block_scene()
    other["nodes"]["ball"]["mass"] = 25
    assert sunder("bake", scene(other, "other.json"), "-o", "other", "--frames", "1:3").status == 0
    (out / "state" / "sim.0003.ply").write_bytes((tmp_path / "other" / "state" / "sim.0003.ply").read_bytes())
    refused(sunder("bake", "scene.json", "-o", "out", "--resume"), "does not tell the truth", "sim.0003.ply")


@pytest.mark.parametrize(
    "name, how",
    {
        "wrong_hash": lambda m: m["frames"][1]["files"][0].update(hash="0123456789abcdef"),
        "wrong_size": lambda m: m["frames"][1]["files"][0].update(size=7),
        "negative_size": lambda m: m["frames"][1]["files"][0].update(size=-7),
        "file_that_is_not_there": lambda m: m["frames"][1]["files"][0].update(path="mesh/gone.0002.ply"),
        "file_outside": lambda m: m["frames"][1]["files"][0].update(path="../scene.json"),
        "absolute_file": lambda m: m["frames"][1]["files"][0].update(path="/etc/hostname"),
        "frame_left_out": lambda m: m["frames"].pop(1),
        "frame_twice": lambda m: m["frames"].append(m["frames"][2]),
        "frames_of_text": lambda m: m.update(frames="all"),
        "graph_gone": lambda m: m.pop("graph"),
        "later_format": lambda m: m.update(format="sunder manifest 2"),
        "another_format": lambda m: m.update(format="web manifest"),
    }.items(),
)
def test_a_manifest_that_lies_is_found_out(sunder, scene, tmp_path, name, how):
    path = baked(sunder, scene, tmp_path) / "manifest.json"
    manifest = json.loads(path.read_text())
    how(manifest)
    path.write_text(json.dumps(manifest, indent=1))
    before = contents(tmp_path)
    assert sunder("verify", "out").status == 3
    refused(sunder("bake", "scene.json", "-o", "out", "--resume"))
    assert contents(tmp_path) == before


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_a_manifest_that_was_cut_off_is_found_out_and_mended_by_restart(sunder, scene, tmp_path, share):
    path = baked(sunder, scene, tmp_path) / "manifest.json"
    text = path.read_text()
    path.write_text(text[: int(share * len(text))])
    refused(sunder("verify", "out"), "manifest.json")
    refused(sunder("bake", "scene.json", "-o", "out", "--resume"), "manifest.json")
    run = sunder("bake", "scene.json", "-o", "out", "--restart", "--frames", "1:3")
    if share == 0:
        refused(run, "manifest.json")  # an empty file might be anybody's
    else:
        assert run.status == 0 and path.read_text() == text, run.err


def test_a_command_that_is_none_is_named_beside_those_that_are(sunder):
    refused(sunder("foo"), "'foo'", "fracture", "verify", status=2)


def test_no_output_folder_is_not_the_folder_of_the_default(sunder, tmp_path):
    (tmp_path / "cube.obj").write_text(obj_text())
    refused(sunder("fracture", "cube.obj", "-o", ""), "output", status=2)
    assert contents(tmp_path) == {"cube.obj": obj_text().encode()}
