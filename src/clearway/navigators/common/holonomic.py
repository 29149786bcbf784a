"""How a base follows a velocity of any direction: a differential drive one that it can't take up at once.

Alonso-Mora, Breitenmoser, Rufli, Beardsley, Siegwart 2013 ("Optimal reciprocal collision avoidance for multiple non-holonomic
robots"): for a time T it drives the arc at whose end it heads along the velocity, at the speed that brings it as near as can be to
where the velocity would have brought it. What it is off then is the tracking error; that bounds which velocities may be asked of it.
"""

from __future__ import annotations

import math

from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.robots.drive_limits import DriveLimits, possible


@kernel
def turning_time(turn: float, time: float, omega_max: float) -> float:
    """How long the arc takes, s: `time` T, or as long as the base needs to `turn` [rad]."""
    return max(time, abs(turn) / omega_max)


@kernel
def follow(vx: float, vy: float, theta: float, time: float, v_max: float, omega_max: float) -> tuple[float, float]:
    """v [m/s] and omega [rad/s] of a base that heads for `theta` [rad] and is to go at (vx, vy) [m/s]."""
    speed = math.sqrt(vx * vx + vy * vy)
    if speed == 0.0:
        return 0.0, 0.0
    turn = turn_between(theta, math.atan2(vy, vx))
    omega = turn / turning_time(turn, time, omega_max)
    if abs(turn) > 0.5 * math.pi:
        return 0.0, omega
    if abs(turn) > 1e-4:
        speed *= 0.5 * turn * math.sin(turn) / (1.0 - math.cos(turn))
    return min(speed, v_max), omega


def slide_along(
    vx: float, vy: float, pose: FloatArray, ahead: FloatArray, time: float, limits: DriveLimits
) -> tuple[float, float, float]:
    """v [m/s], omega [rad/s] and v_y [m/s] of an omnidirectional base at `pose` (3,) that is to go at (vx, vy) [m/s].

    Meanwhile it turns to `ahead` (2,), the direction in which it wants to look, in `time` [s] where it can; zero: it
    doesn't turn.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    omega = 0.0
    if ahead.any():
        turn = turn_between(float(pose[2]), math.atan2(ahead[1], ahead[0]))
        omega = turn / turning_time(turn, time, limits.omega_max)
    return possible(limits, c * vx + s * vy, omega, c * vy - s * vx)
