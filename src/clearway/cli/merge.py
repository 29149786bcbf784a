"""`clearway merge`: put the shards of a campaign together."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, tell


def merge(
    shards: Annotated[list[Path], typer.Argument(help="The results directories of all shards, in any order.")],
    out: Annotated[Path, typer.Option(help="Results directory of the whole.")],
    no_report: Annotated[bool, typer.Option("--no-report", help="Only the results, no page.")] = False,
    as_json: Json = False,
) -> None:
    """Put together what `clearway run --shard K/N` ran apart: the same bytes as if it had been run in one piece."""
    from clearway import api
    from clearway.cli._progress import Progress, stoppable, written
    from clearway.reports.text import headline

    again = "the shards are as they were; the same command begins again"
    with stoppable(f"nothing was merged, {again}"), Progress("trials merged") as progress:
        results = api.merge(*shards, out=out, progress=progress)
    page = None if no_report else written(results)
    if as_json:
        tell({"results": str(results.path), "report": page and str(page), "trials": len(results)})
    else:
        typer.echo(headline(results.trials))
        typer.echo(f"results: {results.path}" if page is None else f"report: {page}")
