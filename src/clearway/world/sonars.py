"""The sonars of a robot in the world: each tells the distance to the nearest in its cone, within which it can't tell where that is.

A cone is so many rays, and its range the least of theirs: as Gazebo's range sensors do it, and ROS' `range_sensor_layer` takes them.
What sound does besides is left out: a smooth wall that is met aslant sends it elsewhere, and one sonar hears another's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.contract import Ranges
from clearway.geometry.raycast import beams
from clearway.geometry.read_only import read_only
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normals, stream
from clearway.robots import Sonars
from clearway.robots.robot import LEGS_END
from clearway.trials import Body
from clearway.world.legs import on_legs, standing, walk
from clearway.world.lidar import Errors, View, hold, scan
from clearway.world.traffic import Around

RAYS = 9
"""In a cone: 0.06 rad apart in one of 0.5 rad, 6 cm at a metre, half as wide as a leg."""
_EXACT = Errors(sigma=0.0, bias=0.0, spot=0.0, pulse=math.inf, kept=0.0)


class SonarRing:
    """Measures what is around one robot.

    Args:
        sonars: The robot's.
        pivot: How far ahead of base_link the point is that its poses are of, m.
        still: The bodies that stand.
        moving: The bodies that move, in the order of `around`.
        poses: (m, 3) where these are as the sonars measure; others write them before.
        around: What of the traffic moves around this robot.
        period: Its control period, s.
        seed: Of the errors, and of how people walk.
    """

    def __init__(
        self, sonars: Sonars, pivot: float, still: Sequence[Body], moving: Sequence[Body], poses: FloatArray, around: Around,
        period: float, seed: int,
    ) -> None:  # fmt: skip
        self._sonars, self._around, self._every = sonars, around, max(1, round(sonars.period / period))
        self._mounts = read_only(np.array(sonars.mounts, dtype=np.float64))
        self._key = stream(seed, "sonars")
        low = sonars.height is not None and sonars.height < LEGS_END
        movable, self._legs = on_legs(moving, seed, low)
        self._circles, scene = movable.circles, standing(still, low)
        half, (near, far) = 0.5 * sonars.field, (sonars.range_min, sonars.range_max)
        rays = beams(RAYS, -half, half, near, far)
        self._views = [
            hold(View(mount - (pivot, 0.0, 0.0), rays, _EXACT, self._key, scene, movable, poses, np.empty((2, RAYS))))
            for mount in self._mounts
        ]

    def look(self, stamp: float, pose: FloatArray, count: int) -> Ranges | None:
        """What was measured at time `stamp` [s], with the robot at `pose` (3,), in control period `count`; None: nothing new."""
        if count % self._every:
            return None
        if len(self._legs.circle):
            walk(self._circles, self._legs, self._around.tracks, self._around.since, self._around.leg, stamp)
        x, y, theta = pose.tolist()
        rays, sonars = np.empty(RAYS), self._sonars
        ranges = np.empty(len(self._views))
        for i, view in enumerate(self._views):
            scan(rays, x, y, theta, count, view)
            ranges[i] = rays.min()
        noise = np.empty(len(ranges))
        normals(self._key, count, noise, np.empty(len(ranges)))
        ranges += sonars.sigma * noise
        return Ranges(np.maximum(ranges, sonars.range_min), self._mounts, sonars.field, sonars.range_max)
