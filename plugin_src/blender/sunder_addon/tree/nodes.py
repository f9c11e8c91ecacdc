"""Blender's node classes, each made from the description of a node type of the library."""
import bpy
from bpy.props import StringProperty

from ..base import descriptions, drawing, runtime
from . import parameters, pickers, sockets, trees, wiring


def class_name(node_type):
    return "Sunder" + "".join(word.title() for word in node_type.split("_")) + "Node"


_WIDE = ("prefracture", "fragment_region", "body", "turbulence", "solver")  # with long labels beside numbers
_GREY, _TINT = 0.17, 0.15  # a node's colour: grey, with so much of what the wires have that come out of it


def _color(description):
    wire = sockets.color(description["outputs"][0]["type"])
    return [(1 - _TINT) * _GREY + _TINT * c for c in wire[:3]]


def _changed(self, _context):
    runtime.signatures.pop(self.id_data.name_full, None)
    runtime.node_errors.pop((self.id_data.name_full, self.graph_name), None)


def _map_names(self, _context, text):
    """What of the source's mesh could be a map."""
    thing = self.mesh_object()
    if thing is None:
        return []
    names = [g.name for g in thing.vertex_groups] + [a.name for a in thing.data.attributes if a.domain == "POINT"]
    return [n for n in names if text.lower() in n.lower() and not n.startswith(".") and n != "position"]


def _fresh_name(node):
    """A name in the graph that no other node of the tree has: "body", "body_2", ..."""
    taken = {n.graph_name for n in node.id_data.nodes if trees.is_node(n) and n != node}
    name, number = node.sunder_type, 1
    while name in taken:
        number += 1
        name = f"{node.sunder_type}_{number}"
    return name


class SunderNode:
    """What all nodes share. Parameters are attributes: `node.density`, `node.yield_`, `node.use_yield`,
    `node.auto_damping_time`."""

    @classmethod
    def poll(cls, tree):
        return trees.is_tree(tree)

    def init(self, _context):
        description = descriptions.NODES[self.sunder_type]
        for socket in description["inputs"]:
            sockets.add(self.inputs, socket, True)
        for socket in description["outputs"]:
            sockets.add(self.outputs, socket, False)
        self.width = drawing.WIDE_NODE if self.sunder_type in _WIDE else drawing.NODE
        self.use_custom_color, self.color = True, _color(description)
        trees.identity(self.id_data)
        self.graph_name = _fresh_name(self)
        for p in description["parameters"]:
            parameters.begin(p, self)

    def copy(self, _node):
        if any(n.graph_name == self.graph_name for n in self.id_data.nodes if trees.is_node(n) and n != self):
            self.graph_name = _fresh_name(self)

    @property
    def error(self):
        """What the last bake or wire had against this node; empty if nothing."""
        return runtime.node_errors.get((self.id_data.name_full, self.graph_name), "")

    @property
    def note(self):
        """What the node says of its bake: which frames there are and which is shown."""
        return runtime.node_notes.get((self.id_data.name_full, self.graph_name), "")

    def parameter(self, name):
        """A parameter as Sunder takes it: None for null, "auto" where it is automatic, degrees for angles."""
        return parameters.value(self._description(name), self)

    def set_parameters(self, **given):
        """Sets parameters as Sunder would take them: node.set_parameters(toughness=None, rotation=(0, 0, 90))."""
        for name, value in given.items():
            parameters.set_value(self._description(name), self, value)

    def _description(self, name):
        for p in descriptions.parameters(self.sunder_type):
            if p["name"] == name:
                return p
        known = ", ".join(p["name"] for p in descriptions.parameters(self.sunder_type))
        raise AttributeError(f"a {self.bl_label} node has no parameter '{name}'; it has {known}")

    def mesh_object(self):
        """The object whose mesh comes up the wires, for picking a vertex group."""
        node = wiring.upstream(self, "mesh_file")
        return node.object if node and node.source == pickers.OBJECT else None


def make(description, buttons):
    """`buttons`: a class of what Blender calls to draw a node (node_buttons.py)."""
    node_type = description["type"]
    annotations = {"graph_name": StringProperty(options={"HIDDEN"})}
    for p in description["parameters"]:
        annotations.update(parameters.properties(p, _changed))
        if p["name"] in pickers.map_parameters(node_type):
            annotations[p["name"]] = StringProperty(
                name=p["label"], description=p["sentence"].rstrip("."), default=p["default"], options=set(),
                update=_changed, search=_map_names, search_options={"SUGGESTION"})
    annotations.update(parameters.folds(node_type))
    picked = pickers.properties(node_type, _changed)
    if annotations.keys() & picked.keys():
        raise ValueError(f"{node_type}: {', '.join(annotations.keys() & picked.keys())} is both parameter and picker")
    annotations.update(picked)
    is_mesh = node_type == "mesh_file"
    sentence = "A solid from Blender's objects, or from a file" if is_mesh else description["sentence"].rstrip(".")
    members = {
        "bl_idname": class_name(node_type),
        "bl_label": "Mesh" if is_mesh else description["label"],
        "bl_description": sentence,
        "sunder_type": node_type,
        "__doc__": sentence,
        "__annotations__": annotations,
    }
    return type(members["bl_idname"], (buttons, SunderNode, bpy.types.Node), members)
