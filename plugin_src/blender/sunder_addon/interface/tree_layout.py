"""Places the nodes of a tree: columns by how far they are from what comes out, rows in the order of the sockets they feed.

How high a node is Blender knows once it has drawn it, and not when a tree is made. So what draws it draws into a layout that
counts rows.
"""
import math
import types

import bpy

from ..base import runtime
from ..tree import trees

COLUMN_GAP, ROW_GAP = 50, 40  # between nodes, points
_UNTIL_DRAWN = 0.4  # s
_MARGIN = 0.02  # around a tree, of its longer side
_editors_seen = set()  # as_pointer of areas that were editors of our trees at the last look
_ROUNDS = 6  # of moving columns towards what they are wired to; more change nothing that is seen
# As Blender draws, points: title and borders, a row of a socket, a row of buttons, the gap between two of these.
_FRAME, _SOCKET, _ROW, _GAP = 42, 22, 20, 5
_TO_OUTPUT, _TO_INPUT = 36, 14  # from a node's top to its first output, from its bottom to its last input


class _Rows:
    """Stands in for Blender's layout: counts the rows of buttons that it would have."""

    def __init__(self, is_row=False):
        self._is_row, self._parts, self._own = is_row, [], 0.0

    def count(self):
        inner = [part.count() for part in self._parts]
        return max([self._own, *inner]) if self._is_row else self._own + sum(inner)

    def _add(self, rows):
        self._own = max(self._own, rows) if self._is_row else self._own + rows

    def _part(self, is_row):
        self._parts.append(_Rows(is_row))
        return self._parts[-1]

    def row(self, **_how):
        return self._part(True)

    split = row

    def column(self, **_how):
        return self._part(False)

    box = column

    def label(self, **_how):
        self._add(1)

    def separator(self, **_how):
        self._add(0.5)

    def operator(self, _name, **_how):
        self._add(1)
        return types.SimpleNamespace()

    def prop(self, data, name, **_how):
        about = data.bl_rna.properties[name]
        is_vector = getattr(about, "array_length", 0) > 0 and about.type in ("FLOAT", "INT")
        self._add(1 + about.array_length if is_vector else 1)

    def prop_search(self, *_what, **_how):
        self._add(1)


def size(node):
    """Width and height in points: as drawn, else about as it will be."""
    if node.dimensions.y > 0:
        scale = bpy.context.preferences.system.ui_scale
        return node.dimensions.x / scale, node.dimensions.y / scale
    return node.width, estimated_height(node)


def estimated_height(node):
    rows = _Rows()
    node.draw_buttons(bpy.context, rows)
    n_sockets = sum(not s.hide for s in [*node.inputs, *node.outputs])
    return _FRAME + _SOCKET * n_sockets + (_ROW + _GAP) * rows.count()


def _fed_by(node):
    """Nodes that feed a node, in the order of its sockets and wires."""
    sources = [trees.source_of(link) for socket in node.inputs for link in socket.links]
    return [output.node for output in sources if output is not None]


def columns(nodes):
    """[[node, ...], ...] from left to right, each from above to below."""
    known = {node.name: node for node in nodes}
    distance, order = {}, []

    def visit(node, steps, below):
        if node.name not in known or node.name in below:
            return
        if node.name not in distance:
            order.append(node.name)
        elif distance[node.name] >= steps:
            return
        distance[node.name] = steps
        for source in _fed_by(node):
            visit(source, steps + 1, below | {node.name})

    feeding = {source.name for node in nodes for source in _fed_by(node)}
    ends = [node for node in nodes if node.name not in feeding]
    for node in [*ends, *nodes]:  # nodes in a circle are fed and feed: they come last
        if node.name not in distance:
            visit(node, 0, frozenset())
    n = 1 + max(distance.values(), default=-1)
    return [[known[name] for name in order if distance[name] == n - 1 - column] for column in range(n)]


def _stack(names, heights, wanted):
    """{name: middle} of one column: in order, apart, and as a whole where they want to be. y points up."""
    middles, top = {}, None
    for name in names:
        middle = wanted[name] if top is None else min(wanted[name], top - heights[name] / 2)
        middles[name], top = middle, middle - heights[name] / 2 - ROW_GAP
    shift = sum(wanted[name] - middles[name] for name in names) / len(names)
    return {name: middle + shift for name, middle in middles.items()}


def _raise_above_what_lies_between(found, middles, heights):
    """The topmost node of a column is raised to where a long wire that comes from above reaches it without passing behind a node."""
    column_of = {node.name: i for i, column in enumerate(found) for node in column}
    for node in (column[0] for column in found if column):
        inputs = [socket for socket in node.inputs if not socket.hide]
        for i, socket in enumerate(inputs):
            for source in filter(None, (trees.source_of(link) for link in socket.links)):
                name = source.node.name
                between = [n.name for column in found[column_of[name] + 1:column_of[node.name]] for n in column]
                least = max((middles[n] + heights[n] / 2 for n in between), default=-math.inf) + ROW_GAP / 2
                starts = middles[name] + heights[name] / 2 - _TO_OUTPUT
                ends = middles[node.name] - heights[node.name] / 2 + _TO_INPUT + _SOCKET * (len(inputs) - 1 - i)
                if ends < least <= starts:
                    middles[node.name] += least - ends


def arrange(tree):
    """Moves all nodes; none lies over another. None is selected: Blender draws wires of selected ones white."""
    nodes = [node for node in tree.nodes if trees.is_node(node)]
    for node in tree.nodes:
        node.select = False
    found = columns(nodes)
    sizes = {node.name: size(node) for node in nodes}
    heights = {name: height for name, (_, height) in sizes.items()}
    wired = {node.name: set() for node in nodes}
    for node in nodes:
        for source in _fed_by(node):
            wired[node.name].add(source.name), wired[source.name].add(node.name)
    middles = {}
    for column in found:
        names = [node.name for node in column]
        middles.update(_stack(names, heights, {name: 0.0 for name in names}))
    for turn in range(_ROUNDS):
        for column in found if turn % 2 else reversed(found):
            names = [node.name for node in column]
            wanted = {name: sum(middles[n] for n in sorted(wired[name])) / len(wired[name]) if wired[name] else middles[name]
                      for name in names}
            middles.update(_stack(names, heights, wanted))
    _raise_above_what_lies_between(found, middles, heights)
    x = 0.0
    for column in found:
        for node in column:
            node.location = x, middles[node.name] + heights[node.name] / 2
        x += max(sizes[node.name][0] for node in column) + COLUMN_GAP


def _editors():
    """(window, area) of the editors of our trees that are to be seen."""
    return [(window, area) for window in bpy.context.window_manager.windows for area in window.screen.areas
            if area.type == "NODE_EDITOR" and area.ui_type == trees.SunderTree.bl_idname]


def fill(window, area):
    """The editor shows its tree from edge to edge. (Blender's own View All leaves half of it empty.)"""
    nodes = list(area.spaces.active.node_tree.nodes)
    if not nodes:
        return
    scale = bpy.context.preferences.system.ui_scale
    boxes = [(node.location, size(node)) for node in nodes]
    left, right = min(at.x for at, _ in boxes), max(at.x + width for at, (width, _) in boxes)
    bottom, top = min(at.y - height for at, (_, height) in boxes), max(at.y for at, _ in boxes)
    margin = _MARGIN * max(right - left, top - bottom)
    region = next(r for r in area.regions if r.type == "WINDOW")
    ends = region.x + region.width
    free = region.width - sum(r.width for r in area.regions if r.type == "UI" and r.width > 1 and r.x < ends)  # of the sidebar
    if free <= 0:
        return
    step = max((right - left + 2 * margin) / free, (top - bottom + 2 * margin) / region.height)  # points of the tree in a pixel
    x, y = (left + right - step * free) / 2, (bottom + top - step * region.height) / 2
    to_region = region.view2d.view_to_region
    x_min, y_min = to_region(x * scale, y * scale, clip=False)
    x_max, y_max = to_region((x + step * region.width) * scale, (y + step * region.height) * scale, clip=False)
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view2d.zoom_border(xmin=x_min, xmax=x_max, ymin=y_min, ymax=y_max, wait_for_input=False, zoom_out=False)


def show(tree):
    """Editors that hold on to no other tree show this one: all of it, as soon as Blender has drawn it and knows how large it is."""
    for _, area in _editors():
        if not area.spaces.active.pin:
            area.spaces.active.node_tree = tree
    _fill_soon(tree)


def show_in_new_editors():
    """Blender leaves an editor empty that just became one of ours: it shows the active object's tree, or the file's first."""
    there = {area.as_pointer(): area.spaces.active for _, area in _editors()}
    empty = [space for key, space in there.items() if key not in _editors_seen and space.node_tree is None]
    _editors_seen.clear()
    _editors_seen.update(there)
    if not empty or not trees.trees():
        return
    thing = bpy.context.view_layer.objects.active if bpy.context.view_layer else None
    tree = thing.sunder.tree if thing is not None and trees.is_tree(thing.sunder.tree) else trees.trees()[0]
    for space in empty:
        space.node_tree = tree
    _fill_soon(tree)


def _fill_soon(tree):
    if bpy.app.background:
        return
    name = tree.name_full

    @runtime.guarded
    def fill_all():
        for window, area in _editors():
            shown = area.spaces.active.node_tree
            if shown is not None and shown.name_full == name:
                fill(window, area)

    bpy.app.timers.register(fill_all, first_interval=_UNTIL_DRAWN)
