"""Markers that have changed names: frames that no rigid body explains as they are, but do with two markers exchanged or
one or two left out."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.stats import chi2

from clearway.geometry.shapes import FloatArray
from clearway.recordings.rigid import Fit, Seen, fit

DOUBT, BELIEF = 1e-6, 1e-4
"""Share of sound frames whose residual is larger: beyond the first a frame is looked at, within the second a repair is
believed."""

UPRIGHT = 0.5
"""Cosine; a robot that leans by more than 60 degrees is a mirrored marker set: markers in one plane fit upside down."""

TURN, TURNS = 0.5, 3.0
"""rad, rad/s: a repair under which a body would have turned by more than the first, and faster than the second, since the
nearest sound frame is none: markers in a regular figure fit after a quarter turn as well."""

TRIED = 20_000
"""Frames on which every repair is tried; of more, only those that worked on a tenth of this, evenly over the capture."""

ROWS = 65_536
"""Fits at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Repaired:
    """Fits after the repair.

    Attributes:
        fit: of every frame. swapped: (n,) bool, two markers had each other's names. thinned: (n,) bool, markers were
        left out. refused: (n,) bool, nothing helped; their poses are NaN.
    """

    fit: Fit
    swapped: Seen
    thinned: Seen
    refused: Seen


@dataclass(frozen=True, slots=True, eq=False)
class _Fix:
    """Marker `order[i]` of the file is the body's i-th; those in `out` are not used."""

    order: Any
    out: tuple[int, ...]


def repair(t: FloatArray, xyz: FloatArray, model: FloatArray, done: Fit, noise: float, limit: float) -> Repaired:
    """Repair the fits `done` of `model` (m, 3) to `xyz` (n, m, 3) at the stamps t (n,) [s].

    A frame is doubtful if its residual is beyond what `noise` [m] explains, or the body stands on its head. Of the
    repairs that bring it back to the noise, near the heading of the nearest sound frame, the one that keeps most markers is taken, of these the best fit. What
    stays doubtful is kept if its rms residual is at most `limit` [m] and the body is upright, and refused otherwise.
    """
    n = len(xyz)
    rotation, translation = done.rotation.copy(), done.translation.copy()
    used, residual = done.used.copy(), done.residual.copy()
    swapped, thinned = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    strange = _strange(done, noise, DOUBT)
    doubtful = np.flatnonzero(strange)
    heading, turn = _expected(t, done, strange)
    fixes = _fixes(xyz.shape[1])
    if len(doubtful) > TRIED:
        sample = doubtful[np.linspace(0, len(doubtful) - 1, TRIED // 10).round().astype(int)]
        worked = np.unique(_best(xyz, model, used, sample, fixes, noise, heading, turn)[0])
        fixes = [fixes[i] for i in worked if i >= 0]
    if len(doubtful) and fixes:
        best, found = _best(xyz, model, used, doubtful, fixes, noise, heading, turn)
        good = best >= 0
        rows = doubtful[good]
        rotation[rows], translation[rows] = found.rotation[good], found.translation[good]
        used[rows], residual[rows] = found.used[good], found.residual[good]
        left_out = np.array([bool(f.out) for f in fixes])[best[good]]
        thinned[rows], swapped[rows] = left_out, ~left_out
    with np.errstate(invalid="ignore"):
        refused = (residual > limit) | (rotation[:, 2, 2] < UPRIGHT)
    rotation[refused], translation[refused], used[refused] = np.nan, np.nan, False
    residual[refused] = np.nan
    return Repaired(Fit(rotation, translation, used, residual), swapped & ~refused, thinned & ~refused, refused)


def _strange(done: Fit, noise: float, share: float) -> Seen:
    """Frames that `noise` doesn't explain: a larger residual has a share of them, or the body is not upright."""
    freedom = done.freedom
    largest = chi2.isf(share, np.arange(int(freedom.max(initial=0)) + 1))
    with np.errstate(invalid="ignore"):
        loud = done.squares > noise**2 * largest[freedom]
        return np.asarray((freedom > 0) & (loud | (done.rotation[:, 2, 2] < UPRIGHT)))


def _expected(t: FloatArray, done: Fit, strange: Seen) -> tuple[FloatArray, FloatArray]:
    """Of every frame the heading in the nearest sound one, and how far it may have turned since: (n,) rad each."""
    sound = np.flatnonzero(np.isfinite(done.residual) & ~strange)
    if not len(sound):
        return np.zeros(len(t)), np.full(len(t), np.inf)
    after = np.clip(np.searchsorted(t[sound], t), 0, len(sound) - 1)
    before = np.maximum(after - 1, 0)
    near = sound[np.where(t - t[sound[before]] < t[sound[after]] - t, before, after)]
    heading = np.arctan2(done.rotation[near, 1, 0], done.rotation[near, 0, 0])
    return heading, TURN + TURNS * np.abs(t - t[near])


def _fixes(m: int) -> list[_Fix]:
    """All exchanges of two, then all that leave out one, then two."""
    same = np.arange(m)
    found = []
    for i, j in combinations(range(m), 2):
        order = same.copy()
        order[i], order[j] = j, i
        found.append(_Fix(order, ()))
    found += [_Fix(same, (i,)) for i in range(m)]
    if 5 < m <= 16:
        found += [_Fix(same, pair) for pair in combinations(range(m), 2)]
    return found


def _best(
    xyz: FloatArray,
    model: FloatArray,
    used: Seen,
    rows: Any,
    fixes: list[_Fix],
    noise: float,
    heading: FloatArray,
    turn: FloatArray,
) -> tuple[Any, Fit]:
    """The index of the best of `fixes` for each of `rows` (-1: none helps) and the fits by it."""
    k, m = len(rows), xyz.shape[1]
    best = np.full(k, -1)
    rotation, translation = np.full((k, 3, 3), np.nan), np.full((k, 3), np.nan)
    chosen, residual = np.zeros((k, m), dtype=bool), np.full(k, np.nan)
    each = max(1, ROWS // max(len(fixes), 1))
    for start in range(0, k, each):
        some = rows[start : start + each]
        wide = np.concatenate([xyz[some][:, f.order] for f in fixes])
        use = np.concatenate([_without(used[some][:, f.order], f.out) for f in fixes])
        # an exchange of what isn't seen, or of one seen with one unseen, is a matter of its own: only pairs that are seen
        possible = np.concatenate([_seen(used[some], f) for f in fixes])
        done = fit(wide, model, use & possible[:, None])
        freedom = np.maximum(done.freedom, 1)
        price = done.squares / noise**2 / freedom + 1e6 * np.repeat([len(f.out) for f in fixes], len(some))
        off = np.arctan2(done.rotation[:, 1, 0], done.rotation[:, 0, 0]) - np.tile(heading[some], len(fixes))
        with np.errstate(invalid="ignore"):
            leapt = np.abs(np.remainder(off + np.pi, 2 * np.pi) - np.pi) > np.tile(turn[some], len(fixes))
        price[~np.isfinite(done.residual) | _strange(done, noise, BELIEF) | leapt] = np.inf
        table = price.reshape(len(fixes), len(some))
        winner = table.argmin(axis=0)
        here = np.arange(len(some))
        flat = winner * len(some) + here
        good = np.isfinite(table[winner, here])
        best[start : start + each] = np.where(good, winner, -1)
        rotation[start : start + each], translation[start : start + each] = (
            done.rotation[flat],
            done.translation[flat],
        )
        chosen[start : start + each], residual[start : start + each] = done.used[flat], done.residual[flat]
    return best, Fit(rotation, translation, chosen, residual)


def _without(use: Seen, out: tuple[int, ...]) -> Seen:
    use = use.copy()
    use[:, list(out)] = False
    return use


def _seen(use: Seen, fix: _Fix) -> Seen:
    """Whether all the markers that a fix touches are there."""
    touched = list(fix.out) or list(np.flatnonzero(fix.order != np.arange(len(fix.order))))
    return np.asarray(use[:, touched].all(axis=1))
