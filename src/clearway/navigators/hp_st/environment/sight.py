"""What a robot sees: a sector of a circle about its sensor, where nothing hides what is behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray
from clearway.robots import Robot

SIGMAS = 3.0
"""So many standard deviations of a range are its statistical error at most."""


class Sight(NamedTuple):
    """The sector of sight in base_link.

    Attributes:
        range: Radius of the sector in metres; inf: there is no limit.
        middle: Bearing of the sector's middle in radians.
        half: Half of the sector's angle in radians; pi: the whole circle.
        x: Where the sensor is, in metres ahead of base_link.
        y: Where the sensor is, in metres to the left of base_link.
    """

    range: float
    middle: float = 0.0
    half: float = math.pi
    x: float = 0.0
    y: float = 0.0


def sight_of(robot: Robot, scan_range: float) -> Sight:
    """What `robot` sees: a camera's circle, or a lidar's sector up to `scan_range` [m] at most; without both, everything.

    A lidar may miss what lies nearer to the end of its range than a range errs, so that doesn't count as seen.
    """
    if robot.camera is not None:
        return Sight(robot.camera.range)
    if robot.lidar is None:
        return Sight(math.inf)
    lidar = robot.lidar
    angle = lidar.angle_max - lidar.angle_min
    whole = angle >= 2.0 * math.pi * (1.0 - 1.5 / max(lidar.beams, 2))  # the last beam is next to the first
    x, y, yaw = lidar.mount
    return Sight(
        max(0.0, min(lidar.range_max, scan_range) - SIGMAS * lidar.sigma - lidar.bias),
        yaw + 0.5 * (lidar.angle_min + lidar.angle_max),
        math.pi if whole else 0.5 * angle,
        x,
        y,
    )


def looked_at(sight: Sight, turned: Sequence[float]) -> Sight:
    """What of `sight` was in sight at each of some looks before, too, since which the robot has `turned` by so many radians."""
    if sight.half >= math.pi:
        return sight
    left, right = max(0.0, *turned), max(0.0, *(-angle for angle in turned))
    return sight._replace(middle=sight.middle + 0.5 * (right - left), half=max(sight.half - 0.5 * (left + right), 0.0))


@light
def sees(sight: Sight, direction: float, doubt: float) -> bool:
    """Whether a direction in base_link [rad] lies in the sector, and all that is `doubt` [rad] beside it."""
    return bool(sight.half >= math.pi or abs(turn_between(sight.middle, direction)) + doubt <= sight.half)


@light
def beside(sight: Sight, pose: FloatArray, x: float, y: float) -> bool:
    """Whether the place (x, y) lies in a direction into which the sensor doesn't look from `pose` (3,)."""
    theta = pose[2]
    dx = x - (pose[0] + math.cos(theta) * sight.x - math.sin(theta) * sight.y)
    dy = y - (pose[1] + math.sin(theta) * sight.x + math.cos(theta) * sight.y)
    return not sees(sight, math.atan2(dy, dx) - theta, 0.0)


@kernel
def hidden_within(
    sight: Sight, eye: FloatArray, pose: FloatArray, centre: FloatArray, reach: FloatArray
) -> npt.NDArray[np.bool_]:
    """(n,) which of the discs about `centre` (n, K + 1, 2) at its first instant, with radii `reach` (n,) [m], hold the place of `pose` (3,)
    while their centres are `beside` what is seen from `eye` (3,)."""
    found = np.zeros(len(reach), np.bool_)
    for i in range(len(reach)):
        x, y = centre[i, 0, 0], centre[i, 0, 1]
        found[i] = math.hypot(x - pose[0], y - pose[1]) <= reach[i] and beside(sight, eye, x, y)
    return found


def depth(sight: Sight, pose: FloatArray, x: float, y: float) -> float:
    """How deep [m] the place (x, y) lies within the sector that is seen from `pose` (3,); below 0: so far outside."""
    theta = float(pose[2])
    cos, sin = math.cos(theta), math.sin(theta)
    dx = x - (float(pose[0]) + cos * sight.x - sin * sight.y)
    dy = y - (float(pose[1]) + sin * sight.x + cos * sight.y)
    far = math.hypot(dx, dy)
    rim = sight.range - far
    if sight.half >= math.pi:
        return rim
    off = sight.half - abs(turn_between(theta + sight.middle, math.atan2(dy, dx)))  # from the nearer edge; < 0: outside
    along, across = (far * math.cos(off), far * math.sin(abs(off))) if abs(off) < 0.5 * math.pi else (0.0, far)
    if off >= 0.0:
        return min(rim, across)
    return -math.hypot(max(0.0, along - sight.range), across)
