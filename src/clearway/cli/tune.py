"""`clearway tune`: better parameters for a navigator, and what they are worth on held-out trials."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, tell


def tune(
    task: Annotated[
        Path,
        typer.Argument(
            help="A TOML file: parameters and ranges, an objective, training and held-out trials.", show_default=False
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="The folder for what is found; default: results/tune-NAME.")] = None,
    workers: Annotated[int | None, typer.Option(min=0, help="How many processes; default: one a core.")] = None,
    as_json: Json = False,
) -> None:
    """Search for better parameters on training trials, and compare them with what came in on held-out ones.

    Exit code 1: no gain is shown on the held-out trials.
    """
    from dataclasses import asdict

    from clearway import api
    from clearway.cli._progress import stoppable

    def show(done: int, total: int, note: str = "") -> None:
        if not as_json:
            typer.echo(f"{done}/{total} {note}", err=True)

    with stoppable():
        found = api.tune(task, workers=workers, out=out, progress=show)
    if as_json:
        said = {"path": str(found.path), "robot": found.robot, "navigator": found.navigator, "trials": found.trials}
        tell(
            said
            | {"before": dict(found.before), "after": dict(found.after), "better": found.better}
            | {"gains": [asdict(gain) for gain in found.gains], "warnings": list(found.warnings)},
            indent=2,
        )
    else:
        typer.echo(str(found))
    if not found.better:
        raise typer.Exit(1)
