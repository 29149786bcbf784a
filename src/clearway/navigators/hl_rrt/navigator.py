"""The navigator `hl-rrt`."""

from __future__ import annotations

import math
import time
from functools import cache
from typing import ClassVar

import numpy as np

from clearway.contract import Budget, Command, Diagnostics, Need, Observation, Obstacles, Task
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.navigators.common.arrival import BEGIN, Approach
from clearway.navigators.common.inputs import area_of, finite
from clearway.navigators.common.parametrised import Parametrised
from clearway.navigators.hl_rrt.following import Body, follow, turn
from clearway.navigators.hl_rrt.parameters import Parameters
from clearway.navigators.hl_rrt.planner import Plan, Planner
from clearway.robots import Robot
from clearway.robots.drive_limits import DriveLimits
from clearway.tuning import TunedOn

_NONE = Plan(np.empty((0, 2)), math.inf, False, 0, False)


class HlRrt(Parametrised[Parameters]):
    """Horizon-based lazy RRT* with online learning (HL-RRT*), paper B's first rival.

    Chen, He, Li 2019 (Autonomous Robots, 10.1007/s10514-019-09879-8) as paper B describes it; what neither says is
    filled in and listed in DECISIONS.md beside this file. It predicts nothing: obstacles count where they are now. The robot stays
    put unless a collision-free way leads to a point nearer to the goal than itself.

    An iteration of its budget is one sample. Without a budget it ends by itself, deterministically: once a valid path to
    the horizon or the goal has not improved for `patience` samples, or after `cap` samples.

    Args:
        options: Any field of `Parameters`, which overrides the robot's file and the stand-ins.
    """

    parameters = Parameters
    needs: ClassVar[frozenset[Need]] = frozenset({"obstacles"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = tuple(
        TunedOn(suite, ("rescue",), draws=range(30_000, 30_040), note="padding") for suite in ("sar-case1", "sar-case2")
    )

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything and prepare for a new trial.

        Raises:
            ClearwayError: a parameter in the robot's file or an option is wrong.
        """
        p = self.read_parameters(robot)
        _compile()
        self._planner = Planner(p, area_of(task), rng)
        self._body = Body(robot.limits(min(p.speed or math.inf, task.speed_limit)), task.period)
        self._margin = circumscribed_radius(robot.planner_shape) + p.padding
        self._budget = task.budget
        self._approach = Approach(self._body.limits, task.period)
        self._plan, self._status = _NONE, ""

    def step(self, observation: Observation) -> Command:
        """Decide for one control period.

        Raises:
            ValueError: the pose, the velocity or the goal is not finite.
        """
        began, o = time.perf_counter(), observation
        pose, velocity, aim = (
            finite("pose", o.pose),
            finite("velocity", o.velocity, 2),
            finite("goal.pose", o.goal.pose),
        )
        at, goal = pose[:2].copy(), aim[:2].copy()
        if self._approach.set_out(o.goal):
            self._planner.forget(at)
        arrived = self._approach.reached(pose, velocity)
        if self._approach.stopping:
            self._plan, self._status = _NONE, "arrived"
            return self._command(*turn(self._approach.turn, velocity, self._body), arrived)
        near = self._body.limits.v_max * self._body.period
        discs = self._discs(o.obstacles)
        self._plan = plan = self._planner.plan(at, goal, BEGIN * o.goal.xy_tolerance, discs, near, self._budget, began)
        if not len(plan.points):
            self._status = "no path"
            return self._command(*turn(0.0, velocity, self._body))
        assert self._planner.scene is not None
        v, omega, clear = follow(plan.points, pose, velocity, self._body, near, self._planner.scene)
        self._status = "tracking" if clear else "braking"
        return self._command(v, omega)

    def diagnostics(self) -> Diagnostics:
        """The tree, the path and the learnt mixture."""
        scene = self._planner.scene
        return Diagnostics(
            polylines={"plan": self._plan.points} if len(self._plan.points) else {},
            circles={
                "obstacles": np.empty((0, 3)) if scene is None else scene.discs.copy(),
                "mixture": self._planner.mixture,
            },
            tree=self._planner.edges(),
            status=self._status,
            iterations=self._plan.iterations,
        )

    def _discs(self, obstacles: Obstacles | None) -> FloatArray:
        """(n, 3) x, y, R: what the robot's centre keeps out of. An obstacle that is not a finite disc is left out."""
        if obstacles is None:
            return np.empty((0, 3))
        discs = np.column_stack([obstacles.position, obstacles.radius + self._margin]).astype(np.float64)
        return np.ascontiguousarray(discs[np.isfinite(discs).all(axis=1) & (obstacles.radius >= 0.0)])

    def _command(self, v: float, omega: float, arrived: bool = False) -> Command:
        limits = self._body.limits
        v = min(max(v, 0.0), limits.v_max)
        omega = min(max(omega, -limits.omega_max), limits.omega_max)
        return Command(v, omega, arrived=arrived, status=self._status, cut=self._plan.cut)


@cache
def _compile() -> None:
    """Compile all kernels now, so that no decision of a trial waits for it."""
    parameters = Parameters.read(None, cap=20, capacity=16)
    planner = Planner(parameters, np.array((-9.0, -9.0, 9.0, 9.0)), np.random.default_rng(0))
    planner.forget(np.zeros(2))
    for _ in range(2):
        plan = planner.plan(
            np.zeros(2), np.array((0.4, 0.0)), 0.1, np.array(((5.0, 0.0, 0.2),)), 0.01, Budget(), 0.0
        )  # fmt: skip
    body = Body(DriveLimits(0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0), 0.1)
    assert planner.scene is not None
    follow(plan.points, np.zeros(3), np.zeros(2), body, 0.01, planner.scene)
    turn(0.1, np.zeros(2), body)
    planner.edges()
