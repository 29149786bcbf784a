"""Puts two sources of one trial on one clock, by how fast the robot drove and turned in both.

First every shift is tried on a common grid: the agreement of two signals f, g is 2 sum(f g) / sum(f^2 + g^2) over the
time that both know, where motion of the one that the other doesn't cover counts as disagreement (of whichever source
has less of it, so that a short capture may lie within a long log). Then the shift is refined by least squares. What it
is worth is seen from blocks of a few seconds, which each pull it some way (a sandwich estimator over blocks): noise that
is correlated in time, and scale errors of an odometry, are in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from scipy.ndimage import uniform_filter1d

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.motion import Motion

GRID = 0.05
"""s; of the first search."""
FINE = 0.01
"""s; of the refinement, or the sampling of the faster source where that is coarser."""
ARM = 0.3
"""m; turning at omega weighs as driving at ARM * omega."""
MOVING, TURNING = 0.05, 0.1
"""m/s, rad/s; slower throughout is rest."""
OVERLAP = 3.0
"""s of common time that it takes at least."""
AGREEMENT = 0.7
"""Below, the two sources don't show the same drive."""
DOUBTFUL = 0.9
"""Below, the uncertainty of the offset isn't the whole of it: of a drone whose own estimate overshot and lagged the
speeds agreed by 0.81, and the offset was off by 0.4 s (docs/recordings-tried.md)."""
MARGIN = 0.07
"""By so much the best shift has to agree better than any other, farther off than its own peak."""
RIPPLE = 0.01
"""A rise of the agreement by less makes no other peak."""
VAGUE = 0.5
"""s; a standard uncertainty above this is no tie."""
SMOOTH = 0.25
"""s; over which slopes are smoothed."""
ALIKE = 0.3
"""Agreement of the slopes below which the robot's speed changed too little to tell noise from it."""
BLOCK = 2.0
"""s; stretches that are taken as independent."""
DRIFTED = 0.005
"""s; less drift over a trial isn't worth a word."""
HOLE = 0.2
"""s; samples farther apart than this, and than three usual steps, have a gap between them."""


@dataclass(frozen=True, slots=True)
class Offset:
    """Clock of b against a's.

    Attributes:
        seconds: What to add to b's stamps to have them on a's clock, s.
        sigma: Its standard uncertainty, s.
        correlation: Agreement of the two motions there, 1 if they are the same.
        note: How it was found, in a sentence.
        drift: Seconds that b's clock loses on a's per second; 0 if none was seen. `seconds` then holds in the middle,
            and `sigma` covers the ends.
    """

    seconds: float
    sigma: float
    correlation: float
    note: str
    drift: float = 0.0


def offset(a: Motion, b: Motion, *, within: tuple[float, float] | None = None) -> Offset:
    """What to add to b's stamps to have them on a's clock.

    Args:
        a: A motion of the robot, in a frame of its own.
        b: A motion of the same robot, in another.
        within: (least, most) s, if something is known beforehand.

    Raises:
        ClearwayError: one of them doesn't move, they have too little in common, they don't agree, or they agree at
            several shifts.
    """
    for name, motion in (("first", a), ("second", b)):
        _must_move(name, motion)
    channels = _channels(a, b)
    shift, agreement = _search(a, b, channels, within)
    seconds, sigma, drift, span = _refine(a, b, channels, shift)
    if not sigma < VAGUE:
        how = f", by {sigma:.2f} s" if math.isfinite(sigma) else ""
        raise ClearwayError(
            f"the clocks can't be tied by the motion: the robot changed its speed too little or too seldom, so that the "
            f"offset would be uncertain{how}; give the source's `clock` as a number or as `epoch`"
        )
    note = f"clock: {seconds:+.4f} s +- {sigma:.4f} s by its motion (agreement {agreement:.3f})"
    if agreement < DOUBTFUL:
        note += "; the two differ much: if what the robot believes lags behind, the lag is taken for its clock's"
    if drift:
        note += f"; the clocks drift apart by {abs(drift) * span * 1000:.0f} ms over {span:.0f} s"
    return Offset(seconds, sigma, agreement, note, drift)


def resample(motion: Motion, t: FloatArray) -> Motion:
    """`motion` at `t` (n,) s, increasing: linear between neighbouring samples, NaN in the gaps left open and outside.

    Between samples farther apart than `HOLE` and three usual steps lies a gap as well.
    """
    at = np.asarray(t, dtype=np.float64)
    sigma = None if motion.sigma is None else _linear(motion.t, motion.sigma, at)
    pose, velocity = _linear(motion.t, motion.pose, at), _linear(motion.t, motion.velocity, at)
    for gap in motion.quality.gaps:
        if not gap.filled:  # it may lie between two stamps, which a line would join
            pose[(at > gap.start) & (at < gap.end)] = np.nan
            velocity[(at > gap.start) & (at < gap.end)] = np.nan
    rate = 1 / float(np.median(np.diff(at))) if len(at) > 1 else motion.quality.rate
    quality = replace(motion.quality, rate=rate)
    return replace(motion, t=at, pose=pose, velocity=velocity, sigma=sigma, quality=quality, residual=None)


def _linear(t: FloatArray, values: FloatArray, at: FloatArray) -> Any:
    if len(t) == 0:
        return np.full((len(at), *values.shape[1:]), np.nan)
    if len(t) == 1:
        return np.where((at == t[0])[:, None], values[0], np.nan)
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    step = t[i + 1] - t[i]
    share = (at - t[i]) / step
    hole = (step > HOLE) & (step > 3 * float(np.median(np.diff(t))))
    bad = (share < 0) | (share > 1) | (hole & (share > 0) & (share < 1))
    share = share[:, None]
    low, high = values[i], values[i + 1]
    # a sample that is hit exactly needs no neighbour
    mixed = np.where(share <= 0, low, np.where(share >= 1, high, low + share * (high - low)))
    return np.where(bad[:, None], np.nan, mixed)


def _must_move(name: str, motion: Motion) -> None:
    v, omega = np.abs(motion.velocity).T
    moving = (np.nan_to_num(v) > MOVING) | (np.nan_to_num(omega) > TURNING)
    if np.count_nonzero(moving) < max(3, 0.5 * motion.quality.rate):
        fastest = float(np.nan_to_num(v).max(initial=0.0))
        raise ClearwayError(
            f"the {name} source shows the robot at rest (fastest {fastest:.3f} m/s); the clocks can't be tied by its motion; "
            "give the source's `clock` as a number or as `epoch`"
        )


def _channels(a: Motion, b: Motion) -> list[int]:
    """What both know: 0 speed, 1 yaw rate."""
    known = [c for c in (0, 1) if all(np.isfinite(m.velocity[:, c]).any() for m in (a, b))]
    if 1 in known:
        strongest = [float(np.nanpercentile(np.abs(m.velocity[:, 1]), 99)) for m in (a, b)]
        if min(strongest) < TURNING:
            known.remove(1)
    if not known:
        raise ClearwayError("the two sources know no speed in common; the clocks can't be tied by the motion")
    return known


def _signal(motion: Motion, channel: int, at: FloatArray) -> Any:
    """(n,) m/s at `at`, NaN where unknown; what is far faster than the usual fastest is a spike."""
    v = motion.velocity[:, channel]
    v = np.abs(v) if channel == 0 else ARM * v
    top = 1.5 * float(np.nanpercentile(np.abs(v), 98)) + 1e-12
    return _linear(motion.t, np.clip(v, -top, top)[:, None], at)[:, 0]


def _grid(motion: Motion, step: float) -> FloatArray:
    return np.arange(motion.t[0], motion.t[-1] + 1e-9, step)


def _search(a: Motion, b: Motion, channels: list[int], within: tuple[float, float] | None) -> tuple[float, float]:
    """The shift of best agreement on the grid, and that agreement."""
    ta, tb = _grid(a, GRID), _grid(b, GRID)
    both: list[Any] = [0.0] * 4
    total_a = total_b = 0.0
    turning = None
    common: Any = 0.0
    for c in channels:
        f, g = _signal(a, c, ta), _signal(b, c, tb)
        know_f, know_g = np.isfinite(f), np.isfinite(g)
        f, g = np.where(know_f, f, 0.0), np.where(know_g, g, 0.0)
        product = _slide(f, g)
        if c == 1:
            turning = product
        for k, term in enumerate((product, _slide(f * f, 1.0 * know_g), _slide(1.0 * know_f, g * g))):
            both[k] = both[k] + term
        common = np.maximum(common, _slide(1.0 * know_f, 1.0 * know_g) * GRID)
        total_a, total_b = total_a + float((f * f).sum()), total_b + float((g * g).sum())
    product, in_a, in_b = both[:3]
    uncovered = 2 * np.minimum(total_a - in_a, total_b - in_b)
    agreement = 2 * product / np.maximum(in_a + in_b + uncovered, 1e-12)
    # entry k: b's first sample falls on a's sample k - (len(tb) - 1)
    shifts = (np.arange(len(agreement)) - (len(tb) - 1)) * GRID + ta[0] - tb[0]
    usable = common >= OVERLAP - 1e-6
    if within is not None:
        usable &= (shifts >= within[0] - GRID) & (shifts <= within[1] + GRID)
    if not usable.any():
        raise ClearwayError(
            f"the two sources can't have {OVERLAP:g} s in common"
            + (f" with an offset from {within[0]:g} s to {within[1]:g} s" if within else "")
            + f": they last {a.t[-1] - a.t[0]:.1f} s and {b.t[-1] - b.t[0]:.1f} s"
        )
    agreement = np.where(usable, agreement, -1.0)
    best = int(np.argmax(agreement))
    peak = float(agreement[best])
    if turning is not None and turning[best] < -0.5 * float(np.abs(turning).max()) and turning[best] < 0:
        raise ClearwayError(
            "the two sources turn opposite ways while their speeds agree: the frame of one is left-handed, or Y-up and "
            "read as Z-up"
        )
    if peak < AGREEMENT:
        raise ClearwayError(
            f"the two sources don't show the same drive: at best, at {shifts[best]:+.2f} s, their speeds agree by {peak:.2f} "
            f"(1: the same; {AGREEMENT} are needed); are they of one trial?"
        )
    _must_be_alone(shifts, agreement, best)
    return _vertex(shifts, agreement, best), peak


def _must_be_alone(shifts: FloatArray, agreement: FloatArray, best: int) -> None:
    peak = float(agreement[best])
    rest = agreement.copy()
    rest[best - _fall(agreement[best::-1]) : best + _fall(agreement[best:]) + 1] = -1.0
    other = int(np.argmax(rest))
    if rest[other] > peak - MARGIN:
        raise ClearwayError(
            f"the clocks can't be tied by the motion, which repeats itself: the sources agree at {shifts[best]:+.2f} s "
            f"({peak:.3f}) and at {shifts[other]:+.2f} s ({rest[other]:.3f}); give the source's `clock` as a number or "
            "as `epoch`"
        )


def _fall(agreement: FloatArray) -> int:
    """Entries down the side of a peak, until it rises again."""
    rises = np.flatnonzero(agreement > np.minimum.accumulate(agreement) + RIPPLE)
    return int(rises[0]) - 1 if len(rises) else len(agreement) - 1


def _slide(f: Any, g: Any) -> Any:
    """(len(f) + len(g) - 1,) sum_i f[i + k] g[i] for k from 1 - len(g)."""
    return scipy.signal.fftconvolve(f, g[::-1])


def _vertex(x: FloatArray, y: FloatArray, i: int) -> float:
    """Where the parabola through three neighbours peaks."""
    if not 0 < i < len(y) - 1 or min(y[i - 1], y[i + 1]) < 0:
        return float(x[i])
    curve = y[i - 1] - 2 * y[i] + y[i + 1]
    return float(x[i] + (0.0 if curve >= 0 else 0.5 * (y[i - 1] - y[i + 1]) / curve * (x[i + 1] - x[i])))


def _refine(a: Motion, b: Motion, channels: list[int], shift: float) -> tuple[float, float, float, float]:
    """Offset, its uncertainty, drift (0 unless seen), and the time in common.

    Least squares in the shift with a scale of each channel. What noise does to the slopes must not count as knowledge:
    residuals are weighed by smoothed slopes, and unless those of both sources agree, nothing is known.
    """
    usual = min(float(np.median(np.diff(m.t))) for m in (a, b))
    step = max(FINE, min(usual, GRID))
    at = _grid(a, step)
    f = np.array([_signal(a, c, at) for c in channels])
    pull = power = np.zeros(0)
    alike = 0.0
    for _ in range(20):
        g = np.array([_signal(b, c, at - shift) for c in channels])
        gap = ~(np.isfinite(f) & np.isfinite(g))
        scale = np.where(gap, 0.0, f * g).sum(axis=1) / np.maximum(np.where(gap, 0.0, g * g).sum(axis=1), 1e-12)
        g *= scale[:, None]
        steep_f, steep_g = np.gradient(f, step, axis=1), np.gradient(g, step, axis=1)
        gap |= ~(np.isfinite(steep_f) & np.isfinite(steep_g))
        steep_f, steep_g = np.where(gap, 0.0, steep_f), np.where(gap, 0.0, steep_g)
        smooth_f, smooth_g = _smooth(steep_f, step), _smooth(steep_g, step)
        slope = 0.5 * (smooth_f + smooth_g)
        # f(t) = g(t - shift): too small a shift leaves f - g = -error * slope
        pull = np.where(gap, 0.0, -(f - g) * slope).sum(axis=0)
        power = (0.5 * (steep_f + steep_g) * slope).sum(axis=0)
        alike = 2 * float((smooth_f * smooth_g).sum()) / max(float((smooth_f**2 + smooth_g**2).sum()), 1e-12)
        if not power.sum() > 0:
            return shift, math.inf, 0.0, 0.0
        move = float(np.clip(pull.sum() / power.sum(), -GRID, GRID))
        shift += move
        if abs(move) < 1e-7:
            break
    if alike < ALIKE:
        return shift, math.inf, 0.0, 0.0
    first = np.arange(0, len(at), max(1, round(BLOCK / step)))
    pulls, powers = np.add.reduceat(pull, first), np.maximum(np.add.reduceat(power, first), 0.0)
    sigma = _sandwich(pulls, powers)
    known = at[np.isfinite(f).any(axis=0) & np.isfinite(g).any(axis=0)]
    span = float(known[-1] - known[0])
    drift = _drift(pulls, powers, at[first] + BLOCK / 2)
    if drift:
        sigma = math.hypot(sigma, drift * span / math.sqrt(12))
    return shift, max(sigma, 0.02 * usual), drift, span


def _smooth(values: Any, step: float) -> Any:
    return uniform_filter1d(values, max(1, round(SMOOTH / step)), axis=1, mode="constant")


def _sandwich(pulls: Any, powers: Any) -> float:
    """Standard uncertainty of sum(pulls) / sum(powers), whose blocks are independent; widened where few of them count."""
    total = float(powers.sum())
    effective = total**2 / float((powers**2).sum())
    if effective < 1.5:
        return math.inf
    residual = pulls - powers * (pulls.sum() / total)
    sigma = math.sqrt(float((residual**2).sum()) * effective / (effective - 1)) / total
    return sigma * float(scipy.stats.t.ppf(0.975, effective - 1)) / 1.96


def _drift(pulls: Any, powers: Any, at: FloatArray) -> float:
    """Slope of the blocks' own offsets over time, if it is beyond doubt; weighted by what they know."""
    use = powers > 0.01 * powers.max()
    if np.count_nonzero(use) < 10:
        return 0.0
    own, w, x = pulls[use] / powers[use], powers[use], at[use]
    x = x - np.average(x, weights=w)
    slope = float((w * x * own).sum() / (w * x * x).sum())
    residual = own - np.average(own, weights=w) - slope * x
    freedom = np.count_nonzero(use) - 2
    error = math.sqrt(float(((w * x * residual) ** 2).sum()) * (freedom + 2) / freedom) / float((w * x * x).sum())
    beyond = abs(slope) > float(scipy.stats.t.ppf(0.9995, freedom)) * error
    return slope if beyond and abs(slope) * float(np.ptp(x)) > DRIFTED else 0.0
