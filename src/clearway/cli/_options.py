"""Options that several verbs share."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
ResultsDirectory = Annotated[Path, typer.Argument(help="A results directory, as `run` writes it.", show_default=False)]
RobotName = Annotated[
    str, typer.Option("--robot", "-r", help="A robot's name or TOML file; NAME:PRESET for one of its presets.")
]
Batches = Annotated[list[str] | None, typer.Option("--batch", help="Only these batches.")]
Configurations = Annotated[list[str] | None, typer.Option("--configuration", help="Only these configurations.")]
Speeds = Annotated[list[float] | None, typer.Option("--speed", help="Only these set speeds, m/s.")]
ObstacleSpeeds = Annotated[
    list[float] | None, typer.Option("--obstacle-speed", help="Only these speeds of the moving obstacle, m/s.")
]
Sizes = Annotated[list[float] | None, typer.Option("--size", help="Only these obstacle edges, m.")]
Gaps = Annotated[list[float] | None, typer.Option("--gap", help="Only these gaps, in multiples of d_base.")]
Repetitions = Annotated[int | None, typer.Option(min=1, help="Repetitions of each configuration.")]
FloorPlanName = Annotated[str | None, typer.Option(help="Another floor plan for the suite, such as ward.")]


@contextmanager
def apart(as_json: bool) -> Iterator[None]:
    """With --json, what a navigator or other foreign code prints goes to stderr, also from compiled code and from workers:
    standard output holds the JSON alone."""
    if not as_json:
        yield
        return
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        sys.stderr.flush()
        os.dup2(kept, 1)
        os.close(kept)
