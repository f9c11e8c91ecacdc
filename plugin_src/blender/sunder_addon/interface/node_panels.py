"""The active node in the sidebar of its editor: a panel with what the node shows at once, and one below it for each group.

Panels are classes of the groups' labels, because Blender until 4.0 knows no others.
"""
import bpy

from ..base import descriptions, drawing
from ..tree import parameters, trees
from . import node_buttons


class _Sidebar:
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Sunder"


def _active(context):
    """The active node, if it is one of ours."""
    node = context.active_node if trees.is_tree(context.space_data.edit_tree) else None
    return node if node is not None and trees.is_node(node) else None


def _width(context):
    """Points of a node as wide as the sidebar."""
    return drawing.sidebar_width(context) + drawing.EDGES


class SUNDER_PT_node(_Sidebar, bpy.types.Panel):
    bl_idname = "SUNDER_PT_node"
    bl_label = "Node"
    bl_order = 1

    @classmethod
    def poll(cls, context):
        return _active(context) is not None

    @drawing.guarded
    def draw(self, context):
        node = _active(context)
        self.layout.label(text=node.label or node.name, icon="NODE")
        node_buttons.draw_main(self.layout, node, _width(context))


def _make(label):
    def poll(_cls, context):
        node = _active(context)
        return node is not None and label in node_buttons.groups(node)

    @drawing.guarded
    def draw(self, context):
        node_buttons.draw_group(self.layout, _active(context), label, _width(context))

    name = "SUNDER_PT_node_" + parameters.fold(label)
    members = {"bl_idname": name, "bl_label": label, "bl_parent_id": SUNDER_PT_node.bl_idname, "bl_options": {"DEFAULT_CLOSED"},
               "poll": classmethod(poll), "draw": draw}
    return type(name, (_Sidebar, bpy.types.Panel), members)


classes = [SUNDER_PT_node, *map(_make, descriptions.group_labels())]
