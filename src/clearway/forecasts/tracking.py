"""Which obstacle is which: measurements matched to tracks, tracks begun, moved on, and dropped.

An identity that perception gives is believed only if the obstacle can have come there. What cannot is first tried
against the other tracks, so that two that swapped their identities are put right; else it has jumped.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.forecasts import bounds, oscillations
from clearway.forecasts.bounds import BENT, HELD, TOO_FAST
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.mixture import Hypotheses, forecast, weigh
from clearway.forecasts.models import (
    MANOEUVRE,
    OSCILLATION,
    Filters,
    Fit,
    Models,
    begin,
    correct,
    correct_turns,
    predict,
    predict_turns,
    put,
    transitions,
)
from clearway.forecasts.tracks import FIRST, MOVED, SEEN, Limits, Perceived, Tracks, filters_of
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

SWAPPED, NEW = 3, 4
"""What a measurement says, beside `bounds.HELD`, `TOO_FAST` and `BENT`: another's identity; never seen before."""

_LEAST_VARIANCE = 0.05**2  # m^2/s^2: what a tracker says of a velocity may be a little wrong
_SHIFTED = 12.0  # squared deviations: 1 in 400
_SEEN_CHANGE = 0.1  # a probability below is no evidence


class Matches(NamedTuple):
    """Which of the m perceived obstacles is which track.

    Attributes:
        row: (m,) int64, its track; -1: none.
        told: (m,) int64: HELD, TOO_FAST, BENT, SWAPPED or NEW.
        amount: (m,) how far it lies beyond what was possible, m.
    """

    row: npt.NDArray[np.int64]
    told: npt.NDArray[np.int64]
    amount: FloatArray


@kernel
def match(tracks: Tracks, count: int, speed: float, seen: Perceived, dt: FloatArray, matches: Matches) -> None:
    """Match measurements to tracks that have been moved on to now.

    Args:
        speed: what no obstacle exceeds, m/s. dt: (count,) s since each track was perceived last. matches: filled.
    """
    place, error, label = seen.place, seen.error, seen.label
    row, told, amount = matches
    m = label.shape[0]
    taken, missed = np.zeros(count, dtype=np.uint8), np.zeros(count, dtype=np.uint8)
    own = np.empty(m, dtype=np.int64)
    for j in range(m):
        own[j], row[j], told[j], amount[j] = -1, -1, NEW, 0.0
        for i in range(count):
            if tracks.label[i] == label[j] and not taken[i]:
                own[j] = i
                amount[j] = bounds.excess(place[j, 0], place[j, 1], error[j], tracks.disc[i])
                if amount[j] <= 0.0:
                    row[j], told[j], taken[i] = i, HELD, 1
                else:
                    missed[i] = 1
                break
    for j in range(m):  # those that cannot be who they are said to be, or are new under a name that was another's
        if row[j] >= 0:
            continue
        nearest = math.inf
        for i in range(count):
            if taken[i] or i == own[j]:
                continue
            if own[j] < 0 and not missed[i]:
                continue  # a new one is not a vanished one
            if bounds.excess(place[j, 0], place[j, 1], error[j], tracks.disc[i]) <= 0.0:
                d = math.hypot(place[j, 0] - tracks.disc[i, 0], place[j, 1] - tracks.disc[i, 1])
                if d < nearest:
                    nearest, row[j] = d, i
        if row[j] >= 0:
            taken[row[j]], told[j] = 1, SWAPPED
    for j in range(m):
        i = own[j]
        if row[j] < 0 and i >= 0 and not taken[i]:
            row[j], taken[i] = i, 1
            last = tracks.recent[i, 0]
            far = math.hypot(place[j, 0] - last[1], place[j, 1] - last[2]) - last[3] - error[j] - speed * dt[i]
            told[j] = BENT
            if far > 0.0:
                told[j], amount[j] = TOO_FAST, far


@kernel
def move_on(tracks: Tracks, count: int, models: Models, limits: Limits, dt: float) -> None:
    """Move the tracks on by `dt` [s] > 0."""
    move, spread = np.zeros((OSCILLATION, 3, 3)), np.zeros((OSCILLATION, 6))
    transitions(models.noise, models.manoeuvre, dt, move, spread)
    for i in range(count):
        predict(move, spread, tracks.mean[i], tracks.cov[i])
        predict_turns(models.turn, models.noise[4], dt, tracks.turn[i], tracks.turn_cov[i])
        for axis in range(2):
            oscillations.predict(dt, models.noise[5], tracks.osc[i, axis], tracks.osc_cov[i, axis])
        bounds.move(dt, limits.speed, limits.acceleration, tracks.disc[i])


@kernel
def fresh(
    tracks: Tracks, i: int, models: Models, x: float, y: float, vx: float, vy: float, r: float, vv: float
) -> None:  # fmt: skip
    """Begin the filters of track `i`; `r`, `vv`: variances along an axis of place [m^2] and velocity (vx, vy) [m^2/s^2]."""
    sigma = models.manoeuvre[0]
    begin(sigma, x, y, vx, vy, r, vv, tracks.mean[i], tracks.cov[i], tracks.turn[i], tracks.turn_cov[i])
    for axis in range(2):
        z, v = (x, vx) if axis == 0 else (y, vy)
        oscillations.begin(
            models.stiffness, models.spread, models.reach, z, v, r, vv, tracks.osc[i, axis], tracks.osc_cov[i, axis]
        )
        put(models.likely, tracks.stiff[i, axis])
    put(models.prior, tracks.family[i])


@kernel
def _bound_anew(tracks: Tracks, i: int, limits: Limits, t: float, x: float, y: float, error: float) -> None:
    bounds.start(x, y, error, limits.speed, tracks.disc[i], tracks.recent[i])
    tracks.recent[i, 0, 0], tracks.recent[i, 0, 1], tracks.recent[i, 0, 2], tracks.recent[i, 0, 3] = t, x, y, error


@kernel
def _follow_shift(
    tracks: Tracks, i: int, x: float, y: float, r: float, vx: float, vy: float, velocity_error: float
) -> None:
    """Move the filters of track `i` to a place that can't be its motion's, where its measured velocity is as expected.

    A lidar sees now more, now less of a body: the middle of what it sees jumps, its velocity does not.
    """
    mean, var = tracks.mean[i, :, MANOEUVRE], tracks.cov[i, MANOEUVRE]
    dx, dy = x - mean[0, 0], y - mean[1, 0]
    if not dx * dx + dy * dy > _SHIFTED * (var[0] + r):
        return
    if not math.hypot(vx - mean[0, 1], vy - mean[1, 1]) <= velocity_error + 2.0 * math.sqrt(var[3]):
        return
    for m in range(OSCILLATION):
        tracks.mean[i, 0, m, 0] += dx
        tracks.mean[i, 1, m, 0] += dy
    for m in range(tracks.turn.shape[1]):
        tracks.turn[i, m, 0] += dx
        tracks.turn[i, m, 1] += dy
    for b in range(tracks.osc.shape[2]):
        tracks.osc[i, 0, b, 0] += dx
        tracks.osc[i, 1, b, 0] += dy


@kernel
def take_in(
    tracks: Tracks, models: Models, limits: Limits, t: float, dt: FloatArray, seen: Perceived, matches: Matches
) -> None:
    """Give each measurement to its track, if it has one; those that are new, or have jumped, begin anew.

    Args:
        dt: (C,) s since each track was perceived last; 0: has been at this very instant.
        matches: what they tell is updated.
    """
    place, error, velocity, velocity_error = seen.place, seen.error, seen.velocity, seen.velocity_error
    row, told = matches.row, matches.told
    bank, turns = tracks.osc.shape[2], tracks.turn.shape[1]
    fit = Fit(
        np.empty(OSCILLATION), np.empty(OSCILLATION), np.empty(turns), np.empty(turns), np.empty((2, bank)),
        np.empty((2, bank)),
    )  # fmt: skip
    for j in range(row.shape[0]):
        i = row[j]
        if i < 0:
            continue
        x, y, e = place[j, 0], place[j, 1], error[j]
        r = 0.25 * e * e + 1e-6
        if told[j] == NEW or told[j] == TOO_FAST:
            vx, vy, vv = velocity[j, 0], velocity[j, 1], 0.25 * velocity_error[j] ** 2  # a bound is about two sigma
            if told[j] == TOO_FAST or not (math.isfinite(vx + vy) and vv < limits.usual_speed**2):
                vx, vy, vv = 0.0, 0.0, limits.usual_speed**2
            fresh(tracks, i, models, x, y, vx, vy, r, max(vv, _LEAST_VARIANCE))
            tracks.clock[i, FIRST], tracks.changes[i] = t, 0.0
            _bound_anew(tracks, i, limits, t, x, y, e)
            if limits.velocities and told[j] == NEW:
                bounds.take_velocity(velocity[j, 0], velocity[j, 1], velocity_error[j], tracks.disc[i])
            continue
        if dt[i] <= 0.0:
            continue
        if limits.velocities:
            _follow_shift(tracks, i, x, y, r, velocity[j, 0], velocity[j, 1], velocity_error[j])
        _compare(limits, x, y, r, velocity[j, 0], velocity[j, 1], velocity_error[j], filters_of(tracks, i), fit)
        rate = tracks.changes[i] / (t - tracks.clock[i, FIRST] + limits.patience)
        stay = math.exp(-(limits.switching + rate) * dt[i])
        best, changed = weigh(models, stay, limits.refuted, fit, filters_of(tracks, i))
        if changed > _SEEN_CHANGE:
            tracks.changes[i] += changed
        if best > limits.surprise:
            last = tracks.recent[i, 0]
            since = t - last[0]
            vx, vy = (x - last[1]) / since, (y - last[2]) / since
            fresh(tracks, i, models, x, y, vx, vy, r, 2.0 * r / since**2 + (0.5 * limits.acceleration * since) ** 2)
        if told[j] == BENT:
            _bound_anew(tracks, i, limits, t, x, y, e)
        elif not bounds.take(
            t, x, y, e, limits.speed, limits.acceleration, tracks.disc[i], tracks.recent[i]
        ) and told[j] == HELD:  # fmt: skip
            told[j] = BENT
        elif limits.velocities:
            bounds.take_velocity(velocity[j, 0], velocity[j, 1], velocity_error[j], tracks.disc[i])


@kernel
def _compare(
    limits: Limits, x: float, y: float, r: float, vx: float, vy: float, velocity_error: float, filters: Filters, fit: Fit
) -> None:  # fmt: skip
    """Take a place with variance `r` and, if velocities count, a velocity into one track's filters; fill `fit`."""
    for a in (fit.linear, fit.linear_off, fit.turn, fit.turn_off):
        for m in range(a.shape[0]):
            a[m] = 0.0
    for b in range(fit.osc.shape[1]):
        fit.osc[0, b], fit.osc[1, b], fit.osc_off[0, b], fit.osc_off[1, b] = 0.0, 0.0, 0.0, 0.0
    osc, osc_cov = filters.osc, filters.osc_cov
    for what in range(2):
        zx, zy, rz = x, y, r
        if what == 1:
            zx, zy, rz = vx, vy, max(0.25 * velocity_error**2, _LEAST_VARIANCE)
            if not (limits.velocities and math.isfinite(zx + zy + rz)):
                continue
        correct(what, zx, zy, rz, filters.mean, filters.cov, fit.linear, fit.linear_off)
        correct_turns(what, zx, zy, rz, filters.turn, filters.turn_cov, fit.turn, fit.turn_off)
        oscillations.correct(what, zx, rz, osc[0], osc_cov[0], fit.osc[0], fit.osc_off[0])
        oscillations.correct(what, zy, rz, osc[1], osc_cov[1], fit.osc[1], fit.osc_off[1])


@kernel
def advance(
    tracks: Tracks, count: int, models: Models, limits: Limits, t: float, dt: float, seen: Perceived, since: FloatArray,
    matches: Matches,
) -> int:  # fmt: skip
    """One period: move the tracks on by `dt` [s] to `t`, and take in what is perceived.

    Args:
        seen: there is room for all of them. since: (C,), filled: s since each track was perceived before.
        matches: filled.

    Returns:
        How many tracks there are now.
    """
    label, moving, row = seen.label, seen.moving, matches.row
    if dt > 0.0:
        move_on(tracks, count, models, limits, dt)
    for i in range(count):
        since[i] = t - tracks.clock[i, SEEN]
    match(tracks, count, limits.speed, seen, since, matches)
    known = count
    for j in range(label.shape[0]):
        if row[j] < 0 and moving[j]:
            row[j], since[count] = count, 0.0
            tracks.label[count] = label[j]
            tracks.identity[count] = _unused(tracks.identity, count, label[j])
            count += 1
    take_in(tracks, models, limits, t, since, seen, matches)
    for j in range(label.shape[0]):
        i = row[j]
        if i < 0:
            continue
        if tracks.label[i] != label[j]:
            for k in range(known):  # who had this name gets the other's
                if tracks.label[k] == label[j]:
                    tracks.label[k] = tracks.label[i]
            tracks.label[i] = label[j]
        tracks.size[i, 0], tracks.size[i, 1] = seen.radius[j], seen.error[j]
        tracks.clock[i, SEEN] = t
        if moving[j]:
            tracks.clock[i, MOVED] = t
    return count


@kernel
def _unused(identity: np.ndarray, count: int, wanted: int) -> int:
    """`wanted` if none of the first `count` identities is that, else the first negative number that none is."""
    name, other = wanted, -1
    while True:
        free = True
        for i in range(count):
            if identity[i] == name:
                free = False
                break
        if free:
            return name
        name, other = other, other - 1


@kernel
def foresee(tracks: Tracks, count: int, models: Models, limits: Limits, t: float, out: Forecast) -> int:
    """Fill the forecast at `t` [s] of those of the first `count` tracks that moved when they were perceived last.

    Args:
        out: `still` and the step are left as they are.

    Returns:
        How many these are.
    """
    n = 0
    for i in range(count):
        if tracks.clock[i, MOVED] < tracks.clock[i, SEEN]:
            continue
        disc = tracks.disc[i]
        rate = tracks.changes[i] / (tracks.clock[i, SEEN] - tracks.clock[i, FIRST] + limits.patience)
        hypotheses = Hypotheses(out.path[n], out.sigma[n], out.weight[n])
        forecast(models, filters_of(tracks, i), disc[0], disc[1], rate, limits.agree, limits.least, hypotheses)
        out.speed[n] = bounds.reach(disc, models.step, limits.speed, limits.acceleration, out.centre[n], out.reach[n])
        out.radius[n], out.identity[n], out.age[n] = tracks.size[i, 0], tracks.identity[i], t - tracks.clock[i, SEEN]
        n += 1
    return n
