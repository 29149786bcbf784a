"""Bounded disturbance of the robot's motion: its bounds, its keys, and contact that stays exact."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import DRIVE, Pilot, body, constant, make_robot, make_scenario, moving_obstacle, run, steer

from clearway.contract import Command
from clearway.geometry.distance import min_clearance, path_clearance
from clearway.geometry.motion import arc
from clearway.geometry.shapes import Circle, FloatArray, rectangle
from clearway.geometry.streams import stream
from clearway.robots import load_robot
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suites import load_suite
from clearway.trials import Outcome, Trial
from clearway.world import simulate
from clearway.world.plant import disturb

BOTH = {"position": 0.01, "heading": 0.02}
INSTANT = DRIVE | dict.fromkeys(
    ("acceleration", "deceleration", "angular_acceleration", "angular_deceleration"), math.inf
)
GRAZE = 2e-3  # m: the way between two samples deviates a little from the arc that the oracle draws there
FAR = [{"name": "f", "goal": (99, 0, 0), "time_limit": 6.0}]


def scenario(disturbance: dict[str, Any] | None, **more: Any) -> Any:
    return make_scenario(disturbance=disturbance, **({"legs": FAR} | more))


def pushes(trial: Trial, v: float, omega: float) -> FloatArray:
    """(n, 3) where the robot ends each period of 0.1 s, less where it would have ended on the exact arc."""
    ends = np.array([arc(*pose, v, omega, 0.1) for pose in trial.pose[:-1]])
    off: FloatArray = trial.pose[1:] - ends
    off[:, 2] = [math.remainder(a, math.tau) for a in off[:, 2]]
    return off


def test_infinite_acceleration_reaches_any_speed_at_once() -> None:
    plan = [Command(1.0, 2.0), Command(-1.0, -2.0), Command(0.0, 0.0), Command(0.5, 0.0)]
    trial = run(Pilot(lambda s: plan[round(s.t / 0.1) % 4]), scenario=scenario(None), robot=make_robot(drive=INSTANT))
    assert trial.velocity is not None
    assert trial.velocity[1:5].tolist() == [[1.0, 2.0], [-1.0, -2.0], [0.0, 0.0], [0.5, 0.0]]
    pose = (0.0, 0.0, 0.0)
    for i, command in enumerate(plan):
        pose = arc(*pose, command.v, command.omega, 0.1)
        assert trial.pose[i + 1] == pytest.approx(pose, abs=1e-12)
    assert np.isfinite(trial.pose).all()


def test_a_period_ends_one_draw_away_from_the_undisturbed_arc() -> None:
    trial = run(constant(0.8, 0.5), scenario=scenario(BOTH), robot=make_robot(drive=INSTANT))
    off = pushes(trial, 0.8, 0.5)
    drawn, key = np.empty((len(off), 5)), stream(5, "disturbance")
    for i in range(len(off)):
        disturb(np.array([0.01, 0.02, 0.0, 0.0, 1.0]), key, i, drawn[i])
    np.testing.assert_allclose(off, drawn[:, :3], atol=1e-12)
    apart = np.hypot(off[:, 0], off[:, 1])
    assert 0.0095 < apart.max() <= 0.01
    assert 0.018 < np.abs(off[:, 2]).max() <= 0.02


def test_the_draws_fill_their_disc_evenly() -> None:
    drawn = np.empty((20_000, 5))
    for i in range(len(drawn)):
        disturb(np.array([1.0, 0.5, 0.2, 0.3, 1.0]), stream(1, "disturbance"), i, drawn[i])
    radius, angle = np.hypot(drawn[:, 0], drawn[:, 1]), np.arctan2(drawn[:, 1], drawn[:, 0])
    assert np.mean(radius < 0.5) == pytest.approx(0.25, abs=0.015)
    assert np.histogram(angle, 8, (-math.pi, math.pi))[0] / len(drawn) == pytest.approx(np.full(8, 1 / 8), abs=0.01)
    for column, bound in ((2, 0.5), (3, 0.2), (4, 0.3)):
        assert np.abs(drawn[:, column]).max() <= bound
        assert np.std(drawn[:, column]) == pytest.approx(bound / math.sqrt(3), rel=0.03)
        assert np.mean(drawn[:, column]) == pytest.approx(0.0, abs=0.02 * bound + 0.005)
    correlation = np.corrcoef(drawn.T)
    assert np.abs(correlation - np.eye(5)).max() < 0.03


def test_every_navigator_meets_the_same_disturbance_and_another_seed_another() -> None:
    robot = make_robot(drive=INSTANT)
    straight = pushes(run(constant(1.0), scenario=scenario(BOTH), robot=robot), 1.0, 0.0)
    turning = pushes(run(constant(0.2, 1.7), scenario=scenario(BOTH), robot=robot), 0.2, 1.7)
    np.testing.assert_allclose(straight, turning, atol=1e-12)
    other = pushes(run(constant(1.0), scenario=scenario(BOTH, seed=6), robot=robot), 1.0, 0.0)
    assert np.abs(other - straight).max() > 0.005


def test_at_rest() -> None:
    still = run(constant(0.0), scenario=scenario(BOTH | {"velocity": 0.1, "at_rest": False}))
    assert (still.pose == still.pose[0]).all()
    moved = run(constant(0.0), scenario=scenario(BOTH))
    assert np.ptp(moved.pose[:, 0]) > 0.01


def test_v_and_omega_deviate_within_their_bounds() -> None:
    noise = {"position": 0.0, "velocity": 0.05, "turn": 0.1}
    pilot = constant(0.8, 0.0)
    trial = run(pilot, scenario=scenario(noise), robot=make_robot(drive=INSTANT))
    step = np.diff(trial.pose, axis=0)
    turn = np.array([math.remainder(a, math.tau) for a in step[:, 2]]) / 0.1
    speed = np.hypot(step[:, 0], step[:, 1]) / 0.1
    assert 0.09 < np.abs(turn).max() <= 0.1 + 1e-12
    assert 0.045 < np.abs(speed - 0.8).max() <= 0.05 + 1e-5  # a chord is a little shorter than its arc
    assert pilot.seen[-1].odom_pose[:2] == pytest.approx([0.8 * pilot.seen[-1].t, 0.0])  # the wheels know nothing


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(0.02, 0.3)), max_size=4),
    st.lists(st.tuples(*[st.floats(-2, 2)] * 4), max_size=2),
    st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    st.integers(0, 1000),
)
def test_contact_is_exact_under_heavy_disturbance(
    still: list[tuple[float, float, float]], moving: list[tuple[float, float, float, float]],
    command: tuple[float, float], seed: int,
) -> None:  # fmt: skip
    """Pushed about by up to 0.1 m and 0.2 rad in 0.1 s. The trial's own samples are dense: one each step of the plant."""
    foot = {"kind": "polygon", "vertices": [(-0.3, -0.2), (0.4, -0.2), (0.4, 0.2), (-0.3, 0.2)]}
    rough = {"position": 0.01, "heading": 0.02, "velocity": 0.5, "turn": 1.0}  # a hundredth of a second each
    robot = make_robot(footprint=foot, period=0.01, drive=INSTANT | {"v_max": 3.0, "v_min": -3.0}, lidar=None)
    bodies = [body(Circle(r), x, y) for x, y, r in still] + [moving_obstacle(rectangle(0.3, 0.1)) for _ in moving]
    knots = [np.array([[0.0, a, b, 0.0], [1.5, c, d, 2.0]]) for a, b, c, d in moving]
    legs = [{"name": "f", "goal": (99, 0, 0), "time_limit": 1.2}]
    trial = run(constant(*command), bodies, scenario(rough, legs=legs, seed=seed, speed=3.0), robot, knots or None)
    gap = min_clearance(robot.shape, trial.pose, bodies, trial.moving_obstacles)
    between = path_clearance(robot.shape, trial.pose, bodies, trial.moving_obstacles, 1e-5)
    if trial.outcome is Outcome.COLLISION:
        assert gap[-1] <= 1.2e-5
        assert (gap[:-1] > 0).all()
        assert between[:-2].min(initial=1.0) > 0 or gap[:-1].min() < GRAZE
    else:
        assert trial.outcome is Outcome.TIMEOUT
        assert gap.min(initial=1.0) > 0
        assert between.min() > 0 or gap.min() < GRAZE


def test_a_push_alone_is_contact() -> None:
    """The robot stands 4 mm from a wall and is pushed by up to 10 mm every tenth of a second."""
    trial = run(constant(0.0), [body(rectangle(0.2, 4.0), 0.354, 0.0)], scenario(BOTH))
    assert trial.outcome is Outcome.COLLISION
    assert "robot at 0.000 m/s" in trial.events[-1].detail
    assert trial.pose[-1, 0] == pytest.approx(0.004, abs=1.1e-5)
    assert (trial.pose[:-1, 0] < 0.004).all()


@pytest.mark.parametrize("number", range(10))
def test_contact_in_a_rescue_scenario_is_where_the_closed_forms_say(number: int) -> None:
    """A robot that heads for the goal, blind. Its way and the obstacles' are recomputed every millisecond."""
    robot = load_robot("rescue:unlimited")
    scene = load_suite("sar-case2").build(robot)[number]
    trial = simulate(scene, robot, Pilot(steer), navigator="blind", localisation="truth", map=None)
    assert trial.command is not None
    push, key = np.empty(5), stream(scene.seed, "disturbance")
    bounds = np.array([0.01, 0.01, 0.0, 0.0, 1.0])
    least = []
    for k, (pose, command) in enumerate(zip(trial.pose[:-1], trial.command[:-1], strict=True)):
        end = float(trial.t[k + 1] - trial.t[k])
        s = np.append(np.arange(0.0, end, 1e-3), end)
        v, omega = np.clip(command, (0.0, -1.5), (1.0, 1.5))
        disturb(bounds, key, k, push)
        half = 0.5 * omega * s
        chord = v * s * np.sinc(half / np.pi)
        at = pose[:2] + np.stack([chord * np.cos(pose[2] + half), chord * np.sin(pose[2] + half)], axis=1)
        at += (s / 0.15)[:, None] * push[:2]
        least.append(min(np.hypot(*(at - centre).T).min() for centre in centres(scene, trial.t[k] + s)))
        assert at[-1] == pytest.approx(trial.pose[k + 1, :2], abs=1e-9)
    if trial.outcome is Outcome.COLLISION:
        assert least[-1] == pytest.approx(0.6, abs=1e-4)
        assert min(least[:-1]) > 0.6 - 1e-4
    else:
        assert trial.outcome is Outcome.REACHED
        assert min(least) > 0.6


def centres(scene: Scenario, t: FloatArray) -> list[FloatArray]:
    """Of each obstacle, (k, 2) at the times `t` (k,), by the closed form."""
    found = []
    for obstacle in scene.obstacles:
        motion = obstacle.oscillation
        if motion is None:
            assert obstacle.pose is not None
            found.append(np.broadcast_to(np.array(obstacle.pose[:2]), (len(t), 2)))
        else:
            x, v, a, w = (np.array(c) for c in (motion.start, motion.velocity, motion.attraction, motion.stiffness))
            w, s = np.sqrt(w), t[:, None]
            found.append(a + (x - a) * np.cos(w * s) + v / w * np.sin(w * s))
    return found
