"""The Newton system of the interior point: a linear-quadratic regulator over the pose and the input before.

A Riccati recursion solves it in O(N): factorised once, for as many right-hand sides as there are.
"""

from __future__ import annotations

from typing import NamedTuple

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


class LinearMotion(NamedTuple):
    """The motion linearised about a plan of N inputs: dx_k = A_k dx_{k-1} + B_k du_k.

    Attributes:
        turn: (N, 2) d(x, y)_k / d theta_{k-1}, m/rad.
        push: (N, 2, 2) d(x, y)_k / d(v, omega)_k, s and m s/rad.
        period: d theta_k / d omega_k, s.
    """

    turn: FloatArray
    push: FloatArray
    period: float


@kernel
def roll(motion: LinearMotion, step: FloatArray, delta: FloatArray) -> None:
    """dx_k for changes `step` (N^c, 2) of the inputs, into `delta` (N, 3)."""
    turn, push, period = motion
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
def factorise(motion: LinearMotion, big: FloatArray, cross: FloatArray, weight: FloatArray, gains: FloatArray) -> bool:
    """The matrices of the Riccati recursion over (pose, input before), backwards. False: not positive definite.

    Args:
        motion: The linearised motion.
        big: (N, 6) Hessian of stage k's pose: xx, xy, yy, xt, yt, tt.
        cross: (N, 4) Hessian between stage k's position and the one before: xx', xy', yx', yy'; (0, 4): there is none.
        weight: (N, 5) Hessian of its inputs v and omega, and of their change: vv, vw, ww.
        gains: (N^c, 13), filled: H^-1 (00, 01, 11), F = H^-1 H_up (2 x 3), E = H^-1 T (2 x 2).
    """
    turn, push, period = motion
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
        if len(cross) > 0:  # H_up = G A + B^T C, and A^T C + C^T A besides
            c0, c1, c2, c3 = cross[k, 0], cross[k, 1], cross[k, 2], cross[k, 3]
            gv0, gv1 = gv0 + p * c0 + q * c2, gv1 + p * c1 + q * c3
            gw0, gw1 = gw0 + r * c0 + s * c2, gw1 + r * c1 + s * c3
            xx, xy, yy = xx + 2.0 * c0, xy + c1 + c2, yy + 2.0 * c3
            xt, yt = xt + a * c0 + b * c2, yt + a * c1 + b * c3
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
def solve(
    motion: LinearMotion, slope: FloatArray, pull: FloatArray, gains: FloatArray, effort: float, u: FloatArray,
    step: FloatArray,
) -> None:  # fmt: skip
    """The Newton step of the inputs, by what `factorise` left.

    Args:
        motion: The linearised motion.
        slope: (N, 3) gradient for stage k's pose.
        pull: (N^c, 4) gradient for its inputs and for their change; what the effort of held inputs adds is not in it.
        gains: (N^c, 13) what `factorise` left.
        effort: Weight of the inputs.
        u: (N^c, 2) the inputs.
        step: (N^c, 2), filled.
    """
    turn, push, period = motion
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
