"""Where sampled controls lead: within the base's limits, poses after each step.

Noise is drawn at points some steps apart and is linear in between, so that samples leave their mean for longer than a step. Velocity i
is that of step i - 1, velocity 0 that of now.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.crowds.ways import Ways, way_point
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.holonomic import follow as arc_along
from clearway.navigators.common.mppi.functions import HALF, ONE, ZERO, Floats, sine_cosine
from clearway.navigators.common.mppi.samples import Samples, follow, perturb
from clearway.robots.drive_limits import DriveLimits

STOP, GO = 1, 2
"""Samples 0, 1, 2: the last plan without noise, coming to rest, keeping to the way; the others are drawn."""


class Drawn(NamedTuple):
    """Noise of one decision, float32, (points, samples).

    Attributes:
        v: m/s.
        v_y: m/s.
        omega: rad/s.
    """

    v: Floats
    v_y: Floats
    omega: Floats


def make_room(steps: int, batch: int) -> Samples:
    """Room for `batch` samples: controls and poses of `steps` time steps, and a velocity more, that of now."""
    velocities = (np.zeros((steps + 1, batch), np.float32) for _ in range(3))
    return Samples(*velocities, *(np.zeros((steps, batch), np.float32) for _ in range(6)))


@kernel
def roll_out(
    samples: Samples, drawn: Drawn, hold: int, control: Floats, go: Floats, start: FloatArray, speed: FloatArray,
    limits: DriveLimits, dt: float,
) -> None:  # fmt: skip
    """Fill `samples`: of Biased-MPPI (see DECISIONS.md) that about the last plan, and what stands for the other controllers.

    Args:
        samples: From `make_room`.
        drawn: Noise at every `hold` steps.
        hold: Steps between two points of it.
        control: (3, T) the last plan: v, v_y, omega.
        go: (3, T) of a robot that keeps to its way.
        start: (3,) pose.
        speed: (3,) v, v_y, omega now.
        limits: Of the base.
        dt: Of a step, s.
    """
    between = np.empty_like(samples.cvx)
    side = limits.v_y_max > 0.0
    for axis in range(3):
        if axis == 1 and not side:
            continue
        noise = drawn.v if axis == 0 else (drawn.v_y if axis == 1 else drawn.omega)
        controls = samples.cvx if axis == 0 else (samples.cvy if axis == 1 else samples.cwz)
        _interpolate(noise, hold, between)
        perturb(controls, between, control[axis])
        for t in range(len(controls)):
            controls[t, 0], controls[t, STOP], controls[t, GO] = control[axis, t], ZERO, go[axis, t]
    _hold_limits(samples, limits)
    _follow(samples.vx, samples.cvx, speed[0], limits.acceleration, limits.deceleration, dt)
    _follow(samples.wz, samples.cwz, speed[2], limits.angular_acceleration, limits.angular_deceleration, dt)
    if side:
        _follow(samples.vy, samples.cvy, speed[1], limits.lateral_acceleration, limits.lateral_deceleration, dt)
    _integrate(samples, start, np.float32(dt), side)


@kernel
def _interpolate(noise: Floats, hold: int, into: Floats) -> None:
    steps, batch = into.shape
    for t in range(steps):
        k = t // hold
        share = np.float32((t - k * hold) / hold)
        first, second, row, rest = noise[k], noise[k + 1], into[t], ONE - share
        for b in range(batch):
            row[b] = rest * first[b] + share * second[b]


@kernel
def _follow(velocity: Floats, controls: Floats, speed: float, faster: float, slower: float, dt: float) -> None:
    follow(velocity, controls, np.float32(speed), np.float32(-slower * dt), np.float32(faster * dt), True)


@kernel
def _hold_limits(samples: Samples, limits: DriveLimits) -> None:
    """Cut controls to what the base can do; an omnidirectional one slows down in its direction."""
    steps, batch = samples.cvx.shape
    low, high, turn = np.float32(limits.v_min), np.float32(limits.v_max), np.float32(limits.omega_max)
    aside, most = np.float32(limits.v_y_max), np.float32(limits.speed_max)
    for t in range(steps):
        v, v_y, omega = samples.cvx[t], samples.cvy[t], samples.cwz[t]
        for b in range(batch):
            v[b] = min(max(v[b], low), high)
        for b in range(batch):
            omega[b] = min(max(omega[b], -turn), turn)
        if aside > ZERO:
            for b in range(batch):
                across = min(max(v_y[b], -aside), aside)
                size = np.float32(math.sqrt(v[b] * v[b] + across * across))
                share = most / size if size > most else ONE
                v[b], v_y[b] = share * v[b], share * across


@kernel
def _integrate(samples: Samples, start: FloatArray, dt: np.float32, side: bool) -> None:
    """Poses after each step, which is driven along the heading in its middle."""
    steps, batch = samples.x.shape
    work = np.empty((5, batch), np.float32)
    x0, y0, yaw0, sine, cosine = work[0], work[1], work[2], work[3], work[4]
    x0[:], y0[:], yaw0[:] = np.float32(start[0]), np.float32(start[1]), np.float32(start[2])
    half = HALF * dt
    for t in range(steps):
        v, v_y, omega = samples.vx[t + 1], samples.vy[t + 1], samples.wz[t + 1]
        x, y, yaw = samples.x[t], samples.y[t], samples.yaw[t]
        for b in range(batch):
            sine[b], cosine[b] = sine_cosine(yaw0[b] + half * omega[b])
        for b in range(batch):
            yaw[b] = yaw0[b] + dt * omega[b]
        for b in range(batch):
            x[b] = x0[b] + dt * (v[b] * cosine[b])
        for b in range(batch):
            y[b] = y0[b] + dt * (v[b] * sine[b])
        if side:
            for b in range(batch):
                x[b] -= dt * (v_y[b] * sine[b])
            for b in range(batch):
                y[b] += dt * (v_y[b] * cosine[b])
        x0, y0, yaw0 = x, y, yaw


@kernel
def keep_to(ways: Ways, ahead: float, start: FloatArray, limits: DriveLimits, dt: float, go: Floats) -> None:
    """The controls (3, T) of a robot that heads for the point `ahead` [m] on its way, as one that knows of nobody; filled."""
    x, y, theta = start[0], start[1], start[2]
    for t in range(go.shape[1]):
        px, py, left = way_point(ways, x, y, ahead)
        away = math.hypot(px - x, py - y)
        vx, vy, v_y = 0.0, 0.0, 0.0
        if left < math.inf and away > 1e-9:
            speed = min(limits.v_max, math.sqrt(2.0 * min(limits.deceleration, 1e6) * left))
            speed = min(speed, away / dt)
            vx, vy = speed * (px - x) / away, speed * (py - y) / away
        if limits.v_y_max > 0.0:
            c, s = math.cos(theta), math.sin(theta)
            v, v_y, omega = c * vx + s * vy, c * vy - s * vx, 0.0
            x, y = x + dt * vx, y + dt * vy
        else:
            v, omega = arc_along(vx, vy, theta, max(0.5, dt), limits.v_max, limits.omega_max)
            middle = theta + 0.5 * dt * omega
            x, y, theta = x + dt * v * math.cos(middle), y + dt * v * math.sin(middle), theta + dt * omega
        go[0, t], go[1, t], go[2, t] = np.float32(v), np.float32(v_y), np.float32(omega)
