"""How far it is to a pose for who can't turn on the spot, and that hp-st brings a car there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.navigators.hp_st.search.manoeuvres import NONE, manoeuvres_of, to_manoeuvre
from clearway.robots import DriveLimits, load_robot

LIMITS = load_robot("f1tenth").limits(0.6)
RADIUS = LIMITS.wheelbase / math.tan(LIMITS.steering_max)


def way(x: float, y: float, theta: float, limits: DriveLimits = LIMITS, heading: float = 0.0) -> float:
    """From (x, y, theta) to the origin with `heading`, where a metre backwards counts as one forwards."""
    return float(to_manoeuvre(manoeuvres_of(limits, 0.0), np.zeros(2), heading, x, y, theta))


FARTHER = 0.8
"""m by which it may be taken to be farther off than it is."""


def about(true: float) -> object:
    return pytest.approx(true + 0.5 * FARTHER, abs=0.5 * FARTHER)


def test_a_base_that_turns_on_the_spot_needs_none() -> None:
    assert manoeuvres_of(load_robot("tiago").limits(0.6), 0.0) is NONE


def test_straight_on_and_straight_back_it_is_the_distance() -> None:
    assert way(-1.0, 0.0, 0.0) == about(1.0)
    assert way(1.0, 0.0, 0.0) == about(1.0)
    assert way(-9.0, 0.0, 0.0) == about(9.0)  # beyond the grid


@pytest.mark.parametrize("turn", [0.25 * math.pi, 0.5 * math.pi, -0.5 * math.pi])
def test_along_the_narrowest_arc_it_is_the_arc(turn: float) -> None:
    x, y = (
        RADIUS * math.sin(abs(turn)),
        math.copysign(RADIUS * (1.0 - math.cos(turn)), turn),
    )  # its end, seen from its start
    c, s = math.cos(turn), math.sin(turn)
    start = -(c * x + s * y), s * x - c * y, -turn
    assert way(*start) == about(RADIUS * abs(turn))


def test_to_turn_about_takes_a_manoeuvre() -> None:
    """Reeds and Shepp: half a turn on the spot takes pi R in three arcs of 60 degrees; forwards only, a loop and more."""
    assert way(0.0, 0.0, math.pi) == about(math.pi * RADIUS)
    ahead = to_manoeuvre(manoeuvres_of(LIMITS, math.inf), np.zeros(2), 0.0, 0.0, 0.0, math.pi)
    assert ahead > 1.5 * math.pi * RADIUS


def test_a_turned_goal_is_the_same_seen_from_there() -> None:
    c, s = math.cos(0.7), math.sin(0.7)
    x, y = -1.0, 0.4
    assert way(c * x - s * y, s * x + c * y, 0.7 + 0.3, heading=0.7) == pytest.approx(way(x, y, 0.3), abs=1e-9)
