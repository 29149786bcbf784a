"""What a navigator is told, checked and in the types that kernels are compiled for."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import numpy.typing as npt

from clearway.contract import Observation, Obstacles, Task
from clearway.geometry.shapes import FloatArray
from clearway.robots import Robot

NOTHING = Obstacles(
    np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.bool_)
)  # fmt: skip
"""No obstacle."""


def finite(name: str, values: npt.ArrayLike, count: int = 3) -> FloatArray:
    """A copy of a pose (3,) or of something else that has `count` numbers.

    Args:
        name: What it is, in the words of `clearway.contract.Observation`.

    Raises:
        ValueError: They are not so many, or one of them is not finite.
    """
    found = np.array(values, dtype=np.float64)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise ValueError(f"the observation's {name} is {found.tolist()}; {count} finite numbers are needed")
    return found


def own(observation: Observation) -> Observation:
    """`observation` with arrays that are a navigator's own: those that it is given can't be written, which for kernels is
    another type. The goal stays the object that it is."""
    scan, seen = observation.scan, observation.obstacles
    return replace(
        observation,
        pose=observation.pose.copy(),
        velocity=observation.velocity.copy(),
        odom_pose=observation.odom_pose.copy(),
        scan=None if scan is None else replace(scan, ranges=scan.ranges.copy(), mount=scan.mount.copy()),
        obstacles=None if seen is None else Obstacles(*(getattr(seen, f.name).copy() for f in fields(seen))),
    )


def perception_radius(robot: Robot, scan_range: float) -> float:
    """How far `robot` perceives obstacles, m: by its camera, else by its lidar; inf without both.

    Args:
        scan_range: How far a tracker tells of obstacles that a lidar sees, m.
    """
    if robot.camera is not None:
        return robot.camera.range
    return math.inf if robot.lidar is None else min(robot.lidar.range_max, scan_range)


def area_of(task: Task) -> FloatArray:
    """(4,) x_min, y_min, x_max, y_max that the robot's centre keeps to, m; +-inf where it is free."""
    return np.array(task.area or (-math.inf, -math.inf, math.inf, math.inf), np.float64)
