"""DE and OE: how far from its goal, and how far turned away from it, the robot stood when a leg ended.

Paper A gives one value a trial; a trial ends twice (at B and back at A): the headline is the mean of both ends.
Eq. 3 and 4 subtract a scalar tolerance from a vector; read as |error - T| / T they are `DE_literal` and `OE_literal`,
but the paper's printed values are raw metres and radians: these are `DE` and `OE`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from statistics import fmean
from typing import Literal

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, finished, goal_of, named

Whose = Literal["true", "own"]
"""Measured from outside (motion capture, the simulator's truth), or by the robot's own estimate."""


def distance_error(drive: DrivenLeg, whose: Whose = "true") -> float:
    """Distance from the goal at the leg's end, m.

    Raises:
        NotComputable: the goal or the pose there is unknown.
    """
    end, goal = _end(drive, whose), goal_of(drive)
    if not np.isfinite(end[:2]).all():
        raise NotComputable(f"the pose at the end of leg {drive.leg.name} is unknown")
    return math.hypot(end[0] - goal[0], end[1] - goal[1])


def orientation_error(drive: DrivenLeg, whose: Whose = "true") -> float:
    """Absolute angle to the goal's heading at the leg's end, rad, in [0, pi].

    Raises:
        NotComputable: the heading is free, or it or the goal's is unknown.
    """
    if math.isinf(drive.leg.yaw_tolerance):
        raise NotComputable(f"the heading at the end of leg {drive.leg.name} is free")
    if not math.isfinite(goal_of(drive)[2]):
        raise NotComputable(f"the goal's heading of leg {drive.leg.name} is unknown")
    heading = float(_end(drive, whose)[2])
    if not math.isfinite(heading):
        raise NotComputable(f"the heading at the end of leg {drive.leg.name} is unknown")
    return abs(math.remainder(heading - drive.leg.goal[2], 2 * math.pi))


def _end(drive: DrivenLeg, whose: Whose) -> FloatArray:
    poses = drive.pose if whose == "true" else drive.estimate
    if poses is None:
        raise NotComputable("the robot's own estimate is unknown")
    end: FloatArray = poses[-1]
    return end


def _literal(error: float, tolerance: float) -> float:
    if not tolerance > 0:
        raise NotComputable("the tolerance is unknown")
    return abs(error - tolerance) / tolerance


def over_legs(error: Callable[[DrivenLeg], float], combine: Callable[[list[float]], float] = fmean) -> Measure:
    """`error` at the end of every scored leg, combined (the mean, unless told otherwise)."""
    return measure(lambda trial: combine([error(drive) for drive in finished(trial)]))


def at_end_of(name: str, error: Callable[[DrivenLeg], float]) -> Measure:
    """`error` at the end of the scored leg `name`."""
    return measure(lambda trial: error(named(trial, name)))


def _family(symbol: str, title: str, unit: str, number: int, error: Callable[..., float]) -> tuple[Indicator, ...]:
    paper = f"paper A, eq. {number}"

    def tolerance(drive: DrivenLeg) -> float:
        return drive.leg.xy_tolerance if symbol == "DE" else drive.leg.yaw_tolerance

    def literal(drive: DrivenLeg) -> float:
        return _literal(error(drive), tolerance(drive))

    def own(drive: DrivenLeg) -> float:
        return error(drive, "own")

    def one(suffix: str, detail: str, unit: str, source: str, function: Measure) -> Indicator:
        return Indicator(f"{symbol}{suffix}", f"{title}{detail}", unit, source, "lower", function)

    return (
        one("", "", unit, f"{paper}, ||e||, mean over legs", over_legs(error)),
        one("_forth", " at B", unit, f"{paper}, ||e||", at_end_of("forth", error)),
        one("_back", " back at A", unit, f"{paper}, ||e||", at_end_of("back", error)),
        one("_max", ", worst leg", unit, f"{paper}, ||e||, maximum over legs", over_legs(error, max)),
        one("_literal", ", as printed", "", f"{paper}, |‖e‖ - T| / T, mean over legs", over_legs(literal)),
        one("_self", " by the robot's own estimate", unit, f"{paper}, ||e|| of the estimate", over_legs(own)),
    )


ALL = (
    *_family("DE", "distance error", "m", 3, distance_error),
    *_family("OE", "orientation error", "rad", 4, orientation_error),
)
