"""A small primal-dual interior point for the convex programs that the tracking problem linearises to.

    min  sum_k gamma_k |S (e_k + dx_k)| + w_2 sum_k |u_k|^2 + rho sum_i t_i
    s.t. dx_k = A_k dx_{k-1} + B_k (u_k - u0_k)               (the inputs are the only unknowns)
         low <= u <= high,  |u_k - u_{k-1}| <= smooth_k,  n_i . dr_i + m_i . dr'_i + t_i >= b_i,  t_i >= 0

with dr'_i one stage before dr_i (0 before the first).
Norms are not squared: each is smoothed by the barrier parameter and has a dual vector y, |y| <= 1, of its own, as in
Andersen, Christiansen, Conn, Overton (SIAM J. Sci. Comput. 22, 2000), so that residuals of exactly zero, which such
costs favour, converge like any other. The slack t of a soft row is eliminated: its multiplier stays within (0, rho).
Steps follow Mehrotra's predictor and corrector (SIAM J. Optim. 2, 1992). The Newton system has the structure of a
linear-quadratic regulator over the pose and the input before, so a Riccati recursion solves it in O(N).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.tracking.problem import IntArray
from clearway.navigators.common.tracking.riccati import LinearMotion, factorise, roll, solve

FAR = 1e4
"""What an infinite bound on an input counts as [m/s, rad/s]."""

_SHORT = 0.995  # share of the way to the boundary that a step may go

_SLACK, _MULTIPLIER, _D_SLACK, _D_MULTIPLIER, _TARGET = range(5)
"""Of each inequality: slack, multiplier, their steps, and the product of slack and multiplier that is aimed at.

Those of the inputs stand in `bounds` (N^c, 5, 5): v and omega above their lower ends, v and omega below their upper
ends, and the change, of which all is 0 where it has no bound. Those of the soft rows stand in `rows` (R, 9).
"""

_VIOLATION, _D_VIOLATION, _TARGET_VIOLATION, _WEIGHT = range(5, 9)
"""Of a soft row also t >= 0, whose multiplier is rho less the row's, and the row's weight in the Hessian."""


class Program(NamedTuple):
    """The convex program.

    Attributes:
        motion: How dx depends on the inputs.
        error: (N, 3) e_k, poses less the reference.
        heading_weight: S = diag(1, 1, heading_weight).
        gamma: (N,) weight of each norm.
        effort: w_2.
        base: (N^c, 2) u0; the last one serves the stages from N^c on, too.
        low: (N^c, 2) lower bound on the inputs.
        high: (N^c, 2) upper bound on them.
        smooth: (>= N^c,) bound on the change of the inputs; inf: none.
        previous: (2,) the input before.
        stage: (>= R,) int64, of the pose that each soft row is about; in any order.
        normal: (>= R, 2) n_i.
        before: (>= R, 2) m_i; (0, 2): all are 0, each row is about one pose.
        lack: (>= R,) b_i.
        rows: R; so many soft rows there are.
        penalty: rho.
    """

    motion: LinearMotion
    error: FloatArray
    heading_weight: float
    gamma: FloatArray
    effort: float
    base: FloatArray
    low: FloatArray
    high: FloatArray
    smooth: FloatArray
    previous: FloatArray
    stage: IntArray
    normal: FloatArray
    before: FloatArray
    lack: FloatArray
    rows: int
    penalty: float


@kernel
def soft_multiplier(gap: float, rho: float, mu: float) -> float:
    """The multiplier in (0, rho) of a soft row with n . dr - b = `gap` on the central path: mu/l - mu/(rho - l) = gap."""
    root = math.sqrt(gap * gap * rho * rho + 4.0 * mu * mu)
    if gap >= 0.0:
        return 2.0 * mu * rho / (gap * rho + 2.0 * mu + root)
    return rho - 2.0 * mu * rho / (2.0 * mu - gap * rho + root)


@kernel
def minimise(program: Program, mu: float, mu_end: float, limit: int, out: FloatArray) -> int:
    """The minimiser, written into `out` (N^c, 2).

    Args:
        program: The convex program.
        mu: Barrier parameter at the start.
        mu_end: Barrier parameter at the end.
        limit: Most iterations.
        out: (N^c, 2), filled.

    Returns:
        Iterations spent. The answer lies strictly within the box and is as good as mu_end makes it; the rate limits
        may be off by rounding of the same order.
    """
    # taken apart once: each kernel that takes a tuple counts references to all its arrays; small problems took 28 %
    # longer where the steps below took theirs in tuples
    (
        motion,
        error,
        heading_weight,
        gamma,
        effort,
        base,
        _,
        _,
        smooth,
        previous,
        stage,
        normal,
        before,
        lack,
        count,
        rho,
    ) = program
    n, free = len(error), len(base)
    u, change, bounds = np.empty((free, 2)), np.empty((free, 2)), np.empty((free, 5, 5))
    step, delta, d_delta, rows = np.empty((free, 2)), np.empty((n, 3)), np.empty((n, 3)), np.empty((count, 9))
    pairs = _begin(program, mu, u, change, bounds, step, delta, rows)
    dual, unit = np.zeros((n, 3)), np.empty((n, 4))
    big, weight, gains = np.empty((n, 6)), np.empty((n, 5)), np.empty((free, 13))
    cross = np.empty((n if len(before) > 0 else 0, 4))
    slope, pull = np.empty((n, 3)), np.empty((free, 4))
    spent = 0
    while spent < limit:
        spent += 1
        _norm_hessian(error, heading_weight, gamma, mu, delta, dual, unit, big)
        _row_hessian(stage, normal, before, rho, rows, big, cross)
        _input_hessian(effort, change, bounds, weight)
        if not factorise(motion, big, cross, weight, gains):
            break

        # Predictor: complementarity 0. Corrector: sigma mu, less the product of the predictor's steps.
        primal, other = 1.0, 1.0
        for corrector in range(2):
            for k in range(n):
                slope[k, 0], slope[k, 1] = gamma[k] * unit[k, 0], gamma[k] * unit[k, 1]
                slope[k, 2] = gamma[k] * heading_weight * unit[k, 2]
            _row_gradient(stage, normal, before, lack, rho, delta, rows, slope)
            _input_gradient(effort, u, change, smooth, bounds, pull)
            solve(motion, slope, pull, gains, effort, u, step)
            roll(motion, step, d_delta)
            _input_steps(step, change, smooth, bounds)
            _row_steps(stage, normal, before, rho, d_delta, rows)
            primal, other = _lengths(bounds, rows, rho)
            if not (primal > 0.0 and other > 0.0):  # not a number
                return spent
            if corrector == 0:
                _aim(bounds, rows, rho, primal, other, pairs, 0.1 * mu_end)

        _turn_duals(heading_weight, unit, d_delta, other, dual)
        for k in range(n):
            for j in range(3):
                delta[k, j] += primal * d_delta[k, j]
        for k in range(free):
            for j in range(2):
                u[k, j] += primal * step[k, j]
                change[k, j] = u[k, j] - (previous[j] if k == 0 else u[k - 1, j])
        now = _go(bounds, rows, rho, primal, other) / pairs
        done = min(primal, other) > 0.9 and max(now, mu) <= 2.0 * mu_end
        mu = max(mu_end, min(mu, now))
        if done:
            break
    for k in range(free):
        out[k, 0], out[k, 1] = u[k, 0], u[k, 1]
    return spent


@kernel
def _begin(
    program: Program, mu: float, u: FloatArray, change: FloatArray, bounds: FloatArray, step: FloatArray,
    delta: FloatArray, rows: FloatArray,
) -> float:  # fmt: skip
    """Fill inputs strictly within their box, their changes, their `step` from u0, dx, and the inequalities; how many."""
    motion, _, _, _, _, base, low, high, smooth, previous, stage, normal, before, lack, count, rho = program
    pairs = 4.0 * len(base) + 2.0 * count
    for k in range(len(base)):
        for j in range(2):
            a, b = max(low[k, j], -FAR), min(high[k, j], FAR)
            if b - a < 2e-6:  # a box without inside: the caller projects
                a, b = 0.5 * (a + b) - 1e-6, 0.5 * (a + b) + 1e-6
            inside = min(0.25 * (b - a), 10.0 * mu)
            u[k, j] = min(max(base[k, j], a + inside), b - inside)
            bounds[k, j, _SLACK], bounds[k, j + 2, _SLACK] = u[k, j] - a, b - u[k, j]
            step[k, j] = u[k, j] - base[k, j]
            change[k, j] = u[k, j] - (previous[j] if k == 0 else u[k - 1, j])
        bounds[k, 4, _SLACK] = 0.0
        if smooth[k] < math.inf:
            pairs += 1.0
            room = smooth[k] ** 2 - change[k, 0] ** 2 - change[k, 1] ** 2
            bounds[k, 4, _SLACK] = max(room, min(10.0 * mu, 0.25 * smooth[k] ** 2 + 1e-9))
        for j in range(5):
            s = bounds[k, j, _SLACK]
            bounds[k, j, _MULTIPLIER] = mu / s if s > 0.0 else 0.0
            bounds[k, j, _D_SLACK] = bounds[k, j, _D_MULTIPLIER] = bounds[k, j, _TARGET] = 0.0
    roll(motion, step, delta)
    for i in range(len(rows)):
        lam = soft_multiplier(_along(i, stage, normal, before, delta) - lack[i], rho, mu)
        rows[i, _MULTIPLIER], rows[i, _SLACK], rows[i, _VIOLATION] = lam, mu / lam, mu / (rho - lam)
        rows[i, _TARGET] = rows[i, _TARGET_VIOLATION] = 0.0
    return pairs


@kernel
def _norm_hessian(
    error: FloatArray, heading_weight: float, gamma: FloatArray, mu: float, delta: FloatArray, dual: FloatArray,
    unit: FloatArray, big: FloatArray,
) -> None:  # fmt: skip
    """Fill the norms' part of the poses' Hessian, `big`, and `unit` (N, 4): residuals over their length, and that."""
    for k in range(len(error)):
        r0, r1 = error[k, 0] + delta[k, 0], error[k, 1] + delta[k, 1]
        r2 = heading_weight * (error[k, 2] + delta[k, 2])
        d = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + mu * mu)
        r0, r1, r2 = r0 / d, r1 / d, r2 / d
        unit[k, 0], unit[k, 1], unit[k, 2], unit[k, 3] = r0, r1, r2, d
        y0, y1, y2, q = dual[k, 0], dual[k, 1], dual[k, 2], gamma[k] / d
        big[k, 0], big[k, 1], big[k, 2] = q * (1.0 - y0 * r0), -0.5 * q * (y0 * r1 + y1 * r0), q * (1.0 - y1 * r1)
        big[k, 3] = -0.5 * q * heading_weight * (y0 * r2 + y2 * r0)
        big[k, 4] = -0.5 * q * heading_weight * (y1 * r2 + y2 * r1)
        big[k, 5] = q * heading_weight * heading_weight * (1.0 - y2 * r2)


@kernel
def _along(i: int, stage: IntArray, normal: FloatArray, before: FloatArray, delta: FloatArray) -> float:
    """n . dr + m . dr' of soft row `i` at the poses' changes `delta` (N, 3)."""
    k = stage[i]
    along = normal[i, 0] * delta[k, 0] + normal[i, 1] * delta[k, 1]
    if len(before) > 0 and k > 0:
        along += before[i, 0] * delta[k - 1, 0] + before[i, 1] * delta[k - 1, 1]
    return float(along)


@kernel
def _row_hessian(
    stage: IntArray, normal: FloatArray, before: FloatArray, rho: float, rows: FloatArray, big: FloatArray,
    cross: FloatArray,
) -> None:  # fmt: skip
    """Add the soft rows' part to the poses' Hessian, fill that between successive positions, and their weight in it."""
    for k in range(len(cross)):
        for j in range(4):
            cross[k, j] = 0.0
    for i in range(len(rows)):
        k, n0, n1, lam = stage[i], normal[i, 0], normal[i, 1], rows[i, _MULTIPLIER]
        w = 1.0 / (rows[i, _SLACK] / lam + rows[i, _VIOLATION] / (rho - lam))
        rows[i, _WEIGHT] = w
        big[k, 0] += w * n0 * n0
        big[k, 1] += w * n0 * n1
        big[k, 2] += w * n1 * n1
        if len(before) > 0 and k > 0:
            m0, m1 = before[i, 0], before[i, 1]
            big[k - 1, 0] += w * m0 * m0
            big[k - 1, 1] += w * m0 * m1
            big[k - 1, 2] += w * m1 * m1
            cross[k, 0] += w * n0 * m0
            cross[k, 1] += w * n0 * m1
            cross[k, 2] += w * n1 * m0
            cross[k, 3] += w * n1 * m1


@kernel
def _input_hessian(effort: float, change: FloatArray, bounds: FloatArray, weight: FloatArray) -> None:
    """Fill the Hessian by the inputs: of v, of omega, and of their change (vv, vw, ww)."""
    free = len(change)
    for k in range(len(weight)):
        for j in range(5):
            weight[k, j] = 2.0 * effort + 1e-9 if j < 2 else 0.0
        if k < free:
            for j in range(4):
                weight[k, j % 2] += bounds[k, j, _MULTIPLIER] / bounds[k, j, _SLACK]
            slack, lam = bounds[k, 4, _SLACK], bounds[k, 4, _MULTIPLIER]
            if slack > 0.0:
                ratio = 4.0 * lam / slack
                weight[k, 2] = 2.0 * lam + ratio * change[k, 0] * change[k, 0]
                weight[k, 3] = ratio * change[k, 0] * change[k, 1]
                weight[k, 4] = 2.0 * lam + ratio * change[k, 1] * change[k, 1]


@kernel
def _row_gradient(
    stage: IntArray, normal: FloatArray, before: FloatArray, lack: FloatArray, rho: float, delta: FloatArray,
    rows: FloatArray, slope: FloatArray,
) -> None:  # fmt: skip
    """Add the soft rows' part to the poses' gradient, and fill what their multipliers' steps are without the poses'."""
    for i in range(len(rows)):
        k, n0, n1 = stage[i], normal[i, 0], normal[i, 1]
        s, t, lam = rows[i, _SLACK], rows[i, _VIOLATION], rows[i, _MULTIPLIER]
        off = _along(i, stage, normal, before, delta) - lack[i] + t - s
        d_lam = -rows[i, _WEIGHT] * (
            off - (rows[i, _TARGET] / lam - s) + (rows[i, _TARGET_VIOLATION] / (rho - lam) - t)
        )
        rows[i, _D_MULTIPLIER] = d_lam
        slope[k, 0] -= (lam + d_lam) * n0
        slope[k, 1] -= (lam + d_lam) * n1
        if len(before) > 0 and k > 0:
            slope[k - 1, 0] -= (lam + d_lam) * before[i, 0]
            slope[k - 1, 1] -= (lam + d_lam) * before[i, 1]


@kernel
def _input_gradient(
    effort: float, u: FloatArray, change: FloatArray, smooth: FloatArray, bounds: FloatArray, pull: FloatArray
) -> None:
    """Fill the gradient by the inputs and by their changes."""
    for k in range(len(u)):
        for j in range(2):
            pull[k, j] = 2.0 * effort * u[k, j]
            pull[k, j] += (
                bounds[k, j + 2, _TARGET] / bounds[k, j + 2, _SLACK] - bounds[k, j, _TARGET] / bounds[k, j, _SLACK]
            )
        pull[k, 2] = pull[k, 3] = 0.0
        slack = bounds[k, 4, _SLACK]
        if slack > 0.0:
            off = change[k, 0] ** 2 + change[k, 1] ** 2 - smooth[k] ** 2 + slack
            force = 2.0 * (bounds[k, 4, _TARGET] + bounds[k, 4, _MULTIPLIER] * off) / slack
            pull[k, 2], pull[k, 3] = force * change[k, 0], force * change[k, 1]


@kernel
def _input_steps(step: FloatArray, change: FloatArray, smooth: FloatArray, bounds: FloatArray) -> None:
    """Fill the steps of the inputs' bounds for the inputs' `step` (N^c, 2)."""
    for k in range(len(step)):
        for j in range(4):
            bounds[k, j, _D_SLACK] = step[k, j % 2] if j < 2 else -step[k, j % 2]
        if bounds[k, 4, _SLACK] > 0.0:
            d0, d1 = step[k, 0], step[k, 1]
            if k > 0:
                d0, d1 = d0 - step[k - 1, 0], d1 - step[k - 1, 1]
            off = change[k, 0] ** 2 + change[k, 1] ** 2 - smooth[k] ** 2 + bounds[k, 4, _SLACK]
            bounds[k, 4, _D_SLACK] = -off - 2.0 * (change[k, 0] * d0 + change[k, 1] * d1)
        for j in range(5):
            s, lam = bounds[k, j, _SLACK], bounds[k, j, _MULTIPLIER]
            if s > 0.0:
                bounds[k, j, _D_MULTIPLIER] = (bounds[k, j, _TARGET] - lam * bounds[k, j, _D_SLACK]) / s - lam


@kernel
def _row_steps(
    stage: IntArray, normal: FloatArray, before: FloatArray, rho: float, d_delta: FloatArray, rows: FloatArray
) -> None:
    """Fill the steps of the soft rows for the poses' `d_delta` (N, 3)."""
    for i in range(len(rows)):
        s, t, lam = rows[i, _SLACK], rows[i, _VIOLATION], rows[i, _MULTIPLIER]
        d = rows[i, _D_MULTIPLIER] - rows[i, _WEIGHT] * _along(i, stage, normal, before, d_delta)
        rows[i, _D_MULTIPLIER] = d
        rows[i, _D_SLACK] = (rows[i, _TARGET] - s * d) / lam - s
        rows[i, _D_VIOLATION] = (rows[i, _TARGET_VIOLATION] + t * d) / (rho - lam) - t


@kernel
def _lengths(bounds: FloatArray, rows: FloatArray, rho: float) -> tuple[float, float]:
    """Which share of their steps slacks and multipliers may go before one of them is all but 0; at most 1."""
    primal, other = 1.0, 1.0
    for k in range(len(bounds)):
        for j in range(5):
            s, lam = bounds[k, j, _SLACK], bounds[k, j, _MULTIPLIER]
            if bounds[k, j, _D_SLACK] < -_SHORT * s:
                primal = min(primal, -_SHORT * s / bounds[k, j, _D_SLACK])
            if bounds[k, j, _D_MULTIPLIER] < -_SHORT * lam:
                other = min(other, -_SHORT * lam / bounds[k, j, _D_MULTIPLIER])
    for i in range(len(rows)):
        s, t, lam, d = rows[i, _SLACK], rows[i, _VIOLATION], rows[i, _MULTIPLIER], rows[i, _D_MULTIPLIER]
        if rows[i, _D_SLACK] < -_SHORT * s:
            primal = min(primal, -_SHORT * s / rows[i, _D_SLACK])
        if rows[i, _D_VIOLATION] < -_SHORT * t:
            primal = min(primal, -_SHORT * t / rows[i, _D_VIOLATION])
        if d < -_SHORT * lam:
            other = min(other, -_SHORT * lam / d)
        elif d > _SHORT * (rho - lam):
            other = min(other, _SHORT * (rho - lam) / d)
    return primal, other


@kernel
def _aim(
    bounds: FloatArray, rows: FloatArray, rho: float, primal: float, other: float, pairs: float, least: float
) -> None:
    """Aim at sigma mu, less the product of the steps: sigma falls with how much going their whole way would gain."""
    now, then = 0.0, 0.0
    for k in range(len(bounds)):
        for j in range(5):
            s, lam = bounds[k, j, _SLACK], bounds[k, j, _MULTIPLIER]
            now += s * lam
            then += (s + primal * bounds[k, j, _D_SLACK]) * (lam + other * bounds[k, j, _D_MULTIPLIER])
    for i in range(len(rows)):
        s, t, lam, d = rows[i, _SLACK], rows[i, _VIOLATION], rows[i, _MULTIPLIER], rows[i, _D_MULTIPLIER]
        nu = rho - lam
        now += s * lam + t * nu
        then += (s + primal * rows[i, _D_SLACK]) * (lam + other * d)
        then += (t + primal * rows[i, _D_VIOLATION]) * (nu - other * d)
    aim = max(now / pairs * min(1.0, max(then / now, 0.0)) ** 3, least)
    for k in range(len(bounds)):
        for j in range(5):
            bounds[k, j, _TARGET] = aim - bounds[k, j, _D_SLACK] * bounds[k, j, _D_MULTIPLIER]
    for i in range(len(rows)):
        rows[i, _TARGET] = aim - rows[i, _D_SLACK] * rows[i, _D_MULTIPLIER]
        rows[i, _TARGET_VIOLATION] = aim + rows[i, _D_VIOLATION] * rows[i, _D_MULTIPLIER]


@kernel
def _turn_duals(heading_weight: float, unit: FloatArray, d_delta: FloatArray, other: float, dual: FloatArray) -> None:
    """Move the norms' dual vectors by the share `other` of their steps, and back into the unit ball."""
    for k in range(len(dual)):
        e0, e1, e2 = d_delta[k, 0], d_delta[k, 1], heading_weight * d_delta[k, 2]
        r0, r1, r2, d = unit[k, 0], unit[k, 1], unit[k, 2], unit[k, 3]
        along = (r0 * e0 + r1 * e1 + r2 * e2) / d
        y0 = dual[k, 0] + other * (r0 + e0 / d - dual[k, 0] * along - dual[k, 0])
        y1 = dual[k, 1] + other * (r1 + e1 / d - dual[k, 1] * along - dual[k, 1])
        y2 = dual[k, 2] + other * (r2 + e2 / d - dual[k, 2] * along - dual[k, 2])
        shrink = 1.0 / max(1.0, math.sqrt(y0 * y0 + y1 * y1 + y2 * y2))
        dual[k, 0], dual[k, 1], dual[k, 2] = y0 * shrink, y1 * shrink, y2 * shrink


@kernel
def _go(bounds: FloatArray, rows: FloatArray, rho: float, primal: float, other: float) -> float:
    """Move slacks and multipliers by these shares of their steps, aim at 0 again; the sum of their products there."""
    total = 0.0
    for k in range(len(bounds)):
        for j in range(5):
            bounds[k, j, _SLACK] += primal * bounds[k, j, _D_SLACK]
            bounds[k, j, _MULTIPLIER] += other * bounds[k, j, _D_MULTIPLIER]
            total += bounds[k, j, _SLACK] * bounds[k, j, _MULTIPLIER]
            bounds[k, j, _TARGET] = 0.0
    for i in range(len(rows)):
        rows[i, _SLACK] += primal * rows[i, _D_SLACK]
        rows[i, _VIOLATION] += primal * rows[i, _D_VIOLATION]
        rows[i, _MULTIPLIER] += other * rows[i, _D_MULTIPLIER]
        lam = rows[i, _MULTIPLIER]
        total += rows[i, _SLACK] * lam + rows[i, _VIOLATION] * (rho - lam)
        rows[i, _TARGET] = rows[i, _TARGET_VIOLATION] = 0.0
    return total
