"""Action nodes of servers that are started only for a tree that asks for them (nav2_behavior_tree/plugins/action)."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.behavior_tree.actions import ActionClient
from clearway.navigators.nav2.behavior_tree.nodes import (
    IGNORED,
    RESULT,
    ROS,
    TEXT,
    TRUTH,
    VALUE,
    WHOLE,
    Node,
    Port,
    Ports,
    Status,
    TreeError,
)
from clearway.navigators.nav2.behavior_tree.paths import EMPTY
from clearway.navigators.nav2.behavior_tree.servers import Job


class SmoothRequest(NamedTuple):
    """A goal of the smoother server (nav2_msgs/action/SmoothPath).

    Attributes:
        path: (n, 3) in the map.
        smoother: Name of the plug-in; empty: the only one.
        checked: Whether a smoothed path that collides is refused.
    """

    path: FloatArray
    smoother: str
    checked: bool


class RouteRequest(NamedTuple):
    """A goal of the route server (nav2_msgs/action/ComputeRoute).

    Attributes:
        goal: (3,) in the map, None: nodes are given.
        start: (3,) in the map, or None: where the robot is.
        start_id: The first node, if nodes are given.
        goal_id: The last node, likewise.
    """

    goal: FloatArray | None
    start: FloatArray | None
    start_id: int
    goal_id: int


class Routed(NamedTuple):
    """What a route server gives for that.

    Attributes:
        nodes: (n, 2) places of its nodes in the map, m.
        path: (m, 3) in the map.
    """

    nodes: FloatArray
    path: FloatArray


class ComputeRoute(ActionClient):
    """Has a route planned (compute_route_action.cpp)."""

    PORTS: ClassVar[Ports] = (
        {
            "start_id": Port(WHOLE, 0),
            "goal_id": Port(WHOLE, 0),
            "start": VALUE,
            "goal": VALUE,
            "use_start": Port(TRUTH, False),
            "use_poses": Port(TRUTH, False),
            "route": VALUE,
            "path": VALUE,
            "planning_time": IGNORED,
        }
        | RESULT
        | ROS
    )
    ACTION = "compute_route"
    SERVER = "route_server"

    def request(self) -> RouteRequest:
        if not self.value("use_poses"):
            return RouteRequest(None, None, self.value("start_id"), self.value("goal_id"))
        goal = self.value("goal")
        if goal is None:
            raise TreeError(f'ComputeRoute {self.name!r} has no goal: write goal="{{goal}}"')
        start = self.value("start") if self.value("use_start") else None
        if start is None and self.value("use_start"):
            raise TreeError(f'ComputeRoute {self.name!r} has no start: write start="{{start}}", or leave use_start out')
        return RouteRequest(goal, start, 0, 0)

    def ended(self, job: Job) -> None:
        self._give(job.result if job.succeeded else None)

    def halt(self) -> None:
        self._give(None)
        super().halt()

    def _give(self, routed: Routed | None) -> None:
        self.give("route", routed)
        self.give("path", EMPTY if routed is None else routed.path)


class ExtractRouteNodesAsGoals(Node):
    """Gives a route's nodes as goals, their headings 0 (extract_route_nodes_as_goals_action.cpp)."""

    PORTS: ClassVar[Ports] = {"route": VALUE, "goals": VALUE}

    def tick(self) -> Status:
        route = self.value("route")
        if route is None:
            return Status.FAILURE
        self.give("goals", np.column_stack((route.nodes, np.zeros(len(route.nodes)))))
        return Status.SUCCESS


class SmoothPath(ActionClient):
    """Has a path smoothed (smooth_path_action.cpp)."""

    PORTS: ClassVar[Ports] = (
        {
            "unsmoothed_path": VALUE,
            "smoothed_path": VALUE,
            "smoother_id": Port(TEXT, ""),
            "check_for_collisions": Port(TRUTH, False),
            "max_smoothing_duration": IGNORED,
            "smoothing_duration": IGNORED,
            "was_completed": VALUE,
        }
        | RESULT
        | ROS
    )
    ACTION = "smooth_path"
    SERVER = "smoother_server"

    def request(self) -> SmoothRequest:
        path = self.value("unsmoothed_path")
        return SmoothRequest(
            EMPTY if path is None else path, self.value("smoother_id"), self.value("check_for_collisions")
        )

    def ended(self, job: Job) -> None:
        if job.succeeded:
            self.give("smoothed_path", job.result)
            self.give("was_completed", True)


ROUTES: dict[str, type[Node]] = {kind.__name__: kind for kind in (ComputeRoute, ExtractRouteNodesAsGoals, SmoothPath)}
