"""The total force, felt now and along the horizon, and the command that follows it. All compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import arc
from clearway.geometry.shapes import FloatArray
from clearway.navigators.colregs_apf.encounters import (
    CLEAR,
    PORT,
    STAND_ON,
    STARBOARD,
    IntArray,
    classify,
    closest_approach,
    side_to_pass,
)
from clearway.navigators.colregs_apf.potentials import Gains, attraction, emergency, risk, static
from clearway.robots.drive_limits import DriveLimits

EMERGENCY = 5
"""The status beyond those of `encounters`: a moving obstacle is nearer than d_m."""
HOLD = 1.3
"""Rule 17: the stand-on robot keeps its course until the other is nearer than this many d_m."""
CHANGE = math.radians(15.0)
"""Rule 8: the least change of course that shows."""


class Pace(NamedTuple):
    """How the robot moves.

    Attributes:
        limits: What its base can do; `v_max` is the speed that it drives at.
        turn_gain: Yaw rate by heading error, 1/s.
        period: Control period, s.
    """

    limits: DriveLimits
    turn_gain: float
    period: float


@kernel
def total(
    x: float, y: float, vx: float, vy: float, ahead: float, goal: FloatArray, discs: FloatArray, kinds: IntArray,
    sides: FloatArray, area: FloatArray, radius: float, gains: Gains,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Potential and force at (x, y) for a robot that moves with (vx, vy), `ahead` seconds from now.

    Args:
        goal: (2,) its place, m.
        discs: (n, 6) x, y [m], vx, vy [m/s], radius with its error [m], 1 if it moves, else 0.
        kinds: (n,) of the encounters with them.
        sides: (n,) of the encounters with them.
        area: x_min, y_min, x_max, y_max [m] of where the centre may be (inf: anywhere); its borders repel like static
            obstacles.
        radius: The robot's, m.

    Returns:
        U, the force x and y, and the part of it that moving obstacles cause, x and y.
    """
    gx, gy = goal[0] - x, goal[1] - y
    d_g = math.hypot(gx, gy)
    if d_g > 1e-9:
        gx, gy = gx / d_g, gy / d_g
    level, pull = attraction(d_g, gains)
    fx, fy, mx, my = 0.0, 0.0, 0.0, 0.0
    for i in range(len(discs)):
        R_o = discs[i, 4]
        tau = radius + R_o
        rx, ry = discs[i, 0] + ahead * discs[i, 2] - x, discs[i, 1] + ahead * discs[i, 3] - y
        d = math.hypot(rx, ry)
        nx, ny = (rx / d, ry / d) if d > 1e-9 else (1.0, 0.0)
        if discs[i, 5] == 0.0:
            U, away, to_goal = static(d - tau, R_o, d_g, gains)
            fx, fy = fx - away * nx + to_goal * gx, fy - away * ny + to_goal * gy
            level += U
            continue
        d_m = tau + gains.d_safe
        if d >= d_m + gains.rho_0:
            continue
        wx, wy = vx - discs[i, 2], vy - discs[i, 3]
        if d <= d_m:
            U, away, across, to_goal = emergency(rx, ry, wx, wy, tau, R_o, d_g, gains)
            side = PORT if rx * wy - ry * wx > 0.0 else STARBOARD
        else:
            U, away, across, to_goal = risk(rx, ry, wx, wy, tau, R_o, d_g, gains, 1.0)
            kind, side = kinds[i], sides[i]
            if kind == CLEAR and U > 0.0:  # an encounter that only begins along the predicted course
                kind = classify(math.atan2(vy, vx), math.hypot(vx, vy), rx, ry, discs[i, 2], discs[i, 3])
                side = side_to_pass(kind, rx, ry, wx, wy)
            if kind == STAND_ON and d >= HOLD * d_m:
                continue
        level += U
        mx += -away * nx - across * side * ny + to_goal * gx
        my += -away * ny + across * side * nx + to_goal * gy
    gaps = (x - area[0], y - area[1], area[2] - x, area[3] - y)
    for k in range(4):
        U, away, to_goal = static(gaps[k], radius, d_g, gains)
        inward = away if k < 2 else -away
        fx, fy = fx + to_goal * gx + (inward if k % 2 == 0 else 0.0), fy + to_goal * gy + (inward if k % 2 else 0.0)
        level += U
    return level, fx + pull * gx + mx, fy + pull * gy + my, mx, my


@kernel
def steer(direction: float, theta: float, v: float, omega: float, d_g: float, pace: Pace) -> tuple[float, float]:
    """(v, omega) that turns from heading `theta` to `direction` [rad] and drives as far as it points there already.

    v = speed max(0, cos e), omega = turn_gain e with e the angle between them; both such that the robot can stop at
    the goal, `d_g` [m] away, and at the direction, and within what a period changes of the present `v` and `omega`.
    """
    e = wrap(direction - theta)
    limits = pace.limits
    rate = min(limits.angular_acceleration, limits.angular_deceleration)
    turn = min(pace.turn_gain * abs(e), limits.omega_max, _stopping(rate, abs(e)))
    change = rate * pace.period
    turn = min(max(math.copysign(turn, e), omega - change), omega + change)
    drive = min(limits.v_max, _stopping(limits.deceleration, d_g), d_g / pace.period) * max(0.0, math.cos(e))
    drive = min(max(drive, v - limits.deceleration * pace.period), v + limits.acceleration * pace.period)
    return max(drive, 0.0), min(max(turn, -limits.omega_max), limits.omega_max)


@kernel
def _stopping(rate: float, way: float) -> float:
    """The speed from which `rate` still stops within `way`."""
    return math.inf if math.isinf(rate) else math.sqrt(2.0 * rate * way)


@kernel
def roll_out(
    pose: FloatArray, velocity: FloatArray, goal: FloatArray, discs: FloatArray, kinds: IntArray, sides: FloatArray,
    area: FloatArray, radius: float, gains: Gains, pace: Pace, steps: int, w1: float,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Follow the force for `steps` periods, with obstacles that keep their velocities.

    Returns:
        The predicted poses (steps + 1, 3), and the mean over k = 1 ... steps of what is felt there, weighted by
        w1^k: (4,) the force x, y and its part by moving obstacles x, y.
    """
    path = np.empty((steps + 1, 3))
    path[0] = pose
    mean = np.zeros(4)
    x, y, theta, v, omega = pose[0], pose[1], pose[2], velocity[0], velocity[1]
    weight, weights = 1.0, 0.0
    for k in range(steps + 1):
        cos, sin = math.cos(theta), math.sin(theta)
        _, fx, fy, mx, my = total(
            x, y, v * cos, v * sin, k * pace.period, goal, discs, kinds, sides, area, radius, gains
        )
        if k > 0:
            weight *= w1
            weights += weight
            for j, part in enumerate((fx, fy, mx, my)):
                mean[j] += weight * part
        if k < steps:
            v, omega = steer(math.atan2(fy, fx), theta, v, omega, math.hypot(goal[0] - x, goal[1] - y), pace)
            x, y, theta = arc(x, y, theta, v, omega, pace.period)
            path[k + 1, 0], path[k + 1, 1], path[k + 1, 2] = x, y, theta
    return path, mean / weights


@kernel
def course(
    pose: FloatArray, mean: FloatArray, discs: FloatArray, kinds: IntArray, sides: FloatArray, radius: float,
    gains: Gains, speed: float,
) -> float:  # fmt: skip
    """The direction to take [rad]: that of the mean force, but off the course that it would have without moving
    obstacles by at least 15 degrees, to the side of the nearest encounter in which that course leads into d_m (rule 8).
    """
    direction, free = math.atan2(mean[1], mean[0]), math.atan2(mean[1] - mean[3], mean[0] - mean[2])
    vx, vy = speed * math.cos(free), speed * math.sin(free)
    nearest, side = math.inf, 0.0
    for i in range(len(discs)):
        if kinds[i] == CLEAR or kinds[i] == STAND_ON:
            continue
        rx, ry = discs[i, 0] - pose[0], discs[i, 1] - pose[1]
        d = math.hypot(rx, ry)
        dcpa, tcpa = closest_approach(rx, ry, discs[i, 2] - vx, discs[i, 3] - vy)
        d_m = radius + discs[i, 4] + gains.d_safe
        if d < nearest and d < d_m + gains.rho_0 and tcpa > 0.0 and dcpa < d_m:
            nearest, side = d, sides[i]
    if side != 0.0 and abs(wrap(direction - free)) < CHANGE:
        return wrap(free + side * CHANGE)
    return direction


@kernel
def situation(pose: FloatArray, discs: FloatArray, kinds: IntArray, radius: float, d_safe: float) -> int:
    """What the robot is in: `EMERGENCY`, else the kind of its nearest encounter, else `CLEAR`."""
    nearest, kind = math.inf, CLEAR
    for i in range(len(discs)):
        if discs[i, 5] == 0.0:
            continue
        d = math.hypot(discs[i, 0] - pose[0], discs[i, 1] - pose[1])
        if d <= radius + discs[i, 4] + d_safe:
            return EMERGENCY
        if kinds[i] != CLEAR and d < nearest:
            nearest, kind = d, kinds[i]
    return kind


@kernel
def levels(
    corner: FloatArray, resolution: float, cells: int, vx: float, vy: float, goal: FloatArray, discs: FloatArray,
    kinds: IntArray, sides: FloatArray, area: FloatArray, radius: float, gains: Gains,
) -> FloatArray:  # fmt: skip
    """The potential at the centres of cells x cells squares from `corner` (2,) on, (rows: y, columns: x)."""
    out = np.empty((cells, cells))
    for row in range(cells):
        for col in range(cells):
            x, y = corner[0] + (col + 0.5) * resolution, corner[1] + (row + 0.5) * resolution
            out[row, col] = total(x, y, vx, vy, 0.0, goal, discs, kinds, sides, area, radius, gains)[0]
    return out
