"""Nav2's small action nodes about poses, paths and lists of goals (nav2_behavior_tree/plugins/action).

A list of goals is (n, 3) on the blackboard, as a path is.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from clearway.navigators.nav2.behavior_tree.nodes import (
    IGNORED,
    NUMBER,
    VALUE,
    WHOLE,
    Node,
    Port,
    Ports,
    Status,
    TreeError,
)
from clearway.navigators.nav2.behavior_tree.paths import EMPTY, Pruned, first_after


class GetCurrentPose(Node):
    """Gives the robot's pose (get_current_pose_action.cpp)."""

    PORTS: ClassVar[Ports] = {"global_frame": IGNORED, "robot_base_frame": IGNORED, "current_pose": VALUE}

    def tick(self) -> Status:
        self.give("current_pose", self.servers.pose)
        return Status.SUCCESS


class GetPoseFromPath(Node):
    """Gives a pose of a path, from its end where the index is negative (get_pose_from_path_action.cpp)."""

    PORTS: ClassVar[Ports] = {"path": VALUE, "pose": VALUE, "index": Port(WHOLE, 0)}

    def tick(self) -> Status:
        path, index = self.value("path"), self.value("index")
        if path is None or not -len(path) <= index < len(path):
            return Status.FAILURE
        self.give("pose", path[index])
        return Status.SUCCESS


class ConcatenatePaths(Node):
    """Gives two paths as one (concatenate_paths_action.cpp)."""

    PORTS: ClassVar[Ports] = {"input_path1": VALUE, "input_path2": VALUE, "output_path": VALUE}

    def tick(self) -> Status:
        paths = [EMPTY if path is None else path for path in (self.value("input_path1"), self.value("input_path2"))]
        joined = np.concatenate(paths)
        if not len(joined):
            return Status.FAILURE
        self.give("output_path", joined)
        return Status.SUCCESS


class TruncatePathLocal(Node):
    """The part of a path around the robot (truncate_path_local_action.cpp)."""

    PORTS: ClassVar[Ports] = {
        "input_path": VALUE,
        "output_path": VALUE,
        "distance_forward": Port(NUMBER, 8.0),
        "distance_backward": Port(NUMBER, 4.0),
        "robot_base_frame": IGNORED,
        "transform_tolerance": IGNORED,
        "pose": VALUE,
        "angular_distance_weight": Port(NUMBER, 0.0),
        "max_robot_pose_search_dist": Port(NUMBER, math.inf),
    }

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._where = Pruned()

    def tick(self) -> Status:
        path = self.value("input_path")
        if path is None or not len(path):
            self.give("output_path", EMPTY)
            return Status.SUCCESS
        pose = self.value("pose")
        weight, search = self.value("angular_distance_weight"), self.value("max_robot_pose_search_dist")
        at = self._where.index(path, self.servers.pose if pose is None else pose, search, weight)
        ahead, behind = self.value("distance_forward"), self.value("distance_backward")
        end = first_after(path, at, math.inf if ahead < 0.0 else ahead)
        begin = at + 1 - first_after(path[at::-1], 0, behind)
        self.give("output_path", path[begin:end])
        return Status.SUCCESS


class TruncatePath(Node):
    """A path without its last stretch (truncate_path_action.cpp)."""

    PORTS: ClassVar[Ports] = {"input_path": VALUE, "output_path": VALUE, "distance": Port(NUMBER, 1.0)}

    def tick(self) -> Status:
        path = self.value("input_path")
        if path is None or not len(path):
            self.give("output_path", EMPTY)
            return Status.SUCCESS
        last, n = path[-1], len(path)
        while n > 2 and math.hypot(*(path[n - 1, :2] - last[:2])) < self.value("distance"):
            n -= 1
        cut = np.array(path[:n])
        cut[-1, 2] = math.atan2(last[1] - cut[-1, 1], last[0] - cut[-1, 0])
        self.give("output_path", cut)
        return Status.SUCCESS


class AppendGoalPoseToGoals(Node):
    """Gives goals with one more at their end (append_goal_pose_to_goals_action.cpp)."""

    PORTS: ClassVar[Ports] = {"goal_pose": VALUE, "input_goals": VALUE, "output_goals": VALUE}

    def tick(self) -> Status:
        goals, goal = self.value("input_goals"), self.value("goal_pose")
        if goal is None:
            raise TreeError(f'AppendGoalPoseToGoals {self.name!r} has no goal: write goal_pose="{{goal}}"')
        self.give("output_goals", np.vstack((EMPTY if goals is None else goals, goal)))
        return Status.SUCCESS


class RemovePassedGoals(Node):
    """Gives goals without the first ones that the robot is near, but always the last (remove_passed_goals_action.cpp)."""

    PORTS: ClassVar[Ports] = {
        "input_goals": VALUE,
        "output_goals": VALUE,
        "radius": Port(NUMBER, 0.5),
        "robot_base_frame": IGNORED,
        "input_waypoint_statuses": IGNORED,
        "output_waypoint_statuses": IGNORED,
    }

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._radius = 0.0

    def tick(self) -> Status:
        if not self.active:
            self._radius = self.value("radius")
        goals, pose = self.value("input_goals"), self.servers.pose
        goals = EMPTY if goals is None else goals
        while len(goals) > 1 and math.hypot(goals[0, 0] - pose[0], goals[0, 1] - pose[1]) <= self._radius:
            goals = goals[1:]
        self.give("output_goals", goals)
        return Status.SUCCESS


class GetNextFewGoals(Node):
    """Gives the first of some goals (get_next_few_goals_action.cpp)."""

    PORTS: ClassVar[Ports] = {"input_goals": VALUE, "num_goals": Port(WHOLE), "output_goals": VALUE}

    @classmethod
    def wrong(cls, given: dict[str, Any]) -> str:
        count = given.get("num_goals")
        if count is None:
            return 'num_goals is missing; write how many, such as num_goals="2"'
        return f"num_goals is {count}; it is to be 1 or more" if isinstance(count, int) and count < 1 else ""

    def tick(self) -> Status:
        goals = self.value("input_goals")
        if goals is None or not len(goals):
            return Status.FAILURE
        self.give("output_goals", goals[: self.value("num_goals")])
        return Status.SUCCESS


POSES: dict[str, type[Node]] = {
    kind.__name__: kind
    for kind in (
        GetCurrentPose,
        GetPoseFromPath,
        ConcatenatePaths,
        TruncatePathLocal,
        TruncatePath,
        AppendGoalPoseToGoals,
        RemovePassedGoals,
        GetNextFewGoals,
    )
}
