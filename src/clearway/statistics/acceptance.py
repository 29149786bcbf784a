"""Is a robot accepted? Criteria held against tables of trials, after each trial anew.

Nothing here may be turned against whoever relies on it: a trial that nobody can judge yet counts as failed towards an acceptance
and as conforming towards a rejection; trials that share a simulation, or that stand twice in the tables, are refused; what is
decided stays decided, whatever later trials say and whatever a person confirms.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import pyarrow as pa

from clearway.errors import ClearwayError
from clearway.statistics.acceptance_trials import (
    OF_A_CONTACT,
    WAITS,
    Row,
    fits,
    gaps,
    in_order,
    notes,
    of_group,
    refuse_dependent,
    refuse_nothing,
    system_of,
    useless,
)  # fmt: skip
from clearway.statistics.betting import first_shown, rule, shown_shares
from clearway.statistics.criteria import Criteria, Criterion, asks, demand, errors_of, groups, in_words
from clearway.statistics.proportions import Interval
from clearway.trials.trial import Outcome


class Decision(StrEnum):
    """A verdict."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"
    GO_ON = "go on"


@dataclass(frozen=True, slots=True)
class Judged:
    """What became of one criterion.

    Attributes:
        name: Its name, or what it asks.
        demand: What it asks and how often, in words.
        group: Of which trials, in words; empty: all.
        decision: Accepted, rejected or go on.
        why: The reason, a sentence.
        trials: How many trials count for it.
        conforming: How many of them conform.
        failing: How many do not.
        missing: How many of these because they have no value.
        unknown: How many nobody can judge yet.
        decided: After how many of them the decision fell; None: not yet.
        shares: The shares that are not ruled out, each end at the criterion's confidence at all times; None where none is asked.
        more: About how many trials more decide, if they go on as so far; None: decided, or too many to tell. 0: those decide that nobody can
            judge yet.
        least: How many more accept if none of them fails; None: decided.
        failed: The trials that do not conform, by table and number.
        unjudged: Those that nobody can judge yet, likewise.
    """

    name: str
    demand: str
    group: str
    decision: Decision
    why: str
    trials: int
    conforming: int
    failing: int
    missing: int
    unknown: int
    decided: int | None
    shares: Interval | None
    more: int | None
    least: int | None
    failed: tuple[tuple[int, int], ...]
    unjudged: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a robot is accepted.

    Attributes:
        title: What was to be accepted.
        system: Who was tested, in words.
        decision: Accepted if every criterion is, rejected if one is, else go on.
        criteria: What became of each.
        more: About how many trials more decide, of the kinds that were run so far; None: decided, or too many to tell.
        notes: What has to be known beside it.
        tables: How many results it is on.
    """

    title: str
    system: str
    decision: Decision
    criteria: tuple[Judged, ...]
    more: int | None
    notes: tuple[str, ...]
    tables: int

    def __str__(self) -> str:
        return str(self.decision) if not self.more else f"{self.decision}, about {more_trials(self.more)}"


def more_trials(n: int) -> str:
    """`n` more trials, in words."""
    return f"{n:,} more trial{'' if n == 1 else 's'}"


def judge(tables: Sequence[pa.Table], criteria: Criteria, *, complete: bool = True) -> Verdict:
    """Hold trials against criteria, trial by trial.

    Whatever comes in later counts later, so that a look sees what the one before it saw, and then more. Recorded trials count in
    the order of their plan, up to the first that is not there yet: those behind it wait. Simulated ones count seed by seed and
    repetition by repetition, within each in an order that is drawn by their names, the same for every robot and navigator.

    Args:
        tables: Results, as in `trials.parquet`, one after the other; none: nothing was run yet. Of recorded ones a column `NUMBER`
            may tell which of the plan's trials they are, from 1; else none is missing.
        criteria: What is asked.
        complete: Whether a group without trials is an error; else its trials may still come.

    Raises:
        ClearwayError: a group that does not exist, several systems, trials that are not independent, or an indicator that none of
            them can have.
    """
    rows = [row for number, table in enumerate(tables) for row in in_order(table, number)]
    chosen = [r for r in rows if fits(r, criteria.where)]
    refuse_nothing(rows, criteria.where, "where", complete)
    system = system_of(chosen)
    refuse_dependent(chosen)
    counted = [r for r in chosen if not r[WAITS]]
    judged = []
    for number, one in enumerate(criteria.criterion):
        at = f"criterion.{number}"
        for where in groups(one):
            refuse_nothing(chosen, where, f"{at}.where", complete)
            part = [r for r in counted if fits(r, where)]
            judged.append(_judged(one, criteria, part, where, at, complete))
    decisions = {j.decision for j in judged}
    decision = (
        Decision.REJECTED
        if Decision.REJECTED in decisions
        else Decision.ACCEPTED
        if decisions == {Decision.ACCEPTED}
        else Decision.GO_ON
    )
    open_ones = [j for j in judged if j.decision is Decision.GO_ON]
    more = None
    if decision is Decision.GO_ON and all(j.more is not None for j in open_ones):
        more = max(math.ceil((j.more or 0) * (len(counted) / j.trials if j.trials else 1)) for j in open_ones)
    return Verdict(
        criteria.title,
        system,
        decision,
        tuple(judged),
        more,
        (*gaps(rows, len(tables)), *notes(chosen, tables, criteria)),
        len(tables),
    )


def _judged(
    one: Criterion, criteria: Criteria, rows: Sequence[Row], where: Mapping[str, Any], at: str, complete: bool
) -> Judged:
    said = [conforms(one, r) for r in rows]
    if rows and complete and all(r.get(one.indicator) is None for r in rows) and not (one.one_of or one.none_of):
        reason = Counter(_why(r, one.indicator) for r in rows).most_common(1)[0][0]
        raise ClearwayError(
            f"{one.indicator} is not computable in any of the {len(rows)} trials{of_group(where)} ({reason}); "
            "no number of such trials can meet the criterion",
            field=f"{at}.indicator",
        )
    sure = np.array([s is True for s in said], dtype=np.bool_)
    possible = np.array([s is not False for s in said], dtype=np.bool_)
    found = _by_share if one.share is not None else _by_count
    decision, decided, why, shares, more, least = found(one, criteria, sure, possible)
    return Judged(
        name=one.name or asks(one),
        demand=f"{asks(one)} {demand(one, criteria)}",
        group=in_words(where),
        decision=decision,
        why=why,
        trials=len(rows),
        conforming=int(sure.sum()),
        failing=int((~possible).sum()),
        missing=sum(
            s is False and r.get(one.indicator) in (None, "") and _between(one.indicator, r) is None
            for r, s in zip(rows, said, strict=True)
        ),
        unknown=int((possible & ~sure).sum()),
        decided=decided,
        shares=shares,
        more=more,
        least=least,
        failed=_which(rows, said, False),
        unjudged=_which(rows, said, None),
    )


def _which(rows: Sequence[Row], said: Sequence[bool | None], what: bool | None) -> tuple[tuple[int, int], ...]:
    return tuple(sorted((r["_table"], r["trial"]) for r, s in zip(rows, said, strict=True) if s is what))


_Found = tuple[Decision, int | None, str, Interval | None, int | None, int | None]


def _by_share(one: Criterion, criteria: Criteria, sure: np.ndarray, possible: np.ndarray) -> _Found:
    assert one.share is not None
    accept, reject = errors_of(one, criteria)
    n, most = len(sure), criteria.most
    within = slice(None, most)
    yes = first_shown(sure[within], one.share, accept, above=True)
    no = first_shown(possible[within], one.share, reject, above=False)
    # what nobody can judge yet might have decided the other way before that: then it has to be judged first
    no_before = yes and first_shown(sure[:yes], one.share, reject, above=False)
    yes_before = no and first_shown(possible[:no], one.share, accept, above=True)
    k, f = int(sure.sum()), int((~possible).sum())
    worst, best = shown_shares(k, n - k, accept), shown_shares(n - f, f, reject)
    shares = Interval(k / n if n else math.nan, worst.low, best.high)
    if yes is not None and no_before is None:
        why = f"{int(sure[:yes].sum())} of the first {yes} trials conform: a share below {one.share:g} is ruled out"
        return Decision.ACCEPTED, yes, why, shares, None, None
    if no is not None and yes_before is None:
        why = f"{int((~possible[:no]).sum())} of the first {no} trials fail: a share of {one.share:g} is ruled out"
        return Decision.REJECTED, no, why, shares, None, None
    if before := no_before or yes_before:
        why = f"what nobody can judge yet may decide it at trial {before}, and has to be judged first"
        return Decision.GO_ON, None, why, shares, 0, None
    if most is not None and n >= most:
        if (possible & ~sure)[within].any():
            why = f"{most} trials are the most that count, and some of them nobody can judge yet"
            return Decision.GO_ON, None, why, shares, 0, None
        why = f"a share of {one.share:g} was not shown within {most} trials, the most that count"
        return Decision.REJECTED, most, why, shares, None, None
    bounds = rule(one.share, accept, reject, failures=n - k + 4000, first=n - k)
    more = bounds.more(k, n - k, k / n if n else 1.0)
    least = max(bounds.least, n + 1) - n
    if most is not None:
        more = most - n if more is None else min(more, most - n)
    why = (
        f"shares from {shares.low:.3g} to {shares.high:.3g} are possible, {one.share:g} among them"
        if n
        else "no trial yet"
    )
    return Decision.GO_ON, None, why, shares, more, least


def _by_count(one: Criterion, criteria: Criteria, sure: np.ndarray, possible: np.ndarray) -> _Found:
    assert one.trials is not None
    n = min(len(sure), one.trials)
    failed = np.cumsum(~possible[:n])
    if n and failed[-1] > one.failures:
        at = int(np.flatnonzero(failed > one.failures)[0]) + 1
        why = f"{one.failures + 1} of the first {at} trials fail; {one.failures or 'none'} may"
        return Decision.REJECTED, at, why, None, None, None
    if n == one.trials and int((~sure[:n]).sum()) <= one.failures:
        why = f"{int(sure[:n].sum())} of the first {n} trials conform"
        return Decision.ACCEPTED, n, why, None, None, None
    if n == one.trials:
        return Decision.GO_ON, None, f"of the first {n} trials some nobody can judge yet", None, 0, None
    return Decision.GO_ON, None, f"{n} of {one.trials} trials are there", None, one.trials - n, one.trials - n


def conforms(one: Criterion, row: Mapping[str, Any]) -> bool | None:
    """Whether a trial conforms; None: nobody can judge it yet."""
    value = row.get(one.indicator)
    if useless(row) or row.get("outcome") == Outcome.SCENARIO_FAILED:
        return None
    if one.indicator in OF_A_CONTACT and not value and row.get("contacts") != 0:
        if row.get("contacts") is None:
            return None
        value = None  # there was a contact
    elif one.one_of or one.none_of:
        value = value or ""
    low = -math.inf if one.at_least is None else one.at_least
    high = math.inf if one.at_most is None else one.at_most
    if value is None and (between := _between(one.indicator, row)) is not None:
        least, most = between
        yes = low <= least and most <= high
        return None if row.get("to_confirm") or not (yes or most < low or least > high) else yes
    if value is None:
        return None if one.missing == "unknown" or row.get("to_confirm") else False
    if isinstance(value, str):
        yes = value in one.one_of if one.one_of else value not in one.none_of
    elif isinstance(value, bool):
        yes = value is (True if one.value is None else one.value)
    else:
        yes = low <= value <= high
    return None if yes and row.get("to_confirm") else yes


def _between(indicator: str, row: Mapping[str, Any]) -> tuple[float, float] | None:
    """What an indicator without a value is at least and at most, where the recording tells so much."""
    least, most = row.get(f"{indicator}_at_least"), row.get(f"{indicator}_at_most")
    if least is None and most is None:
        return None
    return -math.inf if least is None else least, math.inf if most is None else most


def _why(row: Row, name: str) -> str:
    return str(json.loads(row.get("not_computable") or "{}").get(name) or "it does not apply")
