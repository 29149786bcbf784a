"""`clearway schema`: the JSON Schema of the files that a user writes."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer


class Kind(StrEnum):
    """A kind of file."""

    SCENARIO = "scenario"
    SUITE = "suite"
    ROBOT = "robot"


def schema(kind: Annotated[Kind, typer.Argument(help="Which kind of file.", show_default=False)]) -> None:
    """Print the JSON Schema of a scenario, suite or robot file (for editors that complete and check)."""
    import json

    from clearway.scenarios import check

    made = {Kind.SCENARIO: check.scenario_schema, Kind.SUITE: check.suite_schema, Kind.ROBOT: check.robot_schema}[kind]
    typer.echo(json.dumps(made(), indent=2))
