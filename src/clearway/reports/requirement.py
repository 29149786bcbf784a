"""What the environment must offer, as a sentence, a curve and numbers."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from clearway.errors import ClearwayError
from clearway.reading import read_json
from clearway.reports import theme
from clearway.statistics.proportions import wilson_interval

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS, CURVE = "requirement.json", "requirement.svg"
"""Files of a requirement's folder."""

JUDGES = {"success_slack": "", "success": " by the true pose", "success_self": " by its own estimate"}
"""Columns that may say whether a trial was a success, and how a sentence tells which."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """What came of a search; printed, it is one sentence.

    Attributes:
        offer: Name of what the environment offers, such as `door`.
        phrase: What has the quantity, for a sentence, with braces for the number.
        unit: Its unit as printed behind a number, empty for a factor.
        quantity: What an axis says of it, with its unit.
        eases: Whether more of it is easier.
        robot: The robot's title.
        navigator: Who decides.
        speed: Set speed, m/s.
        reliability: The success that is asked for, in (0, 1).
        confidence: Of the interval, in (0, 1).
        hardest: The hardest value of the range, in the quantity's unit.
        easiest: The easiest value of the range.
        values: (n,) values that were tried, from the hardest to the easiest.
        successes: (n,) successes of each.
        trials: (n,) trials of each.
        curve: (n,) isotonic estimate of success at each.
        estimate: Where success reaches `reliability` by the curve; None: nowhere in the range.
        fails: The easiest value at which success is shown to be less; None: none is.
        passes: The hardest value at which success is shown to be more; None: none is.
        spent: Whether the search ended as all its trials were run.
        judged: The column that says whether a trial was a success.
        why: (n,) what a trial of each did that failed, most often; empty where none failed.
    """

    offer: str
    phrase: str
    unit: str
    quantity: str
    eases: bool
    robot: str
    navigator: str
    speed: float
    reliability: float
    confidence: float
    hardest: float
    easiest: float
    values: tuple[float, ...]
    successes: tuple[int, ...]
    trials: tuple[int, ...]
    curve: tuple[float, ...]
    estimate: float | None
    fails: float | None
    passes: float | None
    spent: bool
    judged: str
    why: tuple[str, ...]

    @property
    def met(self) -> bool:
        """Whether success is shown to reach `reliability` somewhere in the range."""
        return self.passes is not None

    def __str__(self) -> str:
        who = f"{self.robot} with {self.navigator}"
        goal = f"{100 * self.reliability:g} % success{JUDGES[self.judged]} at {self.speed:g} m/s"
        basis = f" ({100 * self.confidence:g} % confidence, {sum(self.trials)} trials)."
        verb = "needs" if self.eases else "bears"
        with_ = "for" if self.eases else "with"
        if self.estimate is not None and self.passes is not None and self.fails is not None:
            low, high = sorted((self.fails, self.passes))
            return f"{who} {verb} {self._of(self.estimate, f' [{_n(low)}, {_n(high)}]')} {with_} {goal}{basis}"
        if self.passes is not None:
            bound = "at most " if self.eases else "at least "
            last = ", the hardest that was asked for" if self.passes == self.hardest else ""
            return f"{who} {verb} {self.phrase.format(bound + _n(self.passes) + self.unit)}{last} {with_} {goal}{basis}"
        ends = f"{_n(self.hardest)} to {_n(self.easiest)}{self.unit}"
        if self.fails == self.easiest:
            why = "it is never met in that range"
        else:
            why = "not decided before its trials were used up" if self.spent else "not decided"
            if self.fails is not None:
                why += f", but it is shown to fail at {_n(self.fails)}{self.unit} and what is harder"
        return f"{who} is not shown to reach {goal} with {self._of(None, ends)}: {why}{basis}"

    def _of(self, value: float | None, behind: str) -> str:
        return self.phrase.format(behind if value is None else f"{_n(value)}{self.unit}{behind}")

    def to_json(self) -> dict[str, Any]:
        """Everything, and the sentence, as JSON values."""
        return asdict(self) | {"met": self.met, "sentence": str(self)}

    def figure(self) -> Figure:
        """The curve: success at each value that was tried, with Wilson's intervals, and where R is reached."""
        with theme.style():
            figure = theme.new_figure(6.0, 3.2)
            ax = figure.add_subplot()
            order = sorted(range(len(self.values)), key=lambda i: self.values[i])
            x = [self.values[i] for i in order]
            if self.fails is not None and self.passes is not None:
                ax.axvspan(*sorted((self.fails, self.passes)), color=theme.RULE, lw=0, label="interval")
            ax.axhline(self.reliability, color=theme.MUTED, lw=0.8, ls="--", label="asked for")
            held = "steps-post" if self.eases else "steps-pre"  # as the sentence has it: from the harder value on
            ax.plot(x, [self.curve[i] for i in order], color=theme.ROBOT, lw=1.4, drawstyle=held, label="isotonic")
            for i in order:
                found = wilson_interval(self.successes[i], self.trials[i], self.confidence)
                ax.plot([self.values[i]] * 2, [found.low, found.high], color=theme.MUTED, lw=0.8)
                ax.plot(self.values[i], found.estimate, "o", ms=2.5 + self.trials[i] ** 0.5 / 3, color=theme.ROBOT)
            ax.set(xlabel=self.quantity, ylabel="success", ylim=(-0.03, 1.03))
            ax.set_title(f"{self.robot}, {self.navigator}, {self.speed:g} m/s")
            ax.legend(loc="best")
            return figure


def write_requirement(found: Requirement, out: Path) -> None:
    """Write the numbers into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    (out / NUMBERS).write_text(json.dumps(found.to_json(), indent=2) + "\n", "utf-8")


def read_requirement(folder: Path) -> Requirement:
    """What a search left in its folder.

    Raises:
        ClearwayError: there is nothing of the kind, or it is damaged.
    """
    file = folder / NUMBERS
    if not file.is_file():
        raise ClearwayError(f"holds no {NUMBERS}, which a finished search leaves", file=folder)
    try:
        return TypeAdapter(Requirement).validate_python(read_json(file))
    except ValidationError as error:
        field = ".".join(map(str, error.errors()[0]["loc"])) or None
        raise ClearwayError("is not as this version's searches write it", file=file, field=field) from error


def _n(value: float) -> str:
    return f"{value:.6g}"
