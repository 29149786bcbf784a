"""Navigators that follow who moves in the odometry's frame, on a base that turns about a point ahead of base_link."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.contract import Goal, Observation, Task
from clearway.geometry.shapes import FloatArray
from clearway.navigators.registry import make_navigator
from clearway.robots import load_robot
from perceived import obstacles

PERIOD, RATE = 0.05, 2.0
AT, WALKS = np.array((3.0, -1.0)), np.array((0.0, 0.8))


def foreseen(name: str, pivot: float) -> FloatArray:
    """(n, 2) where it expects one who walks evenly to be at last, m, while a base turns to and fro about a point so far ahead."""
    robot = load_robot("jackal")
    robot = robot.model_copy(update={"drive": robot.drive.model_copy(update={"pivot": pivot})})
    navigator, found = make_navigator(name), []
    navigator.reset(Task(PERIOD, 0.5, np.zeros(3)), robot, np.random.default_rng(0))
    goal = Goal(np.array((10.0, 0.0, 0.0)), 0.25, math.inf)
    for k in range(40):
        t = k * PERIOD
        theta, omega = 0.8 * math.sin(RATE * t), 0.8 * RATE * math.cos(RATE * t)
        pose = np.array((pivot * (1.0 - math.cos(theta)), -pivot * math.sin(theta), theta))
        at = AT + t * WALKS
        seen = obstacles(at, WALKS, 0.3, error=0.02, velocity_error=0.3)
        navigator.step(Observation(t, pose, np.array((0.0, omega)), np.array((0.0, 0.0, theta)), goal, obstacles=seen))
        found.append(navigator.diagnostics().circles["forecast"][0, :2])
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hp-st", "mppi-forecast"])
def test_who_walks_evenly_is_expected_to_go_on_evenly(name: str) -> None:
    about_itself, about_another = foreseen(name, 0.0), foreseen(name, 0.2)
    assert about_another == pytest.approx(about_itself, abs=1e-6)
    assert about_itself[:, 1].min() > AT[1] + 0.1
