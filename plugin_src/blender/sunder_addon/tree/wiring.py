"""What is wired to what: reroutes are followed, muted nodes count as not there."""
from . import trees


def sources(node, socket_name):
    """(node, output name) of everything that feeds an input, in the order of its wires."""
    socket = next(s for s in node.inputs if s.identifier == socket_name)
    found = []
    for link in socket.links:
        output = trees.source_of(link)
        if output is not None and trees.is_node(output.node) and not output.node.mute:
            found.append((output.node, output.identifier))
    return found


def inputs(node):
    """[(input name, [(node, output name), ...])] of inputs that are fed."""
    pairs = [(s.identifier, sources(node, s.identifier)) for s in node.inputs]
    return [(name, found) for name, found in pairs if found]


def upstream(node, sunder_type):
    """The first node of a type met when going up the wires, itself included."""
    seen, queue = set(), [node]
    while queue:
        at = queue.pop(0)
        if at.sunder_type == sunder_type:
            return at
        if at.name not in seen:
            seen.add(at.name)
            queue += [n for _, found in inputs(at) for n, _ in found]
    return None


def needed(tree):
    """Nodes that a bake needs, each after what feeds it: deformers, bake nodes and all above them.

    A cycle is left as it is; the library names it.
    """
    order, state = [], {}

    def visit(node):
        if node.name in state:
            return
        state[node.name] = True
        for _, found in inputs(node):
            for source, _ in found:
                visit(source)
        order.append(node)

    for node in tree.nodes:
        if trees.is_node(node) and not node.mute and node.sunder_type in ("deformer", "bake_mesh", "bake_state"):
            visit(node)
    return order
