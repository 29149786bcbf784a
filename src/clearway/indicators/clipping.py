"""How often a base was told what it can't do."""

from __future__ import annotations

import numpy as np

from clearway.robots.drive_limits import DriveLimits
from clearway.trials import Trial

_SAME = 1e-9


def clipped(trial: Trial) -> int | None:
    """In how many samples the command was beyond what the base can hold: a speed, the speed of a wheel, a car's curvature.

    What acceleration leaves of a command doesn't count. None where the commands or the limits are unknown.
    """
    limits, told = trial.attempt.limits, trial.command
    if limits is None or told is None or trial.attempt.source == "recorded":
        return None
    return int(_beyond(limits, told).sum())


def _beyond(limits: DriveLimits, told: np.ndarray) -> np.ndarray:
    """(n,) bool of the commands `told` (n, 2) or (n, 3), as `clearway.robots.possible` has it."""
    v, omega = told[:, 0], told[:, 1]
    v_y = told[:, 2] if told.shape[1] > 2 else np.zeros(len(told))
    beyond = (v < limits.v_min - _SAME) | (v > limits.v_max + _SAME) | (np.abs(v_y) > limits.v_y_max + _SAME)
    if limits.wheelbase > 0.0:
        return np.asarray(beyond | (np.abs(omega) > np.abs(v) * np.tan(limits.steering_max) / limits.wheelbase + _SAME))
    beyond |= (np.abs(omega) > limits.omega_max + _SAME) | (np.hypot(v, v_y) > limits.speed_max + _SAME)
    shares = np.reshape(limits.wheels, (-1, 3)) @ np.array([v, v_y, omega])
    return np.asarray(beyond | (np.abs(shares).max(axis=0) > 1.0 + _SAME))
