"""Models of motion: linear filters, each exact for its fixed parameter, run side by side for every track.

Along an axis the linear models have three states, position, velocity and acceleration, and a covariance that both axes
share, as their noise is alike:

    STOPPED        position only
    STEADY         constant velocity with weak white acceleration
    FREE           the same with strong one
    BRAKING        velocity that fades exponentially
    MANOEUVRE      acceleration that fades exponentially (Singer 1970)

Constant turn couples the axes: with z = x + iy, v' = i omega v is a filter of two complex states, one for each omega.
OSCILLATION is a family of its own, see `oscillations`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts import oscillations
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

STOPPED, STEADY, FREE, BRAKING, MANOEUVRE, OSCILLATION = 0, 1, 2, 3, 4, 5
FAMILIES = 6
"""Kinds of motion before the turns, each of which is a family of its own."""


AT_FIRST = np.array([0.06, 0.14, 0.1, 0.04, 0.2, 0.38])
"""Probability of each family but the turns, which share the rest."""
AFTER_CHANGE = np.array([0.2, 0.3, 0.12, 0.1, 0.2, 0.02])
"""The same once the kind of motion has changed: what is free to change does not swing for ever."""


class Models(NamedTuple):
    """The bank, and how it forecasts.

    Attributes:
        stiffness: (B,) 1/s^2 from which oscillations start; none where none are expected.
        likely: (B,) their probabilities.
        spread: Standard deviation of each over its value.
        reach: (B,) standard deviation of the way to the point, m.
        turn: (R,) yaw rates, rad/s.
        prior: (6 + R,) probability of each family at first.
        next: (6 + R,) the same once the kind of motion has changed.
        step: Time between a forecast's instants, s.
        noise: (6,) of stopped, steady, free, braking, turn, oscillation; see the parameters.
        manoeuvre: (3,) acceleration of a manoeuvre [m/s^2], how long it lasts [s], and how long braking lasts [s].
        row: (5, K + 1, 3) factors: the position at an instant is row . state now.
        grown: (5, K + 1) variance added until then, m^2.
        turn_row: (R, K + 1, 2) the same for turns: real and imaginary part of the velocity's factor.
        turn_grown: (K + 1,) m^2.
    """

    stiffness: FloatArray
    likely: FloatArray
    spread: float
    reach: FloatArray
    turn: FloatArray
    prior: FloatArray
    next: FloatArray
    step: float
    noise: FloatArray
    manoeuvre: FloatArray
    row: FloatArray
    grown: FloatArray
    turn_row: FloatArray
    turn_grown: FloatArray


class Filters(NamedTuple):
    """One track's filters, and how probable they are.

    Attributes:
        mean: (2, 5, 3) position [m], velocity [m/s] and acceleration [m/s^2] of each linear model, x and y.
        cov: (5, 6) their covariance along either axis: xx, xv, xa, vv, va, aa.
        turn: (R, 4) x, y [m], vx, vy [m/s] of each turning model.
        turn_cov: (R, 4) variance of position and of velocity, real and imaginary part of position with conjugate
            velocity.
        osc: (2, B, 4) see `oscillations`, x and y.
        osc_cov: (2, B, 10) see there.
        family: (6 + R,) probability of each family.
        stiff: (2, B) probability of each stiffness, along x and y.
    """

    mean: FloatArray
    cov: FloatArray
    turn: FloatArray
    turn_cov: FloatArray
    osc: FloatArray
    osc_cov: FloatArray
    family: FloatArray
    stiff: FloatArray


class Fit(NamedTuple):
    """How well a track's filters foretold what was measured.

    Attributes:
        linear: (5,) logarithm of the likelihood of each linear model, less a constant.
        linear_off: (5,) squared deviations, both axes together.
        turn: (R,) the same of the turning models.
        turn_off: (R,) the same.
        osc: (2, B) the same of the oscillations, along x and y.
        osc_off: (2, B) squared deviations along either.
    """

    linear: FloatArray
    linear_off: FloatArray
    turn: FloatArray
    turn_off: FloatArray
    osc: FloatArray
    osc_off: FloatArray


def models(p: ForecastParameters, step: float, count: int) -> Models:
    """The bank of parameters `p`, for forecasts of `count` steps of `step` [s]."""
    stiffness = np.geomspace(p.softest, p.stiffest, p.stiffnesses)
    apart = math.log(stiffness[1] / stiffness[0])
    likely = np.exp(-0.5 * np.linspace(-p.ends, p.ends, p.stiffnesses) ** 2)
    turn = np.array([sign * w for w in p.turns for sign in (1.0, -1.0)])
    prior, after = (
        np.concatenate([a, np.full(len(turn), (1.0 - a.sum()) / len(turn))]) for a in (AT_FIRST, AFTER_CHANGE)
    )
    prior *= (1.0 - p.oscillation) / (1.0 - AT_FIRST[OSCILLATION])
    prior[OSCILLATION] = p.oscillation
    if p.oscillation == 0.0:
        after[OSCILLATION] = 0.0
    if p.constant_velocity_only:
        prior = after = np.zeros(FAMILIES + len(turn))
        prior[[STEADY, FREE]] = 0.5
    noise = np.array(
        [p.noise_stopped, p.noise_steady, p.noise_free, p.noise_braking, p.noise_turn, p.noise_oscillation]
    )
    manoeuvre = np.array([p.manoeuvre, p.manoeuvre_time, p.braking_time])
    reach = np.minimum(p.usual_reach, np.minimum(p.acceleration / stiffness, p.speed / np.sqrt(stiffness)))
    bank = slice(None if prior[OSCILLATION] > 0.0 else 0)  # filters that nothing is expected of cost as much as others

    move, spread = np.zeros((OSCILLATION, 3, 3)), np.zeros((OSCILLATION, 6))
    fine = 4  # the noise is integrated in finer steps than it is asked for
    transitions(noise, manoeuvre, step / fine, move, spread)
    row, grown = np.zeros((OSCILLATION, count + 1, 3)), np.zeros((OSCILLATION, count + 1))
    for m in range(OSCILLATION):
        whole, sigma, q = np.eye(3), np.zeros((3, 3)), _square(spread[m])
        for j in range(count + 1):
            row[m, j], grown[m, j] = whole[0], sigma[0, 0]
            for _ in range(fine):
                whole, sigma = move[m] @ whole, move[m] @ sigma @ move[m].T + q
    t: FloatArray = step * np.arange(count + 1, dtype=np.float64)
    angle = turn[:, None] * t
    along, aside = np.sin(angle) / turn[:, None], (1.0 - np.cos(angle)) / turn[:, None]
    turn_row = np.ascontiguousarray(np.stack([along, aside], axis=2))
    turn_grown: FloatArray = np.asarray(p.noise_turn * t**3 / 3.0, dtype=np.float64)
    return Models(
        stiffness[bank], (likely / likely.sum())[bank], 0.5 * apart, reach[bank], turn, prior, after, float(step), noise,
        manoeuvre, row, grown, turn_row, turn_grown,
    )  # fmt: skip


def _square(s: FloatArray) -> FloatArray:
    return np.array([[s[0], s[1], s[2]], [s[1], s[3], s[4]], [s[2], s[4], s[5]]])


@kernel
def put(source: FloatArray, target: FloatArray) -> None:
    """Copy numbers (n,); a loop compiles faster than an assignment of slices."""
    for i in range(source.shape[0]):
        target[i] = source[i]


@kernel
def transitions(noise: FloatArray, manoeuvre: FloatArray, dt: float, move: FloatArray, spread: FloatArray) -> None:
    """Fill what `dt` [s] does to the linear models: state transitions `move` (5, 3, 3) and noise `spread` (5, 6): xx, xv, xa,
    vv, va, aa; both zero before."""
    for m in range(OSCILLATION):
        move[m, 0, 0] = 1.0
    spread[STOPPED, 0] = noise[0] * dt
    for m in (STEADY, FREE, BRAKING):
        q = noise[m]
        spread[m, 0], spread[m, 1], spread[m, 3] = q * dt**3 / 3.0, q * dt**2 / 2.0, q * dt
        move[m, 0, 1], move[m, 1, 1] = dt, 1.0
    ease = math.exp(-dt / manoeuvre[2])
    move[BRAKING, 0, 1], move[BRAKING, 1, 1] = manoeuvre[2] * (1.0 - ease), ease
    rate = 1.0 / manoeuvre[1]
    fade = math.exp(-rate * dt)
    move[MANOEUVRE, 0, 1], move[MANOEUVRE, 0, 2] = dt, (rate * dt - 1.0 + fade) / rate**2
    move[MANOEUVRE, 1, 1], move[MANOEUVRE, 1, 2], move[MANOEUVRE, 2, 2] = 1.0, (1.0 - fade) / rate, fade
    q = 2.0 * rate * manoeuvre[0] ** 2
    spread[MANOEUVRE, 0], spread[MANOEUVRE, 1], spread[MANOEUVRE, 2] = (
        q * dt**5 / 20.0,
        q * dt**4 / 8.0,
        q * dt**3 / 6.0,
    )
    spread[MANOEUVRE, 3], spread[MANOEUVRE, 4], spread[MANOEUVRE, 5] = q * dt**3 / 3.0, q * dt**2 / 2.0, q * dt


@kernel
def begin(
    sigma: float, x: float, y: float, vx: float, vy: float, r: float, vv: float, mean: FloatArray, cov: FloatArray,
    turn: FloatArray, turn_cov: FloatArray,
) -> None:  # fmt: skip
    """Start one track's filters at a first position with variance `r` [m^2] and velocity with variance `vv` along an axis.

    Args:
        sigma: of a manoeuvre's acceleration, m/s^2. mean: (2, 5, 3), cov: (5, 6), turn: (R, 4) x, y, vx, vy, turn_cov:
        (R, 4) position, velocity, and real and imaginary part of position with conjugate velocity; all filled.
    """
    for m in range(mean.shape[1]):
        mean[0, m, 0], mean[0, m, 1], mean[0, m, 2] = x, vx, 0.0
        mean[1, m, 0], mean[1, m, 1], mean[1, m, 2] = y, vy, 0.0
        cov[m, 0], cov[m, 1], cov[m, 2], cov[m, 3], cov[m, 4], cov[m, 5] = r, 0.0, 0.0, vv, 0.0, 0.0
    mean[0, STOPPED, 1], mean[1, STOPPED, 1], cov[STOPPED, 3] = 0.0, 0.0, 0.0
    cov[MANOEUVRE, 5] = sigma * sigma
    for i in range(turn.shape[0]):
        turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3] = x, y, vx, vy
        turn_cov[i, 0], turn_cov[i, 1], turn_cov[i, 2], turn_cov[i, 3] = r, vv, 0.0, 0.0


@kernel
def predict(move: FloatArray, spread: FloatArray, mean: FloatArray, cov: FloatArray) -> None:
    """Move one track's axis filters on: x <- F x, P <- F P F' + Q; see `transitions` and `begin`."""
    for m in range(move.shape[0]):
        a, b, c = move[m, 0, 0], move[m, 0, 1], move[m, 0, 2]
        d, e, f = move[m, 1, 0], move[m, 1, 1], move[m, 1, 2]
        h = move[m, 2, 2]
        for i in range(2):
            x, v, o = mean[i, m, 0], mean[i, m, 1], mean[i, m, 2]
            mean[i, m, 0], mean[i, m, 1], mean[i, m, 2] = a * x + b * v + c * o, d * x + e * v + f * o, h * o
        xx, xv, xo, vv, vo, oo = cov[m, 0], cov[m, 1], cov[m, 2], cov[m, 3], cov[m, 4], cov[m, 5]
        px, pv, po = a * xx + b * xv + c * xo, a * xv + b * vv + c * vo, a * xo + b * vo + c * oo
        qx, qv, qo = d * xx + e * xv + f * xo, d * xv + e * vv + f * vo, d * xo + e * vo + f * oo
        cov[m, 0] = a * px + b * pv + c * po + spread[m, 0]
        cov[m, 1] = d * px + e * pv + f * po + spread[m, 1]
        cov[m, 2] = h * po + spread[m, 2]
        cov[m, 3] = d * qx + e * qv + f * qo + spread[m, 3]
        cov[m, 4] = h * qo + spread[m, 4]
        cov[m, 5] = h * h * oo + spread[m, 5]


@kernel
def predict_turns(rates: FloatArray, q: float, dt: float, turn: FloatArray, turn_cov: FloatArray) -> None:
    """Move one track's turning filters on by `dt` [s]; `q`: white acceleration, m^2/s^3."""
    for i in range(rates.shape[0]):
        w = rates[i]
        c, s = math.cos(w * dt), math.sin(w * dt)
        gr, gi = s / w, (1.0 - c) / w  # (exp(iw dt) - 1) / (iw)
        vx, vy = turn[i, 2], turn[i, 3]
        turn[i, 0] += gr * vx - gi * vy
        turn[i, 1] += gi * vx + gr * vy
        turn[i, 2], turn[i, 3] = c * vx - s * vy, s * vx + c * vy
        zz, vv, re, im = turn_cov[i, 0], turn_cov[i, 1], turn_cov[i, 2], turn_cov[i, 3]
        # P_zz' = P_zz + 2 Re(conj(g) P_zv) + |g|^2 P_vv; P_zv' = (P_zv + g P_vv) conj(f), with f = exp(iw dt)
        turn_cov[i, 0] = zz + 2.0 * (gr * re + gi * im) + (gr * gr + gi * gi) * vv + q * dt**3 / 3.0
        nr, ni = re + gr * vv, im + gi * vv
        turn_cov[i, 2], turn_cov[i, 3] = nr * c + ni * s + q * dt**2 / 2.0, ni * c - nr * s
        turn_cov[i, 1] = vv + q * dt


@kernel
def correct(
    what: int, zx: float, zy: float, r: float, mean: FloatArray, cov: FloatArray, fit: FloatArray, error: FloatArray
) -> None:
    """Take what was measured, with variance `r` along an axis, into one track's axis filters.

    Args:
        what: 0: a position (zx, zy) [m], 1: a velocity [m/s].
        fit: (5,), added to: logarithm of each model's likelihood, less a constant.
        error: (5,), added to: squared deviations, both axes together.
    """
    for m in range(cov.shape[0]):
        xx, xv, xo, vv, vo, oo = cov[m, 0], cov[m, 1], cov[m, 2], cov[m, 3], cov[m, 4], cov[m, 5]
        px, pv, po = (xx, xv, xo) if what == 0 else (xv, vv, vo)
        s = (px if what == 0 else pv) + r
        kx, kv, ko = px / s, pv / s, po / s
        off = 0.0
        for i in range(2):
            e = (zx if i == 0 else zy) - mean[i, m, what]
            mean[i, m, 0] += kx * e
            mean[i, m, 1] += kv * e
            mean[i, m, 2] += ko * e
            off += e * e / s
        cov[m, 0], cov[m, 1], cov[m, 2] = xx - kx * px, xv - kx * pv, xo - kx * po
        cov[m, 3], cov[m, 4], cov[m, 5] = vv - kv * pv, vo - kv * po, oo - ko * po
        fit[m] += -math.log(s) - 0.5 * off
        error[m] += off


@kernel
def correct_turns(
    what: int, zx: float, zy: float, r: float, turn: FloatArray, turn_cov: FloatArray, fit: FloatArray,
    error: FloatArray,
) -> None:  # fmt: skip
    """The same for one track's turning filters; fit, error: (R,), added to."""
    for i in range(turn.shape[0]):
        zz, vv, re, im = turn_cov[i, 0], turn_cov[i, 1], turn_cov[i, 2], turn_cov[i, 3]
        s = (zz if what == 0 else vv) + r
        ex, ey = zx - turn[i, 2 * what], zy - turn[i, 2 * what + 1]
        zr, zi, vr, vi = (zz, 0.0, re, -im) if what == 0 else (re, im, vv, 0.0)  # covariances with what is measured
        zr, zi, vr, vi = zr / s, zi / s, vr / s, vi / s
        turn[i, 0] += zr * ex - zi * ey
        turn[i, 1] += zi * ex + zr * ey
        turn[i, 2] += vr * ex - vi * ey
        turn[i, 3] += vi * ex + vr * ey
        keep = 1.0 - (zz if what == 0 else vv) / s
        turn_cov[i, 0] = zz - s * (zr * zr + zi * zi)
        turn_cov[i, 1] = vv - s * (vr * vr + vi * vi)
        turn_cov[i, 2], turn_cov[i, 3] = re * keep, im * keep
        off = (ex * ex + ey * ey) / s
        fit[i] += -math.log(s) - 0.5 * off
        error[i] += off


@kernel
def renew(models: Models, family: int, filters: Filters) -> None:
    """Begin the filters of a refuted family anew, with what the freer one among `MANOEUVRE` and `FREE` believes now."""
    mean, cov, turn, turn_cov = filters.mean, filters.cov, filters.turn, filters.turn_cov
    other = FREE if family == MANOEUVRE else MANOEUVRE
    if family == STOPPED:
        mean[0, STOPPED, 0], mean[1, STOPPED, 0], cov[STOPPED, 0] = mean[0, other, 0], mean[1, other, 0], cov[other, 0]
    elif family < OSCILLATION:
        put(mean[0, other], mean[0, family])
        put(mean[1, other], mean[1, family])
        put(cov[other], cov[family])
        if family == MANOEUVRE:
            cov[family, 5] = models.manoeuvre[0] ** 2
        else:
            mean[0, family, 2], mean[1, family, 2] = 0.0, 0.0
            cov[family, 2], cov[family, 4], cov[family, 5] = 0.0, 0.0, 0.0
    elif family == OSCILLATION:
        for i in range(2):
            x, v, a = mean[i, other, 0], mean[i, other, 1], mean[i, other, 2]
            oscillations.renew(models.stiffness, models.spread, x, v, a, cov[other], filters.osc[i], filters.osc_cov[i])
    else:
        i = family - FAMILIES
        turn[i, 0], turn[i, 1], turn[i, 2], turn[i, 3] = (
            mean[0, other, 0], mean[1, other, 0], mean[0, other, 1], mean[1, other, 1],
        )  # fmt: skip
        turn_cov[i, 0], turn_cov[i, 1], turn_cov[i, 2], turn_cov[i, 3] = (
            cov[other, 0],
            cov[other, 3],
            cov[other, 1],
            0.0,
        )
