"""Motion of a body that is pulled, braked and pushed about, with bounds on its speed and acceleration."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


@kernel
def driven(
    start: FloatArray, velocity: FloatArray, target: FloatArray, stiffness: FloatArray, push: FloatArray,
    damping: float, speed: float, acceleration: float, dt: float,
) -> FloatArray:  # fmt: skip
    """States (k + 1, 4) x, y [m], v_x, v_y [m/s], `dt` [s] apart, of x'' = stiffness (target - x) - damping x' + push.

    What the right side asks for is cut to `acceleration` [m/s^2] in any direction, and the velocity that comes of it to
    `speed` [m/s]. Each step drives its new velocity (Euler's semi-implicit rule): the polyline of the positions keeps
    both bounds exactly.

    Args:
        start: (2,) position at the first instant, m.
        velocity: (2,) velocity at the first instant, m/s.
        target: (k, 2) what it is drawn to during each step, m.
        stiffness: (2,) stiffness along each axis, 1/s^2.
        push: (k, 2) what pushes it during each step, m/s^2.
        damping: Damping, 1/s.
    """
    states = np.empty((len(push) + 1, 4))
    states[0, :2], states[0, 2:] = start, velocity
    for i in range(len(push)):
        x, y, vx, vy = states[i]
        ax = stiffness[0] * (target[i, 0] - x) - damping * vx + push[i, 0]
        ay = stiffness[1] * (target[i, 1] - y) - damping * vy + push[i, 1]
        share = min(1.0, acceleration / max(math.hypot(ax, ay), 1e-300))
        vx, vy = vx + share * ax * dt, vy + share * ay * dt
        share = min(1.0, speed / max(math.hypot(vx, vy), 1e-300))
        vx, vy = share * vx, share * vy
        states[i + 1] = x + vx * dt, y + vy * dt, vx, vy
    return states
