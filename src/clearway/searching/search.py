"""Goes through families until enough different breaks are found, or the trials are spent."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.errors import ClearwayError
from clearway.scenarios.scenario import Scenario
from clearway.searching.candidates import Bench, Candidate, Families, Tried
from clearway.searching.strategies import Strategy

APART = 1.0
"""Breaks of one kind with one party that lie farther apart than this, m, are different ones."""
_HALVINGS = 8
"""How often a candidate that makes no scenario is moved half the way to its family's own one."""


@dataclass(frozen=True, slots=True, eq=False)
class Attempted:
    """A trial of a search.

    Attributes:
        candidate: What was tried.
        scenario: The same as it ran.
        tried: What came of it.
    """

    candidate: Candidate
    scenario: Scenario
    tried: Tried


class FamilySpace:
    """The families of a bench as what a strategy searches."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    def __len__(self) -> int:
        return len(self._bench.families)

    def size(self, base: int) -> int:
        """How many numbers vary in one."""
        return self._bench.families.size(base)

    def hardness(self, candidate: Candidate) -> float:
        """How hard a member looks before any trial of it; -inf where it makes no scenario."""
        return self._bench.hardness(candidate)


def search(
    bench: Bench, strategy: Strategy, trials: int, breaks: int, tell: Callable[[int, int, str], None]
) -> list[Attempted]:
    """Every trial of a search, in its order.

    Args:
        bench: Where trials run.
        strategy: Who proposes them.
        trials: How many there may be.
        breaks: How many different breaks are enough.
        tell: Told how far it is: done, of how many, and the least margin.

    Raises:
        ClearwayError: no candidate makes a scenario, or none of the trials tells how far it is from failing.
    """
    done: list[Attempted] = []
    meaningless = 0
    while len(done) < trials and len(different(done, bench.families, breaks)) < breaks:
        asked = strategy.ask()[: trials - len(done)]
        settled = [_settled(bench, candidate) for candidate in asked]
        made = [(c, s) for c, s in settled if s is not None]
        found = iter(bench.run([(c.base, s) for c, s in made]))
        tried = [None if s is None else next(found) for _, s in settled]
        strategy.tell([c for c, _ in settled], tried)
        done += [
            Attempted(c, s, t) for (c, s), t in zip(settled, tried, strict=True) if s is not None and t is not None
        ]
        meaningless = 0 if made else meaningless + 1
        if meaningless > 20:
            raise ClearwayError(
                "none of the scenarios that were drawn makes sense (something stands in something else, say); narrow the ranges",
                field="family",
            )
        if len(done) >= min(20, trials) and not any(math.isfinite(a.tried.margin) for a in done):
            why = done[0].tried.why or "nobody says why"
            raise ClearwayError(
                f"in none of {len(done)} trials it can be computed how far they are from failing so: {why}",
                field="failure",
            )
        least = min((a.tried.margin for a in done), default=math.inf)
        tell(len(done), trials, f"least margin {least:.3g}" if math.isfinite(least) else "")
    return done


def _settled(bench: Bench, candidate: Candidate) -> tuple[Candidate, Scenario | None]:
    """The candidate, or the nearest one on the way to its family's own scenario that makes sense; with its scenario."""
    nominal = bench.families[candidate.base].nominal
    for k in range(_HALVINGS):
        point = nominal + 0.5**k * (candidate.point - nominal)
        at = Candidate(candidate.base, point, candidate.noise)
        if (made := bench.scenario(at)) is not None:
            return at, made
    return candidate, None


def different(done: Sequence[Attempted], families: Families, most: int) -> list[Attempted]:
    """The breaks that differ from each other: in how it ended, with whom, in which test, or by `APART` in where; of those alike the one
    nearest to its family's own scenario.

    Args:
        done: Trials.
        families: Of what.
        most: How many at most.
    """

    def distance(one: Attempted) -> float:
        nominal = families[one.candidate.base].nominal
        return float(np.linalg.norm(one.candidate.point - nominal) / math.sqrt(len(nominal)))

    found: list[Attempted] = []
    for one in sorted((a for a in done if a.tried.broken), key=distance):
        if len(found) < most and not any(_alike(one, other) for other in found):
            found.append(one)
    return found


def _alike(a: Attempted, b: Attempted) -> bool:
    same = (a.tried.outcome, a.tried.party, a.tried.leg) == (b.tried.outcome, b.tried.party, b.tried.leg)
    test = a.scenario.labels.configuration == b.scenario.labels.configuration
    return same and test and math.dist(a.tried.place, b.tried.place) <= APART
