"""What a tuning found, and what it gained on trials that nothing was tuned on."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clearway.errors import shown
from clearway.improving.search import Candidate
from clearway.statistics import FEWEST_RESAMPLED, Comparison


@dataclass(frozen=True, slots=True)
class Gain:
    """What an objective's indicator gained on the held-out trials.

    Attributes:
        indicator: Its name.
        unit: Its unit.
        before: Its mean with the parameters that came in; nan: never computable.
        after: With those that were found.
        difference: Of the pairs, after - before: the mean, of success the difference of the rates; nan: no pairs.
        low: Lower end of its 95 % interval; nan: too few pairs for one.
        high: Upper end.
        verdict: 1: shown to be better, -1: shown to be worse, 0: neither is shown.
    """

    indicator: str
    unit: str
    before: float
    after: float
    difference: float
    low: float
    high: float
    verdict: int

    def __str__(self) -> str:
        said = {1: "better, shown", -1: "WORSE, shown", 0: "no difference is shown"}[self.verdict]
        was, now = ("none" if math.isnan(mean) else f"{mean:.4g}" for mean in (self.before, self.after))
        unit = f" {self.unit}" if self.unit and not math.isnan(self.after) else ""
        known = not math.isnan(self.low) and not math.isnan(self.high)
        span = (
            f" [{self.low:+.4g}, {self.high:+.4g}]" if known else f", no interval: fewer than {FEWEST_RESAMPLED} pairs"
        )
        pairs = f"paired difference {self.difference:+.4g}{span}"
        if math.isnan(self.difference):
            pairs = "no pair of which both have one"
        return f"{self.indicator}: {was} -> {now}{unit}, {pairs}; {said}"


Held = tuple[str, float, float, bool]
"""A constraint on the held-out trials: its words, its value before and after, whether it holds then."""


def deciding(gains: Sequence[Gain]) -> Gain | None:
    """The first of the objective's in which a difference is shown; None: there is none."""
    return next((gain for gain in gains if gain.verdict), None)


def doubts(gains: Sequence[Gain], limits: Sequence[Held], pairs: int) -> list[str]:
    """What is to be distrusted by what so many held-out pairs show."""
    shown_first, said = deciding(gains), []
    if shown_first is None:
        said.append(
            f"no gain is shown on the {pairs} held-out pairs: what was found may be what fitted the training trials by chance"
        )
    elif shown_first.verdict < 0:
        why = "which counts first" if shown_first is gains[0] else "the first in which a difference is shown"
        said.append(f"it is shown to be worse in {shown_first.indicator}, {why}; keep what came in")
    elif worse := [gain.indicator for gain in gains if gain.verdict < 0]:
        said.append(f"it is shown to be worse in {' and '.join(worse)}, which counts less")
    if not all(holds for *_, holds in limits):
        said.append("on the held-out trials a constraint is broken; see above")
    return said


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """What a tuning found.

    Attributes:
        path: Its folder.
        file: The file with the parameters that were found; None: they are options, or nothing better was found.
        robot: The robot with them, as `clearway run` takes it.
        navigator: The navigator with them, likewise.
        before: The values that came in; None where none is known.
        after: The values that were found.
        trials: How many training trials were run.
        front: The candidates that no other one beats in everything, of those that met all training trials.
        gains: On the held-out trials, in the order of the objective; empty where nothing better was found.
        limits: Each constraint and its value on the held-out trials: (constraint, value before, value after, whether it holds then).
        comparison: Of the held-out trials, after against before; None where nothing better was found.
        warnings: What is to be distrusted.
    """

    path: Path
    file: Path | None
    robot: str
    navigator: str
    before: Mapping[str, Any]
    after: Mapping[str, Any]
    trials: int
    front: tuple[Candidate, ...]
    gains: tuple[Gain, ...]
    limits: tuple[Held, ...]
    comparison: Comparison | None
    warnings: tuple[str, ...]

    @property
    def better(self) -> bool:
        """Whether the held-out trials show a gain: in the first indicator of the objective in which a difference is shown."""
        kept = all(holds for *_, holds in self.limits)
        return kept and (found := deciding(self.gains)) is not None and found.verdict > 0

    def __str__(self) -> str:
        """What was found, for people."""
        if self.comparison is None:
            return "\n".join([f"nothing better than what came in, in {self.trials} training trials", *self._warned()])
        lines = [f"{name}: {shown(self.before[name])} -> {shown(value)}" for name, value in self.after.items()]
        lines += [f"held out, {self.comparison.pairs} pairs", *(f"  {gain}" for gain in self.gains)]
        lines += [
            f"  {text}: {before:.4g} -> {after:.4g}, {'holds' if holds else 'BROKEN'}"
            for text, before, after, holds in self.limits
        ]
        lines += [*self._warned(), f"page: {self.path / 'index.html'}"]
        if (found := deciding(self.gains)) is None or found.verdict > 0:
            robot, navigator = shlex.quote(self.robot), shlex.quote(self.navigator)
            lines.append(f"to use it: clearway run SUITE --robot {robot} --navigator {navigator}")
        return "\n".join(lines)

    def _warned(self) -> list[str]:
        return [f"warning: {text}" for text in self.warnings]
