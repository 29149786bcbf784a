"""The moving base: limits, exact arcs, odometry, and contact that no step can jump over.

Contact is found by conservative advancement (Mirtich 1996): a gap of d metres that closes at no more than r m/s stays
open for d / r seconds, so nothing has to be looked at before. For what stands still the gap is kept across steps, as
the reading of the robot's odometer at which it has to be looked at next; that counts the metres that no point of its
footprint can have exceeded.

Disturbed, the robot ends a control period exactly one draw away from where it would have ended without: the draw grows
evenly over the period, so that contact on the way is as exact as ever.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.distance import gap
from clearway.geometry.held import Held
from clearway.geometry.motion import arc, ramp
from clearway.geometry.packing import Packed, to_box, transform
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normal, uniform
from clearway.robots import Odometry
from clearway.robots.drive_limits import DriveLimits
from clearway.scenarios.scenario import DisturbanceSpec
from clearway.world.tracks import Tracks, knot_at, on_line, pose_at

STEP = 0.01
"""Longest step of the plant, s."""
TOUCH = 1e-5
"""A gap below this is contact, m: conservative advancement comes close, but never to zero."""
_INSTANT = 1e-12  # s: the least in which a base without limits is at its command
_LOOK = 0.1  # m: nearer than this to a body's box, its true outline is measured

# the state of a robot, a row of float64
X, Y, THETA, V, OMEGA = 0, 1, 2, 3, 4
ODOM_X, ODOM_Y, ODOM_THETA, ODOM_V, ODOM_OMEGA = 5, 6, 7, 8, 9
WAY = 8  # so many of them have a value at each step; measured velocities are those of a whole period
ODOMETER, NEXT_CHECK, ELAPSED = 10, 11, 12  # m; the first reading at which a static body must be looked at; s
STATE = 13


class OdometryErrors(NamedTuple):
    """What the odometry of a trial makes of the wheels' motion; the drift's three are standard deviations.

    Attributes:
        distance: A metre of the wheels is told as so many.
        turn: A radian of the wheels is told as so many.
        curvature: Turn that is imagined per metre, rad/m.
        translation_per_metre: Drift, m per sqrt(m).
        rotation_per_metre: Drift, rad per sqrt(m).
        rotation_per_radian: Drift, rad per sqrt(rad).
        speed_noise: Of the measured velocities, as a share of them; negative: what the drift makes of them.
        yaw_rate_noise: Of the measured yaw rate beside that, rad/s per m/s.
    """

    distance: float
    turn: float
    curvature: float
    translation_per_metre: float
    rotation_per_metre: float
    rotation_per_radian: float
    speed_noise: float
    yaw_rate_noise: float


def odometry_errors(odometry: Odometry, key: np.uint64) -> OdometryErrors:
    """The errors of `odometry` in the trial of the random stream `key`: the systematic ones are drawn."""
    return OdometryErrors(
        distance=1.0 + odometry.scale * normal(key, -1, 0),
        turn=1.0 + odometry.turning * normal(key, -1, 1),
        curvature=odometry.curvature * normal(key, -1, 2),
        translation_per_metre=odometry.translation_per_metre,
        rotation_per_metre=odometry.rotation_per_metre,
        rotation_per_radian=odometry.rotation_per_radian,
        speed_noise=-1.0 if odometry.speed_noise is None else odometry.speed_noise,
        yaw_rate_noise=odometry.yaw_rate_noise,
    )


def disturbance_bounds(spec: DisturbanceSpec | None) -> FloatArray:
    """(5,) position [m], heading [rad], v [m/s], omega [rad/s], and 1 where it also moves a robot that stands."""
    if spec is None:
        return np.zeros(5)
    return np.array([spec.position, spec.heading, spec.velocity, spec.turn, float(spec.at_rest)])


@kernel
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


class Vehicle(NamedTuple):
    """The robot that the plant moves, and what its wheels tell of it.

    Attributes:
        period: A control period, s.
        limits: Of its base.
        errors: Of its odometry.
        odometry_key: The random stream of the odometry.
        bounds: (5,) see `disturbance_bounds`.
        disturbance_key: The random stream of the disturbance.
        outline: (k, 2) points of its footprint in its own frame, m.
        rim: By which they are thickened, m.
        reach: Radius around the frame's origin that no part of the footprint leaves, m.
    """

    period: float
    limits: DriveLimits
    errors: OdometryErrors
    odometry_key: np.uint64
    bounds: FloatArray
    disturbance_key: np.uint64
    outline: FloatArray
    rim: float
    reach: float


class Still(NamedTuple):
    """The n bodies that stand still.

    Attributes:
        shapes: Packed in the map frame.
        boxes: (n, 4) around each, see `packing.boxes`.
        due: (n,) reading of the odometer up to which each needs no look, m; kept from period to period.
    """

    shapes: Packed
    boxes: FloatArray
    due: FloatArray


class Moving(NamedTuple):
    """The m bodies that move.

    Attributes:
        shapes: Packed, each in its own frame.
        tracks: Where they are, and when.
        since: (m,) time at which the clock of each began, s.
        slack: (m,) way for which each needs no look, m; kept from period to period.
        poses: (m, 3) now, map frame, NaN if absent; written at the end of each period.
    """

    shapes: Packed
    tracks: Tracks
    since: FloatArray
    slack: FloatArray
    poses: FloatArray


class Setting(NamedTuple):
    """Who moves, among what.

    Attributes:
        vehicle: The robot.
        still: What stands.
        moving: What moves.
        commands: (k, 3) what the base follows in the period that begins: since when, s after the period began, from 0 on and
            rising, inf where there is no more; forward speed, m/s; yaw rate, rad/s.
        way: (n + 1, 8) what the robot's first eight states were at the ends of the last period's n steps; written in each
            period, after a contact only as far as it came.
    """

    vehicle: Vehicle
    still: Still
    moving: Moving
    commands: FloatArray
    way: FloatArray


@kernel
def hold(setting: Setting) -> Held[Setting]:
    """`setting`, as `tick` takes it."""
    return Held(setting)


class Step(NamedTuple):
    """The way in one step of the plant: an arc, and a displacement that grows evenly over the control period.

    Attributes:
        x: Where it begins, without displacement, m.
        y: The same.
        theta: The heading there, rad.
        v: Mean speed, m/s.
        omega: Mean yaw rate, rad/s.
        push: (5,) displacement per time in x, y [m/s] and heading [rad/s]; the rest is not for the way.
        since: For how long the displacement has been growing, s.
        duration: How long it takes, s.
        advance: What the robot's origin does not exceed, m/s.
        rate: What no point of its footprint exceeds, m/s.
    """

    x: float
    y: float
    theta: float
    v: float
    omega: float
    push: FloatArray
    since: float
    duration: float
    advance: float
    rate: float


class _Room(NamedTuple):
    """For what is where, while it is looked at: the footprint, the moving bodies, and a pose of one of them."""

    outline: FloatArray
    shapes: FloatArray
    here: FloatArray


@kernel
def steps(period: float) -> int:
    """Into how many steps of the plant a control `period` [s] is cut."""
    return max(1, math.ceil(period / STEP - 1e-9))


@kernel
def tick(state: FloatArray, count: int, leg: int, t: float, held: Held[Setting]) -> int:
    """Drive for one control period, or until contact, as the commands say.

    Args:
        state: (STATE,), updated; ELAPSED is the time driven.
        count: Number of control periods so far.
        leg: The leg whose tracks count.
        t: Time now, s.

    Returns:
        -1, or the body that was touched: the static ones count first, then the moving ones.
    """
    vehicle, still, moving, commands, way = held.value
    period, limits, errors, odometry_key = vehicle.period, vehicle.limits, vehicle.errors, vehicle.odometry_key
    bounds, slack, speed = vehicle.bounds, moving.slack, moving.tracks.speed
    n = steps(period)
    h = period / n
    noise_v, noise_w = 0.0, 0.0
    hit = -1
    done = 0.0
    push = np.zeros(5)
    at_rest = state[V] == 0.0 and state[OMEGA] == 0.0 and _stands(commands)
    if bounds[:4].max() > 0.0 and (bounds[4] > 0.0 or not at_rest):
        disturb(bounds, vehicle.disturbance_key, count, push)
    push[:3] /= period
    drift = math.hypot(push[0], push[1])
    nx, ny, nt = state[X], state[Y], state[THETA]  # where it would be without displacement
    room = _Room(np.empty_like(vehicle.outline), np.empty_like(moving.shapes.points), np.empty(3))
    way[0] = state[:WAY]
    for i in range(n):
        v0, w0 = state[V], state[OMEGA]
        v1, driven, w1, steered = _follow(commands, limits, v0, w0, i * h, h)
        vm, wm = driven + push[3], steered + push[4]
        advance = abs(vm) + drift
        rate = advance + (abs(wm) + abs(push[2])) * vehicle.reach
        step = Step(nx, ny, nt, vm, wm, push, done, h, advance, rate)
        until = h  # contact, or the end of the step
        if state[NEXT_CHECK] <= state[ODOMETER] + rate * h:
            until, hit = _meet_still(state, step, vehicle, still, room)
        for m in range(len(slack)):
            closing = (advance + speed[m]) * h
            if slack[m] > closing:
                slack[m] -= closing
                continue
            s, touched = _meet_moving(state, step, vehicle, moving, m, leg, t, until, room)
            if touched and (s < until or hit < 0):
                until, hit = s, len(still.due) + m

        state[X], state[Y], state[THETA] = _displaced(step, until)
        nx, ny, nt = arc(nx, ny, nt, vm, wm, until)
        if hit >= 0:  # in the midst of the step; without limits the base is at its command at once
            passed = max(until, _INSTANT)
            v1, _, w1, _ = _follow(commands, limits, v0, w0, i * h, passed)
        state[V], state[OMEGA] = v1, w1
        state[ODOMETER] += rate * until
        done += until
        distance, turned = driven * until, steered * until  # wheels don't know of disturbance
        e_v = errors.translation_per_metre * math.sqrt(abs(distance)) * normal(odometry_key, count * n + i, 0)
        per_metre, per_radian = errors.rotation_per_metre, errors.rotation_per_radian
        spread = math.sqrt(per_metre * per_metre * abs(distance) + per_radian * per_radian * abs(turned))
        e_w = spread * normal(odometry_key, count * n + i, 1)
        told = errors.distance * distance + e_v, errors.turn * turned + errors.curvature * distance + e_w
        state[ODOM_X], state[ODOM_Y], state[ODOM_THETA] = arc(
            state[ODOM_X], state[ODOM_Y], state[ODOM_THETA], told[0], told[1], 1.0
        )
        noise_v += e_v
        noise_w += e_w
        way[i + 1] = state[:WAY]
        if hit >= 0:
            break
    state[ELAPSED] = done
    if done > 0.0:
        if errors.speed_noise >= 0.0:
            spread = math.hypot(errors.speed_noise * state[OMEGA], errors.yaw_rate_noise * state[V])
            noise_v = period * errors.speed_noise * state[V] * normal(odometry_key, count, 2)
            noise_w = period * spread * normal(odometry_key, count, 3)
        state[ODOM_V] = errors.distance * state[V] + noise_v / period
        state[ODOM_OMEGA] = errors.turn * state[OMEGA] + errors.curvature * state[V] + noise_w / period
    tracks, since, poses = moving.tracks, moving.since, moving.poses
    for m in range(len(since)):
        first, last = tracks.rows[leg, m, 0], tracks.rows[leg, m, 1]
        pose_at(tracks.knots, first, last, t - since[m] + (done if hit >= 0 else period), poses[m])
    return hit


@kernel
def _stands(commands: FloatArray) -> bool:
    """Whether the base is to stand for the whole period."""
    for row in range(len(commands)):
        if commands[row, 0] < math.inf and (commands[row, 1] != 0.0 or commands[row, 2] != 0.0):
            return False
    return True


@kernel
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


@kernel
def _meet_still(state: FloatArray, step: Step, vehicle: Vehicle, still: Still, room: _Room) -> tuple[float, int]:
    """When in `step` the robot touches something that stands [s], and which; its whole duration and -1 if nothing.

    Args:
        state: What it says of the next check is updated.
    """
    due, boxes, points, first, radius = (
        still.due,
        still.boxes,
        still.shapes.points,
        still.shapes.first,
        still.shapes.radius,
    )
    outline, rim, reach, rate, robot = vehicle.outline, vehicle.rim, vehicle.reach, step.rate, room.outline
    until, hit = step.duration, -1
    for b in range(due.shape[0]):
        if due[b] > state[ODOMETER] + rate * until:
            continue
        s = max(0.0, (due[b] - state[ODOMETER]) / rate) if rate > 0.0 else 0.0
        body = points[first[b] : first[b + 1]]
        while s <= until:
            x, y, theta = _displaced(step, s)
            d = to_box(boxes, b, x, y) - reach
            if d < _LOOK:
                transform(outline, x, y, theta, robot)
                d = gap(robot, rim, body, radius[b])
                if d <= TOUCH:
                    until, hit = s, b
                    break
            due[b] = state[ODOMETER] + rate * s + d
            if rate <= 0.0:
                break
            s += d / rate
    state[NEXT_CHECK] = due.min() if due.shape[0] > 0 else math.inf
    return until, hit


@kernel
def _meet_moving(
    state: FloatArray,
    step: Step,
    vehicle: Vehicle,
    moving: Moving,
    m: int,
    leg: int,
    t: float,
    until: float,
    room: _Room,
) -> tuple[float, bool]:
    """When in `step`, but not after `until` [s], the robot touches body `m`, and whether it does.

    Args:
        leg: As for `tick`.
        t: As for `tick`.
    """
    knots, here, robot = moving.tracks.knots, room.here, room.outline
    outline, rim, reach, radius, reaches = (
        vehicle.outline,
        vehicle.rim,
        vehicle.reach,
        moving.shapes.radius,
        moving.shapes.reach,
    )
    h, now = step.duration, t - moving.since[m] + step.since
    begin, end = moving.tracks.rows[leg, m, 0], moving.tracks.rows[leg, m, 1]
    moving.slack[m] = 0.0
    if pose_at(knots, begin, end, now, here):
        apart = math.hypot(here[0] - state[X], here[1] - state[Y]) - reaches[m] - reach
        closing = (step.advance + moving.tracks.speed[m]) * h
        if apart > closing:
            moving.slack[m] = apart - closing
            return until, False
    first, last = moving.shapes.first[m], moving.shapes.first[m + 1]
    shape, body = moving.shapes.points[first:last], room.shapes[first:last]
    knot, s = max(knot_at(knots, begin, end, now), begin), 0.0
    while knot < end - 1 and s <= until:  # from knot to knot it moves on a line
        s, over = max(s, knots[knot, 0] - now), knots[knot + 1, 0] - now
        line = knots[knot + 1] - knots[knot]
        knot += 1
        if not (over > s and math.isfinite(line[1])):  # one instant, or it is absent
            continue
        turn = wrap(line[3])
        relative = step.rate + (math.hypot(line[1], line[2]) + abs(turn) * reaches[m]) / line[0]
        while s <= min(until, over):
            on_line(knots, knot - 1, now + s, here)
            x, y, theta = _displaced(step, s)
            transform(outline, x, y, theta, robot)
            transform(shape, here[0], here[1], here[2], body)
            d = gap(robot, rim, body, radius[m])
            if d <= TOUCH:
                return s, True
            if relative <= 0.0:
                break
            s += d / relative
        s = min(s, over)  # the next line begins with a look
    return until, False


@kernel
def _displaced(step: Step, s: float) -> tuple[float, float, float]:
    """The pose `s` [s] after the beginning of `step`."""
    push = step.push
    x, y, theta = arc(step.x, step.y, step.theta, step.v, step.omega, s)
    if push[0] == 0.0 and push[1] == 0.0 and push[2] == 0.0:
        return x, y, theta
    since = step.since + s
    return x + since * push[0], y + since * push[1], wrap(theta + since * push[2])
