"""What Nav2's servers ask of their plug-ins: the seams inside this navigator (nav2_core's interfaces).

A controller is told everything in the local costmap's frame, a planner in the global costmap's.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame
from clearway.navigators.common.costmaps.layers import ByteGrid


class NoValidControl(Exception):
    """A controller found no command that it may give (nav2_core::NoValidControl); its text says why."""


class ControllerFailed(NoValidControl):
    """Following can't go on, and no patience helps (nav2_core::ControllerException, InvalidPath and their kin)."""


class NoPath(Exception):
    """A planner found no path (nav2_core::PlannerException and its kin); its text says why."""


class StartOccupied(NoPath):
    """There is none, as something stands where it is to begin (nav2_core::StartOccupied): no recovery is tried for that."""


class GoalOccupied(NoPath):
    """There is none, as something stands where it is to end (nav2_core::GoalOccupied): no recovery is tried for that."""


class Velocity(NamedTuple):
    """A velocity of the base.

    Attributes:
        v_x: Forwards, m/s.
        v_y: To the left, m/s.
        omega: Yaw rate, rad/s.
    """

    v_x: float
    v_y: float
    omega: float


class CostView(NamedTuple):
    """A costmap as a plug-in sees it.

    Attributes:
        cost: (rows, columns) uint8; 0 to 252 rising with nearness, 253 inscribed, 254 lethal, 255 unknown.
        origin: (2,) of its lower-left corner in its frame, m.
        resolution: Edge of a cell, m.
        footprint: (m, 2) the padded outline in base_link, m.
        inscribed: Largest radius about base_link inside the footprint, m.
        circumscribed: Least radius about base_link around the footprint, m.
        scaling: The inflation layer's cost_scaling_factor, 1/m; 0 without one.
        inflation: The inflation layer's radius, m; 0 without one.
        tracks_unknown: Whether unknown cells are told from free ones.
        circular: Whether the outline is a circle given by `robot_radius`, which Smac looks up at its centre (getUseRadius).
    """

    cost: ByteGrid
    origin: FloatArray
    resolution: float
    footprint: FloatArray
    inscribed: float
    circumscribed: float
    scaling: float
    inflation: float
    tracks_unknown: bool
    circular: bool = False

    @property
    def frame(self) -> Frame:
        """Where its cells are."""
        return Frame(float(self.origin[0]), float(self.origin[1]), self.resolution, *self.cost.shape)


class Tolerances(NamedTuple):
    """How near to its goal a goal checker wants the robot.

    Attributes:
        xy: m.
        yaw: rad.
        there: Whether it found the robot at the goal's place when it was last asked (isGoalXYReached), whatever its heading.
    """

    xy: float
    yaw: float
    there: bool = False


class Controller(Protocol):
    """Follows a path (nav2_core::Controller)."""

    @property
    def trajectory(self) -> FloatArray:
        """(k, 2) where the last command leads, in the local costmap's frame; empty if it can't tell."""

    def reset(self) -> None:
        """Forget everything: a new trial begins."""

    def set_plan(self, path: FloatArray) -> None:
        """A new path (n, 3) came, in the global costmap's frame."""

    def set_speed_limit(self, limit: float, percentage: bool) -> None:
        """Cap the speed at `limit` m/s, or per cent of the greatest; 0 takes the cap off."""

    def compute(
        self,
        now: float,
        pose: FloatArray,
        velocity: Velocity,
        path: FloatArray,
        goal: FloatArray,
        tolerances: Tolerances,
        view: CostView,
    ) -> Velocity:
        """The command for one control period.

        Args:
            now: s.
            pose: (3,) of the robot.
            velocity: As measured.
            path: (n, 3), n >= 1: the part of the path that the path handler hands on, behind the robot pruned away.
            goal: (3,) the whole path's last pose.
            tolerances: Of the goal checker.
            view: The local costmap.

        Raises:
            NoValidControl: it may give none.
            ControllerFailed: it will find none by being asked again.
        """


@runtime_checkable
class Stopping(Protocol):
    """What a controller has beside if it brings the robot to rest itself when it is cancelled (nav2_core::Controller::cancel)."""

    def cancel(self) -> bool:
        """Stop following, as from now on. Whether the robot rests; else `compute` is to be called on until this says so."""


class PathHandler(Protocol):
    """Keeps the path and hands the part near the robot on to controllers (nav2_core::PathHandler)."""

    def set_plan(self, path: FloatArray) -> None:
        """A new path (n, 3), n >= 1, came, in the global costmap's frame."""

    def local_plan(self, pose: FloatArray, frame: FloatArray, view: CostView) -> FloatArray:
        """The part (m, 3), m >= 1, of the path that is followed now, in the local costmap's frame; what lies behind is dropped.

        Args:
            pose: (3,) of the robot in the local costmap's frame.
            frame: (3,) pose of the global costmap's frame in the local one's.
            view: The local costmap.

        Raises:
            ControllerFailed: nothing of the path is on the local costmap.
        """


class Planner(Protocol):
    """Finds a path (nav2_core::GlobalPlanner)."""

    def reset(self) -> None:
        """Forget everything: a new trial begins."""

    def plan(self, start: FloatArray, goal: FloatArray, view: CostView) -> FloatArray:
        """A path (n, 3), n >= 1, from `start` (3,) to `goal` (3,).

        Raises:
            NoPath: there is none that it finds.
        """


class GoalChecker(Protocol):
    """Says whether the goal is reached (nav2_core::GoalChecker)."""

    def reset(self) -> None:
        """A new goal came."""

    def tolerances(self) -> Tolerances:
        """How near it wants the robot."""

    def reached(self, pose: FloatArray, goal: FloatArray, velocity: Velocity, left: float) -> bool:
        """Whether the robot is there.

        Args:
            pose: (3,).
            goal: (3,).
            velocity: As measured.
            left: Length of the path that is left, m.
        """


class ProgressChecker(Protocol):
    """Says whether the robot gets on (nav2_core::ProgressChecker)."""

    def reset(self) -> None:
        """Begin anew."""

    def check(self, now: float, pose: FloatArray) -> bool:
        """Whether it got far enough in the time that it is allowed, at `now` [s] with the robot at `pose` (3,)."""
