"""How smoothly the robot drove, and for how long it stood.

Jerk is the change of acceleration, of the velocity over ground in the map's axes, so that swerving counts as braking does. A base
that is told its speed at each control period changes its acceleration at once; its jerk then is whatever the sampling makes of that.
So it is taken over a fixed interval, the same for robots of any period: the second difference of the velocity, `OVER` apart.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.indicators.indicator import Indicator, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, finished, speed, track
from clearway.indicators.success import AT_REST
from clearway.trials import Trial

OVER = 0.25
"""s from a velocity to the next of which accelerations are made, and from an acceleration to the next."""


def _jerks(trial: Trial) -> FloatArray:
    """(n,) size of the jerk at instants `OVER` apart on all scored legs, m/s^3.

    Raises:
        NotComputable: a leg was not finished, or the velocity is unknown or measured.
    """
    drives = finished(trial)
    if trial.attempt.source == "recorded":
        raise NotComputable("the noise of a recorded velocity would make most of it")
    found = np.concatenate([_of_leg(drive) for drive in drives])
    if not len(found):
        raise NotComputable(f"the legs took less than {3 * OVER:g} s")
    return found


def _of_leg(drive: DrivenLeg) -> FloatArray:
    speed(drive)  # whether it is known throughout
    assert drive.velocity is not None
    v, theta = drive.velocity, track(drive)[:, 2]
    sideways = v[:, 2] if v.shape[1] > 2 else np.zeros(len(v))
    cos, sin = np.cos(theta), np.sin(theta)
    at = np.arange(drive.t[0], drive.t[-1] + 1e-9, OVER)
    ground = (v[:, 0] * cos - sideways * sin, v[:, 0] * sin + sideways * cos)
    over_ground = np.stack([np.interp(at, drive.t, one) for one in ground], axis=1)
    return np.asarray(np.hypot(*np.diff(over_ground, 2, axis=0).T) / OVER**2)


@measure
def mean_jerk(trial: Trial) -> float:
    """Mean size of the jerk on the scored legs, m/s^3."""
    return float(_jerks(trial).mean())


@measure
def largest_jerk(trial: Trial) -> float:
    """Largest jerk on a scored leg, m/s^3."""
    return float(_jerks(trial).max())


@measure
def stopped_time(trial: Trial) -> float:
    """For how long the robot neither drove nor turned on the scored legs, s: from one sample at rest to the next."""
    seconds = 0.0
    for drive in finished(trial):
        v = speed(drive)
        assert drive.velocity is not None
        rest = (v < AT_REST) & (np.abs(drive.velocity[:, 1]) < AT_REST)
        seconds += float(np.diff(drive.t)[rest[:-1] & rest[1:]].sum())
    return seconds


_JERK = f"Francis et al. 2023 (J), velocities {OVER:g} s apart"

OF_SIMULATIONS = (
    Indicator("jerk", "mean jerk", "m/s^3", _JERK, "lower", mean_jerk),
    Indicator("jerk_max", "largest jerk", "m/s^3", _JERK, "lower", largest_jerk),
)
"""Of a recording nothing is said of these."""

ALL = (
    *OF_SIMULATIONS,
    Indicator("stopped_time", "time stopped on the way", "s", "Francis et al. 2023 (ST)", "lower", stopped_time),
)
