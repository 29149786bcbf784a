"""One pure function an indicator: Trial -> number with a unit, or not computable, because.

`INDICATORS` is the registry: a new indicator is a file with its function and one line here. What else a row of
`trials.parquet` holds is declared in `columns.py`.
"""

from __future__ import annotations

from typing import Any

from clearway.indicators import (
    barn,
    clearance,
    completion_time,
    cruise,
    goal_error,
    optimal,
    path_length,
    row,
    space,
    success,
    uncertainty,
)
from clearway.indicators.cause import cause
from clearway.indicators.column import Cell, Kind
from clearway.indicators.columns import COLUMNS
from clearway.indicators.completion_time import TIMED
from clearway.indicators.indicator import Indicator, NotComputable, Value
from clearway.indicators.success import SLACK, failure
from clearway.indicators.uncertainty import shown_digits
from clearway.trials import Trial

INDICATORS: dict[str, Indicator] = {
    indicator.name: indicator
    for family in (
        success,
        completion_time,
        path_length,
        goal_error,
        clearance,
        cruise,
        space,
        barn,
        optimal,
        uncertainty,
    )
    for indicator in family.ALL
}
"""Every indicator by its name, in the order of the columns."""

HEADLINE = ("CT", "PL", "DE", "OE", "MDO", "TCS")
"""Paper A's indicators that are numbers of a trial; SR is the share of `success`."""


def score_row(trial: Trial) -> dict[str, Cell]:
    """The trial as a row of `trials.parquet`: labels, outcome, `failure`, every indicator, and `not_computable`
    (JSON: indicator -> why). None: does not apply, unknown, or not computable. Pure: same trial, same row."""
    return row.score(trial, COLUMNS, INDICATORS)


def row_schema() -> Any:
    """The `pyarrow.Schema` of a table of such rows, with units in the fields' metadata."""
    return row.schema(COLUMNS, INDICATORS)


__all__ = [
    "COLUMNS",
    "HEADLINE",
    "INDICATORS",
    "SLACK",
    "TIMED",
    "Indicator",
    "Kind",
    "NotComputable",
    "Value",
    "cause",
    "failure",
    "row_schema",
    "score_row",
    "shown_digits",
]
