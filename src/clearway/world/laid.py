"""Tracks that are laid while a trial goes on, each knot when a body has decided where it will be.

A body that decides lays its track up to its next decision, so that it moves on lines like any other body, and contact with it
is found as exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.world.tracks import ROOM, Tracks, pose_at


class Laid:
    """One such track; when there is no more room, the older half is forgotten.

    Attributes:
        knots: (ROOM, 4) s since the trial began, x, y [m], theta [rad]; NaN poses: it is absent.
        count: How many of them there are.
    """

    def __init__(self, knots: FloatArray | None = None) -> None:
        self.knots = np.full((ROOM, 4), np.nan) if knots is None else knots
        self.count = 0

    def lay(self, t: float, pose: Sequence[float] | FloatArray) -> None:
        """At time `t` [s], not before the last knot, it will be at `pose` (3,)."""
        if self.count == len(self.knots):
            half = len(self.knots) // 2
            self.knots[:half] = self.knots[-half:]
            self.count = half
        self.knots[self.count, 0] = t
        self.knots[self.count, 1:] = pose
        self.count += 1

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
        self._tracks = tracks
        self._laid: dict[int, Laid] = {}

    def add(self, body: int, speed: float) -> None:
        """Moving body `body` decides; it never moves faster than `speed` [m/s]."""
        begin = int(self._tracks.rows[0, body, 0])
        self._laid[body] = Laid(self._tracks.knots[begin : begin + ROOM])
        self._tracks.speed[body] = speed

    def __contains__(self, body: int) -> bool:
        """Whether moving body `body` decides."""
        return body in self._laid

    def lay(self, body: int, t: float, pose: FloatArray) -> None:
        """At time `t` [s] it will be at `pose` (3,)."""
        laid = self._laid[body]
        laid.lay(t, pose)
        self._tracks.rows[:, body, 1] = self._tracks.rows[:, body, 0] + laid.count

    def cut(self, body: int, t: float) -> None:
        """Forget what was laid beyond time `t` [s]."""
        self._laid[body].cut(t)

    def restart(self, body: int, t: float, pose: FloatArray) -> None:
        """From time `t` [s] on it is at `pose` (3,), whatever was laid beyond."""
        self.cut(body, t)
        self.lay(body, t, pose)

    def foreseen(self, body: int, t: float) -> FloatArray:
        """(2,) where it is at time `t` [s]; beyond what is laid as it last moved."""
        laid = self._laid[body]
        last, before = laid.knots[laid.count - 1], laid.knots[max(laid.count - 2, 0)]
        if t <= last[0] or not last[0] > before[0]:
            return laid.at(t)[:2]
        ahead: FloatArray = last[1:3] + (t - last[0]) / (last[0] - before[0]) * (last[1:3] - before[1:3])
        return ahead
