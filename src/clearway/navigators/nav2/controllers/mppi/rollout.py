"""Where the samples lead: noised controls, the velocities that the base can follow them with, the poses on the way.

Behaviour after nav2_mppi_controller/include/nav2_mppi_controller/motion_models.hpp and src/optimizer.cpp. All arrays are
float32 and (time steps, samples), so that the inner loops go over samples side by side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ZERO, Floats, sine_cosine
from clearway.navigators.common.mppi.samples import Samples, follow, perturb


class Limits(NamedTuple):
    """Limits of the base, all float32.

    Attributes:
        vx_max: m/s.
        vx_min: m/s, negative backwards.
        vy: To either side, m/s.
        wz: To either side, rad/s.
        ax_max: Gaining speed, m/s^2.
        ax_min: Losing it, m/s^2, negative.
        ay_max: Gaining speed, m/s^2.
        ay_min: Losing it, m/s^2, negative.
        az_max: rad/s^2.
    """

    vx_max: np.float32
    vx_min: np.float32
    vy: np.float32
    wz: np.float32
    ax_max: np.float32
    ax_min: np.float32
    ay_max: np.float32
    ay_min: np.float32
    az_max: np.float32


class Delays(NamedTuple):
    """How late the base acts, for the motion model's input delay.

    Attributes:
        steps: (3,) int64, time steps of vx, vy, wz.
        commands: (3, h) float32, the last commands given, the latest last; h is the most of `steps`.
    """

    steps: npt.NDArray[np.int64]
    commands: Floats


@kernel
def roll_out(
    samples: Samples,
    noise: tuple[Floats, Floats, Floats],
    control: Floats,
    pose: Floats,
    speed: Floats,
    limits: Limits,
    delays: Delays,
    dt: np.float32,
    holonomic: bool,
    clamp_raw: bool,
) -> None:
    """Fill `samples` from the noise about a control sequence.

    Args:
        noise: (T, B) each, of vx, vy, wz.
        control: (3, T) vx, vy, wz.
        pose: (3,) of the robot.
        speed: (3,) it drives at.
        dt: Of a time step, s.
        holonomic: Whether the base moves to its sides.
        clamp_raw: Whether a control that the base can't follow is replaced by what it can.
    """
    vx, vy, wz = samples.vx, samples.vy, samples.wz
    noise_vx, noise_vy, noise_wz = noise
    perturb(samples.cvx, noise_vx, control[0])
    perturb(samples.cwz, noise_wz, control[2])
    follow(vx, samples.cvx, speed[0], dt * limits.ax_min, dt * limits.ax_max, clamp_raw)
    follow(wz, samples.cwz, speed[2], -dt * limits.az_max, dt * limits.az_max, clamp_raw)
    _delay(vx, delays.steps[0], delays.commands[0])
    _delay(wz, delays.steps[2], delays.commands[2])
    if holonomic:
        perturb(samples.cvy, noise_vy, control[1])
        follow(vy, samples.cvy, speed[1], dt * limits.ay_min, dt * limits.ay_max, clamp_raw)
        _delay(vy, delays.steps[1], delays.commands[1])
    _integrate(samples, pose, dt, holonomic)


@kernel
def _delay(velocity: Floats, late: int, commands: Floats) -> None:
    """Velocities `late` steps later, after those that the commands already on their way lead to (applyDelayShift)."""
    steps = velocity.shape[0]
    if late <= 0:
        return
    for t in range(steps - 1, late - 1, -1):
        velocity[t] = velocity[t - late + 1]
    begin = commands.shape[0] - late
    for t in range(1, min(late, steps)):
        velocity[t] = commands[begin + t]


@kernel
def _integrate(samples: Samples, pose: Floats, dt: np.float32, holonomic: bool) -> None:
    """Poses after each step: a step is driven along the yaw at its beginning (integrateStateVelocities)."""
    steps, batch = samples.vx.shape
    work = np.empty((5, batch), np.float32)
    x0, y0, yaw0, sine, cosine = work[0], work[1], work[2], work[3], work[4]
    for b in range(batch):
        x0[b], y0[b], yaw0[b] = pose[0], pose[1], pose[2]
    for t in range(steps):
        vx, vy, wz = samples.vx[t], samples.vy[t], samples.wz[t]
        x, y, yaw = samples.x[t], samples.y[t], samples.yaw[t]
        for b in range(batch):  # in short loops: LLVM makes vectors of those over few arrays only
            sine[b], cosine[b] = sine_cosine(yaw0[b])
        for b in range(batch):
            yaw[b] = yaw0[b] + wz[b] * dt
        if holonomic:
            for b in range(batch):
                x[b] = x0[b] + (vx[b] * cosine[b] - vy[b] * sine[b]) * dt
            for b in range(batch):
                y[b] = y0[b] + (vx[b] * sine[b] + vy[b] * cosine[b]) * dt
        else:
            for b in range(batch):
                x[b] = x0[b] + (vx[b] * cosine[b]) * dt
            for b in range(batch):
                y[b] = y0[b] + (vx[b] * sine[b]) * dt
        x0, y0, yaw0 = x, y, yaw


@kernel
def trajectory_of(control: Floats, pose: Floats, dt: np.float32, holonomic: bool) -> Floats:
    """(T, 3) float32, the poses that a control sequence (3, T) leads to (getOptimizedTrajectory)."""
    steps = control.shape[1]
    poses = np.empty((steps, 3), np.float32)
    x, y, yaw = pose[0], pose[1], pose[2]
    for t in range(steps):
        sine, cosine = sine_cosine(yaw)
        vy = control[1, t] if holonomic else ZERO
        x = x + (control[0, t] * cosine - vy * sine) * dt
        y = y + (control[0, t] * sine + vy * cosine) * dt
        yaw = yaw + control[2, t] * dt
        poses[t, 0], poses[t, 1], poses[t, 2] = x, y, yaw
    return poses
