"""Baking through the program: what is on disk after it ends in any way, and that it goes on to the same bits."""
import json
import os
import pty
import resource
import select
import signal
import subprocess
import time

import pytest

from conftest import PROGRAM, block_scene, contents


def bake(sunder, *arguments):
    run = sunder("bake", "scene.json", "-o", *arguments)
    assert run.status == 0, run.err
    return run


@pytest.fixture
def whole(sunder, scene, tmp_path):
    """An unbroken bake of the block scene, in whole/."""
    scene()
    bake(sunder, "whole")
    return contents(tmp_path / "whole")


def long_scene(states=True):
    """Long enough that a signal arrives in its midst on any machine."""
    graph = block_scene((1, 120))
    if not states:
        del graph["nodes"]["cache"]
    return graph


def started(tmp_path, folder, *arguments):
    """A bake that has at least three whole frames and is still running."""
    process = subprocess.Popen(
        [PROGRAM, "bake", "scene.json", "-o", folder, *arguments],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    for _ in range(3):
        assert process.stdout.readline().startswith(b"frame")
    return process


def test_one_line_a_frame_where_there_is_no_terminal(sunder, scene):
    scene()
    lines = bake(sunder, "out").out.splitlines()
    assert [line.split(":")[0] for line in lines[:-1]] == [f"frame {i} of 10" for i in range(1, 11)]
    assert "20 files" in lines[-1]


def test_a_bar_with_time_left_on_a_terminal(scene, tmp_path):
    scene(long_scene())
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [PROGRAM, "bake", "scene.json", "-o", "out"],
        cwd=tmp_path,
        stdout=slave,
        stderr=slave,
        env={**os.environ, "TERM": "xterm"},
    )
    os.close(slave)
    shown = b""
    while select.select([master], [], [], 60)[0]:
        try:
            shown += os.read(master, 65536)
        except OSError:  # the other end was closed
            break
    assert process.wait() == 0
    assert b"[####" in shown and b"%" in shown
    assert b"frame 5 of" not in shown  # no plain lines beside the bar
    assert shown.rstrip().splitlines()[-1].split(b"\x1b[K")[-1].startswith(b"out: frames 1 to 120 baked")


def test_any_number_of_threads_gives_the_same_bits(sunder, scene, tmp_path, whole):
    for threads in (1, 2, 4):
        bake(sunder, f"t{threads}", "--threads", threads)
        assert contents(tmp_path / f"t{threads}") == whole


def test_nothing_is_read_that_was_never_written(sunder, scene, tmp_path):
    """Six blocks about one that is hit, which takes parts of the substeps for itself: with memory filled otherwise."""
    graph = block_scene((1, 12))
    nodes = graph["nodes"]
    del nodes["skin"], nodes["out"]
    nodes["clay"].update({"youngs_modulus": 1e6, "yield": None})
    for k in range(6):
        x, y = 0.75 * (k % 3) - 0.75, 0.9 * (k // 3) - 0.45
        nodes[f"block{k}"] = {**nodes["block"], "center": [x, y, 0.6]}
        nodes[f"clay{k}"] = {**nodes["clay"], "fragments": f"@block{k}.fragments"}
        nodes["sim"]["bodies"].append(f"@clay{k}.body")
    scene(graph)
    bakes = []
    for filled_with in ("0", "85", "170", "255"):
        environment = {**os.environ, "MALLOC_PERTURB_": filled_with}
        run = sunder("bake", "scene.json", "-o", filled_with, "--threads", 2, env=environment)
        assert run.status == 0, run.err
        bakes.append(contents(tmp_path / filled_with))
    assert all(bake == bakes[0] for bake in bakes)


def test_extended_by_resume(sunder, tmp_path, whole):
    bake(sunder, "out", "--frames", "1:4")
    bake(sunder, "out", "--resume", "--frames", "1:7")
    bake(sunder, "out", "--resume")
    assert contents(tmp_path / "out") == whole
    assert "there already" in bake(sunder, "out", "--resume").out
    assert contents(tmp_path / "out") == whole


@pytest.mark.parametrize("states", [True, False])
def test_killed_and_resumed_gives_the_bits_of_an_unbroken_run(sunder, scene, tmp_path, states):
    scene(long_scene(states))
    bake(sunder, "whole")
    for _ in range(3):
        process = started(tmp_path, "out", "--resume")
        process.kill()
        assert process.wait() == -signal.SIGKILL
        process.communicate()
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert 3 <= len(manifest["frames"]) < 120, "it was killed too late"
    bake(sunder, "out", "--resume")
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_cleanly_with_130_and_can_be_resumed(sunder, scene, tmp_path, which):
    scene(long_scene())
    bake(sunder, "whole")
    process = started(tmp_path, "out")
    process.send_signal(which)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"sunder: error: out: cancelled after" in err and b"--resume" in err
    assert not [name for name in contents(tmp_path / "out") if name.endswith(".sunder-tmp")]
    n_frames = len(json.loads((tmp_path / "out" / "manifest.json").read_text())["frames"])
    assert 3 <= n_frames < 120
    run = sunder("verify", "out")
    assert run.status == 3 and len(run.errors) == 1 and "not baked yet" in run.lines[0], run.err
    bake(sunder, "out", "--resume")
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")


def test_a_full_disk_is_told_and_nothing_is_lost(sunder, tmp_path, whole):
    bake(sunder, "out", "--frames", "1:3")

    def small_disk():  # fails a write part of the way as a full disk does, and needs no privileges
        resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))

    run = sunder("bake", "scene.json", "-o", "out", "--resume", preexec_fn=small_disk)
    assert (
        run.status == 1 and len(run.errors) == 1 and "cannot write" in run.lines[0] and "--resume" in run.lines[0]
    ), run.err
    frames = {k: v for k, v in contents(tmp_path / "out").items() if k != "manifest.json" and not k.startswith(".sunder/")}
    assert frames.items() <= whole.items()
    assert len(json.loads((tmp_path / "out" / "manifest.json").read_text())["frames"]) == 3
    bake(sunder, "out", "--resume")
    assert contents(tmp_path / "out") == whole


def test_a_folder_that_cannot_be_is_told(sunder, scene, tmp_path):
    scene()
    (tmp_path / "file").write_text("mine")
    for folder in ("file", "file/sub", "/proc/nowhere"):
        run = sunder("bake", "scene.json", "-o", folder)
        assert (
            run.status == 1 and len(run.errors) == 1 and folder.split("/")[1 if folder[0] == "/" else 0] in run.lines[0]
        ), run.err
    assert (tmp_path / "file").read_text() == "mine"


def test_set_changes_the_graph_and_the_manifest_tells(sunder, scene, tmp_path):
    scene()
    bake(
        sunder,
        "out",
        "--frames",
        "1:2",
        "--set",
        "clay.toughness=null",
        "--set",
        "ball.position=[0,0,1]",
        "--set",
        "cache.path=s/x.##.ply",
    )
    nodes = json.loads((tmp_path / "out" / "manifest.json").read_text())["graph"]["nodes"]
    assert nodes["clay"]["toughness"] is None and nodes["ball"]["position"] == [0, 0, 1]
    assert (tmp_path / "out" / "s" / "x.02.ply").is_file()
    run = sunder("bake", "scene.json", "-o", "out", "--resume")
    assert run.status == 3 and "'clay', 'toughness': null was baked, now 0.06" in run.lines[0], run.err


def test_a_changed_input_file_is_told(sunder, scene, tmp_path):
    from conftest import mesh_scene, obj_text

    scene(mesh_scene())
    (tmp_path / "mesh.obj").write_text(obj_text())
    bake(sunder, "out", "--frames", "1:1")
    (tmp_path / "mesh.obj").write_text(obj_text() + "# again\n")
    run = sunder("bake", "scene.json", "-o", "out", "--resume")
    assert run.status == 3 and "mesh.obj" in run.lines[0] and "changed" in run.lines[0], run.err


def test_baked_states_are_those_that_evaluation_gives(sunder, tmp_path, whole):
    import numpy as np
    import sunder as package

    graph = package.Graph.load(tmp_path / "scene.json")
    for frame in (1, 5, 10):
        live, baked = graph.evaluate("sim.state", frame), package.read_state(
            tmp_path / "whole" / "state" / f"sim.{frame:04d}.ply"
        )
        for name in (
            "position",
            "orientation",
            "velocity",
            "angular_velocity",
            "plastic_deformation",
            "yield",
            "strain",
            "edge_intact",
            "edges",
            "rigid_position",
            "body",
            "fragment",
            "piece",
        ):
            assert np.array_equal(getattr(live, name), getattr(baked, name)), name
    assert live.edge_intact.min() == 0  # it broke
