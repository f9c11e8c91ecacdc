"""Everything that Blender has to know, in the order in which it has to learn it."""
import bpy

from . import (
    core, export, handlers, nodes, operators, panels, player, preview, quick_fracture, runtime, sockets, tree,
)

_CLASSES = [
    *tree.classes, *sockets.classes, *player.classes, *nodes.classes, *operators.classes, *quick_fracture.classes,
    *export.classes, *panels.classes,
]


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    player.register()
    panels.register()
    export.register()
    handlers.register()
    preview.register()
    problem = core.problem()
    if problem:
        print(f"sunder: error: {problem}")


def unregister():
    for job in list(runtime.jobs.values()):
        job.cancel()
        job.finish(None)
    runtime.forget()
    preview.unregister()
    handlers.unregister()
    export.unregister()
    panels.unregister()
    player.unregister()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
