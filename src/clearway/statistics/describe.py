"""Describing a sample: centre, spread, intervals, and whether it looks normal; per group and indicator of a table."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import scipy
from scipy import special

from clearway.geometry.shapes import FloatArray
from clearway.indicators import INDICATORS, Kind
from clearway.statistics.columns import GROUP, any_estimate, findings, groups, indicators_in, numbers, reasons, schema
from clearway.statistics.proportions import Interval, checked_probability, success_interval, wilson_interval

RESAMPLES = 2000
"""Bootstrap resamples of a mean."""
FEWEST_RESAMPLED = 8
"""Values below which there is no bootstrap: resamples of so few know too little of the spread, and two values never leave their range."""
_DRAWN_AT_ONCE = 1_000_000
"""Values of resamples that are held at a time."""

_DESCRIPTION = schema(
    robot=str, navigator=str, setup=str, suite=str, batch=str, speed=float, indicator=str, unit=str,
    n=int, missing=int, reasons=str, mean=float, sd=float, t_low=float, t_high=float, boot_low=float, boot_high=float,
    median=float, minimum=float, maximum=float, shapiro_p=float, normal=bool,
    range_low=float, range_high=float, norm_mean=float, norm_low=float, norm_high=float,
)  # fmt: skip

_SUCCESS = schema(
    robot=str, navigator=str, setup=str, suite=str, batch=str, speed=float, n=int, successes=int, unknown=int, SR=float, low=float, high=float,
    wilson_low=float, wilson_high=float, self_successes=int, self_n=int, SR_self=float,
    slack_successes=int, slack_n=int, SR_slack=float, failures=str,
)  # fmt: skip


def mean_interval(
    sample: FloatArray, confidence: float = 0.95, bounds: tuple[float, float] = (-np.inf, np.inf)
) -> Interval | None:
    """Student's t interval of the mean of (n,) values, cut off at the `bounds` of what such a value can be (which takes nothing
    from its confidence: the mean is within); None below two of them."""
    n = len(sample)
    if n < 2:
        return None
    half = float(
        scipy.stats.t.ppf((1 + checked_probability("confidence", confidence)) / 2, n - 1) * scipy.stats.sem(sample)
    )
    mean, (least, most) = float(np.mean(sample)), bounds
    return Interval(mean, max(mean - half, min(least, mean)), min(mean + half, max(most, mean)))


def bootstrap_interval(sample: FloatArray, confidence: float = 0.95, seed: int = 0) -> Interval | None:
    """Bootstrap (BCa) interval of the mean of (n,) values, the same for the same seed; None below `FEWEST_RESAMPLED` of them."""
    checked_probability("confidence", confidence)
    if len(sample) < FEWEST_RESAMPLED:
        return None
    mean = float(np.mean(sample))
    if np.ptp(sample) <= 1e-12 * max(1.0, abs(mean)):
        return Interval(mean, mean, mean)
    means = _resampled_means(sample, np.random.default_rng(seed))
    below = (np.count_nonzero(means < mean) + np.count_nonzero(means <= mean)) / (2 * RESAMPLES)
    off = sample - mean
    skew = (off**3).sum() / (6 * (off**2).sum() ** 1.5)  # the jackknife's acceleration: of a mean it needs no resamples
    bias = special.ndtri(below) + special.ndtri([(1 - confidence) / 2, (1 + confidence) / 2])
    with np.errstate(all="ignore"):
        ends = special.ndtr(special.ndtri(below) + bias / (1 - skew * bias))
    if np.isnan(ends).any():  # all resamples on one side of the mean
        return Interval(mean, np.nan, np.nan)
    low, high = np.quantile(means, ends).tolist()
    return Interval(mean, low, high)


def _resampled_means(sample: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(RESAMPLES,) means of samples drawn with replacement, some at a time: the draws are the same however many."""
    n = len(sample)
    most = max(1, _DRAWN_AT_ONCE // n)
    blocks = [min(most, RESAMPLES - first) for first in range(0, RESAMPLES, most)]
    return np.concatenate([sample[rng.integers(0, n, (block, n))].mean(axis=1) for block in blocks])


@dataclass(frozen=True, slots=True)
class Normality:
    """Shapiro and Wilk's test: `normal` says that it does not reject at 0.05.

    Attributes:
        n: Number of values.
        p: The test's p.
    """

    n: int
    p: float

    @property
    def normal(self) -> bool:
        return self.p > 0.05


def normality(sample: FloatArray) -> Normality | None:
    """Test whether (n,) values may come from a normal distribution; None below three, or if all are the same."""
    if len(sample) < 3 or np.ptp(sample) <= 1e-12 * max(1.0, float(np.abs(sample).max())):
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # scipy warns that p is rough beyond 5000 values
        return Normality(len(sample), float(scipy.stats.shapiro(sample).pvalue))


def describe(
    table: pa.Table, indicators: Sequence[str] | None = None, *, confidence: float = 0.95, seed: int = 0
) -> pa.Table:
    """Every indicator (default: all that the table has) per robot, navigator, set-up, suite, batch and speed.

    A row has the sample's size and what is missing with the reasons, mean, standard deviation, both intervals of the
    mean (the t interval within what the indicator can be), median, range, Shapiro-Wilk, and paper A's normalised mean and t interval: by the range of the indicator over
    all speeds within robot, navigator, set-up, suite and batch (Fig. 6), 0 where that range is nil.
    """
    rows = []
    chosen = [i for i in indicators_in(table, indicators, INDICATORS) if i.kind is not Kind.BOOLEAN]
    data = {i.name: numbers(table, i.name) for i in chosen}
    wide = groups(table, GROUP[:-1])
    for group, members in groups(table, GROUP).items():
        why = reasons(table, members)
        for indicator in chosen:
            everything = data[indicator.name][wide[group[:-1]]]
            everything = everything[~np.isnan(everything)]
            if not len(everything):
                continue  # does not apply to this batch at all (MDO without obstacles)
            low, high = float(everything.min()), float(everything.max())
            sample = data[indicator.name][members]
            sample = sample[~np.isnan(sample)]
            row = dict(zip(GROUP, group, strict=True))
            row |= {"indicator": indicator.name, "unit": indicator.unit, "range_low": low, "range_high": high}
            row |= {"n": len(sample), "missing": len(members) - len(sample)}
            row |= {"reasons": why.get(indicator.name, "")}
            rows.append(row | _summary(sample, low, high, indicator.bounds, confidence, seed))
    return findings(rows, _DESCRIPTION)


def _summary(
    sample: FloatArray, low: float, high: float, bounds: tuple[float, float], confidence: float, seed: int
) -> dict[str, float | bool]:
    if not len(sample):
        return {}
    mean = float(sample.mean())
    row: dict[str, float | bool] = {"mean": mean, "median": float(np.median(sample))}
    row |= {"minimum": float(sample.min()), "maximum": float(sample.max())}

    def normalise(value: float) -> float:
        return (value - low) / (high - low) if high > low else 0.0

    row["norm_mean"] = normalise(mean)
    if len(sample) > 1:
        row["sd"] = float(sample.std(ddof=1))
    if t := mean_interval(sample, confidence, bounds):
        row |= {"t_low": t.low, "t_high": t.high, "norm_low": normalise(t.low), "norm_high": normalise(t.high)}
    if boot := bootstrap_interval(sample, confidence, seed):
        row |= {"boot_low": boot.low, "boot_high": boot.high}
    if found := normality(sample):
        row |= {"shapiro_p": found.p, "normal": found.normal}
    return row


def success_rates(table: pa.Table, by: Sequence[str] = GROUP, *, confidence: float = 0.95) -> pa.Table:
    """SR in per cent (paper A, eq. 5) with the exact and Wilson's interval, by some of `GROUP`.

    `n` counts the trials of which the success is known, `unknown` the others, `self_n` those of which it is known by the
    robot's own estimate (0 where it has none in any of a group's trials), `slack_n` with a slack for what it cannot know; `failures` says how trials failed.
    """
    judged = numbers(table, "success")
    others = {name: numbers(table, c) for name in ("self", "slack") if (c := f"success_{name}") in table.column_names}
    failure = table["failure"].to_pylist()
    trials = table.select([c for c in ("success_self", "source", "duration") if c in table.column_names]).to_pylist()
    rows = []
    for key, members in groups(table, by).items():
        known = judged[members][~np.isnan(judged[members])]
        why: dict[str, int] = {}
        for member in members:
            if failure[member]:
                why[failure[member]] = why.get(failure[member], 0) + 1
        row = dict(zip(by, key, strict=True)) | {"n": len(known), "successes": int(known.sum())}
        row |= {"unknown": len(members) - len(known), "self_n": 0, "slack_n": 0}
        row["failures"] = "; ".join(f"{w} ({c})" for w, c in sorted(why.items(), key=lambda item: (-item[1], item[0])))
        for name, values in others.items():
            told = values[members][~np.isnan(values[members])]
            if name == "self" and not any_estimate(trials[member] for member in members):
                told = told[:0]
            row |= {f"{name}_successes": int(told.sum()), f"{name}_n": len(told)}
            if len(told):
                row[f"SR_{name}"] = 100 * float(told.mean())
        if len(known):
            exact = success_interval(int(known.sum()), len(known), confidence)
            wilson = wilson_interval(int(known.sum()), len(known), confidence)
            row |= {"SR": 100 * exact.estimate, "low": 100 * exact.low, "high": 100 * exact.high}
            row |= {"wilson_low": 100 * wilson.low, "wilson_high": 100 * wilson.high}
        rows.append(row)
    kept = [field for field in _SUCCESS if field.name in by or field.name not in GROUP]
    return findings(rows, pa.schema(kept))
