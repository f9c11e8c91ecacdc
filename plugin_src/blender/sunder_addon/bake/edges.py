"""A body's edges at rest, as the library cuts them from the tree as it stands; and which of them are selected.

A selection belongs to the tree, so that undo carries it along. It is of one cut: in another none is selected.
"""
import os
import zlib

import bpy
import numpy as np
from mathutils import Quaternion

from ..base import core
from ..tree import trees, wiring
from ..scene import mesh_export, scene_input
from . import break_report, cache, compiler, signature

_known = {}  # full name of a tree: (signature, {graph name of a body: Edges}), of the tree as it was asked about last


class Edges:
    """One body at the first frame, m edges between n fragments, in the scene.

    pairs (m, 2) fragments; center (n, 3), middle (m, 3) m; normal (m, 3); share (m,) of area; cluster (n,); toughness (m,) as
    the tree makes it at the first frame; own_toughness: the body's, or None; own_middle (m, 3): in the body's own coordinates;
    spacing: of fragments, m; stamp: of the cut.
    """

    def __init__(self, body, own_toughness):
        self.pairs, self.center, self.middle = body.edges.astype(np.int64), body.rest_position.copy(), body.edge_middle.copy()
        self.normal, self.share, self.cluster = body.edge_normal.copy(), body.edge_share.copy(), body.cluster.copy()
        self.toughness, self.own_toughness = body.edge_toughness.copy(), own_toughness
        self.spacing = float(np.cbrt(body.volume.mean()))
        pose = body.pose
        self._turned = np.array(Quaternion(pose["orientation"]).to_matrix())
        self._at = np.array(pose["position"])
        self.own_middle = self.to_own(self.middle)
        self.stamp = f"{len(self.center)} {zlib.crc32(self.pairs.tobytes()):08x}"

    def to_own(self, points):
        """From the scene to the body's own coordinates, in which edits keep their places."""
        return (np.asarray(points, float).reshape(-1, 3) - self._at) @ self._turned


def body_of(context, tree, name=""):
    """The body node that is meant: the one of a name, of the active object, or the only one."""
    bodies = [n for n in wiring.needed(tree) if n.sunder_type == "body"]
    thing = context.object
    if not name and len(bodies) > 1 and thing is not None:
        shown = break_report.body_of(thing) if trees.is_tree(thing.sunder.tree) else ""
        found = [b for b in bodies if b.graph_name == shown or scene_input.placed_by(b) == thing]
    else:
        found = [b for b in bodies if name in ("", b.graph_name)]
    if len(found) == 1:
        return found[0]
    known = ", ".join(b.graph_name for b in bodies) or "none"
    raise core.Refused(f"there is no body '{name}': the tree has {known}" if name else
                       f"it is not clear which body is meant: make its object active, or name it ({known})")


def _cut(tree, scene):
    """{graph name of a body: Edges}"""
    sunder, compiled = core.sunder(), compiler.compile_tree(tree, scene, at_first=True)
    baked, folder = cache.folder(tree), os.path.join(bpy.app.tempdir, "sunder_edges")
    mesh_export.write(folder, compiled.files)
    first, found = compiled.description["frame_range"][0], {}
    try:
        graph = sunder.Graph.from_dict(compiled.description, base_folder=folder, name=tree.name)
        graph.set_cut_folder(cache.cuts(baked if os.path.isdir(baked) else folder))
        graph.set_threads(tree.threads)
        for wire in _wires(compiled.description["nodes"]):
            body = graph.evaluate(wire[1:], first)
            found[body.name] = Edges(body, graph[body.name].at("toughness", first))
    except sunder.Error as error:
        raise core.Refused(error.what + (f" ({error.mend})" if error.mend else ""), error.node) from error
    return found


def _wires(graph_nodes):
    """What solvers have bodies from."""
    for fields in graph_nodes.values():
        if fields["type"] == "solver":
            bodies = fields.get("bodies", ())
            yield from [bodies] if isinstance(bodies, str) else bodies


def of(tree, scene, body):
    """Edges of a body node's body. Cuts it where that was not done before; refuses (core.Refused) what cannot be cut."""
    stamp = signature.signature(tree, scene)
    known = _known.get(tree.name_full)
    if known is None or not stamp or known[0] != stamp:
        known = _known[tree.name_full] = stamp, _cut(tree, scene)
        signature.signature(tree, scene)  # frames were set for that
    if body.graph_name not in known[1]:
        raise core.Refused("no solver has this body", body.graph_name)
    return known[1][body.graph_name]


def at_hand(tree, scene):
    """{graph name of a body: Edges} as far as they are known without work; None if something may have changed."""
    known = _known.get(tree.name_full)
    return known[1] if known and known[0] == signature.known(tree, scene) else None


def forget():
    """Another file is open."""
    _known.clear()


def selected(tree, name, edges):
    """(m,) bool: which edges of a body are selected."""
    chosen = np.zeros(len(edges.middle), bool)
    if (tree.edges_of, tree.edges_stamp) == (name, edges.stamp) and tree.selected_edges:
        chosen[np.fromiter(break_report.numbers(tree.selected_edges), int)] = True
    return chosen


def select(tree, name, edges, chosen):
    """Makes these the selected ones, and of no other body."""
    tree.edges_of, tree.edges_stamp = name, edges.stamp
    tree.selected_edges = break_report.as_text(np.flatnonzero(chosen).tolist())
