"""What a robot's file holds for others than the robot: is it right, and is there anybody who reads it?"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from clearway.errors import ClearwayError, unknown
from clearway.navigators.registry import check_parameters, make_navigator, navigator_names
from clearway.perception import LOCALISERS, make_localiser
from clearway.perception.parameters import MappingParameters
from clearway.robots import Robot, RobotTable


def table_problems(robot: Robot) -> Iterator[ClearwayError]:
    """Everything that is wrong with the tables that navigators, localisers and the mapper read."""
    readers: list[Callable[[], object]] = [partial(MappingParameters.read, robot)]
    readers += [partial(make_localiser, name, robot) for name in robot.localisation if name in LOCALISERS]
    readers += [partial(_read_as_navigator, name, robot) for name in robot.navigators if _known(name)]
    for read in readers:
        try:
            read()
        except ClearwayError as error:
            yield error
    yield from unread_tables(robot)


def unread_tables(robot: Robot) -> Iterator[ClearwayError]:
    """The tables for navigators and localisers that there are not."""
    file = _name(robot)
    for name in robot.navigators:
        if not _known(name):
            yield unknown("navigator", name, navigator_names(), file=file, field=f"navigators.{name}")
    for name in robot.localisation:
        if name not in LOCALISERS:
            yield unknown("localisation", name, LOCALISERS, file=file, field=f"localisation.{name}")


@contextmanager
def in_file_of(which: str, robot: Robot) -> Iterator[None]:
    """Within it, what is wrong with the robot is told by its file, where `which` names one: the user wrote that."""
    try:
        yield
    except ClearwayError as error:
        if error.file != _name(robot) or ".toml" not in which:
            raise
        raise ClearwayError(error.problem, file=which, field=error.field) from error


def _read_as_navigator(name: str, robot: Robot) -> None:
    read = check_parameters(name, make_navigator(name), robot)
    if isinstance(read, RobotTable) and f"navigators.{name}" != read.TABLE:
        raise ClearwayError(
            f"nobody reads it: {name!r} reads [{read.TABLE}]", file=_name(robot), field=f"navigators.{name}"
        )


def _known(name: str) -> bool:
    """Whether a navigator is registered under it, or it is an address, to be tried when it is read."""
    return ":" in name or name in navigator_names()


def _name(robot: Robot) -> str:
    return f"robot {robot.name}"
