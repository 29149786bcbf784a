"""Oscillation about an unknown point with unknown stiffness: filters that learn both while they run.

Along an axis x'' = a, a' = -k v: the state is position, velocity, acceleration and stiffness k. Where the point lies
(x + a / k) need not be known, and k matters only as far as the motion has shown it: that is why this form is nearly
linear. For a fixed k the transition is exact; k itself is estimated by an extended Kalman filter. Several of them start
from stiffnesses spread evenly in log k and are weighed by likelihood (a Gaussian sum, Alspach and Sorenson 1972), so
that no first guess has to be good; a bank of fixed values would never fit better than half the way between two of them.

A covariance is stored as xx, xv, xa, xk, vv, va, vk, aa, ak, kk.
"""

from __future__ import annotations

import math

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

SOFTEST, STIFFEST = 2e-3, 2.0
"""1/s^2; an estimate is kept in between."""


@kernel
def begin(
    stiffness: FloatArray, spread: float, reach: FloatArray, x: float, v: float, r: float, vv: float, state: FloatArray,
    cov: FloatArray,
) -> None:  # fmt: skip
    """Start the filters of one axis at a position and a velocity with variances `r` and `vv`.

    Args:
        stiffness: (B,) 1/s^2. spread: standard deviation of a stiffness over its value. reach: (B,) m, standard
        deviation of the way to the point. state: (B, 4), cov: (B, 10), filled.
    """
    for b in range(stiffness.shape[0]):
        k = stiffness[b]
        state[b, 0], state[b, 1], state[b, 2], state[b, 3] = x, v, 0.0, k
        for j in range(10):
            cov[b, j] = 0.0
        cov[b, 0], cov[b, 4], cov[b, 7], cov[b, 9] = r, vv, (k * reach[b]) ** 2, (spread * k) ** 2


@kernel
def renew(
    stiffness: FloatArray, spread: float, x: float, v: float, a: float, like: FloatArray, state: FloatArray,
    cov: FloatArray,
) -> None:  # fmt: skip
    """Start them anew at a position, a velocity and an acceleration with covariance `like` (6,): xx, xv, xa, vv, va, aa."""
    for b in range(stiffness.shape[0]):
        k = stiffness[b]
        state[b, 0], state[b, 1], state[b, 2], state[b, 3] = x, v, a, k
        for j in range(10):
            cov[b, j] = 0.0
        cov[b, 0], cov[b, 1], cov[b, 2], cov[b, 4], cov[b, 5], cov[b, 7] = (
            like[0], like[1], like[2], like[3], like[4], like[5],
        )  # fmt: skip
        cov[b, 9] = (spread * k) ** 2


@kernel
def predict(dt: float, q: float, state: FloatArray, cov: FloatArray) -> None:
    """Move the filters of one axis on by `dt` [s]; `q`: white jerk, m^2/s^5."""
    for i in range(state.shape[0]):
        x, v, a, k = state[i, 0], state[i, 1], state[i, 2], state[i, 3]
        w = math.sqrt(k)
        c, s = math.cos(w * dt), math.sin(w * dt)
        f, g, h = s / w, (1.0 - c) / k, -w * s
        df, dg, dc, dh = 0.5 * (dt * c - f) / k, (0.5 * dt * f - g) / k, -0.5 * dt * f, -0.5 * (f + dt * c)
        state[i, 0], state[i, 1], state[i, 2] = x + f * v + g * a, c * v + f * a, h * v + c * a
        d0, d1, d2 = df * v + dg * a, dc * v + df * a, dh * v + dc * a  # by k
        xx, xv, xa, xk, vv = cov[i, 0], cov[i, 1], cov[i, 2], cov[i, 3], cov[i, 4]
        va, vk, aa, ak, kk = cov[i, 5], cov[i, 6], cov[i, 7], cov[i, 8], cov[i, 9]
        x_x, x_v = xx + f * xv + g * xa + d0 * xk, xv + f * vv + g * va + d0 * vk  # rows of F P
        x_a, x_k = xa + f * va + g * aa + d0 * ak, xk + f * vk + g * ak + d0 * kk
        v_v, v_a, v_k = c * vv + f * va + d1 * vk, c * va + f * aa + d1 * ak, c * vk + f * ak + d1 * kk
        a_v, a_a, a_k = h * vv + c * va + d2 * vk, h * va + c * aa + d2 * ak, h * vk + c * ak + d2 * kk
        cov[i, 0] = x_x + f * x_v + g * x_a + d0 * x_k + q * dt**5 / 20.0
        cov[i, 1] = c * x_v + f * x_a + d1 * x_k + q * dt**4 / 8.0
        cov[i, 2] = h * x_v + c * x_a + d2 * x_k + q * dt**3 / 6.0
        cov[i, 3] = x_k
        cov[i, 4] = c * v_v + f * v_a + d1 * v_k + q * dt**3 / 3.0
        cov[i, 5] = h * v_v + c * v_a + d2 * v_k + q * dt**2 / 2.0
        cov[i, 6] = v_k
        cov[i, 7] = h * a_v + c * a_a + d2 * a_k + q * dt
        cov[i, 8] = a_k


@kernel
def correct(
    what: int, z: float, r: float, state: FloatArray, cov: FloatArray, fit: FloatArray, error: FloatArray
) -> None:
    """Take what was measured, with variance `r`, into the filters of one axis.

    Args:
        what: 0: a position [m], 1: a velocity [m/s]. fit: (B,), added to: logarithm of each one's likelihood, less a
        constant. error: (B,), added to: squared deviations.
    """
    for i in range(state.shape[0]):
        xx, xv, xa, xk, vv, va, vk = cov[i, 0], cov[i, 1], cov[i, 2], cov[i, 3], cov[i, 4], cov[i, 5], cov[i, 6]
        px, pv, pa, pk = (xx, xv, xa, xk) if what == 0 else (xv, vv, va, vk)
        s = (px if what == 0 else pv) + r
        e = z - state[i, what]
        kx, kv, ka, kk = px / s, pv / s, pa / s, pk / s
        state[i, 0] += kx * e
        state[i, 1] += kv * e
        state[i, 2] += ka * e
        state[i, 3] = min(max(state[i, 3] + kk * e, SOFTEST), STIFFEST)
        cov[i, 0], cov[i, 1], cov[i, 2], cov[i, 3] = xx - kx * px, xv - kx * pv, xa - kx * pa, xk - kx * pk
        cov[i, 4], cov[i, 5], cov[i, 6] = vv - kv * pv, va - kv * pa, vk - kv * pk
        cov[i, 7] -= ka * pa
        cov[i, 8] -= ka * pk
        cov[i, 9] -= kk * pk
        fit[i] += -0.5 * math.log(s) - 0.5 * e * e / s
        error[i] += e * e / s


@kernel
def forecast(
    step: float, q: float, weight: float, near: float, state: FloatArray, cov: FloatArray, path: FloatArray,
    var: FloatArray,
) -> None:  # fmt: skip
    """Add one filter's forecast of one axis, with a `weight`.

    Args:
        step: s between instants. q: white jerk, m^2/s^5. near: m, the place about which moments are taken. state: (4,),
        cov: (10,). path: (K + 1,), added to: weighted mean, m. var: (K + 1,), added to: half the weighted mean of
        squares, as an axis' share in what both have on average, m^2.
    """
    x, v, a, k = state[0] - near, state[1], state[2], state[3]
    w = math.sqrt(k)
    c1, s1 = math.cos(w * step), math.sin(w * step)
    c, s = 1.0, 0.0
    per_w, per_k = 1.0 / w, 1.0 / k
    for j in range(path.shape[0]):
        t = j * step
        f, g = s * per_w, (1.0 - c) * per_k
        d = (0.5 * (t * c - f) * v + (0.5 * t * f - g) * a) * per_k
        p = x + f * v + g * a
        own = (
            cov[0] + 2.0 * (f * cov[1] + g * cov[2] + d * cov[3]) + f * (f * cov[4] + 2.0 * (g * cov[5] + d * cov[6]))
            + g * (g * cov[7] + 2.0 * d * cov[8]) + d * d * cov[9] + 0.05 * q * t * t * t * t * t
        )  # fmt: skip
        path[j] += weight * p
        var[j] += 0.5 * weight * (own + p * p)
        c, s = c * c1 - s * s1, s * c1 + c * s1
