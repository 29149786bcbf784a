"""Results directories, opened and put side by side."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.errors import ClearwayError, shown
from clearway.scenarios.selecting import strings
from clearway.trials import Trial, store

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from clearway.statistics import Comparison, ConfigurationComparison, Verdict

TAKES = {"trial": "trial=17", "clearance": "trial=17", "thought": "trial=17, at=12.0", "paths": 'scenario="..."'}
"""What a figure is of, where that is not any selection of columns."""


class Results(store.Results):
    """A finished results directory.

    Attributes:
        path: The directory.
        campaign: What campaign.json holds: what was asked, versions, seeds, machine.
        trials: A pyarrow.Table, one row a trial; a column's unit is in its field's metadata.
    """

    def to_pandas(self) -> Any:
        """The table of trials as a pandas.DataFrame."""
        return self.trials.to_pandas()

    def to_polars(self) -> Any:
        """The table of trials as a polars.DataFrame."""
        try:
            import polars
        except ImportError as error:
            raise ClearwayError("polars is not installed; pip install 'clearway[polars]'") from error
        return polars.from_arrow(self.trials)

    def trial(self, index: int) -> Trial:
        """Trial number `index` (the column `trial`) in full.

        Raises:
            ClearwayError: there is no such trial, or a file is damaged.
        """
        try:
            number = operator.index(index)  # NumPy's whole numbers too
        except TypeError:
            raise ClearwayError(
                f"{shown(index)} is no trial's number; 0 to {len(self) - 1} are (the column `trial`)", file=self.path
            ) from None
        return super().trial(number)

    def summary(self) -> Any:
        """A row a system, suite, batch and speed, as a pyarrow.Table: success with its exact 95 % interval, the same by the robot's own
        estimate, and the mean of each of paper A's indicators with its bootstrap interval; `to_pandas()` makes a frame of it.
        """
        from clearway.statistics.summary import summary

        return summary(self.trials)

    def _repr_html_(self) -> str:
        """What a notebook shows: the headline numbers as a table."""
        from clearway.reports.notebook import as_html

        return as_html(self, self.summary())

    def figures(self) -> dict[str, str]:
        """The figures that `figure` draws: the name of each, and what it shows and takes."""
        from clearway.reports import FIGURES

        return {name: f"figure({name!r}, {TAKES.get(name, 'column=value, ...')}): {FIGURES[name]}" for name in FIGURES}

    def figure(self, name: str, **selection: Any) -> Figure:
        """A figure of the report, drawn anew.

        Args:
            name: Which one: `trajectories`, `bars`, ...
            **selection: What to narrow it to, as in `batch="CE"`.

        Raises:
            ClearwayError: no such figure, or a selection that selects nothing.
        """
        from clearway.reports import figure
        from clearway.reports.notebook import as_png

        drawn: Any = figure(self, name, **selection)
        drawn._repr_png_ = partial(as_png, drawn)  # which a notebook shows; a Figure alone it doesn't
        found: Figure = drawn
        return found

    def report(self, verdict: Verdict | None = None) -> Path:
        """Write the report (a self-contained page, figures, tables) into the directory; returns the page's path.

        Args:
            verdict: Of `clearway.accept`: with what the page begins.
        """
        from clearway.reports import write_report

        return Path(write_report(self.path, verdict))


def open_results(path: str | Path) -> Results:
    """Open a finished results directory.

    Raises:
        ClearwayError: not a results directory, unfinished, damaged, or written by a newer version of Clearway.
    """
    found = store.open_results(path)
    return Results(found.path, found.campaign)


def compare(
    *results: str | Path | store.Results,
    between: Iterable[str] = (),
    indicators: Iterable[str] | None = None,
    confidence: float = 0.95,
    out: str | Path | None = None,
) -> list[Comparison | ConfigurationComparison]:
    """Compare every two of several results, or of the systems of one: success and indicators on the same tests.

    Args:
        results: Results directories or their paths; of a single one its robots, navigators and set-ups are compared.
        between: Of a single one, only the systems of these robots, navigators or set-ups.
        indicators: Only these; None: paper A's.
        confidence: Of the intervals, in (0, 1).
        out: A folder for a page with figures, and a CSV table; None: none is written.

    Returns:
        A comparison a pair that has a test in common, the later against the earlier.

    Raises:
        ClearwayError: nothing to compare, no two results with a test in common, or `out` can't be used.
    """
    from clearway.reports.comparison_page import write_comparison
    from clearway.reports.side_by_side import tables_of
    from clearway.statistics import compare_all

    opened = [one if isinstance(one, store.Results) else open_results(one) for one in results]
    chosen = None if indicators is None else strings(indicators, "indicators")
    found = compare_all(tables_of(opened, strings(between, "between")), indicators=chosen, confidence=confidence)
    if out is not None:
        write_comparison(found, Path(out))
    return found
