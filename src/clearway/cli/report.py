"""`clearway report`: the page, figures and tables of a results directory."""

from __future__ import annotations

import typer

from clearway.cli._options import Json, ResultsDirectory, tell


def report(results: ResultsDirectory, as_json: Json = False) -> None:
    """Write the report of a results directory (a self-contained page, SVG figures, CSV tables) and print its tables."""
    from clearway.reports import write_report
    from clearway.reports.text import numbers
    from clearway.trials.store import open_results

    page = write_report(results)
    if as_json:
        tell({"report": str(page)})
    else:
        typer.echo(f"{numbers(open_results(results))}\n\nreport: {page}")
