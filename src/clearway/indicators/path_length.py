"""PL, path length: in metres, and normalised by the protocol's distance (paper A's eq. 2 against its text)."""

from __future__ import annotations

import numpy as np

from clearway.indicators.column import Kind
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, finished, named, positions
from clearway.trials import Trial


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
