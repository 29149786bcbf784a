"""Success rates: exact and score intervals, and two rates on the same tests."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate and its two-sided confidence interval, in the same unit.

    Attributes:
        estimate: The estimate.
        low: Lower end of the interval.
        high: Upper end of the interval.
    """

    estimate: float
    low: float
    high: float


def success_interval(successes: int, trials: int, confidence: float = 0.95) -> Interval:
    """Clopper and Pearson's exact interval of a success probability.

    Raises:
        ClearwayError: no trials, more successes than trials, or a confidence outside (0, 1).
    """
    k, n, alpha = _counts(successes, trials, confidence)
    low = float(special.betaincinv(k, n - k + 1, alpha / 2)) if k > 0 else 0.0
    high = float(special.betaincinv(k + 1, n - k, 1 - alpha / 2)) if k < n else 1.0
    return Interval(k / n, low, high)


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> Interval:
    """Wilson's score interval of a success probability: shorter than the exact one, right on average.

    Raises:
        ClearwayError: as for `success_interval`.
    """
    k, n, alpha = _counts(successes, trials, confidence)
    z, p = float(special.ndtri(1 - alpha / 2)), k / n
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return Interval(p, 0.0 if k == 0 else centre - half, 1.0 if k == n else centre + half)


@dataclass(frozen=True, slots=True)
class PairedSuccess:
    """Two success rates on the same tests.

    Attributes:
        both: How many tests both passed.
        only_a: How many only A passed.
        only_b: How many only B passed.
        neither: How many neither passed.
        p: p of McNemar's exact test, two-sided.
        difference: Difference of the rates, B - A, with Newcombe's score interval for paired data.
    """

    both: int
    only_a: int
    only_b: int
    neither: int
    p: float
    difference: Interval

    @property
    def n(self) -> int:
        """Number of tests."""
        return self.both + self.only_a + self.only_b + self.neither

    @property
    def doubtful(self) -> bool:
        """Whether one of interval and test, at 95 %, shows a difference and the other does not."""
        return (self.difference.low > 0 or self.difference.high < 0) != (self.p <= 0.05)


def paired_success(a: FloatArray, b: FloatArray, confidence: float = 0.95) -> PairedSuccess:
    """Compare the successes of A and B (n,) on the same tests, each 1 or 0.

    Raises:
        ClearwayError: they are not equally many, or none.
    """
    first, second = np.asarray(a, dtype=bool), np.asarray(b, dtype=bool)
    if first.shape != second.shape or first.ndim != 1 or not len(first):
        raise ClearwayError(
            f"paired successes must be equally many, at least one; got {first.shape} and {second.shape}"
        )
    both, only_a = int((first & second).sum()), int((first & ~second).sum())
    only_b, neither = int((~first & second).sum()), int((~first & ~second).sum())
    return PairedSuccess(
        both, only_a, only_b, neither, mcnemar(only_a, only_b), _newcombe(both, only_a, only_b, neither, confidence)
    )


@dataclass(frozen=True, slots=True)
class RateDifference:
    """Two success rates of independent trials.

    Attributes:
        successes_a: Successes of A.
        trials_a: Trials of A.
        successes_b: Successes of B.
        trials_b: Trials of B.
        difference: Difference of the rates, B - A, with Newcombe's score interval.
    """

    successes_a: int
    trials_a: int
    successes_b: int
    trials_b: int
    difference: Interval


def rate_difference(
    successes_a: int, trials_a: int, successes_b: int, trials_b: int, confidence: float = 0.95
) -> RateDifference:
    """B - A for independent trials, after Newcombe 1998 (Stat. Med. 17, 873), method 10: Wilson's limits joined.

    Raises:
        ClearwayError: as for `success_interval`.
    """
    a = wilson_interval(successes_a, trials_a, confidence)
    b = wilson_interval(successes_b, trials_b, confidence)
    difference = b.estimate - a.estimate
    low = difference - math.hypot(b.estimate - b.low, a.high - a.estimate)
    high = difference + math.hypot(b.high - b.estimate, a.estimate - a.low)
    interval = Interval(difference, max(-1.0, low), min(1.0, high))
    return RateDifference(successes_a, trials_a, successes_b, trials_b, interval)


def mcnemar(only_a: int, only_b: int) -> float:
    """McNemar's exact two-sided p: discordant tests fall to either side with probability 1/2."""
    n = only_a + only_b
    return min(1.0, 2 * float(special.bdtr(min(only_a, only_b), n, 0.5))) if n else 1.0


def _newcombe(both: int, only_a: int, only_b: int, neither: int, confidence: float) -> Interval:
    """B - A after Newcombe 1998 (Stat. Med. 17, 2635), method 10: Wilson's limits joined through the correlation."""
    n = both + only_a + only_b + neither
    a, b = wilson_interval(both + only_a, n, confidence), wilson_interval(both + only_b, n, confidence)
    margins = (both + only_a) * (both + only_b) * (neither + only_a) * (neither + only_b)
    excess = both * neither - only_a * only_b
    corrected = max(excess - n / 2, 0.0) if excess > 0 else excess  # continuity correction of a positive one
    phi = corrected / math.sqrt(margins) if margins else 0.0
    difference = b.estimate - a.estimate

    def joined(x: float, y: float) -> float:
        return math.sqrt(max(0.0, x * x - 2 * phi * x * y + y * y))

    low = difference - joined(b.estimate - b.low, a.high - a.estimate)
    high = difference + joined(b.high - b.estimate, a.estimate - a.low)
    return Interval(difference, max(-1.0, low), min(1.0, high))


def _counts(successes: int, trials: int, confidence: float) -> tuple[int, int, float]:
    if trials < 1:
        raise ClearwayError(f"{trials} trials say nothing; at least 1 is needed")
    if not 0 <= successes <= trials:
        raise ClearwayError(f"{successes} successes of {trials} trials cannot be")
    return int(successes), int(trials), 1 - checked_probability("confidence", confidence)


def checked_probability(name: str, value: float) -> float:
    """`value` if it lies strictly between 0 and 1.

    Raises:
        ClearwayError: otherwise; it guesses at percent.
    """
    if not 0 < value < 1:
        hint = f" (did you mean {value / 100:g}?)" if 2 <= value < 100 else ""  # 1.2 % is nobody's reliability
        raise ClearwayError(f"{name} {value:g} must lie between 0 and 1, both excluded{hint}")
    return float(value)
