"""Tracks that are laid while a trial goes on, each knot when a body has decided where it will be.

A body that decides lays its track up to its next decision, so that it moves on lines like any other body, and contact with it
is found as exactly. When there is no more room for knots, the older half is forgotten.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray
from clearway.world.tracks import ROOM, Tracks, pose_at

_SAME = 1e-9  # s
APART = 0.005
"""A robot's track keeps no knots nearer in time than this, s: one with a control period of 1 ms is kept for as long as any other."""


class RobotTracks(NamedTuple):
    """Where r robots have been of late, each with its pivot.

    Attributes:
        knots: (r, ROBOTS_ROOM, 4) s since the trial began, x, y [m], theta [rad].
        laid: (r,) int64, how many of them there are; 0: the robot is gone.
        reach: (r,) radius around the pivot that no part of the robot leaves, m.
    """

    knots: FloatArray
    laid: npt.NDArray[np.int64]
    reach: FloatArray


class Laid:
    """The track of one robot.

    Args:
        knots: (ROBOTS_ROOM, 4) its part of `RobotTracks`; updated.
        count: (1,) the same.
    """

    def __init__(self, knots: FloatArray, count: npt.NDArray[np.int64]) -> None:
        self.knots, self._count = knots, count

    @property
    def count(self) -> int:
        """How many knots there are."""
        return int(self._count[0])

    def lay(self, t: float, pose: FloatArray) -> None:
        """At time `t` [s], not before the last knot, it will be at `pose` (3,)."""
        if self.count == len(self.knots):
            self._count[0] = forget(self.knots, self.count)
        self.knots[self.count, 0], self.knots[self.count, 1:] = t, pose
        self._count[0] += 1

    def drive(self, t: float, period: float, way: FloatArray) -> None:
        """In the `period` [s] from time `t` [s] on it drives along `way` (n + 1, 3 or more)."""
        lay_way(self.knots, self._count, t, period, way)

    def cut(self, t: float) -> None:
        """Forget what was laid beyond time `t` [s]."""
        while self.count and self.knots[self.count - 1, 0] > t:
            self._count[0] -= 1

    def at(self, t: float) -> FloatArray:
        """The pose (3,) at time `t` [s]; before the first knot that of the first, after the last one that of the last."""
        pose, count = np.empty(3), self.count
        first, last = self.knots[0, 0], self.knots[count - 1, 0]
        pose_at(self.knots, 0, count, min(max(t, first), last), pose)
        return pose


class LaidTracks:
    """Those of the bodies of `tracks` that decide.

    Args:
        tracks: Of all moving bodies; those that decide have `ROOM` knots there, robots `ROBOTS_ROOM`.
    """

    def __init__(self, tracks: Tracks) -> None:
        self._tracks, self._room = tracks, dict[int, int]()

    def add(self, body: int, speed: float, room: int = ROOM) -> None:
        """Moving body `body` decides; it never moves faster than `speed` [m/s], and there is `room` for so many knots of it."""
        self._room[body] = room
        self._tracks.speed[body] = speed

    def __contains__(self, body: int) -> bool:
        """Whether moving body `body` decides."""
        return body in self._room

    def lay(self, bodies: Sequence[int] | npt.NDArray[np.int64], t: float, poses: FloatArray) -> None:
        """At time `t` [s] each of these bodies, robots or others, will be at one of `poses` (n, 3)."""
        who, room = np.asarray(bodies, np.int64), self._room[int(bodies[0])]
        lay(self._tracks.knots, self._tracks.rows, who, t, np.asarray(poses, np.float64), room)

    def drive(self, body: int, t: float, period: float, way: FloatArray) -> None:
        """In the `period` [s] from time `t` [s] on, its last knot, robot `body` drives along `way` (n + 1, 3)."""
        begin, end = self._tracks.rows[0, body].tolist()
        count = np.array([end - begin])
        lay_way(self._tracks.knots[begin : begin + self._room[body]], count, t, period, way)
        self._tracks.rows[:, body, 1] = begin + count[0]

    def cut(self, body: int, t: float) -> None:
        """Forget what was laid beyond time `t` [s]."""
        begin, end = self._tracks.rows[0, body].tolist()
        while end > begin and self._tracks.knots[end - 1, 0] > t:
            end -= 1
        self._tracks.rows[:, body, 1] = end

    def restart(self, bodies: Sequence[int], t: float, poses: FloatArray) -> None:
        """From time `t` [s] on each of these bodies is at one of `poses` (n, 3), whatever was laid beyond."""
        for body in bodies:
            self.cut(body, t)
        self.lay(bodies, t, poses)

    def foreseen(self, body: int, t: float) -> FloatArray:
        """(2,) where it is at time `t` [s]; beyond what is laid as it last moved."""
        begin, end = self._tracks.rows[0, body].tolist()
        knots = self._tracks.knots
        last, before = knots[end - 1], knots[max(end - 2, begin)]
        if t <= last[0] or not last[0] > before[0]:
            pose = np.empty(3)
            pose_at(knots, begin, end, min(max(t, float(knots[begin, 0])), float(last[0])), pose)
            return pose[:2]
        ahead: FloatArray = last[1:3] + (t - last[0]) / (last[0] - before[0]) * (last[1:3] - before[1:3])
        return ahead


@light
def lay(
    knots: FloatArray,
    rows: npt.NDArray[np.int64],
    bodies: npt.NDArray[np.int64],
    t: float,
    poses: FloatArray,
    room: int,
) -> None:
    """Add a knot at time `t` [s] to the tracks of these bodies: `poses` (n, 3).

    Args:
        knots: As `Tracks` has them; updated.
        rows: The same.
        room: For so many knots of each.
    """
    for i in range(len(bodies)):
        m = bodies[i]
        begin = rows[0, m, 0]
        count = rows[0, m, 1] - begin
        if count == room:
            count = forget(knots[begin : begin + room], count)
        knots[begin + count, 0] = t
        for c in range(3):
            knots[begin + count, 1 + c] = poses[i, c]
        for leg in range(len(rows)):
            rows[leg, m, 1] = begin + count + 1


@light
def lay_way(knots: FloatArray, count: npt.NDArray[np.int64], t: float, period: float, way: FloatArray) -> None:
    """`Laid.drive`.

    Args:
        knots: (ROBOTS_ROOM, 4) as `RobotTracks` has them; updated.
        count: (1,) the same.
    """
    n = len(way) - 1
    if n == 1 and count[0] > 1 and knots[count[0] - 1, 0] - knots[count[0] - 2, 0] < APART:
        count[0] -= 1
    if count[0] + n > len(knots):
        count[0] = forget(knots, count[0])
    for i in range(1, n + 1):
        knots[count[0], 0] = t + period / n * i
        for c in range(3):
            knots[count[0], 1 + c] = way[i, c]
        count[0] += 1


@light
def bound_for(
    tracks: Tracks, decides: npt.NDArray[np.bool_], t: float, out: FloatArray, free: npt.NDArray[np.bool_]
) -> None:
    """Where bodies go that have decided before time `t` [s]; what they decide at this very instant, in whatever order, doesn't count.

    Args:
        tracks: Of all bodies.
        decides: Which of them decide.
        t: The time, s.
        out: (m, 3) where each of the first m will be at its next decision, m and rad; written; NaN where one is absent or never decides.
        free: (m,) whether each decides at this instant; written.
    """
    for m in range(len(out)):
        begin, last = tracks.rows[0, m, 0], tracks.rows[0, m, 1] - 1
        there = decides[m] and last >= begin
        while there and last > begin and tracks.knots[last, 0] > t + _SAME and tracks.knots[last - 1, 0] >= t - _SAME:
            last -= 1
        free[m] = there and tracks.knots[last, 0] <= t + _SAME
        for c in range(3):
            out[m, c] = tracks.knots[last, 1 + c] if there else math.nan


@light
def forget(knots: FloatArray, count: int) -> int:
    """Keep the later ones of `count` of the `knots` (n, 4), half as many as there is room for, and say how many these are."""
    half = len(knots) // 2
    for k in range(half):
        for c in range(4):
            knots[k, c] = knots[count - half + k, c]
    return half
