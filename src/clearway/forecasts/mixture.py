"""Several kinds of motion at once: weighed by how well each foretold what was seen, put together as few hypotheses.

A kind of motion changes now and then: between two measurements each family gives a little of its probability to the
others (Magill 1965 with a Markov chain's switching, the first-order multiple-model filter; Bar-Shalom, Li,
Kirubarajan 2001, section 11.6). A family that has been refuted begins anew with what the freest one believes, so that it
can be right again later. An oscillation's stiffness has its own probabilities on each axis.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts import oscillations
from clearway.forecasts.models import (
    BRAKING,
    FAMILIES,
    FREE,
    MANOEUVRE,
    OSCILLATION,
    STEADY,
    STOPPED,
    Filters,
    Fit,
    Models,
    put,
    renew,
)
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

GROUPS = 5
"""Hypotheses before merging: oscillation, straight or manoeuvring, stopped, turning left, turning right."""
_UNLIKELY = 1e-3  # a stiffness less probable doesn't change a forecast


@kernel
def weigh(models: Models, stay: float, refuted: float, fit: Fit, filters: Filters) -> tuple[float, float]:
    """Weigh one track's models after a measurement.

    Args:
        stay: probability that the kind of motion has not changed. refuted: see the parameters.
        filters: probabilities are updated; filters of refuted families are renewed.

    Returns:
        The squared deviations of the best model, and the probability that the kind of motion has changed.
    """
    family, stiff, osc_fit, osc_error = filters.family, filters.stiff, fit.osc, fit.osc_off
    turn_fit, turn_error = fit.turn, fit.turn_off
    bank, turns = stiff.shape[1], turn_fit.shape[0]
    best = math.inf
    score = np.empty(FAMILIES + turns)
    for m in range(OSCILLATION):
        score[m] = fit.linear[m]
        if models.prior[m] > 0.0:
            best = min(best, fit.linear_off[m])
    score[OSCILLATION] = 0.0
    for i in range(2):
        top = -math.inf
        for b in range(bank):
            top = max(top, osc_fit[i, b])
        total = 0.0
        for b in range(bank):
            stiff[i, b] *= math.exp(osc_fit[i, b] - top)
            total += stiff[i, b]
        if total > 0.0:
            score[OSCILLATION] += top + math.log(total)
        else:
            score[OSCILLATION] = -math.inf
            put(models.likely, stiff[i])
            total = 1.0
        for b in range(bank):
            stiff[i, b] = max(stiff[i, b] / total, 1e-9)
    if models.prior[OSCILLATION] > 0.0:
        least_x, least_y = math.inf, math.inf
        for b in range(bank):
            least_x, least_y = min(least_x, osc_error[0, b]), min(least_y, osc_error[1, b])
        best = min(best, least_x + least_y)
    for i in range(turns):
        score[FAMILIES + i] = turn_fit[i]
        if models.prior[FAMILIES + i] > 0.0:
            best = min(best, turn_error[i])
    top = -math.inf
    changed = 0.0
    for f in range(FAMILIES + turns):
        family[f] = stay * family[f] + (1.0 - stay) * models.next[f]
        if family[f] > 0.0:
            score[f] += math.log(family[f])
            top = max(top, score[f])
    total = 0.0
    for f in range(FAMILIES + turns):
        if family[f] > 0.0:
            new = (1.0 - stay) * models.next[f] / family[f]
            family[f] = math.exp(score[f] - top)
            changed += new * family[f]
        total += family[f]
    for f in range(FAMILIES + turns):
        family[f] /= total
        if family[f] < refuted and models.prior[f] > 0.0:
            renew(models, f, filters)
            if f == OSCILLATION:
                put(models.likely, stiff[0])
                put(models.likely, stiff[1])
    return best, changed / total


@kernel
def _add(
    models: Models, m: int, w: float, x: float, y: float, mean: FloatArray, cov: FloatArray, path: FloatArray,
    var: FloatArray,
) -> None:  # fmt: skip
    """Add linear model `m` with weight `w` to a group's mean `path` (2, K + 1) about (x, y) and its mean of squares."""
    x, y = mean[0, m, 0] - x, mean[1, m, 0] - y
    xx, xv, xo, vv, vo, oo = cov[m, 0], cov[m, 1], cov[m, 2], cov[m, 3], cov[m, 4], cov[m, 5]
    vx, ox, vy, oy = mean[0, m, 1], mean[0, m, 2], mean[1, m, 1], mean[1, m, 2]
    for j in range(var.shape[0]):
        a, b, c = models.row[m, j, 0], models.row[m, j, 1], models.row[m, j, 2]
        px, py = a * x + b * vx + c * ox, a * y + b * vy + c * oy
        own = a * (a * xx + 2.0 * (b * xv + c * xo)) + b * (b * vv + 2.0 * c * vo) + c * c * oo + models.grown[m, j]
        path[0, j] += w * px
        path[1, j] += w * py
        var[j] += w * (own + 0.5 * (px * px + py * py))


class Hypotheses(NamedTuple):
    """One track's forecast by up to H hypotheses, about a place near it.

    Attributes:
        path: (H, K + 1, 2) m.
        sigma: (H, K + 1) m, standard deviation along either axis; while they are put together, variances, m^2.
        weight: (H,) probability.
    """

    path: FloatArray
    sigma: FloatArray
    weight: FloatArray


@kernel
def forecast(
    models: Models, filters: Filters, x: float, y: float, rate: float, agree: float, least: float, out: Hypotheses
) -> None:
    """One track's hypotheses, filled into `out`, which needs no values; see `Forecast`.

    Args:
        x, y: a place near the track, about which moments are taken, m. rate: of changes of the kind of
        motion that were seen, 1/s. agree, least: see the parameters.
    """
    path, sigma, weight = out
    n = sigma.shape[1]
    share, first, second = np.zeros(GROUPS), np.zeros((GROUPS, 2, n)), np.zeros((GROUPS, n))
    _group(models, filters, x, y, least, share, first, second)
    used = _merge(share, first, second, agree, least, out)
    if rate > 0.0:
        for j in range(n):
            wider = (1.0 - math.exp(-rate * j * models.step)) * models.grown[MANOEUVRE, j]
            for h in range(used):
                sigma[h, j] += wider
    _finish(x, y, used, path, sigma, weight)


@kernel
def _group(
    models: Models, filters: Filters, x: float, y: float, least: float, share: FloatArray, first: FloatArray,
    second: FloatArray,
) -> None:  # fmt: skip
    """Put the models together that go alike: fill each group's `share` (G,), and if that is not less than `least`, its
    mean about (x, y) into `first` (G, 2, K + 1) and its mean of squares into `second` (G, K + 1)."""
    mean, cov, turn, turn_cov, osc, osc_cov, family, stiff = filters
    n, turns = second.shape[1], turn.shape[0]
    share[0] = family[OSCILLATION]
    share[1] = family[STEADY] + family[FREE] + family[BRAKING] + family[MANOEUVRE]
    share[2] = family[STOPPED]
    for i in range(turns):
        share[3 + i % 2] += family[FAMILIES + i]
    if share[0] >= least:
        for i in range(2):
            likely = 0.0
            for b in range(stiff.shape[1]):
                likely += stiff[i, b] if stiff[i, b] >= _UNLIKELY else 0.0
            for b in range(stiff.shape[1]):
                if stiff[i, b] >= _UNLIKELY:
                    oscillations.forecast(
                        models.step, models.noise[5], stiff[i, b] / likely, x if i == 0 else y, osc[i, b], osc_cov[i, b],
                        first[0, i], second[0],
                    )  # fmt: skip
    if share[1] >= least:
        for m in (STEADY, FREE, BRAKING, MANOEUVRE):
            w = family[m] / share[1]
            _add(models, m, w, x, y, mean, cov, first[1], second[1])
    if share[2] >= least:
        _add(models, STOPPED, 1.0, x, y, mean, cov, first[2], second[2])
    for i in range(turns):
        g = 3 + i % 2
        if share[g] < least:
            continue
        w = family[FAMILIES + i] / share[g]
        zz, vv, re, im = turn_cov[i, 0], turn_cov[i, 1], turn_cov[i, 2], turn_cov[i, 3]
        for j in range(n):
            gr, gi = models.turn_row[i, j, 0], models.turn_row[i, j, 1]
            px = turn[i, 0] - x + gr * turn[i, 2] - gi * turn[i, 3]
            py = turn[i, 1] - y + gi * turn[i, 2] + gr * turn[i, 3]
            own = zz + 2.0 * (gr * re + gi * im) + (gr * gr + gi * gi) * vv + models.turn_grown[j]
            first[g, 0, j] += w * px
            first[g, 1, j] += w * py
            second[g, j] += w * (own + 0.5 * (px * px + py * py))


@kernel
def _merge(
    share: FloatArray, first: FloatArray, second: FloatArray, agree: float, least: float, out: Hypotheses
) -> int:
    """The groups as hypotheses, the likeliest first; those that agree are merged. Returns how many there are.

    Args:
        share: (G,) is used up.
    """
    path, sigma, weight = out
    n = sigma.shape[1]
    for h in range(weight.shape[0]):
        weight[h] = 0.0
    used = 0
    for _ in range(GROUPS):
        g = 0
        for i in range(1, GROUPS):
            if share[i] > share[g]:
                g = i
        w = share[g]
        if w < least:
            break
        share[g] = 0.0
        into, nearest = -1, math.inf
        for h in range(used):
            worst = 0.0
            for j in range(n):
                dx, dy = first[g, 0, j] - path[h, j, 0], first[g, 1, j] - path[h, j, 1]
                own = second[g, j] - 0.5 * (first[g, 0, j] ** 2 + first[g, 1, j] ** 2)
                d2, s2 = dx * dx + dy * dy, max(sigma[h, j], own, 1e-6)
                if d2 > worst * s2:
                    worst = d2 / s2
            if worst < nearest:
                into, nearest = h, worst
        if used == weight.shape[0] or (into >= 0 and nearest <= agree * agree):  # sigma holds variances until the end
            total = weight[into] + w
            s = w / total
            for j in range(n):
                dx, dy = first[g, 0, j] - path[into, j, 0], first[g, 1, j] - path[into, j, 1]
                own = second[g, j] - 0.5 * (first[g, 0, j] ** 2 + first[g, 1, j] ** 2)
                path[into, j, 0] += s * dx
                path[into, j, 1] += s * dy
                sigma[into, j] = (1.0 - s) * sigma[into, j] + s * own + 0.5 * s * (1.0 - s) * (dx * dx + dy * dy)
            weight[into] = total
        else:
            for j in range(n):
                path[used, j, 0], path[used, j, 1] = first[g, 0, j], first[g, 1, j]
                sigma[used, j] = second[g, j] - 0.5 * (first[g, 0, j] ** 2 + first[g, 1, j] ** 2)
            weight[used] = w
            used += 1
    return used


@kernel
def _finish(x: float, y: float, used: int, path: FloatArray, sigma: FloatArray, weight: FloatArray) -> None:
    """Sort the `used` hypotheses, whose `sigma` are variances and whose paths are about (x, y), and normalise them."""
    for i in range(used):  # few: selection
        top = i
        for h in range(i + 1, used):
            if weight[h] > weight[top]:
                top = h
        if top != i:
            weight[i], weight[top] = weight[top], weight[i]
            for j in range(sigma.shape[1]):
                sigma[i, j], sigma[top, j] = sigma[top, j], sigma[i, j]
                for k in range(2):
                    path[i, j, k], path[top, j, k] = path[top, j, k], path[i, j, k]
    total = 0.0
    for h in range(used):
        total += weight[h]
    for h in range(weight.shape[0]):
        for j in range(sigma.shape[1]):
            if h >= used:  # not used, but finite
                path[h, j, 0], path[h, j, 1], sigma[h, j] = path[0, j, 0], path[0, j, 1], sigma[0, j]
            else:
                path[h, j, 0] += x
                path[h, j, 1] += y
                sigma[h, j] = math.sqrt(max(sigma[h, j], 1e-8))
        weight[h] /= total
