"""What the library warns of before anything is simulated: of a mesh, of how things settle, of what a solver leaves out.

A bake notes it in blender.json beside itself, by names in the graph.
"""
import re

from . import cache

_NAMED = re.compile(r"node '(?P<node>[^']*)': ")  # what begins so is of that node, whoever tells it
_OUTPUTS = {"prefracture": "fragments", "collider": "collider", "solver": "state"}  # values that have warnings


def collect(graph, frame):
    """A generator of the library's jobs; returns {graph name: [sentence, ...]} at the first frame, of nodes that are warned of."""
    found = {}
    nodes = graph.to_dict()["nodes"]
    for name, fields in nodes.items():
        output = _OUTPUTS.get(fields["type"])
        if output is None:
            continue
        job = graph.start_evaluate(f"{name}.{output}", frame)
        yield job
        job.result()
        for warning in graph.evaluate(f"{name}.{output}", frame).warnings:
            other = _NAMED.match(warning)  # they stand on their nodes
            at = other["node"] if other and other["node"] in nodes else name
            found.setdefault(at, []).append(warning[other.end():] if other else warning)
    return found


def of_bake(tree):
    """{graph name: [sentence, ...]} of the bake that is there."""
    return cache.note(cache.folder(tree)).get("warnings", {})


def of_node(node):
    """Of one node, and of all that it stands for: NAME:2 is of the second object of node NAME."""
    return [sentence for name, sentences in of_bake(node.id_data).items() if name.split(":")[0] == node.graph_name
            for sentence in sentences]
