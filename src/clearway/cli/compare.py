"""`clearway compare`: paired differences between results directories."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json


def compare(
    directories: Annotated[
        list[Path], typer.Argument(help="Two or more results directories; the first is the reference.")
    ],
    as_json: Json = False,
) -> None:
    """Compare results directories: paired differences per indicator, with intervals."""
    from clearway.errors import ClearwayError

    if len(directories) < 2:
        raise ClearwayError("compare needs at least two results directories")
    raise NotImplementedError
