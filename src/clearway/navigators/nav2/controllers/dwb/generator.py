"""Which velocities DWB tries, and where each leads.

Behaviour after nav2_dwb_controller/dwb_plugins: one_d_velocity_iterator.hpp, xy_theta_iterator.cpp,
kinematic_parameters.hpp, standard_traj_generator.cpp and limited_accel_generator.cpp.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

_NO_CHOICE = 1e-5
"""Velocities nearer to each other than this are one, m/s or rad/s."""

_SLACK = 1.1920928955078125e-07
"""By so much a sample may pass a bound of its (squared) speed: a float's epsilon, as in the source."""


class Axis(NamedTuple):
    """Velocities along one axis.

    Attributes:
        low: Least, m/s or rad/s.
        high: Largest.
        accel: m/s^2 or rad/s^2.
        decel: Likewise, negative.
        samples: How many are tried.
    """

    low: float
    high: float
    accel: float
    decel: float
    samples: int


class Kinematics(NamedTuple):
    """What can be driven and how trajectories are laid out; `DWBParameters` tells of them. Numbers only: see `Frame`.

    Attributes:
        x: Forwards.
        y: To the left.
        w: Turning.
        min_speed: Of a sample that turns slowly, m/s; negative: none.
        max_speed: m/s; negative: none.
        min_turn: Of a sample that moves slowly, rad/s; negative: none.
        reach: Time in which a sample has to be reached, s.
        at_once: Whether trajectories have their velocity at once.
        sim_time: s.
        time_step: s; 0: by distance and angle.
        linear_step: m.
        angular_step: rad.
        twice: Whether the last point counts twice.
        first_step: Whether a command is what is reached in the first step.
    """

    x: Axis
    y: Axis
    w: Axis
    min_speed: float
    max_speed: float
    min_turn: float
    reach: float
    at_once: bool
    sim_time: float
    time_step: float
    linear_step: float
    angular_step: float
    twice: bool
    first_step: bool


@kernel
def towards(now: float, accel: float, decel: float, dt: float, target: float) -> float:
    """The velocity after `dt` on the way from `now` to `target`: rises by `accel`, falls by `decel`, which is negative."""
    if now < target:
        return min(target, now + accel * dt)
    return max(target, now + decel * dt)


@kernel
def velocities(axis: Axis, reach: float, now: float) -> FloatArray:
    """What can be reached in `reach` [s] from the velocity `now`, evenly spaced, and 0 between two of different sign."""
    now = axis.low if now < axis.low else axis.high if now > axis.high else now
    most, least = (
        towards(now, axis.accel, axis.decel, reach, axis.high),
        towards(now, axis.accel, axis.decel, reach, axis.low),
    )
    count = max(2, axis.samples)
    step = 1.0 if abs(least - most) < _NO_CHOICE else (most - least) / (count - 1)
    out = np.empty(count + 3)
    n, value, crossed = 1, least, False
    out[0] = least
    while n < out.size:
        if not crossed and value < 0.0 and value + step > 0.0 and value + step <= most + _NO_CHOICE:
            crossed = True
            out[n] = 0.0
        else:
            value += step
            if value > most + _NO_CHOICE:
                break
            out[n] = value
        n += 1
    return out[:n]


@kernel
def is_tried(kinematics: Kinematics, v: float, u: float, w: float) -> bool:
    """Whether a velocity is fast enough and not too fast."""
    squared = v * v + u * u
    least, most = kinematics.min_speed, kinematics.max_speed
    if most >= 0.0 and squared > most * most + _SLACK:
        return False
    slow = least >= 0.0 and squared + _SLACK < least * least
    if slow and kinematics.min_turn >= 0.0 and abs(w) + _SLACK < kinematics.min_turn:
        return False
    return squared != 0.0 or w != 0.0


@kernel
def steps_of(kinematics: Kinematics, v: float, u: float, w: float) -> int:
    """Number of steps of a trajectory, at least one."""
    if kinematics.time_step > 0.0:
        return max(1, math.ceil(kinematics.sim_time / kinematics.time_step))
    far, around = math.hypot(v, u) * kinematics.sim_time, abs(w) * kinematics.sim_time
    return max(1, math.ceil(max(far / kinematics.linear_step, around / kinematics.angular_step)))


@kernel
def turn(kinematics: Kinematics, yaw: float, now: float, w: float, steps: int, out: FloatArray) -> float:
    """Fill `out` (> steps, 3) with a trajectory's headings: yaw, cosine, sine; returns the first step's yaw rate.

    Args:
        yaw: At its beginning, rad.
        now: Yaw rate at its beginning, rad/s.
        w: That it heads for, rad/s.
    """
    dt = kinematics.sim_time / steps
    rate = w if kinematics.at_once else now
    first = w
    for i in range(steps + 1):
        out[i, 0], out[i, 1], out[i, 2] = yaw, math.cos(yaw), math.sin(yaw)
        if rate != w:
            rate = towards(rate, kinematics.w.accel, kinematics.w.decel, dt, w)
        if i == 0:
            first = rate
        yaw += rate * dt
    return first


@kernel
def walk(
    kinematics: Kinematics,
    x: float,
    y: float,
    v_now: float,
    u_now: float,
    v: float,
    u: float,
    steps: int,
    headings: FloatArray,
    out: FloatArray,
) -> tuple[float, float, float, float]:
    """The places from (x, y) on of a trajectory whose headings are known; `out` (> steps, 2) is filled unless it is empty.

    Returns:
        Its end (x, y), and the first step's velocity forwards and to the left.
    """
    dt = kinematics.sim_time / steps
    if kinematics.at_once:
        v_now, u_now = v, u
    first_v, first_u = v, u
    keep = out.shape[0] > 0
    for i in range(steps):
        if keep:
            out[i, 0], out[i, 1] = x, y
        if v_now != v:
            v_now = towards(v_now, kinematics.x.accel, kinematics.x.decel, dt, v)
        if u_now != u:
            u_now = towards(u_now, kinematics.y.accel, kinematics.y.decel, dt, u)
        if i == 0:
            first_v, first_u = v_now, u_now
        x += (v_now * headings[i, 1] - u_now * headings[i, 2]) * dt
        y += (v_now * headings[i, 2] + u_now * headings[i, 1]) * dt
    if keep:
        out[steps, 0], out[steps, 1] = x, y
    return x, y, first_v, first_u
