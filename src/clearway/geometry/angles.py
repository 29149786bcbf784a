"""Angles on the circle, in radians."""

from __future__ import annotations

import math

from clearway.geometry.compiled import light

TURN = 2.0 * math.pi


@light
def wrap(angle: float) -> float:
    """The same direction in (-pi, pi]. An angle that lies there already keeps its bits."""
    if -math.pi < angle <= math.pi:
        return angle
    wrapped = angle - TURN * math.ceil((angle - math.pi) / TURN)
    if wrapped <= -math.pi:  # rounding
        wrapped += TURN
    return min(wrapped, math.pi)


@light
def turn_between(start: float, end: float) -> float:
    """The shortest turn that leads from heading `start` to heading `end`, in (-pi, pi]."""
    return wrap(end - start)
