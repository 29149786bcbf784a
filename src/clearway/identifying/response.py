"""How a base answers its commands: some time later its controller sets the motors to them, within its accelerations, and they follow
by first order.

It is the base of `world/plant.py` without what that has beside (slip, noise, contact), written down a second time as what happens from one
event to the next, so that a reading may come at any instant and each part of the motion is exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray


class Response(NamedTuple):
    """How one velocity of a base, forwards or of turning, answers what it is commanded.

    Attributes:
        latency: From a command until the base's controller has it, s.
        lag: Time constant with which the motors follow what that sets them to, s, above 0.
        acceleration: Bound of how fast it sets them faster, m/s^2 or rad/s^2.
        deceleration: The same of slower.
    """

    latency: float
    lag: float
    acceleration: float
    deceleration: float


@kernel
def answer(when: FloatArray, told: FloatArray, response: Response, at: FloatArray, velocity: FloatArray) -> None:
    """Write what `velocity` (n,) [m/s or rad/s] a base has that stands before its first command.

    Args:
        when: (k,) times of the commands, s, increasing.
        told: (k,) what each asks for, m/s or rad/s; it holds until the next.
        response: How the base answers.
        at: (n,) times at which its velocity is asked for, s, increasing.
        velocity: (n,), filled.
    """
    now = min(at[0], when[0] + response.latency) if len(when) and len(at) else 0.0
    row, goal, aim, wheels = 0, 0.0, 0.0, 0.0
    for i in range(len(at)):
        while row < len(when) and when[row] + response.latency <= at[i]:
            due = when[row] + response.latency
            aim, wheels = _go_on(aim, wheels, goal, response, due - now)
            now, goal = due, told[row]
            row += 1
        aim, wheels = _go_on(aim, wheels, goal, response, at[i] - now)
        now = at[i]
        velocity[i] = wheels


@light
def _go_on(aim: float, wheels: float, goal: float, response: Response, span: float) -> tuple[float, float]:
    """What the motors are set to, and what they do, after `span` [s] on the way to `goal`."""
    left = span
    while left > 0.0:
        toward = goal if aim * goal >= 0.0 else 0.0  # it stops before it turns round
        gap = toward - aim
        rate = response.acceleration if abs(toward) > abs(aim) else response.deceleration
        needs = abs(gap) / rate
        part = min(left, needs) if gap != 0.0 else left
        slope = math.copysign(rate, gap) if gap != 0.0 else 0.0
        behind = slope * response.lag  # so far behind what they are set to motors stay in the end
        wheels = aim + slope * part - behind + (wheels - aim + behind) * math.exp(-part / response.lag)
        aim = toward if needs <= left else aim + slope * part
        left -= part
    return aim, wheels
