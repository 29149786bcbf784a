"""Pearson's correlations between indicators, the paper's words for their strength, and which indicators are redundant."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import scipy
from scipy import special

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.indicators import HEADLINE
from clearway.statistics.columns import SYSTEM, findings, groups, indicators_in, numbers, schema

PAPER_A = {
    ("DE", "OE"): 0.48,
    ("CT", "TCS"): 0.47,
    ("PL", "DE"): -0.40,
    ("PL", "OE"): -0.37,
    ("CT", "DE"): -0.23,
    ("CT", "OE"): -0.20,
    ("TCS", "MDO"): 0.33,
    ("DE", "MDO"): 0.20,
    ("CT", "MDO"): 0.18,
}
"""What paper A prints of its Fig. 7, both robots pooled."""
REDUNDANT = 0.40
"""Magnitude from which a correlation is called moderate, and one of the two indicators redundant."""
FEWEST = 10
"""Trials below which nothing is said of how strong a correlation is, nor of redundancy: by chance alone, |r| of nine unrelated
pairs of values is above 0.58 once in ten times."""
TOO_FEW = "too few trials"
POOLED = "pooled"

_PAIRS = schema(
    robot=str,
    navigator=str,
    setup=str,
    a=str,
    b=str,
    r=float,
    n=int,
    p=float,
    low=float,
    high=float,
    strength=str,
    paper=float,
)


@dataclass(frozen=True, slots=True)
class Correlation:
    """One coefficient of correlation.

    Attributes:
        n: Number of pairs of values.
        r: The coefficient; None where n or the spread is too small.
        p: Its two-sided p; None likewise.
        low: Lower end of its 95 % interval; None likewise.
        high: Upper end of its 95 % interval; None likewise.
    """

    n: int
    r: float | None
    p: float | None
    low: float | None
    high: float | None

    @property
    def strength(self) -> str:
        """Paper A's word for it, or that there are too few trials to say."""
        return "" if self.r is None else strength(self.r) if self.n >= FEWEST else TOO_FEW


@dataclass(frozen=True, slots=True, eq=False)
class Correlations:
    """A symmetric matrix of k indicators: `r` (k, k) with NaN where unknown, `n` (k, k).

    Attributes:
        indicators: Their names.
        pairs: The coefficient of every two of them, either way round.
    """

    indicators: tuple[str, ...]
    pairs: dict[tuple[str, str], Correlation]

    @property
    def r(self) -> FloatArray:
        return np.array([[self._r(a, b) for b in self.indicators] for a in self.indicators])

    @property
    def n(self) -> np.ndarray:
        return np.array([[self.pairs[a, b].n for b in self.indicators] for a in self.indicators])

    def _r(self, a: str, b: str) -> float:
        found = self.pairs[a, b].r
        return math.nan if found is None else found


@dataclass(frozen=True, slots=True)
class Reduced:
    """Which indicators are enough.

    Attributes:
        kept: The indicators that remain.
        dropped: The dropped ones: name, the one that stands for it, their r.
    """

    kept: tuple[str, ...]
    dropped: tuple[tuple[str, str, float], ...]


def strength(r: float) -> str:
    """Paper A's word for |r|, rounded to two digits as its bounds are: `very low`, `low`, `moderate`, `strong`, `very strong`."""
    size = round(abs(r), 2)
    bounds = ((0.19, "very low"), (0.39, "low"), (0.59, "moderate"), (0.79, "strong"))
    return next((word for bound, word in bounds if size <= bound), "very strong")


def pearson(x: FloatArray, y: FloatArray, confidence: float = 0.95) -> Correlation:
    """Pearson's correlation of (n,) and (n,), pairs with a NaN left out; interval by Fisher's z."""
    return _correlate(x, y, confidence, ranks=False)


def spearman(x: FloatArray, y: FloatArray, confidence: float = 0.95) -> Correlation:
    """Spearman's rank correlation, pairs with a NaN left out; interval by Fisher's z with Bonett and Wright's variance."""
    return _correlate(x, y, confidence, ranks=True)


def _correlate(x: FloatArray, y: FloatArray, confidence: float, *, ranks: bool) -> Correlation:
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 1:
        raise ClearwayError(f"a correlation needs equally many values of both; got {x.shape} and {y.shape}")
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    n = len(x)
    if n < 3 or _constant(x) or _constant(y):
        return Correlation(n, None, None, None, None)
    found = scipy.stats.spearmanr(x, y) if ranks else scipy.stats.pearsonr(x, y)
    r, p = float(found.statistic), float(found.pvalue)
    if n < 4 or abs(r) >= 1:
        return Correlation(n, r, p, None, None)
    variance = (1 + r * r / 2 if ranks else 1.0) / (n - 3)
    half = float(special.ndtri((1 + confidence) / 2)) * math.sqrt(variance)
    return Correlation(n, r, p, math.tanh(math.atanh(r) - half), math.tanh(math.atanh(r) + half))


def _constant(x: FloatArray) -> bool:
    return bool(np.ptp(x) <= 1e-9 * max(1e-3, float(np.abs(x).max())))


def correlations(table: pa.Table, indicators: Sequence[str] | None = None) -> Correlations:
    """Pearson's matrix over the trials of `table`; each pair of indicators uses the trials that have both."""
    names = tuple(i.name for i in indicators_in(table, indicators, HEADLINE))
    data = {name: numbers(table, name) for name in names}
    pairs = {}
    for i, a in enumerate(names):
        for b in names[i:]:
            pairs[a, b] = pairs[b, a] = pearson(data[a], data[b])
    return Correlations(names, pairs)


def correlations_by_robot(
    table: pa.Table, indicators: Sequence[str] | None = None
) -> dict[tuple[str, str, str | None], Correlations]:
    """Matrices by (robot, navigator, set-up), and by (`pooled`, ...) over all robots where there are several."""
    found = {key: correlations(table.take(pa.array(rows)), indicators) for key, rows in groups(table, SYSTEM).items()}
    for (navigator, setup), rows in groups(table, SYSTEM[1:]).items():
        if sum(key[1:] == (navigator, setup) for key in found) > 1:
            found[POOLED, navigator, setup] = correlations(table.take(pa.array(rows)), indicators)
    return found


def correlation_table(table: pa.Table, indicators: Sequence[str] | None = None) -> pa.Table:
    """The same as a table, one row a pair, with paper A's coefficient beside the pooled one."""
    rows = []
    for (robot, navigator, setup), matrix in correlations_by_robot(table, indicators).items():
        for i, a in enumerate(matrix.indicators):
            for b in matrix.indicators[i + 1 :]:
                c = matrix.pairs[a, b]
                row = {
                    "robot": robot,
                    "navigator": navigator,
                    "setup": setup,
                    "a": a,
                    "b": b,
                    "r": c.r,
                    "n": c.n,
                    "p": c.p,
                }
                row |= {"low": c.low, "high": c.high, "strength": c.strength}
                row["paper"] = PAPER_A.get((a, b), PAPER_A.get((b, a))) if robot == POOLED else None
                rows.append(row)
    return findings(rows, _PAIRS)


def reduced_set(matrix: Correlations, threshold: float = REDUNDANT) -> Reduced:
    """Drop redundant indicators, strongest correlation first, until none of |r| >= threshold is left.

    Of the two, the one with the larger sum of |r| to all that are still kept goes; if equal, the later one. What fewer than
    `FEWEST` trials say does not count.
    """
    kept = list(matrix.indicators)
    dropped: list[tuple[str, str, float]] = []
    size = dict(zip(matrix.indicators, np.where(matrix.n >= FEWEST, np.nan_to_num(np.abs(matrix.r)), 0.0), strict=True))
    place = {name: i for i, name in enumerate(matrix.indicators)}
    while True:
        rivals = [(float(size[a][place[b]]), a, b) for i, a in enumerate(kept) for b in kept[i + 1 :]]
        strongest = max(rivals, key=lambda rival: rival[0], default=(0.0, "", ""))
        if strongest[0] < threshold:
            return Reduced(tuple(kept), tuple(dropped))
        _, a, b = strongest

        def total(name: str) -> float:
            return sum(float(size[name][place[other]]) for other in kept if other != name)

        goes, stays = (a, b) if total(a) > total(b) else (b, a)
        r = matrix.pairs[a, b].r
        kept.remove(goes)
        dropped.append((goes, stays, math.nan if r is None else r))
