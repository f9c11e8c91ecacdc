"""Blender's events: the frame changes, a file is opened or saved, something is undone or edited."""
import os

import bpy
from bpy.app.handlers import persistent

from ..base import runtime
from ..tree import trees
from ..bake import cache, compiler, edges, signature
from ..results import parts, player, result_mesh
from ..preview import edge_overlay
from . import report, tree_layout

_INTERVAL = 0.5  # s between looks whether bakes went out of date
_late = {"frame": None}  # the frame at which meshes are not, or not wholly, written yet
_seen = {"scene": "", "results": {}}  # at the last look; results: {name: (its place in memory, what its mesh shows)}
_before_save = {}  # while a file is saved: where caches lay


@persistent
@runtime.guarded
def on_frame(scene, depsgraph=None):
    """Meshes that viewports do not show are written once the frame rests (_look), and normals of large ones once playing
    stops; renders and scripts need them now."""
    if runtime.is_sampling:
        return
    is_in_viewport = depsgraph is not None and depsgraph.mode == "VIEWPORT" and not bpy.app.background
    is_playing = is_in_viewport and any(w.screen.is_animation_playing for w in bpy.data.window_managers[0].windows)
    is_late = player.show_all(scene, skip_previewed=is_in_viewport, is_playing=is_playing, depsgraph=depsgraph)
    _late["frame"] = scene.frame_current if is_late else None


@persistent
@runtime.guarded
def on_load(*_):
    runtime.forget()
    report.forget(), edges.forget(), edge_overlay.forget()
    cache.tell_players()
    _refresh()


def _refresh():
    """Results as they are at the current frame; also for a file that was open before the add-on was enabled."""
    for tree in trees.trees():
        tree.update_tag()
        tree.update()  # it was not looked at while classes were registered
        if any(use.tree == tree for use in bpy.context.scene.sunder_trees):
            compiler.ensure_evaluated(tree, bpy.context.scene)
    if not trees.result_objects():
        return
    for thing in trees.result_objects():
        parts.count_as_moving(thing)  # those of files that were made before
    player.lock_interface()
    player.show_all(bpy.context.scene)


@persistent
@runtime.guarded
def on_undo(*_):
    runtime.signatures.clear()
    runtime.mesh_hashes.clear()
    player.show_all(bpy.context.scene)


@persistent
@runtime.guarded
def on_edit(_scene, depsgraph):
    """Forgets what is known of things that were edited. (Frame changes do not come here.)"""
    if runtime.is_sampling:
        return
    for update in depsgraph.updates:
        thing = update.id.original
        if isinstance(thing, bpy.types.Object):
            if thing.sunder.tree:
                continue
            if update.is_updated_geometry:
                for use_modifiers in (True, False):
                    runtime.mesh_hashes.pop((thing.name, use_modifiers), None)
        elif isinstance(thing, bpy.types.Mesh):
            if player.SHOWN in thing:
                continue
            runtime.mesh_hashes.clear()
        elif isinstance(thing, bpy.types.Scene):
            continue
        runtime.signatures.clear()


@persistent
@runtime.guarded
def on_save_pre(*_):
    """The file may be about to move: it goes on playing its bakes where they lie."""
    result_mesh.drop_stage_object()
    _before_save["home"] = cache.home()
    if bpy.data.filepath:
        for tree in trees.trees():
            former = os.path.dirname(cache.folder(tree))
            tree.former_home = runtime.former_homes[tree.cache_id] = former


@persistent
@runtime.guarded
def on_save_post(*_):
    home = _before_save.pop("home", "")
    if home.startswith(bpy.app.tempdir):
        cache.move_home(home)
    cache.tell_players()
    player.show_all(bpy.context.scene)


def _look():
    """Now and then, in the UI: finds out whether bakes went out of date."""
    scene = bpy.context.scene
    screen = bpy.context.screen
    thing = bpy.context.view_layer.objects.active if bpy.context.view_layer else None
    is_editing = thing is not None and thing.mode != "OBJECT"  # what is sculpted and edited changes at every stroke
    is_busy = runtime.is_sampling or bpy.app.is_job_running("RENDER") or screen and screen.is_animation_playing
    runtime.guarded(tree_layout.show_in_new_editors)()
    if scene is not None and not is_busy:
        for tree in trees.trees():
            if signature.known(tree, scene) is None and not is_editing:
                runtime.guarded(signature.signature)(tree, scene)
                redraw()
        runtime.guarded(_notice)(scene)
        _catch_up(scene)
    return _INTERVAL


def _notice(scene):
    """Results that were linked, appended or read again since the last look, or that a render left at another frame, as that
    of a strip leaves those of the strip's scene, are shown once the frame rests."""
    results = {t.name_full: (t.as_pointer(), t.data.get(player.SHOWN) if t.data else None) for t in trees.result_objects()}
    if results.keys() - _seen["results"].keys():
        player.lock_interface()
    if (scene.name_full, results) != (_seen["scene"], _seen["results"]):
        _late["frame"] = scene.frame_current
    _seen.update(scene=scene.name_full, results=results)


def _catch_up(scene):
    """Writes the meshes behind previews when a whole look found the same frame."""
    frame = scene.frame_current
    if _late["frame"] != frame:
        return
    if _late.get("looked") == frame:
        runtime.guarded(player.show_all)(scene)
        _late["frame"] = None
    _late["looked"] = frame


def redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("NODE_EDITOR", "VIEW_3D"):
                area.tag_redraw()


def _start():
    """Once Blender's data can be reached after the add-on was enabled."""
    runtime.guarded(_refresh)()
    return None


_LISTS = {
    "frame_change_post": on_frame,
    "load_post": on_load,
    "undo_post": on_undo,
    "redo_post": on_undo,
    "depsgraph_update_post": on_edit,
    "save_pre": on_save_pre,
    "save_post": on_save_post,
}


def register():
    for name, handler in _LISTS.items():
        getattr(bpy.app.handlers, name).append(handler)
    if not bpy.app.background:
        bpy.app.timers.register(_start, first_interval=0)
        bpy.app.timers.register(_look, first_interval=_INTERVAL, persistent=True)


def unregister():
    for timer in (_start, _look):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    for name, handler in _LISTS.items():
        found = getattr(bpy.app.handlers, name)
        if handler in found:
            found.remove(handler)
