"""How well a built map matches the true one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation

from clearway.geometry.grid import OCCUPIED, OccupancyGrid
from clearway.geometry.shapes import FloatArray


@dataclass(frozen=True, slots=True)
class MapQuality:
    """Shares, from 0 to 1.

    Attributes:
        precision: Share of the built map's occupied cells that lie near a true one.
        recall: Share of the true occupied cells that lie near a built one.
        f1: Their harmonic mean.
    """

    f1: float
    precision: float
    recall: float


def map_quality(built: OccupancyGrid, truth: OccupancyGrid, tolerance_cells: int = 1) -> MapQuality:
    """Compare the occupied cells of two maps of one frame; nothing is aligned.

    A cell is near another one if its centre lies at most `tolerance_cells` cells away in both x and y. `truth` holds
    what could be seen on the tour: the inside and the back of a wall is nothing that a map could show.

    Raises:
        ValueError: the cells of the two maps differ in size.
    """
    if not math.isclose(built.resolution, truth.resolution, rel_tol=1e-6):
        raise ValueError(f"cells differ in size: {built.resolution} and {truth.resolution} m")
    ours, true = _centres(built), _centres(truth)
    precision = _share_near(ours, true, built.resolution, tolerance_cells)
    recall = _share_near(true, ours, built.resolution, tolerance_cells)
    f1 = 2 * precision * recall / (precision + recall) if precision + recall > 0 else 0.0
    return MapQuality(f1, precision, recall)


def _centres(grid: OccupancyGrid) -> FloatArray:
    rows, cols = np.nonzero(grid.data == OCCUPIED)
    centres: FloatArray = np.asarray(grid.origin) + (np.column_stack((cols, rows)) + 0.5) * grid.resolution
    return centres


def _share_near(points: FloatArray, others: FloatArray, edge: float, tolerance: int) -> float:
    """Share of `points` that lie within `tolerance` cells of any of `others`, on the lattice of the latter."""
    if not len(points) or not len(others):
        return 0.0
    low = np.minimum(points.min(axis=0), others.min(axis=0)) - (tolerance + 1) * edge
    low += np.remainder(others[0] - low, edge) - 0.5 * edge  # a corner of the others' lattice
    ours, theirs = (np.floor((p - low) / edge + 1e-6).astype(int) for p in (points, others))
    size = np.maximum(ours.max(axis=0), theirs.max(axis=0)) + tolerance + 1
    cells = np.zeros(size, dtype=bool)
    cells[tuple(theirs.T)] = True
    near = binary_dilation(cells, np.ones((2 * tolerance + 1,) * 2))
    return float(near[tuple(ours.T)].mean())
