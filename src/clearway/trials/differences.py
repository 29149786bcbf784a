"""Where two trials first differ, to the last bit: what shows that one was run again as it was, or when it went another way."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import numpy as np
import pyarrow as pa

from clearway.trials.store_results import Results
from clearway.trials.store_tables import FILES, Tables
from clearway.trials.trial import Event, Trial
from clearway.trials.trial_tables import to_tables

_KEYS = ("trial", "obstacle", "snapshot")
"""Columns that only count the rows."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Where two trials differ first.

    Attributes:
        t: When, s since the trial began; None for what has no instant.
        what: The column of the results' files that differs, or another part of a trial, for people.
        unit: Unit of the two values, empty without one.
        first: What the first trial has there; None: nothing.
        second: What the second trial has there; None: nothing.
    """

    t: float | None
    what: str
    unit: str
    first: Any
    second: Any

    def __str__(self) -> str:
        when = "" if self.t is None else f" at {self.t:.6g} s"
        return f"{self.what}{when}: {self._text(self.first)} before, {self._text(self.second)} now"

    def _text(self, value: Any) -> str:
        if value is None:
            return "nothing"
        text = " ".join(str(value).split())
        return f"{text if len(text) <= 120 else text[:119] + '…'}{' ' + self.unit if self.unit else ''}"


def first_difference(first: Trial, second: Trial) -> Difference | None:
    """The first difference of two trials in time; None if all of them is the same, apart from wall-clock figures, versions, and
    what a navigator declares of its tuning.

    What was attempted comes before everything else. At one instant it is what comes first in a control period: the
    obstacles, then the robot's state, its estimate and its command.
    """
    a, b = to_tables(0, first), to_tables(0, second)
    if (attempted := _attempted(a, b)) is not None:
        return attempted
    timed = [
        _sampled(a, b, "obstacles"),
        _sampled(a, b, "robot"),
        _happened(first.events, second.events),
        _sampled(a, b, "snapshots"),
        _sampled(a, b, "drawings"),
    ]
    found = [difference for difference in timed if difference is not None]
    if found:
        return min(found, key=lambda difference: difference.t or 0.0)  # of equal ones the first
    ends = (("outcome", first.outcome.value, second.outcome.value), ("reason", first.reason, second.reason))
    spans = [json.loads(t["attempts"]["spans"][0].as_py()) for t in (a, b)]
    errands = [json.loads(t["attempts"]["attempt"][0].as_py()).get("errands") for t in (a, b)]
    for what, x, y in (*ends, ("spans", *spans), ("errands", *errands)):
        if (at := first_in_json(what, x, y)) is not None:
            return Difference(None, at[0], "", at[1], at[2])
    return None


def first_in_json(name: str, first: Any, second: Any) -> tuple[str, Any, Any] | None:
    """The first difference of two JSON values.

    Args:
        name: What the values are called.
        first: One value.
        second: The other one.

    Returns:
        The dotted path to it, which begins with the name, and the values there; None if there is no difference.
    """
    if first == second:
        return None
    inside: Iterator[tuple[Any, Any, Any]] = iter(())
    if isinstance(first, dict) and isinstance(second, dict):
        inside = ((key, first.get(key), second.get(key)) for key in [*second, *first])
    elif isinstance(first, list) and isinstance(second, list) and len(first) == len(second):
        inside = ((i, x, y) for i, (x, y) in enumerate(zip(first, second, strict=True)))
    for key, x, y in inside:
        if (found := first_in_json(f"{name}.{key}", x, y)) is not None:
            return found
    return name, first, second


def other_robots(a: Results, b: Results) -> list[str]:
    """A sentence for each robot that bears the same name in both results and is not the same."""
    mine, theirs = a.campaign.get("robots", {}), b.campaign.get("robots", {})
    found = (first_in_json(name, mine[name], theirs[name]) for name in mine if name in theirs)
    return [f"Not the same robot in both: {at} is {x!r} and {y!r}." for at, x, y in filter(None, found)]


def _attempted(a: Tables, b: Tables) -> Difference | None:
    """What was attempted, and in which columns something is known."""
    rows = [t["attempts"].to_pylist()[0] for t in (a, b)]
    fixtures = [json.loads(t["fixtures"]["bodies"][0].as_py()) for t in (a, b)]
    whole = [
        {**json.loads(row["attempt"]), "reason": "", "tuned": "", "errands": [], "fixtures": walls}
        for row, walls in zip(rows, fixtures, strict=True)
    ]
    at = first_in_json("attempt", *whole)
    return None if at is None else Difference(None, at[0], "", at[1], at[2])


def _happened(first: Sequence[Event], second: Sequence[Event]) -> Difference | None:
    for x, y in zip_longest(first, second):
        if x != y:
            t = min(event.t for event in (x, y) if event is not None)
            return Difference(t, "event", "", *(e and f"{e.kind.value} at {e.t:.6g} s, {e.detail!r}" for e in (x, y)))
    return None


def _sampled(a: Tables, b: Tables, name: str) -> Difference | None:
    """The first difference of a table whose rows are in the order of time."""
    rows = min(a[name].num_rows, b[name].num_rows)
    row, column = rows, ""
    for field in FILES[name].schema:
        if field.name not in _KEYS:
            differs = np.flatnonzero(_bits(a[name][field.name][:row]) != _bits(b[name][field.name][:row]))
            if len(differs):
                row, column = int(differs[0]), field.name
    if column:
        unit = (FILES[name].schema.field(column).metadata or {}).get(b"unit", b"").decode().partition(",")[0]
        values = (table[name][column][row].as_py() for table in (a, b))
        return Difference(_time(a, name, row), _called(a, name, row, column), unit, *values)
    if a[name].num_rows == b[name].num_rows or name == "obstacles":  # they end when the robot's samples do
        return None
    longer = a if a[name].num_rows > rows else b
    if name == "robot":
        ends = (float(table[name]["t"][-1].as_py()) for table in (a, b))
        return Difference(_time(longer, name, row), "the end of the trial", "s", *ends)
    return Difference(_time(longer, name, row), f"rows in {FILES[name].path}", "", a[name].num_rows, b[name].num_rows)


def _called(tables: Tables, name: str, row: int, column: str) -> str:
    """What a column is called for people."""
    if name == "robot":
        return column
    of = "" if name == "snapshots" else f" of {tables[name]['obstacle' if name == 'obstacles' else 'name'][row]}"
    return f"{column}{of} in {FILES[name].path}"


def _time(tables: Tables, name: str, row: int) -> float:
    if name == "drawings":
        name, row = "snapshots", tables[name]["snapshot"][row].as_py()
    return float(tables[name]["t"][row].as_py())


def _bits(column: Any) -> Any:
    """The values as something that is equal only for the same bits."""
    if pa.types.is_floating(column.type) and column.null_count == 0:
        return np.ascontiguousarray(column.to_numpy()).view(np.int64)
    return np.array([repr(value) for value in column.to_pylist()], dtype=object)
