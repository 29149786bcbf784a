"""The smallest circle around points."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray

_ROUNDS = 64  # far more than a planar set needs: the radius grows in each
_ROUNDING = 1e-12  # relative


@kernel
def enclosing_circle(points: FloatArray, rows: npt.NDArray[np.int64]) -> tuple[float, float, float]:
    """The smallest circle that holds `points[rows]`: x, y, radius [m]; it holds each of them to the last digit.

    Takes in the farthest point outside until none is left, each time solving for the few points that carry the circle
    (the pivot rule of Gärtner 1999, "Fast and robust smallest enclosing balls").

    Args:
        points: (n, 2), finite.
        rows: (m,) which of them, at least one.
    """
    carriers = np.empty((4, 2))
    carriers[0] = points[rows[0]]
    x, y, squared, count = carriers[0, 0], carriers[0, 1], 0.0, 1
    for _ in range(_ROUNDS):
        far, most = -1, squared * (1.0 + _ROUNDING) + 1e-24
        for i in range(rows.shape[0]):
            d = (points[rows[i], 0] - x) ** 2 + (points[rows[i], 1] - y) ** 2
            if d > most:
                far, most = rows[i], d
        if far < 0:
            break
        carriers[count] = points[far]
        x, y, squared, count = _carried(carriers, count + 1)
    radius = 0.0
    for i in range(rows.shape[0]):
        radius = max(radius, math.hypot(points[rows[i], 0] - x, points[rows[i], 1] - y))
    return x, y, radius


@light
def _carried(carriers: FloatArray, count: int) -> tuple[float, float, float, int]:
    """The smallest circle around up to four points, the last of which lies on it: x, y, squared radius, and how many
    points carry it, which are moved to the front.
    """
    last = count - 1
    best, bx, by = math.inf, carriers[last, 0], carriers[last, 1]
    one, other = -1, -1
    for i in range(last):
        for j in range(i, last):  # j == i: the circle over the diameter from i to the last one
            ax, ay = carriers[i, 0] - carriers[last, 0], carriers[i, 1] - carriers[last, 1]
            cx, cy = carriers[j, 0] - carriers[last, 0], carriers[j, 1] - carriers[last, 1]
            if i == j:
                x, y = 0.5 * ax, 0.5 * ay
            else:
                across = 2.0 * (ax * cy - ay * cx)
                if across == 0.0:
                    continue
                a, c = ax * ax + ay * ay, cx * cx + cy * cy
                x, y = (cy * a - ay * c) / across, (ax * c - cx * a) / across
            x, y = x + carriers[last, 0], y + carriers[last, 1]
            most = 0.0
            for k in range(count):
                most = max(most, (carriers[k, 0] - x) ** 2 + (carriers[k, 1] - y) ** 2)
            if most < best:
                best, bx, by, one, other = most, x, y, i, j
    kept = 2 if one == other else 3
    for k in range(2):  # one <= other < last: none is overwritten before it has moved
        carriers[0, k] = carriers[one, k]
        carriers[1, k] = carriers[other if kept == 3 else last, k]
        carriers[kept - 1, k] = carriers[last, k]
    return bx, by, best, kept
