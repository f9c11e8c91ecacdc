"""What broke and why, as lists that Blender shows: read from a tree's bake when asked for, gone to by their rows.

The lists belong to Blender's window and not to the file: no undo changes them. What they are of is told by `stamp`.
"""
import bpy
from bpy.props import BoolProperty, CollectionProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..base import core, runtime
from ..tree import trees, verbs
from ..bake import break_report
from ..results import fragment_faces, player

_MOST_LOADS = 500  # rows of fragments, those nearest to breaking
_NAMED = 20  # fragments that a sentence names; of more it tells how many


def _picked_break(self, context):
    if 0 <= self.at_break < len(self.breaks):
        _go_to(context, self, self.breaks[self.at_break], True)


def _picked_load(self, context):
    if 0 <= self.at_load < len(self.loads):
        _go_to(context, self, self.loads[self.at_load], self.loads[self.at_load].share > 0)


class SunderBreakRow(bpy.types.PropertyGroup):
    """What one thing broke of one body in one frame."""

    frame: IntProperty()
    body: StringProperty(description="By its name in the graph")
    edges: IntProperty()
    strain: FloatProperty()
    toughness: FloatProperty()
    by: StringProperty()
    fragments: StringProperty()
    sentence: StringProperty()


class SunderLoadRow(bpy.types.PropertyGroup):
    """What a fragment bore."""

    frame: IntProperty(description="At which it was nearest to breaking; without a share none")
    body: StringProperty(description="By its name in the graph")
    fragments: StringProperty(description="Its number")
    share: FloatProperty(description="Strain over toughness")
    is_broken: BoolProperty()
    sentence: StringProperty()


class SunderReport(bpy.types.PropertyGroup):
    """What was read of one tree's bake."""

    tree: StringProperty(description="Full name of the tree")
    stamp: StringProperty(description="Of the bake, when it was read")
    summary: StringProperty()
    note: StringProperty()
    breaks: CollectionProperty(type=SunderBreakRow)
    at_break: IntProperty(name="What Broke", description="Goes to the frame, and selects the fragments", update=_picked_break,
                          options={"SKIP_SAVE"})
    loads: CollectionProperty(type=SunderLoadRow)
    at_load: IntProperty(name="Fragment", description="Goes to the frame at which it was nearest to breaking, and selects it",
                         update=_picked_load, options={"SKIP_SAVE"})
    asked: StringProperty(name="Fragments", description="Numbers and ranges as 3, 7-9, or all", options={"SKIP_SAVE"})


def lists():
    return bpy.context.window_manager.sunder_report


def forget():
    """Another file is open."""
    for manager in bpy.data.window_managers:
        _clear(manager.sunder_report)


def _clear(told):
    for rows in (told.breaks, told.loads):
        rows.clear()
    told.at_break = told.at_load = -1
    told.tree = told.stamp = told.summary = told.note = ""


def read(tree):
    """Fills the list of what broke. Refuses (core.Refused) where that cannot be read; then the lists are empty."""
    told, stamp = lists(), break_report.stamp(tree)
    _clear(told)
    told.tree = tree.name_full
    found = break_report.read(tree)
    told.stamp, told.summary, told.note = stamp, break_report.summary(found), found["note"]
    for row in break_report.rows(found):
        shown = told.breaks.add()
        shown.frame, shown.body, shown.edges = row.frame, row.body, row.edges
        shown.strain, shown.toughness, shown.by = row.strain, row.toughness, trees.spoken(tree, row.by)
        shown.fragments = break_report.as_text(row.fragments)
        between = f"fragments {shown.fragments}" if len(row.fragments) <= _NAMED else f"{len(row.fragments)} fragments"
        shown.sentence = (f"{trees.spoken(tree, row.body)}, {row.time:.3f} s: {row.edges} edges, pushed by {shown.by}; strain "
                          f"{row.strain:.3g}, toughness {row.toughness:.3g}; {between}")


def ask(tree, choices):
    """Fills the list of what fragments bore, those nearest to breaking first; returns how many were found. choices: [(body or
    None, fragments or "all"), ...]. Refuses (core.Refused) where that cannot be read."""
    if (lists().tree, lists().stamp) != (tree.name_full, break_report.stamp(tree)):
        read(tree)
    told = lists()
    told.loads.clear()
    told.at_load = -1
    found = []
    for body, fragments in choices:
        found += break_report.read(tree, fragments, body)["fragments"]
    found.sort(key=lambda load: -load["share"])
    for load in found[:_MOST_LOADS]:
        shown = told.loads.add()
        shown.frame, shown.body, shown.fragments = load["frame"] or 0, load["body"], str(load["fragment"])
        shown.share, shown.is_broken = load["share"], load["broken_edges"] > 0
        when = f", at frame {load['frame']}" if load["frame"] is not None else ""
        shown.sentence = (f"{trees.spoken(tree, load['body'])} {load['fragment']} bore {100 * load['share']:.3g}% of its toughness"
                          f"{when}; {break_report.why(load)}")
    return len(found)


def refresh(context, tree):
    """A bake has ended: what is looked at is read again."""
    if lists().tree == tree.name_full and lists().stamp:
        try:
            read(tree)
        except core.Refused:
            pass  # the panel says why


@runtime.guarded
def _go_to(context, told, row, has_frame):
    """Shows the frame of a row, and selects its fragments on the objects that show its body and nothing on the tree's others. Where
    no object shows it, all stays selected as it is."""
    tree = next((t for t in trees.trees() if t.name_full == told.tree), None)
    if tree is None:
        return
    if has_frame:
        context.scene.frame_set(row.frame)
    bodies = {thing: break_report.body_of(thing) for thing in trees.result_objects(tree)}
    if row.body not in bodies.values():
        return
    player.show_all(context.scene, tree)
    context.tool_settings.mesh_select_mode = (False, False, True)  # by vertices, neighbours would be selected, too
    for thing, body in bodies.items():
        if body:
            fragment_faces.select(thing, break_report.numbers(row.fragments) if body == row.body else set())


class _OnBake(verbs.OnTree):
    @classmethod
    def poll(cls, _context):
        if any(break_report.stamp(tree) for tree in trees.trees()):
            return True
        known = trees.trees()
        why = break_report.lack(known[0]) if known else "there is no Sunder tree"
        cls.poll_message_set(why[0].upper() + why[1:])
        return False


class SUNDER_OT_report(_OnBake, bpy.types.Operator):
    """Read from the bake what broke, when and why"""

    bl_idname = "sunder.report"
    bl_label = "Read What Broke"

    @verbs.told
    def execute(self, context):
        tree = self.find(context)
        if tree is None:
            return {"CANCELLED"}
        read(tree)
        self.report({"INFO"}, f"Sunder: {lists().summary}")
        return {"FINISHED"}


class SUNDER_OT_ask_fragments(_OnBake, bpy.types.Operator):
    """Tell how close fragments came to breaking, and why they did not: those with selected faces, or those named"""

    bl_idname = "sunder.ask_fragments"
    bl_label = "Why Did It Not Break"

    fragments: StringProperty(name="Fragments", options={"SKIP_SAVE"},
                              description="Numbers and ranges as 3, 7-9, or all; empty: those with selected faces")
    body: StringProperty(name="Body", description="Its name in the graph; empty: every body, or that of the selected faces",
                         options={"SKIP_SAVE"})

    def _choices(self, context, tree):
        body = self.body or None
        if self.fragments.strip() == "all":
            return [(body, "all")]
        if self.fragments:
            return [(body, break_report.numbers(self.fragments))]
        chosen = {}
        for thing in {*context.selected_objects, *([context.object] if context.object else [])}:
            of = break_report.body_of(thing) if thing.sunder.tree == tree else ""
            if of and body in (None, of):
                chosen.setdefault(of, set()).update(fragment_faces.selected(thing))
        chosen = {of: fragments for of, fragments in chosen.items() if fragments}
        if not chosen:
            raise core.Refused("select faces of a result object in edit mode, or name fragments as 3, 7-9")
        return sorted(chosen.items())

    @verbs.told
    def execute(self, context):
        tree = self.find(context)
        if tree is None:
            return {"CANCELLED"}
        n = ask(tree, self._choices(context, tree))
        listed = f"; the {_MOST_LOADS} nearest to breaking are listed" if n > _MOST_LOADS else ""
        self.report({"INFO"}, f"Sunder: {n} fragments{listed}")
        return {"FINISHED"}


class SUNDER_OT_go_to_break(bpy.types.Operator):
    """Go to the frame of a row of what broke, and select its fragments"""

    bl_idname = "sunder.go_to_break"
    bl_label = "Go to What Broke"
    bl_options = {"REGISTER", "UNDO"}

    row: IntProperty(name="Row", description="From 0", min=0, options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, _context):
        if lists().breaks:
            return True
        cls.poll_message_set("Read what broke first" if not lists().stamp else "Nothing broke")
        return False

    @verbs.told
    def execute(self, context):
        told = lists()
        if self.row >= len(told.breaks):
            self.report({"ERROR"}, f"there are {len(told.breaks)} rows, from 0")
            return {"CANCELLED"}
        told.at_break = self.row  # which goes there
        return {"FINISHED"}


classes = [SunderBreakRow, SunderLoadRow, SunderReport, SUNDER_OT_report, SUNDER_OT_ask_fragments, SUNDER_OT_go_to_break]


def register():
    bpy.types.WindowManager.sunder_report = PointerProperty(type=SunderReport)


def unregister():
    del bpy.types.WindowManager.sunder_report
