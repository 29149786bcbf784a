"""The risk of a step is a probability: of one mover that of the normal distribution, whatever the robot's outline."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.geometry.footprint import Footprint, footprint, gap
from clearway.geometry.shapes import Circle, FloatArray, Polygon
from clearway.navigators.hp_st.environment.contact import STEPS, Nearby, collision_risks, near

FOOT = footprint(Polygon(((0.6, 0.2), (-0.6, 0.2), (-0.6, -0.2), (0.6, -0.2))))
ROUND = footprint(Circle(0.25))
RADIUS, SIGMA, CHANCE = 0.3, 0.05, 0.7
MARGIN, SOFT, NEARNESS = 0.05, 0.4, 0.3


def risks(
    foot: Footprint, still: FloatArray, belts: FloatArray, theta: float, steps: FloatArray, soft: float = SOFT
) -> FloatArray:
    """(k,) of `steps` (k, 3) from the origin: along x and y, and turn."""
    nearby = Nearby(
        np.vstack((still.T, np.empty(len(still)))), belts, np.empty((3, len(still) + 1)), np.empty(belts.shape), np.empty((4, STEPS))
    )  # fmt: skip
    n, m = near(len(belts), 0.0, 0.0, foot.circumscribed + 1.0, soft, nearby)
    dx, dy, turn = np.ascontiguousarray(steps.T)
    found = np.empty(len(steps))
    collision_risks(nearby, n, m, foot, MARGIN, soft, NEARNESS, theta, dx, dy, turn, found)
    return found


def belt(x: float, y: float, dx: float = 0.0, dy: float = 0.0) -> list[float]:
    """Of a mover at (x, y) that moves by (dx, dy)."""
    widest = RADIUS + 3.5 * SIGMA
    return [x, y, dx, dy, RADIUS, SIGMA, CHANCE, widest, widest + math.hypot(dx, dy), 0.0]


def risk_of(x: float, y: float, theta: float) -> float:
    """Of one standing step with a mover at (x, y), which stands too."""
    return float(risks(FOOT, np.empty((0, 3)), np.array([belt(x, y)]), theta, np.zeros((1, 3)), 0.0)[0])


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


PLACES = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
STEP = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))


@given(
    st.sampled_from([FOOT, ROUND]), st.lists(PLACES, max_size=6), st.lists(st.tuples(PLACES, PLACES), max_size=6),
    st.lists(STEP, min_size=2, max_size=STEPS),
)  # fmt: skip
def test_a_step_risks_the_same_whichever_others_are_looked_at_with_it(
    foot: Footprint, still: list[tuple[float, float]], moving: list[tuple[tuple[float, float], tuple[float, float]]],
    steps: list[tuple[float, float, float]],
) -> None:  # fmt: skip
    stands = np.array([(x, y, 0.1) for x, y in still]).reshape(-1, 3)
    belts = np.array([belt(x, y, dx, dy) for (x, y), (dx, dy) in moving]).reshape(-1, 10)
    together = risks(foot, stands, belts, 0.3, np.array(steps))
    alone = [risks(foot, stands, belts, 0.3, np.array([step]))[0] for step in steps]
    assert together.tolist() == alone


@given(st.lists(PLACES, max_size=6), st.lists(st.tuples(PLACES, PLACES), max_size=6), STEP)
def test_a_round_robots_risk_is_the_sum_over_what_it_comes_near(
    still: list[tuple[float, float]], moving: list[tuple[tuple[float, float], tuple[float, float]]],
    step: tuple[float, float, float],
) -> None:  # fmt: skip
    s = np.linspace(0.0, 1.0, 2001)
    stands = np.array([(x, y, 0.1) for x, y in still]).reshape(-1, 3)
    belts = np.array([belt(x, y, dx, dy) for (x, y), (dx, dy) in moving]).reshape(-1, 10)
    expected = 0.0
    for x, y in still:
        room = float(np.hypot(x - s * step[0], y - s * step[1]).min()) - 0.25 - 0.1
        if room < MARGIN + 1e-3:
            return  # it hits: asked elsewhere
        expected += NEARNESS * max(1.0 - room / SOFT, 0.0) ** 2
    for (x, y), (dx, dy) in moving:
        room = float(np.hypot(x + s * (dx - step[0]), y + s * (dy - step[1])).min()) - 0.25 - RADIUS
        expected += CHANCE * 0.5 * math.erfc(room / SIGMA * math.sqrt(0.5))
    tolerance = 1e-3 + len(moving) * CHANCE * 0.013
    assert risks(ROUND, stands, belts, 0.3, np.array([step]))[0] == pytest.approx(expected, abs=tolerance)


def test_what_stands_in_the_way_is_hit_and_may_be_left() -> None:
    stands = np.array([[0.36, 0.0, 0.1]])  # 1 cm from a round robot
    ahead, away = risks(ROUND, stands, np.empty((0, 10)), 0.0, np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]]))
    assert ahead == -math.inf
    assert away >= 0.0
