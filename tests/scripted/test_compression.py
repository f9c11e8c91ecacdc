"""Compressed bakes: the same frames in fewer bytes, for every reader; what is damaged is refused by name."""
import ctypes
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import sunder as package
from conftest import block_scene, contents

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin_src/blender"))
from bake_reader import Bake, BakeError, read_mesh_frame, read_ply  # noqa: E402


def packed_scene(frames=(1, 10)):
    graph = block_scene(frames)
    for node in ("out", "cache"):
        graph["nodes"][node]["compression"] = "zstd"
    return graph


def unpacked(data):
    """By the library itself."""
    zstd = ctypes.CDLL("libzstd.so.1")
    zstd.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    out = ctypes.create_string_buffer(max(1, zstd.ZSTD_getFrameContentSize(data, ctypes.c_size_t(len(data)))))
    n = zstd.ZSTD_decompress(out, ctypes.c_size_t(len(out)), data, ctypes.c_size_t(len(data)))
    return out.raw[:n]


@pytest.fixture
def both(sunder, scene, tmp_path):
    """The block scene in plain/ and packed/."""
    scene(block_scene(), "plain.json")
    scene(packed_scene(), "packed.json")
    for name in ("plain", "packed"):
        run = sunder("bake", f"{name}.json", "-o", name)
        assert run.status == 0, run.err
    return tmp_path


def test_frames_hold_the_bytes_of_uncompressed_ones(both):
    plain, packed = contents(both / "plain"), contents(both / "packed")
    frames = [name for name in plain if name.endswith(".ply")]
    assert sorted(name + ".zst" for name in frames) == sorted(name for name in packed if ".ply" in name)
    for name in frames:
        assert unpacked(packed[name + ".zst"]) == plain[name]
    assert sum(len(packed[name + ".zst"]) for name in frames) < 0.8 * sum(len(plain[name]) for name in frames)


def test_every_reader_reads_them(sunder, both):
    assert sunder("verify", "packed").status == 0
    for name in ("mesh/block.0007.ply", "state/sim.0007.ply"):
        plain, packed = (sunder("info", f"{folder}/{name}{end}") for folder, end in (("plain", ""), ("packed", ".zst")))
        assert packed.status == 0, packed.err
        assert plain.out.splitlines()[1:] == packed.out.splitlines()[1:]
    for folder in ("plain", "packed"):
        assert sunder("export", folder, "-o", f"{folder}.usda").status == 0
    assert (both / "plain.usda").read_bytes() == (both / "packed.usda").read_bytes()

    first, second = (Bake(str(both / name)) for name in ("plain", "packed"))
    for frame in (1, 7, 10):
        for a, b in zip(first.mesh_frame(first.meshes[0], frame), second.mesh_frame(second.meshes[0], frame)):
            np.testing.assert_array_equal(a, b)
        for a, b in zip(first.rigid_body_poses(frame), second.rigid_body_poses(frame)):
            np.testing.assert_array_equal(a, b)


def test_a_resumed_bake_has_the_bits_of_an_unbroken_one(sunder, both):
    run = sunder("bake", "packed.json", "-o", "again", "--frames", "1:4")
    assert run.status == 0, run.err
    run = sunder("bake", "packed.json", "-o", "again", "--resume")
    assert run.status == 0, run.err
    assert contents(both / "again") == contents(both / "packed")


def test_a_bake_goes_on_as_it_began(sunder, both):
    run = sunder("bake", "plain.json", "-o", "packed", "--resume")
    assert run.status == 3 and "compression" in run.err


@pytest.mark.parametrize("damage", [lambda d: d[:len(d) // 2], lambda d: d[:-1], lambda d: d[:40] + b"\xff\xff" + d[42:], lambda d: b"ply\n" + d,
                                    lambda d: d + b"more", lambda d: b""])
def test_a_damaged_frame_is_refused_by_name(sunder, both, damage):
    mesh = both / "packed/mesh/block.0007.ply.zst"
    mesh.write_bytes(damage(mesh.read_bytes()))
    for command in (("info", mesh), ("export", "packed", "-o", "out.usda")):
        run = sunder(*command)
        assert run.status == 3 and "block.0007.ply.zst" in run.err and "(" in run.err, run.err
    assert not (both / "out.usda").exists()
    with pytest.raises(BakeError, match="block.0007.ply.zst: "):
        read_mesh_frame(str(mesh))


def test_a_damaged_state_is_not_resumed_from(sunder, both):
    state = both / "packed/state/sim.0010.ply.zst"
    state.write_bytes(state.read_bytes()[:-7])
    graph = json.loads((both / "packed.json").read_text())
    graph["frame_range"] = [1, 12]
    (both / "packed.json").write_text(json.dumps(graph))
    run = sunder("bake", "packed.json", "-o", "packed", "--resume")
    assert run.status == 3 and "sim.0010.ply.zst" in run.err, run.err
    with pytest.raises(BakeError, match="sim.0010.ply.zst: "):
        read_ply(str(state))


def test_a_choice_that_is_not_there_is_refused():
    graph = package.Graph()
    graph.add("bake_mesh", "out")
    with pytest.raises(package.Error, match="zstd"):
        graph["out"]["compression"] = "gzip"
