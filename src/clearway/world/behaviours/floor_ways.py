"""Ways across a floor, as people take them: round what stands, through doors, with a shoulder's room where there is.

The floor is a grid. To each goal there is one tree of shortest ways; who walks heads for the farthest place on the way that can
be seen from here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from clearway.geometry.compiled import kernel
from clearway.geometry.rasterise import rasterise
from clearway.geometry.shapes import FloatArray, Shape

CELL = 0.1
"""Edge of a cell, m."""
SPARE = 0.15
"""Room that a way leaves beside a person where there is as much, m."""
NARROW = 5.0
"""What a metre costs where there is not."""
AHEAD = 4.0
"""How far along the way a person looks for the place to head for, m."""

_Trees = npt.NDArray[np.int32]


class FloorWays:
    """The ways of people of one size.

    Args:
        bodies: What stands, with its poses (3,), map frame.
        bounds: x_min, y_min, x_max, y_max that hold all that matters, m.
        radius: Of a person, m.

    Attributes:
        origin: (2,) the lower left corner of the grid, m.
        room: (rows, cols) distance from a cell's middle to what stands, m.
    """

    def __init__(
        self, bodies: Sequence[tuple[Shape, FloatArray]], bounds: tuple[float, float, float, float], radius: float
    ) -> None:
        x0, y0, x1, y1 = bounds
        size = math.ceil((y1 - y0) / CELL) + 1, math.ceil((x1 - x0) / CELL) + 1
        self.origin = np.array((x0, y0))
        taken = rasterise(bodies, size, CELL, (x0, y0))
        self.room = np.asarray(ndimage.distance_transform_edt(~taken), np.float64) * CELL
        self._radius = radius
        self._trees: dict[tuple[int, int], _Trees] = {}
        self._graph = self._edges()

    def tree(self, goal: Sequence[float] | FloatArray) -> _Trees:
        """(cells,) the next cell on the way from each to `goal` (2,); negative: there is none, or it is the goal's own."""
        row, col = self._cell(goal)
        if (row, col) not in self._trees:
            _, before = dijkstra(
                self._graph, directed=False, indices=row * self.room.shape[1] + col, return_predecessors=True
            )
            self._trees[row, col] = np.asarray(before, np.int32)
        return self._trees[row, col]

    def reaches(self, start: Sequence[float], goal: Sequence[float]) -> bool:
        """Whether there is a way from `start` (2,) to `goal` (2,), m."""
        (row, col), end = self._cell(start), self._cell(goal)
        return (row, col) == end or bool(self.tree(goal)[row * self.room.shape[1] + col] >= 0)

    def free(self, place: Sequence[float]) -> bool:
        """Whether a person has room at `place` (2,), up to a cell."""
        return bool(self.room[self._cell(place)] > self._radius - CELL)

    def room_at(self, x: float, y: float) -> float:
        """How far what stands is from (x, y) [m], up to a cell."""
        return float(self.room[self._cell((x, y))])

    def target(self, tree: _Trees, x: float, y: float, goal: FloatArray) -> tuple[float, float]:
        """Where to head for from (x, y) [m] on the way to `goal` (2,), whose tree is `tree`."""
        return heading_for(tree, self.room, self.origin, self._radius, x, y, goal)

    def _cell(self, place: Sequence[float] | FloatArray) -> tuple[int, int]:
        rows, cols = self.room.shape
        col, row = int((place[0] - self.origin[0]) / CELL), int((place[1] - self.origin[1]) / CELL)
        return min(max(row, 0), rows - 1), min(max(col, 0), cols - 1)

    def _edges(self) -> coo_array:
        """Between neighbouring cells that a person fits into, at what it costs to go."""
        rows, cols = self.room.shape
        number = np.arange(rows * cols).reshape(rows, cols)
        fits = self.room > self._radius - 0.5 * CELL
        price = np.where(self.room < self._radius + SPARE, NARROW, 1.0)
        begin, end, cost = [], [], []
        for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here = np.s_[: rows - dr, max(0, -dc) : cols - max(0, dc)]
            there = np.s_[dr:, max(0, dc) : cols + min(0, dc)]
            both = fits[here] & fits[there]
            begin.append(number[here][both])
            end.append(number[there][both])
            cost.append((math.hypot(dr, dc) * CELL * 0.5 * (price[here] + price[there]))[both])
        edges = np.concatenate(cost), (np.concatenate(begin), np.concatenate(end))
        return coo_array(edges, shape=(rows * cols, rows * cols)).tocsr()


@kernel
def heading_for(
    tree: np.ndarray, room: FloatArray, origin: FloatArray, radius: float, x: float, y: float, goal: FloatArray
) -> tuple[float, float]:
    """The farthest place on the way from (x, y) [m] that is seen from there, no farther on than `AHEAD`; the goal if it is.

    Args:
        tree: (cells,) the next cell of each.
        room: (rows, cols) distance to what stands, m.
        origin: (2,) the lower left corner, m.
        radius: Of who walks, m.
        goal: (2,) m.
    """
    if math.hypot(goal[0] - x, goal[1] - y) < AHEAD and _seen(room, origin, radius, x, y, goal[0], goal[1]):
        return goal[0], goal[1]
    rows, cols = room.shape
    row = min(max(int((y - origin[1]) / CELL), 0), rows - 1)
    col = min(max(int((x - origin[0]) / CELL), 0), cols - 1)
    at, found_x, found_y = row * cols + col, x, y
    for k in range(int(AHEAD / CELL)):
        at = tree[at]
        if at < 0:
            break
        px, py = origin[0] + (at % cols + 0.5) * CELL, origin[1] + (at // cols + 0.5) * CELL
        if k > 2 and not _seen(room, origin, radius, x, y, px, py):
            break
        found_x, found_y = px, py
    return found_x, found_y


@kernel
def _seen(room: FloatArray, origin: FloatArray, radius: float, x: float, y: float, px: float, py: float) -> bool:
    """Whether one can walk from (x, y) straight to (px, py), m."""
    rows, cols = room.shape
    n = max(1, math.ceil(math.hypot(px - x, py - y) / (0.5 * CELL)))
    for k in range(1, n + 1):
        col, row = int((x + (px - x) * k / n - origin[0]) / CELL), int((y + (py - y) * k / n - origin[1]) / CELL)
        if row < 0 or col < 0 or row >= rows or col >= cols or room[row, col] < radius:
            return False
    return True
