"""What the search takes a certificate to ask is what one asks: against the closed form, and against `certify` itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from space_time_scenes import OTHER, OWN

from clearway.forecasts.forecast import Forecast
from clearway.geometry.footprint import footprint
from clearway.geometry.shapes import Circle, FloatArray
from clearway.navigators.hp_st.environment.contact import Base, belts_of, near, predicted_obstacles, room_around
from clearway.navigators.hp_st.environment.sight import Sight
from clearway.navigators.hp_st.guarantee.certificate import Rules, Safety, certify, stopped_after
from clearway.navigators.hp_st.guarantee.stopping import (
    NOBODY,
    Halting,
    StepEnd,
    braking_time,
    fastest_certified,
    longest_braking,
    stopping_risk,
    widest_braking,
)
from clearway.navigators.hp_st.guarantee.tube import drive, room, tube
from clearway.robots import load_robot

LIMITS = load_robot("rescue").limits(1.0)
PERIOD, COUNT = 0.15, 12
BODY = footprint(Circle(OWN))
ACCELERATION = 1.25
EVERYWHERE = np.array((-math.inf, -math.inf, math.inf, math.inf))


def coming(x: float, y: float, vx: float, vy: float) -> Forecast:
    """One who goes on with its velocity, known exactly, and keeps its bound of the acceleration."""
    t = PERIOD * np.arange(COUNT + 1)
    at = np.stack((x + vx * t, y + vy * t), axis=-1)[None]
    return Forecast(
        PERIOD, np.empty((0, 3)), at[:, None], np.full((1, 1, COUNT + 1), 1e-3), np.ones((1, 1)), np.array([OTHER]), at.copy(),
        0.5 * ACCELERATION * t[None] ** 2, np.array([4.4]), np.arange(1), np.zeros(1),
    )  # fmt: skip


def standing(x: float, y: float) -> Forecast:
    """One that stands, and nobody who moves."""
    none = coming(0.0, 0.0, 0.0, 0.0)
    return none._replace(
        still=np.array([[x, y, OTHER]]), **{name: getattr(none, name)[:0] for name in Forecast._fields[2:]}
    )


def risk(forecast: Forecast, v: float, omega: float = 0.0, margin: float = 0.0) -> float:
    """Of one who stays at the origin for a period and then drives with `v` along x."""
    obstacles = predicted_obstacles(forecast, np.array((1e-3, 0.0, 1.0)))
    nearby = room_around(obstacles)
    moving = belts_of(obstacles, 0, 1, 0, longest_braking(LIMITS, PERIOD), nearby.belts)
    n, m = near(moving, 0.0, 0.0, 3.0, 0.0, nearby)
    halting = Halting(Base(LIMITS, BODY), obstacles.reach, margin, PERIOD, PERIOD)
    return float(stopping_risk(nearby, n, m, halting, StepEnd(0.0, 0.0, 0.0, v, omega)))


def certified(forecast: Forecast, v: float) -> bool:
    """The same by the certificate, of one who begins with that `v` when the step has ended."""
    start: FloatArray = np.array((0.0, 0.0, 0.0, v, 0.0))
    plan = stopped_after(drive(start, np.array([[v, 0.0]]), LIMITS, PERIOD), 0, LIMITS, PERIOD)
    about = tube(plan, room(plan, LIMITS), PERIOD, np.zeros(5), np.zeros(3), False)
    gone = forecast._replace(centre=forecast.centre[:, 1:].copy(), reach=forecast.reach[:, 1:].copy())
    return bool(certify(plan, about, PERIOD, BODY, gone, Rules(ACCELERATION, EVERYWHERE, Sight(math.inf), 0.0)).ok)


@pytest.mark.parametrize(("v", "speed"), [(0.6, 1.0), (1.0, 2.0), (0.3, 0.5)])
def test_who_comes_head_on_has_to_be_as_far_as_both_go_until_it_stands(v: float, speed: float) -> None:
    time = braking_time(LIMITS, v, 0.0)
    assert time == pytest.approx(v / 2.0)
    span = max(time, 2.0 * PERIOD)
    instants = math.floor(span / PERIOD + 1e-9) + 1
    needed = OWN + OTHER + 0.5 * v * time + speed * (span + PERIOD) + 0.5 * ACCELERATION * (instants * PERIOD) ** 2
    assert risk(coming(needed + 0.02, 0.0, -speed, 0.0), v) == 0.0
    assert risk(coming(needed - 0.02, 0.0, -speed, 0.0), v) > 0.99
    assert risk(coming(needed + 0.02, 0.0, -speed, 0.0), v, margin=0.04) > 0.99


def test_what_stands_in_the_way_of_its_braking_counts() -> None:
    needed = OWN + OTHER + 1.0 / (2.0 * LIMITS.deceleration)
    assert risk(standing(needed + 0.01, 0.0), 1.0) == 0.0
    assert risk(standing(needed - 0.01, 0.0), 1.0) == 1.0
    assert risk(standing(needed + 0.01, 0.0), 1.0, margin=0.02) == 1.0
    assert risk(standing(-OWN - OTHER - 0.01, 0.0), 1.0, margin=0.02) == 0.0, "it leaves that"
    assert risk(standing(OWN + OTHER - 0.01, 0.0), 0.0) == 0.0, "one that stands comes no nearer"


def test_the_widest_braking_is_what_a_certificate_asks_beside_what_stands() -> None:
    safety = Safety(LIMITS, PERIOD, np.array((0.01, 0.01, 0.0, 0.0, 1.0)), np.array((0.02, 0.02, 0.02)))
    margin = widest_braking(safety)
    start: FloatArray = np.array((0.0, 0.0, 0.0, 1.0, 0.0))
    whole = stopped_after(drive(start, np.array([[1.0, 0.0]]), LIMITS, PERIOD), 1, LIMITS, PERIOD)
    about = tube(whole, room(whole, LIMITS), PERIOD, safety.disturbance, safety.start, False)
    rules = Rules(ACCELERATION, EVERYWHERE, Sight(math.inf), 0.0)
    along = np.linspace(0.0, 0.4, 41)
    for off, clear in ((0.001, True), (-0.002, False)):
        row = np.column_stack((along, np.full(41, OWN + OTHER + margin + off), np.full(41, OTHER)))
        assert certify(whole, about, PERIOD, BODY, NOBODY._replace(still=row), rules).ok is clear


@pytest.mark.parametrize(("late", "low", "high"), [(0.0, 0.9, 1.0), (0.1, 0.8, 0.95), (0.187, 0.5, 0.65)])
def test_it_goes_no_faster_than_it_could_stop_before_who_is_unseen(late: float, low: float, high: float) -> None:
    safety = Safety(LIMITS, PERIOD, np.array((0.01, 0.01, 0.0, 0.0, 1.0)), np.zeros(3))
    rules = Rules(ACCELERATION, EVERYWHERE, Sight(4.0), 4.4, late)

    def allowed(v: float) -> bool:
        start: FloatArray = np.array((v * late, 0.0, 0.0, v, 0.0))
        whole = stopped_after(drive(start, np.array([[v, 0.0]]), LIMITS, PERIOD), 1, LIMITS, PERIOD)
        about = tube(whole, room(whole, LIMITS), PERIOD, safety.disturbance, safety.start, False)
        return bool(certify(whole, about, PERIOD, BODY, NOBODY, rules._replace(eye=np.zeros(3))).ok)

    v = fastest_certified(BODY, safety, rules)
    assert low <= v < high
    assert allowed(v)
    assert not allowed(v + 0.05)


@pytest.mark.parametrize("unseen", [0.0, 100.0])
def test_what_slowness_would_not_help_does_not_slow_it(unseen: float) -> None:
    safety = Safety(LIMITS, PERIOD, np.zeros(5), np.zeros(3))
    assert fastest_certified(BODY, safety, Rules(ACCELERATION, EVERYWHERE, Sight(4.0), unseen)) == 1.0


def test_one_that_stands_is_free_as_long_as_it_could_get_away() -> None:
    assert risk(coming(OWN + OTHER + 0.5, 0.0, 0.0, 0.0), 0.0) == 0.0
    assert risk(coming(OWN + OTHER + 0.1, 0.0, -0.2, 0.0), 0.0) > 0.99
    assert risk(coming(2.0, 0.0, 0.0, 1.0), 0.0) == 0.0


def test_the_certificate_agrees_nearly_always() -> None:
    """Braking counts as driving evenly as long, so that the two may differ by centimetres."""
    rng = np.random.default_rng(5)
    yes = no = wrong = 0
    for _ in range(300):
        angle, far = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.7, 2.5)
        forecast = coming(far * math.cos(angle), far * math.sin(angle), *rng.uniform(-2.0, 2.0, 2))
        v = float(rng.uniform(0.6, 1.0))  # brakes longer than the two periods that one needs that stands
        free, allowed = risk(forecast, v) == 0.0, certified(forecast, v)
        yes, no, wrong = yes + (free and allowed), no + (not free and not allowed), wrong + (free != allowed)
    assert yes > 100
    assert no > 20
    assert wrong < 0.05 * (yes + no), wrong
