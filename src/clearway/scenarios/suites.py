"""Finds suites: by name, as other packages register theirs under the entry-point group `clearway.suites`, by address, and
from files; and the floor plans that they bring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from clearway.errors import ClearwayError, unknown
from clearway.registry import Registry
from clearway.scenarios.plan import FloorPlan
from clearway.scenarios.suite import Selection, Suite, scenario_seed

__all__ = ["Selection", "Suite", "load_suite", "own_floor_plans", "scenario_seed", "suite_names"]

SUITES = Registry(
    "suite",
    "clearway.suites",
    {
        "barn": "clearway.scenarios.barn:BARN",
        "barn-2022": "clearway.scenarios.barn:BARN_2022",
        "crowd": "clearway.scenarios.crowdnav:CROWD",
        "crowd-held-out": "clearway.scenarios.crowdnav:HELD_OUT",
        "dynabarn": "clearway.scenarios.dynabarn:DYNABARN",
        "dynabarn-held-out": "clearway.scenarios.dynabarn:HELD_OUT_DYNABARN",
        "hospital": "clearway.scenarios.hospital:HOSPITAL",
        "hospital-blind": "clearway.scenarios.hospital:BLIND",
        "hospital-held-out": "clearway.scenarios.hospital:HELD_OUT",
        "hospital-held-out-blind": "clearway.scenarios.hospital:HELD_OUT_BLIND",
        "meeting-points": "clearway.scenarios.meeting_points:MEETING_POINTS",
        "meeting-points-held-out": "clearway.scenarios.meeting_points:HELD_OUT_MEETING_POINTS",
        "people": "clearway.scenarios.people_scenes:PEOPLE",
        "replayed": "clearway.scenarios.replayed:REPLAYED",
        "replayed-held-out": "clearway.scenarios.replayed:HELD_OUT_REPLAYED",
        "sar-case1": "clearway.scenarios.sar:CASE_1",
        "sar-case2": "clearway.scenarios.sar:CASE_2",
        "sar-case3": "clearway.scenarios.sar:CASE_3",
        "sar-confined": "clearway.scenarios.sar:CONFINED",
        "sar-misspecified": "clearway.scenarios.sar:MISSPECIFIED",
        "sar-stress": "clearway.scenarios.sar:STRESS",
        "sar-team": "clearway.scenarios.sar_team:SAR_TEAM",
        "sar-team-held-out": "clearway.scenarios.sar_team:HELD_OUT_SAR_TEAM",
        "ward-day": "clearway.scenarios.ward_day:WARD_DAY",
        "ward-day-held-out": "clearway.scenarios.ward_day:HELD_OUT_WARD_DAY",
    },
)

_BY_ADDRESS: dict[str, Suite] = {}


def suite_names() -> list[str]:
    """Names of the suites that come with Clearway and of those that other packages register.

    Raises:
        ClearwayError: two packages register different suites under one name.
    """
    return sorted(SUITES.addresses())


def with_movers(suites: Iterable[str], movers: str | None) -> tuple[str, ...]:
    """The suites whose movers are `operator` (they look, where somebody drives them) or `blind`, of those with these names.

    Raises:
        ClearwayError: `movers` is another word, or no suite has blind ones.
    """
    asked = tuple(suites)
    if movers in (None, "operator"):
        return asked
    if movers != "blind":
        raise unknown("kind of movers", str(movers), ("operator", "blind"))
    blind = tuple(f"{name}-blind" if f"{name}-blind" in suite_names() else name for name in asked)
    if not any(name.endswith("-blind") for name in blind):
        raise ClearwayError(f"no suite among {', '.join(asked)} has movers that could be blind", field="movers")
    return blind


def load_suite(which: str) -> Suite:
    """A suite by its name, by its address (`my_pkg.module:SUITE`, `path/to/file.py:SUITE`), or from a TOML file.

    A suite at an address brings its floor plans along: from now on they are found in this process.

    Raises:
        ClearwayError: no such suite, or something in its file that is wrong.
    """
    if which.endswith(".toml"):
        from clearway.scenarios.files import load_suite_file  # which reads scenarios, which name floor plans

        return load_suite_file(which)
    suite = SUITES.find(which)
    if not isinstance(suite, Suite):
        raise ClearwayError(f"{which!r} is a {type(suite).__name__}, not a suite; see clearway.scenarios.suite.Suite")
    if ":" in which:
        _BY_ADDRESS[which] = suite
    elif suite.name != which:
        raise ClearwayError(f"the suite that is registered as {which!r} calls itself {suite.name!r}; name it alike")
    return suite


def own_floor_plans() -> dict[str, Callable[[], FloorPlan]]:
    """Name -> maker of every floor plan that suites bring.

    Raises:
        ClearwayError: two suites bring different ones under one name.
    """
    found: dict[str, tuple[str, Callable[[], FloorPlan]]] = {}
    for suite in _known():
        for name, make in suite.floor_plans.items():
            first, before = found.setdefault(name, (suite.name, make))
            if before is not make:
                raise ClearwayError(f"the suites {first!r} and {suite.name!r} bring different floor plans {name!r}")
    return {name: make for name, (_, make) in found.items()}


def examples_of_floor_plans() -> list[str]:
    """The first of each suite's own floor plans: what a message names of many."""
    return sorted({next(iter(suite.floor_plans)) for suite in _known() if suite.floor_plans})


def _known() -> Iterable[Suite]:
    return [*map(load_suite, suite_names()), *_BY_ADDRESS.values()]
