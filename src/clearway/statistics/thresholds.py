"""From which value on success is at least R: a sequential search along a monotone dose-response, with an interval that holds
however the search went and whenever it stopped.

Values are scouted by bisection, a few trials each. Then the easiest value that seemed too hard and the hardest that seemed easy
enough are put to the test, each by trials that count from there on: a bet against "success is at most R" (or "at least R") whose
wealth, if that is true, is a supermartingale for any design (Ville 1939; Shafer 2021, J. R. Stat. Soc. A 184, 407). The j-th value
that is put to the test is decided once the wealth is j (j + 1) / (1 - confidence): all errors together stay below 1 - confidence.
A value that cannot be decided gives way to its neighbour. Where that leads to the easiest value, and that cannot be decided soon either,
all further trials are its: it decides whether anything is shown at all.
Nothing is assumed of the curve but that success does not fall from a harder value to an easier one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.statistics.proportions import checked_probability

SCOUT = 4
"""Trials of a value that is scouted."""
BLOCK = {True: 12, False: 4}
"""Trials of a value that is put to the test, before the search looks again: of one that seems easy enough, and too hard."""
PATIENCE = 2.2
"""A value is given up once it cannot be decided within so many times the trials that show R where none fails,"""
LEAST_PATIENCE = 60
"""or within so many trials if that is more."""


@dataclass(frozen=True, slots=True)
class Block:
    """What is to be tried next.

    Attributes:
        index: The value's place in the order from the hardest to the easiest, from 0.
        trials: How many trials of it.
        testing: Whether these count as a test; otherwise they scout.
    """

    index: int
    trials: int
    testing: bool


@dataclass(slots=True)
class _Test:
    """A value that was put to the test: whether success is above R there, or below."""

    index: int
    above: bool
    order: int
    successes: int = 0
    trials: int = 0


class ThresholdSearch:
    """Searches for the hardest value at which success is at least R. The same outcomes lead to the same search.

    Args:
        values: How many values there are, ordered from the hardest to the easiest.
        reliability: R, in (0, 1).
        confidence: Of the interval, in (0, 1).
        most: How many trials there may be in all.

    Attributes:
        successes: (values,) successes of each value, scouting and testing together.
        trials: (values,) trials of each value.
        fails: The easiest value at which success is shown to be below R; None: none is.
        passes: The hardest value at which success is shown to be above R; None: none is.

    Raises:
        ClearwayError: no values, R or the confidence outside (0, 1), or fewer trials than would show R at a flawless value.
    """

    def __init__(self, values: int, reliability: float, confidence: float = 0.95, most: int = 400) -> None:
        if values < 2:
            raise ClearwayError(f"{values} values are no range to search; at least 2 are")
        self.reliability = checked_probability("reliability", reliability)
        self.confidence = checked_probability("confidence", confidence)
        needed = fewest_trials(reliability, confidence) + SCOUT * math.ceil(math.log2(values + 1))
        if most < needed:
            raise ClearwayError(
                f"{most} trials cannot show {reliability:.15g} success with {confidence:.15g} confidence, even where none fails; at "
                f"least {needed} can",
                field="trials",
            )
        self.most = most
        self.successes, self.trials = np.zeros(values, dtype=np.int64), np.zeros(values, dtype=np.int64)
        self.fails: int | None = None
        self.passes: int | None = None
        self._tests: list[_Test] = []
        self._low, self._high = -1, values  # what seems too hard, and easy enough
        self._pass = self._fail = -1  # what is put to the test next, once all is scouted
        self._stride = {True: 1, False: 1}
        self._open = {True: True, False: True}  # whether that side is still searched
        self._scouted = False

    def next(self) -> Block | None:
        """What to try next; None: the search is over."""
        left = self.most - int(self.trials.sum())
        if left <= 0:
            return None
        if not self._scouted:
            return Block((self._low + self._high) // 2, min(SCOUT, left), testing=False)
        for above in (True, False):
            if self._open[above]:
                return Block(self._test(above, self._index(above)).index, min(BLOCK[above], left), testing=True)
        return Block(len(self.trials) - 1, min(BLOCK[True], left), testing=True) if self._undecided else None

    def tell(self, block: Block, successes: int) -> None:
        """Take note of what came of a block.

        Raises:
            ClearwayError: there are more successes than trials.
        """
        if not 0 <= successes <= block.trials:
            raise ClearwayError(f"{successes} successes of {block.trials} trials cannot be")
        self.successes[block.index] += successes
        self.trials[block.index] += block.trials
        if not block.testing:
            self._scout(block, successes)
            return
        if self._undecided:
            under_way = [self._test(above, block.index) for above in (True, False)]
        else:
            under_way = [
                test
                for test in self._tests
                if test.index == block.index == self._index(test.above) and self._open[test.above]
            ]
        for test in under_way:
            test.successes += successes
            test.trials += block.trials
            self._judge(test)

    @property
    def _undecided(self) -> bool:
        """Whether nothing is left to put to the test, though not even the easiest value is decided."""
        return not any(self._open.values()) and self.passes is None and self.fails != len(self.trials) - 1

    def _scout(self, block: Block, successes: int) -> None:
        if successes >= self.reliability * block.trials:
            self._high = block.index
        else:
            self._low = block.index
        if self._high - self._low == 1:
            self._scouted = True
            last = len(self.trials) - 1
            self._pass, self._fail = min(self._high, last), max(self._low, 0)
            self._open = {True: self._high <= last, False: self._low >= 0}

    def _index(self, above: bool) -> int:
        """The value that side puts to the test."""
        return self._pass if above else self._fail

    def _test(self, above: bool, index: int) -> _Test:
        """The test of a value, begun if need be."""
        for test in self._tests:
            if test.index == index and test.above == above:
                return test
        self._tests.append(_Test(index, above, len(self._tests) + 1))
        return self._tests[-1]

    def _judge(self, test: _Test) -> None:
        wanted = _wanted(test.order, self.confidence)
        if log_evidence(test.successes, test.trials, self.reliability, above=test.above) >= wanted:
            if test.above:
                self.passes = test.index
            else:
                self.fails = test.index
            self._open[test.above] = False
        if not self._open[test.above]:
            return
        share = self.reliability if test.above else 1 - self.reliability
        good = test.successes if test.above else test.trials - test.successes
        enough = max(PATIENCE * _flawless(self.reliability, wanted, 0), LEAST_PATIENCE)
        if _flawless(share, wanted, test.trials - good) <= enough:
            return
        last, stride = len(self.trials) - 1, self._stride[test.above]
        self._stride[test.above] = 2 * stride
        at_the_end = test.index == (last if test.above else 0)
        if at_the_end:
            self._open[test.above] = False
        elif test.above:
            self._pass = min(test.index + stride, last)
            self._open[False] |= self._low < 0  # what seemed easy enough isn't: there may be something too hard
            self._fail = self._fail if self._low >= 0 else 0
            self._low = max(self._low, 0)
        else:
            self._fail = max(test.index - stride, 0)
            if self._high > last:  # what seemed too hard isn't: there may be something easy enough
                self._high, self._pass, self._open[True] = last, last, True

    @property
    def curve(self) -> FloatArray:
        """(values,) the isotonic estimate of success, NaN at values that were not tried."""
        tried = self.trials > 0
        found = np.full(len(self.trials), math.nan)
        found[tried] = isotonic(self.successes[tried] / self.trials[tried], self.trials[tried].astype(np.float64))
        return found

    @property
    def estimate(self) -> int | None:
        """The hardest value between `fails` and `passes` at which the isotonic estimate reaches R; None: there is none."""
        curve = self.curve
        least = -1 if self.fails is None else self.fails
        most = len(curve) - 1 if self.passes is None else self.passes
        found = [i for i in range(least + 1, most + 1) if curve[i] >= self.reliability]
        return found[0] if found else self.passes


def log_evidence(successes: int, trials: int, reliability: float, *, above: bool) -> float:
    """The log of the wealth of a bet that success is above R (or below) after some trials.

    The bet is on Jeffreys' mixture Beta(1/2, 1/2), cut at R, against R itself.

    Args:
        successes: How many.
        trials: Of how many.
        reliability: R.
        above: Whether the bet is on more than R; otherwise on less.
    """
    a, b = successes + 0.5, trials - successes + 0.5
    tail = special.betaincc if above else special.betainc
    share = float(tail(a, b, reliability))
    if share <= 0.0:
        return -math.inf
    mixture = special.betaln(a, b) + math.log(share) - special.betaln(0.5, 0.5) - math.log(tail(0.5, 0.5, reliability))
    return float(mixture - special.xlogy(successes, reliability) - special.xlog1py(trials - successes, -reliability))


def fewest_trials(reliability: float, confidence: float) -> int:
    """How many trials without a failure show, as the first value that is put to the test, that success is above R."""
    return _flawless(reliability, _wanted(1, confidence), 0)


def isotonic(shares: Sequence[float] | FloatArray, weights: Sequence[float] | FloatArray) -> FloatArray:
    """(n,) the non-decreasing sequence nearest to `shares` by least squares, each with its weight (pool adjacent violators)."""
    blocks: list[list[float]] = []  # mean, weight, how many
    for share, weight in zip(shares, weights, strict=True):
        blocks.append([float(share), float(weight), 1])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            mean, more, many = blocks.pop()
            last = blocks[-1]
            last[0] = (last[0] * last[1] + mean * more) / (last[1] + more)
            last[1] += more
            last[2] += many
    return np.concatenate([np.full(int(many), mean) for mean, _, many in blocks]) if blocks else np.zeros(0)


def _wanted(order: int, confidence: float) -> float:
    return math.log(order * (order + 1) / (1 - confidence))


@lru_cache(maxsize=4096)
def _flawless(share: float, wanted: float, misses: int) -> int:
    """How many trials, `misses` of which speak against it, show that their `share` is exceeded."""
    low, high = misses, misses + 1
    while log_evidence(high - misses, high, share, above=True) < wanted:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        if log_evidence(middle - misses, middle, share, above=True) < wanted:
            low = middle
        else:
            high = middle
    return high
