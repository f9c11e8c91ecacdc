"""Edits of edges: seam nodes between a body and its solver that keep places, and find by them their interfaces in any cut.

Places are points in the body's own coordinates. A node takes the interfaces whose middle is nearer than its distance to one of its
points and to none that it spares nearer still: so an edit is exact in the cut in which it was made.
"""
import numpy as np
from mathutils.kdtree import KDTree

from ..base import core
from . import nodes, pickers, trees, wiring

_GAP = 50  # between nodes, points
_RIVALS = {"scale": ("scale",), "hold": ("hold", "break"), "break": ("hold", "break")}  # modes of which an edge has one


def places(node, name):
    """(n, 3) float64: of `points` or `spared`."""
    try:
        found = np.array(getattr(node, name + "_values").split(), float).reshape(-1, 3)
    except ValueError:
        found = np.full((1, 3), np.nan)
    if not np.isfinite(found).all():
        raise core.Refused(f"{name}: what is kept here is no list of places", node.graph_name)
    return found


def write_places(node, name, points):
    setattr(node, name + "_values", " ".join(f"{x:.7g}" for x in np.ravel(points)))


def is_edit(node):
    return (node.sunder_type == "seam" and node.between == "places" and node.points_source == pickers.VALUES
            and node.spared_source == pickers.VALUES)


def of_body(body):
    """The edits of a body's edges."""
    return [n for n in body.id_data.nodes if trees.is_node(n) and is_edit(n) and wiring.upstream(n, "body") == body]


def _nearest(points):
    """A function that gives how far the nearest of them is; infinitely far where there is none."""
    known = KDTree(len(points))
    for i, point in enumerate(points):
        known.insert(point, i)
    known.balance()
    return lambda at: known.find(at)[2] if len(points) else np.inf


def covered(node, middles):
    """(m,) bool: which interfaces an edit takes, by their middles in the body's own coordinates."""
    distance, to_point, to_spared = node.parameter("distance"), *(_nearest(places(node, n)) for n in ("points", "spared"))
    return np.array([(d := to_point(at)) < distance and not to_spared(at) < d for at in middles], bool)


def within(middles, points, distance):
    """(m,) bool: which middles are nearer than `distance` to one of the points."""
    to_point = _nearest(points)
    return np.array([to_point(at) < distance for at in middles], bool)


def _without(points, others):
    """Points that are none of the others, but for rounding."""
    to_other = _nearest(others)
    size = max(1.0, np.abs(points).max(initial=0))
    return np.array([p for p in points if to_other(p) > 1e-6 * size]).reshape(-1, 3)


def _united(points, others):
    return np.concatenate([points, _without(others, points)])


def release(body, middles, chosen, modes=("scale", "hold", "break")):
    """Takes chosen interfaces (m,) bool out of a body's edits of some modes; an edit that is left with none goes. Returns how many
    interfaces had one."""
    had = np.zeros(len(middles), bool)
    for node in of_body(body):
        takes = covered(node, middles) if node.mode in modes else np.zeros(len(middles), bool)
        gone, kept = middles[takes & chosen], middles[takes & ~chosen]
        had |= takes & chosen
        if len(gone) and not len(kept):
            remove(node)
        elif len(gone):
            write_places(node, "points", _united(_without(places(node, "points"), gone), kept))
            write_places(node, "spared", _united(_without(places(node, "spared"), kept), gone))
    return int(had.sum())


def put(body, settings, distance, middles, chosen):
    """Makes chosen interfaces (m,) bool, at `middles` (m, 3), those of an edit with these settings, and of none that would
    contradict it; returns the node."""
    node = _of_settings(body, settings, distance)
    takes = covered(node, middles) if node else np.zeros(len(middles), bool)
    release(body, middles, chosen & ~takes, _RIVALS[settings["mode"]])
    node = node or insert(body, settings, distance)
    points = _united(places(node, "points"), middles[takes | chosen])
    to_point = _nearest(points)
    spared = [p for p in middles[~takes & ~chosen] if to_point(p) < 2 * distance]
    write_places(node, "points", points)
    write_places(node, "spared", spared)
    return node


def paint(body, settings, distance, middles, stroke):
    """The same of all that is nearer than `distance` to a stroke's points (k, 3), which are kept instead of the middles."""
    chosen = within(middles, stroke, distance)
    node = _of_settings(body, settings, distance)
    is_stroke = node is not None and not len(places(node, "spared"))
    takes = covered(node, middles) if is_stroke else np.zeros(len(middles), bool)
    release(body, middles, chosen & ~takes, _RIVALS[settings["mode"]])
    if not is_stroke:
        node = insert(body, settings, distance)
    write_places(node, "points", _united(places(node, "points"), np.asarray(stroke, float)))
    return node


def _of_settings(body, settings, distance):
    def fits(node):
        own = {name: node.parameter(name) for name in settings}
        return own == settings and np.isclose(node.parameter("distance"), distance, rtol=1e-5)

    return next((node for node in of_body(body) if fits(node)), None)


def _end_of(body):
    """(node, output name) that a solver has a body from."""
    for node in body.id_data.nodes:
        if trees.is_node(node) and node.sunder_type == "solver" and not node.mute:
            for source, output in wiring.sources(node, "bodies"):
                if wiring.upstream(source, "body") == body:
                    return source, output
    raise core.Refused("no solver has this body", body.graph_name)


def _rewire(sockets, before, after):
    """Whatever inputs have from one output they have from another, in the place that it had."""
    for socket in sockets:
        fed = [(link.from_socket, trees.source_of(link)) for link in socket.links]
        if all(source != before for _, source in fed):
            continue
        links = socket.id_data.links
        for link in list(socket.links):
            links.remove(link)
        for direct, source in fed:
            links.new(after if source == before else direct, socket)


def insert(body, settings, distance):
    """A new edit between a body and its solver, behind all that stands there; what lies right of it makes room."""
    tree, (last, output) = body.id_data, _end_of(body)
    before = next(s for s in last.outputs if s.identifier == output)
    node = tree.nodes.new(nodes.class_name("seam"))
    step, x = node.width + _GAP, last.location.x + last.width + _GAP
    for other in tree.nodes:
        if other != node and other.location.x >= x - _GAP / 2:
            other.location.x += step
    node.location = x, last.location.y
    solvers = [n for n in tree.nodes if trees.is_node(n) and n.sunder_type == "solver"]
    _rewire([s for n in solvers for s in n.inputs if s.identifier == "bodies"], before, node.outputs[0])
    tree.links.new(before, node.inputs[0])
    node.between = "places"
    node.points_source = node.spared_source = pickers.VALUES
    node.set_parameters(distance=distance, **settings)
    return node


def remove(node):
    """Takes an edit out, and closes the gap."""
    tree, x, step = node.id_data, node.location.x, node.width + _GAP
    _rewire([s for n in tree.nodes if trees.is_node(n) for s in n.inputs], node.outputs[0], trees.source_of(node.inputs[0].links[0]))
    tree.nodes.remove(node)
    if any(x - _GAP < other.location.x < x + step - _GAP / 2 for other in tree.nodes):
        return
    for other in tree.nodes:
        if other.location.x >= x:
            other.location.x -= step
