"""What the costs make of the control sequence: the weighted mean of the samples, smoothed, within what the base can do.

Behaviour after nav2_mppi_controller/src/optimizer.cpp (updateControlSequence, applyControlSequence*Constraints) and
include/nav2_mppi_controller/tools/utils.hpp (savitskyGolayFilter). Control sequences are (3, T) float32: vx, vy, wz.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ZERO, Floats
from clearway.navigators.common.mppi.samples import Samples
from clearway.navigators.common.mppi.weights import softmax, weighted_mean
from clearway.navigators.nav2.controllers.mppi.rollout import Limits

_WINDOW = 9
_LEAST_SMOOTHED = 21  # time steps: a shorter sequence is left as it is


class Update(NamedTuple):
    """How the control sequence is updated; numbers are float32.

    Attributes:
        temperature: Of the softmax.
        gamma: (3,) weight of a control's departure from the mean, over the variance of vx, vy, wz; 0 leaves it out.
        dt: Of a time step, s.
        period: Of the controller, s.
        radius: Least turning radius, m; 0 without one.
        order: Of the smoothing polynomial, 1 or 2.
        shift: Whether the sequence is shifted by a step in each period, so that its second entry is the one sent.
        holonomic: Whether the base moves to its sides.
    """

    temperature: np.float32
    gamma: Floats
    dt: np.float32
    period: np.float32
    radius: np.float32
    order: int
    shift: bool
    holonomic: bool


@kernel
def hold_now(control: Floats, speed: Floats, limits: Limits, how: Update) -> None:
    """Have the sequence begin with what can be had from the speed (3,) (applyControlSequenceInterIterationConstraints)."""
    for axis in range(3):
        if axis == 1 and not how.holonomic:
            continue
        if how.shift:
            control[axis, 0] = speed[axis]
        else:
            slower, faster = _changes(limits, axis)
            control[axis, 0] = _reachable(speed[axis], control[axis, 0], how.period * slower, how.period * faster)


@kernel
def update_controls(
    control: Floats, costs: Floats, history: Floats, samples: Samples, speed: Floats, limits: Limits, how: Update
) -> None:
    """Put the softmax-weighted mean of the samples in place of the control sequence, smooth it, hold its limits.

    Args:
        control: (3, T), overwritten.
        costs: (B,); what departing from the mean costs is added.
        history: (4, 3) the last smoothed commands, the latest last; overwritten.
        speed: (3,) the robot drives at.
    """
    _add_control_cost(costs, samples.cvx, control[0], how.gamma[0])
    _add_control_cost(costs, samples.cwz, control[2], how.gamma[2])
    if how.holonomic:
        _add_control_cost(costs, samples.cvy, control[1], how.gamma[1])
    weights = softmax(costs, how.temperature)
    weighted_mean(control[0], samples.cvx, weights)
    weighted_mean(control[2], samples.cwz, weights)
    if how.holonomic:
        weighted_mean(control[1], samples.cvy, weights)
    _smooth(control, history, how.order, 1 if how.shift else 0)
    _constrain(control, speed, limits, how)


@kernel
def shift(control: Floats, holonomic: bool) -> None:
    """Drop the first entry; the last one is there twice (shiftControlSequence)."""
    steps = control.shape[1]
    for axis in range(3):
        if axis != 1 or holonomic:
            for t in range(steps - 1):
                control[axis, t] = control[axis, t + 1]


@kernel
def _add_control_cost(costs: Floats, controls: Floats, mean: Floats, gamma: np.float32) -> None:
    if gamma == ZERO:
        return
    steps, batch = controls.shape
    total = np.zeros(batch, np.float32)
    for t in range(steps):
        m, row = mean[t], controls[t]
        for b in range(batch):
            total[b] += (row[b] - m) * m
    for b in range(batch):
        costs[b] += gamma * total[b]


@kernel
def _smooth(control: Floats, history: Floats, order: int, sent: int) -> None:
    """Savitzky and Golay's filter over nine entries, the last four commands before the first; the last entry stays."""
    steps = control.shape[1]
    if steps < _LEAST_SMOOTHED:
        return
    filter_ = np.empty(_WINDOW, np.float32)
    for i in range(_WINDOW):
        away = i - _WINDOW // 2
        filter_[i] = np.float32(1.0 / 9.0) if order == 1 else np.float32((59.0 - 5.0 * away * away) / 231.0)
    padded = np.empty(steps + 8, np.float32)
    for axis in range(3):
        for i in range(4):
            padded[i], padded[steps + 4 + i] = history[i, axis], control[axis, steps - 1]
        padded[4 : steps + 4] = control[axis]
        for t in range(steps - 1):
            total = ZERO
            for i in range(_WINDOW):
                total += padded[t + i] * filter_[i]
            control[axis, t] = total
    for i in range(3):
        history[i] = history[i + 1]
    for axis in range(3):
        history[3, axis] = control[axis, sent]


@kernel
def _constrain(control: Floats, speed: Floats, limits: Limits, how: Update) -> None:
    """Hold the limits of speed and acceleration, from the speed (3,) on (applyControlSequenceConstraints)."""
    steps = control.shape[1]
    _hold_turning_radius(control, how.radius)
    for axis in range(3):
        if axis == 1 and not how.holonomic:
            continue
        slower, faster = _changes(limits, axis)
        least, most = _range(limits, axis)
        last = speed[axis]
        if how.shift:
            control[axis, 0] = last
        for t in range(steps):
            dt = how.period if t == 0 else how.dt
            value = min(most, max(control[axis, t], least))
            last = _reachable(last, value, dt * slower, dt * faster)
            control[axis, t] = last
    _hold_turning_radius(control, how.radius)


@kernel
def _changes(limits: Limits, axis: int) -> tuple[np.float32, np.float32]:
    """Accelerations that lose and that gain speed."""
    if axis == 0:
        return limits.ax_min, limits.ax_max
    if axis == 1:
        return limits.ay_min, limits.ay_max
    return -limits.az_max, limits.az_max


@kernel
def _range(limits: Limits, axis: int) -> tuple[np.float32, np.float32]:
    if axis == 0:
        return limits.vx_min, limits.vx_max
    if axis == 1:
        return -limits.vy, limits.vy
    return -limits.wz, limits.wz


@kernel
def _reachable(last: np.float32, value: np.float32, slower: np.float32, faster: np.float32) -> np.float32:
    """`value` within what can be reached from `last` (utils.hpp, clampVelocityByAccel)."""
    forward = last >= ZERO
    low = last + (slower if forward else -faster)
    high = last + (faster if forward else -slower)
    return min(high, max(value, low))


@kernel
def _hold_turning_radius(control: Floats, radius: np.float32) -> None:
    if radius <= ZERO:
        return
    for t in range(control.shape[1]):
        most = abs(control[0, t]) / radius
        control[2, t] = min(most, max(control[2, t], -most))
