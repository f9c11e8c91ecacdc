"""One bake: compiled here, run by a thread of the library's own, cancelled at any moment.

No Python may run in another thread while Blender works: its main thread then takes Python for its own where it looks up a
context that was overridden, without Python's lock, and crashes (3.4.1; any script's operators meanwhile would do).
"""
import os
import time

import bpy

from ..base import core, runtime
from ..tree import trees
from ..scene import mesh_export
from . import bake_warnings, cache, compiler, looks, signature

_CACHE_LIMIT = 2**30  # bytes of past frames that a solver keeps at least
_LOOK = 0.1  # s between looks while waiting
AUTO, RESTART, FROM_FRAME = "AUTO", "RESTART", "FROM_FRAME"


class BakeJob:
    """Refuses (core.Refused, core.Unusable) when it is made, or ends with `error`; `node` names the node at fault.

    fraction, text: progress; graph: the library's. After the end: report (of the library) and warnings ({graph name: [sentence,
    ...]}) or error or is_cancelled.
    """

    def __init__(self, tree, scene, start=AUTO, frame=0):
        """`frame`: with FROM_FRAME the last one that is taken over from the bake that is there."""
        self.tree_name, self.cache_id = tree.name_full, trees.identity(tree)
        self.fraction, self.text = 0.0, "preparing"
        self.report, self.warnings, self.error, self.node, self.is_cancelled = None, {}, "", "", False
        self.is_running = self._is_to_stop = False
        self._steps = self._at = None  # what is still to do; the library's job at work
        runtime.forget_errors(tree.name_full)
        try:
            self._prepare(tree, scene, start, frame)
        except core.Refused as refused:
            self._blame(tree, refused.node, str(refused))
            raise

    def _prepare(self, tree, scene, start, frame):
        sunder = core.sunder()
        if tree.library is not None:
            raise core.Refused("this tree is linked from another file: bake it there")
        if self.cache_id in runtime.jobs:
            raise core.Refused("this tree is being baked already")
        compiled = compiler.compile_tree(tree, scene)
        folder = cache.folder(tree)
        try:
            graph = sunder.Graph.from_dict(compiled.description, base_folder=folder, name=tree.name)
            baked = cache.manifest(folder)
            is_same = baked is not None and _is_same(baked, graph, sunder.version())
            taken_over = cache.note(folder).get("taken_over")
            told_before = bake_warnings.of_bake(tree)
            is_whole = taken_over is None or baked is not None and taken_over in baked.numbers
            self.is_resumed = is_same and is_whole and start == AUTO
            self._history = []
            if start == FROM_FRAME:
                taken_over = frame
                self._history = _history(baked, folder, graph.to_dict(defaults=True), frame, tree)
            elif not self.is_resumed:
                taken_over = None
            if baked is not None and not self.is_resumed or cache.is_elsewhere(tree):
                cache.make_own(tree)
                self.cache_id, folder = tree.cache_id, cache.folder(tree)
                graph.set_base_folder(folder)
            graph.set_cut_folder(cache.cuts(folder))
            graph.set_threads(tree.threads)
        except sunder.Error as error:
            self._told(error, tree)
            raise core.Refused(self.error, self.node) from error
        try:
            os.makedirs(folder, exist_ok=True)
            mesh_export.write(folder, compiled.files)
            looks.write(tree, folder)
            note = {
                "blend": cache.blend_name(), "tree": tree.name, "signature": signature.signature(tree, scene),
                "rest_matrices": compiled.rest_matrices, "rest_coordinates": compiled.rest_coordinates,
                "taken_over": taken_over, "warnings": told_before if self.is_resumed else {},
                **({"mesh_layers": compiled.mesh_layers} if compiled.mesh_layers else {}),
            }
        except OSError as error:
            raise core.Refused(f"{error.filename or folder}: {error.strerror}") from error
        self.folder, self._home = folder, cache.home()
        self._note, self._description, self._inputs = note, compiled.description, compiled.files.keys()
        self.graph, self._error_type = graph, sunder.Error
        self.frames = compiled.description["frame_range"]

    def _told(self, error, tree=None):
        self.error = error.what + (f" ({error.mend})" if error.mend else "")
        if error.parameter:
            self.error = f"{error.parameter}: {self.error}"
        elif error.where and not error.node:
            self.error = f"{error.where}: {self.error}"
        self.node = error.node

    def _blame(self, tree, graph_name, sentence):
        """Shows an error on the node that caused it; on the first that is baked if none did."""
        node = trees.find_node(tree, graph_name) if graph_name else None
        if node is None:
            node = next((n for n in tree.nodes if trees.is_node(n) and n.sunder_type == "deformer"), None)
        if node is not None:
            runtime.node_errors[tree.name_full, node.graph_name] = sentence

    def _work(self):
        """Yields the library's jobs one after the other, and None between what is done here."""
        for solver, _, path in self._history:
            state = core.sunder().read_state(path)
            if state.simulated_frame == int(state.simulated_frame):  # what lies between is made of these
                self.graph.seed_state(solver, int(state.simulated_frame), state)
            yield None
        if not self.is_resumed:
            # What cannot be baked is refused before the bake that is there is removed. (The bake finds this frame done.)
            nodes = self.graph.to_dict()["nodes"].items()
            meshes = [f"{name}.mesh" for name, fields in nodes if fields["type"] == "deformer"]
            job = self.graph.start_evaluate_all(meshes, self.frames[0])
            yield job
            job.result()
            cache.remove_old_inputs(self.folder, self._inputs)
            self._note["warnings"] = yield from bake_warnings.collect(self.graph, self.frames[0])
        cache.write_note(self.folder, self._note, self._description)
        job = self.graph.start_bake(self.folder, resume=self.is_resumed, restart=not self.is_resumed)
        self._bakes = True
        yield job
        self.report = job.result()
        self.warnings, self.fraction = self._note["warnings"], 1.0

    def start(self):
        runtime.jobs[self.cache_id] = self
        if self._history:  # the solvers go on from the last state; all must stay until they are written
            n_bytes = sum(os.path.getsize(path) for _, _, path in self._history)
            self.graph.set_cache_limit(max(_CACHE_LIMIT, 3 * n_bytes))
        self._steps, self._bakes, self.is_running = self._work(), False, True

    def advance(self):
        """To be called again and again: looks at the library's job, and goes on with what follows it."""
        if not self.is_running:
            return
        if self._at is not None:
            fraction, self.text = self._at.progress
            self.fraction = fraction if self._bakes else 0.0
            if self._is_to_stop and self._may_stop():
                self._at.cancel()
            if self._at.is_running:
                return
        elif self._is_to_stop and self._may_stop():
            self.is_cancelled, self.is_running = True, False
            return
        end = time.monotonic() + _LOOK / 2
        try:
            self._at = next(self._steps)
            while self._at is None and time.monotonic() < end:
                self._at = next(self._steps)
            return
        except StopIteration:
            pass
        except self._error_type as error:
            self.is_cancelled = error.code == "cancelled"
            if not self.is_cancelled:
                self._told(error)
        except OSError as error:
            self.error = f"{error.filename or self.folder}: {error.strerror}"
        except Exception as error:
            self.error = f"{type(error).__name__}: {error}"
        self.is_running = False

    def _may_stop(self):
        """What is taken over is written before the bake can be stopped: it is quick, and would be lost."""
        first, last = self.frames
        return not self._history or self.fraction * (last - first + 1) >= self._history[-1][1] - first + 1

    def cancel(self):
        """The bake ends after the step at work; what is whole stays and is resumed from."""
        self._is_to_stop = True
        self.advance()

    def wait(self, seconds=None):
        """Goes on until the end, or for about that time; whether it has ended."""
        end = None if seconds is None else time.monotonic() + seconds
        while self.is_running and (end is None or time.monotonic() < end):
            if self._at is not None:
                look = _LOOK / 50 if self._is_to_stop else _LOOK
                self._at.wait(look if end is None else max(0.0, min(look, end - time.monotonic())))
            self.advance()
        return not self.is_running

    def finish(self, tree):
        """Once it has ended, in the main thread: the tree (or None, if it is gone) shows what came of it."""
        self.wait()
        if runtime.jobs.get(self.cache_id) is self:
            del runtime.jobs[self.cache_id]
        if tree is not None and self._home.startswith(bpy.app.tempdir):
            cache.move_home(self._home)  # the file may have been saved meanwhile
        if tree is not None and self.error:
            self._blame(tree, self.node, self.error)


def _history(baked, folder, graph, frame, tree):
    """[(solver, frame, state file)] of a bake up to a frame, for a bake that goes on from there with other settings.

    Refuses where bodies would not be the same ones, or do not begin alike.
    """
    if baked is None or frame not in baked.numbers:
        has = f"are frames {baked.numbers[0]} to {baked.numbers[-1]}" if baked and baked.numbers else "is nothing"
        raise core.Refused(f"frame {frame} is not baked: there {has} to go on from")
    before, now = _what_stays(baked.graph), _what_stays(graph)
    for name in sorted(before.keys() | now.keys()):
        if before.get(name) != now.get(name):
            node = trees.find_node(tree, name)
            raise core.Refused("pieces, start and range must be those of the bake that goes on; bake anew instead",
                               node.graph_name if node else "")
    bakes = {f["state"][1:].rsplit(".", 1)[0]: name for name, f in baked.graph["nodes"].items()
             if f["type"] == "bake_state" and name.endswith(":bake")}
    return [(solver, n, os.path.join(folder, baked.frames[n][bake]))
            for n in baked.numbers if n <= frame for solver, bake in bakes.items()]


def _what_stays(graph):
    """What a state depends on apart from what moves it: {node: fields}."""
    kept = {"": [graph["frame_rate"], graph["frame_range"][0]]}
    for name, fields in graph["nodes"].items():
        if fields["type"] in ("mesh_file", "prefracture", "lattice"):
            kept[name] = fields
        elif fields["type"] == "body":
            kept[name] = [fields[k] for k in ("fragments", "position", "rotation")]
        elif fields["type"] == "solver":
            kept[name] = [fields.get(k) for k in ("bodies", "rigid_bodies")]
    return kept


def _is_same(baked, graph, version):
    """Whether a bake was made from this graph; the last frame may differ, and so may what the graph file's version
    says, as all parameters are written. Meshes are told apart by their names."""

    def plain(description):
        return {**description, "sunder": None, "frame_range": description["frame_range"][:1]}

    return baked.version == version and plain(baked.graph) == plain(graph.to_dict(defaults=True))
