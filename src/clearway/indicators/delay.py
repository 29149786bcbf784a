"""What a robot costs the people who have somewhere to go: how much later they arrive, and by how much longer a way.

The same people walk twice, by the same seed: with the robot, and where none drives (`clearway.trials.Errand`). Both are judged at
the place that a person was walking to when the trial ended, or had come to by then. From the trial's end on the robot is gone, and
they walk on until they are there: so each of them has a delay, whether or not it had arrived when the robot had. Who has not come by
the end of the time that people are given counts as coming then: what is told is the difference of restricted mean times (Royston
and Parmar 2013).
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import finished
from clearway.trials import Errand, Outcome, Trial


def _errands(trial: Trial) -> tuple[Errand, ...]:
    """Of a trial that took its time: to the goal, or until its time was over.

    Raises:
        NotComputable: it was cut short, nobody goes anywhere, or it is not known how people fare without robots.
    """
    if trial.outcome is not Outcome.TIMEOUT:
        finished(trial)
    if not trial.errands:
        raise NotComputable("nobody there walks to a place by a decision of its own")
    if any(math.isnan(errand.until) for errand in trial.errands):
        raise NotComputable("nobody knows how people walk there without robots")
    return trial.errands


def _delays(trial: Trial) -> FloatArray:
    """(n,) how much later each person arrived, s."""
    times = np.array([(e.arrived, e.arrived_without, e.until) for e in _errands(trial)])
    came, without = np.fmin(times[:, :2], times[:, 2:]).T
    return np.asarray(came - without)


@measure
def mean_delay(trial: Trial) -> float:
    """How much later people arrived than without robots, on average, s."""
    return float(_delays(trial).mean())


@measure
def worst_delay(trial: Trial) -> float:
    """The same of the one who was delayed most, s."""
    return float(_delays(trial).max())


@measure
def mean_detour(trial: Trial) -> float:
    """How much further people walked than without robots, on average of those who arrived with and without, m."""
    further = np.array([e.path - e.path_without for e in _errands(trial)])
    if np.isnan(further).all():
        raise NotComputable("nobody arrived both with robots and without")
    return float(np.nanmean(further))


_TWICE = "Clearway, the same scene simulated without robots"

ALL = (
    Indicator("people_delay", "people's delay, mean", "s", _TWICE, "lower", mean_delay, signed=True),
    Indicator("people_delay_max", "people's delay, worst", "s", _TWICE, "lower", worst_delay, signed=True),
    Indicator("people_detour", "people's detour, mean", "m", _TWICE, "lower", mean_detour, signed=True),
)
"""Of a trial without people, and of a recording, nothing is said of these."""
