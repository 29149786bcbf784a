"""The way home: along the field to the goal's very centre, where a base with bounded acceleration stops.

The search's layers are too coarse to end a way on a spot; what is found here is one more candidate beside its ways.
"""

from __future__ import annotations

import math

from clearway.geometry.compiled import light
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.motion import spin
from clearway.navigators.hp_st.environment.field import Field, look
from clearway.robots.drive_limits import DriveLimits

_BRAKING = 0.9  # share of the deceleration that is used: the rest is for what was rounded to periods


@light
def home(
    start: FloatArray, limits: DriveLimits, field: Field, period: float, reach: float, commands: FloatArray
) -> None:
    """Fill `commands` (N, 2) that lead from `start` (5,) along `field` and stop within `reach` [m] of its goal.

    Args:
        start: (5,) x, y, theta, v, omega now.
        limits: Limits of the base.
        field: Distances to the goal.
        period: Control period in seconds.
        reach: Radius around the goal that is near enough, in metres.
        commands: (N, 2) v [m/s] and omega [rad/s], filled.
    """
    x, y, theta, v, w = start[0], start[1], start[2], start[3], start[4]
    c, fall = period, _BRAKING * limits.deceleration
    low, high, turn = limits.v_min, limits.v_max, limits.omega_max
    for k in range(len(commands)):
        far, ux, uy = look(field, x, y)
        off = math.atan2(math.cos(theta) * uy - math.sin(theta) * ux, math.cos(theta) * ux + math.sin(theta) * uy)
        way, top = 1.0, high
        if low < 0.0 and far / -low + (math.pi - abs(off)) / turn < far / top + abs(off) / turn:
            way, top = -1.0, -low
            off -= math.copysign(math.pi, off)
        if far <= 0.5 * reach:
            v_goal, w_goal = 0.0, 0.0
        else:
            # so fast that what is left after this period is enough to brake; and slowly while it points elsewhere
            fast = fall * (math.sqrt(c * c + 2.0 * far / fall) - c)
            v_goal = way * min(top, fast) * max(math.cos(off), 0.0) ** 2
            w_goal = spin(off, w, turn, limits.angular_acceleration, limits.angular_deceleration, c)
        commands[k, 0], commands[k, 1] = v_goal, w_goal
        v, v_mean = ramp(v, v_goal, limits.acceleration, limits.deceleration, c)
        w, w_mean = ramp(w, w_goal, limits.angular_acceleration, limits.angular_deceleration, c)
        x, y, theta = arc(x, y, theta, v_mean, w_mean, c)
