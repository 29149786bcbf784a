"""Exact motion at constant speeds, for tests that drive a robot by hand."""

from __future__ import annotations

import numpy as np

from clearway.geometry.motion import arc


def step_arc(pose: np.ndarray, v: float, omega: float, dt: float) -> np.ndarray:
    """The pose (3,) after `dt` [s] at `v` [m/s] and `omega` [rad/s]."""
    return np.array(arc(pose[0], pose[1], pose[2], v, omega, dt))
