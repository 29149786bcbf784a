"""`clearway replay`: one trial as a page to play."""

from __future__ import annotations

from typing import Annotated

import typer

from clearway.cli._options import Json, ResultsDirectory


def replay(
    results: ResultsDirectory,
    trial: Annotated[int, typer.Option(min=0, help="The trial's number in trials.csv.")],
    as_json: Json = False,
) -> None:
    """Write a page that replays one trial: play, pause, scrub."""
    import json

    from clearway.reports import write_replay
    from clearway.trials.store import open_results

    page = write_replay(open_results(results), trial)
    typer.echo(json.dumps({"replay": str(page)}) if as_json else f"replay: {page}")
