"""Nav2's NavFn against a plain reading of its search, and the details in which it differs from ROS 1's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.navigators.common.potentials.grid_search import HIGH
from clearway.navigators.common.potentials.navfn import NavfnSearch
from clearway.navigators.nav2.planners.navfn import Navfn
from clearway.navigators.nav2.planners.parameters import NavfnParameters
from clearway.navigators.nav2.seams import CostView, NoPath

F = np.float32


def view(cost: np.ndarray, resolution: float = 0.05, origin: tuple[float, float] = (-1.0, 2.0)) -> CostView:
    square = np.array([(0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)])
    return CostView(cost, np.array(origin), resolution, square, 0.1, 0.1414, 3.0, 0.5, True)


def plain_potential(
    cost: np.ndarray, start: tuple[int, int], target: tuple[int, int], allow_unknown: bool, astar: bool
) -> np.ndarray:
    """NavFn's potential, read from nav2_navfn_planner/src/navfn.cpp: three lists of cells, one after another."""
    rows, columns = cost.shape
    price = np.full(cost.shape, 254, int)
    for r in range(1, rows - 1):
        for c in range(1, columns - 1):
            if cost[r, c] < 253:
                price[r, c] = min(int(50 + 0.8 * cost[r, c]), 253)
            elif cost[r, c] == 255 and allow_unknown:
                price[r, c] = 253
    potential = np.full(cost.shape, 1e10, F)
    potential[start] = 0
    threshold = F(254)
    if astar:
        threshold = F(math.hypot(start[0] - target[0], start[1] - target[1]) * 50) + threshold
    r0, c0 = start
    current = [(r0, c0 + 1), (r0, c0 - 1), (r0 - 1, c0), (r0 + 1, c0)]
    current = [n for n in current if 0 <= n[0] < rows and 0 <= n[1] < columns and price[n] < 254]
    nexts: list[tuple[int, int]] = []
    overs: list[tuple[int, int]] = []
    for _ in range(max(rows * columns // 20, rows + columns)):
        if not current and not nexts:
            break
        waiting = set(overs)
        for r, c in current:
            left, right, up, down = (potential[n] for n in ((r, c - 1), (r, c + 1), (r - 1, c), (r + 1, c)))
            low, high = sorted((min(left, right), min(up, down)))
            step = F(price[r, c])
            if high - low >= step:
                value = low + step
            else:
                d = (high - low) / step
                value = low + step * (F(-0.2301) * d * d + F(0.5307) * d + F(0.7040))
            if value < potential[r, c]:
                potential[r, c] = value
                if astar:
                    value = value + F(math.hypot(r - target[0], c - target[1]) * 50)
                goes = nexts if value < threshold else overs
                for n, of in (((r, c - 1), left), ((r, c + 1), right), ((r - 1, c), up), ((r + 1, c), down)):
                    if price[n] < 254 and n not in waiting and of > value + F(0.707106781 * price[n]):
                        goes.append(n)
                        waiting.add(n)
        current, nexts = nexts, []
        if not current:
            threshold += F(100)
            current, overs = overs, []
        if potential[target] < 1e10:
            break
    return potential


@pytest.mark.parametrize("astar", [False, True])
@pytest.mark.parametrize("unknown", [False, True])
def test_potential_against_a_plain_reading(astar: bool, unknown: bool) -> None:
    rng = np.random.default_rng(5)
    reached = 0
    for _ in range(12):
        cost = rng.integers(0, 253, (24, 31)).astype(np.uint8)
        cost[rng.random(cost.shape) < 0.2] = 254
        cost[rng.random(cost.shape) < 0.15] = 255
        start, target = (int(rng.integers(1, 23)), int(rng.integers(1, 30))), (12, 15)
        cost[start] = cost[target] = 0
        expected = plain_potential(cost, start, target, unknown, astar)
        search = NavfnSearch(unknown)
        found = search.spread(cost, start, target, best_first=astar)
        potential = search._workspace.potential.reshape(cost.shape)
        np.testing.assert_allclose(potential, expected, rtol=1e-6)
        assert found == (expected[target] < HIGH)
        reached += found
    assert reached > 4


def test_astar_looks_at_fewer_cells_and_finds_a_like_path() -> None:
    cost = np.zeros((200, 200), np.uint8)
    cost[60:140, 100] = 254
    start, goal = np.array((1.0, 7.0, 0.0)), np.array((7.0, 7.0, 1.0))
    lengths = []
    cells = []
    for astar in (False, True):
        planner = Navfn(NavfnParameters(use_astar=astar))
        path = planner.plan(start, goal, view(cost))
        lengths.append(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
        cells.append((planner._search._workspace.potential < HIGH).sum())
        np.testing.assert_allclose(path[0, :2], start[:2], atol=0.03)
        np.testing.assert_array_equal(path[-1], goal)
        assert (path[:-1, 2] == 0).all()
    assert cells[1] < 0.8 * cells[0]
    assert lengths[0] == pytest.approx(2 * math.hypot(3.0, 2.0), rel=0.04)
    assert lengths[1] == pytest.approx(lengths[0], rel=0.04)


def test_a_goal_in_an_obstacle_is_approached_within_the_tolerance() -> None:
    cost = np.zeros((100, 100), np.uint8)
    cost[45:56, 65:76] = 254
    start, goal = np.array((0.5, 4.5, 0.0)), np.array((2.5, 4.525, 2.0))
    path = Navfn(NavfnParameters()).plan(start, goal, view(cost))
    assert path[-1, 2] == 2.0
    assert 0.25 <= np.abs(path[-1, :2] - goal[:2]).max() <= 0.35
    with pytest.raises(NoPath, match=r"within 0\.2 m"):
        Navfn(NavfnParameters(tolerance=0.2)).plan(start, goal, view(cost))
    with pytest.raises(NoPath, match="occupied"):
        Navfn(NavfnParameters(tolerance=0.0)).plan(start, goal, view(cost))


def test_the_last_heading_is_the_goals_or_that_of_the_approach() -> None:
    cost = np.zeros((100, 100), np.uint8)
    start, goal = np.array((0.5, 4.5, 0.3)), np.array((2.5, 4.5, 2.0))
    assert Navfn(NavfnParameters()).plan(start, goal, view(cost))[-1, 2] == 2.0
    approach = Navfn(NavfnParameters(use_final_approach_orientation=True))
    assert approach.plan(start, goal, view(cost))[-1, 2] == pytest.approx(0.0, abs=0.1)
    here = np.array((0.5, 4.5, 2.0))
    np.testing.assert_array_equal(approach.plan(start, here, view(cost)), [start])
    np.testing.assert_array_equal(Navfn(NavfnParameters()).plan(start, here, view(cost)), [here])


def test_the_path_ends_at_the_goal_and_does_not_go_back_to_it() -> None:
    cost = np.zeros((80, 80), np.uint8)
    rng = np.random.default_rng(3)
    planner = Navfn(NavfnParameters())
    for _ in range(40):
        start, goal = (np.array((*rng.uniform((-0.5, 2.5), (2.5, 5.5)), 0.0)) for _ in range(2))
        path = planner.plan(start, goal, view(cost))
        np.testing.assert_array_equal(path[-1], goal)
        if len(path) > 3:
            before, last = path[-2, :2] - path[-3, :2], path[-1, :2] - path[-2, :2]
            assert before @ last > -0.0013  # half a cell back at most


def test_start_and_goal_off_the_map_and_unknown_ground() -> None:
    cost = np.zeros((60, 60), np.uint8)
    inside, outside = np.array((0.0, 3.0, 0.0)), np.array((2.1, 3.0, 0.0))
    planner = Navfn(NavfnParameters())
    with pytest.raises(NoPath, match="start"):
        planner.plan(outside, inside, view(cost))
    with pytest.raises(NoPath, match="goal"):
        planner.plan(inside, outside, view(cost))
    edge = np.array((1.99, 3.0, 0.0))  # rounds to a column that is not there
    assert len(planner.plan(inside, edge, view(cost))) > 3
    cost[:, 30] = 255
    far = np.array((1.5, 3.0, 0.0))
    assert len(planner.plan(inside, far, view(cost))) > 10
    with pytest.raises(NoPath):
        Navfn(NavfnParameters(allow_unknown=False)).plan(inside, far, view(cost))
