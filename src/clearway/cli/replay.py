"""`clearway replay`: one trial as a page to play."""

from __future__ import annotations

from typing import Annotated

import typer

from clearway.cli._options import Json, ResultsDirectory, tell


def replay(
    results: ResultsDirectory,
    trial: Annotated[int, typer.Option(min=0, help="The trial's number in trials.csv.")],
    as_json: Json = False,
) -> None:
    """Write a page that replays one trial: play, pause, scrub."""
    from clearway.reports import write_replay
    from clearway.trials.store import open_results

    page = write_replay(open_results(results), trial)
    if as_json:
        tell({"replay": str(page)})
    else:
        typer.echo(f"replay: {page}")
