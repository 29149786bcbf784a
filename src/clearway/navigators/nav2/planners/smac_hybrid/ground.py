"""Whether the robot may stand somewhere.

Behaviour read from ros-navigation/navigation2, nav2_smac_planner/src/collision_checker.cpp and utils.hpp.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame
from clearway.navigators.common.costmaps.layers import INSCRIBED, LETHAL, UNKNOWN, ByteGrid
from clearway.navigators.nav2.footprint import cost_at_pose
from clearway.navigators.nav2.planners.grids import Grid
from clearway.navigators.nav2.planners.smac_hybrid.graph import CHECKED, OPEN, Graph
from clearway.navigators.nav2.seams import CostView


class Ground(NamedTuple):
    """What the robot stands on, and with what outline.

    Attributes:
        cost: (rows, columns) uint8.
        frame: Where its cells lie.
        outlines: (headings, m, 2) the outline at each heading, m.
        circular: Whether the cost at the centre alone counts.
        possible: Cost at the centre below which nothing can touch the outline; not positive: that is not known.
        allow_unknown: Whether unknown ground may be entered.
    """

    cost: ByteGrid
    frame: Frame
    outlines: FloatArray
    circular: bool
    possible: int
    allow_unknown: bool


def make_ground(grid: Grid, view: CostView, headings: int, allow_unknown: bool) -> Ground:
    """The ground of a costmap."""
    angle = np.float32(2 * math.pi) / np.float32(headings) * np.arange(headings, dtype=np.float32)
    c, s = np.cos(angle.astype(np.float64))[:, None], np.sin(angle.astype(np.float64))[:, None]
    x, y = view.footprint[:, 0], view.footprint[:, 1]
    outlines = np.stack((x * c - y * s, x * s + y * c), axis=2)
    return Ground(grid.cost, grid.frame, outlines, view.circular, circumscribed_cost(view), allow_unknown)


def circumscribed_cost(view: CostView) -> int:
    """The inflation's cost at the circumscribed radius from an obstacle; -1 without inflation, 0 where it ends before."""
    if view.inflation <= 0:
        return -1
    if view.inflation < view.circumscribed:
        return 0
    if view.circumscribed <= view.inscribed:
        return INSCRIBED
    return int((INSCRIBED - 1) * math.exp(-view.scaling * (view.circumscribed - view.inscribed)))


@kernel
def is_open(ground: Ground, graph: Graph, n: Any) -> Any:
    """Whether a node may be entered, judged once, by the pose that it has then."""
    if graph.mark[n] & CHECKED == 0:
        free, cost = stands(ground, graph.x[n], graph.y[n], int(graph.heading[n]))
        graph.mark[n] |= CHECKED | (OPEN if free else 0)
        graph.cost[n] = cost
    return graph.mark[n] & OPEN != 0


@kernel
def stands(ground: Ground, x: Any, y: Any, heading: int) -> tuple[bool, int]:
    """Whether the robot may stand at a place in cells with a heading in steps, and the cost at its centre."""
    frame = ground.frame
    row, column = int(y + np.float32(0.5)), int(x + np.float32(0.5))
    if x < 0 or y < 0 or row >= frame.rows or column >= frame.cols:
        return False, LETHAL
    centre = int(ground.cost[row, column])
    if ground.circular:
        return centre < INSCRIBED or (centre == UNKNOWN and ground.allow_unknown), centre
    if centre < ground.possible:
        return True, centre
    if INSCRIBED <= centre <= LETHAL or (centre == UNKNOWN and not ground.allow_unknown):
        return False, centre
    wx, wy = frame.x + (int(x) + 0.5) * frame.resolution, frame.y + (int(y) + 0.5) * frame.resolution
    outline = ground.outlines[heading % len(ground.outlines)]
    worst = cost_at_pose(ground.cost, frame, outline, wx, wy, 0.0)
    return worst < LETHAL or (worst == UNKNOWN and ground.allow_unknown), centre


@kernel
def zone_is_open(ground: Ground, x: float, y: float, heading: int, radius: float) -> bool:
    """Whether the robot may stand at a cell's corner within `radius` cells of a place; not where `radius` is below 1."""
    if radius < 1:
        return False
    rows, columns = ground.cost.shape
    for c in range(max(0, math.floor(x - radius)), min(columns - 1, math.ceil(x + radius)) + 1):
        for r in range(max(0, math.floor(y - radius)), min(rows - 1, math.ceil(y + radius)) + 1):
            near = (c - x) ** 2 + (r - y) ** 2 <= radius**2
            if near and stands(ground, np.float32(c), np.float32(r), heading)[0]:
                return True
    return False
