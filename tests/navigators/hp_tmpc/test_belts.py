"""Obstacle belts and the reference that the heuristic planner gives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.navigators.hp_tmpc.heuristic_planner import planner
from clearway.navigators.hp_tmpc.heuristic_planner.belts import Reference, plan_reference, predict, reference_speed

FREE = np.array([-np.inf, -np.inf, np.inf, np.inf])
NO_DISCS = np.zeros((0, 3))
NOBODY = np.zeros((0, 6, 3))
POSE, GOAL = np.array([0.0, 0.0, 0.3]), np.array([8.0, 0.0, 0.0])
C, V = 0.15, 0.5


def reference(
    static: np.ndarray, predicted: np.ndarray, *, pose: np.ndarray = POSE, goal: np.ndarray = GOAL,
    perception: float = 4.0, speed: float = V, count: int = 5, exact: bool = False,
) -> Reference:  # fmt: skip
    return plan_reference(pose, goal, static, predicted, FREE, perception, speed, C, count, 0.25, exact, 0.0)


def crossing(steps: int = 5) -> np.ndarray:
    """One obstacle from the right, at 1 m/s, that meets the robot if nobody gives way."""
    margin = 0.01 * np.minimum(np.arange(steps + 1), 3)[None]
    return predict(np.array([[0.9, -1.1]]), np.array([[0.0, 1.0]]), np.array([0.65]), margin, C)


def test_predictions() -> None:
    discs = predict(
        np.array([[1.0, 2.0]]), np.array([[0.5, -1.0]]), np.array([0.6]), np.array([[0.0, 0.01, 0.02]]), 0.2
    )
    np.testing.assert_allclose(discs, [[[1, 2, 0.6], [1.1, 1.8, 0.61], [1.2, 1.6, 0.62]]], atol=1e-15)


def test_reference_speed_is_at_least_half_of_the_fastest() -> None:
    assert [reference_speed(a, b, 0.5) for a, b in ((0.0, 1.0), (-1.0, 1.0), (0.2, 1.0))] == [0.5, 0.5, 0.6]


def test_points_are_equidistant_in_time_on_a_straight_way() -> None:
    r = reference(NO_DISCS, NOBODY, count=8)
    assert r.status == planner.TEMPORARY
    np.testing.assert_allclose(r.target, [4.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(r.points[0], POSE)
    np.testing.assert_allclose(r.points[1:, 0], V * C * np.arange(1, 9), atol=1e-12)
    np.testing.assert_allclose(r.inputs[:, 0], V, atol=1e-12)
    assert r.inputs[0, 1] == pytest.approx(-0.3 / C)  # turns into the path within the first step
    np.testing.assert_array_equal(r.inputs[1:, 1], 0.0)
    assert (r.length, r.rounds, len(r.belts)) == (pytest.approx(4.0), 1, 0)


def test_it_stands_still_at_the_goal() -> None:
    goal = np.array([0.19, 0.0, 2.0])
    r = reference(NO_DISCS, NOBODY, goal=goal)
    assert r.status == 0
    np.testing.assert_allclose(r.points[1:, 0], [0.075, 0.15, 0.19, 0.19, 0.19], atol=1e-12)
    np.testing.assert_allclose(r.inputs[:, 0], [0.5, 0.5, 0.04 / C, 0, 0], atol=1e-12)
    there = reference(NO_DISCS, NOBODY, goal=POSE)
    np.testing.assert_array_equal(there.points, np.tile(POSE, (6, 1)))
    np.testing.assert_array_equal(there.inputs, 0.0)


def test_inputs_lead_along_an_arc() -> None:
    wall = np.array([[1.0, 0.0, 1.0]])
    r = reference(wall, NOBODY, pose=np.array([0.0, 0.0, math.pi / 2]), goal=np.array([2.0, 0.0]), count=20)
    np.testing.assert_allclose(r.inputs[1:, 1], -V / 1.0, atol=1e-9)  # touches at the start: omega = v / R
    np.testing.assert_allclose(np.hypot(r.points[:, 0] - 1, r.points[:, 1]), 1.0, atol=1e-9)


def meets(points: np.ndarray, predicted: np.ndarray) -> bool:
    """Whether the robot is in a disc at the same step, 1..N."""
    n = predicted.shape[1]
    gaps = np.hypot(*(points[None, 1:n, :2] - predicted[:, 1:, :2]).transpose(2, 0, 1)) - predicted[:, 1:, 2]
    return bool((gaps < -1e-9).any())


@pytest.mark.parametrize("exact", [False, True])
def test_a_crossing_obstacle_makes_a_detour(exact: bool) -> None:
    predicted = crossing()
    blind = reference(NO_DISCS, NOBODY, exact=exact)
    assert meets(blind.points, predicted)  # without belts they meet
    seen = reference(NO_DISCS, predicted, exact=exact)
    assert not meets(seen.points, predicted)
    assert seen.rounds > 1
    assert len(seen.belts) > 0
    assert seen.length > blind.length
    assert seen.status == planner.TEMPORARY
    now = reference(predicted[0, :1], NOBODY)  # where it is now is not in the way
    assert now.length == pytest.approx(4.0)


def test_an_obstacle_that_has_passed_in_time_is_no_belt() -> None:
    far = predict(np.array([[3.0, -1.5]]), np.array([[0.0, 1.0]]), np.array([0.65]), np.zeros((1, 6)), C)
    r = reference(NO_DISCS, far)  # it crosses the way, but not where the robot is within the window
    assert (r.rounds, len(r.belts), r.length) == (1, 0, pytest.approx(4.0))


moving_obstacles = st.lists(
    st.tuples(st.floats(-1, 3), st.floats(-2, 2), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), min_size=1, max_size=6
).map(np.array)
still = st.lists(st.tuples(st.floats(-1, 4), st.floats(-2, 2), st.floats(0.3, 0.7)), max_size=5).map(
    lambda rows: np.array(rows).reshape(-1, 3)
)


@given(moving_obstacles, still, st.booleans())
@settings(max_examples=200)
def test_belts_hold_every_risky_disc(rows: np.ndarray, static: np.ndarray, exact: bool) -> None:
    n = len(rows)
    margin = np.tile(0.01 * np.arange(6), (n, 1))
    predicted = predict(rows[:, :2].copy(), rows[:, 2:].copy(), np.full(n, 0.6), margin, C)
    r = reference(static, predicted, exact=exact)
    assert np.isfinite(r.points).all()
    assert np.isfinite(r.inputs).all()
    if r.status & planner.BELT_LIMIT:
        assert r.rounds == 10
        return
    belt = {tuple(disc) for disc in r.belts}
    flat = {tuple(disc) for disc in predicted.reshape(-1, 3)}
    assert belt <= flat  # nothing but predictions
    for o in range(n):
        for i in range(6):
            for k in range(max(1, i - 1), min(5, i + 1) + 1):
                x, y, radius = predicted[o, i]
                if math.hypot(r.points[k, 0] - x, r.points[k, 1] - y) < radius - 2e-9:
                    assert tuple(predicted[o, i]) in belt
    if not r.status & (planner.START_COVERED | planner.NO_PATH):
        assert not meets(r.points, predicted)  # the path keeps clear of the belts, so of all risky discs
        discs = np.concatenate([static, r.belts])
        for x, y in r.path:
            assert (np.hypot(discs[:, 0] - x, discs[:, 1] - y) > discs[:, 2] - 3e-9).all()


def test_an_obstacle_on_top_of_the_robot() -> None:
    on_top = predict(np.zeros((1, 2)), np.zeros((1, 2)), np.array([0.65]), np.zeros((1, 6)), C)
    r = reference(NO_DISCS, on_top)
    assert r.status & planner.START_COVERED
    assert np.isfinite(r.points).all()
    assert math.hypot(*r.points[5, :2]) == pytest.approx(5 * V * C)  # straight out


def test_a_thousand_obstacles() -> None:
    rng = np.random.default_rng(0)
    static = np.column_stack([rng.uniform(-4, 4, 500), rng.uniform(-4, 4, 500), np.full(500, 0.3)])
    predicted = predict(
        rng.uniform(-4, 4, (500, 2)), rng.uniform(-1, 1, (500, 2)), np.full(500, 0.3), np.zeros((500, 6)), C
    )
    for exact in (False, True):
        r = reference(static, predicted, exact=exact)
        assert np.isfinite(r.points).all()


def test_more_steps_than_the_window_may_be_asked_for() -> None:
    r = reference(NO_DISCS, crossing(), count=60)
    assert r.points.shape == (61, 3)
    assert r.inputs.shape == (60, 2)
    np.testing.assert_allclose(r.points[-1, :2], [4.0, 0.0], atol=1e-9)
    assert V * C * len(r.inputs) > r.length
    assert r.inputs[:, 0].sum() * C == pytest.approx(r.length)
    one = reference(NO_DISCS, crossing(), count=1)
    np.testing.assert_array_equal(one.points, r.points[:2])
