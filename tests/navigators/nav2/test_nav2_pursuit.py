"""Nav2's regulated pure pursuit against a plain reading on random input, and how it behaves on whole paths."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pursuit_oracle as plain
import pytest

from clearway.navigators.nav2.controllers.parameters import RegulatedPurePursuitParameters
from clearway.navigators.nav2.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from clearway.navigators.nav2.seams import (
    Controller,
    ControllerFailed,
    CostView,
    NoValidControl,
    Stopping,
    Tolerances,
    Velocity,
)

pytestmark = pytest.mark.slow  # compiles for long

OUTLINE = np.array([(0.25, 0.15), (-0.2, 0.15), (-0.2, -0.15), (0.25, -0.15)])
FAR = Tolerances(0.25, 0.25, False)
DT = 0.05


def view(cost: np.ndarray | None = None, origin: tuple[float, float] = (-1.5, -1.5), tracks: bool = True) -> CostView:
    cost = np.zeros((60, 60), np.uint8) if cost is None else cost
    return CostView(cost, np.array(origin), 0.05, OUTLINE, 0.15, math.hypot(0.25, 0.15), 3.0, 0.5, tracks)


def random_parameters(rng: np.random.Generator) -> dict[str, object]:
    flags = (
        "use_velocity_scaled_lookahead_dist",
        "use_fixed_curvature_lookahead",
        "interpolate_curvature_after_goal",
        "use_regulated_linear_velocity_scaling",
        "use_cost_regulated_linear_velocity_scaling",
        "use_rotate_to_heading",
        "allow_reversing",
        "use_dynamic_window",
        "use_collision_detection",
        "allow_obstacle_checking_beyond_goal",
    )
    given: dict[str, object] = {name: bool(rng.random() < 0.5) for name in flags}
    given |= {
        "max_linear_vel": rng.uniform(0.2, 1.0),
        "lookahead_dist": rng.uniform(0.1, 1.2),
        "curvature_lookahead_dist": rng.uniform(0.1, 1.2),
        "regulated_linear_scaling_min_speed": rng.uniform(0.0, 0.3),
        "min_distance_to_obstacle": rng.choice((-1.0, 0.4)),
        "rotate_to_heading_min_angle": rng.uniform(0.4, 1.5),
        "use_cancel_deceleration": True,
    }
    return given


def random_scene(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A costmap with a few obstacles, a path across it, and a pose near its beginning."""
    cost = rng.integers(0, 253, (60, 60)).astype(np.uint8) * np.uint8(rng.random() < 0.7)
    for _ in range(rng.integers(0, 4)):
        r, c = rng.integers(0, 58, 2)
        cost[r : r + 2, c : c + 2] = rng.choice((254, 255))
    n = int(rng.integers(2, 40))
    yaw = np.cumsum(rng.normal(0.0, 0.15, n)) + rng.uniform(-3, 3)
    at = np.cumsum(0.06 * np.stack((np.cos(yaw), np.sin(yaw)), axis=1), axis=0)
    path = np.column_stack((at, yaw))
    way = 1.0 if rng.random() < 0.8 else -1.0
    pose = np.array((*rng.normal(0.0, 0.1, 2), yaw[0] + (way < 0) * math.pi + rng.normal(0.0, 0.5)))
    return cost, path, pose


def test_against_a_plain_reading() -> None:
    rng = np.random.default_rng(21)
    ends: Counter[str] = Counter()
    for _ in range(1500):
        given = random_parameters(rng)
        p = RegulatedPurePursuitParameters(**given)
        cost, path, pose = random_scene(rng)
        tracks, there, cancelling = (bool(x) for x in rng.random(3) < (0.5, 0.2, 0.2))
        measured = float(rng.uniform(-0.3, 0.8)), float(rng.uniform(-1.0, 1.0))
        last = float(rng.uniform(-0.3, 0.8)), float(rng.uniform(-1.0, 1.0))
        controller = RegulatedPurePursuit(p, DT)
        controller._last = Velocity(last[0], 0.0, last[1])
        if cancelling:
            assert not controller.cancel()
        grid = plain.PlainMap(cost, complex(-1.5, -1.5), 0.05, tracks)
        told = Velocity(measured[0], 0.0, measured[1]), path, path[-1], Tolerances(0.25, 0.25, there)
        values = p.model_dump()
        try:
            v, w, finished = plain.command(
                values,
                DT,
                tuple(pose),
                measured,
                last,
                [tuple(q) for q in path],
                there,
                cancelling,
                grid,
                OUTLINE,
                0.15,
            )
        except plain.Refused as refused:
            with pytest.raises(NoValidControl):
                controller.compute(0.0, pose, *told, view(cost, tracks=tracks))
            ends[str(refused)] += 1
            continue
        found = controller.compute(0.0, pose, *told, view(cost, tracks=tracks))
        assert found == pytest.approx((v, 0.0, w), abs=1e-9)
        assert controller.cancel() == finished
        ends["rotating" if v == 0 else "backwards" if v < 0 else "forwards"] += 1
    assert min(ends[name] for name in ("collision", "rotating", "backwards", "forwards")) > 20


def drive(controller: Controller, path: np.ndarray, pose: np.ndarray, seconds: float) -> np.ndarray:
    """Poses of an ideal robot that follows `path` (n, 3)."""
    v, poses = Velocity(0.0, 0.0, 0.0), [pose]
    for k in range(round(seconds / DT)):
        nearest = int(np.argmin(np.hypot(*(path[:, :2] - pose[:2]).T)))
        there = math.dist(pose[:2], path[-1, :2]) < 0.25
        around = view(origin=(pose[0] - 1.5, pose[1] - 1.5))
        v = controller.compute(
            k * DT, pose, v, path[min(nearest, len(path) - 2) :], path[-1], Tolerances(0.25, 0.25, there), around
        )
        pose = pose + DT * np.array((v.v_x * math.cos(pose[2]), v.v_x * math.sin(pose[2]), v.omega))
        poses.append(pose)
    return np.array(poses)


def test_it_keeps_to_a_bend_slows_down_for_it_and_turns_to_the_goal() -> None:
    angle = np.linspace(0.0, math.pi / 2, 40)
    bend = np.column_stack((0.6 * np.sin(angle), 0.6 * (1 - np.cos(angle)), angle))
    on = np.column_stack((np.full(20, 0.6), np.linspace(0.65, 1.6, 20), np.full(20, math.pi / 2)))
    path = np.vstack((bend, on))
    path[-1, 2] = -3.0
    poses = drive(RegulatedPurePursuit(RegulatedPurePursuitParameters(lookahead_dist=0.3), DT), path, np.zeros(3), 12.0)
    gaps = [np.hypot(*(path[:, :2] - p[:2]).T).min() for p in poses if math.dist(p[:2], path[-1, :2]) > 0.3]
    assert max(gaps) < 0.08
    speeds = np.hypot(*np.diff(poses[:, :2], axis=0).T) / DT
    assert 0.25 <= speeds[5:20].max() < 0.40  # 0.5 m/s * (0.6 m / 0.9 m)
    assert speeds.max() == pytest.approx(0.5, abs=0.02)
    assert abs(math.remainder(poses[-1, 2] + 3.0, math.tau)) < 0.1
    assert speeds[-1] == 0.0


def test_obstacles_ahead_are_refused_and_the_way_there_is_told() -> None:
    cost = np.zeros((60, 60), np.uint8)
    cost[28:33, 42] = 254  # 0.6 m ahead
    path = np.column_stack((np.linspace(0.0, 1.4, 29), np.zeros(29), np.zeros(29)))
    controller = RegulatedPurePursuit(RegulatedPurePursuitParameters(max_linear_vel=0.5), DT)
    told = np.zeros(3), Velocity(0.5, 0.0, 0.0), path, path[-1], FAR
    with pytest.raises(NoValidControl, match="collision"):
        controller.compute(0.0, *told, view(cost))
    assert controller.trajectory[-1, 0] == pytest.approx(0.35)
    controller.set_speed_limit(40.0, True)
    assert controller.compute(0.0, *told, view(cost)).v_x == pytest.approx(0.2)
    controller.set_speed_limit(0.0, False)
    assert controller.compute(0.0, *told, view()).v_x == pytest.approx(0.5)
    with pytest.raises(ControllerFailed):
        controller.compute(0.0, *told, view(origin=(5.0, 5.0)))


def test_a_cancelled_robot_slows_down_if_it_is_to() -> None:
    path = np.column_stack((np.linspace(0.0, 1.4, 29), np.zeros(29), np.zeros(29)))
    at_once = RegulatedPurePursuit(RegulatedPurePursuitParameters(), DT)
    assert isinstance(at_once, Stopping)
    assert at_once.cancel()
    slowly = RegulatedPurePursuit(
        RegulatedPurePursuitParameters(use_cancel_deceleration=True, cancel_deceleration=1.9), DT
    )
    speeds, v = [], Velocity(0.5, 0.0, 0.0)
    while not slowly.cancel():
        v = slowly.compute(0.0, np.zeros(3), v, path, path[-1], FAR, view())
        speeds.append(v.v_x)
    assert speeds == pytest.approx([0.405, 0.31, 0.215, 0.12, 0.025, 0.0])
    slowly.reset()
    assert slowly.compute(0.0, np.zeros(3), v, path, path[-1], FAR, view()).v_x == pytest.approx(0.5)
