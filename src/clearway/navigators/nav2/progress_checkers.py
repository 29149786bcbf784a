"""Whether the robot gets on: Nav2's progress checkers, and their parameters.

Behaviour after nav2_controller/plugins/{simple,pose}_progress_checker.cpp.
"""

from __future__ import annotations

import math

from pydantic import Field

from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.seams import ProgressChecker
from clearway.quantities import NonNegative


class SimpleProgress(Group):
    """`nav2_controller::SimpleProgressChecker` (nav2_controller/plugins/simple_progress_checker.cpp)."""

    required_movement_radius: NonNegative = Field(default=0.5, description="how far the robot has to get, m")
    movement_time_allowance: NonNegative = Field(default=10.0, description="in what time it has to, s")


class PoseProgress(SimpleProgress):
    """`nav2_controller::PoseProgressChecker` (nav2_controller/plugins/pose_progress_checker.cpp)."""

    required_movement_angle: NonNegative = Field(default=0.5, description="turning so far will do as well, rad")


class SimpleProgressChecker:
    """`nav2_controller::SimpleProgressChecker`, a `ProgressChecker`: by the distance from where it last got on.

    With the parameters of `nav2_controller::PoseProgressChecker` it is that one: turning counts as well.
    """

    def __init__(self, parameters: SimpleProgress) -> None:
        self._parameters = parameters
        self._angle = parameters.required_movement_angle if isinstance(parameters, PoseProgress) else math.inf
        self._from: tuple[float, float, float] | None = None
        self._since = 0.0

    def reset(self) -> None:
        """See `ProgressChecker`."""
        self._from = None

    def check(self, now: float, pose: FloatArray) -> bool:
        """See `ProgressChecker`."""
        x, y, yaw = map(float, pose)
        if self._from is None or self._got_on(self._from, x, y, yaw):
            self._from, self._since = (x, y, yaw), now
            return True
        return now - self._since <= self._parameters.movement_time_allowance

    def _got_on(self, begin: tuple[float, float, float], x: float, y: float, yaw: float) -> bool:
        far = math.hypot(x - begin[0], y - begin[1]) > self._parameters.required_movement_radius
        return far or abs(turn_between(yaw, begin[2])) > self._angle


def make_progress_checker(parameters: Group) -> ProgressChecker:
    """The progress checker whose parameters these are.

    Raises:
        TypeError: they are those of something else.
    """
    if isinstance(parameters, SimpleProgress):
        return SimpleProgressChecker(parameters)
    raise TypeError(f"{type(parameters).__name__} is no group of a progress checker")
