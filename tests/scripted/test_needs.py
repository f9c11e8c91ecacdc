"""What descriptions say of parameters without effect is so: while its needs are not met, a parameter changes no result.

For each parameter with needs, the parameters that these name take their values in turn. Where the needs are not met, another value
of the parameter gives the same arrays to the bit; and somewhere they are met, or the scene would prove nothing, another value
gives others.
"""
import hashlib
import itertools
import json

import numpy as np
import pytest

import sunder
from conftest import obj_text

MOST_ROWS = 8  # of a node that are seen at once
MOST_CASES = 8  # of each kind that are tried, of parameters with more: evenly spread over all


def described(node_type):
    return {p["name"]: p for p in sunder.node_types()[node_type]["parameters"]}


def needed(parameter):
    return [condition for alternative in parameter.get("needs", ()) for condition in alternative]


ALL = [(t, name) for t in sunder.node_types() for name, p in described(t).items() if "needs" in p]


def values_of(p, conditions):
    """What a parameter that is needed takes in turn: all choices, or values for and against its conditions."""
    if "choices" in p:
        return p["choices"]
    values = []
    for c in conditions:
        given = [v for v in c.get("values", []) if v is not None]
        values += given + [v + 1 for v in given] + ([c["above"], c["above"] + 1] if "above" in c else [])
        if "not_null" in c or None in c.get("values", []):
            values += [None, IF_GIVEN[p["name"]]]
    largest = p.get("max", 1e9)
    other = [p["default"]] if p["default"] is not None else []
    return list(dict.fromkeys(min(v, largest) if isinstance(v, (int, float)) else v for v in values + other))


@pytest.mark.parametrize("node_type,name", ALL)
def test_needs_name_parameters_and_values_that_are_there(node_type, name):
    parameters = described(node_type)
    assert parameters[name]["needs_text"] and all(parameters[name]["needs"])
    for c in needed(parameters[name]):
        other = parameters[c["parameter"]]
        assert other["name"] != name and len({"values", "above", "not_null"} & set(c)) == 1
        for value in c.get("values", ()):
            assert value in other["choices"] if "choices" in other else value is not None or other["nullable"]
        assert "above" not in c or other.get("max", 1e9) > c["above"] >= other.get("min", other.get("above"))
        assert "not_null" not in c or other["nullable"]


@pytest.mark.parametrize("node_type", sunder.node_types())
def test_few_rows_are_seen_at_once(node_type):
    parameters = described(node_type)
    main = [p for p in parameters.values() if p["group"] == "" and p["type"] != "vertex_groups"]
    names = sorted({c["parameter"] for p in main for c in needed(p) if parameters[c["parameter"]]["type"] == "choice"})
    graph = sunder.Graph()
    node = graph.add(node_type, "node")
    for values in itertools.product(*(parameters[n]["choices"] for n in names)):
        node.set(**dict(zip(names, values)))
        assert sum(node.has_effect(p["name"]) for p in main) <= MOST_ROWS, dict(zip(names, values))


def test_groups_come_after_what_is_seen_at_once():
    text = {t: [p["group"] for p in d["parameters"]] for t, d in sunder.node_types().items()}
    assert text["prefracture"][0] == "" and {"Repair", "Break Surfaces", "Strength"} <= set(text["prefracture"])
    assert all("" in groups for groups in text.values())


def test_effects_are_told_of_a_node_and_of_its_keys():
    graph = sunder.Graph()
    force, body = graph.add("force", "air"), graph.add("body", "clay")
    assert not force.has_effect("wind") and not body.has_effect("hardening") and body.has_effect("density")
    force["drag"], body["yield"] = {"keys": [[1, 0], [9, 2]]}, 0.1
    assert force.has_effect("wind") and body.has_effect("hardening") and body.has_effect("fragments")
    with pytest.raises(sunder.Error, match="hardness"):
        body.has_effect("hardness")


# Scenes: small, and such that each parameter would show.

CUBE = [(x - 0.5, y - 0.5, z - 0.5) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
QUADS = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
AS_READ = [CUBE[i] for i in dict.fromkeys(i - 1 for quad in QUADS for i in quad)]  # a file's vertices, by their first use
LID = [(x, y, z + 0.001) for x, y, z in CUBE[4:]]  # a little above the cube: a seam, found and welded unless that is forbidden
MESHES = {
    "cube": obj_text(CUBE, QUADS),
    "plate": obj_text([(x, y, 0.04 * z) for x, y, z in CUBE], QUADS),
    "seam": obj_text(CUBE + LID, [QUADS[0], *QUADS[2:], (9, 10, 12, 11)]),
    "sheet": obj_text([(x, y, 0) for y in range(3) for x in range(3)], [(1, 2, 5, 4), (2, 3, 6, 5), (4, 5, 8, 7), (5, 6, 9, 8)]),
    "rod": obj_text([(0.1 * x, 0.1 * y, z) for x, y, z in CUBE], QUADS),
}


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    for name, text in MESHES.items():
        (folder / f"{name}.obj").write_text(text)
    for name, vector in (("steady", [3, 0, 0]), ("swirl", [0, 3, 1])):
        (folder / f"{name}.json").write_text(json.dumps({"values": [vector] * 8}))
    for name, stretch in (("still", 0.05), ("motion", 0.15)):
        np.save(folder / f"{name}.npy", [np.array(AS_READ) * [1, 1, 1 + stretch * frame] + [0, 0, 2] for frame in range(3)])
    for name, rise in (("stands", 0), ("rises", 0.05)):
        np.save(folder / f"{name}.npy", [np.array(AS_READ) + [0.03, 0.02, rise * frame - 0.5] for frame in range(4)])
    return folder


def block(**body):
    return {"block": {"type": "lattice", "size": [0.3, 0.3, 0.3], "cells": [3, 3, 3], "center": [0, 0, 0.16]},
            "body": {"type": "body", "fragments": "@block.fragments", "youngs_modulus": 1e5, "yield": 0.01, "flow_rate": 20,
                     "hardening": 0.5, "toughness": 0.06, "velocity": [0, 0, -4], **body}}


def scene(folder, node_type, mesh="cube", **given):
    """(Nodes of a graph of which one of the type has what is given, outputs that show it, frame)."""
    floor = {"type": "collider", "shape": "plane"}
    solver = {"type": "solver", "bodies": ["@body.body"], "colliders": ["@floor.collider"], "preset": "preview"}
    it = {"type": node_type, **given}
    file = {"type": "mesh_file", "path": str(folder / f"{mesh}.obj"), "groups": {"Some": [0, 1], "Others": [5, 6, 7]}}
    if node_type == "prefracture":
        body = {"type": "body", "fragments": "@it.fragments"}
        skin = {"type": "deformer", "body": "@body.body", "state": "@solver.state"}
        nodes = {"file": file, "it": {"pieces": 6, "cells_per_piece": 4, **it, "mesh": "@file.mesh"}, "body": body,
                 "solver": {"type": "solver", "bodies": ["@body.body"]}, "skin": skin}
        return nodes, ["it.fragments", "skin.mesh"], 1
    if node_type == "fragment_region":
        cut = {"type": "prefracture", "mesh": "@file.mesh", "pieces": 12, "clusters": 3}
        return {"file": file, "cut": cut, "it": {**it, "toughness": 2, "fragments": "@cut.fragments"}}, ["it.fragments"], 1
    if node_type == "body":
        cut = {"type": "prefracture", "mesh": "@file.mesh", "pieces": 8}
        fragments = "@block.fragments" if mesh == "cube" else "@cut.fragments"
        nodes = {**block(), "file": file, "cut": cut, "floor": floor, "solver": solver}
        place = {"position": [0, 0, 0.5], "rotation": [0, 40, 0]} if mesh != "cube" else {}
        nodes["body"] |= {**place, **it, "fragments": fragments}
        return nodes, ["solver.state"], 4
    nodes = {**block(), "floor": floor, "solver": solver}
    if node_type in ("activate", "seam", "body_region"):
        cut = {"type": "prefracture", "mesh": "@file.mesh", "pieces": 12, "clusters": 3}
        ram = {"type": "collider", "shape": "box", "size": [0.4, 2, 2], "position": {"keys": [[1, [-0.9, 0, 0.5]], [4, [-0.5, 0, 0.5]]]}}
        ball = {"type": "rigid_body", "radius": 0.2, "position": [0, 0, 1.25], "velocity": [0, 0, -9]}
        nodes |= {"file": file, "block": cut, "ram": ram, "ball": ball, "it": {**it, "body": "@body.body"}}
        nodes["body"] |= {"position": [0, 0, 0.51], "velocity": [0, 0, -0.5]}
        if node_type == "activate":
            nodes["it"]["object"] = "@ram.collider"
        solver["bodies"], solver["rigid_bodies"] = ["@it.body"], ["@ball.rigid_body"]
        return nodes, ["solver.state"], 4
    if node_type == "follow":
        cut = {"type": "prefracture", "mesh": "@file.mesh", "pieces": 8}
        nodes |= {"file": file, "block": cut, "it": {**it, "body": "@body.body", "mesh": "@file.mesh"}}
        solver["bodies"] = ["@it.body"]
        return nodes, ["solver.state"], 4
    if node_type == "solver":
        nodes["solver"] |= it
    elif node_type == "rigid_body":
        nodes["it"] = {"mass": 20, "position": [0.03, 0.02, 0.6], "velocity": [0, 0, -6], **it}
        solver["rigid_bodies"] = ["@it.rigid_body"]
    elif node_type == "collider":
        nodes["it"] = {"position": [0.03, 0.02, -0.5], **it}
        solver["colliders"] = ["@it.collider"]
    elif node_type == "pin":
        cut = {"type": "prefracture", "mesh": "@file.mesh", "pieces": 12}
        nodes |= {"file": file, "block": cut, "it": {"position": {"keys": [[1, [0, 0, 0]], [3, [0, 0, 0.2]]]}, **it, "body": "@body.body",
                                                    "mesh": "@file.mesh"}}
        solver["pins"] = ["@it.pin"]
    elif "force" in (s["name"] for s in sunder.node_types()[node_type]["outputs"]):
        nodes["it"], solver["forces"] = it, ["@it.force"]
        if node_type == "guide":
            nodes["other"] = {"type": "solver", "bodies": ["@body.body"], "gravity": [1, 0, 0], "preset": "preview"}
            it.update(body="@body.body", state="@other.state", strength=it.get("strength", 20))
    return nodes, ["solver.state"], 4


FADING = ("edge_damage",)  # there where a body has a fracture energy, whether it can tear or not


def result(folder, node_type, **given):
    """A hash of what the node leads to, or the error."""
    nodes, outputs, frame = scene(folder, node_type, **given)
    graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 9], "nodes": nodes})
    graph.set_threads(1)
    digest = hashlib.sha256()
    try:
        for output in outputs:
            value = graph.evaluate(output, frame)
            for name in sorted(set(value._arrays) - set(FADING)):
                digest.update(name.encode() + getattr(value, name).tobytes())
    except sunder.Error as error:
        return str(error)
    return digest.hexdigest()


def graph_of(folder, node_type, given):
    graph = sunder.Graph()
    return graph.add(node_type, "it", **{k: v for k, v in given.items() if k != "mesh"})


IF_GIVEN = {"yield": 0.01, "toughness": 0.05, "compressive_toughness": 0.2, "substeps": 3, "iterations": 2, "hit_substeps": 2,
            "voxel_size": 0.1, "release_frame": 2, "reach": 0.2, "angle": 30, "frame": 2}
# Another value of the parameter than in the scene, where the default will not do; and what else the scene has that it be seen.
OTHER = {
    ("prefracture", "sites"): "uniform", ("prefracture", "points"): [[0.1, 0.2, 0.3], [-0.2, 0.1, 0]], ("prefracture", "pieces"): 9,
    ("prefracture", "impact_shape"): "curve", ("prefracture", "impact_radius"): 0.4, ("prefracture", "grid_jitter"): 0.9,
    ("prefracture", "density_group"): "Others", ("prefracture", "density_factor"): 900, ("prefracture", "roughness"): 3,
    ("prefracture", "least_piece"): 1.0, ("prefracture", "source"): "voronoi", ("prefracture", "cells_per_piece"): 12,
    ("prefracture", "sharp_angle"): 170, ("prefracture", "sheets"): "off", ("prefracture", "thickness"): 0.05,
    ("prefracture", "weld_distance"): 0, ("prefracture", "wrap_detail"): 0.1, ("prefracture", "noise_scale"): 1.5,
    ("prefracture", "cluster_toughness"): 9, ("solver", "preset"): "final",
    ("collider", "path"): "rod.obj", ("collider", "resolution"): 30, ("collider", "voxel_size"): 0.2,
    ("collider", "thickness"): 0.3, ("collider", "scale"): 0.9, ("pin", "group"): "Others", ("fragment_region", "group"): "Others",
    ("collider", "position"): [0.03, 0.02, -0.45], ("collider", "rotation"): [0, 20, 0], ("collider", "motion"): "vertices",
    ("pin", "pivot"): [0.3, 0, 0], ("pin", "position"): [0, 0, 0.1], ("pin", "rotation"): [0, 30, 0],
    **{(node_type, name): value for node_type in ("collider", "pin") for name, value in (
        ("motion_source", "values"), ("motion_path", "rises.npy"), ("first_frame", 2),
        ("positions", [[x, y, z + 0.1 * frame - 0.45] for frame in range(3) for x, y, z in AS_READ]))},
    ("pin", "release_frames"): 3,
    ("pin", "center"): [0.4, 0.4, 0.4], ("pin", "box_max"): [0.2, 0.2, 0.2], ("pin", "box_min"): [0, 0, 0],
    ("fragment_region", "center"): [0.4, 0.4, 0.4], ("fragment_region", "box_max"): [0.2, 0.2, 0.2],
    ("fragment_region", "box_min"): [0, 0, 0], ("fragment_region", "cluster"): 1, ("force", "wind"): [30, 0, 0],
    ("blast", "direction"): [1, 0, 0], ("turbulence", "position"): [0.2, 0.1, 0], ("guide", "target_frame"): 6,
    ("grid_force", "values"): [[0, 9, 0]] * 8, ("grid_force", "nodes"): [2, 2, 4], ("grid_force", "first_frame"): 3,
    ("grid_force", "path"): "swirl.json", ("force", "gusts"): 0.5, ("force", "gust_seed"): 3,
    ("activate", "center"): [0.4, 0.4, 0.4], ("activate", "box_max"): [0.2, 0.2, 0.2], ("activate", "box_min"): [0, 0, 0],
    ("activate", "cluster"): 1, ("activate", "group"): "Others", ("activate", "frame"): 4, ("activate", "impulse"): 1e6,
    ("activate", "delay"): 2, ("activate", "growth"): 30, ("activate", "falloff"): 0.8, ("seam", "group"): "Others",
    ("seam", "other_group"): "Others",
    ("body_region", "center"): [0.4, 0.4, 0.4], ("body_region", "box_max"): [0.2, 0.2, 0.2], ("body_region", "box_min"): [0, 0, 0],
    ("body_region", "fracture_energy"): 0.01, ("body_region", "cluster"): 1, ("body_region", "group"): "Others",
    ("seam", "points"): [[0, 0, 0], [0, 0, 1]], ("seam", "distance"): 0.6, ("seam", "frames"): 90,
    ("seam", "center"): [0.4, 0.4, 0.4], ("seam", "box_max"): [0.2, 0.2, 0.2], ("seam", "box_min"): [0, 0, 0],
    ("seam", "spared"): [[-0.4, -0.5, 0.5]], ("seam", "direction"): [1, 0, 0], ("seam", "toughness"): 0.01, ("seam", "frame"): 3,
    ("follow", "position"): [0, 0, 3], ("follow", "rotation"): [0, 30, 0], ("follow", "path"): "motion.npy", ("follow", "first_frame"): 2,
    ("follow", "positions"): [[x, y, z + 2] for x, y, z in AS_READ], ("follow", "source"): "values", ("follow", "source_strain"): "elastic",
    ("solver", "substeps"): 3, ("solver", "iterations"): 5, ("solver", "hit_substeps"): 1, ("body", "fracture_energy"): 20.0,
}
RISING = [[x, y, z + 0.05 * frame - 0.5] for frame in range(3) for x, y, z in AS_READ]
POINTS = [[0.5, 0.1, 0.2], [0.4, -0.3, 0.2], [-0.3, 0.2, 0.4]]
ALSO = {
    "prefracture": {"points": POINTS, "density_group": "Some"},
    "collider": {"resolution": 20, "positions": RISING},
    "pin": {"group": "Some", "rotation": [0, 20, 0], "positions": RISING},
    "fragment_region": {"group": "Some"},
    "grid_force": {"values": [[5, 0, 0]] * 8 + [[0, 5, 0]] * 8},  # two frames of 2 x 2 x 2, or one of 2 x 2 x 4
    "activate": {"group": "Some"},
    "follow": {"frame": 4, "positions": [[x, y, (1 + 0.1 * frame) * z + 2] for frame in range(3) for x, y, z in AS_READ]},
    "body_region": {"group": "Some", "stiffness": 0.5},
    "seam": {"group": "Some", "points": [[-0.5, -0.5, 0.5], [-0.5, 0.5, 0.5]], "frame": 2},
}
ALSO_OF = {
    ("prefracture", "points"): {}, ("prefracture", "sheets"): {"mesh": "plate"}, ("prefracture", "least_piece"): {"sites": "uniform"},
    ("prefracture", "cluster_toughness"): {"pieces": 9}, ("solver", "preset"): {"substeps": 2},
    ("solver", "over_relaxation"): {"iterations": 2}, ("force", "gusts"): {"wind": [30, 0, 0]}, ("seam", "spared"): {"distance": 0.6},
    ("seam", "toughness"): {"between": "all"}, ("seam", "direction"): {"between": "all"},
    ("force", "gust_time"): {"wind": [30, 0, 0]}, ("force", "gust_seed"): {"wind": [30, 0, 0]},
}
MESHES_OF = {
    ("prefracture", "thickness"): ("cube", "sheet"), ("prefracture", "weld_distance"): ("cube", "seam"),
    ("prefracture", "wrap_detail"): ("cube", "seam"), ("body", "flow_rate"): ("cube", "plate"),
    ("body", "hardening"): ("cube", "plate"), ("body", "fracture_energy"): ("cube", "plate"),
}


def other_value(node_type, p):
    if (node_type, p["name"]) in OTHER:
        return OTHER[node_type, p["name"]]
    default = p["default"]
    return [0.7 * v for v in default] if isinstance(default, list) else 0.7 * default


def spread(cases):
    step = -(-len(cases) // MOST_CASES)
    return cases[::step or 1]


def cases_of(folder, node_type, name):
    """([what is given where the needs are not met], [where they are])"""
    parameters = described(node_type)
    p = parameters[name]
    names = list(dict.fromkeys(c["parameter"] for c in needed(p)))
    values = [values_of(parameters[n], [c for c in needed(p) if c["parameter"] == n]) for n in names]
    idle, counting = [], []
    for mesh in MESHES_OF.get((node_type, name), (None,)):
        for chosen in itertools.product(*values):
            given = {**ALSO.get(node_type, {}), **ALSO_OF.get((node_type, name), {}), **dict(zip(names, chosen))}
            given.pop(name, None)
            if mesh:
                given["mesh"] = mesh
            has_effect = graph_of(folder, node_type, given).has_effect(name)
            (counting if has_effect else idle).append(given)
    return idle, counting


@pytest.mark.parametrize("node_type,name", ALL)
def test_without_its_needs_a_parameter_changes_nothing(meshes, node_type, name):
    p = described(node_type)[name]
    idle, counting = cases_of(meshes, node_type, name)
    assert idle and counting
    kept = {name: ALSO.get(node_type, {})[name]} if name in ALSO.get(node_type, {}) else {}
    if (node_type, name) == ("grid_force", "path"):
        kept = {"path": str(meshes / "steady.json")}
        counting = [{**g, "source": "file"} for g in counting]
    elif (node_type, name) == ("follow", "path"):
        kept = {"path": str(meshes / "still.npy")}
    elif node_type == "follow":
        idle, counting = ([{**g, "path": str(meshes / "still.npy")} for g in some] for some in (idle, counting))
    elif node_type == "grid_force":
        idle = [{**g, "path": str(meshes / "steady.json")} for g in idle]
    if name == "motion_path":
        kept = {"motion_path": str(meshes / "stands.npy")}
    elif node_type in ("collider", "pin"):
        idle, counting = ([{**g, "motion_path": str(meshes / "rises.npy")} for g in some] for some in (idle, counting))
    if (node_type, name) == ("collider", "path"):
        kept = {"path": str(meshes / "cube.obj")}
    elif node_type == "collider":
        idle, counting = ([{**g, **({"path": str(meshes / "cube.obj")} if g["shape"] == "mesh" else {})} for g in some]
                          for some in (idle, counting))
    other = {name: str(meshes / OTHER[node_type, name]) if p["type"] == "path" else other_value(node_type, p)}
    for given in spread(idle):
        given = {k: v for k, v in given.items() if k != name}
        assert result(meshes, node_type, **given, **kept) == result(meshes, node_type, **given, **other), given
    assert any(result(meshes, node_type, **given, **kept) != result(meshes, node_type, **given, **other)
               for given in spread(counting)), "nothing shows it"


def test_an_error_budget_leaves_no_effect_to_substeps_when_all_sleeps_and_wakes():
    """Then frames are stepped as `substeps` says, and nothing happens in them: what a ram will meet wakes before the frame."""

    def positions(**given):
        graph = sunder.Graph.from_dict({"sunder": 2, "frame_rate": 24, "frame_range": [1, 60], "nodes": {
            "block": {"type": "lattice", "size": [0.3, 0.3, 0.3], "cells": [2, 2, 2], "center": [0, 0, 0.151]},
            "body": {"type": "body", "fragments": "@block.fragments", "youngs_modulus": 1e5, "yield": 0.01, "toughness": 0.06},
            "floor": {"type": "collider", "shape": "plane"},
            "ram": {"type": "collider", "shape": "box", "size": [0.2, 0.2, 0.2],
                    "position": {"keys": [[1, [-1, 0, 0.15]], [40, [-1, 0, 0.15]], [44, [0.2, 0, 0.15]]]}},
            "solver": {"type": "solver", "bodies": ["@body.body"], "colliders": ["@floor.collider", "@ram.collider"],
                       "error_budget": 0.05, **given}}})
        asleep, hit = (graph.evaluate("solver.state", frame) for frame in (40, 44))
        assert asleep.asleep.all() and not hit.asleep.any()
        return hit.position.tobytes()

    assert positions(substeps=3, iterations=1) == positions(substeps=30, iterations=4)
