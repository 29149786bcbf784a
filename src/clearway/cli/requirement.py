"""`clearway requirement`: what the environment must offer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli import _options
from clearway.cli._options import Json, tell


def requirement(
    offer: Annotated[
        str,
        typer.Argument(
            help="What: door, corridor, gap, lane, density, latency, lidar-noise, odometry-noise, or the address of an Offer.",
            show_default=False,
        ),
    ],
    robot: _options.RobotName = "tiago",
    navigator: Annotated[
        str,
        typer.Option("--navigator", "-n", help="Who drives.", autocompletion=_options.navigators_beginning),
    ] = "move-base",
    reliability: Annotated[float, typer.Option(help="The success that is asked for, in (0, 1).")] = 0.95,
    confidence: Annotated[float, typer.Option(help="That the interval holds, in (0, 1).")] = 0.95,
    between: Annotated[
        str | None, typer.Option("--range", help="Least and greatest value, as 0.6:1.2; default: usual for the robot.")
    ] = None,
    step: Annotated[float | None, typer.Option(help="Distance of neighbouring values.")] = None,
    speed: Annotated[float, typer.Option(help="Set speed, m/s.")] = 0.6,
    trials: Annotated[int, typer.Option(help="How many there may be.")] = 400,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Of the campaign.")] = 0,
    localisation: Annotated[
        str | None, typer.Option(help="truth, odometry or amcl; default: as the tests say, amcl.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=0, help="How many processes; default: one a core.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="A folder for tests, results, curve and numbers; an earlier search in it goes on."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Find how wide a door (a corridor, a gap ...) must be for a robot to succeed often enough, in as few trials as that takes.

    Exit code 1: success does not reach what was asked for anywhere in the range, as far as could be shown.
    """
    from clearway import api
    from clearway.api.arguments import free_directory
    from clearway.cli._progress import Progress, stoppable
    from clearway.errors import ClearwayError, shown
    from clearway.reports.requirement import CURVE

    ends: tuple[float, float] | None = None
    if between is not None:
        low, _, high = between.partition(":")
        try:
            ends = float(low), float(high)
        except ValueError:
            raise ClearwayError(f"{shown(between)} is no range; write it as 0.6:1.2", field="--range") from None
    place = free_directory([f"requirement-{offer.rpartition(':')[2]}"]) if out is None else out
    with Progress("trials") as progress, stoppable(f"what is finished is kept; with --out {place} it goes on"):
        found = api.requirement(
            offer, robot, navigator, reliability=reliability, confidence=confidence, between=ends, step=step, speed=speed,
            trials=trials, seed=seed, localisation=localisation, workers=workers, out=place, progress=progress,
        )  # fmt: skip
    if as_json:
        tell(found.to_json() | {"out": str(place)}, indent=2)
    else:
        typer.echo(f"{found}\ncurve: {place / CURVE}")
    if not found.met:
        raise typer.Exit(1)
