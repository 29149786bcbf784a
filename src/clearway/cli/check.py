"""`clearway check`: is this file, robot, suite or plan, or this navigator, as it should be?"""

from __future__ import annotations

from typing import Annotated, Any

import typer

from clearway.cli._options import Json, tell

SHOWN = 50
"""Problems that are printed."""


def check(
    target: Annotated[
        str,
        typer.Argument(
            help="A TOML or map file; the name of a robot, suite or floor plan; a navigator (name or my_pkg:MyNavigator)."
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
    """Say what is wrong with a scenario, suite, robot, plan, test plan or map file, or with a navigator.

    Of a test plan the recordings are read as well: whether they hold what it names, and whether its ties tie.
    Each finding is printed as soon as it is known; what could not be tested is not called right.
    """
    from clearway.campaigns.checks import findings

    found: dict[bool | None, list[str]] = {True: [], False: [], None: []}
    for passed, text in findings(target, robot, decision_limit):
        found[passed].append(text)
        if as_json:
            continue
        if passed is False and len(found[False]) > SHOWN:
            continue
        word = {True: "ok", False: "problem", None: "not tested"}[passed]
        typer.echo(f"{word:<10}  {text}", err=passed is False)
    problems, untested = found[False], found[None]
    if as_json:
        answer: dict[str, Any] = {"target": target, "problems": problems, "passed": found[True], "not_tested": untested}
        tell(answer, indent=2)
    else:
        if len(problems) > SHOWN:
            typer.echo(f"problem     and {len(problems) - SHOWN} more; --json has them all", err=True)
        said = "nothing wrong" if not problems else f"{len(problems)} problem(s)"
        typer.echo(f"{target}: {said}" + (f", {len(untested)} not tested" if untested else ""))
    raise typer.Exit(1 if problems else 0)
