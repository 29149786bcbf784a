"""The moving base: limits, lag, slip, exact arcs, odometry.

The base's controller sets the wheels to what it is commanded, within its limits of acceleration; the wheels follow that by first
order, with a time constant (`lag`); the base moves as much less than they turn as they slip (`grip`). Odometry counts wheels.

Disturbed, the robot ends a control period exactly one draw away from where it would have ended without: the draw grows
evenly over the period, so that contact on the way is as exact as ever.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import light
from clearway.geometry.motion import ramp, slide
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normal, uniform
from clearway.robots.drive_limits import DriveLimits, possible, steering_angle
from clearway.world.contact import Step, displaced, meet_moving, meet_still
from clearway.world.setting import (
    ELAPSED,
    NEXT_CHECK,
    ODOM_OMEGA,
    ODOM_THETA,
    ODOM_V,
    ODOM_V_Y,
    ODOM_X,
    ODOM_Y,
    ODOMETER,
    OMEGA,
    SET_OMEGA,
    SET_V,
    SET_V_Y,
    STEERING,
    THETA,
    V_Y,
    WAY,
    Setting,
    V,
    Vehicle,
    X,
    Y,
    steps,
)
from clearway.world.tracks import pose_at

_LEEWAY = 1e-3  # m: more than contact and rounding take
_INSTANT = 1e-12  # s: the least in which a base without limits is at its command
_STICKS = 1e-3  # m/s and rad/s: slower than that, a lagging base that is set to stand does


@light
def disturb(bounds: FloatArray, key: np.uint64, count: int, out: FloatArray) -> None:
    """What control period `count` does to the robot beyond its command, drawn within `bounds` (5,).

    Args:
        out: (5,), filled: displacement in x and y [m], uniform in a disc, and in heading [rad]; deviations of v [m/s]
            and omega [rad/s] from what the base drives.
    """
    radius, angle = bounds[0] * math.sqrt(uniform(key, count, 0)), 2.0 * math.pi * uniform(key, count, 1)
    out[0], out[1] = radius * math.cos(angle), radius * math.sin(angle)
    for i in range(1, 4):
        out[i + 1] = bounds[i] * (2.0 * uniform(key, count, i + 1) - 1.0)


@light
def drive_period(state: FloatArray, count: int, leg: int, t: float, setting: Setting) -> int:
    """Drive for one control period, or until contact, as the commands say.

    Args:
        state: (STATE,), updated; ELAPSED is the time driven.
        count: Number of control periods so far.
        leg: The leg whose tracks count.
        t: Time now, s.

    Returns:
        -1, or the body that was touched: the static ones count first, then the moving ones.
    """
    vehicle, still, moving, commands, way, room = setting
    period, errors, odometry_key = vehicle.period, vehicle.errors, vehicle.odometry_key
    bounds, slack, speed = vehicle.bounds, moving.slack, moving.tracks.speed
    n = steps(period)
    h = period / n
    noise_v, noise_w, noise_y = 0.0, 0.0, 0.0
    hit = -1
    done = 0.0
    push, grip, turn_grip = room.push, vehicle.grip, vehicle.turn_grip
    for c in range(5):
        push[c] = 0.0
    at_rest = state[V] == 0.0 and state[OMEGA] == 0.0 and state[V_Y] == 0.0 and _stands(commands)
    disturbed = bounds[0] > 0.0 or bounds[1] > 0.0 or bounds[2] > 0.0 or bounds[3] > 0.0
    if disturbed and (bounds[4] > 0.0 or not at_rest):
        disturb(bounds, vehicle.disturbance_key, count, push)
    for c in range(3):
        push[c] /= period
    drift = math.hypot(push[0], push[1])
    nx, ny, nt = state[X], state[Y], state[THETA]  # where it would be without displacement
    for c in range(WAY):
        way[0, c] = state[c]
    for i in range(n):
        wheels = _roll(state, vehicle, commands, i * h, h)
        driven, steered, slid = wheels.along, wheels.turn, wheels.aside
        vm, wm, ym = grip * driven + push[3], turn_grip * steered + push[4], grip * slid
        advance = (abs(vm) if ym == 0.0 else math.hypot(vm, ym)) + drift
        rate = advance + (abs(wm) + abs(push[2])) * vehicle.reach
        step = Step(nx, ny, nt, vm, ym, wm, push, done, h, advance, rate)
        until = h  # contact, or the end of the step
        if state[NEXT_CHECK] <= state[ODOMETER] + rate * h:
            until, hit = meet_still(state, step, vehicle, still, room)
        for m in range(len(slack)):
            closing = (advance + speed[m]) * h
            if slack[m] > closing:
                slack[m] -= closing
                continue
            s, touched = meet_moving(state, step, vehicle, moving, m, leg, t, until, room)
            if touched and (s < until or hit < 0):
                until, hit = s, len(still.due) + m

        state[X], state[Y], state[THETA] = displaced(step, until)
        nx, ny, nt = slide(nx, ny, nt, vm, ym, wm, until)
        if hit >= 0:  # in the midst of the step; without limits the base is at its command at once
            wheels = _roll(state, vehicle, commands, i * h, max(until, _INSTANT))
        state[SET_V], state[SET_OMEGA], state[SET_V_Y], state[STEERING] = (
            wheels.set_v,
            wheels.set_omega,
            wheels.set_v_y,
            wheels.steering,
        )
        state[V], state[OMEGA], state[V_Y] = grip * wheels.v, turn_grip * wheels.omega, grip * wheels.v_y
        state[ODOMETER] += rate * until
        done += until
        distance, turned = driven * until, steered * until  # wheels don't know of disturbance
        e_v = errors.translation_per_metre * math.sqrt(abs(distance)) * normal(odometry_key, count * n + i, 0)
        per_metre, per_radian = errors.rotation_per_metre, errors.rotation_per_radian
        slid *= until
        path = abs(distance) if slid == 0.0 else math.hypot(distance, slid)
        spread = math.sqrt(per_metre * per_metre * path + per_radian * per_radian * abs(turned))
        e_w = spread * normal(odometry_key, count * n + i, 1)
        told = errors.distance * distance + e_v, errors.turn * turned + errors.curvature * distance + e_w
        aside = 0.0
        if slid != 0.0:
            e_y = errors.translation_per_metre * math.sqrt(abs(slid)) * normal(odometry_key, count * n + i, 4)
            aside = errors.distance * slid + e_y
            noise_y += e_y
        state[ODOM_X], state[ODOM_Y], state[ODOM_THETA] = slide(
            state[ODOM_X], state[ODOM_Y], state[ODOM_THETA], told[0], aside, told[1], 1.0
        )
        noise_v += e_v
        noise_w += e_w
        for c in range(WAY):
            way[i + 1, c] = state[c]
        if hit >= 0:
            break
    state[ELAPSED] = done
    if done > 0.0:
        v, omega, v_y = state[V] / grip, state[OMEGA] / turn_grip, state[V_Y] / grip  # of the wheels
        if errors.speed_noise >= 0.0:
            spread = math.hypot(errors.speed_noise * omega, errors.yaw_rate_noise * v)
            noise_v = period * errors.speed_noise * v * normal(odometry_key, count, 2)
            noise_w = period * spread * normal(odometry_key, count, 3)
            if v_y != 0.0:
                noise_y = period * errors.speed_noise * v_y * normal(odometry_key, count, 5)
        state[ODOM_V] = errors.distance * v + noise_v / period
        state[ODOM_OMEGA] = errors.turn * omega + errors.curvature * v + noise_w / period
        state[ODOM_V_Y] = errors.distance * v_y + noise_y / period
    tracks, since, poses = moving.tracks, moving.since, moving.poses
    for m in range(len(since)):
        first, last = tracks.rows[leg, m, 0], tracks.rows[leg, m, 1]
        pose_at(tracks.knots, first, last, t - since[m] + (done if hit >= 0 else period), poses[m])
    return hit


@light
def unmet(before: FloatArray, after: FloatArray, leg: int, t: float, setting: Setting) -> bool:
    """Which of those that move can't be met in the control period from time `t` [s] on, by how far they are from the robot: these need no
    look, as `Moving.slack` says then. Where it is all of them, each is placed where it is at the end, as `drive_period` does it.

    Args:
        before: (STATE,) as the period begins.
        after: (STATE,) as it ends if nothing is met.
        leg: The leg whose tracks count.

    Returns:
        Whether it is all of them.
    """
    vehicle, moving = setting.vehicle, setting.moving
    tracks, since, poses, reach, slack = moving.tracks, moving.since, moving.poses, moving.shapes.reach, moving.slack
    driven = after[ODOMETER] - before[ODOMETER] + vehicle.reach + _LEEWAY
    none = True
    for m in range(len(since)):
        first, last = tracks.rows[leg, m, 0], tracks.rows[leg, m, 1]
        slack[m] = 0.0
        if first == last:
            continue
        if pose_at(tracks.knots, first, last, t - since[m], poses[m]):
            apart = math.hypot(poses[m, 0] - before[X], poses[m, 1] - before[Y])
            if apart > driven + reach[m] + tracks.speed[m] * vehicle.period:
                slack[m] = math.inf
                continue
        none = False
    if none:
        for m in range(len(since)):
            first, last = tracks.rows[leg, m, 0], tracks.rows[leg, m, 1]
            pose_at(tracks.knots, first, last, t - since[m] + vehicle.period, poses[m])
    return none


@light
def _stands(commands: FloatArray) -> bool:
    """Whether the base is to stand for the whole period."""
    for row in range(len(commands)):
        told = commands[row]
        if told[0] < math.inf and (told[1] != 0.0 or told[2] != 0.0 or told[3] != 0.0):
            return False
    return True


class _Wheels(NamedTuple):
    """What the wheels do for a while, as velocities that the base would have if none slipped; m/s and rad/s.

    Attributes:
        set_v: What they are set to at its end, forwards.
        set_omega: The same of the yaw rate.
        set_v_y: The same to the left.
        steering: A car's steering angle then, rad.
        v: How fast they turn at its end, forwards.
        omega: The same of the yaw rate.
        v_y: The same to the left.
        along: Mean of v.
        turn: Mean of omega.
        aside: Mean of v_y.
    """

    set_v: float
    set_omega: float
    set_v_y: float
    steering: float
    v: float
    omega: float
    v_y: float
    along: float
    turn: float
    aside: float


@light
def _roll(state: FloatArray, vehicle: Vehicle, commands: FloatArray, begin: float, duration: float) -> _Wheels:
    """What the wheels do in the `duration` that begins at `begin` [s] of a period, from `state` (STATE,)."""
    limits = vehicle.limits
    v_y, aside, front = 0.0, 0.0, 0.0
    if limits.v_y_max == 0.0 and limits.wheelbase == 0.0:
        v, along, omega, turn = _follow(commands, limits, state[SET_V], state[SET_OMEGA], begin, duration)
    else:
        v, along, omega, turn, v_y, aside, front = _follow_any(commands, limits, state, begin, duration)
    if vehicle.lag == 0.0:
        return _Wheels(v, omega, v_y, front, v, omega, v_y, along, turn, aside)
    # what they are set to counts as constant at its mean: end and mean are exact for that
    kept = math.exp(-duration / vehicle.lag)
    at_v, at_omega, at_y = state[V] / vehicle.grip, state[OMEGA] / vehicle.turn_grip, state[V_Y] / vehicle.grip
    to_v, to_omega, to_y = along + (at_v - along) * kept, turn + (at_omega - turn) * kept, aside + (at_y - aside) * kept
    share = vehicle.lag / duration
    along, aside = along - share * (to_v - at_v), aside - share * (to_y - at_y)
    if limits.wheelbase > 0.0:  # it turns as its front wheels stand
        turn = along * math.tan(0.5 * (state[STEERING] + front)) / limits.wheelbase
        to_omega = to_v * math.tan(front) / limits.wheelbase
    else:
        turn -= share * (to_omega - at_omega)
    if v == 0.0 and omega == 0.0 and v_y == 0.0 and max(abs(to_v), abs(to_omega), abs(to_y)) < _STICKS:
        to_v, to_omega, to_y = 0.0, 0.0, 0.0
    return _Wheels(v, omega, v_y, front, to_v, to_omega, to_y, along, turn, aside)


@light
def _follow(
    commands: FloatArray, limits: DriveLimits, v: float, omega: float, begin: float, duration: float
) -> tuple[float, float, float, float]:
    """v [m/s] and its mean, omega [rad/s] and its mean, at the end of the `duration` that begins at `begin` [s] of a period."""
    row = 0
    while row + 1 < len(commands) and commands[row + 1, 0] <= begin:
        row += 1
    end, now, way, turned = begin + duration, begin, 0.0, 0.0
    while True:
        last = row + 1 == len(commands) or commands[row + 1, 0] >= end
        span = (duration if now == begin else end - now) if last else commands[row + 1, 0] - now
        v_goal = min(max(commands[row, 1], limits.v_min), limits.v_max)
        w_goal = min(max(commands[row, 2], -limits.omega_max), limits.omega_max)
        v, mean = ramp(v, v_goal, limits.acceleration, limits.deceleration, span)
        omega, turn = ramp(omega, w_goal, limits.angular_acceleration, limits.angular_deceleration, span)
        if last and now == begin:
            return v, mean, omega, turn
        way, turned = way + mean * span, turned + turn * span
        if last:
            return v, way / duration, omega, turned / duration
        row, now = row + 1, commands[row + 1, 0]


@light
def _follow_any(
    commands: FloatArray, limits: DriveLimits, state: FloatArray, begin: float, duration: float
) -> tuple[float, float, float, float, float, float, float]:
    """`_follow` for a base that moves to the side or steers like a car, from what is set in `state` (STATE,); behind it the speed to
    the side and its mean [m/s], and the steering angle [rad]."""
    row = 0
    while row + 1 < len(commands) and commands[row + 1, 0] <= begin:
        row += 1
    end, now, way, turned, slid = begin + duration, begin, 0.0, 0.0, 0.0
    v, omega, v_y, front = state[SET_V], state[SET_OMEGA], state[SET_V_Y], state[STEERING]
    while True:
        last = row + 1 == len(commands) or commands[row + 1, 0] >= end
        span = (duration if now == begin else end - now) if last else commands[row + 1, 0] - now
        told = possible(limits, commands[row, 1], commands[row, 2], commands[row, 3])
        v, mean = ramp(v, told[0], limits.acceleration, limits.deceleration, span)
        if limits.wheelbase > 0.0:
            goal = front  # who is to stand is told no curvature
            if commands[row, 1] != 0.0 or commands[row, 2] != 0.0:
                goal = steering_angle(limits, told[0], commands[row, 2])
            front, angle = ramp(front, goal, limits.steering_rate, limits.steering_rate, span)
            omega, turn = v * math.tan(front) / limits.wheelbase, mean * math.tan(angle) / limits.wheelbase
            aside = 0.0
        else:
            omega, turn = ramp(omega, told[1], limits.angular_acceleration, limits.angular_deceleration, span)
            v_y, aside = ramp(v_y, told[2], limits.lateral_acceleration, limits.lateral_deceleration, span)
            v, omega, v_y = possible(limits, v, omega, v_y)  # no wheel is faster than it can be meanwhile
            mean, turn, aside = possible(limits, mean, turn, aside)
        way, turned, slid = way + mean * span, turned + turn * span, slid + aside * span
        if last:
            break
        row, now = row + 1, commands[row + 1, 0]
    return v, way / duration, omega, turned / duration, v_y, slid / duration, front
