"""What a behaviour tree asks of the rest of Nav2: where the robot is, and the servers whose clients its leaves are."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple, Protocol

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.parameters.outline import Points


class Error(IntEnum):
    """Error codes of Nav2's actions that occur here (nav2_msgs/action)."""

    NONE = 0
    GOAL_REJECTED = 1
    CONTROLLER_UNKNOWN = 100
    INVALID_CONTROLLER = 101
    INVALID_PATH = 103
    PATIENCE_EXCEEDED = 104
    FAILED_TO_MAKE_PROGRESS = 105
    NO_VALID_CONTROL = 106
    CONTROLLER_TIMED_OUT = 107
    PLANNER_UNKNOWN = 200
    INVALID_PLANNER = 201
    START_OUTSIDE_MAP = 203
    GOAL_OUTSIDE_MAP = 204
    START_OCCUPIED = 205
    GOAL_OCCUPIED = 206
    PLANNER_TIMEOUT = 207
    NO_VALID_PATH = 208
    THROUGH_UNKNOWN = 300
    THROUGH_INVALID_PLANNER = 301
    THROUGH_START_OUTSIDE_MAP = 303
    THROUGH_GOAL_OUTSIDE_MAP = 304
    THROUGH_START_OCCUPIED = 305
    THROUGH_GOAL_OCCUPIED = 306
    THROUGH_TIMEOUT = 307
    THROUGH_NO_VALID_PATH = 308
    NO_VIAPOINTS_GIVEN = 309
    ROUTE_UNKNOWN = 400
    ROUTE_TIMEOUT = 404
    NO_VALID_ROUTE = 405
    INVALID_EDGE_SCORER_USE = 407
    SMOOTHER_UNKNOWN = 500
    SMOOTHER_TIMEOUT = 502
    SMOOTHED_PATH_IN_COLLISION = 503
    FAILED_TO_SMOOTH_PATH = 504
    SPIN_TIMEOUT = 701
    SPIN_COLLISION_AHEAD = 703
    BACKUP_TIMEOUT = 711
    BACKUP_INVALID_INPUT = 713
    BACKUP_COLLISION_AHEAD = 714
    DRIVE_TIMEOUT = 721
    DRIVE_INVALID_INPUT = 723
    DRIVE_COLLISION_AHEAD = 724


class Tracking(NamedTuple):
    """How the robot follows its path (nav2_msgs/TrackingFeedback).

    Attributes:
        position: Its distance from the path, m; positive on the left.
        heading: Angle from its heading to the path's, rad.
    """

    position: float
    heading: float


class Job:
    """A goal that was sent to an action server, as its client sees it.

    Attributes:
        request: What was asked.
        running: Whether it has no result yet.
        succeeded: Whether it ended well; a cancelled one does, for the client.
        error: Why it did not.
        message: The same in words.
        result: What it gave: a path, of a planner.
        feedback: What it last told while it ran.
    """

    def __init__(self, request: Any) -> None:
        self.request = request
        self.running, self.succeeded = True, False
        self.error: Error = Error.NONE
        self.message = ""
        self.result: Any = None
        self.feedback: Any = None

    def succeed(self, result: Any = None) -> None:
        """It ended well."""
        self.running, self.succeeded, self.result = False, True, result

    def abort(self, error: Error, message: str) -> None:
        """It failed."""
        self.running, self.succeeded, self.error, self.message = False, False, error, message


class Validity(NamedTuple):
    """A request to the planner server's service is_path_valid (nav2_msgs/srv/IsPathValid).

    Attributes:
        path: (n, 3) poses in the map.
        max_cost: From which cost on a pose is invalid.
        unknown_is_obstacle: Whether unknown cells are lethal.
        layer: Name of the layer that is asked; empty: the whole costmap.
        lookahead: How far ahead is looked, m; not positive: to the end.
        first_only: Whether the first invalid pose ends the search.
        outline: Of the robot in base_link, m; empty: the costmap's.
    """

    path: FloatArray
    max_cost: int
    unknown_is_obstacle: bool
    layer: str
    lookahead: float
    first_only: bool
    outline: Points = ()


class Servers(Protocol):
    """What stands around a tree.

    Attributes:
        now: s.
        pose: (3,) of the robot in the map.
        velocity: (3,) measured v_x, v_y [m/s], omega [rad/s].
        speed: m/s, along and sideways, smoothed over `filter_duration`.
        goal_reached_tol: Distance to the goal up to which it counts as reached, m.
    """

    now: float
    pose: FloatArray
    velocity: FloatArray
    speed: float
    goal_reached_tol: float

    def send(self, action: str, request: Any) -> Job:
        """Send a goal to an action server; what it did for that client before it lets go."""

    def cancel(self, action: str) -> None:
        """Have an action server stop what it does."""

    def clear(self, costmap: str, layers: tuple[str, ...], reset_distance: float | None, *, around: bool) -> bool:
        """Clear the costmap `local_costmap` or `global_costmap`; whether it could.

        Args:
            costmap: Which one.
            layers: Those that are cleared; none: all that can be.
            reset_distance: Edge of a square around the robot, m; None: everything is cleared.
            around: Whether the square is cleared, and not what lies outside of it.
        """

    def invalid_poses(self, request: Validity) -> list[int] | None:
        """Indices of a path's poses that are no longer valid, None if it can't tell."""
