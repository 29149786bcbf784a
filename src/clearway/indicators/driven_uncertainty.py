"""CT_U, PL_U, TCS_U: how far off CT, PL and TCS may be because times, poses and speeds were measured.

Expanded uncertainties U = 2 u as those of DE, OE and MDO are (`uncertainty`). u follows from what the recording shows:

- When a leg began and ended, s. A given span is read off a sample: u_t = dt / sqrt(12) at each end, independently. What was
  found by the motion lies, besides, within tau to either side, the time that the robot takes between rest and a speed that
  can be told from rest (0.02 m/s, or 3 u_v): tau / sqrt(3), all ends alike, as noise and filter put all of them outwards. A low-pass
  of less than 3 Hz blunts starts and stops, so that tau is longer by 1 / (2 pi f). What
  the robot reported is exact on its clock; where only one end of a leg is, the uncertainty of that clock against the
  capture's comes in, in all legs alike.
- CT: u^2 = sum over all ends of u_t^2 + (sum over them of tau / sqrt(3))^2 + (sum over the legs of the clock's)^2.
- PL: u^2 = sum over all ends of sigma^2 + (v u_t)^2, as errors along the way cancel between two ends, + (sum over the legs
  of e)^2 + (sum over the legs of c)^2. e is the path within tau of the ends, and what the path is longer than the
  same smoothed over 1 s: noise makes a path longer, and so does a robot that shakes; nobody can tell which. c is what
  chords cut off the curves, a third of what they cut off with every second sample left out. The tie of the frame to the
  map moves the path as a whole.
- TCS = 100 W / CT: u of W is half of how much W changes between a band that is narrower by u_v on both sides and one that
  is wider; u of CT as above. u_v is the scatter of the speed about the same smoothed over 1 s, while the robot moves.

A simulation knows its poses: 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from clearway.contract import EventKind
from clearway.geometry.shapes import FloatArray
from clearway.indicators.column import Kind
from clearway.indicators.completion_time import STANDING, completion_time
from clearway.indicators.cruise import BAND, time_at_cruise_speed, time_within
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, finished, ground_speed, positions, speed, speed_limit
from clearway.indicators.path_length import path_length
from clearway.indicators.uncertainty import COVERAGE, GUM, pose_uncertainty
from clearway.trials import Trial

SMOOTHED = 1.0
"""s; window of the cubic (Savitzky-Golay) that tells noise from motion: what passes it is slower than about 2 Hz."""
ARM = 0.3
"""m; turning at omega counts as driving at ARM * omega, as it does where legs are found by motion."""
SHARP = 3.0
"""Hz; a low-pass that lets so much pass blunts no start or stop of a robot."""
UNDER_WAY = 0.06
"""m/s; a robot that is so fast where its leg begins or ends did not rest there."""


@dataclass(frozen=True, slots=True)
class Ends:
    """How surely is known when a leg was driven, s; standard uncertainties but for `rise` and `fall`.

    Attributes:
        start: Of its start by the sampling, independent of all others.
        end: Of its end, likewise.
        rise: How long it takes after its start until motion shows, s; 0 where its start was not found by that.
        fall: The same before its end.
        clock: Of its duration, because its two ends are known by two clocks; the same error in every leg.
    """

    start: float
    end: float
    rise: float = 0.0
    fall: float = 0.0
    clock: float = 0.0


def ends(trial: Trial) -> list[Ends]:
    """Of the scored legs of a recording, in the order driven.

    Raises:
        NotComputable: a leg was not finished, or one of its ends did not show.
    """
    told = trial.provenance.get("legs")
    words = [str(leg) for leg in told] if isinstance(told, list | tuple) else []
    how = dict(zip((span.leg for span in trial.spans), words, strict=False))
    return [_ends(trial, drive, how.get(drive.span.leg, "")) for drive in finished(trial)]


def _ends(trial: Trial, drive: DrivenLeg, how: str) -> Ends:
    sample = trial.attempt.period / math.sqrt(12.0)
    if "span given" in how:
        return Ends(sample, sample)
    sent, called = "goal sent" in how, "by the robot" in how
    blunt = _blunted(trial)
    return Ends(
        start=0.0 if sent else sample,
        end=0.0 if called else sample,
        rise=0.0 if sent else _seen(trial, drive, "start") + blunt,
        fall=0.0 if called else _seen(trial, drive, "end") + blunt,
        clock=_clock(trial) if sent != called else 0.0,
    )


def _seen(trial: Trial, drive: DrivenLeg, which: str) -> float:
    """How long the robot takes at a start or end that was found by the motion between rest and what shows, s."""
    kind = EventKind.UNSEEN_DEPARTURE if which == "start" else EventKind.UNSEEN_ARRIVAL
    unseen = NotComputable(f"the {which} of leg {drive.leg.name} did not show")
    if any(e.kind == kind and e.detail.startswith(f"leg {drive.leg.name}") for e in trial.events):
        raise unseen
    if drive.velocity is None:
        raise NotComputable("the trial has no velocity")
    effort = np.hypot(ground_speed(drive.velocity), ARM * np.nan_to_num(drive.velocity[:, 1]))
    known = np.isfinite(effort)
    if not known.any():
        raise NotComputable("the velocity is unknown")
    level = max(STANDING, 3.0 * speed_noise(drive.t[known], effort[known]))
    away = drive.t - drive.t[0]
    if which == "end":
        effort, away = effort[::-1], drive.t[-1] - drive.t[::-1]
    if not effort[0] <= max(UNDER_WAY, level) or not (effort >= level).any():
        raise unseen
    first = int(np.argmax(effort >= level))
    if first == 0:
        return 0.0
    since = effort[first - 1] if np.isfinite(effort[first - 1]) else 0.0
    share = (level - since) / (effort[first] - since)
    return float(away[first - 1] + share * (away[first] - away[first - 1]))


def _blunted(trial: Trial) -> float:
    """How far the low-pass puts starts and stops off, s; 0 where it lets pass what a robot can do."""
    cleaned = trial.provenance.get("motion")
    robot = cleaned.get("robot") if isinstance(cleaned, Mapping) else None
    cutoff = robot.get("cutoff") if isinstance(robot, Mapping) else None
    return 1.0 / (2.0 * math.pi * cutoff) if isinstance(cutoff, float) and 0.0 < cutoff < SHARP else 0.0


def _clock(trial: Trial) -> float:
    """Standard uncertainty of the robot's clock against the capture's, s; the largest, where there are several logs."""
    told = trial.provenance.get("clock")
    logs = list(told.values()) if isinstance(told, Mapping) else []
    sigmas = [float(log["sigma"]) for log in logs if isinstance(log, Mapping) and log.get("sigma") is not None]
    return max(sigmas, default=0.0)


def smoothed(t: FloatArray, x: FloatArray) -> FloatArray:
    """`x` (n, ...) at the stamps t (n,) [s], smoothed over `SMOOTHED`; uneven stamps go by way of an even grid. As it is where
    it is shorter than that, or has fewer than seven samples in that time."""
    n = len(t)
    step = float(np.median(np.diff(t))) if n > 1 else math.inf
    window = 2 * round(SMOOTHED / step / 2) + 1 if step > 0 and math.isfinite(step) else 1
    if window < 7 or window > n:
        return x
    from scipy.signal import savgol_filter  # here: loading it takes longer than all else that a campaign's worker loads

    columns = x.reshape(n, -1)
    grid = np.linspace(t[0], t[-1], max(window, round((t[-1] - t[0]) / step) + 1))
    between = np.stack([np.interp(grid, t, column) for column in columns.T], axis=1)
    clean = savgol_filter(between, window, 3, axis=0)
    return np.stack([np.interp(t, grid, column) for column in clean.T], axis=1).reshape(x.shape)


def speed_noise(t: FloatArray, v: FloatArray) -> float:
    """Standard deviation of the speed v (n,) [m/s] about the same smoothed, while the robot moves; robust: a robot may brake hard."""
    moves = v > STANDING
    if not moves.any():
        return 0.0
    return float(1.4826 * np.median(np.abs(v - smoothed(t, v))[moves]))


def _added(drive: DrivenLeg, when: Ends) -> tuple[float, float]:
    """What of one leg's path may be noise, and how much chords cut off it, m; not below 0."""
    at = smoothed(drive.t, positions(drive))
    whole, half = (float(np.hypot(*np.diff(p, axis=0).T).sum()) for p in (at, np.concatenate([at[:-1:2], at[-1:]])))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(positions(drive), axis=0).T))])
    first, last = np.interp([drive.t[0] + when.rise, drive.t[-1] - when.fall], drive.t, way)
    return max(way[-1] - whole, 0.0) + float(first + way[-1] - last), max(whole - half, 0.0) / 3.0


def _of_time(every: list[Ends]) -> float:
    independent = sum(e.start**2 + e.end**2 for e in every)
    alike = sum(e.rise + e.fall for e in every) / math.sqrt(3.0)
    return math.sqrt(independent + alike**2 + sum(e.clock for e in every) ** 2)


def _measured(value: Measure, u: Measure) -> Measure:
    """The expanded uncertainty of an indicator whose standard uncertainty in a recording is `u`."""

    @measure
    def expanded(trial: Trial) -> float:
        for found in (value(trial),) if trial.attempt.source == "simulated" else (value(trial), u(trial)):
            if found.value is None:
                raise NotComputable(found.why)
        return 0.0 if trial.attempt.source == "simulated" else COVERAGE * (found.value or 0.0)

    return expanded


@measure
def of_completion_time(trial: Trial) -> float:
    """Standard uncertainty of CT of a recording, s."""
    return _of_time(ends(trial))


@measure
def of_path_length(trial: Trial) -> float:
    """Standard uncertainty of PL of a recording, m."""
    drives = finished(trial)
    independent = longer = cut = 0.0
    for drive, when in zip(drives, ends(trial), strict=True):
        steps = np.hypot(*np.diff(positions(drive), axis=0).T) / np.diff(drive.t)
        for sample, v, u in ((0, steps[0], when.start), (len(drive.t) - 1, steps[-1], when.end)):
            independent += pose_uncertainty(drive, sample, 0, 0, among=True) ** 2 + (v * u) ** 2
        noise, chords = _added(drive, when)
        longer, cut = longer + noise, cut + chords
    return math.sqrt(independent + longer**2 + cut**2)


@measure
def of_time_at_cruise_speed(trial: Trial) -> float:
    """Standard uncertainty of TCS of a recording, %."""
    limit, drives = speed_limit(trial), finished(trial)
    took = sum(d.span.end - d.span.start for d in drives)

    def within(wider: int) -> float:
        found = 0.0
        for d in drives:
            v = speed(d)
            by = wider * speed_noise(d.t, v)
            low, high = (1 - BAND) * limit - by, (1 + BAND) * limit + by
            found += time_within(d.t, v, low, high) if low < high else 0.0
        return found

    narrow, usual, wide = (within(wider) for wider in (-1, 0, 1))
    return 100.0 * math.hypot((wide - narrow) / 2.0, usual / took * _of_time(ends(trial))) / took


ALL = (
    Indicator("CT_U", "uncertainty of CT", "s", GUM, "neither", _measured(completion_time, of_completion_time)),
    Indicator("PL_U", "uncertainty of PL", "m", GUM, "neither", _measured(path_length, of_path_length)),
    Indicator(
        "TCS_U", "uncertainty of TCS", "%", GUM, "neither", _measured(time_at_cruise_speed(BAND), of_time_at_cruise_speed), Kind.SHARE,
    ),
)  # fmt: skip
