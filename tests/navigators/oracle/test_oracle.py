"""The clairvoyant navigator in a little world of its own: the base drives what it is told, the discs keep their word."""

from __future__ import annotations

import math

import numpy as np
import pytest

from arcs import step_arc
from clearway.contract import Command, Goal, Observation, Task
from clearway.errors import ClearwayError
from clearway.navigators.oracle import Oracle
from clearway.robots import load_robot

RESCUE = load_robot("rescue")
AREA = (0.0, 0.0, 14.0, 14.0)


def nobody(t: float) -> np.ndarray:
    return np.zeros((0, 4))


def task_of(forecast, start=(1.75, 1.75, 0.785), speed=1.0) -> Task:
    return Task(period=RESCUE.period, speed_limit=speed, start=np.array(start), area=AREA, obstacle_oracle=forecast)


def drive(forecast, start=(1.75, 1.75, 0.785), goal=(12.25, 12.25, 0.0), seconds=40.0, noise=0.0, seed=0, speed=1.0):
    """Until the goal is reached or the time is over: time, least gap to a disc, statuses; the base is disturbed."""
    oracle, rng = Oracle(), np.random.default_rng(seed)
    oracle.reset(task_of(forecast, start, speed), RESCUE, np.random.default_rng(0))
    aim = Goal(np.array(goal), 0.2, math.pi)
    pose, velocity, t, gap, said = np.array(start, dtype=float), np.zeros(2), 0.0, math.inf, set()
    while t < seconds and math.hypot(*(pose - aim.pose)[:2]) > 0.2:
        command = oracle.step(Observation(t, pose.copy(), velocity, pose.copy(), aim))
        assert isinstance(command, Command)
        assert abs(command.v) <= speed + 1e-9
        assert abs(command.omega) <= RESCUE.drive.omega_max + 1e-9
        said.add(command.status)
        for _ in range(15):
            pose = step_arc(pose, command.v, command.omega, RESCUE.period / 15)
            t += RESCUE.period / 15
            for x, y, r, there in forecast(t):
                if there:
                    gap = min(gap, math.hypot(pose[0] - x, pose[1] - y) - r - 0.25)
        angle = rng.uniform(0.0, math.tau)
        pose += noise * math.sqrt(rng.random()) * np.array([math.cos(angle), math.sin(angle), rng.uniform(-1, 1)])
        velocity = np.array([command.v, command.omega])
    return t, gap, said


def test_an_empty_square_is_crossed_about_as_fast_as_it_can_be() -> None:
    t, _, said = drive(nobody)
    assert t < 1.06 * 14.65
    assert said == {"following", "turning"}  # the last word is said once it comes to rest at the goal


@pytest.mark.parametrize("speed", [0.6, 0.4])
def test_a_slow_one_looks_farther_ahead(speed: float) -> None:
    """The way takes 24 s and 37 s."""
    t, _, said = drive(nobody, speed=speed)
    assert t < 1.06 * 14.65 / speed
    assert said == {"following"}


def test_it_turns_first_where_it_looks_the_wrong_way() -> None:
    t, _, _ = drive(nobody, start=(1.75, 1.75, -2.3))
    assert t < 1.06 * 14.65 + 3.5


@pytest.mark.parametrize("seed", range(4))
def test_swinging_discs_are_passed_under_disturbance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centre, swing = rng.uniform(3.0, 11.0, (8, 2)), rng.uniform(-2.5, 2.5, (8, 2))
    still = np.array([(5.0, 5.2, 0.35, 1.0), (9.0, 8.5, 0.35, 1.0)])

    def forecast(t: float) -> np.ndarray:
        at = centre + swing * np.sin(0.5 * t + np.arange(8)[:, None])
        return np.concatenate([still, np.column_stack([at, np.full(8, 0.35), np.ones(8)])])

    t, gap, _ = drive(forecast, noise=0.01, seed=seed)
    assert t < 25.0
    assert gap > 0.0


def test_it_waits_for_a_gate() -> None:
    """A wall across the square, and its only gap is filled until 20 s."""
    wall = np.array([(7.0, y, 0.35, 1.0) for y in np.arange(0.0, 14.1, 0.5) if abs(y - 7.0) > 1.1])

    def forecast(t: float) -> np.ndarray:
        return np.concatenate([wall, [(7.0, 7.0, 0.9, float(t < 20.0))]])

    t, gap, _ = drive(forecast, start=(2.0, 7.0, 0.0), goal=(12.0, 7.0, 0.0), seconds=45.0)
    assert 20.0 < t < 45.0
    assert gap > 0.0


def test_walled_in_it_stands_and_survives() -> None:
    ring = np.array(
        [(7 + 1.5 * math.cos(a), 7 + 1.5 * math.sin(a), 0.5, 1.0) for a in np.linspace(0, math.tau, 14)[:-1]]
    )
    t, gap, said = drive(lambda _: ring, start=(7.0, 7.0, 0.0), seconds=4.0)
    assert t >= 4.0
    assert gap > 0.0
    assert "no path" in said


@pytest.mark.parametrize(
    "discs",
    [
        np.array([(1.75, 1.75, 0.4, 1.0)]),  # on top of it
        np.array([(12.25, 12.25, 0.6, 1.0)]),  # on the goal
        np.array([(np.nan, np.nan, np.nan, 1.0), (5.0, 5.0, 0.3, 0.0)]),  # nonsense, and one that isn't there
    ],
)
def test_it_survives_odd_obstacles(discs: np.ndarray) -> None:
    drive(lambda _: discs, seconds=2.0)


def test_it_survives_a_thousand_obstacles() -> None:
    rng = np.random.default_rng(0)
    discs = np.column_stack([rng.uniform(3.0, 14.0, (1000, 2)), np.full(1000, 0.05), np.ones(1000)])
    drive(lambda _: discs, seconds=1.0)


def test_without_a_forecast_it_says_so() -> None:
    with pytest.raises(ClearwayError, match=r"task\.obstacle_oracle: the navigator 'oracle' needs"):
        Oracle().reset(task_of(None), RESCUE, np.random.default_rng(0))


def test_a_pose_that_is_no_number_is_named() -> None:
    oracle = Oracle()
    oracle.reset(task_of(nobody), RESCUE, np.random.default_rng(0))
    pose = np.array([np.nan, 0.0, 0.0])
    with pytest.raises(ValueError, match="the observation's pose"):
        oracle.step(Observation(0.0, pose, np.zeros(2), pose, Goal(np.ones(3), 0.2, math.pi)))
