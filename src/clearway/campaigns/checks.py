"""Everything that can be wrong with a user's file, looked at from every room."""

from __future__ import annotations

from pathlib import Path

from clearway.errors import ClearwayError
from clearway.navigators.move_base.parameters import parameters_of
from clearway.perception import make_localiser
from clearway.perception.parameters import mapping_parameters
from clearway.recordings.lab.checks import problems_of, summary
from clearway.recordings.lab.test_plan import is_test_plan
from clearway.robots import Robot, load_robot
from clearway.scenarios import check
from clearway.scenarios.files import kind_of, read_toml


def check_file(path: Path, robot: Robot) -> list[ClearwayError]:
    """What is wrong with a scenario, suite, robot, floor plan, test plan or map file; `robot` would drive the scenarios.

    A robot's file is also read as its navigator, localiser and mapper would; of a test plan its recordings are looked at.
    """
    if _is_plan(path):
        return problems_of(path)
    found = check.check_file(path, robot)
    if found or path.suffix != ".toml" or kind_of(read_toml(path)) is not Robot:
        return found
    own = load_robot(str(path))
    readers = (
        parameters_of,
        lambda r: make_localiser("amcl", r) if r.lidar else None,
        mapping_parameters,
    )
    for read in readers:
        try:
            read(own)
        except ClearwayError as error:
            found.append(ClearwayError(error.problem, file=path, field=error.field))
    return found


def about_file(path: Path) -> list[str]:
    """What a file is about, where that is worth saying beside its problems: how far a test plan is done."""
    return summary(path) if _is_plan(path) else []


def _is_plan(path: Path) -> bool:
    try:
        return path.suffix == ".toml" and is_test_plan(read_toml(path))
    except ClearwayError:
        return False
