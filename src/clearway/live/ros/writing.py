"""What the robot says, in the messages of a version of ROS. Both versions have the same fields in the same order, but for a header's."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from clearway.contract import Scan
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import BASE, LASER, MAP, ODOM, Moment

_UNKNOWN = np.zeros(36)
_INITIAL = np.diag([0.25, 0.25, 0.0, 0.0, 0.0, 0.0685])
"""m², rad²: half a metre and 15 degrees, as RViz sends it with an initial pose."""
_INITIAL_COVARIANCE = _INITIAL.ravel()


class Writing:
    """Makes messages.

    Args:
        message: Who makes those of a type, such as `geometry_msgs/msg/Twist`; each field that it isn't given is zero or empty.
    """

    def __init__(self, message: Callable[[str], Callable[..., Any]]) -> None:
        self._time, self._clock = message("builtin_interfaces/msg/Time"), message("rosgraph_msgs/msg/Clock")
        self._header = message("std_msgs/msg/Header")
        self._point, self._turn_of = message("geometry_msgs/msg/Point"), message("geometry_msgs/msg/Quaternion")
        self._vector, self._pose = message("geometry_msgs/msg/Vector3"), message("geometry_msgs/msg/Pose")
        self._pose_stamped = message("geometry_msgs/msg/PoseStamped")
        self._spread_pose = message("geometry_msgs/msg/PoseWithCovariance")
        self._located = message("geometry_msgs/msg/PoseWithCovarianceStamped")
        self._twist, self._spread_twist = (
            message("geometry_msgs/msg/Twist"),
            message("geometry_msgs/msg/TwistWithCovariance"),
        )
        self._transform, self._stamped = (
            message("geometry_msgs/msg/Transform"),
            message("geometry_msgs/msg/TransformStamped"),
        )
        self._transforms = message("tf2_msgs/msg/TFMessage")
        self._odometry, self._sweep = message("nav_msgs/msg/Odometry"), message("sensor_msgs/msg/LaserScan")
        self._about, self._grid = message("nav_msgs/msg/MapMetaData"), message("nav_msgs/msg/OccupancyGrid")

    def time_of(self, stamp: int) -> Any:
        """A stamp in ns."""
        return self._time(*divmod(stamp, 10**9))

    def clock(self, stamp: int) -> Any:
        """What `/clock` holds."""
        return self._clock(self.time_of(stamp))

    def header(self, stamp: int, frame: str) -> Any:
        """A header."""
        return self._header(stamp=self.time_of(stamp), frame_id=frame)

    def pose_of(self, pose: FloatArray) -> Any:
        """A pose (3,)."""
        return self._pose(self._point(float(pose[0]), float(pose[1])), self._turn(pose[2]))

    def goal(self, stamp: int, pose: FloatArray) -> Any:
        """A pose (3,) in the map, to go to."""
        return self._pose_stamped(self.header(stamp, MAP), self.pose_of(pose))

    def transform(self, stamp: int, parent: str, child: str, pose: FloatArray) -> Any:
        """That `child` stands at `pose` (3,) in `parent`."""
        where = self._vector(float(pose[0]), float(pose[1]))
        return self._stamped(self.header(stamp, parent), child, self._transform(where, self._turn(pose[2])))

    def transforms(self, moment: Moment) -> Any:
        """What `/tf` holds of a moment."""
        found = [self.transform(moment.stamp, ODOM, BASE, moment.odom_pose)]
        if moment.map_to_odom is not None:
            found.append(self.transform(moment.stamp, MAP, ODOM, moment.map_to_odom))
        return self._transforms(found)

    def mount(self, stamp: int, scan: Scan) -> Any:
        """What `/tf_static` holds: where the lidar stands."""
        return self._transforms([self.transform(stamp, BASE, LASER, scan.mount)])

    def odometry(self, moment: Moment) -> Any:
        """What `/odom` holds of a moment."""
        v, omega, *v_y = (float(value) for value in moment.velocity)
        twist = self._twist(self._vector(v, *v_y), self._vector(z=omega))
        covariance = _UNKNOWN.tolist()
        return self._odometry(
            self.header(moment.stamp, ODOM), BASE,
            self._spread_pose(self.pose_of(moment.odom_pose), covariance), self._spread_twist(twist, covariance),
        )  # fmt: skip

    def located(self, stamp: int, pose: FloatArray, initial: bool) -> Any:
        """A pose in the map; `initial`: with the spread that a pose given by hand has."""
        covariance = (_INITIAL_COVARIANCE if initial else _UNKNOWN).tolist()
        return self._located(self.header(stamp, MAP), self._spread_pose(self.pose_of(pose), covariance))

    def sweep(self, stamp: int, scan: Scan) -> Any:
        """What `/scan` holds: its stamp is the first beam's, as the message defines it, also where that one is cast last: beam i is of
        the stamp and i times the time increment."""
        beams = len(scan.ranges)
        lasts = scan.time_increment * (beams - 1)
        first = stamp - round(0.5 * lasts * 1e9)
        return self._sweep(
            self.header(first, LASER),
            scan.angle_min, scan.angle_min + (beams - 1) * scan.angle_increment, scan.angle_increment,
            scan.time_increment, abs(lasts), scan.range_min, scan.range_max, scan.ranges.tolist(), [],
        )  # fmt: skip

    def grid(self, stamp: int, cells: OccupancyGrid) -> Any:
        """What `/map` holds."""
        rows, columns = cells.data.shape
        origin = self.pose_of(np.array((*cells.origin, 0.0)))
        about = self._about(self.time_of(stamp), cells.resolution, columns, rows, origin)
        return self._grid(self.header(stamp, MAP), about, cells.data.ravel().tolist())

    def _turn(self, theta: float) -> Any:
        return self._turn_of(z=math.sin(0.5 * theta), w=math.cos(0.5 * theta))
