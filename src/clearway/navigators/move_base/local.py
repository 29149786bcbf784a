"""What the local planners share: their contract, and which stretch of the global plan they follow.

Frames: a global plan is kept in the frame that it was planned in (`map`, or `odom` where that is the global
frame); costmap, robot pose and the followed stretch are in the local costmap's frame (`odom`). The transform
between the two is given anew each cycle, as tf gives it in ROS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

CostArray = npt.NDArray[np.uint8]
IDENTITY: FloatArray = np.zeros(3)
"""The transform between two frames that coincide. Not to be written to."""


@dataclass(frozen=True, slots=True, eq=False)
class LocalResult:
    """What a local planner decided for one cycle.

    Attributes:
        v: m/s; omega: rad/s. Zero where `ok` is False.
        ok: False where no legal motion was found (`computeVelocityCommands` failing): the state machine recovers.
        arrived: the goal is reached (`isGoalReached`, asked before anything is computed); v and omega are then zero.
        trajectory: (k, 2) the chosen rollout, local frame; empty where there is none.
    """

    v: float
    omega: float
    ok: bool
    arrived: bool
    trajectory: FloatArray


class LocalPlanner(Protocol):
    """Turns a global plan and a local costmap into a velocity (`nav_core::BaseLocalPlanner`)."""

    def reset(self) -> None:
        """Forget everything: a new trial."""

    def set_plan(self, plan: FloatArray) -> None:
        """Follow `plan`, (n, 3) in the global frame; clears the latched goal tolerance."""

    def compute(
        self,
        pose: FloatArray,
        velocity: FloatArray,
        cost: CostArray,
        origin: FloatArray,
        resolution: float,
        speed_limit: float,
        plan_to_local: FloatArray = IDENTITY,
    ) -> LocalResult:
        """Decide for one cycle.

        Args:
            pose: (3,) the robot in the local costmap's frame. velocity: (2,) measured v [m/s], omega [rad/s].
            cost: (rows, cols) local costmap, C-contiguous; row r at y = origin[1] + r * resolution.
            origin: (2,) m. resolution: m. speed_limit: caps the planner's own forward limits, m/s.
            plan_to_local: (3,) pose of the plan's frame in the local frame.
        """


@kernel
def follow(
    plan: FloatArray,
    start: int,
    transform: FloatArray,
    pose: FloatArray,
    reach: float,
    prune: bool,
    out: FloatArray,
) -> tuple[int, int]:
    """The stretch of a plan that lies around the robot, and what of the plan is behind it for good.

    Takes the first run of points within `reach` of the robot, and one beyond; drops from the front what is
    further than 1 m away (`transformGlobalPlan` and `prunePlan` of base_local_planner/goal_functions.cpp).

    Args:
        plan: (n, 3) plan frame; points before `start` were pruned earlier. transform: (3,) plan frame -> local.
        pose: (3,) local frame. reach: m, half the longer edge of the local costmap. out: (>= n, 3) filled.

    Returns:
        Number of points in `out` (local frame), the new `start`.
    """
    n = plan.shape[0]
    c, s = math.cos(transform[2]), math.sin(transform[2])
    limit = reach * reach
    i = start
    squared = 0.0
    while i < n:
        x = transform[0] + c * plan[i, 0] - s * plan[i, 1]
        y = transform[1] + s * plan[i, 0] + c * plan[i, 1]
        squared = (pose[0] - x) ** 2 + (pose[1] - y) ** 2
        if squared <= limit:
            break
        i += 1
    count, dropped = 0, 0
    dropping = prune
    while i < n and squared <= limit:
        x = transform[0] + c * plan[i, 0] - s * plan[i, 1]
        y = transform[1] + s * plan[i, 0] + c * plan[i, 1]
        squared = (pose[0] - x) ** 2 + (pose[1] - y) ** 2
        i += 1
        if dropping and squared >= 1.0:
            dropped += 1
            continue
        dropping = False
        out[count, 0], out[count, 1], out[count, 2] = x, y, plan[i - 1, 2] + transform[2]
        count += 1
    return count, start + dropped


class Following:
    """A global plan being followed: keeps what was pruned, gives the stretch ahead and the goal in the local frame."""

    def __init__(self, *, prune: bool) -> None:
        self._prune = prune
        self.forget()

    def forget(self) -> None:
        """Follow nothing."""
        self._plan: FloatArray = np.empty((0, 3))
        self._ahead: FloatArray = np.empty((0, 3))
        self._start = 0

    def take(self, plan: FloatArray) -> None:
        """Follow `plan`, (n, 3) in its own frame, from its first point on."""
        self._plan = np.ascontiguousarray(plan, dtype=np.float64)
        self._start = 0
        if len(self._ahead) < len(self._plan):
            self._ahead = np.empty((2 * len(self._plan), 3))

    def ahead(self, pose: FloatArray, transform: FloatArray, reach: float) -> FloatArray:
        """(k, 3) the stretch to follow, local frame; empty where the robot strayed from the plan."""
        count, self._start = follow(self._plan, self._start, transform, pose, reach, self._prune, self._ahead)
        return self._ahead[:count]

    def goal(self, transform: FloatArray) -> FloatArray | None:
        """(3,) the plan's last pose in the local frame, None without a plan."""
        if not len(self._plan):
            return None
        x, y, yaw = self._plan[-1]
        c, s = math.cos(transform[2]), math.sin(transform[2])
        return np.array((transform[0] + c * x - s * y, transform[1] + s * x + c * y, yaw + transform[2]))
