"""Occupancy grids: cells of a floor plan, in ROS's order (row 0 at the lowest y), map frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clearway.geometry.read_only import read_only

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""The three values of a nav_msgs/OccupancyGrid that a trinary map holds."""


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """A map of cells, axis-aligned in its frame.

    Attributes:
        data: (rows, cols) int8; row r, column c covers y from origin[1] + r * resolution, x from origin[0] + c *
            resolution.
        resolution: Edge of a cell, m.
        origin: The lower-left corner x, y of cell (0, 0), m.
    """

    data: npt.NDArray[np.int8]
    resolution: float
    origin: tuple[float, float]

    def read_only(self) -> OccupancyGrid:
        """The same, with cells that nobody can write."""
        return replace(self, data=read_only(self.data)) if self.data.flags.writeable else self
