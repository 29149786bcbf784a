"""CT, completion time, and what it is made of.

A leg's time is split at three instants, so that the four parts add up to it exactly:

    start --acceleration-- first at 90 % of the set speed --cruise-- last at 90 % --approach-- final rotation --end

The final rotation is the stretch up to the leg's end in which the robot stands (|v| < 0.02 m/s) within the position
tolerance of its goal (true position): all that is left to do there is to turn and to settle.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import (
    DrivenLeg,
    ended,
    finished,
    goal_of,
    legs_reached,
    named,
    positions,
    speed,
    speed_limit,
    time_driven,
)
from clearway.trials import Trial

AT_SPEED = 0.9
"""Share of the set speed from which the robot counts as being at speed."""
STANDING = 0.02
"""m/s; below, the robot counts as standing."""


@measure
def completion_time(trial: Trial) -> float:
    """Time of all scored legs together, s (paper A, eq. 1; the turn at B is not part of it)."""
    return time_driven(trial)


def leg_time(name: str) -> Measure:
    """Time of the scored leg `name`, s."""

    @measure
    def of_leg(trial: Trial) -> float:
        span = named(trial, name).span
        return span.end - span.start

    return of_leg


@measure
def turning_time(trial: Trial) -> float:
    """Time of the legs that are not scored (the turn at B), s."""
    unscored = [i for i, leg in enumerate(trial.attempt.legs) if not leg.scored]
    if not unscored:
        raise NotComputable("the test has no turn")
    reached = legs_reached(trial)
    spans = {span.leg: span for span in trial.spans if span.leg in reached}
    if any(i not in spans for i in unscored):
        raise NotComputable(f"the turn was not finished ({ended(trial)})")
    return sum(spans[i].end - spans[i].start for i in unscored)


def _at_speed(drive: DrivenLeg, limit: float) -> tuple[float, float]:
    """When the robot was first and last at speed on one leg, s.

    Raises:
        NotComputable: the velocity is unknown, or the robot never was at speed.
    """
    t, v = drive.t, speed(drive)
    at_speed = np.flatnonzero(v >= AT_SPEED * limit - 1e-9)
    if not len(at_speed):
        raise NotComputable(f"{AT_SPEED:.0%} of the set speed was never reached on leg {drive.leg.name}")
    first = _crossing(t, v, at_speed[0] - 1, at_speed[0], AT_SPEED * limit)
    last = _crossing(t, v, at_speed[-1] + 1, at_speed[-1], AT_SPEED * limit)
    return first, last


def _rotation(drive: DrivenLeg) -> float:
    """When the final rotation began, s.

    Raises:
        NotComputable: the velocity, the position, the goal or its tolerance is unknown.
    """
    t, v, goal = drive.t, speed(drive), goal_of(drive)
    error = np.hypot(*(positions(drive) - goal[:2]).T)
    if not drive.leg.xy_tolerance > 0:
        raise NotComputable(f"the tolerance of leg {drive.leg.name} is unknown")
    standing = (v < STANDING) & (error <= drive.leg.xy_tolerance)
    moving = np.flatnonzero(~standing)
    return float(t[-1] if not standing[-1] else t[min(moving[-1] + 1, len(t) - 1)] if len(moving) else t[0])


def seconds(drive: DrivenLeg, limit: float, index: int) -> float:
    """Seconds of one part of one leg: 0 acceleration, 1 cruise, 2 approach, 3 final rotation; they add up to its time.

    Raises:
        NotComputable: something that this part needs is unknown, or the robot never was at speed.
    """
    first, last = _at_speed(drive, limit)
    if index < 2:
        return first - drive.t[0] if index == 0 else last - first
    rotation = max(_rotation(drive), last)
    return rotation - last if index == 2 else drive.t[-1] - rotation


def _crossing(t: FloatArray, v: FloatArray, below: int, above: int, level: float) -> float:
    """When v passed `level` between two neighbouring samples; the sample itself at the ends of the record."""
    if not 0 <= below < len(t):
        return float(t[above])
    share = (v[above] - level) / (v[above] - v[below])
    return float(t[above] + np.clip(share, 0.0, 1.0) * (t[below] - t[above]))


def part(index: int) -> Measure:
    """Seconds of one part (see `seconds`), over all scored legs."""

    @measure
    def of_part(trial: Trial) -> float:
        limit = speed_limit(trial)
        return sum(seconds(drive, limit, index) for drive in finished(trial))

    return of_part


TIMED = frozenset({"CT", "CT_forth", "CT_back", "T_turn", "T_acceleration", "T_cruise", "T_approach", "T_rotation", "TCS",
                   "TCS_5", "TCS_20", "CT_optimal"})  # fmt: skip
"""Indicators that hang on when a leg began and ended."""
_OURS = "Clearway: CT split at 90 % of the set speed and at the last standstill within tolerance"

ALL = (
    Indicator("CT", "completion time", "s", "paper A, eq. 1", "lower", completion_time),
    Indicator("CT_forth", "completion time, A to B", "s", "paper A, eq. 1, one leg", "lower", leg_time("forth")),
    Indicator("CT_back", "completion time, B to A", "s", "paper A, eq. 1, one leg", "lower", leg_time("back")),
    Indicator("T_turn", "time of the turn at B", "s", "Clearway: logged, not part of CT", "lower", turning_time),
    Indicator("T_acceleration", "of CT: acceleration", "s", _OURS, "lower", part(0)),
    Indicator("T_cruise", "of CT: cruise", "s", _OURS, "neither", part(1)),
    Indicator("T_approach", "of CT: approach", "s", _OURS, "lower", part(2)),
    Indicator("T_rotation", "of CT: final rotation", "s", _OURS, "lower", part(3)),
)
