"""The navigator `social-force`: what drives and pushes a pedestrian, on a robot, on the way that the map gives.

Helbing, Molnár 1995 in the form of Moussaïd et al. 2009, 2010 (`clearway.crowds.social_force`). What moves acts as another
pedestrian does, what stands as a wall does. The base follows the velocity at which drive and forces are even.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from clearway.contract import Command, Diagnostics, Goal, Need, Observation, Status, Task
from clearway.crowds.bodies import Wishes
from clearway.crowds.outlines import outlines
from clearway.crowds.social_force import forces
from clearway.crowds.walls import walls_of
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.holonomic import follow
from clearway.navigators.common.inputs import finite, own
from clearway.navigators.common.motion import stop_and_turn
from clearway.navigators.common.route import Route, Seen, seen, with_others
from clearway.navigators.social_force.parameters import Parameters
from clearway.robots import Robot
from clearway.tuning import TunedOn


class SocialForceNavigator:
    """Navigates by the social force model.

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
        p = self.read_parameters(robot)
        self._model, self._tracking_time = p.model(), p.tracking_time
        self._limits = robot.limits(task.speed_limit)
        self._period, self._mapped = task.period, task.map is not None
        self._radius = circumscribed_radius(robot.planner_shape) + p.padding
        self._walls = walls_of([] if task.map is None else outlines(task.map))
        self._route = Route(task, self._radius, self._limits, p.ahead)
        self._goal: Goal | None = None
        self._approach = Approach(self._limits, task.period)
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
        force = self._force(pose, velocity, others, wish)
        vx, vy = wish + self._model.relaxation * force
        speed = math.hypot(vx, vy)
        if speed > limits.v_max:
            vx, vy = vx * limits.v_max / speed, vy * limits.v_max / speed
        v, omega = follow(vx, vy, pose[2], self._tracking_time, limits.v_max, limits.omega_max)
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

    def _force(self, pose: FloatArray, velocity: FloatArray, others: Seen, wish: FloatArray) -> FloatArray:
        """What acts on the robot, m/s^2."""
        moving = Seen(others.discs[others.moving], others.moving[others.moving])
        bodies = with_others(pose, velocity, self._radius, moving, 1.0)
        wishes = Wishes(np.zeros(1, np.int64), wish[None], np.full(1, self._limits.v_max), np.ones(1, np.int64))
        force = forces(bodies, wishes, np.full(len(bodies.radius), -1), self._model, self._walls)[0]
        standing = others.discs[~others.moving]
        if len(standing):
            nearest = standing[np.argmin(np.hypot(*(standing[:, :2] - pose[:2]).T) - standing[:, 4])]
            away = pose[:2] - nearest[:2]
            centres = max(float(np.hypot(*away)), 1e-9)
            gap = min(max(centres - nearest[4] - self._radius, -0.2), 10.0)
            force = force + self._model.wall_strength * math.exp(-gap / self._model.wall_span) * away / centres
        return np.asarray(force)
