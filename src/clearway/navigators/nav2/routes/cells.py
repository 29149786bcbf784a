"""What a route server looks up in the costmap: costs along an edge, and which node is nearest on free ground.

Behaviour read from ros-navigation/navigation2: nav2_route/include/nav2_route/goal_intent_search.hpp,
src/plugins/edge_cost_functions/costmap_scorer.cpp.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame, row_col
from clearway.navigators.common.costmaps.layers import INSCRIBED, UNKNOWN, ByteGrid
from clearway.navigators.common.costmaps.lines import line_between, next_cell


class Ground(NamedTuple):
    """A costmap with the graph's nodes.

    Attributes:
        cost: (rows, columns) uint8.
        frame: Where its cells lie.
        places: (n, 2) of the nodes in the costmap's frame, m.
    """

    cost: ByteGrid
    frame: Frame
    places: FloatArray


@kernel
def along_edge(
    cost: ByteGrid, frame: Frame, ax: float, ay: float, bx: float, by: float, step: int, closing: float
) -> tuple[int, float, float]:
    """Costs of every `step`-th cell from (ax, ay) to (bx, by): their number, the highest known one, and their sum.

    The number is 0 where an end is off the costmap, and -1 where a cost reaches `closing`.
    """
    r, c = row_col(frame, ax, ay)
    last_r, last_c = row_col(frame, bx, by)
    count, highest, total = 0, 0.0, 0.0
    if r < 0 or last_r < 0:
        return count, highest, total
    line = line_between(r, c, last_r, last_c)
    error = line.length // 2
    for i in range(line.length + 1):
        if i % step == 0:
            here = float(cost[r, c])
            if here >= closing:
                return -1, highest, total
            count += 1
            total += here
            if here > highest and here != UNKNOWN:
                highest = here
        r, c, error = next_cell(line, r, c, error)
    return count, highest, total


@kernel
def _blocked(cost: ByteGrid, r: int, c: int, last_r: int, last_c: int) -> bool:
    """Whether a cell on the line between two is occupied, or its centre would collide."""
    line = line_between(r, c, last_r, last_c)
    error = line.length // 2
    for _ in range(line.length + 1):
        if cost[r, c] >= INSCRIBED and cost[r, c] != UNKNOWN:
            return True
        r, c, error = next_cell(line, r, c, error)
    return False


@kernel
def _first_met(cost: ByteGrid, row: int, col: int, wanted: npt.NDArray[np.int64], most: int) -> int:
    """Which of the `wanted` cells, by their indices row by row, a flood from a cell meets first; -1: none of them.

    It spreads over cells that are free or unknown, to eight sides, and ends after `most` cells.
    """
    rows, cols = cost.shape
    seen = np.zeros(rows * cols, np.uint8)
    queue = np.empty(rows * cols, np.int64)
    queue[0] = row * cols + col
    seen[queue[0]] = 1
    first, end = 0, 1
    sides = ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))  # Nav2's order decides among equals
    while first < end and first < most:
        here = queue[first]
        first += 1
        for k in range(len(wanted)):
            if wanted[k] == here:
                return k
        for dr, dc in sides:
            r, c = here // cols + dr, here % cols + dc
            if r < 0 or r >= rows or c < 0 or c >= cols:
                continue
            if seen[r * cols + c] or (cost[r, c] >= INSCRIBED and cost[r, c] != UNKNOWN):
                continue
            seen[r * cols + c] = 1
            queue[end] = r * cols + c
            end += 1
    return -1


@kernel
def in_reach(cost: ByteGrid, frame: Frame, x: float, y: float, places: FloatArray, most: int) -> int:
    """Which of some places (k, 2), the nearest first, is the nearest to (x, y) for who can't drive through obstacles.

    The first one, if it is seen from there, or nothing can be told. As in the source places off the costmap are left out before
    they are counted, so that one before it may be named.
    """
    row, col = row_col(frame, x, y)
    r, c = row_col(frame, places[0, 0], places[0, 1])
    if row < 0 or r < 0 or not _blocked(cost, r, c, row, col):
        return 0
    wanted = np.empty(len(places), np.int64)
    count = 0
    for k in range(len(places)):
        r, c = row_col(frame, places[k, 0], places[k, 1])
        if r >= 0:
            wanted[count] = r * cost.shape[1] + c
            count += 1
    return max(_first_met(cost, row, col, wanted[:count], most), 0)
