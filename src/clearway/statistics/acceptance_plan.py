"""Before the first trial: how many trials each criterion will take, and how probably it is accepted; exact, not simulated."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import special

from clearway.errors import ClearwayError
from clearway.statistics.acceptance_trials import fits, refuse_strange_groups
from clearway.statistics.betting import Prospect, failures_within, prospect, rule
from clearway.statistics.criteria import Criteria, Criterion, asks, demand, errors_of, groups, in_words

AHEAD = 20
"""Times the least number of trials: so far is looked ahead where the criteria name no most."""
LONGEST = 100_000
"""Trials; nor farther."""


@dataclass(frozen=True, slots=True)
class Outlook:
    """What a criterion will take.

    Attributes:
        name: Its name, or what it asks.
        demand: What it asks and how often, in words.
        group: Of which trials, in words; empty: all.
        least: How many trials accept if none of them fails.
        most: So many trials are looked ahead to: what the criteria allow at most, or far enough to tell.
        planned: How many trials decide with 90 % probability at the share that is expected; None: more than `most`.
        prospects: What becomes of it at several true shares, the expected one first.
    """

    name: str
    demand: str
    group: str
    least: int
    most: int
    planned: int | None
    prospects: tuple[Prospect, ...]


def outlooks(criteria: Criteria, rates: tuple[float, ...] = ()) -> list[Outlook]:
    """What each criterion will take.

    Args:
        criteria: What is asked.
        rates: True shares to look at, beside the expected one; empty: a robot that never fails, the limit, and one that fails
            twice as often as it may.

    Raises:
        ClearwayError: a rate that is none.
    """
    for rate in rates:
        if not 0 <= rate <= 1:
            hint = f" (did you mean {rate / 100:g}?)" if 1 < rate <= 100 else ""
            raise ClearwayError(f"{rate:g} is no share of trials; 0 to 1 is{hint}", field="--rate")
    return [_outlook(one, criteria, rates) for one in criteria.criterion]


def repetitions(criteria: Criteria, tests: Sequence[Mapping[str, Any]]) -> int:
    """How often each test has to be driven so that every criterion has the trials that are planned for it.

    Args:
        criteria: What is asked.
        tests: The labels of each test, once.

    Raises:
        ClearwayError: a criterion is about none of the tests, or no number of trials is planned for it.
    """
    refuse_strange_groups(criteria, tests)
    told = {name for test in tests for name in test}
    most = 1
    for one, outlook in zip(criteria.criterion, outlooks(criteria), strict=True):
        for where in groups(one):
            asked = {name: v for name, v in (criteria.where | where).items() if name in told}
            if outlook.planned is None:
                raise ClearwayError(
                    f"{outlook.most:,} trials don't decide it in nine of ten cases, if the true share is {outlook.prospects[0].rate:g}: set "
                    "`most`, expect more, or ask for less",
                    field=outlook.name,
                )
            most = max(most, math.ceil(outlook.planned / sum(fits(test, asked) for test in tests)))
    return most


def _outlook(one: Criterion, criteria: Criteria, rates: tuple[float, ...]) -> Outlook:
    group = in_words(criteria.where | one.where)
    group = f"each {one.each} of {group}" if one.each else group
    about = {"name": one.name or asks(one), "demand": f"{asks(one)} {demand(one, criteria)}", "group": group}
    if one.share is None:
        assert one.trials is not None
        share = 1 - (one.failures + 0.5) / one.trials
        looked = rates or tuple(dict.fromkeys((one.expected or 1 - (1 - share) / 5, 1.0, share, 1 - 2 * (1 - share))))
        counted = tuple(_counted(one.trials, one.failures, max(rate, 0.0)) for rate in looked)
        return Outlook(**about, least=one.trials, most=one.trials, planned=one.trials, prospects=counted)
    accept, reject = errors_of(one, criteria)
    most = criteria.most or min(AHEAD * rule(one.share, accept, reject, failures=0).least, LONGEST)
    bounds = rule(one.share, accept, reject, failures=failures_within(one.share, reject, most))
    expected = one.expected or (1 + one.share) / 2
    limits = (1.0, one.share, max(0.0, 1 - 2 * (1 - one.share)))
    looked = tuple(dict.fromkeys((expected, *(rates or limits))))
    found = tuple(prospect(bounds, rate, most) for rate in looked)
    if criteria.most is not None:  # what is undecided then is rejected
        found = tuple(_ended(one, most) for one in found)
    return Outlook(**about, least=bounds.least, most=most, planned=found[0].ninth, prospects=found)


def _ended(found: Prospect, most: int) -> Prospect:
    """What becomes of it where `most` trials are the most that count."""
    median, ninth = (most if n is None else n for n in (found.median, found.ninth))
    return replace(found, rejected=1.0 - found.accepted, median=median, ninth=ninth)


def _counted(trials: int, failures: int, rate: float) -> Prospect:
    """Of so many trials of which so many may fail: it ends at the first failure too many."""
    n = np.arange(trials)
    allowed = np.where(
        n <= failures, 1.0, special.bdtr(failures, np.maximum(n, failures), 1 - rate)
    )  # it still goes on
    accepted = float(special.bdtr(failures, trials, 1 - rate))
    going = np.append(allowed, 0.0)  # after all of them it does not

    def within(part: float) -> int:
        return int(np.argmax(going <= 1 - part))

    return Prospect(rate, accepted, 1 - accepted, float(allowed.sum()), within(0.5), within(0.9))
