"""Operators: everything that buttons do, and scripts too."""
import signal
import threading

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ..base import core, runtime
from ..tree import trees, verbs
from ..bake import bake_job, cache
from ..results import player, results
from ..preview import preview
from . import handlers, report

_TICK = 0.1  # s between looks at a bake at work
_AGAIN = 5.0  # percent between lines of progress in background mode


class SUNDER_OT_bake(verbs.OnTree, bpy.types.Operator):
    """Simulate, and write every frame to the cache. Goes on where it was stopped if nothing changed"""

    bl_idname = "sunder.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER"}

    start: EnumProperty(
        name="Start",
        items=[
            ("AUTO", "As Needed", "Go on with a bake of the same; otherwise bake anew"),
            ("RESTART", "Anew", "Remove what was baked and begin at the first frame"),
            ("FROM_FRAME", "From a Frame", "Keep the bake up to a frame, and go on from there as the tree is now"),
        ],
        options={"SKIP_SAVE"},
    )
    frame: IntProperty(name="Frame", description="With From a Frame: the last frame that stays as it is baked",
                       options={"SKIP_SAVE"})

    def _begin(self, context):
        tree = self.find(context)
        if tree is None:
            return None
        try:
            job = bake_job.BakeJob(tree, context.scene, self.start, self.frame)
        except (core.Refused, core.Unusable) as error:
            self.report({"ERROR"}, str(error))
            return None
        job.start()
        return job

    def _end(self, context, job):
        # Undo may have made the tree anew, and a copy of it may play the same bake.
        known = [t for t in trees.trees() if t.cache_id == job.cache_id]
        tree = next((t for t in known if t.name_full == job.tree_name), known[0] if known else None)
        job.finish(tree)
        preview.take_over(job, tree)
        player.show_all(context.scene)
        handlers.redraw()
        if job.error:
            self.report({"ERROR"}, f"{job.node}: {job.error}" if job.node else job.error)
            return {"CANCELLED"}
        if job.is_cancelled:
            self.report({"INFO"}, "Sunder: stopped; what is baked stays")
            return {"CANCELLED"}
        if tree is not None:
            report.refresh(context, tree)
        baked = f"Sunder: {job.report['n_frames']} frames baked"
        warnings = [f"{name}: {sentence}" for name, sentences in job.warnings.items() for sentence in sentences]
        self.report({"WARNING" if warnings else "INFO"}, "; ".join([baked, *warnings]))
        return {"FINISHED"}

    @verbs.told
    def execute(self, context):
        """Blocks until done; Ctrl-C stops it as ESC does in the window."""
        job = self._begin(context)
        if job is None:
            return {"CANCELLED"}
        takes_signals = bpy.app.background and threading.current_thread() is threading.main_thread()
        if takes_signals:  # Blender swallows Ctrl-C otherwise
            signal.signal(signal.SIGINT, lambda *_: job.cancel())
        told = -_AGAIN
        try:
            while not job.wait(_TICK):
                if 100 * job.fraction >= told + _AGAIN:
                    told = 100 * job.fraction
                    print(f"sunder.bake {told:.0f}%: {job.text}", flush=True)
        finally:
            if takes_signals:  # Blender's own handler is no Python object and cannot be put back
                signal.signal(signal.SIGINT, signal.SIG_DFL)
        return self._end(context, job)

    @verbs.told
    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        self._job = self._begin(context)
        if self._job is None:
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(_TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    @verbs.told
    def modal(self, context, event):
        if event.type == "ESC":
            self._job.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        self._job.advance()
        if self._job.is_running:
            percent = 100 * self._job.fraction
            context.window_manager.progress_update(percent)
            context.workspace.status_text_set(f"Sunder: {percent:.0f}%, {self._job.text}   Esc: stop")
            runtime.guarded(player.show_all)(context.scene)
            handlers.redraw()
            return {"PASS_THROUGH"}
        self._leave(context)
        return self._end(context, self._job)

    def cancel(self, context):
        """Blender quits or opens another file: the bake must have ended before its memory goes."""
        self._job.cancel()
        self._leave(context)
        self._job.finish(None)

    def _leave(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class SUNDER_OT_cancel_bake(verbs.OnTree, bpy.types.Operator):
    """Stop the bake; what is baked stays, and a later bake goes on from there"""

    bl_idname = "sunder.cancel_bake"
    bl_label = "Stop"

    @verbs.told
    def execute(self, context):
        tree = self.find(context)
        job = runtime.jobs.get(tree.cache_id) if tree else None
        if job is None:
            return {"CANCELLED"}
        job.cancel()
        return {"FINISHED"}


class SUNDER_OT_free_bake(verbs.OnTree, bpy.types.Operator):
    """Remove the baked files of this tree. A bake that another file or tree plays is left to it"""

    bl_idname = "sunder.free_bake"
    bl_label = "Free Bake"
    bl_options = {"REGISTER"}

    @verbs.told
    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    @verbs.told
    def execute(self, context):
        tree = self.find(context)
        if tree is None:
            return {"CANCELLED"}
        if tree.cache_id in runtime.jobs or tree.library is not None:
            self.report({"ERROR"}, "it is linked from another file" if tree.library else "it is being baked: stop that first")
            return {"CANCELLED"}
        try:
            removed = cache.free(tree)
        except OSError as error:
            self.report({"ERROR"}, f"{error.filename}: {error.strerror}")
            return {"CANCELLED"}
        player.show_all(context.scene, tree)
        self.report({"INFO"}, f"Sunder: {removed} files removed")
        return {"FINISHED"}


class SUNDER_OT_new_tree(bpy.types.Operator):
    """Make an empty Sunder tree"""

    bl_idname = "sunder.new_tree"
    bl_label = "New Sunder Tree"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(name="Name", default="Fracture")

    @verbs.told
    def execute(self, context):
        tree = bpy.data.node_groups.new(self.name, trees.SunderTree.bl_idname)
        trees.identity(tree)
        if getattr(context.space_data, "tree_type", "") == trees.SunderTree.bl_idname:
            context.space_data.node_tree = tree
        return {"FINISHED"}


class SUNDER_OT_add_results(verbs.OnTree, bpy.types.Operator):
    """Make objects that play the bake: a mesh for a deformer, a moving twin for each rigid body's object"""

    bl_idname = "sunder.add_results"
    bl_label = "Add Result Objects"
    bl_options = {"REGISTER", "UNDO"}

    node: StringProperty(name="Node", description="A deformer's name; empty: all that have none", options={"SKIP_SAVE"})

    @verbs.told
    def execute(self, context):
        tree = self.find(context)
        if tree is None:
            return {"CANCELLED"}
        if not self.node:
            made = results.add_missing(tree, context.scene)
            self.report({"INFO"}, f"Sunder: {len(made)} result objects made")
            return {"FINISHED"}
        node = tree.nodes.get(self.node)
        if node is None or not trees.is_node(node) or node.sunder_type != "deformer":
            self.report({"ERROR"}, f"there is no deformer '{self.node}'")
            return {"CANCELLED"}
        results.add_mesh_result(node, context.scene)
        player.show_all(context.scene, tree)
        return {"FINISHED"}


classes = [SUNDER_OT_bake, SUNDER_OT_cancel_bake, SUNDER_OT_free_bake, SUNDER_OT_new_tree, SUNDER_OT_add_results]
