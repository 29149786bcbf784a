"""What an indicator is: a pure function of a trial, with a name, a unit and a source."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from clearway.indicators.column import Kind
from clearway.trials import Trial


@dataclass(frozen=True, slots=True)
class Value:
    """What an indicator answers.

    Attributes:
        value: The number, in the indicator's unit; None if it cannot be computed.
        why: Why it cannot be computed.
    """

    value: float | None
    why: str = ""


class NotComputable(Exception):
    """Raised inside an indicator's function: what the trial lacks, as a short phrase for people."""


Measure: TypeAlias = Callable[[Trial], Value]


@dataclass(frozen=True, slots=True)
class Indicator:
    """An indicator of how well a trial went.

    Attributes:
        name: Its column.
        title: How it is printed.
        unit: `s`, `m`, `rad`, `%`, or empty for a ratio or a yes/no.
        source: Paper and equation, or where else it comes from.
        better: Which way is better; `neither` if it only describes.
        function: Trial -> Value; never raises for want of data.
        kind: What its values are; a BOOLEAN is 1 or 0.
        signed: Whether a value may be negative, as no length, time or angle off is.
    """

    name: str
    title: str
    unit: str
    source: str
    better: Literal["lower", "higher", "neither"]
    function: Measure
    kind: Kind = Kind.NUMBER
    signed: bool = False

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the most that a value can be."""
        return -math.inf if self.signed else 0.0, 100.0 if self.unit == "%" else math.inf

    def upside_down(self, more: bool) -> bool:
        """Whether it is worse to have more of it; or, if not `more`, less."""
        return self.better == ("lower" if more else "higher")


def measure(function: Callable[[Trial], float]) -> Measure:
    """Turn a function that raises `NotComputable` into one that answers with a `Value`."""

    @functools.wraps(function)
    def answer(trial: Trial) -> Value:
        try:
            value = float(function(trial))
        except NotComputable as reason:
            return Value(None, str(reason))
        return Value(value) if math.isfinite(value) else Value(None, "the trial holds a number that is not finite")

    return answer
