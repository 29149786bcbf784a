"""The navigator `mpc-cbf`: model predictive control with discrete-time control barrier functions, on the way that the map gives.

J. Zeng, B. Zhang, K. Sreenath, "Safety-critical model predictive control with discrete-time control barrier function", American
Control Conference 2021. What the paper leaves open is told in DECISIONS.md beside this file.

Where it fails, by the paper or by what was found here (each has a test):
- Nothing makes (10) solvable one period after it was (the paper, section III-C: recursive feasibility is an open problem). The smaller
  gamma, the sooner it is not: somebody who comes at the robot faster than the barrier may fall leaves no input at all. It then
  drives what breaks (10f) least, and where that would touch somebody it brakes. One who does not look walks into it as it stands.
- Exactly head on it stops before what could move and doesn't: to neither side does the cost fall, so a local solver stays.
- It takes one future of each obstacle, the most probable, for true, without its spread.
- An omnidirectional base is driven as one that only drives forwards and turns.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Diagnostics, Need, Observation, Status, Task
from clearway.crowds.outlines import outlines
from clearway.crowds.walls import walls_of
from clearway.forecasts.forecast import later
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.navigators.common.ahead import Ahead
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.inputs import area_of, finite, own
from clearway.navigators.common.motion import stop_and_turn
from clearway.navigators.common.parametrised import Parametrised
from clearway.navigators.common.route import Route, seen, unmapped
from clearway.navigators.common.tracking.gauss_newton import BUDGET
from clearway.navigators.mpc_cbf.decision import Decision, Settings, decide
from clearway.navigators.mpc_cbf.parameters import STEP, Parameters
from clearway.robots import DriveKind, Robot
from clearway.tuning import TunedOn

STATUSES = (Status.TRACKING, Status.INFEASIBLE, Status.BRAKING, Status.ITERATION_LIMIT, Status.NO_PATH)
"""Of the outcomes of a decision."""


class MpcCbf(Parametrised[Parameters]):
    """Model predictive control that lets no barrier of an obstacle fall by more than a share in a period.

    One unit of `task.budget.iterations` is an interior-point iteration; no wall-clock budget is heeded. A decision takes a few
    milliseconds among discs; among people in a ward of many walls some take longer than a control period.

    Args:
        options: Any field of `Parameters`, which overrides the robot's file.

    Raises:
        ClearwayError: An option is wrong.
    """

    parameters = Parameters
    needs: ClassVar[frozenset[Need]] = frozenset({"map", "obstacles"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"differential", "omnidirectional"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = tuple(
        TunedOn(suite, ("rescue",), draws=draws, note="horizon, which of the paper's gammas, reverse, when it brakes")
        for suite in ("sar-case1", "sar-case2", "sar-case3", "sar-stress")
        for draws in (range(20000, 20010), range(30000, 30010))
    )

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything. Nothing is drawn from `rng`."""
        p, c = self.read_parameters(robot), task.period
        limits = robot.limits(task.speed_limit)
        if not p.reverse:
            limits = limits._replace(v_min=0.0)
        self._components = 3 if limits.kind == "omnidirectional" else 2
        n = max(round(p.horizon / c), 1)
        self._settings = Settings(
            c, n, 1.0 - (1.0 - p.gamma) ** (c / STEP), p.effort, p.terminal, p.heading_weight,
            circumscribed_radius(robot.planner_shape) + p.padding, p.distance, p.ahead, area_of(task), limits,
        )  # fmt: skip
        self._ahead = Ahead(task.latency, limits)
        count = n + math.ceil(self._ahead.time / c - 1e-9)
        self._expected = ForecastParameters(velocities=robot.camera is None)
        self._forecaster = Forecaster(self._expected, c, c, count)
        self._mapped = task.map is not None
        self._walls = walls_of([] if task.map is None else outlines(task.map))
        self._route = Route(task, self._settings.radius, limits, p.ahead)
        self._budget = BUDGET if task.budget.iterations is None else task.budget.iterations
        self._approach = Approach(limits, c)
        self._plan = np.zeros((n, 2))
        self._decision: Decision | None = None
        self._circles = np.zeros((0, 3))

    def step(self, observation: Observation) -> Command:
        """Decide for one control period, for the time at which the command is followed.

        Raises:
            ValueError: the pose, the velocity or the goal is not finite.
        """
        pose, velocity = (
            finite("pose", observation.pose),
            finite("velocity", observation.velocity, self._components)[:2],
        )
        finite("goal.pose", observation.goal.pose)
        pose, velocity = self._ahead.state(observation.t, pose, velocity)
        command = self._decide(observation, pose, velocity)
        self._ahead.decided(observation.t, velocity, command.v, command.omega)
        return command

    def _decide(self, observation: Observation, pose: FloatArray, velocity: FloatArray) -> Command:
        """The command for a robot at `pose` with `velocity` when it follows it."""
        goal, settings = observation.goal, self._settings
        self._approach.set_out(goal)
        obstacles = unmapped(own(observation).obstacles, self._mapped)
        now, _ = self._forecaster.update(observation.t, obstacles)
        arrived = self._approach.reached(pose, velocity)
        if self._approach.stopping:
            v, omega = stop_and_turn(self._approach.turn, velocity[0], velocity[1], settings.limits, settings.period)
            self._plan[:], self._decision = 0.0, None
            return Command(v, omega, arrived=arrived, status=self._approach.status)
        forecast = later(now, self._ahead.time, self._expected.acceleration)
        ways = self._route.ways(observation.t, pose, goal, seen(obstacles, self._mapped))
        decision = decide(settings, forecast, self._walls, ways, pose, velocity, self._plan, self._budget)
        self._plan, self._decision = decision.inputs, decision
        self._circles = np.column_stack((obstacles.position, obstacles.radius))
        v, omega = decision.inputs[0].tolist()
        return Command(v, omega, arrived=False, status=STATUSES[decision.outcome], cut=decision.cut)

    def diagnostics(self) -> Diagnostics:
        """Where it heads, what it predicts of itself, and the obstacles; `infeasible`: (10) has no solution, `braking`: so it brakes."""
        decision = self._decision
        if decision is None:
            return Diagnostics(status=self._approach.status)
        lines = {"plan": decision.reference[:, :2].copy(), "horizon": decision.states[:, :2].copy()}
        status = STATUSES[decision.outcome]
        return Diagnostics(lines, {"obstacles": self._circles}, status=status, iterations=decision.iterations)
