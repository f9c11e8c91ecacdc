"""looks.json beside a bake: what exports show for what was simulated (docs/files.md): artists' names, meshes, materials."""
import json
import os

import bpy
from mathutils import Matrix, Vector

from ..base import blender_versions, core
from ..tree import pickers, trees, wiring
from ..scene import mesh_export, scene_input
from . import cache


# Textures that take Generated coordinates where nothing is plugged in.
BY_GENERATED = {"TEX_BRICK", "TEX_CHECKER", "TEX_GABOR", "TEX_GRADIENT", "TEX_MAGIC", "TEX_MUSGRAVE", "TEX_NOISE", "TEX_VORONOI",
                 "TEX_WAVE"}


def _share(value):
    return scene_input.decimal(min(1.0, max(0.0, float(value))))


def _principled(material):
    """The shader that the material's output shows, if it is a Principled BSDF."""
    if not blender_versions.has_nodes(material):
        return None
    output = material.node_tree.get_output_node("ALL")
    links = output.inputs["Surface"].links if output else ()
    shader = links[0].from_node if links else None
    return shader if shader is not None and shader.type == "BSDF_PRINCIPLED" else None


def surface(material):
    """A material by its name, colour and gloss. Where a texture or another shader gives them, the viewport's count; a colour
    that something gives varies, and gives way to colours of vertices."""
    if material is None:
        return {}
    found = {"name": material.name, "color": [_share(c) for c in material.diffuse_color],
             "metallic": _share(material.metallic), "roughness": _share(material.roughness)}
    shader = _principled(material)
    if shader is None:
        return found
    values = {name: s.default_value for name, s in shader.inputs.items() if not s.is_linked and hasattr(s, "default_value")}
    if "Base Color" in values:
        found["color"] = [_share(c) for c in values["Base Color"][:3]] + [_share(values.get("Alpha", 1.0))]
    else:
        found["color_varies"] = True
    for field, name in (("metallic", "Metallic"), ("roughness", "Roughness")):
        if name in values:
            found[field] = _share(values[name])
    found["transmission"] = _share(next((values[n] for n in blender_versions.TRANSMISSION if n in values), 0.0))
    return found


def _nodes(material):
    """All nodes of a material, those in groups included."""
    pending, seen = [material.node_tree] if blender_versions.has_nodes(material) else [], set()
    while pending:
        tree = pending.pop()
        if tree is None or tree.name_full in seen:
            continue
        seen.add(tree.name_full)
        yield from tree.nodes
        pending += [node.node_tree for node in tree.nodes if node.type == "GROUP"]


def attributes_read(material):
    """Names of the attributes that a material reads of what it is on."""
    names = {node.attribute_name for node in _nodes(material) if node.type == "ATTRIBUTE" and node.attribute_type == "GEOMETRY"}
    return (names | {node.layer_name for node in _nodes(material) if node.type == "VERTEX_COLOR"}) - {""}


def reads_generated(material):
    """Whether a material has a texture by Generated coordinates: by a wire, or where nothing is plugged in."""
    return any(node.outputs["Generated"].is_linked if node.type == "TEX_COORD"
               else node.type in BY_GENERATED and not node.inputs["Vector"].is_linked for node in _nodes(material))


def _of_bodies(tree, looks):
    for thing in trees.result_objects(tree):
        deformer = next((n for n in wiring.needed(tree) if n.graph_name == thing.sunder.node), None)
        if thing.type != "MESH" or deformer is None or deformer.sunder_type != "deformer" or thing.sunder.part == "INSIDE":
            continue
        body = wiring.upstream(deformer, "body")
        materials, interior = list(thing.data.materials), thing.sunder.interior_slot
        look = {"name": thing.name, "materials": [surface(m) for m in materials[:interior]]}
        inner = [o.data.materials[0] for o in trees.insides(thing) if o.data.materials] if thing.sunder.part != "ALL" else []
        inner += materials[interior:]
        if inner:
            look["interior"] = surface(inner[0])
        looks.setdefault(body.graph_name, look)


def _mesh(node, thing, depsgraph):
    """An object's mesh in the frame of its node's shape; None if it has none to show."""
    if thing.type not in pickers.SURFACES or thing.mode == "EDIT":
        return None
    center = Vector() if node.shape == "mesh" else scene_input.shape(node.shape, thing, depsgraph, node)[1]
    own = Matrix.Translation(-center) @ scene_input.placement(thing.matrix_world)[2]
    geometry = mesh_export.geometry(thing, depsgraph, own, True)
    return mesh_export.ply_bytes(geometry) if len(geometry.corners) else None


def _of_solids(tree, looks, files):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for node in wiring.needed(tree):
        if node.sunder_type not in ("rigid_body", "collider"):
            continue
        if node.source == "VALUES":
            looks[node.graph_name] = {"name": node.label or node.name}
            continue
        try:
            for i, thing in enumerate(scene_input.objects_of(node)):
                graph_name = node.graph_name if i == 0 else f"{node.graph_name}:{i + 1}"
                materials = [surface(s.material) for s in thing.material_slots]
                look = looks[graph_name] = {"name": thing.name, "materials": materials}
                data = _mesh(node, thing, depsgraph)
                if data:
                    look["mesh"] = f"{cache.LOOKS_FOLDER}/{graph_name.replace(':', '_')}-{mesh_export.content_hash(data)}.ply"
                    files[look["mesh"]] = data
        except core.Refused:
            continue  # gone or disabled since it was baked: its shape stands for it


def write(tree, folder):
    """As the scene is now. Raises OSError."""
    looks, files = {}, {}
    _of_bodies(tree, looks)
    _of_solids(tree, looks, files)
    mesh_export.write(folder, files)
    path = os.path.join(folder, cache.LOOKS)
    with open(path + ".part", "w", encoding="utf-8") as file:
        json.dump({"sunder_looks": 1, "nodes": looks}, file, indent=1)
    os.replace(path + ".part", path)
    for name in cache.looks_meshes(folder):
        if f"{cache.LOOKS_FOLDER}/{name}" not in files:
            os.remove(os.path.join(folder, cache.LOOKS_FOLDER, name))
