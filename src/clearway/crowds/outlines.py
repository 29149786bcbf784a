"""The walls of an occupancy grid: the outlines of what is occupied, as polygons."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.crowds.bodies import IntArray
from clearway.geometry.compiled import kernel
from clearway.geometry.grid import OCCUPIED, OccupancyGrid
from clearway.geometry.shapes import FloatArray

# A side of a cell that has what is occupied on its left: 0 leads to +x, 1 to +y, 2 to -x, 3 to -y.


def outlines(grid: OccupancyGrid, tolerance: float | None = None) -> list[FloatArray]:
    """Polygons (n, 2) in metres around the occupied cells of `grid`, with these on the left.

    Args:
        tolerance: How far a polygon may be from the cells' sides, m; default: a cell, so that a slanting wall is no staircase
            (Douglas, Peucker 1973). 0: the cells' very sides.
    """
    occupied = np.pad(grid.data == OCCUPIED, 1)
    within = (grid.resolution if tolerance is None else tolerance) / grid.resolution
    corners, ends = _trace(occupied)
    polygons = []
    for first, last in zip([0, *ends[:-1]], ends, strict=True):
        points = _simplified(corners[first:last].astype(np.float64), within)
        if len(points) > 2:
            polygons.append(np.array(grid.origin) + (points - 1.0) * grid.resolution)
    return polygons


@kernel
def _trace(occupied: npt.NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """The closed ways along the sides of the cells: (n, 2) column and row of the corners where they turn, and (k,) where each of
    them ends in it. Cells that touch at a corner only are not of one piece."""
    rows, columns = occupied.shape
    sides = np.zeros((rows + 1, columns + 1, 4), np.bool_)
    count = 0
    for r in range(1, rows - 1):
        for c in range(1, columns - 1):
            if occupied[r, c]:
                sides[r, c, 0] = not occupied[r - 1, c]
                sides[r, c + 1, 1] = not occupied[r, c + 1]
                sides[r + 1, c + 1, 2] = not occupied[r + 1, c]
                sides[r + 1, c, 3] = not occupied[r, c - 1]
                count += 4
    corners, ends, n, k = np.empty((count, 2), np.int64), np.empty(count, np.int64), 0, 0
    for r0 in range(rows):
        for c0 in range(columns):
            if not sides[r0, c0, 0]:
                continue
            r, c, way, before = r0, c0, 0, -1
            while sides[r, c, way]:
                sides[r, c, way] = False
                if way != before:
                    corners[n, 0], corners[n, 1] = c, r
                    n += 1
                before = way
                c += 1 if way == 0 else -1 if way == 2 else 0
                r += 1 if way == 1 else -1 if way == 3 else 0
                for turn in (1, 0, 3):  # left, straight on, right
                    if sides[r, c, (before + turn) % 4]:
                        way = (before + turn) % 4
                        break
            ends[k] = n
            k += 1
    return corners[:n].copy(), ends[:k].copy()


def _simplified(ring: FloatArray, within: float) -> FloatArray:
    """Of a closed polygon, the corners without which it would be farther off than `within`; at least its two most distant."""
    far = int(np.argmax(((ring - ring[0]) ** 2).sum(1)))
    return np.concatenate([_kept(ring[: far + 1], within)[:-1], _kept(np.vstack([ring[far:], ring[:1]]), within)[:-1]])


def _kept(points: FloatArray, within: float) -> FloatArray:
    """The ends of a way and what else it needs (Douglas, Peucker 1973)."""
    keep, spans = np.zeros(len(points), np.bool_), [(0, len(points) - 1)]
    keep[[0, -1]] = True
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        a, chord = points[first], points[last] - points[first]
        between = points[first + 1 : last] - a
        off = np.abs(chord[0] * between[:, 1] - chord[1] * between[:, 0]) / max(float(np.hypot(*chord)), 1e-12)
        worst = int(np.argmax(off))
        if off[worst] > within:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return points[keep]
