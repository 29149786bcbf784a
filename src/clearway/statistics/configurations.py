"""Two results side by side whose trials are no pairs: a simulation and a recording, or two recordings (before, after).

The third repetition in the lab has nothing to do with the third one in the simulator, so trials are matched by
configuration: suite, batch, configuration, set speed, obstacle speed, size, gap; robot, navigator and set-up where both
results share any. The repetitions of a configuration are averaged first, then the configurations are pairs. Success is
compared as the difference of two rates of independent trials.

Three uncertainties are told apart. Over configurations (bootstrap, Wilcoxon): what another choice of configurations
would give. Over repetitions (`rep_low`, `rep_high`): what repeating these very configurations would give, Student's t
with Welch's degrees of freedom, the variance pooled over the configurations of a side; it exists for a single
configuration too. And U: how far off all of the measured values may be together, which no repetition averages out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import scipy

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.indicators import HEADLINE, Indicator
from clearway.statistics.columns import SYSTEM, batch_names, findings, groups, indicators_in, numbers, schema, values
from clearway.statistics.comparison import adjust, paired_row
from clearway.statistics.proportions import RateDifference, rate_difference

LABELS = ("suite", "batch", "configuration", "speed", "obstacle_speed", "size", "gap")
"""What makes a configuration, besides the system."""
RECORDED = "recorded"

_DIFFERENCES = schema(
    batch=str, indicator=str, unit=str, better=str, n=int, dropped=int, trials_a=int, trials_b=int, mean_a=float,
    mean_b=float, mean_difference=float, boot_low=float, boot_high=float, rep_low=float, rep_high=float, u_a=float,
    u_b=float, median_difference=float, low=float, high=float, p=float, stars=str, p_holm=float, stars_holm=str,
    smallest_p=float, effect=float, favours=str,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Repetitions:
    """Trials of one side in the matched configurations.

    Attributes:
        trials: How many there are.
        fewest: How many a configuration has at least.
        most: How many a configuration has at most.
    """

    trials: int
    fewest: int
    most: int


@dataclass(frozen=True, slots=True, eq=False)
class ConfigurationComparison:
    """B against A, configuration by configuration.

    Attributes:
        a: Name of the one side.
        b: Name of the other.
        source_a: Where A's trials come from: `simulated`, `recorded`, or both joined by `+`.
        source_b: Where B's trials come from, likewise.
        matched_by: The columns that make a configuration.
        configurations: How many configurations both have.
        only_a: How many configurations only A has.
        only_b: How many configurations only B has.
        repetitions_a: A's trials in the matched configurations.
        repetitions_b: B's trials in the matched configurations.
        differences: One row an indicator and batch (batch null: all; of several suites, with its suite before it), B - A over the means of configurations: as of a
            `Comparison`, with n the number of configurations that have a value on both sides and `dropped` the others,
            trials_a, trials_b the trials behind the means, rep_low, rep_high the interval over repetitions, u_a, u_b
            the mean expanded uncertainty of what was measured (0: exact; None: unknown, or the indicator has none).
        success: By batch (None: all), of the matched configurations' trials whose success is known.
        by_motion_a: How many of A's trials in the matched configurations have legs that were found by the robot's
            motion.
        by_motion_b: How many of B's trials there have such legs.
        confidence: Of the intervals.
    """

    a: str
    b: str
    source_a: str
    source_b: str
    matched_by: tuple[str, ...]
    configurations: int
    only_a: int
    only_b: int
    repetitions_a: Repetitions
    repetitions_b: Repetitions
    differences: pa.Table
    success: Mapping[str | None, RateDifference]
    by_motion_a: int = 0
    by_motion_b: int = 0
    confidence: float = 0.95

    @property
    def kind(self) -> str:
        """What B - A is: `sim-to-real difference`, `real-to-sim difference`, or `difference`."""
        names = {("simulated", RECORDED): "sim-to-real difference", (RECORDED, "simulated"): "real-to-sim difference"}
        return names.get((self.source_a, self.source_b), "difference")


def sources(table: pa.Table) -> frozenset[str]:
    """Where its trials come from; results from before there were recordings are simulated."""
    if "source" not in table.column_names:
        return frozenset({"simulated"})
    return frozenset(v or "simulated" for v in values(table, "source"))


def no_pairs(a: pa.Table, b: pa.Table) -> bool:
    """Whether trials of these results can only be matched by configuration."""
    if sources(a) != sources(b):
        return True
    return RECORDED in sources(a) and any(None in values(table, "scenario") for table in (a, b))


def compare_configurations(
    a: pa.Table, b: pa.Table, *, names: tuple[str, str] = ("A", "B"), indicators: Sequence[str] | None = None,
    confidence: float = 0.95, seed: int = 0,
) -> ConfigurationComparison:  # fmt: skip
    """Compare results B with results A, configuration by configuration.

    Raises:
        ClearwayError: no configuration in common, or a result with several robots, navigators or set-ups of which the
            other has none.
    """
    keys = _key_columns(a, b, names)
    first, second = _index(a, keys), _index(b, keys)
    shared = [key for key in first if key in second]
    if not shared:
        raise ClearwayError(
            f"{names[0]} and {names[1]} have no configuration in common (matched by {', '.join(keys)}): "
            f"{names[0]} has {_example(first, keys)}; {names[1]} has {_example(second, keys)}"
        )
    left, right = [first[k] for k in shared], [second[k] for k in shared]
    common = [i.name for i in indicators_in(a, indicators, HEADLINE) if i.name in b.column_names]
    chosen = indicators_in(a, common, HEADLINE)
    parts: dict[str | None, list[int]] = {None: list(range(len(shared)))}
    for k, batch in enumerate(batch_names(dict(zip(keys, key, strict=True)) for key in shared)):
        parts.setdefault(batch, []).append(k)
    rows = []
    values_a, values_b = ({name: numbers(t, name) for name in (*common, "success")} for t in (a, b))
    for batch, members in parts.items():
        for indicator in chosen:
            side_a, side_b = (
                [_known(v[indicator.name], s[k]) for k in members] for v, s in ((values_a, left), (values_b, right))
            )
            row = _difference(indicator, side_a, side_b, confidence, seed)
            u = {f"u_{x}": _uncertainty(t, indicator.name, [s[k] for k in members])
                 for x, t, s in (("a", a, left), ("b", b, right))}  # fmt: skip
            rows.append({"batch": batch} | row | u)
    adjust(rows)
    success = {}
    for batch, members in parts.items():
        one, two = (
            np.concatenate([_known(v["success"], s[k]) for k in members])
            for v, s in ((values_a, left), (values_b, right))
        )
        if len(one) and len(two):
            success[batch] = rate_difference(int(one.sum()), len(one), int(two.sum()), len(two), confidence)
    source_a, source_b = ("+".join(sorted(sources(t))) for t in (a, b))
    return ConfigurationComparison(
        *names, source_a, source_b, tuple(keys), len(shared), len(first) - len(shared),
        len(second) - len(shared), _repetitions(left), _repetitions(right), findings(rows, _DIFFERENCES), success,
        _by_motion(a, left), _by_motion(b, right), confidence,
    )  # fmt: skip


def _key_columns(a: pa.Table, b: pa.Table, names: tuple[str, str]) -> list[str]:
    keys = list(LABELS)
    for column in SYSTEM:
        if column not in a.column_names or column not in b.column_names:
            continue
        there = [dict.fromkeys(values(t, column)) for t in (a, b)]
        if set(there[0]) & set(there[1]):
            keys += [] if set(there[0]) | set(there[1]) == {None} else [column]
            continue
        for name, found in zip(names, there, strict=True):
            if len(found) > 1:
                raise ClearwayError(
                    f"{name} has {len(found)} values of {column} ({', '.join(map(str, found))}) and the other result none "
                    f"of them; compare results with one {column}"
                )
    return keys


def _index(table: pa.Table, keys: list[str]) -> dict[tuple[Any, ...], np.ndarray]:
    """Row numbers by configuration; numbers agree to 1e-6."""
    found: dict[tuple[Any, ...], list[int]] = {}
    for key, rows in groups(table, keys).items():
        near = tuple(round(v, 6) if isinstance(v, float) else v for v in key)
        found.setdefault(near, []).extend(rows.tolist())
    return {key: np.array(rows) for key, rows in found.items()}


def _example(index: Mapping[tuple[Any, ...], Any], keys: list[str]) -> str:
    if not index:
        return "no trials"
    parts = [f"{k} {v}" for k, v in zip(keys, next(iter(index)), strict=True) if v is not None]
    return ", ".join(parts) + (f" and {len(index) - 1} more" if len(index) > 1 else "")


def _repetitions(rows: Sequence[np.ndarray]) -> Repetitions:
    counts = [len(r) for r in rows]
    return Repetitions(sum(counts), min(counts), max(counts))


def _by_motion(table: pa.Table, rows: Sequence[np.ndarray]) -> int:
    if "legs_by_motion" not in table.column_names:
        return 0
    found = values(table, "legs_by_motion")
    return sum(bool(found[row]) for several in rows for row in several)


def _known(every: FloatArray, rows: np.ndarray) -> FloatArray:
    found: FloatArray = every[rows]
    return found[~np.isnan(found)]


def _uncertainty(table: pa.Table, name: str, rows: Sequence[np.ndarray]) -> float | None:
    """Mean expanded uncertainty of the values of `name`; None where one is unknown."""
    if f"{name}_U" not in table.column_names:
        return None
    every = np.concatenate(rows)
    u = numbers(table, f"{name}_U")[every][~np.isnan(numbers(table, name)[every])]
    return float(u.mean()) if len(u) and not np.isnan(u).any() else None


def _difference(
    indicator: Indicator, one: Sequence[FloatArray], two: Sequence[FloatArray], confidence: float, seed: int
) -> dict[str, Any]:
    """The row of one indicator from the values of each configuration on both sides."""
    both = [(x, y) for x, y in zip(one, two, strict=True) if len(x) and len(y)]
    # equal values must not differ by the rounding of their means
    means = np.round(np.array([(x.mean(), y.mean()) for x, y in both]).reshape(-1, 2), 8)
    row: dict[str, Any] = {"indicator": indicator.name, "unit": indicator.unit, "better": indicator.better}
    row |= paired_row(means[:, 0], means[:, 1], len(one) - len(both), confidence, seed)
    row |= {"trials_a": sum(len(x) for x, _ in both), "trials_b": sum(len(y) for _, y in both)}
    if both and (found := repetition_interval([x for x, _ in both], [y for _, y in both], confidence)):
        row |= {"rep_low": found[0], "rep_high": found[1]}
    return row


def repetition_interval(
    one: Sequence[FloatArray], two: Sequence[FloatArray], confidence: float
) -> tuple[float, float] | None:
    """Interval of the mean over configurations of (mean of `two` - mean of `one`), over repetitions.

    For one configuration it is Welch's. None where no configuration of a side was repeated.
    """
    spread, freedom, centre = [], [], 0.0
    for sign, side in ((-1.0, one), (1.0, two)):
        free = sum(len(x) - 1 for x in side)
        if free < 1:
            return None
        variance = sum(float(((x - x.mean()) ** 2).sum()) for x in side) / free
        spread.append(variance * sum(1 / len(x) for x in side) / len(side) ** 2)
        freedom.append(free)
        centre += sign * sum(float(x.mean()) for x in side) / len(side)
    total = sum(spread)
    if not total > 0:
        return centre, centre
    welch = total**2 / sum(v * v / f for v, f in zip(spread, freedom, strict=True))
    half = float(scipy.stats.t.ppf((1 + confidence) / 2, welch)) * math.sqrt(total)
    return centre - half, centre + half
