"""A small primal-dual interior point for the convex programs that the tracking problem linearises to.

    min  sum_k gamma_k |S (e_k + dx_k)| + w_2 sum_k m_k |u_k|^2 + rho sum_i t_i
    s.t. dx_k = A_k dx_{k-1} + B_k (u_k - u0_k)               (condensed: the inputs are the only unknowns)
         low <= u <= high,  |u_k - u_{k-1}| <= smooth_k,  n_i . dr_i + t_i >= b_i,  t_i >= 0

Norms are not squared: each is smoothed by the barrier parameter and has a dual vector y, |y| <= 1, of its own, as in
Andersen, Christiansen, Conn, Overton (SIAM J. Sci. Comput. 22, 2000), so that residuals of exactly zero, which such
costs favour, converge like any other. The slack t of a soft row is eliminated: its multiplier stays within (0, rho).
The condensed Hessian is built by a backward recursion, O(N^2), and factorised by Cholesky.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.tracking import IntArray

FAR = 1e4
"""What an infinite bound on an input counts as [m/s, rad/s]."""


@kernel
def factorise(h: FloatArray) -> bool:
    """The upper triangle of a positive definite (n, n), in place, into U with U^T U = H. False: not positive definite."""
    n = len(h)
    for j in range(n):
        pivot = h[j, j]
        if not pivot > 0.0:
            return False
        scale = 1.0 / math.sqrt(pivot)
        for k in range(j, n):
            h[j, k] *= scale
        for i in range(j + 1, n):
            f = h[j, i]
            for k in range(i, n):
                h[i, k] -= f * h[j, k]
    return True


@kernel
def substitute(u: FloatArray, b: FloatArray) -> None:
    """Solve U^T U x = b in place, by the U of `factorise`."""
    n = len(b)
    for j in range(n):
        b[j] /= u[j, j]
        for k in range(j + 1, n):
            b[k] -= u[j, k] * b[j]
    for j in range(n - 1, -1, -1):
        total = b[j]
        for k in range(j + 1, n):
            total -= u[j, k] * b[k]
        b[j] = total / u[j, j]


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
        base: (N^c, 2) u0. low, high: (N^c, 2). smooth: (N^c,), inf: none. previous: (2,) the input before.
        stage, normal, lack: (R,), (R, 2), (R,) the soft rows, of which the first `count` count; ordered by stage or not.
        rho: their penalty. mu, mu_end: barrier parameter at the start and at the end. limit: most iterations.

    Returns:
        Iterations spent. The answer lies strictly within the box and is as good as mu_end makes it; the rate limits
        may be off by rounding of the same order.
    """
    n, free = len(turn), len(base)
    size = 2 * free
    u, step = np.empty((free, 2)), np.empty(size)
    s_low, s_high = np.empty((free, 2)), np.empty((free, 2))
    l_low, l_high = np.empty((free, 2)), np.empty((free, 2))
    for k in range(free):
        for j in range(2):
            a, b = max(low[k, j], -FAR), min(high[k, j], FAR)
            if b - a < 2e-6:  # a box without inside: the caller projects
                a, b = 0.5 * (a + b) - 1e-6, 0.5 * (a + b) + 1e-6
            inside = min(0.25 * (b - a), 10.0 * mu)
            u[k, j] = min(max(base[k, j], a + inside), b - inside)
            s_low[k, j], s_high[k, j] = u[k, j] - a, b - u[k, j]
            l_low[k, j], l_high[k, j] = mu / s_low[k, j], mu / s_high[k, j]
    sigma, eta, d_sigma = np.zeros(free), np.zeros(free), np.zeros(free)
    pairs = 4.0 * free + 2.0 * count
    for k in range(free):
        if smooth[k] < math.inf:
            pairs += 1.0
            v, w = (previous[0], previous[1]) if k == 0 else (u[k - 1, 0], u[k - 1, 1])
            room = smooth[k] ** 2 - (u[k, 0] - v) ** 2 - (u[k, 1] - w) ** 2
            sigma[k] = max(room, min(10.0 * mu, 0.25 * smooth[k] ** 2 + 1e-9))
            eta[k] = mu / sigma[k]

    delta, dual, big, slope = np.zeros((n, 3)), np.zeros((n, 3)), np.empty((n, 6)), np.empty((n, 3))
    bw, d_delta, residual = np.empty((n, 2, 3)), np.empty((n, 3)), np.empty((n, 4))
    h = np.empty((size, size))
    lam, s, t = np.empty(count), np.empty(count), np.empty(count)
    d_lam, d_s, d_t = np.empty(count), np.empty(count), np.empty(count)
    _roll(turn, push, period, base, u, delta)
    for i in range(count):
        k = stage[i]
        lam[i] = soft_multiplier(normal[i, 0] * delta[k, 0] + normal[i, 1] * delta[k, 1] - lack[i], rho, mu)
        s[i], t[i] = mu / lam[i], mu / (rho - lam[i])

    spent = 0
    while spent < limit:
        spent += 1
        # Stage by stage: the norm's gradient and Hessian (big: xx, xy, yy, xt, yt, tt), then the soft rows'.
        for k in range(n):
            r0, r1 = error[k, 0] + delta[k, 0], error[k, 1] + delta[k, 1]
            r2 = heading_weight * (error[k, 2] + delta[k, 2])
            d = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + mu * mu)
            residual[k, 0], residual[k, 1], residual[k, 2], residual[k, 3] = r0 / d, r1 / d, r2 / d, d
            r0, r1, r2 = r0 / d, r1 / d, r2 / d
            y0, y1, y2, q = dual[k, 0], dual[k, 1], dual[k, 2], gamma[k] / d
            big[k, 0], big[k, 1], big[k, 2] = q * (1.0 - y0 * r0), -0.5 * q * (y0 * r1 + y1 * r0), q * (1.0 - y1 * r1)
            big[k, 3] = -0.5 * q * heading_weight * (y0 * r2 + y2 * r0)
            big[k, 4] = -0.5 * q * heading_weight * (y1 * r2 + y2 * r1)
            big[k, 5] = q * heading_weight * heading_weight * (1.0 - y2 * r2)
            slope[k, 0], slope[k, 1] = gamma[k] * r0, gamma[k] * r1
            slope[k, 2] = gamma[k] * heading_weight * r2
        for i in range(count):
            k, n0, n1 = stage[i], normal[i, 0], normal[i, 1]
            nu = rho - lam[i]
            off = n0 * delta[k, 0] + n1 * delta[k, 1] - lack[i] + t[i] - s[i]
            weight = 1.0 / (s[i] / lam[i] + t[i] / nu)
            d_lam[i] = -weight * (off - (mu / lam[i] - s[i]) + (mu / nu - t[i]))
            d_s[i] = weight
            force = lam[i] + d_lam[i]
            big[k, 0] += weight * n0 * n0
            big[k, 1] += weight * n0 * n1
            big[k, 2] += weight * n1 * n1
            slope[k, 0] -= force * n0
            slope[k, 1] -= force * n1
        _condense(turn, push, period, big, slope, bw, h, step, free)
        # What concerns the inputs alone: effort, box, rate limits. step: minus the gradient.
        for k in range(free):
            share = effort * (n - free + 1.0 if k == free - 1 else 1.0)
            for j in range(2):
                i = 2 * k + j
                h[i, i] += 2.0 * share + l_low[k, j] / s_low[k, j] + l_high[k, j] / s_high[k, j] + 1e-9
                step[i] += -2.0 * share * u[k, j] + mu / s_low[k, j] - mu / s_high[k, j]
            if sigma[k] > 0.0:
                v, w = (previous[0], previous[1]) if k == 0 else (u[k - 1, 0], u[k - 1, 1])
                c0, c1 = u[k, 0] - v, u[k, 1] - w
                ratio = eta[k] / sigma[k]
                force = 2.0 * (mu / sigma[k] + ratio * (c0 * c0 + c1 * c1 - smooth[k] ** 2 + sigma[k]))
                h00, h01 = 2.0 * eta[k] + 4.0 * ratio * c0 * c0, 4.0 * ratio * c0 * c1
                h11 = 2.0 * eta[k] + 4.0 * ratio * c1 * c1
                i = 2 * k
                h[i, i] += h00
                h[i, i + 1] += h01
                h[i + 1, i + 1] += h11
                step[i] -= force * c0
                step[i + 1] -= force * c1
                if k > 0:
                    h[i - 2, i - 2] += h00
                    h[i - 2, i - 1] += h01
                    h[i - 1, i - 1] += h11
                    h[i - 2, i] -= h00
                    h[i - 2, i + 1] -= h01
                    h[i - 1, i] -= h01
                    h[i - 1, i + 1] -= h11
                    step[i - 2] += force * c0
                    step[i - 1] += force * c1
        if not factorise(h):
            break
        substitute(h, step)
        # Step lengths: everything that has to stay positive does.
        primal, other = 1.0, 1.0
        most = 0.995
        for k in range(free):
            for j in range(2):
                d = step[2 * k + j]
                d_low = mu / s_low[k, j] - l_low[k, j] / s_low[k, j] * d - l_low[k, j]
                d_high = mu / s_high[k, j] + l_high[k, j] / s_high[k, j] * d - l_high[k, j]
                if d < 0.0:
                    primal = min(primal, -most * s_low[k, j] / d)
                else:
                    primal = min(primal, most * s_high[k, j] / (d + 1e-300))
                if d_low < 0.0:
                    other = min(other, -most * l_low[k, j] / d_low)
                if d_high < 0.0:
                    other = min(other, -most * l_high[k, j] / d_high)
            if sigma[k] > 0.0:
                v, w = (previous[0], previous[1]) if k == 0 else (u[k - 1, 0], u[k - 1, 1])
                c0, c1 = u[k, 0] - v, u[k, 1] - w
                d0, d1 = step[2 * k], step[2 * k + 1]
                if k > 0:
                    d0, d1 = d0 - step[2 * k - 2], d1 - step[2 * k - 1]
                off = c0 * c0 + c1 * c1 - smooth[k] ** 2 + sigma[k]
                d_sigma[k] = -off - 2.0 * (c0 * d0 + c1 * d1)
                d_eta = mu / sigma[k] - eta[k] / sigma[k] * d_sigma[k] - eta[k]
                if d_sigma[k] < 0.0:
                    primal = min(primal, -most * sigma[k] / d_sigma[k])
                if d_eta < 0.0:
                    other = min(other, -most * eta[k] / d_eta)
        _roll_step(turn, push, period, step, d_delta, free)
        for i in range(count):
            k = stage[i]
            d_lam[i] -= d_s[i] * (normal[i, 0] * d_delta[k, 0] + normal[i, 1] * d_delta[k, 1])
            d_s[i] = (mu - s[i] * d_lam[i]) / lam[i] - s[i]
            d_t[i] = (mu + t[i] * d_lam[i]) / (rho - lam[i]) - t[i]
            if d_s[i] < 0.0:
                primal = min(primal, -most * s[i] / d_s[i])
            if d_t[i] < 0.0:
                primal = min(primal, -most * t[i] / d_t[i])
            if d_lam[i] < 0.0:
                other = min(other, -most * lam[i] / d_lam[i])
            elif d_lam[i] > 0.0:
                other = min(other, most * (rho - lam[i]) / d_lam[i])
        if not primal > 0.0:  # not a number
            break

        total = 0.0
        for k in range(n):
            e0, e1, e2 = d_delta[k, 0], d_delta[k, 1], heading_weight * d_delta[k, 2]
            r0, r1, r2, d = residual[k, 0], residual[k, 1], residual[k, 2], residual[k, 3]
            along = (r0 * e0 + r1 * e1 + r2 * e2) / d
            y0 = dual[k, 0] + other * (r0 + e0 / d - dual[k, 0] * along - dual[k, 0])
            y1 = dual[k, 1] + other * (r1 + e1 / d - dual[k, 1] * along - dual[k, 1])
            y2 = dual[k, 2] + other * (r2 + e2 / d - dual[k, 2] * along - dual[k, 2])
            long = math.sqrt(y0 * y0 + y1 * y1 + y2 * y2)
            shrink = 1.0 / long if long > 1.0 else 1.0
            dual[k, 0], dual[k, 1], dual[k, 2] = y0 * shrink, y1 * shrink, y2 * shrink
            for j in range(3):
                delta[k, j] += primal * d_delta[k, j]
        for k in range(free):
            if sigma[k] > 0.0:
                d_eta = mu / sigma[k] - eta[k] / sigma[k] * d_sigma[k] - eta[k]
                sigma[k] += primal * d_sigma[k]
                eta[k] += other * d_eta
                total += sigma[k] * eta[k]
            for j in range(2):
                d = step[2 * k + j]
                l_low[k, j] += other * (mu / s_low[k, j] - l_low[k, j] / s_low[k, j] * d - l_low[k, j])
                l_high[k, j] += other * (mu / s_high[k, j] + l_high[k, j] / s_high[k, j] * d - l_high[k, j])
                u[k, j] += primal * d
                s_low[k, j] += primal * d
                s_high[k, j] -= primal * d
                total += s_low[k, j] * l_low[k, j] + s_high[k, j] * l_high[k, j]
        for i in range(count):
            s[i] += primal * d_s[i]
            t[i] += primal * d_t[i]
            lam[i] += other * d_lam[i]
            total += s[i] * lam[i] + t[i] * (rho - lam[i])
        total /= pairs
        progress = min(primal, other)
        if progress > 0.9 and total <= 1.5 * mu_end:
            break
        mu = max(mu_end, min(mu, total) * (0.1 if progress > 0.9 else 0.3 if progress > 0.5 else 0.8))
    for k in range(free):
        out[k, 0], out[k, 1] = u[k, 0], u[k, 1]
    return spent


@kernel
def _roll(
    turn: FloatArray, push: FloatArray, period: float, base: FloatArray, inputs: FloatArray, delta: FloatArray
) -> None:
    """dx_k of the linearised motion for inputs (N^c, 2), into `delta` (N, 3)."""
    x, y, theta = 0.0, 0.0, 0.0
    last = len(base) - 1
    for k in range(len(turn)):
        j = min(k, last)
        v, w = inputs[j, 0] - base[j, 0], inputs[j, 1] - base[j, 1]
        x += turn[k, 0] * theta + push[k, 0, 0] * v + push[k, 0, 1] * w
        y += turn[k, 1] * theta + push[k, 1, 0] * v + push[k, 1, 1] * w
        theta += period * w
        delta[k, 0], delta[k, 1], delta[k, 2] = x, y, theta


@kernel
def _roll_step(
    turn: FloatArray, push: FloatArray, period: float, step: FloatArray, delta: FloatArray, free: int
) -> None:
    """The same for a change (2 N^c,) of the inputs."""
    x, y, theta = 0.0, 0.0, 0.0
    for k in range(len(turn)):
        j = 2 * min(k, free - 1)
        v, w = step[j], step[j + 1]
        x += turn[k, 0] * theta + push[k, 0, 0] * v + push[k, 0, 1] * w
        y += turn[k, 1] * theta + push[k, 1, 0] * v + push[k, 1, 1] * w
        theta += period * w
        delta[k, 0], delta[k, 1], delta[k, 2] = x, y, theta


@kernel
def _condense(
    turn: FloatArray,
    push: FloatArray,
    period: float,
    big: FloatArray,
    slope: FloatArray,
    bw: FloatArray,
    h: FloatArray,
    step: FloatArray,
    free: int,
) -> None:
    """From stages to inputs: the upper triangle of the Hessian into `h`, minus the gradient into `step`.

    Backwards, W_k = M_k + A_{k+1}^T W_{k+1} A_{k+1} gathers all later stages; then the block of inputs j <= k is
    B_k^T W_k G_kj with G_kj = dx_k / du_j, and G_{k+1,j} = A_{k+1} G_kj.
    """
    n = len(turn)
    for i in range(2 * free):
        step[i] = 0.0
        for j in range(i, 2 * free):
            h[i, j] = 0.0
    xx, xy, yy, xt, yt, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    p0, p1, p2 = 0.0, 0.0, 0.0
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            a, b = turn[k + 1, 0], turn[k + 1, 1]
            tt += a * (a * xx + 2.0 * xt) + b * (b * yy + 2.0 * yt) + 2.0 * a * b * xy
            xt += a * xx + b * xy
            yt += a * xy + b * yy
            p2 += a * p0 + b * p1
        xx, xy, yy = xx + big[k, 0], xy + big[k, 1], yy + big[k, 2]
        xt, yt, tt = xt + big[k, 3], yt + big[k, 4], tt + big[k, 5]
        p0, p1, p2 = p0 + slope[k, 0], p1 + slope[k, 1], p2 + slope[k, 2]
        i = 2 * min(k, free - 1)
        step[i] -= push[k, 0, 0] * p0 + push[k, 1, 0] * p1
        step[i + 1] -= push[k, 0, 1] * p0 + push[k, 1, 1] * p1 + period * p2
        for j in range(2):
            x, y = push[k, 0, j], push[k, 1, j]
            c = period if j == 1 else 0.0
            bw[k, j, 0] = x * xx + y * xy + c * xt
            bw[k, j, 1] = x * xy + y * yy + c * yt
            bw[k, j, 2] = x * xt + y * yt + c * tt
    for j in range(n):
        vx, vy, wx, wy = push[j, 0, 0], push[j, 1, 0], push[j, 0, 1], push[j, 1, 1]
        col = 2 * min(j, free - 1)
        for k in range(j, n):
            if k > j:
                wx += turn[k, 0] * period
                wy += turn[k, 1] * period
            vv = bw[k, 0, 0] * vx + bw[k, 0, 1] * vy
            vw = bw[k, 0, 0] * wx + bw[k, 0, 1] * wy + bw[k, 0, 2] * period  # d2 / dv_k domega_j
            wv = bw[k, 1, 0] * vx + bw[k, 1, 1] * vy
            ww = bw[k, 1, 0] * wx + bw[k, 1, 1] * wy + bw[k, 1, 2] * period
            row = 2 * min(k, free - 1)
            if row > col:
                h[col, row] += vv
                h[col, row + 1] += wv
                h[col + 1, row] += vw
                h[col + 1, row + 1] += ww
            elif k > j:  # two held stages: both orders fall on the same block
                h[col, col] += 2.0 * vv
                h[col, col + 1] += vw + wv
                h[col + 1, col + 1] += 2.0 * ww
            else:
                h[col, col] += vv
                h[col, col + 1] += vw
                h[col + 1, col + 1] += ww
