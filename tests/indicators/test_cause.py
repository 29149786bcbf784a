"""Why a trial failed: one hand-made contact for each of the causes, and the ratios to the clairvoyant's limit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from clearway.geometry.shapes import Circle, rectangle
from clearway.indicators import INDICATORS, score_row
from clearway.indicators.cause import cause, who_moved
from clearway.robots import DriveLimits
from clearway.trials import Attempt, Body, Event, Labels, Leg, Outcome, Span, Trial

PERIOD = 0.15


def at_once(v_min: float, v_max: float, omega_max: float) -> DriveLimits:
    """Of a base that takes up any speed at once."""
    return DriveLimits(v_min, v_max, math.inf, math.inf, omega_max, math.inf, math.inf)


def contact(robot: np.ndarray, moving_obstacles: np.ndarray, *, status: str = "", stood: bool = False) -> Trial:
    """A trial that ends in contact: robot (n, 3), moving obstacles (n, m, 2); discs of 0.25 m and 0.35 m."""
    n, m = moving_obstacles.shape[:2]
    bodies = tuple(Body(f"d{k}", "moving obstacle", Circle(0.35), None) for k in range(m))
    t = PERIOD * np.arange(n)
    velocity = np.zeros((n, 2))
    if not stood:
        velocity[:, 0] = 0.5
    leg = Leg("forth", robot[0], np.array([9.0, 0.0, 0.0]), 0.2, np.inf)
    attempt = Attempt(
        Labels("own", "own", "own", 1.0), "rescue", "some", "truth", Circle(0.25), (leg,), bodies, 1.0, PERIOD,
        limits=at_once(0.0, 1.0, 1.5), optimal_time=5.0, shortest_path=4.0,
    )  # fmt: skip
    events = [Event(0.0, "status", status)] if status else []
    return Trial(
        attempt, t, robot, velocity, robot, velocity, np.zeros(n, np.int64),
        np.concatenate([moving_obstacles, np.zeros((n, m, 1))], axis=2), (Span(0, 0.0, float(t[-1]), False),),
        (*events, Event(float(t[-1]), "contact", "moving obstacle 'd0' at 1 m/s", 0)), Outcome.COLLISION,
    )  # fmt: skip


def closing(count: int, speed: float, n: int = 20) -> Trial:
    """`count` discs around a robot that stands at the origin close in on it at `speed` [m/s]."""
    angles = 2 * np.pi * np.arange(count) / count
    away = 0.6 + speed * PERIOD * np.arange(n)[::-1]
    discs = away[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return contact(np.zeros((n, 3)), discs)


def test_a_ring_that_closes_is_a_crushing_zone() -> None:
    assert cause(closing(8, 1.0)) == "crushing zone"


@pytest.mark.parametrize(("status", "expected"), [("iteration limit", "iteration limit"), ("input limit", "input-limit violation"),
                                                  ("infeasible", "infeasible"), ("", "unforeseen"), ("tracking", "unforeseen")])  # fmt: skip
def test_with_a_way_out_the_navigators_word_counts(status: str, expected: str) -> None:
    n = 20
    robot = np.zeros((n, 3))
    robot[:, 0] = 0.5 * PERIOD * np.arange(n)
    disc = np.broadcast_to([robot[-1, 0] + 0.6, 0.0], (n, 1, 2))
    assert cause(contact(robot, disc.copy(), status=status)) == expected


@pytest.mark.parametrize(("away", "expected"), [(2.0, "unforeseen"), (0.26, "crushing zone")])
def test_walls_count_as_what_they_are(away: float, expected: str) -> None:
    """A disc comes at a robot that could turn aside, if the walls to both sides, 20 m long and `away` [m], let it."""
    trial = closing(1, 1.0)
    walls = tuple(Body(f"wall {y:g}", "wall", rectangle(20.0, 0.02), np.array([0.0, y, 0.0])) for y in (-away, away))
    attempt = replace(trial.attempt, bodies=walls + trial.attempt.bodies, limits=at_once(0.0, 2.0, 4.0))
    assert (
        cause(replace(trial, attempt=attempt, moving_obstacles=trial.moving_obstacles - [0.001, 0.0, 0.0])) == expected
    )


def test_a_robot_that_stood_was_run_into() -> None:
    trial = closing(1, 1.0)
    stood = replace(trial, velocity=np.zeros((len(trial.t), 2)))
    assert cause(stood) == "contact at rest"
    assert who_moved(stood) == "obstacle"
    assert who_moved(trial) == "both"
    turning = replace(trial, velocity=np.tile([0.0, 1.5], (len(trial.t), 1)))
    assert (who_moved(turning), cause(turning)) == ("obstacle", "contact at rest"), "its outline stays where it is"
    square = replace(turning, attempt=replace(trial.attempt, footprint=rectangle(0.5, 0.5)))
    assert who_moved(square) == "both"
    assert cause(square) != "contact at rest"


def test_without_contact_the_outcome_is_the_cause() -> None:
    assert cause(replace(closing(1, 1.0), outcome=Outcome.LIVELOCK, events=())) == "livelock"


def test_ratios_to_the_limit_and_the_share_of_cut_decisions() -> None:
    n = 41
    robot = np.zeros((n, 3))
    robot[:, 0] = 9.0 * np.linspace(0.0, 1.0, n)
    trial = contact(robot, np.full((n, 1, 2), 50.0))
    cut = np.zeros(n, np.bool_)
    cut[:10] = True
    reached = replace(
        trial, outcome=Outcome.REACHED, events=(), spans=(Span(0, 0.0, float(trial.t[-1]), True),), cut=cut
    )
    row = score_row(reached)
    assert row["PL_shortest"] == pytest.approx(9.0 / 4.0)
    assert row["CT_optimal"] == pytest.approx(PERIOD * 40 / 5.0)
    assert row["cut"] == pytest.approx(100 * 10 / 41)
    assert row["cause"] == ""
    assert (
        INDICATORS["PL_shortest"].function(replace(reached, attempt=replace(reached.attempt, shortest_path=None))).value
        is None
    )


def test_who_cannot_brake_in_time_is_in_a_crushing_zone():
    """0.375 m before a wall at 0.5 m/s: at 0.1 m/s² it takes 1.25 m to stop, at 5 m/s² 25 mm."""
    n = 12
    robot = np.column_stack([PERIOD * 0.5 * np.arange(n), np.zeros(n), np.zeros(n)])
    wall = Body("wall", "wall", rectangle(0.1, 40.0), np.array([robot[-1, 0] + 0.25 + 0.05, 0.0, 0.0]))
    trial = contact(robot, np.empty((n, 0, 2)))
    for rate, told in ((0.1, "crushing zone"), (5.0, "unforeseen")):
        attempt = replace(trial.attempt, bodies=(wall,), limits=DriveLimits(0.0, 1.0, rate, rate, 1.5, rate, rate))
        assert cause(replace(trial, attempt=attempt)) == told
