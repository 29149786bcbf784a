"""The BARN Challenge's own score of a run, for its suite only."""

from __future__ import annotations

from clearway.indicators.column import Kind
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import time_driven
from clearway.indicators.success import failure
from clearway.trials import Trial

FAMILY = "barn"
"""Of the suites for which it makes sense."""
TOP_SPEED = 2.0
"""m/s; the reference path's length over it is the optimal time T."""


def _reference(trial: Trial) -> float:
    if trial.attempt.labels.family != FAMILY:
        raise NotComputable("only for the BARN Challenge's suites")
    if trial.attempt.reference_length is None:
        raise NotComputable("the test has no reference length")
    return trial.attempt.reference_length


@measure
def barn_time(trial: Trial) -> float:
    """Time of a successful run, s, from the first 0.1 m on."""
    _reference(trial)
    if why := failure(trial):
        raise NotComputable(f"the run failed ({why})")
    return time_driven(trial)


@measure
def barn_score(trial: Trial) -> float:
    """success x T / clip(t, 2 T, 8 T) with T = L / 2 m/s: 0.5 at best."""
    optimal = _reference(trial) / TOP_SPEED
    if failure(trial):
        return 0.0
    return optimal / min(max(time_driven(trial), 2 * optimal), 8 * optimal)


_SOURCE = "BARN Challenge, scoring of a run"

ALL = (
    Indicator("barn_score", "BARN score", "", _SOURCE, "higher", barn_score, Kind.SHARE),
    Indicator("barn_time", "BARN time", "s", _SOURCE, "lower", barn_time),
)
