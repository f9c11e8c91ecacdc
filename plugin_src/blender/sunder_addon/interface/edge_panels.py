"""Edges of a body in the sidebars of node editors and 3D views: which are selected, and what can be made of them."""
import bpy

from ..base import drawing
from ..tree import trees, verbs
from ..bake import edges


def _draw(layout, tree, context):
    known = edges.at_hand(tree, context.scene)
    is_shown = tree.shows_edges and known is not None
    show = layout.operator("sunder.show_edges", text="Hide Edges" if is_shown else "Show Edges", icon="HIDE_OFF" if is_shown else "HIDE_ON",
                           depress=is_shown)
    show.tree = tree.name_full
    if tree.shows_edges and known is None:
        drawing.sentence(layout, "the tree has changed: show them again", "INFO")
    found = known.get(tree.edges_of) if known else None
    if found is not None:
        chosen = edges.selected(tree, tree.edges_of, found).sum()
        layout.label(text=f"{trees.spoken(tree, tree.edges_of)}: {chosen} of {len(found.pairs)} selected")
    column = layout.column(align=True)
    row = column.row(align=True)
    for by, label in (("ALL", "All"), ("NONE", "None"), ("INVERT", "Invert")):
        _operator(row, "sunder.select_edges", tree, text=label, by=by)
    row = column.row(align=True)
    _operator(row, "sunder.box_select_edges", tree, text="Box", icon="SELECT_SET")
    row.operator_menu_enum("sunder.select_edges", "by", text="By")
    column = layout.column(align=True)
    _operator(column, "sunder.set_edge_strength", tree)
    row = column.row(align=True)
    _operator(row, "sunder.glue_edges", tree)
    _operator(row, "sunder.break_edges", tree)
    row = column.row(align=True)
    _operator(row, "sunder.paint_edges", tree, text="Paint", icon="BRUSH_DATA")
    _operator(row, "sunder.free_edges", tree)


def _operator(layout, name, tree, by=None, **how):
    made = layout.operator(name, **how)
    made.tree = tree.name_full
    if by:
        made.by = by


def _make(space, name):
    """A sidebar's panel."""

    def poll(_cls, context):
        tree = verbs.tree_of(context, "")
        return (space == "VIEW_3D" or trees.is_tree(context.space_data.edit_tree)) and tree is not None and tree.library is None

    @drawing.guarded
    def draw(self, context):
        _draw(self.layout, verbs.tree_of(context, ""), context)

    members = {"bl_space_type": space, "bl_region_type": "UI", "bl_category": "Sunder", "bl_options": {"DEFAULT_CLOSED"},
               "bl_idname": f"SUNDER_PT_edges_{name}", "bl_label": "Edges", "bl_order": 3, "poll": classmethod(poll), "draw": draw}
    return type(members["bl_idname"], (bpy.types.Panel,), members)


classes = [_make("NODE_EDITOR", "nodes"), _make("VIEW_3D", "view")]
