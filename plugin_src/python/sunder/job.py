"""Long work on a thread of the library's own, looked at from this one: no Python runs beside the caller's."""
from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

from .library import BakeReport, JobState, check, decode, lib, number

if TYPE_CHECKING:
    from .graph import Graph
    from .library import Bake


class Job:
    """What Graph.start_evaluate or start_bake has begun.

    The graph is the job's until `result` was asked for, or nobody refers to the job any more; what is asked of it meanwhile
    raises Error with code "bad_usage".
    """

    def __init__(self, graph: Graph, function: str, *arguments: Any) -> None:
        self._graph, self._pointer = graph, ctypes.c_void_p()
        graph._call(function, *arguments, ctypes.byref(self._pointer))

    def __del__(self) -> None:
        if getattr(self, "_pointer", None):
            lib().sunder_job_free(self._pointer)

    def _look(self) -> JobState:
        state = JobState()
        lib().sunder_job_look(self._pointer, ctypes.byref(state))
        return state

    @property
    def is_running(self) -> bool:
        return bool(self._look().is_running)

    @property
    def progress(self) -> tuple[float, str]:
        """(fraction from 0 to 1, what it is at)."""
        state = self._look()
        return state.fraction, decode(state.text)

    def cancel(self) -> None:
        """It ends as soon as its data are whole; `result` then raises Error with code "cancelled"."""
        lib().sunder_job_cancel(self._pointer)

    def wait(self, seconds: float = 0.0) -> bool:
        """Whether it has ended within that time."""
        return bool(lib().sunder_job_wait(self._pointer, number("seconds", seconds)))

    def result(self) -> Bake:
        """Waits for the end; of a bake what Graph.bake returns. Raises Error if it failed."""
        report = BakeReport()
        status = lib().sunder_job_finish(self._pointer, ctypes.byref(report))
        check(status, lib().sunder_graph_error, self._graph._pointer)
        return report.as_dict()
