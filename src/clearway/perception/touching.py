"""Round bodies that touch, or that one sees one before the other, in one cluster of a scan: parted where they meet."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.enclosing import enclosing_circle
from clearway.geometry.shapes import FloatArray
from clearway.perception.arcs import LEAST, arc
from clearway.perception.clusters import JOIN, IntArray, Returns, by_label


def parted(returns: Returns, increment: float, sizes: tuple[float, float], sigma: float) -> Returns:
    """`returns`, with the round bodies in clusters of several as clusters of their own.

    Args:
        returns: What was seen; its labels change.
        increment: Between two beams, rad.
        sizes: Least and largest radius of a round body, m.
        sigma: Standard deviation of a range, m.
    """
    of, cut = _part(returns, sizes, sigma)
    if len(of) == 0:
        return returns
    circles, size, far = _described(returns, of, increment)
    legs = np.append(returns.legs, np.zeros(len(of), dtype=np.uint8))
    return returns._replace(circles=circles, size=size, far=far, cut=cut, legs=legs)


@kernel
def _part(returns: Returns, sizes: tuple[float, float], sigma: float) -> tuple[IntArray, npt.NDArray[np.uint8]]:
    """Give parts of clusters labels of their own, behind all others.

    Returns:
        (n,) the cluster that each was a part of; (k + n,) which clusters are cut now.
    """
    k, n, least = returns.size.shape[0], 0, JOIN * math.sqrt(2.0) * sigma
    order, first = by_label(returns.label, k)
    m = order.shape[0]
    of, cut, left = np.empty(m, dtype=np.int64), np.zeros(k + m, dtype=np.uint8), np.empty((m + 1, 2), dtype=np.int64)
    cut[:k] = returns.cut
    for c in range(k):
        members = order[first[c] : first[c + 1]]
        if returns.legs[c] or members.shape[0] <= LEAST or returns.known[members[0]]:
            continue
        members = _in_turn(returns.raw, members, returns.sensor)
        left[0, 0], left[0, 1] = 0, members.shape[0]
        more = 0 if _circle(returns, members, sizes, sigma)[2] > 0.0 else 1
        while more > 0:
            more -= 1
            a, b = left[more]
            ends, began = _meetings(returns.raw, members[a:b], returns.sensor, least), a
            circles = np.empty((ends.shape[0], 3))
            for i in range(ends.shape[0]):  # where they meet the last return of one may be the other's
                first_own, last_own = began + (i > 0), a + ends[i] - (i + 1 < ends.shape[0])
                circles[i] = _circle(returns, members[first_own:last_own], sizes, sigma)
                began = a + ends[i]
            rounds = circles[:, 2] > 0.0
            if ends.shape[0] < 2 or not rounds.any():
                continue
            for i in range(ends.shape[0] - 1):
                last = members[a + ends[i] - 1]
                if _off(returns.raw, last, circles[i + 1], least) < _off(returns.raw, last, circles[i], least):
                    ends[i] -= 1
            began = a
            for i in range(ends.shape[0]):
                end = a + ends[i]
                if i + 1 < ends.shape[0] and not (rounds[i] or rounds[i + 1]):
                    continue
                if began > a:
                    returns.label[members[began:end]] = k + n
                    of[n], cut[k + n] = c, returns.cut[c]
                    beyond = returns.distance[members[began]] - returns.distance[members[began - 1]]
                    if abs(beyond) > 3.0 * sigma + 0.05:  # what is nearer may hide a part of the other
                        cut[returns.label[members[began if beyond > 0.0 else began - 1]]] = 1
                    n += 1
                if not rounds[i]:
                    left[more, 0], left[more, 1] = began, end
                    more += 1
                began = end
    return of[:n], cut[: k + n]


@kernel
def _in_turn(points: FloatArray, members: IntArray, sensor: FloatArray) -> IntArray:
    """`members` by their bearing, the first beam next to the last where the lidar looks around."""
    x, y = 0.0, 0.0
    for j in members:
        x += points[j, 0] - sensor[0]
        y += points[j, 1] - sensor[1]
    bearing = np.empty(members.shape[0])
    for i in range(members.shape[0]):
        px, py = points[members[i], 0] - sensor[0], points[members[i], 1] - sensor[1]
        bearing[i] = math.atan2(x * py - y * px, x * px + y * py)
    return members[np.argsort(bearing, kind="mergesort")]


@light
def _circle(returns: Returns, part: IntArray, sizes: tuple[float, float], sigma: float) -> tuple[float, float, float]:
    """x, y and radius of the body of which a part of a cluster is an arc, were nothing known of it; radius 0: of none."""
    if part.shape[0] < LEAST:
        return 0.0, 0.0, 0.0
    one, other = returns.raw[part[0]], returns.raw[part[-1]]
    r = 0.5 * math.hypot(one[0] - other[0], one[1] - other[1])  # little less than the radius of one that is seen whole
    if not 0.0 < r <= sizes[1]:
        return 0.0, 0.0, 0.0
    a = arc(returns.raw, part, returns.sensor, sigma, r, 0.25 * r * r)
    return a.x, a.y, a.radius if a.fits and sizes[0] <= a.radius <= sizes[1] else 0.0


@light
def _off(points: FloatArray, j: int, circle: FloatArray, unknown: float) -> float:
    """How far point j lies off a circle (3,), m; `unknown` of one of radius 0, which nobody knows."""
    if circle[2] == 0.0:
        return unknown
    return float(abs(math.hypot(points[j, 0] - circle[0], points[j, 1] - circle[1]) - circle[2]))


@kernel
def _meetings(points: FloatArray, part: IntArray, sensor: FloatArray, least: float) -> IntArray:
    """Where bodies may meet in a part of a cluster: the points farthest behind each side of its hull, as the sensor sees it.

    Args:
        points: (m, 2) m.
        part: (n,) which of them, counter-clockwise about the sensor.
        sensor: Its pose.
        least: What lies no farther behind does so by noise, m.

    Returns:
        Where each body ends; the last one ends with the part.
    """
    n = part.shape[0]
    hull, h = np.empty(n, dtype=np.int64), 0
    for i in range(n):  # the near side of the hull turns to the right
        while h > 1 and _behind(points, part[hull[h - 2]], part[i], part[hull[h - 1]]) >= 0.0:
            h -= 1
        hull[h] = i
        h += 1
    ends, k = np.empty(h, dtype=np.int64), 0
    for side in range(h - 1):
        depth = least
        for i in range(hull[side] + 1, hull[side + 1]):
            behind = _behind(points, part[hull[side]], part[hull[side + 1]], part[i])
            if behind > depth:
                ends[k], depth = i + 1, behind
        k += 1 if depth > least else 0
    ends[k] = n
    return ends[: k + 1]


@light
def _behind(points: FloatArray, a: int, b: int, j: int) -> float:
    """How far point j lies behind the way from a to b, which goes counter-clockwise about the sensor, m."""
    dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    px, py = points[j, 0] - points[a, 0], points[j, 1] - points[a, 1]
    return float((px * dy - py * dx) / max(math.hypot(dx, dy), 1e-9))


@kernel
def _described(returns: Returns, of: IntArray, increment: float) -> tuple[FloatArray, IntArray, FloatArray]:
    """The circles, sizes and distances of all clusters, with the parts of clusters `of` (n,) behind them."""
    k, n = returns.size.shape[0], of.shape[0]
    circles, size, far = np.empty((k + n, 3)), np.zeros(k + n, dtype=np.int64), np.zeros(k + n)
    circles[:k], size[:k], far[:k] = returns.circles, returns.size, returns.far
    order, first = by_label(returns.label, k + n)
    for i in range(2 * n):
        c = of[i] if i < n else k + i - n
        members = order[first[c] : first[c + 1]]
        circles[c, 0], circles[c, 1], circles[c, 2] = enclosing_circle(returns.points, members)
        size[c], far[c] = members.shape[0], 0.0
        for j in members:
            far[c] += returns.distance[j] / size[c]
        circles[c, 2] += 0.5 * increment * far[c]
    return circles, size, far
