"""A shot for those who have no Sunder: what plays without the add-on, in files of its own beside the .blend.

NAME_shared.blend holds a collection that links and appends anywhere. Its objects read NAME.abc (share_cache.py) or, where
this Blender was built without Alembic, have a mesh for each frame in it (share_meshes.py).
"""
import contextlib
import math
import os
import shutil
import time

import bpy
from bpy.props import EnumProperty

from ..base import blender_versions, core, drawing, runtime
from ..tree import keys, trees, verbs
from ..bake import cache
from ..results import player
from . import share_cache, share_meshes

_MADE = ("scenes", "collections", "objects", "meshes", "materials", "node_groups", "cache_files", "actions")
_PART = ".part"  # before the ending of what is not whole yet
_SHARE_OF_BAKE = {True: 1.5, False: 4}  # of the bake's meshes: at most what a cache, and what meshes in a .blend, take
_TURN = 0.3  # s between looks at keys and at the window
_LAST_BLOCK = 64  # bytes at the end of a .blend that hold the block by which it ends
KINDS = [
    ("AUTO", "As This Blender Can", "A cache where it was built with Alembic, meshes where not"),
    ("CACHE", "Alembic Cache", "A mesh is read from the cache at each frame. Break surfaces are objects of their own; of "
     "attributes UV maps, velocities, colours (in 8 bits) and what materials read come along"),
    ("MESHES", "A Mesh a Frame", "All meshes lie in the .blend, with all that they carry. Large, and plays in any Blender"),
]


def _bases(tree, home):
    """What files of a tree begin with beside a .blend, "" for one that is not saved: as they are named, and as they were until
    0.2. In a cleaned name there is no "-": no other file and tree share one."""
    shot = os.path.splitext(home)[0]
    return [f"{shot}{joint}{bpy.path.clean_name(tree.name)}_shared" for joint in "-_"] if home else []


def found(tree):
    """The shared file of a tree, beside the file that it is in or beside this one; None if there is none."""
    homes = [bpy.path.abspath(tree.library.filepath)] if tree.library else []
    for base in (base for home in (*homes, bpy.data.filepath) for base in _bases(tree, home)):
        if os.path.isfile(base + ".blend"):
            return os.path.normpath(base + ".blend")
    return None


def _collection_in(names, tree):
    """Of the names of a shared file's collections the tree's own; None if it holds another tree."""
    name = f"{tree.name} shared"
    return next((n for n in names if n == name or n.startswith(name + ".")), None)


def _base(tree):
    """What the files of a tree here begin with: as those of before, if these are its own, for who linked them."""
    base, former = _bases(tree, bpy.data.filepath)
    if os.path.isfile(former + ".blend") and not os.path.isfile(base + ".blend"):
        try:
            with bpy.data.libraries.load(former + ".blend") as (there, _):
                if _collection_in(there.collections, tree):
                    return former
        except OSError:  # no .blend
            pass
    return base


def has_bake(tree):
    known = cache.manifest(cache.folder(tree))
    return known is not None and bool(known.numbers)


@contextlib.contextmanager
def _left_as_it_was():
    """What is made meanwhile is gone afterwards; what 3.4 renamed for it has its name again."""
    before = {kind: {thing: thing.name for thing in getattr(bpy.data, kind)} for kind in _MADE}
    try:
        yield
    finally:
        made = [thing for kind in _MADE for thing in set(getattr(bpy.data, kind)) - before[kind].keys()]
        for thing in made:
            if isinstance(thing, bpy.types.Mesh):
                thing.texco_mesh = None  # a use that Blender counts and does not take back
        bpy.data.batch_remove(made)
        for thing, name in (pair for things in before.values() for pair in things.items()):
            if thing.name != name:
                thing.name = name
        runtime.face_stamps.clear()  # of meshes that are gone, under names that others may get


@contextlib.contextmanager
def _whole(*paths):
    """Where to write files: beside `paths`, whose place they take in the end, all or none of them."""
    parts = [_PART.join(os.path.splitext(path)) for path in paths]
    try:
        yield parts
        for part, path in zip(parts, paths):
            if os.path.isdir(path):
                raise core.Refused(f"{path} is a folder")
        for part, path in zip(parts, paths):
            os.replace(part, path)
    finally:
        for part in parts:
            with contextlib.suppress(FileNotFoundError):
                os.remove(part)


def _new_scene(name, like, frames):
    """One whose frames pass as in another; what is shared is made in it."""
    scene = bpy.data.scenes.new(name)
    scene.render.fps, scene.render.fps_base = like.render.fps, like.render.fps_base
    scene.frame_start, scene.frame_end = frames[0], frames[-1]
    return scene


def _remap(scene, like, frames):
    """Frames pass in another time than keys and caches are in, as in another scene."""
    old, new = like.render.frame_map_old, like.render.frame_map_new
    scene.render.frame_map_old, scene.render.frame_map_new = old, new
    scene.frame_start, scene.frame_end = math.floor(frames[0] * new / old), math.ceil(frames[-1] * new / old)


def _check(tree):
    """Refuses what cannot be shared. Returns the folder that files go to."""
    if not bpy.data.filepath:
        raise core.Refused("save this file first: what is shared lies beside it")
    if tree.cache_id in runtime.jobs:
        raise core.Refused("it is being baked: wait, or stop that first")
    if not has_bake(tree):
        home = f" beside {bpy.path.basename(tree.library.filepath)}: bake it there" if tree.library else ": bake first"
        raise core.Refused(f"nothing is baked{home}")
    clean = bpy.path.clean_name(tree.name).casefold()
    others = [t.name for t in trees.trees() if t != tree and bpy.path.clean_name(t.name).casefold() == clean]
    if others:
        raise core.Refused(f"'{others[0]}' is shared into files of the same name: rename one of the trees")
    folder = os.path.dirname(bpy.data.filepath)
    if not os.access(folder, os.W_OK):
        raise core.Refused(f"{folder} cannot be written")
    return folder


def _check_room(folder, tree, is_cache):
    """Refuses what the disk has no room for: Blender's Alembic exporter ends Blender where that is full."""
    bake = cache.folder(tree)
    known = cache.manifest(bake)
    meshes = [os.path.join(bake, path) for n in known.numbers for path in known.frames[n].values() if path.startswith("mesh/")]
    needed = _SHARE_OF_BAKE[is_cache] * sum(os.path.getsize(path) for path in meshes if os.path.isfile(path))
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise core.Refused(f"there is no room in {folder}: it takes about {needed / 1e6:.1f} MB, and {free / 1e6:.1f} MB are "
                           "free")


def _is_cached(kind):
    """Whether sharing makes a cache, which Blender writes in one go."""
    return kind == "CACHE" or kind == "AUTO" and blender_versions.has_operator("wm", "alembic_export")


def share(tree, scene, things, kind="AUTO"):
    """Writes the files. A generator of the frames that it steps through, at each of which it may be closed, and then leaves
    nothing; returns (path of the .blend, sentences on what is not as with Sunder). Raises Refused, OSError."""
    folder, is_cache = _check(tree), _is_cached(kind)
    if is_cache and not blender_versions.has_operator("wm", "alembic_export"):
        raise core.Refused("this Blender was built without Alembic: share a mesh a frame")
    frames, path = cache.manifest(cache.folder(tree)).numbers, _base(tree)
    alembic, blend = path + ".abc", path + ".blend"
    _check_room(folder, tree, is_cache)
    with _left_as_it_was(), _whole(*([alembic] if is_cache else []), blend) as parts:
        name = f"{tree.name} shared"
        stage, outcome = _new_scene("Sunder stage", scene, frames), _new_scene(name, scene, frames)
        _remap(outcome, scene, frames)
        shared = bpy.data.collections.new(name)
        outcome.collection.children.link(shared)
        if is_cache:
            notes = yield from share_cache.make(things, frames, stage, shared, parts[0], alembic)
        else:
            notes = yield from share_meshes.make(things, frames, stage, shared)
        _write(parts[-1], outcome, blend)
    away = [thing.name for thing in things if scene not in thing.users_scene]
    if away:
        notes.append(f"shared where it stands itself, not where an instance shows it: {', '.join(away)}")
    if not is_cache and os.path.isfile(alembic):
        os.remove(alembic)  # that of an earlier click; nothing reads it any more
    return blend, notes


def _write(part, scene, path):
    told = ""
    try:
        bpy.data.libraries.write(part, {scene}, path_remap="RELATIVE")  # of a compressed one nobody tells whether it is whole
        with open(part, "rb") as file:
            file.seek(-_LAST_BLOCK, os.SEEK_END)
            is_whole = b"ENDB" in file.read()
    except (OSError, RuntimeError) as error:
        is_whole, told = False, "" if "Success" in str(error) else f" ({str(error).strip()})"  # what it says of a full disk
    if not is_whole:
        raise core.Refused(f"{path} cannot be written: is there room for it, and may this folder be written?{told}")


@contextlib.contextmanager
def _progress(manager, tree):
    """Shows beside the pointer how much of the shot was stepped through."""
    known = cache.manifest(cache.folder(tree))
    frames = known.numbers if known and known.numbers else [0]

    def on_frame(scene, *_):
        manager.progress_update(100 * (scene.frame_current - frames[0] + 1) / (frames[-1] - frames[0] + 1))

    manager.progress_begin(0, 100)
    bpy.app.handlers.frame_change_post.append(on_frame)
    try:
        yield
    finally:
        bpy.app.handlers.frame_change_post.remove(on_frame)
        manager.progress_end()


class SUNDER_OT_make_shareable(verbs.OnTree, bpy.types.Operator):
    """Write the baked shot as files that play where Sunder is off or not installed: a .blend beside this one, whose
    collection is linked or appended anywhere, and the Alembic cache that it reads. Escape stops it between frames, but not
    while Blender writes the cache"""

    bl_idname = "sunder.make_shareable"
    bl_label = "Share Without Sunder"

    kind: EnumProperty(name="Holds", items=KINDS, options={"SKIP_SAVE"})

    def _steps(self, context):
        """What `share` does, and what is to be done before and after it. A generator as that."""
        tree = self.find(context)
        if tree is None:
            return {"CANCELLED"}
        if any(window.screen.is_animation_playing for window in context.window_manager.windows):
            bpy.ops.screen.animation_cancel(restore_frame=False)  # while it plays meshes may have no exact normals
        scene = context.scene
        things = player.shown_objects(scene, tree) or trees.result_objects(tree)
        if not things:
            self.report({"ERROR"}, "the tree has no result object: add one first")
            return {"CANCELLED"}
        try:
            with _progress(context.window_manager, tree):
                path, notes = yield from share(tree, scene, things, self.kind)
        except core.Refused as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        except OSError as error:
            self.report({"ERROR"}, f"{error.filename or bpy.data.filepath}: {error.strerror or error}")
            return {"CANCELLED"}
        finally:
            player.show_all(scene, tree)
        for library in bpy.data.libraries:
            if os.path.normpath(bpy.path.abspath(library.filepath)) == os.path.normpath(path):
                library.reload()
        self.report({"WARNING" if notes else "INFO"}, "; ".join([f"Sunder: {path}: link or append its collection", *notes]))
        return {"FINISHED"}

    @verbs.told
    def execute(self, context):
        steps = self._steps(context)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                return end.value

    @verbs.told
    def invoke(self, context, event):
        if context.window is None or _is_cached(self.kind):
            return self.execute(context)
        manager = context.window_manager
        self._going, self._timer = self._steps(context), manager.event_timer_add(0.01, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _leave(self, context):
        self._going.close()
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)

    @verbs.told
    def modal(self, context, event):
        """Keeps all events to itself: what is shared is not to change meanwhile."""
        if event.type == "ESC":
            self._leave(context)
            self.report({"INFO"}, "Sunder: stopped; nothing was written")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        pause = time.monotonic() + _TURN
        try:
            while time.monotonic() < pause:
                frame = next(self._going)
            context.workspace.status_text_set(f"Share Without Sunder: frame {frame}   Esc: stop")
            return {"RUNNING_MODAL"}
        except StopIteration as end:
            outcome = end.value
        except BaseException:
            self._leave(context)
            raise
        self._leave(context)
        return outcome

    def cancel(self, context):
        self._leave(context)


class SUNDER_OT_use_shared(verbs.OnTree, bpy.types.Operator):
    """Link what was shared of this shot into the scene; the result objects stand back for it"""

    bl_idname = "sunder.use_shared"
    bl_label = "Link What Was Shared"
    bl_options = {"REGISTER", "UNDO"}

    @verbs.told
    def execute(self, context):
        tree = self.find(context)
        path = found(tree) if tree else None
        if path is None:
            if tree:
                self.report({"ERROR"}, "nothing was shared of it yet: press Share Without Sunder where it is baked")
            return {"CANCELLED"}
        known = {c.name_full for c in bpy.data.collections}
        relative = bool(bpy.data.filepath)
        with bpy.data.libraries.load(path, link=True, relative=relative) as (there, wanted):
            name = _collection_in(there.collections, tree)
            wanted.collections = [name] if name else []
        linked = [c for c in wanted.collections if c is not None]
        if not linked:
            self.report({"ERROR"}, f"{path} does not hold what was shared of '{tree.name}'")
            return {"CANCELLED"}
        if linked[0].name_full in known and linked[0] in context.scene.collection.children_recursive:
            self.report({"INFO"}, "Sunder: it is in this scene already")
            return {"CANCELLED"}
        context.scene.collection.children.link(linked[0])
        left = [thing.name for thing in trees.result_objects(tree) if not _stand_back(thing, context.view_layer)]
        note = f"; take these out, they are linked or their visibility is keyed: {', '.join(left)}" if left else ""
        self.report({"WARNING" if left else "INFO"}, f"Sunder: {bpy.path.basename(path)} is linked{note}")
        return {"FINISHED"}


def _stand_back(thing, view_layer):
    """Whether a result is hidden in viewports and renders; what is linked cannot be in renders, nor what keys show."""
    if thing.name in view_layer.objects and view_layer.objects[thing.name] == thing:
        thing.hide_set(True, view_layer=view_layer)
    if thing.library is None and not thing.hide_render:
        thing.hide_render = thing.sunder.stands_back = True
    return thing.library is None and all(curve.data_path != "hide_render" for curve in keys.curves(thing))


def draw(layout, tree):
    """The click, and for a linked shot that cannot play here what to do there."""
    if not has_bake(tree):
        if tree.library is None:
            return
        if found(tree):
            drawing.sentence(layout, "It cannot play here; what was shared of it can", "INFO")
            layout.operator("sunder.use_shared", icon="LINKED").tree = tree.name_full
        else:
            home = bpy.path.basename(tree.library.filepath)
            drawing.sentence(layout, f"It cannot play here. Open {home} where its bake is, and press Share Without Sunder",
                             "INFO")
        return
    row = layout.row(align=True)
    row.operator("sunder.make_shareable", icon="EXPORT").tree = tree.name_full
    row.operator_menu_enum("sunder.make_shareable", "kind", text="", icon="DOWNARROW_HLT").tree = tree.name_full
    if found(tree):
        layout.operator("sunder.use_shared", icon="LINKED").tree = tree.name_full


classes = [SUNDER_OT_make_shareable, SUNDER_OT_use_shared]
