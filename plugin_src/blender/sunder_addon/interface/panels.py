"""Where the add-on shows itself: sidebars, menus, the panel of a result object, preferences."""
import bpy

from ..base import blender_versions, core, drawing
from ..tree import trees, verbs
from ..results import parts
from ..exports import share
from . import bake_buttons, node_buttons


class SUNDER_PT_tree(bpy.types.Panel):
    bl_idname = "SUNDER_PT_tree"
    bl_label = "Bake"
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Sunder"

    @classmethod
    def poll(cls, context):
        return trees.is_tree(context.space_data.edit_tree)

    @drawing.guarded
    def draw(self, context):
        bake_buttons.draw_tree(self.layout, context.space_data.edit_tree, context.scene)


def _draw_played(box, thing):
    """What a result object plays, and how that goes. Returns the node."""
    tree = thing.sunder.tree
    node = trees.find_node(tree, thing.sunder.node)
    place = f" of {bpy.path.basename(tree.library.filepath)}" if tree.library else ""
    box.label(text=f"Plays: {node.label or node.name if node else 'a node that is gone'}{place}")
    if node is not None and node.note:
        drawing.sentence(box, node.note, "INFO")
    return node


class SUNDER_PT_object(bpy.types.Panel):
    bl_idname = "SUNDER_PT_object"
    bl_label = "Sunder"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Sunder"

    @drawing.guarded
    def draw(self, context):
        layout, thing = self.layout, context.object
        problem = core.problem()
        if problem:
            drawing.sentence(layout, problem, "ERROR", alert=True)
        layout.operator("sunder.quick_fracture", icon="MOD_EXPLODE")
        tree = verbs.tree_of(context, "")
        if tree is not None:
            box = layout.box()
            box.label(text=tree.name, icon="NODETREE")
            bake_buttons.draw_tree(box, tree, context.scene)
        if thing is None:
            return
        collection = thing.instance_collection if thing.instance_type == "COLLECTION" else None
        for shown in collection.all_objects if collection else ():
            if trees.is_tree(shown.sunder.tree):
                box = layout.box()
                box.label(text=shown.name, icon="MESH_DATA")
                _draw_played(box, shown)
                share.draw(box, shown.sunder.tree)
        if not thing.sunder.tree:
            return
        box = layout.box()
        box.label(text="Result Object", icon="MESH_DATA")
        box.prop(thing.sunder, "tree")
        node = _draw_played(box, thing)
        share.draw(box, thing.sunder.tree)
        if thing.type == "MESH" and node is not None and node.sunder_type == "deformer":
            bake_buttons.draw_preview(box, thing)
            if thing.sunder.part != "INSIDE":
                box.prop(thing.sunder, "interior_slot")
            box.prop(thing.sunder, "use_exact_normals")
            if thing.sunder.use_exact_normals and not blender_versions.HAS_QUICK_NORMALS:
                drawing.sentence(box, "Until Blender 4.4 these take most of a frame's time: off, frames come faster", "INFO")
            if parts.can_split(thing):
                drawing.sentence(box, "Alembic and USD lose the material of break surfaces, unless these are apart", "INFO")
                box.operator("sunder.split_inside", icon="UNLINKED").tree = thing.sunder.tree.name
            elif thing.sunder.part == "OUTSIDE":
                box.operator("sunder.unite_inside", icon="LINKED").tree = thing.sunder.tree.name


class SunderPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__.rpartition(".")[0]  # the add-on's own, by whatever name Blender gave it

    @drawing.guarded
    def draw(self, _context):
        problem = core.problem()
        if problem:
            drawing.sentence(self.layout, problem, "ERROR", alert=True)
        else:
            self.layout.label(text=f"Sunder's library, version {core.sunder().version()}", icon="CHECKMARK")


@drawing.guarded
def draw_add_menu(self, context):
    """Node editor > Add: nodes by the categories that the library gives."""
    if getattr(context.space_data, "tree_type", "") != trees.SunderTree.bl_idname:
        return
    for i, (_, label, members) in enumerate(node_buttons.categories()):
        if i:
            self.layout.separator()
        self.layout.label(text=label)
        for cls in members:
            add = self.layout.operator("node.add_node", text=cls.bl_label)
            add.type, add.use_transform = cls.bl_idname, True


@drawing.guarded
def draw_quick_menu(self, _context):
    self.layout.operator("sunder.quick_fracture")


classes = [SUNDER_PT_tree, SUNDER_PT_object, SunderPreferences]


def register():
    bpy.types.NODE_MT_add.append(draw_add_menu)
    bpy.types.VIEW3D_MT_object_quick_effects.append(draw_quick_menu)


def unregister():
    bpy.types.VIEW3D_MT_object_quick_effects.remove(draw_quick_menu)
    bpy.types.NODE_MT_add.remove(draw_add_menu)
