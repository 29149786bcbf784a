"""Beds, wheelchairs and whatever else is pushed: rectangles of known sizes, found in scans and followed.

They are larger than a body, and no smallest circle tells where they are: another side comes into view, who stands before them cuts
them, and the middle of what is seen jumps. A rectangle of a known size has one place that fits (see `rectangle_fit`).
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
import numpy.typing as npt

from clearway.contract import Scan
from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray, rectangle, row_of_discs
from clearway.perception.bodies import Bodies
from clearway.perception.clusters import IntArray, Returns
from clearway.perception.kalman import SIGMAS
from clearway.perception.rectangle_fit import (
    CLOSE,
    OFF,
    RETURNS,
    SIDE,
    Rectangles,
    from_sides,
    nothing,
    predict,
    put,
    register,
)
from clearway.perception.seen_through import share_seen_through

SHOWN = 0.3
"""One that is followed is seen if so much of it is, m."""
SOON = 0.2
"""What it may have come farther than expected since the last scan, at most, m."""
PERSISTENCE = 3
"""Periods in a row in which it moves, or doesn't fit, until that counts."""
FASTER, FARTHER = 0.25, 0.25
"""It moves if it is faster than that and than three standard deviations, m/s, and has come farther, m."""
CAME = 0.12
"""Share of its returns that have to have come to a free place, or gone from one: of a bed that passes by side on few have."""
WATCH, ASIDE = 1.0, 0.05
"""How old the scan is that has to have looked through where it is now, s, and for how far to either side, rad: what odometry errs in that time."""
COASTS = 3.0
"""Out of view it is told for so long, s."""
KNOWN, AGAIN = 20.0, 1.5
"""And what is found within so many m of it for so many s is the same one."""
AT_FIRST = 0.3, 0.3, 0.2
"""The same of its velocity, m/s, m/s, rad/s."""
FIRST, PARTS = 1 << 20, 16
"""Identities of its discs: the first one's, and how many each may have."""
GOES_ON = 0.4
"""Speed at which one that stands, or gives way, is told to go on, m/s: who pushes it wants to. Whoever reckons with bounds and with
1 m/s^2 reckons with its standing too, as no bound is told below `CLOSE`."""
BULGE = 0.08
"""By which the discs that it is told as stick out of its longer sides at most, m."""


class RectangleFollower:
    """Follows rectangles in a series of scans.

    Args:
        sizes: (m, 2) lengths and widths of those that there are, m.
    """

    def __init__(self, sizes: FloatArray) -> None:
        self._sizes, self._t, self._unused = sizes, math.nan, 0
        self._followed = nothing(0)
        self._past: deque[tuple[float, Scan, FloatArray, FloatArray, IntArray]] = deque()
        self._moved: set[int] = set()

    def update(self, returns: Returns, scan: Scan, bodies: Bodies, t: float) -> tuple[Bodies, Returns]:
        """`bodies` at time `t` [s], those rectangles that have been seen to move among them instead of what was made of their returns; and
        `returns`, in which what stands beside one is no part of its clusters."""
        dt = t - self._t if t > self._t else 0.0
        self._t = t
        self._followed, self._unused = follow(self._followed, returns, self._sizes, self._unused, dt, t)
        now = self._followed
        told = now.way.any(axis=1) & (t - now.seen <= COASTS)
        self._watch(returns, scan, t)
        for i in np.flatnonzero(told).tolist():
            if int(now.identity[i]) in self._moved:
                bodies, returns = _with(bodies, returns, now, i)
        return bodies, returns

    def _watch(self, returns: Returns, scan: Scan, t: float) -> None:
        """Note which have come to where a scan before looked through, or gone from where this one does: what stands, and shows another
        side, never has."""
        now = self._followed
        owner = np.full(len(returns.points), -1, dtype=np.int64)
        for i in np.flatnonzero(now.seen == t).tolist():
            near = from_sides(now, i, returns.points, returns.sensor)[:, 0] < CLOSE
            owner[near & (returns.known == 0)] = now.identity[i]
        self._past.append((t, scan, returns.sensor, returns.points, owner))
        while self._past[0][0] < t - WATCH - 1e-9:
            self._past.popleft()
        doubted = np.array(sorted(set(now.identity[now.way.any(axis=1)].tolist()) - self._moved), dtype=np.int64)
        if not len(doubted):
            return
        before, latest = self._past[0], self._past[-1]
        for (_, _, _, points, own), (_, other, sensor, _, _) in ((latest, before), (before, latest)):
            share = share_seen_through(
                points, own, doubted, other.ranges, sensor, other.angle_min, other.angle_increment, other.range_max, OFF, ASIDE
            )  # fmt: skip
            self._moved |= set(doubted[share >= CAME].tolist())


def _with(bodies: Bodies, returns: Returns, now: Rectangles, i: int) -> tuple[Bodies, Returns]:
    """`bodies` with the rectangle `i`, as a row of discs, instead of what else was made of its returns; see `update`."""
    pose, velocity = now.pose[i], now.velocity[i]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    turn = np.array([[c, -s], [s, c]])

    def inside(points: FloatArray, beside: FloatArray | float) -> npt.NDArray[np.bool_]:
        off = np.abs((points[:, :2] - pose[:2]) @ turn) - now.half[i]
        return off.max(axis=1, initial=-math.inf) < beside  # type: ignore[no-any-return]

    k, its = len(bodies.structure), inside(returns.points, CLOSE)
    mine = np.bincount(returns.label, weights=its & (returns.known == 0), minlength=k)
    own = mine > 0.5 * np.bincount(returns.label, minlength=k)
    beside = own[returns.label] & ~its
    length, width = 2.0 * now.half[i]
    discs = row_of_discs(rectangle(length, width), BULGE)
    off, n = discs[:, :2] @ turn.T, len(discs)
    wanted = velocity[:2]
    if wanted @ now.way[i] < GOES_ON:
        wanted = GOES_ON * now.way[i]
    spread = np.diag(now.spread[i])
    error, v_error = (max(SIGMAS * math.sqrt(spread[d : d + 2].max()), CLOSE) for d in (0, 3))
    kept = ~inside(bodies.x, np.maximum(bodies.radius - CLOSE, CLOSE))  # nobody stands in it: those are parts of it
    core = ~inside(bodies.cores, CLOSE)
    told = bodies._replace(
        x=np.concatenate((bodies.x[kept], pose[:2] + off)),
        v=np.concatenate((bodies.v[kept], wanted + velocity[2] * off[:, ::-1] * (-1.0, 1.0))),
        radius=np.concatenate((bodies.radius[kept], discs[:, 2])),
        error=np.concatenate((bodies.error[kept], np.full(n, min(error, OFF)))),
        v_error=np.concatenate((bodies.v_error[kept], np.full(n, v_error))),
        identity=np.concatenate((bodies.identity[kept], FIRST + PARTS * now.identity[i] + np.arange(n))),
        structure=np.append(np.where(own, 0, bodies.structure), 1).astype(np.uint8),
        cores=bodies.cores[core],
        core_identity=bodies.core_identity[core],
    )
    return told, returns._replace(label=np.where(beside, k, returns.label))


def follow(
    before: Rectangles, returns: Returns, sizes: FloatArray, unused: int, dt: float, t: float
) -> tuple[Rectangles, int]:
    """The rectangles at time `t` [s], and the first identity that was never given.

    Args:
        before: Those of `dt` [s] ago; they change.
        returns: What is seen, in a frame that doesn't move.
        sizes: (m, 2) lengths and widths of those that there are, m.
        unused: The first identity that was never given until then.
    """
    free, rows = _go_on(before, returns, sizes, dt, t)
    now = Rectangles._make(a[rows] for a in before)
    if not free.any():
        return now, unused
    room = nothing(int(free.sum()))
    now = Rectangles._make(np.concatenate((a, more)) for a, more in zip(now, room, strict=True))
    n, unused = _find(now, len(rows), returns, free, sizes, unused, t)
    return Rectangles._make(a[:n] for a in now), unused


@kernel
def _go_on(
    r: Rectangles, returns: Returns, sizes: FloatArray, dt: float, t: float
) -> tuple[npt.NDArray[np.bool_], IntArray]:
    """Follow those that there are for another `dt` [s]: which clusters may show another one (k,), and which rectangles are kept."""
    free = np.empty(returns.size.shape[0], dtype=np.bool_)
    for c in range(free.shape[0]):
        free[c] = returns.legs[c] == 0
    for j in range(returns.label.shape[0]):
        if returns.known[j]:
            free[returns.label[j]] = False
    for i in range(r.identity.shape[0]):
        if t - r.seen[i] <= COASTS:
            predict(r, i, dt)
            _look(r, i, returns, free, sizes, t)
    for c in range(free.shape[0]):
        free[c] &= returns.size[c] >= 2 * RETURNS and returns.circles[c, 2] >= 0.5 * SIDE
    return free, _kept(r, t)


@kernel
def _find(
    r: Rectangles, n: int, returns: Returns, free: npt.NDArray[np.bool_], sizes: FloatArray, unused: int, t: float
) -> tuple[int, int]:
    """Put new ones behind the first `n` where clusters that are `free` (k,) show a side, or one there that was lost; how many there are
    then, and the first identity that was never given."""
    for c in range(free.shape[0]):
        if not free[c]:
            continue
        own = returns.points[returns.label == c]
        if _is_part(r, n, own, returns.sensor, t):
            continue
        at = n
        for i in range(n):  # one that was lost
            away = math.hypot(r.pose[i, 0] - returns.circles[c, 0], r.pose[i, 1] - returns.circles[c, 1])
            if has_moved(r, i) and r.seen[i] < t and away <= AGAIN:
                at = i
        if put(r, at, own, returns.sensor, sizes):
            r.seen[at], r.moves[at] = t, 0
            for d in range(3):
                r.velocity[at, d], r.spread[at, 3 + d, 3 + d] = 0.0, AT_FIRST[d] ** 2
            if at == n:
                r.identity[n] = unused
                n, unused = n + 1, unused + 1
    return n, unused


@light
def has_moved(r: Rectangles, i: int) -> bool:
    """Whether it has ever gone fast and far enough; whether space has shown it too, see `RectangleFollower`, counts for what is told."""
    return bool(r.way[i, 0] != 0.0 or r.way[i, 1] != 0.0)


@kernel
def _kept(r: Rectangles, t: float) -> IntArray:
    """Which are followed on: none that was out of view for too long, and of two in one place the one that has moved, or the older one."""
    n = r.identity.shape[0]
    kept, m = np.empty(n, dtype=np.int64), 0
    for moved in (True, False):
        for i in range(n):
            if has_moved(r, i) != moved or t - r.seen[i] > (KNOWN if moved else COASTS):
                continue
            apart = True
            for j in kept[:m]:
                c, s = math.cos(r.pose[j, 2]), math.sin(r.pose[j, 2])
                dx, dy = r.pose[i, 0] - r.pose[j, 0], r.pose[i, 1] - r.pose[j, 1]
                if abs(c * dx + s * dy) < r.half[j, 0] + CLOSE and abs(c * dy - s * dx) < r.half[j, 1] + CLOSE:
                    apart = False
            if apart:
                kept[m] = i
                m += 1
    return kept[:m]


@kernel
def _is_part(r: Rectangles, n: int, points: FloatArray, sensor: FloatArray, t: float) -> bool:
    """Whether a third of `points` (m, 2) lies near a side of one of the first `n` that is followed."""
    for i in range(n):
        if t - r.seen[i] > COASTS:
            continue
        near, away = 0, from_sides(r, i, points, sensor)
        for j in range(points.shape[0]):
            near += away[j, 0] < CLOSE + OFF
        if 3 * near > points.shape[0]:
            return True
    return False


@kernel
def _expected(r: Rectangles, i: int, returns: Returns, free: npt.NDArray[np.bool_]) -> FloatArray:
    """(n, 2) what is seen near where its sides are expected, of clusters that are `free` (k,)."""
    points, label, size = returns.points, returns.label, returns.size
    reach = OFF + min(2.0 * math.sqrt(r.spread[i, 0, 0] + r.spread[i, 1, 1]), SOON)
    near, n, close, sides = (
        np.empty((label.shape[0], 2)),
        0,
        np.zeros(size.shape[0]),
        from_sides(r, i, points, returns.sensor),
    )
    for j in range(label.shape[0]):
        if free[label[j]] and sides[j, 0] < CLOSE:
            close[label[j]] += 1
    likely = (close >= 0.5 * size).any()  # where one is as near as expected, those beside it are others
    for j in range(label.shape[0]):
        c = label[j]
        if free[c] and sides[j, 0] < reach and (not likely or close[c] >= 0.5 * size[c]):
            near[n, 0], near[n, 1] = points[j, 0], points[j, 1]
            n += 1
    return near[:n]


@kernel
def _look(r: Rectangles, i: int, returns: Returns, free: npt.NDArray[np.bool_], sizes: FloatArray, t: float) -> None:
    """Move it to where what is seen near its sides lies on them, and note whether it fits and has moved.

    Args:
        free: (k,) which clusters may be one; those that are its own no longer are.
    """
    points, label, sensor, k = returns.points, returns.label, returns.sensor, free.shape[0]
    near = _expected(r, i, returns, free)
    if near.shape[0] < RETURNS or not register(r, i, near, sensor):
        r.moves[i] = 0
        return
    count, off, deep = np.zeros(k), np.zeros(k), 0
    low, high = np.full((k, 2), math.inf), np.full((k, 2), -math.inf)
    sides = from_sides(r, i, points, sensor)
    for j in range(label.shape[0]):
        c, u, v = label[j], sides[j, 4], sides[j, 5]
        if not free[c]:
            continue
        off[c] += sides[j, 0] > OFF
        deep += abs(u) < r.half[i, 0] - OFF and abs(v) < r.half[i, 1] - OFF
        if sides[j, 0] < CLOSE:
            count[c] += 1
            low[c, 0], low[c, 1] = min(low[c, 0], u), min(low[c, 1], v)
            high[c, 0], high[c, 1] = max(high[c, 0], u), max(high[c, 1], v)
    shown, wrong, most = 0.0, 0.0, 0
    own = np.zeros(k, dtype=np.bool_)
    for c in range(k):
        if free[c] and count[c] >= 0.5 * returns.size[c] and count[c] >= RETURNS:
            own[c] = True
            shown += max(high[c, 0] - low[c, 0], high[c, 1] - low[c, 1])
            wrong += off[c]
            if not own[most] or count[c] > count[most]:
                most = c
    if shown < SHOWN:
        r.moves[i] = 0
        return
    r.seen[i] = t
    r.misfits[i] = r.misfits[i] + 1 if deep >= RETURNS or wrong >= 2 * RETURNS else 0
    unlike = r.misfits[i] >= PERSISTENCE and not put(r, i, points[label == most], sensor, sizes)
    if unlike and r.misfits[i] >= 3 * PERSISTENCE:
        r.seen[i] = -math.inf
    for c in range(k):
        free[c] &= not own[c]
    vx, vy, p = r.velocity[i, 0], r.velocity[i, 1], r.spread[i]
    speed = math.hypot(vx, vy)
    variance = vx * vx * p[3, 3] + 2.0 * vx * vy * p[3, 4] + vy * vy * p[4, 4]
    unsure = math.sqrt(variance) / max(speed, 1e-9)  # along its way
    gone = math.hypot(r.pose[i, 0] - r.begun[i, 0], r.pose[i, 1] - r.begun[i, 1])
    r.moves[i] = r.moves[i] + 1 if speed > max(FASTER, SIGMAS * unsure) and gone > FARTHER else 0
    if r.moves[i] >= PERSISTENCE:
        for d in range(2):
            r.way[i, d] = r.velocity[i, d] / speed
