"""What the certificate will ask: that at a step's end the robot can brake to rest before it may touch anything."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import light
from clearway.geometry.footprint import Footprint
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.contact import (
    AT_X,
    AT_Y,
    BEYOND,
    BY_X,
    BY_Y,
    CHANCE,
    RADIUS,
    SIGMA,
    WHICH,
    WIDEST,
    Base,
    Nearby,
    room_to,
    tail,
)
from clearway.navigators.hp_st.guarantee.certificate import Rules, Safety, certify, stopped_after
from clearway.navigators.hp_st.guarantee.tube import Plan, Tube, drive, room, tube
from clearway.robots.drive_limits import DriveLimits

_SHARES = np.linspace(1.0, 0.05, 20)
"""Speeds that are tried, as shares of the limit."""

NOBODY = Forecast(
    1.0, np.zeros((0, 3)), np.zeros((0, 1, 1, 2)), np.zeros((0, 1, 1)), np.zeros((0, 1)), np.zeros(0), np.zeros((0, 1, 2)),
    np.zeros((0, 1)), np.zeros(0), np.zeros(0, np.int64), np.zeros(0),
)  # fmt: skip
"""The forecast where nobody is seen."""


@light
def braking_time(limits: DriveLimits, v: float, omega: float) -> float:
    """How long the base takes from `v` [m/s] and `omega` [rad/s] to rest, s."""
    return max(abs(v) / limits.deceleration, abs(omega) / limits.angular_deceleration)


def longest_braking(limits: DriveLimits, period: float) -> int:
    """In how many periods at most it is at rest, the one that was decided for included; 0: it needs no time."""
    longest = max(limits.fastest / limits.deceleration, limits.omega_max / limits.angular_deceleration)
    return math.ceil(longest / period - 1e-9) + 1 if longest > 0.0 else 0


def fastest_certified(body: Footprint, safety: Safety, rules: Rules) -> float:
    """The highest speed at which a certificate lets the robot drive straight on for a period and brake, with nothing around it but what
    nobody has seen, in m/s; where there is none, its limit."""
    anywhere = rules._replace(area=np.array((-math.inf, -math.inf, math.inf, math.inf)), eye=np.zeros(3))
    for v in safety.limits.v_max * _SHARES:
        plan, about = _braking(safety, v, v * rules.looked)
        if certify(plan, about, safety.period, body, NOBODY, anywhere).ok:
            return float(v)
    return safety.limits.v_max


def widest_braking(safety: Safety) -> float:
    """How far from its plan a certificate lets the robot be that drives on for a period at full speed and brakes, in metres."""
    return float(_braking(safety, safety.limits.v_max, 0.0)[1].around.max())


def _braking(safety: Safety, v: float, x: float) -> tuple[Plan, Tube]:
    """From `x` [m] ahead a period of `v` [m/s], then the hardest braking, and the tube about it."""
    limits, period = safety.limits, safety.period
    plan = stopped_after(
        drive(np.array((x, 0.0, 0.0, v, 0.0)), np.array([[v, 0.0]]), limits, period), 1, limits, period
    )
    return plan, tube(plan, room(plan, limits), period, safety.disturbance, safety.start, False)


class Halting(NamedTuple):
    """What a certificate asks of a robot that is to stop.

    Attributes:
        base: What it can do, and its outline.
        reach: (K + 1, m), see `PredictedObstacles`.
        margin: How far from its plan a certificate lets it be, in metres.
        period: Control period, in which it goes on before it brakes, and time between two rows of `reach`, in seconds.
        step: Duration of a step in seconds.
    """

    base: Base
    reach: FloatArray
    margin: float
    period: float
    step: float


class StepEnd(NamedTuple):
    """The end of a step.

    Attributes:
        theta: Heading there, in radians.
        dx: How far the step leads along x, in metres.
        dy: How far the step leads along y, in metres.
        v: Speed there, in m/s.
        omega: Yaw rate there, in rad/s.
    """

    theta: float
    dx: float
    dy: float
    v: float
    omega: float


@light
def stopping_risk(nearby: Nearby, n: int, m: int, halting: Halting, end: StepEnd) -> float:
    """Probability that, at the end of a step, the robot can't be certified to come to rest before it touches or may be touched.

    From where it is expected to be then an obstacle goes on as it did in the step; a certificate has it within `reach` of that.

    Args:
        nearby: What it can meet, as `near` fills it.
        n: So many stand.
        m: So many move.
        halting: What is asked.
        end: The end of the step.
    """
    (limits, foot), reach, margin, period, step = halting
    theta, dx, dy, v, omega = end
    needed = braking_time(limits, v, omega)
    way = 0.5 * v * abs(v) / limits.deceleration
    time = max(needed, 2.0 * period)  # one that stands and can't be sure of two periods can't get away
    bx, by = way * math.cos(theta), way * math.sin(theta)
    vertices, rim, outer, top = foot.vertices, foot.radius, foot.circumscribed, len(reach) - 1
    _, _, stills, moving, _ = nearby
    if way != 0.0:
        per = 1.0 / (way * way)
        for i in range(n):
            ax, ay = stills[0, i] - dx, stills[1, i] - dy
            share = min(max((ax * bx + ay * by) * per, 0.0), 1.0)
            ex, ey = ax - share * bx, ay - share * by
            d2 = ex * ex + ey * ey
            if share > 0.0 and room_to(vertices, rim, theta, ex, ey, d2) < stills[2, i] + margin:
                return 1.0
    most = min(int(time / period) + 2, top)
    risk = 0.0
    for i in range(m):
        share = time / step
        ax, ay = moving[i, AT_X] + moving[i, BY_X] - dx, moving[i, AT_Y] + moving[i, BY_Y] - dy
        ux, uy = bx - share * moving[i, BY_X], by - share * moving[i, BY_Y]
        sigma, which = moving[i, SIGMA], int(moving[i, WHICH])
        along, long2 = ax * ux + ay * uy, ux * ux + uy * uy
        near = 0.0 if along <= 0.0 else (1.0 if along >= long2 else along / long2)
        ex, ey = ax - near * ux, ay - near * uy
        d2 = ex * ex + ey * ey
        widest = moving[i, WIDEST] + outer + margin + reach[most, which]
        if d2 >= widest * widest:
            continue
        grown = reach[min(int(near * time / period + 1e-9) + 1, top), which]
        room = room_to(vertices, rim, theta, ex, ey, d2) - moving[i, RADIUS] - margin - grown
        if room < BEYOND * sigma:
            risk += moving[i, CHANCE] * tail(room / sigma)
    return min(risk, 1.0)
