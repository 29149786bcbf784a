"""Where a rectangle of a known size is, by what is seen of its sides.

It is put where a cluster shows a straight side without gaps, its heading by closeness (Zhang, Xu, Dong and Dolan 2017, "Efficient L-shape
fitting for vehicle detection using laser scanners"). Then it moves evenly, and in each scan to where what is seen near its sides lies on
them (model-based tracking; Petrovskaya and Thrun 2009, "Model based vehicle detection and tracking for autonomous urban driving").
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.perception.clusters import IntArray

HEADINGS = 45
"""Tried over a right angle."""
STRAIGHT = 0.035
"""Mean distance of a cluster's returns from the box around them, at most, m."""
SIDE, GAP = 0.64, 0.12
"""A new one shows a side of at least so much without a gap, m: HOSBOT's rack is 0.6 m wide, and no row of legs looks like that."""
RETURNS = 4
"""Fewer are none."""
CLOSE, OFF = 0.1, 0.15
"""m: a return that is nearer to a side belongs to it; one that is farther from all, or deeper inside, doesn't fit."""
NOISE, SOFT, WORTH = 0.03, 0.06, 12.0
"""Standard deviation of a return from a side, m; from where on it counts less; how many count as independent, at most."""
ROUNDS, ENOUGH = 5, 1e-4
"""Of Gauss and Newton, at most, and the step after which no other is made, m and rad."""
ACCELERATION, TURNING = 0.4, 0.3
"""Standard deviations, m/s^2 and rad/s^2."""
UNSURE, ASKEW = 0.03, 0.05
"""The same of where a side is that is in view, m, and of the heading, rad."""
KEEPS, HIDDEN = 0.25, 0.3
"""By so much another size has to fit better than its own, m; of a side of which more is missing it is hidden, or seen at a grazing angle."""


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


def nothing(n: int) -> Rectangles:
    """So many, of which nothing is known."""
    return Rectangles(
        np.zeros(n, dtype=np.int64), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 6, 6)), np.zeros((n, 2)), np.full(n, -math.inf),
        np.zeros((n, 2)), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64), np.zeros((n, 2)),
    )  # fmt: skip


@kernel
def from_sides(r: Rectangles, i: int, points: FloatArray, sensor: FloatArray) -> FloatArray:
    """(n, 6) how far each of `points` (n, 2) lies from the nearest of the sides of `i` that look at the sensor, m; the same with a sign,
    outside positive; along which unit vector, and where it is, both in the rectangle's own frame."""
    found = np.empty((points.shape[0], 6))
    c, s = math.cos(r.pose[i, 2]), math.sin(r.pose[i, 2])
    dx, dy = sensor[0] - r.pose[i, 0], sensor[1] - r.pose[i, 1]
    eye = c * dx + s * dy, c * dy - s * dx
    for j in range(points.shape[0]):
        dx, dy = points[j, 0] - r.pose[i, 0], points[j, 1] - r.pose[i, 1]
        u, v = c * dx + s * dy, c * dy - s * dx
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
        found[j, 0], found[j, 1], found[j, 2], found[j, 3], found[j, 4], found[j, 5] = nearest, off, along, across, u, v
    return found


@kernel
def predict(r: Rectangles, i: int, dt: float) -> None:
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
def register(r: Rectangles, i: int, points: FloatArray, sensor: FloatArray) -> bool:
    """Move it to where `points` (n, 2) lie on its sides, as far as it is likely to be there; false: none does.

    Least squares with robust weights and what was expected as a prior, by Gauss and Newton; velocities follow as in a Kalman filter.
    """
    p, expected = r.spread[i], r.pose[i].copy()
    sure, seen, both, pull, moved = (
        inverse(p[:3, :3]),
        np.empty((3, 3)),
        np.empty((3, 3)),
        np.empty((3, 1)),
        np.empty((3, 1)),
    )
    for _ in range(ROUNDS):
        seen[:], pull[:], total = 0.0, 0.0, 0.0
        c, s = math.cos(r.pose[i, 2]), math.sin(r.pose[i, 2])
        sides = from_sides(r, i, points, sensor)
        for j in range(points.shape[0]):
            off, along, across = sides[j, 1], sides[j, 2], sides[j, 3]
            if sides[j, 0] > 2.0 * OFF:
                continue
            weight = 1.0 / (1.0 + (off / SOFT) ** 2)
            row = (s * across - c * along, -s * along - c * across, along * sides[j, 5] - across * sides[j, 4])
            for d in range(3):
                pull[d, 0] += weight * row[d] * off
                for e in range(3):
                    seen[d, e] += weight * row[d] * row[e]
            total += weight
        if total < 2.0:
            return False
        worth = min(1.0, WORTH / total) / NOISE**2
        for d in range(3):
            moved[d, 0] = r.pose[i, d] - expected[d]
        prior = product(sure, moved)
        for d in range(3):
            pull[d, 0] = worth * pull[d, 0] + prior[d, 0]
            for e in range(3):
                seen[d, e] *= worth
                both[d, e] = seen[d, e] + sure[d, e]
        step, most = product(inverse(both), pull), 0.0
        for d in range(3):
            r.pose[i, d] -= step[d, 0]
            most = max(most, abs(step[d, 0]))
        if most < ENOUGH:
            break
    for d in range(3):
        moved[d, 0] = r.pose[i, d] - expected[d]
    gained, less = product(product(p[3:, :3], sure), moved), product(p[:3, :3], seen)
    for d in range(3):
        r.velocity[i, d] += gained[d, 0]
        less[d, d] += 1.0
    gone = product(product(p[:, :3], product(seen, inverse(less))), p[:3, :])
    for d in range(6):
        for e in range(d + 1):
            p[d, e] = p[e, d] = 0.5 * (p[d, e] - gone[d, e] + p[e, d] - gone[e, d])
    return True


@kernel
def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Of two matrices; not by BLAS, whose bits are another machine's others."""
    c: FloatArray = np.zeros((a.shape[0], b.shape[1]))
    for i in range(a.shape[0]):
        for k in range(b.shape[0]):
            for j in range(b.shape[1]):
                c[i, j] += a[i, k] * b[k, j]
    return c


@kernel
def inverse(m: FloatArray) -> FloatArray:
    """Of a matrix (3, 3)."""
    inverse: FloatArray = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = m[a, c] * m[b, d] - m[a, d] * m[b, c]
    inverse /= m[0, 0] * inverse[0, 0] + m[0, 1] * inverse[1, 0] + m[0, 2] * inverse[2, 0]
    return inverse


@kernel
def put(r: Rectangles, i: int, points: FloatArray, sensor: FloatArray, sizes: FloatArray) -> bool:
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
    low, high, looks, side, share = np.empty(2), np.empty(2), np.zeros(2), np.zeros(2), np.zeros(2)
    for d in range(2):
        low[d], high[d] = along[d].min(), along[d].max()
        looks[d] = 1.0 if eye[d] > high[d] else -1.0 if eye[d] < low[d] else 0.0  # the side across d that is in view
    for d in range(2):
        if looks[d] != 0.0:
            face = high[d] if looks[d] > 0.0 else low[d]
            on = np.abs(along[d] - face) < 0.5 * CLOSE
            side[d], share[d] = _longest(along[1 - d][on]), on.mean()
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
                cost += share[d] * min(abs(size[1 - d] - (high[1 - d] - low[1 - d])), HIDDEN)
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
