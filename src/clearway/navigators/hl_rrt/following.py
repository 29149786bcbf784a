"""Drives the first segment of a path: what lazy steering left open."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hl_rrt.checking import FREE, Scene, edge
from clearway.robots.drive_limits import DriveLimits

_PARTS = 4
"""Chords by which the arc of a control period is checked, and that of braking."""

_SLOWER = 3
"""Speeds that are tried, each half the one before: near an obstacle the robot goes as fast as it can stop."""

AHEAD = 1.0
"""How far along the path the robot aims, s at its speed."""


class Body(NamedTuple):
    """What the robot can do.

    Attributes:
        limits: What its base can do; `v_max` is the speed along a path.
        period: Control period, s.
    """

    limits: DriveLimits
    period: float


@kernel
def follow(
    path: FloatArray, pose: FloatArray, velocity: FloatArray, body: Body, near: float, scene: Scene
) -> tuple[float, float, bool]:
    """The command for one control period along `path` (k, 2), which begins at the robot.

    It drives the arc to the point that lies `AHEAD` further along the path, or less where that is not in free sight
    (pure pursuit: Coulter 1992); where that point lies more than 45 degrees off, or the arc meets an obstacle where it is
    now, it turns to the first point that is farther than `near` [m], on the spot if need be; and it slows down for
    the path's end. If no arc is clear, it only turns. An arc counts with the way on which the robot can stop after it.

    Returns:
        v [m/s], omega [rad/s], both within the drive's rate limits from `velocity` (2,); whether the way was clear.
    """
    x, y, theta = pose[0], pose[1], pose[2]
    k, last = 1, path.shape[0] - 1
    while k < last and math.hypot(path[k, 0] - x, path[k, 1] - y) <= near:
        k += 1
    left = math.hypot(path[k, 0] - x, path[k, 1] - y)
    for i in range(k, last):
        left += math.hypot(path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1])
    fastest = min(body.limits.v_max, left / body.period, math.sqrt(2.0 * body.limits.deceleration * left))

    error, away = _aim(path, k, pose, AHEAD * body.limits.v_max, scene)
    if abs(error) < 0.25 * math.pi:
        for half in range(_SLOWER):
            v, mean_v = _drive(fastest * 0.5**half, error, velocity[0], body)
            wanted = min(
                max(2.0 * mean_v * math.sin(error) / max(away, near), -body.limits.omega_max), body.limits.omega_max
            )
            omega, mean_omega = ramp(
                velocity[1], wanted, body.limits.angular_acceleration, body.limits.angular_deceleration, body.period
            )  # fmt: skip
            if _clear(x, y, theta, v, mean_v, mean_omega, body, scene):
                return v, omega, True

    error = turn_between(theta, math.atan2(path[k, 1] - y, path[k, 0] - x))
    omega, mean_omega = _turn(error, velocity[1], body)
    for half in range(_SLOWER):
        v, mean_v = _drive(fastest * 0.5**half, error, velocity[0], body)
        if _clear(x, y, theta, v, mean_v, mean_omega, body, scene):
            return v, omega, True
    v, mean_v = ramp(velocity[0], 0.0, body.limits.acceleration, body.limits.deceleration, body.period)
    return v, omega, False


@kernel
def turn(error: float, velocity: FloatArray, body: Body) -> tuple[float, float]:
    """The command v, omega for one control period that brakes and turns by `error` [rad]."""
    v, _ = ramp(velocity[0], 0.0, body.limits.acceleration, body.limits.deceleration, body.period)
    omega, _ = _turn(error, velocity[1], body)
    return v, omega


@kernel
def _aim(path: FloatArray, k: int, pose: FloatArray, ahead: float, scene: Scene) -> tuple[float, float]:
    """Direction [rad, from the heading] and distance [m] of the point to drive to: `ahead` [m] along the path, half or a
    quarter of that if the straight way there meets an obstacle, and its point `k` if all do."""
    x, y, theta = pose[0], pose[1], pose[2]
    px, py = path[k]
    for half in range(3):
        qx, qy = _along(path, k, x, y, ahead * 0.5**half)
        if edge(scene, x, y, qx, qy) == FREE:
            px, py = qx, qy
            break
    return turn_between(theta, math.atan2(py - y, px - x)), math.hypot(px - x, py - y)


@kernel
def _along(path: FloatArray, k: int, x: float, y: float, left: float) -> tuple[float, float]:
    """The point `left` [m] further along the way from (x, y) through the path's points k, k + 1, ...; at most its end."""
    for i in range(k, path.shape[0]):
        length = math.hypot(path[i, 0] - x, path[i, 1] - y)
        if length >= left:
            return x + (path[i, 0] - x) * left / length, y + (path[i, 1] - y) * left / length
        left -= length
        x, y = path[i, 0], path[i, 1]
    return x, y


@kernel
def _drive(fastest: float, error: float, v: float, body: Body) -> tuple[float, float]:
    wanted = fastest * math.cos(2.0 * error) if abs(error) < 0.25 * math.pi else 0.0
    return ramp(v, wanted, body.limits.acceleration, body.limits.deceleration, body.period)


@kernel
def _turn(error: float, omega: float, body: Body) -> tuple[float, float]:
    top = min(abs(error) / body.period, body.limits.omega_max)
    slower = body.limits.angular_deceleration
    if not math.isinf(slower):  # a rate from which it still stops in time, and gets to within this period
        lag = 0.5 * slower * body.period
        left = abs(error) - 0.5 * body.period * math.copysign(omega, omega * error)
        top = min(top, max(math.sqrt(max(lag * lag + 2.0 * slower * left, 0.0)) - lag, 0.0))
    return ramp(
        omega,
        math.copysign(top, error),
        body.limits.angular_acceleration,
        body.limits.angular_deceleration,
        body.period,
    )


@kernel
def _clear(
    x: float, y: float, theta: float, v: float, mean_v: float, mean_omega: float, body: Body, scene: Scene
) -> bool:  # fmt: skip
    """Whether the arc of a period, with its mean velocities, and that of braking from `v` [m/s] meet no obstacle."""
    last = 0.0 if math.isinf(body.limits.deceleration) else v / body.limits.deceleration
    for part in range(2 * _PARTS if last > 0.0 else _PARTS):
        ax, ay = x, y
        if part < _PARTS:
            x, y, theta = arc(x, y, theta, mean_v, mean_omega, body.period / _PARTS)
        else:
            x, y, theta = arc(x, y, theta, 0.5 * v, 0.5 * mean_omega, last / _PARTS)
        if edge(scene, ax, ay, x, y) != FREE:
            return False
    return True
