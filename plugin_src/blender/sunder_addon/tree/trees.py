"""The node tree: identity of its cache, settings of a bake, who plays it; wires that do not fit are taken out again."""
import re
import uuid

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ..base import descriptions, runtime
from . import sockets


def is_tree(tree):
    return tree is not None and tree.bl_idname == SunderTree.bl_idname


def trees():
    return [t for t in bpy.data.node_groups if is_tree(t)]


def is_node(node):
    return getattr(node, "sunder_type", "") in descriptions.NODES


def identity(tree):
    """The name of the tree's folder below the cache: made once, kept when the tree is renamed."""
    if not tree.cache_id and tree.library is None:
        renew_identity(tree)
        tree.use_fake_user = True  # a tree that no object shows is worth saving too
    return tree.cache_id


def renew_identity(tree):
    tree.cache_id = f"{re.sub('[^A-Za-z0-9_-]+', '_', tree.name)}-{uuid.uuid4().hex[:8]}"


def source_of(link):
    """The output socket that a link comes from, through reroutes; None behind a reroute that hangs in the air."""
    seen = set()
    while link.from_node.bl_idname == "NodeReroute":
        if link.from_node.name in seen:
            return None
        seen.add(link.from_node.name)
        before = link.from_node.inputs[0].links
        if not before:
            return None
        link = before[0]
    return link.from_socket


def find_node(tree, graph_name):
    """The node that has a name in the graph; pieces of a node that stands for several objects are NAME:2, NAME:3."""
    name = graph_name.split(":")[0]
    return next((n for n in tree.nodes if is_node(n) and n.graph_name == name), None)


def spoken(tree, graph_name):
    """What artists call a node that has a name in the graph: NAME:2 is what a node stands for second."""
    node, number = find_node(tree, graph_name), graph_name.partition(":")[2]
    return graph_name if node is None else (node.label or node.name) + (f" {number}" if number else "")


def result_objects(tree=None):
    """The objects that play a tree's bake; of all trees for none."""
    return [o for o in bpy.data.objects if is_tree(o.sunder.tree) and o.sunder.tree == (tree or o.sunder.tree)]


def insides(thing):
    """The objects that show the break surfaces which an object leaves out."""
    return [o for o in result_objects(thing.sunder.tree)
            if (o.sunder.node, o.sunder.part) == (thing.sunder.node, "INSIDE")]


def _changed(self, _context):
    runtime.signatures.pop(self.name_full, None)


class SunderTree(bpy.types.NodeTree):
    """Ductile fracture: cut a mesh, give it a material, simulate, and play the bake on a result object"""

    bl_idname = "SunderTree"
    bl_label = "Sunder"
    bl_icon = "MOD_EXPLODE"
    bl_use_group_interface = False  # from Blender 4.1 on: hides what only node groups have

    cache_id: StringProperty(name="Cache", description="Name of this tree's folder below the cache", options={"HIDDEN"})
    preset: StringProperty(options={"HIDDEN"}, description="What Quick Fracture made it of: how results look at first")
    former_home: StringProperty(
        name="Former Cache", description="Where the bake lay when the file was saved last; used while there is none beside it",
        subtype="DIR_PATH", options={"HIDDEN"},
    )
    use_scene_range: BoolProperty(
        name="Scene Range", description="Simulate and bake the scene's frame range", default=True, options=set(),
        update=_changed,
    )
    frame_start: IntProperty(
        name="Start", description="First frame: bodies are as placed", default=1, min=-1000000, max=1000000,
        options=set(), update=_changed,
    )
    frame_end: IntProperty(
        name="End", description="Last frame", default=96, min=-1000000, max=1000000, options=set(), update=_changed
    )
    subframes: IntProperty(
        name="Sub-Frames", description="Steps from one frame to the next that are baked, for motion blur and between frames; 1: "
        "whole frames alone. Results play them where the deformer's topology is constant", default=1, min=1, max=64, options=set(),
        update=_changed,
    )
    threads: IntProperty(
        name="Threads", description="Threads that simulate; 0: all cores. Changes no result", min=0, max=1024,
        options=set(),
    )

    shows_edges: BoolProperty(
        name="Show Edges", options=set(),
        description="Viewports show the edges of the body that was selected of last, as placed at the first frame: selected ones "
        "bright, others by their toughness",
    )
    edges_of: StringProperty(options={"HIDDEN"}, description="Graph name of the body of which edges are selected")
    edges_stamp: StringProperty(options={"HIDDEN"}, description="Of the cut in which they are selected")
    selected_edges: StringProperty(options={"HIDDEN"}, description="Numbers and ranges as 3, 7-9")

    def frames(self, scene):
        """First and last frame of the bake."""
        if self.use_scene_range:
            return scene.frame_start, scene.frame_end
        return self.frame_start, max(self.frame_start, self.frame_end)

    def update(self):
        """Called by Blender on every edit of nodes and wires, also while they are half made, or their classes are. (What is
        not looked at then is looked at when all is there: handlers.py.)"""
        if not runtime.is_registered:
            return
        runtime.signatures.pop(self.name_full, None)
        for link in list(self.links):
            source, target = source_of(link), link.to_socket
            if source is not None and is_node(link.to_node) and source.bl_idname != target.bl_idname:
                self._refuse(link, source, target)
        runtime.wires[self.name_full] = {
            (link.to_node.name, link.to_socket.identifier): (link.from_node.name, link.from_socket.identifier)
            for link in self.links
        }

    def _refuse(self, link, source, target):
        """Takes a wire out and puts back the one that it has pushed out of a socket for one."""
        node = link.to_node
        runtime.node_errors[self.name_full, node.graph_name] = (
            f"{target.name} takes a {sockets.spoken(target.bl_idname)}, not the "
            f"{sockets.spoken(source.bl_idname)} of '{source.node.name}'"
        )
        before = runtime.wires.get(self.name_full, {}).get((node.name, target.identifier))
        wrong = (link.from_node.name, link.from_socket.identifier)
        self.links.remove(link)
        if before is None or before == wrong or any(l.to_socket == target for l in self.links):
            return
        old = self.nodes.get(before[0])
        output = next((s for s in old.outputs if s.identifier == before[1]), None) if old else None
        if output is not None:
            self.links.new(output, target)


classes = [SunderTree]
