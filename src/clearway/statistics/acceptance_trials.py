"""The trials that a verdict rests on: in which order they count, which are of a group, which are refused, what is to be said of them."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from typing import Any

import pyarrow as pa

from clearway.errors import ClearwayError, shown, unknown
from clearway.statistics.columns import SYSTEM
from clearway.statistics.criteria import Criteria, groups, in_words, word
from clearway.trials.trial import UNUSABLE, Outcome

Row = dict[str, Any]
NUMBER = "_number"
"""The column that tells which trial of its plan a recorded one is."""
WAITS = "_waits"
"""The column that tells whether a recorded one waits for one before it."""
_DRAWN_FROM = re.compile(r"\bseed-(\d{1,19})\b")
"""In a scenario's name: the seed that it was drawn from."""
OF_A_CONTACT = ("moved_at_contact", "touched", "avoidable")
"""Indicators that only a trial with a contact has."""
_IDENTITY = ("suite", "scenario", "seed", "member")
_SENSES = ("localisation", "tracking")
"""Of the system too; but scenarios may name their own, so that those of another suite or batch may have others."""


def refuse_strange_groups(criteria: Criteria, planned: Sequence[Mapping[str, Any]]) -> None:
    """Nothing, unless a group of the criteria has no trial in a plan; of columns that the plan tells.

    Raises:
        ClearwayError: it has none.
    """
    rows = [dict(p) for p in planned]
    told = {name for p in rows for name in p}
    for number, one in enumerate(criteria.criterion):
        for where, at in ((criteria.where, "where"), *((part, f"criterion.{number}.where") for part in groups(one))):
            refuse_nothing(rows, {name: v for name, v in where.items() if name in told}, at, True)


def in_order(table: pa.Table, number: int = 0) -> list[Row]:
    """The trials of a table in the order in which they count; of each also whether it still waits for one before it.

    Args:
        table: Results.
        number: Which of the results they are.
    """
    rows: list[Row] = [row | {"_table": number, WAITS: False} for row in table.to_pylist()]
    recorded = [r for r in rows if r.get("source") == "recorded"]
    drawn = [r for r in rows if r.get("source") != "recorded"]
    for at, row in enumerate(recorded, 1):
        row[WAITS] = row.get(NUMBER, at) != at

    def lot(row: Row) -> tuple[int, int, str, int]:
        """First what a campaign grows by, so that the trials it had stay ahead."""
        seed = _DRAWN_FROM.search(str(row.get("scenario")))
        name = json.dumps([row.get(c) for c in _IDENTITY])
        drawn = hashlib.sha256(name.encode()).hexdigest()
        return int(seed[1]) if seed else -1, row.get("repetition") or 1, drawn, row["trial"]

    return recorded + sorted(drawn, key=lot)


def fits(row: Mapping[str, Any], where: Mapping[str, Any]) -> bool:
    """Whether a trial is of a group."""
    return all(
        any(_same(row.get(name), v) for v in (value if isinstance(value, tuple) else (value,)))
        for name, value in where.items()
    )


def _same(cell: Any, value: Any) -> bool:
    if isinstance(cell, float) and isinstance(value, float | int):
        return math.isclose(cell, value, rel_tol=1e-9)
    return bool(cell == value)


def refuse_nothing(rows: Sequence[Row], where: Mapping[str, Any], at: str, complete: bool) -> None:
    """Nothing, unless no row fits, or none has one of the values: a group of which a part is misspelt is not the one that is meant."""
    if not complete:
        return
    for name, value in where.items():
        for v in value if isinstance(value, tuple) else (value,):
            if not any(_same(r.get(name), v) for r in rows):
                raise unknown(name, word(v), {word(r.get(name)) for r in rows}, field=f"{at}.{name}")
    if not any(fits(r, where) for r in rows):
        raise ClearwayError(f"no trial is of this group{of_group(where)}" if where else "there is no trial", field=at)


def system_of(rows: Sequence[Row]) -> str:
    """Who was tested, in words.

    Raises:
        ClearwayError: there are several.
    """
    found = list(dict.fromkeys(tuple(r.get(c) for c in SYSTEM) for r in rows))
    if len(found) > 1:
        column = next(c for i, c in enumerate(SYSTEM) if len({f[i] for f in found}) > 1)
        names = ", ".join(dict.fromkeys(word(f[SYSTEM.index(column)]) for f in found))
        raise ClearwayError(f"a verdict is on one, and there are several: {names}; say which", field=f"where.{column}")
    senses: dict[Any, Any] = {}
    for r, column in product(rows, _SENSES):
        other, own = senses.setdefault((r.get("suite"), r.get("batch"), column), r.get(column)), r.get(column)
        if own != other:
            raise ClearwayError(
                f"a verdict is on one, and there are several: {word(other) or 'none'}, {word(own) or 'none'}; say which",
                field=f"where.{column}",
            )
    return ", ".join(str(part) for part in found[0] if part) if found else ""


def refuse_dependent(rows: Sequence[Row]) -> None:
    """Nothing, unless two trials tell less than two.

    Raises:
        ClearwayError: they share a simulation, or are the same test.
    """
    runs: dict[Any, int] = {}
    tests: dict[Any, int] = {}
    for r in rows:
        if (run := r.get("run")) and (other := runs.setdefault((r["_table"], run), r["trial"])) != r["trial"]:
            raise ClearwayError(
                f"trials {other} and {r['trial']} are two robots of one simulation, and tell less than two; choose one with member",
                field="where.member",
            )
        if r.get("source") == "simulated":
            test = tuple(r.get(c) for c in _IDENTITY)
            if test in tests:
                raise ClearwayError(
                    f"trial {r['trial']} is the same test as trial {tests[test]}: {shown(r.get('scenario'))} with seed {r.get('seed')}; "
                    "another seed of the campaign makes others"
                )
            tests[test] = r["trial"]


def gaps(rows: Sequence[Row], tables: int) -> list[str]:
    """Of which recorded trials others wait."""
    found = []
    for number in range(tables):
        waits = Counter(r[WAITS] for r in rows if r["_table"] == number and r.get("source") == "recorded")
        if waits[True]:
            of = f" of results {number + 1}" if tables > 1 else ""
            found.append(
                f"trial {waits[False] + 1} of the test plan{of} is not there yet, and the {waits[True]} that came in of those behind it "
                "wait; drive it, or leave out `attempted = false`, and it counts as not recorded"
            )
    return found


def notes(rows: Sequence[Row], tables: Sequence[pa.Table], criteria: Criteria) -> list[str]:
    """What whoever relies on the verdict is to know of the trials."""
    found = []
    for number, _ in enumerate(tables):
        recorded = [r for r in rows if r["_table"] == number and r.get("source") == "recorded"]
        tests = [tuple(r.get(c) for c in ("batch", "configuration", "speed", "size", "gap")) for r in recorded]
        count = Counter(tests)
        alike = sum(a == b for a, b in pairwise(tests))
        n = len(tests)
        by_chance = sum(c * (c - 1) for c in count.values()) / n if n else 0.0
        if len(count) > 1 and alike > by_chance + 3 * math.sqrt(by_chance + 1):
            found.append(
                "the recorded trials were not driven in a drawn order but test by test: a verdict before the last of them leans on the "
                "tests that came first"
            )
    if confirm := [r for r in rows if r.get("to_confirm")]:
        found.append(f"to be confirmed by a person: {_named(confirm)}")
    asked = any(one.indicator in OF_A_CONTACT for one in criteria.criterion)
    of_lab = [r for r in rows if asked and r.get("source") == "recorded" and not useless(r)]
    if untold := [r for r in of_lab if r.get("contacts") is None]:
        found.append(
            f"nobody knows whether it touched something: {_named(untold)}; `contact = true` or `false` in the test plan tells"
        )
    if unusable := [r for r in rows if useless(r)]:
        found.append(f"to be recorded again: {_named(unusable)}")
    if broken := [r for r in rows if r.get("outcome") == Outcome.SCENARIO_FAILED]:
        found.append(f"to be run again, as their scenario failed: {_named(broken)}")
    return found


def useless(row: Mapping[str, Any]) -> bool:
    """Whether its recording can't be used."""
    return UNUSABLE in str(row.get("reason") or "")


def _named(rows: Sequence[Row]) -> str:
    """Trials by their numbers in the results, and by those in the test plan, where a person looks them up; from 0 and from 1."""
    said = f"trial{'s' if len(rows) > 1 else ''} {_listed([r['trial'] for r in rows])}"
    planned = [r[NUMBER] for r in rows if NUMBER in r]
    return f"{said} (no. {_listed(planned)} of the test plan)" if planned else said


def _listed(numbers: Sequence[int], most: int = 12) -> str:
    return ", ".join(map(str, numbers[:most])) + (f" and {len(numbers) - most} more" if len(numbers) > most else "")


def of_group(where: Mapping[str, Any]) -> str:
    return f" of {in_words(where)}" if where else ""
