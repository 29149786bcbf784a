"""Set-ups: how much a navigator may think per decision, by name."""

from __future__ import annotations

import re
from dataclasses import dataclass

from clearway.contract import Budget
from clearway.errors import ClearwayError

PAPER_B = {"1": Budget(seconds=0.15), "2": Budget()}
"""Paper B's set-ups: 0.15 s of wall clock a decision, and no bound."""

_WORDS = re.compile(r"(?P<number>[0-9.e+-]+) ?(?P<unit>s|iterations?)")


@dataclass(frozen=True, slots=True)
class ThinkingBudget:
    """How much a navigator may think per control period.

    Trials that are bounded by wall clock are not the same bits each time.

    Attributes:
        name: What the results call it; None: the campaign has no set-ups.
        budget: The bound.
        real_time: Whether time passes in the world while the navigator thinks.
    """

    name: str | None
    budget: Budget
    real_time: bool = False

    @property
    def clocked(self) -> bool:
        """Whether a trial depends on how fast the machine is."""
        return self.real_time or self.budget.seconds is not None


REAL_TIME = "real time"
"""The set-up in which a command is followed as late as it was decided."""

FREE = ThinkingBudget(None, Budget())
"""No bound: a navigator thinks until its own end."""


def read_thinking_budget(text: str) -> ThinkingBudget:
    """A set-up from `1` or `2` (paper B's), `0.15 s` (wall clock a decision), `400 iterations` (reproducible) or `real time`.

    Raises:
        ClearwayError: it is none of these.
    """
    if text in PAPER_B:
        return ThinkingBudget(text, PAPER_B[text])
    if text.strip().replace("-", " ") == REAL_TIME:
        return ThinkingBudget(REAL_TIME, Budget(), real_time=True)
    found = _WORDS.fullmatch(text.strip())
    try:
        number = float(found["number"]) if found else 0.0
    except ValueError:
        number = 0.0
    if found is None or not 0.0 < number < 1e9 or (found["unit"] != "s" and number != int(number)):
        raise ClearwayError(
            f"{text!r} is no set-up; write 1 or 2 (paper B's), 0.15s, 400 iterations or real-time", field="setup"
        )
    if found["unit"] == "s":
        return ThinkingBudget(f"{number:.15g} s", Budget(seconds=number))  # the name alone is kept: it must say all
    return ThinkingBudget(f"{int(number)} iterations", Budget(iterations=int(number)))
