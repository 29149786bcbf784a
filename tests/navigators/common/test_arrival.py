"""Arrival: well within the tolerances, or within them for good."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.contract import Goal
from clearway.navigators.common.arrival import PATIENCE, SHARE, Arrival

GOAL = Goal(np.array((3.0, -1.0, math.pi - 0.05)), 0.2, 0.4)


def at(away: float, turned: float) -> np.ndarray:
    """A pose `away` [m] from the goal and `turned` [rad] off its heading."""
    x, y, theta = GOAL.pose
    return np.array((x - away * math.cos(0.7), y + away * math.sin(0.7), theta + turned))


def judge(goal: Goal | None = GOAL) -> Arrival:
    arrival = Arrival()
    arrival.reset(goal)
    return arrival


@pytest.mark.parametrize(
    ("away", "turned", "there"),
    [(0.13, 0.27, True), (0.15, 0.0, False), (0.0, 0.29, False), (0.0, -0.27, True), (0.0, 2 * math.pi, True)],
)
def test_well_within_both_tolerances(away: float, turned: float, there: bool) -> None:
    assert SHARE == 0.7
    assert judge().reached(at(away, turned), 0.0) is there


def test_the_tolerance_itself_will_do_once_it_comes_no_nearer() -> None:
    arrival = judge()
    assert not arrival.reached(at(0.19, 0.0), 10.0)
    assert not arrival.reached(at(0.17, 0.0), 10.5)  # nearer: the wait begins anew
    assert not arrival.reached(at(0.18, 0.0), 10.4 + PATIENCE)
    assert not arrival.reached(at(0.21, 0.0), 10.6 + PATIENCE)  # outside it never will
    assert arrival.reached(at(0.18, 0.0), 10.6 + PATIENCE)


def test_turning_in_place_counts_as_coming_nearer() -> None:
    arrival = judge()
    for k in range(50):
        assert not arrival.reached(at(0.1, 2.5 - 0.04 * k), 0.1 * k)
    assert arrival.reached(at(0.1, 0.2), 5.1)


def test_a_free_heading_stays_free() -> None:
    free = Goal(GOAL.pose, 0.2, math.inf)
    assert judge(free).reached(at(0.13, 3.0), 0.0)
    assert not judge(free).reached(at(0.15, 0.0), 0.0)


def test_without_a_goal_and_with_a_new_one() -> None:
    assert not judge(None).reached(at(0.0, 0.0), 0.0)
    arrival = judge()
    assert not arrival.reached(at(0.19, 0.0), 0.0)
    arrival.reset(Goal(GOAL.pose, 0.2, 0.4))
    assert not arrival.reached(at(0.19, 0.0), PATIENCE + 1.0)


def test_a_tolerance_of_nothing() -> None:
    exact = Goal(np.zeros(3), 0.0, 0.0)
    assert judge(exact).reached(np.zeros(3), 0.0)
    assert not judge(exact).reached(np.array((1e-3, 0.0, 0.0)), 0.0)
