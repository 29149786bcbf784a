"""Nav2's SmacPlanner2D: A* over the costmap's cells and their eight neighbours, then a smoother.

Behaviour read from ros-navigation/navigation2, nav2_smac_planner: smac_planner_2d_impl.hpp, a_star_impl.hpp,
goal_manager.hpp, src/node_2d.cpp.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.heap import pop, push
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.layers import INSCRIBED, UNKNOWN, ByteGrid
from clearway.navigators.nav2.planners.grids import grid_of, place, to_world
from clearway.navigators.nav2.planners.parameters import Smac2DParameters, SmootherParameters
from clearway.navigators.nav2.planners.queue import order
from clearway.navigators.nav2.planners.smoother import Smoother
from clearway.navigators.nav2.seams import CostView, GoalOccupied, NoPath, StartOccupied

Costs = npt.NDArray[np.float32]

_WITHOUT_BOUND = 2**31 - 1


class Smac2D:
    """`nav2_smac_planner::SmacPlanner2D`, a `Planner`."""

    def __init__(self, parameters: Smac2DParameters, smoother: SmootherParameters | None = None) -> None:
        p = self._parameters = parameters
        self._smoother = Smoother(smoother or SmootherParameters(), None)
        self._factor = p.downsampling_factor if p.downsample_costmap else 1
        dearer = np.float32(p.cost_travel_multiplier) * (np.arange(256) / 252.0).astype(np.float32)
        self._straight = (1.0 + dearer).astype(np.float32)
        self._diagonal = (np.sqrt(np.float32(2)) * (1.0 + dearer.astype(np.float64))).astype(np.float32)
        closed = np.zeros(256, np.uint8)
        closed[INSCRIBED:] = 1
        closed[UNKNOWN] = not p.allow_unknown
        self._closed = closed

    def reset(self) -> None:
        """See `Planner`: it keeps nothing."""

    def plan(self, start: FloatArray, goal: FloatArray, view: CostView) -> FloatArray:
        """See `Planner`.

        Raises:
            NoPath: start or goal lie off the map, the goal is occupied, nothing leads there, or it took too long.
        """
        p = self._parameters
        grid = grid_of(view, self._factor)
        cost, frame = grid
        here, there = place(frame, start, "start"), place(frame, goal, "goal")
        first, last = int(here.y) * frame.cols + int(here.x), int(there.y) * frame.cols + int(there.x)
        if first == last:
            yaw = start[2] if p.use_final_approach_orientation else goal[2]
            return np.array([(goal[0], goal[1], yaw)])
        flat = cost.reshape(-1)
        tolerance = np.float32(np.float32(p.tolerance) / np.float32(frame.resolution))
        if self._closed[flat[last]] and not zone_is_open(
            cost, self._closed, float(there.x), float(there.y), float(tolerance)
        ):
            raise GoalOccupied(f"the goal ({goal[0]:.2f}, {goal[1]:.2f}) is occupied")
        limit = p.max_iterations if p.max_iterations > 0 else _WITHOUT_BOUND
        approach = p.max_on_approach_iterations if p.max_on_approach_iterations > 0 else _WITHOUT_BOUND
        cells, visited = search(
            flat,
            frame.cols,
            self._closed,
            self._straight,
            self._diagonal,
            first,
            last,
            there.x,
            there.y,
            tolerance,
            limit,
            approach,
        )
        if len(cells) == 0:
            if visited == 1:
                raise StartOccupied(f"the start is blocked after {visited} cells")
            why = "no path" if visited < limit else "too many iterations"
            raise NoPath(f"{why} after {visited} cells")
        path = np.zeros((len(cells), 3))
        path[:, :2] = to_world(frame, np.stack((cells % frame.cols, cells // frame.cols), axis=1).astype(np.float64))
        self._smoother.smooth(path, grid, view)
        if cells[-1] == last:
            path[-1, :2] = goal[:2]
        if not p.use_final_approach_orientation:
            path[-1, 2] = goal[2]
        else:
            path[-1, 2] = math.atan2(path[-1, 1] - path[-2, 1], path[-1, 0] - path[-2, 0])
        return path


def zone_is_open(cost: ByteGrid, closed: ByteGrid, x: float, y: float, radius: float) -> bool:
    """Whether the corner of an open cell lies within `radius` of a place, in cells; never, where `radius` is below 1."""
    if radius < 1:
        return False
    rows, columns = cost.shape
    across = np.arange(max(0, math.floor(x - radius)), min(columns - 1, math.ceil(x + radius)) + 1)
    up = np.arange(max(0, math.floor(y - radius)), min(rows - 1, math.ceil(y + radius)) + 1)[:, None]
    near = (across - x) ** 2 + (up - y) ** 2 <= radius**2
    return bool((near & (closed[cost[up, across]] == 0)).any())


@kernel
def search(
    cost: ByteGrid,
    columns: int,
    closed: ByteGrid,
    straight: Costs,
    diagonal: Costs,
    start: int,
    goal: int,
    goal_x: Any,
    goal_y: Any,
    tolerance: Any,
    limit: int,
    approach: int,
) -> Any:
    """A* over a grid's cells, the straight distance to the goal as heuristic.

    Args:
        cost: (cells,) uint8.
        columns: Width of the grid, cells.
        closed: (256,) whether a cell of that cost can't be entered.
        straight: (256,) float32 cost of entering a cell of that cost across an edge.
        diagonal: (256,) float32 the same across a corner.
        start: Cell.
        goal: Cell.
        goal_x: Column of the goal, with fractions, float32.
        goal_y: Row of the goal, likewise.
        tolerance: Distance from the goal, in cells, within which a path may end, float32.
        limit: Cells visited, at most.
        approach: Cells visited, at most, once one within the tolerance is known.

    Returns:
        the path's cells from the start, none where there is none, and how many cells were visited.
    """
    rows = cost.size // columns
    best = np.full(cost.size, np.inf, np.float32)
    parent = np.full(cost.size, -1, np.int32)
    visited = np.zeros(cost.size, np.uint8)
    capacity = 1024
    keys, items = np.empty(capacity, np.int64), np.empty(capacity, np.int32)
    keys[0], items[0] = 0, start
    size, pushed = 1, 1
    best[start] = 0.0
    nearest, near = np.float32(np.inf), start
    iterations, approached, end = 0, 0, -1
    while iterations < limit and size > 0:
        n = items[0]
        size = pop(keys, items, size)
        if visited[n]:
            continue
        iterations += 1
        visited[n] = 1
        if n == goal:
            end = n
            break
        if nearest < tolerance:
            approached += 1
            if approached >= approach:
                break
        row, column = n // columns, n % columns
        if size + 8 > capacity:
            more, others = np.empty(capacity, np.int64), np.empty(capacity, np.int32)
            keys, items = np.concatenate((keys, more)), np.concatenate((items, others))
            capacity *= 2
        for k in range(8):  # left, right, below, above, then the corners
            across = (-1, 1, 0, 0, -1, 1, -1, 1)[k]
            up = (0, 0, -1, 1, -1, -1, 1, 1)[k]
            r, c = row + up, column + across
            if not (0 <= r < rows and 0 <= c < columns):
                continue
            m = r * columns + c
            here = cost[m]
            if closed[here] or visited[m]:
                continue
            total = best[n] + (straight[here] if k < 4 else diagonal[here])
            if total < best[m]:
                best[m], parent[m] = total, n
                dx, dy = goal_x - np.float32(c), goal_y - np.float32(r)
                ahead = np.float32(math.sqrt(dx * dx + dy * dy))
                if ahead < nearest:
                    nearest, near = ahead, m
                size = push(keys, items, size, order(total + ahead, pushed), m)
                pushed += 1
    if end < 0 and nearest < tolerance:
        end = near
    count = 0
    n = end
    while n >= 0:
        count += 1
        n = parent[n]
    path = np.empty(count if count > 1 else 0, np.int64)
    n = end
    for i in range(path.size - 1, -1, -1):
        path[i] = n
        n = parent[n]
    return path, iterations
