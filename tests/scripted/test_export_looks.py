"""Materials and colours in exports: as the artist or looks.json gives them, told apart and shown."""
import json

import numpy as np
import pytest

import usda_reader
from test_export import Glb, baked, export, readings  # noqa: F401 (a fixture)
from test_export_solids import crowded_scene

from bake_reader import read_mesh_frame


def bake_coloured_box(sunder, scene, tmp_path, color, kind, looks=None):
    """Bakes a cut box whose corner (x, y, z) has color(x, y, z), four numbers of that kind."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]
    lines = ["ply", "format ascii 1.0", "element vertex 8", *(f"property float {n}" for n in "xyz"),
             *(f"property {kind} {n}" for n in ("red", "green", "blue", "alpha")), "element face 12",
             "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(str, c + tuple(color(*c)))) for c in corners] + [f"3 {a} {b} {c}" for a, b, c in faces]
    (tmp_path / "box.ply").write_text("\n".join(lines) + "\n")
    scene({"sunder": 1, "frame_range": [1, 1], "nodes": {
        "file": {"type": "mesh_file", "path": "box.ply"},
        "cut": {"type": "prefracture", "mesh": "@file.mesh", "pieces": 4},
        "clay": {"type": "body", "fragments": "@cut.fragments"},
        "sim": {"type": "solver", "bodies": ["@clay.body"]},
        "skin": {"type": "deformer", "body": "@clay.body", "state": "@sim.state", "topology": "constant"},
        "out": {"type": "bake_mesh", "mesh": "@skin.mesh"}}})
    assert sunder("bake", "scene.json", "-o", "bake").status == 0
    if looks is not None:
        (tmp_path / "bake/looks.json").write_text(json.dumps({"sunder_looks": 1, "nodes": {"clay": looks}}))
    return read_mesh_frame(tmp_path / "bake/mesh/mesh.0001.ply")


def colours_of_glb(glb):
    """{(fragment, material): colours of its corners, or None}."""
    found = {}
    for node in (n for n in glb.json["nodes"] if "mesh" in n):
        for p in glb.json["meshes"][node["mesh"]]["primitives"]:
            at = p["attributes"].get("COLOR_0")
            colors = None if at is None else glb.array(at)[glb.array(p["indices"])]
            found[int(node["name"].rsplit(".", 1)[1]), p["material"]] = colors
    return found


def test_glb_carries_colours_of_vertices(sunder, scene, tmp_path):
    frame = bake_coloured_box(sunder, scene, tmp_path, lambda x, y, z: (255 * x, 255 * y, 51 * z, 255), "uchar")
    export(sunder, "-o", "shot.glb")
    glb = Glb(tmp_path / "shot.glb")
    assert [m["pbrMetallicRoughness"]["baseColorFactor"][0] for m in glb.json["materials"]] == [1, 0.5]
    assert all("alphaMode" not in m for m in glb.json["materials"])
    for (fragment, material), colors in colours_of_glb(glb).items():
        wanted = frame.colors.reshape(-1, 3, 4)[(frame.fragment == fragment) & (frame.material == material)]
        if material == 0:
            np.testing.assert_array_equal(colors, wanted.reshape(-1, 4))
        else:
            assert colors is None and np.all(wanted == 1)  # break surfaces
    assert len(np.unique(frame.colors, axis=0)) > 8


def test_colours_in_glb_are_from_0_to_1(sunder, scene, tmp_path):
    frame = bake_coloured_box(sunder, scene, tmp_path, lambda x, y, z: (2 * x, -y, z, 1 - z / 2), "float")
    assert frame.colors.max() == 2 and frame.colors.min() == -1
    export(sunder, "-o", "shot.glb")
    glb = Glb(tmp_path / "shot.glb")
    assert [m.get("alphaMode") for m in glb.json["materials"]] == ["BLEND", None]
    for (fragment, material), colors in colours_of_glb(glb).items():
        if material == 0:
            wanted = frame.colors.reshape(-1, 3, 4)[(frame.fragment == fragment) & (frame.material == 0)]
            np.testing.assert_array_equal(colors, wanted.reshape(-1, 4).clip(0, 1))


def test_usd_shows_colours_of_vertices(sunder, scene, tmp_path):
    frame = bake_coloured_box(sunder, scene, tmp_path, lambda x, y, z: (x, y, 0.5 * z, 1), "float")
    export(sunder, "-o", "shot.usda")
    for root, rtol in readings(tmp_path / "shot.usda", False)[0]:
        mesh = root["shot/clay"]
        colors = mesh.attributes["primvars:displayColor"]
        np.testing.assert_allclose(colors.value.astype(np.float32), frame.colors[:, :3], rtol=rtol, atol=1e-7)
        assert colors.metadata["interpolation"] == "faceVarying" and "primvars:displayOpacity" not in mesh.attributes
        material = root["shot/Looks/material_0"]
        assert material["surface"].relations["inputs:diffuseColor"] == "</shot/Looks/material_0/displayColor.outputs:result>"
        reader = material["displayColor"].attributes
        assert reader["info:id"].value == "UsdPrimvarReader_float3" and reader["inputs:varname"].value == "displayColor"
        np.testing.assert_allclose(reader["inputs:fallback"].value, [0.7] * 3)
        assert list(root["shot/Looks/interior"].children) == ["surface"]


def test_usd_shows_where_vertices_are_seen_through(sunder, scene, tmp_path):
    frame = bake_coloured_box(sunder, scene, tmp_path, lambda x, y, z: (x, y, z, 1 - 0.5 * z), "float")
    export(sunder, "-o", "shot.usda")
    root = usda_reader.read(tmp_path / "shot.usda")
    opacity = root["shot/clay"].attributes["primvars:displayOpacity"]
    np.testing.assert_array_equal(opacity.value.astype(np.float32), frame.colors[:, 3])
    assert opacity.metadata["interpolation"] == "faceVarying"
    material = root["shot/Looks/material_0"]
    assert material["surface"].relations["inputs:opacity"] == "</shot/Looks/material_0/displayOpacity.outputs:result>"
    reader = material["displayOpacity"].attributes
    assert reader["info:id"].value == "UsdPrimvarReader_float" and reader["inputs:fallback"].value == 1


@pytest.mark.parametrize("fields, varies", [({}, False), ({"color_varies": False}, False), ({"color_varies": True}, True)])
def test_a_colour_that_is_given_hides_colours_of_vertices_unless_it_varies(sunder, scene, tmp_path, fields, varies):
    looks = {"materials": [{"name": "Glaze", "color": [0.1, 0.2, 0.3, 1], **fields}]}
    bake_coloured_box(sunder, scene, tmp_path, lambda x, y, z: (255 * x, 255 * y, 51 * z, 255), "uchar", looks)
    export(sunder, "-o", "shot.glb")
    glb = Glb(tmp_path / "shot.glb")
    factors = [m["pbrMetallicRoughness"]["baseColorFactor"] for m in glb.json["materials"]]
    assert factors[0] == ([1, 1, 1, 1] if varies else [0.1, 0.2, 0.3, 1])
    assert {m for (_, m), colors in colours_of_glb(glb).items() if colors is not None} == ({0} if varies else set())
    export(sunder, "-o", "shot.usda")
    for root, _ in readings(tmp_path / "shot.usda", False)[0]:
        glaze = root["shot/Looks/Glaze"]
        assert set(glaze.children) == ({"surface", "displayColor"} if varies else {"surface"})
        shown = glaze["displayColor"].attributes["inputs:fallback"] if varies else glaze["surface"].attributes["inputs:diffuseColor"]
        np.testing.assert_allclose(shown.value, [0.1, 0.2, 0.3], rtol=1e-6)


def test_materials_are_told_apart_by_all_that_they_are(sunder, baked, tmp_path):  # noqa: F811
    graph = crowded_scene(tmp_path)
    baked(graph)
    glaze = {"name": "Glaze", "color": [0.1, 0.2, 0.3, 1]}
    looks = {"clay": {"name": "Gro\u00dfe Vase", "materials": [{"name": "interior", "color": [1, 0, 0, 1]}],
                      "interior": {"name": "interior", "color": [0, 1, 0, 1]}},
             "ball": {"materials": [glaze]}, "crate": {"materials": [glaze]}, "wall": {"materials": [{**glaze, "roughness": 0.1}]}}
    (tmp_path / "bake/looks.json").write_text(json.dumps({"sunder_looks": 1, "nodes": looks}))
    export(sunder, "-o", "shot.usda")
    for root, _ in readings(tmp_path / "shot.usda")[0]:
        shot = root["shot"]
        colors = {name: m["surface"].attributes["inputs:diffuseColor"].value for name, m in shot["Looks"].children.items()}
        assert {n: tuple(np.round(c, 6)) for n, c in colors.items()} == {
            "interior": (1, 0, 0), "interior_2": (0, 1, 0), "Glaze": (0.1, 0.2, 0.3), "Glaze_2": (0.1, 0.2, 0.3),
            "Collider": (0.7, 0.7, 0.7)}
        bound = {name: [s.relations["material:binding"].strip("</>").rsplit("/", 1)[1] for s in mesh.children.values()]
                 for name, mesh in shot.children.items() if name != "Looks"}
        assert bound == {"Gro__e_Vase": ["interior", "interior_2"], "ball": ["Glaze"], "crate": ["Glaze"], "wall": ["Glaze_2"],
                         "floor": ["Collider"], "post": ["Collider"]}
    told = usda_reader.read(tmp_path / "shot.usda")["shot"]  # names that prims cannot have
    assert told["Gro__e_Vase"].metadata["displayName"] == "Gro\u00dfe Vase"
    assert told["Gro__e_Vase/interior_2"].metadata["displayName"] == "interior"
    assert told["Looks/Glaze_2"].metadata["displayName"] == "Glaze" and "displayName" not in told["ball"].metadata
    looks["clay"]["name"] = 'The "vase" \\ 1\n'
    (tmp_path / "bake/looks.json").write_text(json.dumps({"sunder_looks": 1, "nodes": looks}))
    export(sunder, "-o", "quoted.usda")
    assert usda_reader.read(tmp_path / "quoted.usda")["shot/The__vase____1_"].metadata["displayName"] == 'The "vase" \\ 1 '
    export(sunder, "-o", "shot.glb", "--tolerance", "0.5")
    glb = Glb(tmp_path / "shot.glb")
    assert [m["name"] for m in glb.json["materials"]] == ["interior", "interior", "Glaze", "Collider", "Glaze"]
    used = {glb.json["nodes"][n]["name"]: {p["material"] for p in glb.json["meshes"][glb.json["nodes"][n]["mesh"]]["primitives"]}
            for n in glb.json["scenes"][0]["nodes"] if "mesh" in glb.json["nodes"][n]}
    assert used == {"ball": {2}, "crate": {2}, "floor": {3}, "post": {3}, "wall": {4}}
