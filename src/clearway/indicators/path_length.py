"""PL, path length: in metres, and normalised by the protocol's distance (paper A's eq. 2 against its text)."""

from __future__ import annotations

import numpy as np

from clearway.indicators.column import Kind
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, finished, known_rows, named, positions
from clearway.trials import Trial
from clearway.trials.unseen import robot_speeds


def length(drive: DrivenLeg) -> float:
    """Length of the true path of one leg, m: the integral of |dp/dt|, over chords between samples.

    Chords of arcs are short by (omega dt)^2 / 24 of their length: 0.04 % at 1 rad/s and 10 Hz.
    """
    steps = np.diff(positions(drive), axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


@measure
def path_length(trial: Trial) -> float:
    """Length of the path over all scored legs, m."""
    return sum(length(drive) for drive in finished(trial))


def bounds(trial: Trial) -> tuple[float, float] | None:
    """Between what two lengths PL of a recording lies, m, where the robot was not seen all of the time: it drove straight on
    where it was not, or as fast as it can. None where PL is known, or was not finished."""
    if trial.attempt.source != "recorded":
        return None
    try:
        drives = finished(trial)
    except NotComputable:
        return None
    least = most = 0.0
    top = robot_speeds(trial.attempt, trial.t, trial.pose)[0]
    for drive in drives:
        known = np.flatnonzero(known_rows(drive.pose[:, :2]))
        if not len(known):
            return None
        t, at = drive.t[known], drive.pose[known, :2]
        steps = np.hypot(*np.diff(at, axis=0).T)
        lasts = np.diff(t)
        hidden = (np.diff(known) > 1) | drive.missed[known[:-1]]
        ends = float(t[0] - drive.t[0] + drive.t[-1] - t[-1])
        least += float(steps.sum())
        most += float(np.where(hidden, np.maximum(steps, top * lasts), steps).sum()) + top * ends
    return (least, most) if most > least else None


def leg_length(name: str) -> Measure:
    """Length of the path of the scored leg `name`, m."""

    @measure
    def of_leg(trial: Trial) -> float:
        return length(named(trial, name))

    return of_leg


@measure
def normalised(trial: Trial) -> float:
    """PL over the protocol's distance: legs x reference length (paper A's 2 d_AB)."""
    reference = trial.attempt.reference_length
    if reference is None:
        raise NotComputable("the test has no reference length")
    drives = finished(trial)
    return sum(length(drive) for drive in drives) / (len(drives) * reference)


ALL = (
    Indicator("PL", "path length", "m", "paper A, eq. 2, numerator", "lower", path_length),
    Indicator("PL_norm", "path length over 2 d_AB", "", "paper A, eq. 2", "lower", normalised, Kind.SHARE),
    Indicator("PL_forth", "path length, A to B", "m", "paper A, eq. 2, one leg", "lower", leg_length("forth")),
    Indicator("PL_back", "path length, B to A", "m", "paper A, eq. 2, one leg", "lower", leg_length("back")),
)
