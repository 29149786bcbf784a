"""Who is where the lidar doesn't look, by sonars: each tells how far off the nearest in its cone is, and not where in it.

A lidar's tracker goes on telling of whoever went out of view as they went, which within a second says little of where they are. A sonar
that meets something in no map corrects the one who is expected there, in distance, and in bearing only as far as the cone has it; where
nobody is expected, there is somebody. Where its cone is free nobody is, whoever was expected there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.contract import Ranges, Scan
from clearway.geometry.compiled import kernel
from clearway.geometry.frames import compose
from clearway.geometry.shapes import FloatArray
from clearway.perception import kalman
from clearway.perception.bodies import Bodies
from clearway.perception.clusters import PERSON, IntArray, KnownStructure, Returns
from clearway.perception.rectangles import FIRST as PUSHED
from clearway.perception.structure import unseen

FIRST = PUSHED // 2
"""Identities from here on, up to those of what is pushed, are of those whom a sonar has found."""
DEEP = 0.1
"""m from what echoes to the middle of a person: between a shin that is met (0.06 m) and that of one who stands side on (0.15 m)."""
SPREAD = 0.08
"""Standard deviation of a place that a sonar tells, m."""
GATE = 0.5
"""So far from where they are expected somebody may be met, m."""
WALL = 0.05
"""What is no nearer than the map's structure less this is that, m."""
SHOWN = 0.2
"""What lies no farther from what the lidar shows, or showed, is that, m."""
GONE = 0.3
"""Nobody is where a cone is free for so much more, m."""
KEPT = 1.0
"""For so long somebody is told of whom no sensor shows any more, s."""


class _Tracks(NamedTuple):
    ids: IntArray  # (n,)
    state: FloatArray  # (n, 4)
    spread: FloatArray  # (n, 3)
    radius: FloatArray  # (n,)
    heard: FloatArray  # (n,) when a sonar met them last


class SonarFollower:
    """Follows those who are out of the lidar's view.

    Args:
        speed: Bound on their speed, m/s.
        acceleration: Bound on their acceleration, m/s^2.
        reach: How far the lidar's tracker looks, m.
    """

    def __init__(self, speed: float, acceleration: float, reach: float) -> None:
        self._speed, self._acceleration, self._reach = speed, kalman.SPREAD * acceleration, reach
        self._t, self._unused = math.nan, FIRST
        self._tracks = _Tracks(np.empty(0, np.int64), np.empty((0, 4)), np.empty((0, 3)), np.empty(0), np.empty(0))
        self._gone: set[int] = set()  # of those that the lidar's tracker still tells of

    def update(
        self, sonars: Ranges | None, scan: Scan, returns: Returns, bodies: Bodies, standing: FloatArray,
        odom: FloatArray, pose: FloatArray, known: KnownStructure, t: float,
    ) -> Bodies:  # fmt: skip
        """`bodies` at time `t` [s], those out of the lidar's view as the sonars have them.

        Args:
            sonars: What they measured; None: nothing new.
            scan: The lidar's.
            returns: Of it.
            bodies: That its tracker tells of.
            standing: (n, 3) discs of what stands.
            odom: (3,) pose of base_link in the frame of all these.
            pose: (3,) the same in the map's.
            known: What the map shows.
            t: See above.
        """
        dt, self._t = t - self._t if t > self._t else 0.0, t
        view = (
            returns.sensor,
            scan.angle_min,
            (len(scan.ranges) - 1) * scan.angle_increment,
            scan.range_min,
            self._reach,
        )
        kalman.predict(self._tracks.state, self._tracks.spread, dt, self._acceleration)
        hidden = unseen(bodies.x, *view) & (bodies.identity < FIRST)
        told = bodies.identity[hidden]
        self._gone &= set(told.tolist())
        now = self._tracks
        kept = unseen(now.state, *view) & (np.isin(now.ids, told) | (t - now.heard <= KEPT))
        new = hidden & ~np.isin(bodies.identity, [*now.ids, *self._gone])
        fresh = _Tracks(
            bodies.identity[new],
            np.column_stack((bodies.x[new], bodies.v[new])),
            np.column_stack((_variance(bodies.error[new]), np.zeros(new.sum()), _variance(bodies.v_error[new]))),
            bodies.radius[new],
            np.full(new.sum(), -math.inf),
        )
        now = _Tracks._make(np.concatenate((a[kept], b)) for a, b in zip(now, fresh, strict=True))
        if sonars is not None:
            shown = np.concatenate((np.column_stack((bodies.x, bodies.radius))[~hidden], standing))
            for mount, distance in zip(sonars.mounts, sonars.ranges.tolist(), strict=True):
                wall = structure_within(compose(pose, mount), 0.5 * sonars.field, sonars.range_max, known)
                now = self._hear(now, compose(odom, mount), distance, 0.5 * sonars.field, wall, shown, t)
        self._tracks = now
        return bodies._replace(
            x=np.concatenate((bodies.x[~hidden], now.state[:, :2])),
            v=np.concatenate((bodies.v[~hidden], now.state[:, 2:])),
            radius=np.concatenate((bodies.radius[~hidden], now.radius)),
            error=np.concatenate((bodies.error[~hidden], kalman.SIGMAS * np.sqrt(now.spread[:, 0]))),
            v_error=np.concatenate((bodies.v_error[~hidden], kalman.SIGMAS * np.sqrt(now.spread[:, 2]))),
            identity=np.concatenate((bodies.identity[~hidden], now.ids)),
        )

    def _hear(
        self, now: _Tracks, at: FloatArray, distance: float, half: float, wall: float, shown: FloatArray, t: float
    ) -> _Tracks:
        """Those `now` and one more at most, after the sonar at `at` (3,) met the nearest at `distance` [m] within `half` [rad] of its
        heading; the map's structure begins at `wall` [m], and what the lidar shows is `shown` (n, 3)."""
        off = now.state[:, :2] - at[:2]
        bearing = np.remainder(np.arctan2(off[:, 1], off[:, 0]) - at[2] + math.pi, 2.0 * math.pi) - math.pi
        absent = (np.abs(bearing) < half) & (np.hypot(*off.T) < min(distance, wall) - GONE)
        self._gone |= set(now.ids[absent].tolist())
        now = _Tracks._make(a[~absent] for a in now)
        if distance >= wall - WALL:
            return now
        aim = at[2] + np.append(np.clip(bearing[~absent], -half, half), 0.0)  # of each, and of somebody new
        places = at[:2] + (distance + DEEP) * np.column_stack((np.cos(aim), np.sin(aim)))
        apart = np.hypot(*(places[:-1] - now.state[:, :2]).T)
        if apart.min(initial=math.inf) <= GATE:
            i = int(apart.argmin())
            x, y = places[i].tolist()
            kalman.correct(now.state, now.spread, i, x, y, SPREAD**2)
            now.heard[i] = t
            return now
        x, y = places[-1].tolist()
        if (np.hypot(shown[:, 0] - x, shown[:, 1] - y) < shown[:, 2] + SHOWN).any():
            return now
        state, spread = np.zeros((1, 4)), np.zeros((1, 3))
        kalman.begin(state, spread, 0, x, y, (2.0 * SPREAD) ** 2, self._speed)
        one = _Tracks(np.array([self._unused]), state, spread, np.array([PERSON]), np.array([t]))
        self._unused += 1
        return _Tracks._make(np.concatenate((a, b)) for a, b in zip(now, one, strict=True))


def _variance(bound: FloatArray) -> FloatArray:
    return (bound / kalman.SIGMAS) ** 2


@kernel
def structure_within(at: FloatArray, half: float, most: float, known: KnownStructure) -> float:
    """How far off the nearest `known` structure is within `half` [rad] of the heading of `at` (3,), m; `most`, if it is farther."""
    rows, columns = known.cells.shape
    step = known.resolution
    for k in range(1, math.ceil(most / step) if rows else 0):
        d = k * step
        n = max(1, math.ceil(half * k))
        for i in range(-n, n + 1):
            a = at[2] + half * i / n
            column = math.floor((at[0] + d * math.cos(a) - known.origin[0]) / step)
            row = math.floor((at[1] + d * math.sin(a) - known.origin[1]) / step)
            if 0 <= row < rows and 0 <= column < columns and known.cells[row, column]:
                return d
    return most
