"""Tracks that are laid while a trial goes on, each knot when a body has decided where it will be.

A body that decides lays its track up to its next decision, so that it moves on lines like any other body, and contact with it
is found as exactly. When there is no more room for knots, the older half is forgotten.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.world.tracks import ROOM, Tracks, pose_at


class Laid:
    """One such track.

    Attributes:
        knots: (ROOM, 4) s since the trial began, x, y [m], theta [rad]; NaN poses: it is absent.
        count: How many of them there are.
    """

    def __init__(self) -> None:
        self.knots = np.full((ROOM, 4), np.nan)
        self.count = 0

    def lay(self, times: float | FloatArray, poses: FloatArray) -> None:
        """At these times (n,) [s], not before the last knot and fewer than half of `ROOM`, it will be at `poses` (n, 3); or at one
        time at one pose (3,)."""
        n = np.size(times)
        if self.count + n > len(self.knots):
            half = len(self.knots) // 2
            self.knots[:half] = self.knots[self.count - half : self.count]
            self.count = half
        self.knots[self.count : self.count + n, 0] = times
        self.knots[self.count : self.count + n, 1:] = poses
        self.count += n

    def cut(self, t: float) -> None:
        """Forget what was laid beyond time `t` [s]."""
        while self.count and self.knots[self.count - 1, 0] > t:
            self.count -= 1

    def at(self, t: float) -> FloatArray:
        """The pose (3,) at time `t` [s]; before the first knot that of the first, after the last one that of the last."""
        pose = np.empty(3)
        first, last = self.knots[0, 0], self.knots[self.count - 1, 0]
        pose_at(self.knots, 0, self.count, min(max(t, first), last), pose)
        return pose


class LaidTracks:
    """Those of the bodies of `tracks` that decide.

    Args:
        tracks: Of all moving bodies; those that decide have `ROOM` knots there.
    """

    def __init__(self, tracks: Tracks) -> None:
        self._tracks, self._who = tracks, set[int]()

    def add(self, body: int, speed: float) -> None:
        """Moving body `body` decides; it never moves faster than `speed` [m/s]."""
        self._who.add(body)
        self._tracks.speed[body] = speed

    def __contains__(self, body: int) -> bool:
        """Whether moving body `body` decides."""
        return body in self._who

    def lay(self, bodies: Sequence[int] | npt.NDArray[np.int64], t: float, poses: FloatArray) -> None:
        """At time `t` [s] each of these bodies will be at one of `poses` (n, 3)."""
        lay(self._tracks.knots, self._tracks.rows, np.asarray(bodies, np.int64), t, np.asarray(poses, np.float64))

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


@kernel
def lay(
    knots: FloatArray, rows: npt.NDArray[np.int64], bodies: npt.NDArray[np.int64], t: float, poses: FloatArray
) -> None:
    """Add a knot at time `t` [s] to the tracks of these bodies: `poses` (n, 3).

    Args:
        knots: As `Tracks` has them; updated.
        rows: The same.
    """
    for i in range(len(bodies)):
        m = bodies[i]
        begin = rows[0, m, 0]
        count = rows[0, m, 1] - begin
        if count == ROOM:
            count = ROOM // 2
            for k in range(count):
                knots[begin + k] = knots[begin + ROOM - count + k]
        knots[begin + count, 0] = t
        knots[begin + count, 1:] = poses[i]
        rows[:, m, 1] = begin + count + 1
