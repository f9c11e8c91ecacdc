"""What Sunder 0.1.0 wrote (tests/data/version_0_1_0) is read and verified, and never mixed with what this version computes."""
import json
import shutil
import subprocess
from pathlib import Path

import pytest

import sunder
from conftest import PROGRAM

OLD = Path(__file__).resolve().parents[1] / "data/version_0_1_0"


def run(*words):
    return subprocess.run([PROGRAM, *map(str, words)], text=True, capture_output=True, timeout=120)


@pytest.fixture
def old(tmp_path):
    return Path(shutil.copytree(OLD, tmp_path / "old"))


@pytest.mark.parametrize("bake", ["beam", "shot/sunder_cache/Cube_Fracture-5668a33f"])
def test_a_bake_is_whole_and_tells_its_version(old, bake):
    verified = run("verify", old / bake)
    assert verified.returncode == 0 and "whole" in verified.stdout, verified.stdout + verified.stderr
    assert "bake by Sunder 0.1.0" in run("info", old / bake).stdout


def test_resuming_a_bake_names_both_versions_and_leaves_it(old):
    before = {path: path.read_bytes() for path in (old / "beam").rglob("*") if path.is_file()}
    refused = run("bake", old / "beam.json", "-o", old / "beam", "--resume")
    assert refused.returncode != 0
    assert f"Sunder 0.1.0 baked it, this is {sunder.version()}" in refused.stderr
    assert {path: path.read_bytes() for path in (old / "beam").rglob("*") if path.is_file()} == before


def test_every_frame_is_described_and_exported(old, tmp_path):
    for path in sorted((old / "beam").glob("*/*.ply")):
        told = run("info", path)
        assert told.returncode == 0 and told.stdout, f"{path}: {told.stderr}"
    exported = run("export", old / "beam", "-o", tmp_path / "beam.usda")
    assert exported.returncode == 0, exported.stderr
    assert (tmp_path / "beam.usda").read_text().startswith("#usda 1.0")


def test_its_graph_is_computed_anew(old):
    """A graph of that time means what it meant: what it leaves out is as it was."""
    baked = json.loads((old / "beam/manifest.json").read_text())["graph"]["nodes"]
    graph = sunder.Graph.load(old / "beam.json")
    for name, fields in baked.items():
        now = graph[name].parameters()
        same = {key: value for key, value in fields.items() if key in now}
        assert same and {key: now[key] for key in same} == same
    done = run("bake", old / "beam.json", "-o", old / "again")
    assert done.returncode == 0, done.stderr


def test_a_cut_of_another_version_is_made_anew(old):
    """A kept cut is taken by the version that made it alone; another cuts again and keeps its own."""
    shot = old / "shot/sunder_cache/Cube_Fracture-5668a33f"
    (kept,) = (shot / "cuts").glob("*.cut")
    was = kept.read_bytes()
    assert was.startswith(b"sunder cut 2, sunder 0.1.0")
    graph = sunder.Graph.load(shot / "graph.json")
    graph.set_cut_folder(str(shot / "cuts"))
    mesh = graph.evaluate("deformer.mesh")
    assert len(mesh.triangles) > 12
    new = [path for path in (shot / "cuts").glob("*.cut") if path.read_bytes() != was]
    assert len(new) == 1 and new[0].read_bytes().startswith(f"sunder cut 2, sunder {sunder.version()}".encode())


def test_a_cut_folder_is_described_and_its_pieces_are_solids(old):
    told = run("info", old / "cut")
    assert told.returncode == 0 and "fragments      4" in told.stdout, told.stderr
    pieces = sorted((old / "cut/pieces").iterdir())
    assert len(pieces) == 4
    for piece in pieces:
        assert "no faults" in run("fracture", "--check", piece).stdout, piece


def test_cutting_anew_replaces_a_cut_folder(old):
    mesh, = (old / "shot").rglob("mesh_file-*.ply")
    done = run("fracture", mesh, "-o", old / "cut", "--pieces", 3)
    assert done.returncode == 0, done.stderr
    listing = json.loads((old / "cut/fragments.json").read_text())
    assert listing["sunder"] == sunder.version() and len(listing["fragments"]) == 3
    assert len(list((old / "cut/pieces").iterdir())) == 3
