"""`clearway export`: trials as files for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, ResultsDirectory


def export(
    results: ResultsDirectory,
    to: Annotated[
        str,
        typer.Option(
            help="mcap, tum, csv, or what a capture system would have recorded: vicon, motive, qualisys, qualisys-6d, trc, c3d.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="The file; of several trials the folder for their files.", show_default=False)
    ],
    trial: Annotated[
        list[int] | None, typer.Option(min=0, help="A trial's number in trials.csv; may be repeated.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Every trial.")] = False,
    which: Annotated[str, typer.Option(help="Of TUM: true, estimate or both poses.")] = "both",
    scans: Annotated[bool, typer.Option("--scans/--no-scans", help="Of MCAP: with the lidar's scans.")] = True,
    rate: Annotated[float, typer.Option(help="Of a capture: Hz.")] = 100.0,
    noise: Annotated[float, typer.Option(help="Of a capture: standard deviation of a marker's coordinate, m.")] = 0.0,
    gaps: Annotated[float, typer.Option(help="Of a capture: share of the time in which a marker is unseen.")] = 0.0,
    swaps: Annotated[int, typer.Option(help="Of a capture: how often two of the robot's markers change names.")] = 0,
    seed: Annotated[int, typer.Option(help="Of noise, gaps and swaps.")] = 0,
    as_json: Json = False,
) -> None:
    """Export trials, simulated or recorded: bags, trajectories, tables, motion-capture layouts. Overwrites nothing."""
    import json

    from clearway.cli._progress import Progress
    from clearway.recordings.exports.export import export_trials
    from clearway.recordings.exports.synthetic import System
    from clearway.trials.store import open_results

    system = System(rate=rate, noise=noise, gaps=gaps, swaps=swaps, seed=seed)
    found = open_results(results)
    wanted = range(len(found)) if every else trial or ()
    with Progress("export") as progress:
        files = export_trials(found, wanted, to, out, system=system, which=which, scans=scans, progress=progress)
    if as_json:
        typer.echo(json.dumps({"files": [str(f) for f in files]}))
    else:
        for file in files:
            typer.echo(f"export: {file}")
