"""How rare a failure is among all members of families: subset simulation (Au and Beck 2001), an adaptive multilevel splitting.

Members are drawn by chance. Again and again the tenth with the least margins stays, and grows to as many as before by chains of Markov
steps that keep the distribution of those below that margin. The product of the shares that stayed estimates the probability. Who
descends of different first draws has nothing in common but the levels, so how unevenly those who failed descend of them tells how far
the estimate may be off (a branching process, as of fixed levels; that it holds for these is measured in `benchmarks/rarity.py`).
That is so if small margins lead to the failure: one that comes at once, or in a scenario that all others are nearer to it than, may have
been where no member was left. So the interval is told with that assumption, and beside it what the first draws exclude by chance alone;
where a round saw no failure, only that.
Where so many of the first draws fail that plain sampling does it, that goes on instead.

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
_KEPT = 0.1
"""Share of the members that stays at a level."""
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
        high: Upper end. By splitting it may hold only if small margins lead to the failure.
        limit: The upper end that draws by chance alone tell, whatever margins lead to; never below `high`.
        confidence: Of the interval, and of the limit.
        trials: How many it took.
        splitting: Whether by splitting; otherwise by plain sampling.
        plain: About how many trials plain sampling would take for as narrow an interval; None: not to be told, or no more than it took.
        failed: In how many of them the navigator itself failed, which counts as no failure of this kind.
    """

    failure: str
    probability: float
    low: float
    high: float
    limit: float
    confidence: float
    trials: int
    splitting: bool
    plain: int | None
    failed: int = 0

    def __str__(self) -> str:
        if self.failed >= self.trials:
            return f"{self.failure}: nothing is known, as the navigator itself failed in all {self.trials:,} trials"
        besides = (
            f"; in {self.failed:,} of them the navigator itself failed, which counts as none" if self.failed else ""
        )
        return self._said() + besides

    def _said(self) -> str:
        how = "adaptive multilevel splitting" if self.splitting else "plain sampling"
        sure = f"{100 * self.confidence:g} %"
        if self.probability == 0.0:
            return f"{self.failure} in less than {self.high:.2g} of all trials ({sure}), by {how} in {self.trials:,} trials"
        led = f" if small margins lead to it, up to {self.limit:.2g} if they don't" if self.high < self.limit else ""
        said = (
            f"{self.failure} in {self.probability:.2g} of all trials ({sure}: {self.low:.2g} to {self.high:.2g}{led})"
        )
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
        trials: How many it may take; it takes fewer where the failure is frequent.
        seed: Of the draws.
        tell: Told how far it is: done, of how many, and what is reached.

    Raises:
        ClearwayError: fewer trials than `FEWEST`, or hardly any member of the families makes a scenario.
    """
    if trials < FEWEST:
        raise ClearwayError(f"{trials} trials are too few: at least {FEWEST}", field="rarity")
    judged = _Counted(judge, trials, tell)
    levels = _REACH / -math.log(_KEPT)
    size = int(trials / (1.0 + levels * (1.0 - _KEPT)))
    first = _drawn(space, judged, size, seed, 0)
    if first.failed >= max(_SEEN, _FREQUENT * size):
        # they say how many more are drawn, so only those tell how probable it is
        many = min(trials - size, math.ceil(_ENOUGH * size / first.failed))
        found = success_interval(_drawn(space, judged, many, seed, 1).failed, many, CONFIDENCE)
        return Rarity(failure, found.estimate, found.low, found.high, found.high, CONFIDENCE, judged.done, False, many)
    _split(first, judged, trials)
    rounds = [first]
    for k in range(1, trials // judged.done):
        if judged.done + size > trials:  # the rounds before took longer than the first
            break
        rounds.append(_drawn(space, judged, size, seed, k))
        _split(rounds[-1], judged, trials)
    return _found(failure, rounds, judged.done)


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
        size: How many first draws there were.
        failed_first: How many of them failed.
        log_share: Logarithm of the probability of a margin below the last level.
        chains: How many chains grow at this level.
        steps: How many steps each of them makes.
    """

    def __init__(self, members: list[Candidate], margins: FloatArray, rng: np.random.Generator) -> None:
        self._members, self._margins, self._rng = members, margins, rng
        self._lines = np.arange(len(members))  # of which first draw each descends
        self.size, self.failed_first = len(members), self.failed
        self._length, self._level, self.chains = 0.6, math.inf, 0
        self._asked: list[Candidate] = []
        self.log_share, self.steps = 0.0, 0

    @property
    def failed(self) -> int:
        """How many of its members failed."""
        return int((self._margins <= 0.0).sum())

    @property
    def probability(self) -> float:
        """The estimate, 0 where none failed."""
        return math.exp(self.log_share) * self.failed / len(self._members)

    @property
    def variance(self) -> float:
        """Of the estimate, over its square, where some failed: each first draw's part in it is independent of the others'."""
        parts = np.bincount(self._lines[self._margins <= 0.0]) / self.failed
        return max(float(np.square(parts).sum()) - 1.0 / self.size, 0.0)

    def fall(self) -> bool:
        """Keep the members with the least margins; whether there was need, and others to leave."""
        ordered = np.sort(self._margins)
        higher = ordered[max(1, round(_KEPT * len(ordered))) :]
        higher = higher[higher > ordered[0]]
        if not len(higher) or higher[0] <= 0.0:
            return False
        self._level = float(higher[0])
        kept = np.flatnonzero(self._margins < self._level)
        self.log_share += math.log(len(kept) / len(self._members))
        self._members, self._margins = [self._members[int(i)] for i in kept], self._margins[kept]
        self._lines, self.chains = self._lines[kept], len(kept)
        self.steps = max(1, round(self.size / len(kept)) - 1)
        return True

    def proposals(self) -> list[Candidate]:
        """Whither the chains would step."""
        self._asked = [self._step(member) for member in self._members[-self.chains :]]
        return self._asked

    def _step(self, member: Candidate) -> Candidate:
        """To a neighbour, by the preconditioned Crank-Nicolson proposal: it keeps a normal distribution."""
        normal = special.ndtri(np.clip(member.point, _RIM, 1.0 - _RIM))
        normal = math.sqrt(1.0 - self._length**2) * normal + self._length * self._rng.standard_normal(len(normal))
        noise = int(self._rng.integers(NOISES)) if self._rng.random() < _NOISE else member.noise
        return Candidate(member.base, special.ndtr(normal), noise)

    def take(self, margins: Sequence[float | None]) -> None:
        """Each chain's next member: the step where it stays below the level, else the last one again. Steps get longer if most stay."""
        steps = taken = 0
        before, margins_before = self._members[-self.chains :], self._margins[-self.chains :]
        after = margins_before.copy()
        for i, (candidate, margin) in enumerate(zip(self._asked, margins, strict=True)):
            below = margin is not None and margin < self._level
            if candidate.noise == before[i].noise:
                steps, taken = steps + 1, taken + below
            if margin is not None and below:
                before[i], after[i] = candidate, margin
        self._members += before
        self._margins = np.concatenate([self._margins, after])
        self._lines = np.concatenate([self._lines, self._lines[-self.chains :]])
        if steps:
            self._length = min(max(self._length * math.exp(taken / steps - _ACCEPTED), 0.02), 1.0)


def _drawn(space: Space, judge: Judge, size: int, seed: int, k: int) -> _Population:
    """The population of round `k`."""
    rng = np.random.default_rng([seed, k])
    return _Population(*_draws(space, judge, size, rng), rng)


def _split(population: _Population, judge: _Counted, trials: int) -> None:
    """Let a population fall until enough fail, it is stuck or beyond what may ever be found, or the trials are spent; its last level may
    have fewer steps."""
    while judge.done < trials and population.log_share > -_DEEPEST and population.fall():
        for _ in range(population.steps):
            if judge.done + population.chains > trials:
                return
            population.take(judge(population.proposals(), f"down to {math.exp(population.log_share):.1g}"))


def _found(failure: str, rounds: Sequence[_Population], trials: int) -> Rarity:
    """The mean of independent rounds, its interval on the logarithm by Student's distribution of as many degrees of freedom as first
    draws take part in it. All first draws together tell its limit; where a round never failed, they alone tell."""
    estimates = np.array([p.probability for p in rounds])
    probability = float(estimates.mean())
    drawn = success_interval(sum(p.failed_first for p in rounds), sum(p.size for p in rounds), CONFIDENCE)
    limit = max(drawn.high, probability)
    if not estimates.all():
        return Rarity(failure, probability, 0.0, limit, limit, CONFIDENCE, trials, True, None)
    variance = float((np.square(estimates) * [p.variance for p in rounds]).sum() / estimates.sum() ** 2)
    degrees = max(1.0 / variance - 1.0, 1.0) if variance else math.inf
    half = _student(degrees) * math.sqrt(variance)
    low, high = probability * math.exp(-half), min(limit, probability * math.exp(min(half, _DEEPEST)))
    # by as wide an interval on the logarithm, whose quantile is the normal one
    plain = (1.0 - probability) / probability * (_student(math.inf) / half) ** 2 if half else 0.0
    return Rarity(
        failure, probability, low, high, limit, CONFIDENCE, trials, True, math.ceil(plain) if plain > trials else None
    )


def _student(degrees: float) -> float:
    """The quantile of Student's distribution that an interval takes on either side."""
    return float(special.stdtrit(degrees, 0.5 + CONFIDENCE / 2.0))


def _round(number: float) -> int:
    """To two digits."""
    return int(float(f"{number:.2g}"))
