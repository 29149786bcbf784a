"""Beds, wheelchairs and whatever else is pushed: rectangles of known sizes, found in scans and followed.

They are larger than a body, and no smallest circle tells where they are: another side comes into view, who stands before them cuts
them, and the middle of what is seen jumps. A rectangle of a known size has one place that fits (model-based tracking; Petrovskaya and
Thrun 2009, "Model based vehicle detection and tracking for autonomous urban driving"). It is found where a cluster has a straight side
without gaps, its heading by closeness (Zhang, Xu, Dong and Dolan 2017, "Efficient L-shape fitting for vehicle detection using laser
scanners"). From then on it moves evenly, and in each scan to where what is seen near its sides lies on them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray, rectangle, row_of_discs
from clearway.perception.bodies import Bodies
from clearway.perception.clusters import IntArray, Returns

HEADINGS = 45
"""Tried over a right angle."""
STRAIGHT = 0.035
"""Mean distance of a cluster's returns from the box around them, at most, m."""
SIDE, GAP = 0.64, 0.12
"""A new one shows a side of at least so much without a gap, m: HOSBOT's rack is 0.6 m wide, and no row of legs looks like that."""
SHOWN = 0.3
"""One that is followed is seen if so much of it is, m."""
RETURNS = 4
"""Fewer are none."""
CLOSE, OFF = 0.1, 0.15
"""m: a return that is nearer to a side belongs to it; one that is farther from all, or deeper inside, doesn't fit."""
SOON = 0.2
"""What it may have come farther than expected since the last scan, at most, m."""
NOISE, SOFT, WORTH = 0.03, 0.06, 12.0
"""Standard deviation of a return from a side, m; from where on it counts less; how many count as independent, at most."""
ROUNDS, ENOUGH = 5, 1e-4
"""Of Gauss and Newton, at most, and the step after which no other is made, m and rad."""
PERSISTENCE = 3
"""Periods in a row in which it moves, or doesn't fit, until that counts."""
FASTER, FARTHER = 0.25, 0.25
"""It moves if it is faster than that and than three standard deviations, m/s, and has come farther, m."""
COASTS = 3.0
"""Out of view it is told for so long, s."""
KNOWN, AGAIN = 20.0, 1.5
"""And what is found within so many m of it for so many s is the same one."""
ACCELERATION, TURNING = 0.4, 0.3
"""Standard deviations, m/s^2 and rad/s^2."""
AT_FIRST = 0.3, 0.3, 0.2
"""The same of its velocity, m/s, m/s, rad/s."""
UNSURE, ASKEW = 0.03, 0.05
"""The same of where a side is that is in view, m, and of the heading, rad."""
KEEPS = 0.3
"""By so much another size has to fit better than its own, m."""
FIRST, PARTS = 1 << 20, 16
"""Identities of its discs: the first one's, and how many each may have."""
GOES_ON = 0.4
"""Speed at which one that stands, or gives way, is expected to go on, m/s."""
SIGMAS = 3.0
"""Of a bound."""
BULGE = 0.08
"""By which the discs that it is told as stick out of its longer sides at most, m."""


class Rectangles(NamedTuple):
    """Those that are followed.

    Attributes:
        identity: (n,) from 0.
        pose: (n, 3) of the middle, in a frame that doesn't move.
        velocity: (n, 3) m/s, m/s, rad/s.
        spread: (n, 6, 6) covariance of pose and velocity.
        half: (n, 2) half of its sizes along its own axes, m.
        seen: (n,) when it was seen last, s.
        begun: (n, 2) where it was when it was fitted, m.
        moves: (n,) periods in a row in which it has moved.
        misfits: (n,) periods in a row in which what is seen did not fit.
        way: (n, 2) unit vector in which it went when it last did; 0: it never has.
    """

    identity: IntArray
    pose: FloatArray
    velocity: FloatArray
    spread: FloatArray
    half: FloatArray
    seen: FloatArray
    begun: FloatArray
    moves: IntArray
    misfits: IntArray
    way: FloatArray


class RectangleFollower:
    """Follows rectangles in a series of scans.

    Args:
        sizes: (m, 2) lengths and widths of those that there are, m.
    """

    def __init__(self, sizes: FloatArray) -> None:
        self._sizes, self._t, self._unused = sizes, math.nan, 0
        self._followed = nothing(0)

    def update(self, returns: Returns, bodies: Bodies, t: float) -> Bodies:
        """`bodies` at time `t` [s] with those rectangles among them that have been seen to move, instead of what they were taken for."""
        dt = t - self._t if t > self._t else 0.0
        self._t = t
        self._followed, self._unused = follow(self._followed, returns, self._sizes, self._unused, dt, t)
        now = self._followed
        told = now.way.any(axis=1) & (t - now.seen <= COASTS)
        for i in np.flatnonzero(told).tolist():
            bodies = _with(bodies, returns, now, i)
        return bodies


def _with(bodies: Bodies, returns: Returns, now: Rectangles, i: int) -> Bodies:
    """`bodies` with the rectangle `i`, as a row of discs, instead of what else was made of its returns."""
    pose, velocity = now.pose[i], now.velocity[i]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    turn = np.array([[c, -s], [s, c]])
    size = now.half[i] + CLOSE

    def inside(points: FloatArray) -> npt.NDArray[np.bool_]:
        return (np.abs((points[:, :2] - pose[:2]) @ turn) < size).all(axis=1)  # type: ignore[no-any-return]

    k = len(returns.size)
    known = np.bincount(returns.label, weights=returns.known, minlength=k) > 0
    own = np.bincount(returns.label, weights=inside(returns.points), minlength=k) > 0.5 * returns.size
    length, width = 2.0 * now.half[i]
    discs = row_of_discs(rectangle(length, width), BULGE)
    off, n = discs[:, :2] @ turn.T, len(discs)
    wanted = velocity[:2]
    if wanted @ now.way[i] < GOES_ON:
        wanted = GOES_ON * now.way[i]
    spread = np.diag(now.spread[i])
    bound = SIGMAS * math.sqrt(spread[3:5].max())
    kept, core = ~inside(bodies.x), ~inside(bodies.cores)
    return bodies._replace(
        x=np.concatenate((bodies.x[kept], pose[:2] + off)),
        v=np.concatenate((bodies.v[kept], wanted + velocity[2] * off[:, ::-1] * (-1.0, 1.0))),
        radius=np.concatenate((bodies.radius[kept], discs[:, 2])),
        error=np.concatenate((bodies.error[kept], np.full(n, min(SIGMAS * math.sqrt(spread[:2].max()), OFF)))),
        v_error=np.concatenate((bodies.v_error[kept], np.full(n, bound))),
        identity=np.concatenate((bodies.identity[kept], FIRST + PARTS * now.identity[i] + np.arange(n))),
        structure=np.where(own & ~known, 0, bodies.structure).astype(np.uint8),
        cores=bodies.cores[core],
        core_identity=bodies.core_identity[core],
    )


@kernel
def nothing(n: int) -> Rectangles:
    """So many, of which nothing is known."""
    return Rectangles(
        np.zeros(n, dtype=np.int64), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 6, 6)), np.zeros((n, 2)), np.full(n, -math.inf),
        np.zeros((n, 2)), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64), np.zeros((n, 2)),
    )  # fmt: skip


@kernel
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
    label, k = returns.label, returns.size.shape[0]
    free = returns.legs == 0  # clusters that may be one
    for j in range(label.shape[0]):
        if returns.known[j]:
            free[label[j]] = False
    for i in range(before.identity.shape[0]):
        if t - before.seen[i] <= COASTS:
            _predict(before, i, dt)
            _look(before, i, returns, free, sizes, t)
    rows = _kept(before, t)
    n = rows.shape[0]
    now = nothing(n + k)
    for i in range(n):
        _copy(before, rows[i], now, i)
    for c in range(k):
        if not free[c] or returns.size[c] < 2 * RETURNS or returns.circles[c, 2] < 0.5 * SIDE:
            continue
        own = returns.points[label == c]
        if _is_part(now, n, own, returns.sensor, t):
            continue
        at = n
        for i in range(n):  # one that was lost
            away = math.hypot(now.pose[i, 0] - returns.circles[c, 0], now.pose[i, 1] - returns.circles[c, 1])
            if now.way[i].any() and now.seen[i] < t and away <= AGAIN:
                at = i
        if _fit(now, at, own, returns.sensor, sizes):
            now.seen[at], now.velocity[at], now.moves[at] = t, 0.0, 0
            for d in range(3):
                now.spread[at, 3 + d, 3 + d] = AT_FIRST[d] ** 2
            if at == n:
                now.identity[n] = unused
                n, unused = n + 1, unused + 1
    last = nothing(n)
    for i in range(n):
        _copy(now, i, last, i)
    return last, unused


@kernel
def _copy(a: Rectangles, i: int, b: Rectangles, j: int) -> None:
    b.identity[j], b.pose[j], b.velocity[j], b.spread[j], b.half[j] = a.identity[i], a.pose[i], a.velocity[i], a.spread[i], a.half[i]
    b.seen[j], b.begun[j], b.moves[j], b.misfits[j], b.way[j] = a.seen[i], a.begun[i], a.moves[i], a.misfits[i], a.way[i]


@kernel
def _kept(r: Rectangles, t: float) -> IntArray:
    """Which are followed on: none that was out of view for too long, and of two in one place the one that has moved, or the older one."""
    n = r.identity.shape[0]
    kept, m = np.empty(n, dtype=np.int64), 0
    for moved in (True, False):
        for i in range(n):
            if r.way[i].any() != moved or t - r.seen[i] > (KNOWN if moved else COASTS):
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
        near = 0
        for j in range(points.shape[0]):
            near += _from_side(r, i, points[j], sensor)[0] < CLOSE + OFF
        if 3 * near > points.shape[0]:
            return True
    return False


@light
def _from_side(
    r: Rectangles, i: int, point: FloatArray, sensor: FloatArray
) -> tuple[float, float, float, float, float, float]:
    """How far a point (2,) lies from the nearest of the sides of `i` that look at the sensor, m; the same with a sign, outside positive;
    along which unit vector, and where it is, both in the rectangle's own frame."""
    c, s = math.cos(r.pose[i, 2]), math.sin(r.pose[i, 2])
    dx, dy = point[0] - r.pose[i, 0], point[1] - r.pose[i, 1]
    u, v = c * dx + s * dy, c * dy - s * dx
    dx, dy = sensor[0] - r.pose[i, 0], sensor[1] - r.pose[i, 1]
    eye = c * dx + s * dy, c * dy - s * dx
    nearest, off, along, across = math.inf, 0.0, 0.0, 0.0
    for axis in range(2):
        x, y = (u, v) if axis == 0 else (v, u)
        half, end = r.half[i, axis], r.half[i, 1 - axis]
        if abs(eye[axis]) <= half:
            continue
        sign = 1.0 if eye[axis] > 0.0 else -1.0
        out = sign * x - half
        beyond = math.copysign(max(abs(y) - end, 0.0), y)
        far = math.hypot(out, beyond)
        if far < nearest:
            nearest, off = far, out if beyond == 0.0 else far
            a, b = (sign, 0.0) if beyond == 0.0 else (sign * out / far, beyond / far)
            along, across = (a, b) if axis == 0 else (b, a)
    return nearest, off, along, across, u, v


@kernel
def _predict(r: Rectangles, i: int, dt: float) -> None:
    """Move it on evenly."""
    p = r.spread[i]
    for d in range(3):
        r.pose[i, d] += dt * r.velocity[i, d]
    for d in range(3):
        for e in range(6):
            p[d, e] += dt * p[d + 3, e]
    for d in range(3):
        for e in range(6):
            p[e, d] += dt * p[e, d + 3]
        q = (TURNING if d == 2 else ACCELERATION) ** 2
        p[d, d] += 0.25 * q * dt**4
        p[d, d + 3] += 0.5 * q * dt**3
        p[d + 3, d] += 0.5 * q * dt**3
        p[d + 3, d + 3] += q * dt**2


@kernel
def _look(r: Rectangles, i: int, returns: Returns, free: npt.NDArray[np.bool_], sizes: FloatArray, t: float) -> None:
    """Move it to where what is seen near its sides lies on them, and note whether it fits and has moved.

    Args:
        free: (k,) which clusters may be one; those that are its own no longer are.
    """
    points, label, sensor, k = returns.points, returns.label, returns.sensor, free.shape[0]
    reach = OFF + min(2.0 * math.sqrt(r.spread[i, 0, 0] + r.spread[i, 1, 1]), SOON)
    near, n = np.empty(label.shape[0], dtype=np.int64), 0
    for j in range(label.shape[0]):
        if free[label[j]] and _from_side(r, i, points[j], sensor)[0] < reach:
            near[n] = j
            n += 1
    if n < RETURNS or not _register(r, i, points, near[:n], sensor):
        r.moves[i] = 0
        return
    count, off, deep = np.zeros(k), np.zeros(k), 0
    low, high = np.full((k, 2), math.inf), np.full((k, 2), -math.inf)
    for j in range(label.shape[0]):
        c = label[j]
        if not free[c]:
            continue
        away, _, _, _, u, v = _from_side(r, i, points[j], sensor)
        off[c] += away > OFF
        deep += abs(u) < r.half[i, 0] - OFF and abs(v) < r.half[i, 1] - OFF
        if away < CLOSE:
            count[c] += 1
            low[c, 0], low[c, 1] = min(low[c, 0], u), min(low[c, 1], v)
            high[c, 0], high[c, 1] = max(high[c, 0], u), max(high[c, 1], v)
    own = (count >= 0.5 * returns.size) & (count >= RETURNS) & free
    shown, wrong, most = 0.0, 0.0, -1
    for c in np.flatnonzero(own):
        shown += max(high[c, 0] - low[c, 0], high[c, 1] - low[c, 1])
        wrong += off[c]
        if most < 0 or count[c] > count[most]:
            most = c
    if shown < SHOWN:
        r.moves[i] = 0
        return
    r.seen[i] = t
    r.misfits[i] = r.misfits[i] + 1 if deep >= RETURNS or wrong >= 2 * RETURNS else 0
    if r.misfits[i] >= PERSISTENCE and not _fit(r, i, points[label == most], sensor, sizes) and r.misfits[i] >= 3 * PERSISTENCE:
        r.seen[i] = -math.inf
    for c in range(k):
        free[c] &= not own[c]
    speed, unsure = math.hypot(r.velocity[i, 0], r.velocity[i, 1]), math.sqrt(max(r.spread[i, 3, 3], r.spread[i, 4, 4]))
    gone = math.hypot(r.pose[i, 0] - r.begun[i, 0], r.pose[i, 1] - r.begun[i, 1])
    r.moves[i] = r.moves[i] + 1 if speed > max(FASTER, SIGMAS * unsure) and gone > FARTHER else 0
    if r.moves[i] >= PERSISTENCE:
        for d in range(2):
            r.way[i, d] = r.velocity[i, d] / speed


@kernel
def _register(r: Rectangles, i: int, points: FloatArray, near: IntArray, sensor: FloatArray) -> bool:
    """Move it to where the points `near` (n,) of `points` (m, 2) lie on its sides, as far as it is likely to be there; false: none does.

    Least squares with robust weights and what was expected as a prior, by Gauss and Newton; velocities follow as in a Kalman filter.
    """
    p = r.spread[i]
    expected, sure = r.pose[i].copy(), _inverse(p[:3, :3])
    seen, pull = np.empty((3, 3)), np.empty(3)
    for _ in range(ROUNDS):
        seen[:], pull[:], total = 0.0, 0.0, 0.0
        c, s = math.cos(r.pose[i, 2]), math.sin(r.pose[i, 2])
        for j in near:
            away, off, along, across, u, v = _from_side(r, i, points[j], sensor)
            if away > 2.0 * OFF:
                continue
            weight = 1.0 / (1.0 + (off / SOFT) ** 2)
            row = (s * across - c * along, -s * along - c * across, along * v - across * u)
            for d in range(3):
                pull[d] += weight * row[d] * off
                for e in range(3):
                    seen[d, e] += weight * row[d] * row[e]
            total += weight
        if total < 2.0:
            return False
        worth = min(1.0, WORTH / total) / NOISE**2
        seen *= worth
        pull = worth * pull + (sure * (r.pose[i] - expected)).sum(axis=1)
        step = (_inverse(seen + sure) * pull).sum(axis=1)
        r.pose[i] -= step
        if np.abs(step).max() < ENOUGH:
            break
    r.velocity[i] += (_product(p[3:, :3], sure) * (r.pose[i] - expected)).sum(axis=1)
    less = _product(seen, _inverse(np.eye(3) + _product(p[:3, :3], seen)))
    p -= _product(_product(p[:, :3], less), p[:3, :])
    p[:] = 0.5 * (p + p.T)
    return True


@kernel
def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Of two matrices; not by BLAS, whose bits are another machine's others."""
    c = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(b.shape[0]):
            for j in range(b.shape[1]):
                c[i, j] += a[i, k] * b[k, j]
    return c


@kernel
def _inverse(m: FloatArray) -> FloatArray:
    """Of a matrix (3, 3)."""
    inverse = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = m[a, c] * m[b, d] - m[a, d] * m[b, c]
    return inverse / (m[0, 0] * inverse[0, 0] + m[0, 1] * inverse[1, 0] + m[0, 2] * inverse[2, 0])


@kernel
def _fit(r: Rectangles, i: int, points: FloatArray, sensor: FloatArray, sizes: FloatArray) -> bool:
    """Put `i` where one of `sizes` (m, 2) fits a cluster's `points` (n, 2) best; false, and nothing changes: none does, or it shows no side.

    Where a side's end is out of view, one size fits as well as another: then it keeps its own.
    """
    heading, off = _heading(points)
    if off > STRAIGHT:
        return False
    c, s = math.cos(heading), math.sin(heading)
    eye = c * sensor[0] + s * sensor[1], c * sensor[1] - s * sensor[0]
    along = np.empty((2, points.shape[0]))
    along[0], along[1] = c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]
    low, high, looks, side = np.empty(2), np.empty(2), np.zeros(2), np.zeros(2)
    for d in range(2):
        low[d], high[d] = along[d].min(), along[d].max()
        looks[d] = 1.0 if eye[d] > high[d] else -1.0 if eye[d] < low[d] else 0.0  # the side across d that looks at the sensor
    for d in range(2):
        if looks[d] != 0.0:
            face = high[d] if looks[d] > 0.0 else low[d]
            side[d] = _longest(along[1 - d][np.abs(along[d] - face) < 0.5 * CLOSE])
    if side.max() < SIDE:
        return False
    best, half = math.inf, np.empty(2)
    for m in range(sizes.shape[0]):
        for turned in range(2):
            size = (sizes[m, turned], sizes[m, 1 - turned])
            if high[0] - low[0] > size[0] + CLOSE or high[1] - low[1] > size[1] + CLOSE:
                continue
            cost = 0.0
            for d in range(2):
                if side[d] > 0.5 * SHOWN:
                    cost += abs(size[1 - d] - (high[1 - d] - low[1 - d]))
            own = abs(max(size) - 2.0 * r.half[i].max()) < 1e-9
            cost -= KEEPS if own else 0.0
            if cost < best:
                best, half[0], half[1] = cost, 0.5 * size[0], 0.5 * size[1]
    if best == math.inf:
        return False
    middle, doubt = np.empty(2), np.empty(2)
    for d in range(2):
        if looks[d] != 0.0:
            middle[d], doubt[d] = (high[d] - half[d] if looks[d] > 0.0 else low[d] + half[d]), UNSURE
        else:
            middle[d], doubt[d] = 0.5 * (low[d] + high[d]), max(half[d] - 0.5 * (high[d] - low[d]), UNSURE)
    r.half[i] = half
    r.pose[i, 0], r.pose[i, 1], r.pose[i, 2] = c * middle[0] - s * middle[1], s * middle[0] + c * middle[1], heading
    r.begun[i], r.misfits[i] = r.pose[i, :2], 0
    p = r.spread[i]
    p[:3, :], p[:, :3] = 0.0, 0.0
    a, b = doubt[0] ** 2, doubt[1] ** 2
    p[0, 0], p[1, 1], p[2, 2] = c * c * a + s * s * b, s * s * a + c * c * b, ASKEW**2
    p[0, 1] = p[1, 0] = c * s * (a - b)
    return True


@kernel
def _heading(points: FloatArray) -> tuple[float, float]:
    """Of the box around `points` (n, 2) whose sides they are nearest to, and how near in the mean, m."""
    heading, least = 0.0, math.inf
    for k in range(HEADINGS):
        angle = 0.5 * math.pi * k / HEADINGS
        c, s = math.cos(angle), math.sin(angle)
        u, v = c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]
        off = np.minimum(np.minimum(u.max() - u, u - u.min()), np.minimum(v.max() - v, v - v.min()))
        mean = np.minimum(off, CLOSE).mean()
        if mean < least:
            heading, least = angle, mean
    return heading, least


@kernel
def _longest(x: FloatArray) -> float:
    """The longest stretch of `x` (n,) without a gap, m."""
    if x.shape[0] < RETURNS:
        return 0.0
    x = np.sort(x)
    longest, first = 0.0, x[0]
    for k in range(1, x.shape[0]):
        if x[k] - x[k - 1] > GAP:
            first = x[k]
        longest = max(longest, x[k] - first)
    return longest  # type: ignore[no-any-return]
