"""Teams: which robots take part in scenarios of several robots."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence

from clearway.errors import ClearwayError, shown
from clearway.reading.limits import ROBOTS
from clearway.scenarios.scenario import Scenario

LARGEST = 1 + ROBOTS
"""Robots in one scenario."""


def read_team(text: str) -> tuple[str, ...]:
    """The robots of a team that is written as `tiago*2+hosbot`, in order, each as often as it takes part.

    Raises:
        ClearwayError: it is written otherwise, is no team, or has more robots than a scenario may.
    """
    team: list[str] = []
    for part in text.split("+"):
        name, _, count = (piece.strip() for piece in part.partition("*"))
        if not name or ("*" in part and not re.fullmatch(r"[1-9][0-9]{0,8}", count)):
            raise ClearwayError(
                f"{shown(part.strip())} is no part of a team; tiago*2+hosbot are two TIAGos and a HOSBOT, and a count is at least 1",
                field="team",
            )
        if len(team) + int(count or 1) > LARGEST:
            raise ClearwayError(f"{shown(text)} has more robots than a scenario may, {LARGEST}", field="team")
        team += [name] * int(count or 1)
    return tuple(team)


def write_team(team: Sequence[str]) -> str:
    """The text that `read_team` reads as `team`."""
    alike = [(name, len(list(some))) for name, some in itertools.groupby(team)]
    return "+".join(name if count == 1 else f"{name}*{count}" for name, count in alike)


def with_team(scenarios: Sequence[Scenario], team: Sequence[str], suite: str) -> list[Scenario]:
    """Those of the scenarios that are for as many robots as the team has, with these as their tested robots.

    Args:
        scenarios: Of a suite.
        team: Names, presets or files of robots; the first drives as each scenario's own robot.
        suite: Its name.

    Raises:
        ClearwayError: there is no such scenario.
    """
    if len(team) < 2:
        raise ClearwayError(f"{write_team(team)!r} is one robot, and no team; name it by --robot", field="team")
    numbers = sorted({len(scenario.tested()) for scenario in scenarios})
    if len(team) not in numbers:
        if numbers and numbers[-1] > 1:
            listed = ", ".join(str(n) for n in numbers if n > 1)
            why = f"its scenarios of several robots are for {listed} of them"
        else:
            why = "its scenarios are for one robot each; name that by --robot"
        raise ClearwayError(
            f"{write_team(team)!r}, {len(team)} robots, cannot take part in the suite {suite!r}: {why}", field="team"
        )
    return [_driven(scenario, team) for scenario in scenarios if len(scenario.tested()) == len(team)]


def _driven(scenario: Scenario, team: Sequence[str]) -> Scenario:
    who = dict(zip(scenario.tested(), team, strict=True))
    robots = tuple(
        robot.model_copy(update={"robot": who[k]}) if k in who else robot for k, robot in enumerate(scenario.robots, 1)
    )
    return scenario.model_copy(update={"robots": robots})
