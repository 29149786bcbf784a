"""Tracking problems for tests, and what their solvers are held to, worked out apart from them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.tracking.problem import Problem, roll_out


def problem(
    *,
    start: npt.ArrayLike,
    reference: npt.ArrayLike,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    period: float,
    previous: npt.ArrayLike = (0.0, 0.0),
    nominal: npt.ArrayLike | None = None,
    rows: npt.ArrayLike | None = None,
    counts: npt.ArrayLike | None = None,
    passed: npt.ArrayLike | None = None,
    decay: float = 1.0,
    centre: npt.ArrayLike | None = None,
    reach: npt.ArrayLike = math.inf,
    area: npt.ArrayLike = (-math.inf, -math.inf, math.inf, math.inf),
    smooth: npt.ArrayLike = math.inf,
    discount: npt.ArrayLike = 1.0,
    effort: float = 0.0,
    heading_weight: float = 0.0,
    exact: bool = True,
    control_horizon: int | None = None,
) -> Problem:
    """A `Problem` with the right types: bounds may be given once for all stages, what is left out does not bind."""
    ref = np.array(reference, dtype=np.float64, order="C").reshape(-1, 3)
    n = len(ref)
    held = n if control_horizon is None else control_horizon

    def each(values: npt.ArrayLike, *shape: int) -> FloatArray:
        return np.array(np.broadcast_to(np.asarray(values, dtype=np.float64), (n, *shape)), order="C")

    obstacles = np.zeros((n, 0, 3)) if rows is None else np.array(rows, dtype=np.float64, order="C")
    count = np.full(n, obstacles.shape[1], dtype=np.int64) if counts is None else np.array(counts, dtype=np.int64)
    pose = np.array(start, dtype=np.float64).reshape(3)
    return Problem(
        start=pose,
        previous=np.array(previous, dtype=np.float64).reshape(2),
        reference=ref,
        nominal=np.zeros((n, 2)) if nominal is None else each(nominal, 2),
        rows=obstacles,
        counts=count,
        passed=np.zeros((0, 3)) if passed is None else np.array(passed, dtype=np.float64).reshape(-1, 3),
        decay=float(decay),
        centre=pose[:2].copy() if centre is None else np.array(centre, dtype=np.float64).reshape(2),
        reach=each(reach),
        area=each(area, 4),
        low=each(low, 2),
        high=each(high, 2),
        smooth=each(smooth),
        discount=each(discount),
        effort=float(effort),
        heading_weight=float(heading_weight),
        period=float(period),
        exact=bool(exact),
        control_horizon=held,
    )


def cost(problem: Problem, inputs: FloatArray, states: FloatArray) -> float:
    """Eq. 2 of a plan and the poses that it leads to: norms of (dx, dy, heading_weight dtheta), not squared."""
    total = 0.0
    for k in range(len(inputs)):
        dx = states[k, 0] - problem.reference[k, 0]
        dy = states[k, 1] - problem.reference[k, 1]
        turn = problem.heading_weight * turn_between(problem.reference[k, 2], states[k, 2])
        total += problem.discount[k] * math.sqrt(dx * dx + dy * dy + turn * turn)
        total += problem.effort * (inputs[k, 0] ** 2 + inputs[k, 1] ** 2)
    return total


def violations(problem: Problem, inputs: FloatArray) -> FloatArray:
    """How far a plan (N, 2) breaks each kind of constraint at most, 0: not at all.

    Returns:
        (5,): state box (3c) [m], input box (3d) [m/s or rad/s], rate limit (3e), stay-inside circle (3f) [m],
        obstacles (3g-3j) [m].
    """
    out = np.zeros(5)
    states = roll_out(problem, inputs)
    for k in range(len(inputs)):
        x, y = states[k, 0], states[k, 1]
        out[0] = max(
            out[0],
            problem.area[k, 0] - x,
            problem.area[k, 1] - y,
            x - problem.area[k, 2],
            y - problem.area[k, 3],
        )
        last = problem.previous if k == 0 else inputs[k - 1]
        for j in range(2):
            out[1] = max(out[1], problem.low[k, j] - inputs[k, j], inputs[k, j] - problem.high[k, j])
        change = math.hypot(inputs[k, 0] - last[0], inputs[k, 1] - last[1])
        out[2] = max(out[2], change - problem.smooth[k])
        out[3] = max(out[3], math.hypot(x - problem.centre[0], y - problem.centre[1]) - problem.reach[k])
        for i in range(problem.counts[k]):
            gap = math.hypot(x - problem.rows[k, i, 0], y - problem.rows[k, i, 1])
            out[4] = max(out[4], problem.rows[k, i, 2] - gap)
    return out
