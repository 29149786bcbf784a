"""Makes a break smaller for as long as it stays one: fewer goals and bodies, fewer numbers that differ from the scenario that it came
of, rounder numbers. As Hypothesis shrinks what fails, each step keeps what it was to show."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from clearway.errors import ClearwayError
from clearway.scenarios.family import Family, Variable, put, resolved, scenario_from, table_of
from clearway.scenarios.scenario import Scenario
from clearway.searching.candidates import Bench, Tried
from clearway.searching.search import Attempted

_DIGITS = (0, 1, 2, 3)
Table = dict[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class Shrunk:
    """A break that got smaller.

    Attributes:
        scenario: What breaks.
        tried: How.
        changed: What still differs from the family's own scenario: name, value there, value here.
        dropped: Who was left out.
        trials: How many trials it took.
    """

    scenario: Scenario
    tried: Tried
    changed: tuple[tuple[str, float, float], ...]
    dropped: tuple[str, ...]
    trials: int


class _Shrinker:
    def __init__(self, bench: Bench, broken: Attempted, batch: int, most: int) -> None:
        self._bench, self._batch, self._left = bench, batch, most
        self._base, self.family = broken.candidate.base, bench.families[broken.candidate.base]
        self.table, self.tried = table_of(broken.scenario), broken.tried
        self.trials = 0

    def first(self, tables: Iterator[Table] | Sequence[Table]) -> bool:
        """Take the first of these that breaks alike over; whether there is one."""
        waiting = iter(tables)
        while self._left > 0:
            made: list[tuple[Table, Scenario]] = []
            for table in waiting:
                if (scenario := self._scenario(table)) is not None:
                    made.append((table, scenario))
                if len(made) == min(self._batch, self._left):
                    break
            if not made:
                return False
            found = self._bench.run([(self._base, scenario) for _, scenario in made])
            self.trials, self._left = self.trials + len(made), self._left - len(made)
            for (table, _), tried in zip(made, found, strict=True):
                if tried.broken and (tried.outcome, tried.party) == (self.tried.outcome, self.tried.party):
                    self.table, self.tried = table, tried
                    return True
        return False

    def _scenario(self, table: Table) -> Scenario | None:
        try:
            return self._bench.valid(scenario_from(table))
        except ClearwayError:
            return None

    @property
    def scenario(self) -> Scenario:
        made = self._scenario(self.table)
        assert made is not None
        return made

    def changed(self) -> list[tuple[Variable, tuple[str | int, ...], float]]:
        """What differs from the family's own scenario: the variable, its path here, its value here."""
        found = []
        for variable in self.family.variables:
            try:
                path, _, value = resolved(scenario_from(self.table), _keys(self.family.base, variable))
            except ClearwayError:  # it was left out
                continue
            if value != variable.nominal:
                found.append((variable, path, value))
        return found

    def with_values(self, values: Sequence[tuple[tuple[str | int, ...], float]]) -> Table:
        """The table with these values at these paths."""
        made = copy.deepcopy(self.table)
        for path, value in values:
            put(made, path, value)
        return made

    def reset(self, group: Sequence[tuple[Variable, tuple[str | int, ...], float]]) -> None:
        """Put back as many of these as can be: all, else each half."""
        if not group or self.first([self.with_values([(path, variable.nominal) for variable, path, _ in group])]):
            return
        if len(group) > 1:
            middle = len(group) // 2
            self.reset(group[:middle])
            self.reset(group[middle:])


def _keys(base: Scenario, variable: Variable) -> list[str | int]:
    """The variable's path with parts by their names, which hold when others are left out."""
    at: Any = base
    keys: list[str | int] = []
    for step in variable.path:
        at = getattr(at, str(step)) if isinstance(step, str) else at[step]
        keys.append(getattr(at, "name", step) if isinstance(step, int) else step)
    return keys


def shrunk(bench: Bench, broken: Attempted, batch: int, most: int) -> Shrunk:
    """The break made smaller.

    Args:
        bench: Where trials run.
        broken: It.
        batch: How many trials can run at once.
        most: How many there may be.
    """
    s = _Shrinker(bench, broken, batch, most)
    while s.first(_fewer_legs(s.table, s.tried.leg)):
        pass
    everybody = _bodies(s.table)
    touched = s.tried.party.rpartition(" (")[0]
    s.first([t for t in (_without(s.table, {n for n in everybody if n != touched}),) if len(everybody) > 1])
    for name in everybody:
        if name in _bodies(s.table):
            s.first([_without(s.table, {name})])
    while s.first(_fewer_runs(s.table)):
        pass
    for key in ("disturbance", "latency"):
        if key in s.table:
            s.first([{k: v for k, v in s.table.items() if k != key}])
    s.reset(s.changed())
    for digits in reversed(_DIGITS):  # all at once first
        if not s.first([s.with_values([(path, round(v, digits)) for _, path, v in s.changed()])]):
            break
    for variable, path, value in s.changed():
        rounder = [round(value, d) for d in _DIGITS if round(value, d) != value]
        s.first([s.with_values([(path, r)]) for r in rounder if r != variable.nominal])
    s.first([_rounded(s.table, digits) for digits in (2, 3) if _rounded(s.table, digits) != s.table])
    changed = tuple((v.name, v.nominal, value) for v, _, value in s.changed())
    dropped = tuple(n for n in _bodies(s.family.table) if n not in _bodies(s.table))
    return Shrunk(s.scenario, s.tried, changed, dropped, s.trials)


def unshrunk(broken: Attempted, family: Family) -> Shrunk:
    """The break as it was found."""
    values = family.values(broken.candidate.point)
    changed = tuple((v.name, v.nominal, x) for v, x in zip(family.variables, values, strict=True) if x != v.nominal)
    return Shrunk(broken.scenario, broken.tried, changed, (), 0)


_WHO = ("obstacles", "people", "robots")


def _bodies(table: Table) -> list[str]:
    return [item["name"] for key in _WHO for item in table.get(key, ())]


def _without(table: Table, names: set[str]) -> Table:
    rest = {key: [i for i in table[key] if i["name"] not in names] for key in _WHO if key in table}
    return {k: v for k, v in table.items() if k not in _WHO} | {k: v for k, v in rest.items() if v}


def _fewer_legs(table: Table, broke_on: str) -> Iterator[Table]:
    """Without the legs behind that on which it broke, then without the first one, which begins where that one ended."""
    legs = table["legs"]
    at = next((i for i, leg in enumerate(legs) if leg["name"] == broke_on), len(legs) - 1)
    if at + 1 < len(legs):
        yield _with_legs(table, legs[: at + 1])
    if at > 0:
        yield _with_legs(table, legs[at : at + 1]) | {"start": legs[at - 1]["goal"]}
        yield _with_legs(table, legs[1:]) | {"start": legs[0]["goal"]}


def _with_legs(table: Table, legs: Sequence[Table]) -> Table:
    names = {leg["name"] for leg in legs}
    made = copy.deepcopy(table) | {"legs": list(legs)}
    for obstacle in made.get("obstacles", ()):
        if "runs" in obstacle:
            obstacle["runs"] = [run for run in obstacle["runs"] if run["leg"] in names]
    gone = {o["name"] for o in made.get("obstacles", ()) if "runs" in o and not o["runs"]}
    return _without(made, gone)


def _fewer_runs(table: Table) -> Iterator[Table]:
    for i, obstacle in enumerate(table.get("obstacles", ())):
        for j in range(len(obstacle.get("runs", ())) if len(obstacle.get("runs", ())) > 1 else 0):
            made = copy.deepcopy(table)
            del made["obstacles"][i]["runs"][j]
            yield made


def _rounded(value: Any, digits: int) -> Any:
    if isinstance(value, dict):
        return {k: _rounded(v, digits) for k, v in value.items()}
    if isinstance(value, list):
        return [_rounded(v, digits) for v in value]
    return round(value, digits) if isinstance(value, float) else value
