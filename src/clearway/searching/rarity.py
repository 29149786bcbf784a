"""How rare a failure is among all members of families: adaptive multilevel splitting (Cérou and Guyader 2007; Bréhier et al. 2016).

Populations of members are drawn by chance. Of each, again and again, the share with the greatest margins is replaced by copies of
others, which are moved by steps of a Markov chain that keeps the distribution of those below that margin. The product of the shares
that stayed estimates the probability, without bias however badly the chain mixes; several populations that know nothing of each
other give the interval. Where so many of the first draws fail that plain sampling does it, that goes on instead.

Every scenario is as likely as any other, what varies of it uniform in its range, as far as that makes a scenario. Which noise a
trial meets is one more random number, drawn anew by some steps and kept by the others: a trial is a function of its member and its
noise, so splitting holds for chaotic ones too; what it gains there is less. A chain stays in its scenario.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np
from scipy import special

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.searching.candidates import NOISES, Candidate
from clearway.statistics.proportions import success_interval

CONFIDENCE = 0.95
FEWEST = 500
"""Trials that it takes at least."""
_POPULATIONS = 8
"""Of a round."""
_REPLACED = 0.25
"""Share of a population that is replaced at a time."""
_STEPS = 3
"""Of a copy's chain."""
_NOISE = 0.25
"""Share of the steps that draw the noise anew too."""
_ACCEPTED = 0.4
"""Share of the other steps that shall be accepted: how long they are follows it."""
_REACH = 12.0
"""Down to exp(-12), 6e-6, the trials suffice."""
_FREQUENT, _SEEN = 0.01, 3
"""Share of the first draws that fail, and how many at least, from which on plain sampling takes fewer trials."""
_ENOUGH = 400
"""Failures that plain sampling waits for: it knows the probability to about 10 % then."""
_LEAST = 12
"""Members of a population at least."""
_DEEPEST = 30.0
"""Below exp(-30), 1e-13, nothing is searched for."""
_TRIES = 50
"""How often numbers of a member are drawn until they make a scenario."""
_RIM = 1e-15
"""How near to the rim of the unit cube a member may lie, for its normal coordinates to be finite."""

Judge = Callable[[Sequence[Candidate]], Sequence[float | None]]
"""The margins of candidates in their order; None of one that makes no scenario, which takes no trial."""


class Space(Protocol):
    """Among what a failure is rare."""

    def __len__(self) -> int:
        """How many families there are."""
        ...

    def size(self, base: int) -> int:
        """How many numbers vary in one."""
        ...


@dataclass(frozen=True, slots=True)
class Rarity:
    """How probable a failure is.

    Attributes:
        failure: Which.
        probability: The estimate; 0 where no trial failed.
        low: Lower end of its interval.
        high: Upper end.
        confidence: Of the interval.
        trials: How many it took.
        splitting: Whether by splitting; otherwise by plain sampling.
        plain: About how many trials plain sampling would take for as narrow an interval; None: not to be told.
    """

    failure: str
    probability: float
    low: float
    high: float
    confidence: float
    trials: int
    splitting: bool
    plain: int | None

    def __str__(self) -> str:
        how = "adaptive multilevel splitting" if self.splitting else "plain sampling"
        sure = f"{100 * self.confidence:g} %"
        if self.probability == 0.0:
            return f"{self.failure} in less than {self.high:.2g} of all trials ({sure}), by {how} in {self.trials:,} trials"
        said = f"{self.failure} in {self.probability:.2g} of all trials ({sure}: {self.low:.2g} to {self.high:.2g})"
        if self.probability < 0.1:
            said += f", about one in {_round(1 / self.probability):,}"
        said += f", by {how} in {self.trials:,} trials"
        return said + (
            f"; plain sampling would take about {_round(self.plain):,}" if self.splitting and self.plain else ""
        )

    def to_json(self) -> dict[str, Any]:
        """Everything, and the sentence, as JSON values."""
        return asdict(self) | {"sentence": str(self)}


def rarity(
    failure: str, space: Space, judge: Judge, trials: int, seed: int, tell: Callable[[int, int, str], None]
) -> Rarity:
    """How probable a failure is.

    Args:
        failure: Its name.
        space: The families.
        judge: Tells margins; a trial failed if its margin is 0 or less.
        trials: About how many it may take; it takes fewer where the failure is frequent.
        seed: Of the draws.
        tell: Told how far it is: done, of how many, and what is reached.

    Raises:
        ClearwayError: fewer trials than `FEWEST`, or hardly any member of the families makes a scenario.
    """
    if trials < FEWEST:
        raise ClearwayError(f"{trials} trials are too few: at least {FEWEST}", field="rarity")
    judged = _Counted(judge, trials, tell)
    falls = -_REACH / math.log1p(-_REPLACED)
    size = max(_LEAST, int(trials / _POPULATIONS / (1.0 + falls * _REPLACED * _STEPS)))
    populations = _drawn(space, judged, size, seed, 0)
    drawn = _POPULATIONS * size
    failed = sum(p.failed for p in populations)
    if failed >= max(_SEEN, _FREQUENT * drawn):
        # they say how many more are drawn, so only those tell how probable it is
        many = min(trials - drawn, math.ceil(_ENOUGH * drawn / failed))
        _, margins = _draws(space, judged, many, np.random.default_rng([seed]))
        found = success_interval(int((margins <= 0.0).sum()), many, CONFIDENCE)
        return Rarity(failure, found.estimate, found.low, found.high, CONFIDENCE, judged.done, False, many)
    _split(populations, judged, trials)
    for k in range(1, trials // judged.done):
        more_of_them = _drawn(space, judged, size, seed, k)
        _split(more_of_them, judged, math.inf)
        populations += more_of_them
    return _found(failure, populations, judged.done)


class _Counted:
    """Counts trials, and tells how far they are."""

    def __init__(self, judge: Judge, most: int, tell: Callable[[int, int, str], None]) -> None:
        self._judge, self._most, self._tell = judge, most, tell
        self.done = 0

    def __call__(self, asked: Sequence[Candidate], reached: str = "") -> Sequence[float | None]:
        # NaN is below no level and above none, and a population would fall for ever
        margins = [math.inf if m is not None and math.isnan(m) else m for m in self._judge(asked)]
        self.done += sum(m is not None for m in margins)
        self._tell(min(self.done, self._most), self._most, reached or "how rare it is")
        return margins


def _draws(space: Space, judge: Judge, many: int, rng: np.random.Generator) -> tuple[list[Candidate], FloatArray]:
    """So many members by chance, of every family as many (but for one), and their margins; where numbers make no scenario, others of
    that family are drawn."""
    turns = [rng.permutation(len(space)) for _ in range(math.ceil(many / len(space)))]
    bases = [int(b) for turn in turns for b in turn][:many]
    members: list[Candidate | None] = [None] * many
    margins = np.empty(many)
    left = list(range(many))
    for _ in range(_TRIES):
        asked = [Candidate(bases[i], rng.random(space.size(bases[i])), int(rng.integers(NOISES))) for i in left]
        for i, one, margin in zip(left, asked, judge(asked), strict=True):
            if margin is not None:
                members[i], margins[i] = one, margin
        left = [i for i in left if members[i] is None]
        if not left:
            return [m for m in members if m is not None], margins
    raise ClearwayError(
        f"in {_TRIES} draws no numbers made a scenario that makes sense (something stands in something else, say);"
        " narrow the ranges",
        field="family",
    )


class _Population:
    """Members on their way to the failure.

    Args:
        members: They, drawn by chance.
        margins: (n,) theirs.
        rng: Of its draws.

    Attributes:
        log_share: Logarithm of the probability of a margin below the last level.
        stuck: Whether no member lies below any further level.
    """

    def __init__(self, members: list[Candidate], margins: FloatArray, rng: np.random.Generator) -> None:
        self._members, self._margins, self._rng = members, margins, rng
        self._length, self._level = 0.6, math.inf
        self._moved: list[int] = []
        self._asked: list[Candidate] = []
        self.log_share, self.stuck = 0.0, False

    @property
    def failed(self) -> int:
        """How many of its members failed."""
        return int((self._margins <= 0.0).sum())

    @property
    def probability(self) -> float:
        """The estimate, 0 where none failed."""
        return math.exp(self.log_share) * self.failed / len(self._members)

    @property
    def most(self) -> float:
        """The estimate, or that of the last level where none failed."""
        return self.probability or math.exp(self.log_share)

    def fall(self) -> bool:
        """Replace the members with the greatest margins by copies of others; whether there was need and others to copy."""
        self._level = float(np.sort(self._margins)[-max(1, round(_REPLACED * len(self._members)))])
        above = self._margins >= self._level
        self.stuck = bool(above.all()) and self._level > 0.0
        if self._level <= 0.0 or self.stuck:
            return False
        below, self._moved = np.flatnonzero(~above), [int(i) for i in np.flatnonzero(above)]
        self.log_share += math.log(len(below) / len(self._members))
        copied = self._rng.choice(below, len(self._moved), replace=len(self._moved) > len(below))
        for i, source in zip(self._moved, copied, strict=True):
            self._members[i], self._margins[i] = self._members[int(source)], self._margins[int(source)]
        return True

    def proposals(self) -> list[Candidate]:
        """Whither the copies would step."""
        self._asked = [self._step(self._members[i]) for i in self._moved]
        return self._asked

    def _step(self, member: Candidate) -> Candidate:
        """To a neighbour, by the preconditioned Crank-Nicolson proposal: it keeps a normal distribution."""
        normal = special.ndtri(np.clip(member.point, _RIM, 1.0 - _RIM))
        normal = math.sqrt(1.0 - self._length**2) * normal + self._length * self._rng.standard_normal(len(normal))
        noise = int(self._rng.integers(NOISES)) if self._rng.random() < _NOISE else member.noise
        return Candidate(member.base, special.ndtr(normal), noise)

    def take(self, margins: Sequence[float | None]) -> None:
        """Take the steps that stay below the level; the next ones are longer if most of these did."""
        steps = taken = 0
        for i, candidate, margin in zip(self._moved, self._asked, margins, strict=True):
            below = margin is not None and margin < self._level
            if candidate.noise == self._members[i].noise:
                steps, taken = steps + 1, taken + below
            if below:
                self._members[i], self._margins[i] = candidate, margin
        if steps:
            self._length = min(max(self._length * math.exp(taken / steps - _ACCEPTED), 0.02), 1.0)


def _drawn(space: Space, judge: Judge, size: int, seed: int, k: int) -> list[_Population]:
    """The populations of round `k`."""
    rngs = [np.random.default_rng([seed, k, i]) for i in range(_POPULATIONS)]
    members, margins = _draws(space, judge, _POPULATIONS * size, np.random.default_rng([seed, k]))
    parts = [slice(i * size, (i + 1) * size) for i in range(_POPULATIONS)]
    return [_Population(members[part], margins[part], rng) for part, rng in zip(parts, rngs, strict=True)]


def _split(populations: Sequence[_Population], judge: _Counted, trials: float) -> None:
    """Let populations fall until each has failed, is stuck or is beyond what may ever be found, or the trials are spent."""
    falling = list(populations)
    while falling and judge.done < trials:
        falling = [p for p in falling if p.log_share > -_DEEPEST and p.fall()]
        for _ in range(_STEPS if falling else 0):
            asked = [p.proposals() for p in falling]
            reached = f"down to {math.exp(max(p.log_share for p in falling)):.1g}"
            margins = iter(judge([c for part in asked for c in part], reached))
            for population, part in zip(falling, asked, strict=True):
                population.take([next(margins) for _ in part])


def _found(failure: str, populations: Sequence[_Population], trials: int) -> Rarity:
    """Of independent estimates their mean, and Cox's interval of the mean of what is lognormal; where some populations never
    failed, they bound it from above only."""
    probability = float(np.mean([p.probability for p in populations]))
    logs, n = np.log([p.most for p in populations]), len(populations)
    variance = float(logs.var(ddof=1))
    middle = float(logs.mean()) + variance / 2.0
    spread = math.sqrt(variance / n + variance**2 / (2.0 * (n - 1)))
    half = float(special.stdtrit(n - 1, 0.5 + CONFIDENCE / 2.0)) * spread
    never = any(p.probability == 0.0 for p in populations)
    low = 0.0 if never else min(math.exp(middle - half), probability)
    high = min(1.0, max(math.exp(middle + half), probability))
    plain = None if never else math.ceil((1.0 - probability) / (probability * spread**2)) if spread else None
    return Rarity(failure, probability, low, high, CONFIDENCE, trials, True, plain)


def _round(number: float) -> int:
    """To two digits."""
    return int(float(f"{number:.2g}"))
