"""Does `clearway accept` keep its errors? Robots at the limit, looked at after every trial, and how many trials others take.

Printed: how often a robot whose true share lies on the limit (the worst case of either error) is accepted, and rejected, within
so many trials; for trials of one test, for those of unlike tests in a drawn order, for several criteria at once; for campaigns that grow by
repetitions or seeds and for recordings that come in in another order than their plan's, judged anew at ten looks; beside it the same
by Clopper and Pearson's interval looked at after every trial, and the exact probabilities where there are such. Then how many
trials better and worse robots take, beside a plan of fixed length. It fails if an error exceeds its probability beyond chance.

    python benchmarks/accept_errors.py [--robots N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
from scipy import special

from clearway.statistics import samples_needed
from clearway.statistics.acceptance_trials import NUMBER, in_order
from clearway.statistics.betting import Rule, prospect, rule

Bools = npt.NDArray[np.bool_]
ERROR = 0.05
LIMITS = (0.8, 0.9, 0.95, 0.99)
BLOCK = 250
"""Robots at once."""
LOOKS = 10


def first(bounds: Rule, conforms: Bools) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """By robot after how many of its trials (robots, trials) it is accepted, and rejected; beyond them: never."""
    n = np.arange(1, conforms.shape[1] + 1)
    f = np.cumsum(~conforms, axis=1)
    f = np.minimum(f, len(bounds.accepts) - 1)
    return _first(n >= bounds.accepts[f]), _first(n <= bounds.rejects[f])


def _first(found: Bools) -> npt.NDArray[np.int64]:
    return np.where(found.any(axis=1), found.argmax(axis=1), found.shape[1])


def clopper_pearson(limit: float, conforms: Bools) -> tuple[float, float]:
    """Shares of robots that the interval for a fixed number of trials accepts and rejects when looked at after every one."""
    n = np.arange(1, conforms.shape[1] + 1)
    k = np.cumsum(conforms, axis=1)
    low = special.betaincinv(np.maximum(k, 1), n - k + 1, ERROR)
    high = special.betaincinv(k + 1, np.maximum(n - k, 1), 1 - ERROR)
    yes, no = _first((k > 0) & (low >= limit)), _first((k < n) & (high < limit))
    end = conforms.shape[1]
    return float(((yes <= no) & (yes < end)).mean()), float(((no < yes) & (no < end)).mean())


def one_test(limit: float) -> Callable[[np.random.Generator, int, int], Bools]:
    """Trials of one test."""
    return lambda rng, robots, n: rng.random((robots, n)) < limit


def unlike(limit: float) -> Callable[[np.random.Generator, int, int], Bools]:
    """Trials of unlike tests, as many of each, in a drawn order: half of them never fail, the others twice as often as they may."""

    def draw(rng: np.random.Generator, robots: int, n: int) -> Bools:
        rates = np.where(np.arange(n) % 2 == 0, 1.0, max(0.0, 1 - 2 * (1 - limit)))
        order = rng.permuted(np.broadcast_to(rates, (robots, n)), axis=1)
        return rng.random((robots, n)) < order

    return draw


def easy_first(limit: float) -> Callable[[np.random.Generator, int, int], Bools]:
    """The same tests, those first that never fail: what must not be done."""

    def draw(rng: np.random.Generator, robots: int, n: int) -> Bools:
        rates = np.where(np.arange(n) < n // 2, 1.0, max(0.0, 1 - 2 * (1 - limit)))
        return rng.random((robots, n)) < rates

    return draw


def errors(limit: float, robots: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """How often robots at the limit are accepted and rejected."""
    bounds = rule(limit, ERROR, ERROR)
    n = 12 * bounds.least
    rows = []
    cases = {
        "one test": one_test(limit),
        "unlike tests, drawn order": unlike(limit),
        "easy tests first": easy_first(limit),
    }
    for name, draw in cases.items():
        accepted = rejected = 0
        for _ in range(robots // BLOCK):
            yes, no = first(bounds, draw(rng, BLOCK, n))
            accepted += int(((yes <= no) & (yes < n)).sum())
            rejected += int(((no < yes) & (no < n)).sum())
        total = robots // BLOCK * BLOCK
        rows.append(
            {"limit": limit, "case": name, "trials": n, "accepted": accepted / total, "rejected": rejected / total}
        )
    exact = prospect(bounds, limit, n)
    rows.append(
        {"limit": limit, "case": "one test, exact", "trials": n, "accepted": exact.accepted, "rejected": exact.rejected}
    )
    naive = [clopper_pearson(limit, one_test(limit)(rng, BLOCK, n)) for _ in range(max(1, robots // BLOCK // 4))]
    yes_too, no_too = np.mean(naive, axis=0)
    rows.append(
        {
            "limit": limit,
            "case": "Clopper-Pearson, watched",
            "trials": n,
            "accepted": float(yes_too),
            "rejected": float(no_too),
        }
    )
    return rows


def grows(limit: float, way: str, robots: int, rng: np.random.Generator) -> dict[str, Any]:
    """How often robots at the limit are accepted and rejected at any of several looks at results that grow: half of a round of tests never
    fail, the others twice as often as they may.

    Args:
        limit: Their true share.
        way: By what the results grow: `repetitions`, `seeds`, or `another order` than the plan's in which recordings come in.
        robots: How many.
        rng: Where chance comes from.
    """
    bounds = rule(limit, ERROR, ERROR)
    tests = max(2, bounds.least // 10 * 2)
    n = -(-12 * bounds.least // tests // LOOKS) * LOOKS * tests
    accepted = rejected = 0
    for block in range(robots // BLOCK):
        rounds, test = np.arange(n) // tests, np.arange(n) % tests
        if way == "another order":  # of the plan, which is drawn round by round
            test = rng.permuted(test.reshape(-1, tests), axis=1).ravel()
        rates = np.where(test % 2 == 0, 1.0, max(0.0, 1 - 2 * (1 - limit)))
        conforms = rng.random((BLOCK, n)) < rates
        part, repetition = ("seed-{}-r1", np.ones(n, int)) if way == "seeds" else ("r{}", rounds + 1)
        names = [f"{block}-t{t}-{part.format(r)}" for t, r in zip(test, rounds, strict=True)]
        source = "recorded" if way == "another order" else "simulated"
        table = pa.table(
            {
                "trial": np.arange(n),
                "scenario": names,
                "repetition": repetition,
                "source": [source] * n,
                NUMBER: np.arange(n) + 1,
            }
        )
        came = rng.permutation(n) if way == "another order" else np.arange(n)
        yes_ever, no_ever = np.zeros(BLOCK, np.bool_), np.zeros(BLOCK, np.bool_)
        for look in range(1, LOOKS + 1):
            there = np.sort(came[: n * look // LOOKS])
            counted = [r["trial"] for r in in_order(table.take(there)) if not r["_waits"]]
            if not counted:
                continue
            yes, no = first(bounds, conforms[:, counted])
            yes_ever |= (yes <= no) & (yes < len(counted))
            no_ever |= (no < yes) & (no < len(counted))
        accepted += int(yes_ever.sum())
        rejected += int(no_ever.sum())
    total = robots // BLOCK * BLOCK
    case = {"repetitions": "grown by repetitions", "seeds": "grown by seeds"}.get(way, "not in the plan's order")
    return {"limit": limit, "case": case, "trials": n, "accepted": accepted / total, "rejected": rejected / total}


def together(limit: float, criteria: int, robots: int, rng: np.random.Generator) -> dict[str, Any]:
    """How often a robot is rejected that keeps all of several criteria by a hair, each judged on its own trials."""
    bounds = rule(limit, ERROR, ERROR / criteria)
    n = 6 * bounds.least
    rejected = 0
    for _ in range(robots // BLOCK):
        wrong = np.zeros(BLOCK, dtype=np.bool_)
        for _ in range(criteria):
            yes, no = first(bounds, one_test(limit)(rng, BLOCK, n))
            wrong |= (no < yes) & (no < n)
        rejected += int(wrong.sum())
    total = robots // BLOCK * BLOCK
    return {
        "limit": limit,
        "case": f"{criteria} criteria at once",
        "trials": n,
        "accepted": None,
        "rejected": rejected / total,
    }


def lengths(limit: float) -> list[dict[str, Any]]:
    """How many trials robots take that are better and worse than the limit."""
    bounds, rows = rule(limit, ERROR, ERROR), []
    for failing in (0.0, 0.25, 0.5, 2.0, 4.0):
        rate = 1 - failing * (1 - limit)
        at = prospect(bounds, rate, 40 * bounds.least)
        rows.append(
            {"limit": limit, "rate": rate, "accepted": at.accepted, "rejected": at.rejected, "mean": at.expected, "median": at.median,
             "nine of ten": at.ninth, "fixed, no failure": samples_needed(limit, 1 - ERROR)}
        )  # fmt: skip
    return rows


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=20_000)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true")
    given = parser.parse_args()
    robots = 500 if given.smoke else max(BLOCK, given.robots)
    rng = np.random.default_rng(17)
    limits = LIMITS[:2] if given.smoke else LIMITS
    found = [row for limit in limits for row in errors(limit, robots, rng)]
    found += [
        grows(limit, way, robots, rng) for limit in limits[:3] for way in ("repetitions", "seeds", "another order")
    ]
    found.append(together(0.9, 5, robots, rng))
    took = [row for limit in limits for row in lengths(limit)]
    if given.json:
        print(json.dumps({"errors": found, "lengths": took}, indent=2))
    else:
        print(f"{robots} robots whose true share lies on the limit; either error may be {ERROR:g}\n")
        print(f"{'limit':>6}  {'case':<26}  {'trials':>7}  {'accepted':>8}  {'rejected':>8}")
        for r in found:
            yes = "-" if r["accepted"] is None else f"{r['accepted']:.4f}"
            print(f"{r['limit']:>6}  {r['case']:<26}  {r['trials']:>7}  {yes:>8}  {r['rejected']:>8.4f}")
        print(
            f"\n{'limit':>6}  {'true':>7}  {'accepted':>8}  {'rejected':>8}  {'mean':>8}  {'half':>7}  {'nine of ten':>11}  {'fixed':>6}"
        )
        for r in took:
            half, ninth = (f"{v}" if v is not None else "-" for v in (r["median"], r["nine of ten"]))
            print(
                f"{r['limit']:>6}  {r['rate']:>7.4g}  {r['accepted']:>8.4f}  {r['rejected']:>8.4f}  {r['mean']:>8.0f}  {half:>7}  {ninth:>11}"
                f"  {r['fixed, no failure']:>6}"
            )
    chance = 4 * math.sqrt(ERROR * (1 - ERROR) / robots)
    kept = [r for r in found if r["case"] not in ("easy tests first", "Clopper-Pearson, watched")]
    if any((r["accepted"] or 0) > ERROR + chance or r["rejected"] > ERROR + chance for r in kept):
        sys.exit("an error exceeds its probability")


if __name__ == "__main__":
    main()
