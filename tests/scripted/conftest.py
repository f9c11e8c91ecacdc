"""What scripted tests share: the program as users run it, small scenes, small meshes."""
import json
import os
import re
import subprocess
import types

import pytest

PROGRAM = os.environ["SUNDER_PROGRAM"]
ERROR_LINE = re.compile(r"^sunder: error: (?P<where>.+?): (?P<what>.+?)(?: \((?P<mend>.+)\))?$")


def block_scene(frames=(1, 10)):
    """A small brittle block under a falling ball: contacts, a rigid body, plastic flow, broken edges."""
    return {
        "sunder": 1,
        "frame_rate": 24,
        "frame_range": list(frames),
        "nodes": {
            "block": {"type": "lattice", "size": [0.3, 0.3, 0.3], "cells": [3, 3, 3], "center": [0, 0, 0.2]},
            "clay": {
                "type": "body",
                "fragments": "@block.fragments",
                "youngs_modulus": 1e5,
                "yield": 0.01,
                "flow_rate": 20,
                "hardening": 0.5,
                "toughness": 0.06,
            },
            "ball": {
                "type": "rigid_body",
                "shape": "sphere",
                "radius": 0.1,
                "mass": 20,
                "position": [0.03, 0.02, 0.6],
                "velocity": [0, 0, -6],
            },
            "floor": {"type": "collider", "shape": "plane"},
            "sim": {
                "type": "solver",
                "bodies": ["@clay.body"],
                "rigid_bodies": ["@ball.rigid_body"],
                "colliders": ["@floor.collider"],
                "substeps": 4,
            },
            "skin": {"type": "deformer", "body": "@clay.body", "state": "@sim.state"},
            "out": {"type": "bake_mesh", "mesh": "@skin.mesh", "path": "mesh/block.####.ply"},
            "cache": {"type": "bake_state", "state": "@sim.state", "path": "state/sim.####.ply"},
        },
    }


def mesh_scene(mesh="mesh.obj", **cut):
    """A mesh from a file, cut and dropped; only its first frame matters."""
    return {
        "sunder": 1,
        "frame_range": [1, 2],
        "nodes": {
            "file": {"type": "mesh_file", "path": mesh},
            "pieces": {"type": "prefracture", "mesh": "@file.mesh", "pieces": 8, **cut},
            "clay": {"type": "body", "fragments": "@pieces.fragments"},
            "sim": {"type": "solver", "bodies": ["@clay.body"]},
            "cache": {"type": "bake_state", "state": "@sim.state"},
        },
    }


CUBE_VERTICES = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
CUBE_FACES = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]


def obj_text(vertices=CUBE_VERTICES, faces=CUBE_FACES):
    lines = ["v " + " ".join(map(str, v)) for v in vertices] + ["f " + " ".join(map(str, f)) for f in faces]
    return "\n".join(lines) + "\n"


def contents(folder):
    """Every file below a folder with its bytes."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def run_program(*arguments, cwd=None, **options):
    """Runs the program; `errors` are its error lines taken apart. A crash is never an answer."""
    done = subprocess.run(
        [PROGRAM, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, timeout=300, **options
    )
    assert done.returncode >= 0, f"killed by signal {-done.returncode}: {done.stderr}"
    lines = [line for line in done.stderr.splitlines() if line.startswith("sunder: error")]
    matches = [ERROR_LINE.match(line) for line in lines]
    assert all(matches), f"not an error line of ours: {lines}"
    return types.SimpleNamespace(
        status=done.returncode,
        out=done.stdout,
        err=done.stderr,
        lines=lines,
        errors=[types.SimpleNamespace(**m.groupdict()) for m in matches],
    )


@pytest.fixture
def sunder(tmp_path):
    """Runs the program in a folder of its own."""
    return lambda *arguments, **options: run_program(*arguments, cwd=tmp_path, **options)


@pytest.fixture
def scene(tmp_path):
    """Writes a graph file and gives its path: scene(), scene(graph), scene(text)."""

    def write(graph=None, name="scene.json"):
        graph = block_scene() if graph is None else graph
        (tmp_path / name).write_text(graph if isinstance(graph, str) else json.dumps(graph))
        return tmp_path / name

    return write
