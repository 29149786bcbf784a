"""What is better: indicators in their order of importance, under constraints, over trials."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, median
from typing import Literal

from clearway.errors import ClearwayError, noted, refuse, shown, unknown
from clearway.indicators import INDICATORS

Answers = Mapping[str, float | None]
"""What a trial's indicators are; None: not computable."""

SUCCESS = "success"

FAILED = "navigator failed"
"""Among a trial's answers: 1 where the navigator raised, hung or could not be made."""

_GOAL = re.compile(r"(maximise|minimise)\s+(\S+)")
_LIMIT = re.compile(r"(?:(mean|median|min|max)\s+)?(\S+)\s*(>=|<=)\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)")
_OVER: Mapping[str, Callable[[Sequence[float]], float]] = {"mean": fmean, "median": median, "min": min, "max": max}


@dataclass(frozen=True, slots=True)
class Goal:
    """An indicator whose mean is to be made greater or less.

    Attributes:
        indicator: Its name.
        sign: 1 if less is better, -1 if more is.
    """

    indicator: str
    sign: Literal[1, -1]

    def __str__(self) -> str:
        return f"{'minimise' if self.sign == 1 else 'maximise'} {self.indicator}"


@dataclass(frozen=True, slots=True)
class Limit:
    """A constraint on an indicator over all trials.

    Attributes:
        indicator: Its name.
        over: How its values are taken together: `mean`, `median`, `min`, `max`.
        at_least: Whether it has to be at least `limit`, rather than at most.
        limit: In the indicator's unit.
    """

    indicator: str
    over: str
    at_least: bool
    limit: float

    def __str__(self) -> str:
        return f"{self.over} {self.indicator} {'>=' if self.at_least else '<='} {self.limit:g}"

    def excess(self, answers: Sequence[Answers]) -> float:
        """How far beyond it the trials are, in multiples of the limit (or of 1, near 0); 0: it is kept; inf: nobody can tell."""
        if (found := together(answers, self.indicator, self.over)) is None:
            return math.inf
        beyond = self.limit - found if self.at_least else found - self.limit
        return max(beyond, 0.0) / max(abs(self.limit), 1e-2)


@dataclass(frozen=True, slots=True)
class Score:
    """How good parameters are, over some trials.

    Attributes:
        trials: How many there were.
        excess: By how much constraints are broken; inf: they can't be told, or the navigator failed.
        goals: The mean of each objective's indicator; nan: never computable.
        order: By which scores are sorted, the best first.
    """

    trials: int
    excess: float
    goals: tuple[float, ...]
    order: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Objective:
    """What is better.

    Attributes:
        goals: The most important first; the next counts where those before it are equal. Success is the first in any case.
        limits: What has to hold; parameters that break fewer of it are better, whatever the goals say.
    """

    goals: tuple[Goal, ...]
    limits: tuple[Limit, ...] = ()

    @property
    def indicators(self) -> tuple[str, ...]:
        """Every indicator that it asks for."""
        return tuple(dict.fromkeys([*(g.indicator for g in self.goals), *(c.indicator for c in self.limits)]))

    def score(self, answers: Sequence[Answers]) -> Score:
        """How good trials are, taken together; a mean is over those of which the indicator can be computed."""
        failed = math.inf if any(a.get(FAILED) for a in answers) else 0.0
        excess = failed + sum(limit.excess(answers) for limit in self.limits)
        means = tuple(together(answers, goal.indicator) for goal in self.goals)
        signed = (math.inf if m is None else g.sign * m for g, m in zip(self.goals, means, strict=True))
        return Score(len(answers), excess, tuple(math.nan if m is None else m for m in means), (excess, *signed))

    def dominated(self, one: Score, by: Score) -> bool:
        """Whether `by` is at least as good in everything, and better in something."""
        return all(b <= a for a, b in zip(one.order, by.order, strict=True)) and by.order != one.order


def together(answers: Sequence[Answers], indicator: str, over: str = "mean") -> float | None:
    """An indicator's values over trials as one number; None: it can be computed of none."""
    values = [float(v) for a in answers if (v := a.get(indicator)) is not None]
    return _OVER[over](values) if values else None


def read_objective(goals: Sequence[str], limits: Sequence[str], file: str) -> Objective:
    """Read goals such as `maximise success` and constraints such as `min MDO >= 0.05`.

    Success comes first, named or not: other indicators may be computable of successes alone, and their means would gain by
    failing what is hard.

    Raises:
        ClearwayError: one is none, or names no indicator.
    """
    wrong: list[ClearwayError] = []
    read: list[Goal] = []
    for text in goals:
        with noted(wrong):
            read.append(_goal(text, file))
    if len({goal.indicator for goal in read}) < len(read):
        wrong.append(ClearwayError("an indicator stands in it twice", file=file, field="objective"))
    kept: list[Limit] = []
    for text in limits:
        with noted(wrong):
            kept.append(_limit(text, file))
    refuse(wrong)
    others = (goal for goal in read if goal.indicator != SUCCESS)
    return Objective((Goal(SUCCESS, -1), *others), tuple(kept))


def _goal(text: str, file: str) -> Goal:
    if (match := _GOAL.fullmatch(text.strip())) is None:
        raise ClearwayError(
            f"{shown(text)} is no objective; 'maximise success' and 'minimise CT' are", file=file, field="objective"
        )
    name, more = _known(match[2], file, "objective"), match[1] == "maximise"
    if (indicator := INDICATORS[name]).upside_down(more):
        raise ClearwayError(
            f"{shown(text)} is upside down: {name} is the better the {indicator.better}; write '{'minimise' if more else 'maximise'} {name}'",
            file=file, field="objective",
        )  # fmt: skip
    return Goal(name, -1 if more else 1)


def _limit(text: str, file: str) -> Limit:
    if (match := _LIMIT.fullmatch(text.strip())) is None:
        raise ClearwayError(
            f"{shown(text)} is no constraint; 'min MDO >= 0.05' and 'CT <= 60' are", file=file, field="constraints"
        )
    try:
        limit = float(match[4])
    except ValueError:
        raise ClearwayError(f"{shown(match[4])} is no number", file=file, field="constraints") from None
    name = _known(match[2], file, "constraints")
    least, most = INDICATORS[name].bounds
    if name == "success":
        most = 1.0
    if (limit > most) if match[3] == ">=" else (limit < least):
        raise ClearwayError(f"{text!r} can never hold: {name} is {least:g} to {most:g}", file=file, field="constraints")
    return Limit(name, match[1] or "mean", match[3] == ">=", limit)


def _known(name: str, file: str, field: str) -> str:
    if name not in INDICATORS:
        raise unknown("indicator", name, INDICATORS, file=file, field=field)
    return name
