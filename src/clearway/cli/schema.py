"""`clearway schema`: the JSON Schema of the files that a user writes."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Annotated, Any

import typer


class Kind(StrEnum):
    """A kind of file."""

    SCENARIO = "scenario"
    SUITE = "suite"
    ROBOT = "robot"
    FLOOR_PLAN = "floor-plan"
    TEST_PLAN = "test-plan"
    TABLE = "table"
    CRITERIA = "criteria"


def schema(kind: Annotated[Kind, typer.Argument(help="Which kind of file.", show_default=False)]) -> None:
    """Print the JSON Schema of a scenario, suite, robot, floor plan, test plan, table's or criteria file (for editors that complete and check)."""
    import json

    from clearway.recordings.formats.table_spec import TableSpec
    from clearway.recordings.lab.test_plan import TestPlan
    from clearway.scenarios import files
    from clearway.statistics import Criteria

    made: dict[Kind, Callable[[], dict[str, Any]]] = {
        Kind.SCENARIO: files.scenario_schema,
        Kind.SUITE: files.suite_schema,
        Kind.ROBOT: files.robot_schema,
        Kind.FLOOR_PLAN: files.floor_plan_schema,
        Kind.TEST_PLAN: lambda: files.schema_of(TestPlan),
        Kind.TABLE: lambda: files.schema_of(TableSpec),
        Kind.CRITERIA: lambda: files.schema_of(Criteria),
    }
    typer.echo(json.dumps(made[kind](), indent=2))
