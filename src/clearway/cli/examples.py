"""`clearway examples`: the examples that came with the package, and copies of them to work on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, tell


def examples(
    copy: Annotated[
        Path | None, typer.Option(help="Copy them into this folder, which must not hold any of them.")
    ] = None,
    as_json: Json = False,
) -> None:
    """List the examples, scripts, files and a notebook, or copy them to a folder of yours."""
    from clearway.examples_place import copy_examples, example_files

    names = [str(name) for name in example_files()]
    if copy is not None:
        copy_examples(copy)
    if as_json:
        tell({"examples": names, "copied_to": None if copy is None else str(copy)}, indent=2)
    elif copy is not None:
        typer.echo(f"{len(names)} files copied to {copy}")
    else:
        typer.echo("\n".join([*names, "", "clearway examples --copy DIR copies them"]))
