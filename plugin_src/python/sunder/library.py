"""libsunder.so: found, checked, and its functions as Python sees them (plugin_src/c_api/sunder.h)."""
from __future__ import annotations

import ctypes
import glob
import json
import math
import os
import platform
import re
import sys
from collections.abc import Sequence
from ctypes import POINTER, c_char_p, c_double, c_int32, c_uint32, c_uint64, c_void_p
from fractions import Fraction
from typing import Any, Callable, Optional, TypedDict, Union

from .errors import CODES, Error

ABI_VERSION = 1

Path = Union[str, "os.PathLike[str]"]
FrameRange = tuple[int, int]  # first and last
ProgressCallback = Callable[[float, str], object]  # (fraction from 0 to 1, what it is at): False cancels


class Bake(TypedDict):
    """What was baked: the frames of the bake, the first that was not there before, and what was written. `warnings` are sentences
    that name their nodes: what was done to meshes, what a solver leaves out, what never happens. Empty where nothing was new.
    """

    frames: FrameRange
    first_new_frame: int
    n_frames: int
    n_files: int
    bytes: int
    warnings: list[str]


ProgressFunction = ctypes.CFUNCTYPE(c_int32, c_void_p, c_double, c_char_p)


class _Sized(ctypes.Structure):
    """A struct that begins with its size."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(ctypes.sizeof(type(self)), *args, **kwargs)


class ErrorStruct(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("status", c_int32),
        ("text", c_char_p),
        ("where", c_char_p),
        ("what", c_char_p),
        ("mend", c_char_p),
        ("node", c_char_p),
        ("parameter", c_char_p),
    ]


class ProgressStruct(_Sized):
    _fields_ = [("struct_size", c_uint32), ("function", ProgressFunction), ("user", c_void_p)]


class ArrayStruct(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("type", c_int32),
        ("data", c_void_p),
        ("rank", c_uint32),
        ("shape", c_uint64 * 4),
    ]


class BakeSettings(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("start", c_int32),
        ("folder", c_char_p),
        ("has_frames", c_int32),
        ("first_frame", c_int32),
        ("last_frame", c_int32),
    ]


class BakeReport(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("first_frame", c_int32),
        ("last_frame", c_int32),
        ("first_new_frame", c_int32),
        ("n_frames", c_uint64),
        ("n_files", c_uint64),
        ("bytes", c_uint64),
        ("notes", c_char_p),
    ]

    def as_dict(self) -> Bake:
        warnings = json.loads(decode(self.notes)) if self.notes else []
        return {"frames": (self.first_frame, self.last_frame), "first_new_frame": self.first_new_frame,
                "n_frames": self.n_frames, "n_files": self.n_files, "bytes": self.bytes, "warnings": warnings}


class JobState(_Sized):
    _fields_ = [("struct_size", c_uint32), ("is_running", c_int32), ("fraction", c_double), ("text", c_char_p)]


class ExportSettings(_Sized):
    _fields_ = [
        ("struct_size", c_uint32),
        ("overwrite", c_int32),
        ("bake", c_char_p),
        ("file", c_char_p),
        ("node", c_char_p),
        ("has_frames", c_int32),
        ("first_frame", c_int32),
        ("last_frame", c_int32),
        ("tolerance", c_double),
    ]


_TEXT = POINTER(c_char_p)  # also an array of texts
_HANDLE = POINTER(c_void_p)  # also an array of handles
_PROGRESS = POINTER(ProgressStruct)
_FUNCTIONS = {  # name: (result, arguments)
    "abi_version": (c_uint32, []),
    "version": (c_char_p, []),
    "node_types_json": (c_char_p, []),
    "graph_create": (c_int32, [c_uint32, _HANDLE]),
    "graph_free": (None, [c_void_p]),
    "graph_error": (None, [c_void_p, POINTER(ErrorStruct)]),
    "graph_load": (c_int32, [c_void_p, c_char_p]),
    "graph_parse": (c_int32, [c_void_p, c_char_p, c_char_p, c_char_p]),
    "graph_save": (c_int32, [c_void_p, c_char_p]),
    "graph_json": (c_int32, [c_void_p, c_int32, _TEXT]),
    "graph_add_node": (c_int32, [c_void_p, c_char_p, c_char_p]),
    "graph_remove_node": (c_int32, [c_void_p, c_char_p]),
    "graph_connect": (c_int32, [c_void_p, c_char_p, c_char_p]),
    "graph_disconnect": (c_int32, [c_void_p, c_char_p]),
    "graph_set": (c_int32, [c_void_p, c_char_p, c_char_p, c_char_p]),
    "graph_get": (c_int32, [c_void_p, c_char_p, c_char_p, _TEXT]),
    "graph_get_at": (c_int32, [c_void_p, c_char_p, c_char_p, c_double, _TEXT]),
    "graph_reset": (c_int32, [c_void_p, c_char_p, c_char_p]),
    "graph_set_frame_rate": (c_int32, [c_void_p, c_double]),
    "graph_set_frame_ratio": (c_int32, [c_void_p, c_int32, c_int32]),
    "graph_set_frame_range": (c_int32, [c_void_p, c_int32, c_int32]),
    "graph_set_threads": (c_int32, [c_void_p, c_int32]),
    "graph_set_cache_limit": (c_int32, [c_void_p, c_uint64]),
    "graph_set_base_folder": (c_int32, [c_void_p, c_char_p]),
    "graph_set_cut_folder": (c_int32, [c_void_p, c_char_p]),
    "graph_cancel": (None, [c_void_p]),
    "graph_evaluate": (c_int32, [c_void_p, c_char_p, c_int32, _PROGRESS, _HANDLE]),
    "graph_evaluate_all_at": (c_int32, [c_void_p, _TEXT, c_uint32, c_double, _PROGRESS, _HANDLE]),
    "graph_read_state": (c_int32, [c_void_p, c_char_p, _HANDLE]),
    "graph_seed_state": (c_int32, [c_void_p, c_char_p, c_int32, c_void_p]),
    "graph_show_state": (c_int32, [c_void_p, c_char_p, c_int32, c_void_p]),
    "graph_bake": (c_int32, [c_void_p, POINTER(BakeSettings), _PROGRESS, POINTER(BakeReport)]),
    "graph_start_evaluate": (c_int32, [c_void_p, c_char_p, c_int32, _HANDLE]),
    "graph_start_evaluate_all_at": (c_int32, [c_void_p, _TEXT, c_uint32, c_double, _HANDLE]),
    "graph_start_bake": (c_int32, [c_void_p, POINTER(BakeSettings), _HANDLE]),
    "job_look": (None, [c_void_p, POINTER(JobState)]),
    "job_cancel": (None, [c_void_p]),
    "job_wait": (c_int32, [c_void_p, c_double]),
    "job_finish": (c_int32, [c_void_p, POINTER(BakeReport)]),
    "job_free": (None, [c_void_p]),
    "graph_verify_bake": (c_int32, [c_void_p, c_char_p, _PROGRESS, _TEXT]),
    "graph_report_bake": (c_int32, [c_void_p, c_char_p, c_char_p, _TEXT]),
    "graph_export_bake": (c_int32, [c_void_p, POINTER(ExportSettings), _PROGRESS, _TEXT]),
    "value_free": (None, [c_void_p]),
    "value_error": (None, [c_void_p, POINTER(ErrorStruct)]),
    "value_type": (c_char_p, [c_void_p]),
    "value_array_count": (c_uint32, [c_void_p]),
    "value_array_name": (c_char_p, [c_void_p, c_uint32]),
    "value_array": (c_int32, [c_void_p, c_char_p, POINTER(ArrayStruct)]),
    "value_info": (c_int32, [c_void_p, _TEXT]),
    "value_part": (c_int32, [c_void_p, c_char_p, c_uint64, _HANDLE]),
    "value_write_fragments": (c_int32, [c_void_p, c_char_p, _PROGRESS]),
}


def _candidates() -> list[str]:
    """Where the library may lie, best first: as SUNDER_LIBRARY names it, beside the package, in a build folder."""
    named = os.environ.get("SUNDER_LIBRARY")
    if named:
        return [named]
    here = os.path.dirname(os.path.abspath(__file__))
    tree = os.path.normpath(os.path.join(here, "..", "..", ".."))
    built = glob.glob(os.path.join(tree, "build*", "plugin_src", "libsunder.so"))
    own = os.path.join(tree, "build", "plugin_src", "libsunder.so")  # the one that ./sunder builds goes before others
    return [os.path.join(here, "libsunder.so"), *sorted(built, key=lambda path: (path != own, path))]


_PROCESSORS = {3: "x86", 40: "ARM", 62: "x86-64", 183: "ARM64"}  # ELF's numbers of them
_MACHINES = {"x86_64": 62, "amd64": 62, "aarch64": 183, "arm64": 183}


def _foreign(path: str) -> Optional[Error]:
    """The error of a library that is for another processor than this Python, None for one that is not: the system's linker
    would say that it is no library, or not there."""
    try:
        with open(path, "rb") as file:
            head = file.read(20)
    except OSError:
        return None
    if head[:4] != b"\x7fELF" or len(head) < 20:
        return None
    bits, here = {1: 32, 2: 64}.get(head[4]), 64 if sys.maxsize > 2**32 else 32
    processor, machine = int.from_bytes(head[18:20], "little"), platform.machine()
    if bits == here and _MACHINES.get(machine.lower(), processor) == processor:
        return None
    what = f"is for {bits}-bit programs on {_PROCESSORS.get(processor, 'other')}, and this is a {here}-bit Python on {machine}"
    mend = "use Sunder's package for this system, or build Sunder on it"
    return Error("bad_input", f"{path}: {what} ({mend})", what, path, mend)


def _libc() -> Optional[str]:
    """This system's C library with its version; None if it is not glibc."""
    try:
        return os.confstr("CS_GNU_LIBC_VERSION")
    except (AttributeError, ValueError, OSError):
        return None


def _unusable(path: str, told: str) -> Error:
    """What the system's linker says of a library, as an error that names what is missing and how to get it."""
    missing = re.match(r"(?P<name>[^\s/:]+): cannot open shared object file: No such file", told)
    if missing:
        name = missing["name"]
        stem, _, version = name.partition(".so.")
        stem = stem.lower().replace("_", "-")  # as Debian names packages: libassimp5, libimath-3-1-29
        mend = f"install it; on Debian it is {stem}{'-' if stem[-1].isdigit() else ''}{version}"
        what = f"needs {name}, which this system has not"
    elif too_old := re.search(r"version `(\w+?)_([\d.]+)' not found", told):
        have = f"this system has {_libc()}" if too_old[1] == "GLIBC" and _libc() else "this system's is older"
        what, mend = f"needs {too_old[1]} {too_old[2]}, and {have}", "use a later system, or build Sunder on this one"
    elif sys.platform == "linux" and not _libc():
        what, mend = f"needs glibc, and this system has another C library: {told}", "use a system with glibc 2.28 or later"
    else:
        return Error("bad_input", f"{path}: is not Sunder's library: {told}")
    return Error("bad_input", f"{path}: {what} ({mend})", what, path, mend)


def _load() -> ctypes.CDLL:
    candidates = _candidates()
    path = next((p for p in candidates if os.path.exists(p)), None)
    if path is None:
        raise Error(
            "bad_input",
            "libsunder.so: is not there (build it with ./sunder, or name it in SUNDER_LIBRARY); looked for "
            + ", ".join(candidates),
        )
    if foreign := _foreign(path):
        raise foreign
    try:
        library = ctypes.CDLL(path)
        found = library.sunder_abi_version
    except (OSError, AttributeError) as error:
        raise _unusable(path, str(error)) from error
    found.restype = c_uint32
    if found() != ABI_VERSION:
        raise Error(
            "bad_input",
            f"{path}: speaks version {found()} of the interface, this package {ABI_VERSION} (use the package "
            "that came with the library)",
        )
    for name, (result, arguments) in _FUNCTIONS.items():
        function = getattr(library, "sunder_" + name, None)
        if function is None:  # additions leave the version of the interface
            raise Error(
                "bad_input",
                f"{path}: is older than this package, it has no sunder_{name} (use the package that came with the library)",
            )
        function.restype, function.argtypes = result, arguments
    return library


_library: Optional[ctypes.CDLL] = None


def lib() -> ctypes.CDLL:
    """The library, loaded when it is first needed."""
    global _library
    if _library is None:
        _library = _load()
    return _library


def version() -> str:
    return decode(lib().sunder_version())


def encode(text: object) -> bytes:
    """Text or a path as the library takes it."""
    try:
        data = os.fsencode(text) if isinstance(text, os.PathLike) else str(text).encode("utf-8", "surrogateescape")
    except UnicodeEncodeError as error:
        raise Error("bad_usage", f"{text!a} is no text: {error.reason}") from error
    if b"\0" in data:
        raise Error("bad_usage", "a text holds a zero byte")
    return data


def decode(data: Optional[bytes]) -> str:
    return (data or b"").decode("utf-8", "replace")


def _refusal(code: str, where: str, what: str, mend: str = "", **concerned: str) -> Error:
    text = (f"{where}: " if where else "") + what + (f" ({mend})" if mend else "")
    return Error(code, text, what, where, mend, **concerned)


def dump(value: object, node: str = "", parameter: str = "") -> bytes:
    """A Python value as JSON text; numpy numbers and arrays are welcome. Errors name the parameter that it is for."""

    def plain(other: Any) -> object:
        if hasattr(other, "tolist"):
            return other.tolist()
        if isinstance(other, os.PathLike):
            return os.fspath(other)
        raise TypeError(f"a {type(other).__name__} is no parameter value")

    def refusal(code: str, what: str) -> Error:
        where = f"node '{node}', parameter '{parameter}'" if node else ""
        return _refusal(code, where, what, node=str(node), parameter=str(parameter))

    try:
        return json.dumps(value, default=plain, allow_nan=False).encode()
    except TypeError as error:
        raise refusal("bad_usage", str(error)) from error
    except (ValueError, RecursionError) as error:
        raise refusal("bad_input", f"a value is not finite or refers to itself: {error}") from error


def dump_graph(description: Any) -> bytes:
    """What a graph file holds, as JSON text; errors name the node's parameter."""
    try:
        return dump(description)
    except Error:
        nodes = description.get("nodes") if isinstance(description, dict) else None
        for node, fields in nodes.items() if isinstance(nodes, dict) else ():
            for parameter, value in fields.items() if isinstance(fields, dict) else ():
                dump(value, node, parameter)
        raise


FRAMES = (-1_000_000, 1_000_000)  # the library's own limits; ctypes would cut off what does not fit C's integers
THREADS = (0, 1024)
CLUSTERS = (-(2**31) + 1, 2**31 - 1)
BYTES = (0, 2**64 - 1)


def integer(name: str, value: Any, permitted: Optional[tuple[int, int]] = None) -> int:
    """A whole number of any type as an int; `permitted` (lowest, highest)."""
    try:
        whole = int(value)
        is_whole = bool(whole == value)
    except (TypeError, ValueError, OverflowError):
        is_whole = False
    if not is_whole:
        raise _refusal("bad_usage", name, f"{value!r} is no whole number")
    if permitted and not permitted[0] <= whole <= permitted[1]:
        raise _refusal("bad_input", name, f"{whole} is out of range", f"permitted: {permitted[0]} to {permitted[1]}")
    return whole


def frame_number(value: Any) -> Union[int, float]:
    """A frame, or what lies between two: an int of a whole one."""
    at = number("frame", value)
    if at == at // 1:
        return integer("frame", value, FRAMES)
    if not FRAMES[0] <= at <= FRAMES[1]:
        raise _refusal("bad_input" if math.isfinite(at) else "bad_usage", "frame", f"{at} is out of range", f"permitted: {FRAMES[0]} to {FRAMES[1]}")
    return at


def frame_pair(name: str, first_last: Any) -> FrameRange:
    """(first, last) frame as ints."""
    try:
        first, last = first_last
    except (TypeError, ValueError) as error:
        raise _refusal("bad_usage", name, f"{first_last!r} is no pair of frames (first, last)") from error
    return integer(name, first, FRAMES), integer(name, last, FRAMES)


TERMS = (1, 10_000_000)  # of a ratio, as the library has it


def whole_ratio(name: str, value: Any) -> Optional[tuple[int, int]]:
    """(24000, 1001) and Fraction(24000, 1001) as ints; None of what is no ratio."""
    if isinstance(value, Fraction):
        value = value.numerator, value.denominator
    if isinstance(value, str) or not isinstance(value, Sequence):
        return None
    if len(value) != 2:
        raise _refusal("bad_usage", name, f"{value!r} is no ratio (frames, seconds)")
    return integer(name, value[0], TERMS), integer(name, value[1], TERMS)


def number(name: str, value: Any) -> float:
    """A float, of what Python itself takes for one: text is none."""
    try:
        return c_double(value).value
    except (TypeError, OverflowError) as error:
        raise _refusal("bad_usage", name, f"{value!r} is no number") from error


def check(status: int, tell: Callable[..., None], handle: Any) -> None:
    """Raises what `tell` (graph_error or value_error) says of the handle, unless the status is 0."""
    if status == 0:
        return
    e = ErrorStruct()
    tell(handle, ctypes.byref(e))
    texts = {name: decode(getattr(e, name)) for name in ("what", "where", "mend", "node", "parameter")}
    raise Error(CODES[status] if 0 < status < len(CODES) else "internal", decode(e.text) or "unknown error", **texts)


class Progress:
    """A Python callable as a progress function. What it raises (Ctrl-C too) cancels the job and is raised again."""

    def __init__(self, callable_: Optional[ProgressCallback]) -> None:
        self.raised: Optional[BaseException] = None

        def report(_user: Optional[int], fraction: float, text: bytes) -> int:
            try:
                return 1 if callable_ is None or callable_(fraction, decode(text)) is not False else 0
            except BaseException as error:  # nothing may be thrown into C
                self.raised = error
                return 0

        self._function = ProgressFunction(report)
        self.struct = ProgressStruct(self._function, None)

    def check(self, status: int, tell: Callable[..., None], handle: Any) -> None:
        if self.raised is not None:
            raise self.raised
        check(status, tell, handle)
