"""The search for better parameters: candidates meet the same trials, few at first and more as it goes on."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.improving.objective import Answers, Objective, Score
from clearway.improving.task import Search, Setting, Variable

Values = dict[str, Setting]
"""A parameter's value by its name."""

Try = Callable[[Sequence[tuple[int, Values, Sequence[int]]]], dict[tuple[int, int], Answers]]
"""Runs trials: (candidate's number, its values, which training trials) -> answers by candidate and trial."""

_GROWTH = 1.25
"""By how much a generation of CMA-ES has more trials than the one before."""
_SPREAD = 0.25
"""The first standard deviation of CMA-ES, as a share of each range."""
_FOR_SEARCH = 0.7
"""Share of the minutes after which the finals begin."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """Parameters that were tried.

    Attributes:
        number: Counted from 0, which are those that came in.
        values: What they are.
        score: Over all training trials that they met.
    """

    number: int
    values: Values
    score: Score


@dataclass(slots=True)
class Record:
    """What was tried and what came of it.

    Attributes:
        objective: What is better.
        attempt: Runs trials.
        budget: How many trials there may be.
        values: Of each candidate; the first ones came in.
        answers: By candidate and training trial.
        told: Called after each batch of trials with how many were run, and a note.
    """

    objective: Objective
    attempt: Try
    budget: int
    values: list[Values] = field(default_factory=list)
    answers: dict[tuple[int, int], Answers] = field(default_factory=dict)
    told: Callable[[int, str], None] = lambda done, note: None

    def number(self, values: Values) -> int:
        """The candidate with these values, a new one if there is none."""
        if values not in self.values:
            self.values.append(values)
        return self.values.index(values)

    def cost(self, numbers: Sequence[int], trials: Sequence[int]) -> int:
        """How many trials have yet to be run to score candidates on `trials`."""
        return sum((n, t) not in self.answers for n in dict.fromkeys(numbers) for t in trials)

    @property
    def left(self) -> int:
        """How many trials may still be run."""
        return self.budget - len(self.answers)

    def scores(self, numbers: Sequence[int], trials: Sequence[int], note: str = "") -> list[Score]:
        """The candidates' scores on the same trials; those that were run already are not run again."""
        asked = [(n, self.values[n], [t for t in trials if (n, t) not in self.answers]) for n in dict.fromkeys(numbers)]
        if asked := [one for one in asked if one[2]]:
            self.answers |= self.attempt(asked)
            self.told(len(self.answers), note)
        return [self.objective.score([self.answers[n, t] for t in trials]) for n in numbers]

    def candidates(self) -> list[Candidate]:
        """All that were tried, each with its score over what it met."""
        met: dict[int, list[Answers]] = {}
        for (n, _), answer in sorted(self.answers.items()):
            met.setdefault(n, []).append(answer)
        return [Candidate(n, self.values[n], self.objective.score(answers)) for n, answers in sorted(met.items())]


def reserve(search: Search, trials: int) -> int:
    """How many trials the finals take at most: halving the finalists up to all training trials, and what came in on all."""
    alive, cost, before = search.finalists, trials, 0
    for size in _sizes(search.finalists, trials):
        cost, before, alive = cost + alive * (size - before), size, max(1, math.ceil(alive / 2))
    return cost


def refuse_little(search: Search, trials: int, file: str) -> None:
    """Complain of a budget that is not enough for a search and its finals.

    Raises:
        ClearwayError: it isn't.
    """
    least = reserve(search, trials) + 2 * search.population * min(search.first, trials)
    if search.trials < least:
        raise ClearwayError(
            f"{search.trials} trials are too few: two generations of {search.population} candidates and the finals on all {trials} "
            f"training trials take {least}",
            file=file, field="search.trials",
        )  # fmt: skip


def best(record: Record, variables: Sequence[Variable], search: Search, trials: int) -> list[int]:
    """Search, and try the finalists on all training trials.

    Args:
        record: Where candidate 0 is what came in.
        variables: What is tuned.
        search: How.
        trials: How many training trials there are.

    Returns:
        The candidates that were scored on all training trials, the best first.
    """
    ends = math.inf if search.minutes is None else time.monotonic() + 60.0 * _FOR_SEARCH * search.minutes
    spare = reserve(search, trials)
    find = _by_cma if search.method == "cma" else _by_halving
    found = find(record, variables, search, trials, spare, ends)
    finalists = list(dict.fromkeys(n for n in reversed(found) if n != 0))[: search.finalists]
    done = [0]
    for size in _sizes(len(finalists), trials):
        some = range(size)
        ranked = _ranked(finalists, record.scores(finalists, some, "finals"))
        finalists = ranked if size == trials else ranked[: max(1, math.ceil(len(ranked) / 2))]
    done += finalists
    return _ranked(done, record.scores(done, range(trials), "finals"))


def _sizes(finalists: int, trials: int) -> list[int]:
    """On how many trials each round of the finals is, the last on all."""
    rounds = max(1, math.ceil(math.log2(max(finalists, 1))) + 1) if finalists else 0
    return sorted({max(1, math.ceil(trials / 2 ** (rounds - 1 - k))) for k in range(rounds)})


def _ranked(numbers: Sequence[int], scores: Sequence[Score]) -> list[int]:
    order = sorted(range(len(numbers)), key=lambda k: (scores[k].order, k))
    return [numbers[k] for k in order]


def _by_cma(
    record: Record, variables: Sequence[Variable], search: Search, trials: int, spare: int, ends: float
) -> list[int]:
    """CMA-ES on ranks; the best of each generation, the last generation's last."""
    start = np.array([v.place(record.values[0].get(v.name)) for v in variables])
    one = len(variables) == 1  # cma asks for two dimensions
    made = cma_module().CMAEvolutionStrategy(
        np.append(start, 0.5) if one else start, _SPREAD,
        {"bounds": [0.0, 1.0], "popsize": search.population, "seed": search.seed + 1, "verbose": -9, "verb_log": 0},
    )  # fmt: skip
    found: list[int] = []
    for generation in range(search.trials):
        some = range(min(trials, round(search.first * _GROWTH**generation)))
        points = made.ask()
        numbers = [record.number(_values(variables, x)) for x in points]
        if record.left - record.cost(numbers, some) < spare or (found and time.monotonic() > ends):
            break
        scores = record.scores(numbers, some, f"generation {generation + 1} on {len(some)} trials")
        orders = sorted({score.order for score in scores})
        made.tell(points, [float(orders.index(score.order)) for score in scores])
        found += [n for n in _ranked(numbers, scores)[:2][::-1] if n not in found]
        middle = record.number(_values(variables, made.mean))
    return [*found, middle]


def _by_halving(
    record: Record, variables: Sequence[Variable], search: Search, trials: int, spare: int, ends: float
) -> list[int]:
    """Evenly spread candidates (Sobol) on a few trials, the better half on twice as many, and so on."""
    from scipy.stats import qmc

    first = min(search.first, trials)
    rounds = max(1, math.ceil(math.log2(trials / first)))
    many = max(search.population, (search.trials - spare) // (first * (1 + rounds) // 2 + first))
    sample = qmc.Sobol(len(variables), seed=search.seed).random_base2(math.ceil(math.log2(many)))[:many]
    alive, size = [record.number(_values(variables, x)) for x in sample], first
    alive = list(dict.fromkeys(alive))
    while True:
        while len(alive) > search.finalists and record.left - record.cost(alive, range(size)) < spare:
            alive = alive[:-1]
        if record.left - record.cost(alive, range(size)) < spare or (size > first and time.monotonic() > ends):
            return alive[::-1]
        alive = _ranked(alive, record.scores(alive, range(size), f"{len(alive)} candidates on {size} trials"))
        if len(alive) <= search.finalists or size == trials:
            return alive[::-1]
        alive, size = alive[: max(search.finalists, math.ceil(len(alive) / 2))], min(2 * size, trials)


def _values(variables: Sequence[Variable], x: FloatArray) -> Values:
    return {v.name: v.value(float(x[k])) for k, v in enumerate(variables)}


def cma_module() -> Any:
    """The package that CMA-ES comes from.

    Raises:
        ClearwayError: it isn't installed.
    """
    try:
        import cma
    except ImportError as error:
        raise ClearwayError(
            "method 'cma' needs the package cma; pip install 'clearway[search]', or search by 'halving'",
            field="search.method",
        ) from error
    return cma
