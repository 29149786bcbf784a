"""Bases that move to their sides or steer like a car, against a second reading in plain Python at 1 ms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import SILENT, Pilot, body, make_robot, make_scenario, run

from clearway.contract import Command
from clearway.geometry.frames import relative
from clearway.geometry.shapes import FloatArray, rectangle
from clearway.indicators.clipping import clipped
from clearway.robots import DriveLimits, Robot, possible
from clearway.trials import Outcome, Trial
from clearway.trials.trial_tables import from_tables, to_tables

FAR = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 3.0}]
MECANUM = [
    {"x": x, "y": y, "slip": math.copysign(math.pi / 4, x * y), "speed": 1.0}
    for x in (0.25, -0.25) for y in (0.2, -0.2)
]  # fmt: skip
OMNI: dict[str, Any] = {
    "kind": "omnidirectional", "v_max": 1.0, "v_min": -1.0, "acceleration": 1.0, "deceleration": 2.0, "v_y_max": 0.8,
    "lateral_acceleration": 0.8, "lateral_deceleration": 1.6, "omega_max": 2.0, "angular_acceleration": 3.0,
    "angular_deceleration": 3.0,
}  # fmt: skip
CAR: dict[str, Any] = {
    "kind": "ackermann", "v_max": 1.5, "v_min": -1.0, "acceleration": 1.0, "deceleration": 2.0, "wheelbase": 0.65,
    "steering_max": 0.5, "steering_rate": 0.8,
}  # fmt: skip

commands = st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-4.0, 4.0), st.floats(-3.0, 3.0)), min_size=1, max_size=6)


def robot_with(drive: dict[str, Any], **changes: Any) -> Robot:
    return make_robot(drive=drive, **changes)


def driven(robot: Robot, plan: list[tuple[float, float, float]], **changes: Any) -> Trial:
    """Each command of `plan` for half a second, the last one to the end."""
    told = [Command(v, omega, v_y=v_y) for v, omega, v_y in plan]
    scenario = make_scenario(**({"legs": FAR, "speed": 9.0} | changes))
    return run(Pilot(lambda s: told[min(int(s.t / 0.5 + 1e-6), len(told) - 1)]), scenario=scenario, robot=robot)


def towards(now: float, goal: float, up: float, down: float, h: float) -> float:
    """One small step of a velocity: to change its sign it comes to zero first."""
    if now * goal < 0.0:
        goal = 0.0
    rate = up if abs(goal) > abs(now) else down
    return min(now + rate * h, goal) if goal > now else max(now - rate * h, goal)


def plainly(
    drive: dict[str, Any], plan: list[tuple[float, float, float]], duration: float, lag: float = 0.0
) -> FloatArray:
    """(3,) where a base without wheel limits ends, by Euler's midpoint at 1 ms; it follows its limits with that `lag`, in s."""
    h, x, y, theta, v, w, u, front = 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    now = np.zeros(3)  # its velocities, where it lags
    share = 1.0 if lag == 0.0 else h / lag
    for k in range(round(duration / h)):
        tv, tw, tu = plan[min(k // 500, len(plan) - 1)]
        before = now
        tv = min(max(tv, drive["v_min"]), drive["v_max"])
        v = towards(v, tv, drive["acceleration"], drive["deceleration"], h)
        if drive.get("kind") == "ackermann":
            most, goal = drive["steering_max"], front
            if tv != 0.0:
                goal = min(max(math.atan(drive["wheelbase"] * tw / tv), -most), most)
            elif tw != 0.0:
                goal = math.copysign(most, tw)
            front = min(max(goal, front - drive["steering_rate"] * h), front + drive["steering_rate"] * h)
            along = before[0] + share * (v - before[0])
            now = np.array((along, along * math.tan(front) / drive["wheelbase"], 0.0))
        else:
            tw = min(max(tw, -drive["omega_max"]), drive["omega_max"])
            w = towards(w, tw, drive["angular_acceleration"], drive["angular_deceleration"], h)
            if drive.get("kind") == "omnidirectional":
                tu = min(max(tu, -drive["v_y_max"]), drive["v_y_max"])
                u = towards(u, tu, drive["lateral_acceleration"], drive["lateral_deceleration"], h)
            now = before + share * (np.array((v, w, u)) - before)
        vm, wm, um = 0.5 * (before + now)
        middle = theta + 0.5 * wm * h
        x += h * (vm * math.cos(middle) - um * math.sin(middle))
        y += h * (vm * math.sin(middle) + um * math.cos(middle))
        theta += wm * h
    return np.array([x, y, theta])


@settings(max_examples=25, deadline=None)
@given(plan=commands, drive=st.sampled_from([OMNI, CAR]))
def test_the_plant_is_a_second_readings(plan: list[tuple[float, float, float]], drive: dict[str, Any]) -> None:
    trial = driven(robot_with(drive), plan)
    told = [(v, w, u) if drive is OMNI else (v, w, 0.0) for v, w, u in plan]
    expected = plainly(drive, told, 3.0)
    assert trial.t[-1] == pytest.approx(3.0)
    assert trial.pose[-1, :2] == pytest.approx(expected[:2], abs=0.02)
    assert math.remainder(trial.pose[-1, 2] - expected[2], 2 * math.pi) == pytest.approx(0.0, abs=0.02)


@settings(max_examples=25, deadline=None)
@given(plan=commands)
def test_a_car_never_turns_more_narrowly_than_it_can(plan: list[tuple[float, float, float]]) -> None:
    trial = driven(robot_with(CAR), plan)
    assert trial.velocity is not None
    assert trial.velocity.shape[1] == 2
    v, omega = trial.velocity.T
    sharpest = math.tan(0.5) / 0.65
    assert (np.abs(omega) <= np.abs(v) * sharpest + 1e-12).all()
    turned = np.abs(np.diff(np.unwrap(trial.pose[:, 2])))
    moved = np.hypot(*np.diff(trial.pose[:, :2], axis=0).T)
    assert (turned <= sharpest * moved / np.sinc(turned / 2 / math.pi) * (1 + 1e-9) + 0.011).all()  # a way back too
    if all(v == 0.0 for v, _, _ in plan):
        assert (trial.pose == trial.pose[0]).all()


def test_a_car_does_not_turn_on_the_spot_and_that_is_counted() -> None:
    trial = driven(robot_with(CAR), [(0.0, 1.0, 0.0)])
    assert (trial.pose == trial.pose[0]).all()
    assert clipped(trial) == len(trial.t)
    assert clipped(driven(robot_with(CAR), [(1.0, 0.5, 0.0)])) == 0


@settings(max_examples=25, deadline=None)
@given(plan=commands)
def test_no_wheel_is_faster_than_it_can_be(plan: list[tuple[float, float, float]]) -> None:
    """Of a mecanum wheel at (x, y) the rim moves at v - y omega -+ (v_y + x omega)."""
    trial = driven(robot_with(OMNI | {"wheels": MECANUM}), plan)
    assert trial.velocity is not None
    v, omega, v_y = trial.velocity.T
    for wheel in MECANUM:
        side = math.copysign(1.0, wheel["x"] * wheel["y"])
        rim = v - wheel["y"] * omega - side * (v_y + wheel["x"] * omega)
        assert (np.abs(rim) <= 1.0 + 1e-9).all()


def test_it_goes_where_its_velocity_points() -> None:
    """(0.6, 0.8) m/s in its own frame while it turns at 1 rad/s, without bounds on its accelerations: a circle of 1 m."""
    inf = dict.fromkeys([k for k in OMNI if "celeration" in k], math.inf)
    trial = driven(robot_with(OMNI | inf), [(0.6, 1.0, 0.8)])
    t, start = trial.t, math.atan2(0.8, 0.6)
    circle = np.column_stack([np.sin(t + start) - math.sin(start), math.cos(start) - np.cos(t + start)])
    assert trial.pose[:, :2] == pytest.approx(circle, abs=1e-9)
    assert trial.command is not None
    assert trial.command[0].tolist() == [0.6, 1.0, 0.8]
    assert clipped(trial) == 0


def test_the_set_speed_holds_in_every_direction() -> None:
    trial = driven(robot_with(OMNI), [(0.8, 0.0, 0.8)], speed=0.5)
    assert trial.velocity is not None
    v, _, v_y = trial.velocity.T
    assert np.hypot(v, v_y).max() == pytest.approx(0.5)
    assert v[-1] == pytest.approx(v_y[-1])
    assert clipped(trial) == len(trial.t)


def test_sideways_into_a_wall() -> None:
    """0.8 m/s^2 from rest: 0.25 m are passed after 0.79 s; the wall is thin, and beside it."""
    wall = body(rectangle(4.0, 0.001), 0.0, 0.5005)
    trial = run(Pilot(lambda _: Command(0.0, 0.0, v_y=9.0)), [wall], make_scenario(speed=2.0), robot_with(OMNI))
    assert trial.outcome is Outcome.COLLISION
    assert trial.pose[-1, 1] == pytest.approx(0.25, abs=3e-5)
    assert trial.t[-1] == pytest.approx(math.sqrt(0.5 / 0.8), abs=1e-3)
    assert "robot at 0.632 m/s" in trial.events[-1].detail


def test_a_differential_base_has_no_sides() -> None:
    trial = run(Pilot(lambda _: Command(0.5, 0.0, v_y=0.5)), scenario=make_scenario(legs=FAR))
    assert trial.velocity is not None
    assert trial.velocity.shape[1] == 2
    assert (trial.pose[:, 1] == 0.0).all()


def test_odometry_drifts_sideways_as_it_does_forwards() -> None:
    """Over many seeds the dead-reckoned end is off across and along by the drift of the way, 0.02 m per sqrt(m)."""
    errors = SILENT | {"translation_per_metre": 0.02}
    away = []
    for seed in range(60):
        seen: list[FloatArray] = []
        pilot = Pilot(lambda s, seen=seen: (seen.append(s.odom_pose), Command(0.0, 0.0, v_y=0.8))[1])
        trial = run(pilot, scenario=make_scenario(legs=FAR, seed=seed), robot=robot_with(OMNI, odometry=errors))
        away.append(seen[-1] - trial.pose[len(seen) - 1])
    spread = np.std(away, axis=0)
    assert spread[1] == pytest.approx(0.02 * math.sqrt(2.0), rel=0.3)
    assert spread[0] == pytest.approx(0.0, abs=1e-12)


@given(
    v=st.floats(-3, 3), omega=st.floats(-3, 3), v_y=st.floats(-3, 3),
    drive=st.sampled_from([OMNI, OMNI | {"wheels": MECANUM, "speed_max": 0.9}, CAR]),
)  # fmt: skip
def test_what_is_possible_is_left_alone_and_not_counted(
    v: float, omega: float, v_y: float, drive: dict[str, Any]
) -> None:
    from clearway.indicators.clipping import _beyond

    limits = robot_with(drive).limits(1.2)
    kept = possible(limits, v, omega, v_y)
    assert possible(limits, *kept) == pytest.approx(kept, abs=1e-12)
    assert not _beyond(limits, np.array([kept]))[0]
    changed = max(abs(a - b) for a, b in zip(kept, (v, omega, v_y), strict=True))
    if changed > 1e-6:
        assert _beyond(limits, np.array([[v, omega, v_y]]))[0]
    elif changed == 0.0:
        assert not _beyond(limits, np.array([[v, omega, v_y]]))[0]


def test_bases_know_their_kind() -> None:
    assert robot_with(OMNI).limits().kind == "omnidirectional"
    car = robot_with(CAR).limits(0.5)
    assert isinstance(car, DriveLimits)
    assert car.kind == "ackermann"
    assert car.omega_max == pytest.approx(0.5 * math.tan(0.5) / 0.65)


def test_what_an_omnidirectional_base_is_told_late_is_what_was() -> None:
    """On a circle of 1 m, 35 ms late: between the ends of the plant's steps, on the arc that it drove."""
    inf = dict.fromkeys([k for k in OMNI if "celeration" in k], math.inf)
    seen: list[tuple[float, FloatArray, FloatArray]] = []
    pilot = Pilot(lambda s: (seen.append((s.t, s.truth, s.odom_velocity)), Command(0.6, 1.0, v_y=0.8))[1])
    robot = robot_with(OMNI | inf, latency={"sensing": 0.035})
    run(pilot, scenario=make_scenario(legs=FAR, speed=9.0), robot=robot)
    start = math.atan2(0.8, 0.6)
    for t, truth, velocity in seen[2:]:
        assert truth[:2] == pytest.approx([math.sin(t + start) - 0.8, 0.6 - math.cos(t + start)], abs=1e-9)
        assert velocity == pytest.approx([0.6, 1.0, 0.8])


def test_a_trial_of_an_omnidirectional_base_survives_its_store() -> None:
    trial = driven(robot_with(OMNI | {"wheels": MECANUM}), [(0.5, 0.3, -0.4), (0.0, 0.0, 0.5)])
    again = from_tables(to_tables(0, trial))
    assert again.attempt.limits == trial.attempt.limits
    assert trial.velocity is not None
    assert trial.command is not None
    assert again.velocity is not None
    assert again.command is not None
    assert np.array_equal(again.velocity, trial.velocity)
    assert np.array_equal(again.command, trial.command)


@pytest.mark.parametrize("pivot", [-0.23, 0.3])
def test_a_car_s_odometry_knows_where_its_rear_axle_is(pivot: float) -> None:
    """Whatever base_link is the middle of: dead reckoning without errors is the true motion, told late as well."""
    for latency in ({}, {"latency": {"sensing": 0.13}}):
        pilot = Pilot(lambda _: Command(0.8, 0.6))
        robot = robot_with(CAR | {"pivot": pivot}, odometry=SILENT, **latency)
        run(pilot, scenario=make_scenario(legs=FAR, speed=9.0), robot=robot)
        start = pilot.seen[0].truth
        assert abs(pilot.seen[-1].truth[2] - start[2]) > 0.5
        for sensing in pilot.seen:
            assert sensing.odom_pose == pytest.approx(relative(start, sensing.truth), abs=1e-9)
            assert robot.drive.base_link(sensing.odom_pose) == pytest.approx(sensing.odom_pose)
