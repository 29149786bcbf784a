"""What navigators share that walk as a crowd does: the way that the map gives, a rule for the velocity, a base that follows it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, TypeVar

import numpy as np
from pydantic import Field

from clearway.contract import Command, Diagnostics, Need, Observation, Status, Task
from clearway.crowds.outlines import outlines
from clearway.crowds.walls import Walls, walls_of
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.navigators.common.ahead import Ahead
from clearway.navigators.common.arrival import Approach
from clearway.navigators.common.holonomic import follow, slide_along
from clearway.navigators.common.inputs import finite, own
from clearway.navigators.common.motion import braked, stop_and_turn
from clearway.navigators.common.parametrised import Parametrised
from clearway.navigators.common.route import Route, Seen, later, seen
from clearway.quantities import NonNegative, Positive
from clearway.robots import DriveKind, DriveLimits, Robot, RobotTable, possible
from clearway.tuning import TunedOn


class CrowdParameters(RobotTable):
    """The parameters that all of them have."""

    padding: NonNegative = Field(default=0.02, description="kept beyond the robot's radius, m")
    tracking_time: Positive = Field(
        default=0.5, description="in which the base turns to the velocity that it follows, s: ORCA's T"
    )
    ahead: Positive = Field(default=2.0, description="how far along its way it heads, m")
    turns: bool = Field(
        default=True, description="whether a base that moves to its sides as well turns to where it wants to go"
    )


_P = TypeVar("_P", bound=CrowdParameters)


class CrowdNavigator(ABC, Parametrised[_P]):
    """Drives by the velocity that `_velocity` chooses.

    Args:
        options: Any field of its parameters, which overrides the robot's file.

    Raises:
        ClearwayError: An option is wrong.
    """

    needs: ClassVar[frozenset[Need]] = frozenset({"map", "obstacles"})
    drives: ClassVar[frozenset[DriveKind]] = frozenset({"differential", "omnidirectional"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = ()

    @abstractmethod
    def _prepare(self, limits: DriveLimits, period: float) -> None:
        """Prepare for a trial with a base of `limits`, decided for each `period` [s]."""

    @abstractmethod
    def _velocity(
        self, pose: FloatArray, velocity: FloatArray, others: Seen, wish: FloatArray
    ) -> tuple[float, float]:  # fmt: skip
        """The velocity (m/s) to follow.

        Args:
            pose: (3,) of the robot.
            velocity: (2,) v [m/s] and omega [rad/s], or (3,) with v_y [m/s].
            others: What is perceived.
            wish: (2,) the velocity that it would drive at alone, m/s.
        """

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Forget everything. Nothing is drawn from `rng`."""
        p = self._parameters = self.read_parameters(robot)
        self._limits = robot.limits(task.speed_limit)
        self._components = 3 if self._limits.kind == "omnidirectional" else 2
        self._period, self._mapped = task.period, task.map is not None
        self._radius = circumscribed_radius(robot.planner_shape) + p.padding
        self._walls: Walls = walls_of([] if task.map is None else outlines(task.map))
        self._route = Route(task, self._radius, self._limits, p.ahead)
        self._approach = Approach(self._limits, task.period)
        self._ahead = Ahead(task.latency, self._limits)
        self._shown = Diagnostics()
        self._prepare(self._limits, task.period)

    def step(self, observation: Observation) -> Command:
        """Decide for one control period, for the time at which the command is followed.

        Raises:
            ValueError: the pose, the velocity or the goal is not finite.
        """
        pose, velocity = finite("pose", observation.pose), finite("velocity", observation.velocity, self._components)
        finite("goal.pose", observation.goal.pose)
        pose, velocity = self._ahead.state(observation.t, pose, velocity)
        command = self._decide(observation, pose, velocity)
        self._ahead.decided(observation.t, velocity[:2], command.v, command.omega)
        return command

    def _decide(self, observation: Observation, pose: FloatArray, velocity: FloatArray) -> Command:
        """The command for a robot at `pose` with `velocity` when it follows it."""
        goal, limits = observation.goal, self._limits
        self._approach.set_out(goal)
        arrived = self._approach.reached(pose, velocity)
        if self._approach.stopping:
            v, omega = stop_and_turn(self._approach.turn, velocity[0], velocity[1], limits, self._period)
            v_y = 0.0
            if self._components > 2:
                v_y = braked(velocity[2], limits.lateral_deceleration, self._period)
                v, omega, v_y = possible(limits, v, omega, v_y)
            return Command(v, omega, arrived=arrived, status=self._approach.status, v_y=v_y)
        others = later(seen(own(observation).obstacles, self._mapped), self._ahead.time)
        point, wish = self._route.wish(observation.t, pose, goal, others)
        vx, vy = self._velocity(pose, velocity, others, wish)
        v_y, time = 0.0, self._parameters.tracking_time
        if self._components > 2:
            v, omega, v_y = slide_along(vx, vy, pose, wish if self._parameters.turns else np.zeros(2), time, limits)
        else:
            v, omega = follow(vx, vy, pose[2], time, limits.v_max, limits.omega_max)
        status = Status.TRACKING if wish.any() else Status.NO_PATH
        self._shown = Diagnostics(
            polylines={
                "plan": np.vstack((pose[:2], point)),
                "velocity": np.array((pose[:2], (pose[0] + vx, pose[1] + vy))),
            },
            circles={"obstacles": others.discs[:, (0, 1, 4)]},
            status=status,
        )
        return Command(v, omega, arrived=False, status=status, v_y=v_y)

    def diagnostics(self) -> Diagnostics:
        """Where it heads, the velocity that it follows, and the obstacles as it sees them."""
        return self._shown
