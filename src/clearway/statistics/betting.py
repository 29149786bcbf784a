"""Is a share at least so large? Two bets, one for it and one against, that may be looked at after every trial.

A bet that the share p is above a limit s stakes, in each trial, on a p drawn once from a distribution on (s, 1]: its wealth is the
likelihood under that mixture over the likelihood under s. Whoever's true share is s or below sees that wealth grow beyond
1 / error with probability `error` at most, however often it is looked at and whenever one stops (Ville's inequality; Howard,
Ramdas, McAuliffe and Sekhon 2021, Ann. Stat. 49, 1055; Waudby-Smith and Ramdas 2024, J. R. Stat. Soc. B 86, 1). The bet that it
is below s is the same on [0, s). Both mixtures are Beta(1, 1/4) cut off at s: between a bet on a robot that never fails (shortest
if that is so, ruined by one failure) and an even one. With it 67 trials without a failure show 0.95 at 95 %; a plan of fixed length
needs 59, and may not be looked at before.

It holds for trials that are independent with one p, and for those of unlike tests in an order that was drawn beforehand
(`benchmarks/accept_errors.py`); not for tests that are driven the easy ones first.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import optimize, special

from clearway.geometry.shapes import FloatArray
from clearway.statistics.proportions import Interval

A, B = 1.0, 0.25
"""Of the Beta distributions on which is bet."""
MOST = 1_000_000
"""Trials; more are not looked ahead to."""
_TINY = 1e-12

IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def log_wealth(conforming: npt.ArrayLike, failing: npt.ArrayLike, share: float, *, above: bool) -> FloatArray:
    """Logarithm of the wealth (n,) of the bet that the share is above `share`, or below it, after so many trials.

    Args:
        conforming: How many conformed (n,).
        failing: How many did not (n,).
        share: The limit, in (0, 1).
        above: Which of the two bets.
    """
    k, f = np.asarray(conforming, dtype=np.float64), np.asarray(failing, dtype=np.float64)
    part = special.betaincc if above else special.betainc
    with np.errstate(divide="ignore"):  # a bet that lost everything
        won = special.betaln(A + k, B + f) + np.log(part(A + k, B + f, share))
    staked = special.betaln(A, B) + math.log(part(A, B, share))
    found: FloatArray = won - staked - k * math.log(share) - f * math.log1p(-share)
    return found


def first_shown(conforms: BoolArray, share: float, error: float, *, above: bool) -> int | None:
    """After which of these trials (n,), counted from 1, it was shown that the share is above `share`, or below it; None: not yet."""
    n = np.arange(1, len(conforms) + 1)
    k = np.cumsum(conforms)
    shown = np.flatnonzero(log_wealth(k, n - k, share, above=above) >= -math.log(error))
    return int(n[shown[0]]) if len(shown) else None


def shown_shares(conforming: int, failing: int, error: float) -> Interval:
    """The shares that neither bet has ruled out so far: each end is wrong at any time with probability `error` at most.

    Args:
        conforming: How many trials conformed.
        failing: How many did not.
        error: Of either end, in (0, 1); however small, unlike one less a confidence.
    """
    k, f = conforming, failing
    if k + f == 0:
        return Interval(math.nan, 0.0, 1.0)
    level, best = -math.log(error), k / (k + f)

    def excess(p: float, above: bool) -> float:
        return float(log_wealth(k, f, p, above=above)) - level

    inner = min(max(best, _TINY), 1 - _TINY)
    low, high = 0.0, 1.0  # where a share within `_TINY` of them is not ruled out
    if k and excess(inner, True) < 0 < excess(_TINY, True):
        low = optimize.brentq(excess, _TINY, inner, args=(True,))
    if f and excess(inner, False) < 0 < excess(1 - _TINY, False):
        high = optimize.brentq(excess, inner, 1 - _TINY, args=(False,))
    return Interval(best, float(low), float(high))


@dataclass(frozen=True, slots=True)
class Rule:
    """When a share is accepted or rejected: both bounds for every number of trials up to some.

    Attributes:
        accepts: (m,) by number of failures from `first` on: from how many trials on so many still are accepted; beyond `MOST`: never.
        rejects: (m,) likewise: up to how many trials so many are rejected; 0: never.
        first: The number of failures with which they begin.
    """

    accepts: IntArray
    rejects: IntArray
    first: int = 0

    @property
    def least(self) -> int:
        """The number of trials that is enough if no more of them fail than `first`."""
        return int(self.accepts[0])

    def more(self, conforming: int, failing: int, rate: float) -> int | None:
        """About how many trials more decide if each conforms at `rate`, a straight line on; None: more than are looked ahead to."""
        n = conforming + failing
        accepts, rejects = self.accepts[failing - self.first :], self.rejects[failing - self.first :]
        further = np.arange(len(accepts))
        line = np.full(len(further), np.inf) if rate >= 1 else n + further / (1 - rate)  # when that many have failed
        accepted = np.maximum(accepts, n + 1)
        ahead = np.append(line[1:], np.inf)  # before the next one fails
        yes = accepted[(accepted < ahead) & (accepted <= MOST)]
        no = line[(line <= rejects) & (line > n)]
        found = [float(times.min()) for times in (yes, no) if len(times)]
        return math.ceil(min(found)) - n if found else None


def rule(share: float, accept_error: float, reject_error: float, failures: int = 4000, first: int = 0) -> Rule:
    """The bounds for a share.

    Args:
        share: The share to be reached, in (0, 1).
        accept_error: The greatest probability of accepting what has a smaller share.
        reject_error: The greatest probability of rejecting what has it.
        failures: Up to how many failures.
        first: From how many on.
    """
    f = np.arange(first, failures + 1)

    def enough(n: IntArray) -> BoolArray:
        found: BoolArray = log_wealth(n - f, f, share, above=True) >= -math.log(accept_error)
        return found

    def too_many(n: IntArray) -> BoolArray:
        found: BoolArray = log_wealth(n - f, f, share, above=False) >= -math.log(reject_error)
        return found

    accepts = _bisected(lambda n: ~enough(n), f, np.full(len(f), MOST + 1)) + 1
    rejects = np.where((f > 0) & too_many(f), _bisected(too_many, f, np.full(len(f), MOST + 1)), 0)
    return Rule(accepts.astype(np.int64), rejects.astype(np.int64), first)


def failures_within(share: float, reject_error: float, most: int) -> int:
    """More failures than so many there can't be within `most` trials without a rejection."""

    def undecided(f: IntArray) -> BoolArray:
        found: BoolArray = log_wealth(most - f, f, share, above=False) < -math.log(reject_error)
        return found

    return min(most, int(_bisected(undecided, np.array([0]), np.array([most + 1]))[0]) + 1)


def _bisected(holds: Callable[[IntArray], BoolArray], low: IntArray, high: IntArray) -> IntArray:
    """The last number from `low` on for which each element still holds, where from some number on it holds no more."""
    low, high = low.copy(), high.copy()
    while (high - low > 1).any():
        middle = (low + high) // 2
        still = holds(middle)
        low, high = np.where(still, middle, low), np.where(still, high, middle)
    return low


@dataclass(frozen=True, slots=True)
class Prospect:
    """What becomes of a criterion if each trial conforms with the same probability; exact, not simulated.

    Attributes:
        rate: That probability.
        accepted: Probability of being accepted within the trials that are planned.
        rejected: Probability of being rejected within them.
        expected: Mean number of trials until the decision, or the end of the plan.
        median: Within so many trials half of all verdicts fall; None: more than are planned.
        ninth: Within so many nine of ten do; None: more than are planned.
    """

    rate: float
    accepted: float
    rejected: float
    expected: float
    median: int | None
    ninth: int | None


def prospect(bounds: Rule, rate: float, most: int) -> Prospect:
    """What becomes of a criterion with these bounds within `most` trials at a rate.

    Args:
        bounds: Its bounds, up to `failures_within` so many trials at least.
        rate: Probability that a trial conforms.
        most: How many trials are planned at most.
    """
    f = np.arange(len(bounds.accepts))
    weight = np.zeros(len(f))
    weight[0] = 1.0
    low, high = 0, 1  # undecided are low <= failures < high
    accepted = rejected = expected = 0.0
    median = ninth = None
    for n in range(1, most + 1):
        expected += max(0.0, 1.0 - accepted - rejected)
        high = min(high + 1, len(f))
        part = weight[low:high]
        moved = part * rate
        moved[1:] += part[:-1] * (1 - rate)
        weight[low:high] = moved
        while low < high and bounds.accepts[low] <= n:
            accepted += weight[low]
            weight[low] = 0.0
            low += 1
        while high > low and bounds.rejects[high - 1] >= n:
            rejected += weight[high - 1]
            weight[high - 1] = 0.0
            high -= 1
        done = accepted + rejected
        median = n if median is None and done >= 0.5 else median
        ninth = n if ninth is None and done >= 0.9 else ninth
        if done > 1 - 1e-9 or low >= high:
            break
    return Prospect(rate, float(accepted), float(rejected), expected, median, ninth)
