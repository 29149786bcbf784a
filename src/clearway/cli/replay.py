"""`clearway replay`: one trial as a page to play, or as a video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, ResultsDirectory, tell
from clearway.cli._progress import Progress


def replay(
    results: ResultsDirectory,
    trial: Annotated[int, typer.Option(min=0, help="The trial's number in trials.csv.")],
    video: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a video instead: .gif, or .mp4 and .webm where there is ffmpeg."),
    ] = None,
    beside: Annotated[
        int | None,
        typer.Option(min=0, metavar="TRIAL", help="With --video: a second trial to show beside it, on one clock."),
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.1, max=100.0, help="With --video: how many times faster than it was.")
    ] = 4.0,
    as_json: Json = False,
) -> None:
    """Write a page that replays one trial (play, pause, scrub, another beside it), or a video."""
    from clearway.errors import ClearwayError
    from clearway.trials.store import open_results

    if video is None:
        from clearway.reports import write_replay

        if beside is not None:
            raise ClearwayError(
                "in the page another trial is picked beside it; the option is for --video", field="--beside"
            )
        made = write_replay(open_results(results), trial)
    else:
        from clearway.reports.video import write_video

        shown = [trial] if beside is None else [trial, beside]
        with Progress("frames") as progress:
            made = write_video(open_results(results), shown, video, speed, progress)
    if as_json:
        tell({"replay": str(made)})
    else:
        typer.echo(f"replay: {made}")
