"""How wide is the widest way from place to place?"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from clearway.geometry.rasterise import rasterise
from clearway.geometry.shapes import FloatArray, Shape

CELL = 0.05
"""Edge of the grid's cells, m."""


class Room(NamedTuple):
    """How much room there is on a floor, on a grid in a disc's favour: an opening counts as up to two cells wider than it is.

    Attributes:
        needed: Radius of the disc, m.
        origin: Corner of the grid, m.
        width: Distance of each cell to what stands, m.
        regions: Which cells the disc gets to from each other: the same number, 0 where it can't be.
    """

    needed: float
    origin: tuple[float, float]
    width: FloatArray
    regions: npt.NDArray[np.int32]


def room_for(
    bodies: Sequence[tuple[Shape, FloatArray]], bounds: tuple[float, float, float, float], needed: float
) -> Room:
    """The room for a disc of radius `needed` [m] among `bodies` within `bounds` (x0, y0, x1, y1 [m])."""
    x0, y0, x1, y1 = bounds
    size = int(np.ceil((y1 - y0) / CELL)) + 1, int(np.ceil((x1 - x0) / CELL)) + 1
    origin = (x0 - CELL / 2, y0 - CELL / 2)
    occupied = rasterise(bodies, size, CELL, origin)
    width = ndimage.distance_transform_edt(np.pad(~occupied, 1, constant_values=True))[1:-1, 1:-1] * CELL
    return Room(needed, origin, width, ndimage.label(width >= needed - CELL)[0])


def widest_way(room: Room, places: Sequence[tuple[float, float]]) -> list[float | None]:
    """For each of the `places` [m] after the first: None if the disc gets there from the one before, else how wide [m] the
    widest way is (0: there is none at all)."""
    _, origin, width, regions = room
    cells = [(int((y - origin[1]) / CELL), int((x - origin[0]) / CELL)) for x, y in places]
    narrow: dict[
        tuple[object, object], float
    ] = {}  # between two regions the widest way is one, wherever it begins in them
    widths: list[float | None] = []
    for p, q in itertools.pairwise(cells):
        between = int(regions[p]) or p, int(regions[q]) or q
        if not _same(regions, p, q) and between not in narrow:
            narrow[between] = 2 * _bottleneck(width, p, q, room.needed)
        widths.append(None if _same(regions, p, q) else narrow[between])
    return widths


def _same(regions: npt.NDArray[np.int32], p: tuple[int, int], q: tuple[int, int]) -> bool:
    return bool(regions[p] == regions[q] != 0)


def _bottleneck(room: FloatArray, p: tuple[int, int], q: tuple[int, int], needed: float) -> float:
    """The largest radius that gets from p to q, by bisection."""
    low, high = 0.0, needed
    for _ in range(8):
        middle = (low + high) / 2
        regions, _ = ndimage.label(room > max(middle - CELL / 2, 0.0))
        low, high = (middle, high) if _same(regions, p, q) else (low, middle)
    return low
