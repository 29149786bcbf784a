"""Which clusters of a scan are bodies that move, and how they move."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from clearway.contract import Scan
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, uncompiled
from clearway.geometry.shapes import FloatArray
from clearway.perception import kalman
from clearway.perception.candidates import EXACT, Candidates, found_in, rounded, sizes_of
from clearway.perception.clusters import PERSON, ClusterParameters, IntArray, Returns, middle_of_leg
from clearway.perception.covering import cores
from clearway.perception.seen_through import share_seen_through
from clearway.perception.structure import unseen
from clearway.robots import Robot

MARGIN = 0.02
"""m, beyond the noise of two ranges, by which a beam must go beyond a place to have seen through it."""
PERSISTENCE = 3
"""Periods in a row in which that must be so."""
SHARE = 0.25
"""Share of a body's returns that must have come to a free place, or gone from one, before it is said to move."""
SHIFT = 2.5
"""How far the centre of a circle may shift over how much its radius changes: of a square, from two faces in view to
one, 0.5 e over 0.21 e."""
EDGE = 0.15
"""rad: a body whose centre lies within this of the edge of the view may have left it."""
LATCH = 1.0
"""s for which a body that was seen to move is still one that moves."""
SURE, SLOW = 4.0, 0.05
"""A round body moves at the first sign of it, if its speed is beyond so many standard deviations and so many m/s, by which
odometry may err. By that alone posts that stand side by side moved, as now one is in view and now the next."""
GAIT = 0.03
"""m: standard deviation of the middle between two legs about the body's, along either axis: who walks swings them. A step lasts
several scans, so that no filter averages it out: it counts in the bound again."""
CALM, ADAPTS, EXPECTED = 0.5, 0.7, 0.5
"""Who walks evenly is taken for calm: the acceleration assumed of a walker falls, to this share of it at least, by this rate in each
scan while the squared normalised innovation is less than expected, and grows while it is more (Bar-Shalom, Li, Kirubarajan 2001,
section 11.2.1, continuous adjustment of the noise level)."""
SLIM = 1.05
"""Times a person's radius: what a lidar that sees legs sees move, no wider than that, is taken for somebody on two; a robot's
front is wider."""
PART = 5.0
"""A body that is cut by the edge of the view or by something nearer goes on counting as moving for so long after it last showed
that it does, s; then it has to show it again, else one who once was taken for moving and is seen in part would for ever."""
_wrap = uncompiled(wrap)


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


class DifferenceFollower:
    """Finite differences from one scan to the next; every cluster that may be a body is one that moves."""

    def __init__(self, robot: Robot, parameters: ClusterParameters, speed: float, acceleration: float) -> None:
        assert robot.lidar is not None
        self._p, self._sigma, self._speed, self._acceleration = parameters, robot.lidar.sigma, speed, acceleration
        self._t, self._next = math.nan, 0
        self._before, self._error, self._ids = np.empty((0, 2)), np.empty(0), np.empty(0, dtype=np.int64)
        self._sizes = sizes_of(robot, parameters)

    def update(self, returns: Returns, scan: Scan, t: float) -> Bodies:
        """See `Follower`. A body belongs to the nearest one of the last scan that it can have come from."""
        found = found_in(returns, scan, self._p, self._sigma)
        n, dt = len(found.rows), t - self._t
        new = np.full(n, -1, dtype=np.int64)
        unknown = np.empty(0)
        rounded(found, returns, new, unknown, unknown, self._sizes, max(self._sigma, EXACT))
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
    ranges: FloatArray  # (n,) and how they lay
    angle_min: float
    increment: float
    range_max: float
    sensor: FloatArray
    points: FloatArray
    body: IntArray  # (m,) identity of the body of each point, -1: none


class _Filters(NamedTuple):
    ids: IntArray  # (n,) sorted
    state: FloatArray  # (n, 4)
    spread: FloatArray  # (n, 3)
    radius: FloatArray  # (n,)
    largest: FloatArray  # (n,) radius that it has shown
    seen: FloatArray  # (n,) when it was seen last
    moved: FloatArray  # (n,) when it last counted as moving
    shown: FloatArray  # (n,) when it last showed that it does
    signs: IntArray  # (n,) periods in a row with signs of motion
    disc: FloatArray  # (n,) radius of one that is round, m
    doubt: FloatArray  # (n,) variance of that, m^2; inf: it isn't, or nobody knows
    restless: FloatArray  # (n,) of somebody on two legs, share of a walker's acceleration that they show; 0: nobody on two legs


@kernel
def _no_filters(n: int) -> _Filters:
    """So many, of which nothing is known."""
    return _Filters(
        np.zeros(n, dtype=np.int64), np.zeros((n, 4)), np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n),
        np.full(n, -math.inf), np.full(n, -math.inf), np.zeros(n, dtype=np.int64), np.zeros(n), np.full(n, math.inf), np.zeros(n),
    )  # fmt: skip


class _Assumed(NamedTuple):
    spread: float  # standard deviation of an acceleration, m/s^2
    walking: float  # the same of somebody on two legs
    speed: float  # bound, m/s
    least_radius: float  # of a round body, m
    body_radius: float  # of the largest body, m
    range_limit: float  # m
    memory: float  # s, all three
    coast: float
    aside: float


class BodyFollower:
    """A Kalman filter for each cluster that may be a body; it moves if space has shown so (see `seen_through`).

    What is not seen to move is structure, whatever its cluster's centre does while more of it comes into view.
    """

    def __init__(
        self, robot: Robot, parameters: ClusterParameters, speed: float, acceleration: float, walking: float,
        memory: float, coast: float, aside: float, watch: float,
    ) -> None:  # fmt: skip
        assert robot.lidar is not None
        self._p, self._sigma, self._watch = parameters, robot.lidar.sigma, watch
        self._margin = MARGIN + kalman.SIGMAS * math.sqrt(2.0) * self._sigma
        self._hidden = self._margin + SHARE * 2.0 * parameters.body_radius  # so far one may have gone without a sign
        self._assumed = _Assumed(
            kalman.SPREAD * acceleration, kalman.SPREAD * walking, speed, *sizes_of(robot, parameters), parameters.range_limit,
            max(memory, aside), coast, aside,
        )  # fmt: skip
        self._odometry = robot.odometry
        self._t, self._unused = math.nan, 0
        self._past: deque[_Past] = deque()
        self._filters = _no_filters(0)

    def update(self, returns: Returns, scan: Scan, t: float) -> Bodies:
        """See `Follower`."""
        if not t > self._t:  # the first one
            self._t = t
        dt, self._t = t - self._t, t
        found = found_in(returns, scan, self._p, self._sigma)
        self._filters, at, owner, self._unused = _associate(
            self._filters, found, returns, self._unused, self._assumed, max(self._sigma, EXACT), dt, t
        )  # fmt: skip
        now = _Past(
            t, scan.ranges, scan.angle_min, scan.angle_increment, scan.range_max, returns.sensor, returns.points, owner
        )  # fmt: skip
        sign = np.zeros(len(self._filters.ids), dtype=np.bool_)
        if self._past:  # the oldest scan that is kept and the one half as old
            half = min(self._past, key=lambda p: abs(p.t - (t - 0.5 * self._watch)))
            for past in (self._past[0],) if half is self._past[0] else (self._past[0], half):
                _notice(sign, self._filters.ids, past, now, *self._doubt(past.sensor, now.sensor))
        self._past.append(now)
        while self._past[0].t < t - self._watch - 1e-9:
            self._past.popleft()
        first = self._past[0]
        watched = t - first.t
        way = (now.sensor - first.sensor)[:2] / watched if watched > 0.0 else np.zeros(2)
        return _tell(
            self._filters, sign, returns, found, at, self._assumed, way, t, scan.angle_min + EDGE,
            (len(scan.ranges) - 1) * scan.angle_increment - 2.0 * EDGE, scan.range_min,
            self._hidden / watched if watched >= 0.5 * self._watch else math.inf,
        )  # fmt: skip

    def _doubt(self, a: FloatArray, b: FloatArray) -> tuple[float, float]:
        """How far beyond a place a beam must go, and how far to either side [rad], for the odometry's error (3 sigma)
        on the way between two poses of the sensor."""
        o, (ax, ay, a_yaw), (bx, by, b_yaw) = self._odometry, a.tolist(), b.tolist()
        way, turn = math.hypot(bx - ax, by - ay), abs(_wrap(b_yaw - a_yaw))
        rotation = math.hypot(o.rotation_per_metre * math.sqrt(way), o.rotation_per_radian * math.sqrt(turn))
        lost = o.translation_per_metre * math.sqrt(way) + o.scale * way
        return self._margin + kalman.SIGMAS * lost, kalman.SIGMAS * (rotation + o.turning * turn + o.curvature * way)


@kernel
def _associate(
    before: _Filters, found: Candidates, returns: Returns, unused: int, p: _Assumed, sigma: float, dt: float, t: float
) -> tuple[_Filters, IntArray, IntArray, int]:  # fmt: skip
    """Advance the filters, correct those that are seen, drop old ones, begin new ones.

    Args:
        before: The filters; they change.
        found: What may be bodies.
        returns: What was seen.
        unused: The first identity that was never given.
        p: What is assumed.
        sigma: Standard deviation of a range, m.
        dt: Time since the last period, s.
        t: Now, s.

    Returns:
        The filters now; which belongs to each candidate; the identity of each return's body (m,), -1: none; `unused` now.
    """
    ids, state, spread, radius, largest, seen, moved, shown, signs, disc, doubt, restless = before
    label, clusters = returns.label, returns.size.shape[0]
    circle, variance = found.circle, found.variance
    n, m = ids.shape[0], variance.shape[0]
    kalman.predict(state, spread, dt, np.where(restless > 0.0, p.walking * restless, p.spread))
    reach = np.minimum(kalman.SIGMAS * np.sqrt(spread[:, 0]) + 0.5 * radius, p.body_radius)
    at = kalman.nearest_pairs(state, reach, circle, kalman.SIGMAS * np.sqrt(variance) + 0.5 * circle[:, 2])
    of_radius = rounded(found, returns, at, disc, doubt, (p.least_radius, p.body_radius), sigma)
    fresh = 0
    for j in range(m):
        i = at[j]
        if i < 0:
            fresh += 1
            continue
        _correct(before, i, found, j, of_radius[j], returns.sensor, t)
    keep = np.flatnonzero(t - seen <= p.memory)
    kept = keep.shape[0]
    new, place = _no_filters(kept + fresh), np.empty(n, dtype=np.int64)
    for k in range(kept):
        i = keep[k]
        place[i] = k
        new.ids[k], new.state[k], new.spread[k] = ids[i], state[i], spread[i]
        new.radius[k], new.largest[k], new.seen[k] = radius[i], largest[i], seen[i]
        new.moved[k], new.shown[k], new.signs[k] = moved[i], shown[i], signs[i]
        new.disc[k], new.doubt[k], new.restless[k] = disc[i], doubt[i], restless[i]
    body, k = np.full(clusters, -1, dtype=np.int64), kept
    for j in range(m):
        if at[j] >= 0:
            at[j] = place[at[j]]
        else:
            kalman.begin(new.state, new.spread, k, circle[j, 0], circle[j, 1], variance[j], p.speed)
            new.ids[k], new.radius[k], new.seen[k] = unused + k - kept, circle[j, 2], t
            new.disc[k], new.doubt[k], new.restless[k] = circle[j, 2], of_radius[j], 1.0 if found.legs[j] else 0.0
            at[j] = k
            k += 1
        body[found.rows[j]] = new.ids[at[j]]
    return new, at, body[label], unused + fresh


@kernel
def _correct(
    filters: _Filters, i: int, found: Candidates, j: int, of_radius: float, sensor: FloatArray, t: float
) -> None:  # fmt: skip
    """Take candidate `j` into filter `i`; the radius has the variance `of_radius` [m^2], inf where that says nothing."""
    _, state, spread, radius, largest, seen, moved, shown, _, disc, doubt, restless = filters
    (x, y, r), variance = found.circle[j], found.variance[j]
    if of_radius < math.inf:
        if doubt[i] < math.inf:  # its near side is where it was, however large it turns out
            dx, dy = x - sensor[0], y - sensor[1]
            deeper = (r - disc[i]) / max(math.hypot(dx, dy), 1e-9)
            state[i, 0] += deeper * dx
            state[i, 1] += deeper * dy
            kalman.correct(state, spread, i, x, y, variance)
        else:  # the same body, another point of it
            state[i, 0], state[i, 1], spread[i, 0], spread[i, 1] = x, y, variance, 0.0
        disc[i] = radius[i] = largest[i] = r
        doubt[i] = of_radius
    elif found.legs[j] or restless[i] > 0.0:
        missing = 0.0
        if found.legs[j]:
            largest[i] = 0.0
        else:  # one leg, both as one cluster, or with what is beside them
            missing = abs(PERSON - r)
            x, y = middle_of_leg(x, y, r, sensor)
        radius[i] = max(PERSON, r)
        variance += GAIT * GAIT + 0.25 * missing * missing
        off = ((x - state[i, 0]) ** 2 + (y - state[i, 1]) ** 2) / (2.0 * (spread[i, 0] + variance))
        share = restless[i] * math.exp(ADAPTS * (min(off, 4.0) - EXPECTED))
        restless[i] = min(max(share, CALM), 1.0) if restless[i] > 0.0 else 1.0
        kalman.correct(state, spread, i, x, y, variance)
    elif found.cut[j]:  # its centre is as far from the part's as the radii differ, or nearer: 2 sigma
        radius[i] = max(radius[i], r)
        hidden = radius[i] - r
        vx, vy, vv = state[i, 2], state[i, 3], spread[i, 2]
        kalman.correct(state, spread, i, x, y, variance + 0.25 * hidden * hidden)
        state[i, 2], state[i, 3], spread[i, 1], spread[i, 2] = vx, vy, 0.0, vv  # the part's motion isn't the body's
        if seen[i] - moved[i] <= LATCH and t - shown[i] <= PART:
            moved[i] = t  # of a part one can't tell that it stands
    else:
        grown = abs(r - radius[i])
        if grown > 2.0 * math.sqrt(variance):  # another side is in view: the same body, another point of it
            state[i, 0], state[i, 1], spread[i, 0], spread[i, 1] = x, y, variance, 0.0
        else:
            kalman.correct(state, spread, i, x, y, variance + (SHIFT * grown) ** 2)
        radius[i] = r
    seen[i] = t


@kernel
def _notice(sign: npt.NDArray[np.bool_], ids: IntArray, past: _Past, now: _Past, margin: float, slack: float) -> None:
    """Note in `sign` (n,) which bodies (n,) have moved between two scans; for the doubt, see `share_seen_through`."""
    for points, body, scan in ((now.points, now.body, past), (past.points, past.body, now)):  # arrived, gone
        share = share_seen_through(
            points, body, ids, scan.ranges, scan.sensor, scan.angle_min, scan.increment, scan.range_max, margin, slack
        )  # fmt: skip
        for i in range(sign.shape[0]):
            sign[i] |= share[i] >= SHARE


@kernel
def _tell(
    filters: _Filters, sign: npt.NDArray[np.bool_], returns: Returns, found: Candidates, at: IntArray, p: _Assumed,
    way: FloatArray, t: float, angle_min: float, field: float, near: float, slowest: float,
) -> Bodies:  # fmt: skip
    """Which bodies move, and what is told of them.

    Args:
        filters: They change.
        sign: (n,) whether there were signs of motion.
        returns: What was seen.
        found: What may be bodies.
        at: The filter of each.
        p: What is assumed.
        way: (2,) the sensor's mean velocity while the bodies were watched, m/s.
        t: Now, s.
        angle_min: Where the view begins, without its edge, rad.
        field: How wide it is, rad.
        near: Shortest range, m.
        slowest: See `Bodies`.
    """
    state, n, sensor = filters.state, sign.shape[0], returns.sensor
    for i in range(n):
        filters.signs[i] = filters.signs[i] + 1 if sign[i] else 0
        if filters.signs[i] >= PERSISTENCE:
            filters.moved[i] = filters.shown[i] = t
            # what moves where legs are seen, and is no wider than two are, is mostly somebody
            slim = max(filters.radius[i], filters.largest[i]) <= SLIM * p.least_radius
            if slim and filters.doubt[i] == math.inf and filters.restless[i] == 0.0:
                filters.restless[i] = 1.0
    for j in range(at.shape[0]):
        i = at[j]
        speed, sure = math.hypot(state[i, 2], state[i, 3]), SURE * math.sqrt(filters.spread[i, 2]) + SLOW
        # who stands on two legs may walk off at any time; of what is round the centre shows whether it moves, once space has
        if found.legs[j] or (sign[i] and filters.doubt[i] < math.inf and not found.cut[j] and speed > sure):
            filters.moved[i] = filters.shown[i] = t
    moves = filters.seen - filters.moved <= LATCH
    walks = filters.restless > 0.0
    x, error = state[:, :2].copy(), kalman.SIGMAS * np.sqrt(filters.spread[:, 0] + np.where(walks, GAIT * GAIT, 0.0))
    radius = np.maximum(filters.radius, filters.largest)
    structure, still = np.ones(returns.size.shape[0], dtype=np.uint8), np.empty_like(at)
    told = moves & ((t - filters.seen <= p.coast) | _turned_away(filters, sensor, p, t, angle_min, field, near))
    m = 0
    for j in range(at.shape[0]):
        i, r = at[j], found.circle[j, 2]
        if moves[i]:
            structure[found.rows[j]], told[i] = 0, True
        else:
            still[m] = j
            m += 1
        if walks[i]:
            continue
        if found.cut[j]:
            apart = math.hypot(x[i, 0] - found.circle[j, 0], x[i, 1] - found.circle[j, 1])
            radius[i] = max(radius[i], apart + r)
            continue
        filters.largest[i] = radius[i] = max(filters.largest[i], r)
        error[i] = kalman.SIGMAS * math.sqrt(found.variance[j])
        dx, dy = found.circle[j, 0] - sensor[0], found.circle[j, 1] - sensor[1]
        behind = (radius[i] - r) / max(math.hypot(dx, dy), 1e-9)  # as large as it was, as near as the returns allow
        x[i, 0], x[i, 1] = found.circle[j, 0] + dx * behind, found.circle[j, 1] + dy * behind  # covers the returns
    still = still[:m]
    rows = np.flatnonzero(told)
    v_error = np.empty(rows.shape[0])
    for k in range(rows.shape[0]):
        i = rows[k]
        rx, ry, vx, vy = state[i, 0] - sensor[0], state[i, 1] - sensor[1], state[i, 2] - way[0], state[i, 3] - way[1]
        # another side of it comes into view, at so many rad/s: its circle shifts on it by as many radii
        turning = abs(rx * vy - ry * vx) / max(rx * rx + ry * ry, 1e-2)
        side = 0.0 if filters.doubt[i] < math.inf or walks[i] else filters.radius[i]
        v_error[k] = kalman.SIGMAS * math.sqrt(filters.spread[i, 2]) + side * turning
    inside = cores(returns.points, returns.label, returns.circles, sensor, found.rows[still])
    return Bodies(
        x[rows], state[rows, 2:].copy(), radius[rows], error[rows], v_error,
        filters.ids[rows], structure, slowest, inside, filters.ids[at[still]],
    )  # fmt: skip


@kernel
def _turned_away(
    filters: _Filters, sensor: FloatArray, p: _Assumed, t: float, angle_min: float, field: float, near: float
) -> npt.NDArray[np.bool_]:
    """Which bodies the sensor has turned away from not long ago: all that is known is how they moved."""
    return unseen(filters.state, sensor, angle_min, field, near, p.range_limit) & (t - filters.seen <= p.aside)
