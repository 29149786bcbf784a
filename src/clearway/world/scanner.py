"""The lidar of a robot in the world: among what it stands, and when each of its beams is cast."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.contract import Scan
from clearway.geometry.raycast import beams
from clearway.geometry.read_only import read_only
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream
from clearway.robots import Lidar
from clearway.trials import Body
from clearway.world.latency import Past
from clearway.world.legs import on_legs, standing, walk
from clearway.world.lidar import GROUPS, Sweep, Trace, View, errors_of, hold, hold_sweep, scan, scan_in_time
from clearway.world.setting import steps
from clearway.world.traffic import Around, Traffic


class Scanner:
    """Scans what is around one robot.

    Args:
        lidar: The robot's.
        pivot: How far ahead of base_link the point is that its poses are of, m.
        still: The bodies that stand.
        moving: The bodies that move, in the order of `around`.
        traffic: What moves.
        around: What of it moves around this robot.
        past: Where all were of late.
        period: Its control period, s.
        pose: (3,) where it stands before anything moves.
        factor: On the time that a sweep takes.
        late: How old the middle of a scan is at most when it arrives, s.
        seed: Of the lidar's errors, and of how people walk.

    Attributes:
        poses: (m, 3) where the moving bodies are as a scan is taken; to be written before a scan is asked for.
        view: It, and among what it stands.
        legs: Of the people whom it sees low.
        sweeps: Whether a scan takes time.
    """

    def __init__(
        self, lidar: Lidar, pivot: float, still: Sequence[Body], moving: Sequence[Body], traffic: Traffic, around: Around,
        past: Past, period: float, pose: FloatArray, factor: float, late: float, seed: int,
    ) -> None:  # fmt: skip
        rays = beams(lidar.beams, lidar.angle_min, lidar.angle_max, lidar.range_min, lidar.range_max)
        mount = read_only(np.array(lidar.mount, dtype=np.float64))
        key = stream(seed, "lidar")
        low = lidar.sees_legs
        movable, self.legs = on_legs(moving, seed, low)
        self.poses = np.full((len(moving), 3), np.nan)
        view = View(
            mount=mount - (pivot, 0.0, 0.0),
            rays=rays,
            errors=errors_of(lidar, rays.increment, key),
            key=key,
            still=standing(still, low),
            movable=movable,
            poses=self.poses,
            room=np.empty((2, lidar.beams)),
        )
        self.view, self._view, self._circles = view, hold(view), movable.circles
        self._beams = lidar.beams
        self._traffic, self._around, self._past = traffic, around, past
        self._time = factor * lidar.sweep * (-1.0 if lidar.clockwise else 1.0)
        self.sweeps = self._time != 0.0
        between = self._time / max(lidar.beams - 1, 1)
        self._about = (rays.angle_min, rays.increment, rays.range_min, rays.range_max, mount, between)
        if self.sweeps:
            k = math.ceil((late + 0.5 * abs(self._time)) / period) + 1
            self._trace = Trace(period * np.arange(-k, 0.0), period, np.tile(pose[:3], (k, steps(period) + 1, 1)))
            self._before = np.full((GROUPS, len(moving), 3), np.nan)
            self._sweep = hold_sweep(
                Sweep(view, self._trace, self._time, self.legs, around.tracks, around.since, self._before)
            )

    def keep(self, t: float, way: FloatArray) -> None:
        """In the period from time `t` [s] on the robot drove along `way` (n + 1, 3 or more)."""
        if self.sweeps:
            begun, ways = self._trace.begun, self._trace.ways
            begun[:-1], ways[:-1] = begun[1:], ways[1:]
            begun[-1], ways[-1] = t, way[:, :3]

    def look(self, stamp: float, pose: FloatArray, count: int) -> Scan:
        """The scan whose middle was at time `stamp` [s], when the robot was at `pose` (3,), in control period `count`."""
        ranges = np.empty(self._beams)
        if self.sweeps:
            began = self._traffic.leg_began
            if stamp - 0.5 * abs(self._time) < began:
                for g in range(GROUPS):
                    self._before[g] = self._past.seen(stamp + self._time * ((g + 0.5) / GROUPS - 0.5))
            self._around.now()
            scan_in_time(ranges, stamp, self._around.leg, began, count, self._sweep)
        else:
            if len(self.legs.circle):
                walk(self._circles, self.legs, self._around.tracks, self._around.since, self._around.leg, stamp)
            x, y, theta = pose.tolist()
            scan(ranges, x, y, theta, count, self._view)
        return Scan(ranges, *self._about)
