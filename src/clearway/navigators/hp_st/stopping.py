"""What the certificate will ask of a step's end: that the robot can brake to rest before who moves may come there."""

from __future__ import annotations

import math

from clearway.geometry.compiled import light
from clearway.geometry.footprint import Footprint
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.contact import (
    AT_X,
    AT_Y,
    BEYOND,
    BY_X,
    BY_Y,
    CHANCE,
    LANES,
    RADIUS,
    SIGMA,
    WHICH,
    WIDEST,
    room_to,
    tail,
)
from clearway.robots.drive_limits import DriveLimits


@light
def braking_time(limits: DriveLimits, v: float, omega: float) -> float:
    """How long the base takes from `v` [m/s] and `omega` [rad/s] to rest, s."""
    return max(abs(v) / limits.deceleration, abs(omega) / limits.angular_deceleration)


def longest_braking(limits: DriveLimits, period: float) -> int:
    """In how many periods at most it is at rest, the one that was decided for included; 0: it needs no time."""
    longest = max(limits.fastest / limits.deceleration, limits.omega_max / limits.angular_deceleration)
    return math.ceil(longest / period - 1e-9) + 1 if longest > 0.0 else 0


@light
def stopping_risk(
    moving: FloatArray, m: int, reach: FloatArray, period: float, step: float, limits: DriveLimits, foot: Footprint, theta: float,
    dx: float, dy: float, v: float, omega: float,
) -> float:  # fmt: skip
    """Probability that, at the end of a step, the robot can't be certified to come to rest before it may be touched.

    From where it is expected to be then an obstacle goes on as it did in the step; a certificate has it within `reach` of that.

    Args:
        moving: (M, 12 LANES) what moves, as `near` fills it.
        m: So many move.
        reach: (K + 1, m), see `PredictedObstacles`.
        period: Control period, in which the robot goes on before it brakes, and time between two rows of `reach`, in seconds.
        step: Duration of the step in seconds.
        limits: Limits of the base.
        foot: The robot's outline.
        theta: Heading at the step's end, in radians.
        dx: How far the step leads along x, in metres.
        dy: How far the step leads along y, in metres.
        v: Speed at its end, in m/s.
        omega: Yaw rate at its end, in rad/s.
    """
    needed = braking_time(limits, v, omega)
    way = 0.5 * v * needed
    time = max(needed, 2.0 * period)  # one that stands and can't be sure of two periods can't get away
    bx, by = way * math.cos(theta), way * math.sin(theta)
    vertices, rim, outer, top = foot.vertices, foot.radius, foot.circumscribed, len(reach) - 1
    most = min(int(time / period) + 2, top)
    risk = 0.0
    for i in range(m):
        share = time / step
        some, lane = moving[i // LANES], i % LANES
        ax, ay = some[AT_X + lane] + some[BY_X + lane] - dx, some[AT_Y + lane] + some[BY_Y + lane] - dy
        ux, uy = bx - share * some[BY_X + lane], by - share * some[BY_Y + lane]
        which, sigma = int(some[WHICH + lane]), some[SIGMA + lane]
        along, long2 = ax * ux + ay * uy, ux * ux + uy * uy
        near = 0.0 if along <= 0.0 else (1.0 if along >= long2 else along / long2)
        ex, ey = ax - near * ux, ay - near * uy
        d2 = ex * ex + ey * ey
        widest = some[WIDEST + lane] + outer + reach[most, which]
        if d2 >= widest * widest:
            continue
        grown = reach[min(int(near * time / period + 1e-9) + 1, top), which]
        room = room_to(vertices, rim, theta, ex, ey, d2) - some[RADIUS + lane] - grown
        if room < BEYOND * sigma:
            risk += some[CHANCE + lane] * tail(room / sigma)
    return min(risk, 1.0)
