"""How far it is to the goal around obstacles, for a point that may turn on the spot: Dijkstra from the goal, as far as asked.

The values are those of nav2_smac_planner/src/obstacle_heuristic.cpp. There an A* towards the node in question sorts its
queue anew for each; here cells wait in buckets one cell wide. As no step is shorter than that, a cell in the nearest
bucket is final, in whatever order they are taken.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.navigators.common.costmaps.layers import INSCRIBED, ByteGrid
from clearway.navigators.nav2.planners.smac_hybrid.motion import Integers, Single, Singles

_EDGE = 3
"""Cells along the map's border that are never entered."""

_AT_GOAL = -0.00001
"""Cost of the goal's cell: not 0, which is that of a cell that was not reached; negative, as it waits."""


class Field(NamedTuple):
    """The heuristic's state.

    Attributes:
        ground: (cells,) uint8 cost of a cell, 255 where it is never entered.
        straight: (256,) float32 cost of entering a cell of that cost across an edge.
        diagonal: (256,) float32 across a corner.
        total: (cells,) float32 cost from the goal, negative while it may fall, 0 where the search has not been.
        following: (cells,) int32 next in the same bucket, -1 for none.
        preceding: (cells,) int32 previous in the same bucket, -1 for none.
        first: (buckets,) int32 first in a bucket, -1 for none.
        state: (2,) int64 the nearest bucket, how many cells wait.
        columns: Width, cells.
        scale: Cells of the map along one of these.
    """

    ground: ByteGrid
    straight: Singles
    diagonal: Singles
    total: Singles
    following: Integers
    preceding: Integers
    first: Integers
    state: npt.NDArray[np.int64]
    columns: int
    scale: int


class ObstacleHeuristic:
    """Fields for one costmap after another."""

    def __init__(self, cost_penalty: float, quadratic: bool, downsample: bool) -> None:
        penalty, cost = np.float32(cost_penalty), np.arange(256, dtype=np.float32)
        squared = penalty * cost * cost / np.float32(63504)
        self._straight = np.float32(1) + (squared if quadratic else penalty * cost / np.float32(252))
        self._diagonal = np.sqrt(np.float32(2)) * self._straight
        self._scale = 2 if downsample else 1
        self._field: Field | None = None

    def towards(self, cost: ByteGrid, x: float, y: float, keep: bool) -> Field:
        """The field of a goal at a place in cells.

        Args:
            cost: (rows, columns) uint8.
            x: Column of the goal.
            y: Row of the goal.
            keep: Whether what was found stays: the goal has not changed.
        """
        rows, columns = (math.ceil(n / self._scale) for n in cost.shape)
        ground = _ground(np.ascontiguousarray(cost), rows, columns, self._scale)
        field = self._field
        if field is None or field.total.size != rows * columns or field.columns != columns:
            buckets = int(self._diagonal[:INSCRIBED].max()) + 2
            following, preceding, first = (np.full(n, -1, np.int32) for n in (rows * columns, rows * columns, buckets))
            total = np.zeros(rows * columns, np.float32)
            state = np.zeros(2, np.int64)
            keep = False
            field = Field(
                ground,
                self._straight,
                self._diagonal,
                total,
                following,
                preceding,
                first,
                state,
                columns,
                self._scale,
            )
        field = self._field = field._replace(ground=ground)
        if not keep:
            _reset(field, int(y) // self._scale * columns + int(x) // self._scale)
        return field

    def forget(self) -> None:
        """Keep nothing."""
        self._field = None


@kernel
def _ground(cost: ByteGrid, rows: int, columns: int, scale: int) -> ByteGrid:
    """The least cost in each square of `scale` cells; 255 along the border."""
    ground = np.full(rows * columns, 255, np.uint8)
    for r in range(_EDGE + 1, rows - _EDGE):
        for c in range(_EDGE + 1, columns - _EDGE):
            if scale == 1:
                ground[r * columns + c] = cost[r, c]
            else:
                least = min(cost[2 * r, 2 * c], cost[2 * r, 2 * c + 1])
                ground[r * columns + c] = min(least, min(cost[2 * r + 1, 2 * c], cost[2 * r + 1, 2 * c + 1]))
    return ground


@kernel
def _reset(field: Field, goal: int) -> None:
    field.total[:] = 0.0
    field.first[:] = -1
    field.total[goal], field.following[goal], field.preceding[goal], field.first[0] = _AT_GOAL, -1, -1, goal
    field.state[0], field.state[1] = 0, 1


@kernel
def around_obstacles(field: Field, row: int, column: int) -> Single:
    """Cost of the way from a cell of the map to the goal; 0 where there is none."""
    cell = row // field.scale * field.columns + column // field.scale
    if field.total[cell] <= 0:
        _spread(field, cell)
    return np.float32(field.scale) * field.total[cell]


@kernel
def _spread(field: Field, target: int) -> None:
    """Go on until the target's cost is final, or nothing is left."""
    ground, straight, diagonal, total = field.ground, field.straight, field.diagonal, field.total
    following, preceding, first, columns = field.following, field.preceding, field.first, field.columns
    buckets = first.size
    bucket, waiting = field.state[0], field.state[1]
    around = np.array((1, -1, columns, -columns, columns + 1, columns - 1, 1 - columns, -columns - 1))
    while waiting > 0 and total[target] <= 0:
        n = np.int64(first[bucket % buckets])
        if n < 0:
            bucket += 1
            continue
        after = following[n]
        first[bucket % buckets] = after
        if after >= 0:
            preceding[after] = -1
        waiting -= 1
        here = -total[n]
        total[n] = here
        for k in range(8):
            m = n + around[k]
            if m < 0 or m >= total.size or ground[m] >= INSCRIBED or total[m] > 0:
                continue
            new = here + (straight[ground[m]] if k < 4 else diagonal[ground[m]])
            old = -total[m]
            if old != 0 and old <= new:
                continue
            if old != 0:  # out of its bucket
                before, after = preceding[m], following[m]
                if before >= 0:
                    following[before] = after
                else:
                    first[int(old) % buckets] = after
                if after >= 0:
                    preceding[after] = before
                waiting -= 1
            b = int(new) % buckets
            after = first[b]
            following[m], preceding[m], first[b] = after, -1, m
            if after >= 0:
                preceding[after] = m
            waiting += 1
            total[m] = -new
    field.state[0], field.state[1] = bucket, waiting
