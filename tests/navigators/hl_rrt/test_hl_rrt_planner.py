"""Paths: valid now, ever shorter, down to the shortest; the tree lives on; the same seed and budget give the same bits."""

from __future__ import annotations

import itertools
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.contract import Budget
from clearway.navigators.hl_rrt.parameters import Parameters
from clearway.navigators.hl_rrt.planner import Plan, Planner
from clearway.stand_ins import stand_ins

pytestmark = pytest.mark.slow

AREA = np.array((-3.0, -4.0, 9.0, 4.0))
FREE = np.empty((0, 3))
START, GOAL = np.zeros(2), np.array((6.0, 0.0))


def make(seed: int = 0, **change: float) -> Planner:
    planner = Planner(
        Parameters.model_validate(stand_ins("hl-rrt") | change), AREA, np.random.default_rng(seed)
    )  # fmt: skip
    planner.forget(START)
    return planner


def tick(planner: Planner, discs: np.ndarray = FREE, at=START, goal=GOAL, iterations: int | None = None) -> Plan:  # type: ignore[no-untyped-def]
    return planner.plan(
        np.array(at, float), np.array(goal, float), 0.1, np.array(discs, float), 0.075, Budget(iterations), 0.0
    )


def gap(points: np.ndarray, discs: np.ndarray) -> float:
    """The smallest gap between a polyline and discs, from points 1 mm apart or closer."""
    least = math.inf
    for a, b in itertools.pairwise(points):
        along = a + np.linspace(0, 1, 600)[:, None] * (b - a)
        for x, y, r in discs:
            least = min(least, float(np.hypot(*(along - (x, y)).T).min()) - r)
    return least


def shortest(distance: float, radius: float) -> float:
    """The shortest path between points `distance` apart around one disc in the middle: two tangents and an arc."""
    half = 0.5 * distance
    arc = math.pi - 2.0 * math.acos(radius / half)
    return 2.0 * math.sqrt(half * half - radius * radius) + radius * arc


WIDE = {"horizon": 7.0, "capacity": 20_000, "spacing": 0.001, "patience": 10**6, "cap": 10**6}
"""The whole scene within the horizon, and no end but the budget's."""


@pytest.mark.parametrize("radius", [0.8, 1.2])
@pytest.mark.parametrize("seed", range(2))
def test_cost_goes_down_to_the_shortest_path(radius: float, seed: int) -> None:
    exact, disc = shortest(6.0, radius), [(3.0, 0.0, radius)]
    costs = []
    for iterations in (500, 2_000, 5_000, 15_000):  # each run begins as the one before did
        plan = tick(make(seed, **WIDE), disc, iterations=iterations)
        assert plan.complete
        assert gap(plan.points, np.array(disc)) > -1e-6
        assert math.dist(plan.points[-1], GOAL) <= 0.1
        length = np.hypot(*np.diff(plan.points, axis=0).T).sum()
        assert plan.cost == pytest.approx(length, abs=1e-9)
        costs.append(plan.cost + math.dist(plan.points[-1], GOAL))
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] >= exact - 1e-9
    assert costs[-1] <= 1.015 * exact


def test_in_the_open_the_path_is_straight() -> None:
    plan = tick(make(2, **WIDE), iterations=5_000)
    assert 6.0 <= plan.cost + math.dist(plan.points[-1], GOAL) <= 6.03


scenes = st.lists(st.tuples(st.floats(0.5, 5.5), st.floats(-2, 2), st.floats(0.1, 0.7)), min_size=1, max_size=14)


@settings(max_examples=60)
@given(scenes, st.integers(0, 1000), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_a_path_is_never_in_collision_at_present_positions(discs, seed, dx, dy) -> None:  # type: ignore[no-untyped-def]
    planner, at = make(seed), START
    for k in range(4):  # the obstacles move, and the tree remembers paths that were valid before
        now = np.array(discs) + np.array((dx, dy, 0.0)) * k
        plan = tick(planner, now, at, iterations=200)
        if not len(plan.points):
            continue
        assert plan.points[0].tolist() == list(at)
        left = np.hypot(*(plan.points[-1] - GOAL))
        assert left < math.dist(at, GOAL)
        shrunk = np.column_stack([now[:, :2], np.minimum(now[:, 2], np.hypot(*(now[:, :2] - at).T))])
        assert gap(plan.points, shrunk) > -1e-6
        step = plan.points[1] - at
        at = at + step * min(1.0, 0.1 / np.hypot(*step))


def test_the_same_seed_and_iterations_give_the_same_bits() -> None:
    def run(seed: int) -> list[bytes]:
        planner = make(seed)
        out = []
        for k in range(6):
            discs = [(1.0 + 0.1 * k, 0.2, 0.5), (2.0, -0.5 + 0.1 * k, 0.5)]
            plan = tick(planner, discs, (0.05 * k, 0.0), iterations=150)
            out += [plan.points.tobytes(), planner.edges().tobytes(), planner.mixture.tobytes()]
        return out

    assert run(3) == run(3)
    assert run(3) != run(4)


def test_it_ends_by_itself_and_says_who_ended_it() -> None:
    free = tick(make())
    assert (free.cut, free.complete) == (False, True)
    assert 300 <= free.iterations < 3_000
    cut = tick(make(), iterations=100)
    assert (cut.cut, cut.iterations) == (True, 100)
    generous = tick(make(), iterations=10**9)
    assert (generous.cut, generous.points.tobytes()) == (False, free.points.tobytes())
    walled = tick(make(cap=500), [(0.5, y, 0.3) for y in np.arange(-4.0, 4.1, 0.3)])
    assert (walled.cut, walled.iterations, walled.complete) == (False, 500, False)


def test_seconds_cut_it_and_it_still_answers_with_what_it_has() -> None:
    planner = make()
    assert tick(planner).complete
    plan = planner.plan(START, GOAL, 0.1, FREE, 0.075, Budget(seconds=0.0), time.perf_counter())
    assert (plan.cut, plan.complete, plan.iterations) == (True, True, 0)  # the tree of the tick before


def test_old_solutions_are_used_again() -> None:
    discs = [(1.5, 0.2, 0.6)]
    planner = make()
    before = tick(planner, discs)
    after = tick(planner, discs, before.points[0] + 0.1 * (before.points[1] - before.points[0]), iterations=0)
    assert after.complete
    assert after.iterations == 0
    assert after.cost < before.cost


def test_a_node_that_is_driven_past_becomes_the_root() -> None:
    planner = make()
    first = tick(planner)
    edges = len(planner.edges())
    tick(planner, at=first.points[1], iterations=0)
    assert 0 < len(planner.edges()) < edges  # the rest was no descendant of it
    again = planner.edges()
    assert (np.hypot(*(again[:, :2] - first.points[1]).T) < 1e-12).any()


def test_it_stays_put_where_no_node_is_nearer_the_goal() -> None:
    wall = [(0.6, y, 0.6) for y in np.arange(-4.0, 4.01, 0.02)]  # the robot stands at it
    plan = tick(make(cap=1_000), wall)
    assert plan.points.shape == (0, 2)
    assert plan.cost == math.inf


def test_without_a_way_to_the_horizon_it_takes_what_is_nearest_the_goal() -> None:
    hallway = Planner(
        Parameters.model_validate(stand_ins("hl-rrt") | {"cap": 1_000}), np.array((-3.0, -1.0, 9.0, 1.0)),
        np.random.default_rng(0),
    )  # fmt: skip
    hallway.forget(START)
    plan = tick(hallway, [(2.0, y, 0.3) for y in np.arange(-1.2, 1.3, 0.3)])
    assert not plan.complete
    assert 1.6 < plan.points[-1][0] < 1.76
    assert plan.points[-1][1] == pytest.approx(0.0, abs=0.3)


def test_paths_stay_in_the_area() -> None:
    discs = [(3.0, y, 0.9) for y in (-1.8, 0.0, 1.8)] + [(2.0, 3.0, 0.7)]  # free below y = -2.7 only
    planner = make(**WIDE)
    plan = tick(planner, discs, iterations=3_000)
    assert plan.complete
    assert plan.points[:, 1].min() > -4.0
    narrow = Planner(
        Parameters.model_validate(stand_ins("hl-rrt") | WIDE),
        np.array((-3.0, -2.5, 9.0, 2.5)),
        np.random.default_rng(0),
    )
    narrow.forget(START)
    assert not tick(narrow, discs, iterations=3_000).complete


def test_the_mixture_learns_where_good_samples_are() -> None:
    planner = make()
    for _ in range(4):
        tick(planner, [(1.5, 0.0, 0.7)])
    mean = planner.mixture[:, :2]
    assert 1 <= len(mean) <= 20
    assert np.hypot(*(mean - (1.5, 0.0)).T).min() > 0.4  # not where the obstacle is
    assert (mean[:, 0] > -0.5).all()
    assert np.isfinite(planner.mixture).all()


def test_a_full_tree_goes_on() -> None:
    planner = make(capacity=64, patience=10**6, cap=10**6)
    plan = tick(planner, [(1.5, 0.2, 0.5)], iterations=5_000)
    assert plan.complete
    assert len(planner.edges()) <= 63


def test_a_thousand_discs_are_planned_through_in_milliseconds() -> None:
    x = np.linspace(-4, 8, 500)
    walls = np.concatenate([np.column_stack([x, np.full(500, y), np.full(500, 0.35)]) for y in (-1.2, 1.2)])
    planner = make()
    took = []
    for _ in range(15):
        began = time.thread_time()
        plan = tick(planner, walls)
        took.append(time.thread_time() - began)
        assert plan.complete
    assert np.median(took) < 0.05  # 3 ms where nothing else runs
