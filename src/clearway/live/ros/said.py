"""What passes between the simulated robot and a ROS stack, in no version's types. Stamps are whole nanoseconds of `/clock`."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from clearway.contract import Scan
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray

MAP, ODOM, BASE, LASER = "map", "odom", "base_link", "laser"
"""Names of the frames."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """What stays as it is during a trial.

    Attributes:
        stamp: When the trial begins, ns.
        start: (3,) where the robot is believed to stand, map frame: the initial pose.
        map: What is known of the floor; None: nothing.
    """

    stamp: int
    start: FloatArray
    map: OccupancyGrid | None


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What the robot says each control period.

    Attributes:
        stamp: When it was sensed, ns; `/clock` is set to it.
        odom_pose: (3,) dead-reckoned pose in the frame `odom`.
        velocity: (2,) v [m/s], omega [rad/s]; of an omnidirectional base (3,) with v_y [m/s] behind them.
        pose: (3,) estimated pose in the frame `map`; None: the stack localises itself.
        map_to_odom: (3,) the transform from `map` to `odom` that belongs to it; None: the same.
        scan: The lidar's sweep; None: there is none yet.
    """

    stamp: int
    odom_pose: FloatArray
    velocity: FloatArray
    pose: FloatArray | None
    map_to_odom: FloatArray | None
    scan: Scan | None


@dataclass(frozen=True, slots=True)
class Twist:
    """What somebody said on `/cmd_vel`, unchecked.

    Attributes:
        v: Forward speed, m/s.
        v_y: Speed to the left, m/s.
        omega: Yaw rate, rad/s.
        publisher: Who said it, for people; the same for the same one.
        frame: The frame that it names; empty: none.
        stamp: Its stamp, ns; None: it has none.
    """

    v: float
    v_y: float
    omega: float
    publisher: str
    frame: str = ""
    stamp: int | None = None


class GoalState(StrEnum):
    """How far the stack is with a goal."""

    SENT = "sent"
    ACCEPTED = "accepted"
    REJECTED = "rejected"
    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"


FINISHED = frozenset({GoalState.SUCCEEDED, GoalState.ABORTED, GoalState.CANCELED})
"""The states that a goal does not leave."""
