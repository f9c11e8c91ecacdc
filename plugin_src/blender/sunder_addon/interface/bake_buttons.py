"""How nodes and panels show what a tree's bake is like, and what can be done about it."""
import bpy

from ..base import drawing
from ..tree import trees
from ..bake import bake_status, bake_warnings, cache
from ..preview import preview


def draw_bake(layout, tree, scene, width=drawing.SIDEBAR):
    """Progress, or what is baked and what can be done about it."""
    now = bake_status.status(tree, scene, compute=False)
    if now.state == "baking":
        drawing.sentence(layout, now.text, "RENDER_ANIMATION", width=width)
        layout.operator("sunder.cancel_bake", icon="CANCEL").tree = tree.name
        return
    icon = "ERROR" if now.is_stale else "CHECKMARK" if now.state == "complete" else "INFO"
    drawing.sentence(layout, now.text, icon, width=width)
    if tree.library is not None:
        drawing.sentence(layout, f"linked: bake it in {bpy.path.basename(tree.library.filepath)}", "LINKED", width=width)
        return
    row = layout.row(align=True)
    resumes = now.state == "partial" and not now.is_stale
    row.operator("sunder.bake", text="Resume" if resumes else "Bake", icon="PHYSICS").tree = tree.name
    manifest = cache.manifest(cache.folder(tree))
    if now.is_stale and manifest and scene.frame_current in manifest.numbers:
        again = layout.operator("sunder.bake", text=f"Go On from Frame {scene.frame_current}", icon="FORWARD")
        again.tree, again.start, again.frame = tree.name, "FROM_FRAME", scene.frame_current
    if now.state != "none":
        row.operator("sunder.free_bake", text="Free", icon="TRASH").tree = tree.name


def draw_node(context, layout, node):
    tree = node.id_data
    if node.sunder_type == "solver":
        draw_bake(layout, tree, context.scene, node.width)
        return
    if node.note:
        drawing.sentence(layout, node.note, "INFO", width=node.width)
    shows = [o for o in trees.result_objects(tree) if o.sunder.node == node.graph_name]
    for thing in shows:
        layout.label(text=thing.name, icon="MESH_DATA")
        draw_preview(layout, thing, node.width)
    add = layout.operator("sunder.add_results", text="Add Result Object" if not shows else "Add Another", icon="ADD")
    add.tree, add.node = tree.name_full, node.name


def draw_preview(layout, thing, width=drawing.SIDEBAR):
    """What viewports show of a result object."""
    drawing.labelled(layout, "Preview").prop(thing.sunder, "preview", text="")
    if thing.sunder.preview in ("EDGES", "SIMULATION"):
        drawing.labelled(layout, "Edges").prop(thing.sunder, "edges_as", text="")
    if thing.sunder.preview == "STRAIN":
        layout.prop(thing.sunder, "preview_limit")
    if thing.sunder.preview != "OFF" and preview.problems.get(thing.name_full):
        drawing.sentence(layout, preview.problems[thing.name_full], "INFO", width=width)


def draw_tree(layout, tree, scene):
    draw_bake(layout, tree, scene)
    for name, sentences in bake_warnings.of_bake(tree).items():
        for sentence in sentences:
            drawing.sentence(layout, f"{trees.spoken(tree, name)}: {sentence}", "ERROR")
    layout.separator()
    layout.prop(tree, "use_scene_range")
    if not tree.use_scene_range:
        row = layout.row(align=True)
        row.prop(tree, "frame_start")
        row.prop(tree, "frame_end")
    layout.prop(tree, "subframes")
    layout.prop(tree, "threads")
    layout.operator("sunder.add_results", text="Add Result Objects", icon="ADD").tree = tree.name_full
    if not scene.render.use_lock_interface:
        drawing.sentence(layout, "Lock Interface is off: rendering may crash while results change", "ERROR")
        layout.prop(scene.render, "use_lock_interface")
    layout.label(text=tree.cache_id, icon="FILE_FOLDER")
