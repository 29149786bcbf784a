"""Options that several verbs share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
ResultsDirectory = Annotated[Path, typer.Argument(help="A results directory, as `run` writes it.", show_default=False)]
RobotName = Annotated[
    str, typer.Option("--robot", "-r", help="A robot's name or TOML file; NAME:PRESET for one of its presets.")
]
