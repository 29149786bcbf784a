"""Motion that neither the planner nor the tracking problem provides: turning on the spot."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.robots.drive_limits import DriveLimits


@kernel
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
    v = math.copysign(max(abs(v) - min(limits.deceleration, abs(v) / c) * c, 0.0), v)
    return v, spin(error, omega, limits.omega_max, limits.angular_acceleration, limits.angular_deceleration, c)


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


@kernel
def turn_first(points: FloatArray, inputs: FloatArray, theta: float, beyond: float, rate: float, c: float) -> int:
    """Begin a reference with a turn on the spot where it leads off in too different a direction, in place.

    A differential drive can't follow a path that starts behind it, and a short horizon doesn't show that turning pays.

    Args:
        points: (n + 1, 3) reference poses.
        inputs: (n, 2) their v, omega.
        theta: Heading of the robot, rad.
        beyond: Deviation up to which the tracking system turns while it drives, rad.
        rate: Yaw rate of the turn, rad/s.
        c: Control period, s.

    Returns:
        How many periods the turn takes, 0: none; the rest of the reference comes that much later.
    """
    n = len(inputs)
    away = turn_between(theta, points[1, 2])
    moves = math.hypot(points[n, 0] - points[0, 0], points[n, 1] - points[0, 1]) > 1e-6
    if abs(away) <= beyond or not moves:
        return 0
    turn = min(math.ceil((abs(away) - 0.5 * beyond) / (rate * c)), n)
    for k in range(n, turn, -1):
        points[k] = points[k - turn]
        inputs[k - 1] = inputs[k - turn - 1]
    each = math.copysign(rate * c, away)
    for k in range(1, turn + 1):
        points[k, 0], points[k, 1] = points[0, 0], points[0, 1]
        points[k, 2] = wrap(theta + each * k)
        inputs[k - 1, 0], inputs[k - 1, 1] = 0.0, each / c
    return turn
