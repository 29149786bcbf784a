"""What the robot itself shows to be untrue: no false alarm while the assumptions hold, all excesses once they don't."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.contract import Command, Decision, Sensing, Task
from clearway.geometry.motion import arc
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.ahead import Ahead
from clearway.navigators.hp_st.guarantee.assumption_monitor import AssumptionMonitor
from clearway.navigators.hp_st.guarantee.tube import drive
from clearway.robots import DriveLimits, LatencySpec, Odometry, Robot, load_robot
from clearway.scenarios.scenario import Scenario
from clearway.world import simulate_in
from clearway.world.tracks import stack

SHOVED = np.array([0.01, 0.01, 0.0, 0.0, 0.0])
INSTANT = DriveLimits(-1.0, 1.0, math.inf, math.inf, 1.5, math.inf, math.inf)
EXACT = Odometry(translation_per_metre=0.0, rotation_per_metre=0.0, rotation_per_radian=0.0)
ROBOTS = {
    "rescue": SHOVED,
    "rescue:unlimited": SHOVED,
    "tiago": SHOVED,
    "hosbot": np.array([0.004, 0.01, 0.05, 0.08, 0.0]),
}


class Wanderer:
    """A pilot that drives at random and watches."""

    def __init__(self, assumed: FloatArray, robot: Robot, seed: int) -> None:
        self.limits, self.robot, self.assumed, self.velocity = robot.limits(), robot, assumed, np.zeros(2)
        self.rng, self.texts, self.count = np.random.default_rng(seed), list[str](), 0

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.ahead = Ahead(task.latency, self.limits)
        self.watch = AssumptionMonitor(self.limits, robot.period, self.assumed, np.zeros(3), robot.odometry, self.ahead)

    def decide(self, sensing: Sensing) -> Decision:
        texts = self.watch.seen(sensing.t, sensing.truth, sensing.odom_velocity)
        if self.count % 4 == 0:
            self.wish = self.rng.uniform(-1, 1, 2) * (1.5, 2.0) * (self.rng.random() > 0.3)
        self.count += 1
        self.watch.told(sensing.t, sensing.truth, *self.wish)
        self.ahead.decided(sensing.t, self.velocity, *self.wish)
        now = np.concatenate((sensing.truth, self.velocity))
        self.velocity = drive(now, self.wish[None], self.limits, self.robot.period).velocities[1]
        self.texts += texts
        return Decision(Command(*self.wish, violated=texts), sensing.truth)


def wander(name: str, factor: float, seed: int, **latency: float) -> list[str]:
    """What a AssumptionMonitor says of 30 s in the real plant, disturbed `factor` times as strongly as it assumes."""
    robot, assumed = load_robot(name), ROBOTS[name]
    if latency:
        robot = robot.model_copy(update={"latency": LatencySpec(**latency)})
    keys = ("position", "heading", "velocity", "turn")
    disturbance: dict[str, Any] = dict(zip(keys, (factor * assumed[:4]).tolist(), strict=True)) | {"at_rest": False}
    scenario = Scenario.model_validate(
        {
            "name": "test", "floor_plan": "nowhere", "start": (0.0, 0.0, 0.0), "speed": 99.0, "seed": seed,
            "legs": [{"name": "forth", "goal": (999.0, 0.0, 0.0), "time_limit": 30.0}],
            "placement_xy": 0.0, "placement_yaw": 0.0, "disturbance": disturbance,
        }
    )  # fmt: skip
    pilot = Wanderer(assumed, robot, seed)
    simulate_in([], stack([[]]), scenario, robot, pilot, navigator="test", localisation="truth")
    assert pilot.count > 150
    return pilot.texts


@pytest.mark.parametrize("name", ROBOTS)
def test_nothing_is_said_while_the_assumptions_hold(name: str) -> None:
    assert [wander(name, 1.0, seed) for seed in range(3)] == [[], [], []]


@pytest.mark.parametrize("name", ["rescue", "tiago", "hosbot"])
@pytest.mark.parametrize("latency", [{"sensing": 0.1}, {"command": 0.13}, {"sensing": 0.237, "command": 0.05}])
def test_nor_is_anything_said_of_one_that_senses_and_acts_late(name: str, latency: dict[str, float]) -> None:
    assert [wander(name, 1.0, seed, **latency) for seed in range(2)] == [[], []]


def test_twice_the_disturbance_is_said_of_a_late_one_too() -> None:
    assert len(wander("rescue", 2.0, 5, sensing=0.1, command=0.05)) > 20


def test_twice_the_disturbance_is_said() -> None:
    texts = wander("rescue:unlimited", 2.0, 5)
    # uniform in a disc of twice the radius: 3 of 4 displacements are too large, 1 of 2 turns; it stands for a while
    assert 60 < sum("ended" in text for text in texts) < 200
    assert 40 < sum("turned" in text for text in texts) < 140
    assert all(
        re.fullmatch(r"disturbance: (ended 0\.0[12]\d\d m|turned 0\.0[12]\d\d rad) .* at most 0\.0100", t)
        for t in texts
    )
    assert wander("hosbot", 3.0, 5)


@settings(max_examples=200, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-1, 1), st.floats(-1.5, 1.5), st.floats(0, 1), st.floats(0, 6.3), st.floats(-1, 1)),
        max_size=6,
    ),
    st.floats(-9, 9),
)
def test_the_bound_itself_is_allowed(periods: list[tuple[float, ...]], theta: float) -> None:
    watch, pose, t = AssumptionMonitor(INSTANT, 0.15, SHOVED, np.zeros(3), EXACT), np.array([1.0, 2.0, theta]), 0.0
    moved = False
    for v, omega, share, angle, twist in periods:
        watch.told(t, pose, v, omega)
        velocity = np.array([v, omega])
        pushed = 0.01 * share * (moved or v != 0.0 or omega != 0.0)
        moved = v != 0.0 or omega != 0.0
        x, y, theta = arc(*pose, v, omega, 0.15)
        pose = np.array(
            [x + pushed * math.cos(angle), y + pushed * math.sin(angle), theta + math.copysign(pushed, twist)]
        )
        t += 0.15
        assert watch.seen(t, pose, velocity) == ()


def told(v: float = 0.5, odometry: Odometry = EXACT) -> AssumptionMonitor:
    watch = AssumptionMonitor(INSTANT, 0.15, SHOVED, np.zeros(3), odometry)
    watch.told(1.0, np.zeros(3), v, 0.0)
    return watch


DRIVEN = np.array([0.5, 0.0])


def test_the_words() -> None:
    assert told().seen(1.15, np.array([0.075, 0.023, 0.0]), DRIVEN) == (
        "disturbance: ended 0.0230 m from where it was commanded, assumed at most 0.0100",
    )
    assert told().seen(1.15, np.array([0.075, 0.0, -0.02]), DRIVEN) == (
        "disturbance: turned 0.0200 rad off its command, assumed at most 0.0100",
    )
    assert told().seen(1.3, np.array([0.15, 0.0, 0.0]), DRIVEN) == (
        "period: 0.3 s since the last command, assumed 0.15 s",
    )
    assert told().seen(1.15, np.array([0.075, 0.0, 0.0]), np.array([0.5, -0.1])) == (
        "command: omega is -0.1000 rad/s, should be 0.0000 within 0.0000",
    )
    assert len(told().seen(1.15, np.array([math.nan, 0.0, math.nan]), np.full(2, math.nan))) == 4


def test_a_measured_velocity_may_err_as_its_odometry_does() -> None:
    noisy, there = (
        Odometry(translation_per_metre=0.01, rotation_per_metre=0.0, rotation_per_radian=0.0, scale=0.01),
        [0.075, 0.0, 0.0],
    )
    sigma = math.hypot(0.01 * 0.5, 0.01 * math.sqrt(0.5 / 0.15))
    for off, said in ((4.99, 0), (-4.99, 0), (5.01, 1), (-5.01, 1)):
        assert len(told(odometry=noisy).seen(1.15, np.array(there), np.array([0.5 + off * sigma, 0.0]))) == said
    assert told(odometry=noisy).seen(1.15, np.array(there), np.array([5.0, 3.0])) == (
        f"command: v is 5.0000 m/s, should be 0.5000 within {5.0 * sigma:.4f}",
        "command: omega is 3.0000 rad/s, should be 0.0000 within 0.0000",
    )


def test_a_robot_at_rest_that_is_pushed_although_nothing_should_push_it() -> None:
    watch = AssumptionMonitor(INSTANT, 0.15, SHOVED, np.zeros(3), EXACT)
    watch.told(0.0, np.zeros(3), 0.0, 0.0)
    assert watch.seen(0.15, np.array([0.004, 0.0, 0.0]), np.zeros(2)) == (
        "disturbance: ended 0.0040 m from where it was commanded, assumed at most 0.0000",
    )
    allowed = AssumptionMonitor(INSTANT, 0.15, np.array([0.01, 0.01, 0.0, 0.0, 1.0]), np.zeros(3), EXACT)
    allowed.told(0.0, np.zeros(3), 0.0, 0.0)
    assert allowed.seen(0.15, np.array([0.004, 0.0, 0.0]), np.zeros(2)) == ()


def test_nothing_is_said_before_anything_was_told_and_everything_once() -> None:
    watch = told()
    far = np.array([9.0, 9.0, 0.0])
    assert AssumptionMonitor(INSTANT, 0.15, SHOVED, np.zeros(3), EXACT).seen(0.0, far, np.zeros(2)) == ()
    assert watch.seen(1.15, far, np.zeros(2))
    assert watch.seen(1.30, far, np.zeros(2)) == ()
