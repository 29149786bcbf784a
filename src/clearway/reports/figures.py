"""Figures by name: `figure(results, "trajectories", batch="CE")`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from clearway.errors import ClearwayError, unknown
from clearway.reports import theme
from clearway.reports.selection import label, representative, rows_of, systems, table_of
from clearway.trials.store import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = {
    "layout": "every configuration as it was set up (paper A, Fig. 2)",
    "trajectories": "a representative trial of each configuration (Fig. 5), and where others failed on their way",
    "strips": "the indicators of every trial in their units, all systems on one scale",
    "bars": "normalised means with intervals and asterisks (paper A's Fig. 6); one robot",
    "correlations": "Pearson's r between the indicators (Fig. 7)",
    "trial": "the trajectory of one trial",
    "clearance": "clearance over time of one trial",
    "paths": "paths of one test under each set-up, and the distance to the nearest obstacle (paper B, Figs. 4-9)",
    "thought": "what a navigator thought at an instant of one trial, `at` [s] (paper B, Figs. 2 and 10)",
}


def figure(results: Results, name: str, *, at: float | None = None, **selection: Any) -> Figure:
    """A figure of the selected trials.

    Args:
        results: An open results directory.
        name: One of `FIGURES`.
        at: s, for `thought` only.
        selection: Columns of the trials' table with the value (or values) wanted, such as `batch="CE"`, `trial=17`.

    Raises:
        ClearwayError: no such figure or column, or nothing is selected.
    """
    if name not in FIGURES:
        raise unknown("figure", name, FIGURES)
    rows = rows_of(results, **selection)
    with theme.style():
        if name in ("layout", "trajectories"):
            from clearway.reports import trajectory_plots

            return (
                trajectory_plots.layout(results, rows)
                if name == "layout"
                else trajectory_plots.trajectories(results, rows)
            )
        if name in ("trial", "clearance"):
            from clearway.reports import trajectory_plots

            row = rows[0] if len(rows) == 1 else representative(rows)
            assert row is not None
            title = f"Trial {row['trial']}: {row['robot']}, {label(row)}"
            return (trajectory_plots.one_trial if name == "trial" else trajectory_plots.clearance)(
                results.trial(row["trial"]), title
            )
        if name in ("paths", "thought"):
            from clearway.reports import rescue_figures

            if name == "thought":
                row = rows[0] if len(rows) == 1 else representative(rows)
                assert row is not None
                return rescue_figures.thought(results, row, at)
            if len({(r["scenario"], r["robot"], r["navigator"]) for r in rows}) > 1:
                raise ClearwayError("paths are of one scenario, robot and navigator; select them", field="scenario")
            return rescue_figures.paths(results, rows, f"{rows[0]['navigator']}, {rows[0]['scenario']}")
        if name == "strips":
            from clearway.reports import strips

            drawn = strips.strips(rows, lambda s: f"{s.robot} {s.navigator}", tuple(strips.SHOWN))
            if drawn is None:
                raise ClearwayError("none of the selected trials has any of the indicators", field="strips")
            return drawn
        from clearway.reports import charts
        from clearway.statistics import correlations_by_robot

        table = table_of(results, rows)
        if name == "correlations":
            return charts.correlations(correlations_by_robot(table))
        if len(there := systems(rows)) > 1:
            names = ", ".join(f"{s.robot} with {s.navigator}" for s in there)
            raise ClearwayError(f"the bars are of one robot with one navigator; select one of {names}", field="robot")
        return charts.bars(charts.Bars.of(table))
