"""Bake folders: where they lie, what is in them, whose they are, and how they are freed.

Each tree has one folder below the cache, `//sunder_cache/NAME-ID`, beside the .blend file (before the file is saved: in
Blender's temporary folder). The bake's manifest says what is whole (docs/files.md); `blender.json` beside it says what
the add-on adds: which file baked it, from what, and where rigid bodies' objects stood. `players.json`
lists other .blend files that play it, by their paths from the owner's folder: second versions of that file, until they
bake something else. Nobody replaces what another file plays.
"""
import bisect
import json
import os
import shutil

import bpy

from ..base import runtime
from ..tree import trees

FOLDER = "sunder_cache"
_NOTE = "blender.json"
_GRAPH = "graph.json"
_PLAYERS = "players.json"
LOOKS, LOOKS_FOLDER = "looks.json", "looks"
_read_before = {}  # file: (stamp, content)


class Manifest:
    """frames: {frame: {node: path}}, of what lies between two frames as well; numbers: of whole frames, ascending; graph: as run; interval: first and last frame wanted;
    log: equal where what broke is, None in bakes of an earlier Sunder, which keep none."""

    def __init__(self, content):
        parts = [part for f in content["frames"] for part in (*f.get("subframes", ()), f)]
        self.frames = {f["frame"]: {file["node"]: file["path"] for file in f["files"]} for f in parts}
        self.numbers = [f["frame"] for f in content["frames"]]
        self.hashes = {f["frame"]: {file["node"]: file["hash"] for file in f["files"]} for f in parts}
        self.graph, self.interval, self.version = content["graph"], content["frame_range"], content["version"]
        self.files = [path for paths in self.frames.values() for path in paths.values()]
        log = content.get("log", {})
        self.log = "-".join(file["hash"] for file in log["breaks"] + log["loads"]) if log else None
        own = content["resume"] + content.get("exports", []) + log.get("breaks", []) + log.get("loads", [])
        self.files += [file["path"] for file in own]

    def shown(self, frame):
        """The frame to show at a frame: itself, else the last one before it, else the first; None if there is none."""
        if not self.numbers:
            return None
        return self.numbers[max(0, bisect.bisect_right(self.numbers, frame) - 1)]

    def nearest(self, at):
        """Of what is baked, whole frames and between them, what lies next to a time in frames."""
        return min(self.frames, key=lambda frame: abs(frame - at))


def home(library=None):
    """Where this file's caches lie, or those of a linked file."""
    if bpy.data.filepath or library:
        return os.path.normpath(bpy.path.abspath("//" + FOLDER, library=library))
    return os.path.join(bpy.app.tempdir, FOLDER)


def folder(tree):
    """The bake folder of a tree; it need not be there."""
    job = runtime.jobs.get(tree.cache_id)
    if job is not None:  # also while the file is saved somewhere else
        return job.folder
    own = os.path.join(home(tree.library), trees.identity(tree))
    if not os.path.isdir(own):  # the file was saved to another folder, or the tree appended: the bake stayed where it was
        beside = [home(library) for library in bpy.data.libraries]
        for former in (tree.former_home, runtime.former_homes.get(tree.cache_id), *beside):
            if former and os.path.isdir(os.path.join(former, tree.cache_id)):
                return os.path.join(former, tree.cache_id)
    return own


def _read(name, parse):
    """What a JSON file holds, read again when it was replaced; None if it is not there or not whole."""
    try:
        status = os.stat(name)
        stamp = (status.st_mtime_ns, status.st_size, status.st_ino)
        if name not in _read_before or _read_before[name][0] != stamp:
            with open(name, encoding="utf-8") as file:
                _read_before[name] = (stamp, parse(json.load(file)))
        return _read_before[name][1]
    except (OSError, ValueError, KeyError, TypeError):
        _read_before.pop(name, None)
        return None


def manifest(path):
    """What a bake folder holds now; None if there is no bake."""
    return _read(os.path.join(path, "manifest.json"), Manifest)


def note(path):
    """What the add-on wrote beside a bake; {} if nothing."""
    return _read(os.path.join(path, _NOTE), dict) or {}


def write_note(path, content, description):
    """Writes blender.json, and graph.json for `sunder bake` outside Blender."""
    _write(path, _NOTE, content)
    _write(path, _GRAPH, description)


def _write(path, name, value):
    temporary = os.path.join(path, name + ".part")
    with open(temporary, "w", encoding="utf-8") as file:
        json.dump(value, file, indent=1)
    os.replace(temporary, os.path.join(path, name))


def blend_name():
    return os.path.basename(bpy.data.filepath)


def is_anothers(tree):
    """Whether another tree of this file plays the same folder, or another .blend file baked it."""
    if any(t != tree and t.cache_id == tree.cache_id for t in trees.trees()):
        return True
    path = folder(tree)
    return _is_played(path, [note(path).get("blend", "")])


def is_shared(tree):
    """Whether another tree of this file, or another .blend file, plays the same folder."""
    path = folder(tree)
    return is_anothers(tree) or _is_played(path, _players(path))


def _is_played(path, names):
    """Whether one of these .blend files is there, and another than this one."""
    if not bpy.data.filepath:
        return False
    others = set(names) - {"", _as_player(path)}
    return any(os.path.exists(os.path.join(_owners_folder(path), name)) for name in others)


def _owners_folder(path):
    """Where the .blend file lies beside which a bake folder is."""
    return os.path.dirname(os.path.dirname(path))


def _as_player(path):
    """This file, as a bake folder names it."""
    try:
        return os.path.relpath(bpy.data.filepath, _owners_folder(path))
    except ValueError:  # on another drive
        return bpy.data.filepath


def _players(path):
    return _read(os.path.join(path, _PLAYERS), lambda content: list(map(str, content["players"]))) or []


def tell_players():
    """Lists this file, as it was opened or saved, with the bakes that it plays and with no others."""
    if not bpy.data.filepath:
        return
    played = {folder(tree) for tree in trees.trees() if tree.library is None}
    known = set(played)
    for place in {home(), *map(os.path.dirname, played)}:
        if os.path.isdir(place):
            known.update(entry.path for entry in os.scandir(place) if entry.is_dir())
    for path in known:
        if os.path.isdir(path):
            _tell(path, path in played)


def _tell(path, plays):
    this, content, players = _as_player(path), note(path), _players(path)
    is_owner = content.get("blend") == this
    wanted = [name for name in players if name != this]
    if plays and not is_owner:
        wanted.append(this)
    try:
        if is_owner and not plays:
            _write(path, _NOTE, {**content, "blend": ""})
        if not wanted and players:
            os.remove(os.path.join(path, _PLAYERS))
        elif sorted(wanted) != sorted(players):
            _write(path, _PLAYERS, {"players": wanted})
    except OSError:
        pass  # may be read only


def is_elsewhere(tree):
    """Whether the tree plays a bake that lies with the file it was saved from, in another folder."""
    return os.path.dirname(folder(tree)) != home(tree.library)


def make_own(tree):
    """Gives the tree a folder that nobody else plays; what it played stays for the others."""
    if is_elsewhere(tree) or is_shared(tree):
        trees.renew_identity(tree)


def free(tree):
    """Removes what a bake wrote, and nothing else; a folder that others play too is only left alone.

    Returns how many files were removed.
    """
    if is_elsewhere(tree) or is_shared(tree):
        make_own(tree)
        return 0
    path, removed = folder(tree), 0
    known = manifest(path)
    own = [] if known is None else list(dict.fromkeys(known.files))
    inputs = os.path.join(path, "inputs")
    if os.path.isdir(inputs):
        own += ["inputs/" + name for name in os.listdir(inputs) if name.endswith((".ply", ".ply.part"))]
    own += [f"{LOOKS_FOLDER}/{name}" for name in looks_meshes(path)]
    if os.path.isdir(cuts(path)):
        own += ["cuts/" + name for name in os.listdir(cuts(path)) if name.endswith(".cut")]
    for name in [*own, "manifest.json", _GRAPH, _NOTE, _PLAYERS, LOOKS]:
        try:
            os.remove(os.path.join(path, name))
            removed += 1
        except FileNotFoundError:
            pass
    _remove_empty(path)
    return removed


def cuts(path):
    """Where the library keeps what it has cut for a bake folder, so that it does not cut it again."""
    return os.path.join(path, "cuts")


def looks_meshes(path):
    """What looks.py left in a bake folder beside its looks.json."""
    meshes = os.path.join(path, LOOKS_FOLDER)
    return [n for n in os.listdir(meshes) if n.endswith((".ply", ".ply.part"))] if os.path.isdir(meshes) else []


def remove_old_inputs(path, kept):
    """Meshes that an earlier bake in this folder was cut from."""
    inputs = os.path.join(path, "inputs")
    for name in os.listdir(inputs) if os.path.isdir(inputs) else ():
        if name.endswith(".ply") and "inputs/" + name not in kept:
            os.remove(os.path.join(inputs, name))


def _remove_empty(path):
    for at, _, _ in os.walk(path, topdown=False):
        try:
            os.rmdir(at)
        except OSError:
            pass  # it holds something that is not ours


def move_home(old):
    """Brings bakes that were made before the file was saved beside it; those at work come when they have ended."""
    if not os.path.isdir(old) or os.path.normpath(old) == home():
        return
    for tree in trees.trees():
        if tree.cache_id in runtime.jobs:
            continue
        source, target = os.path.join(old, trees.identity(tree)), folder(tree)
        if os.path.isdir(source) and not os.path.exists(target):
            os.makedirs(os.path.dirname(target), exist_ok=True)
            shutil.move(source, target)
