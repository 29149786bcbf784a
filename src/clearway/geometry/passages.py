"""How wide the ways through a map are: how far a disc comes on it, and which is the widest that comes to a place."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OccupancyGrid
from clearway.geometry.shapes import FloatArray

_FINE = 2
"""Cells are halved along each edge: then the middle line of every passage runs between two of them."""


def roomiest(grid: OccupancyGrid) -> tuple[float, float]:
    """The place (x, y) [m] that is farthest from all that is not free.

    Raises:
        ClearwayError: nothing is free.
    """
    room = _room(grid)
    if not (room > 0.0).any():
        raise ClearwayError("no cell of the map is free")
    row, column = np.unravel_index(int(np.argmax(room)), room.shape)
    return _place(grid, int(row), int(column))


def widest_ways(grid: OccupancyGrid, start: tuple[float, float], widths: Iterable[float]) -> FloatArray:
    """Of each cell the widest of some discs that can come to touch it from a place: how wide the narrowest passage is on the widest way.

    Args:
        grid: The map; what is unknown, and what lies beyond its edge, is no way.
        start: Which place (x, y), m; a disc begins wherever it covers that.
        widths: The discs' diameters, m.

    Returns:
        (rows, cols) the diameter, m; 0: none of them comes there; NaN: not free.

    Raises:
        ClearwayError: the place is not free.
    """
    from scipy import ndimage

    free, room = grid.data == FREE, _room(grid)
    edge = grid.resolution / _FINE
    row, column = (int((v - o) // grid.resolution) for v, o in zip(start[::-1], grid.origin[::-1], strict=True))
    inside = 0 <= row < free.shape[0] and 0 <= column < free.shape[1]
    if not (inside and free[row, column]):
        raise ClearwayError(f"({start[0]:g}, {start[1]:g}) is no free place of the map", field="start")
    y, x = (o + (np.arange(n) + 0.5) * edge for o, n in zip(grid.origin[::-1], room.shape, strict=True))
    away = np.hypot(y[:, None] - start[1], x[None, :] - start[0])
    found = np.zeros(room.shape)
    for width in sorted(widths, reverse=True):
        regions, _ = ndimage.label(room >= width / 2 - 1e-9)
        begun = np.unique(regions[away <= width / 2])
        came = np.isin(regions, begun[begun > 0])
        if came.any():
            touched = ndimage.distance_transform_edt(~came) * edge <= width / 2
            found[touched & (found == 0.0)] = width
    rows, columns = free.shape
    coarse: FloatArray = found.reshape(rows, _FINE, columns, _FINE).max(axis=(1, 3))
    return np.where(free, coarse, np.nan)


def _room(grid: OccupancyGrid) -> FloatArray:
    """(2 rows, 2 cols) the radius of the widest disc about each quarter of a cell, m.

    Measured to the middles of quarters that are not free, not to their edges: the middle line of a passage runs between two quarters,
    and so the disc that fits between its walls is as wide as the passage.
    """
    from scipy import ndimage

    fine: npt.NDArray[np.bool_] = np.repeat(np.repeat(grid.data == FREE, _FINE, axis=0), _FINE, axis=1)
    room: FloatArray = ndimage.distance_transform_edt(np.pad(fine, 1))[1:-1, 1:-1] * (grid.resolution / _FINE)
    return room


def _place(grid: OccupancyGrid, row: int, column: int) -> tuple[float, float]:
    edge = grid.resolution / _FINE
    return grid.origin[0] + (column + 0.5) * edge, grid.origin[1] + (row + 0.5) * edge
