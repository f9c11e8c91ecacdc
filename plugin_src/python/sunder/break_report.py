"""What broke in a bake, when and why, and what its fragments bore."""
from __future__ import annotations

import ctypes
import json
from collections.abc import Iterable, Sequence
from typing import Any, Optional, SupportsInt, TypedDict, Union

from .graph import Graph
from .library import CLUSTERS, FRAMES, Path, decode, dump, encode, integer


class Break(TypedDict):
    """An edge that broke. `by`: what pressed hardest on its piece then; `by_kind`: "body", "rigid_body", "collider", "seam" or "nothing"."""

    frame: int
    time: float
    solver: str
    body: str
    edge: int
    fragments: list[int]
    position: list[float]
    strain: float
    toughness: float
    by_kind: str
    by: Optional[str]
    by_fragment: Optional[int]


class Pieces(TypedDict):
    """A frame in which edges broke: how many, how many pieces there are then, and of how many fragments the largest are."""

    frame: int
    time: float
    solver: str
    edges: int
    pieces: int
    largest: list[int]


class FragmentLoad(TypedDict):
    """The most that a fragment bore for its toughness, and whether it broke. `share`: strain over toughness; above 1 it breaks."""

    solver: str
    body: str
    fragment: int
    position: list[float]
    strain: float
    toughness: Optional[float]
    share: float
    frame: Optional[int]
    broken_edges: int
    first_broken: Optional[float]


class Cracks(TypedDict):
    """What cracks of a solver's bodies took, of those that have a fracture energy. `energy`: elastic energy, J; `parted_area`: of
    interfaces between pieces, m2; `faded_area`: within pieces, each by its damage; `surface_work`: what those areas take by
    their fracture energy, J; `ratio`: energy over that, None without any, or where it is not known; `since`: None, or the frame
    before which no energy was counted, and then there is no ratio."""

    solver: str
    energy: float
    parted_area: float
    faded_area: float
    surface_work: float
    ratio: Optional[float]
    since: Optional[int]


class Report(TypedDict):
    """What `report` tells of a bake folder."""

    frames: list[int]
    complete: bool
    note: str
    broken: int
    first: Optional[Break]
    pieces: list[Pieces]
    breaks: list[Break]
    fragments: list[FragmentLoad]
    cracks: list[Cracks]


def report(folder: Path, fragments: Union[str, Iterable[SupportsInt], None] = None, body: Optional[str] = None,
           box: Optional[Sequence[Sequence[float]]] = None, group: Optional[str] = None,
           cluster: Optional[SupportsInt] = None) -> Report:
    """What broke in a bake, complete or not: when, where, at which strain, and what pushed.

    "breaks" has a row for each edge, in order; "first" is the first of them, None where nothing broke. For the fragments that
    are asked about (by number, or "all"; of one body; whose centres lie in a box at the start, given by two corners; that
    own vertices of a vertex group; of a cluster; where several are given, of which all hold) "fragments" tells the largest
    strain, the toughness then, their share and the frame, of those too that did not break.
    """
    choice: dict[str, Any] = {}
    if fragments == "all":
        choice["all"] = True
    elif fragments is not None:
        choice["fragments"] = [integer("fragments", number, FRAMES) for number in fragments]
    if body is not None:
        choice["body"] = body
    if box is not None:
        choice["box"] = [[float(x) for x in corner] for corner in box]
    if group is not None:
        choice["group"] = group
    if cluster is not None:
        choice["cluster"] = integer("cluster", cluster, CLUSTERS)
    graph, text = Graph(), ctypes.c_char_p()
    graph._call("graph_report_bake", encode(folder), dump(choice, "report", "fragments"), ctypes.byref(text))
    told: Report = json.loads(decode(text.value))
    return told
