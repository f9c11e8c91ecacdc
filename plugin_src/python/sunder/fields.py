"""Any function of places as the grid that a `grid_force` takes."""
from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from .errors import Error
from .library import Path, frame_pair, integer

_Corner = Sequence[float]
_MOST = 1e6  # the largest number that a grid_force takes


def _corner(name: str, value: _Corner) -> npt.NDArray[np.float64]:
    corner = np.asarray(value, float)
    if corner.shape != (3,) or not np.isfinite(corner).all():
        raise Error("bad_usage", f"sample_field: {name} takes three finite numbers [x, y, z], not {value!r}")
    return corner


def _asked(field: Callable[..., Any], places: npt.NDArray[np.float64], *frame: int) -> list[list[float]]:
    at = f" at frame {frame[0]}" if frame else ""
    values = np.asarray(field(places.copy(), *frame), float)
    if values.shape == (3,):  # the same everywhere
        values = np.broadcast_to(values, places.shape)
    if values.shape != places.shape:
        raise Error("bad_usage", f"sample_field: the field gave an array of shape {values.shape}{at}, not {places.shape}")
    bad = np.flatnonzero(~(np.abs(values) <= _MOST).all(1))
    if bad.size:
        raise Error("bad_input", f"sample_field: the field is {values[bad[0]].tolist()} at {places[bad[0]].tolist()}{at}: "
                    "its numbers are to be finite, up to a million")
    rows: list[list[float]] = values.tolist()
    return rows


def sample_field(field: Callable[..., Any], box_min: _Corner, box_max: _Corner, nodes: Sequence[int] = (16, 16, 16),
                 frames: Optional[Sequence[int]] = None, path: Optional[Path] = None) -> dict[str, Any]:
    """Asks a function at the nodes of a box, and returns what a `grid_force` takes:

        g.add("grid_force", "swirl", **sunder.sample_field(lambda x: np.cross([0, 0, 1], x), (-2, -2, 0), (2, 2, 4)))

    `field(places)` is given an (n, 3) array in metres and returns one of vectors, m/s or m/s2; with `frames` (first, last) it is
    asked once for each of them, as `field(places, frame)`. The answers stand in the graph, or in a JSON file at `path`: so a
    bake is the same, and resumes, wherever the function is not.
    """
    low, high = _corner("box_min", box_min), _corner("box_max", box_max)
    counts = [integer("nodes", n, (2, 1000)) for n in nodes]
    if len(counts) != 3 or not (low < high).all():
        raise Error("bad_usage", "sample_field: takes three numbers of nodes, and a box whose box_min is below its box_max")
    axes = [np.linspace(a, b, n) for a, b, n in zip(low, high, counts)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    grid: dict[str, Any] = {"nodes": counts, "box_min": low.tolist(), "box_max": high.tolist()}
    if frames is None:
        grid["values"] = _asked(field, places)
    else:
        first, last = frame_pair("frames", frames)
        grid["first_frame"] = first
        grid["values"] = [v for frame in range(first, last + 1) for v in _asked(field, places, frame)]
    if path is None:
        return {"source": "values", **grid}
    with open(path, "w", encoding="utf-8") as file:
        json.dump(grid, file)
    return {"source": "file", "path": os.fspath(path)}
