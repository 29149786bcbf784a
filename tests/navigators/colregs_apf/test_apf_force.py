"""The total force, and how it is followed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.navigators.colregs_apf.encounters import CLEAR, GIVE_WAY, HEAD_ON, STAND_ON, STARBOARD
from clearway.navigators.colregs_apf.force import CHANGE, EMERGENCY, Pace, course, roll_out, situation, steer, total
from clearway.navigators.colregs_apf.potentials import Gains
from clearway.robots import DriveLimits

GAINS = Gains(1.0, 0.3, 1.0, 0.2, 4.0, 1.0, 0.3, 0.0, 1.0)
RADIUS = 0.25
GOAL = np.array((5.0, 1.0))
NOWHERE = np.array((-np.inf, -np.inf, np.inf, np.inf))
INF = math.inf
PACE = Pace(DriveLimits(0.0, 0.5, INF, INF, 1.5, INF, INF), 2.0, 0.15)


def felt(x, y, discs, v=(0.0, 0.0), kinds=None, area=NOWHERE):  # type: ignore[no-untyped-def]
    discs = np.array(discs, dtype=float).reshape(-1, 6)
    kinds = np.zeros(len(discs), np.int64) if kinds is None else np.array(kinds)
    return total(x, y, *v, 0.0, GOAL, discs, kinds, np.full(len(discs), STARBOARD), area, RADIUS, GAINS)


@given(st.floats(0.1, 3.9), st.floats(-1.9, 1.9))
@settings(max_examples=100, deadline=None)
def test_among_what_stands_it_is_minus_the_gradient_of_the_level(x: float, y: float) -> None:
    still = [(2.0, 0.5, 0, 0, 0.3, 0), (2.6, -0.4, 0, 0, 0.2, 0), (0.5, 1.2, 0, 0, 0.1, 0)]
    if min(math.hypot(x - d[0], y - d[1]) - d[4] for d in still) - RADIUS < 0.05:
        return
    area = np.array((0.0, -2.0, 4.0, 2.0))
    if min(x, y + 2.0, 4.0 - x, 2.0 - y) < 0.05:
        return
    h = 1e-6
    _, fx, fy, mx, my = felt(x, y, still, area=area)
    assert fx == pytest.approx(
        (felt(x - h, y, still, area=area)[0] - felt(x + h, y, still, area=area)[0]) / (2 * h), rel=1e-3, abs=1e-3
    )
    assert fy == pytest.approx(
        (felt(x, y - h, still, area=area)[0] - felt(x, y + h, still, area=area)[0]) / (2 * h), rel=1e-3, abs=1e-3
    )
    assert (mx, my) == (0.0, 0.0)


def test_the_rules_set_the_side_of_the_risks_force() -> None:
    # a target ahead and a little to starboard: left to itself the force would turn the robot to port
    meeting, v = [(3.0, -0.2, -0.5, 0.0, 0.35, 1)], (0.5, 0.0)
    _, _, _, mx, my = felt(0.0, 0.0, meeting, v, [HEAD_ON])
    assert mx < 0.0
    assert my < 0.0
    mirrored = [(3.0, 0.2, -0.5, 0.0, 0.35, 1)]
    assert felt(0.0, 0.0, mirrored, v, [HEAD_ON])[4] < 0.0
    # one that begins only now is judged on the spot, by the same rules
    assert felt(0.0, 0.0, meeting, v, [CLEAR]) == felt(0.0, 0.0, meeting, v, [HEAD_ON])


def test_standing_on_it_feels_nothing_until_the_other_is_close() -> None:
    v = (0.5, 0.0)
    for distance, held in ((1.2, True), (1.16, False)):  # 1.3 d_m = 1.17 m
        a = distance / math.sqrt(2.0)
        force = felt(0.0, 0.0, [(a, a, 0.0, -0.5, 0.35, 1)], v, [STAND_ON])
        assert (force[3:] == (0.0, 0.0)) is held


def test_moving_obstacles_are_felt_where_they_will_be() -> None:
    ahead = total(0.0, 0.0, 0.5, 0.0, 2.0, GOAL, np.array([(3.0, 1.0, 0.0, -0.5, 0.35, 1.0)]), np.array([GIVE_WAY]), np.array([STARBOARD]), NOWHERE, RADIUS, GAINS)  # fmt: skip
    there = felt(0.0, 0.0, [(3.0, 0.0, 0.0, -0.5, 0.35, 1)], (0.5, 0.0), [GIVE_WAY])
    assert ahead == pytest.approx(there)


def test_steer_without_limits() -> None:
    assert steer(0.0, 0.0, 0.0, 0.0, 9.0, PACE) == (0.5, 0.0)
    v, omega = steer(0.5, 0.0, 0.0, 0.0, 9.0, PACE)
    assert (v, omega) == pytest.approx((0.5 * math.cos(0.5), 1.0))
    assert steer(3.0, 0.0, 0.5, 0.0, 9.0, PACE) == (0.0, 1.5)
    assert steer(-3.0, 3.0, 0.0, 0.0, 9.0, PACE)[1] > 0.0  # the short way round
    assert steer(0.0, 0.0, 0.0, 0.0, 0.03, PACE)[0] == pytest.approx(0.2)  # no farther than the goal


def test_steer_stops_in_time_within_its_limits() -> None:
    slow = Pace(DriveLimits(0.0, 1.0, 0.5, 0.8, 2.0, 1.0, 1.5), 5.0, 0.1)
    x = theta = v = omega = 0.0
    for _ in range(200):
        v_new, omega_new = steer(0.0, theta, v, omega, max(3.0 - x, 0.0), slow)
        assert -0.08 - 1e-9 <= v_new - v <= 0.05 + 1e-9
        v, omega = v_new, omega_new
        x += 0.1 * v
    assert x == pytest.approx(3.0, abs=0.06)
    assert v < 1e-2
    for _ in range(100):
        _, omega_new = steer(2.0, theta, 0.0, omega, 0.0, slow)
        assert abs(omega_new - omega) <= 0.1 + 1e-9
        omega = omega_new
        theta += 0.1 * omega
    assert theta == pytest.approx(2.0, abs=0.02)


def test_roll_out_in_the_open_is_straight_and_its_mean_is_the_attraction() -> None:
    goal = np.array((5.0, 0.0))
    path, mean = roll_out(np.zeros(3), np.zeros(2), goal, np.empty((0, 6)), np.empty(0, np.int64), np.empty(0), NOWHERE, RADIUS, GAINS, PACE, 5, 0.9)  # fmt: skip
    np.testing.assert_allclose(path[:, 0], 0.075 * np.arange(6))
    np.testing.assert_allclose(mean, (1.0, 0.0, 0.0, 0.0), atol=1e-12)


def test_the_horizons_weights() -> None:
    # within the cap the attraction is the distance: at k = 1, 2, 3 it is 0.85, 0.7 and 0.55 at 1 m/s
    fast = PACE._replace(limits=PACE.limits._replace(v_max=1.0))
    _, mean = roll_out(np.zeros(3), np.zeros(2), np.array((1.0, 0.0)), np.empty((0, 6)), np.empty(0, np.int64), np.empty(0), NOWHERE, RADIUS, GAINS, fast, 3, 0.5)  # fmt: skip
    assert mean[0] == pytest.approx((0.5 * 0.85 + 0.25 * 0.7 + 0.125 * 0.55) / 0.875)


@pytest.mark.parametrize("turned", [0.0, 1.0, -2.5])
def test_a_change_of_course_is_at_least_15_degrees(turned: float) -> None:
    c, s = math.cos(turned), math.sin(turned)

    def at(x: float, y: float) -> list[float]:
        return [c * x - s * y, s * x + c * y]

    pose = np.zeros(3)
    meeting = np.array([(*at(3.0, 0.0), *at(-0.5, 0.0), 0.35, 1.0)])
    little = np.array((*at(1.0, -0.05), *at(0.0, -0.05)))  # 3 degrees to starboard, by the moving obstacle
    for kind, change in ((HEAD_ON, -CHANGE), (STAND_ON, -math.atan(0.05)), (CLEAR, -math.atan(0.05))):
        taken = course(pose, little, meeting, np.array([kind]), np.array([STARBOARD]), RADIUS, GAINS, 0.5)
        assert math.remainder(taken - turned, math.tau) == pytest.approx(change)
    large = np.array((*at(0.5, -0.5), *at(-0.5, -0.5)))
    taken = course(pose, large, meeting, np.array([HEAD_ON]), np.array([STARBOARD]), RADIUS, GAINS, 0.5)
    assert math.remainder(taken - turned, math.tau) == pytest.approx(-math.pi / 4)
    passed = np.array([(*at(-1.0, 1.2), *at(-0.5, 0.0), 0.35, 1.0)])  # its course is free again
    taken = course(pose, little, passed, np.array([HEAD_ON]), np.array([STARBOARD]), RADIUS, GAINS, 0.5)
    assert math.remainder(taken - turned, math.tau) == pytest.approx(-math.atan(0.05))


def test_situation() -> None:
    pose = np.zeros(3)
    far, near, nearest = (3.0, 0, 0, 0, 0.35, 1.0), (2.0, 0, 0, 0, 0.35, 1.0), (0.8, 0, 0, 0, 0.35, 1.0)
    kinds = np.array([HEAD_ON, GIVE_WAY])
    assert situation(pose, np.array([far, near]), kinds, RADIUS, 0.3) == GIVE_WAY
    assert situation(pose, np.array([far, nearest]), kinds, RADIUS, 0.3) == EMERGENCY
    assert situation(pose, np.array([far, (*nearest[:5], 0.0)]), np.array([HEAD_ON, CLEAR]), RADIUS, 0.3) == HEAD_ON
    assert situation(pose, np.empty((0, 6)), np.empty(0, np.int64), RADIUS, 0.3) == CLEAR
