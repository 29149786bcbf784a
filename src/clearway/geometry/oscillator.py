"""Undamped motion about a point of attraction: paper B, eqs. 6-7, x' = v, v' = stiffness (attraction - x) per axis.

The paper writes a Runge-Kutta 3/8 operator for each integral with the other variable frozen, which would be Euler's
method; here both variables go through the same four stages, which is what the rule is made for.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray


@light
def oscillate(x: float, v: float, attraction: float, stiffness: float, dt: float) -> tuple[float, float]:
    """Position [m] and velocity [m/s] on one axis after one step of `dt` [s] of the Runge-Kutta 3/8 rule.

    Args:
        x: Position now, m.
        v: Velocity now, m/s.
        attraction: What it is attracted to, m.
        stiffness: Alpha or beta of eqs. 6-7, 1/s^2.
    """
    p1, q1 = v, stiffness * (attraction - x)
    p2, q2 = v + dt * q1 / 3.0, stiffness * (attraction - (x + dt * p1 / 3.0))
    p3, q3 = v + dt * (q2 - q1 / 3.0), stiffness * (attraction - (x + dt * (p2 - p1 / 3.0)))
    p4, q4 = v + dt * (q1 - q2 + q3), stiffness * (attraction - (x + dt * (p1 - p2 + p3)))
    share = dt / 8.0
    return x + share * (p1 + 3.0 * p2 + 3.0 * p3 + p4), v + share * (q1 + 3.0 * q2 + 3.0 * q3 + q4)


@kernel
def trajectory(
    start: FloatArray, velocity: FloatArray, attraction: FloatArray, stiffness: FloatArray, dt: float, count: int
) -> FloatArray:
    """States (count + 1, 4) x, y [m], v_x, v_y [m/s] of a body in the plane, `dt` [s] apart, from the start on.

    Args:
        start: (2,) position at the first instant, m.
        velocity: (2,) velocity at the first instant, m/s.
        attraction: (2,) what it is attracted to, m.
        stiffness: (2,) stiffness along each axis, 1/s^2.
    """
    states = np.empty((count + 1, 4))
    states[0, :2], states[0, 2:] = start, velocity
    for i in range(count):
        for k in range(2):
            states[i + 1, k], states[i + 1, k + 2] = oscillate(
                states[i, k], states[i, k + 2], attraction[k], stiffness[k], dt
            )
    return states


def amplitude(x: float, v: float, attraction: float, stiffness: float) -> float:
    """How far from its attraction a body on one axis swings for ever, m; its greatest speed is sqrt(stiffness) times that."""
    return math.sqrt((x - attraction) ** 2 + v * v / stiffness)
