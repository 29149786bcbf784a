"""What it costs to stand somewhere with an outline, as Nav2's servers ask it.

Behaviour after nav2_costmap_2d/src/footprint_collision_checker.cpp: the outline is drawn cell by cell and the highest cost on
it counts; a lethal cell ends the search. Unlike in ROS 1 an unknown cell is but the highest cost, 255, and the centre may
lie off the map.
"""

from __future__ import annotations

import math

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import LETHAL, CostArray, Frame, row_col
from clearway.navigators.common.costmaps.lines import line_between, next_cell


@kernel
def _line_cost(cost: CostArray, r0: int, c0: int, r1: int, c1: int) -> int:
    """The highest cost on the cells between two cells, both included; LETHAL at the first lethal one."""
    line = line_between(r0, c0, r1, c1)
    r, c, error = r0, c0, line.length // 2
    highest = 0
    for _ in range(line.length + 1):
        here = int(cost[r, c])
        if here == LETHAL:
            return LETHAL
        highest = max(highest, here)
        r, c, error = next_cell(line, r, c, error)
    return highest


@kernel
def cost_at_pose(cost: CostArray, frame: Frame, polygon: FloatArray, x: float, y: float, yaw: float) -> int:
    """The highest cost under the outline `polygon` (m, 2) at a pose, 0 .. 255; LETHAL where a corner is off the map.

    As in the source, what comes after an unknown cell on another edge can't lower the 255 any more: a footprint on
    unknown and on lethal cells counts as unknown, if the unknown ones come first.
    """
    cosine, sine = math.cos(yaw), math.sin(yaw)
    corners = polygon.shape[0]
    highest = 0
    r0, c0 = 0, 0
    for i in range(corners + 1):
        k = i if i < corners else 0  # and back to the first corner
        px, py = polygon[k, 0], polygon[k, 1]
        r1, c1 = row_col(frame, x + (px * cosine - py * sine), y + (px * sine + py * cosine))
        if r1 < 0:
            return LETHAL
        if i == corners:  # the source draws the last edge from the first corner
            return max(highest, _line_cost(cost, r1, c1, r0, c0))
        if i > 0:
            highest = max(highest, _line_cost(cost, r0, c0, r1, c1))
            if highest == LETHAL:
                return highest
        r0, c0 = r1, c1
    return highest
