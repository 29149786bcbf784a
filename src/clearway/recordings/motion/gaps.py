"""Gaps of a pose: short ones are filled by a smooth curve through what is on both sides, long ones stay open."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.motion import Gap

SIDE = 0.1
"""s; so much is looked at on either side of a gap at least, so that noise of a single sample doesn't set the slope."""

FEWEST = 3
"""Samples on either side that a curve needs."""


@dataclass(frozen=True, slots=True, eq=False)
class Filled:
    """A pose without its short gaps.

    Attributes:
        pose: (n, d) pose, NaN in what was left open.
        variance: (n, d) variance of what was filled, 0 elsewhere.
        gaps: All gaps, in order.
    """

    pose: FloatArray
    variance: FloatArray
    gaps: tuple[Gap, ...]


def runs(mask: Any) -> Any:
    """Where `mask` (n,) holds without a break: (k, 2) int, first and one past the last of each."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return edges.reshape(-1, 2)


def known(pose: FloatArray) -> Any:
    """(n,) bool, where all of `pose` (n, d) is there."""
    return np.isfinite(pose).all(axis=1)


def seen_in_part(t: FloatArray, partly: Any, least: float) -> tuple[Gap, ...]:
    """The stretches of more than `least` [s] in which the pose comes from fewer markers than the body has: (n,) bool
    says where. Shorter ones are without number where single markers flicker."""
    return tuple(Gap(float(t[a]), float(t[b - 1]), "markers") for a, b in runs(partly) if t[b - 1] - t[a] > least)


def usual_step(t: FloatArray) -> float:
    """Median time between samples, s; 0 below two."""
    return float(np.median(np.diff(t))) if len(t) > 1 else 0.0


def stretches(t: FloatArray, there: Any, longest: float) -> list[tuple[int, int]]:
    """Where a body is known without a break (first, one past the last): no sample missing, and none of the times
    between two samples longer than `longest` [s] and three usual steps."""
    hole = max(longest, 3 * usual_step(t)) * (1 + 1e-9)
    found: list[tuple[int, int]] = []
    for a, b in runs(there):
        cuts = a + 1 + np.flatnonzero(np.diff(t[a:b]) > hole)
        bounds = [int(a), *(int(c) for c in cuts), int(b)]
        found += pairwise(bounds)
    return found


def fill(t: FloatArray, pose: FloatArray, longest: float) -> Filled:
    """Fill the gaps of `pose` (n, d) [NaN; heading unwrapped] that last at most `longest` [s], from last seen to next.

    A gap is bridged by one cubic, the least-squares one over it and as much on either side (at least 0.1 s): the
    smoothing that keeps noise of the samples at its edges from being blown up within. Its variance: the fit's own, and
    what one order less would have made different. Missing samples and missing frames (a leap of the stamps) before
    the first and after the last sample are no gaps that could be filled.
    """
    there = known(pose)
    out, variance = pose.copy(), np.zeros_like(pose)
    gaps: list[Gap] = []
    rows = np.flatnonzero(there)
    holes = runs(~there)
    for a, b in holes:
        if a == 0 or b == len(t):
            gaps.append(Gap(float(t[a]), float(t[b - 1]), ""))
            continue
        span = float(t[b] - t[a - 1])
        filled = None
        if span <= longest * (1 + 1e-9):
            filled = _bridge(t, pose, rows, int(a), int(b), max(span, SIDE))
        if filled is not None:
            out[a:b], variance[a:b] = filled
        gaps.append(Gap(float(t[a - 1]), float(t[b]), "" if filled is None else "spline"))
    out[~known(out)] = np.nan
    step = usual_step(t)
    hole = max(longest, 3 * step) * (1 + 1e-9)
    for i in np.flatnonzero(np.diff(t) > hole):
        if there[i] and there[i + 1]:
            gaps.append(Gap(float(t[i]), float(t[i + 1]), ""))
    return Filled(out, variance, tuple(sorted(gaps, key=lambda g: g.start)))


def _bridge(
    t: FloatArray, pose: FloatArray, seen: Any, a: int, b: int, side: float
) -> tuple[FloatArray, FloatArray] | None:
    """Values and variances (b - a, d) within the gap, None where too little is seen beside it."""
    first = np.searchsorted(seen, np.searchsorted(t, t[a - 1] - side - 1e-9))
    split = np.searchsorted(seen, a)
    last = np.searchsorted(seen, np.searchsorted(t, t[b] + side + 1e-9))
    if min(split - first, last - split) < FEWEST:
        return None
    rows = seen[first:last]
    middle, half = (t[a - 1] + t[b]) / 2, (t[b] - t[a - 1]) / 2 + side
    powers = np.vander((t[rows] - middle) / half, 4, increasing=True)
    inside = np.vander((t[a:b] - middle) / half, 4, increasing=True)
    values = pose[rows]
    cubic = np.linalg.lstsq(powers, values, rcond=None)[0]
    square = np.linalg.lstsq(powers[:, :3], values, rcond=None)[0]
    freedom = max(len(rows) - 4, 1)
    scatter = ((values - powers @ cubic) ** 2).sum(axis=0) / freedom
    q = np.linalg.lstsq(powers.T @ powers, inside.T, rcond=None)[0]
    leverage = np.maximum(np.einsum("ij,ji->i", inside, q), 0.0)  # below zero by rounding alone
    filled = inside @ cubic
    return filled, leverage[:, None] * scatter + (filled - inside[:, :3] @ square) ** 2
