"""The navigator `orca`: ORCA among obstacles and the map's walls, on the way that the map gives.

Van den Berg, Guy, Lin, Manocha 2011, for bases that are not holonomic by Alonso-Mora, Breitenmoser, Rufli, Beardsley, Siegwart 2013
("Optimal reciprocal collision avoidance for multiple non-holonomic robots"). No budget: a decision takes well under a millisecond.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from clearway.contract import Command, Diagnostics, Goal, Need, Observation, Status, Task
from clearway.crowds.outlines import outlines
from clearway.crowds.walls import walls_of
from clearway.geometry.shapes import circumscribed_radius
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.holonomic import follow
from clearway.navigators.common.inputs import finite, own
from clearway.navigators.common.motion import stop_and_turn
from clearway.navigators.common.route import Route, seen, with_others
from clearway.navigators.orca.decision import Rules, choose
from clearway.navigators.orca.parameters import Parameters
from clearway.robots import Robot
from clearway.tuning import TunedOn


class Orca:
    """Navigates by optimal reciprocal collision avoidance.

    Args:
        options: Any field of `Parameters`, which overrides the robot's file.

    Raises:
        ClearwayError: An option is wrong.
    """

    needs: ClassVar[frozenset[Need]] = frozenset({"map", "obstacles"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = ()

    def __init__(self, **options: Any) -> None:
        Parameters.read(None, **options)  # a wrong one is told at once
        self._options = options

    def read_parameters(self, robot: Robot) -> Parameters:
        """What it would drive `robot` with.

        Raises:
            ClearwayError: One of them is wrong, in the robot's file or among the options.
        """
        return Parameters.read(robot, **self._options)

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything. Nothing is drawn from `rng`."""
        self._parameters = p = self.read_parameters(robot)
        self._limits = limits = robot.limits(task.speed_limit)
        self._period, self._mapped = task.period, task.map is not None
        self._radius = circumscribed_radius(robot.planner_shape) + p.padding
        self._walls = walls_of([] if task.map is None else outlines(task.map))
        self._rules = Rules(
            p.distance, p.neighbours, p.horizon, p.wall_horizon, p.tracking_error, p.tracking_time,
            limits.v_max, limits.omega_max, task.period,
        )  # fmt: skip
        self._route = Route(task, self._radius, limits, p.ahead)
        self._goal: Goal | None = None
        self._approach = Approach(limits, task.period)
        self._shown = Diagnostics()

    def step(self, observation: Observation) -> Command:
        """Decide for one control period.

        Raises:
            ValueError: the pose, the velocity or the goal is not finite.
        """
        pose, velocity = finite("pose", observation.pose), finite("velocity", observation.velocity, 2)
        finite("goal.pose", observation.goal.pose)
        goal, limits = observation.goal, self._limits
        if goal is not self._goal:
            self._goal = goal
            self._approach.reset(goal)
        arrived = self._approach.reached(pose, velocity)
        if self._approach.stopping:
            v, omega = stop_and_turn(self._approach.turn, velocity[0], velocity[1], limits, self._period)
            return Command(v, omega, arrived=arrived, status=self._approach.status)
        others = seen(own(observation).obstacles, self._mapped)
        point, wish = self._route.wish(observation.t, pose, goal, others)
        bodies = with_others(pose, velocity, self._radius, others, self._parameters.share)
        vx, vy = choose(pose[2], wish[0], wish[1], bodies, self._walls, self._rules)
        v, omega = follow(vx, vy, pose[2], self._rules.tracking_time, limits.v_max, limits.omega_max)
        status = Status.TRACKING if wish.any() else Status.NO_PATH
        self._shown = Diagnostics(
            polylines={
                "plan": np.vstack((pose[:2], point)),
                "velocity": np.array((pose[:2], (pose[0] + vx, pose[1] + vy))),
            },
            circles={"obstacles": others.discs[:, (0, 1, 4)]},
            status=status,
        )
        return Command(v, omega, arrived=False, status=status)

    def diagnostics(self) -> Diagnostics:
        """Where it heads, the velocity that it follows, and the obstacles as it sees them."""
        return self._shown
