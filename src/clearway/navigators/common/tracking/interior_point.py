"""A small primal-dual interior point for the convex programs that the tracking problem linearises to.

    min  sum_k gamma_k |S (e_k + dx_k)| + w_2 sum_k |u_k|^2 + rho sum_i t_i
    s.t. dx_k = A_k dx_{k-1} + B_k (u_k - u0_k)               (the inputs are the only unknowns)
         low <= u <= high,  |u_k - u_{k-1}| <= smooth_k,  n_i . dr_i + t_i >= b_i,  t_i >= 0

Norms are not squared: each is smoothed by the barrier parameter and has a dual vector y, |y| <= 1, of its own, as in
Andersen, Christiansen, Conn, Overton (SIAM J. Sci. Comput. 22, 2000), so that residuals of exactly zero, which such
costs favour, converge like any other. The slack t of a soft row is eliminated: its multiplier stays within (0, rho).
Steps follow Mehrotra's predictor and corrector (SIAM J. Optim. 2, 1992). The Newton system has the structure of a
linear-quadratic regulator over the pose and the input before, so a Riccati recursion solves it in O(N).
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.tracking.problem import IntArray

FAR = 1e4
"""What an infinite bound on an input counts as [m/s, rad/s]."""

_SHORT = 0.995  # share of the way to the boundary that a step may go


@kernel
def soft_multiplier(gap: float, rho: float, mu: float) -> float:
    """The multiplier in (0, rho) of a soft row with n . dr - b = `gap` on the central path: mu/l - mu/(rho - l) = gap."""
    root = math.sqrt(gap * gap * rho * rho + 4.0 * mu * mu)
    if gap >= 0.0:
        return 2.0 * mu * rho / (gap * rho + 2.0 * mu + root)
    return rho - 2.0 * mu * rho / (2.0 * mu - gap * rho + root)


@kernel
def minimise(
    turn: FloatArray,
    push: FloatArray,
    period: float,
    error: FloatArray,
    heading_weight: float,
    gamma: FloatArray,
    effort: float,
    base: FloatArray,
    low: FloatArray,
    high: FloatArray,
    smooth: FloatArray,
    previous: FloatArray,
    stage: IntArray,
    normal: FloatArray,
    lack: FloatArray,
    count: int,
    rho: float,
    mu: float,
    mu_end: float,
    limit: int,
    out: FloatArray,
) -> int:
    """The minimiser, written into `out` (N^c, 2).

    Args:
        turn: (N, 2) d(x, y)_k / d theta_{k-1}. push: (N, 2, 2) d(x, y)_k / d(v, omega)_k. period: d theta / d omega.
        error: (N, 3) e_k. heading_weight: S = diag(1, 1, heading_weight). gamma: (N,). effort: w_2.
        base: (N^c, 2) u0; the last one serves the stages from N^c on, too. low, high: (N^c, 2).
        smooth: (>= N^c,), inf: none. previous: (2,) the input before.
        stage, normal, lack: (R,), (R, 2), (R,) the soft rows, of which the first `count` count; in any order.
        rho: their penalty. mu, mu_end: barrier parameter at the start and at the end. limit: most iterations.

    Returns:
        Iterations spent. The answer lies strictly within the box and is as good as mu_end makes it; the rate limits
        may be off by rounding of the same order.
    """
    n, free = len(turn), len(base)
    u, s_box, l_box = np.empty((free, 2)), np.empty((free, 4)), np.empty((free, 4))  # v >, omega >, v <, omega <
    for k in range(free):
        for j in range(2):
            a, b = max(low[k, j], -FAR), min(high[k, j], FAR)
            if b - a < 2e-6:  # a box without inside: the caller projects
                a, b = 0.5 * (a + b) - 1e-6, 0.5 * (a + b) + 1e-6
            inside = min(0.25 * (b - a), 10.0 * mu)
            u[k, j] = min(max(base[k, j], a + inside), b - inside)
            s_box[k, j], s_box[k, j + 2] = u[k, j] - a, b - u[k, j]
            l_box[k, j], l_box[k, j + 2] = mu / s_box[k, j], mu / s_box[k, j + 2]
    pairs = 4.0 * free + 2.0 * count
    rate = np.zeros((free, 4))  # change of v, of omega, slack, multiplier; slack 0: no limit
    for k in range(free):
        for j in range(2):
            rate[k, j] = u[k, j] - (previous[j] if k == 0 else u[k - 1, j])
        if smooth[k] < math.inf:
            pairs += 1.0
            room = smooth[k] ** 2 - rate[k, 0] ** 2 - rate[k, 1] ** 2
            rate[k, 2] = max(room, min(10.0 * mu, 0.25 * smooth[k] ** 2 + 1e-9))
            rate[k, 3] = mu / rate[k, 2]
    delta, step, d_delta = np.zeros((n, 3)), np.zeros((free, 2)), np.empty((n, 3))
    for k in range(free):
        for j in range(2):
            step[k, j] = u[k, j] - base[k, j]
    _roll(turn, push, period, step, delta)
    rows = np.empty((count, 3))  # slack, violation, multiplier
    for i in range(count):
        k = stage[i]
        gap = normal[i, 0] * delta[k, 0] + normal[i, 1] * delta[k, 1] - lack[i]
        rows[i, 2] = soft_multiplier(gap, rho, mu)
        rows[i, 0], rows[i, 1] = mu / rows[i, 2], mu / (rho - rows[i, 2])

    dual, unit = np.zeros((n, 3)), np.empty((n, 4))
    big, slope = np.empty((n, 6)), np.empty((n, 3))
    weight, pull = np.empty((n, 5)), np.empty((free, 4))
    gains = np.empty((free, 13))
    t_box, t_rate, t_rows = np.zeros((free, 4)), np.zeros(free), np.zeros((count, 2))
    d_lbox, d_rate, d_rows = np.empty((free, 4)), np.empty((free, 2)), np.empty((count, 3))
    row_weight = np.empty(count)

    spent = 0
    while spent < limit:
        spent += 1
        # Hessian. Stage by stage the norm's (big: xx, xy, yy, xt, yt, tt), then the soft rows'.
        for k in range(n):
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
        for i in range(count):
            k, n0, n1 = stage[i], normal[i, 0], normal[i, 1]
            w = 1.0 / (rows[i, 0] / rows[i, 2] + rows[i, 1] / (rho - rows[i, 2]))
            row_weight[i] = w
            big[k, 0] += w * n0 * n0
            big[k, 1] += w * n0 * n1
            big[k, 2] += w * n1 * n1
        for k in range(n):  # weight: of v, of omega, of their change (vv, vw, ww)
            for j in range(5):
                weight[k, j] = 2.0 * effort + 1e-9 if j < 2 else 0.0
            if k < free:
                for j in range(4):
                    weight[k, j % 2] += l_box[k, j] / s_box[k, j]
                if rate[k, 2] > 0.0:
                    ratio = 4.0 * rate[k, 3] / rate[k, 2]
                    weight[k, 2] = 2.0 * rate[k, 3] + ratio * rate[k, 0] * rate[k, 0]
                    weight[k, 3] = ratio * rate[k, 0] * rate[k, 1]
                    weight[k, 4] = 2.0 * rate[k, 3] + ratio * rate[k, 1] * rate[k, 1]
        if not _factorise(turn, push, period, big, weight, gains):
            break

        # Predictor: complementarity 0. Corrector: sigma mu, less the product of the predictor's steps.
        primal, other, target = 1.0, 1.0, 0.0
        for corrector in range(2):
            for k in range(n):
                slope[k, 0], slope[k, 1] = gamma[k] * unit[k, 0], gamma[k] * unit[k, 1]
                slope[k, 2] = gamma[k] * heading_weight * unit[k, 2]
            for i in range(count):
                k, n0, n1 = stage[i], normal[i, 0], normal[i, 1]
                s, t, lam = rows[i, 0], rows[i, 1], rows[i, 2]
                off = n0 * delta[k, 0] + n1 * delta[k, 1] - lack[i] + t - s
                change = -row_weight[i] * (off - (t_rows[i, 0] / lam - s) + (t_rows[i, 1] / (rho - lam) - t))
                d_rows[i, 2] = change
                slope[k, 0] -= (lam + change) * n0
                slope[k, 1] -= (lam + change) * n1
            for k in range(free):
                for j in range(2):
                    pull[k, j] = 2.0 * effort * u[k, j]
                    pull[k, j] += t_box[k, j + 2] / s_box[k, j + 2] - t_box[k, j] / s_box[k, j]
                pull[k, 2] = pull[k, 3] = 0.0
                if rate[k, 2] > 0.0:
                    off = rate[k, 0] ** 2 + rate[k, 1] ** 2 - smooth[k] ** 2 + rate[k, 2]
                    force = 2.0 * (t_rate[k] + rate[k, 3] * off) / rate[k, 2]
                    pull[k, 2], pull[k, 3] = force * rate[k, 0], force * rate[k, 1]
            _solve(turn, push, period, slope, pull, gains, effort, u, step)
            _roll(turn, push, period, step, d_delta)

            primal, other = 1.0, 1.0
            for k in range(free):
                for j in range(4):
                    s, lam = s_box[k, j], l_box[k, j]
                    d = step[k, j % 2] if j < 2 else -step[k, j % 2]
                    d_lbox[k, j] = (t_box[k, j] - lam * d) / s - lam
                    if d < -_SHORT * s:
                        primal = min(primal, -_SHORT * s / d)
                    if d_lbox[k, j] < -_SHORT * lam:
                        other = min(other, -_SHORT * lam / d_lbox[k, j])
                if rate[k, 2] > 0.0:
                    d0, d1 = step[k, 0], step[k, 1]
                    if k > 0:
                        d0, d1 = d0 - step[k - 1, 0], d1 - step[k - 1, 1]
                    off = rate[k, 0] ** 2 + rate[k, 1] ** 2 - smooth[k] ** 2 + rate[k, 2]
                    d = -off - 2.0 * (rate[k, 0] * d0 + rate[k, 1] * d1)
                    d_rate[k, 0], d_rate[k, 1] = d, (t_rate[k] - rate[k, 3] * d) / rate[k, 2] - rate[k, 3]
                    if d < -_SHORT * rate[k, 2]:
                        primal = min(primal, -_SHORT * rate[k, 2] / d)
                    if d_rate[k, 1] < -_SHORT * rate[k, 3]:
                        other = min(other, -_SHORT * rate[k, 3] / d_rate[k, 1])
            for i in range(count):
                k, s, t, lam = stage[i], rows[i, 0], rows[i, 1], rows[i, 2]
                d = d_rows[i, 2] - row_weight[i] * (normal[i, 0] * d_delta[k, 0] + normal[i, 1] * d_delta[k, 1])
                d_rows[i, 2] = d
                d_rows[i, 0] = (t_rows[i, 0] - s * d) / lam - s
                d_rows[i, 1] = (t_rows[i, 1] + t * d) / (rho - lam) - t
                if d_rows[i, 0] < -_SHORT * s:
                    primal = min(primal, -_SHORT * s / d_rows[i, 0])
                if d_rows[i, 1] < -_SHORT * t:
                    primal = min(primal, -_SHORT * t / d_rows[i, 1])
                if d < -_SHORT * lam:
                    other = min(other, -_SHORT * lam / d)
                elif d > _SHORT * (rho - lam):
                    other = min(other, _SHORT * (rho - lam) / d)
            if not (primal > 0.0 and other > 0.0):  # not a number
                return spent
            if corrector == 1:
                break
            now, then = 0.0, 0.0
            for k in range(free):
                for j in range(4):
                    d = step[k, j % 2] if j < 2 else -step[k, j % 2]
                    now += s_box[k, j] * l_box[k, j]
                    then += (s_box[k, j] + primal * d) * (l_box[k, j] + other * d_lbox[k, j])
                if rate[k, 2] > 0.0:
                    now += rate[k, 2] * rate[k, 3]
                    then += (rate[k, 2] + primal * d_rate[k, 0]) * (rate[k, 3] + other * d_rate[k, 1])
            for i in range(count):
                s, t, lam, nu = rows[i, 0], rows[i, 1], rows[i, 2], rho - rows[i, 2]
                now += s * lam + t * nu
                then += (s + primal * d_rows[i, 0]) * (lam + other * d_rows[i, 2])
                then += (t + primal * d_rows[i, 1]) * (nu - other * d_rows[i, 2])
            target = max(now / pairs * min(1.0, max(then / now, 0.0)) ** 3, 0.1 * mu_end)
            for k in range(free):
                for j in range(4):
                    d = step[k, j % 2] if j < 2 else -step[k, j % 2]
                    t_box[k, j] = target - d * d_lbox[k, j]
                if rate[k, 2] > 0.0:
                    t_rate[k] = target - d_rate[k, 0] * d_rate[k, 1]
            for i in range(count):
                t_rows[i, 0] = target - d_rows[i, 0] * d_rows[i, 2]
                t_rows[i, 1] = target + d_rows[i, 1] * d_rows[i, 2]

        total = 0.0
        for k in range(n):
            e0, e1, e2 = d_delta[k, 0], d_delta[k, 1], heading_weight * d_delta[k, 2]
            r0, r1, r2, d = unit[k, 0], unit[k, 1], unit[k, 2], unit[k, 3]
            along = (r0 * e0 + r1 * e1 + r2 * e2) / d
            y0 = dual[k, 0] + other * (r0 + e0 / d - dual[k, 0] * along - dual[k, 0])
            y1 = dual[k, 1] + other * (r1 + e1 / d - dual[k, 1] * along - dual[k, 1])
            y2 = dual[k, 2] + other * (r2 + e2 / d - dual[k, 2] * along - dual[k, 2])
            shrink = 1.0 / max(1.0, math.sqrt(y0 * y0 + y1 * y1 + y2 * y2))
            dual[k, 0], dual[k, 1], dual[k, 2] = y0 * shrink, y1 * shrink, y2 * shrink
            for j in range(3):
                delta[k, j] += primal * d_delta[k, j]
        for k in range(free):
            for j in range(4):
                s_box[k, j] += primal * (step[k, j % 2] if j < 2 else -step[k, j % 2])
                l_box[k, j] += other * d_lbox[k, j]
                total += s_box[k, j] * l_box[k, j]
                t_box[k, j] = 0.0
            for j in range(2):
                u[k, j] += primal * step[k, j]
                rate[k, j] = u[k, j] - (previous[j] if k == 0 else u[k - 1, j])
            if rate[k, 2] > 0.0:
                rate[k, 2] += primal * d_rate[k, 0]
                rate[k, 3] += other * d_rate[k, 1]
                total += rate[k, 2] * rate[k, 3]
                t_rate[k] = 0.0
        for i in range(count):
            rows[i, 0] += primal * d_rows[i, 0]
            rows[i, 1] += primal * d_rows[i, 1]
            rows[i, 2] += other * d_rows[i, 2]
            total += rows[i, 0] * rows[i, 2] + rows[i, 1] * (rho - rows[i, 2])
            t_rows[i, 0] = t_rows[i, 1] = 0.0
        done = min(primal, other) > 0.9 and max(total / pairs, mu) <= 2.0 * mu_end
        mu = max(mu_end, min(mu, total / pairs))
        if done:
            break
    for k in range(free):
        out[k, 0], out[k, 1] = u[k, 0], u[k, 1]
    return spent


@kernel
def _roll(turn: FloatArray, push: FloatArray, period: float, step: FloatArray, delta: FloatArray) -> None:
    """dx_k of the linearised motion for changes `step` (N^c, 2) of the inputs, into `delta` (N, 3)."""
    x, y, theta = 0.0, 0.0, 0.0
    last = len(step) - 1
    for k in range(len(turn)):
        j = min(k, last)
        v, w = step[j, 0], step[j, 1]
        x += turn[k, 0] * theta + push[k, 0, 0] * v + push[k, 0, 1] * w
        y += turn[k, 1] * theta + push[k, 1, 0] * v + push[k, 1, 1] * w
        theta += period * w
        delta[k, 0], delta[k, 1], delta[k, 2] = x, y, theta


@kernel
def _factorise(
    turn: FloatArray, push: FloatArray, period: float, big: FloatArray, weight: FloatArray, gains: FloatArray
) -> bool:
    """The matrices of the Riccati recursion over (pose, input before), backwards. False: not positive definite.

    Args:
        big: (N, 6) Hessian of stage k's pose: xx, xy, yy, xt, yt, tt. weight: (N, 5) of its inputs v, omega and of
        their change vv, vw, ww. gains: (N^c, 13), written: H^-1 (00, 01, 11), F = H^-1 H_up (2 x 3), E = H^-1 T (2 x 2).
    """
    free = len(gains)
    xx, xy, yy, xt, yt, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    vx, vy, vt, wx, wy, wt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # between the inputs and the pose
    vv, vw, ww = 0.0, 0.0, 0.0
    for k in range(len(turn) - 1, -1, -1):
        xx, xy, yy = xx + big[k, 0], xy + big[k, 1], yy + big[k, 2]
        xt, yt, tt = xt + big[k, 3], yt + big[k, 4], tt + big[k, 5]
        a, b, c = turn[k, 0], turn[k, 1], period
        p, q, r, s = push[k, 0, 0], push[k, 1, 0], push[k, 0, 1], push[k, 1, 1]
        # G = B^T W_pp + W_up, its rows for v and omega; then H_uu = G B + B^T W_pu + W_uu + R + T.
        gv0, gv1, gv2 = p * xx + q * xy, p * xy + q * yy, p * xt + q * yt
        gw0, gw1, gw2 = r * xx + s * xy + c * xt, r * xy + s * yy + c * yt, r * xt + s * yt + c * tt
        hvv = vv + weight[k, 0] + p * (gv0 + 2.0 * vx) + q * (gv1 + 2.0 * vy)
        hvw = vw + r * (gv0 + vx) + s * (gv1 + vy) + c * (gv2 + vt) + p * wx + q * wy
        hww = ww + weight[k, 1] + r * (gw0 + 2.0 * wx) + s * (gw1 + 2.0 * wy) + c * (gw2 + 2.0 * wt)
        gv0, gv1, gv2, gw0, gw1, gw2 = gv0 + vx, gv1 + vy, gv2 + vt, gw0 + wx, gw1 + wy, gw2 + wt
        gv2, gw2 = gv2 + a * gv0 + b * gv1, gw2 + a * gw0 + b * gw1  # H_up = G A
        tt += a * (a * xx + 2.0 * xt) + b * (b * yy + 2.0 * yt) + 2.0 * a * b * xy  # A^T W_pp A
        xt, yt = xt + a * xx + b * xy, yt + a * xy + b * yy
        if k >= free:  # held: the input is the one before
            vx, vy, vt, wx, wy, wt, vv, vw, ww = gv0, gv1, gv2, gw0, gw1, gw2, hvv, hvw, hww
            continue
        t0, t1, t2 = weight[k, 2], weight[k, 3], weight[k, 4]
        f0, f1, f2 = hvv + t0, hvw + t1, hww + t2
        det = f0 * f2 - f1 * f1
        if not (det > 0.0 and f0 > 0.0):
            return False
        i0, i1, i2 = f2 / det, -f1 / det, f0 / det
        fv0, fv1, fv2 = i0 * gv0 + i1 * gw0, i0 * gv1 + i1 * gw1, i0 * gv2 + i1 * gw2
        fw0, fw1, fw2 = i1 * gv0 + i2 * gw0, i1 * gv1 + i2 * gw1, i1 * gv2 + i2 * gw2
        e00, e01, e10, e11 = i0 * t0 + i1 * t1, i0 * t1 + i1 * t2, i1 * t0 + i2 * t1, i1 * t1 + i2 * t2
        gains[k, 0], gains[k, 1], gains[k, 2] = i0, i1, i2
        gains[k, 3], gains[k, 4], gains[k, 5] = fv0, fv1, fv2
        gains[k, 6], gains[k, 7], gains[k, 8] = fw0, fw1, fw2
        gains[k, 9], gains[k, 10], gains[k, 11], gains[k, 12] = e00, e01, e10, e11
        xx, xy, yy = xx - gv0 * fv0 - gw0 * fw0, xy - gv0 * fv1 - gw0 * fw1, yy - gv1 * fv1 - gw1 * fw1
        xt, yt, tt = xt - gv0 * fv2 - gw0 * fw2, yt - gv1 * fv2 - gw1 * fw2, tt - gv2 * fv2 - gw2 * fw2
        vx, vy, vt = t0 * fv0 + t1 * fw0, t0 * fv1 + t1 * fw1, t0 * fv2 + t1 * fw2
        wx, wy, wt = t1 * fv0 + t2 * fw0, t1 * fv1 + t2 * fw1, t1 * fv2 + t2 * fw2
        vv = e00 * hvv + e10 * hvw  # T - T H^-1 T = E^T (H - T): no cancellation where T is large
        vw = 0.5 * (e00 * hvw + e10 * hww + e01 * hvv + e11 * hvw)
        ww = e01 * hvw + e11 * hww
    return True


@kernel
def _solve(
    turn: FloatArray,
    push: FloatArray,
    period: float,
    slope: FloatArray,
    pull: FloatArray,
    gains: FloatArray,
    effort: float,
    u: FloatArray,
    step: FloatArray,
) -> None:
    """The Newton step (N^c, 2), into `step`, by what `_factorise` left.

    Args:
        slope: (N, 3) gradient for stage k's pose. pull: (N^c, 4) for its inputs and for their change; what the effort
        of held inputs adds comes from `effort` and `u`.
    """
    n, free = len(turn), len(gains)
    x, y, theta, v, w = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n - 1, -1, -1):
        x, y, theta = x + slope[k, 0], y + slope[k, 1], theta + slope[k, 2]
        h0 = v + push[k, 0, 0] * x + push[k, 1, 0] * y
        h1 = w + push[k, 0, 1] * x + push[k, 1, 1] * y + period * theta
        theta += turn[k, 0] * x + turn[k, 1] * y
        if k >= free:
            v, w = h0 + 2.0 * effort * u[free - 1, 0], h1 + 2.0 * effort * u[free - 1, 1]
            continue
        h0, h1 = h0 + pull[k, 0] + pull[k, 2], h1 + pull[k, 1] + pull[k, 3]
        x -= gains[k, 3] * h0 + gains[k, 6] * h1
        y -= gains[k, 4] * h0 + gains[k, 7] * h1
        theta -= gains[k, 5] * h0 + gains[k, 8] * h1
        v = gains[k, 9] * h0 + gains[k, 11] * h1 - pull[k, 2]
        w = gains[k, 10] * h0 + gains[k, 12] * h1 - pull[k, 3]
        step[k, 0], step[k, 1] = -gains[k, 0] * h0 - gains[k, 1] * h1, -gains[k, 1] * h0 - gains[k, 2] * h1
    x, y, theta, v, w = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(free):
        h0 = step[k, 0] - gains[k, 3] * x - gains[k, 4] * y - gains[k, 5] * theta + gains[k, 9] * v + gains[k, 10] * w
        h1 = step[k, 1] - gains[k, 6] * x - gains[k, 7] * y - gains[k, 8] * theta + gains[k, 11] * v + gains[k, 12] * w
        v, w = h0, h1
        step[k, 0], step[k, 1] = v, w
        x += turn[k, 0] * theta + push[k, 0, 0] * v + push[k, 0, 1] * w
        y += turn[k, 1] * theta + push[k, 1, 0] * v + push[k, 1, 1] * w
        theta += period * w
