"""Robust EM: a mixture of Gaussians whose number of components is found, not given.

Yang, Lai, Lin 2012, "A robust EM clustering algorithm for Gaussian mixture models", Pattern Recognition 45, 3950-3961.
Every point starts as a component of its own. A penalty on the entropy of the proportions lets components compete:

    alpha_k <- alpha_k^EM + beta alpha_k (ln alpha_k - sum_s alpha_s ln alpha_s)

and those that fall below one point's share are dropped. Written for the plane.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

GAMMA = 1e-4
"""Share of d_min^2 I in a covariance: keeps it from becoming singular."""

STABLE = 60
"""Iterations without a change of the number of components after which beta is 0."""

_ETA = 1.0  # min(1, 0.5^floor(d / 2 - 1)) for d = 2


@kernel
def robust_em(points: FloatArray, tolerance: float, iterations: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fit a mixture to `points` (n, 2).

    Args:
        points: (n, 2) m; fewer than two different ones give no component.
        tolerance: Ends when no mean moves farther than this in an iteration, m, and beta is 0 or the number of
            components stayed the same.
        iterations: So many at most.

    Returns:
        alpha (c,) proportions, sum 1; mean (c, 2), m; covariance (c, 3) xx, xy, yy, m^2.
    """
    n = points.shape[0]
    least, widths = _spread(points)
    if not least < np.inf:
        return np.empty(0), np.empty((0, 2)), np.empty((0, 3))
    c, beta = n, 1.0
    alpha, mean, covariance = np.full(n, 1.0 / n), points.copy(), np.zeros((n, 3))
    for k in range(n):
        covariance[k, 0] = covariance[k, 2] = (1.0 - GAMMA) * widths[k] + GAMMA * least
    z, em = np.empty((n, n)), np.empty(n)
    history = np.zeros(iterations + 1, np.int64)
    history[0] = c
    _responsibilities(points, c, alpha, mean, covariance, z)
    for t in range(1, iterations + 1):
        moved = _means(points, c, z, mean)
        beta = _proportions(n, c, z, alpha, em, beta)
        c_new = _drop(n, c, alpha, mean, z)
        if t >= STABLE and history[t - STABLE] == c_new:
            beta = 0.0
        settled = c_new == c
        c = history[t] = c_new
        _covariances(points, c, z, mean, covariance, least)
        _responsibilities(points, c, alpha, mean, covariance, z)
        if settled and moved < tolerance:
            break
    return alpha[:c].copy(), mean[:c].copy(), covariance[:c].copy()


@kernel
def _spread(points: FloatArray) -> tuple[float, FloatArray]:
    """The smallest squared distance above 0 between two points, and for each point its ceil(sqrt(n))-th smallest."""
    n = points.shape[0]
    rank = math.ceil(math.sqrt(n))
    least, widths, row = np.inf, np.empty(n), np.empty(n)
    for i in range(n):
        count = 0
        for j in range(n):
            d = (points[i, 0] - points[j, 0]) ** 2 + (points[i, 1] - points[j, 1]) ** 2
            if d > 0.0:
                row[count] = d
                count += 1
        if count == 0:
            return np.inf, widths
        ordered = np.sort(row[:count])
        widths[i] = ordered[min(rank, count) - 1]
        least = min(least, ordered[0])
    return least, widths


@kernel
def _responsibilities(
    points: FloatArray, c: int, alpha: FloatArray, mean: FloatArray, covariance: FloatArray, z: FloatArray
) -> None:
    """z (n, c): the share of component k in point i."""
    for k in range(c):
        xx, xy, yy = covariance[k]
        det = xx * yy - xy * xy
        scale, ixx, ixy, iyy = alpha[k] / math.sqrt(det), yy / det, -xy / det, xx / det
        for i in range(points.shape[0]):
            dx, dy = points[i, 0] - mean[k, 0], points[i, 1] - mean[k, 1]
            z[i, k] = scale * math.exp(-0.5 * (ixx * dx * dx + 2.0 * ixy * dx * dy + iyy * dy * dy))
    for i in range(points.shape[0]):
        total = 0.0
        for k in range(c):
            total += z[i, k]
        if total > 0.0:
            for k in range(c):
                z[i, k] /= total
        else:  # too far from all: the nearest takes it
            near, least = 0, np.inf
            for k in range(c):
                z[i, k] = 0.0
                d = (points[i, 0] - mean[k, 0]) ** 2 + (points[i, 1] - mean[k, 1]) ** 2
                if d < least:
                    near, least = k, d
            z[i, near] = 1.0


@kernel
def _means(points: FloatArray, c: int, z: FloatArray, mean: FloatArray) -> float:
    """Means from the shares; returns how far the one that moved most has moved, m."""
    most = 0.0
    for k in range(c):
        total = x = y = 0.0
        for i in range(points.shape[0]):
            total += z[i, k]
            x += z[i, k] * points[i, 0]
            y += z[i, k] * points[i, 1]
        if total > 0.0:
            most = max(most, math.hypot(x / total - mean[k, 0], y / total - mean[k, 1]))
            mean[k, 0], mean[k, 1] = x / total, y / total
    return most


@kernel
def _proportions(n: int, c: int, z: FloatArray, alpha: FloatArray, em: FloatArray, beta: float) -> float:
    """Proportions in place, by the competition; returns the next beta."""
    entropy = 0.0
    for k in range(c):
        entropy += alpha[k] * math.log(alpha[k])
    change = largest_em = largest = 0.0
    for k in range(c):
        total = 0.0
        for i in range(n):
            total += z[i, k]
        em[k] = total / n
        old = alpha[k]
        alpha[k] = em[k] + beta * old * (math.log(old) - entropy)
        change += math.exp(-_ETA * n * abs(alpha[k] - old))
        largest_em, largest = max(largest_em, em[k]), max(largest, old)
    bound = -largest * entropy
    return min(change / c, (1.0 - largest_em) / bound if bound > 0.0 else 0.0)


@kernel
def _drop(n: int, c: int, alpha: FloatArray, mean: FloatArray, z: FloatArray) -> int:
    """Drop components of less than one point's share (but never the largest), close ranks, scale to sum 1."""
    best = 0
    for k in range(c):
        if alpha[k] > alpha[best]:
            best = k
    kept, total = 0, 0.0
    for k in range(c):
        if alpha[k] >= 1.0 / n or k == best:
            alpha[kept], total = alpha[k], total + alpha[k]
            mean[kept] = mean[k]
            z[:, kept] = z[:, k]
            kept += 1
    for k in range(kept):
        alpha[k] /= total
    for i in range(n):
        row = 0.0
        for k in range(kept):
            row += z[i, k]
        for k in range(kept):
            z[i, k] = z[i, k] / row if row > 0.0 else 1.0 / kept
    return kept


@kernel
def _covariances(
    points: FloatArray, c: int, z: FloatArray, mean: FloatArray, covariance: FloatArray, least: float
) -> None:  # fmt: skip
    for k in range(c):
        total = xx = xy = yy = 0.0
        for i in range(points.shape[0]):
            dx, dy, w = points[i, 0] - mean[k, 0], points[i, 1] - mean[k, 1], z[i, k]
            total += w
            xx += w * dx * dx
            xy += w * dx * dy
            yy += w * dy * dy
        if total > 0.0:
            covariance[k, 0], covariance[k, 1], covariance[k, 2] = xx / total, xy / total, yy / total
        shrink, floor = 1.0 - GAMMA, GAMMA * least
        covariance[k, 0] = shrink * covariance[k, 0] + floor
        covariance[k, 1] = shrink * covariance[k, 1]
        covariance[k, 2] = shrink * covariance[k, 2] + floor
