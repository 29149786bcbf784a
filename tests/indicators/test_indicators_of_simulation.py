"""The world's verdict and the indicators agree: a trial that ended in contact has no distance left."""

from __future__ import annotations

import math

import pytest

from clearway.contract import Command, Decision
from clearway.indicators import score_row
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection, load_suite
from clearway.world import simulate


class StraightOn:
    """Drives ahead along the leg, turns where it is to turn, sees nothing."""

    def reset(self, task, robot, rng):
        self.speed = task.speed_limit

    def decide(self, sensing):
        x, y, yaw = sensing.truth
        goal = sensing.goal.pose
        turn = math.remainder(goal[2] - yaw, 2 * math.pi)
        ahead = (goal[0] - x) * math.cos(goal[2]) + (goal[1] - y) * math.sin(goal[2])
        if sensing.goal.leg == 1:
            return Decision(Command(0.0, max(-0.5, min(0.5, 2 * turn)), arrived=abs(turn) < 0.01), sensing.truth)
        done = ahead < 0.05
        v = 0.0 if done else min(self.speed, ahead)
        return Decision(Command(v, turn, arrived=done and abs(sensing.odom_velocity[0]) < 0.02), sensing.truth)


@pytest.mark.parametrize("robot", ["tiago", "hosbot"])
@pytest.mark.parametrize("batch", ["NO", "SO", "MO"])
def test_contact_and_distance_agree(batch, robot):
    machine = load_robot(robot)
    suite = load_suite("hospital")
    everything = suite.build(machine, Selection(batches=(batch,), speeds=(0.6,), repetitions=1), 1)
    for scenario in everything[:: max(1, len(everything) // 4)]:
        trial = simulate(scenario, machine, StraightOn(), navigator="straight", localisation="truth", map=None)
        row = score_row(trial)
        if row["failure"] == "collision":
            assert row["MDO"] == 0.0
            assert row["success"] is False
        elif batch == "NO":
            assert row["MDO"] is None
            assert row["CT"] == pytest.approx(2 * (5 - 0.05) / 0.6, abs=8.0)
            assert 9.6 < row["PL"] < 10.2
            parts = ("T_acceleration", "T_cruise", "T_approach", "T_rotation")
            assert sum(row[p] for p in parts) == pytest.approx(row["CT"], abs=1e-9)
        else:
            assert row["MDO"] > 0.0


def test_who_is_there_at_once_took_no_time():
    """The start lies within the goal's tolerance, or the navigator says so: nothing is divided by the time that it took."""

    class There(StraightOn):
        def decide(self, sensing):
            return Decision(Command(0.0, 0.0, arrived=True), sensing.truth)

    scenario = load_suite("sar-case1").build(load_robot("rescue"), Selection(repetitions=1), 1)[0]
    declared = scenario.legs[0].model_copy(update={"arrival": "declared"})
    scenario = scenario.model_copy(update={"legs": (declared,)})
    trial = simulate(scenario, load_robot("rescue"), There(), navigator="there", localisation="truth", map=None)
    assert (trial.outcome, trial.t.tolist(), trial.spans[0].end) == ("reached", [0.0], 0.0)
    row = score_row(trial)
    assert row["TCS"] is None
    assert "the legs took no time" in row["not_computable"]
    assert row["CT"] == 0.0
    assert not row["success"]
