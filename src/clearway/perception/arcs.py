"""Round bodies in a scan: the circle of which the returns of a cluster are an arc."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
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


@kernel
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
    a = np.empty((3, 3))
    squares = math.inf
    for step in range(STEPS + 1):
        a[:] = 0.0
        a[2, 2] = 1.0 / variance
        bx, by, br = 0.0, 0.0, (radius - r) / variance
        squares = (radius - r) ** 2 / variance
        for k in range(n):
            px, py = points[rows[k], 0] - x, points[rows[k], 1] - y
            d = max(math.hypot(px, py), 1e-9)
            ux, uy, e = px / d, py / d, d - r  # of the distance the derivatives are -u, of the residual that of r is -1
            squares += weight * e * e
            bx += weight * ux * e
            by += weight * uy * e
            br += weight * e
            a[0, 0] += weight * ux * ux
            a[0, 1] += weight * ux * uy
            a[1, 1] += weight * uy * uy
            a[0, 2] += weight * ux
            a[1, 2] += weight * uy
            a[2, 2] += weight
        # inverse of the symmetric 3 x 3
        a00, a01, a02, a11, a12, a22 = a[0, 0], a[0, 1], a[0, 2], a[1, 1], a[1, 2], a[2, 2]
        c00, c01, c02 = a11 * a22 - a12 * a12, a02 * a12 - a01 * a22, a01 * a12 - a02 * a11
        c11, c12, c22 = a00 * a22 - a02 * a02, a01 * a02 - a00 * a12, a00 * a11 - a01 * a01
        det = a00 * c00 + a01 * c01 + a02 * c02
        if not det > 0.0:
            return Arc(x, y, r, math.inf, math.inf, False)
        if step == STEPS:
            break
        x += (c00 * bx + c01 * by + c02 * br) / det
        y += (c01 * bx + c11 * by + c12 * br) / det
        r += (c02 * bx + c12 * by + c22 * br) / det
        if not (0.0 < r < 10.0):
            return Arc(x, y, r, math.inf, math.inf, False)
    of_centre, of_radius = 0.5 * (a00 + a11) / c22, c22 / det  # half the trace of the inverse of the 2 x 2
    behind = (x - sensor[0]) * dx + (y - sensor[1]) * dy > far
    free = n - 2.0
    fits = behind and squares <= free + DOUBT * math.sqrt(2.0 * free) and of_radius <= (SHARP * r) ** 2
    return Arc(x, y, r, of_centre, of_radius, fits)
