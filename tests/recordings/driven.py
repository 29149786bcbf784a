"""Motions made of a speed profile, for tests of clocks and legs: what a perfect observer of that drive would see."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion.motion import Motion, Quality

Knots = list[tuple[float, float, float]]
"""t [s], v [m/s], omega [rad/s]; linear between."""


def driven(
    knots: Knots, rate: float = 100.0, *, at: tuple[float, float, float] = (0.0, 0.0, 0.0), noise: float = 0.0,
    turn_noise: float = 0.0, filtered: float | None = None, seed: int = 0,
) -> Motion:  # fmt: skip
    """The motion of a robot that drives `knots`, from pose `at`.

    Args:
        noise, turn_noise: standard deviation of positions [m] and headings [rad], before a zero-phase low-pass at
            `filtered` Hz; velocity is then the derivative of the pose.
    """
    known = np.array(knots)
    h = 1e-3
    fine = np.arange(known[0, 0], known[-1, 0] + 0.05, h)
    v, omega = (np.interp(fine, known[:, 0], known[:, i]) for i in (1, 2))
    theta = at[2] + _summed(omega, h)
    x, y = at[0] + _summed(v * np.cos(theta), h), at[1] + _summed(v * np.sin(theta), h)
    t = np.arange(known[0, 0], known[-1, 0] + 1e-9, 1 / rate)
    pose = np.stack([np.interp(t, fine, u) for u in (x, y, theta)], axis=1)
    if not noise and filtered is None:
        velocity = np.stack([np.interp(t, known[:, 0], known[:, i]) for i in (1, 2)], axis=1)
        return Motion(t, pose, velocity, None, Quality(rate, 1.0))
    pose = pose + np.random.default_rng(seed).normal(size=pose.shape) * [noise, noise, turn_noise]
    if filtered is not None:
        pose = sosfiltfilt(butter(2, filtered / 0.802, fs=rate, output="sos"), pose, axis=0)
    return Motion(t, pose, derived(t, pose), None, Quality(rate, 1.0))


def derived(t: FloatArray, pose: FloatArray) -> FloatArray:
    """(n, 2) v along the body's x and omega of poses."""
    d = np.gradient(pose, t, axis=0)
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    return np.stack([c * d[:, 0] + s * d[:, 1], d[:, 2]], axis=1)


def _summed(rate: FloatArray, h: float) -> FloatArray:
    whole: FloatArray = np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * h))
    return whole
