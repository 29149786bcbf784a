"""The two global planners of ROS 1: `navfn/NavfnROS` and `global_planner/GlobalPlanner`.

Both spread a potential from the robot over the global costmap until it reaches the goal, then go down from the goal.
Behaviour read from ros-planning/navigation: navfn/src/{navfn,navfn_ros}.cpp, global_planner/src/*.cpp.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.costmap import Costmap
from clearway.navigators.common.costmaps.layers import FREE, LETHAL, UNKNOWN
from clearway.navigators.common.potentials import grid_search
from clearway.navigators.common.potentials.navfn import NEUTRAL, NavfnSearch
from clearway.navigators.common.potentials.parameters import GlobalPlannerGroup

_SPARE = 40 * NEUTRAL
"""How much more potential than the last plan to the same goal a new one may need: 40 free cells' worth."""


class GlobalPlanner(Protocol):
    """nav_core's BaseGlobalPlanner."""

    def plan(self, costmap: Costmap, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        """A plan (n, 3), n >= 1, from `start` (3,) to `goal` (3,) in the costmap's frame, or None if there is none."""


class Navfn:
    """`navfn/NavfnROS`: its plan's poses have yaw 0 but for the last, which has the goal's."""

    def __init__(self, parameters: GlobalPlannerGroup) -> None:
        self._tolerance = parameters.default_tolerance
        self._search = NavfnSearch(parameters.allow_unknown)
        self._goal: tuple[int, tuple[int, ...]] | None = None
        self._known = math.inf  # potential of the last plan to that goal

    def plan(self, costmap: Costmap, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        """See `GlobalPlanner`. With `default_tolerance` it may end beside a goal that can't be reached."""
        columns = costmap.cost.shape[1]
        here, there = costmap.cell(start[0], start[1]), costmap.cell(goal[0], goal[1])
        if here is None or (there is None and self._tolerance <= 0):
            return None
        costmap.cost[here] = FREE  # where the robot stands can't be an obstacle
        there = there or (0, 0)
        target = there[0] * columns + there[1]
        known = self._known if (target, costmap.cost.shape) == self._goal else math.inf
        # First look only where a path hardly dearer than the last one can lead. If it does, the rest does not matter.
        search = self._search
        if not search.spread(costmap.cost, here, there, bound=known + _SPARE) and known < math.inf:
            search.spread(costmap.cost, here, there)
        self._goal, self._known = (target, costmap.cost.shape), search.potential(there)
        if self._known >= grid_search.HIGH:
            self._known = math.inf
        end = search.nearest(goal, self._tolerance, costmap.resolution, costmap.cell)
        if end is None:
            return None
        cell = costmap.cell(end[0], end[1])
        assert cell is not None
        path = search.path(cell, here, 4 * columns)
        if len(path) == 0:
            return None
        plan = np.zeros((len(path) + 1, 3))
        plan[:-1, :2] = costmap.origin + path[::-1].astype(np.float64) * costmap.resolution
        plan[-1] = end[0], end[1], goal[2]
        return plan


class PotentialPlanner:
    """`global_planner/GlobalPlanner`: Dijkstra or A*, gradient or grid path, poses turned by an orientation filter."""

    def __init__(self, parameters: GlobalPlannerGroup) -> None:
        p = self._parameters = parameters
        self._offset = 0.0 if p.old_navfn_behavior else 0.5
        cost = np.arange(256.0)
        if p.use_dijkstra:
            scaled = np.minimum(np.floor(cost * p.cost_factor + p.neutral_cost), p.lethal_cost - 1)
            open_cells = cost < p.lethal_cost - 1
        else:
            scaled = np.minimum((cost + p.neutral_cost) % 256, p.lethal_cost - 1)  # a byte, which may overflow, in ROS
            open_cells = cost < p.lethal_cost
        if p.allow_unknown:
            open_cells[UNKNOWN] = True
        self._table = np.where(open_cells, scaled, p.lethal_cost).astype(np.uint8)
        self._workspace = grid_search.Workspace(0, 0)

    def plan(self, costmap: Costmap, start: FloatArray, goal: FloatArray) -> FloatArray | None:
        """See `GlobalPlanner`."""
        p = self._parameters
        rows, columns = costmap.cost.shape
        here, there = costmap.cell(start[0], start[1]), costmap.cell(goal[0], goal[1])
        if here is None or there is None:
            return None
        sx, sy = self._cells(costmap, start, here)
        gx, gy = self._cells(costmap, goal, there)
        costmap.cost[here] = FREE
        if p.outline_map:
            edge = costmap.cost
            edge[0], edge[-1], edge[:, 0], edge[:, -1] = LETHAL, LETHAL, LETHAL, LETHAL
        space = self._workspace = self._workspace.fitting(rows, columns)
        if not self._spread(costmap, sx, sy, int(gy) * columns + int(gx)):
            return None
        if not p.old_navfn_behavior:
            self._clear_end(costmap, there)
        if p.use_grid_path:
            path = grid_search.descend_cells(
                space.potential, columns, gx, gy, int(sy) * columns + int(sx), 4 * rows * columns
            )
        else:
            path = grid_search.descend(
                space.potential, columns, p.lethal_cost, gx, gy, sx, sy, -1.0, 16 * (rows + columns)
            )
        if len(path) == 0:
            return None
        plan = np.zeros((len(path) + (2 if p.old_navfn_behavior else 1), 3))
        plan[: len(path), :2] = costmap.origin + (path[::-1].astype(np.float64) + self._offset) * costmap.resolution
        plan[len(path) :] = goal
        orient(plan, start, p.orientation_mode, p.orientation_window_size)
        return plan

    def _cells(self, costmap: Costmap, pose: FloatArray, cell: tuple[int, int]) -> tuple[float, float]:
        """Column and row of a pose, with fractions unless navfn is mirrored."""
        if self._parameters.old_navfn_behavior:
            return float(cell[1]), float(cell[0])
        x, y = (pose[:2] - costmap.origin) / costmap.resolution - self._offset
        return max(float(x), 0.0), max(float(y), 0.0)

    def _spread(self, costmap: Costmap, sx: float, sy: float, target: int) -> bool:
        """Spread the potential from the start; whether it reached the target."""
        p, space = self._parameters, self._workspace
        rows, columns = costmap.cost.shape
        n = int(sy) * columns + int(sx)
        flat = costmap.cost.reshape(-1)
        if not p.use_dijkstra:
            return bool(
                grid_search.best_first(
                    flat,
                    columns,
                    self._table,
                    p.lethal_cost,
                    p.neutral_cost,
                    n,
                    target,
                    p.use_quadratic,
                    space.potential,
                    space.pending,
                    space.extent,
                )
            )
        if p.old_navfn_behavior:
            space.potential[n] = 0.0
            space.extent[:] = n, n
            front = [n + 1, n - 1, n - columns, n + columns]
        else:  # the start lies between four cells
            if n + columns + 1 >= flat.size:
                return False
            dx, dy = (math.floor((v - int(v)) * 100 + 0.5) / 100 for v in (sx, sy))
            space.potential[n] = p.neutral_cost * 2 * dx * dy
            space.potential[n + 1] = p.neutral_cost * 2 * (1 - dx) * dy
            space.potential[n + columns] = p.neutral_cost * 2 * dx * (1 - dy)
            space.potential[n + columns + 1] = p.neutral_cost * 2 * (1 - dx) * (1 - dy)
            space.extent[:] = n, n + columns + 1
            front = [
                *(n + 2, n - 1, n + columns - 1, n + columns + 2),
                *(n - columns, n - columns + 1, n + 2 * columns, n + 2 * columns + 1),
            ]
        return bool(
            grid_search.wave(
                flat,
                columns,
                self._table,
                p.lethal_cost,
                np.array(front),
                target,
                2 * p.neutral_cost,
                p.use_quadratic,
                2 * rows * columns,
                space.potential,
                space.pending,
                space.blocks,
                space.extent,
                math.inf,
                0.0,
            )
        )

    def _clear_end(self, costmap: Costmap, cell: tuple[int, int]) -> None:
        """Give the unreached cells around the goal a potential, so that the gradient is good there (clearEndpoint)."""
        space, neutral = self._workspace, self._parameters.neutral_cost
        rows, columns = costmap.cost.shape
        if not (3 <= cell[0] < rows - 3 and 3 <= cell[1] < columns - 3):
            return
        centre = cell[0] * columns + cell[1]
        space.extent[0] = min(space.extent[0], centre - 2 * columns - 2)
        space.extent[1] = max(space.extent[1], centre + 2 * columns + 2)
        flat = costmap.cost.reshape(-1)
        grid_search.fill_around(space.potential, flat, columns, centre, neutral, self._parameters.use_quadratic)


def orient(plan: FloatArray, start: FloatArray, mode: int, window: int) -> None:
    """Turn the plan's poses (n, 3), in place, by the orientation filter's mode; the last one keeps its yaw.

    Modes: 0 none, 1 forward, 2 interpolate, 3 forward then interpolate, 4 backward, 5 leftward, 6 rightward.
    """
    n = len(plan)
    if mode == 0 or n < 2:
        return
    if mode != 2:
        i = np.arange(n - 1)
        before, after = plan[np.maximum(0, i - window)], plan[np.minimum(n - 1, i + window)]
        forward = np.arctan2(after[:, 1] - before[:, 1], after[:, 0] - before[:, 0])
        plan[:-1, 2] = _wrapped(forward + {4: math.pi, 5: -math.pi / 2, 6: math.pi / 2}.get(mode, 0.0))
    first = 0
    if mode == 3:
        first = max(n - 3, 0)
        straight = plan[first, 2]
        while first > 0 and abs(wrap(straight - plan[first - 1, 2])) <= 0.35:
            first -= 1
    if mode in (2, 3):
        plan[0, 2] = start[2]
        turn = wrap(plan[-1, 2] - plan[first, 2]) / (n - 1 - first)
        yaw = plan[first, 2]
        for k in range(first, n):
            plan[k, 2] = wrap(yaw + turn * k)  # k, not k - first: as the filter has it


@kernel
def _wrapped(angles: FloatArray) -> FloatArray:
    for i in range(angles.size):
        angles[i] = wrap(angles[i])
    return angles
