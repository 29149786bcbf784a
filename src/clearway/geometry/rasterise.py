"""From shapes to cells and back: occupancy grids of placed shapes, outlines of occupied cells."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.geometry.shapes import Circle, FloatArray, Polygon, Shape

BoolArray = npt.NDArray[np.bool_]


def outline(shape: Shape, pose: FloatArray, *, sides: int = 48) -> FloatArray:
    """The shape's boundary as vertices (n, 2) in the frame of `pose` (3,); a disc as a polygon of `sides` around it."""
    if isinstance(shape, Circle):
        angle = 2 * np.pi * np.arange(sides) / sides
        points = shape.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    else:
        points = shape.array
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.asarray(points @ np.array([[c, s], [-s, c]]) + np.asarray(pose[:2]))


def rasterise(
    bodies: Iterable[tuple[Shape, FloatArray]], size: tuple[int, int], resolution: float, origin: tuple[float, float]
) -> BoolArray:
    """Cells (rows, cols) that a body covers or that its boundary passes through.

    Args:
        bodies: Shapes with their poses (3,), in the grid's frame.
        size: Numbers of rows and columns.
        resolution: Edge of a cell, m.
        origin: (x, y) of the lower-left corner of cell (0, 0), m.
    """
    cells = np.zeros(size, dtype=np.bool_)
    for shape, pose in bodies:
        if isinstance(shape, Circle):
            _disc(cells, (np.asarray(pose[:2]) - np.asarray(origin)) / resolution, shape.radius / resolution)
            continue
        points = (outline(shape, pose) - np.asarray(origin)) / resolution
        _trace(cells, points)
        if len(points) > 2:
            _fill(cells, points)
    return cells


def _disc(cells: BoolArray, centre: FloatArray, radius: float) -> None:
    """Mark the cells whose nearest point is within `radius` of `centre`, both in cells."""
    low = np.clip(np.floor(centre - radius), 0, cells.shape[::-1]).astype(np.int64)
    high = np.clip(np.ceil(centre + radius), 0, cells.shape[::-1]).astype(np.int64)
    x, y = (np.arange(a, b) for a, b in zip(low, high, strict=True))
    dx, dy = (np.maximum(np.maximum(k - c, c - k - 1), 0.0) for k, c in ((x, centre[0]), (y, centre[1])))
    cells[low[1] : high[1], low[0] : high[0]] |= dx[None, :] ** 2 + dy[:, None] ** 2 < radius**2


def _trace(cells: BoolArray, points: FloatArray) -> None:
    """Mark the cells along a closed boundary given in cells."""
    for p, q in zip(points, np.roll(points, -1, axis=0), strict=True):
        n = max(2, math.ceil(float(np.hypot(*(q - p))) * 10) + 1)
        along = np.floor(p + np.linspace(0.0, 1.0, n)[:, None] * (q - p)).astype(np.int64)
        inside = (along >= 0).all(1) & (along[:, 0] < cells.shape[1]) & (along[:, 1] < cells.shape[0])
        cells[along[inside, 1], along[inside, 0]] = True


def _fill(cells: BoolArray, points: FloatArray) -> None:
    """Mark the cells whose centre lies inside the polygon given in cells (even-odd rule)."""
    low = np.maximum(np.floor(points.min(0)).astype(np.int64), 0)
    high = np.minimum(np.ceil(points.max(0)).astype(np.int64), (cells.shape[1], cells.shape[0]))
    if (high <= low).any():
        return
    x = (np.arange(low[0], high[0]) + 0.5)[None, :]
    y = (np.arange(low[1], high[1]) + 0.5)[:, None]
    inside = np.zeros((high[1] - low[1], high[0] - low[0]), dtype=np.bool_)
    for (x0, y0), (x1, y1) in zip(points, np.roll(points, -1, axis=0), strict=True):
        if y0 != y1:
            inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * ((x1 - x0) / (y1 - y0)))
    cells[low[1] : high[1], low[0] : high[0]] |= inside


def explored(occupied: BoolArray, seeds: Iterable[tuple[int, int]]) -> npt.NDArray[np.int8]:
    """A map's cells after an ideal exploration: occupied, free where a seed (row, col) is connected to, else unknown."""
    from scipy import ndimage

    regions, _ = ndimage.label(~occupied)  # by the four neighbours of a cell
    data = np.full(occupied.shape, UNKNOWN, dtype=np.int8)
    for region in {int(regions[seed]) for seed in seeds} - {0}:
        data[regions == region] = FREE
    data[occupied] = OCCUPIED
    return data


def rectangles(grid: OccupancyGrid) -> int:
    """How many polygons `boundaries` gives, without making them."""
    walls = np.pad(grid.data == OCCUPIED, ((0, 0), (1, 1))).view(np.int8)
    edges = np.diff(walls, axis=1)
    rows, first = np.nonzero(edges == 1)
    last = np.nonzero(edges == -1)[1]
    wide = grid.data.shape[1] + 1
    runs = (rows * wide + first) * wide + last
    return int((~np.isin(runs, runs + wide * wide)).sum())  # a run below which the same one lies begins nothing


def boundaries(grid: OccupancyGrid) -> list[Polygon]:
    """The occupied cells as rectangles in the map frame: runs of a row, merged over equal rows. Exact and disjoint."""
    done: list[tuple[int, int, int, int]] = []
    running: dict[tuple[int, int], int] = {}
    for r in range(grid.data.shape[0] + 1):
        row = grid.data[r] == OCCUPIED if r < grid.data.shape[0] else np.zeros(grid.data.shape[1], dtype=np.bool_)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
        runs = {(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)}
        for run in sorted(set(running) - runs):
            done.append((running.pop(run), r, *run))
        for run in sorted(runs - set(running)):
            running[run] = r
    x0, y0 = grid.origin
    k = grid.resolution
    return [
        Polygon(
            (
                (x0 + a * k, y0 + r0 * k),
                (x0 + b * k, y0 + r0 * k),
                (x0 + b * k, y0 + r1 * k),
                (x0 + a * k, y0 + r1 * k),
            )
        )
        for r0, r1, a, b in sorted(done)
    ]
