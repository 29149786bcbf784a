"""The smoother of Nav2's Smac planners: each point is drawn between its neighbours and to where it was.

Then the ends, which it has bent, are laid anew as Dubins paths. Behaviour read from ros-navigation/navigation2:
nav2_smac_planner/src/smoother.cpp, nav2_util/include/nav2_util/smoother_utils.hpp.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.dubins import along, dubins, length, relative
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame, row_col
from clearway.navigators.common.costmaps.layers import INSCRIBED, UNKNOWN, ByteGrid
from clearway.navigators.nav2.footprint import cost_at_pose
from clearway.navigators.nav2.planners.grids import Grid
from clearway.navigators.nav2.planners.parameters import SmootherParameters
from clearway.navigators.nav2.seams import CostView

_SHORTEST = 10
"""Steps that a piece must have more of to be smoothed."""

_EQUAL = 1e-4
"""Points nearer than this along each axis are one, m; headings nearer are one, rad."""


class Weights(NamedTuple):
    """What the kernel is given of the parameters.

    Attributes:
        tolerance: It ends when all points together move less, m.
        rounds: At most.
        data: How much a point is drawn to where it was.
        smooth: How much it is drawn to between its neighbours.
        refinements: How often what is smooth is smoothed again.
        radius: Least turning radius, m; 0: the path has no headings to keep.
    """

    tolerance: float
    rounds: int
    data: float
    smooth: float
    refinements: int
    radius: float


class Smoother:
    """`nav2_smac_planner::Smoother`."""

    def __init__(self, parameters: SmootherParameters, radius: float | None) -> None:
        """
        Args:
            parameters: Its own.
            radius: Least turning radius, m; None: the path is that of a search over cells, without headings.
        """
        p = parameters
        refinements = p.refinement_num if p.do_refinement else 0
        self._weights = Weights(p.tolerance, p.max_iterations, p.w_data, p.w_smooth, refinements, radius or 0.0)

    def smooth(self, path: FloatArray, grid: Grid, view: CostView) -> None:
        """Smooth a path (n, 3) in place, as far as it stays free of obstacles in `grid`."""
        if self._weights.rounds > 0:
            polygon = np.zeros((0, 2)) if view.circular else np.ascontiguousarray(view.footprint)
            smooth(path, grid.cost, grid.frame, polygon, self._weights)


@kernel
def smooth(path: FloatArray, cost: ByteGrid, frame: Frame, polygon: FloatArray, weights: Weights) -> None:
    """Smooth each piece of a path (n, 3) in place that leads one way.

    Args:
        path: x, y, yaw.
        cost: (rows, columns) uint8.
        frame: Where its cells lie.
        polygon: (m, 2) the outline; none: the cost at the centre counts.
        weights: See there.
    """
    first, end = 0, len(path) - 1
    if weights.radius > 0:
        for i in range(1, end):
            turns_back, turns_in_place = turns_at(path, i)
            if turns_back:
                _smooth_piece(path[first : i + 1], cost, frame, polygon, weights)
                first = i
            if turns_in_place:
                _smooth_piece(path[first : i + 1], cost, frame, polygon, weights)
                first = i
    _smooth_piece(path[first:], cost, frame, polygon, weights)


@kernel
def turns_at(path: FloatArray, i: int) -> tuple[bool, bool]:
    """Whether a path (n, 3) turns back at a pose between its ends, and whether it turns in place there."""
    ax, ay = path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1]
    bx, by = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
    stays = abs(bx) < _EQUAL and abs(by) < _EQUAL
    return ax * bx + ay * by < 0, stays and abs(wrap(path[i + 1, 2] - path[i, 2])) > _EQUAL


@kernel
def _smooth_piece(path: FloatArray, cost: ByteGrid, frame: Frame, polygon: FloatArray, weights: Weights) -> None:
    if len(path) - 1 <= _SHORTEST:
        return
    start, end = path[0].copy(), path[-1].copy()
    converged, backwards = _relax(path, cost, frame, polygon, weights)
    going_on = converged
    for _ in range(weights.refinements):
        if going_on:
            going_on, backwards = _relax(path, cost, frame, polygon, weights)
    if weights.radius > 0 and converged:
        _lay_end(path, start, cost, frame, weights.radius, backwards, True)
        _lay_end(path, end, cost, frame, weights.radius, backwards, False)


@kernel
def _relax(path: FloatArray, cost: ByteGrid, frame: Frame, polygon: FloatArray, weights: Weights) -> Any:
    """Smooth a piece in place. Whether it came to rest before it hit something, and whether it is driven backwards."""
    new, last = path.copy(), path.copy()
    backwards = False
    change = weights.tolerance
    rounds = 0
    while change >= weights.tolerance:
        rounds += 1
        change = 0.0
        if rounds >= weights.rounds:
            path[:] = last
            return False, orient(path, weights.radius <= 0)
        for i in range(1, len(path) - 1):
            for j in range(2):
                before = new[i, j]
                moved = before + (
                    weights.data * (path[i, j] - before)
                    + weights.smooth * (new[i + 1, j] + new[i - 1, j] - 2.0 * before)
                )
                new[i, j] = moved
                change += abs(moved - before)
        backwards = orient(new, weights.radius <= 0)
        for i in range(1, len(path) - 1):
            here = _cost(cost, frame, polygon, new[i])
            if here >= INSCRIBED and here != UNKNOWN:
                path[:] = last
                return False, backwards
        last[:] = new
    path[:] = new
    return True, backwards


@kernel
def _cost(cost: ByteGrid, frame: Frame, polygon: FloatArray, pose: FloatArray) -> int:
    if len(polygon) > 0:
        return cost_at_pose(cost, frame, polygon, pose[0], pose[1], pose[2])
    row, column = row_col(frame, pose[0], pose[1])
    return int(cost[row, column]) if row >= 0 else 254


@kernel
def orient(path: FloatArray, ahead: bool) -> bool:
    """Turn a piece's poses, in place, along it; whether it is driven backwards, which it never is where `ahead`."""
    towards = math.atan2(path[2, 1] - path[1, 1], path[2, 0] - path[1, 0])
    backwards = not ahead and abs(wrap(towards - path[1, 2])) > 0.5 * math.pi
    for i in range(len(path) - 1):
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        if abs(dx) < _EQUAL and abs(dy) < _EQUAL:
            continue
        path[i, 2] = wrap(math.atan2(dy, dx) + (math.pi if backwards else 0.0))
    return backwards


@kernel
def _lay_end(
    path: FloatArray, pose: FloatArray, cost: ByteGrid, frame: Frame, radius: float, backwards: bool, at_start: bool
) -> None:
    """Lay the shortest of four Dubins paths, each to a point farther in, at the beginning or the end of a piece.

    Args:
        path: (n, 3) the piece, in place.
        pose: (3,) where it began or ended before it was smoothed.
        cost: (rows, columns) uint8.
        frame: Where its cells lie.
        radius: Least turning radius, m.
        backwards: Whether the piece is driven backwards.
        at_start: Which of its ends.
    """
    reaches = np.array((radius, 2.0 * radius, math.pi * radius, 2.0 * math.pi * radius))
    n = len(path)
    shortest = 1e9
    best = np.empty((0, 3))
    driven, reach = 0.0, 0
    for k in range(n):
        i = k if at_start else n - 1 - k
        if k > 0:
            j = i - 1 if at_start else i + 1
            driven += math.hypot(path[i, 0] - path[j, 0], path[i, 1] - path[j, 1])
        if driven >= reaches[reach]:
            reach += 1
            if k > 0:
                from_outside = at_start != backwards
                laid, total = _between(
                    pose if from_outside else path[i], path[i] if from_outside else pose, k, driven, cost, frame, radius
                )
                if 0.0 < total < shortest:
                    shortest, best = total, laid
        if reach == 4:
            break
    m = len(best)
    for i in range(m):
        path[i if at_start else n - m + i] = best[m - 1 - i if backwards else i]


@kernel
def _between(
    start: FloatArray, end: FloatArray, steps: int, original: float, cost: ByteGrid, frame: Frame, radius: float
) -> Any:
    """The Dubins path (steps + 1, 3) between two poses and its length, m; 0 where it hits something or makes a loop."""
    x, y, yaw = relative(start[0], start[1], start[2], end[0], end[1], end[2], radius)
    pieces = dubins(x, y, yaw)
    whole = length(pieces)
    points = np.empty((steps + 1, 3))
    if whole * radius > 2.0 * original:
        return points, 0.0
    c, s = math.cos(start[2]), math.sin(start[2])
    total = 0.0
    for i in range(steps + 1):
        if i == steps:
            points[i] = end
        else:
            px, py, turn = along(pieces, whole * (i / steps))
            points[i, 0] = start[0] + radius * (c * px - s * py)
            points[i, 1] = start[1] + radius * (s * px + c * py)
            points[i, 2] = wrap(start[2] + turn)
        row, column = row_col(frame, points[i, 0], points[i, 1])
        if row < 0 or cost[row, column] >= INSCRIBED:
            return points, 0.0
        if i > 0:
            total += math.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return points, total
