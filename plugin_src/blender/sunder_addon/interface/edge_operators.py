"""Operators on a body's edges: which are selected, and what becomes of them. Edits are kept by place (tree/edits.py)."""
import math

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ..base import core, runtime
from ..tree import edits, parameters, verbs
from ..bake import edges

_REACH = 0.75  # of an edit by the middles of interfaces, in spacings of fragments: what it spares bounds it before that
LEAST, MOST = 1e-3, 1e3  # factors that a seam takes
_BY = [
    ("ALL", "All", "Every edge"),
    ("NONE", "None", "No edge"),
    ("INVERT", "Invert", "Those that are not selected"),
    ("BOX", "Box", "Those whose interface has its middle in a box, in the scene as the body stands at the first frame"),
    ("CLUSTERS", "Between Clusters", "Those between fragments of different clusters"),
    ("CLUSTER", "In a Cluster", "Those between two fragments of a cluster"),
    ("ANGLE", "Angle", "Those whose interface has its normal along a direction, or nearly so"),
    ("AREA", "Area", "Those whose interface is small, or large, for its fragments"),
]
ACTIONS = [("SET", "Set", "Selects these alone"), ("ADD", "Add", "Selects these, too"),
            ("REMOVE", "Remove", "Selects these no more"), ("FILTER", "Keep", "Of what is selected keeps these")]
_PROPERTIES = {"BOX": ("box_min", "box_max"), "CLUSTER": ("cluster",), "ANGLE": ("direction", "angle"),
               "AREA": ("least_area", "most_area")}


class OnEdges(verbs.OnTree):
    body: StringProperty(name="Body", options={"SKIP_SAVE"},
                         description="Its name in the graph; empty: the active object's, or the only one")

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to object mode first")
        return context.mode == "OBJECT"

    def target(self, context):
        """(tree, body node, its Edges, which are selected); refuses (core.Refused) where there are none."""
        tree = verbs.tree_of(context, self.tree)
        if tree is None:
            raise core.Refused(f"there is no Sunder tree '{self.tree}'" if self.tree else "pick a Sunder tree")
        if tree.library is not None:
            raise core.Refused("this tree is linked from another file: edit it there")
        name = self.body or (tree.edges_of if context.object is None else "")
        body = edges.body_of(context, tree, name)
        found = edges.of(tree, context.scene, body)
        return tree, body, found, edges.selected(tree, body.graph_name, found)

    def select(self, target, wanted, action):
        """Makes (m,) bool the selection, or changes it by them; tells how many there are."""
        tree, body, found, chosen = target
        chosen = {"SET": wanted, "ADD": chosen | wanted, "REMOVE": chosen & ~wanted, "FILTER": chosen & wanted}[action]
        edges.select(tree, body.graph_name, found, chosen)
        self.report({"INFO"}, f"Sunder: {chosen.sum()} of {len(chosen)} edges selected")


def settings_of(kind, toughness=1.0, frame=1, frames=0):
    """What a seam node gets for an edit of a kind."""
    if kind == "STRENGTH":
        return {"mode": "scale", "toughness": parameters.decimal(toughness)}
    return {"mode": "hold", "frame": None} if kind == "GLUE" else {"mode": "break", "frame": frame, "frames": frames}


def changed(context, tree, body):
    """To be called after an edit: what is drawn follows."""
    runtime.signatures.pop(tree.name_full, None)
    if tree.shows_edges:
        edges.of(tree, context.scene, body)
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()


class SUNDER_OT_select_edges(OnEdges, bpy.types.Operator):
    """Select edges of a body by where they are, by clusters, by how their interfaces lie, or by their area"""

    bl_idname = "sunder.select_edges"
    bl_label = "Select Edges"
    bl_options = {"REGISTER", "UNDO"}

    by: EnumProperty(name="By", items=_BY, default="ALL")
    action: EnumProperty(name="Action", items=ACTIONS, default="SET")
    box_min: FloatVectorProperty(name="Box Min", subtype="XYZ", unit="LENGTH", default=(-1, -1, -1))
    box_max: FloatVectorProperty(name="Box Max", subtype="XYZ", unit="LENGTH", default=(1, 1, 1))
    cluster: IntProperty(name="Cluster", min=0)
    direction: FloatVectorProperty(name="Direction", subtype="XYZ", default=(0, 0, 1))
    angle: FloatProperty(name="Angle", description="At most so far from the direction", subtype="ANGLE", min=0, max=math.pi / 2,
                         default=math.radians(30))
    least_area: FloatProperty(name="Least Area", description="As a share of its fragments' cross-section", min=0, default=0)
    most_area: FloatProperty(name="Most Area", description="Likewise", min=0, default=0.3)

    def draw(self, _context):
        column = self.layout.column()
        column.use_property_split = True
        for name in ("by", "action", *_PROPERTIES.get(self.by, ())):
            column.prop(self, name)

    def _wanted(self, found, chosen):
        everything = np.ones(len(chosen), bool)
        if self.by == "BOX":
            low, high = np.array(self.box_min), np.array(self.box_max)
            return ((found.middle >= low) & (found.middle <= high)).all(1)
        if self.by == "ANGLE":
            along = np.array(self.direction)
            if not along.any():
                raise core.Refused("the direction has no length")
            return np.abs(found.normal @ (along / np.linalg.norm(along))) >= math.cos(self.angle) - 1e-6
        if self.by == "AREA":
            return (found.share >= self.least_area) & (found.share <= self.most_area)
        if self.by in ("CLUSTERS", "CLUSTER"):
            first, second = found.cluster[found.pairs].T
            return first != second if self.by == "CLUSTERS" else (first == self.cluster) & (second == self.cluster)
        return {"ALL": everything, "NONE": ~everything, "INVERT": ~chosen}[self.by]

    @verbs.told
    def execute(self, context):
        target = self.target(context)
        self.select(target, self._wanted(*target[2:]), self.action)
        changed(context, *target[:2])
        return {"FINISHED"}


class _Edit(OnEdges):
    bl_options = {"REGISTER", "UNDO"}

    distance: FloatProperty(name="Distance", unit="LENGTH", min=0, options={"SKIP_SAVE"},
                            description="How far the edit reaches from the middles of these interfaces in other cuts; 0: three "
                            "quarters of what fragments are apart")

    @verbs.told
    def execute(self, context):
        tree, body, found, chosen = self.target(context)
        if not chosen.any():
            raise core.Refused("select edges first: those of an earlier cut are not selected in this one")
        done = self.edit(body, found, chosen)
        changed(context, tree, body)
        self.report({"INFO"}, f"Sunder: {done}")
        return {"FINISHED"}

    def put(self, body, found, chosen, settings):
        reach = parameters.decimal(float(f"{self.distance or _REACH * found.spacing:.4g}"))
        edits.put(body, settings, reach, found.own_middle, chosen)


class SUNDER_OT_set_edge_strength(_Edit, bpy.types.Operator):
    """Multiply the toughness of the selected edges, in place of what was set there before"""

    bl_idname = "sunder.set_edge_strength"
    bl_label = "Set Strength"

    toughness: FloatProperty(name="Toughness", description="Factor on the body's; 1: as it was", min=LEAST, max=MOST, default=0.2)

    def edit(self, body, found, chosen):
        if self.toughness == 1:
            return f"{edits.release(body, found.own_middle, chosen, ('scale',))} edges have the body's toughness again"
        self.put(body, found, chosen, settings_of("STRENGTH", self.toughness))
        return f"{chosen.sum()} edges bear {self.toughness:.3g} times as much"


class SUNDER_OT_glue_edges(_Edit, bpy.types.Operator):
    """Glue the selected edges: they never break"""

    bl_idname = "sunder.glue_edges"
    bl_label = "Glue"

    def edit(self, body, found, chosen):
        self.put(body, found, chosen, settings_of("GLUE"))
        return f"{chosen.sum()} edges never break"


class SUNDER_OT_break_edges(_Edit, bpy.types.Operator):
    """Break the selected edges at a frame, or weaken them from there on"""

    bl_idname = "sunder.break_edges"
    bl_label = "Break at Frame"

    frame: IntProperty(name="Frame", description="At which they are broken", default=1, options={"SKIP_SAVE"})
    frames: IntProperty(name="Over", description="Frames that it takes from there on; 0: at once", min=0, max=100000)

    @verbs.told
    def invoke(self, context, _event):
        if not self.properties.is_property_set("frame"):
            self.frame = context.scene.frame_current
        return self.execute(context)

    def edit(self, body, found, chosen):
        self.put(body, found, chosen, settings_of("BREAK", frame=self.frame, frames=self.frames))
        return f"{chosen.sum()} edges break at frame {self.frame}"


class SUNDER_OT_free_edges(_Edit, bpy.types.Operator):
    """Take the selected edges out of all edits"""

    bl_idname = "sunder.free_edges"
    bl_label = "Clear Edits"

    def edit(self, body, found, chosen):
        return f"{edits.release(body, found.own_middle, chosen)} edges are as if nothing was set there"


class SUNDER_OT_show_edges(OnEdges, bpy.types.Operator):
    """Show the edges of a body as the tree stands, or hide them"""

    bl_idname = "sunder.show_edges"
    bl_label = "Show Edges"
    bl_options = {"REGISTER", "UNDO"}

    action: EnumProperty(name="Action", items=[("TOGGLE", "Toggle", ""), ("SHOW", "Show", ""), ("HIDE", "Hide", "")], default="TOGGLE",
                         options={"SKIP_SAVE"})

    @verbs.told
    def execute(self, context):
        tree = verbs.tree_of(context, self.tree)
        is_current = tree is not None and edges.at_hand(tree, context.scene) is not None
        if tree is not None and (self.action == "HIDE" or self.action == "TOGGLE" and tree.shows_edges and is_current):
            tree.shows_edges = False
            return {"FINISHED"}
        tree, body, found, chosen = self.target(context)
        edges.select(tree, body.graph_name, found, chosen)
        tree.shows_edges = True
        changed(context, tree, body)
        return {"FINISHED"}


classes = [SUNDER_OT_select_edges, SUNDER_OT_set_edge_strength, SUNDER_OT_glue_edges, SUNDER_OT_break_edges, SUNDER_OT_free_edges,
           SUNDER_OT_show_edges]
