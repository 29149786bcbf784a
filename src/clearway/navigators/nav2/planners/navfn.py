"""Nav2's NavfnPlanner: navfn's search over the global costmap.

Behaviour read from ros-navigation/navigation2, nav2_navfn_planner/src/navfn_planner.cpp. From ROS 1's it differs in
that cells are rounded to, that a reachable goal ends the path itself, and in how the path's end is made.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.layers import FREE, LETHAL
from clearway.navigators.common.potentials.grid_search import HIGH
from clearway.navigators.common.potentials.navfn import Cell, NavfnSearch
from clearway.navigators.nav2.planners.parameters import NavfnParameters
from clearway.navigators.nav2.seams import CostView, GoalOccupied, NoPath

_SAME = 1e-6
"""Squared distance below which the path's last point is the goal, m^2."""

_EQUAL = 1e-4
"""Distance along each axis below which the last two points are one, m."""


class Navfn:
    """`nav2_navfn_planner::NavfnPlanner`, a `Planner`: poses have yaw 0 but for the last."""

    def __init__(self, parameters: NavfnParameters) -> None:
        self._parameters = parameters
        self._search = NavfnSearch(parameters.allow_unknown)

    def reset(self) -> None:
        """See `Planner`: it keeps nothing."""

    def plan(self, start: FloatArray, goal: FloatArray, view: CostView) -> FloatArray:
        """See `Planner`. The cell in which the robot stands is set free in `view`, as in the source.

        Raises:
            NoPath: start or goal lie off the map, the goal is occupied and `tolerance` is 0, or nothing leads there.
        """
        p = self._parameters
        for name, pose in (("start", start), ("goal", goal)):
            if not on_map(view, pose):
                raise NoPath(f"the {name} ({pose[0]:.2f}, {pose[1]:.2f}) is off the map")
        there = (goal[:2] - view.origin) / view.resolution
        if p.tolerance == 0 and view.cost[int(there[1]), int(there[0])] == LETHAL:
            raise GoalOccupied(f"the goal ({goal[0]:.2f}, {goal[1]:.2f}) is occupied")
        if start[0] == goal[0] and start[1] == goal[1]:
            return np.array([start if p.use_final_approach_orientation else goal])
        points = self._points(start, goal, view)
        plan = np.zeros((len(points), 3))
        plan[:, :2] = points
        plan[-1, 2] = goal[2]
        if p.use_final_approach_orientation:
            plan[-1, 2] = _final_approach(points, float(start[2]))
        return plan

    def _points(self, start: FloatArray, goal: FloatArray, view: CostView) -> FloatArray:
        """The path's points (n, 2), m."""
        rows, columns = view.cost.shape

        def cell(x: float, y: float) -> Cell | None:
            at = _rounded(view, x, y)
            return at if x >= view.origin[0] and y >= view.origin[1] and at[0] < rows and at[1] < columns else None

        def clamped(pose: FloatArray) -> Cell:
            row, column = _rounded(view, float(pose[0]), float(pose[1]))
            return min(row, rows - 1), min(column, columns - 1)

        p, search = self._parameters, self._search
        here, there = clamped(start), clamped(goal)
        view.cost[here] = FREE
        search.spread(view.cost, here, there, best_first=p.use_astar)
        end: tuple[float, float] | None = float(goal[0]), float(goal[1])
        if search.potential(there) >= HIGH:
            end = search.nearest(goal, p.tolerance, view.resolution, cell)
        begin = cell(*end) if end is not None else None
        if end is None or begin is None:
            raise NoPath(f"nothing leads within {p.tolerance:g} m of the goal")
        path = search.path(begin, here, p.max_cycles_factor * max(rows, columns))
        if len(path) == 0:
            raise NoPath("the way down the potential is lost")
        return _ending(view.origin + path[::-1].astype(np.float64) * view.resolution, np.array(end))


def on_map(view: CostView, pose: FloatArray) -> bool:
    """Whether a pose (3,) lies on the costmap (Costmap2D::worldToMap)."""
    x, y = (pose[:2] - view.origin) / view.resolution
    rows, columns = view.cost.shape
    return bool(0 <= x < columns and 0 <= y < rows)


def _rounded(view: CostView, x: float, y: float) -> Cell:
    """The cell whose lower-left corner is nearest (NavfnPlanner::worldToMap; halves away from zero)."""
    ox, oy = view.origin
    return math.floor((y - oy) / view.resolution + 0.5), math.floor((x - ox) / view.resolution + 0.5)


def _ending(points: FloatArray, end: FloatArray) -> FloatArray:
    """The path's points (n, 2) with `end` (2,) as last one, in place of the former last one where that lies beyond it or on it."""
    if len(points) >= 2:
        before, last = points[-2], points[-1]
        if _squared(last, before) > _squared(end, before) or _squared(last, end) < _SAME:
            points[-1] = end
            return points
    return np.vstack((points, end))


def _final_approach(points: FloatArray, start_yaw: float) -> float:
    """Heading of the path's last piece, rad."""
    if len(points) == 1:
        return start_yaw
    last, before = points[-1], points[-2]
    if len(points) > 2 and (np.abs(last - before) < _EQUAL).all():
        before = points[-3]
    return math.atan2(last[1] - before[1], last[0] - before[0])


def _squared(a: FloatArray, b: FloatArray) -> float:
    dx, dy = a[0] - b[0], a[1] - b[1]
    return float(dx * dx + dy * dy)
