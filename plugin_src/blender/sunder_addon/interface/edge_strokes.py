"""Operators that take what the mouse draws in a viewport: a box that selects edges, a stroke that paints edits of them."""
import bpy
import numpy as np
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, IntVectorProperty
from bpy_extras import view3d_utils
from mathutils import Vector

from ..base import core
from ..tree import edits, parameters, trees, verbs
from ..bake import edges
from ..scene import scene_input
from ..preview import edge_overlay
from . import edge_operators

_STEP = 0.25  # between points of a stroke, of its radius
_KINDS = [
    ("STRENGTH", "Strength", "Multiplies their toughness"),
    ("GLUE", "Glue", "They never break"),
    ("BREAK", "Break", "They break at a frame"),
    ("SELECT", "Select", "Selects them, too, and changes nothing"),
    ("FREE", "Clear", "Takes them out of all edits"),
]


def in_rectangle(points, matrix, size, low, high):
    """(m,) bool: which points (m, 3) lie in a rectangle of pixels. matrix: from the scene to clip coordinates; size: of the region."""
    clip = np.column_stack([points, np.ones(len(points))]) @ np.array(matrix).T
    with np.errstate(divide="ignore", invalid="ignore"):
        pixel = (clip[:, :2] / clip[:, 3:] + 1) / 2 * np.array(size)
    return (clip[:, 3] > 0) & (pixel >= low).all(1) & (pixel <= high).all(1)


class _Drag:
    """What begins with the left button and ends when it is let go."""

    @classmethod
    def poll(cls, context):
        return edge_operators.OnEdges.poll.__func__(cls, context)

    @verbs.told
    def invoke(self, context, _event):
        if context.area is None or context.area.type != "VIEW_3D":
            raise core.Refused("draw it in a 3D view, or give it in numbers")
        self._target, self._is_down = self.target(context), False
        context.window.cursor_modal_set("CROSSHAIR")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    @verbs.told
    def modal(self, context, event):
        if event.type in ("ESC", "RIGHTMOUSE"):
            self._leave(context)
            return {"CANCELLED"}
        at = event.mouse_region_x, event.mouse_region_y
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            self._is_down = True
            self.begin(context, at)
        elif event.type == "MOUSEMOVE" and self._is_down:
            self.move(context, at)
            context.area.tag_redraw()
        elif event.type == "LEFTMOUSE" and event.value == "RELEASE" and self._is_down:
            self.move(context, at)
            self._leave(context)
            return self.execute(context)
        elif not self._is_down:
            return {"PASS_THROUGH"}  # the view may be turned
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Blender quits or opens another file."""
        self._leave(context)

    def _leave(self, context):
        edge_overlay.stroke.clear()
        context.window.cursor_modal_restore()
        context.area.tag_redraw()


class SUNDER_OT_box_select_edges(_Drag, edge_operators.OnEdges, bpy.types.Operator):
    """Select edges by a box drawn in a 3D view: those whose interface has its middle in it, hidden or not"""

    bl_idname = "sunder.box_select_edges"
    bl_label = "Box Select Edges"
    bl_options = {"REGISTER", "UNDO"}

    action: EnumProperty(name="Action", items=edge_operators.ACTIONS, default="SET")
    first: IntVectorProperty(name="First Corner", size=2, description="Pixels of the view", options={"SKIP_SAVE"})
    last: IntVectorProperty(name="Last Corner", size=2, description="Pixels of the view", options={"SKIP_SAVE"})

    def begin(self, _context, at):
        self.first = self.last = at

    def move(self, context, at):
        self.last = at
        corners = [self.first, (self.last[0], self.first[1]), self.last, (self.first[0], self.last[1]), self.first]
        region, view, depth = context.region, context.region_data, self._target[2].center.mean(0)
        edge_overlay.stroke[:] = [view3d_utils.region_2d_to_location_3d(region, view, c, Vector(depth))[:] for c in corners]

    @verbs.told
    def execute(self, context):
        region, view = context.region, context.region_data
        if view is None:
            raise core.Refused("a box in pixels needs a 3D view: take Select Edges by box for one in the scene")
        target = self.target(context)
        low, high = np.minimum(self.first, self.last), np.maximum(self.first, self.last)
        wanted = in_rectangle(target[2].middle, view.perspective_matrix, (region.width, region.height), low, high)
        self.select(target, wanted, self.action)
        edge_operators.changed(context, *target[:2])
        return {"FINISHED"}


class SunderStrokePoint(bpy.types.PropertyGroup):
    """A point of a stroke."""

    location: FloatVectorProperty(subtype="XYZ", unit="LENGTH", description="In the scene, as the body stands at the first frame")


class SUNDER_OT_paint_edges(_Drag, edge_operators.OnEdges, bpy.types.Operator):
    """Paint edges of a body: make those near a stroke weaker or tougher, glue them, or break them at a frame"""

    bl_idname = "sunder.paint_edges"
    bl_label = "Paint Edges"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Paint", items=_KINDS, default="STRENGTH")
    radius: FloatProperty(name="Radius", unit="LENGTH", min=0, description="How far the stroke reaches; 0: as far as fragments are apart")
    toughness: FloatProperty(name="Toughness", description="Factor on the body's", min=edge_operators.LEAST, max=edge_operators.MOST,
                             default=0.2)
    frame: IntProperty(name="Frame", description="At which they are broken", default=1)
    frames: IntProperty(name="Over", description="Frames that it takes from there on; 0: at once", min=0, max=100000)
    stroke: CollectionProperty(type=SunderStrokePoint, options={"SKIP_SAVE", "HIDDEN"})

    def draw(self, _context):
        column = self.layout.column()
        column.use_property_split = True
        for name in ("kind", "radius", *{"STRENGTH": ("toughness",), "BREAK": ("frame", "frames")}.get(self.kind, ())):
            column.prop(self, name)

    def _reach(self, found):
        return parameters.decimal(float(f"{self.radius or found.spacing:.4g}"))

    def begin(self, context, at):
        tree, body, *_ = self._target
        if context.scene.frame_current != tree.frames(context.scene)[0]:
            raise core.Refused("go to the first frame: a stroke lies where the body stands then")
        self.stroke.clear()
        source = scene_input.placed_by(body)
        shown = [o for o in [source, *trees.result_objects(tree)] if o is not None and o.type == "MESH" and o.visible_get()]
        self._surfaces = [o.evaluated_get(context.evaluated_depsgraph_get()) for o in shown]
        self.move(context, at)

    def move(self, context, at):
        origin = view3d_utils.region_2d_to_origin_3d(context.region, context.region_data, at)
        way = view3d_utils.region_2d_to_vector_3d(context.region, context.region_data, at)
        hits = []
        for thing in self._surfaces:
            back = thing.matrix_world.inverted_safe()
            is_hit, place, _, _ = thing.ray_cast(back @ origin, (back.to_3x3() @ way).normalized())
            if is_hit:
                hits.append(thing.matrix_world @ place)
        if not hits:
            return
        point = min(hits, key=lambda p: (p - origin).length)
        far_enough = _STEP * self._reach(self._target[2])
        if not len(self.stroke) or (Vector(self.stroke[-1].location) - point).length >= far_enough:
            self.stroke.add().location = point
        edge_overlay.stroke[:] = [p.location[:] for p in self.stroke]

    @verbs.told
    def execute(self, context):
        tree, body, found, chosen = self.target(context)
        points = np.array([p.location[:] for p in self.stroke], float).reshape(-1, 3)
        if not len(points):
            raise core.Refused("the stroke has no point on the body")
        if not np.isfinite(points).all():
            raise core.Refused("the stroke has a point that is none: its numbers are not finite")
        reach, points = self._reach(found), found.to_own(points)
        near = edits.within(found.own_middle, points, reach)
        if not near.any():
            raise core.Refused(f"no interface of the body lies nearer than {reach:g} m to the stroke")
        if self.kind == "SELECT":
            self.select((tree, body, found, chosen), near, "ADD")
        elif self.kind == "FREE" or self.kind == "STRENGTH" and self.toughness == 1:
            edits.release(body, found.own_middle, near, ("scale", "hold", "break") if self.kind == "FREE" else ("scale",))
        else:
            settings = edge_operators.settings_of(self.kind, self.toughness, self.frame, self.frames)
            edits.paint(body, settings, reach, found.own_middle, points)
        edge_operators.changed(context, tree, body)
        self.report({"INFO"}, f"Sunder: {near.sum()} edges lie under the stroke")
        return {"FINISHED"}


classes = [SUNDER_OT_box_select_edges, SunderStrokePoint, SUNDER_OT_paint_edges]
