"""Which clusters of a scan are bodies that move, and how they move."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from clearway.contract import Scan
from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray
from clearway.perception import kalman
from clearway.perception.clusters import ClusterParameters, IntArray, Returns, cores
from clearway.perception.seen_through import share_seen_through
from clearway.perception.structure import unseen
from clearway.robots import Robot

MARGIN = 0.02
"""m, beyond the noise of two ranges, by which a beam must go beyond a place to have seen through it."""
PERSISTENCE = 3
"""Periods in a row in which that must be so."""
SHARE = 0.25
"""Share of a body's returns that must have come to a free place, or gone from one, before it is said to move."""
CENTRE = 0.75
"""Standard deviation of a circle's centre along the line of sight over that of a range: measured on discs and squares
of 0.2 to 0.6 m at 1.5 to 3.5 m; across it is a fifth of that."""
SHIFT = 2.5
"""How far the centre of a circle may shift over how much its radius changes: of a square, from two faces in view to
one, 0.5 e over 0.21 e."""
EDGE = 0.15
"""rad: a body whose centre lies within this of the edge of the view may have left it."""
LATCH = 1.0
"""s for which a body that was seen to move is still one that moves."""
PART = 5.0
"""A body that is cut by the edge of the view or by something nearer goes on counting as moving for so long after it last showed
that it does, s; then it has to show it again, else one who once was taken for moving and is seen in part would for ever."""


class Bodies(NamedTuple):
    """Bodies that move, in the frame of the returns, and what is left.

    Attributes:
        x: (n, 2) m.
        v: (n, 2) m/s.
        radius: (n,) m.
        error: (n,) bound on the error of `x`, m.
        v_error: (n,) bound on the error of `v`, m/s.
        identity: (n,) from 0.
        structure: (k,) uint8, which clusters are not among them.
        slowest: Bound on how fast structure that is in no map may be moving, m/s.
        cores: (c, 3) discs inside those structures that could be bodies.
        core_identity: (c,) of the cores, the same over time.
    """

    x: FloatArray
    v: FloatArray
    radius: FloatArray
    error: FloatArray
    v_error: FloatArray
    identity: IntArray
    structure: npt.NDArray[np.uint8]
    slowest: float
    cores: FloatArray
    core_identity: IntArray


class Follower(Protocol):
    """Follows the bodies in a series of scans."""

    def update(self, returns: Returns, scan: Scan, t: float) -> Bodies:
        """The bodies at time `t` [s]; `returns` in a frame that does not move."""


class _Candidates(NamedTuple):
    rows: IntArray  # of the clusters that may be bodies
    circle: FloatArray  # (n, 3)
    variance: FloatArray  # (n,) of a coordinate of the centre, m^2
    cut: npt.NDArray[np.bool_]  # (n,) only a part of it is in view
    legs: npt.NDArray[np.bool_]  # (n,) it is two legs


def _candidates(returns: Returns, scan: Scan, p: ClusterParameters, sigma: float) -> _Candidates:
    """Clusters that are in no map and no larger than a body."""
    k = len(returns.size)
    unknown = np.ones(k, dtype=np.bool_)
    unknown[returns.label[returns.known != 0]] = False
    rows = np.flatnonzero(unknown & (returns.size >= p.body_returns) & (returns.circles[:, 2] <= p.body_radius))
    if len(rows) > p.discs // 4:
        rows = np.sort(rows[np.argsort(returns.far[rows], kind="stable")[: p.discs // 4]])
    spacing = scan.angle_increment * returns.far[rows]
    variance = (CENTRE * sigma) ** 2 + spacing**2 / 12.0
    return _Candidates(rows, returns.circles[rows], variance, returns.cut[rows] != 0, returns.legs[rows] != 0)


class DifferenceFollower:
    """Finite differences from one scan to the next; every cluster that may be a body is one that moves."""

    def __init__(self, robot: Robot, parameters: ClusterParameters, speed: float, acceleration: float) -> None:
        assert robot.lidar is not None
        self._p, self._sigma, self._speed, self._acceleration = parameters, robot.lidar.sigma, speed, acceleration
        self._t, self._next = math.nan, 0
        self._before, self._error, self._ids = np.empty((0, 2)), np.empty(0), np.empty(0, dtype=np.int64)

    def update(self, returns: Returns, scan: Scan, t: float) -> Bodies:
        """See `Follower`. A body belongs to the nearest one of the last scan that it can have come from."""
        found = _candidates(returns, scan, self._p, self._sigma)
        n, dt = len(found.rows), t - self._t
        x = np.ascontiguousarray(found.circle[:, :2])
        error = kalman.SIGMAS * np.sqrt(found.variance)
        v, v_error = np.zeros((n, 2)), np.full(n, np.inf)
        partner = np.full(n, -1, dtype=np.int64)
        if dt > 0.0:
            partner = kalman.nearest_pairs(self._before, self._error + self._speed * dt, x, error)
            old = partner >= 0
            at = partner[old]
            v[old] = (x[old] - self._before[at]) / dt
            v_error[old] = (error[old] + self._error[at]) / dt + 0.5 * math.sqrt(2.0) * self._acceleration * dt
        ids = np.where(partner >= 0, self._ids[partner] if len(self._ids) else -1, -1)
        fresh = ids < 0
        ids[fresh] = self._next + np.arange(fresh.sum())
        self._next += int(fresh.sum())
        self._t, self._before, self._error, self._ids = t, x, error, ids
        structure = np.ones(len(returns.size), dtype=np.uint8)
        structure[found.rows] = 0
        none = np.empty(0, dtype=np.int64)
        return Bodies(x, v, found.circle[:, 2].copy(), error, v_error, ids, structure, math.inf, np.empty((0, 3)), none)


class _Past(NamedTuple):
    t: float
    scan: Scan
    sensor: FloatArray
    points: FloatArray
    body: IntArray  # (m,) identity of the body of each point, -1: none


class BodyFollower:
    """A Kalman filter for each cluster that may be a body; it moves if space has shown so (see `seen_through`).

    What is not seen to move is structure, whatever its cluster's centre does while more of it comes into view.
    """

    def __init__(
        self, robot: Robot, parameters: ClusterParameters, speed: float, acceleration: float,
        memory: float, coast: float, aside: float, watch: float,
    ) -> None:  # fmt: skip
        assert robot.lidar is not None
        self._p, self._sigma, self._speed, self._acceleration = parameters, robot.lidar.sigma, speed, acceleration
        self._memory, self._coast, self._aside, self._watch = memory, coast, aside, watch
        self._margin = MARGIN + kalman.SIGMAS * math.sqrt(2.0) * self._sigma
        self._odometry = robot.odometry
        self._t, self._next = math.nan, 0
        self._past: deque[_Past] = deque()
        self._ids = np.empty(0, dtype=np.int64)
        self._state, self._spread = np.empty((0, 4)), np.empty((0, 3))
        self._radius, self._seen = np.empty(0), np.empty(0)
        self._moved, self._shown = (
            np.empty(0),
            np.empty(0),
        )  # when it last counted as moving, and when it last showed so
        self._largest = np.empty(0)  # radius that each body has shown
        self._signs = np.empty(0, dtype=np.int64)  # periods in a row with signs of motion
        self._paired = np.empty(0, dtype=np.int64)  # periods in a row with two legs

    def update(self, returns: Returns, scan: Scan, t: float) -> Bodies:
        """See `Follower`."""
        if not t > self._t:  # the first one
            self._t = t
        dt, self._t = t - self._t, t
        found = _candidates(returns, scan, self._p, self._sigma)
        at = self._associate(found, dt, t)
        body = np.full(len(returns.size), -1, dtype=np.int64)
        body[found.rows] = self._ids[at]
        owner = body[returns.label] if len(returns.label) else np.empty(0, dtype=np.int64)
        self._notice(returns, scan, owner, t)
        self._paired[at] = np.where(found.legs, self._paired[at] + 1, 0)
        people = self._paired >= PERSISTENCE  # who stands on two legs may walk off at any time
        self._moved[people] = self._shown[people] = t
        self._past.append(_Past(t, scan, returns.sensor, returns.points, owner))
        while self._past[0].t < t - self._watch - 1e-9:
            self._past.popleft()

        moves = self._seen - self._moved <= LATCH
        here = np.zeros(len(self._ids), dtype=np.bool_)
        here[at] = True
        structure = np.ones(len(returns.size), dtype=np.uint8)
        still = ~moves[at]
        structure[found.rows[~still]] = 0
        inside = cores(returns.points, returns.label, returns.circles, returns.sensor, found.rows[still])
        told = moves & (here | (t - self._seen <= self._coast) | self._out_of_view(scan, returns.sensor, t))
        x, radius = self._state[:, :2].copy(), np.maximum(self._radius, self._largest)
        error = kalman.SIGMAS * np.sqrt(self._spread[:, 0])
        whole = ~found.cut
        x[at[whole]] = found.circle[whole, :2]  # the disc covers the returns
        error[at[whole]] = kalman.SIGMAS * np.sqrt(found.variance[whole])
        self._largest[at[whole]] = np.maximum(self._largest[at[whole]], found.circle[whole, 2])
        behind = self._largest[at[whole]] - found.circle[whole, 2]  # as large as it was, as near as the returns allow
        sight = found.circle[whole, :2] - returns.sensor[:2]
        x[at[whole]] += sight * (behind / np.maximum(np.hypot(*sight.T), 1e-9))[:, None]
        radius[at[whole]] = self._largest[at[whole]]
        part, seen = at[found.cut], found.circle[found.cut]
        radius[part] = np.maximum(radius[part], np.hypot(*(x[part] - seen[:, :2]).T) + seen[:, 2])
        rows = np.flatnonzero(told)
        v_error = kalman.SIGMAS * np.sqrt(self._spread[rows, 2]) + self._radius[rows] * self._turning(rows, t)
        watched = t - self._past[0].t
        hidden = self._margin + SHARE * 2.0 * self._p.body_radius  # so far it may have gone without a sign
        slowest = hidden / watched if watched >= 0.5 * self._watch else math.inf
        return Bodies(
            x[rows], self._state[rows, 2:].copy(), radius[rows], error[rows], v_error,
            self._ids[rows], structure, slowest, inside, self._ids[at[still]],
        )  # fmt: skip

    def _out_of_view(self, scan: Scan, sensor: FloatArray, t: float) -> npt.NDArray[np.bool_]:
        """Which bodies the sensor has turned away from not long ago: all that is known is how they moved."""
        discs = np.column_stack((self._state[:, :2], self._radius))
        field = (len(scan.ranges) - 1) * scan.angle_increment - 2.0 * EDGE
        away = unseen(discs, sensor, scan.angle_min + EDGE, field, scan.range_min, self._p.range_limit)
        return away & (t - self._seen <= self._aside)

    def _turning(self, rows: IntArray, t: float) -> FloatArray:
        """How fast [rad/s] the side changes from which each body is seen: its circle shifts on it by as many radii."""
        first, now = self._past[0], self._past[-1]
        way = (now.sensor - first.sensor)[:2] / (t - first.t) if t > first.t else np.zeros(2)
        r, v = self._state[rows, :2] - now.sensor[:2], self._state[rows, 2:] - way
        rate: FloatArray = np.abs(r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]) / np.maximum((r * r).sum(axis=1), 1e-2)
        return rate

    def _associate(self, found: _Candidates, dt: float, t: float) -> IntArray:
        """Advance the filters, correct those that are seen, begin new ones, drop old ones; the filter of each cluster."""
        state, spread = self._state, self._spread
        kalman.predict(state, spread, dt, kalman.SPREAD * self._acceleration)
        x = np.ascontiguousarray(found.circle[:, :2])
        reach = kalman.SIGMAS * np.sqrt(spread[:, 0]) + 0.5 * self._radius
        partner = kalman.nearest_pairs(
            np.ascontiguousarray(state[:, :2]), np.minimum(reach, self._p.body_radius),
            x, kalman.SIGMAS * np.sqrt(found.variance) + 0.5 * found.circle[:, 2],
        )  # fmt: skip
        before = self._seen.copy()
        for j, i in enumerate(partner.tolist()):
            if i < 0:
                continue
            self._seen[i] = t
            if found.cut[j]:  # its centre is as far from the part's as the radii differ, or nearer: 2 sigma
                self._radius[i] = max(self._radius[i], found.circle[j, 2])
                hidden = self._radius[i] - found.circle[j, 2]
                v, vv = state[i, 2:].copy(), spread[i, 2]
                kalman.correct(state, spread, i, x[j, 0], x[j, 1], found.variance[j] + 0.25 * hidden * hidden)
                state[i, 2:], spread[i, 1], spread[i, 2] = v, 0.0, vv  # the part's motion is not the body's
                if before[i] - self._moved[i] <= LATCH and t - self._shown[i] <= PART:
                    self._moved[i] = t  # of a part one can't tell that it stands
                continue
            grown = abs(found.circle[j, 2] - self._radius[i])
            if grown > 2.0 * math.sqrt(
                found.variance[j]
            ):  # another side is in view: the same body, another point of it
                state[i, :2], spread[i, 0], spread[i, 1] = x[j], found.variance[j], 0.0
            else:
                kalman.correct(state, spread, i, x[j, 0], x[j, 1], found.variance[j] + (SHIFT * grown) ** 2)
            self._radius[i] = found.circle[j, 2]
        fresh = np.flatnonzero(partner < 0)
        keep = np.flatnonzero(t - self._seen <= max(self._memory, self._aside))
        moved_to = np.full(len(self._ids) + 1, -1, dtype=np.int64)
        moved_to[keep] = np.arange(len(keep))
        at: IntArray = moved_to[partner]
        at[fresh] = len(keep) + np.arange(len(fresh))
        more = len(fresh)
        self._state = np.concatenate((state[keep], np.zeros((more, 4))))
        self._spread = np.concatenate((spread[keep], np.zeros((more, 3))))
        for j in fresh.tolist():
            kalman.begin(self._state, self._spread, int(at[j]), x[j, 0], x[j, 1], found.variance[j], self._speed)
        self._ids = np.concatenate((self._ids[keep], self._next + np.arange(more)))
        self._next += more
        self._radius = np.concatenate((self._radius[keep], found.circle[fresh, 2]))
        self._largest = np.concatenate((self._largest[keep], np.zeros(more)))
        self._seen = np.concatenate((self._seen[keep], np.full(more, t)))
        self._moved = np.concatenate((self._moved[keep], np.full(more, -math.inf)))
        self._shown = np.concatenate((self._shown[keep], np.full(more, -math.inf)))
        self._signs = np.concatenate((self._signs[keep], np.zeros(more, dtype=np.int64)))
        self._paired = np.concatenate((self._paired[keep], np.zeros(more, dtype=np.int64)))
        return at

    def _notice(self, returns: Returns, scan: Scan, owner: IntArray, t: float) -> None:
        """Note which bodies have moved since the oldest scan that is kept and the one half as old."""
        if not self._past or not len(self._ids):
            return
        half = min(self._past, key=lambda p: abs(p.t - (t - 0.5 * self._watch)))
        sign = np.zeros(len(self._ids), dtype=np.bool_)
        for past in {id(p): p for p in (self._past[0], half)}.values():
            margin, slack = self._doubt(past.sensor, returns.sensor)
            arrived = self._shares(returns.points, owner, past.scan, past.sensor, margin, slack)
            gone = self._shares(past.points, past.body, scan, returns.sensor, margin, slack)
            sign |= (arrived >= SHARE) | (gone >= SHARE)
        self._signs = np.where(sign, self._signs + 1, 0)
        self._moved[self._signs >= PERSISTENCE] = self._shown[self._signs >= PERSISTENCE] = t

    def _doubt(self, a: FloatArray, b: FloatArray) -> tuple[float, float]:
        """How far beyond a place a beam must go, and how far to either side [rad], for the odometry's error (3 sigma)
        on the way between two poses of the sensor."""
        o, way, turn = self._odometry, math.hypot(b[0] - a[0], b[1] - a[1]), abs(wrap(b[2] - a[2]))
        rotation = math.hypot(o.rotation_per_metre * math.sqrt(way), o.rotation_per_radian * math.sqrt(turn))
        lost = o.translation_per_metre * math.sqrt(way) + o.scale * way
        return self._margin + kalman.SIGMAS * lost, kalman.SIGMAS * (rotation + o.turning * turn + o.curvature * way)

    def _shares(
        self, points: FloatArray, body: IntArray, scan: Scan, sensor: FloatArray, margin: float, slack: float
    ) -> FloatArray:
        """The share of each body's points that `scan`, taken at `sensor`, looked through."""
        return share_seen_through(
            points, body, self._ids, scan.ranges, sensor, scan.angle_min, scan.angle_increment, scan.range_max, margin, slack,
        )  # fmt: skip
