"""Graphs of nodes: edited, evaluated, baked."""
from __future__ import annotations

import ctypes
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Optional, SupportsInt, TypedDict, Union

from .errors import Error
from .job import Job
from .library import (
    ABI_VERSION,
    BYTES,
    FRAMES,
    THREADS,
    Bake,
    BakeReport,
    BakeSettings,
    ExportSettings,
    FrameRange,
    Path,
    Progress,
    ProgressCallback,
    check,
    decode,
    dump,
    dump_graph,
    encode,
    frame_number,
    frame_pair,
    integer,
    lib,
    number,
    whole_ratio,
)
from .values import State, Value, wrap

if TYPE_CHECKING:
    from ._nodes import AddsNodes  # what nodes there are, for type checkers: _nodes.pyi, and nothing that runs
else:
    AddsNodes = object


class Check(TypedDict):
    """What `verify` found of a bake folder."""

    files: int
    bytes: int
    faults: list[str]
    missing_frames: list[int]


class Export(TypedDict):
    """What `export` wrote: files of the frames from the first to the last, and what whoever asked should know."""

    frames: list[int]
    files: list[str]
    note: str



def node_types() -> dict[str, dict[str, Any]]:
    """All node types as {type: description}, each with its sockets and parameters.

    A parameter's "group" is what it is shown with, "" for what is seen at once. Its "needs", where it has any, are alternatives,
    each a list of conditions on other parameters of the node: without one that holds it has no effect ("needs_text": in words).
    """
    return {node["type"]: node for node in json.loads(lib().sunder_node_types_json())["nodes"]}


def _holds(condition: dict[str, Any], value: Any) -> bool:
    """Of a parameter's value, one condition of another one's needs; true where keys may make it so."""
    if isinstance(value, dict):
        return True
    if "values" in condition:
        return value in condition["values"]
    if "above" in condition:
        return isinstance(value, (int, float)) and bool(value > condition["above"])
    return value is not None


class Node:
    """One node of a graph: `node["toughness"]` reads a parameter or wire, `node["toughness"] = 0.2` sets it."""

    def __init__(self, graph: Graph, name: str) -> None:
        self._graph, self.name = graph, name

    @property
    def type(self) -> str:
        return str(self._graph._fields(self.name)["type"])

    def __getitem__(self, parameter: str) -> Any:
        """The value as given, or its default: animated ones as {"keys": ...}, wires as "@node.socket"."""
        return self._graph._json("graph_get", encode(self.name), encode(parameter))

    def __setitem__(self, parameter: str, value: object) -> None:
        self._graph._call("graph_set", encode(self.name), encode(parameter), dump(value, self.name, parameter))

    def __delitem__(self, parameter: str) -> None:
        """Puts a parameter back to its default."""
        self._graph._call("graph_reset", encode(self.name), encode(parameter))

    def set(self, **parameters: object) -> Node:
        for name, value in parameters.items():
            self[name] = value
        return self

    def at(self, parameter: str, frame: float) -> Any:
        """A parameter's value at a frame, animation worked out."""
        return self._graph._json("graph_get_at", encode(self.name), encode(parameter), number("frame", frame))

    def has_effect(self, parameter: str) -> bool:
        """Whether a parameter counts as the node's other parameters are now: whether what it needs is so."""
        described = {p["name"]: p for p in node_types()[self.type]["parameters"]}
        if parameter not in described:
            self[parameter]  # raises what is wrong with it
            return True  # a wire, or a former name
        needs = described[parameter].get("needs")
        return needs is None or any(all(_holds(c, self[c["parameter"]]) for c in conditions) for conditions in needs)

    def parameters(self) -> dict[str, Any]:
        """Everything that is set or wired, defaults included."""
        fields = self._graph._fields(self.name, defaults=True)
        del fields["type"]
        return fields

    def __repr__(self) -> str:
        return f"<sunder node '{self.name}'>"


class Graph(AddsNodes):
    """A graph of nodes. Not to be used from two threads at once; `cancel` alone may come from another.

    While a Job of it has not been finished (Job.result), and from within `progress`, everything but `cancel` raises Error
    with code "bad_usage".
    """

    def __init__(self) -> None:
        self._pointer = ctypes.c_void_p()
        if lib().sunder_graph_create(ABI_VERSION, ctypes.byref(self._pointer)) != 0:
            raise Error("internal", "a graph could not be made")

    def __del__(self) -> None:
        if getattr(self, "_pointer", None):
            lib().sunder_graph_free(self._pointer)

    def _call(self, function: str, *arguments: Any) -> None:
        check(getattr(lib(), "sunder_" + function)(self._pointer, *arguments), lib().sunder_graph_error, self._pointer)

    def _json(self, function: str, *arguments: Any) -> Any:
        text = ctypes.c_char_p()
        self._call(function, *arguments, ctypes.byref(text))
        return json.loads(decode(text.value))

    def _long_call(self, function: str, progress: Optional[ProgressCallback], *arguments: Any) -> None:
        """`arguments` may hold the placeholder Progress, where the progress struct goes."""
        p = Progress(progress)
        given = [ctypes.byref(p.struct) if a is Progress else a for a in arguments]
        status = getattr(lib(), "sunder_" + function)(self._pointer, *given)
        p.check(status, lib().sunder_graph_error, self._pointer)

    # Files

    @classmethod
    def load(cls, path: Path) -> Graph:
        """Reads a graph file; input paths are seen from its folder."""
        graph = cls()
        graph._call("graph_load", encode(path))
        return graph

    @classmethod
    def from_dict(cls, description: Union[dict[str, Any], str], base_folder: Path = "", name: str = "graph") -> Graph:
        """A graph from what a graph file holds, as a dict or JSON text."""
        graph = cls()
        text = encode(description) if isinstance(description, str) else dump_graph(description)
        graph._call("graph_parse", text, encode(name), encode(base_folder))
        return graph

    def save(self, path: Path) -> None:
        self._call("graph_save", encode(path))

    def to_dict(self, defaults: bool = False) -> Any:
        """What a graph file holds; with `defaults`, parameters left at their default too."""
        return self._json("graph_json", int(defaults))

    # Nodes and wires

    if not TYPE_CHECKING:  # AddsNodes tells what each type takes

        def add(self, type, name, **parameters):
            """Adds a node and sets its parameters and wires; nothing is added if one of them is refused."""
            return self._add(type, name, parameters)

    def _add(self, type: str, name: str, parameters: dict[str, object]) -> Node:
        self._call("graph_add_node", encode(name), encode(type))
        node = Node(self, name)
        try:
            return node.set(**parameters)
        except BaseException:
            self.remove(name)
            raise

    def remove(self, name: str) -> None:
        self._call("graph_remove_node", encode(name))

    def connect(self, output: str, input: str) -> None:
        """Wires "node.output" to "node.input"; an input that takes a list gets one more."""
        self._call("graph_connect", encode(output), encode(input))

    def disconnect(self, input: str) -> None:
        self._call("graph_disconnect", encode(input))

    def _unknown(self, name: object) -> Error:
        return Error(
            "bad_input",
            f"node '{name}': there is no node of that name (permitted: {', '.join(self)})",
            node=str(name),
        )

    def _fields(self, name: str, defaults: bool = False) -> dict[str, Any]:
        """A node as a graph file holds it."""
        nodes: dict[str, dict[str, Any]] = self.to_dict(defaults)["nodes"]
        if name not in nodes:
            raise self._unknown(name)
        return nodes[name]

    def __getitem__(self, name: str) -> Node:
        if name not in self:
            raise self._unknown(name)
        return Node(self, name)

    def __contains__(self, name: object) -> bool:
        return name in self.to_dict()["nodes"]

    def __iter__(self) -> Iterator[str]:
        return iter(self.to_dict()["nodes"])

    def __len__(self) -> int:
        return len(self.to_dict()["nodes"])

    # Settings

    @property
    def frame_range(self) -> FrameRange:
        first, last = self.to_dict()["frame_range"]
        return first, last

    @frame_range.setter
    def frame_range(self, first_last: Sequence[int]) -> None:
        self._call("graph_set_frame_range", *frame_pair("frame_range", first_last))

    @property
    def frame_rate(self) -> float:
        """Frames per second. It takes a ratio, too, which nothing rounds: (24000, 1001), or Fraction(24000, 1001)."""
        rate = self.to_dict()["frame_rate"]
        return float(rate[0] / rate[1]) if isinstance(rate, list) else float(rate)

    @frame_rate.setter
    def frame_rate(self, frames_per_second: Union[float, Fraction, Sequence[int]]) -> None:
        ratio = whole_ratio("frame_rate", frames_per_second)
        if ratio is None:
            self._call("graph_set_frame_rate", number("frame_rate", frames_per_second))
        else:
            self._call("graph_set_frame_ratio", *ratio)

    def set_threads(self, threads: SupportsInt) -> None:
        """0: all cores. Changes no result."""
        self._call("graph_set_threads", integer("threads", threads, THREADS))

    def set_cache_limit(self, n_bytes: SupportsInt) -> None:
        """Of past frames, that each solver keeps."""
        self._call("graph_set_cache_limit", integer("cache limit", n_bytes, BYTES))

    def set_base_folder(self, folder: Path) -> None:
        """Input paths are seen from it."""
        self._call("graph_set_base_folder", encode(folder))

    def set_cut_folder(self, folder: Path) -> None:
        """What prefracture nodes cut is kept there and not cut again, also by another graph later. Changes no result."""
        self._call("graph_set_cut_folder", encode(folder))

    # Work

    def evaluate(self, output: str, frame: Optional[SupportsInt] = None, progress: Optional[ProgressCallback] = None) -> Value:
        """The value of "node.socket" at a frame (the first of the range unless given): State, Mesh, Fragments or Value.
        Between two frames, as at 12.5, it is blended of what is simulated.

        `progress(fraction, text)` is called now and then and returns False to cancel (Error with code "cancelled").
        """
        at = self._frame(frame)
        if isinstance(at, float):
            return self.evaluate_all([output], at, progress)[0]
        out = ctypes.c_void_p()
        self._long_call("graph_evaluate", progress, encode(output), at, Progress, ctypes.byref(out))
        return wrap(out)

    def evaluate_all(self, outputs: Iterable[str], frame: Optional[SupportsInt] = None,
                     progress: Optional[ProgressCallback] = None) -> list[Value]:
        """The values of several "node.socket" at a frame, in their order; sooner than one by one where they are meshes.

        Raises the first one's Error that has one; the others are made nevertheless, and `evaluate` finds them done.
        """
        names, n, at = self._wanted(outputs, frame)
        out = (ctypes.c_void_p * n)()
        try:
            self._long_call("graph_evaluate_all_at", progress, names, n, at, Progress, out)
        finally:
            values = [wrap(ctypes.c_void_p(pointer)) for pointer in out if pointer]  # freed with what wraps them
        return values

    def _wanted(self, outputs: Iterable[str], frame: Optional[SupportsInt]) -> tuple[ctypes.Array[ctypes.c_char_p], int, float]:
        if isinstance(outputs, str) or not isinstance(outputs, Iterable):
            raise Error("bad_usage", f"{outputs!r} is no list of outputs")
        names = [encode(output) for output in outputs]
        return (ctypes.c_char_p * len(names))(*names), len(names), self._frame(frame)

    def _frame(self, frame: Optional[SupportsInt]) -> Union[int, float]:
        """An int of a whole frame, a float between two."""
        return self.frame_range[0] if frame is None else frame_number(frame)

    def seed_state(self, node: str, frame: SupportsInt, state: State) -> None:
        """Makes a solver continue from a State at a frame. What was simulated of later frames is forgotten; the state given last
        stays, however small the cache, and those before it as long as they fit (`set_cache_limit`)."""
        self._place("graph_seed_state", node, frame, state)

    def show_state(self, node: str, frame: SupportsInt, state: State) -> None:
        """The same for looking at that frame alone, also of a State that lies between two simulated frames: later frames go on from
        it as if it were one of these, and are of no use."""
        self._place("graph_show_state", node, frame, state)

    def _place(self, function: str, node: str, frame: SupportsInt, state: State) -> None:
        if not isinstance(state, State):
            raise Error("bad_usage", f"{state!r} is no State")
        self._call(function, encode(node), integer("frame", frame, FRAMES), state._handle.pointer)

    def cancel(self) -> None:
        """From another thread: what is being evaluated or baked stops as soon as its data are whole."""
        lib().sunder_graph_cancel(self._pointer)

    def bake(self, folder: Path, frames: Optional[Sequence[int]] = None, resume: bool = False, restart: bool = False,
             progress: Optional[ProgressCallback] = None) -> Bake:
        """Evaluates every bake node over `frames` (first, last) into `folder`; returns a dict of what was written."""
        settings, report = _bake_settings(folder, frames, resume, restart), BakeReport()
        self._long_call("graph_bake", progress, ctypes.byref(settings), Progress, ctypes.byref(report))
        return report.as_dict()

    def start_evaluate(self, output: str, frame: Optional[SupportsInt] = None) -> Job:
        """A Job that evaluates on a thread of the library's own; `evaluate` then finds it done."""
        at = self._frame(frame)
        if isinstance(at, float):
            return self.start_evaluate_all([output], at)
        return Job(self, "graph_start_evaluate", encode(output), at)

    def start_evaluate_all(self, outputs: Iterable[str], frame: Optional[SupportsInt] = None) -> Job:
        """A Job that evaluates on a thread of the library's own; `evaluate_all` and `evaluate` then find it done."""
        return Job(self, "graph_start_evaluate_all_at", *self._wanted(outputs, frame))

    def start_bake(self, folder: Path, frames: Optional[Sequence[int]] = None, resume: bool = False,
                   restart: bool = False) -> Job:
        """A Job that bakes on a thread of the library's own, as `bake`."""
        return Job(self, "graph_start_bake", ctypes.byref(_bake_settings(folder, frames, resume, restart)))


def _bake_settings(folder: Path, frames: Optional[Sequence[int]], resume: bool, restart: bool) -> BakeSettings:
    if resume and restart:
        raise Error("bad_usage", "bake: resume and restart exclude one another")
    start = 1 if resume else 2 if restart else 0
    return BakeSettings(start, encode(folder), *_frame_settings(frames))


def _frame_settings(frames: Optional[Sequence[int]]) -> tuple[int, int, int]:
    """has_frames, first_frame, last_frame"""
    return (0, 0, 0) if frames is None else (1, *frame_pair("frames", frames))


def bake(graph: Union[Graph, Path], folder: Path, frames: Optional[Sequence[int]] = None, threads: Optional[SupportsInt] = None,
         resume: bool = False, restart: bool = False, progress: Optional[ProgressCallback] = None) -> Bake:
    """Bakes a Graph, or the graph file of that path."""
    g = graph if isinstance(graph, Graph) else Graph.load(os.fspath(graph))
    if threads is not None:
        g.set_threads(threads)
    return g.bake(folder, frames=frames, resume=resume, restart=restart, progress=progress)


def verify(folder: Path, progress: Optional[ProgressCallback] = None) -> Check:
    """Compares a bake with its manifest: {"files", "bytes", "faults", "missing_frames"}; whole if no faults."""
    graph, text = Graph(), ctypes.c_char_p()
    graph._long_call("graph_verify_bake", progress, encode(folder), Progress, ctypes.byref(text))
    found: Check = json.loads(decode(text.value))
    return found


def export(bake: Path, file: Path, node: Optional[str] = None, frames: Optional[Sequence[int]] = None, tolerance: float = 0.005,
           overwrite: bool = False, progress: Optional[ProgressCallback] = None) -> Export:
    """Writes a bake folder as `file`: .usda, .glb, .pc2 (with its mesh as .obj), or a sequence .####.ply or .####.obj.

    `node`: one bake_mesh node's mesh, all unless given; `frames` (first, last). In .glb fragments are rigid: `tolerance` is
    how far a vertex may be from that, as a share of its body's size. Returns {"frames", "files", "note"}.
    """
    graph, text = Graph(), ctypes.c_char_p()
    texts = encode(bake), encode(file), encode(node or "")
    settings = ExportSettings(int(overwrite), *texts, *_frame_settings(frames), number("tolerance", tolerance))
    graph._long_call("graph_export_bake", progress, ctypes.byref(settings), Progress, ctypes.byref(text))
    written: Export = json.loads(decode(text.value))
    return written


def read_state(path: Path) -> State:
    """A state frame that a bake wrote, as a State; what the file does not tell (rest shapes, masses) is NaN."""
    graph, out = Graph(), ctypes.c_void_p()
    graph._call("graph_read_state", encode(path), ctypes.byref(out))
    state = wrap(out)
    assert isinstance(state, State)
    return state
