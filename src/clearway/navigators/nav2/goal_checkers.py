"""Whether the goal is reached: Nav2's goal checkers, and their parameters.

Behaviour after nav2_controller/plugins/{simple,stopped,position}_goal_checker.cpp.
"""

from __future__ import annotations

import math

from pydantic import Field

from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.seams import GoalChecker, Tolerances, Velocity
from clearway.quantities import NonNegative


class PositionGoal(Group):
    """`nav2_controller::PositionGoalChecker` (nav2_controller/plugins/position_goal_checker.cpp)."""

    xy_goal_tolerance: NonNegative = Field(default=0.25, description="how far from the goal it is reached, m")
    xy_goal_tolerance_buffer: NonNegative = Field(
        default=0.0,
        description="beyond xy_goal_tolerance by so much a robot that was there is not there any more, m; 0: it stays there",
    )
    path_length_tolerance: NonNegative = Field(default=1.0, description="a path longer than this is not at its end, m")
    stateful: bool = Field(
        default=True, description="whether a robot that was within xy_goal_tolerance counts as there from then on"
    )


class SimpleGoal(PositionGoal):
    """`nav2_controller::SimpleGoalChecker` (nav2_controller/plugins/simple_goal_checker.cpp)."""

    yaw_goal_tolerance: NonNegative = Field(
        default=0.25, description="how far from the goal's heading it is reached, rad"
    )
    symmetric_yaw_tolerance: bool = Field(default=False, description="whether the opposite heading will do as well")


class StoppedGoal(SimpleGoal):
    """`nav2_controller::StoppedGoalChecker` (nav2_controller/plugins/stopped_goal_checker.cpp)."""

    rot_stopped_velocity: NonNegative = Field(default=0.25, description="turning no faster the robot stands, rad/s")
    trans_stopped_velocity: NonNegative = Field(default=0.25, description="moving no faster the robot stands, m/s")


class PositionGoalChecker:
    """`nav2_controller::PositionGoalChecker`, a `GoalChecker`: at the goal's place, with any heading."""

    def __init__(self, parameters: PositionGoal) -> None:
        self._parameters = parameters
        self._was_there = self._there = False

    def reset(self) -> None:
        """See `GoalChecker`."""
        self._was_there = self._there = False

    def tolerances(self) -> Tolerances:
        """See `GoalChecker`. No heading is too far off; Nav2 reports 0 for it."""
        return Tolerances(self._parameters.xy_goal_tolerance, 0.0, self._there)

    def reached(self, pose: FloatArray, goal: FloatArray, velocity: Velocity, left: float) -> bool:
        """See `GoalChecker`."""
        self._there = self._at_place(pose, goal, left)
        return self._there

    def _at_place(self, pose: FloatArray, goal: FloatArray, left: float) -> bool:
        p = self._parameters
        if left > p.path_length_tolerance:
            return False
        dx, dy = float(pose[0] - goal[0]), float(pose[1] - goal[1])
        squared = dx * dx + dy * dy
        if self._was_there:
            leave = p.xy_goal_tolerance + p.xy_goal_tolerance_buffer
            if p.xy_goal_tolerance_buffer > 0.0 and squared > leave * leave:
                self._was_there = False
            return self._was_there
        there = squared <= p.xy_goal_tolerance * p.xy_goal_tolerance
        self._was_there = there and p.stateful
        return there


class SimpleGoalChecker(PositionGoalChecker):
    """`nav2_controller::SimpleGoalChecker`, a `GoalChecker`: at the goal's place and turned to it."""

    def __init__(self, parameters: SimpleGoal) -> None:
        super().__init__(parameters)
        self._simple = parameters

    def tolerances(self) -> Tolerances:
        """See `GoalChecker`."""
        return Tolerances(self._simple.xy_goal_tolerance, self._simple.yaw_goal_tolerance, self._there)

    def reached(self, pose: FloatArray, goal: FloatArray, velocity: Velocity, left: float) -> bool:
        """See `GoalChecker`."""
        if not super().reached(pose, goal, velocity, left):
            return False
        off = abs(turn_between(float(pose[2]), float(goal[2])))
        if self._simple.symmetric_yaw_tolerance:
            off = min(off, math.pi - off)
        return off <= self._simple.yaw_goal_tolerance


class StoppedGoalChecker(SimpleGoalChecker):
    """`nav2_controller::StoppedGoalChecker`, a `GoalChecker`: at the goal's place, turned to it, and standing."""

    def __init__(self, parameters: StoppedGoal) -> None:
        super().__init__(parameters)
        self._stopped = parameters

    def reached(self, pose: FloatArray, goal: FloatArray, velocity: Velocity, left: float) -> bool:
        """See `GoalChecker`."""
        return (
            super().reached(pose, goal, velocity, left)
            and abs(velocity.omega) <= self._stopped.rot_stopped_velocity
            and math.hypot(velocity.v_x, velocity.v_y) <= self._stopped.trans_stopped_velocity
        )


def make_goal_checker(parameters: Group) -> GoalChecker:
    """The goal checker whose parameters these are.

    Raises:
        TypeError: they are those of something else.
    """
    if isinstance(parameters, StoppedGoal):
        return StoppedGoalChecker(parameters)
    if isinstance(parameters, SimpleGoal):
        return SimpleGoalChecker(parameters)
    if isinstance(parameters, PositionGoal):
        return PositionGoalChecker(parameters)
    raise TypeError(f"{type(parameters).__name__} is no group of a goal checker")
