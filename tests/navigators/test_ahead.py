"""Where a robot will be when what it decides takes effect, against where it then is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.contract import Command, Decision, Latency, Sensing, Task
from clearway.forecasts.forecast import Forecast, later
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.ahead import Ahead, blurred
from clearway.robots import LatencySpec, Robot, load_robot
from clearway.scenarios.scenario import Scenario
from clearway.trials import Trial
from clearway.world import simulate_in
from clearway.world.tracks import stack


class Dreamer:
    """Drives at random and notes where it takes itself to be when its command is followed."""

    def __init__(self, robot: Robot, seed: int) -> None:
        self.limits, self.period, self.rng = robot.limits(1.0), robot.period, np.random.default_rng(seed)
        self.dreamt: list[FloatArray] = []

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        self.ahead, self.velocity = Ahead(task.latency, self.limits), np.zeros(2)

    def decide(self, sensing: Sensing) -> Decision:
        t, pose = sensing.t, sensing.truth
        self.dreamt.append(self.ahead.pose(t, pose, sensing.odom_velocity).copy())
        if len(self.dreamt) % 3 == 1:
            self.wish = self.rng.uniform(-1.0, 1.0, 2) * (1.0, 1.5)
        self.ahead.decided(t, self.velocity, *self.wish)
        followed = t + self.ahead.time
        if self.ahead.time > 0.0:
            self.velocity = self.ahead.way(pose, followed, followed + self.period).velocity
        return Decision(Command(*self.wish), pose)


def drive(
    robot: Robot, seed: int, disturbance: dict[str, Any] | None = None, **latency: float
) -> tuple[Trial, FloatArray]:
    robot = robot.model_copy(update={"latency": LatencySpec(**latency)})
    scenario = Scenario.model_validate(
        {
            "name": "test", "floor_plan": "nowhere", "start": (0.0, 0.0, 0.5), "speed": 1.0, "seed": seed,
            "legs": [{"name": "forth", "goal": (999.0, 0.0, 0.0), "time_limit": 12.0}],
            "placement_xy": 0.0, "placement_yaw": 0.0, "disturbance": disturbance,
        }
    )  # fmt: skip
    pilot = Dreamer(robot, seed)
    trial = simulate_in([], stack([[]]), scenario, robot, pilot, navigator="test", localisation="truth")
    return trial, np.array(pilot.dreamt)


def off(trial: Trial, dreamt: FloatArray, later_by: int) -> FloatArray:
    """(n, 3) the true pose so many periods after each decision, less the one that was dreamt of."""
    difference = trial.pose[later_by:] - dreamt[: len(dreamt) - later_by]
    difference[:, 2] = np.remainder(difference[:, 2] + math.pi, math.tau) - math.pi
    return difference


@pytest.mark.parametrize("name", ["tiago", "hosbot", "rescue"])
@pytest.mark.parametrize(("sensing", "command"), [(0.07, 0), (0.0, 1), (0.138, 1), (0.3, 2)])
def test_it_is_where_it_expected_to_be(name: str, sensing: float, command: int) -> None:
    """The command takes effect at the end of a period, where there is a sample."""
    robot = load_robot(name)
    trial, dreamt = drive(robot, 1, sensing=sensing, command=command * robot.period)
    assert np.abs(off(trial, dreamt, command)).max() < 1e-4  # the plant's steps begin elsewhere in a ramp
    assert np.ptp(trial.pose[:, :2], axis=0).min() > 0.3


@settings(max_examples=20)
@given(
    lag=st.floats(0.05, 0.5),
    sensing=st.sampled_from((0.0, 0.13)),
    command=st.sampled_from((0.0, 0.1)),
    brake=st.floats(1.0, 9.0),
)
def test_motors_that_lag_end_where_it_expected(lag: float, sensing: float, command: float, brake: float) -> None:
    """Asked at any instant, of a robot that speeds up or brakes: where one without lag would come to rest from there, it does."""
    tiago = load_robot("tiago")
    drive = tiago.drive.model_copy(update={"lag": lag, "deceleration": brake})
    update = {"drive": drive, "latency": LatencySpec(sensing=sensing, command=command)}
    robot = tiago.model_copy(update=update | {"lidar": None})
    limits, rests = robot.limits(1.0), []

    class Braking:
        def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
            self.ahead, self.v = Ahead(task.latency, limits), np.zeros(2)

        def decide(self, sensing: Sensing) -> Decision:
            t, v = sensing.t, 0.9 if sensing.t < 0.95 else 0.0
            pose, velocity = self.ahead.state(t, sensing.truth, sensing.odom_velocity)
            if t > 0.95:
                rests.append(float(pose[0] + 0.5 * velocity[0] ** 2 / brake))
            self.ahead.decided(t, velocity, v, 0.0)
            return Decision(Command(v, 0.0), sensing.truth)

    scenario = Scenario.model_validate(
        {
            "name": "test", "floor_plan": "nowhere", "start": (0.0, 0.0, 0.0), "speed": 1.0, "seed": 3,
            "legs": [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 7.0}], "placement_xy": 0.0, "placement_yaw": 0.0,
            "ideal": ["odometry"],
        }
    )  # fmt: skip
    trial = simulate_in([], stack([[]]), scenario, robot, Braking(), navigator="test", localisation="truth")
    assert len(rests) > 40
    assert rests == pytest.approx([trial.pose[-1, 0]] * len(rests), abs=3e-3)


@settings(max_examples=20)
@given(seed=st.integers(0, 999), sensing=st.floats(0.0, 0.3), command=st.integers(0, 2), factor=st.floats(0.1, 3.0))
def test_what_pushes_it_puts_it_off_by_no_more_than_the_bound(
    seed: int, sensing: float, command: int, factor: float
) -> None:
    robot = load_robot("rescue")
    bounds = factor * np.array((0.01, 0.01, 0.02, 0.02))
    disturbance = dict(zip(("position", "heading", "velocity", "turn"), bounds.tolist(), strict=True))
    time = sensing + command * robot.period
    trial, dreamt = drive(robot, seed, disturbance, sensing=sensing, command=command * robot.period)
    most = blurred(np.zeros(3), np.array((*bounds, 1.0)), time, robot.period, 1.0)
    found = np.abs(off(trial, dreamt, command))
    assert (found <= most + 1e-4).all()
    if time > robot.period:
        assert (found.max(axis=0) > 0.1 * most).all()  # and the bound is not beyond all measure


def test_without_latency_nothing_is_rolled_on() -> None:
    ahead, pose = Ahead(Latency(), load_robot("tiago").limits()), np.array((1.0, 2.0, 3.0))
    ahead.decided(0.0, np.zeros(2), 1.0, 1.0)
    assert ahead.pose(0.1, pose, np.ones(2)) is pose
    start = np.array((0.1, 0.2, 0.3))
    assert blurred(start, np.ones(5), 0.0, 0.1, 1.0) is start


def swinging(step: float, count: int, amplitude: float, rate: float) -> Forecast:
    """A forecast that is just true of one that swings: its discs hold each place, on the edge of theirs."""
    t = step * np.arange(count + 1)
    true = np.stack((amplitude * np.cos(rate * t), amplitude * np.sin(rate * t)), axis=1)
    reach = 0.05 + 0.1 * t
    centre = true + np.stack((reach, np.zeros_like(reach)), axis=1)
    path = np.broadcast_to(true, (1, 2, count + 1, 2)).copy()
    return Forecast(
        step, np.zeros((0, 3)), path, np.full((1, 2, count + 1), 0.1), np.full((1, 2), 0.5), np.full(1, 0.3), centre[None],
        reach[None], np.full(1, amplitude * rate), np.zeros(1, np.int64), np.zeros(1),
    )  # fmt: skip


@given(time=st.floats(0.0, 1.0), amplitude=st.floats(0.1, 3.0), rate=st.floats(0.1, 4.0), bounded=st.booleans())
def test_a_forecast_from_later_on_holds_what_happens(time: float, amplitude: float, rate: float, bounded: bool) -> None:
    step, whole = 0.15, swinging(0.15, 20, amplitude, rate)
    found = later(whole, time, amplitude * rate * rate if bounded else math.inf)
    count = found.reach.shape[1]
    assert count >= 20 - math.ceil(time / step - 1e-9) + 1
    t = time + step * np.arange(count)
    true = np.stack((amplitude * np.cos(rate * t), amplitude * np.sin(rate * t)), axis=1)
    assert (np.hypot(*(found.centre[0] - true).T) <= found.reach[0] + 1e-9).all()
    assert np.hypot(*(found.path[0, 0] - true).T).max() <= amplitude * rate * rate * step * step / 8 + 1e-9
    assert found.centre.flags.c_contiguous
    assert found.path.flags.c_contiguous


def test_a_forecast_from_now_on_is_itself() -> None:
    whole = swinging(0.1, 5, 1.0, 1.0)
    assert later(whole, 0.0, 1.0) is whole
    assert np.array_equal(later(whole, 0.2, 1.0).centre, whole.centre[:, 2:])
