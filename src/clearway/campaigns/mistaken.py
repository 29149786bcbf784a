"""A file of one kind where one of another kind is wanted: said at once, instead of which of its keys is unknown."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from clearway.errors import ClearwayError
from clearway.reading import read_toml
from clearway.recordings.lab.test_plan import is_test_plan
from clearway.robots import Robot
from clearway.scenarios.files import SuiteSpec
from clearway.scenarios.floor_plan_files import FloorPlanSpec
from clearway.scenarios.scenario import Scenario
from clearway.statistics.criteria import is_criteria

Kind = Literal["robot", "suite", "scenario", "floor plan", "test plan", "list of criteria"]

_KEYS: dict[Kind, frozenset[str]] = {
    "robot": frozenset(Robot.model_fields),
    "suite": frozenset(SuiteSpec.model_fields),
    "scenario": frozenset(Scenario.model_fields),
    "floor plan": frozenset(FloorPlanSpec.model_fields),
}
_USE: dict[Kind, str] = {
    "robot": "name it with --robot",
    "suite": "`clearway run` runs it",
    "scenario": "`clearway run` runs it",
    "floor plan": "name it with --floor-plan",
    "test plan": "`clearway score` scores it",
    "list of criteria": "`clearway accept` holds results against it",
}


_MAPS = frozenset({".yaml", ".yml", ".pgm", ".png"})


def refuse_mistaken(which: str | Path, *wanted: Kind) -> None:
    """Nothing, unless a TOML file is plainly of another kind than one of those that are wanted, or a map is named for one.

    Args:
        which: A file, with a preset behind it or not; whatever else is no TOML file is let pass.
        wanted: What it may be.

    Raises:
        ClearwayError: it is of another kind, or can't be read.
    """
    if Path(which).suffix in _MAPS:
        raise ClearwayError(
            f"is no file of a {wanted[0]}, which is TOML; a map is named in a scenario, or with --floor-plan or --map",
            file=which,
        )
    if ".toml" not in str(which):
        return
    file = Path(str(which).partition(".toml:")[0])
    file = file if file.suffix == ".toml" else file.with_name(f"{file.name}.toml")
    if not file.is_file():
        return
    found = _kind(read_toml(file), wanted)
    if found is not None and found not in wanted:
        raise ClearwayError(f"is the file of a {found}, and a {wanted[0]} is wanted; {_USE[found]}", file=file)


def _kind(table: dict[str, Any], wanted: tuple[Kind, ...]) -> Kind | None:
    """What a file plainly is: it has three keys or more of that kind, and more than of what is wanted."""
    if is_test_plan(table):
        return "test plan"
    if is_criteria(table):
        return "list of criteria"
    shared = {kind: len(keys & set(table) - {"name", "title", "description"}) for kind, keys in _KEYS.items()}
    best = max(shared, key=lambda kind: shared[kind])
    return best if shared[best] > max(2, *(shared.get(kind, 0) for kind in wanted)) else None
