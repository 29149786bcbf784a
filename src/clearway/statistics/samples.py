"""How many trials show a reliability, by the exact binomial distribution.

The rule is fixed before the first trial: n trials with at most so many failures. Reliability R is shown with
confidence C if a robot of reliability R or worse would pass with probability 1 - C at most.
"""

from __future__ import annotations

from scipy import special

from clearway.errors import ClearwayError
from clearway.statistics.proportions import checked_probability

MOST = 10_000_000
"""Trials; more are not planned."""


def samples_needed(reliability: float, confidence: float, failures: int = 0) -> int:
    """Smallest number of trials that shows `reliability` at `confidence` with up to `failures` failures.

    Args:
        reliability: Rate of success to show, in (0, 1).
        confidence: Confidence to show it with, in (0, 1).
        failures: How many failures are allowed.

    Raises:
        ClearwayError: a number outside its range, or more than 10 million trials.
    """
    r, allowed = checked_probability("reliability", reliability), 1 - checked_probability("confidence", confidence)
    f = _failures(failures)

    def shown(n: int) -> bool:
        return bool(special.bdtr(f, n, 1 - r) <= allowed * (1 + 1e-12))

    low, high = f, f + 1
    while not shown(high):
        low, high = high, 2 * high
        if low > MOST:
            raise ClearwayError(f"reliability {r:g} with {f} failures would need more than {MOST:,} trials")
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if shown(middle) else (middle, high)
    return high


def reliability_shown(trials: int, failures: int, confidence: float) -> float:
    """The reliability that `trials` with `failures` failures show at `confidence` (lower Clopper-Pearson bound).

    Raises:
        ClearwayError: no trials, more failures than trials, or a confidence outside (0, 1).
    """
    f, error = _failures(failures), 1 - checked_probability("confidence", confidence)
    if trials < 1 or f > trials:
        raise ClearwayError(f"{failures} failures of {trials} trials cannot be")
    return 0.0 if f == trials else float(special.betaincinv(trials - f, f + 1, error))


def _failures(failures: int) -> int:
    if not 0 <= failures <= MOST or failures != int(failures):
        raise ClearwayError(f"failures {failures:.6g} must be a whole number, 0 to {MOST:,}")
    return int(failures)
