"""Arrival: at rest well within the tolerances, or within them for good."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.contract import Goal, Status
from clearway.navigators.common.arrival import BEGIN, HEADING, PATIENCE, SHARE, Approach
from clearway.robots import DriveLimits

GOAL = Goal(np.array((3.0, -1.0, math.pi - 0.05)), 0.2, 0.4)
LIMITS = DriveLimits(-1.0, 2.0, 1.0, 0.5, 1.0, 1.0, 1.0)
PERIOD = 0.1
REST = np.zeros(2)


def at(away: float, turned: float) -> np.ndarray:
    """A pose `away` [m] behind the goal and `turned` [rad] off its heading."""
    x, y, theta = GOAL.pose
    return np.array((x - away * math.cos(theta), y - away * math.sin(theta), theta + turned))


def judge(goal: Goal | None = GOAL, **more: float) -> Approach:
    approach = Approach(LIMITS, PERIOD, **more)
    approach.reset(goal)
    return approach


@pytest.mark.parametrize(
    ("away", "turned", "there"),
    [(0.09, 0.19, True), (0.11, 0.0, False), (0.0, 0.21, False), (0.0, -0.19, True), (0.0, 2 * math.pi, True)],
)
def test_well_within_both_tolerances(away: float, turned: float, there: bool) -> None:
    assert (BEGIN, HEADING) == (0.5, 0.5)
    assert judge().reached(at(away, turned), REST) is there


def test_it_brakes_where_it_would_come_to_rest_near_the_goal() -> None:
    approach, fast = judge(), np.array((1.0, 0.0))  # 1 m until it stands
    assert not approach.reached(at(1.2, 0.0), fast)
    assert not approach.stopping
    assert not approach.reached(at(1.09, 0.0), fast)  # it is still far off: nothing is called
    assert approach.stopping
    assert approach.reached(at(0.1, 0.0), np.array((0.1, 0.0)))
    at_once = Approach(LIMITS._replace(deceleration=math.inf), PERIOD)
    at_once.reset(GOAL)
    at_once.reached(at(0.11, 0.0), fast)
    assert not at_once.stopping


def test_the_word_tells_turning_from_coming_to_rest() -> None:
    fast, free = np.array((1.0, 0.0)), Goal(GOAL.pose, GOAL.xy_tolerance, math.inf)
    approach = judge()
    words = []
    for away, turned, velocity in ((1.2, 0.3, fast), (0.05, 0.3, REST), (0.05, 0.15, REST)):
        approach.reached(at(away, turned), velocity)
        words.append(approach.status)
    assert words == ["", Status.TURNING, Status.ARRIVING]
    approach = judge(free)
    approach.reached(at(0.05, 0.3), 0.1 * fast)  # any heading will do: it only brakes
    assert approach.status == Status.ARRIVING


def test_once_called_it_only_has_to_stand() -> None:
    approach = judge()
    assert not approach.reached(at(0.05, 0.3), REST)
    assert approach.stopping
    assert approach.turn == pytest.approx(-0.3)
    assert approach.reached(at(0.05, 0.15), REST)
    assert (approach.stopping, approach.turn) == (True, 0.0)
    assert approach.reached(at(0.19, 0.39), REST)  # within the tolerances the call stands
    assert not approach.reached(at(0.21, 0.0), REST)  # and outside it is taken back
    assert not approach.stopping
    assert not approach.reached(at(0.19, 0.0), REST)


def test_a_push_within_its_share_does_not_make_it_drive_again() -> None:
    approach = judge()
    approach.reached(at(0.05, 2.0), REST)
    for away, stays in ((SHARE * 0.2 - 0.01, True), (SHARE * 0.2 + 0.01, False)):
        assert not approach.reached(at(away, 2.0), REST)
        assert approach.stopping is stays


def test_the_tolerance_itself_will_do_once_it_comes_no_nearer() -> None:
    approach = judge()
    for k in range(round(PATIENCE / PERIOD)):
        assert not approach.reached(at(0.19 if k < 5 else 0.17, 0.0), REST)  # nearer: the wait begins anew
    for _ in range(5):
        assert not approach.reached(at(0.17, 0.0), REST)
    assert approach.reached(at(0.17, 0.0), REST)
    assert not approach.reached(at(0.21, 0.0), REST)  # outside it never will


def test_where_it_comes_no_nearer_it_turns_without_a_pause() -> None:
    approach = judge()
    for _ in range(round(PATIENCE / PERIOD)):
        approach.reached(at(0.19, 1.0), REST)
    for k in range(20):  # as the heading comes nearer, the place remains good enough
        assert not approach.reached(at(0.19, 1.0 - 0.04 * k), REST)
        assert approach.stopping
    assert approach.reached(at(0.19, 0.19), REST)


def test_turning_in_place_counts_as_coming_nearer() -> None:
    approach = judge()
    for k in range(50):
        assert not approach.reached(at(0.05, 2.5 - 0.04 * k), REST)
    assert approach.reached(at(0.05, 0.19), REST)


def test_a_free_heading_stays_free() -> None:
    for free in (math.inf, math.pi):
        approach = judge(Goal(GOAL.pose, 0.2, free))
        assert approach.reached(at(0.09, 3.0), REST)
        assert approach.turn == 0.0


def test_without_a_goal_and_with_a_new_one() -> None:
    assert not judge(None).reached(at(0.0, 0.0), REST)
    approach = judge()
    assert approach.reached(at(0.0, 0.0), REST)
    assert not approach.set_out(GOAL)
    assert approach.reached(at(0.19, 0.0), REST), "it was there before"
    other = Goal(GOAL.pose, 0.2, 0.4)
    assert approach.set_out(other)
    assert approach.goal is other
    assert not approach.reached(at(0.19, 0.0), REST)


def test_a_navigator_may_aim_deeper() -> None:
    deep = judge(begin=0.15, heading=0.3)
    assert not deep.reached(at(0.05, 0.0), REST)
    assert deep.reached(at(0.02, 0.1), REST)
    assert not judge(begin=0.15, heading=0.3).reached(at(0.02, 0.13), REST)
