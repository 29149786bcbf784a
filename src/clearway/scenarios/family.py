"""A family of scenarios: one of them, and the ranges within which numbers of it may lie. What a search goes through.

A user writes it as the table `[family]` of a scenario's file, whose keys name fields as the file itself nests them, each with
`[least, most]`; parts of a list go by their name or their number from 0, coordinates by `x`, `y`, `theta` too:

    [family]
    speed = [0.2, 1.0]
    start.y = [-0.3, 0.3]
    obstacles.nurse.runs.0.delay = [0.0, 6.0]

Of any other scenario `clearway.scenarios.perturbing` makes one.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError

from clearway.errors import ClearwayError, nearest, shown
from clearway.geometry.shapes import FloatArray
from clearway.reading import read_toml
from clearway.scenarios.files import FAMILY, load_scenario
from clearway.scenarios.scenario import Scenario
from clearway.validation import first_problem

Path_ = tuple[str | int, ...]
COORDINATES = ("x", "y", "theta")
MOST = 1000
"""How many numbers of a scenario may vary."""
_FIXED = ("seed", "labels", "optimal", "shortest", "ideal")
"""Fields of a scenario that say nothing of what happens in it, or may not be continuous."""


@dataclass(frozen=True, slots=True)
class Variable:
    """A number of a scenario that may vary.

    Attributes:
        name: The path to it, as a user writes it.
        path: The same, as keys and indices of the scenario's table.
        low: The least that it is, in the field's unit.
        high: The most.
        nominal: What it is in the scenario itself.
    """

    name: str
    path: Path_
    low: float
    high: float
    nominal: float

    def at(self, share: float) -> float:
        """The value at `share` of the way from `low` to `high`."""
        return min(max(self.low + share * (self.high - self.low), self.low), self.high)


@dataclass(frozen=True, slots=True, eq=False)
class Family:
    """A scenario with ranges.

    Attributes:
        base: The scenario.
        variables: What may vary; each is uniform in its range, independent of the others.
        table: The scenario as a file has it.
    """

    base: Scenario
    variables: tuple[Variable, ...]
    table: dict[str, Any] = field(repr=False)

    @classmethod
    def of(cls, base: Scenario, variables: Sequence[Variable]) -> Family:
        """The family of `base`; what somebody has searched of it (its optimum) holds for no other member, and is left out."""
        bare = base.model_copy(update={"optimal": None, "shortest": None})
        return cls(bare, tuple(variables), table_of(bare))

    @property
    def nominal(self) -> FloatArray:
        """Where the scenario itself lies in the unit cube; at its rim what lies outside of its range."""
        shares = [(v.nominal - v.low) / (v.high - v.low) for v in self.variables]
        return np.clip(np.array(shares, dtype=np.float64), 0.0, 1.0)

    def values(self, point: FloatArray) -> list[float]:
        """The values at a point of the unit cube, in the fields' units."""
        return [v.at(float(share)) for v, share in zip(self.variables, point, strict=True)]

    def scenario(self, values: Sequence[float]) -> Scenario:
        """The scenario with these values.

        Raises:
            ClearwayError: they make none, as where a speed is beyond what another field allows.
        """
        table = copy.deepcopy(self.table)
        for variable, value in zip(self.variables, values, strict=True):
            put(table, variable.path, float(value))
        return scenario_from(table)


def table_of(scenario: Scenario) -> dict[str, Any]:
    """The scenario as a file has it: tables, lists and plain values; what is as usual is left out."""
    made: dict[str, Any] = _listed(scenario.model_dump(exclude_defaults=True))
    return made


def scenario_from(table: Mapping[str, Any]) -> Scenario:
    """The scenario of such a table.

    Raises:
        ClearwayError: it makes none.
    """
    try:
        return Scenario.model_validate(table)
    except ValidationError as error:
        raise first_problem(error, Scenario) from error


def put(table: dict[str, Any], path: Path_, value: Any) -> None:
    """Write a value at a path of a scenario's table."""
    at: Any = table
    for step in path[:-1]:
        at = at.setdefault(step, {}) if isinstance(at, dict) else at[step]
    at[path[-1]] = value


def load_families(path: str | Path) -> list[Family]:
    """The family that a scenario's file describes; none where it has no table `[family]`.

    Raises:
        ClearwayError: the file can't be read, a field is wrong, a range is none, or a path leads nowhere.
    """
    path = Path(path)
    ranges = read_toml(path).get(FAMILY)
    return [family_of(load_scenario(path), ranges, path)] if isinstance(ranges, dict) else []


def family_of(base: Scenario, ranges: Mapping[str, Any], file: Path | None = None) -> Family:
    """The family of `base` with these ranges, nested as a file has them.

    Args:
        base: The scenario.
        ranges: Tables in tables, at whose leaves stand `[least, most]`.
        file: Where they stand, for the errors.

    Raises:
        ClearwayError: a range is none, a path leads nowhere, or nothing varies.
    """
    found: dict[Path_, Variable] = {}
    for keys, between in _leaves(ranges, ()):
        where = ".".join(map(str, (FAMILY, *keys)))
        try:
            variable = _variable(base, keys, between)
        except ClearwayError as error:
            raise ClearwayError(error.problem, file=file, field=where) from None
        if variable.path in found:
            raise ClearwayError("its range stands twice, by name and by number", file=file, field=where)
        found[variable.path] = variable
    if not 0 < len(found) <= MOST:
        problem = (
            f"{len(found)} numbers vary; 1 to {MOST} may" if found else "nothing varies; name a field and its range"
        )
        raise ClearwayError(problem, file=file, field=FAMILY)
    return Family.of(base, tuple(found.values()))


def _leaves(ranges: Mapping[str, Any], at: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    for key, value in ranges.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, (*at, key))
        else:
            yield (*at, key), value


def _variable(base: Scenario, keys: tuple[str, ...], between: Any) -> Variable:
    numbers = isinstance(between, list | tuple) and len(between) == 2
    if not numbers or not all(type(v) in (int, float) and math.isfinite(v) for v in between):
        raise ClearwayError(f"{shown(between)} is no range; [least, most] is, two numbers")
    low, high = map(float, between)
    if low >= high:
        why = "is upside down" if low > high else "leaves no room"
        raise ClearwayError(f"the range [{low:g}, {high:g}] {why}; the smaller number stands first")
    path, name, nominal = resolved(base, keys)
    if path[0] in _FIXED:
        raise ClearwayError(f"{path[0]!r} is nothing that a family could vary")
    table = table_of(base)
    for value in (low, high):
        tried = copy.deepcopy(table)
        put(tried, path, value)
        try:
            scenario_from(tried)
        except ClearwayError as error:
            if error.field == ".".join(map(str, path)):  # what hangs on other fields may be mended by these
                raise ClearwayError(f"the range [{low:g}, {high:g}] holds what cannot be: {error.problem}") from None
    return Variable(name, path, low, high, nominal)


def resolved(base: Scenario, keys: Sequence[str | int]) -> tuple[Path_, str, float]:
    """Where `keys` lead: the path with numbers of list items, the same with their names, and the number that stands there.

    Raises:
        ClearwayError: nowhere, or to what is no number.
    """
    at: Any = base
    path: list[str | int] = []
    names: list[str] = []
    for key in keys:
        step, name = _step(at, key)
        at = getattr(at, str(step)) if isinstance(at, BaseModel) else at[int(step)]
        path.append(step)
        names.append(name)
        if at is None:
            raise ClearwayError(f"{'.'.join(names)!r} is not set in the scenario; give it a value there first")
    if type(at) is not float:
        what = "is a table or a list: name a number in it" if isinstance(at, BaseModel | tuple) else f"is {shown(at)}"
        raise ClearwayError(f"{'.'.join(names)!r} {what}; a continuous number can vary")
    return tuple(path), ".".join(names), at


def _step(at: Any, key: str | int) -> tuple[str | int, str]:
    """The key or index to which `key` leads from a part of a scenario, and what it is called."""
    if isinstance(at, BaseModel):
        known = list(type(at).model_fields)
        if key in known:
            return str(key), str(key)
    elif isinstance(at, tuple) and at and isinstance(at[0], BaseModel):
        names = [getattr(item, "name", str(i)) for i, item in enumerate(at)]
        if key in names:
            return names.index(str(key)), str(key)
        if str(key).isdecimal() and int(key) < len(at):
            return int(key), names[int(key)]
        known = names
    elif isinstance(at, tuple):
        numbers = all(isinstance(v, int | float) for v in at)
        labels = list(COORDINATES[: len(at)]) if numbers and len(at) <= 3 else [str(i) for i in range(len(at))]
        if key in labels:
            return labels.index(str(key)), str(key)
        if str(key).isdecimal() and int(key) < len(at):
            return int(key), labels[int(key)]
        known = labels
    else:
        raise ClearwayError(f"there is nothing below {shown(at)}, so no {shown(key)}")
    close = nearest(str(key), known)
    hint = f"did you mean {close!r}?" if close else f"known: {', '.join(known[:30]) or 'none'}"
    raise ClearwayError(f"{shown(key)} leads nowhere; {hint}")


def _listed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _listed(inside) for key, inside in value.items()}
    return [_listed(inside) for inside in value] if isinstance(value, tuple | list) else value
