"""What a learner is rewarded for: a default, and what a reward of one's own is told."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from clearway.contract import Command, Goal, Observation
from clearway.errors import ClearwayError, shown
from clearway.geometry.shapes import FloatArray
from clearway.trials import Outcome

END = 10.0
"""For arriving, and, negative, for every other end but the time limit."""
SECOND = 0.1
"""What each second costs."""


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """A control period that is over.

    At the end of a trial nothing more is perceived: `observation` is the one before. A contact ends it amid the period; every other end is
    found where the period would begin, so `command` is not driven, and `after` is `before`.

    Attributes:
        before: (3,) true pose where it began, map frame: x, y [m], theta [rad].
        after: (3,) the same where it ended.
        goal: Where the robot was to go in it.
        command: What the base was told.
        observation: What is perceived at its end; what was perceived last where the trial ended with it.
        period: How long it is, s.
        leg_reached: Whether a leg other than the last was reached.
        outcome: How the trial ended with it; None: it goes on.
    """

    before: FloatArray
    after: FloatArray
    goal: Goal
    command: Command
    observation: Observation
    period: float
    leg_reached: bool
    outcome: Outcome | None


Reward: TypeAlias = Callable[[Step], float]


def default_reward(step: Step) -> float:
    """1 for each metre nearer to the goal, less 0.1 a second; 10 for each leg that is reached; less 10 for a contact, giving up, or
    no progress for long.

    Nearer is as the crow flies, by the truth. Out of time costs nothing more: that is the learner's truncation.
    """
    gone = _away(step.before, step.goal) - _away(step.after, step.goal)
    ends = END if step.leg_reached or step.outcome == Outcome.REACHED else 0.0
    if step.outcome not in (None, Outcome.REACHED, Outcome.TIMEOUT):
        ends = -END
    return gone - SECOND * step.period + ends


def refuse_no_reward(given: object) -> None:
    """Nothing, if it can be asked what a control period is worth.

    Raises:
        ClearwayError: it can't.
    """
    if not callable(given):
        raise ClearwayError(f"{shown(given)} is no function", field="reward")


def numbers_of(given: object, shape: tuple[int, ...]) -> FloatArray:
    """What a reward has given, as finite numbers of a shape.

    Raises:
        ClearwayError: it is something else.
    """
    try:
        found = np.asarray(math.nan if isinstance(given, str | bytes) else given, np.float64)
    except (TypeError, ValueError, OverflowError):
        found = np.array(math.nan)
    if found.shape != shape or not np.isfinite(found).all():
        right = f"{shape[0]} finite numbers, an array of the shape {shape}, are" if shape else "a finite number is"
        raise ClearwayError(
            f"what it gave for a control period is {' '.join(shown(given).split())}; {right} expected", field="reward"
        )
    return found


def _away(pose: FloatArray, goal: Goal) -> float:
    return math.hypot(goal.pose[0] - pose[0], goal.pose[1] - pose[1])
