"""What broke and why, in the sidebars of node editors and 3D views."""
import bpy

from ..base import drawing
from ..tree import trees, verbs
from ..bake import break_report
from . import report

_ROWS = 8  # of a list
_ROOM = 230  # points that five columns take
_FRAME, _SMALL, _WIDE = 0.16, 0.22, 0.28  # shares of a list's width: of frames beside much, other numbers, fragments
_LOADS = (_WIDE, _SMALL, _SMALL)


def _columns(layout, shares):
    """A row of places to write into; the last takes what is left."""
    places, rest = [], 1.0
    for share in shares:
        split = layout.split(factor=share / rest, align=True)
        places.append(split.row(align=True))
        layout, rest = split.row(align=True), rest - share
    return [*places, layout]


def _draw_cells(layout, texts, shares):
    for place, text in zip(_columns(layout, shares), texts):
        place.label(text=text)


def _of_breaks(width, frame, edges, strain, toughness, by):
    """(Cells, their shares) of a row of what broke; a sidebar as wide as at first has no room for strains."""
    if width < _ROOM:
        return (frame, edges, by), (_SMALL, _SMALL)
    return (frame, edges, strain, toughness, by), (_FRAME, _FRAME, _SMALL, _SMALL)


class SUNDER_UL_breaks(bpy.types.UIList):
    """What broke: a row for what one thing broke of one body in one frame."""

    bl_idname = "SUNDER_UL_breaks"

    def draw_item(self, context, layout, _data, item, _icon, _lists, _at):
        _draw_cells(layout, *_of_breaks(drawing.sidebar_width(context), str(item.frame), str(item.edges), f"{item.strain:.2g}",
                                        f"{item.toughness:.2g}", item.by))


class SUNDER_UL_loads(bpy.types.UIList):
    """What fragments bore: a row for each."""

    bl_idname = "SUNDER_UL_loads"

    def draw_item(self, _context, layout, _data, item, _icon, _lists, _at):
        _draw_cells(layout, (item.fragments, f"{100 * item.share:.3g}%", "broke" if item.is_broken else "held",
                             str(item.frame) if item.share > 0 else ""), _LOADS)


def _draw_list(layout, width, names, titles, shares):
    """A list below its titles, and the sentence of the row that is picked. names: of the rows, of the picked row's number."""
    lists = report.lists()
    rows, at = getattr(lists, names[0]), getattr(lists, names[1])
    _draw_cells(layout.row(align=True), titles, shares)
    layout.template_list("SUNDER_UL_" + names[0], "", lists, names[0], lists, names[1], rows=min(_ROWS, max(2, len(rows))))
    if 0 <= at < len(rows):
        drawing.sentence(layout, rows[at].sentence, "INFO", width=width)


def _draw_breaks(layout, tree, width):
    lists = report.lists()
    lack = break_report.lack(tree)
    if lack:
        drawing.sentence(layout, lack, "INFO", width=width)
        return
    is_read = lists.tree == tree.name_full and lists.stamp != ""
    layout.operator("sunder.report", text="Read Again" if is_read else "Read What Broke", icon="VIEWZOOM").tree = tree.name_full
    if not is_read:
        return
    if lists.stamp != break_report.stamp(tree):
        drawing.sentence(layout, "the bake has changed since", "ERROR", width=width)
    for sentence in filter(None, (lists.summary, lists.note)):
        drawing.sentence(layout, sentence, "INFO", width=width)
    if lists.breaks:
        titles, shares = _of_breaks(width, "Frame", "Edges", "Strain", "Tough.", "By")
        _draw_list(layout, width, ("breaks", "at_break"), titles, shares)


def _draw_loads(layout, tree, width):
    lists = report.lists()
    ask = layout.operator("sunder.ask_fragments", text="Ask for Selected Faces", icon="FACESEL")
    ask.tree = tree.name_full
    row = layout.row(align=True)
    row.prop(lists, "asked", text="")
    named = row.row(align=True)
    named.enabled = bool(lists.asked.strip())
    ask = named.operator("sunder.ask_fragments", text="Ask", icon="VIEWZOOM")
    ask.tree, ask.fragments = tree.name_full, lists.asked
    if lists.tree == tree.name_full and lists.loads:
        _draw_list(layout, width, ("loads", "at_load"), ("Fragment", "Load", "", "Frame"), _LOADS)


def _make(space, name):
    """A sidebar's panel and the one below it."""
    place = {"bl_space_type": space, "bl_region_type": "UI", "bl_category": "Sunder", "bl_options": {"DEFAULT_CLOSED"}}

    def poll(_cls, context):
        return (space == "VIEW_3D" or trees.is_tree(context.space_data.edit_tree)) and verbs.tree_of(context, "") is not None

    def poll_below(_cls, context):
        tree = verbs.tree_of(context, "")
        return tree is not None and not break_report.lack(tree)

    @drawing.guarded
    def draw(self, context):
        _draw_breaks(self.layout, verbs.tree_of(context, ""), drawing.sidebar_width(context))

    @drawing.guarded
    def draw_below(self, context):
        _draw_loads(self.layout, verbs.tree_of(context, ""), drawing.sidebar_width(context))

    broke = {**place, "bl_idname": f"SUNDER_PT_broke_{name}", "bl_label": "What Broke", "bl_order": 2, "poll": classmethod(poll),
             "draw": draw}
    held = {**place, "bl_idname": f"SUNDER_PT_held_{name}", "bl_label": "Why Did It Not Break", "bl_parent_id": broke["bl_idname"],
            "poll": classmethod(poll_below), "draw": draw_below}
    return [type(members["bl_idname"], (bpy.types.Panel,), members) for members in (broke, held)]


classes = [SUNDER_UL_breaks, SUNDER_UL_loads, *_make("NODE_EDITOR", "nodes"), *_make("VIEW_3D", "view")]
