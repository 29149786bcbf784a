"""Rules 13 to 17 by hand-made cases, their mirror images, and the closest approach against brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.navigators.colregs_apf.encounters import (
    CLEAR,
    GIVE_WAY,
    HEAD_ON,
    OVERTAKING,
    PORT,
    STAND_ON,
    STARBOARD,
    classify,
    closest_approach,
    follow,
    side_to_pass,
)

coordinate = st.floats(-5.0, 5.0)
rate = st.floats(-1.5, 1.5)


@given(coordinate, coordinate, rate, rate)
@settings(max_examples=100, deadline=None)
def test_closest_approach_against_brute_force(rx: float, ry: float, ux: float, uy: float) -> None:
    dcpa, tcpa = closest_approach(rx, ry, ux, uy)
    horizon = max(tcpa, 0.0) * 2 + 5.0
    t = np.linspace(0.0, horizon, 20_001)
    apart = np.hypot(rx + ux * t, ry + uy * t)
    grid = math.hypot(ux, uy) * horizon / 20_000
    assert apart.min() - grid <= dcpa <= apart.min() + 1e-9
    if tcpa > 1e-6 and math.hypot(ux, uy) > 0.01 and tcpa < 1e3:
        assert abs(t[apart.argmin()] - tcpa) <= 3 * horizon / 20_000 + 1e-4


def polar(bearing: float, distance: float = 3.0) -> tuple[float, float]:
    """Where a target lies at a bearing [deg to starboard] from a robot that heads along x."""
    a = -math.radians(bearing)
    return distance * math.cos(a), distance * math.sin(a)


def moving(course: float, speed: float = 0.5) -> tuple[float, float]:
    """A velocity by the course's turn to starboard from own [deg]."""
    a = -math.radians(course)
    return speed * math.cos(a), speed * math.sin(a)


CASES = [
    # bearing, target's course, its speed, what it is, and what its mirror image is
    (0, 180, 0.5, HEAD_ON, HEAD_ON),
    (10, 170, 0.5, HEAD_ON, HEAD_ON),
    (14, 200, 0.5, HEAD_ON, HEAD_ON),
    (14, 210, 0.5, GIVE_WAY, STAND_ON),  # courses not opposite enough: a crossing
    (40, 180, 0.5, GIVE_WAY, STAND_ON),  # opposite but not ahead
    (45, 270, 0.5, GIVE_WAY, STAND_ON),
    (90, 300, 0.5, GIVE_WAY, STAND_ON),
    (112, 330, 0.8, GIVE_WAY, STAND_ON),
    (120, 340, 0.8, STAND_ON, STAND_ON),  # it comes up from abaft and overtakes
    (180, 0, 0.8, STAND_ON, STAND_ON),
    (0, 0, 0.2, OVERTAKING, OVERTAKING),
    (20, 330, 0.2, OVERTAKING, OVERTAKING),
    (0, 0, 0.8, GIVE_WAY, GIVE_WAY),  # ahead and faster: no overtaking, and out of its way
    (0, 270, 0.5, GIVE_WAY, GIVE_WAY),  # crossing dead ahead: in doubt, give way
    (30, 0, 0.02, GIVE_WAY, STAND_ON),  # drifting: no course
]


@pytest.mark.parametrize(("bearing", "course", "speed", "kind", "mirrored"), CASES)
def test_rules(bearing: float, course: float, speed: float, kind: int, mirrored: int) -> None:
    assert classify(0.0, 0.5, *polar(bearing), *moving(course, speed)) == kind
    assert classify(0.0, 0.5, *polar(-bearing), *moving(-course, speed)) == mirrored


@given(st.floats(-math.pi, math.pi), coordinate, coordinate, rate, rate)
@settings(max_examples=100, deadline=None)
def test_the_world_may_be_turned(turn: float, rx: float, ry: float, vx: float, vy: float) -> None:
    c, s = math.cos(turn), math.sin(turn)
    turned = classify(turn, 0.5, c * rx - s * ry, s * rx + c * ry, c * vx - s * vy, s * vx + c * vy)
    plain = classify(0.0, 0.5, rx, ry, vx, vy)
    nudged = {classify(0.0, 0.5, rx + e, ry + f, vx + e, vy + f) for e in (-1e-6, 0, 1e-6) for f in (-1e-6, 0, 1e-6)}
    assert turned == plain or len(nudged) > 1 or math.hypot(rx, ry) < 1e-3  # on a sector's edge


def test_starboard_for_all_but_overtaking() -> None:
    for kind in (HEAD_ON, GIVE_WAY, STAND_ON):
        assert side_to_pass(kind, 2.0, 0.0, 0.5, 0.3) == side_to_pass(kind, 2.0, 0.0, 0.5, -0.3) == STARBOARD
    assert side_to_pass(OVERTAKING, 2.0, 0.0, 0.5, 0.3) == PORT
    assert side_to_pass(OVERTAKING, 2.0, 0.0, 0.5, -0.3) == STARBOARD
    assert side_to_pass(OVERTAKING, 2.0, 0.0, 0.5, 0.0) == STARBOARD


NOBODY = (np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))


def target(x: float, y: float, vx: float, vy: float, moves: float = 1.0) -> np.ndarray:
    return np.array([(x, y, vx, vy, 0.9, moves)])


def test_an_encounter_begins_with_a_risk_and_stays_what_it_was() -> None:
    pose, velocity, identity = np.zeros(3), np.array((0.5, 0.0)), np.array([7])
    kinds, sides = follow(pose, velocity, target(3.0, 0.0, -0.5, 0.0), identity, 4.0, *NOBODY)
    assert (kinds[0], sides[0]) == (HEAD_ON, STARBOARD)
    known = (identity, kinds, sides)
    # turned well to starboard there is no risk any more, and the target would count as crossing: it stays head-on
    aside = np.array((0.0, 0.0, -1.0))
    assert follow(aside, velocity, target(2.0, 0.5, -0.5, 0.0), identity, 4.0, *known)[0][0] == HEAD_ON
    assert follow(aside, velocity, target(2.0, 0.5, -0.5, 0.0), identity, 4.0, *NOBODY)[0][0] != HEAD_ON
    # past: over
    assert follow(pose, velocity, target(-0.1, 1.0, -0.5, 0.0), identity, 4.0, *known)[0][0] == CLEAR
    # another one with another identity has its own encounter
    assert follow(pose, velocity, target(0.0, 3.0, 0.5, -0.5), np.array([8]), 4.0, *known)[0][0] == STAND_ON


def test_no_encounter_without_risk_or_with_what_stands() -> None:
    pose, velocity, identity = np.zeros(3), np.array((0.5, 0.0)), np.array([7])
    for other in (
        target(3.0, 2.5, -0.5, 0.0),  # passes at 2.5 m
        target(3.0, 0.0, 0.6, 0.0),  # gets away
        target(9.0, 0.0, -0.5, 0.0),  # out of reach
        target(3.0, 0.0, 0.0, 0.0, moves=0.0),
    ):
        assert follow(pose, velocity, other, identity, 4.0, *NOBODY)[0][0] == CLEAR


def test_the_side_of_overtaking_is_latched() -> None:
    pose, velocity, identity = np.zeros(3), np.array((0.5, 0.0)), np.array([3])
    kinds, sides = follow(pose, velocity, target(2.0, -0.1, 0.1, -0.05), identity, 4.0, *NOBODY)
    assert (kinds[0], sides[0]) == (OVERTAKING, PORT)
    again = follow(pose, velocity, target(1.9, 0.1, 0.1, 0.05), identity, 4.0, identity, kinds, sides)
    assert (again[0][0], again[1][0]) == (OVERTAKING, PORT)
