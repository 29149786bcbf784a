"""Markers that have changed names: frames that no rigid body explains as they are, but do with two markers exchanged or
one or two left out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import scipy

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.rigid import Fit, Seen, fit

DOUBT, BELIEF = 1e-6, 1e-4
"""Share of sound frames whose residual is larger: beyond the first a frame is looked at, within the second a repair is
believed."""

UPRIGHT = 0.5
"""Cosine; a robot that leans by more than 60 degrees is a mirrored marker set: markers in one plane fit upside down."""

TURN, TURNS, FARTHEST_TURN = 0.5, 3.0, 1.0
"""rad, rad/s, rad: a repair under which a body would have turned, since the last frame that is believed, by more than the
first and the second times the time between, or than the third, is none: markers in a regular figure fit after a quarter
turn as well."""

TRIED = 1_000_000
"""Fits that may be tried; where every repair of every doubtful frame would be more, a third of it goes to frames evenly over
the capture, and of all frames only what worked on these is tried."""

ROWS = 65_536
"""Fits at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Repaired:
    """Fits after the repair.

    Attributes:
        fit: The fit of every frame.
        swapped: (n,) whether two markers had each other's names.
        thinned: (n,) whether markers were left out.
        refused: (n,) whether nothing helped; these poses are NaN.
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

    @property
    def left_out(self) -> Seen:
        """(m,) which markers are not used."""
        return np.isin(np.arange(len(self.order)), self.out)


def repair(t: FloatArray, xyz: FloatArray, model: FloatArray, done: Fit, noise: float, limit: float) -> Repaired:
    """Repair the fits `done` of `model` (m, 3) to `xyz` (n, m, 3) at the stamps t (n,) [s].

    A frame is doubtful if its residual is beyond what `noise` [m] explains, or the body stands on its head. Of the
    repairs that bring it back to the noise, going on from the heading of the last believed frame, the one that keeps most markers is taken, of these the best fit. What
    stays doubtful is kept if its rms residual is at most `limit` [m] and the body is upright, and refused otherwise.
    """
    n = len(xyz)
    rotation, translation = done.rotation.copy(), done.translation.copy()
    used, residual = done.used.copy(), done.residual.copy()
    swapped, thinned = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    strange = _strange(done, noise, DOUBT)
    doubtful = np.flatnonzero(strange)
    fixes = _fixes(xyz.shape[1])
    if len(doubtful) * len(fixes) > TRIED:
        count = max(50, TRIED // 3 // len(fixes))
        sample = doubtful[np.linspace(0, len(doubtful) - 1, count).round().astype(int)]
        worked = np.unique(_options(xyz, model, used, sample, fixes, noise).fix)
        fixes = [fixes[i] for i in worked]
    if len(doubtful) and fixes:
        rows, chosen = _chosen(t, done, strange, _options(xyz, model, used, doubtful, fixes, noise))
        order = np.array([f.order for f in fixes])[chosen]
        use = np.take_along_axis(used[rows], order, axis=1) & ~np.array([f.left_out for f in fixes])[chosen]
        found = fit(np.take_along_axis(xyz[rows], order[:, :, None], axis=1), model, use)
        rotation[rows], translation[rows] = found.rotation, found.translation
        used[rows], residual[rows] = found.used, found.residual
        thinned[rows] = np.array([bool(f.out) for f in fixes])[chosen]
        swapped[rows] = ~thinned[rows]
    with np.errstate(invalid="ignore"):
        refused = (residual > limit) | (rotation[:, 2, 2] < UPRIGHT)
    rotation[refused], translation[refused], used[refused] = np.nan, np.nan, False
    residual[refused] = np.nan
    return Repaired(Fit(rotation, translation, used, residual), swapped & ~refused, thinned & ~refused, refused)


def _strange(done: Fit, noise: float, share: float) -> Seen:
    """Frames that `noise` doesn't explain: a larger residual has a share of them, or the body is not upright."""
    freedom = done.freedom
    largest = scipy.stats.chi2.isf(share, np.arange(int(freedom.max(initial=0)) + 1))
    with np.errstate(invalid="ignore"):
        loud = done.squares > noise**2 * largest[freedom]
        return np.asarray((freedom > 0) & (loud | (done.rotation[:, 2, 2] < UPRIGHT)))


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


@dataclass(frozen=True, slots=True, eq=False)
class _Options:
    """Repairs that explain a frame: row, fix (k,) int, by row and then from the best; heading (k,) rad."""

    row: Any
    fix: Any
    heading: FloatArray


def _options(xyz: FloatArray, model: FloatArray, used: Seen, rows: Any, fixes: list[_Fix], noise: float) -> _Options:
    out = np.array([len(f.out) for f in fixes])
    found: list[tuple[Any, ...]] = []
    each = max(1, ROWS // len(fixes))
    for start in range(0, len(rows), each):
        some = rows[start : start + each]
        wide = np.concatenate([xyz[some][:, f.order] for f in fixes])
        # markers that aren't seen can't be exchanged or left out
        use = np.concatenate([used[some][:, f.order] & ~f.left_out & _seen(used[some], f)[:, None] for f in fixes])
        done = fit(wide, model, use)
        good = np.flatnonzero(np.isfinite(done.residual) & ~_strange(done, noise, BELIEF))
        fix, row = np.divmod(good, len(some))
        price = done.squares[good] / np.maximum(done.freedom[good], 1)
        heading = np.arctan2(done.rotation[good, 1, 0], done.rotation[good, 0, 0])
        by = np.lexsort((price, out[fix], row))
        found.append((some[row[by]], fix[by], heading[by]))
    if not found:
        return _Options(np.empty(0, dtype=int), np.empty(0, dtype=int), np.empty(0))
    return _Options(*(np.concatenate(column) for column in zip(*found, strict=True)))


def _chosen(t: FloatArray, done: Fit, strange: Seen, options: _Options) -> tuple[Any, Any]:
    """Of each frame the best option that goes on from the last believed one: rows and fixes (k,) int."""
    sound = np.flatnonzero(np.isfinite(done.residual) & ~strange)
    facing = np.arctan2(done.rotation[sound, 1, 0], done.rotation[sound, 0, 0])
    last = np.searchsorted(sound, options.row) - 1
    when, where = (t[sound[last]], facing[last]) if len(sound) else (np.full(len(last), -np.inf), np.zeros(len(last)))
    rows, fixes = [], []
    believed, heading, taken = -math.inf, 0.0, -1
    now = t[options.row]
    for i, (row, turned) in enumerate(zip(options.row.tolist(), options.heading.tolist(), strict=True)):
        if row == taken:
            continue
        if last[i] >= 0 and when[i] > believed:
            believed, heading = float(when[i]), float(where[i])
        elif believed == -math.inf and len(sound):  # none before: the first one after
            heading = float(facing[0])
        known = len(sound) > 0 or believed > -math.inf
        most = min(TURN + TURNS * (float(now[i]) - believed), FARTHEST_TURN)
        if not known or abs(math.remainder(turned - heading, 2 * math.pi)) <= most:
            rows.append(row)
            fixes.append(int(options.fix[i]))
            believed, heading, taken = float(now[i]), turned, row
    return np.array(rows, dtype=int), np.array(fixes, dtype=int)


def _seen(use: Seen, fix: _Fix) -> Seen:
    """Whether all the markers that a fix touches are there."""
    touched = list(fix.out) or list(np.flatnonzero(fix.order != np.arange(len(fix.order))))
    return np.asarray(use[:, touched].all(axis=1))
