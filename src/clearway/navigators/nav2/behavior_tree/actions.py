"""Nav2's action nodes that ask a server something (nav2_behavior_tree/plugins/action), and the selectors of its plug-ins."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.behavior_tree.nodes import (
    IGNORED,
    NAMES,
    NUMBER,
    OUTLINE,
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
from clearway.navigators.nav2.behavior_tree.servers import Error, Job, Validity


class PlanRequest(NamedTuple):
    """A goal of the planner server (nav2_msgs/action/ComputePathToPose).

    Attributes:
        goal: (3,) in the map.
        start: (3,) in the map, or None: where the robot is.
        planner: Name of the plug-in; empty: the only one.
    """

    goal: FloatArray
    start: FloatArray | None
    planner: str


class ThroughRequest(NamedTuple):
    """A goal of the planner server (nav2_msgs/action/ComputePathThroughPoses).

    Attributes:
        goals: (n, 3) in the map, one after another.
        start: (3,) in the map, or None: where the robot is.
        planner: Name of the plug-in; empty: the only one.
    """

    goals: FloatArray
    start: FloatArray | None
    planner: str


class ThroughPath(NamedTuple):
    """What a planner server gives for that.

    Attributes:
        path: (n, 3) in the map.
        last_reached: Index of the goal at its end; -1: it leads through all.
    """

    path: FloatArray
    last_reached: int


class FollowRequest(NamedTuple):
    """A goal of the controller server (nav2_msgs/action/FollowPath). An empty name is the only plug-in's of its kind.

    Attributes:
        path: (n, 3) in the map.
        controller: Name of a controller.
        goal_checker: Name of a goal checker.
        progress_checker: Name of a progress checker.
        path_handler: Name of a path handler.
    """

    path: FloatArray
    controller: str
    goal_checker: str
    progress_checker: str
    path_handler: str


class MoveRequest(NamedTuple):
    """A goal of one of the behaviours that move (nav2_msgs/action/Spin, BackUp, DriveOnHeading), or of Wait.

    Attributes:
        amount: Angle to turn [rad], distance to go [m] or time to wait [s].
        speed: m/s, of those that go.
        allowance: s that it may take.
        blind: Whether nothing is checked for collisions.
    """

    amount: float
    speed: float = 0.0
    allowance: float = 0.0
    blind: bool = False


class ActionClient(Node):
    """Sends a goal when it is first asked and runs until its result is there (bt_action_node.hpp)."""

    ACTION: ClassVar[str]

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._job: Job | None = None

    def request(self) -> Any:
        """What is asked of the server."""
        raise NotImplementedError

    def follow_up(self, job: Job) -> Any:
        """What is asked of it instead while it runs; None: nothing."""
        return None

    def ended(self, job: Job) -> None:
        """It came to an end, or was aborted."""

    def tick(self) -> Status:
        if not self.active or self._job is None:
            self.status = Status.RUNNING
            self._job = self.servers.send(self.ACTION, self.request())
        job = self._job
        if job.running:
            changed = self.follow_up(job)
            if changed is not None:
                self._job = self.servers.send(self.ACTION, changed)
            return Status.RUNNING
        self._job = None
        self.ended(job)
        self.give("error_code_id", Error.NONE if job.succeeded else job.error)
        self.give("error_msg", "" if job.succeeded else job.message)
        return Status.SUCCESS if job.succeeded else Status.FAILURE

    def halt(self) -> None:
        if self._job is not None and self._job.running:
            self.servers.cancel(self.ACTION)
        self._job = None
        self.status = Status.IDLE


class ComputePathToPose(ActionClient):
    """Has a path planned (compute_path_to_pose_action.cpp)."""

    PORTS: ClassVar[Ports] = (
        {
            "goal": VALUE,
            "start": VALUE,
            "use_start": Port(TRUTH),
            "planner_id": Port(TEXT, ""),
            "path": VALUE,
            "viapoints": VALUE,
        }
        | RESULT
        | ROS
    )
    ACTION = "compute_path_to_pose"

    def request(self) -> PlanRequest:
        goal, start, use = self.value("goal"), self.value("start"), self.value("use_start")
        if goal is None:
            raise TreeError(f'ComputePathToPose {self.name!r} has no goal: write goal="{{goal}}"')
        return PlanRequest(goal, None if use is False else start, self.value("planner_id"))

    def ended(self, job: Job) -> None:
        self.give("path", job.result if job.succeeded and job.result is not None else EMPTY)

    def halt(self) -> None:
        self.give("path", EMPTY)
        super().halt()


class ComputePathThroughPoses(ActionClient):
    """Has a path planned through several goals (compute_path_through_poses_action.cpp)."""

    PORTS: ClassVar[Ports] = (
        {"goals": VALUE, "start": VALUE, "planner_id": Port(TEXT, ""), "path": VALUE, "last_reached_index": VALUE}
        | RESULT
        | ROS
    )
    ACTION = "compute_path_through_poses"

    def request(self) -> ThroughRequest:
        goals = self.value("goals")
        return ThroughRequest(EMPTY if goals is None else goals, self.value("start"), self.value("planner_id"))

    def ended(self, job: Job) -> None:
        self._give(job.result if job.succeeded and job.result is not None else ThroughPath(EMPTY, -1))

    def halt(self) -> None:
        self._give(ThroughPath(EMPTY, -1))
        super().halt()

    def _give(self, found: ThroughPath) -> None:
        self.give("path", found.path)
        self.give("last_reached_index", found.last_reached)


class FollowPath(ActionClient):
    """Has a path followed; a new one is handed on (follow_path_action.cpp)."""

    PORTS: ClassVar[Ports] = (
        {
            "path": VALUE,
            "controller_id": Port(TEXT, ""),
            "goal_checker_id": Port(TEXT, ""),
            "progress_checker_id": Port(TEXT, ""),
            "path_handler_id": Port(TEXT, ""),
            "tracking_feedback": VALUE,
        }
        | RESULT
        | ROS
    )
    ACTION = "follow_path"

    def request(self) -> FollowRequest:
        path = self.value("path")
        names = (
            self.value(f"{what}_id") for what in ("controller", "goal_checker", "progress_checker", "path_handler")
        )
        return FollowRequest(EMPTY if path is None else path, *names)

    def follow_up(self, job: Job) -> FollowRequest | None:
        if job.feedback is not None:
            self.give("tracking_feedback", job.feedback)
        old, new = job.request, self.request()
        if not len(new.path):
            new = new._replace(path=old.path)
        return new if new.path is not old.path or new[1:] != old[1:] else None

    def ended(self, job: Job) -> None:
        self.give("tracking_feedback", None)


_CHECKED = {"time_allowance": Port(NUMBER, 10.0), "disable_collision_checks": Port(TRUTH, False)} | RESULT | ROS


class Spin(ActionClient):
    """Turns on the spot (spin_action.cpp)."""

    PORTS: ClassVar[Ports] = {
        "spin_dist": Port(NUMBER, 1.57),
        "is_recovery": Port(TRUTH, True, ignored=True),
    } | _CHECKED
    ACTION = "spin"

    def request(self) -> MoveRequest:
        return MoveRequest(
            self.value("spin_dist"), 0.0, self.value("time_allowance"), self.value("disable_collision_checks")
        )


class Wait(ActionClient):
    """Waits (wait_action.cpp)."""

    PORTS: ClassVar[Ports] = {"wait_duration": Port(NUMBER, 1.0)} | RESULT | ROS
    ACTION = "wait"

    def request(self) -> MoveRequest:
        return MoveRequest(abs(self.value("wait_duration")))


class BackUp(ActionClient):
    """Goes straight back (back_up_action.cpp)."""

    PORTS: ClassVar[Ports] = {"backup_dist": Port(NUMBER, 0.15), "backup_speed": Port(NUMBER, 0.025)} | _CHECKED
    ACTION = "backup"

    def request(self) -> MoveRequest:
        return MoveRequest(
            self.value("backup_dist"),
            self.value("backup_speed"),
            self.value("time_allowance"),
            self.value("disable_collision_checks"),
        )


class DriveOnHeading(ActionClient):
    """Goes straight on (drive_on_heading_action.cpp)."""

    PORTS: ClassVar[Ports] = {"dist_to_travel": Port(NUMBER, 0.15), "speed": Port(NUMBER, 0.025)} | _CHECKED
    ACTION = "drive_on_heading"

    def request(self) -> MoveRequest:
        return MoveRequest(
            self.value("dist_to_travel"),
            self.value("speed"),
            self.value("time_allowance"),
            self.value("disable_collision_checks"),
        )


class _Cancel(Node):
    """Has a server stop what it does (bt_cancel_action_node.hpp)."""

    PORTS: ClassVar[Ports] = RESULT | ROS
    ACTION: ClassVar[str]

    def tick(self) -> Status:
        self.servers.cancel(self.ACTION)
        return Status.SUCCESS


class CancelControl(_Cancel):
    """Stops the controller server."""

    ACTION = "follow_path"


class CancelSpin(_Cancel):
    """Stops a turn."""

    ACTION = "spin"


class CancelBackUp(_Cancel):
    """Stops going back."""

    ACTION = "backup"


class CancelWait(_Cancel):
    """Stops waiting."""

    ACTION = "wait"


class CancelDriveOnHeading(_Cancel):
    """Stops going on."""

    ACTION = "drive_on_heading"


class ClearEntireCostmap(Node):
    """Clears a costmap (clear_costmap_service.cpp). Which one, its service's name tells."""

    PORTS: ClassVar[Ports] = {"service_name": Port(TEXT, ""), "plugins": Port(NAMES, ())} | ROS
    AROUND: ClassVar[bool] = False

    def tick(self) -> Status:
        costmap = "local_costmap" if "local_costmap" in self.value("service_name") else "global_costmap"
        distance = self.value("reset_distance") if "reset_distance" in self.PORTS else None
        cleared = self.servers.clear(costmap, self.value("plugins"), distance, around=self.AROUND)
        return Status.SUCCESS if cleared else Status.FAILURE


class ClearCostmapExceptRegion(ClearEntireCostmap):
    """Clears it but for a square around the robot."""

    PORTS: ClassVar[Ports] = ClearEntireCostmap.PORTS | {"reset_distance": Port(NUMBER, 1.0)}


class ClearCostmapAroundRobot(ClearCostmapExceptRegion):
    """Clears a square around the robot."""

    AROUND = True


class ValidatePath(Node):
    """Whether a path is still free (validate_path_action.cpp, nav2_planner/is_path_valid_service.hpp)."""

    PORTS: ClassVar[Ports] = {
        "path": VALUE,
        "max_cost": Port(WHOLE, 254),
        "consider_unknown_as_obstacle": Port(TRUTH, False),
        "layer_name": Port(TEXT, ""),
        "stop_at_first_collision": Port(TRUTH, True),
        "max_lookahead_distance": Port(NUMBER, -1.0),
        "footprint": Port(OUTLINE, ()),
        "service_name": IGNORED,
        "collision_poses": VALUE,
    } | ROS

    def tick(self) -> Status:
        path = self.value("path")
        if path is None or not len(path):
            return Status.FAILURE
        bad = self.servers.invalid_poses(
            Validity(
                path,
                self.value("max_cost"),
                self.value("consider_unknown_as_obstacle"),
                self.value("layer_name"),
                self.value("max_lookahead_distance"),
                self.value("stop_at_first_collision"),
                self.value("footprint"),
            )
        )
        if bad is None:
            return Status.FAILURE
        self.give("collision_poses", path[bad])
        return Status.FAILURE if bad else Status.SUCCESS


class _Selector(Node):
    """Gives the plug-in that is chosen: nobody publishes another, so always the default (controller_selector_node.cpp)."""

    WHAT: ClassVar[str]

    def tick(self) -> Status:
        chosen = self.value(f"default_{self.WHAT}")
        if not chosen:
            return Status.FAILURE
        self.give(f"selected_{self.WHAT}", chosen)
        return Status.SUCCESS


def _selector(name: str, what: str) -> type[Node]:
    ports = {f"default_{what}": Port(TEXT, ""), f"selected_{what}": VALUE, "topic_name": IGNORED}
    return type(name, (_Selector,), {"WHAT": what, "PORTS": ports, "__doc__": f"Gives the {what} that is chosen."})


ACTIONS: dict[str, type[Node]] = {
    kind.__name__: kind
    for kind in (
        ComputePathToPose,
        ComputePathThroughPoses,
        FollowPath,
        Spin,
        Wait,
        BackUp,
        DriveOnHeading,
        CancelControl,
        CancelSpin,
        CancelBackUp,
        CancelWait,
        CancelDriveOnHeading,
        ClearEntireCostmap,
        ClearCostmapExceptRegion,
        ClearCostmapAroundRobot,
        ValidatePath,
        _selector("ControllerSelector", "controller"),
        _selector("PlannerSelector", "planner"),
        _selector("GoalCheckerSelector", "goal_checker"),
        _selector("ProgressCheckerSelector", "progress_checker"),
        _selector("PathHandlerSelector", "path_handler"),
        _selector("SmootherSelector", "smoother"),
    )
}
