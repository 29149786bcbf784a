"""Drives the first segment of a path: what lazy steering left open."""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hl_rrt.checking import FREE, Scene, edge

_PARTS = 4
"""Chords by which the arc of a control period is checked."""


class Body(NamedTuple):
    """What the drive can do (as in `Robot.drive`), with the control period [s] and the speed along a path [m/s]."""

    speed: float
    omega_max: float
    acceleration: float
    deceleration: float
    angular_acceleration: float
    angular_deceleration: float
    period: float


@kernel
def follow(
    path: FloatArray, pose: FloatArray, velocity: FloatArray, body: Body, near: float, scene: Scene
) -> tuple[float, float, bool]:
    """The command for one control period along `path` (k, 2), which begins at the robot.

    It heads for the first point that is farther than `near` [m], turns on the spot while that lies more than 45 degrees
    off, and slows down for the path's end. If the arc of this period meets an obstacle where it is now, it only turns.

    Returns:
        v [m/s], omega [rad/s], both within the drive's rate limits from `velocity` (2,); whether the way was clear.
    """
    x, y, theta = pose[0], pose[1], pose[2]
    k, last = 1, path.shape[0] - 1
    while k < last and math.hypot(path[k, 0] - x, path[k, 1] - y) <= near:
        k += 1
    left = math.hypot(path[k, 0] - x, path[k, 1] - y)
    error = turn_between(theta, math.atan2(path[k, 1] - y, path[k, 0] - x))
    for i in range(k, last):
        left += math.hypot(path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1])
    wanted = body.speed * math.cos(2.0 * error) if abs(error) < 0.25 * math.pi else 0.0
    wanted = min(wanted, left / body.period, math.sqrt(2.0 * body.deceleration * left))
    v, mean_v = ramp(velocity[0], wanted, body.acceleration, body.deceleration, body.period)
    omega, mean_omega = _turn(error, velocity[1], body)
    if _clear(x, y, theta, mean_v, mean_omega, body.period, scene):
        return v, omega, True
    v, mean_v = ramp(velocity[0], 0.0, body.acceleration, body.deceleration, body.period)
    return v, omega, False


@kernel
def turn(error: float, velocity: FloatArray, body: Body) -> tuple[float, float]:
    """The command v, omega for one control period that brakes and turns by `error` [rad]."""
    v, _ = ramp(velocity[0], 0.0, body.acceleration, body.deceleration, body.period)
    omega, _ = _turn(error, velocity[1], body)
    return v, omega


@kernel
def _turn(error: float, omega: float, body: Body) -> tuple[float, float]:
    top = min(abs(error) / body.period, body.omega_max, math.sqrt(2.0 * body.angular_deceleration * abs(error)))
    return ramp(omega, math.copysign(top, error), body.angular_acceleration, body.angular_deceleration, body.period)


@kernel
def _clear(x: float, y: float, theta: float, v: float, omega: float, period: float, scene: Scene) -> bool:
    for _ in range(_PARTS):
        ax, ay = x, y
        x, y, theta = arc(x, y, theta, v, omega, period / _PARTS)
        if edge(scene, ax, ay, x, y) != FREE:
            return False
    return True
