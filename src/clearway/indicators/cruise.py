"""TCS, time at cruise speed: the share of CT that the robot moves at its set speed.

Paper A leaves "at its cruise speed" open: here within a band of 10 % of the set speed, for at least 0.2 s at a
stretch; 5 % and 20 % stand beside it to show how much the choice matters.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.indicators.column import Kind
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import finished, ground_speed, speed, speed_limit
from clearway.trials import Trial

DWELL = 0.2
"""s; a shorter stretch within the band does not count."""
BAND = 0.10
"""Share of the set speed that the headline's band extends to either side."""


def time_within(t: FloatArray, v: FloatArray, low: float, high: float, dwell: float = DWELL) -> float:
    """Seconds for which v, linear between samples, lies in [low, high], in stretches of at least `dwell`.

    Args:
        t: (n,) s, increasing.
        v: (n,) same unit as low and high.
    """
    low, high = low - 1e-9, high + 1e-9
    rise = np.diff(v)
    flat = np.abs(rise) < 1e-12
    slope = np.where(flat, 1.0, rise)
    at_low, at_high = (low - v[:-1]) / slope, (high - v[:-1]) / slope
    inside = (v[:-1] >= low) & (v[:-1] <= high)
    enter = np.where(flat, 0.0, np.clip(np.minimum(at_low, at_high), 0.0, 1.0))
    leave = np.where(flat, np.where(inside, 1.0, 0.0), np.clip(np.maximum(at_low, at_high), 0.0, 1.0))
    within = leave > enter
    step = np.diff(t)
    begin, end = (t[:-1] + enter * step)[within], (t[:-1] + leave * step)[within]
    if not len(begin):
        return 0.0
    apart = np.flatnonzero(begin[1:] - end[:-1] > 1e-9)
    begins, ends = begin[np.r_[0, apart + 1]], end[np.r_[apart, len(end) - 1]]
    stretch = ends - begins
    return float(stretch[stretch >= dwell - 1e-9].sum())


def time_at_cruise_speed(band: float) -> Measure:
    """TCS with a band of `band` times the set speed, %."""

    @measure
    def tcs(trial: Trial) -> float:
        limit = speed_limit(trial)
        drives = finished(trial)
        took = sum(d.span.end - d.span.start for d in drives)
        if took <= 0.0:
            raise NotComputable("the legs took no time")
        return 100.0 * sum(time_within(d.t, speed(d), (1 - band) * limit, (1 + band) * limit) for d in drives) / took

    return tcs


def bounds(trial: Trial) -> tuple[float, float] | None:
    """Between what two shares TCS of a recording lies, %, where the robot's speed was not seen all of the time: it never was
    its set speed where it was not, or always. None where TCS is known, or nothing of it is."""
    if trial.attempt.source != "recorded":
        return None
    try:
        limit, drives = speed_limit(trial), finished(trial)
    except NotComputable:
        return None
    took = sum(d.span.end - d.span.start for d in drives)
    least = most = hidden = 0.0
    for drive in drives:
        if drive.velocity is None:
            return None
        v = ground_speed(drive.velocity)
        lost = ~(np.isfinite(v[:-1]) & np.isfinite(v[1:])) | drive.missed
        hidden += float(np.diff(drive.t)[lost].sum())
        for a, b in pairwise([0, *(int(i) + 1 for i in np.flatnonzero(lost)), len(v)]):
            run = (drive.t[a:b], v[a:b], (1 - BAND) * limit, (1 + BAND) * limit)
            least += time_within(*run) if b - a > 1 else 0.0
            most += time_within(*run, dwell=0.0) if b - a > 1 else 0.0
    if not 0.0 < hidden < took:
        return None
    return 100.0 * least / took, 100.0 * min(most + hidden, took) / took


ALL = (
    Indicator(
        "TCS",
        "time at cruise speed",
        "%",
        "paper A, eq. 7, band 10 %",
        "higher",
        time_at_cruise_speed(BAND),
        Kind.SHARE,
    ),
    Indicator(
        "TCS_5", "TCS, band 5 %", "%", "paper A, eq. 7, band 5 %", "higher", time_at_cruise_speed(0.05), Kind.SHARE
    ),
    Indicator(
        "TCS_20", "TCS, band 20 %", "%", "paper A, eq. 7, band 20 %", "higher", time_at_cruise_speed(0.20), Kind.SHARE
    ),
)
