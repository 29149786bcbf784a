"""One pure function an indicator: Trial -> number with a unit, or not computable, because.

`INDICATORS` is the registry: a new indicator is a file with its function and one line here; another package registers
its own under the entry-point group `clearway.indicators`. What else a row of
`trials.parquet` holds is declared in `columns.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

from clearway.errors import ClearwayError
from clearway.indicators import (
    barn,
    clearance,
    comfort,
    completion_time,
    cruise,
    delay,
    driven_uncertainty,
    goal_error,
    optimal,
    path_length,
    row,
    smoothness,
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
from clearway.registry import Registry
from clearway.trials import Trial


class _Indicators(Mapping[str, Indicator]):
    """Clearway's own, then those of other packages, which are imported at the first look: they may import us."""

    @cached_property
    def _known(self) -> dict[str, Indicator]:
        families = (
            success, completion_time, path_length, goal_error, clearance, comfort, delay, cruise, smoothness, space, barn, optimal, uncertainty,
            driven_uncertainty,
        )  # fmt: skip
        own = {indicator.name: indicator for family in families for indicator in family.ALL}
        others = Registry("indicator", "clearway.indicators", {}).all_of(Indicator)
        if twice := own.keys() & others.keys():
            raise ClearwayError(f"another package registers an indicator {min(twice)!r}, which Clearway has; rename it")
        return own | others

    def __getitem__(self, name: str) -> Indicator:
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


INDICATORS: Mapping[str, Indicator] = _Indicators()
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
