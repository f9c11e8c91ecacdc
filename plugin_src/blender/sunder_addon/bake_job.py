"""One bake: compiled in the main thread, run in a thread of its own (or in place), cancelled at any moment."""
import os
import threading

import bpy

from . import cache, compiler, core, mesh_export, runtime, signature, tree as trees

AUTO, RESTART = "AUTO", "RESTART"


class BakeJob:
    """Refuses (core.Refused, core.Unusable) when it is made, or ends with `error`; `node` names the node at fault.

    fraction, text: progress. After the end: report (of the library) or error or is_cancelled.
    """

    def __init__(self, tree, scene, start=AUTO):
        self.tree_name, self.cache_id = tree.name_full, trees.identity(tree)
        self.fraction, self.text = 0.0, "preparing"
        self.report, self.error, self.node, self.is_cancelled = None, "", "", False
        self._cancel = threading.Event()
        self._thread = None
        runtime.forget_errors(tree.name_full)
        try:
            self._prepare(tree, scene, start)
        except core.Refused as refused:
            self._blame(tree, refused.node, str(refused))
            raise

    def _prepare(self, tree, scene, start):
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
            self.is_resumed = is_same and start == AUTO
            if baked is not None and not self.is_resumed or cache.is_elsewhere(tree):
                cache.make_own(tree)
                self.cache_id, folder = tree.cache_id, cache.folder(tree)
                graph.set_base_folder(folder)
            graph.set_threads(tree.threads)
        except sunder.Error as error:
            self._told(error, tree)
            raise core.Refused(self.error, self.node) from error
        try:
            os.makedirs(folder, exist_ok=True)
            mesh_export.write(folder, compiled.files)
            if not self.is_resumed:
                cache.remove_old_inputs(folder, compiled.files)
            content = {
                "blend": cache.blend_name(), "tree": tree.name, "signature": signature.signature(tree, scene),
                "rest_matrices": compiled.rest_matrices,
            }
            cache.write_note(folder, content, compiled.description)
        except OSError as error:
            raise core.Refused(f"{error.filename or folder}: {error.strerror}") from error
        self.folder, self._home = folder, cache.home()
        self._graph, self._error_type = graph, sunder.Error
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
        try:
            start = {"resume": True} if self.is_resumed else {"restart": True}
            self.report = self._graph.bake(self.folder, progress=self._progress, **start)
            self.fraction = 1.0
        except self._error_type as error:
            self.is_cancelled = error.code == "cancelled"
            if not self.is_cancelled:
                self._told(error)
        except BaseException as error:  # the thread's end is the only place where this can be seen
            self.error = f"{type(error).__name__}: {error}"

    def _progress(self, fraction, text):
        self.fraction, self.text = fraction, text
        return not self._cancel.is_set()

    def start(self):
        runtime.jobs[self.cache_id] = self
        self._thread = threading.Thread(target=self._work, name="sunder bake", daemon=True)
        self._thread.start()

    @property
    def is_running(self):
        return self._thread is not None and self._thread.is_alive()

    def cancel(self):
        """The bake ends after the step at work; what is whole stays and is resumed from."""
        self._cancel.set()

    def wait(self, seconds=None):
        self._thread.join(seconds)
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


def _is_same(baked, graph, version):
    """Whether a bake was made from this graph; the last frame may differ. Meshes are told apart by their names."""

    def plain(description):
        return {**description, "frame_range": description["frame_range"][:1]}

    return baked.version == version and plain(baked.graph) == plain(graph.to_dict(defaults=True))
