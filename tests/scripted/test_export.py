"""Exports of bakes: what other programs read is what the mesh frames hold, in the right units and axes."""
import json
import os
import signal
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sunder as package
from conftest import PROGRAM, block_scene, contents
import usda_reader

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin_src/blender"))
from bake_reader import read_mesh_frame, read_ply  # noqa: E402


def constant_scene(frames=(1, 8), **out):
    graph = block_scene(frames)
    graph["nodes"]["skin"]["topology"] = "constant"
    graph["nodes"]["out"].update(out)
    return graph


def shattering_scene():
    """A turning block whose fragments come off at once and fly freely: nothing deforms."""
    graph = constant_scene((1, 6))
    graph["nodes"]["clay"].update(toughness=1e-7, youngs_modulus=1e7, angular_velocity=[100, 200, 300], velocity=[0, 0, 3], **{"yield": None})
    graph["nodes"]["sim"].update(rigid_bodies=[], colliders=[], self_collision=False)
    for name in ("ball", "floor"):
        del graph["nodes"][name]
    return graph


@pytest.fixture
def baked(sunder, scene, tmp_path):
    """Bakes a graph into bake/ and gives its mesh frames."""

    def run(graph):
        scene(graph)
        done = sunder("bake", "scene.json", "-o", "bake", "--restart")
        assert done.status == 0, done.err
        return [read_mesh_frame(p) for p in sorted((tmp_path / "bake/mesh").glob("*.ply"))]

    return run


def export(sunder, *arguments):
    run = sunder("export", "bake", *arguments)
    assert run.status == 0, run.err
    return run


def readings(path, has_meshes=True):
    """[(root, relative error)] of a USD file: by our own reader to the bit, by tinyusdz to the 8 digits that it tells; and the
    meshes of the latter. Without both of the latter where npm could not bring tinyusdz, which `./sunder test` says."""
    own = [(usda_reader.read(path), 0)]
    if usda_reader.why_there_is_no_tinyusdz():
        return own, None
    other = usda_reader.read_by_tinyusdz(path, has_meshes)
    return own + [(other.root, 1e-7)], other.meshes


def same_render_mesh(meshes, frame):
    """What tinyusdz hands to a renderer, to the bit: the same triangles, of vertices that it has split for their normals."""
    if meshes is None:
        return
    mesh = meshes["/shot/clay"]
    corners = mesh["points"].astype(np.float32).reshape(-1, 3)[mesh["faceVertexIndices"]]
    np.testing.assert_array_equal(corners.reshape(-1, 3, 3), frame.positions[frame.triangles])
    normals = mesh["normals"].astype(np.float32).reshape(-1, 3)[mesh["faceVertexIndices"]]
    np.testing.assert_array_equal(normals, frame.corner_normals)


def same_mesh(mesh, time, frame, rtol=0):
    at = {name: a.at(time) for name, a in mesh.attributes.items()}
    for name, values in (("points", frame.positions), ("velocities", frame.velocities), ("normals", frame.corner_normals)):
        np.testing.assert_allclose(at[name].astype(np.float32), values, rtol=rtol, atol=0)
    np.testing.assert_array_equal(at["faceVertexIndices"].reshape(-1, 3), frame.triangles)
    np.testing.assert_array_equal(at["faceVertexCounts"], np.full(len(frame.triangles), 3))
    np.testing.assert_allclose(at["primvars:Pref"].astype(np.float32), frame.rest, rtol=rtol, atol=0)
    np.testing.assert_array_equal(at["primvars:fragment"], frame.fragment)
    np.testing.assert_allclose(at["extent"].astype(np.float32), [frame.positions.min(0), frame.positions.max(0)], rtol=rtol)
    subsets = [c for c in mesh.children.values() if c.kind == "GeomSubset"]
    owner = np.full(len(frame.triangles), -1)
    for i, subset in enumerate(subsets):
        faces = subset.attributes["indices"].at(time)
        assert np.all(owner[faces] == -1)
        owner[faces] = i
    np.testing.assert_array_equal(owner, frame.material)


def check_stage(root, rate, first, last):
    m = root.metadata
    assert (m["upAxis"], m["metersPerUnit"]) == ("Z", 1)
    assert (m["timeCodesPerSecond"], m["startTimeCode"], m["endTimeCode"]) == (rate, first, last)
    assert m["defaultPrim"] == "shot" and root["shot"].kind == "Xform"


def test_usda_with_faces_that_appear(sunder, baked, tmp_path):
    frames = baked(block_scene((1, 8)))
    assert len({len(f.triangles) for f in frames}) > 1  # it tore
    export(sunder, "-o", "shot.usda")
    stages, meshes = readings(tmp_path / "shot.usda")
    same_render_mesh(meshes, frames[0])
    # Faces are written when they change, and only then.
    changes = 1 + sum(not np.array_equal(a.triangles, b.triangles) for a, b in zip(frames, frames[1:]))
    for root, rtol in stages:
        check_stage(root, 24, 1, 8)
        mesh = root["shot/clay"]
        assert mesh.kind == "Mesh"
        for time, frame in enumerate(frames, 1):
            same_mesh(mesh, time, frame, rtol)
        assert len(mesh.attributes["faceVertexIndices"].samples) == changes
        assert 1 < len(mesh.attributes["primvars:Pref"].samples) <= changes
        assert mesh.attributes["primvars:Pref"].metadata["interpolation"] == "vertex"
        assert "primvars:hidden" not in mesh.attributes
        for subset in mesh.children.values():  # bound to materials that are there
            assert root[subset.relations["material:binding"].strip("</>")].kind == "Material"
            assert subset.attributes["familyName"].value == "materialBind"
        assert mesh.children["interior"].kind == "GeomSubset"
        surface = root["shot/Looks/interior"]
        assert surface.relations["outputs:surface"] == "</shot/Looks/interior/surface.outputs:surface>"
        assert mesh.attributes["normals"].metadata["interpolation"] == "faceVarying"


def test_usda_of_constant_topology(sunder, baked, tmp_path):
    frames = baked(constant_scene())
    export(sunder, "-o", "shot.usda", "--frames", "2:7")
    stages, meshes = readings(tmp_path / "shot.usda")
    same_render_mesh(meshes, frames[1])
    for root, rtol in stages:
        check_stage(root, 24, 2, 7)
        mesh = root["shot/clay"]
        assert mesh.attributes["faceVertexIndices"].samples == {}
        for time in range(2, 8):
            same_mesh(mesh, time, frames[time - 1], rtol)
            np.testing.assert_array_equal(mesh.attributes["primvars:hidden"].at(time), frames[time - 1].hidden)
    assert len({int(f.hidden.sum()) for f in frames}) > 1  # it tore
    faces = read_ply(str(tmp_path / "bake/mesh/block.0007.ply"))["face"]
    np.testing.assert_array_equal(mesh.attributes["primvars:interface"].at(7), faces["interface"])
    assert faces["interface"].max() > 0


def test_usda_carries_uvs_and_the_artists_materials(sunder, scene, tmp_path):
    (tmp_path / "box.mtl").write_text("newmtl paint\nnewmtl 2nd\n")
    vertices = "".join(f"v {x} {y} {z}\n" for z in (0, 1) for y in (0, 1) for x in (0, 1))
    uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    quads = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    faces = ["f " + " ".join(f"{v}/{i + 1}" for i, v in enumerate(q)) for q in quads]
    (tmp_path / "box.obj").write_text("mtllib box.mtl\n" + vertices + uvs + "usemtl paint\n" + "\n".join(faces[:3]) + "\nusemtl 2nd\n" + "\n".join(faces[3:]) + "\n")
    graph = {"sunder": 1, "frame_range": [1, 2], "nodes": {
        "file": {"type": "mesh_file", "path": "box.obj"},
        "cut": {"type": "prefracture", "mesh": "@file.mesh", "pieces": 6},
        "clay": {"type": "body", "fragments": "@cut.fragments"},
        "sim": {"type": "solver", "bodies": ["@clay.body"]},
        "skin": {"type": "deformer", "body": "@clay.body", "state": "@sim.state", "topology": "constant"},
        "out": {"type": "bake_mesh", "mesh": "@skin.mesh"}}}
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    export(sunder, "-o", "shot.usda")
    frame = read_mesh_frame(tmp_path / "bake/mesh/mesh.0001.ply")
    faces = read_ply(str(tmp_path / "bake/mesh/mesh.0001.ply"))["face"]
    for root, rtol in readings(tmp_path / "shot.usda")[0]:
        mesh = root["shot/clay"]
        st = mesh.attributes["primvars:st"]
        np.testing.assert_allclose(st.value.astype(np.float32), frame.uvs, rtol=rtol)
        assert st.metadata["interpolation"] == "faceVarying"
        rim = mesh.attributes["primvars:rim"]
        assert rim.metadata["interpolation"] == "faceVarying"
        np.testing.assert_allclose(rim.value.astype(np.float32), faces["rim"].ravel(), rtol=rtol)
        assert list(mesh.children) == ["paint", "_2nd", "interior"]
        same_mesh(mesh, 1, frame, rtol)


def read_pc2(path):
    data = path.read_bytes()
    mark, version, points, first, step, samples = struct.unpack_from("<12siiffi", data)
    assert (mark, version, step) == (b"POINTCACHE2\0", 1, 1)
    assert len(data) == 32 + 12 * points * samples
    return first, np.frombuffer(data, "<f4", offset=32).reshape(samples, points, 3)


def test_pc2_and_its_mesh(sunder, baked, tmp_path):
    frames = baked(constant_scene())
    export(sunder, "-o", "cache/shot.pc2")
    first, samples = read_pc2(tmp_path / "cache/shot.pc2")
    assert first == 1
    np.testing.assert_array_equal(samples, [f.positions for f in frames])
    lines = (tmp_path / "cache/shot.obj").read_text().splitlines()
    vertices = np.array([line.split()[1:] for line in lines if line.startswith("v ")], np.float32)
    np.testing.assert_array_equal(vertices, frames[0].positions)
    faces = [[int(c.split("/")[0]) - 1 for c in line.split()[1:]] for line in lines if line.startswith("f ")]
    np.testing.assert_array_equal(faces, frames[0].triangles)


def test_sequences(sunder, baked, tmp_path):
    frames = baked(block_scene((1, 5)))
    export(sunder, "-o", "ply/shot.####.ply", "--node", "out", "--frames", "3:5")
    assert sorted(os.listdir(tmp_path / "ply")) == [f"shot.000{i}.ply" for i in (3, 4, 5)]
    for i in (3, 4, 5):
        assert (tmp_path / f"ply/shot.000{i}.ply").read_bytes() == (tmp_path / f"bake/mesh/block.000{i}.ply").read_bytes()
    export(sunder, "-o", "shot.#.obj")
    text = (tmp_path / "shot.5.obj").read_text()
    assert text.count("\nv ") == len(frames[4].positions) and text.count("\nf ") == len(frames[4].triangles)


def test_obj_files_have_the_host_s_names_of_materials(sunder, baked, tmp_path):
    baked(constant_scene())
    (tmp_path / "bake/looks.json").write_text(
        json.dumps({"sunder_looks": 1, "nodes": {"clay": {"materials": [{"name": "Paint Red"}]}}}))
    export(sunder, "-o", "shot.####.obj")
    export(sunder, "-o", "cache.pc2")
    for name in ("shot.0001.obj", "cache.obj"):
        lines = (tmp_path / name).read_text().splitlines()
        assert {line for line in lines if line.startswith("usemtl")} == {"usemtl Paint_Red", "usemtl interior"}, name


class Glb:
    """A binary glTF taken apart by the specification: every byte accounted for."""

    def __init__(self, path):
        data = path.read_bytes()
        magic, version, length, n_json, kind = struct.unpack_from("<4sIII4s", data)
        assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON") and n_json % 4 == 0
        self.json = json.loads(data[20:20 + n_json])
        n_binary, kind = struct.unpack_from("<I4s", data, 20 + n_json)
        assert kind == b"BIN\0" and 28 + n_json + n_binary == len(data)
        self.binary = data[28 + n_json:]
        assert self.json["buffers"] == [{"byteLength": n_binary}]
        assert sum(v["byteLength"] for v in self.json["bufferViews"]) == n_binary

    def array(self, index):
        a = self.json["accessors"][index]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[a["type"]]
        kind = {5125: "<u4", 5126: "<f4"}[a["componentType"]]
        offset = self.json["bufferViews"][a["bufferView"]]["byteOffset"]
        array = np.frombuffer(self.binary, kind, a["count"] * width, offset).reshape(-1, width)
        if "min" in a:
            np.testing.assert_array_equal([array.min(0), array.max(0)], np.float32([a["min"], a["max"]]))
        return array[:, 0] if width == 1 else array


def rotated(q, v):
    """v turned by the quaternion (x, y, z, w)."""
    return v + 2 * np.cross(q[:3], np.cross(q[:3], v) + q[3] * v)


def test_glb_moves_fragments_as_the_bake_does(sunder, baked, tmp_path):
    frames = baked(shattering_scene())
    assert frames[-1].hidden.sum() == 0
    note = export(sunder, "-o", "shot.glb").out
    assert "fragments are rigid" in note
    glb = Glb(tmp_path / "shot.glb")
    animation, = glb.json["animations"]
    tracks = {}
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        np.testing.assert_allclose(glb.array(sampler["input"]), np.arange(6) / 24, rtol=1e-6)
        tracks[channel["target"]["node"], channel["target"]["path"]] = glb.array(sampler["output"])
    root = glb.json["nodes"][glb.json["scenes"][0]["nodes"][0]]
    assert root["name"] == "clay" and len(root["children"]) == 27
    turned = 0
    for index in root["children"]:
        node = glb.json["nodes"][index]
        fragment = int(node["name"].rsplit(".", 1)[1])
        primitives = glb.json["meshes"][node["mesh"]]["primitives"]
        for k, frame in enumerate(frames):
            faces = frame.fragment == fragment
            corners = []
            for p in primitives:
                local = glb.array(p["attributes"]["POSITION"]).astype(float)
                normals = glb.array(p["attributes"]["NORMAL"]).astype(float)
                q = tracks[index, "rotation"][k].astype(float)
                at = rotated(q, local) + tracks[index, "translation"][k]
                picked = glb.array(p["indices"])
                x, y, z = at[picked].T
                corners.append(np.stack([x, -z, y], 1))  # back to Z up
                turned = max(turned, abs(q[:3]).max())
                nx, ny, nz = rotated(q, normals)[picked].T
                material = frames[0].material[faces & (frame.material == p["material"])]
                assert 3 * len(material) == len(picked)
                wanted = frame.corner_normals.reshape(-1, 3, 3)[faces & (frame.material == p["material"])].reshape(-1, 3)
                if k == 0:  # later, creases of the whole block have become rims of fragments
                    np.testing.assert_allclose(np.stack([nx, -nz, ny], 1), wanted, atol=1e-6)
            by_material = np.argsort(frame.material[faces], kind="stable")
            wanted = frame.positions[frame.triangles[faces][by_material].ravel()]
            np.testing.assert_allclose(np.concatenate(corners), wanted, atol=1e-5)
        assert np.all((tracks[index, "rotation"][1:] * tracks[index, "rotation"][:-1]).sum(1) > 0)
    assert turned > 0.5


def test_what_a_format_cannot_hold_is_refused(sunder, baked, tmp_path):
    baked(block_scene((1, 8)))
    for name in ("shot.pc2", "shot.glb"):
        run = sunder("export", "bake", "-o", name)
        assert run.status == 3 and "constant" in run.err, run.err
    baked(constant_scene())
    run = sunder("export", "bake", "-o", "shot.glb", "--tolerance", "1e-5")
    assert run.status == 3 and "deforms by" in run.err and "at frame" in run.err
    for arguments, words in [
        (("-o", "shot.abc"), ".abc"),
        (("-o", "shot.ply"), "####"),
        (("-o", "shot.####.usda"), "all frames"),
        (("-o", "shot.usda", "--node", "skim"), "permitted: out"),
        (("-o", "shot.usda", "--frames", "3:99"), "baked: 1 to 8"),
    ]:
        run = sunder("export", "bake", *arguments)
        assert run.status == 3 and words in run.err, run.err
    run = sunder("export", "scene.json", "-o", "shot.usda")
    assert run.status == 3 and "sunder bake" in run.err
    assert [p.name for p in tmp_path.glob("shot*")] == []  # and nothing is left behind
    export(sunder, "-o", "shot.usda")
    before = (tmp_path / "shot.usda").read_bytes()
    run = sunder("export", "bake", "-o", "shot.usda")
    assert run.status == 3 and "--overwrite" in run.err
    export(sunder, "-o", "shot.usda", "--overwrite")
    assert (tmp_path / "shot.usda").read_bytes() == before


def test_an_export_costs_no_file_that_is_there(sunder, baked, tmp_path):
    baked(block_scene((1, 3)))
    (tmp_path / "out").mkdir()
    (tmp_path / "out/seq.0002.obj").write_text("a week's work")
    (tmp_path / "link").symlink_to("bake/state")
    before = contents(tmp_path)
    run = sunder("export", "bake", "-o", "out/seq.####.obj")
    assert run.status == 3 and "seq.0002.obj" in run.err and "--overwrite" in run.err
    for name in ("bake/state/sim.####.ply", "bake/mesh/block.####.ply", "link/sim.####.ply", "bake/mesh/../state/sim.000#.ply"):
        for flags in ((), ("--overwrite",)):
            run = sunder("export", "bake", "-o", name, *flags)
            assert run.status == 3 and "is a file of the bake itself" in run.err, run.err
    for name in ("new/dir.####/shot.obj", "new/shot.usda.zip", "new/shot.####.glb", "new/shot.USDA"):
        assert sunder("export", "bake", "-o", name).status == 3
    assert contents(tmp_path) == before and not (tmp_path / "new").exists()
    export(sunder, "-o", "out/seq.####.obj", "--overwrite")
    assert (tmp_path / "out/seq.0002.obj").read_text().startswith("# sunder")


def test_a_bake_keeps_its_own_export(sunder, baked, tmp_path):
    baked(constant_scene((1, 2), export="pc2"))
    before = contents(tmp_path)
    run = sunder("export", "bake", "-o", "bake/mesh/block.pc2", "--overwrite", "--frames", "1:1")
    assert run.status == 3 and "is a file of the bake itself" in run.err
    assert contents(tmp_path) == before


def test_a_broken_frame_is_named(sunder, baked, tmp_path):
    baked(block_scene((1, 3)))
    path = tmp_path / "bake/mesh/block.0002.ply"
    path.write_bytes(path.read_bytes()[:-5])
    run = sunder("export", "bake", "-o", "shot.usda")
    assert run.status == 3 and "block.0002.ply" in run.err
    assert list(tmp_path.glob("shot*")) == []


@pytest.mark.parametrize("kind", ["usda", "pc2"])
def test_a_bake_node_exports_at_its_end_and_a_resumed_bake_gives_the_same_bits(sunder, scene, tmp_path, kind):
    scene(constant_scene((1, 8), export=kind))
    assert sunder("bake", "scene.json", "-o", "whole").status == 0
    assert sunder("verify", "whole").status == 0
    export_files = ["mesh/block." + e for e in {"usda": ["usda"], "pc2": ["pc2", "obj"]}[kind]]
    whole = contents(tmp_path / "whole")
    assert [e["path"] for e in json.loads(whole["manifest.json"])["exports"]] == export_files
    # Baked in two runs.
    assert sunder("bake", "scene.json", "-o", "parts", "--frames", "1:3").status == 0
    assert contents(tmp_path / "parts")[export_files[0]] != whole[export_files[0]]
    assert sunder("bake", "scene.json", "-o", "parts", "--resume").status == 0
    assert contents(tmp_path / "parts") == whole
    # The export was lost, or was being written when the run died: made again, nothing is simulated.
    for spoil in (lambda p: p.unlink(), lambda p: p.write_bytes(b"half")):
        spoil(tmp_path / "parts" / export_files[0])
        assert sunder("verify", "parts").status == 3
        assert sunder("bake", "scene.json", "-o", "parts", "--resume").status == 0
        assert contents(tmp_path / "parts") == whole
    # The same by hand.
    run = sunder("export", "whole", "-o", "shot." + kind)
    assert run.status == 0 and (tmp_path / ("shot." + kind)).read_bytes() == whole[export_files[0]]
    # Begun anew, nothing of the old one stays.
    assert sunder("bake", "scene.json", "-o", "parts", "--restart", "--set", "out.export=none").status == 0
    assert not (tmp_path / "parts" / export_files[0]).exists()


def test_a_killed_bake_with_an_export_goes_on_to_the_same_bits(sunder, scene, tmp_path):
    scene(constant_scene((1, 40), export="usda"))
    process = subprocess.Popen([PROGRAM, "bake", "scene.json", "-o", "killed"], cwd=tmp_path, stdout=subprocess.PIPE)
    for _ in range(3):
        assert process.stdout.readline().startswith(b"frame")
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    assert not (tmp_path / "killed/mesh/block.usda").exists()
    assert sunder("bake", "scene.json", "-o", "killed", "--resume").status == 0
    assert sunder("bake", "scene.json", "-o", "whole").status == 0
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")


def test_exports_that_cannot_be_are_refused_before_the_first_frame(sunder, scene):
    for kind in ("pc2", "glb"):
        graph = block_scene()
        graph["nodes"]["out"]["export"] = kind
        scene(graph)
        run = sunder("bake", "scene.json", "-o", "out")
        assert run.status == 3 and "topology" in run.err and "frame 1" not in run.out
    graph = constant_scene(path="mesh/block.####.obj", export="usda")
    scene(graph)
    assert "PLY" in sunder("bake", "scene.json", "-o", "out").err


def test_velocities_are_those_of_the_frames(scene):
    """At 960 frames a second a frame is one short step: positions differ by velocity times its length."""
    graph = block_scene((1, 60))
    graph["frame_rate"] = 960
    graph["nodes"]["sim"]["substeps"] = 1
    graph["nodes"]["clay"].update(angular_velocity=[90, 0, 180], damping_time=0)  # damping acts after the step
    for topology in ("compact", "constant"):
        graph["nodes"]["skin"]["topology"] = topology
        shot = package.Graph.from_dict(graph)
        before = np.array(shot.evaluate("skin.mesh", 29).positions, float)
        mesh = shot.evaluate("skin.mesh", 30)
        difference = (mesh.positions - before) * graph["frame_rate"]
        assert mesh.velocities.shape == mesh.positions.shape and mesh.velocities.dtype == np.float32
        speed = np.linalg.norm(mesh.velocities, axis=1)
        assert speed.max() > 0.5
        error = np.linalg.norm(mesh.velocities - difference, axis=1)
        # Half the acceleration of the step, and positions that are floats: 6e-8 m * 960 / s.
        assert error.max() < 0.02 * speed.max(), error.max()
