"""Rooms that are drawn by hand, for tests of what drives in them."""

from __future__ import annotations

import numpy as np

from clearway.geometry.grid import OccupancyGrid


def floor() -> OccupancyGrid:
    """A room of 9 x 4 m around (2.5, 0)."""
    data = np.zeros((80, 180), np.int8)
    data[[0, -1]] = 100
    data[:, [0, -1]] = 100
    return OccupancyGrid(data, 0.05, (-2.0, -2.0))
