"""The odometry's frame, in which obstacles are tracked of a robot that localises itself."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from clearway.contract import Obstacles
from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray


class OdometryFrame:
    """From the map into the odometry's frame and back: smooth there, while the map's jumps as localisation corrects itself.

    Obstacles are perceived from the robot, so a wrong estimate moves them with it: in this frame they, the stored plan
    and what is watched don't jump; the goal does, as it must.
    """

    def __init__(self, pose: FloatArray, odom: FloatArray) -> None:
        self._pose, self._odom = pose, odom
        self._turned = float(odom[2] - pose[2])
        c, s = math.cos(self._turned), math.sin(self._turned)
        self._rotation = np.array(((c, s), (-s, c)))

    def into(self, pose: FloatArray) -> FloatArray:
        """A pose (3,) of the map."""
        place = (pose[:2] - self._pose[:2]) @ self._rotation + self._odom[:2]
        return np.array((*place, wrap(float(pose[2]) + self._turned)))

    def obstacles(self, seen: Obstacles) -> Obstacles:
        """Obstacles of the map."""
        place = (seen.position - self._pose[:2]) @ self._rotation + self._odom[:2]
        return dataclasses.replace(seen, position=place, velocity=seen.velocity @ self._rotation)

    def back(self, points: FloatArray) -> FloatArray:
        """Points (n, 2), or discs (n, 3), in the map; those that are finite."""
        out = np.array(points, np.float64)
        out[:, :2] = (out[:, :2] - self._odom[:2]) @ self._rotation.T + self._pose[:2]
        finite = np.isfinite(out)
        return out if finite.all() else np.asarray(out[finite.all(axis=1)])

    def grid_back(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """(n m, 2) in the map: the points of a grid with columns at `x` (m,) and rows at `y` (n,), row by row."""
        out = np.empty((len(y), len(x), 2))
        out[:, :, 0], out[:, :, 1] = x - self._odom[0], (y - self._odom[1])[:, None]
        turned: FloatArray = out.reshape(-1, 2) @ self._rotation.T
        for c in range(2):  # column by column, as NumPy is slow in rows of two
            turned[:, c] += self._pose[c]
        return turned
