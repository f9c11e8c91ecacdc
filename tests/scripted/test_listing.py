"""sunder nodes, info, verify, --help, --version."""
import json

from conftest import contents, mesh_scene, obj_text


def test_help_and_version_are_answers_not_errors(sunder):
    assert sunder("--version").out.startswith("sunder 0.")
    for arguments in (["--help"], ["bake", "--help"], ["fracture", "--help"]):
        run = sunder(*arguments)
        assert run.status == 0 and "Usage" in run.out and not run.err


def test_nodes_are_listed_for_people_and_programs(sunder):
    nodes = json.loads(sunder("nodes", "--json").out)["nodes"]
    types = [n["type"] for n in nodes]
    assert {
        "mesh_file",
        "lattice",
        "prefracture",
        "body",
        "collider",
        "rigid_body",
        "pin",
        "force",
        "solver",
        "deformer",
        "bake_mesh",
        "bake_state",
    } <= set(types)
    text = sunder("nodes").out
    for node in nodes:
        assert node["type"] in text
        for parameter in node["parameters"]:
            assert parameter["name"] in text and parameter["sentence"]
    assert sunder("nodes", "--markdown").out.startswith("#")


def test_info_tells_what_things_are(sunder, scene, tmp_path):
    (tmp_path / "mesh.obj").write_text(obj_text())
    scene()
    assert sunder("bake", "scene.json", "-o", "out", "--frames", "1:2").status == 0
    for path, needles in {
        "mesh.obj": ["mesh", "volume", "1 m3", "pieces", "bounds a solid"],
        "scene.json": ["graph", "sim: solver", "1 to 10"],
        "out": ["2 of 1 to 2", "complete"],
        "out/manifest.json": ["bake"],
        "out/state/sim.0002.ply": ["27 in 1 bodies", "frame, time    2"],
        "out/mesh/block.0002.ply": ["mesh frame", "vertex", "corner_normals"],
    }.items():
        run = sunder("info", path)
        assert run.status == 0, run.err
        for needle in needles:
            assert needle in run.out, run.out
    (tmp_path / "open.obj").write_text("\n".join(obj_text().splitlines()[:-1]) + "\n")
    run = sunder("info", "open.obj")
    assert run.status == 0 and "bounds no solid" in run.out and "open" in run.out


def test_looking_changes_nothing(sunder, scene, tmp_path):
    scene()
    assert sunder("bake", "scene.json", "-o", "out", "--frames", "1:2").status == 0
    before = contents(tmp_path)
    for arguments in (["verify", "out"], ["info", "out"], ["info", "scene.json"]):
        assert sunder(*arguments).status == 0
    assert contents(tmp_path) == before


def test_verify_tells_every_fault(sunder, scene, tmp_path):
    scene()
    assert sunder("bake", "scene.json", "-o", "out", "--frames", "1:4").status == 0
    # Two a frame, what broke in three of them, and what fragments bore.
    assert "whole, 12 files" in sunder("verify", "out").out
    (tmp_path / "out/state/sim.0001.ply").unlink()
    (tmp_path / "out/mesh/block.0002.ply").write_bytes(b"ply\n")
    run = sunder("verify", "out")
    assert run.status == 3
    assert ["sim.0001.ply" in run.lines[0] or "sim.0001.ply" in run.lines[1], len(run.lines)] == [True, 2], run.err
