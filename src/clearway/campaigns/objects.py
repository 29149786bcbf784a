"""Names for what a Python program hands over: addresses where any process finds it, else names of objects (`clearway.given`)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import PurePath
from typing import Any

from clearway.errors import ClearwayError, shown
from clearway.given import address_of, give
from clearway.robots import Robot, load_robot, robot_names
from clearway.scenarios.files import suite_of
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Suite
from clearway.scenarios.teams import read_team


def names_of(values: Any, field: str) -> tuple[str, ...]:
    """The names of suites, robots or navigators, each given by its name or as an object; a lone one is a list of one.

    Args:
        values: Names, and navigators (classes, or functions that make one), `Robot`s, `Scenario`s or `Suite`s.
        field: What they are: `suites`, `robots` or `navigators`.

    Raises:
        ClearwayError: one of them is nothing of that.
    """
    name = {"suites": suite_name, "robots": robot_name, "navigators": navigator_name}[field]
    lone = isinstance(values, str | Robot | Scenario | Suite) or not isinstance(values, Iterable)
    return tuple(name(value) for value in ((values,) if lone else values))


def team_of(given: Any) -> tuple[str, ...]:
    """The names of a team's robots, in order; it may be written as one text, `tiago*2+hosbot`, or be robots one by one.

    Raises:
        ClearwayError: it is none.
    """
    if isinstance(given, str) and given:
        return read_team(given)
    try:
        return names_of(given or (), "robots")
    except ClearwayError as error:
        raise ClearwayError(error.problem, field="team") from error


def suite_name(value: Any) -> str:
    """The name of a suite, which may be given as a `Suite`, as one `Scenario` or by the path of a file."""
    if isinstance(value, Scenario):
        return give(value.name, suite_of(value, value.name))
    if isinstance(value, PurePath):
        return str(value)
    return give(value.name, value) if isinstance(value, Suite) else _text(value, "suites", "a Scenario or a Suite")


def robot_name(value: Any) -> str:
    """The name of a robot, which may be given as a `Robot`."""
    if not isinstance(value, Robot):
        return _text(value, "robots", "a Robot")
    if value.name in robot_names():
        if load_robot(value.name) == value:
            return value.name
        raise ClearwayError(
            f"a robot that is not the {value.name!r} that comes with Clearway has its name; give it a name of its own",
            field="robots",
        )
    return give(value.name, value)


def navigator_name(value: Any) -> str:
    """The name of a navigator, which may be given as its class, or as a function that makes one."""
    if isinstance(value, str):
        return value
    if not callable(value) or not hasattr(value, "__qualname__"):
        raise ClearwayError(
            f"{shown(value)} is neither a name nor a navigator's class; give the class, of which each trial makes its own",
            field="navigators",
        )
    return address_of(value) or give(value.__qualname__, value)


def _text(value: Any, field: str, other: str) -> str:
    if not isinstance(value, str):
        raise ClearwayError(f"{shown(value)} is neither a name nor {other}", field=field)
    return value
