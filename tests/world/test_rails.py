"""What moves on rails in the world: cylinders on splines meet a robot when the spline says, and recorded people walk on whatever it does."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest
from scipy.optimize import brentq

import clearway
from clearway.contract import Command, EventKind, Need, Observation, Task
from clearway.indicators.clearance import clearances, scenes
from clearway.indicators.legs import refined
from clearway.robots import Robot, load_robot
from clearway.scenarios.scenario import DiscSpec, LegSpec, ObstacleSpec, Scenario
from clearway.scenarios.spline import SplineSpec, position
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Trial


class Stands:
    """It stands where it is."""

    needs: ClassVar[frozenset[Need]] = frozenset()
    drives: ClassVar[frozenset[str]] = frozenset({"differential", "omnidirectional"})

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Nothing is to be known."""

    def step(self, observation: Observation) -> Command:
        return Command(0.0, 0.0)


def stand(motion: SplineSpec, seconds: float) -> Trial:
    """What happens to a disc of 0.3 m that stands at the origin."""
    cylinder = ObstacleSpec(name="c", shape=DiscSpec(kind="disc", radius=0.5), motion=motion)
    scenario = Scenario(
        name="rails", floor_plan="dynabarn", start=(0.0, 0.0, 0.0), speed=0.5, obstacles=(cylinder,), localisation="truth",
        legs=(LegSpec(name="stay", goal=(3.0, 0.0, 0.0), time_limit=seconds),), placement_xy=0.0, placement_yaw=0.0,
    )  # fmt: skip
    return clearway.simulate(scenario, "crowdnav-disc", Stands)


def test_a_cylinder_meets_a_robot_when_the_spline_says() -> None:
    motion = SplineSpec(
        kind="spline", keyframes=((0.0, -6.0, 1.0), (1.5, -4.0, 1.5), (6.0, 0.0, 0.4), (7.0, 4.0, -2.0)), offset=0.7
    )
    trial = stand(motion, 20.0)
    (contact,) = [e for e in trial.events if e.kind == EventKind.CONTACT]
    assert contact.t == pytest.approx(brentq(lambda t: math.hypot(*position(motion, t)) - 0.8, 3.0, 5.0), abs=2e-3)


def test_one_that_begins_anew_elsewhere_has_swept_nothing_on_its_way_back() -> None:
    """Straight through the robot it would be."""
    motion = SplineSpec(kind="spline", keyframes=((0.0, -4.0, 0.0), (2.0, -4.0, 3.0), (4.0, 4.0, 6.0), (6.0, 4.0, 0.0)))
    trial = stand(motion, 14.0)
    assert trial.t[-1] > 13.9
    least = min(math.hypot(*position(motion, float(t))) for t in np.arange(0.0, 14.0, 0.01)) - 0.8
    (scene,) = scenes(refined(trial))
    assert clearances(scene).min() == pytest.approx(least, abs=0.01)
    assert least > 2.0


def test_recorded_people_walk_on_whatever_the_robot_does() -> None:
    """Its effect on them is zero: with a robot that drives and with one that stands they are where they were recorded."""
    (scenario,) = load_suite("replayed").build(load_robot("tiago"), Selection(configurations=("time-3",)), 1)
    for navigator in ("orca", Stands):
        trial = clearway.simulate(scenario, "tiago", navigator)
        assert trial.t[-1] > 3.0
        for column, person in enumerate(scenario.people):
            t, x, y = np.array(person.track).T
            there = (trial.t >= t[0] + 0.1) & (trial.t <= t[-1] - 0.1)  # who comes is there at the next decision
            expected = np.column_stack([np.interp(trial.t, t, x), np.interp(trial.t, t, y)])
            assert trial.moving_obstacles[there, column, :2] == pytest.approx(expected[there], abs=1e-3)
            gone = (trial.t < t[0]) | (trial.t > t[-1] + 0.1)
            assert np.isnan(trial.moving_obstacles[gone, column, 0]).all()
