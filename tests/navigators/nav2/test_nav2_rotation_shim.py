"""Nav2's rotation shim against a plain reading on random input, and around regulated pure pursuit."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pursuit_oracle as plain
import pytest
from test_nav2_pursuit import DT, OUTLINE, drive, random_scene, view

from clearway.navigators.nav2.controllers.parameters import RegulatedPurePursuitParameters, RotationShimParameters
from clearway.navigators.nav2.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from clearway.navigators.nav2.controllers.rotation_shim import RotationShim
from clearway.navigators.nav2.seams import Tolerances, Velocity

pytestmark = pytest.mark.slow  # compiles for long

PRIMARY = Velocity(0.3, 0.1, 0.7)


class Recorder:
    """A primary controller that says what it was told."""

    trajectory = np.empty((0, 2))

    def __init__(self) -> None:
        self.told: list[object] = []

    def reset(self) -> None:
        self.told.append("reset")

    def set_plan(self, path: np.ndarray) -> None:
        self.told.append("plan")

    def set_speed_limit(self, limit: float, percentage: bool) -> None:
        self.told.append((limit, percentage))

    def compute(self, *_: object) -> Velocity:
        return PRIMARY


class PlainShim:
    """RotationShimController, with its members; nothing is thrown but `plain.Refused`."""

    def __init__(self, p: RotationShimParameters) -> None:
        self.p, self.in_rotation, self.last = p, False, 0.0

    def heading_command(self, angle: float, yaw: float, at: complex, omega: float, grid: plain.PlainMap) -> float:
        p = self.p
        now = omega if p.closed_loop else self.last
        sign = 1 if angle > 0 else -1
        w = plain.clamp(
            sign * p.rotate_to_heading_angular_vel, now - p.max_angular_accel * DT, now + p.max_angular_accel * DT
        )
        if abs(w) > math.sqrt(2 * p.max_angular_accel * abs(angle)):
            w = sign * math.sqrt(2 * p.max_angular_accel * abs(angle))
        time = 0.0
        while time < p.simulate_ahead_time:
            time += DT
            if cmath.phase(cmath.rect(1.0, -w * time)) >= abs(angle) - p.angular_dist_threshold:
                break
            cost = grid.footprint_cost(at, yaw + w * time, OUTLINE)
            if cost >= p.max_cost_threshold or (cost == 255 and grid.tracks):
                raise plain.Refused
        return w

    def compute(
        self,
        pose: tuple[float, float, float],
        omega: float,
        path: list[tuple[float, float, float]],
        goal: tuple[float, float, float],
        there: bool,
        grid: plain.PlainMap,
    ) -> tuple[float, float, float]:
        p, at, yaw = self.p, complex(*pose[:2]), pose[2]
        if p.rotate_to_goal_heading and there:
            try:
                self.last = self.heading_command(cmath.phase(cmath.rect(1.0, goal[2] - yaw)), yaw, at, omega, grid)
                return 0.0, 0.0, self.last
            except plain.Refused:
                pass
        if len(path) >= 2:
            start = complex(*path[0][:2])
            beyond = [q for q in path[1:] if abs(complex(*q[:2]) - start) >= p.forward_sampling_distance]
            sampled = beyond[0] if beyond else path[-1]
            towards = cmath.rect(1.0, sampled[2]) if p.use_path_orientations else complex(*sampled[:2]) - at
            angle = cmath.phase(towards * cmath.rect(1.0, -yaw))
            if abs(angle) > (p.angular_disengage_threshold if self.in_rotation else p.angular_dist_threshold):
                self.in_rotation = True
                try:
                    self.last = self.heading_command(angle, yaw, at, omega, grid)
                    return 0.0, 0.0, self.last
                except plain.Refused:
                    pass
        self.in_rotation, self.last = False, PRIMARY.omega
        return tuple(PRIMARY)


def test_against_a_plain_reading() -> None:
    rng = np.random.default_rng(8)
    turns = follows = 0
    for _ in range(150):
        p = RotationShimParameters(
            rotate_to_goal_heading=bool(rng.random() < 0.5),
            closed_loop=bool(rng.random() < 0.5),
            use_path_orientations=bool(rng.random() < 0.3),
            simulate_ahead_time=rng.choice((0.0, 0.3, 1.0)),
            max_cost_threshold=rng.choice((150.0, 254.0)),
        )
        shim, oracle = RotationShim(p, Recorder(), DT), PlainShim(p)
        cost, path, pose = random_scene(rng)
        cost[rng.random(cost.shape) < 0.98] = 0
        tracks, goal = bool(rng.random() < 0.5), path[-1]
        grid = plain.PlainMap(cost, complex(-1.5, -1.5), 0.05, tracks)
        for _ in range(6):
            there, omega = bool(rng.random() < 0.3), float(rng.uniform(-1, 1))
            expected = oracle.compute(tuple(pose), omega, [tuple(q) for q in path], tuple(goal), there, grid)
            told = Velocity(0.2, 0.0, omega), path, goal, Tolerances(0.25, 0.25, there)
            found = shim.compute(0.0, pose, *told, view(cost, tracks=tracks))
            assert found == pytest.approx(expected, abs=1e-9)
            pose = pose + np.array((*rng.normal(0.0, 0.05, 2), rng.normal(0.0, 0.5)))
            turns, follows = turns + (found[0] == 0), follows + (found[0] != 0)
    assert min(turns, follows) > 150


def test_once_means_after_another_goal_only() -> None:
    primary = Recorder()
    shim = RotationShim(RotationShimParameters(rotate_to_heading_once=True), primary, DT)
    path = np.column_stack((np.linspace(0.0, 1.0, 21), np.zeros(21), np.zeros(21)))
    told = Velocity(0.0, 0.0, 0.0), path, path[-1], Tolerances(0.25, 0.25, False), view()
    away, turned = np.array((0.0, 0.0, 2.0)), np.array((0.0, 0.0, 0.1))
    shim.set_plan(path)
    assert shim.compute(0.0, away, *told).v_x == 0.0
    assert shim.compute(0.0, away, *told).v_x == 0.0  # until it is turned to the path
    assert shim.compute(0.0, turned, *told) == PRIMARY
    shim.set_plan(path[1:])
    assert shim.compute(0.0, away, *told) == PRIMARY
    shim.set_plan(path[:-1])
    assert shim.compute(0.0, away, *told).v_x == 0.0
    shim.set_speed_limit(50.0, True)
    assert primary.told == ["reset", "plan", "plan", "plan", (50.0, True)]


def test_a_turn_that_a_reset_interrupts_goes_on_to_where_it_would_have_ended() -> None:
    shim = RotationShim(RotationShimParameters(rotate_to_heading_once=True), Recorder(), DT)
    path = np.column_stack((np.linspace(0.0, 1.0, 21), np.zeros(21), np.zeros(21)))
    told = Velocity(0.0, 0.0, 0.0), path, path[-1], Tolerances(0.25, 0.25, False), view()
    away, nearly, turned = (np.array((0.0, 0.0, yaw)) for yaw in (2.0, 0.6, 0.1))  # 0.6: between its two thresholds
    shim.set_plan(path)
    assert shim.compute(0.0, away, *told).v_x == 0.0
    shim.reset()
    shim.set_plan(path)
    assert shim.compute(0.0, nearly, *told).v_x == 0.0
    assert shim.compute(0.0, turned, *told) == PRIMARY
    shim.reset()
    shim.set_plan(path)
    assert shim.compute(0.0, away, *told) == PRIMARY  # the goal is the one that it turned for


def test_around_pure_pursuit_the_robot_turns_drives_and_turns() -> None:
    path = np.column_stack((np.linspace(0.0, 1.5, 31), np.zeros(31), np.full(31, -2.0)))
    inner = RegulatedPurePursuitParameters(use_rotate_to_heading=False)
    shim = RotationShim(RotationShimParameters(rotate_to_goal_heading=True), RegulatedPurePursuit(inner, DT), DT)
    poses = drive(shim, path, np.array((0.0, 0.0, 2.5)), 10.0)
    assert np.abs(poses[:, 1]).max() < 0.1
    assert abs(poses[-1, 0] - 1.5) < 0.3
    assert abs(math.remainder(poses[-1, 2] + 2.0, math.tau)) < 0.05
