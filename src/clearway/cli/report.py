"""`clearway report`: the page, figures and tables of a results directory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, ResultsDirectory, tell


def report(
    results: ResultsDirectory,
    pdf: Annotated[
        bool,
        typer.Option("--pdf", help="Also print its first screen on one A4 page, report/summary.pdf; needs Chromium."),
    ] = False,
    criteria: Annotated[
        Path | None,
        typer.Option(help="Criteria (TOML), as `clearway accept` reads them: the page begins with the verdict."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write the report of a results directory (a self-contained page, SVG figures, CSV tables) and print its tables."""
    from clearway import api
    from clearway.reports import printing_browser, write_pdf, write_report
    from clearway.reports.text import numbers
    from clearway.trials.store import open_results

    if pdf:
        printing_browser()  # complains before anything is written
    page = write_report(results, None if criteria is None else api.accept(criteria, results))
    sheet = write_pdf(results) if pdf else None
    if as_json:
        tell({"report": str(page)} | ({"pdf": str(sheet)} if sheet else {}))
    else:
        also = f"\npdf: {sheet}" if sheet else ""
        typer.echo(f"{numbers(open_results(results))}\n\nreport: {page}{also}")
