"""navfn's search: its costs, the spread of its potential from one cell to another, the path back down.

Behaviour read from ros-planning/navigation: navfn/src/{navfn,navfn_ros}.cpp, and ros-navigation/navigation2:
nav2_navfn_planner/src/{navfn,navfn_planner}.cpp, which are the same but for A*.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.layers import UNKNOWN, ByteGrid
from clearway.navigators.common.potentials import grid_search

NEUTRAL = 50
"""Potential that a free cell's width costs."""

_LETHAL, _FACTOR = 254, 0.8

_LEAST = 0.9 * NEUTRAL
"""Potential that a cell's width of free space costs at least (the quadratic fit stays above 0.97 times the neutral)."""

Cell = tuple[int, int]
"""Row and column."""


class NavfnSearch:
    """navfn over one grid after another; cells are (row, column)."""

    def __init__(self, allow_unknown: bool) -> None:
        table = np.full(256, _LETHAL, np.uint8)
        table[:253] = np.minimum(NEUTRAL + _FACTOR * np.arange(253), _LETHAL - 1)
        if allow_unknown:
            table[UNKNOWN] = _LETHAL - 1
        self._table = table
        self._workspace = grid_search.Workspace(0, 0)

    def spread(
        self, cost: ByteGrid, start: Cell, target: Cell, *, bound: float = math.inf, best_first: bool = False
    ) -> bool:
        """Spread the potential over `cost` (rows, columns) from `start` until it reaches `target`; whether it does.

        Args:
            cost: As a costmap has it, uint8.
            start: Where the potential is 0.
            target: Where it stops.
            bound: Potential above which no path is looked for.
            best_first: Whether cells nearer to the target come first (A*).
        """
        rows, columns = cost.shape
        space = self._workspace = self._workspace.fitting(rows, columns)
        n = start[0] * columns + start[1]
        space.potential[n] = 0.0
        space.extent[:] = n, n
        ahead = float(NEUTRAL) if best_first else 0.0
        return grid_search.wave(
            cost.reshape(-1),
            columns,
            self._table,
            _LETHAL,
            np.array((n + 1, n - 1, n - columns, n + columns)),
            target[0] * columns + target[1],
            2 * NEUTRAL,
            True,
            max(rows * columns // 20, rows + columns),
            space.potential,
            space.pending,
            space.blocks,
            space.extent,
            bound,
            _LEAST,
            ahead,
            ahead * math.dist(start, target),
        )

    def potential(self, cell: Cell) -> float:
        """The last spread's potential of a cell; `grid_search.HIGH` where it has not been."""
        return float(self._workspace.potential[cell[0] * self._workspace.columns + cell[1]])

    def nearest(
        self, goal: FloatArray, tolerance: float, resolution: float, cell: Callable[[float, float], Cell | None]
    ) -> tuple[float, float] | None:
        """The point (x, y) nearest to `goal` that the potential has reached, m; None: none within `tolerance`.

        Args:
            goal: (3,) m, rad.
            tolerance: Half the edge of a square around the goal that is looked through, m.
            resolution: Steps in which it is looked through, m.
            cell: The cell of a point, None off the map.
        """
        axis = []
        for centre in (float(goal[0]), float(goal[1])):
            value, values = centre - tolerance, []
            while value <= centre + tolerance:
                values.append(value)
                value += resolution
            axis.append(values)
        best, found = math.inf, None
        for y in axis[1]:
            for x in axis[0]:
                distance = (x - goal[0]) ** 2 + (y - goal[1]) ** 2
                at = cell(x, y) if distance < best else None
                if at is not None and self.potential(at) < grid_search.HIGH:
                    best, found = distance, (x, y)
        return found

    def path(self, begin: Cell, end: Cell, limit: int) -> grid_search.PotentialGrid:
        """Points (n, 2) in columns and rows, from `begin` down the potential to `end`; n = 0 if the way is lost.

        Args:
            begin: Where it begins.
            end: Where the last spread began.
            limit: Points at most.
        """
        space = self._workspace
        return grid_search.descend(
            space.potential,
            space.columns,
            _LETHAL,
            float(begin[1]),
            float(begin[0]),
            float(end[1]),
            float(end[0]),
            float(NEUTRAL),
            limit,
        )
