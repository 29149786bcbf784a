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
from clearway.forecasts.bounds import BENT, HELD, RECENT, TOO_FAST
from clearway.forecasts.mixture import forecast, weigh
from clearway.forecasts.models import (
    FAMILIES,
    MANOEUVRE,
    OSCILLATION,
    Models,
    begin,
    correct,
    correct_turns,
    predict,
    predict_turns,
    put,
    transitions,
)
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

SWAPPED, NEW = 3, 4
"""What a measurement says, beside `bounds.HELD`, `TOO_FAST` and `BENT`: another's identity; never seen before."""
FIRST, SEEN, MOVED = 0, 1, 2


_LEAST_VARIANCE = 0.05**2  # m^2/s^2: what a tracker says of a velocity may be a little wrong
_SHIFTED = 12.0  # squared deviations: 1 in 400
_SEEN_CHANGE = 0.1  # a probability below is no evidence


class Tracks(NamedTuple):
    """Room for C tracks; the first `count` rows that its owner knows of are in use.

    Attributes:
        label: (C,) int64, the identity that perception gives it now. identity: (C,) int64, ours.
        clock: (C, 3) s: when it began, when it was perceived last, and when perceived last as one that moves.
        changes: (C,) of its kind of motion that were seen.
        size: (C, 2) m: radius, error of its last place.
        mean (C, 2, 5, 3), cov (C, 5, 6), turn (C, R, 4), turn_cov (C, R, 4): see `models.begin`. osc (C, 2, B, 4), osc_cov
        (C, 2, B, 10): see `oscillations`.
        family (C, 6 + R), stiff (C, 2, B): see `mixture.weigh`. disc (C, 6), recent (C, RECENT, 4): see `bounds.start`.
    """

    label: npt.NDArray[np.int64]
    identity: npt.NDArray[np.int64]
    clock: FloatArray
    changes: FloatArray
    size: FloatArray
    mean: FloatArray
    cov: FloatArray
    turn: FloatArray
    turn_cov: FloatArray
    osc: FloatArray
    osc_cov: FloatArray
    family: FloatArray
    stiff: FloatArray
    disc: FloatArray
    recent: FloatArray


def room(models: Models, capacity: int) -> Tracks:
    """Empty room for `capacity` tracks."""
    bank, turns, c = len(models.stiffness), len(models.turn), capacity
    return Tracks(
        np.zeros(c, dtype=np.int64), np.zeros(c, dtype=np.int64), np.zeros((c, 3)), np.zeros(c), np.zeros((c, 2)),
        np.zeros((c, 2, OSCILLATION, 3)), np.zeros((c, OSCILLATION, 6)), np.zeros((c, turns, 4)), np.zeros((c, turns, 4)),
        np.zeros((c, 2, bank, 4)), np.zeros((c, 2, bank, 10)), np.zeros((c, FAMILIES + turns)), np.zeros((c, 2, bank)),
        np.zeros((c, 6)), np.zeros((c, RECENT, 4)),
    )  # fmt: skip


def keep(tracks: Tracks, rows: npt.NDArray[np.int64], capacity: int) -> Tracks:
    """The tracks of `rows` in this order, with room for `capacity`."""
    moved = []
    for a in tracks:
        b = np.zeros((capacity, *a.shape[1:]), dtype=a.dtype)
        b[: len(rows)] = a[rows]
        moved.append(b)
    return Tracks(*moved)


class Limits(NamedTuple):
    """Numbers of the parameters that the kernels need; see there."""

    speed: float
    acceleration: float
    usual_speed: float
    switching: float
    refuted: float
    surprise: float
    agree: float
    least: float
    patience: float
    velocities: bool


@kernel
def match(
    tracks: Tracks, count: int, speed: float, place: FloatArray, error: FloatArray, label: np.ndarray, dt: FloatArray,
    row: np.ndarray, told: np.ndarray, amount: FloatArray,
) -> None:  # fmt: skip
    """Match measurements to tracks that have been moved on to now.

    Args:
        place (m, 2), error (m,) [m], label (m,): measured. dt: (count,) s since each track was perceived last.
        row: (m,), filled: its track, or -1: none. told: (m,), filled: HELD, TOO_FAST, BENT, SWAPPED or NEW.
        amount: (m,), filled: m that it lies beyond what was possible.
    """
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
    tracks: Tracks, models: Models, limits: Limits, t: float, dt: FloatArray, place: FloatArray, error: FloatArray,
    velocity: FloatArray, velocity_error: FloatArray, row: np.ndarray, told: np.ndarray,
) -> None:  # fmt: skip
    """Give each measurement to its track, if it has one; those that are new, or have jumped, begin anew.

    Args:
        dt: (C,) s since each track was perceived last; 0: has been at this very instant. velocity (m, 2),
        velocity_error (m,) [m/s]: measured. told: as `match` says, updated.
    """
    bank, turns = tracks.osc.shape[2], tracks.turn.shape[1]
    fit, off = np.empty(OSCILLATION), np.empty(OSCILLATION)
    turn_fit, turn_off = np.empty(turns), np.empty(turns)
    osc_fit, osc_off = np.empty((2, bank)), np.empty((2, bank))
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
            continue
        if dt[i] <= 0.0:
            continue
        if limits.velocities:
            _follow_shift(tracks, i, x, y, r, velocity[j, 0], velocity[j, 1], velocity_error[j])
        for m in range(OSCILLATION):
            fit[m], off[m] = 0.0, 0.0
        for m in range(turns):
            turn_fit[m], turn_off[m] = 0.0, 0.0
        for b in range(bank):
            osc_fit[0, b], osc_fit[1, b], osc_off[0, b], osc_off[1, b] = 0.0, 0.0, 0.0, 0.0
        for what in range(2):
            zx, zy, rz = x, y, r
            if what == 1:
                zx, zy, rz = velocity[j, 0], velocity[j, 1], max(0.25 * velocity_error[j] ** 2, _LEAST_VARIANCE)
                if not (limits.velocities and math.isfinite(zx + zy + rz)):
                    continue
            correct(what, zx, zy, rz, tracks.mean[i], tracks.cov[i], fit, off)
            correct_turns(what, zx, zy, rz, tracks.turn[i], tracks.turn_cov[i], turn_fit, turn_off)
            oscillations.correct(what, zx, rz, tracks.osc[i, 0], tracks.osc_cov[i, 0], osc_fit[0], osc_off[0])
            oscillations.correct(what, zy, rz, tracks.osc[i, 1], tracks.osc_cov[i, 1], osc_fit[1], osc_off[1])
        rate = tracks.changes[i] / (t - tracks.clock[i, FIRST] + limits.patience)
        stay = math.exp(-(limits.switching + rate) * dt[i])
        best, changed = weigh(
            models, stay, limits.refuted, fit, off, turn_fit, turn_off, osc_fit, osc_off, tracks.family[i],
            tracks.stiff[i], tracks.mean[i], tracks.cov[i], tracks.turn[i], tracks.turn_cov[i], tracks.osc[i],
            tracks.osc_cov[i],
        )  # fmt: skip
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


@kernel
def advance(
    tracks: Tracks, count: int, models: Models, limits: Limits, t: float, dt: float, place: FloatArray,
    error: FloatArray, velocity: FloatArray, velocity_error: FloatArray, radius: FloatArray, label: np.ndarray,
    moving: np.ndarray, row: np.ndarray, told: np.ndarray, amount: FloatArray, since: FloatArray,
) -> int:  # fmt: skip
    """One period: move the tracks on by `dt` [s] to `t`, and take in what is perceived.

    Args:
        place (m, 2), error (m,) ...: the perceived obstacles, see `Obstacles`. There is room for all of them.
        row, told, amount: (m,), see `match`; filled. since: (C,), filled: s since each track was perceived before.

    Returns:
        How many tracks there are now.
    """
    if dt > 0.0:
        move_on(tracks, count, models, limits, dt)
    for i in range(count):
        since[i] = t - tracks.clock[i, SEEN]
    match(tracks, count, limits.speed, place, error, label, since, row, told, amount)
    known = count
    for j in range(label.shape[0]):
        if row[j] < 0 and moving[j]:
            row[j], since[count] = count, 0.0
            tracks.label[count] = label[j]
            tracks.identity[count] = _unused(tracks.identity, count, label[j])
            count += 1
    take_in(tracks, models, limits, t, since, place, error, velocity, velocity_error, row, told)
    for j in range(label.shape[0]):
        i = row[j]
        if i < 0:
            continue
        if tracks.label[i] != label[j]:
            for k in range(known):  # who had this name gets the other's
                if tracks.label[k] == label[j]:
                    tracks.label[k] = tracks.label[i]
            tracks.label[i] = label[j]
        tracks.size[i, 0], tracks.size[i, 1] = radius[j], error[j]
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
def foresee(
    tracks: Tracks, count: int, models: Models, limits: Limits, t: float, path: FloatArray, sigma: FloatArray,
    weight: FloatArray, radius: FloatArray, centre: FloatArray, reach: FloatArray, speed: FloatArray,
    identity: np.ndarray, age: FloatArray,
) -> int:  # fmt: skip
    """Fill the forecast at `t` [s] of those of the first `count` tracks that moved when they were perceived last; see
    `Forecast`.

    Returns:
        How many these are.
    """
    n = 0
    for i in range(count):
        if tracks.clock[i, MOVED] < tracks.clock[i, SEEN]:
            continue
        disc = tracks.disc[i]
        rate = tracks.changes[i] / (tracks.clock[i, SEEN] - tracks.clock[i, FIRST] + limits.patience)
        forecast(
            models, tracks.family[i], tracks.stiff[i], tracks.mean[i], tracks.cov[i], tracks.turn[i], tracks.turn_cov[i],
            tracks.osc[i], tracks.osc_cov[i], disc[0], disc[1], rate, limits.agree, limits.least, path[n], sigma[n],
            weight[n],
        )  # fmt: skip
        speed[n] = bounds.reach(disc, models.step, limits.speed, limits.acceleration, centre[n], reach[n])
        radius[n], identity[n], age[n] = tracks.size[i, 0], tracks.identity[i], t - tracks.clock[i, SEEN]
        n += 1
    return n
