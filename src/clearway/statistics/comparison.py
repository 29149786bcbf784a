"""Two results side by side, test by test: paired differences with intervals, and paired successes.

Trials are paired by suite and scenario (every navigator and robot meets the same, with the same seed). Robot,
navigator and set-up are part of the pair where both results share any; two results with one robot each are thus compared across
robots, two with one navigator each across navigators.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.indicators import HEADLINE, Indicator
from clearway.statistics.columns import SYSTEM, batch_names, findings, groups, indicators_in, numbers, schema, values
from clearway.statistics.describe import bootstrap_interval
from clearway.statistics.multiple import asterisks, holm
from clearway.statistics.proportions import PairedSuccess, paired_success
from clearway.statistics.signed_rank import signed_rank

_LABELS = ("batch", "configuration", "speed", "obstacle_speed", "size", "gap", "repetition")
_CIRCUMSTANCES = ("seed", "floor_plan", "localisation", "tracking")
"""What may make the two trials of a pair other tests than their name says."""

_DIFFERENCES = schema(
    batch=str, indicator=str, unit=str, better=str, n=int, dropped=int, mean_a=float, mean_b=float,
    mean_difference=float, boot_low=float, boot_high=float, median_difference=float, low=float, high=float,
    p=float, stars=str, p_holm=float, stars_holm=str, smallest_p=float, effect=float, favours=str,
)  # fmt: skip


class NoCommonTest(ClearwayError):
    """Two results have no test in common."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """B against A.

    Attributes:
        a: Name of the one side.
        b: Name of the other.
        pairs: How many tests both ran.
        only_a: How many tests only A ran.
        only_b: How many tests only B ran.
        differences: One row an indicator and batch (batch null: all of them; of several suites, with its suite before it), B - A over complete pairs: mean with a
            bootstrap interval, median (Hodges-Lehmann) with its exact interval, Wilcoxon's p, Holm's over the rows of
            the same kind (all batches together; batch by batch), effect, and whom it `favours` (`A`, `B` or empty:
            p_holm > 0.05).
        success: Paired success by batch (None: all); a batch without a known success is left out.
        success_self: The same by the robots' own estimates.
        together: How many of the pairs share a simulation with another one (of several robots), and are not independent of it.
        tests: How many different tests the pairs are of, repetitions not counted.
        confidence: Of the intervals.
        differ_in: In which circumstances the trials of pairs differ: `localisation (truth, odometry)`, A's before B's; empty: in none.
    """

    a: str
    b: str
    pairs: int
    only_a: int
    only_b: int
    differences: pa.Table
    success: Mapping[str | None, PairedSuccess]
    success_self: Mapping[str | None, PairedSuccess]
    together: int = 0
    tests: int = 0
    confidence: float = 0.95
    differ_in: tuple[str, ...] = ()

    @property
    def doubtful(self) -> bool:
        """Whether of some success rates the interval, if it is one of 95 %, shows a difference and the test does not, or the other way about."""
        return self.confidence == 0.95 and any(s.doubtful for s in self.success.values())


def compare(
    a: pa.Table, b: pa.Table, *, names: tuple[str, str] = ("A", "B"), indicators: Sequence[str] | None = None,
    confidence: float = 0.95, seed: int = 0,
) -> Comparison:  # fmt: skip
    """Compare results B with results A, test by test.

    Raises:
        NoCommonTest: nothing to pair.
        ClearwayError: a test that occurs twice in one of them.
    """
    keys = _key_columns(a, b)
    first, second = _index(a, keys, names[0]), _index(b, keys, names[1])
    shared = [key for key in first if key in second]
    if not shared:
        raise NoCommonTest(f"{names[0]} and {names[1]} have no test in common (paired by {', '.join(keys)})")
    left, right = a.take(pa.array([first[k] for k in shared])), b.take(pa.array([second[k] for k in shared]))
    common = [i.name for i in indicators_in(a, indicators, HEADLINE) if i.name in b.column_names]
    chosen = indicators_in(a, common, HEADLINE)
    parts: dict[str | None, np.ndarray] = {None: np.arange(len(shared))}
    batch_of = np.array(batch_names(left.select(["suite", "batch"]).to_pylist()), dtype=object)
    parts |= {batch: np.flatnonzero(batch_of == batch) for batch in dict.fromkeys(batch_of)}
    rows: list[dict[str, Any]] = []
    for batch, members in parts.items():
        for indicator in chosen:
            row = _difference(indicator, left, right, members, confidence, seed)
            rows.append({"batch": batch} | row)
    adjust(rows)
    success, own = (_successes(name, left, right, parts, confidence) for name in ("success", "success_self"))
    without = len(first) - len(shared), len(second) - len(shared)
    tests = len(groups(left, [c for c in (*keys, *_LABELS) if c not in ("scenario", "repetition")]))
    return Comparison(
        *names, len(shared), *without, findings(rows, _DIFFERENCES), success, own, _together(left, right), tests, confidence,
        tuple(_differ_in(left, right)),
    )  # fmt: skip


def _together(left: pa.Table, right: pa.Table) -> int:
    """How many of the pairs have a trial that shares a simulation with one of another pair."""
    shared = np.zeros(left.num_rows, dtype=bool)
    for side in (left, right):
        runs = values(side, "run") if "run" in side.column_names else []
        often = Counter(run for run in runs if run)
        shared[: len(runs)] |= [often[run] > 1 for run in runs]
    return int(shared.sum())


def _differ_in(left: pa.Table, right: pa.Table) -> Iterator[str]:
    """The circumstances in which pairs differ, each with its two values, or with the number of pairs where there are several. One
    that a side leaves empty, as who asks for no tracking does, is no other one."""
    for column in _CIRCUMSTANCES:
        if column not in left.column_names or column not in right.column_names:
            continue
        both = zip(values(left, column), values(right, column), strict=True)
        unlike = [(one, two) for one, two in both if one != two and not {one, two} & {None, ""}]
        if len(set(unlike)) == 1:
            yield f"{column} ({unlike[0][0]}, {unlike[0][1]})"
        elif unlike:
            yield f"{column} (in {len(unlike)} of {left.num_rows} pairs)"


def _successes(
    name: str, left: pa.Table, right: pa.Table, parts: Mapping[str | None, np.ndarray], confidence: float
) -> dict[str | None, PairedSuccess]:
    """By batch, over the pairs of which both sides of the column `name` are known."""
    succeeded = np.stack([numbers(left, name), numbers(right, name)], axis=1)
    found = {}
    for batch, members in parts.items():
        known = members[~np.isnan(succeeded[members]).any(axis=1)]
        if len(known):
            found[batch] = paired_success(succeeded[known, 0], succeeded[known, 1], confidence)
    return found


def adjust(rows: Sequence[dict[str, Any]]) -> None:
    """Fill in Holm's p, the asterisks and whom a row favours: one family of all batches together, one batch by batch."""
    for family in ([r for r in rows if r["batch"] is None], [r for r in rows if r["batch"] is not None]):
        for row, p in zip(family, holm([np.nan if r["p"] is None else r["p"] for r in family]).tolist(), strict=True):
            row["p_holm"] = None if np.isnan(p) else p
            row["stars"], row["stars_holm"] = asterisks(row["p"]), asterisks(row["p_holm"])
            row["favours"] = _favoured(row)


def _key_columns(a: pa.Table, b: pa.Table) -> list[str]:
    named = all(None not in values(t, "scenario") for t in (a, b))
    keys = ["suite", "scenario"] if named else ["suite", *_LABELS]
    keys += ["member"] if all("member" in table.column_names for table in (a, b)) else []  # of several robots
    for column in SYSTEM:
        if column in a.column_names and column in b.column_names and set(values(a, column)) & set(values(b, column)):
            keys.append(column)
    return keys


def _index(table: pa.Table, keys: list[str], name: str) -> dict[tuple[Any, ...], int]:
    found: dict[tuple[Any, ...], int] = {}
    for row, key in enumerate(zip(*[values(table, column) for column in keys], strict=True)):
        if key in found:
            what = ", ".join(
                f"{column} {value}" for column, value in zip(keys, key, strict=True) if value not in (None, "")
            )
            raise ClearwayError(
                f"{name}: two trials for {what}; choose one robot, one navigator and one set-up of each"
            )
        found[key] = row
    return found


def _difference(
    indicator: Indicator, left: pa.Table, right: pa.Table, members: np.ndarray, confidence: float, seed: int
) -> dict[str, Any]:
    one, two = numbers(left, indicator.name)[members], numbers(right, indicator.name)[members]
    complete = ~np.isnan(one) & ~np.isnan(two)
    row: dict[str, Any] = {"indicator": indicator.name, "unit": indicator.unit, "better": indicator.better}
    return row | paired_row(one[complete], two[complete], int((~complete).sum()), confidence, seed)


def paired_row(one: FloatArray, two: FloatArray, dropped: int, confidence: float, seed: int) -> dict[str, Any]:
    """What complete pairs (n,) of values say about two - one; `dropped`: pairs that are not complete."""
    row: dict[str, Any] = {"n": len(one), "dropped": dropped, "p": None}
    if not len(one):
        return row
    test, boot = signed_rank(two - one, confidence=confidence), bootstrap_interval(two - one, confidence, seed)
    row |= {"mean_a": float(one.mean()), "mean_b": float(two.mean()), "mean_difference": float((two - one).mean())}
    row |= {"median_difference": test.shift, "low": test.low, "high": test.high, "effect": test.effect}
    row |= {"p": test.p, "smallest_p": test.smallest_p}
    return row | ({"boot_low": boot.low, "boot_high": boot.high} if boot else {})


def _favoured(row: Mapping[str, Any]) -> str:
    if row["p_holm"] is None or row["p_holm"] > 0.05 or row["better"] == "neither":
        return ""
    return "B" if (row["effect"] < 0) == (row["better"] == "lower") else "A"
