"""The robot's outline on a costmap: which polygon ROS makes of a shape, and what it costs to stand somewhere.

Behaviour after costmap_2d/src/footprint.cpp and base_local_planner/src/costmap_model.cpp: only the outline is
looked at, drawn cell by cell; a lethal or unknown cell on it makes the pose illegal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import Circle, FloatArray, Shape

CostArray = npt.NDArray[np.uint8]
"""A costmap: (rows, cols), C-contiguous, row r at y = origin[1] + r * resolution."""


class Scene(NamedTuple):
    """Where a robot plans: a costmap and the robot's outline.

    Attributes:
        cost: (rows, cols). origin: (2,) its lower-left corner, m. resolution: m. polygon: (m, 2) in base_link, m.
    """

    cost: CostArray
    origin: FloatArray
    resolution: float
    polygon: FloatArray


LETHAL, INSCRIBED, NO_INFORMATION = 254, 253, 255
"""costmap_2d's cost values: an obstacle, a centre that certainly collides, never seen."""

_CORNERS_OF_A_CIRCLE = 16


def outline(shape: Shape, padding: float = 0.0) -> FloatArray:
    """The polygon (m, 2) that the ROS stack uses for a shape, in base_link, metres.

    A circle becomes a 16-gon with its corners on the circle (`makeFootprintFromRadius`). Padding moves each
    coordinate away from zero (`padFootprint`), which is not an offset of the edges.
    """
    if isinstance(shape, Circle):
        angle = np.arange(_CORNERS_OF_A_CIRCLE) * (2 * math.pi / _CORNERS_OF_A_CIRCLE)
        polygon = shape.radius * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    else:
        polygon = shape.array
    return np.ascontiguousarray(polygon + np.sign(polygon) * padding)


@kernel
def line_cost(cost: CostArray, c0: int, r0: int, c1: int, r1: int) -> int:
    """The highest cost on the cells between two cells, both included; -1 at a lethal cell, -2 at an unknown one.

    The line is Bresenham's with an integer error that starts at half the longer side (line_iterator.h).
    """
    dc, dr = abs(c1 - c0), abs(r1 - r0)
    sc = 1 if c1 >= c0 else -1
    sr = 1 if r1 >= r0 else -1
    across = dc >= dr
    long, short = (dc, dr) if across else (dr, dc)
    error = long // 2
    r, c = r0, c0
    highest = 0
    for _ in range(long + 1):
        here = np.int64(cost[r, c])
        if here > highest:
            if here >= LETHAL:
                return -1 if here == LETHAL else -2
            highest = here
        error += short
        step = error >= long
        if step:
            error -= long
        if across:
            c += sc
            if step:
                r += sr
        else:
            r += sr
            if step:
                c += sc
    return highest


@kernel
def footprint_cost(scene: Scene, x: float, y: float, cosine: float, sine: float, scale: float) -> int:
    """The highest cost under the outline, `scale` times its size, at a pose given by cosine and sine of its yaw.

    Returns:
        0 .. 253, or -1 (on an obstacle), -2 (on unknown ground), -3 (centre or a corner off the map).
    """
    cost, origin, resolution, polygon = scene
    rows, cols = cost.shape
    ox, oy = origin[0], origin[1]
    if x < ox or y < oy or int((x - ox) / resolution) >= cols or int((y - oy) / resolution) >= rows:
        return -3
    corners = polygon.shape[0]
    highest = 0
    first_c, first_r, last_c, last_r = 0, 0, 0, 0
    for i in range(corners):
        px, py = scale * polygon[i, 0], scale * polygon[i, 1]
        wx = x + (px * cosine - py * sine)
        wy = y + (px * sine + py * cosine)
        if wx < ox or wy < oy:
            return -3
        c, r = int((wx - ox) / resolution), int((wy - oy) / resolution)
        if c >= cols or r >= rows:
            return -3
        if i == 0:
            first_c, first_r = c, r
        else:
            here = line_cost(cost, last_c, last_r, c, r)
            if here < 0:
                return here
            highest = max(highest, here)
        last_c, last_r = c, r
    here = line_cost(cost, last_c, last_r, first_c, first_r)
    if here < 0:
        return here
    return max(highest, here)


@kernel
def _span_line(left: npt.NDArray[np.int64], right: npt.NDArray[np.int64], c0: int, r0: int, c1: int, r1: int) -> None:
    """Widen the row span of each column by the cells of a line (the same line as `line_cost` draws)."""
    dc, dr = abs(c1 - c0), abs(r1 - r0)
    sc = 1 if c1 >= c0 else -1
    sr = 1 if r1 >= r0 else -1
    across = dc >= dr
    long, short = (dc, dr) if across else (dr, dc)
    error = long // 2
    r, c = r0, c0
    for _ in range(long + 1):
        left[c] = min(left[c], r)
        right[c] = max(right[c], r)
        error += short
        step = error >= long
        if step:
            error -= long
        if across:
            c += sc
            if step:
                r += sr
        else:
            r += sr
            if step:
                c += sc


@kernel
def free_under_robot(scene: Scene, pose: FloatArray, grid: npt.NDArray[np.int32], free: int) -> None:
    """Set blocked cells (> free) of a padded map grid to `free` where the robot stands (footprint_helper.cpp).

    Outline and inside, column by column. Nothing is done where a corner lies off the map: a rolling window holds it.

    Args:
        grid: ((rows + 2) * (cols + 2),) int32, see `clearway.navigators.move_base.mapgrid`. pose: (3,).
    """
    cost, origin, resolution, polygon = scene
    rows, cols = cost.shape
    left = np.full(cols, rows, np.int64)
    right = np.full(cols, -1, np.int64)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    corners = polygon.shape[0]
    first_c, first_r, last_c, last_r = 0, 0, 0, 0
    for i in range(corners):
        wx = pose[0] + (polygon[i, 0] * c - polygon[i, 1] * s)
        wy = pose[1] + (polygon[i, 0] * s + polygon[i, 1] * c)
        if wx < origin[0] or wy < origin[1]:
            return
        cell_c, cell_r = int((wx - origin[0]) / resolution), int((wy - origin[1]) / resolution)
        if cell_c >= cols or cell_r >= rows:
            return
        if i == 0:
            first_c, first_r = cell_c, cell_r
        else:
            _span_line(left, right, last_c, last_r, cell_c, cell_r)
        last_c, last_r = cell_c, cell_r
    _span_line(left, right, last_c, last_r, first_c, first_r)
    for col in range(cols):
        for row in range(left[col], right[col] + 1):
            i = (row + 1) * (cols + 2) + col + 1
            if grid[i] > free:
                grid[i] = free
