"""`clearway report`: the page, figures and tables of a results directory."""

from __future__ import annotations

import typer

from clearway.cli._options import Json, ResultsDirectory


def report(results: ResultsDirectory, as_json: Json = False) -> None:
    """Write the report of a results directory: a self-contained page, SVG figures, CSV tables."""
    import json

    from clearway.reports import write_report

    page = write_report(results)
    typer.echo(json.dumps({"report": str(page)}) if as_json else f"report: {page}")
