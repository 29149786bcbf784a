"""`clearway map`: let a robot build the map of a floor plan."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, RobotName, tell


def map_(
    floor_plan: Annotated[str, typer.Argument(help="A floor plan: a shipped name or a file.", show_default=False)],
    robot: RobotName = "tiago",
    out: Annotated[Path, typer.Option(help="Folder for the map: map.yaml and map.pgm.")] = Path("results/map"),
    seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Of the sensor noise, the odometry's and the mapper's.")
    ] = 0,
    odometry_only: Annotated[bool, typer.Option(help="No scan matching: shows what it is worth.")] = False,
    as_json: Json = False,
) -> None:
    """Drive a tour through a floor plan and build its map as the robot would (grid-based Rao-Blackwellised filter)."""
    from dataclasses import asdict

    from clearway.cli._progress import Progress
    from clearway.mapping import build_map
    from clearway.robots import load_robot

    with Progress("mapping") as progress:
        made = build_map(floor_plan, load_robot(robot), seed, out, progress, scan_matching=not odometry_only)
    if as_json:
        tell(asdict(made) | {"map": str(made.map)})
    else:
        typer.echo(str(made))
