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
    PLAN = "plan"


def schema(kind: Annotated[Kind, typer.Argument(help="Which kind of file.", show_default=False)]) -> None:
    """Print the JSON Schema of a scenario, suite, robot or plan file (for editors that complete and check)."""
    import json

    from clearway.scenarios import files

    made = {
        Kind.SCENARIO: files.scenario_schema,
        Kind.SUITE: files.suite_schema,
        Kind.ROBOT: files.robot_schema,
        Kind.PLAN: files.plan_schema,
    }
    typer.echo(json.dumps(made[kind](), indent=2))
