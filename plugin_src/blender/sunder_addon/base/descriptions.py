"""What nodes there are: the library's descriptions of them, written into the add-on's folder when it is packaged."""
import json
import os

_PATH = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "nodes.json")

with open(_PATH, encoding="utf-8") as _file:
    _content = json.load(_file)

VERSION = _content["sunder"]
NODES = {node["type"]: node for node in _content["nodes"]}


def parameters(node_type):
    return NODES[node_type]["parameters"]


def socket_types():
    """Names of everything that runs through wires, in a fixed order."""
    names = []
    for node in NODES.values():
        for socket in node["inputs"] + node["outputs"]:
            if socket["type"] not in names:
                names.append(socket["type"])
    return names


def groups(node_type):
    """{label: [parameter, ...]} in the order in which they are shown; first, under "", what is not folded away."""
    found = {"": []}
    for p in parameters(node_type):
        found.setdefault(p["group"], []).append(p)
    return found


def group_labels():
    """Labels of the groups of all node types, each once."""
    return list(dict.fromkeys(label for node_type in NODES for label in groups(node_type) if label))
