"""Nav2's condition nodes (nav2_behavior_tree/plugins/condition)."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.behavior_tree.nodes import IGNORED, NUMBER, VALUE, WHOLES, Node, Port, Ports, Status
from clearway.navigators.nav2.behavior_tree.paths import Pruned, length
from clearway.navigators.nav2.behavior_tree.servers import Error

_FRAMES = {"global_frame": IGNORED, "robot_base_frame": IGNORED}


def _said(truth: bool) -> Status:
    return Status.SUCCESS if truth else Status.FAILURE


class GoalUpdated(Node):
    """Whether another goal came since it was asked before; never the first time (goal_updated_condition.cpp)."""

    PORTS: ClassVar[Ports] = {"goals": VALUE, "goal": VALUE}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._goal: Any = None

    def tick(self) -> Status:
        goal = self.value_or_shared("goal")
        updated = self.active and goal is not self._goal
        self._goal = goal
        return _said(updated)


class GlobalUpdatedGoal(Node):
    """Whether another goal came since it was asked before, however long ago; the first time too
    (globally_updated_goal_condition.cpp)."""

    PORTS: ClassVar[Ports] = {"goals": VALUE, "goal": VALUE}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._goal: Any = None
        self._first = True

    def tick(self) -> Status:
        goal = self.value_or_shared("goal")
        updated = self._first or goal is not self._goal
        self._first, self._goal = False, goal
        return _said(updated)


class GoalReached(Node):
    """Whether the robot is within `goal_reached_tol` of the goal (goal_reached_condition.cpp)."""

    PORTS: ClassVar[Ports] = {"goal": VALUE, "robot_base_frame": IGNORED}

    def tick(self) -> Status:
        goal, pose = self.value("goal"), self.servers.pose
        near = abs(self.servers.goal_reached_tol)
        return _said(goal is not None and math.hypot(goal[0] - pose[0], goal[1] - pose[1]) <= near)


class ArePosesNear(Node):
    """Whether two poses are near each other (are_poses_near_condition.cpp)."""

    PORTS: ClassVar[Ports] = {
        "ref_pose": VALUE,
        "target_pose": VALUE,
        "tolerance": Port(NUMBER, 0.5),
        "global_frame": IGNORED,
    }

    def tick(self) -> Status:
        one, other = self.value("ref_pose"), self.value("target_pose")
        if one is None or other is None:
            return Status.FAILURE
        return _said(math.hypot(one[0] - other[0], one[1] - other[1]) <= abs(self.value("tolerance")))


class IsGoalNearby(Node):
    """Whether what is left of the path is short (is_goal_nearby_condition.cpp)."""

    PORTS: ClassVar[Ports] = {
        "path": VALUE,
        "proximity_threshold": Port(NUMBER, 1.0),
        "max_robot_pose_search_dist": Port(NUMBER, -1.0),
    } | _FRAMES

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._where = Pruned()

    def tick(self) -> Status:
        path = self.value("path")
        if path is None or not len(path):
            return Status.FAILURE
        at = self._where.index(path, self.servers.pose, self.value("max_robot_pose_search_dist"))
        return _said(length(path, at) < self.value("proximity_threshold"))


class PathExpiringTimer(Node):
    """Whether the path is so old (path_expiring_timer_condition.cpp)."""

    PORTS: ClassVar[Ports] = {"seconds": Port(NUMBER, 1.0), "path": VALUE}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._path: FloatArray | None = None
        self._start: float | None = None

    def tick(self) -> Status:
        now, path = self.servers.now, self.value("path")
        if self._start is None or path is not self._path:
            first, self._start, self._path = self._start is None, now, path
            if first:
                return Status.FAILURE
        if now - self._start < self.value("seconds") - 1e-6:
            return Status.FAILURE
        self._start = now
        return Status.SUCCESS


class TimeExpired(Node):
    """Whether so much time went by since it was asked first, or since it said so (time_expired_condition.cpp)."""

    PORTS: ClassVar[Ports] = {"seconds": Port(NUMBER, 1.0)}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._start = 0.0

    def tick(self) -> Status:
        now = self.servers.now
        if self.active and now - self._start >= self.value("seconds") - 1e-6:
            self._start = now
            return Status.SUCCESS
        if not self.active:
            self._start = now
        return Status.FAILURE


class DistanceTraveled(Node):
    """Whether the robot went so far since it was asked first, or since it said so (distance_traveled_condition.cpp)."""

    PORTS: ClassVar[Ports] = {"distance": Port(NUMBER, 1.0)} | _FRAMES

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._start: FloatArray | None = None

    def tick(self) -> Status:
        pose = self.servers.pose
        if not self.active or self._start is None:
            self._start = pose
            return Status.FAILURE
        if math.hypot(pose[0] - self._start[0], pose[1] - self._start[1]) < self.value("distance"):
            return Status.FAILURE
        self._start = pose
        return Status.SUCCESS


class IsWithinPathTrackingBounds(Node):
    """Whether the robot is near enough to its path (is_within_path_tracking_bounds_condition.cpp)."""

    PORTS: ClassVar[Ports] = {
        "max_error_left": Port(NUMBER, 0.5),
        "max_error_right": Port(NUMBER, 0.5),
        "max_error_heading": Port(NUMBER, 3.14),
        "tracking_feedback": VALUE,
    }

    def tick(self) -> Status:
        tracked = self.value("tracking_feedback")
        if tracked is None:
            return Status.SUCCESS
        side = abs(self.value("max_error_left" if tracked.position >= 0.0 else "max_error_right"))
        ahead = abs(self.value("max_error_heading"))
        return _said(abs(tracked.position) <= side and abs(tracked.heading) <= ahead)


class AreErrorCodesPresent(Node):
    """Whether an error code is one of some (are_error_codes_present_condition.hpp)."""

    PORTS: ClassVar[Ports] = {"error_code": VALUE, "error_codes_to_check": Port(WHOLES, ())}
    CODES: ClassVar[frozenset[int]] = frozenset()

    def tick(self) -> Status:
        return _said(self.value("error_code") in (self.CODES or self.value("error_codes_to_check")))


class WouldAControllerRecoveryHelp(AreErrorCodesPresent):
    """Whether the controller's error is one that recovery may cure, whatever `error_codes_to_check` says."""

    CODES = frozenset(
        {
            Error.CONTROLLER_UNKNOWN,
            Error.PATIENCE_EXCEEDED,
            Error.FAILED_TO_MAKE_PROGRESS,
            Error.NO_VALID_CONTROL,
        }
    )


class WouldAPlannerRecoveryHelp(AreErrorCodesPresent):
    """Whether the planner's error is one that recovery may cure, whatever `error_codes_to_check` says."""

    CODES = frozenset(
        {
            Error.PLANNER_UNKNOWN,
            Error.NO_VALID_PATH,
            Error.PLANNER_TIMEOUT,
            Error.THROUGH_UNKNOWN,
            Error.THROUGH_NO_VALID_PATH,
            Error.THROUGH_TIMEOUT,
        }
    )


class WouldARouteRecoveryHelp(AreErrorCodesPresent):
    """Whether the route server's error is one that recovery may cure, whatever `error_codes_to_check` says."""

    CODES = frozenset({Error.ROUTE_UNKNOWN, Error.NO_VALID_ROUTE, Error.ROUTE_TIMEOUT})


class WouldASmootherRecoveryHelp(AreErrorCodesPresent):
    """Whether the smoother's error is one that recovery may cure, whatever `error_codes_to_check` says."""

    CODES = frozenset(
        {
            Error.SMOOTHER_UNKNOWN,
            Error.SMOOTHER_TIMEOUT,
            Error.FAILED_TO_SMOOTH_PATH,
            Error.SMOOTHED_PATH_IN_COLLISION,
        }
    )


CONDITIONS: dict[str, type[Node]] = {
    kind.__name__: kind
    for kind in (
        GoalUpdated,
        GlobalUpdatedGoal,
        GoalReached,
        ArePosesNear,
        IsGoalNearby,
        PathExpiringTimer,
        TimeExpired,
        DistanceTraveled,
        IsWithinPathTrackingBounds,
        AreErrorCodesPresent,
        WouldAControllerRecoveryHelp,
        WouldAPlannerRecoveryHelp,
        WouldARouteRecoveryHelp,
        WouldASmootherRecoveryHelp,
    )
}
