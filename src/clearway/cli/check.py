"""`clearway check`: is this file, or this navigator, as it should be?"""

from __future__ import annotations

from typing import Annotated

import typer

from clearway.cli._options import Json, RobotName, tell

SHOWN = 50
"""Problems that are printed."""


def check(
    target: Annotated[str, typer.Argument(help="A TOML or map file, or a navigator (name or my_pkg:MyNavigator).")],
    robot: RobotName = "tiago",
    as_json: Json = False,
) -> None:
    """Say what is wrong with a scenario, suite, robot, plan, test plan or map file, or with a navigator.

    Of a test plan the recordings are read as well: whether they hold what it names, and whether its ties tie.
    """
    import os
    from pathlib import Path

    from clearway.errors import ClearwayError
    from clearway.robots import load_robot

    if Path(target).suffix in (".toml", ".yaml", ".yml"):
        from clearway.campaigns.checks import about_file, check_file

        found = [str(problem) for problem in check_file(Path(target), load_robot(robot))]
        passed = about_file(Path(target))
    elif os.path.isfile(target):
        raise ClearwayError("is no TOML file; into recordings looks `clearway import --list`", file=target)
    else:
        from clearway.campaigns.conformance import check_navigator
        from clearway.navigators.registry import make_navigator

        make_navigator(target)  # a navigator that can't be made is an error of its own
        findings = check_navigator(lambda: make_navigator(target), load_robot(robot))
        found = [str(ClearwayError(f.detail, field=f.name)) for f in findings if not f.passed]
        passed = [f"{f.name}: {f.detail}" if f.detail else f.name for f in findings if f.passed]
    if as_json:
        tell({"target": target, "problems": found, "passed": passed}, indent=2)
    else:
        for name in passed:
            typer.echo(f"ok       {name}")
        for problem in found[:SHOWN]:
            typer.echo(f"problem  {problem}", err=True)
        if len(found) > SHOWN:
            typer.echo(f"problem  and {len(found) - SHOWN} more; --json has them all", err=True)
        typer.echo(f"{target}: {'nothing wrong' if not found else f'{len(found)} problem(s)'}")
    raise typer.Exit(1 if found else 0)
