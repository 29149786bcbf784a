"""The bodies that decide while a trial goes on: who decides for which, when, and what they can see."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.geometry.packing import Packed
from clearway.geometry.shapes import FloatArray
from clearway.world.behaviours.behaviour import PERIOD, Behaviour, Scene, SeenRobot
from clearway.world.laid import Laid, LaidTracks
from clearway.world.tracks import Tracks, place

_SAME = 1e-9  # s


class Deciders:
    """Has each behaviour decide at its instants, which are the same for all, and lays the tracks of their bodies.

    Args:
        behaviours: Who decides, and for which of the moving bodies.
        tracks: Of all moving bodies.
        slack: (m,) way for which each needs no look, m; set to 0 when a track is laid.
        since: (m,) when the clock of each began, s.
        shape: The tested robot's, in the frame of its track.
        legs: Names of the legs.
    """

    def __init__(
        self, behaviours: Sequence[Behaviour], tracks: Tracks, slack: FloatArray, since: FloatArray, shape: Packed,
        legs: Sequence[str],
    ) -> None:  # fmt: skip
        self._behaviours, self._tracks, self._since, self._legs = tuple(behaviours), tracks, since, tuple(legs)
        self._laid, self._leg, self._count = LaidTracks(tracks, slack), 0, 0
        self._robot = SeenRobot(shape, Laid())
        for behaviour in behaviours:
            for m, speed in zip(behaviour.members, behaviour.speed, strict=True):
                self._laid.add(m, float(speed))

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self._behaviours)

    def __contains__(self, m: int) -> bool:
        """Whether moving body `m` decides."""
        return m in self._laid

    def start(self, pose: FloatArray) -> None:
        """Time 0: the robot stands at `pose` (3,), and the first leg begins."""
        self._robot.track.lay(0.0, pose)
        self.begin_leg(0, 0.0)
        self.decide_until(0.0)

    def begin_leg(self, leg: int, t: float) -> None:
        """Leg number `leg` begins at time `t` [s]; whom that concerns and who has decided for longer decides anew."""
        self._leg = leg
        for behaviour in self._behaviours:
            poses = behaviour.begin_leg(self._legs[leg], t)
            if poses is None:
                continue
            for m, pose in zip(behaviour.members, poses, strict=True):
                self._laid.restart(m, t, pose)
            until = self._count * PERIOD
            if until > t + _SAME:
                self._lay(behaviour, until, behaviour.step(t, until, self._scene(t)))

    def see(self, t: float, period: float, way: FloatArray) -> None:
        """In the `period` [s] from time `t` [s] on the robot drives along `way` (n + 1, 3 or more)."""
        step = period / (len(way) - 1)
        for i in range(1, len(way)):
            self._robot.track.lay(t + i * step, way[i, :3])

    def decide_until(self, t: float) -> None:
        """All decide up to time `t` [s], and thereby for a little longer; each by what was there when it decided."""
        while self._count * PERIOD <= t + _SAME:
            now, until = self._count * PERIOD, (self._count + 1) * PERIOD
            scene = self._scene(now)
            chosen = [behaviour.step(now, until, scene) for behaviour in self._behaviours]
            for behaviour, poses in zip(self._behaviours, chosen, strict=True):
                self._lay(behaviour, until, poses)
            self._count += 1

    def foreseen(self, m: int, t: float) -> FloatArray:
        """(2,) where body `m` is at time `t` [s]; beyond what it has decided as it last moved."""
        return self._laid.foreseen(m, t)

    def _lay(self, behaviour: Behaviour, until: float, poses: FloatArray) -> None:
        for m, pose in zip(behaviour.members, poses, strict=True):
            self._laid.lay(m, until, pose)

    def _scene(self, t: float) -> Scene:
        now, before = (np.empty((len(self._since), 3)) for _ in range(2))
        place(self._tracks, self._leg, self._since, t, now)
        place(self._tracks, self._leg, self._since, t - PERIOD, before)
        return Scene(now, before, (self._robot,))
