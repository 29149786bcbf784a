"""The risk of a step is a probability: of one mover that of the normal distribution, whatever the robot's outline."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.geometry.footprint import footprint, gap
from clearway.geometry.shapes import FloatArray, Polygon
from clearway.navigators.hp_st.contact import LANES, Nearby, collision_risk, near

FOOT = footprint(Polygon(((0.6, 0.2), (-0.6, 0.2), (-0.6, -0.2), (0.6, -0.2))))
RADIUS, SIGMA, CHANCE = 0.3, 0.05, 0.7


def risk_of(x: float, y: float, theta: float) -> float:
    """Of one standing step with a mover at (x, y), which stands too."""
    belt = np.array([[x, y, 0.0, 0.0, RADIUS, SIGMA, CHANCE, RADIUS + 3.5 * SIGMA, RADIUS + 3.5 * SIGMA, 0.0]])
    room: FloatArray = np.zeros((1, 12 * LANES))
    nearby = Nearby(belt, np.empty((3, 0)), room, np.empty(0))
    n, m = near(np.empty((0, 3)), 1, 0.0, 0.0, FOOT.circumscribed, 0.0, nearby)
    return collision_risk(nearby, n, m, FOOT, 0.0, 0.0, 0.0, theta, 0.0, 0.0, 0.0)


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-math.pi, math.pi))
def test_a_movers_risk_is_the_tail_of_its_normal_distribution(x: float, y: float, theta: float) -> None:
    room = gap(FOOT.vertices, FOOT.radius, 0.0, 0.0, theta, x, y) - RADIUS
    tail = CHANCE * 0.5 * math.erfc(room / SIGMA * math.sqrt(0.5))
    assert risk_of(x, y, theta) == pytest.approx(tail, abs=CHANCE * 0.013)  # a step of the table; beyond 3.5 sigma: 0


def test_beside_a_long_robot_a_mover_risks_nothing() -> None:
    assert (
        risk_of(0.0, 0.85, 0.0) == 0.0
    )  # 7 standard deviations from the side, within the circumscribed circle's reach
    assert risk_of(0.85, 0.0, 0.0) > 0.1 * CHANCE
