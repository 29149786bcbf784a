"""What move_base asks of a local planner (nav_core's BaseLocalPlanner): the one seam inside this navigator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from clearway.geometry.shapes import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class LocalResult:
    """A local planner's answer.

    Attributes:
        v: Forward speed, m/s.
        omega: Yaw rate, rad/s.
        ok: Whether a valid command was found (else move_base stops and replans).
        trajectory: (k, 2) where the command leads, odom frame; empty while it stops or turns at the goal.
        v_y: Speed to the left, m/s.
    """

    v: float
    omega: float
    ok: bool
    trajectory: FloatArray
    v_y: float = 0.0


class LocalPlanner(Protocol):
    """Follows the plan through the local costmap. Made by `clearway.navigators.move_base.planners.make_local_planner`."""

    @property
    def prune_plan(self) -> bool:
        """Whether the plan behind the robot is to be forgotten (`prune_plan`)."""

    def reset(self) -> None:
        """Forget everything: a new trial begins."""

    def set_plan(self) -> None:
        """A new global plan came: drop the latches that ROS's setPlan drops."""

    def goal_reached(self, pose: FloatArray, velocity: FloatArray, goal: FloatArray) -> bool:
        """nav_core's isGoalReached, asked before `compute` in each control period.

        Args:
            pose: (3,) odom frame.
            velocity: (2,) v, omega, or (3,) with v_y.
            goal: (3,) the whole plan's last pose, odom frame.
        """

    def compute(
        self,
        pose: FloatArray,
        velocity: FloatArray,
        plan: FloatArray,
        goal: FloatArray,
        cost: npt.NDArray[np.uint8],
        origin: FloatArray,
        resolution: float,
        speed_limit: float,
    ) -> LocalResult:
        """nav_core's computeVelocityCommands.

        Args:
            pose: (3,) odom frame.
            velocity: (2,) measured v [m/s], omega [rad/s], or (3,) with v_y [m/s].
            plan: (n, 3), n >= 1: the part of the global plan inside the local costmap's reach, pruned, moved into the
                odom frame (base_local_planner::transformGlobalPlan and prunePlan).
            goal: (3,) the whole plan's last pose, odom frame.
            cost: (rows, cols) uint8 local costmap.
            origin: (2,) of its lower-left corner, odom frame, m.
            resolution: Edge of a cell, m.
            speed_limit: Caps the forward speed, m/s.
        """
