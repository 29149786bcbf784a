"""Parts clusters of a scan that are several round bodies, which touch or overlap in view, where these meet."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray
from clearway.perception.arcs import LEAST, arc
from clearway.perception.clusters import JOIN, IntArray, Returns, by_label, hides, surrounded


def parted(returns: Returns, increment: float, sizes: tuple[float, float], sigma: float) -> Returns:
    """`returns`, with each round body of a cluster that holds several as a cluster of its own.

    A group that stands in a half circle about the sensor remains one: the near side of its hull has one meeting, in the middle.

    Args:
        returns: What was seen.
        increment: Between two beams, rad.
        sizes: Least and largest radius of a round body, m.
        sigma: Standard deviation of a range, m, above 0.
    """
    returns = returns._replace(label=returns.label.copy())
    cut = _part(returns, sizes, sigma)
    more = len(cut) - len(returns.size)
    if more == 0:
        return returns
    circles, size, far = _described(returns, more, increment)
    legs = np.append(returns.legs, np.zeros(more, dtype=np.uint8))
    return returns._replace(circles=circles, size=size, far=far, cut=cut, legs=legs)


@kernel
def _part(returns: Returns, sizes: tuple[float, float], sigma: float) -> npt.NDArray[np.uint8]:
    """Give parts of clusters labels of their own, behind all others; (k + n,) which clusters are cut now."""
    k, n, least = returns.size.shape[0], 0, JOIN * math.sqrt(2.0) * sigma
    order, first = by_label(returns.label, k)
    m = order.shape[0]
    cut, left = np.zeros(k + m, dtype=np.uint8), np.empty((m + 1, 2), dtype=np.int64)
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
            ends, began = _meetings(returns.raw, members[a:b], least), a
            circles = np.empty((ends.shape[0], 3))
            for i in range(ends.shape[0]):  # of what is beside a meeting nobody knows yet whose it is
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
            began, was_cut = a, cut[returns.label[members[a]]]
            for i in range(ends.shape[0]):
                end = a + ends[i]
                if i + 1 < ends.shape[0] and not (rounds[i] or rounds[i + 1]):
                    continue
                if began > a:
                    returns.label[members[began:end]] = k + n
                    cut[k + n] = was_cut
                    beyond = returns.distance[members[began]] - returns.distance[members[began - 1]]
                    if abs(beyond) > hides(sigma):  # what is nearer may hide a part of the other
                        cut[returns.label[members[began if beyond > 0.0 else began - 1]]] = 1
                    n += 1
                if not rounds[i]:
                    left[more, 0], left[more, 1] = began, end
                    more += 1
                began = end
    return cut[: k + n]


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
    """x, y and radius of the body of which a part of a cluster is an arc, as if nothing were known of it; radius 0: of none."""
    if part.shape[0] < LEAST:
        return 0.0, 0.0, 0.0
    one, other = returns.raw[part[0]], returns.raw[part[-1]]
    r = 0.5 * math.hypot(
        one[0] - other[0], one[1] - other[1]
    )  # a little less than the radius of one that is seen whole
    if not 0.0 < r <= sizes[1]:
        return 0.0, 0.0, 0.0
    a = arc(returns.raw, part, returns.sensor, sigma, r, 0.25 * r * r)
    if not (a.fits and sizes[0] <= a.radius <= sizes[1]):
        return 0.0, 0.0, 0.0
    return a.x, a.y, a.radius


@light
def _off(points: FloatArray, j: int, circle: FloatArray, unknown: float) -> float:
    """How far point j lies off a circle (3,), m; `unknown` of one of radius 0, which nobody knows."""
    if circle[2] == 0.0:
        return unknown
    return float(abs(math.hypot(points[j, 0] - circle[0], points[j, 1] - circle[1]) - circle[2]))


@kernel
def _meetings(points: FloatArray, part: IntArray, least: float) -> IntArray:
    """Where bodies may meet in a part of a cluster: the points farthest behind each side of its hull, as the sensor sees it.

    Args:
        points: (m, 2) m.
        part: (n,) which of them, counter-clockwise about the sensor, over less than half a turn.
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
def _described(returns: Returns, more: int, increment: float) -> tuple[FloatArray, IntArray, FloatArray]:
    """The circles, sizes and distances of all clusters, so many more than there were; of those that kept their returns the old ones."""
    k = returns.size.shape[0]
    circles, size, far = np.empty((k + more, 3)), np.zeros(k + more, dtype=np.int64), np.zeros(k + more)
    order, first = by_label(returns.label, k + more)
    for c in range(k + more):
        members = order[first[c] : first[c + 1]]
        size[c] = members.shape[0]
        if c < k and size[c] == returns.size[c]:
            circles[c], far[c] = returns.circles[c], returns.far[c]
            continue
        circles[c, 0], circles[c, 1], circles[c, 2], far[c] = surrounded(
            returns.points, returns.distance, members, increment
        )
    return circles, size, far
