"""What the robot says, in ROS 2's messages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clearway.contract import Scan
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import BASE, LASER, MAP, ODOM, Moment
from clearway.live.ros2 import messages as m

_UNKNOWN = np.zeros(36)
_INITIAL = np.diag([0.25, 0.25, 0.0, 0.0, 0.0, 0.0685])
"""m², rad²: half a metre and 15 degrees, as RViz sends it with an initial pose."""
_INITIAL_COVARIANCE = _INITIAL.ravel()


def time_of(stamp: int) -> Any:
    """A stamp in ns as a message."""
    return m.Time(*divmod(stamp, 10**9))


def header(stamp: int, frame: str) -> Any:
    """A header."""
    return m.Header(time_of(stamp), frame)


def pose_of(pose: FloatArray) -> Any:
    """A pose (3,) as a message."""
    return m.Pose(m.Point(float(pose[0]), float(pose[1])), _turn(pose[2]))


def transform(stamp: int, parent: str, child: str, pose: FloatArray) -> Any:
    """That `child` stands at `pose` (3,) in `parent`."""
    where = m.Vector3(float(pose[0]), float(pose[1]))
    return m.TransformStamped(header(stamp, parent), child, m.Transform(where, _turn(pose[2])))


def transforms(moment: Moment) -> Any:
    """What `/tf` holds of a moment."""
    found = [transform(moment.stamp, ODOM, BASE, moment.odom_pose)]
    if moment.map_to_odom is not None:
        found.append(transform(moment.stamp, MAP, ODOM, moment.map_to_odom))
    return m.TFMessage(found)


def odometry(moment: Moment) -> Any:
    """What `/odom` holds of a moment."""
    v, omega, *v_y = (float(value) for value in moment.velocity)
    twist = m.Twist(m.Vector3(v, *v_y), m.Vector3(z=omega))
    covariance = _UNKNOWN.tolist()
    return m.Odometry(
        header(moment.stamp, ODOM), BASE,
        m.PoseWithCovariance(pose_of(moment.odom_pose), covariance), m.TwistWithCovariance(twist, covariance),
    )  # fmt: skip


def located(stamp: int, pose: FloatArray, initial: bool) -> Any:
    """A pose in the map; `initial`: with the spread that a pose given by hand has."""
    covariance = (_INITIAL_COVARIANCE if initial else _UNKNOWN).tolist()
    return m.PoseWithCovarianceStamped(header(stamp, MAP), m.PoseWithCovariance(pose_of(pose), covariance))


def sweep(stamp: int, scan: Scan) -> Any:
    """What `/scan` holds: its stamp is the first beam's, as the message defines it."""
    beams = len(scan.ranges)
    lasts = scan.time_increment * (beams - 1)
    begun = stamp - round(0.5 * abs(lasts) * 1e9)
    return m.LaserScan(
        header(begun, LASER),
        scan.angle_min, scan.angle_min + (beams - 1) * scan.angle_increment, scan.angle_increment,
        scan.time_increment, abs(lasts), scan.range_min, scan.range_max, scan.ranges.tolist(), [],
    )  # fmt: skip


def grid(stamp: int, cells: OccupancyGrid) -> Any:
    """What `/map` holds."""
    rows, columns = cells.data.shape
    about = m.MapMetaData(time_of(stamp), cells.resolution, columns, rows, pose_of(np.array((*cells.origin, 0.0))))
    return m.OccupancyGrid(header(stamp, MAP), about, cells.data.ravel().tolist())


def _turn(theta: float) -> Any:
    return m.Quaternion(z=math.sin(0.5 * theta), w=math.cos(0.5 * theta))
