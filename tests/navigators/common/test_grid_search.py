"""Grid potentials against scipy's Dijkstra, against geometry, and on grids that have no way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from clearway.navigators.common.potentials import grid_search

TABLE = np.full(256, 254, np.uint8)
TABLE[:253] = np.minimum(50 + 0.8 * np.arange(253), 253).astype(np.uint8)
LETHAL = 254


def spread(
    costmap: np.ndarray,
    start: tuple[int, int],
    target: int = -1,
    quadratic: bool = True,
    bound: float = np.inf,
    least: float = 0.0,
) -> grid_search.Workspace:
    rows, columns = costmap.shape
    space = grid_search.Workspace(rows, columns)
    n = start[0] * columns + start[1]
    space.potential[n] = 0
    space.extent[:] = n, n
    front = np.array([n + 1, n - 1, n - columns, n + columns])
    grid_search.wave(
        costmap.reshape(-1),
        columns,
        TABLE,
        LETHAL,
        front,
        target,
        100,
        quadratic,
        10**6,
        space.potential,
        space.pending,
        space.blocks,
        space.extent,
        bound,
        least,
    )
    return space


def scipy_potential(costmap: np.ndarray, start: tuple[int, int]) -> np.ndarray:
    """Cheapest four-connected way into each cell, paying for each cell entered; the outermost ring is closed."""
    rows, columns = costmap.shape
    cost = TABLE[costmap].astype(float)
    cost[[0, -1]] = LETHAL
    cost[:, [0, -1]] = LETHAL
    index = np.arange(rows * columns).reshape(rows, columns)
    head, tail = [], []
    for a, b in ((index[:, :-1], index[:, 1:]), (index[:-1], index[1:])):
        head += [a.ravel(), b.ravel()]
        tail += [b.ravel(), a.ravel()]
    source, sink = np.concatenate(head), np.concatenate(tail)
    open_edges = cost.ravel()[sink] < LETHAL
    source, sink = source[open_edges], sink[open_edges]
    graph = coo_array((cost.ravel()[sink], (source, sink)), shape=(index.size, index.size)).tocsr()
    return dijkstra(graph, indices=index[start]).reshape(rows, columns)


@given(st.integers(0, 10**6))
@settings(max_examples=15, deadline=None)
def test_plain_potential_is_the_cheapest_way(seed: int) -> None:
    rng = np.random.default_rng(seed)
    costmap = rng.integers(0, 252, (23, 31)).astype(np.uint8)
    costmap[rng.random(costmap.shape) < 0.2] = 254
    costmap[11, 15] = 0
    space = spread(costmap, (11, 15), quadratic=False)
    expected = scipy_potential(costmap, (11, 15))
    found = space.potential.reshape(costmap.shape).astype(float)
    reached = np.isfinite(expected)
    np.testing.assert_allclose(found[reached], expected[reached], rtol=1e-5)
    assert (found[~reached] >= grid_search.HIGH).all()
    assert not space.pending.reshape(costmap.shape)[1:-1, 1:-1].any()


def test_quadratic_potential_approximates_the_distance() -> None:
    space = spread(np.zeros((101, 101), np.uint8), (50, 50))
    r, c = np.indices((101, 101))
    distance = 50 * np.hypot(r - 50, c - 50)
    inner = (distance > 500) & (r > 0) & (r < 100) & (c > 0) & (c < 100)
    ratio = space.potential.reshape(101, 101)[inner] / distance[inner]
    assert 0.97 < ratio.min() <= 1.0 + 1e-6 < ratio.max() < 1.08


def test_it_stops_at_the_target_and_cleans_up() -> None:
    costmap = np.zeros((200, 200), np.uint8)
    space = spread(costmap, (100, 100), target=100 * 200 + 120)
    reached = (space.potential < grid_search.HIGH).sum()
    assert 20**2 * 2 < reached < 0.2 * costmap.size
    space.clear()
    assert (space.potential == grid_search.HIGH).all()


@pytest.mark.parametrize("end", [(160, 40), (40, 160), (150, 150), (100, 31)])
def test_a_path_in_the_open_is_hardly_longer_than_the_straight_line(end: tuple[int, int]) -> None:
    space = spread(np.zeros((200, 200), np.uint8), (30, 30))
    path = grid_search.descend(space.potential, 200, LETHAL, float(end[1]), float(end[0]), 30.0, 30.0, 50.0, 800)
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    straight = np.hypot(end[0] - 30, end[1] - 30)
    assert straight - 1 <= length <= 1.03 * straight + 1
    assert tuple(path[-1]) == (30.0, 30.0)


@pytest.mark.parametrize("quadratic", [True, False])
def test_a_path_goes_through_the_gap(quadratic: bool) -> None:
    costmap = np.zeros((60, 60), np.uint8)
    costmap[:, 30] = 254
    costmap[44:47, 30] = 0
    space = spread(costmap, (10, 10), quadratic=quadratic)
    path = grid_search.descend(space.potential, 60, LETHAL, 50.0, 10.0, 10.0, 10.0, 50.0, 400)
    assert len(path) > 0
    crossing = path[np.argmin(np.abs(path[:, 0] - 30))]
    assert 43.5 <= crossing[1] <= 46.5
    cells = np.rint(path).astype(int)
    assert not (costmap[cells[:, 1], cells[:, 0]] == 254).any()


def test_no_path_out_of_an_unreached_cell() -> None:
    costmap = np.zeros((40, 40), np.uint8)
    costmap[20:31, [20, 30]] = 254
    costmap[[20, 30], 20:31] = 254
    space = spread(costmap, (5, 5))
    assert space.potential[25 * 40 + 25] >= grid_search.HIGH
    assert len(grid_search.descend(space.potential, 40, LETHAL, 25.0, 25.0, 5.0, 5.0, 50.0, 160)) == 0


def test_best_first_reaches_the_target_at_no_less_than_the_cheapest_cost() -> None:
    rng = np.random.default_rng(4)
    costmap = np.zeros((50, 50), np.uint8)
    costmap[rng.random(costmap.shape) < 0.25] = 254
    costmap[[5, 44], [5, 44]] = 0
    space = grid_search.Workspace(50, 50)
    start, target = 5 * 50 + 5, 44 * 50 + 44
    assert grid_search.best_first(
        costmap.reshape(-1), 50, TABLE, LETHAL, 50, start, target, False, space.potential, space.pending, space.extent
    )
    expected = scipy_potential(costmap, (5, 5))[44, 44]
    assert expected <= space.potential[target] <= 1.2 * expected
    path = grid_search.descend_cells(space.potential, 50, 44.0, 44.0, start, 10_000)
    assert tuple(path[-1]) == (5.0, 5.0)
    assert np.abs(np.diff(path, axis=0)).max() == 1
    assert (costmap[path[:, 1].astype(int), path[:, 0].astype(int)] == 0).all()


@given(st.integers(0, 10**6))
@settings(max_examples=15, deadline=None)
def test_a_bound_leaves_the_path_as_it_is_and_saves_cells(seed: int) -> None:
    rng = np.random.default_rng(seed)
    costmap = np.zeros((120, 120), np.uint8)
    costmap[rng.random(costmap.shape) < 0.05] = 254
    costmap[[60, 90], [20, 100]] = 0
    target = 90 * 120 + 100
    full = spread(costmap, (60, 20), target)
    known = float(full.potential[target])
    bounded = spread(costmap, (60, 20), target, bound=known + 500, least=45.0)
    assert (bounded.potential < grid_search.HIGH).sum() < (full.potential < grid_search.HIGH).sum()
    paths = [grid_search.descend(s.potential, 120, LETHAL, 100.0, 90.0, 20.0, 60.0, 50.0, 480) for s in (full, bounded)]
    assert np.array_equal(*paths)
    none = spread(costmap, (60, 20), target, bound=0.8 * known, least=45.0)
    assert none.potential[target] >= grid_search.HIGH
