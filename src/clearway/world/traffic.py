"""All that moves in a simulation, and where it will be up to its next decision: on rails, by behaviours, by pilots.

Whoever decides lays its track up to its next decision, so that the robots meet it as exactly as what runs on rails.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.geometry.held import Held
from clearway.geometry.packing import Packed
from clearway.geometry.shapes import FloatArray
from clearway.world.arrivals import Arrivals
from clearway.world.behaviours.among import Among, decide_until, hold_among, look, ride_until
from clearway.world.behaviours.behaviour import (
    PERIOD,
    Behaviour,
    CompiledBehaviour,
    Scene,
    SeenRobot,
    Street,
    hold_street,
)
from clearway.world.behaviours.foreign import BehaviourError
from clearway.world.laid import Laid, LaidTracks, RobotTracks, bound_for
from clearway.world.ride import Period, Ride
from clearway.world.tracks import ROBOTS_ROOM, Tracks, place, place_twice

_SAME = 1e-9  # s
_OVER = 1e-6
"""So much longer than it is known a robot's track goes on, s: an instant is the same up to rounding."""
_EVER = 1e9  # s
_NOBODY = Arrivals((), 0)
AFTER = 120.0
"""For so long after the trials are over people are given to arrive where they were walking to, s."""


class Traffic:
    """Has each behaviour decide at its instants, which are the same for all, and knows where the robots drive.

    Args:
        tracks: Of all that moves: moving obstacles and people, then the robots if there are several.
        behaviours: Who decides, and for which of the former.
        legs: Names of the first robot's legs, by which those go that run or are driven along a path.
        robots: How many there are.
        arrivals: Is told where the people are whenever they decide.

    Attributes:
        several: Whether robots meet robots.
        decided: Whether anything that moves is decided while the trial goes on, and may go by what a robot does.
        leg: Number of the first robot's leg.
        leg_began: When that began, s.
        arrivals: Of the people where they were going.
    """

    def __init__(
        self, tracks: Tracks, behaviours: Sequence[Behaviour | CompiledBehaviour], legs: Sequence[str], robots: int = 1,
        arrivals: Arrivals | None = None,
    ) -> None:  # fmt: skip
        self._tracks, self._behaviours, self._legs = tracks, tuple(behaviours), tuple(legs)
        self._since, self._there = np.zeros(len(tracks.speed)), np.empty((2, len(tracks.speed), 3))
        self.several = robots > 1
        self.decided = bool(self._behaviours) or self.several
        self._others = len(tracks.speed) - (robots if self.several else 0)
        self._laid, self.leg, self.leg_began, self._count = LaidTracks(tracks), 0, 0.0, 0
        self._robots: list[SeenRobot] = []
        self._driven = RobotTracks(
            np.full((robots, ROBOTS_ROOM, 4), np.nan), np.zeros(robots, np.int64), np.zeros(robots)
        )
        self.arrivals = arrivals or Arrivals((), 0)
        self._pivots: list[float] = []
        self._crowds = [b for b in behaviours if isinstance(b, CompiledBehaviour)]
        self._asked = [b for b in behaviours if not isinstance(b, CompiledBehaviour)]
        self._together = len(self._crowds) == 1 and not self._asked  # whether one crowd is all who decide
        for behaviour in behaviours:
            for m, speed in zip(behaviour.members, behaviour.speed, strict=True):
                self._laid.add(m, float(speed))
        self._decides = np.array([m in self._laid for m in range(len(tracks.speed))], np.bool_)

    def join(self, shape: Packed, pivot: float, pose: FloatArray, speed: float) -> int:
        """A robot stands at `pose` (3,) at time 0.

        Args:
            shape: Its footprint, about its pivot.
            pivot: How far ahead of base_link that is, m; `pose`, and what is said of it later, is the pivot's.
            pose: Where it stands.
            speed: The most that its base_link ever moves at, m/s.

        Returns:
            Which of the robots it is.
        """
        member = len(self._robots)
        self._driven.reach[member] = shape.reach[0]
        self._robots.append(SeenRobot(shape, Laid(self._driven.knots[member], self._driven.laid[member : member + 1])))
        self._pivots.append(pivot)
        self._robots[member].track.lay(0.0, pose)
        if self.several:
            self._laid.add(self._others + member, speed, ROBOTS_ROOM)
            self._laid.lay([self._others + member], 0.0, self._base(member, pose[None]))
        return member

    def start(self) -> None:
        """Time 0: all robots have joined, and the first leg begins."""
        self.begin_leg(0, 0.0)
        self.decide_until(0.0)

    def begin_leg(self, leg: int, t: float) -> None:
        """The first robot begins leg number `leg` at time `t` [s]; whom that concerns and who has decided for longer decides
        anew."""
        self.leg, self.leg_began = leg, t
        self._since[~self._tracks.lasting] = t
        for behaviour in self._behaviours:
            poses = behaviour.begin_leg(self._legs[leg], t)
            if poses is None:
                continue
            self._laid.restart(behaviour.members, t, poses)
            until = self._count * PERIOD
            if until > t + _SAME and not isinstance(behaviour, CompiledBehaviour):
                self._laid.lay(behaviour.members, until, behaviour.step(t, until, self._scene(t)))

    def see(self, member: int, t: float, period: float, way: FloatArray) -> None:
        """In the `period` [s] from time `t` [s] on robot `member` drives along `way` (n + 1, 3 or more), as its own track says already."""
        if not self.several:
            return
        body, poses = self._others + member, self._base(member, way)
        self._laid.cut(body, t + _SAME)
        self._laid.drive(body, t, period, poses)
        step = period / (len(way) - 1)
        self._laid.lay([body], t + period + _OVER, poses[-1:] + _OVER / step * (poses[-1:] - poses[-2:-1]))

    def halt(self, member: int, t: float, pose: FloatArray) -> None:
        """From time `t` [s] on robot `member` stands at `pose` (3,), for good."""
        track = self._robots[member].track
        track.cut(t)
        for when in (t, _EVER):
            track.lay(when, pose)
        if self.several:
            body = self._others + member
            self._laid.cut(body, t)
            for when in (t, _EVER):
                self._laid.lay([body], when, self._base(member, pose[None]))

    @property
    def decisions(self) -> int:
        """How often behaviours have decided."""
        return self._count

    @property
    def crowd(self) -> CompiledBehaviour:
        """The crowd, where it is `ridden_among`."""
        return self._crowds[0]

    @property
    def ridden_among(self) -> bool:
        """Whether one crowd is all who decide, and one robot drives among them: then `ride` is all that a period takes."""
        return self._together and not self.several

    def track(self, member: int) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Of robot `member`, as those see it who decide: knots (ROBOTS_ROOM, 4), and how many there are (1,)."""
        return self._driven.knots[member], self._driven.laid[member : member + 1]

    def among(self, ridden: Held[Ride]) -> Held[Among]:
        """The robot among the crowd, as `ride` takes it."""
        return hold_among(self.crowd.crowd, self.street, ridden)

    def ride(self, among: Held[Among], period: Period) -> tuple[int, bool]:
        """The robot drives for its control `period` while the crowd decides; what it hit, and whether nothing is worth being kept."""
        self._count, hit, far = ride_until(self.crowd, among, self.leg, self._count, period, self.arrivals)
        return hit, far

    def look(self) -> None:
        """The crowd's kernel has stopped, as there is something to see to: that is done."""
        look(self.crowd, self.arrivals)

    def decide_until(self, t: float) -> None:
        """All behaviours decide up to time `t` [s], and thereby for a little longer; each by what was there when it decided."""
        if self._together:
            self._count = decide_until(self.crowd, self.street, self.leg, self._count, t + _SAME, self.arrivals)
            return
        while self._behaviours and self._count * PERIOD <= t + _SAME:
            now, until = self._count * PERIOD, (self._count + 1) * PERIOD
            for crowd, street, arrivals in self._streets:
                decide_until(crowd, street, self.leg, self._count, now, arrivals)
            if self._crowds:  # the first of them has looked who is where
                scene = self._scene_of(now, self._there.copy())
            else:
                scene = self._scene(now)
                self.arrivals.look(now, scene.moving)
            chosen = [behaviour.step(now, until, scene) for behaviour in self._asked]
            for behaviour, poses in zip(self._asked, chosen, strict=True):
                self._laid.lay(behaviour.members, until, poses)
            self._count += 1

    def walk_on(self) -> tuple[dict[int, int], float]:
        """The trials are over: the robots are gone, and people walk on until each has come to where it was walking to, for
        `AFTER` at most.

        Returns:
            By person: that place, by number, see `Arrivals`; and until when they are waited for, s; NaN where a behaviour of theirs fails.
        """
        self._robots.clear()
        self._driven.laid[:] = 0
        over = self._count * PERIOD
        places = self.arrivals.bound_for(over)
        try:
            while self._count * PERIOD <= over + AFTER and not self.arrivals.come(places):
                self.decide_until(self._count * PERIOD)
        except BehaviourError:  # what the robots did is known
            return places, math.nan
        return places, over + AFTER

    def without(self, member: int) -> Around:
        """All that moves but robot `member`."""
        others = [m for m in range(len(self._since)) if not self.several or m != self._others + member]
        return Around(self, self._tracks, self._since, self._laid, others)

    def _base(self, member: int, poses: FloatArray) -> FloatArray:
        """(n, 3) where base_link is when its pivot is at `poses` (n, 3 or more)."""
        out, pivot = poses[:, :3].copy(), self._pivots[member]
        out[:, 0] -= pivot * np.cos(out[:, 2])
        out[:, 1] -= pivot * np.sin(out[:, 2])
        return out

    @property
    def street(self) -> Held[Street]:
        """Everything that moves, as the first crowd takes it."""
        return self._streets[0][1]

    @cached_property
    def _streets(self) -> list[tuple[CompiledBehaviour, Held[Street], Arrivals]]:
        """The crowds, and everything that moves as each takes it; the first of them sees who arrives."""
        streets = []
        for k, crowd in enumerate(self._crowds):
            there, arrivals = (np.empty_like(self._there), _NOBODY) if k else (self._there, self.arrivals)
            street = Street(self._tracks, self._since, self._decides, there, self._driven, arrivals.watched)
            streets.append((crowd, hold_street(street), arrivals))
        return streets

    def _scene(self, t: float) -> Scene:
        there = np.empty_like(self._there)
        place_twice(self._tracks, self.leg, self._since, t, t - PERIOD, there)
        return self._scene_of(t, there)

    def _scene_of(self, t: float, there: FloatArray) -> Scene:
        """At time `t` [s] all bodies are at there[0] (m, 3), and were at there[1] a `PERIOD` ago."""
        bound, free = np.empty((self._others, 3)), np.empty(self._others, np.bool_)
        bound_for(self._tracks, self._decides, t, bound, free)
        return Scene(there[0, : self._others], there[1, : self._others], bound, free, tuple(self._robots))


class Around:
    """What moves around one robot.

    Args:
        traffic: All of it.
        tracks: Of all of it.
        since: (m,) when the clock of each began, s.
        laid: Whose tracks are laid while the trial goes on.
        others: Which are not that robot.

    Attributes:
        tracks: Of the others.
        since: (k,) when the clock of each of them began, s.
    """

    def __init__(
        self, traffic: Traffic, tracks: Tracks, since: FloatArray, laid: LaidTracks, others: Sequence[int]
    ) -> None:
        self._traffic, self._all, self._all_since, self._laid, self._others = traffic, tracks, since, laid, others
        self._apart: npt.NDArray[np.int64] | None = None
        self.tracks, self.since = tracks, since
        if len(others) < len(since):
            self._apart = np.array(others, dtype=np.int64)
            rows = np.ascontiguousarray(tracks.rows[:, self._apart])
            self.tracks = Tracks(tracks.knots, rows, tracks.speed[self._apart], tracks.lasting[self._apart])
            self.since = since[self._apart]

    @property
    def leg(self) -> int:
        """Number of the first robot's leg."""
        return self._traffic.leg

    def now(self) -> None:
        """Take over what was laid since."""
        if self._apart is not None:
            self.tracks.rows[:] = self._all.rows[:, self._apart]
            self.tracks.speed[:] = self._all.speed[self._apart]
            self.since[:] = self._all_since[self._apart]

    def place(self, t: float, out: FloatArray) -> None:
        """Write where they are at time `t` [s] to `out` (k, 3), NaN where one is absent."""
        self.now()
        place(self.tracks, self.leg, self.since, t, out)

    def foreseen(self, k: int, t: float) -> FloatArray | None:
        """(2,) where number `k` is at time `t` [s] as it moves now, if it decides; None: its track says."""
        m = self._others[k]
        return self._laid.foreseen(m, t) if m in self._laid else None
