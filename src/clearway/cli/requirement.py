"""`clearway requirement`: what the environment must offer."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from clearway.cli import _options
from clearway.cli._options import Json, tell

_OF_A_FOLDER = ("offer", "map_", "start", "out", "as_json")
"""What may be said of a folder with a finished search."""


def requirement(
    ctx: typer.Context,
    offer: Annotated[
        str,
        typer.Argument(
            help="What: door, corridor, gap, lane, density, latency, lidar-noise, odometry-noise, or the address of an Offer; "
            "or the folder of a finished search, to tell it again or to colour a map by it.",
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
    seed: Annotated[int, typer.Option(min=0, max=2**62 - 1, help="Of the campaign.")] = 0,
    localisation: Annotated[
        str | None, typer.Option(help="truth, odometry or amcl; default: as the tests say, amcl.")
    ] = None,
    success: Annotated[
        str,
        typer.Option(
            help="What counts as a success: success_slack (2 cm and 0.02 rad of slack at the goal), success (by the true pose) or "
            "success_self (by the robot's own estimate)."
        ),
    ] = "success_slack",
    map_: Annotated[
        str | None,
        typer.Option(
            "--map",
            help="A ROS map's yaml or a floor plan: coloured by the probability with which the robot comes where.",
        ),
    ] = None,
    start: Annotated[
        str | None, typer.Option(help="With --map: where the robot comes from, as x,y; default: the roomiest place.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=0, help="How many processes; default: one a core.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="A folder for tests, results, page and numbers; an earlier search in it goes on."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Find how wide a door (a corridor, a gap ...) must be for a robot to succeed often enough, in as few trials as that takes.

    Exit code 1: success does not reach what was asked for anywhere in the range, as far as could be shown.
    """
    from clearway import api
    from clearway.api.arguments import free_directory
    from clearway.cli._progress import Progress, stoppable
    from clearway.errors import ClearwayError
    from clearway.reports.page import PAGE
    from clearway.reports.requirement import read_requirement
    from clearway.scenarios.offers import OFFERS

    ends = None if between is None else _two(between, ":", "--range", "no range; write it as 0.6:1.2")
    place = None if start is None else _two(start, ",", "--start", "no place; write it as 2.5,0.3")
    if place is not None and map_ is None:
        raise ClearwayError("belongs to --map", field="--start")
    if offer not in OFFERS.addresses() and os.path.isdir(offer):
        said = {name: ctx.get_parameter_source(name) for name in ctx.params if name not in _OF_A_FOLDER}
        given = [name for name, source in said.items() if source is not None and source.name == "COMMANDLINE"]
        if given:
            raise ClearwayError(f"means nothing for the folder {offer!r}, whose search is finished", field=given[0])
        found, folder = read_requirement(Path(offer)), Path(offer) if out is None else out
    else:
        folder = free_directory([f"requirement-{offer.rpartition(':')[2]}"]) if out is None else out
        with Progress("trials") as progress, stoppable(f"what is finished is kept; with --out {folder} it goes on"):
            found = api.requirement(
                offer, robot, navigator, reliability=reliability, confidence=confidence, between=ends, step=step, speed=speed,
                trials=trials, seed=seed, localisation=localisation, judged=success, workers=workers, out=folder, progress=progress,
            )  # fmt: skip
    coloured = None if map_ is None else api.passable(found, map_, start=place, out=folder)
    if as_json:
        told = found.to_json() | {"out": str(folder)}
        if coloured is not None:
            shares = {"start": coloured.start, "shown": coloured.shown, "reached": coloured.share(found.reliability)}
            told |= {"map": shares | {"sentence": str(coloured)}}
        tell(told, indent=2)
    else:
        typer.echo(
            "\n".join(
                [
                    str(found),
                    *([] if coloured is None else [str(coloured)]),
                    *([f"page: {folder / PAGE}"] if (folder / PAGE).exists() else []),
                ]
            )
        )
    if not found.met:
        raise typer.Exit(1)


def _two(text: str, between: str, field: str, problem: str) -> tuple[float, float]:
    from clearway.errors import ClearwayError, shown

    first, _, second = text.partition(between)
    try:
        return float(first), float(second)
    except ValueError:
        raise ClearwayError(f"{shown(text)} is {problem}", field=field) from None
