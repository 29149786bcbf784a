"""Paper A's comparison of speeds: Wilcoxon's signed-rank test, paired by (configuration, repetition).

A configuration is everything that a test fixes but the speed: name, floor plan, size, gap, obstacle speed. For each
robot, navigator, suite, batch, indicator and pair of speeds there are three analyses:

- `complete pairs`: both trials have a value (an unfinished trial has no CT, PL, DE, OE, TCS). The headline.
- `failures ranked worst`: a trial without success is worse than any other, by the indicator's better direction, and
  two of them are equal. Shows whether leaving failures out decided the result. It has no median difference.
- `configuration means`: complete pairs, averaged over repetitions first, because repetitions of one configuration are
  not independent: n is the number of configurations.

The differences are value at the higher speed less value at the lower one. Holm's family: all tests of one analysis for
one robot and navigator in a suite, over batches, indicators and pairs of speeds (what paper A's Table 4 lists for a robot).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pyarrow as pa

from clearway.geometry.shapes import FloatArray
from clearway.indicators import HEADLINE, Indicator
from clearway.statistics.columns import GROUP, findings, groups, indicators_in, numbers, schema, values
from clearway.statistics.multiple import asterisks, holm
from clearway.statistics.signed_rank import signed_rank

COMPLETE, WORST, MEANS = "complete pairs", "failures ranked worst", "configuration means"
ANALYSES = (COMPLETE, WORST, MEANS)

CONFIGURATION = ("configuration", "floor_plan", "localisation", "size", "gap", "obstacle_speed")
"""Columns that make a configuration; with the repetition they make a pair."""

_TESTS = schema(
    robot=str, navigator=str, setup=str, suite=str, batch=str, indicator=str, unit=str, better=str, analysis=str, speed_a=float, speed_b=float,
    n=int, dropped=int, zeros=int, mean_a=float, mean_b=float, difference=float, low=float, high=float, statistic=float,
    p=float, stars=str, p_holm=float, stars_holm=str, smallest_p=float, exact=bool, effect=float,
)  # fmt: skip


def wilcoxon_between_speeds(
    table: pa.Table, indicators: Sequence[str] | None = None, *, confidence: float = 0.95
) -> pa.Table:
    """Test every pair of speeds for each indicator (default: paper A's six), robot, navigator, suite and batch.

    A row of the result: n pairs, `dropped` pairs that were run but cannot be used, `zeros` pairs without a difference,
    the means, the median difference with its interval, p with asterisks before and after Holm, the smallest p that this
    n can reach, and the rank-biserial `effect` (positive: larger at speed_b).
    """
    chosen = indicators_in(table, indicators, HEADLINE)
    data = {i.name: numbers(table, i.name) for i in chosen}
    success = numbers(table, "success")
    configuration = list(zip(*[values(table, c) for c in CONFIGURATION if c in table.column_names], strict=True))
    members = values(table, "member") if "member" in table.column_names else [""] * len(table)  # of several robots
    repetition = list(zip(values(table, "repetition"), members, strict=True))
    rows: list[dict[str, Any]] = []
    families: list[tuple[Any, ...]] = []
    for group, there in groups(table, GROUP[:-1]).items():
        speeds = groups(table.take(pa.array(there)), ("speed",))
        known = [(key[0], there[rows]) for key, rows in speeds.items() if key[0] is not None]
        for (a, in_a), (b, in_b) in combinations(known, 2):
            pairs, repeated = _pair(in_a, in_b, configuration, repetition)
            for indicator in chosen:
                for analysis in ANALYSES:
                    one, two = data[indicator.name][pairs[:, 0]], data[indicator.name][pairs[:, 1]]
                    failed = success[pairs] == 0
                    label = [configuration[i] for i in pairs[:, 0]]
                    found = _test(analysis, indicator, one, two, failed, label, confidence)
                    if found is None:
                        continue
                    row = dict(zip(GROUP, group, strict=False)) | {"analysis": analysis}
                    row |= {"indicator": indicator.name, "unit": indicator.unit, "better": indicator.better}
                    row |= {"speed_a": a, "speed_b": b} | found
                    row["dropped"] += repeated
                    rows.append(row)
                    families.append((*group[:-1], analysis))
    _adjust(rows, families)
    return findings(rows, _TESTS)


def _pair(
    in_a: np.ndarray, in_b: np.ndarray, configuration: list[tuple[Any, ...]], repetition: list[Any]
) -> tuple[np.ndarray, int]:
    """(n, 2) row numbers of the same test at both speeds, and how many tests could not be told apart."""

    def tests(rows: np.ndarray) -> dict[tuple[Any, ...], list[int]]:
        found: dict[tuple[Any, ...], list[int]] = {}
        for row in rows.tolist():
            found.setdefault((configuration[row], repetition[row]), []).append(row)
        return found

    first, second = tests(in_a), tests(in_b)
    shared = [key for key in first if key in second]
    single = [key for key in shared if len(first[key]) == len(second[key]) == 1]
    pairs = np.array([(first[key][0], second[key][0]) for key in single], dtype=int).reshape(-1, 2)
    return pairs, len(shared) - len(single)


def _test(
    analysis: str, indicator: Indicator, one: FloatArray, two: FloatArray, failed: np.ndarray,
    label: list[tuple[Any, ...]], confidence: float,
) -> dict[str, Any] | None:  # fmt: skip
    """One test; None where the indicator does not apply to any of these trials, or the analysis not to the indicator."""
    if np.isnan(one).all() and np.isnan(two).all():
        return None
    complete = ~np.isnan(one) & ~np.isnan(two)
    differences, used = (two - one)[complete], int(complete.sum())
    if analysis == WORST:
        if indicator.better == "neither":
            return None
        differences, used = ranked_worst(one, two, failed, indicator.better)
    elif analysis == MEANS:
        names = [name for name, whole in zip(label, complete, strict=True) if whole]
        number = {name: i for i, name in enumerate(dict.fromkeys(names))}
        which = np.array([number[name] for name in names], dtype=int)
        differences = np.bincount(which, differences) / np.bincount(which) if len(which) else differences
    test = signed_rank(differences, confidence=confidence)
    return {
        "n": len(differences), "dropped": len(one) - used, "zeros": test.zeros,
        "mean_a": float(one[complete].mean()) if complete.any() else None,
        "mean_b": float(two[complete].mean()) if complete.any() else None,
        "difference": test.shift, "low": test.low, "high": test.high, "statistic": test.statistic,
        "p": test.p if len(differences) else None, "smallest_p": test.smallest_p if len(differences) else None,
        "exact": test.exact, "effect": test.effect if len(differences) else None,
    }  # fmt: skip


def ranked_worst(one: FloatArray, two: FloatArray, failed: np.ndarray, better: str) -> tuple[FloatArray, int]:
    """Differences two - one (n,) in which a failed trial is infinitely bad and two failed ones are equal, and their number.

    Args:
        one: (n,) values at one speed, NaN where missing.
        two: (n,) values at the other, NaN where missing.
        failed: (n, 2) whether the trials failed.
        better: Which is better, `lower` or `higher`.
    """
    worst = np.inf if better == "lower" else -np.inf
    a, b = np.where(failed[:, 0], worst, one), np.where(failed[:, 1], worst, two)
    usable = ~np.isnan(a) & ~np.isnan(b)
    a, b = a[usable], b[usable]
    equal = a == b
    return np.where(equal, 0.0, b - np.where(equal, 0.0, a)), int(usable.sum())


def _adjust(rows: list[dict[str, Any]], families: list[tuple[Any, ...]]) -> None:
    """Fill in Holm's p within each family, and the asterisks."""
    for family in dict.fromkeys(families):
        members = [row for row, of in zip(rows, families, strict=True) if of == family]
        adjusted = holm([np.nan if row["p"] is None else row["p"] for row in members])
        for row, p in zip(members, adjusted.tolist(), strict=True):
            row["p_holm"] = None if np.isnan(p) else p
            row["stars"], row["stars_holm"] = asterisks(row["p"]), asterisks(row["p_holm"])
