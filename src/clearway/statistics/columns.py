"""Reading the columns of a results table (`trials.parquet`, as Arrow), and writing tables of findings."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.indicators import INDICATORS, Indicator

SYSTEM = ("robot", "navigator", "setup")
"""What is tested: who moves, who decides, and how long it may think."""
GROUP = (*SYSTEM, "suite", "batch", "speed")
"""Paper A's groups: Fig. 6 shows a bar for each batch and speed of a robot; batches of different suites are different ones."""


def values(table: pa.Table, name: str) -> list[Any]:
    """The column as Python values, None where it is null.

    Raises:
        ClearwayError: the table has no such column.
    """
    if name not in table.column_names:
        raise unknown("column", name, table.column_names)
    result: list[Any] = table[name].to_pylist()
    return result


def numbers(table: pa.Table, name: str) -> FloatArray:
    """The column as (n,) float64, NaN where it is null; True is 1, False 0.

    Raises:
        ClearwayError: there is no such column, or it holds text.
    """
    try:
        return np.array([np.nan if v is None else float(v) for v in values(table, name)], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ClearwayError(f"column {name!r} does not hold numbers") from error


def indicators_in(table: pa.Table, names: Sequence[str] | None, default: Iterable[str]) -> list[Indicator]:
    """The indicators called `names` (None: those of `default` that the table has).

    Raises:
        ClearwayError: a name is no indicator, or the table does not have it.
    """
    if names is None:
        return [INDICATORS[name] for name in default if name in table.column_names]
    for name in names:
        if name not in INDICATORS:
            raise unknown("indicator", name, INDICATORS)
        values(table.slice(0, 0), name)
    return [INDICATORS[name] for name in names]


def groups(table: pa.Table, by: Sequence[str]) -> dict[tuple[Any, ...], np.ndarray]:
    """Row numbers by the values of the columns `by`: text in order of appearance, numbers ascending."""
    columns = [values(table, name) for name in by]
    first: dict[tuple[Any, ...], list[int]] = {}
    for row in range(table.num_rows):
        first.setdefault(tuple(column[row] for column in columns), []).append(row)
    ranks = [{v: i for i, v in enumerate(_ordered(column))} for column in columns]
    keys = sorted(first, key=lambda key: [rank[v] for rank, v in zip(ranks, key, strict=True)])
    return {key: np.array(first[key]) for key in keys}


def _ordered(column: list[Any]) -> list[Any]:
    seen = list(dict.fromkeys(column))
    if all(isinstance(v, (int, float)) or v is None for v in seen):
        return sorted(seen, key=lambda v: (v is None, v))
    return seen


def batch_names(rows: Iterable[Mapping[str, Any]]) -> list[Any]:
    """Each trial's batch; with its suite before it where there are several suites, whose batches may have the same names."""
    both = [(row["suite"], row["batch"]) for row in rows]
    if len({suite for suite, _ in both}) < 2:
        return [batch for _, batch in both]
    return [" ".join(filter(None, names)) for names in both]


def any_estimate(rows: Iterable[Mapping[str, Any]]) -> bool:
    """Whether any of these trials was judged by the robot's own estimate: of an attempt of which nothing was recorded
    `success_self` is known without one, for it counts as a failure."""
    return any(
        r["success_self"] is not None and (r.get("source") != "recorded" or r.get("duration") != 0.0) for r in rows
    )


def reasons(table: pa.Table, rows: np.ndarray) -> dict[str, str]:
    """By indicator why it is missing in these rows, the commonest first, with how often: `leg back was not finished (3)`."""
    if "not_computable" not in table.column_names:
        return {}
    cells = Counter(table["not_computable"].take(pa.array(rows)).to_pylist())  # most say the same
    found: dict[str, Counter[str]] = {}
    for cell, count in cells.items():
        for name, text in json.loads(cell or "{}").items():
            if text:
                found.setdefault(name, Counter())[text] += count
    return {name: "; ".join(f"{text} ({n})" for text, n in why.most_common()) for name, why in found.items()}


def findings(rows: Sequence[Mapping[str, Any]], schema: pa.Schema) -> pa.Table:
    """Rows as a table of `schema`; what is NaN becomes null."""

    def clean(cell: Any) -> Any:
        return None if isinstance(cell, float) and np.isnan(cell) else cell

    return pa.Table.from_pylist([{name: clean(row.get(name)) for name in schema.names} for row in rows], schema=schema)


def schema(**kinds: type) -> pa.Schema:
    """A schema from `name=type`, with the types str, float, int and bool."""
    arrow = {str: pa.string(), float: pa.float64(), int: pa.int64(), bool: pa.bool_()}
    return pa.schema([pa.field(name, arrow[kind]) for name, kind in kinds.items()])
