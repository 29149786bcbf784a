"""Legs found in simulated trials, against the world's own account of when each goal was given and called reached."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.contract import Command, Decision
from clearway.recordings.lab.legs import find_legs
from clearway.recordings.motion.motion import Motion, Quality
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection, load_suite
from clearway.trials import Outcome, Trial
from clearway.world import simulate


class StraightOn:
    """Drives ahead along the leg, turns where it is to turn, thinks for two periods, and stands before it says so."""

    def reset(self, task, robot, rng):
        self.speed, self.leg, self.waited = task.speed_limit, -1, 0

    def decide(self, sensing):
        x, y, yaw = sensing.truth
        goal = sensing.goal
        if goal.leg != self.leg:
            self.leg, self.waited = goal.leg, 0
        self.waited += 1
        turn = math.remainder(goal.pose[2] - yaw, math.tau)
        ahead = (goal.pose[0] - x) * math.cos(goal.pose[2]) + (goal.pose[1] - y) * math.sin(goal.pose[2])
        v = 0.0 if goal.leg == 1 or ahead < 0.03 else min(self.speed, ahead)
        w = max(-0.5, min(0.5, 2 * turn)) if abs(turn) > 0.02 else 0.0
        if self.waited <= 2:
            v = w = 0.0
        standing = abs(sensing.odom_velocity[0]) < 1e-3 and abs(sensing.odom_velocity[1]) < 1e-3
        done = self.waited > 2 and v == 0.0 and w == 0.0 and standing
        return Decision(Command(v, w, arrived=done), sensing.truth)


def simulated(robot: str, batch: str, which: int) -> Trial:
    machine = load_robot(robot)
    every = load_suite("hospital").build(machine, Selection(batches=(batch,), speeds=(0.6,), repetitions=1), 1)
    return simulate(every[which], machine, StraightOn(), navigator="straight on", localisation="truth", map=None)


def captured(trial: Trial, lead: float = 3.0, tail: float = 4.0) -> Motion:
    """The trial as a capture has it that runs before and after: the robot stands."""
    before, after = (np.arange(1, round(s / 0.1) + 1) * 0.1 for s in (lead, tail))
    t = np.concatenate([-before[::-1], trial.t, trial.t[-1] + after])
    pose = np.pad(trial.pose, ((len(before), len(after)), (0, 0)), mode="edge")
    pose[:, 2] = np.unwrap(pose[:, 2])
    assert trial.velocity is not None
    return Motion(t, pose, np.pad(trial.velocity, ((len(before), len(after)), (0, 0))), None, Quality(10.0, 1.0))


@pytest.mark.parametrize("robot", ["tiago", "hosbot"])
def test_a_leg_lacks_the_thinking_before_it_and_the_word_after_it(robot: str) -> None:
    trial = simulated(robot, "NO", 0)
    assert trial.outcome == Outcome.REACHED
    found = find_legs(captured(trial), trial.attempt.legs)
    assert [f.reached for f in found] == [True] * 3
    for f, span in zip(found, trial.spans, strict=True):
        # two periods of thinking, and one until it hears of a goal that follows another
        assert f.start - span.start == pytest.approx(0.3 if f.leg else 0.2, abs=0.02)
        assert -0.2 <= f.end - span.end <= 0.1  # it stands before it says so


def test_a_collision_is_no_arrival() -> None:
    trial = simulated("tiago", "SO", 0)
    assert trial.outcome == Outcome.COLLISION
    (found,) = find_legs(captured(trial), trial.attempt.legs)
    assert not found.reached
    assert "never came to rest at the goal" in found.why
