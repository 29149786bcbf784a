"""What a report knows of the suites that were run: what campaign.json keeps of them, and nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from clearway.scenarios.suite import Published

_PUBLISHED = {one.name for one in fields(Published)}


@dataclass(frozen=True, slots=True)
class SuiteAbout:
    """A suite among the results.

    Attributes:
        name: As it stands in the column `suite`.
        title: As it is printed.
        sections: What the report shows of it beside what it always shows: values of `clearway.scenarios.suite.Section`.
        mapped: Whether the robot was given a map anywhere in it; None if nobody says.
        disturbances: The different ones that moved the robot, fields of `DisturbanceSpec`.
        source: What it is and whom it was taken from, as a sentence; empty: nobody says.
        published: What somebody published of its batches, fields of `clearway.scenarios.suite.Published`.
    """

    name: str
    title: str
    sections: frozenset[str] = frozenset()
    mapped: bool | None = None
    disturbances: tuple[Mapping[str, Any], ...] = ()
    source: str = ""
    published: tuple[Published, ...] = ()


def suites_of(campaign: Mapping[str, Any], names: Iterable[str]) -> dict[str, SuiteAbout]:
    """The suites of these names; one of which campaign.json says nothing has its name for a title, and no sections."""
    told = campaign.get("suites")
    return {name: _about(name, told.get(name) if isinstance(told, dict) else None) for name in names}


def _about(name: str, told: Any) -> SuiteAbout:
    if not isinstance(told, dict):
        return SuiteAbout(name, f"Suite {name}")
    return SuiteAbout(
        name,
        str(told.get("title") or f"Suite {name}"),
        frozenset(map(str, told.get("report", ()))),
        told.get("map"),
        tuple(d for d in told.get("disturbances", ()) if isinstance(d, dict)),
        str(told.get("source") or ""),
        tuple(
            Published(**one) for one in told.get("published", ()) if isinstance(one, dict) and set(one) == _PUBLISHED
        ),
    )
