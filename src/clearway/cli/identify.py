"""`clearway identify`: how a recorded robot's base answers its commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, robots_beginning, tell


def identify(
    recording: Annotated[Path, typer.Argument(help="A bag with commands (Twist) and odometry.", show_default=False)],
    command: Annotated[str | None, typer.Option(help="Topic of the commands; default: the only one.")] = None,
    odometry: Annotated[str | None, typer.Option(help="Topic of the odometry; default: the only one.")] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            help="A robot's name or file, to be judged beside: how well it foretells this recording.",
            autocompletion=robots_beginning,
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Tell how a recorded robot's base answers its commands: latency, lag of its motors, accelerations, as lines of a robot's file."""
    from dataclasses import asdict

    from clearway.identifying import identify_recording

    found = identify_recording(recording, command=command, odometry=odometry, robot=robot)
    if as_json:
        tell(asdict(found) | {"recording": str(recording)}, indent=2)
        return
    typer.echo(f"{found}\n\n{found.toml()}")
