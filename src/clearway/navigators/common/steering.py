"""How a car's velocities follow its commands, seen from period to period: without the angle of its wheels, which nobody tells."""

from __future__ import annotations

import math

from clearway.geometry.compiled import kernel
from clearway.geometry.motion import ramp
from clearway.robots.drive_limits import DriveLimits, steering_angle

_CRAWLING = 1e-3  # m/s, below which the curvature tells nothing of the wheels


@kernel
def steered(
    limits: DriveLimits, v: float, omega: float, v_goal: float, w_goal: float, dt: float
) -> tuple[float, float, float, float]:
    """v [m/s] and its mean, omega [rad/s] and its mean after `dt` [s] on the way from `v`, `omega` to what it is told.

    The wheels are where the curvature that it drives says; at a stand they are taken to be where they are to go.
    """
    driven = abs(v) > _CRAWLING
    now = math.atan(limits.wheelbase * omega / v) if driven else 0.0
    goal = now if v_goal == 0.0 and w_goal == 0.0 else steering_angle(limits, v_goal, w_goal)
    front, angle = ramp(now if driven else goal, goal, limits.steering_rate, limits.steering_rate, dt)
    v_end, mean = ramp(v, v_goal, limits.acceleration, limits.deceleration, dt)
    return v_end, mean, v_end * math.tan(front) / limits.wheelbase, mean * math.tan(angle) / limits.wheelbase
