"""The moving base: limits, exact arcs, odometry, and contact that no step can jump over.

Contact is found by conservative advancement (Mirtich 1996): a gap of d metres that closes at no more than r m/s stays
open for d / r seconds, so nothing has to be looked at before. For what stands still the gap is kept across steps, as
an appointment on the robot's odometer, which counts the metres that no point of its footprint can have exceeded.

Disturbed, the robot ends a control period exactly one draw away from where it would have ended without: the draw grows
evenly over the period, so that contact on the way is as exact as ever.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.distance import gap
from clearway.geometry.motion import arc, ramp
from clearway.geometry.packing import to_box, transform
from clearway.geometry.raycast import cast, cast_moving
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normal, uniform
from clearway.robots import Odometry
from clearway.robots.drive_limits import DriveLimits
from clearway.scenarios.scenario import DisturbanceSpec
from clearway.world.tracks import pose_at

STEP = 0.01
"""Longest step of the plant, s."""
TOUCH = 1e-5
"""A gap below this is contact, m: conservative advancement comes close, but never to zero."""
_LOOK = 0.1  # m: nearer than this to a body's box, its true outline is measured

# the state of a robot, a row of float64
X, Y, THETA, V, OMEGA = 0, 1, 2, 3, 4
ODOM_X, ODOM_Y, ODOM_THETA, ODOM_V, ODOM_OMEGA = 5, 6, 7, 8, 9
ODOMETER, NEXT_CHECK, ELAPSED = 10, 11, 12  # m; the first reading at which a static body must be looked at; s
STATE = 13


def odometry_errors(odometry: Odometry, key: np.uint64) -> FloatArray:
    """(5,) scale of distance, scale of turning (drawn for the trial), and the three growing deviations."""
    return np.array(
        [1.0 + odometry.scale * normal(key, -1, 0), 1.0 + odometry.scale * normal(key, -1, 1),
         odometry.translation_per_metre, odometry.rotation_per_metre, odometry.rotation_per_radian]
    )  # fmt: skip


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


@kernel
def tick(
    state: FloatArray, v: float, omega: float, count: int, rows: np.ndarray, times: FloatArray, moving_poses: FloatArray,
    period: float,
    limits: DriveLimits, errors: FloatArray, odometry_key: np.uint64, bounds: FloatArray, disturbance_key: np.uint64,
    foot: FloatArray, foot_radius: float, foot_reach: float,
    still_points: FloatArray, still_first: np.ndarray, still_radius: FloatArray, boxes: FloatArray, due: FloatArray,
    points: FloatArray, first: np.ndarray, radius: FloatArray, reach: FloatArray, knots: FloatArray, speed: FloatArray,
    slack: FloatArray,
) -> int:  # fmt: skip
    """Drive for one control period, or until contact.

    Args:
        state: (STATE,), updated; ELAPSED is the time driven. v, omega: the command. count: of control periods so far.
        limits: of the base. errors, bounds: see `odometry_errors`, `disturbance_bounds`. foot...: the footprint, packed.
        still_...: bodies that stand still, packed in the map frame, with their boxes (n, 4), and when each is due: the
        reading of the odometer up to which it needs no look. points...: moving bodies, packed in their own frames,
        with their tracks; slack: metres for which each needs no look.
        rows: (m, 2) of the current leg's tracks. times: (m,) s, now, on the clock of each. moving_poses: (m, 3), filled
        for the end.

    Returns:
        -1, or the body that was touched: the static ones count first, then the moving ones.
    """
    n = max(1, math.ceil(period / STEP - 1e-9))
    h = period / n
    v_goal = min(max(v, limits.v_min), limits.v_max)
    w_goal = min(max(omega, -limits.omega_max), limits.omega_max)
    robot, shape = np.empty_like(foot), np.empty_like(points)
    here, there = np.empty(3), np.empty(3)
    noise_v, noise_w = 0.0, 0.0
    hit = -1
    done = 0.0
    push = np.zeros(5)
    at_rest = v_goal == 0.0 and w_goal == 0.0 and state[V] == 0.0 and state[OMEGA] == 0.0
    if bounds[:4].max() > 0.0 and (bounds[4] > 0.0 or not at_rest):
        disturb(bounds, disturbance_key, count, push)
    push[:3] /= period
    drift = math.hypot(push[0], push[1])
    nx, ny, nt = state[X], state[Y], state[THETA]  # where it would be without displacement
    for i in range(n):
        v0, w0 = state[V], state[OMEGA]
        v1, driven = ramp(v0, v_goal, limits.acceleration, limits.deceleration, h)
        w1, steered = ramp(w0, w_goal, limits.angular_acceleration, limits.angular_deceleration, h)
        vm, wm = driven + push[3], steered + push[4]
        x, y = state[X], state[Y]
        advance = abs(vm) + drift
        rate = advance + (abs(wm) + abs(push[2])) * foot_reach
        until = h  # contact, or the end of the step

        if state[NEXT_CHECK] <= state[ODOMETER] + rate * h:
            for b in range(due.shape[0]):
                if due[b] > state[ODOMETER] + rate * until:
                    continue
                s = max(0.0, (due[b] - state[ODOMETER]) / rate) if rate > 0.0 else 0.0
                shape_b = still_points[still_first[b] : still_first[b + 1]]
                while s <= until:
                    px, py, pt = _displaced(nx, ny, nt, vm, wm, s, push, done)
                    d = to_box(boxes, b, px, py) - foot_reach
                    if d < _LOOK:
                        transform(foot, px, py, pt, robot)
                        d = gap(robot, foot_radius, shape_b, still_radius[b])
                        if d <= TOUCH:
                            until, hit = s, b
                            break
                    due[b] = state[ODOMETER] + rate * s + d
                    if rate <= 0.0:
                        break
                    s += d / rate
            state[NEXT_CHECK] = due.min() if due.shape[0] > 0 else math.inf

        for m in range(reach.shape[0]):
            closing = (advance + speed[m]) * h
            if slack[m] > closing:
                slack[m] -= closing
                continue
            slack[m] = 0.0
            before = pose_at(knots, rows[m, 0], rows[m, 1], times[m] + done, here)
            after = pose_at(knots, rows[m, 0], rows[m, 1], times[m] + done + h, there)
            if not (before or after):
                continue
            if not before:  # it comes or goes within this step
                here[:] = there
            elif not after:
                there[:] = here
            apart = math.hypot(here[0] - x, here[1] - y) - reach[m] - foot_reach
            if apart > closing and before and after:
                slack[m] = apart - closing
                continue
            ux, uy, turn = (there[0] - here[0]) / h, (there[1] - here[1]) / h, wrap(there[2] - here[2]) / h
            relative = rate + math.hypot(ux, uy) + abs(turn) * reach[m]
            shape_m = shape[first[m] : first[m + 1]]
            s = 0.0
            while s <= until:
                px, py, pt = _displaced(nx, ny, nt, vm, wm, s, push, done)
                transform(foot, px, py, pt, robot)
                transform(
                    points[first[m] : first[m + 1]], here[0] + s * ux, here[1] + s * uy, here[2] + s * turn, shape_m
                )
                d = gap(robot, foot_radius, shape_m, radius[m])
                if d <= TOUCH:
                    if s < until or hit < 0:
                        until, hit = s, due.shape[0] + m
                    break
                if relative <= 0.0:
                    break
                s += d / relative

        state[X], state[Y], state[THETA] = _displaced(nx, ny, nt, vm, wm, until, push, done)
        nx, ny, nt = arc(nx, ny, nt, vm, wm, until)
        share = until / h
        state[V], state[OMEGA] = v0 + share * (v1 - v0), w0 + share * (w1 - w0)
        state[ODOMETER] += rate * until
        done += until
        distance, turned = driven * until, steered * until  # wheels don't know of disturbance
        e_v = errors[2] * math.sqrt(abs(distance)) * normal(odometry_key, count * n + i, 0)
        spread = math.sqrt(errors[3] * errors[3] * abs(distance) + errors[4] * errors[4] * abs(turned))
        e_w = spread * normal(odometry_key, count * n + i, 1)
        state[ODOM_X], state[ODOM_Y], state[ODOM_THETA] = arc(
            state[ODOM_X], state[ODOM_Y], state[ODOM_THETA], errors[0] * distance + e_v, errors[1] * turned + e_w, 1.0
        )
        noise_v += e_v
        noise_w += e_w
        if hit >= 0:
            break
    state[ELAPSED] = done
    if done > 0.0:
        state[ODOM_V] = errors[0] * state[V] + noise_v / period
        state[ODOM_OMEGA] = errors[1] * state[OMEGA] + noise_w / period
    for m in range(reach.shape[0]):
        pose_at(knots, rows[m, 0], rows[m, 1], times[m] + (done if hit >= 0 else period), moving_poses[m])
    return hit


@kernel
def _displaced(
    x: float, y: float, theta: float, v: float, omega: float, s: float, push: FloatArray, done: float
) -> tuple[float, float, float]:
    """The pose `s` [s] further along the arc from (x, y, theta), `done` + s after the displacement at rate `push` began."""
    px, py, pt = arc(x, y, theta, v, omega, s)
    if push[0] == 0.0 and push[1] == 0.0 and push[2] == 0.0:
        return px, py, pt
    since = done + s
    return px + since * push[0], py + since * push[1], wrap(pt + since * push[2])


@kernel
def scan(
    ranges: FloatArray, x: float, y: float, theta: float, count: int,
    mount: FloatArray, segments: FloatArray, circles: FloatArray,
    moving_segments: FloatArray, segment_owner: np.ndarray, moving_circles: FloatArray, circle_owner: np.ndarray,
    moving_poses: FloatArray,
    directions: FloatArray, optics: FloatArray, key: np.uint64,
) -> None:  # fmt: skip
    """One sweep of the lidar into `ranges` (n,), with noise; inf: no return.

    Args:
        x, y, theta: the robot's pose; mount: (3,) the sensor's in it. optics: (5,) angle_min, increment, range_min,
        range_max, sigma. key, count: of the noise.
    """
    c, s = math.cos(theta), math.sin(theta)
    sx, sy, st = x + c * mount[0] - s * mount[1], y + s * mount[0] + c * mount[1], theta + mount[2]
    nearest, farthest, sigma = optics[2], optics[3], optics[4]
    ranges[:] = math.inf
    cast(segments, circles, sx, sy, st, directions, optics[0], optics[1], farthest, ranges)
    cast_moving(moving_segments, segment_owner, moving_circles, circle_owner, moving_poses, sx, sy, st,
                directions, optics[0], optics[1], farthest, ranges)  # fmt: skip
    for i in range(ranges.shape[0]):
        if ranges[i] <= farthest:
            r = ranges[i] + sigma * normal(key, count, i) if sigma > 0.0 else ranges[i]
            ranges[i] = r if nearest <= r <= farthest else math.inf
        else:
            ranges[i] = math.inf
