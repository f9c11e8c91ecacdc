"""What a bake tells of what broke: when, where and why, and of what did not; however the bake went."""
import ctypes
import json
import shutil
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

import sunder as package
from conftest import PROGRAM, block_scene, contents, obj_text

OLD = Path(__file__).resolve().parents[1] / "data/version_0_1_0"


def strip(toughness=0.05, **body):
    """A strip held at one end, whose other end is drawn away."""
    return {"sunder": 2, "frame_rate": 24, "frame_range": [1, 24], "nodes": {
        "cut": {"type": "lattice", "size": [1, 0.1, 0.1], "cells": [10, 1, 1]},
        "strip": {"type": "body", "fragments": "@cut.fragments", "toughness": toughness, "fracture_energy": None, **body},
        "held": {"type": "pin", "body": "@strip.body", "region": "box", "box_min": [-1, -1, -1], "box_max": [-0.41, 1, 1]},
        "drawn": {"type": "pin", "body": "@strip.body", "region": "box", "box_min": [0.41, -1, -1], "box_max": [1, 1, 1],
                  "position": {"keys": [[1, [0, 0, 0]], [24, [0.12, 0, 0]]]}},
        "sim": {"type": "solver", "bodies": ["@strip.body"], "pins": ["@held.pin", "@drawn.pin"], "gravity": [0, 0, 0]},
        "cache": {"type": "bake_state", "state": "@sim.state", "path": "state/sim.####.ply"}}}


def baked(graph, folder, **options):
    package.bake(package.Graph.from_dict(graph), folder, **options)
    return package.report(folder)


def without_states(graph):
    del graph["nodes"]["cache"]
    return graph


@pytest.fixture(scope="module")
def hit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hit")
    return folder, baked(block_scene(), folder)


def test_a_hit_names_the_ball_when_it_hits(hit):
    _, told = hit
    first = told["first"]
    assert first == min(told["breaks"], key=lambda b: b["time"]) and told["complete"] and told["frames"] == [1, 10]
    assert (first["by"], first["by_kind"], first["body"], first["solver"]) == ("ball", "rigid_body", "clay", "sim")
    reaches = (-6 + (6**2 + 2 * 9.81 * 0.15) ** 0.5) / 9.81  # s, that the ball takes for 0.15 m
    assert reaches < first["time"] < reaches + 0.02
    assert all(abs(b["toughness"] - 0.06) < 1e-12 and b["strain"] > 0.06 for b in told["breaks"])
    assert all(b["by_kind"] in ("nothing", "rigid_body", "collider", "body") for b in told["breaks"])


def test_it_is_what_the_states_tell(hit):
    folder, told = hit
    frames = [package.read_state(folder / f"state/sim.{frame:04d}.ply") for frame in range(1, 11)]
    assert told["broken"] == len(told["breaks"]) == (frames[-1].edge_intact == 0).sum() > 0
    for state in frames:
        rows = [b for b in told["breaks"] if b["frame"] == state.frame]
        assert [b["edge"] for b in rows] == list(state.broken_edge)
        assert [b["time"] for b in rows] == list(state.broken_time)
        assert [b["strain"] for b in rows] == list(state.broken_strain)
        assert [b["toughness"] for b in rows] == list(state.broken_toughness)
        kinds = ["nothing", "body", "rigid_body", "collider", "seam"]
        assert [b["by_kind"] for b in rows] == [kinds[kind] for kind, _ in state.broken_by]
        for b in rows:
            ends = state.edges[b["edge"]]
            assert b["fragments"] == list(state.fragment[ends])
            assert np.allclose(b["position"], state.position[ends].mean(axis=0), atol=1e-12)
        for pieces in told["pieces"]:
            if pieces["frame"] == state.frame:
                sizes = np.sort(np.bincount(state.piece))[::-1]
                assert (pieces["pieces"], pieces["largest"]) == (len(sizes), list(sizes[:5])) and pieces["edges"] == len(rows)
    assert {p["frame"] for p in told["pieces"]} == {b["frame"] for b in told["breaks"]}


def test_the_log_needs_no_states_and_changes_nothing_else(hit, tmp_path):
    folder, told = hit
    assert baked(without_states(block_scene()), tmp_path / "bare") == told
    breaks = sorted(p.name for p in (tmp_path / "bare/breaks").iterdir())
    assert breaks == [f"sim.{pieces['frame']:04d}.json" for pieces in told["pieces"]]
    assert contents(folder / "breaks") == contents(tmp_path / "bare/breaks")


def test_the_program_tells_the_same(hit, sunder):
    folder, told = hit
    assert json.loads(sunder("report", folder, "--json").out) == told
    table = sunder("report", folder)
    assert table.status == 0 and f"{told['broken']} edges broken" in table.out
    assert "first: clay" in table.out and "pushed by ball" in table.out and "toughness" in table.out
    lines = sunder("report", folder, "--fragments", "0,3-5", "--body", "clay").out.splitlines()
    assert sum(line.startswith("clay") for line in lines) == 4


def test_what_a_pin_draws_is_pushed_by_nothing(tmp_path):
    told = baked(strip(), tmp_path / "out")
    assert told["broken"] > 0 and {b["by_kind"] for b in told["breaks"]} == {"nothing"}
    assert told["first"]["by"] is None and abs(told["first"]["toughness"] - 0.05) < 1e-12
    assert 0.05 < told["first"]["strain"] < 0.07  # the strip is drawn slowly


def test_why_it_did_not_break(tmp_path):
    """The strip is drawn by 0.12 m of 0.8 m between pins: log strain 0.14 in the middle, of a toughness of 0.5."""
    told = baked(strip(0.5), tmp_path / "out")
    assert told["breaks"] == told["pieces"] == told["fragments"] == [] and told["first"] is None
    assert not (tmp_path / "out/breaks").exists()
    states = [package.read_state(tmp_path / f"out/state/sim.{frame:04d}.ply") for frame in range(1, 25)]
    strains = np.array([state.strain for state in states])
    rows = package.report(tmp_path / "out", fragments="all")["fragments"]
    assert [row["fragment"] for row in rows] == list(range(10))
    for row in rows:
        own = strains[:, row["fragment"]]
        assert row["strain"] == own.max() and row["toughness"] == 0.5 and row["share"] == own.max() / 0.5 < 1
        assert row["frame"] == (states[own.argmax()].frame if own.max() > 0 else None)  # within a pin nothing is strained
        assert (row["broken_edges"], row["first_broken"]) == (0, None)
    middle, = package.report(tmp_path / "out", box=[[0, -1, -1], [0.1, 1, 1]])["fragments"]
    assert middle == rows[5] and 0.1 < middle["strain"] < 0.2
    assert package.report(tmp_path / "out", fragments=[5], body="strip")["fragments"] == [middle]
    for choice in ({"fragments": [10]}, {"body": "nobody"}, {"box": [[5, 5, 5], [6, 6, 6]]}):
        with pytest.raises(package.Error, match="none is chosen"):
            package.report(tmp_path / "out", **choice)


@pytest.fixture(scope="module")
def grouped(tmp_path_factory):
    """A cube of 16 fragments in clusters, with vertex groups, drawn apart."""
    folder = tmp_path_factory.mktemp("grouped")
    (folder / "cube.obj").write_text(obj_text())
    graph = {"sunder": 2, "frame_rate": 24, "frame_range": [1, 3], "nodes": {
        "file": {"type": "mesh_file", "path": str(folder / "cube.obj"), "groups": {"Low": [0, 1, 2, 3], "Corner": [6]}},
        "cut": {"type": "prefracture", "mesh": "@file.mesh", "pieces": 16, "clusters": 3},
        "cube": {"type": "body", "fragments": "@cut.fragments", "toughness": 0.05},
        "sim": {"type": "solver", "bodies": ["@cube.body"]},
        "cache": {"type": "bake_state", "state": "@sim.state"}}}
    package.bake(package.Graph.from_dict(graph), folder / "out")
    return folder / "out", package.Graph.from_dict(graph).evaluate("cut.fragments")


def test_vertex_groups_and_clusters_choose_fragments(grouped, sunder):
    bake, cut = grouped
    chosen = lambda **choice: [row["fragment"] for row in package.report(bake, **choice)["fragments"]]
    assert len(set(cut.cluster)) == 3
    for cluster in range(3):
        of = list(np.flatnonzero(cut.cluster == cluster))
        assert chosen(cluster=cluster) == of
        lines = sunder("report", bake, "--cluster", cluster).out.splitlines()
        assert sum(line.startswith("cube ") for line in lines) == len(of)
    low, corner = chosen(group="Low"), chosen(group="Corner")
    assert len(corner) == 1 and 1 < len(low) < 16  # four corners of the bottom are owned by at most four
    rows = package.report(bake, group="Low")["fragments"]
    assert {row["fragment"] for row in rows} <= set(np.flatnonzero(cut.rest_position[:, 2] < 0.5))
    assert np.all(cut.rest_position[corner[0]] > 0.5)
    lines = sunder("report", bake, "--group", "Corner").out.splitlines()
    assert [int(line.split()[1]) for line in lines if line.startswith("cube ")] == corner
    both = chosen(group="Low", cluster=int(cut.cluster[low[0]]))
    assert both == [f for f in low if cut.cluster[f] == cut.cluster[low[0]]]


def test_groups_and_clusters_that_are_not_there_are_refused(grouped, sunder, tmp_path):
    bake, _ = grouped
    with pytest.raises(package.Error, match="no body has a vertex group 'Lw'") as caught:
        package.report(bake, group="Lw")
    assert "permitted: Corner, Low" in str(caught.value)
    with pytest.raises(package.Error, match="none is chosen"):
        package.report(bake, cluster=7)
    with pytest.raises(package.Error, match="cluster"):
        package.report(bake, cluster=2**40)
    assert sunder("report", bake, "--group", "").status == sunder("report", bake, "--cluster", "x").status == 2
    old = Path(shutil.copytree(bake, tmp_path / "old"))
    file = json.loads((old / "manifest.json").read_text())["log"]["loads"][0]["path"]
    stamped(old, file, changed((old / file).read_text(), lambda content: content.pop("parts")))
    for choice in ({"group": "Low"}, {"cluster": 0}):
        with pytest.raises(package.Error, match="an earlier Sunder baked it"):
            package.report(old, **choice)
    for wrong in ([], [{}], [{"clusters": [0.5], "groups": {}}], [{"clusters": [2**33], "groups": {}}],
                  [{"clusters": [], "groups": {"Low": [-2]}}], [{"clusters": [], "groups": {"Low": 3}}]):
        stamped(old, file, changed((bake / file).read_text(), lambda content: content.update(parts=wrong)))
        with pytest.raises(package.Error, match="is not a whole log of loads"):
            package.report(old, group="Low")


def test_what_broke_has_borne_more_than_its_share(hit):
    folder, told = hit
    rows = package.report(folder, fragments="all")["fragments"]
    broken = {fragment for b in told["breaks"] for fragment in b["fragments"]}
    for row in rows:
        assert (row["broken_edges"] > 0) == (row["fragment"] in broken)
        if row["broken_edges"]:
            assert row["share"] > 1
            assert row["first_broken"] == min(b["time"] for b in told["breaks"] if row["fragment"] in b["fragments"])


@pytest.mark.parametrize("scale, frames", [(0.5, 19), (0.3, 31), (3, 4)])
def test_at_any_time_scale_each_edge_is_told_once(hit, tmp_path, scale, frames):
    graph = block_scene((1, frames))
    graph["nodes"]["sim"]["time_scale"] = scale
    told = baked(graph, tmp_path / "out")
    assert [b["edge"] for b in told["breaks"]] == [b["edge"] for b in hit[1]["breaks"]]
    assert [b["time"] for b in told["breaks"]] == [b["time"] for b in hit[1]["breaks"]]


def test_what_cracks_took_and_parted(sunder, tmp_path):
    """In the strip an interface is 0.1 x 0.1 m."""
    told = baked(strip(fracture_energy=100), tmp_path / "out")
    states = [package.read_state(tmp_path / f"out/state/sim.{frame:04d}.ply") for frame in range(1, 25)]
    last, of = states[-1], told["cracks"][0]
    parted = last.piece[last.edges[:, 0]] != last.piece[last.edges[:, 1]]
    assert of["solver"] == "sim" and parted.sum() > 0
    assert of["parted_area"] == pytest.approx(0.01 * parted.sum(), rel=1e-9)
    assert of["faded_area"] == pytest.approx(0.01 * last.edge_damage[~parted].sum(), rel=1e-9)
    assert of["surface_work"] == pytest.approx(100 * (of["parted_area"] + of["faded_area"]), rel=1e-9)
    assert of["energy"] > 0 and of["ratio"] == of["energy"] / of["surface_work"]
    assert " m2 between pieces, " in sunder("report", tmp_path / "out").out
    package.bake(package.Graph.from_dict(strip(fracture_energy=100)), tmp_path / "parts", frames=(1, 6))
    package.bake(package.Graph.from_dict(strip(fracture_energy=100)), tmp_path / "parts", resume=True)
    assert package.report(tmp_path / "parts")["cracks"] == told["cracks"]
    assert baked(strip(), tmp_path / "null")["cracks"] == []


def seamed(graph, **seam):
    nodes = graph["nodes"]
    nodes["seam"] = {"type": "seam", "body": "@strip.body", "between": "all", **seam}
    nodes["sim"]["bodies"] = ["@seam.body"]
    return graph


def test_new_area_takes_what_seams_leave_of_its_energy(tmp_path):
    """An edge that begins to fade at f of its strain opens as far: it takes f^2 of the energy. What a seam cuts takes none."""
    half = baked(seamed(strip(fracture_energy=100), mode="scale", toughness=0.5), tmp_path / "half")["cracks"][0]
    area = half["parted_area"] + half["faded_area"]
    assert half["parted_area"] > 0 and half["surface_work"] == pytest.approx(25 * area, rel=1e-9)
    box = {"between": "box", "box_min": [-0.01, -1, -1], "box_max": [0.01, 1, 1]}
    cut = baked(seamed(strip(toughness=9, fracture_energy=100), frame=3, **box), tmp_path / "cut")["cracks"][0]
    assert cut["parted_area"] == pytest.approx(0.01, rel=1e-9) and cut["surface_work"] == cut["energy"] == 0


def test_what_cracks_took_counts_as_toughness_is_when_they_part(tmp_path):
    """A seam that weakens more and more, and at last cuts what is left, takes nothing back of what was counted."""
    graph = strip(fracture_energy=100)
    graph["nodes"]["sim"]["bodies"] = ["@seam.body"]
    key = {"keys": [[1, 0.5], [23, 0.5], [24, 0.001]], "interpolation": "step"}
    graph["nodes"]["seam"] = {"type": "seam", "body": "@strip.body", "between": "all", "mode": "scale", "toughness": key}
    told = baked(graph, tmp_path / "keyed")
    assert {b["toughness"] for b in told["breaks"] if b["frame"] < 24} == {0.025}
    parted = 0.01 * sum(b["frame"] < 24 for b in told["breaks"])
    assert told["cracks"][0]["surface_work"] == pytest.approx(25 * parted, rel=0.05) and parted > 0


def test_it_says_where_energy_of_cracks_is_missing(sunder, tmp_path):
    graph, bake = strip(fracture_energy=100), tmp_path / "parts"
    whole = baked(graph, tmp_path / "whole")
    assert whole["cracks"][0]["since"] is None and whole["note"] == ""
    package.bake(package.Graph.from_dict(graph), bake, frames=(1, 18))
    assert package.report(bake)["cracks"][0]["energy"] > 0
    file = logs(bake)[1] if package.report(bake)["broken"] else json.loads((bake / "manifest.json").read_text())["log"]["loads"][0]["path"]
    stamped(bake, file, changed((bake / file).read_text(), lambda content: content.pop("cracks")))  # as before there were any
    package.bake(package.Graph.from_dict(graph), bake, resume=True)
    told = package.report(bake)
    row, full = told["cracks"][0], whole["cracks"][0]
    assert row["since"] == 19 and row["ratio"] is None and row["energy"] < full["energy"]
    assert (row["parted_area"], row["faded_area"]) == (full["parted_area"], full["faded_area"])
    assert told["note"] == "what cracks of 'sim' took before frame 19 is not counted"
    out = sunder("report", bake).out
    assert told["note"] in out and "J from frame 19 on" in out and "times their fracture energy" not in out
    package.bake(package.Graph.from_dict(graph), tmp_path / "late", frames=(18, 24))  # it begins within the shot
    assert package.report(tmp_path / "late")["cracks"][0]["since"] == 18


@pytest.mark.parametrize("first", [1, 5])
def test_what_cracks_took_is_known_where_nothing_could_break_when_it_was_resumed(tmp_path, first):
    """A strip follows an animation, of which nothing breaks, until frame 10."""
    graph = strip(fracture_energy=100)
    graph["nodes"]["rig"] = {"type": "follow", "body": "@strip.body", "frame": 10}
    graph["nodes"]["sim"]["bodies"] = ["@rig.body"]
    for folder, ends in (("whole", [24]), ("parts", [7, 8, 24])):
        for end in ends:
            package.bake(package.Graph.from_dict(graph), tmp_path / folder, frames=(first, end), resume=True)
    whole, parts = (package.report(tmp_path / folder) for folder in ("whole", "parts"))
    assert whole["cracks"][0]["energy"] > 0 and whole["cracks"][0]["since"] == (None if first == 1 else first)
    assert parts == whole and contents(tmp_path / "parts") == contents(tmp_path / "whole")


def test_a_log_from_before_seams_counted_is_read_and_gone_on_with(sunder, tmp_path):
    graph, bake = strip(fracture_energy=100), tmp_path / "parts"
    full = baked(graph, tmp_path / "whole")["cracks"][0]
    package.bake(package.Graph.from_dict(graph), bake, frames=(1, 22))
    before = package.report(bake)
    assert before["broken"] and before["cracks"][0]["ratio"]  # else there is nothing that could be lost
    file = logs(bake)[1]
    for wrong in (None, "1"):
        stamped(bake, file, changed((bake / file).read_text(), lambda content: content["cracks"].update(broken_work=wrong)))
        with pytest.raises(package.Error, match="is not a whole log of loads"):
            package.report(bake)
    stamped(bake, file, changed((bake / file).read_text(), lambda content: content["cracks"].pop("broken_work")))
    note = "what seams left of the fracture energy of cracks of 'sim' is not known: an earlier Sunder baked them"
    told = package.report(bake)
    assert told["cracks"] == [{**before["cracks"][0], "ratio": None}] and told["note"] == note
    package.bake(package.Graph.from_dict(graph), bake, resume=True)
    told = package.report(bake)
    assert told["cracks"] == [{**full, "ratio": None, "surface_work": pytest.approx(full["surface_work"], rel=1e-9)}]
    out = sunder("report", bake).out
    assert told["note"] == note and note in out and "times their fracture energy" not in out


@pytest.mark.parametrize("states", [True, False])
def test_resumed_or_killed_it_tells_the_same(scene, sunder, tmp_path, states):
    graph = block_scene((1, 60)) if states else without_states(block_scene((1, 60)))
    scene(graph)
    assert sunder("bake", "scene.json", "-o", "whole").status == 0
    for frames in ("1:2", "1:5", "1:60"):
        assert sunder("bake", "scene.json", "-o", "parts", "--frames", frames, "--resume").status == 0
    for end in (signal.SIGKILL, signal.SIGINT):
        folder = f"ended_{end}"
        process = subprocess.Popen([PROGRAM, "bake", "scene.json", "-o", folder], cwd=tmp_path, stdout=subprocess.PIPE)
        for _ in range(3):
            process.stdout.readline()
        process.send_signal(end)
        process.communicate()
        early = package.report(tmp_path / folder)
        assert not early["complete"] and early["frames"][1] >= 3
        assert sunder("bake", "scene.json", "-o", folder, "--resume").status == 0
        assert sunder("verify", folder).status == 0
    whole = contents(tmp_path / "whole")
    assert any(name.startswith("breaks/") for name in whole)
    for folder in ("parts", f"ended_{signal.SIGKILL}", f"ended_{signal.SIGINT}"):
        assert contents(tmp_path / folder) == whole


def test_a_changed_log_is_noticed_and_restarting_takes_it_away(hit, scene, sunder, tmp_path):
    folder = Path(shutil.copytree(hit[0], tmp_path / "hit"))
    log = min((folder / "breaks").iterdir())
    log.write_text(log.read_text().replace('"ball"', '"bell"'))
    assert "its contents have changed" in sunder("verify", folder).err
    refused = sunder("report", folder)
    assert refused.status == 3 and "has changed since it was baked" in refused.err
    tough = block_scene()
    tough["nodes"]["clay"]["toughness"] = 9
    scene(tough)
    assert sunder("bake", "scene.json", "-o", "hit", "--restart").status == 0
    assert not any((folder / "breaks").iterdir()) and package.report(folder)["broken"] == 0


def test_bakes_of_before_say_so(scene, sunder, tmp_path):
    refused = sunder("report", OLD / "beam")
    assert refused.status == 3 and "keeps no log of what broke: an earlier Sunder baked it" in refused.err
    scene()
    assert sunder("bake", "scene.json", "-o", "out", "--frames", "1:3").status == 0
    manifest = json.loads((tmp_path / "out/manifest.json").read_text())
    del manifest["log"]
    (tmp_path / "out/manifest.json").write_text(json.dumps(manifest, indent=1))
    assert sunder("bake", "scene.json", "-o", "out", "--resume").status == 0
    told = package.report(tmp_path / "out", fragments="all")
    assert told["note"] == "frames 1 to 3 have no log: an earlier Sunder baked them"
    assert told["frames"] == [4, 10] and all(b["frame"] > 3 for b in told["breaks"])
    assert "note: frames 1 to 3" in sunder("report", "out").out


@pytest.mark.parametrize("words", [["--fragments", "x"], ["--fragments", "4-2"], ["--fragments", "1,"], ["--box", "1", "2"]])
def test_what_is_no_choice_is_refused(hit, sunder, words):
    assert sunder("report", hit[0], *words).status == 2


# What is damaged and yet listed as it is: by whoever writes such files, or a disk that lies.

def stamped(bake, file, data):
    """Writes a file of the log and lists it with the hash of what it holds now."""
    hash_of = ctypes.CDLL("libxxhash.so.0").XXH3_64bits
    hash_of.restype, hash_of.argtypes = ctypes.c_uint64, [ctypes.c_char_p, ctypes.c_size_t]
    (bake / file).write_bytes(data)
    manifest = json.loads((bake / "manifest.json").read_text())
    for entry in manifest["log"]["breaks"] + manifest["log"]["loads"]:
        if entry["path"] == file:
            entry["size"], entry["hash"] = len(data), f"{hash_of(data, len(data)):016x}"
    (bake / "manifest.json").write_text(json.dumps(manifest))


def logs(bake):
    log = json.loads((bake / "manifest.json").read_text())["log"]
    return [log["breaks"][0]["path"], log["loads"][0]["path"]]


def changed(text, change):
    content = json.loads(text)
    change(content)
    return json.dumps(content, separators=(",", ":")).encode()  # as the library writes it: it is known by its first bytes


def test_it_reads_what_is_listed_as_it_was(hit, tmp_path):
    """The hash that the tests below write is that of the library."""
    bake = Path(shutil.copytree(hit[0], tmp_path / "hit"))
    for file in logs(bake):
        stamped(bake, file, (bake / file).read_bytes())
    assert package.report(bake) == hit[1]


WRONG = {
    "empty": lambda text: b"",
    "cut off": lambda text: text[:len(text) // 2],
    "no text": lambda text: b"\xff\xfe\x00" + text,
    "a list": lambda text: b"[]",
    "a later version": lambda text: text.replace(b" 1\"", b" 2\"", 1),
    "no format": lambda text: changed(text, lambda c: c.pop("format")),
    "another kind": lambda text: text.replace(b"sunder breaks", b"sunder loads") if b"breaks 1" in text
    else text.replace(b"sunder loads", b"sunder breaks"),
    "rows that are none": lambda text: changed(text, lambda c: c.update({rows_of(c): 7})),
    "a row too short": lambda text: changed(text, lambda c: c[rows_of(c)][0].pop()),
    "a row too long": lambda text: changed(text, lambda c: c[rows_of(c)][0].append(0)),
    "a row of texts": lambda text: changed(text, lambda c: c[rows_of(c)].__setitem__(0, ["x"] * len(c[rows_of(c)][0]))),
    "a body that is none": lambda text: changed(text, lambda c: c[rows_of(c)][0].__setitem__(1 if rows_of(c) == "edges" else 0, 99)),
    "a frame that is none": lambda text: changed(text, lambda c: c.update(frame=1e40)),
    "deep": lambda text: b"[" * 100_000,
}


def rows_of(content):
    return "edges" if "edges" in content else "fragments"


@pytest.mark.parametrize("which", [0, 1], ids=["breaks", "loads"])
@pytest.mark.parametrize("wrong", WRONG)
def test_a_log_that_means_nothing_is_refused_by_its_name(hit, sunder, tmp_path, wrong, which):
    bake = Path(shutil.copytree(hit[0], tmp_path / "hit"))
    file = logs(bake)[which]
    stamped(bake, file, WRONG[wrong]((bake / file).read_bytes()))
    with pytest.raises(package.Error) as caught:
        package.report(bake, fragments="all")
    assert caught.value.code == "bad_input" and Path(file).name in str(caught.value), caught.value
    told = sunder("report", bake, "--json")
    assert told.status == 3 and len(told.errors) == 1 and not told.out


def test_no_change_of_a_byte_upsets_it(hit, tmp_path):
    bake = Path(shutil.copytree(hit[0], tmp_path / "hit"))
    random, told = np.random.default_rng(5), 0
    for file in logs(bake):
        whole = (bake / file).read_bytes()
        for _ in range(60):
            data = bytearray(whole)
            for at in random.integers(0, len(data), random.integers(1, 4)):
                data[at] = random.choice([*b'0-9.e,:[]{}"n', random.integers(0, 256)])
            stamped(bake, file, bytes(data))
            try:
                report = package.report(bake, fragments="all")
                assert report["broken"] == len(report["breaks"])
                told += 1
            except package.Error as error:
                assert error.code == "bad_input" and error.what, error
        stamped(bake, file, whole)
    assert 0 < told < 120  # a digit of a number is another number, a bracket is none
