"""`clearway export`: trials as files for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, ResultsDirectory, tell


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
    which: Annotated[str | None, typer.Option(help="Of TUM: true, estimate or both poses; default: both.")] = None,
    scans: Annotated[
        bool | None, typer.Option("--scans/--no-scans", help="Of MCAP: with the lidar's scans; default: with them.")
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Of a capture: Hz; default: 100.")] = None,
    lead: Annotated[
        float | None, typer.Option(help="Of a capture: s of rest before and after the trial; default: 2.")
    ] = None,
    noise: Annotated[
        float | None, typer.Option(help="Of a capture: standard deviation of a marker's coordinate, m; default: 0.")
    ] = None,
    gaps: Annotated[
        float | None, typer.Option(help="Of a capture: share of the time in which a marker is unseen; default: 0.")
    ] = None,
    swaps: Annotated[
        int | None, typer.Option(help="Of a capture: how often two of the robot's markers change names; default: 0.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of noise, gaps and swaps; default: 0.")] = None,
    as_json: Json = False,
) -> None:
    """Export trials, simulated or recorded: bags, trajectories, tables, motion-capture layouts. Overwrites nothing.

    Beside a capture FILE it writes FILE.markers.toml: where the made-up markers sit, as a test plan needs it.
    """
    from clearway.cli._progress import Progress
    from clearway.recordings.exports.export import export_trials, settings
    from clearway.trials.store import open_results

    capture = {"rate": rate, "lead": lead, "noise": noise, "gaps": gaps, "swaps": swaps, "seed": seed}
    how = settings(to, {"which": which, "scans": scans} | capture)
    found = open_results(results)
    with Progress("export") as progress:
        files, left_out = export_trials(found, None if every else trial or (), to, out, progress=progress, **how)
    if as_json:
        tell({"files": [str(f) for f in files], "not_recorded": left_out})
    else:
        for file in files:
            typer.echo(f"export: {file}")
        if to == "mcap":
            made_up = "/odom" if scans is False else "/odom and /scan"
            typer.echo(f"export: made up from the true pose, without noise, as a trial keeps no messages: {made_up}")
        if left_out:
            typer.echo(f"export: not recorded or not kept, left out: trials {', '.join(map(str, left_out))}")
