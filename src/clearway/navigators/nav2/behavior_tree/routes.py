"""Action nodes of servers that are started only for a tree that asks for them (nav2_behavior_tree/plugins/action)."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.behavior_tree.actions import ActionClient
from clearway.navigators.nav2.behavior_tree.nodes import IGNORED, RESULT, ROS, TEXT, TRUTH, VALUE, Node, Port, Ports
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


ROUTES: dict[str, type[Node]] = {kind.__name__: kind for kind in (SmoothPath,)}
