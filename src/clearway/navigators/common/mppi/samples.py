"""Samples about a control sequence: noised controls, and the velocities with which a base follows them.

All arrays are float32 and (time steps, samples), so that the inner loops go over samples side by side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ZERO, Floats


class Samples(NamedTuple):
    """All samples of one decision.

    Attributes:
        vx: (T, B) velocity forwards that the base follows, m/s; the first row is the measured one.
        vy: (T, B) to the left, m/s; zeros for a base that can't.
        wz: (T, B) yaw rate, rad/s.
        cvx: (T, B) sampled control forwards, m/s.
        cvy: (T, B) to the left, m/s.
        cwz: (T, B) yaw rate, rad/s.
        x: (T, B) after each step, m.
        y: (T, B) after each step, m.
        yaw: (T, B) after each step, rad, not wrapped.
    """

    vx: Floats
    vy: Floats
    wz: Floats
    cvx: Floats
    cvy: Floats
    cwz: Floats
    x: Floats
    y: Floats
    yaw: Floats


def make_samples(steps: int, batch: int) -> Samples:
    """Room for `batch` samples of `steps` time steps, all zero."""
    return Samples(*(np.zeros((steps, batch), np.float32) for _ in Samples._fields))


@kernel
def perturb(controls: Floats, noise: Floats, control: Floats) -> None:
    """One axis of the sampled controls (T, B): a control sequence (T,) with noise (T, B)."""
    steps, batch = controls.shape
    for t in range(steps):
        mean, from_noise, into = control[t], noise[t], controls[t]
        for b in range(batch):
            into[b] = from_noise[b] + mean


@kernel
def follow(
    velocity: Floats, controls: Floats, speed: np.float32, slower: np.float32, faster: np.float32, clamp_raw: bool
) -> None:
    """One axis of the velocities that follow the controls a step later, within the change that a step allows.

    Args:
        velocity: (T, B) filled; the first row is the speed now.
        controls: (T, B), or a row less: the last one has no effect.
        speed: Now.
        slower: Change of a step that loses speed, negative.
        faster: Change of a step that gains it.
        clamp_raw: Whether a control that the base can't follow is replaced by what it can.
    """
    steps, batch = velocity.shape
    first = velocity[0]
    for b in range(batch):
        first[b] = speed
    for t in range(1, steps):
        before, wanted, now = velocity[t - 1], controls[t - 1], velocity[t]
        for b in range(batch):
            v, w = before[b], wanted[b]
            forward = v > ZERO
            low = v + (slower if forward else -faster)
            high = v + (faster if forward else -slower)
            w = low if w < low else w
            now[b] = high if w > high else w
        if clamp_raw:
            for b in range(batch):
                wanted[b] = now[b]
