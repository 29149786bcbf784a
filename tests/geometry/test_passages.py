"""Ways through a map: the widest disc that comes to a cell, on maps whose passages are known."""

from __future__ import annotations

from heapq import heapify, heappop, heappush

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.geometry.passages import roomiest, widest_ways

EDGE = 0.1
WIDTHS = [0.1 * k for k in range(4, 16)]


def _rooms(*doors: int) -> OccupancyGrid:
    """Rooms of 3 by 3 m in a row, in the wall of 0.2 m behind each a door of so many cells."""
    data = np.full((30, 32 * len(doors) + 30), FREE, dtype=np.int8)
    for k, cells in enumerate(doors):
        wall = data[:, 32 * k + 30 : 32 * k + 32]
        wall[:] = OCCUPIED
        wall[10 : 10 + cells] = FREE
    return OccupancyGrid(data, EDGE, (-1.0, 2.0))


@pytest.mark.parametrize(
    ("doors", "expected"), [((9, 7, 12), (0.9, 0.7, 0.7)), ((6, 11), (0.6, 0.6)), ((10, 8), (1.0, 0.8))]
)
def test_behind_each_door_counts_the_narrowest_so_far(doors: tuple[int, ...], expected: tuple[float, ...]) -> None:
    grid = _rooms(*doors)
    found = widest_ways(grid, (0.5, 3.5), WIDTHS)
    assert found[15, 15] == pytest.approx(WIDTHS[-1])
    for k, width in enumerate(expected):
        assert found[15, 32 * (k + 1) + 15] == pytest.approx(width)
    assert np.isnan(found[2, 30])  # in the wall


def test_the_wider_of_two_ways_counts_and_what_is_unknown_is_none() -> None:
    grid = _rooms(6)
    grid.data[20:29, 30:32] = FREE  # a second door, 0.9 m
    assert widest_ways(grid, (0.5, 3.5), WIDTHS)[15, 50] == pytest.approx(0.9)
    grid.data[20:29, 30:32] = UNKNOWN
    assert widest_ways(grid, (0.5, 3.5), WIDTHS)[15, 50] == pytest.approx(0.6)
    grid.data[10:16, 30:32] = UNKNOWN
    assert widest_ways(grid, (0.5, 3.5), WIDTHS)[15, 50] == 0.0


def test_as_wide_as_the_widest_path_from_cell_to_cell() -> None:
    rng = np.random.default_rng(3)
    grid = OccupancyGrid(np.where(rng.random((24, 40)) < 0.02, OCCUPIED, FREE).astype(np.int8), EDGE, (0.0, 0.0))
    room = distance_transform_edt(np.pad(np.kron(grid.data == FREE, np.ones((2, 2))), 1))[1:-1, 1:-1] * EDGE / 2
    start = roomiest(grid)
    away = {
        cell: np.hypot((cell[0] + 0.5) * EDGE / 2 - start[1], (cell[1] + 0.5) * EDGE / 2 - start[0])
        for cell in np.ndindex(room.shape)
    }
    assert room[min(away, key=lambda cell: away[cell])] == room.max()
    widest = {cell: room[cell] for cell in away if away[cell] <= room[cell]}  # their discs cover the start
    queue = [(-radius, cell) for cell, radius in widest.items()]  # Dijkstra's search, of the least room on the way
    heapify(queue)
    while queue:
        here, (r, c) = heappop(queue)
        for to in ((r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)):
            if to in away and (there := min(-here, room[to])) > widest.get(to, 0.0):
                widest[to] = there
                heappush(queue, (-there, to))
    found = widest_ways(grid, start, WIDTHS)
    comes = np.kron(found, np.ones((2, 2)))
    for cell, radius in widest.items():
        assert comes[cell] >= max((w for w in WIDTHS if w <= 2 * radius + 1e-9), default=0.0)
    for row, column in np.argwhere(found > 0.0)[::7]:  # and no wider than that of a cell that its disc reaches
        reached = [
            r
            for (y, x), r in widest.items()
            if np.hypot(y - 2 * row - 0.5, x - 2 * column - 0.5) <= found[row, column] / EDGE + 1
        ]
        assert 2 * max(reached) >= found[row, column] - 1e-9


def test_a_place_that_is_not_free_is_refused() -> None:
    grid = _rooms(9)
    for place in ((2.05, 2.1), (50.0, 3.0)):
        with pytest.raises(ClearwayError, match="no free place of the map"):
            widest_ways(grid, place, WIDTHS)
    with pytest.raises(ClearwayError, match="no cell of the map is free"):
        roomiest(OccupancyGrid(np.full((4, 4), OCCUPIED, dtype=np.int8), EDGE, (0.0, 0.0)))
