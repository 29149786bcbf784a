"""Wilcoxon's signed-rank test for paired differences, exact also with ties.

Zeros are left out before ranking, as Wilcoxon did and as MATLAB, R and scipy do unless told otherwise (`pratt` ranks
them first and leaves their ranks out). Tied magnitudes share their mean rank; the null distribution is then that of
the ranks at hand, each sign a fair coin, computed by adding one rank at a time. So it is exact for any n up to 200.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from scipy import special

from clearway.errors import ClearwayError
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

MOST_EXACT = 200
"""Pairs up to which the distribution is computed; beyond, the normal approximation is as good."""
_DIGITS = 9
"""Differences are rounded to 1e-9 (s, m, rad or %), so that rounding in the data makes or breaks no tie."""


@dataclass(frozen=True, slots=True)
class SignedRank:
    """What the test says.

    Attributes:
        n: Number of pairs that were ranked (zeros left out).
        zeros: Number of pairs left out.
        statistic: Sum of the ranks of positive differences.
        p: The test's p, two-sided.
        exact: Whether p is of the exact distribution.
        smallest_p: The smallest p that n can reach, 2 / 2^n.
        effect: Matched-pairs rank-biserial correlation, -1 to 1.
        shift: Hodges and Lehmann's median difference; None where n is too small for the confidence, or a difference is
            infinite.
        low: Lower end of its confidence interval; None likewise.
        high: Upper end of its confidence interval; None likewise.
    """

    n: int
    zeros: int
    statistic: float
    p: float
    exact: bool
    smallest_p: float
    effect: float
    shift: float | None
    low: float | None
    high: float | None


def signed_rank(
    differences: FloatArray, *, zeros: Literal["wilcox", "pratt"] = "wilcox", confidence: float = 0.95
) -> SignedRank:
    """Test whether paired differences (n,) are symmetric about zero.

    Infinite differences are allowed: they rank highest, tied with one another.

    Raises:
        ClearwayError: a difference is NaN.
    """
    d = np.asarray(differences, dtype=np.float64)
    if np.isnan(d).any():
        raise ClearwayError("a paired difference is missing; leave incomplete pairs out first")
    d = np.round(d, _DIGITS)
    nonzero = d != 0
    if zeros == "wilcox":
        kept, ranks = d[nonzero], scipy.stats.rankdata(np.abs(d[nonzero]))
    else:
        kept, ranks = d[nonzero], scipy.stats.rankdata(np.abs(d))[nonzero]
    n, total = len(kept), float(ranks.sum())
    positive = float(ranks[kept > 0].sum())
    exact = n <= MOST_EXACT
    p = (_exact_p if exact else _normal_p)(ranks, positive)
    shift, low, high = _hodges_lehmann(d, confidence)
    effect = (2 * positive - total) / total if n else 0.0
    return SignedRank(n, len(d) - n, positive, p, exact, min(1.0, 2.0 ** (1 - n)), effect, shift, low, high)


def null_distribution(ranks: FloatArray) -> FloatArray:
    """P(2 W = k) for k = 0 ... 2 sum(ranks), W the sum of a random half of the ranks (multiples of 1/2)."""
    doubled = np.rint(2 * np.asarray(ranks)).astype(int)
    chance = np.zeros(int(doubled.sum()) + 1)
    chance[0], reach = 1.0, 0
    for r in doubled:
        chance[r : reach + r + 1] += chance[: reach + 1].copy()
        chance[: reach + r + 1] *= 0.5
        reach += r
    return chance


def _exact_p(ranks: FloatArray, positive: float) -> float:
    chance, at = null_distribution(ranks), round(2 * positive)
    return float(min(1.0, 2 * min(chance[: at + 1].sum(), chance[at:].sum())))


def _normal_p(ranks: FloatArray, positive: float) -> float:
    """Normal approximation with the variance of the ranks at hand (ties included) and continuity correction."""
    deviation = max(0.0, abs(positive - ranks.sum() / 2) - 0.5) / math.sqrt((ranks**2).sum() / 4)
    return float(2 * special.ndtr(-deviation))


def _hodges_lehmann(d: FloatArray, confidence: float) -> tuple[float | None, float | None, float | None]:
    """Median of the Walsh averages of all differences, and the interval that inverts the test on untied ranks."""
    n = len(d)
    if n == 0 or not np.isfinite(d).all():
        return None, None, None
    ordered, many = np.sort(d), n * (n + 1) // 2
    middle = {walsh_average(ordered, rank) for rank in ((many - 1) // 2, many // 2)}
    shift = float(np.mean(sorted(middle)))
    if n <= MOST_EXACT:
        below = np.cumsum(null_distribution(np.arange(1.0, n + 1))[::2])  # untied: 2 W is even
        cut = int(np.searchsorted(below, (1 - confidence) / 2 * (1 + 1e-12), side="right"))
    else:
        spread = math.sqrt(n * (n + 1) * (2 * n + 1) / 24)
        cut = int(n * (n + 1) / 4 + special.ndtri((1 - confidence) / 2) * spread)
    if cut == 0:
        return shift, None, None
    return shift, walsh_average(ordered, cut - 1), walsh_average(ordered, many - cut)


def walsh_average(ordered: FloatArray, rank: int) -> float:
    """The Walsh average (mean of two values, or of one with itself) that has this rank, from 0, among all n (n + 1) / 2.

    They are never listed: between the least and the greatest value the doubles themselves are bisected for the first
    with more than `rank` averages up to it. At most 64 counts of O(n) each, and the answer is one of the averages to the
    last bit.

    Args:
        ordered: (n,) finite values, ascending.
    """
    low, high = _place(float(ordered[0])), _place(float(ordered[-1]))
    while low < high:
        middle = (low + high) // 2
        if _averages_up_to(ordered, _double(middle)) > rank:
            high = middle
        else:
            low = middle + 1
    return _double(low)


@kernel
def _averages_up_to(ordered: FloatArray, bound: float) -> int:
    """How many of the Walsh averages are at most `bound`: the partners of a larger value are among those of a smaller one."""
    count, last = 0, len(ordered) - 1
    for first in range(len(ordered)):
        while last >= first and (ordered[first] + ordered[last]) / 2 > bound:
            last -= 1
        if last < first:
            break
        count += last - first + 1
    return count


def _place(value: float) -> int:
    """The number of a double in ascending order, 0 for both zeros."""
    bits = int(struct.unpack("<q", struct.pack("<d", value))[0])
    return bits if bits >= 0 else -(2**63) - bits


def _double(place: int) -> float:
    """The double that has this number."""
    return float(struct.unpack("<d", struct.pack("<q", place if place >= 0 else -(2**63) - place))[0])
