"""Path relative to the shortest past what stands, time relative to the best that a clairvoyant could do, and how much of the thinking a budget cut off."""

from __future__ import annotations

import numpy as np

from clearway.indicators.column import Kind
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import finished, time_driven
from clearway.indicators.path_length import length
from clearway.trials import Trial


@measure
def path_ratio(trial: Trial) -> float:
    """PL over the length of the shortest way past what stands still, whatever moves: none that arrives is below 1."""
    if trial.attempt.shortest_path is None:
        raise NotComputable("the shortest way past what stands is not known for this test")
    return sum(length(drive) for drive in finished(trial)) / trial.attempt.shortest_path


@measure
def time_ratio(trial: Trial) -> float:
    """Time of the scored legs over the clairvoyant's shortest.

    The clairvoyant is undisturbed: a robot that is pushed onwards can be a little faster than it (0.998 was seen).
    """
    if trial.attempt.optimal_time is None:
        raise NotComputable("no clairvoyant's time is known to 0.5 % for this test")
    return time_driven(trial) / trial.attempt.optimal_time


@measure
def cut_share(trial: Trial) -> float:
    """Share of the decisions that the budget cut short, in per cent."""
    if trial.cut is None or not len(trial.cut):
        raise NotComputable("nobody knows which decisions the budget cut")
    return 100.0 * float(np.mean(trial.cut))


_SOURCE = "clairvoyant space-time search; a push can win 0.2 %"
_PAST = "visibility graph, a lower bound"

ALL = (
    Indicator(
        "PL_shortest", "path length over the shortest past what stands", "", _PAST, "lower", path_ratio, Kind.SHARE
    ),
    Indicator("CT_optimal", "time over the undisturbed clairvoyant's", "", _SOURCE, "lower", time_ratio, Kind.SHARE),
    Indicator("cut", "decisions cut by the budget", "%", "paper B, set-up 1", "neither", cut_share, Kind.SHARE),
)
