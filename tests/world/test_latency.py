"""What arrives late, and what is followed late."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from worlds import DRIVE, Pilot, body, constant, make_robot, make_scenario, moving_obstacle, run

from clearway.contract import Command, Decision, Latency, Sensing
from clearway.geometry.motion import arc
from clearway.geometry.shapes import Circle
from clearway.trials import Outcome, Trial
from clearway.world.latency import Delays, between

FAR = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 4.0}]
AT_ONCE = DRIVE | {"acceleration": math.inf, "deceleration": math.inf,
                   "angular_acceleration": math.inf, "angular_deceleration": math.inf}  # fmt: skip


def drive(
    pilot: Pilot, factor: float = 1.0, *, knots: Any = None, bodies: Any = (), seed: int = 5, **latency: float
) -> Trial:
    robot = make_robot(latency=latency, drive=AT_ONCE)
    return run(pilot, bodies, make_scenario(legs=FAR, speed=1.0, latency=factor, seed=seed), robot, knots)


def swerves(s: Sensing) -> Command:
    return Command(0.5 + 0.4 * math.sin(2.0 * s.t), math.cos(s.t))


@pytest.mark.parametrize("command", [0.0, 0.037, 0.1, 0.13, 0.25])
def test_a_command_is_followed_after_its_latency_to_the_microsecond(command: float) -> None:
    """A base without limits stands until then and drives 0.5 m/s from then on."""
    trial = drive(constant(0.5), command=command)
    assert trial.pose[:, 0] == pytest.approx(0.5 * np.maximum(trial.t - command, 0.0), abs=1e-9)


def test_a_change_within_a_period_takes_effect_at_its_instant() -> None:
    late = drive(Pilot(lambda s: Command(0.2 if s.t < 1.95 else 0.8, 0.0)), command=0.03)
    k = int(np.argmin(np.abs(late.t - 2.1)))
    assert late.pose[k, 0] == pytest.approx(0.2 * 2.0 + 0.8 * 0.07, abs=1e-9)
    assert late.velocity is not None
    assert late.velocity[k, 0] == pytest.approx(0.8)


@pytest.mark.parametrize("sensing", [0.0, 0.04, 0.1, 0.27])
def test_what_arrives_is_as_old_as_the_robot_says(sensing: float) -> None:
    """The stamp is that of what was sensed; the pose, the odometry and the scan are those of then."""
    pilot, wall = Pilot(lambda s: Command(0.5, 0.0)), body(Circle(1.0), 9.0, 0.0)
    trial = drive(pilot, sensing=sensing, bodies=[wall])
    for k, seen in enumerate(pilot.seen):
        then = max(0.1 * k - sensing, 0.0)
        assert seen.t == pytest.approx(0.1 * k - sensing, abs=1e-12)  # before 0 everything stood
        assert seen.truth[0] == pytest.approx(0.5 * then, abs=1e-9)
        assert seen.odom_pose[0] == pytest.approx(0.5 * then, abs=1e-9)
        assert seen.scan is not None
        assert seen.scan.ranges[45] == pytest.approx(8.0 - 0.5 * then, abs=1e-9)
    assert len(pilot.seen) == len(trial.t)


def test_who_moves_is_seen_where_it_was() -> None:
    """An obstacle comes at 1 m/s from 6 m away; a robot that stands sees it where it was a quarter of a second ago."""
    pilot = constant(0.0)
    knots = [np.array([[0.0, 6.0, 0.0, 0.0], [3.9, 2.1, 0.0, 0.0]])]
    drive(pilot, sensing=0.25, bodies=[moving_obstacle(Circle(0.5))], knots=knots)
    seen = [(s.t, float(s.scan.ranges[45])) for s in pilot.seen if s.scan is not None]
    assert [r for _, r in seen] == pytest.approx([5.5 - max(t, 0.0) for t, _ in seen], abs=1e-9)
    assert seen[20][0] == pytest.approx(1.75)


def test_a_new_leg_does_not_change_what_was_seen_before() -> None:
    """On the second leg the obstacle stands elsewhere; its picture arrives when that leg is as old as the latency."""
    legs = [{"name": n, "goal": (0.0, 0.0, 0.0), "xy_tolerance": 1.0, "time_limit": 2.0} for n in ("one", "two")]
    legs[1]["goal"] = (9.0, 0.0, 0.0)
    run_ = [{"leg": n, "path": [(x, 0.0), (x + 1e-6, 0.0)], "speed": 1e-7} for n, x in (("one", 3.0), ("two", 5.0))]
    table = {"name": "box", "shape": {"kind": "disc", "radius": 0.5}, "runs": run_}
    pilot = Pilot(lambda s: Command(0.0, 0.0, arrived=s.goal.leg == 0 and s.t > 0.75))
    scenario = make_scenario(legs=legs, obstacles=[table])
    run(pilot, [moving_obstacle(Circle(0.5))], scenario, make_robot(latency={"sensing": 0.25}))
    began = next(s.t for s in pilot.seen if s.goal.leg == 1) + 0.25 - 0.1
    for s in pilot.seen:
        assert s.scan is not None
        assert s.scan.ranges[45] == pytest.approx(2.5 if s.t < began - 1e-9 else 4.5, abs=1e-3), s.t


def test_the_factor_of_a_scenario_scales_it_and_the_navigator_is_told() -> None:
    twice, none = constant(0.5), constant(0.5)
    drive(twice, 2.0, command=0.1, sensing=0.05, jitter=0.01)
    assert twice.task is not None
    assert twice.task.latency == Latency(0.1, 0.2, 0.02)
    without = drive(none, 0.0, command=0.1, sensing=0.05, jitter=0.01)
    assert np.array_equal(without.pose, drive(constant(0.5)).pose)


@settings(max_examples=50)
@given(
    sensing=st.floats(0.0, 0.5), command=st.floats(0.0, 0.5), jitter=st.floats(0.0, 0.3), period=st.floats(0.02, 0.2)
)
def test_messages_keep_their_order(sensing: float, command: float, jitter: float, period: float) -> None:
    delays = Delays(Latency(sensing, command, jitter), period, 3)
    commands = np.zeros((delays.rows, 4))
    stamps, followed = [], {}
    for k in range(60):
        t = k * period
        stamps.append(delays.stamp(t, k))
        assert t - sensing - jitter - 1e-9 <= stamps[-1] <= t
        delays.send(t, k, float(k + 1), 0.0)
        delays.fill(commands, t, period)
        since = commands[:, 0]
        used = since[np.isfinite(since)]
        assert since[0] == 0.0
        assert (np.diff(used) >= 0.0).all()
        assert (used < period).all()
        for s, v, *_ in commands[: len(used)]:
            followed.setdefault(v, t + s)
    assert (np.diff(stamps) >= 0.0).all()
    for v, at in followed.items():  # not before its time, nor later than the period in which it is
        if v > 0.0:
            sent = (v - 1.0) * period
            assert sent + command - 1e-9 <= at <= sent + command + jitter + period


def test_jitter_depends_on_the_seed_alone() -> None:
    one = drive(Pilot(swerves), command=0.05, jitter=0.08)
    assert np.array_equal(one.pose, drive(Pilot(swerves), command=0.05, jitter=0.08).pose)
    assert not np.array_equal(one.pose, drive(Pilot(swerves), command=0.05, jitter=0.08, seed=6).pose)


@given(
    v=st.floats(-2.0, 2.0), omega=st.floats(-6.0, 6.0), share=st.floats(0.0, 1.0), theta=st.floats(-3.1, 3.1)
)  # fmt: skip
def test_between_two_poses_lies_an_arc(v: float, omega: float, share: float, theta: float) -> None:
    a, b = np.array([1.0, -2.0, theta]), np.array(arc(1.0, -2.0, theta, v, omega, 0.5))
    expected = np.array(arc(1.0, -2.0, theta, v, omega, 0.5 * share))
    found = between(a, b, share)
    assert found[:2] == pytest.approx(expected[:2], abs=1e-9)
    assert math.remainder(found[2] - expected[2], math.tau) == pytest.approx(0.0, abs=1e-9)


def test_late_brakes_are_late() -> None:
    """It brakes where it believes that 0.6 m are left: with 0.3 s of delay, at 1 m/s, 0.3 m less are."""

    def careful(s: Sensing) -> Command:
        assert s.scan is not None
        return Command(1.0 if s.scan.ranges[45] > 0.85 else 0.0, 0.0)

    gaps = []
    for sensing, command in ((0.0, 0.0), (0.3, 0.0), (0.0, 0.3), (0.2, 0.2)):
        trial = drive(Pilot(careful), sensing=sensing, command=command, bodies=[body(Circle(0.5), 3.0, 0.0)])
        assert trial.outcome is Outcome.TIMEOUT
        gaps.append(2.25 - float(trial.pose[-1, 0]))
    assert gaps[0] == pytest.approx(0.55, abs=0.06)
    assert [gaps[0] - g for g in gaps[1:]] == pytest.approx([0.3, 0.3, 0.4], abs=1e-6)


@pytest.mark.parametrize(
    "change", [{"sensing": -0.1}, {"command": math.nan}, {"jitter": 3.0}, {"sensing": True}, {"x": 1}]
)
def test_what_can_not_be_meant_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        make_robot(latency=change)


class Thinker(Pilot):
    """Takes so long for its k-th decision, by a clock that nothing else moves; notes the stamps of what it was asked about."""

    def __init__(self, seconds: Callable[[int], float], rule: Callable[[Sensing], Command]) -> None:
        super().__init__(rule)
        self.now, self._seconds = 0.0, seconds

    def decide(self, sensing: Sensing) -> Decision:
        self.now += self._seconds(len(self.seen))
        return super().decide(sensing)


def real(pilot: Thinker, monkeypatch: pytest.MonkeyPatch, *, real_time: bool = True) -> Trial:
    monkeypatch.setattr(import_module("clearway.world.drive"), "perf_counter", lambda: pilot.now)
    legs = [FAR[0] | {"time_limit": 2.0}]
    return run(pilot, (), make_scenario(legs=legs, speed=1.0), make_robot(drive=AT_ONCE), real_time=real_time)


def test_in_real_time_a_command_is_followed_as_late_as_it_was_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    """From its second decision on it takes 35 ms for a period of 100: a step of its command arrives by so much later."""
    pilot = Thinker(lambda k: 0.035, lambda s: Command(0.2 if s.t < 0.95 else 0.8, 0.0))
    trial = real(pilot, monkeypatch)
    assert [s.t for s in pilot.seen] == pytest.approx(trial.t)
    k = int(np.argmin(np.abs(trial.t - 1.1)))
    assert trial.pose[k, 0] - trial.pose[k - 1, 0] == pytest.approx(0.035 * 0.2 + 0.065 * 0.8, abs=1e-9)


def test_who_thinks_for_longer_than_a_period_misses_the_next_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    pilot = Thinker(lambda k: 0.26 if k == 3 else 0.0, lambda s: Command(s.t, 0.0))
    trial = real(pilot, monkeypatch)
    gaps = np.diff([s.t for s in pilot.seen])
    assert gaps[:3] == pytest.approx(0.1)
    assert gaps[3] == pytest.approx(0.3)
    assert gaps[4:] == pytest.approx(0.1)
    assert trial.command[3:6, 0] == pytest.approx(0.3)  # what it is at; it is followed from 0.56 s on
    assert trial.velocity is not None
    assert trial.velocity[5, 0] == pytest.approx(0.2)
    assert trial.pose[6, 0] - trial.pose[5, 0] == pytest.approx(0.06 * 0.2 + 0.04 * 0.3, abs=1e-9)
    assert trial.timing["decide_overrun"] > 0.0


def test_the_first_decision_may_load_code_and_out_of_real_time_nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 5 s for the first decision nothing shows; nor of any without real time."""
    loads, slow, quick = (Thinker(lambda k, s=s: s[k == 0], swerves) for s in ((0.0, 5.0), (0.5, 0.5), (0.0, 0.0)))
    expected = real(quick, monkeypatch).pose
    assert np.array_equal(real(loads, monkeypatch).pose, expected)
    assert np.array_equal(real(slow, monkeypatch, real_time=False).pose, expected)
