"""What a robot costs the people who have somewhere to go: how much later they arrive, and by how much longer a way.

The same people walk twice, by the same seed: with the robot, and where none drives (`clearway.trials.Errand`). Both are judged at
the place that a person was walking to when the trial ended, or had come to by then. From the trial's end on the robot is gone, and
they walk on until they are there: so each of them has a delay, whether or not it had arrived when the robot had.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import finished
from clearway.trials import Trial


def _later(trial: Trial) -> FloatArray:
    """(n, 2) by person: how much later it arrived, s, and how much further it walked, m. Who arrives neither with nor without robots
    is left out: what holds it up is something else.

    Raises:
        NotComputable: nobody goes anywhere, a leg was not finished, or it is not known how somebody fares with or without robots.
    """
    finished(trial)
    if not trial.errands:
        raise NotComputable("nobody there walks to a place by a decision of its own")
    known = [e for e in trial.errands if not (math.isnan(e.arrived) and math.isnan(e.arrived_without))]
    if not known:
        raise NotComputable("nobody arrived, with robots or without")
    for errand in known:
        name = trial.attempt.bodies[errand.body].name
        if math.isnan(errand.arrived):
            raise NotComputable(f"{name} did not arrive in two minutes after the trial")
        if math.isnan(errand.arrived_without):
            raise NotComputable(f"nobody knows when {name} had arrived without robots")
    return np.array([(e.arrived - e.arrived_without, e.path - e.path_without) for e in known])


@measure
def mean_delay(trial: Trial) -> float:
    """How much later people arrived than without robots, on average, s."""
    return float(_later(trial)[:, 0].mean())


@measure
def worst_delay(trial: Trial) -> float:
    """The same of the one who was delayed most, s."""
    return float(_later(trial)[:, 0].max())


@measure
def mean_detour(trial: Trial) -> float:
    """How much further people walked than without robots, on average, m."""
    return float(_later(trial)[:, 1].mean())


_TWICE = "Clearway, the same scene simulated without robots"

ALL = (
    Indicator("people_delay", "people's delay, mean", "s", _TWICE, "lower", mean_delay, signed=True),
    Indicator("people_delay_max", "people's delay, worst", "s", _TWICE, "lower", worst_delay, signed=True),
    Indicator("people_detour", "people's detour, mean", "m", _TWICE, "lower", mean_detour, signed=True),
)
"""Of a trial without people, and of a recording, nothing is said of these."""
