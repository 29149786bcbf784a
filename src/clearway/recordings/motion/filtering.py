"""Noise out of a pose without lag: zero-phase low-pass, its cut-off by residual analysis, rest, velocity, what noise is left.

Sources: D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, section 3.4.4 (two passes of a
second-order Butterworth, the correction of its cut-off, residual analysis).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import scipy
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.gaps import runs, usual_step

LOWEST, HIGHEST = 3.0, 20.0
"""Hz; what residual analysis may choose. Below, starts and stops of a robot at 1 m/s^2 would be smeared by millimetres."""

DEFAULT = 6.0
"""Hz; where nothing moves, or too little is there to analyse."""

ANALYSED = 200_000
"""Samples that residual analysis looks at, at most."""

REST = (0.5, 1.0, 2.0)
"""s; window that a slope is taken over to see whether a body rests, and the shortest rest: the shortest that noise lets
tell."""

CERTAIN = 4.5
"""Standard deviations of the slope beyond which it is motion."""

SLOWEST = (0.0005, 0.001)
"""m/s, rad/s: slower is rest, however quiet the measurement."""

BLUR = (0.01, 0.03)
"""m/s, rad/s: where noise alone looks faster than this, nothing is said about rest."""

CREEP = (0.001, 0.002)
"""m, rad: a rest over which a body drifts by more, and more than noise explains, is none."""


def coefficients(cutoff: float, rate: float) -> FloatArray:
    """Second-order sections of one pass, such that two of them (forward, backward) halve the power at `cutoff` [Hz].

    Winter's correction, (2^(1/2) - 1)^(1/4) = 0.802, is applied to the pre-warped frequency, where it is exact.
    """
    k = math.tan(math.pi * cutoff / rate) / (math.sqrt(2) - 1) ** 0.25
    scale = 1 + math.sqrt(2) * k + k * k  # the bilinear transform of 1 / (s^2 + sqrt(2) s + 1)
    b = k * k / scale
    return np.array([[b, 2 * b, b, 1.0, 2 * (k * k - 1) / scale, (1 - math.sqrt(2) * k + k * k) / scale]])


def highest(rate: float) -> float:
    """The highest cut-off [Hz] that makes sense at a rate [Hz]: 0.4 of it."""
    return 0.4 * rate


def lowpass(x: FloatArray, cutoff: float, rate: float) -> FloatArray:
    """`x` (n, d), sampled evenly at `rate` [Hz], through the zero-phase filter. n below 4: as it is.

    Ends are continued by point reflection in a line through the last samples, so that neither a body at rest nor one
    in steady motion is bent there.
    """
    n = len(x)
    if n < 4 or cutoff >= highest(rate) * (1 + 1e-9):
        return x.copy()
    sos = coefficients(cutoff, rate)
    pad = min(n - 1, max(6, math.ceil(3 * rate / cutoff)))
    near = min(n, max(3, round(rate / cutoff / 3)))
    head, tail = _end(x[:near]), _end(x[: -near - 1 : -1])
    whole = np.concatenate((2 * head - x[pad:0:-1], x, 2 * tail - x[-2 : -pad - 2 : -1]))
    start = np.array([[1 - sos[0, 0], sos[0, 2] - sos[0, 5]]])[:, :, None]  # as after a long time at 1
    for _ in range(2):
        whole = scipy.signal.sosfilt(sos, whole, axis=0, zi=start * whole[0])[0][::-1]
    return np.ascontiguousarray(whole[pad : pad + n])


def _end(x: FloatArray) -> FloatArray:
    """The value (d,) at the first sample of the line through `x` (k, d)."""
    s = np.arange(len(x)) - (len(x) - 1) / 2
    slope = s @ x / (s @ s)
    return np.asarray(x.mean(axis=0) + slope * s[0])


def even(t: FloatArray) -> bool:
    """Whether stamps are evenly spaced, but for rounding and jitter of a twentieth of the step."""
    if len(t) < 3:
        return True
    ideal = np.linspace(t[0], t[-1], len(t))
    return bool(np.abs(t - ideal).max() <= 0.05 * (t[-1] - t[0]) / (len(t) - 1))


def smooth(t: FloatArray, x: FloatArray, cutoff: float) -> FloatArray:
    """`x` (n, d) at the stamps t [s], low-passed; uneven stamps go by way of an even grid of the usual step."""
    n = len(t)
    if n < 4:
        return x.copy()
    if even(t):
        return lowpass(x, cutoff, (n - 1) / (t[-1] - t[0]))
    count = int(min(math.ceil((t[-1] - t[0]) / usual_step(t)), 4 * n)) + 1
    grid = np.linspace(t[0], t[-1], max(count, 4))
    between = np.stack([np.interp(grid, t, column) for column in x.T], axis=1)
    clean = lowpass(between, cutoff, (len(grid) - 1) / (t[-1] - t[0]))
    return np.asarray(CubicSpline(grid, clean)(t))


def gain(n: int, cutoff: float, rate: float, correlation: float = 0.0) -> FloatArray:
    """Share of the noise's variance that the low-pass leaves in each of n samples: (n,), more towards the ends.

    Exact: the filter is a matrix, and the noise's covariance falls by `correlation` (of neighbours) a sample.
    """
    if n < 4 or cutoff >= highest(rate) * (1 + 1e-9):
        return np.ones(n)
    share = _share_left(min(n, 512, max(8, math.ceil(6 * rate / cutoff))), cutoff, rate, correlation)
    length = len(share)
    out = np.full(n, share[length // 2])
    half = (length + 1) // 2
    out[:half], out[n - half :] = share[:half], share[length - half :]
    return np.asarray(np.minimum(out, 1.0))


@lru_cache(maxsize=64)
def _share_left(length: int, cutoff: float, rate: float, correlation: float) -> FloatArray:
    """(length,) as `gain`, of a stretch of that length.

    The product with the noise's covariance is taken by recursion: as a product of matrices it is the only one here that
    wakes the threads of a BLAS, which wait for each other for seconds where the cores are busy.
    """
    matrix = lowpass(np.eye(length), cutoff, rate)
    spread = matrix
    if correlation > 0:
        before = scipy.signal.lfilter([1.0], [1.0, -correlation], matrix, axis=1)
        after = scipy.signal.lfilter([1.0], [1.0, -correlation], matrix[:, ::-1], axis=1)[:, ::-1]
        spread = before + after - matrix
    share: FloatArray = (spread * matrix).sum(axis=1)
    share.flags.writeable = False
    return share


@dataclass(frozen=True, slots=True)
class Analysis:
    """What residual analysis found.

    Attributes:
        cutoff: The cut-off, Hz.
        noise: Standard deviation of the noise, in the signal's unit; None where it could not be told.
    """

    cutoff: float
    noise: float | None


def residual_analysis(parts: Sequence[tuple[FloatArray, Any]], rate: float, correlation: float = 0.0) -> Analysis:
    """The cut-off that leaves the least error, by what the filter takes away at different ones.

    Winter reads the noise off the straight part of the residual over cut-off, by eye, and takes the cut-off at which
    as much signal is lost as noise is left. Here the residual of the noise is known exactly (from the filter and the
    noise's `correlation`: taken for white, noise that lasts would pass for motion) and is scaled to the residuals in the upper half of the band, where there is nothing but noise; what the residual has
    beyond it is lost signal; and the cut-off is chosen at which lost signal and noise left are least together (Stein
    1981, Ann. Statist. 9(6): the estimate of that sum is unbiased), within 2 to 20 Hz.

    Args:
        parts: Stretches without a break, each a signal (n, d) and a mask (n,) of the samples that count (that move).
    """
    top = min(highest(rate), HIGHEST)
    level = tail_noise(parts, rate, correlation)
    if level is None or top <= LOWEST:
        return Analysis(DEFAULT, level)
    long = _long(parts, rate)

    def risk(cutoff: float) -> float:
        taken, kept = _shares(cutoff, rate, correlation)
        return _left(long, cutoff, rate) ** 2 + level**2 * (kept - taken)

    tried = np.geomspace(LOWEST, top, 11)
    best = int(np.argmin([risk(float(f)) for f in tried]))
    near = np.geomspace(tried[max(best - 1, 0)], tried[min(best + 1, 10)], 7)
    return Analysis(float(near[int(np.argmin([risk(float(f)) for f in near]))]), level)


def _long(parts: Sequence[tuple[FloatArray, Any]], rate: float) -> list[tuple[FloatArray, Any]]:
    """Those that are longer than the ends' influence, and move."""
    return [(x, m) for x, m in parts if len(x) > 3 * rate / LOWEST and m.any()]


def tail_noise(parts: Sequence[tuple[FloatArray, Any]], rate: float, correlation: float = 0.0) -> float | None:
    """Standard deviation of noise of that correlation that explains the upper half of the band, None where nothing moves for long."""
    if rate <= 0 or not (long := _long(parts, rate)):
        return None
    tail = np.linspace(0.25, 0.39, 5) * rate
    return float(
        np.median([_left(long, float(f), rate) / math.sqrt(_shares(float(f), rate, correlation)[0]) for f in tail])
    )


def _left(parts: Sequence[tuple[FloatArray, Any]], cutoff: float, rate: float) -> float:
    """Rms of what the filter takes away, over the samples that count."""
    total, count = 0.0, 0
    for x, mask in parts:
        total += float(((x - lowpass(x, cutoff, rate))[mask] ** 2).sum())
        count += int(mask.sum()) * x.shape[1]
        if count > ANALYSED:
            break
    return math.sqrt(total / count)


@lru_cache(maxsize=256)
def _shares(cutoff: float, rate: float, correlation: float) -> tuple[float, float]:
    """Share of the variance of noise that the filter takes away, and that it keeps, far from the ends."""
    length = 2 * math.ceil(3 * rate / cutoff) + 1
    impulse = np.zeros((length, 1))
    impulse[length // 2] = 1.0
    answer = lowpass(impulse, cutoff, rate)
    like = correlation ** np.abs(np.arange(1 - length, length)) if correlation > 0 else None

    def power(response: FloatArray) -> float:
        if like is None:
            return float(response @ response)
        return float(scipy.signal.fftconvolve(response, response[::-1]) @ like)

    return power((impulse - answer)[:, 0]), power(answer[:, 0])


def distortion(
    parts: Sequence[tuple[FloatArray, Any]],
    cutoff: float,
    rate: float,
    noise: float | None,
    correlation: float = 0.0,
) -> float:
    """Variance of the motion itself that the filter takes away: what is left over of the residual beyond the noise's."""
    long = _long(parts, rate)
    if noise is None or not long or cutoff >= highest(rate):
        return 0.0
    return max(0.0, _left(long, cutoff, rate) ** 2 - noise**2 * _shares(cutoff, rate, correlation)[0])


def jitter(x: FloatArray) -> float:
    """Standard deviation of the white noise on a smooth signal (n, d), from third differences (median, robust)."""
    if len(x) < 8:
        return 0.0
    third = np.diff(x, 3, axis=0)
    return float(1.4826 * np.median(np.abs(third)) / math.sqrt(20.0))


def at_rest(t: FloatArray, pose: FloatArray, noise: FloatArray, correlation: float = 0.0) -> Any:
    """Where a body rests, for half a second at least (longer if noise is large): (k, 2) int, first and one past the last.

    A regression line over that time around each sample is level but for noise, in x, y and heading, and over the
    whole rest the body doesn't creep by more than 1 mm and noise explains.

    Args:
        t: (n,) s, a stretch without a break.
        pose: (n, 2 or 3).
        noise: (2,) of position [m] and heading [rad].
    """
    n = len(t)
    if n < 8:
        return np.empty((0, 2), dtype=int)
    grown = math.sqrt((1 + correlation) / (1 - correlation))
    rate = (n - 1) / (t[-1] - t[0])
    blur = [CERTAIN * grown * sigma / most for sigma, most in zip(noise, BLUR, strict=True)]
    rest = next((w for w in REST if max(blur) <= math.sqrt(rate * w**3 / 12)), REST[-1])
    if t[-1] - t[0] < rest:
        return np.empty((0, 2), dtype=int)
    first, last = np.searchsorted(t, t - rest / 2 - 1e-9), np.searchsorted(t, t + rest / 2 + 1e-9)
    whole = (t - rest / 2 >= t[0] - 1e-9) & (t + rest / 2 <= t[-1] + 1e-9) & (last - first >= 4)
    s = t - t[n // 2]
    count = np.maximum(last - first, 1)
    st, stt = _windowed(s, first, last), _windowed(s * s, first, last)
    sxx = np.maximum(stt - st * st / count, 1e-12)
    slope = np.empty_like(pose)
    for i, column in enumerate((pose - pose[n // 2]).T):
        slope[:, i] = (_windowed(column * s, first, last) - st * _windowed(column, first, last) / count) / sxx
    still = whole.copy()
    speed = (np.hypot(slope[:, 0], slope[:, 1]), *(np.abs(c) for c in slope[:, 2:].T))
    for value, sigma, least, most in zip(speed, noise, SLOWEST, BLUR, strict=False):
        limit = np.maximum(CERTAIN * grown * sigma / np.sqrt(sxx), least)
        still &= (value <= limit) & (limit <= most)
    found = [(a, b) for a, b in runs(still) if t[b - 1] - t[a] >= rest and _stays(t[a:b], pose[a:b], noise * grown)]
    if still.any():  # the half windows at the ends of the stretch rest as their neighbours do
        found = [(0 if whole[:a].sum() == 0 else a, n if whole[b:].sum() == 0 else b) for a, b in found]
        found = [(a, b) for a, b in found if _stays(t[a:b], pose[a:b], noise * grown)]
    return np.array(found, dtype=int).reshape(-1, 2)


def _windowed(x: FloatArray, first: Any, last: Any) -> FloatArray:
    total = np.concatenate(([0.0], np.cumsum(x)))
    return np.asarray(total[last] - total[first])


def _stays(t: FloatArray, pose: FloatArray, noise: FloatArray) -> bool:
    s = t - t.mean()
    square = float(s @ s)
    drift = np.abs(s @ (pose - pose.mean(axis=0))) / square * (t[-1] - t[0])
    drifts = (math.hypot(*drift[:2]), *drift[2:])
    unsure = CERTAIN * noise / math.sqrt(square) * (t[-1] - t[0])
    return all(d <= max(u, c) for d, u, c in zip(drifts, unsure, CREEP, strict=False))


def averaged(x: FloatArray, t: FloatArray, window: float) -> FloatArray:
    """`x` (n,) averaged over about `window` [s]."""
    step = usual_step(t)
    size = max(1, round(window / step)) if step else 1
    return np.asarray(uniform_filter1d(x, min(size, max(len(x), 1)), mode="nearest"))


def velocity(t: FloatArray, pose: FloatArray) -> FloatArray:
    """(n, 2) v along the body's x [m/s], omega [rad/s] of a smooth stretch: the derivatives of the cubic spline through
    it, which lag nothing. With two columns (no heading), v = |dp/dt| and omega is NaN. A single sample: NaN."""
    out = np.full((len(t), 2), np.nan)
    if len(t) < 2:
        return out
    rate = CubicSpline(t, pose)(t, 1) if len(t) > 3 else np.gradient(pose, t, axis=0)
    if pose.shape[1] == 2:
        out[:, 0] = np.hypot(rate[:, 0], rate[:, 1])
    else:
        out[:, 0] = rate[:, 0] * np.cos(pose[:, 2]) + rate[:, 1] * np.sin(pose[:, 2])
        out[:, 1] = rate[:, 2]
    return out
