"""Legs by what the robot itself reported: when each goal was sent to it, and when it called it reached (Nav2's and move_base's actions).

So a leg's time is the one that the robot's own stack takes, with its thinking at the start and its checks at the end, and nothing is
looked for in the motion. A goal that was canceled or given up and sent again belongs to one leg, from the first sending on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.lab.legs import NEAR, FoundLeg
from clearway.recordings.motion.motion import Motion
from clearway.recordings.recording import Goals
from clearway.trials import Leg

REACHED = "succeeded"
OTHER = 0.5
"""m; a goal farther than that from the one before is another one, and not the same sent again."""


def legs_told(legs: Sequence[Leg], sent: Goals | None, motion: Motion) -> list[FoundLeg] | None:
    """The legs that were begun, in order; None where no action was recorded.

    Args:
        legs: The trial's legs.
        sent: Goals in the map, on the motion's clock, with when the robot was done with each.
        motion: Motion of base_link.

    Raises:
        ClearwayError: The robot called more goals reached than the trial has legs, or one far from where its leg ends.
    """
    if sent is None or sent.ended is None or not len(sent.t):
        return None
    found: list[FoundLeg] = []
    for tries in _tries(sent):
        last = tries[-1]
        reached = sent.outcome[last] == REACHED
        if len(found) == len(legs):
            raise ClearwayError(
                f"the robot was sent goals for more than the plan's {len(legs)} legs: another at {sent.t[tries[0]]:.2f} s; give the "
                "trial's span, or the legs' spans",
                field="legs",
            )
        ended = float(sent.ended[last])
        end = ended if math.isfinite(ended) else float(motion.t[-1])
        leg = legs[len(found)]
        away = _away(motion, end, leg.goal)
        if reached and away > max(NEAR, 2.5 * _or_zero(leg.xy_tolerance)):
            raise ClearwayError(
                f"the robot called a goal reached at {end:.2f} s, {away:.2f} m from that of leg {leg.name}; give the legs' spans",
                field="legs",
            )
        found.append(FoundLeg(len(found), float(sent.t[tries[0]]), end, reached, _why(sent, tries, end)))
    return found


def _tries(sent: Goals) -> list[list[int]]:
    """The goals of each leg, by their numbers: all up to the one that was reached, or before another goal."""
    groups: list[list[int]] = [[]]
    for i, outcome in enumerate(sent.outcome):
        before = groups[-1][-1] if groups[-1] else i
        moved = float(np.hypot(*(sent.pose[i, :2] - sent.pose[before, :2])))
        if moved > OTHER:  # NaN where nobody says where it is
            groups.append([])
        groups[-1].append(i)
        if outcome == REACHED:
            groups.append([])
    return [g for g in groups if g]


def _away(motion: Motion, at: float, goal: FloatArray) -> float:
    """m from the goal when the robot was seen last before `at` [s]; 0 where that is not known."""
    seen = np.flatnonzero(np.isfinite(motion.pose[:, 0]) & (motion.t <= at))
    if not len(seen) or not np.isfinite(goal[:2]).all():
        return 0.0
    return float(np.hypot(*(motion.pose[seen[-1], :2] - goal[:2])))


def _or_zero(tolerance: float) -> float:
    return tolerance if math.isfinite(tolerance) else 0.0


def _why(sent: Goals, tries: Sequence[int], end: float) -> str:
    again = f", and {len(tries) - 1} more times" if len(tries) > 1 else ""
    outcome = sent.outcome[tries[-1]]
    called = {
        "": f"still pursued when the record ends at {end:.2f} s",
        REACHED: f"called reached at {end:.2f} s by the robot",
    }
    return f"goal sent at {sent.t[tries[0]]:.2f} s{again}; " + called.get(
        outcome, f"{outcome} at {end:.2f} s by the robot"
    )
