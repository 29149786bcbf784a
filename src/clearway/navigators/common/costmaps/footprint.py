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
from clearway.navigators.common.costmaps.lines import line_between, next_cell

CostArray = npt.NDArray[np.uint8]
"""A costmap: (rows, cols), C-contiguous, row r at y = origin[1] + r * resolution."""


class Frame(NamedTuple):
    """Where a costmap's cells lie.

    Numbers only: kernels hand it around in their inner loops, where a tuple of arrays would be counted each time.

    Attributes:
        x: Its lower-left corner, m.
        y: Its lower-left corner, m.
        resolution: Edge of a cell, m.
        rows: Number of rows.
        cols: Number of columns.
    """

    x: float
    y: float
    resolution: float
    rows: int
    cols: int


class Scene(NamedTuple):
    """Where a robot plans.

    Attributes:
        cost: (rows, cols) the costmap.
        frame: Where its cells lie.
        polygon: (m, 2) the robot's outline in base_link, m.
    """

    cost: CostArray
    frame: Frame
    polygon: FloatArray


def make_scene(cost: CostArray, origin: FloatArray, resolution: float, polygon: FloatArray) -> Scene:
    """A scene of a costmap whose lower-left corner is `origin` (2,), m."""
    frame = Frame(float(origin[0]), float(origin[1]), resolution, cost.shape[0], cost.shape[1])
    return Scene(cost, frame, polygon)


LETHAL, INSCRIBED, NO_INFORMATION = 254, 253, 255
"""costmap_2d's cost values: an obstacle, a centre that certainly collides, never seen."""

_CORNERS_OF_A_CIRCLE = 16


def outline(shape: Shape, padding: float = 0.0) -> FloatArray:
    """The polygon (m, 2) that the ROS stack uses for a shape, in base_link, metres.

    A circle becomes a 16-gon with its corners on the circle (`makeFootprintFromRadius`); a polygon's corners are rounded to floats,
    as they pass through a string (`makeFootprintFromString`): an obstacle's cell just as far as an edge then counts as inscribed.
    Padding moves each coordinate away from zero (`padFootprint`), which is not an offset of the edges.
    """
    if isinstance(shape, Circle):
        angle = np.arange(_CORNERS_OF_A_CIRCLE) * (2 * math.pi / _CORNERS_OF_A_CIRCLE)
        polygon = shape.radius * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    else:
        polygon = shape.array.astype(np.float32).astype(np.float64)
    return np.ascontiguousarray(polygon + np.sign(polygon) * padding)


@kernel
def row_col(frame: Frame, x: float, y: float) -> tuple[int, int]:
    """The cell that holds a point, (-1, -1) off the map (costmap_2d's worldToMap)."""
    if x < frame.x or y < frame.y:
        return -1, -1
    row, col = int((y - frame.y) / frame.resolution), int((x - frame.x) / frame.resolution)
    if row >= frame.rows or col >= frame.cols:
        return -1, -1
    return row, col


@kernel
def cell_of(frame: Frame, x: float, y: float) -> int:
    """Index of the cell that holds a point in a flat grid with a border of one cell, -1 off the map."""
    row, col = row_col(frame, x, y)
    return -1 if row < 0 else (row + 1) * (frame.cols + 2) + col + 1


@kernel
def line_cost(cost: CostArray, r0: int, c0: int, r1: int, c1: int) -> int:
    """The highest cost on the cells between two cells, both included; -1 at a lethal cell, -2 at an unknown one."""
    line = line_between(r0, c0, r1, c1)
    r, c, error = r0, c0, line.length // 2
    highest = 0
    for _ in range(line.length + 1):
        here = int(np.int64(cost[r, c]))
        if here > highest:
            if here >= LETHAL:
                return -1 if here == LETHAL else -2
            highest = here
        r, c, error = next_cell(line, r, c, error)
    return highest


@kernel
def footprint_cost(
    cost: CostArray, frame: Frame, polygon: FloatArray, x: float, y: float, cosine: float, sine: float, scale: float
) -> int:
    """The highest cost under the outline `scale * polygon` at a pose given by cosine and sine of its yaw.

    Returns:
        0 .. 253, or -1 (on an obstacle), -2 (on unknown ground), -3 (centre or a corner off the map).
    """
    if row_col(frame, x, y)[0] < 0:
        return -3
    corners = polygon.shape[0]
    highest = 0
    r0, c0 = 0, 0
    for i in range(corners + 1):
        k = i if i < corners else 0  # and back to the first corner
        px, py = scale * polygon[k, 0], scale * polygon[k, 1]
        r1, c1 = row_col(frame, x + (px * cosine - py * sine), y + (px * sine + py * cosine))
        if r1 < 0:
            return -3
        if i > 0:
            worst = line_cost(cost, r0, c0, r1, c1)
            if worst < 0:
                return worst
            highest = max(highest, worst)
        r0, c0 = r1, c1
    return highest


@kernel
def _span_line(left: npt.NDArray[np.int64], right: npt.NDArray[np.int64], r0: int, c0: int, r1: int, c1: int) -> None:
    """Widen the row span of each column by the cells of a line."""
    line = line_between(r0, c0, r1, c1)
    r, c, error = r0, c0, line.length // 2
    for _ in range(line.length + 1):
        left[c] = min(left[c], r)
        right[c] = max(right[c], r)
        r, c, error = next_cell(line, r, c, error)


@kernel
def free_under_robot(scene: Scene, pose: FloatArray, grid: npt.NDArray[np.int32], free: int) -> None:
    """Set blocked cells (> free) of a padded map grid to `free` where the robot stands (footprint_helper.cpp).

    Outline and inside, column by column. Nothing is done where a corner lies off the map: a rolling window holds it.

    Args:
        grid: ((rows + 2) * (cols + 2),) int32, see `clearway.navigators.move_base.local_planners.mapgrid`.
        pose: (3,) of the robot in the grid's frame.
    """
    frame, polygon = scene.frame, scene.polygon
    cols, stride = frame.cols, frame.cols + 2
    left = np.full(cols, frame.rows, np.int64)
    right = np.full(cols, -1, np.int64)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    corners = polygon.shape[0]
    r0, c0 = 0, 0
    for i in range(corners + 1):
        k = i if i < corners else 0
        wx = pose[0] + (polygon[k, 0] * c - polygon[k, 1] * s)
        wy = pose[1] + (polygon[k, 0] * s + polygon[k, 1] * c)
        r1, c1 = row_col(frame, wx, wy)
        if r1 < 0:
            return
        if i > 0:
            _span_line(left, right, r0, c0, r1, c1)
        r0, c0 = r1, c1
    for col in range(cols):
        for row in range(left[col], right[col] + 1):
            i = (row + 1) * stride + col + 1
            if grid[i] > free:
                grid[i] = free
