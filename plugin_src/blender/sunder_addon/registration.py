"""Everything that Blender has to know, in the order in which it has to learn it."""
import bpy

from . import core
from .base import runtime
from .tree import sockets, trees
from .bake import compiler
from .results import player
from .preview import edge_overlay, preview
from .exports import export, share
from .interface import (edge_operators, edge_panels, edge_strokes, handlers, node_buttons, node_panels, operators, panels,
                        quick_fracture, report, report_panels)

# Trees come after what is in them: Blender gives a file's trees their class as soon as it is there, and updates them.
_CLASSES = [
    *sockets.classes, *node_buttons.classes, *trees.classes, *player.classes, *operators.classes, *quick_fracture.classes,
    *export.classes, *share.classes, *report.classes, *edge_operators.classes, *edge_strokes.classes, *panels.classes,
    *report_panels.classes, *edge_panels.classes, *node_panels.classes,
]


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    runtime.is_registered = True
    player.register()
    report.register()
    panels.register()
    export.register()
    handlers.register()
    preview.register()
    edge_overlay.register()
    problem = core.problem()
    if problem:
        print(f"sunder: error: {problem}")


def _drop_evaluated_trees():
    """Makes Blender free its evaluated copies of trees while their types are there: later it would reach for what is gone.

    The pointers that brought them about are set back afterwards, which Blender does not notice.
    """
    holders = [o.sunder for o in bpy.data.objects if o.sunder.tree]
    holders += [use for scene in bpy.data.scenes for use in scene.sunder_trees if use.tree]
    pointers = [(holder, holder.tree) for holder in holders]
    if not pointers:
        return
    for holder, _ in pointers:
        holder.tree = None
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            compiler.rebuild_relations(window.scene)
    for holder, known in pointers:
        holder.tree = known


def _drop_wrappers():
    """Makes Blender forget what it keeps of trees for Python: each is of a class that is gone, in memory that is freed.

    It looks at the class where a tree is asked for, and drops what does not fit; where it calls `update`, after an undo, it does not.
    """
    for _ in bpy.data.node_groups:
        pass


def unregister():
    runtime.is_registered = False
    for job in list(runtime.jobs.values()):
        job.cancel()
        job.finish(None)
    runtime.forget()
    edge_overlay.unregister()
    preview.unregister()
    handlers.unregister()
    export.unregister()
    _drop_evaluated_trees()
    panels.unregister()
    report.unregister()
    player.unregister()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
    _drop_wrappers()
