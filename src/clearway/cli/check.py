"""`clearway check`: is this file, robot, suite or plan, or this navigator, as it should be?"""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from clearway.cli._options import Json, tell

if TYPE_CHECKING:
    from clearway.navigators.common.parameter_table import ParameterTable

SHOWN = 50
"""Problems that are printed."""

_WORDS = {"problems": ("unknown",), "passed": ("read", "default", "ignored"), "not_tested": ("missing",)}
"""What becomes of a parameter, in the words of the other checks."""


def check(
    target: Annotated[
        str,
        typer.Argument(
            help="A TOML or map file; a file of Nav2's parameters, a folder of move_base's; "
            "the name of a robot or floor plan; a suite (name, my_pkg:SUITE); a navigator (name, my_pkg:MyNavigator, exec:COMMAND)."
        ),
    ],
    robot: Annotated[
        str | None,
        typer.Option("--robot", "-r", help="Who drives: a robot's name or file; default: the suite's own, or tiago."),
    ] = None,
    decision_limit: Annotated[
        float, typer.Option(help="Seconds of wall clock after which a navigator's decision counts as hung.")
    ] = 10.0,
    as_json: Json = False,
) -> None:
    """Say what is wrong with a scenario, suite, robot, plan, test plan, map, criteria file or task of `tune`, or with a navigator.

    Of a test plan the recordings are read as well: whether they hold what it names, and whether its ties tie.
    Of a file of Nav2's parameters, or a folder with those of ROS 1's move_base, a table says what becomes of each: read, ignored (why), missing here (what is closest) or unknown
    (what it is likely to mean).
    Each finding is printed as soon as it is known; what could not be tested is not called right.
    """
    from clearway.campaigns.checks import findings
    from clearway.errors import ClearwayError, noted
    from clearway.improving.preparing import task_findings
    from clearway.navigators.parameter_files import parameter_table

    found: dict[bool | None, list[str]] = {True: [], False: [], None: []}
    wrong: list[ClearwayError] = []
    with noted(wrong) if as_json else nullcontext():  # whoever reads JSON is given some
        if (table := parameter_table(target, robot)) is not None:
            _tell_parameters(target, table, as_json)
        for passed, text in task_findings(Path(target)) or findings(target, robot, decision_limit):
            found[passed].append(text)
            if as_json:
                continue
            if passed is False and len(found[False]) > SHOWN:
                continue
            word = {True: "ok", False: "problem", None: "not tested"}[passed]
            typer.echo(f"{word:<10}  {text}", err=passed is False)
    problems, untested = [*found[False], *map(str, wrong)], found[None]
    if as_json:
        answer: dict[str, Any] = {"target": target, "problems": problems, "passed": found[True], "not_tested": untested}
        tell(answer, indent=2)
    else:
        if len(problems) > SHOWN:
            typer.echo(f"problem     and {len(problems) - SHOWN} more; --json has them all", err=True)
        said = "nothing wrong" if not problems else f"{len(problems)} problem(s)"
        typer.echo(f"{target}: {said}" + (f", {len(untested)} not tested" if untested else ""))
    raise typer.Exit(1 if problems else 0)


def _tell_parameters(target: str, table: ParameterTable, as_json: bool) -> NoReturn:
    """Show what becomes of the parameters of a file, and end."""
    if as_json:
        told = {word: [str(row) for row in table.rows if row.status in of] for word, of in _WORDS.items()}
        told["problems"] = [*map(str, table.problems), *told["problems"]]
        tell(
            {"target": target, **told, "about": table.about, "parameters": [row._asdict() for row in table.rows]},
            indent=2,
        )
    else:
        typer.echo(str(table))
    raise typer.Exit(0 if table.all_known else 1)
