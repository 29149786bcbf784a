"""How a search goes through families: by chance, by a Gaussian process (`surrogate`), by CMA-ES, or by quality diversity (CMA-ME on a
grid of places).

The last two climb. Of several families each is tried once, as its scenario stands, for a quarter of the trials at most. Then one is climbed after
another, the one with the least margin first, while a third of the trials go anywhere by chance; one that broke waits until all
others were climbed. A climb ends with a break (quality diversity goes on, as it looks for breaks elsewhere) or when it gets no further.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.searching.candidates import NOISES, WORST, Candidate, Space, Tried, anywhere, member
from clearway.searching.surrogate import Surrogate

METHODS = ("screen", "gp", "cma", "qd", "random")
_LOOKS = (1, 4, 16, 64)
_FIRST_STEP, _DIVERSE_STEP = 0.25, 0.15
"""Standard deviation of the first generation, in the unit cube; shorter where breaks are looked for all along where they lie."""
_CHANCE = 0.5
"""Candidates by chance for each one of a climb. Margins of chaotic trials may lead nowhere: then it is chance that finds a break."""
_PATIENCE = 6
"""Generations without a better margin, after which a climb ends."""
_RANKERS = ("obj", "2imp")
"""What the emitters of quality diversity go for: the least margin, and margins that are new or better at their place."""
_GRID = 10
"""Cells of the grid of places along each axis."""
_CELL = 1.0
"""Their edge, m."""


class Strategy(Protocol):
    """Who proposes candidates."""

    def ask(self) -> list[Candidate]:
        """What to try next, all at once."""
        ...

    def tell(self, candidates: Sequence[Candidate], tried: Sequence[Tried | None]) -> None:
        """What came of these, the first of those that were asked for; None of one that would be meaningless."""
        ...


def strategy_named(name: str, space: Space, trials: int, batch: int, seed: int) -> Strategy:
    """The strategy of that name.

    Args:
        name: One of `METHODS`.
        space: What is searched.
        trials: How many trials there may be.
        batch: How many of them can run at once.
        seed: Of its draws.

    Raises:
        ClearwayError: there is none, or its library is not installed.
    """
    if name == "random":
        return Random(space, batch, seed)
    if name == "screen":
        return Screen(space, batch, seed)
    if name == "gp":
        return Surrogate(space, batch, seed)
    if name not in METHODS:
        raise unknown("method", name, METHODS, field="method")
    try:
        import cma  # noqa: F401
        import ribs  # noqa: F401
    except ImportError as error:
        raise ClearwayError(
            f"the method {name!r} needs libraries that are not installed; pip install 'clearway[search]', or --method gp",
            field="method",
        ) from error
    return Islands(space, trials, batch, seed, diverse=name == "qd")


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
    """Tries what looks hardest, among members that are drawn by chance and looked at without a trial.

    Args:
        space: What is searched.
        batch: How many trials can run at once.
        seed: Of its draws.
    """

    def __init__(self, space: Space, batch: int, seed: int) -> None:
        self._space, self._batch, self._rng = space, batch, np.random.default_rng(seed)

    def ask(self) -> list[Candidate]:
        """As many as can run at once."""
        return [self._next() for _ in range(self._batch)]

    def tell(self, candidates: Sequence[Candidate], tried: Sequence[Tried | None]) -> None:
        """Nothing is learned."""

    def _next(self) -> Candidate:
        base, looks = int(self._rng.integers(len(self._space))), int(self._rng.choice(_LOOKS))
        drawn = [member(self._space, base, self._rng) for _ in range(looks)]
        return max(drawn, key=self._space.hardness) if looks > 1 else drawn[0]


class _Climb(Protocol):
    """A way down the margins of one family."""

    def ask(self) -> FloatArray: ...
    def tell(self, points: FloatArray, margins: FloatArray, places: FloatArray) -> None: ...
    @property
    def ended(self) -> bool: ...


class Islands:
    """Climbs families one after another.

    Args:
        space: What is searched.
        trials: How many trials there may be.
        batch: How many of them can run at once.
        seed: Of its draws.
        diverse: Whether by quality diversity.
    """

    def __init__(self, space: Space, trials: int, batch: int, seed: int, *, diverse: bool) -> None:
        self._space, self._batch, self._diverse, self._rng = space, batch, diverse, np.random.default_rng(seed)
        some = self._rng.permutation(len(space))[: max(1, trials // 4)]
        self._first = [int(base) for base in sorted(some)]
        self._best: dict[int, tuple[float, FloatArray]] = {}
        self._climbed: dict[int, int] = {}
        self._now: tuple[int, _Climb] | None = None
        self._asked: list[Candidate] = []
        self._climbing: list[Candidate] = []

    def ask(self) -> list[Candidate]:
        """Scenarios as they stand at first, then a generation of the climb and some by chance."""
        if self._first:
            now, self._first = self._first[: self._batch], self._first[self._batch :]
            self._asked = [Candidate(b, self._space.nominal(b), int(self._rng.integers(NOISES))) for b in now]
            return self._asked
        if self._now is None:
            base = min(self._best, key=lambda b: (self._climbed.get(b, 0), self._best[b][0]))
            first = self._best[base][1] if not self._climbed.get(base) else self._rng.random(self._space.size(base))
            self._now = base, self._climb(first, int(self._rng.integers(2**31)))
        base, climb = self._now
        self._climbing = [Candidate(base, p, int(self._rng.integers(NOISES))) for p in climb.ask()]
        others = math.ceil(_CHANCE * len(self._climbing))
        self._asked = [*self._climbing, *(anywhere(self._space, self._rng) for _ in range(others))]
        return self._asked

    def tell(self, candidates: Sequence[Candidate], tried: Sequence[Tried | None]) -> None:
        """The margins of the first that were asked for; fewer than asked at the very end of a search."""
        margins = np.array([WORST if t is None else min(t.margin, WORST) for t in tried])
        for candidate, margin in zip(candidates, margins, strict=True):
            if candidate.base not in self._best or margin < self._best[candidate.base][0]:
                self._best[candidate.base] = float(margin), candidate.point
        if self._now is None or len(candidates) < len(self._asked):
            return
        base, climb = self._now
        margins, tried = margins[: len(self._climbing)], tried[: len(self._climbing)]
        places = np.array([(0.0, 0.0) if t is None or not math.isfinite(t.place[0]) else t.place for t in tried])
        climb.tell(np.array([c.point for c in self._climbing]), margins, places)
        if climb.ended or (not self._diverse and margins.min() <= 0.0):
            self._climbed[base] = self._climbed.get(base, 0) + 1
            self._now = None

    def _climb(self, first: FloatArray, seed: int) -> _Climb:
        return _Diverse(first, self._batch, seed) if self._diverse else _Cma(first, self._batch, seed)


def _generation(size: int, batch: int) -> int:
    """How many candidates a generation of `size` numbers has: CMA-ES's usual, in full batches."""
    usual = 4 + math.floor(3.0 * math.log(max(size, 2)))
    return batch * math.ceil(usual / batch)


class _Patient:
    """Whether a climb gets further: to a smaller margin, or to breaks at more places."""

    def __init__(self) -> None:
        self._least, self._most, self._idle = math.inf, 0, 0

    def look(self, margins: FloatArray, places: int = 0) -> None:
        least = float(margins.min())
        further = least < self._least - 1e-6 or places > self._most
        self._least, self._most = min(self._least, least), max(self._most, places)
        self._idle = 0 if further else self._idle + 1

    @property
    def ended(self) -> bool:
        return self._idle >= _PATIENCE


class _Cma:
    """CMA-ES (Hansen, `cma`) in the unit cube."""

    def __init__(self, first: FloatArray, batch: int, seed: int) -> None:
        import cma

        self._size, self._patient = len(first), _Patient()
        start = first if len(first) > 1 else np.array([first[0], 0.5])  # it takes two numbers at least
        rng = np.random.default_rng(seed)
        options = {
            "bounds": [0.0, 1.0], "popsize": _generation(len(start), batch), "verbose": -9, "seed": math.nan,
            "randn": lambda *shape: rng.standard_normal(shape),
        }  # fmt: skip
        self._strategy: Any = cma.CMAEvolutionStrategy(start, _FIRST_STEP, options)
        self._asked: list[FloatArray] = []

    def ask(self) -> FloatArray:
        self._asked = self._strategy.ask()
        return np.clip(np.array(self._asked)[:, : self._size], 0.0, 1.0)

    def tell(self, points: FloatArray, margins: FloatArray, places: FloatArray) -> None:
        self._strategy.tell(self._asked, margins.tolist())
        self._patient.look(margins)

    @property
    def ended(self) -> bool:
        return self._patient.ended or bool(self._strategy.stop())


class _Diverse:
    """CMA-ME (Fontaine et al. 2020, `ribs`): the least margin in each cell of a grid of places where the trial ended."""

    def __init__(self, first: FloatArray, batch: int, seed: int) -> None:
        self._first, self._batch, self._seed = first, batch, seed
        self._patient, self._scheduler, self._broken = _Patient(), None, 0
        self._points: FloatArray = np.empty((0, 0))

    def ask(self) -> FloatArray:
        if self._scheduler is None:  # where trials end is known only after some of them
            rng, size = np.random.default_rng(self._seed), _generation(len(self._first), self._batch)
            steps = _DIVERSE_STEP * rng.standard_normal((size, len(self._first)))
            self._points = np.clip(self._first + steps, 0.0, 1.0)
        else:
            self._points = np.clip(self._scheduler.ask(), 0.0, 1.0)
        return self._points

    def tell(self, points: FloatArray, margins: FloatArray, places: FloatArray) -> None:
        if self._scheduler is None:
            self._scheduler = self._made(places.mean(axis=0))
        else:
            self._scheduler.tell(-margins, places)
            self._broken = int((self._scheduler.archive.data("objective") >= 0.0).sum())
        self._patient.look(margins, self._broken)

    def _made(self, middle: FloatArray) -> Any:
        from ribs.archives import GridArchive
        from ribs.emitters import EvolutionStrategyEmitter
        from ribs.schedulers import Scheduler

        half = _GRID * _CELL / 2.0
        archive = GridArchive(
            solution_dim=len(self._first), dims=(_GRID, _GRID), seed=self._seed,
            ranges=[(float(m) - half, float(m) + half) for m in middle],
        )  # fmt: skip
        size = max(2, _generation(len(self._first), self._batch) // len(_RANKERS))
        emitters = [
            EvolutionStrategyEmitter(
                archive, x0=self._first, sigma0=_DIVERSE_STEP, ranker=ranker, batch_size=size, seed=self._seed + k
            )
            for k, ranker in enumerate(_RANKERS)
        ]
        return Scheduler(archive, emitters)

    @property
    def ended(self) -> bool:
        return self._patient.ended
