"""The costmap that a Smac planner searches: as it is or coarser, and the places of poses in it.

Behaviour read from ros-navigation/navigation2: nav2_smac_planner/src/costmap_downsampler.cpp, utils.hpp, and
nav2_costmap_2d/src/costmap_2d.cpp.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame
from clearway.navigators.common.costmaps.layers import ByteGrid
from clearway.navigators.nav2.seams import CostView, NoPath


class Grid(NamedTuple):
    """A costmap to search.

    Attributes:
        cost: (rows, columns) uint8.
        frame: Where its cells lie.
    """

    cost: ByteGrid
    frame: Frame


class Place(NamedTuple):
    """Where a pose is in a grid, in cells from its lower-left corner, as far as a float32 tells.

    Attributes:
        x: Columns.
        y: Rows.
    """

    x: np.float32
    y: np.float32


def grid_of(view: CostView, factor: int) -> Grid:
    """The costmap of a view with cells `factor` times as long, each at the highest cost of those in it."""
    cost = np.ascontiguousarray(view.cost)
    rows, columns = cost.shape
    if factor > 1:
        padded = np.zeros((math.ceil(rows / factor) * factor, math.ceil(columns / factor) * factor), np.uint8)
        padded[:rows, :columns] = cost
        cost = padded.reshape(padded.shape[0] // factor, factor, -1, factor).max(axis=(1, 3))
    x, y = (float(v) for v in view.origin)
    return Grid(cost, Frame(x, y, view.resolution * factor, cost.shape[0], cost.shape[1]))


def place(frame: Frame, pose: FloatArray, name: str) -> Place:
    """Where the pose (3,) that `name` calls is (Costmap2D::worldToMapContinuous).

    Raises:
        NoPath: it is off the map.
    """
    x, y = np.float32((pose[0] - frame.x) / frame.resolution), np.float32((pose[1] - frame.y) / frame.resolution)
    if not (pose[0] >= frame.x and pose[1] >= frame.y and x < frame.cols and y < frame.rows):
        raise NoPath(f"the {name} ({pose[0]:.2f}, {pose[1]:.2f}) is off the map")
    return Place(x, y)


def to_world(frame: Frame, cells: FloatArray) -> FloatArray:
    """Points (n, 2), m, of places (n, 2) in cells (utils.hpp getWorldCoords, which takes the origin as float32)."""
    origin = np.array((frame.x, frame.y), np.float32).astype(np.float64)
    return origin + cells * frame.resolution
