"""The Python package: graphs edited and evaluated, arrays, errors, progress, cancelling, lifetimes."""
import gc
import json
import subprocess
import sys
import threading

import numpy as np
import pytest

import sunder
from conftest import CUBE_FACES, PROGRAM, block_scene, contents, obj_text


@pytest.fixture
def graph():
    return sunder.Graph.from_dict(block_scene())


def test_a_graph_built_in_python_is_the_graph_of_the_file(graph, tmp_path):
    built = sunder.Graph()
    built.frame_rate, built.frame_range = 24, (1, 10)
    for name, fields in block_scene()["nodes"].items():
        fields = dict(fields)
        built.add(fields.pop("type"), name, **fields)
    assert built.to_dict() == {**graph.to_dict(), "sunder": 2}  # what is new is of the latest version
    built.save(tmp_path / "g.json")
    assert sunder.Graph.load(tmp_path / "g.json").to_dict() == built.to_dict()
    assert (built["clay"]["damping_time"], graph["clay"]["damping_time"]) == ("auto", 0.002)
    assert list(built) == list(block_scene()["nodes"]) and len(built) == 8 and "sim" in built and "sun" not in built


def test_parameters_are_read_and_set_by_name(graph):
    node = graph["clay"]
    assert node.type == "body" and node["toughness"] == 0.06 and node["density"] == 1000
    node["toughness"] = np.float32(0.5)
    assert node["toughness"] == 0.5
    node["position"] = np.array([1, 2, 3])
    assert node["position"] == [1, 2, 3]
    node["toughness"] = {"keys": [[1, 0.1], [3, 0.2]]}
    assert node.at("toughness", 2) == pytest.approx(0.15)
    node["yield"] = None
    assert node["yield"] is None
    del node["toughness"]
    described = {p["name"]: p for p in sunder.node_types()["body"]["parameters"]}
    assert node["toughness"] == described["toughness"]["default"]
    assert graph["sim"]["bodies"] == ["@clay.body"] and node["fragments"] == "@block.fragments"
    assert node.parameters()["density"] == 1000


def test_wires_are_made_and_cut(graph):
    graph.add("collider", "wall", shape="box")
    graph.connect("wall.collider", "sim.colliders")
    assert graph["sim"]["colliders"] == ["@floor.collider", "@wall.collider"]
    graph.disconnect("sim.colliders")
    assert graph["sim"]["colliders"] == []
    graph["sim"]["colliders"] = "@wall.collider"
    graph.remove("wall")
    assert graph["sim"]["colliders"] == []


def test_a_state_has_the_arrays_that_the_contract_names(graph):
    s = graph.evaluate("sim.state", frame=6)
    n, m = 27, 54
    shapes = {
        "position": (n, 3),
        "orientation": (n, 4),
        "velocity": (n, 3),
        "angular_velocity": (n, 3),
        "plastic_deformation": (n, 3, 3),
        "strain": (n,),
        "yield_": (n,),
        "edges": (m, 2),
        "edge_intact": (m,),
        "fragment": (n,),
        "body": (n,),
        "piece": (n,),
        "rigid_position": (1, 3),
        "rest_position": (n, 3),
        "mass": (n,),
    }
    for name, shape in shapes.items():
        assert getattr(s, name).shape == shape, name
    assert s.position.dtype == np.float64 and s.frame == 6 and s.time == pytest.approx(5 / 24)
    assert np.allclose(np.linalg.norm(s.orientation, axis=1), 1)
    assert np.allclose(np.linalg.det(s.plastic_deformation), 1, atol=1e-6)  # flow keeps volume; rounding of many steps
    assert np.array_equal(s.fragment, np.arange(n)) and (s.edges[:, 0] < s.edges[:, 1]).all()
    start = graph.evaluate("sim.state")  # the first frame unless told
    assert start.frame == 1 and np.array_equal(start.position, start.rest_position)
    assert np.array_equal(start.orientation, start.rest_orientation) and np.all(start.edge_intact == 1)


def test_a_mesh_has_the_arrays_that_the_contract_names(graph):
    m = graph.evaluate("skin.mesh", frame=1)
    v, t = len(m.positions), len(m.triangles)
    assert m.positions.dtype == np.float32 and m.normals.shape == (3 * t, 3) and m.uvs.shape[1] == 2
    assert m.face_material.shape == m.face_fragment.shape == (t,) and m.vertex_fragment.shape == (v,)
    a, b, c = (m.positions[m.triangles[:, i]].astype(float) for i in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(0.027, rel=1e-4)  # float32 positions


def rotations(quaternions):
    w, x, y, z = np.asarray(quaternions).T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def skinned(m, s):
    """By the formula that Mesh tells."""
    T, t, R = s.particle_transform, s.particle_turned, s.particle_turn
    carried = T - rotations(R) @ t
    made = []
    for v, x in enumerate(np.column_stack([m.rest_positions, np.ones(len(m.rest_positions))])):
        which = slice(m.influence_offset[v], m.influence_offset[v + 1])
        i, w = m.influence_particle[which], m.influence_weight[which]
        assert w.sum() == 1
        turn = (w * np.where(R[i] @ R[i[w.argmax()]] < 0, -1, 1)) @ R[i]
        Q, = rotations(turn[None] / np.linalg.norm(turn))
        made.append(w @ (carried[i] @ x) + Q @ (w @ (t[i] @ x)))
    return np.array(made)


def test_a_renderer_can_skin_by_itself(graph):
    m, s = graph.evaluate("skin.mesh", frame=6), graph.evaluate("sim.state", frame=6)
    assert s.edge_intact.min() == 0  # it tore, or this guards little
    assert not s.particle_turned.any()  # no sheet
    assert np.allclose(skinned(m, s), m.positions, rtol=0, atol=2e-7)  # single precision of positions below 2 m


def test_a_renderer_can_skin_a_bent_sheet_by_itself():
    scene = block_scene()
    scene["nodes"]["block"].update(size=[0.6, 0.3, 0.02], cells=[12, 6, 1])
    scene["nodes"]["clay"].update({"youngs_modulus": 1e6, "toughness": 0.2})
    graph = sunder.Graph.from_dict(scene)
    m, s = graph.evaluate("skin.mesh", frame=6), graph.evaluate("sim.state", frame=6)
    assert s.particle_turned.any(axis=(1, 2)).all()
    assert np.abs(s.particle_turn[:, 1:]).max() > 0.1  # it bent
    assert np.allclose(skinned(m, s), m.positions, rtol=0, atol=2e-7)


def test_fragments_have_the_arrays_that_the_contract_names(graph):
    f = graph.evaluate("block.fragments")
    assert (
        len(f) == 27
        and f.rest_position.shape == (27, 3)
        and f.rest_orientation.shape == (27, 4)
        and f.radii.shape == (27, 3)
    )
    assert f.volume.sum() == pytest.approx(0.027) and f.edges.shape == (54, 2)
    assert np.allclose(f.interfaces.area, 0.01) and len(f.interfaces) == 54
    assert np.allclose(np.abs(f.interfaces.normal).max(axis=1), 1)
    piece = f.fragment_mesh(26)
    assert piece.triangles.max() < len(piece.positions)
    with pytest.raises(IndexError):
        f.fragment_mesh(27)
    with pytest.raises(IndexError):
        f.fragment_mesh(-1)


def test_arrays_outlive_value_and_graph():
    g = sunder.Graph.from_dict(block_scene())
    state = g.evaluate("sim.state", frame=5)
    position, orientation = state.position, state.orientation  # of the value itself, and made for the caller
    copies = position.copy(), orientation.copy()
    del state, g
    gc.collect()
    [np.random.default_rng(i).random(100_000) for i in range(50)]  # whoever frees too early is overwritten
    assert np.array_equal(position, copies[0]) and np.array_equal(orientation, copies[1])
    with pytest.raises(ValueError):
        position[0] = 0  # results are shared with the graph's cache


def test_results_are_not_changed_by_later_edits(graph):
    before = graph.evaluate("sim.state", frame=5)
    kept = before.position.copy()
    graph["clay"]["youngs_modulus"] = 5e5
    after = graph.evaluate("sim.state", frame=5)
    assert np.array_equal(before.position, kept) and not np.array_equal(after.position, kept)


@pytest.mark.parametrize(
    "action, code, node, parameter",
    [
        (lambda g: g["clay"].set(density=-1), "bad_input", "clay", "density"),
        (lambda g: g["clay"].set(denisty=1), "bad_input", "clay", "denisty"),
        (lambda g: g["clay"].set(density=float("nan")), "bad_input", "clay", "density"),
        (lambda g: g["clay"].set(position=np.full(3, np.inf)), "bad_input", "clay", "position"),
        (lambda g: g["clay"].set(density=object()), "bad_usage", "clay", "density"),
        (lambda g: g["clay"].set(density={1}), "bad_usage", "clay", "density"),
        (lambda g: g["clay"].set(density=b"1"), "bad_usage", "clay", "density"),
        (lambda g: g["clay"].set(density={(1, 2): 3}), "bad_usage", "clay", "density"),
        (lambda g: g["clay"].set(density="\ud800"), "bad_input", "clay", "density"),
        (lambda g: g.add("body", "\ud800"), "bad_usage", "", ""),
        (lambda g: g.bake("d", frames=(1, 2, 3)), "bad_usage", "", ""),
        (lambda g: g.bake("d", frames=()), "bad_usage", "", ""),
        (lambda g: g.evaluate_all(5), "bad_usage", "", ""),
        (lambda g: g.evaluate_all("sim.state"), "bad_usage", "", ""),
        (lambda g: g.seed_state("sim", 1, "state"), "bad_usage", "", ""),
        (lambda g: sunder.export("d", "x.usda", frames=5), "bad_usage", "", ""),
        (lambda g: sunder.export("d", "x.usda", tolerance="x"), "bad_usage", "", ""),
        (lambda g: setattr(g, "frame_range", (1,)), "bad_usage", "", ""),
        (lambda g: setattr(g, "frame_range", (1, 2.5)), "bad_usage", "", ""),
        (lambda g: setattr(g, "frame_rate", "x"), "bad_usage", "", ""),
        (lambda g: setattr(g, "frame_rate", None), "bad_usage", "", ""),
        (lambda g: g["clay"].at("density", "x"), "bad_usage", "", ""),
        (lambda g: g.set_threads("x"), "bad_usage", "", ""),
        (lambda g: g.evaluate("sim.state", "x"), "bad_usage", "", ""),
        (lambda g: g.evaluate("sim.state", float("inf")), "bad_usage", "", ""),
        (lambda g: g.evaluate("block.fragments").fragment_mesh(1.5), "bad_usage", "", ""),
        (lambda g: g["cloy"], "bad_input", "cloy", ""),
        (lambda g: g.add("boddy", "x"), "bad_input", "x", "type"),
        (lambda g: g.add("body", "clay"), "bad_input", "clay", ""),
        (lambda g: g.connect("block.fragments", "sim.bodies"), "bad_input", "sim", "bodies"),
        (lambda g: g.evaluate("sim.stat"), "bad_input", "sim", "stat"),
        (lambda g: g.evaluate("nonsense"), "bad_input", "", ""),
        (lambda g: sunder.Graph.load("gone.json"), "bad_input", "", ""),
        (lambda g: sunder.Graph.from_dict("{"), "bad_input", "", ""),
        (lambda g: sunder.read_state("gone.ply"), "bad_input", "", ""),
        (lambda g: sunder.verify("gone"), "bad_input", "", ""),
        (lambda g: g.bake("x", resume=True, restart=True), "bad_usage", "", ""),
        (lambda g: g["cl\0ay"], "bad_input", None, ""),
        (lambda g: g.save("a\0b"), "bad_usage", "", ""),
    ],
)
def test_errors_say_code_node_and_parameter(graph, action, code, node, parameter):
    before = graph.to_dict()
    with pytest.raises(sunder.Error) as caught:
        action(graph)
    e = caught.value
    assert (e.code, e.parameter) == (code, parameter) and (node is None or e.node == node) and e.what and str(e)
    assert graph.to_dict() == before


@pytest.mark.parametrize(
    "action, value, permitted",
    [
        (lambda g, n: g.evaluate("sim.state", frame=n), 2**32 + 5, "-1000000 to 1000000"),
        (lambda g, n: g.evaluate("sim.state", frame=n), 10**30, "-1000000 to 1000000"),
        (lambda g, n: g.evaluate_all(["sim.state"], n), 2**32 + 5, "-1000000 to 1000000"),
        (lambda g, n: g.start_evaluate("sim.state", n), 2**32 + 5, "-1000000 to 1000000"),
        (lambda g, n: g.start_evaluate_all(["sim.state"], n), -(2**40), "-1000000 to 1000000"),
        (lambda g, n: g.seed_state("sim", n, g.evaluate("sim.state")), 2**32 + 5, "-1000000 to 1000000"),
        (lambda g, n: setattr(g, "frame_range", (1, n)), 2**33, "-1000000 to 1000000"),
        (lambda g, n: g.bake("never", frames=(1, n)), 2**32 + 2, "-1000000 to 1000000"),
        (lambda g, n: g.start_bake("never", frames=(n, 5)), 2**32 + 1, "-1000000 to 1000000"),
        (lambda g, n: sunder.export("never", "x.usda", frames=(1, n)), 2**32 + 2, "-1000000 to 1000000"),
        (lambda g, n: g.set_threads(n), 2**32 + 2, "0 to 1024"),
        (lambda g, n: g.set_threads(n), 1025, "0 to 1024"),
        (lambda g, n: g.set_cache_limit(n), -1, f"0 to {2**64 - 1}"),
        (lambda g, n: g.set_cache_limit(n), 2**64, f"0 to {2**64 - 1}"),
    ],
)
def test_numbers_that_c_would_cut_off_are_refused(graph, action, value, permitted):
    before = graph.to_dict()
    with pytest.raises(sunder.Error) as caught:
        action(graph, value)
    assert caught.value.code == "bad_input" and str(value) in caught.value.what
    assert caught.value.mend == f"permitted: {permitted}" and graph.to_dict() == before


def test_whole_numbers_of_any_type_are_numbers(graph):
    graph.frame_range = np.array([2, 10])
    assert graph.frame_range == (2, 10) and graph.evaluate("sim.state", np.int64(3)).frame == 3
    graph.frame_rate, graph.frame_range = np.float32(25), (1.0, 4)
    assert graph.frame_rate == 25 and graph.frame_range == (1, 4)
    graph.set_threads(1024), graph.set_threads(0), graph.set_cache_limit(2**64 - 1), graph.set_cache_limit(0)


def test_a_removed_node_is_told_by_name(graph):
    node = graph.add("collider", "wall")
    graph.remove("wall")
    for action in (lambda: node.type, node.parameters, lambda: node["friction"], lambda: node.set(friction=1)):
        with pytest.raises(sunder.Error, match="node 'wall': there is no node of that name") as caught:
            action()
        assert caught.value.code == "bad_input" and caught.value.node == "wall"


def test_a_node_that_is_refused_is_not_left_behind(graph):
    with pytest.raises(sunder.Error):
        graph.add("body", "lead", density=-1)
    assert "lead" not in graph


def test_progress_is_told_and_cancels(graph):
    told = []
    graph.evaluate("sim.state", frame=4, progress=lambda fraction, text: told.append((fraction, text)))
    assert told and all(0 <= f <= 1 for f, _ in told) and [f for f, _ in told] == sorted(f for f, _ in told)
    with pytest.raises(sunder.Error) as caught:
        graph.evaluate("sim.state", frame=8, progress=lambda fraction, text: False)
    assert caught.value.code == "cancelled"
    assert graph.evaluate("sim.state", frame=8).frame == 8  # and it works on


def test_what_progress_raises_comes_out_again(graph):
    def fail(fraction, text):
        raise KeyboardInterrupt("stop")

    with pytest.raises(KeyboardInterrupt):
        graph.evaluate("sim.state", frame=8, progress=fail)


def test_cancel_from_another_thread_and_the_lock_is_free_meanwhile(graph):
    graph.frame_range = (1, 100000)
    running = threading.Event()
    failed = []

    def work():
        try:
            graph.evaluate("sim.state", frame=100000, progress=lambda fraction, text: running.set())
        except sunder.Error as error:
            failed.append(error.code)

    thread = threading.Thread(target=work)
    thread.start()
    assert running.wait(60)  # this thread runs while the other is inside the library
    graph.cancel()
    thread.join(60)
    assert not thread.is_alive() and failed == ["cancelled"]


def test_several_values_of_a_frame_are_those_of_each_alone(graph):
    graph.add("deformer", "whole", body="@clay.body", state="@sim.state", topology="constant")
    outputs, told = ["skin.mesh", "whole.mesh", "sim.state"], []
    for frame in (6, 3):
        several = graph.evaluate_all(outputs, frame, progress=lambda fraction, text: told.append(fraction))
        other = sunder.Graph.from_dict(graph.to_dict())
        for output, value in zip(outputs, several):
            alone = other.evaluate(output, frame)
            assert type(value) is type(alone) and value._arrays == alone._arrays
            for name in alone._arrays:
                assert getattr(value, name).tobytes() == getattr(alone, name).tobytes(), (output, name)
    assert told and told == sorted(told)
    assert len(several[1].positions) > len(several[0].positions)
    assert graph.evaluate_all([]) == [] and graph.evaluate_all(iter(["sim.state"]))[0].frame == 1


def test_of_several_values_the_first_error_is_raised_and_the_others_are_made(graph):
    with pytest.raises(sunder.Error) as caught:
        graph.evaluate_all(["skin.mesh", "sim.stat", "nobody.mesh"], 3)
    assert caught.value.node == "sim" and caught.value.parameter == "stat"
    never = lambda fraction, text: pytest.fail("it is made again")
    assert len(graph.evaluate("skin.mesh", 3, progress=never).positions) > 0
    with pytest.raises(sunder.Error) as caught:
        graph.evaluate_all(["skin.mesh", "sim.state"], 8, progress=lambda fraction, text: False)
    assert caught.value.code == "cancelled"


def test_a_job_works_beside_and_no_python_thread_does(tmp_path, graph):
    job = graph.start_evaluate("sim.state", 3)
    assert threading.active_count() == 1
    while not job.wait(0.1):
        fraction, text = job.progress
        assert 0 <= fraction <= 1
    job.result()
    graph.start_evaluate_all(["skin.mesh", "sim.state"], 4).result()
    with pytest.raises(sunder.Error, match="nobody"):
        graph.start_evaluate_all(["skin.mesh", "nobody.mesh"]).result()
    job = graph.start_bake(tmp_path / "a", frames=(1, 4))
    assert job.result()["n_frames"] == 4
    job = graph.start_bake(tmp_path / "a", frames=(1, 100000), resume=True)
    job.cancel()
    with pytest.raises(sunder.Error) as caught:
        job.result()
    assert caught.value.code == "cancelled"
    with pytest.raises(sunder.Error, match="nobody"):
        graph.start_evaluate("nobody.state").result()


def test_a_graph_with_a_job_is_the_jobs(tmp_path, graph):
    node, state = graph["clay"], graph.evaluate("sim.state", 2)
    before = graph.to_dict()
    actions = [
        lambda: node.set(density=5),
        lambda: node["density"],
        lambda: node.type,
        lambda: graph["clay"],
        lambda: graph.add("collider", "wall"),
        lambda: graph.remove("clay"),
        lambda: graph.connect("clay.body", "sim.bodies"),
        lambda: graph.to_dict(),
        lambda: graph.save(tmp_path / "g.json"),
        lambda: graph.frame_range,
        lambda: setattr(graph, "frame_rate", 30),
        lambda: graph.set_threads(1),
        lambda: graph.set_cache_limit(0),
        lambda: graph.evaluate("sim.state", 5),
        lambda: graph.evaluate_all(["skin.mesh"], 5),
        lambda: graph.seed_state("sim", 2, state),
        lambda: graph.bake(tmp_path / "a"),
        lambda: graph.start_evaluate("sim.state", 3),
        lambda: graph.start_bake(tmp_path / "a"),
    ]

    def are_refused(sentence):
        for action in actions:
            with pytest.raises(sunder.Error, match=sentence) as caught:
                action()
            assert caught.value.code == "bad_usage"
        assert not any(tmp_path.iterdir())

    job = graph.start_evaluate("sim.state", 100000)
    for _ in range(20):
        are_refused("a job of this graph is running")
        assert not job.wait(0.01) and 0 <= job.progress[0] <= 1
    assert state.position.shape == (27, 3)  # what was given out stays
    graph.cancel()
    assert job.wait(60)
    are_refused("a job of this graph is running")  # it ended, but nobody knows how
    with pytest.raises(sunder.Error) as caught:
        job.result()
    assert caught.value.code == "cancelled" and graph.to_dict() == before
    job = graph.start_evaluate("sim.state", 100000)
    del job  # nobody wants it: it is cancelled
    assert graph.to_dict() == before

    told = []
    node["density"] = 900
    before = graph.to_dict()
    graph.evaluate("sim.state", 4, progress=lambda *_: told or told.append(are_refused("another call")))
    assert told == [None] and graph.to_dict() == before


def test_bake_from_python(tmp_path, graph):
    report = graph.bake(tmp_path / "a", frames=(1, 4))
    assert report["n_frames"] == 4 and report["n_files"] == 8 and report["frames"] == (1, 4)
    graph.save(tmp_path / "g.json")
    sunder.bake(tmp_path / "g.json", tmp_path / "b", frames=(1, 2), threads=2)
    with pytest.raises(sunder.Error) as caught:
        sunder.bake(tmp_path / "g.json", tmp_path / "b")
    assert caught.value.code == "bad_input" and "resume" in caught.value.mend
    assert sunder.bake(tmp_path / "g.json", tmp_path / "b", frames=(1, 4), resume=True)["first_new_frame"] == 3
    assert contents(tmp_path / "a") == contents(tmp_path / "b")
    check = sunder.verify(tmp_path / "a")  # with the log of what broke
    assert check["files"] == 12 and check["bytes"] > report["bytes"] and check["faults"] == check["missing_frames"] == []


def test_a_bake_warns_as_the_program_does(tmp_path):
    """What was mended, what waits for two, what never goes off: by their nodes' names, from a job, too."""
    (tmp_path / "turned.obj").write_text(obj_text(faces=[CUBE_FACES[0][::-1], *CUBE_FACES[1:]]))
    scene = {"sunder": 2, "frame_rate": 24, "frame_range": [1, 3], "nodes": {
        "file": {"type": "mesh_file", "path": str(tmp_path / "turned.obj")},
        "cut": {"type": "prefracture", "mesh": "@file.mesh", "pieces": 8},
        "near": {"type": "fragment_region", "fragments": "@cut.fragments"},
        "clay": {"type": "body", "fragments": "@near.fragments"},
        "wait": {"type": "activate", "body": "@clay.body", "until": "frame", "frame": 9},
        "hold": {"type": "pin", "body": "@wait.body", "release_frame": 2, "region": "box", "box_min": [-2, -2, -2],
                 "box_max": [2, 2, 2]},
        "bomb": {"type": "blast", "frame": 0},
        "sim": {"type": "solver", "bodies": ["@wait.body"], "pins": ["@hold.pin"], "forces": ["@bomb.force"]},
        "cache": {"type": "bake_state", "state": "@sim.state"}}}
    graph = sunder.Graph.from_dict(scene)
    told = graph.bake(tmp_path / "a")["warnings"]
    assert [sentence.partition(":")[0] for sentence in told] == ["node 'cut'", "node 'sim'", "node 'bomb'"]
    assert "activate 'wait' holds" in told[1] and "'hold'" in told[1] and "never goes off" in told[2]
    job = graph.start_bake(tmp_path / "b")
    assert job.result()["warnings"] == told
    assert graph.bake(tmp_path / "b", resume=True)["warnings"] == []  # nothing was new
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    run = subprocess.run([PROGRAM, "bake", tmp_path / "scene.json", "-o", tmp_path / "c"], capture_output=True, text=True)
    assert [line.removeprefix("note: ") for line in run.stdout.splitlines() if line.startswith("note: ")] == told
    assert sunder.Graph.from_dict(block_scene((1, 2))).bake(tmp_path / "d")["warnings"] == []


def test_a_saved_state_is_gone_on_from(tmp_path, graph):
    graph.bake(tmp_path / "a", frames=(1, 5))
    other = sunder.Graph.from_dict(block_scene())
    other.seed_state("sim", 5, sunder.read_state(tmp_path / "a" / "state" / "sim.0005.ply"))
    assert np.array_equal(other.evaluate("sim.state", 7).position, graph.evaluate("sim.state", 7).position)


def test_nothing_leaks_over_many_values():
    code = """
import resource, sunder
g = sunder.Graph()
g.add("lattice", "bar", cells=[20, 20, 20])
def use():
    f = g.evaluate("bar.fragments")
    f.volume, f.interface_normal, f.rest_orientation
for i in range(20): use()
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for i in range(300): use()
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    # Each use makes 0.9 MB of arrays: 300 of them that nobody frees are 270 MB.
    assert int(run.stdout) < 50_000, run.stderr
