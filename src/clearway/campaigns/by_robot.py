"""Navigators by robot: `tiago=hp-st,hosbot=orca`, or `orca,tiago=hp-st` where all others have `orca`.

What begins with a scheme is one navigator: in `exec:./my_planner --weights=w.npz` the sign of equality belongs to a program.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache

from clearway.errors import ClearwayError, unknown
from clearway.navigators.registry import NAVIGATORS
from clearway.robots import load_robot

_OUTSIDE = r"(?![^\[]*\])"


def navigator_of(asked: str, robot: str) -> str:
    """Who drives `robot` (a name, a preset or a file) where the navigator `asked` is run.

    Raises:
        ClearwayError: it is said by robot, and nothing is said of this one.
    """
    parts = _parts(asked)
    if parts is None:
        return asked
    name = load_robot(robot).name
    for key in (robot, name, name.partition(":")[0], ""):
        if key in parts:
            return parts[key]
    raise ClearwayError(
        f"{asked!r} does not say who drives the robot {robot!r}; write {robot}=NAVIGATOR, or a NAVIGATOR for all others",
        field="navigators",
    )


def is_by_robot(asked: str) -> bool:
    """Whether a navigator is said by robot."""
    return _parts(asked) is not None


def refuse_strangers(asked: str, robots: Iterable[str]) -> None:
    """Complain of a robot that is given a navigator and does not take part.

    Raises:
        ClearwayError: there is one.
    """
    taking_part = dict.fromkeys(robots)
    names = [load_robot(robot).name for robot in taking_part]
    known = {*taking_part, *names, *(name.partition(":")[0] for name in names)}
    for robot in _parts(asked) or {}:
        if robot and robot not in known:
            raise unknown("robot", robot, known, field=f"navigator {asked!r}")


@cache
def _parts(asked: str) -> dict[str, str] | None:
    """Robot -> navigator, that of all others under the empty name; None: the same one drives all."""
    if NAVIGATORS.scheme_of(asked) is not None or not re.search("=" + _OUTSIDE, asked):
        return None
    found: dict[str, str] = {}
    for part in re.split("," + _OUTSIDE, asked):
        pieces = re.split("=" + _OUTSIDE, part, maxsplit=1)
        robot, navigator = ("", *pieces) if len(pieces) == 1 else pieces
        robot, navigator = robot.strip(), navigator.strip()
        if not navigator or (len(pieces) == 2 and not robot):
            raise ClearwayError(
                f"{part!r} is no part of navigators by robot; tiago=hp-st,hosbot=orca are", field="navigators"
            )
        if robot in found:
            raise ClearwayError(f"{asked!r} says twice who drives {robot or 'all others'!r}", field="navigators")
        found[robot] = navigator
    return found
