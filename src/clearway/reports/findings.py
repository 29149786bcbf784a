"""What a campaign found: every statistic that the report shows or saves, computed once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from clearway.errors import ClearwayError
from clearway.indicators import HEADLINE
from clearway.reports.charts import Bars
from clearway.reports.selection import Row, System, is_recorded, rows_in, system_of, systems, table_of
from clearway.reports.suites import SuiteAbout, suites_of
from clearway.robots import Robot
from clearway.scenarios.suite import Section
from clearway.statistics import (
    FEWEST,
    GROUP,
    POOLED,
    correlation_table,
    correlations_by_robot,
    describe,
    success_rates,
    wilcoxon_between_speeds,
)
from clearway.trials import Leg
from clearway.trials.store import Results

BREAKDOWN = ("T_acceleration", "T_cruise", "T_approach", "T_rotation", "T_turn")
DESCRIBED = (
    *HEADLINE, "DE_max", "OE_max", *BREAKDOWN, "DE_self", "OE_self", "MDO_walls", "space", "space_rel", "jerk", "jerk_max", "stopped_time",
    "person_distance", "social_time", "personal_time", "intimate_time", "person_speed", "person_ttc", "ttc", "people_delay",
    "people_delay_max", "people_detour",
)  # fmt: skip
UNCERTAINTIES = tuple(f"{name}_U" for name in HEADLINE)


@dataclass(frozen=True, eq=False)
class Findings:
    """The statistics of one results directory.

    Attributes:
        results: An open results directory.
    """

    results: Results

    @cached_property
    def rows(self) -> list[Row]:
        """The rows of the trials' table."""
        return rows_in(self.results.trials)

    @cached_property
    def recorded(self) -> bool:
        """Whether any of the trials was measured."""
        return any(map(is_recorded, self.rows))

    @cached_property
    def by_motion(self) -> bool:
        """Whether the legs of any recording were found by the robot's motion."""
        return any(r.get("legs_by_motion") for r in self.rows)

    def planned(self, row: Row) -> int | None:
        """The number that a measured trial has in the test plan, from 1, if it says so."""
        number = self.provenance(row).get("number") if is_recorded(row) else None
        return number if isinstance(number, int) else None

    def provenance(self, row: Row) -> Mapping[str, Any]:
        """What the trial of this row says of where it came from."""
        return self._provenance[row["trial"]]

    @cached_property
    def _provenance(self) -> dict[int, Mapping[str, Any]]:
        return {r["trial"]: self.results.trial(r["trial"]).provenance for r in self.rows if is_recorded(r)}

    @cached_property
    def suites(self) -> dict[str, SuiteAbout]:
        """The suites among the rows by name, in the campaign's order."""
        return suites_of(self.results.campaign, dict.fromkeys(r["suite"] for r in self.rows))

    def asked(self, section: Section) -> list[str]:
        """The suites that ask for this section of the report, by name."""
        return [name for name, suite in self.suites.items() if section in suite.sections]

    @cached_property
    def systems(self) -> list[System]:
        """Robots with their navigators and set-ups, in the campaign's order."""
        return systems(self.rows)

    @cached_property
    def privileged(self) -> frozenset[str]:
        """Navigators that were told the obstacles' future."""
        return frozenset(r["navigator"] for r in self.rows if r["privileged"])

    @cached_property
    def described(self) -> list[Row]:
        """Mean, spread and intervals by system, suite, batch, speed and indicator."""
        wanted = (*DESCRIBED, *UNCERTAINTIES) if self.recorded else DESCRIBED
        there = [n for n in wanted if n in self.results.trials.column_names]
        rows: list[Row] = describe(self.results.trials, there).to_pylist()
        return rows

    @cached_property
    def rates(self) -> list[Row]:
        """SR by system, suite, batch and speed."""
        rows: list[Row] = success_rates(self.results.trials).to_pylist()
        return rows

    @cached_property
    def speed_tests(self) -> Any:
        """The comparison of speeds, as an Arrow table."""
        return wilcoxon_between_speeds(self.results.trials)

    @cached_property
    def tests(self) -> list[Row]:
        """The same as dicts."""
        rows: list[Row] = self.speed_tests.to_pylist()
        return rows

    @cached_property
    def matrices(self) -> dict[tuple[str, str, str | None], Any]:
        """Correlations by (robot or `pooled`, navigator, set-up)."""
        return correlations_by_robot(self.results.trials)

    @property
    def correlated(self) -> bool:
        """Whether there are trials enough of any to correlate its indicators."""
        return any(
            c.n >= FEWEST for m in self.matrices.values() for (a, b), c in m.pairs.items() if a != b and c.r is not None
        )

    @cached_property
    def correlation_table(self) -> Any:
        """The same as an Arrow table."""
        return correlation_table(self.results.trials)

    @cached_property
    def robots(self) -> Mapping[str, Robot | None]:
        """By the name that the campaign used: as campaign.json recorded them; None of one that nobody knows."""
        recorded = self.results.campaign.get("robots")
        found: dict[str, Robot | None] = {}
        for name in dict.fromkeys(r["robot"] for r in self.rows):
            values = recorded.get(name) if isinstance(recorded, dict) else None
            found[name] = _recorded(values)
        return found

    def title(self, robot: str) -> str:
        """A robot's name for people, with its preset."""
        if robot == POOLED:
            return "Pooled"
        known = self.robots.get(robot)
        if known is None:
            return robot
        preset = robot.partition(":")[2] if not robot.endswith(".toml") else ""
        return f"{known.title} ({preset})" if preset else known.title

    def name(self, system: System) -> str:
        """A system's name for people: navigator and set-up only where there are several, a privileged one always."""
        parts = [self.title(system.robot)]
        if system.navigator in self.privileged:
            parts.append(f"{system.navigator} (privileged)")
        elif len({s.navigator for s in self.systems}) > 1:
            parts.append(system.navigator)
        if system.setup is not None and len({s.setup for s in self.systems}) > 1:
            parts.append(f"set-up {system.setup}")
        return " · ".join(parts)

    def batch(self, row: Row) -> str:
        """The batch of a row; with its suite before it where there are several suites, whose batches may have the same names."""
        return f"{row['suite']} {row['batch']}" if len(self.suites) > 1 else str(row["batch"])

    def mean(self, group: Row, indicator: str) -> Row | None:
        """The row of `described` of the same system, suite, batch and speed as the row `group`, or None."""
        return self._by_key.get((*(group[c] for c in GROUP), indicator))

    @cached_property
    def _by_key(self) -> dict[tuple[Any, ...], Row]:
        return {(*(r[c] for c in GROUP), r["indicator"]): r for r in self.described}

    @cached_property
    def goals(self) -> dict[System, list[Leg]]:
        """The legs by which a system is judged, of the first trial of each of its suites."""
        found = {}
        for system in self.systems:
            firsts = {r["suite"]: r["trial"] for r in reversed(self.of(system))}
            legs = (self.results.remains(number).attempt.legs for number in firsts.values())
            found[system] = [leg for own in legs for leg in own if leg.scored]
        return found

    @cached_property
    def tolerances(self) -> dict[tuple[System, str], float]:
        """How far a system's ends may be off, m and rad, as its tests say; none of a system whose tests differ in it."""
        return self._alike("xy_tolerance", "yaw_tolerance")

    @cached_property
    def planner_tolerances(self) -> dict[tuple[System, str], float]:
        """The same of what its planner was told, which of a real robot nobody knows."""
        return self._alike("planner_xy_tolerance", "planner_yaw_tolerance")

    def _alike(self, xy: str, yaw: str) -> dict[tuple[System, str], float]:
        found = {}
        for system, legs in self.goals.items():
            for name, tolerance in (("DE_max", xy), ("OE_max", yaw)):
                values = {getattr(leg, tolerance) for leg in legs}
                if len(values) == 1 and math.isfinite(only := values.pop()):
                    found[system, name] = only
        return found

    def bars(self, system: System) -> Bars:
        """What the bars of one system show."""
        return Bars(*(system.of(found) for found in (self.described, self.rates, self.tests)))

    def of(self, system: System) -> list[Row]:
        """The rows of a system, in order."""
        return self._by_system.get(system, [])

    @cached_property
    def _by_system(self) -> dict[System, list[Row]]:
        found: dict[System, list[Row]] = {}
        for row in self.rows:
            found.setdefault(system_of(row), []).append(row)
        return found

    def table(self, system: System) -> Any:
        """Its trials as an Arrow table."""
        if system not in self._tables:
            self._tables[system] = table_of(self.results, self.of(system))
        return self._tables[system]

    @cached_property
    def _tables(self) -> dict[System, Any]:
        return {}


def _recorded(values: Any) -> Robot | None:
    if not isinstance(values, dict):
        return None
    try:
        return Robot.model_validate(_with_infinities(values))
    except (ValueError, ClearwayError):
        return None  # recorded by another version


def _with_infinities(value: Any) -> Any:
    """JSON values, in which an infinite number is a word, as a robot's file has them."""
    if isinstance(value, dict):
        return {name: _with_infinities(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_with_infinities(one) for one in value]
    return float(value) if value in ("Infinity", "-Infinity") else value
