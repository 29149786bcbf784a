"""The heuristic planner among circles that stand still: greedy tangents and arcs on both sides (paper B, "Heuristic planning").

Everything here is a kernel: call it from compiled code, or from Python with float64 C-contiguous arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

START_COVERED = 1
"""The start lay inside a disc: the path begins with a straight line to the nearest free point."""
TARGET_COVERED = 2
"""The target lay inside a disc: the path ends at the nearest free point."""
UNREACHABLE = 4
"""The discs shut the target off: the path ends at the reachable point nearest to it."""
FALLBACK = 8
"""The greedy rule did not come to an end; the tangent graph answered."""
NO_PATH = 16
"""Nothing was found: the path is what the straight line allows before it meets a disc (possibly only the start)."""
LIMITED = 32
"""`exact`: more discs than the graph may hold mattered; the path is free, but may not be the shortest."""
OUTSIDE = 64
"""Every path left `area`: the shortest was cut where it leaves."""
CUT = 128
"""The path left the perception field and was cut at its rim."""
TEMPORARY = 256
"""The goal lies beyond the perception field: the path leads to a temporary target on its rim."""
BELT_LIMIT = 512
"""Belts still grew after the last iteration: the path may meet a predicted disc in time."""


class Path(NamedTuple):
    """A path of straight pieces and arcs.

    Attributes:
        status: sum of the flags above, 0: all is well.
        pieces: (k, 7) x0, y0, x1, y1 [m], centre x, y [m], turn [rad] (> 0 counter-clockwise; 0: straight).
        length: m, exact.
        side: 1 passes the first obstacle on its left (as seen from the start), -1 on its right, 0 goes straight.
        other: (k2, 7) the best path of the other side; empty if there is none.
    """

    status: int
    pieces: FloatArray
    length: float
    side: int
    other: FloatArray


@kernel
def plan_path(
    start: FloatArray, target: FloatArray, discs: FloatArray, area: FloatArray, draw: float, exact: bool
) -> Path:
    """The shorter of the greedy paths on both sides of the straight line, free of all discs (within 1e-9 m).

    Args:
        start, target: (2,) m (more columns are ignored). discs: (n, 3) x, y, inflated radius [m], none NaN.
        area: (4,) x_min, y_min, x_max, y_max that the path must keep to; infinite: none.
        draw: in [0, 1): decides between paths of the same length (left below one half).
        exact: the tangent visibility graph instead of the greedy rule.
    """
    return Path(0, np.zeros((0, 7)), 0.0, 0, np.zeros((0, 7)))


@kernel
def polyline(pieces: FloatArray, spacing: float) -> FloatArray:
    """(m, 2) the path's corners, and points on its arcs at most `spacing` [m] apart along them."""
    return np.zeros((0, 2))


@kernel
def sample(pieces: FloatArray, stations: FloatArray, heading: float) -> FloatArray:
    """(m, 3) x, y, direction of travel at `stations` [m along the path, ascending]; beyond the end: the end.

    `heading` [rad] is the answer where the path has no length.
    """
    return np.zeros((len(stations), 3))
