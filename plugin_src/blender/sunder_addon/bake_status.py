"""What a tree's bake is like, in a word and a sentence, and how nodes and panels show it."""
import bpy

from . import cache, drawing, player, preview, runtime, signature


class Status:
    """state: "baking", "none", "partial" or "complete"; is_stale: what it was baked from has changed since (None: not
    known now); text: a sentence; fraction: of a bake at work."""

    def __init__(self, state, text, is_stale=False, fraction=0.0):
        self.state, self.text, self.is_stale, self.fraction = state, text, is_stale, fraction


def status(tree, scene, compute=True):
    """`compute` False asks for no work, as when drawing: staleness may then be None."""
    job = runtime.jobs.get(tree.cache_id)
    if job is not None:
        return Status("baking", f"{100 * job.fraction:.0f}%: {job.text}", fraction=job.fraction)
    folder = cache.folder(tree)
    manifest = cache.manifest(folder)
    if manifest is None or not manifest.numbers:
        return Status("none", "not baked")
    found = (signature.signature if compute else signature.known)(tree, scene)
    note = cache.note(folder)
    is_stale = None if found is None else found != note.get("signature")
    first, last = manifest.numbers[0], manifest.numbers[-1]
    wanted = tree.frames(scene)[1]
    text = f"baked {first} to {last}"
    if last < wanted:
        text += f" of {wanted}"
    if note.get("taken_over") is not None:
        text += f" (to {note['taken_over']} as before the changes)"
    if is_stale:
        text = "out of date: " + text
    return Status("partial" if last < wanted else "complete", text, is_stale)


def draw_bake(layout, tree, scene, width=drawing.SIDEBAR):
    """Progress, or what is baked and what can be done about it."""
    now = status(tree, scene, compute=False)
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
    shows = [o for o in player.result_objects(tree) if o.sunder.node == node.graph_name]
    for thing in shows:
        layout.label(text=thing.name, icon="MESH_DATA")
        draw_preview(layout, thing, node.width)
    add = layout.operator("sunder.add_results", text="Add Result Object" if not shows else "Add Another", icon="ADD")
    add.tree, add.node = tree.name_full, node.name


def draw_preview(layout, thing, width=drawing.SIDEBAR):
    """What viewports show of a result object."""
    layout.prop(thing.sunder, "preview")
    if thing.sunder.preview == "STRAIN":
        layout.prop(thing.sunder, "preview_limit")
    if thing.sunder.preview != "OFF" and preview.problems.get(thing.name_full):
        drawing.sentence(layout, preview.problems[thing.name_full], "INFO", width=width)


def draw_tree(layout, tree, scene):
    draw_bake(layout, tree, scene)
    layout.separator()
    layout.prop(tree, "use_scene_range")
    if not tree.use_scene_range:
        row = layout.row(align=True)
        row.prop(tree, "frame_start")
        row.prop(tree, "frame_end")
    layout.prop(tree, "threads")
    layout.operator("sunder.add_results", text="Add Result Objects", icon="ADD").tree = tree.name_full
    if not scene.render.use_lock_interface:
        drawing.sentence(layout, "Lock Interface is off: rendering may crash while results change", "ERROR")
        layout.prop(scene.render, "use_lock_interface")
    layout.label(text=tree.cache_id, icon="FILE_FOLDER")
