"""What a mesh carries besides the UV map and the colours that renders show: further ones, attributes, vertex groups.

Read from artists' meshes, written into results. Files call them as docs/files.md tells (layers).
"""
import urllib.parse

import bpy
import numpy as np

from ..base import blender_versions
from ..base.bake_reader import Layer

# Blender's type: (kind, numbers a row, field that holds them)
_TYPES = {
    "FLOAT": ("float", 1, "value"), "FLOAT2": ("float", 2, "vector"), "FLOAT_VECTOR": ("float", 3, "vector"),
    "QUATERNION": ("float", 4, "value"), "FLOAT_COLOR": ("color", 4, "color"), "BYTE_COLOR": ("color", 4, "color"),
    "INT": ("int", 1, "value"), "INT8": ("int", 1, "value"), "INT16_2D": ("int", 2, "value"),
    "INT32_2D": ("int", 2, "value"), "BOOLEAN": ("bool", 1, "value"),
}
# What a kind with so many numbers becomes: the first of these that this Blender has.
_WRITTEN = {
    ("float", 1): ("FLOAT",), ("float", 2): ("FLOAT2",), ("float", 3): ("FLOAT_VECTOR",),
    ("float", 4): ("QUATERNION", "FLOAT_COLOR"), ("color", 4): ("FLOAT_COLOR",), ("int", 1): ("INT",),
    ("int", 2): ("INT32_2D",), ("bool", 1): ("BOOLEAN",),
}
# What results have of their own (docs/blender.md).
OF_RESULTS = {"fragment", "interior", "hidden", "interface", "rim", "strain", "toughness_left", "damage",
              "plastic_strain", "rest_position", "velocity", "acceleration"}


def _key(layer):
    """What layers of two objects have in common when they are one."""
    return layer.name, layer.domain, layer.kind, layer.values.shape[1]


def _none(layer, n):
    """Rows of a part that lacks a layer."""
    return np.full((n, layer.values.shape[1]), 1 if layer.kind == "color" else 0, layer.values.dtype)


def property_name(layer):
    """What a layer is called in a PLY file."""
    return f"{layer.domain}_{layer.kind}:{urllib.parse.quote(layer.name, safe='')}"


def _rows(attribute, kind, width, field):
    dtype = {"int": np.int32, "bool": bool}.get(kind, np.float32)
    values = np.empty(len(attribute.data) * width, dtype)
    attribute.data.foreach_get(field, values)
    return values.astype(np.int32 if kind == "bool" else dtype).reshape(-1, width)


def _deforming_bones(thing, use_modifiers):
    """Names of the bones that have moved the mesh already."""
    rigs = [m.object for m in thing.modifiers if use_modifiers and m.type == "ARMATURE"]
    return {b.name for rig in rigs if rig is not None and rig.type == "ARMATURE" for b in rig.data.bones}


def _weights(thing, mesh, use_modifiers):
    bones = _deforming_bones(thing, use_modifiers)
    groups = [g for g in thing.vertex_groups if g.name not in bones]
    if not groups:
        return []
    held = np.array([(v.index, g.group, g.weight) for v in mesh.vertices for g in v.groups], np.float64).reshape(-1, 3)
    vertex, group = held[:, 0].astype(np.int64), held[:, 1].astype(np.int64)
    found = []
    for g in groups:
        values = np.zeros((len(mesh.vertices), 1), np.float32)
        values[vertex[group == g.index], 0] = held[group == g.index, 2]
        found.append(Layer(g.name, "point", "weight", values))
    return found


def read(thing, mesh, uv_map, colors, use_modifiers):
    """Of `mesh`, which is made of object `thing`; all but those two layers of it (None: there is none)."""
    maps = [Layer(m.name, "corner", "uv", _rows(m, "uv", 2, "uv")) for m in mesh.uv_layers if m != uv_map]
    taken = {m.name for m in mesh.uv_layers} | ({colors.name} if colors else set()) | OF_RESULTS
    attributes = [Layer(a.name, a.domain.lower(), _TYPES[a.data_type][0], _rows(a, *_TYPES[a.data_type]))
                  for a in mesh.attributes if a.domain in ("POINT", "CORNER", "FACE") and a.data_type in _TYPES
                  and a.name not in taken and not blender_versions.is_of_geometry(a.name)]
    return maps + attributes + _weights(thing, mesh, use_modifiers)


def order(thing, mesh, uv_map, colors):
    """How artists find them: {"uv_maps", "colors", "groups": names in their order; "uv_map", "color", "group": the active
    one's; "render_uv_map", "render_color": the ones that are not among the layers}. JSON."""
    active, group = mesh.color_attributes.active_color, thing.vertex_groups.active
    return {
        "uv_maps": [m.name for m in mesh.uv_layers], "uv_map": mesh.uv_layers.active.name if mesh.uv_layers.active else "",
        "colors": [c.name for c in mesh.color_attributes], "color": active.name if active else "",
        "groups": [g.name for g in thing.vertex_groups], "group": group.name if group else "",
        "render_uv_map": uv_map.name if uv_map else "", "render_color": colors.name if colors else "",
    }


def joined_order(orders):
    """Of several objects: names of all, what is active as in the first that has one."""
    whole = {}
    for one in orders:
        for field, value in one.items():
            if isinstance(value, list):
                known = whole.setdefault(field, [])
                known += [name for name in value if name not in known]
            else:
                whole[field] = whole.get(field) or value
    return whole


def joined(parts, counts, render_names):
    """Layers of several objects as those of one. parts: layers of each; counts: {domain: number of rows} of each.

    Of one name the first counts: an object that has it by another domain or type lacks it. `render_names`: of the UV map and
    the colour attribute that are no layers."""
    known = {}
    for layer in (layer for layers in parts for layer in layers):
        is_group = layer.kind == "weight"
        if is_group or layer.name not in render_names:
            known.setdefault((layer.name, is_group), layer)
    whole = []
    for first in known.values():
        own = [next((l for l in layers if _key(l) == _key(first)), None) for layers in parts]
        rows = [_none(first, n[first.domain]) if l is None else l.values for l, n in zip(own, counts)]
        whole.append(Layer(first.name, first.domain, first.kind, np.concatenate(rows)))
    return whole


def _in_order(layers, names):
    """Those that are named first, as they are; what nobody named after them."""
    place = {name: i for i, name in enumerate(names)}
    return sorted(layers, key=lambda layer: place.get(layer.name, len(place)))


def render_names(found, order_of, uv_map, color):
    """What the UV map and the colours that renders show are called on a result: as it says, unless the source has given that
    name to another one since. `found`: the frame's layers."""
    others = {layer.name for layer in found if layer.kind != "weight"}
    return (order_of.get("render_uv_map") or uv_map if uv_map in others else uv_map,
            order_of.get("render_color") or color if color in others else color)


def write_uv_maps(write, mesh, uvs, name, found, order_of):
    """All UV maps of a frame in the order of the source's. `write`: result_mesh's function for one; `name`: of the one that
    renders show, whose `uvs` may be None."""
    known = order_of.get("render_uv_map") or name
    main = [] if uvs is None else [Layer(known, "corner", "uv", uvs)]
    for layer in _in_order(main + [l for l in found if l.kind == "uv"], order_of.get("uv_maps", ())):
        write(mesh, layer.values, name if layer in main else layer.name)
    maps, active = mesh.uv_layers, order_of.get("uv_map", "")
    if len(maps) > 1:
        if main:
            maps[name].active_render = True
        maps.active = maps.get(name if active == known else active) or maps.active


def write_attributes(write, mesh, color_name, found, order_of):
    """Attributes of a frame, after the colours that renders show. `write`: result_mesh's function for one."""
    types = bpy.types.Attribute.bl_rna.properties["data_type"].enum_items
    for layer in found:
        kind = next((t for t in _WRITTEN.get((layer.kind, layer.values.shape[1]), ()) if t in types), None)
        if kind is not None:
            values = layer.values.astype(bool) if layer.kind == "bool" else layer.values
            write(mesh, layer.name, kind, layer.domain.upper(), values)
    colors, active = mesh.color_attributes, order_of.get("color", "")
    if len(colors) > 1:
        place = {c.name: i for i, c in enumerate(colors)}
        colors.render_color_index = place.get(color_name, colors.render_color_index)
        colors.active_color_index = place.get(color_name if active == order_of.get("render_color") else active,
                                              colors.active_color_index)


def write_groups(thing, found, order_of):
    """Vertex groups of a frame; those of a frame without any stay as they are."""
    weights = _in_order([l for l in found if l.kind == "weight"], order_of.get("groups", ()))
    if not weights:
        return
    _write_weights(thing, weights)
    active = thing.vertex_groups.get(order_of.get("group", ""))
    thing.vertex_groups.active_index = active.index if active else 0


def write_linked_groups(names, stage, found):
    """Weights of a frame for a linked mesh that has groups of these names: Blender drops what is written to them, but weights
    come along with a whole mesh, by the groups' numbers. `stage`: a local object of the mesh that is handed over."""
    known = {layer.name: layer for layer in found if layer.kind == "weight"}
    if known.keys() & set(names):
        none = np.zeros((len(stage.data.vertices), 1), np.float32)
        _write_weights(stage, [known.get(name) or Layer(name, "point", "weight", none) for name in names])


def _write_weights(thing, weights):
    thing.vertex_groups.clear()
    for layer in weights:
        group, values = thing.vertex_groups.new(name=layer.name), layer.values[:, 0]
        inside = np.flatnonzero(values)
        inside = inside[np.argsort(values[inside], kind="stable")]
        different, first = np.unique(values[inside], return_index=True)  # a call for each weight
        for weight, members in zip(different.tolist(), np.split(inside, first[1:])):
            group.add(members.tolist(), weight, "REPLACE")
