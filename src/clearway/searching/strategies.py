"""How a search goes through families: by what looks hard (`screen`), by a Gaussian process over margins (`surrogate`), or by chance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from clearway.errors import unknown
from clearway.searching.candidates import Candidate, Space, Tried, anywhere
from clearway.searching.surrogate import Surrogate

SCREEN, MARGINS, CHANCE = "screen", "gp", "random"
METHODS = (SCREEN, MARGINS, CHANCE)
_LOOKS = (1, 4, 16, 64)
"""Among how many new members the hardest is chosen, each as often as the others, after the most looks also among all that were looked at
before. One is chance: a search is never much slower than that, whatever breaks its navigator. The more the better where an
encounter has to be met exactly; where those who are met look themselves, the very hardest are no longer those that break."""
_REMEMBERED = 1000
"""How many members that were looked at and not tried are remembered, the hardest."""


class Strategy(Protocol):
    """Who proposes candidates."""

    def ask(self) -> list[Candidate]:
        """What to try next, all at once."""
        ...

    def tell(self, candidates: Sequence[Candidate], tried: Sequence[Tried | None]) -> None:
        """What came of these, the first of those that were asked for; None of one that would be meaningless."""
        ...


def strategy_named(name: str, space: Space, batch: int, seed: int) -> Strategy:
    """The strategy of that name.

    Args:
        name: One of `METHODS`.
        space: What is searched.
        batch: How many of them can run at once.
        seed: Of its draws.

    Raises:
        ClearwayError: there is none.
    """
    strategies: dict[str, Callable[[Space, int, int], Strategy]] = {SCREEN: Screen, MARGINS: Surrogate, CHANCE: Random}
    if name not in strategies:
        raise unknown("method", name, METHODS, field="method")
    return strategies[name](space, batch, seed)


class Random:
    """Each candidate of any family, anywhere in it, by chance."""

    def __init__(self, space: Space, batch: int, seed: int) -> None:
        self._space, self._batch, self._rng = space, batch, np.random.default_rng(seed)

    def ask(self) -> list[Candidate]:
        """As many as can run at once."""
        return [anywhere(self._space, self._rng) for _ in range(self._batch)]

    def tell(self, candidates: Sequence[Candidate], tried: Sequence[Tried | None]) -> None:
        """Nothing is learned."""


class Screen:
    """Tries what looks hardest among some members of any family that are drawn by chance, and looked at without a trial.

    Nothing is learned from trials: where a search is worth its while breaks are so rare that it would
    have to learn from the margins of trials that hold, which tell little (docs/measurements/answers.md).

    Args:
        space: What is searched.
        batch: How many trials can run at once.
        seed: Of its draws.
    """

    def __init__(self, space: Space, batch: int, seed: int) -> None:
        self._space, self._batch, self._rng = space, batch, np.random.default_rng(seed)
        self._seen: list[tuple[float, Candidate]] = []

    def ask(self) -> list[Candidate]:
        """As many as can run at once."""
        return [self._next() for _ in range(self._batch)]

    def tell(self, candidates: Sequence[Candidate], tried: Sequence[Tried | None]) -> None:
        """Nothing is learned."""

    def _next(self) -> Candidate:
        looks = int(self._rng.choice(_LOOKS))
        drawn = [anywhere(self._space, self._rng) for _ in range(looks)]
        if looks == 1:
            return drawn[0]
        new = [(self._space.hardness(one), one) for one in drawn]
        seen = sorted([*self._seen, *new], key=_hardness, reverse=True)
        chosen = seen[0] if looks == max(_LOOKS) else max(new, key=_hardness)
        self._seen = [one for one in seen if one is not chosen][:_REMEMBERED]
        return chosen[1]


def _hardness(seen: tuple[float, Candidate]) -> float:
    return seen[0]
