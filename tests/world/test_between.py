"""How near they came, against a plain reckoning at every millisecond from where the plant had the robot at each of its steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from worlds import Pilot

from clearway.contract import Command, Sensing
from clearway.geometry.shapes import Circle
from clearway.indicators import score_row
from clearway.robots import load_robot
from clearway.scenarios.scenario import OscillationSpec
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.trials import Trial
from clearway.world import simulate
from clearway.world.world import World

DENSE = 1e-3  # s


class Path:
    """Listens to the plant: where its steps ended, and when."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.t, self.pose = list[float](), list[np.ndarray]()
        drive = World.drive

        def spy(world: World, t: float) -> Any:
            driven, touched = drive(world, t)
            way, period = world.ride.setting.way, world.ride.setting.vehicle.period
            n = len(way) - 1
            for i in range(n + 1):
                at = min(i * period / n, driven)
                self.t.append(t + at)
                self.pose.append(way[i, :3].copy())
                if at < i * period / n:
                    break
            return driven, touched

        monkeypatch.setattr(World, "drive", spy)


def swung(spec: OscillationSpec, t: np.ndarray) -> np.ndarray:
    """(n, 2) the harmonic motion in closed form."""
    w = np.sqrt(spec.stiffness)
    off = np.subtract(spec.start, spec.attraction)
    phase = np.outer(t, w)
    return np.array(spec.attraction) + off * np.cos(phase) + np.array(spec.velocity) / w * np.sin(phase)


def dense(path: Path, trial: Trial, scenario: Any) -> tuple[float, float, float]:
    """Least distance of edges and of centres that counts, m, and what either may be off for looking each millisecond only."""
    t, pose = np.array(path.t), np.array(path.pose)
    times = np.unique(np.concatenate([np.arange(t[0], t[-1], DENSE), t]))
    x, y = (np.interp(times, t, pose[:, k]) for k in range(2))
    edges, centres, fastest = math.inf, math.inf, 0.0
    robot = trial.attempt.footprint
    assert isinstance(robot, Circle)
    for obstacle in scenario.obstacles:
        standing = obstacle.pose is not None
        at = np.array([obstacle.pose[:2]]) if standing else swung(obstacle.oscillation, times)
        d = np.hypot(at[:, 0] - x, at[:, 1] - y)
        fastest = max(fastest, float(np.abs(np.diff(d)).max()))
        centres = min(centres, float(d.min()))
        edges = min(edges, float(d.min()) - robot.radius - obstacle.shape.radius)
    return max(edges, 0.0), centres, fastest / 2


def to_the_goal(sensing: Sensing) -> Command:
    """Turns to the goal while it drives, blind to what moves, with a command that changes each period."""
    x, y, theta = sensing.truth
    goal = sensing.goal.pose
    error = math.remainder(math.atan2(goal[1] - y, goal[0] - x) - theta, math.tau)
    return Command(1.0 + 0.3 * math.sin(7 * sensing.t), 3.0 * error + math.sin(5 * sensing.t))


@pytest.mark.parametrize("robot", ["rescue", "rescue:unlimited"])
@pytest.mark.parametrize("suite", ["sar-case1", "sar-case2"])
def test_the_least_distances_are_those_of_a_dense_reckoning(
    suite: str, robot: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = load_robot(robot)
    contacts = passed = 0
    for full in load_suite(suite).build(machine, Selection(), 0):
        scenario = full.model_copy(update={"obstacles": full.obstacles[::3]})  # so that some are passed
        with monkeypatch.context() as patch:
            path = Path(patch)
            trial = simulate(
                scenario,
                machine,
                Pilot(to_the_goal),
                navigator="blind",
                localisation="truth",
                map=None,
                raise_errors=True,
            )
        row = score_row(trial)
        edges, centres, off = dense(path, trial, scenario)
        if row["failure"] == "collision":
            contacts += 1
            assert row["MDO"] == 0.0
            assert edges <= off + 1e-4
        elif row["MDO"] is not None:
            passed += 1
            assert row["MDO"] == pytest.approx(edges, abs=1e-3)
            assert row["MDO_centre"] == pytest.approx(centres, abs=1e-3)
    assert contacts
    assert passed
