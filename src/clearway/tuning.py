"""On what a navigator's parameters were chosen: declared by its class, told beside every result, so that nobody takes for
held out what was tuned on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Tuned(StrEnum):
    """How near to a trial's test its navigator's parameters were chosen, the nearest first."""

    SCENARIO = "on this scenario"
    GEOMETRY = "on this geometry"  # the same obstacles in the same place; noise, timing, speed or robot are others
    SUITE = "on other scenarios of this suite"  # or nobody kept which
    NO = "no"
    UNDECLARED = ""


@dataclass(frozen=True, slots=True)
class TunedOn:
    """Tests on which parameters were chosen, in the words of `clearway run`.

    Attributes:
        suite: Its name.
        robots: Who drove, by name and without a preset; empty: any.
        floor_plan: Where, by name; empty: wherever the suite takes place.
        draws: What `--seeds` was given, as in `range(100)` for 0:100; None: the suite's own scenarios; empty: some scenarios
            of its kind, and nobody kept which.
        seeds: What `--seed` was given; empty: any.
        speeds: Set speeds, m/s; empty: any.
        note: What was chosen there, if it was not all.
    """

    suite: str
    robots: tuple[str, ...] = ()
    floor_plan: str = ""
    draws: range | None = None
    seeds: tuple[int, ...] = ()
    speeds: tuple[float, ...] = ()
    note: str = ""

    def __str__(self) -> str:
        parts = [self.suite]
        if self.draws is not None:
            parts.append(f"draws {self.draws.start}:{self.draws.stop}" if self.draws else "nobody kept which scenarios")
        parts += [f"in {self.floor_plan}"] if self.floor_plan else []
        parts += [f"at {' and '.join(f'{v:g}' for v in self.speeds)} m/s"] if self.speeds else []
        parts += [f"seed {' and '.join(map(str, self.seeds))}"] if self.seeds else []
        parts += [f"with {' and '.join(self.robots)}"] if self.robots else []
        return ", ".join(parts) + (f" ({self.note})" if self.note else "")


HOSPITAL = ("hospital", "hospital-blind")
"""The same tests, the same obstacles in the same places; what was chosen among movers that are blind is no less chosen there."""
