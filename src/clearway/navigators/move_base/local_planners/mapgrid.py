"""Wavefront distances on the local costmap: how many cells lie between a cell and the plan, or the local goal.

Behaviour after base_local_planner/src/map_grid.cpp: four neighbours, one per step, cells at or above the
inscribed cost (and unknown ones) stop the wave. With N the number of cells, a blocked cell that the wave touches
is worth N, a cell that it never reaches N + 1.

A grid is flat, int32, with a border of one cell, so that the wave needs no bounds: cell (row, col) stands at
`(row + 1) * (cols + 2) + col + 1`. A wave stops once every sought cell has its distance, which does not
depend on that.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import INSCRIBED, NO_INFORMATION, CostArray, Scene, row_col

GridArray = npt.NDArray[np.int32]

BODY, NOSE = np.int64(1), np.int64(2)  # typed: a bare number would make kernels compile once per value
"""Bits of `wanted`: cells that the robot's centre passes, cells that a point ahead of it ends in."""

_BORDER = -1


class Room(NamedTuple):
    """Arrays that a planner's waves work in, one entry per cell of a padded grid.

    Attributes:
        blank: A grid before any wave.
        path: Grid for the wave from the plan.
        goal: Grid for the wave from the local goal.
        front: Grid for the wave from the local goal moved ahead, by which the nose is scored.
        queue: Cells in a wave's order.
        wanted: Bits of who wants to know a cell's distance; zero between two searches.
    """

    blank: GridArray
    path: GridArray
    goal: GridArray
    front: GridArray
    queue: GridArray
    wanted: npt.NDArray[np.uint8]


class Seek(NamedTuple):
    """The distinct cells that have a bit in `Room.wanted`.

    Attributes:
        cells: Their indices, and room for more.
        number: How many of these count.
    """

    cells: GridArray
    number: int


def make_room(shape: tuple[int, ...], old: Room | None = None) -> Room:
    """Room for a costmap of `shape` (rows, cols): the `old` one if it is as large."""
    size = (shape[0] + 2) * (shape[1] + 2)
    if old is not None and len(old.blank) == size:
        return old
    blank, path, goal, front, queue = (np.empty(size, np.int32) for _ in range(5))
    return Room(blank, path, goal, front, queue, np.zeros(size, np.uint8))


@kernel
def clear(cost: CostArray, blank: GridArray) -> int:
    """Fill `blank`: unreached, and one more where the wave cannot pass. Returns N + 1, the worth of an unreached cell."""
    rows, cols = cost.shape
    unreached: int = rows * cols + 1
    stride = cols + 2
    for i in range(stride):
        blank[i] = _BORDER
        blank[(rows + 1) * stride + i] = _BORDER
    for r in range(rows):
        base = (r + 1) * stride + 1
        blank[base - 1] = _BORDER
        blank[base + cols] = _BORDER
        for c in range(cols):
            blank[base + c] = unreached + (1 if cost[r, c] >= INSCRIBED else 0)
    return unreached


@kernel
def refill(grid: GridArray, blank: GridArray) -> None:
    """Copy `blank` into `grid` (a loop: array assignment in a kernel costs seconds of compilation)."""
    for i in range(grid.size):
        grid[i] = blank[i]


@kernel
def lay_plan(
    scene: Scene, ahead: FloatArray, last_x: float, last_y: float, grid: GridArray, queue: GridArray, mark: bool
) -> tuple[int, int]:
    """Walk along a plan in steps of at most one cell, from where it enters the known map to where it leaves it.

    Args:
        ahead: (n, 3) plan, local frame; (last_x, last_y) replaces its last point.
        mark: Make each cell a target.

    Returns:
        Number of targets in `queue`, and the last cell walked on (the local goal), -1 if the plan is nowhere on the map.
    """
    frame, cost = scene.frame, scene.cost
    cols, resolution = frame.cols, frame.resolution
    tail, last = 0, -1
    from_x, from_y = 0.0, 0.0
    for i in range(ahead.shape[0]):
        if i == ahead.shape[0] - 1:
            to_x, to_y = last_x, last_y
        else:
            to_x, to_y = ahead[i, 0], ahead[i, 1]
        if i == 0:
            from_x, from_y = to_x, to_y
        squared = (to_x - from_x) ** 2 + (to_y - from_y) ** 2
        steps = math.ceil(math.sqrt(squared) / resolution) if squared > resolution * resolution else 1
        dx, dy = (to_x - from_x) / steps, (to_y - from_y) / steps
        for j in range(1, steps + 1):
            x, y = (to_x, to_y) if j == steps else (from_x + j * dx, from_y + j * dy)
            row, col = row_col(frame, x, y)
            if row < 0 or cost[row, col] == NO_INFORMATION:
                if last >= 0:
                    return tail, last
                continue
            cell = (row + 1) * (cols + 2) + col + 1
            last = cell
            if mark and grid[cell] != 0:
                grid[cell] = 0
                queue[tail] = cell
                tail += 1
        from_x, from_y = to_x, to_y
    return tail, last


@kernel
def _open_cells(
    seek: Seek, grid: GridArray, wanted: npt.NDArray[np.uint8], mask: np.int64, stride: int, unreached: int
) -> int:
    """How many of the sought cells are not settled yet, and not walled in either (those never will be)."""
    pending = 0
    for k in range(seek.number):
        i = seek.cells[k]
        if wanted[i] & mask and grid[i] >= unreached:
            if grid[i] == unreached:
                pending += 1
            else:
                for j in (i - 1, i + 1, i - stride, i + stride):
                    if grid[j] == unreached or grid[j] == 0:
                        pending += 1
                        break
    return pending


@kernel
def spread(room: Room, grid: GridArray, targets: int, seek: Seek, mask: np.int64, stride: int, unreached: int) -> None:
    """Let distances spread over `grid` from the first `targets` cells of the queue until every sought cell has its own.

    Args:
        mask: Bits of `wanted` that this wave is for.
    """
    queue, wanted = room.queue, room.wanted
    pending = _open_cells(seek, grid, wanted, mask, stride, unreached)
    head, tail = 0, targets
    while head < tail and pending > 0:
        i = queue[head]
        head += 1
        d = grid[i] + 1
        for j in (i - 1, i + 1, i - stride, i + stride):
            if grid[j] >= unreached:
                if grid[j] == unreached:
                    grid[j] = d
                    queue[tail] = j
                    tail += 1
                else:
                    grid[j] = unreached - 1
                if wanted[j] & mask:
                    pending -= 1


@kernel
def spread_from(
    room: Room, grid: GridArray, target: int, seek: Seek, mask: np.int64, stride: int, unreached: int
) -> None:
    """Fill `grid` with the distances to one cell (-1: to nowhere), exact in the sought cells."""
    refill(grid, room.blank)
    if target >= 0:
        grid[target] = 0
        room.queue[0] = target
        spread(room, grid, 1, seek, mask, stride, unreached)
