"""Round bodies in a scan: the circle of which the returns of a cluster are an arc."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray
from clearway.perception.clusters import IntArray

STEPS = 8
"""Of Gauss and Newton: from a first guess within half a radius they settle."""
LEAST = 5
"""Returns of an arc of which nothing is known: three carry a circle, two more tell that it is one."""
LEAST_KNOWN = 3
"""And of one whose radius is known."""
DOUBT = 3.0
"""Standard deviations of chi-squared by which the residuals of an arc may be larger than noise makes them."""
SHARP = 0.15
"""Standard deviation of a radius over it, at most: a side that is as good as straight is no arc."""
MOST = 10.0
"""m: what has a larger radius is a wall."""


class Arc(NamedTuple):
    """The circle of an arc.

    Attributes:
        x: Of its centre, m.
        y: Likewise.
        radius: m.
        variance: Of a coordinate of the centre, were the radius known, m^2.
        radius_variance: m^2.
        fits: Whether the returns are an arc of it, as far as noise allows.
    """

    x: float
    y: float
    radius: float
    variance: float
    radius_variance: float
    fits: bool


@light
def arc(points: FloatArray, rows: IntArray, sensor: FloatArray, sigma: float, radius: float, variance: float) -> Arc:
    """The likeliest circle through `points[rows]`, of which the near side is seen, by Gauss and Newton.

    Args:
        points: (n, 2) m.
        rows: (m,) which of them, three or more.
        sensor: (3,) pose of the lidar in the same frame.
        sigma: Standard deviation of a range, m.
        radius: What is known of it before, m.
        variance: Of that, m^2.
    """
    n = rows.shape[0]
    x, y = 0.0, 0.0
    for k in range(n):
        x += points[rows[k], 0] / n
        y += points[rows[k], 1] / n
    dx, dy = x - sensor[0], y - sensor[1]
    far = max(math.hypot(dx, dy), 1e-9)
    dx, dy = dx / far, dy / far
    r = radius
    x, y = x + 0.7 * r * dx, y + 0.7 * r * dy
    weight = 1.0 / (sigma * sigma)
    for step in range(STEPS + 1):
        off = radius - r
        squares, xx, xy, yy, xr, yr, rr = off * off / variance, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / variance
        bx, by, br = 0.0, 0.0, off / variance
        for k in range(n):
            px, py = points[rows[k], 0] - x, points[rows[k], 1] - y
            d = max(math.hypot(px, py), 1e-9)
            ux, uy, e = px / d, py / d, d - r  # as the centre or the radius grows, e falls by u and by 1
            squares += weight * e * e
            bx, by, br = bx + weight * ux * e, by + weight * uy * e, br + weight * e
            xx, xy, yy = xx + weight * ux * ux, xy + weight * ux * uy, yy + weight * uy * uy
            xr, yr, rr = xr + weight * ux, yr + weight * uy, rr + weight
        # the inverse of that symmetric matrix is these cofactors over its determinant
        cxx, cxy, cxr = yy * rr - yr * yr, xr * yr - xy * rr, xy * yr - xr * yy
        cyy, cyr, crr = xx * rr - xr * xr, xy * xr - xx * yr, xx * yy - xy * xy
        det = xx * cxx + xy * cxy + xr * cxr
        if not (det > 0.0 and crr > 0.0):
            return Arc(x, y, r, math.inf, math.inf, False)
        if step == STEPS:
            break
        x += (cxx * bx + cxy * by + cxr * br) / det
        y += (cxy * bx + cyy * by + cyr * br) / det
        r += (cxr * bx + cyr * by + crr * br) / det
        if not 0.0 < r < MOST:
            return Arc(x, y, r, math.inf, math.inf, False)
    of_centre, of_radius = (
        0.5 * (xx + yy) / crr,
        crr / det,
    )  # half the trace of the inverse of what belongs to the centre
    behind = (x - sensor[0]) * dx + (y - sensor[1]) * dy > far
    free = n - 2.0
    fits = behind and squares <= free + DOUBT * math.sqrt(2.0 * free) and of_radius <= (SHARP * r) ** 2
    return Arc(x, y, r, of_centre, of_radius, fits)
