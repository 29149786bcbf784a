"""What a base can do next: turn on the spot, and reach certain velocities within its accelerations."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray
from clearway.robots.drive_limits import DriveLimits


@light
def spin(error: float, now: float, most: float, faster: float, slower: float, c: float) -> float:
    """Yaw rate [rad/s] of the next period with which a robot turns by `error` [rad] on the spot and stops there.

    Args:
        error: Turn that is left, rad.
        now: Yaw rate, rad/s.
        most: Bound on it, rad/s.
        faster: Bound on its growth, rad/s^2; may be infinite.
        slower: Bound on its decline, rad/s^2; may be infinite.
        c: Control period, s.
    """
    left = abs(error)
    rate = min(most, 0.6 * left / c)
    if math.isfinite(slower):
        rate = min(rate, math.sqrt(2.0 * slower * left))
    rate = math.copysign(rate, error)
    up, down = (faster, slower) if now >= 0.0 else (slower, faster)
    return min(max(rate, now - down * c), now + up * c)


def stop_and_turn(error: float, v: float, omega: float, limits: DriveLimits, c: float) -> tuple[float, float]:
    """The next v [m/s] and omega [rad/s] of a robot that brakes and turns by `error` [rad] on the spot.

    Args:
        v: Speed now, m/s.
        omega: Yaw rate now, rad/s.
        limits: What the base can do.
        c: Control period, s.
    """
    return braked(v, limits.deceleration, c), spin(
        error, omega, limits.omega_max, limits.angular_acceleration, limits.angular_deceleration, c
    )


def braked(v: float, deceleration: float, c: float) -> float:
    """`v` [m/s] after a period `c` [s] of `deceleration` [m/s^2], which may be infinite."""
    return math.copysign(max(abs(v) - min(deceleration, abs(v) / c) * c, 0.0), v)


@kernel
def reachable(limits: DriveLimits, v: float, omega: float, count: int, period: float) -> tuple[FloatArray, FloatArray]:
    """(count, 2) least and largest v [m/s] and omega [rad/s] at the end of each of the next periods, from those now."""
    low, high = np.empty((count, 2)), np.empty((count, 2))
    for j in range(2):
        if j == 0:
            now, floor, top = v, limits.v_min, limits.v_max
            grow, fall = limits.acceleration, limits.deceleration
        else:
            now, floor, top = omega, -limits.omega_max, limits.omega_max
            grow, fall = limits.angular_acceleration, limits.angular_deceleration
        up, down = (grow, fall) if now >= 0.0 else (fall, grow)
        for k in range(count):
            t = (k + 1) * period
            low[k, j], high[k, j] = max(floor, now - down * t), min(top, now + up * t)
    return low, high
