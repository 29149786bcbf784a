"""Everything that can be wrong with a user's file, looked at from every room."""

from __future__ import annotations

from pathlib import Path

from clearway.campaigns.robot_tables import table_problems
from clearway.errors import ClearwayError
from clearway.reading import read_toml
from clearway.recordings.lab.checks import problems_of, summary
from clearway.recordings.lab.test_plan import is_test_plan
from clearway.robots import Robot, load_robot
from clearway.scenarios import check
from clearway.scenarios.files import kind_of


def check_file(path: Path, robot: Robot) -> list[ClearwayError]:
    """What is wrong with a scenario, suite, robot, floor plan, test plan or map file.

    A robot's file is also read as its navigators, localisers and mapper would, with each of its presets; of a test plan
    its recordings are looked at.

    Args:
        path: The file.
        robot: Who would drive the scenarios.
    """
    if _is_plan(path):
        return problems_of(path)
    found = check.check_file(path, robot)
    if found or path.suffix != ".toml" or kind_of(read_toml(path)) is not Robot:
        return found
    told: dict[tuple[str | None, str], ClearwayError] = {}
    for preset in ("", *load_robot(str(path)).presets):
        where, before = (f"{path}:{preset}", f"presets.{preset}.") if preset else (str(path), "")
        for e in table_problems(load_robot(where)):
            told.setdefault(
                (e.field, e.problem),
                ClearwayError(e.problem, file=path, field=f"{before}{e.field or ''}".rstrip(".") or None),
            )
    return list(told.values())


def about_file(path: Path) -> list[str]:
    """What a file is about, where that is worth saying beside its problems: how far a test plan is done."""
    return summary(path) if _is_plan(path) else []


def _is_plan(path: Path) -> bool:
    try:
        return path.suffix == ".toml" and is_test_plan(read_toml(path))
    except ClearwayError:
        return False
