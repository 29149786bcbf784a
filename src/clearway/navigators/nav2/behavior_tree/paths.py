"""What behaviour trees ask about a path (n, 3), poses in metres and radians (nav2_util/geometry_utils.hpp)."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.frames import compose
from clearway.geometry.shapes import FloatArray

EMPTY: FloatArray = np.empty((0, 3))
"""No path."""


def _steps(path: FloatArray) -> FloatArray:
    steps: FloatArray = np.hypot(*np.diff(path[:, :2], axis=0).T)
    return steps


def length(path: FloatArray, begin: int = 0) -> float:
    """Length from a pose on, m."""
    return float(_steps(path[begin:]).sum()) if len(path) > begin + 1 else 0.0


def first_after(path: FloatArray, begin: int, distance: float) -> int:
    """Index of the first pose that lies further than `distance` m along the path; its number of poses without one."""
    far = np.flatnonzero(np.cumsum(_steps(path[begin:])) > distance)
    return begin + 1 + int(far[0]) if far.size else len(path)


def nearest(path: FloatArray, pose: FloatArray, begin: int, end: int, per_radian: float = 0.0) -> int:
    """Index of the pose in [begin, end) nearest to `pose`, a radian counting `per_radian` metres."""
    part = path[begin:end]
    apart = (part[:, 0] - pose[0]) ** 2 + (part[:, 1] - pose[1]) ** 2
    if per_radian > 0.0:
        apart += (per_radian * np.array([wrap(float(yaw - pose[2])) for yaw in part[:, 2]])) ** 2
    return begin + int(np.argmin(apart))


def moved(path: FloatArray, frame: FloatArray) -> FloatArray:
    """A path given in a frame whose pose is `frame` (3,), where that pose is given; the same path if the frames are one."""
    if not frame.any():
        return path
    return np.array([compose(frame, pose) for pose in path]).reshape(-1, 3)


class Pruned:
    """Where on a path the robot is, never behind where it was, as long as the path stays the same."""

    def __init__(self) -> None:
        self._path: FloatArray | None = None
        self._begin = 0

    def index(self, path: FloatArray, pose: FloatArray, search: float, per_radian: float = 0.0) -> int:
        """Index of the pose nearest to the robot's.

        Args:
            path: (n, 3), n >= 1.
            pose: (3,) of the robot.
            search: How far ahead of where it was it is looked for, m; negative or inf: everywhere.
            per_radian: Metres that a radian counts.
        """
        everywhere = search < 0.0 or math.isinf(search)
        if everywhere or path is not self._path:
            self._path, self._begin = path, 0
        end = len(path) if everywhere else first_after(path, self._begin, search)
        self._begin = nearest(path, pose, self._begin, end, per_radian)
        return self._begin
