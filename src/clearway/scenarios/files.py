"""Scenarios and suites that a user writes as TOML files, and the JSON Schemas of everything that can be written.

A scenario's file holds the fields of `Scenario`. A suite's file holds the fields of `SuiteSpec`: scenarios of its own
under `[[scenario]]`, others by `files`, each run at every one of `speeds` and `repetitions` times.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, Field, ValidationError, field_validator, model_validator

from clearway.errors import ClearwayError
from clearway.quantities import Speed, Whole
from clearway.reading import read_toml
from clearway.reading.limits import SCENARIOS, TRIALS
from clearway.robots import Robot
from clearway.scenarios.floor_plan_files import FloorPlanSpec, is_path
from clearway.scenarios.person_tracks import with_tracks
from clearway.scenarios.scenario import RobotBodySpec, Scenario
from clearway.scenarios.suite import Section, Selection, Suite, refuse_many, scenario_seed
from clearway.validation import Table, problems

Model = TypeVar("Model", bound=BaseModel)
FAMILY = "family"
"""The table of a scenario's file with the ranges through which `clearway break` searches (`clearway.scenarios.family`)."""


class SuiteSpec(Table):
    """A suite's file."""

    name: str = Field(min_length=1, description="as it is asked for and recorded")
    title: str = Field(default="", description="as it is printed")
    description: str = Field(default="", description="what it asks, in a sentence")
    robots: tuple[str, ...] = Field(
        default=(),
        max_length=1000,
        description="who drives it unless the run says otherwise: names, presets or files seen from here",
    )
    family: str = Field(default="own", description="what it shares with other suites, such as search-and-rescue")
    report: tuple[Section, ...] = Field(
        default=(Section.MANOEUVRING_SPACE,), description="what the report shows beside what it always shows"
    )
    repetitions: Whole = Field(
        default=1, ge=1, le=TRIALS, description="how often each test is run, with another seed each time"
    )
    speeds: tuple[Speed, ...] = Field(
        default=(),
        max_length=1000,
        description="set speeds at which each test is run, m/s; default: each scenario's own",
    )
    files: tuple[str, ...] = Field(
        default=(), max_length=SCENARIOS, description="files of scenarios, seen from this file's folder"
    )
    scenario: tuple[Scenario, ...] = Field(default=(), max_length=SCENARIOS, description="scenarios in place")

    @field_validator("speeds")
    @classmethod
    def _once(cls, speeds: tuple[float, ...]) -> tuple[float, ...]:
        names = [f"{speed:g}" for speed in speeds]  # as tests are called by them
        if twice := [name for name in names if names.count(name) > 1]:
            raise ValueError(f"{twice[0]} m/s stands twice, and would make two tests of one name")
        return speeds

    @model_validator(mode="after")
    def _not_empty(self) -> SuiteSpec:
        if not self.files and not self.scenario:
            raise ValueError("a suite needs at least one scenario: under [[scenario]], or a file of one in files")
        return self


def scenario_schema() -> dict[str, Any]:
    """JSON Schema of a scenario's file."""
    schema = schema_of(Scenario)
    ranges = "what `clearway break` varies: fields, nested as in the scenario, each with [least, most]"
    return schema | {"properties": schema["properties"] | {FAMILY: {"type": "object", "description": ranges}}}


def suite_schema() -> dict[str, Any]:
    """JSON Schema of a suite's file."""
    return schema_of(SuiteSpec)


def robot_schema() -> dict[str, Any]:
    """JSON Schema of a robot's file."""
    return schema_of(Robot)


def floor_plan_schema() -> dict[str, Any]:
    """JSON Schema of a floor plan's file."""
    return schema_of(FloorPlanSpec)


def schema_of(model: type[BaseModel]) -> dict[str, Any]:
    """JSON Schema of a file that holds a `model`."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | model.model_json_schema()


def parse(model: type[Model], table: dict[str, Any], path: Path) -> tuple[Model | None, list[ClearwayError]]:
    """The table as a model, or everything that is wrong with it; files that it names by way of values are read, others are named as
    they are seen from here. Of a scenario with a `[family]` it is the scenario itself."""
    if model is Scenario and isinstance(table.get(FAMILY), dict):
        table = {key: value for key, value in table.items() if key != FAMILY}
    try:
        return _located(model.model_validate(with_tracks(table, path)), path), []
    except ClearwayError as error:
        return None, [error]
    except ValidationError as error:
        return None, problems(error, model, file=path)


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario's file; names of plans and robots in it that are files are seen from its folder.

    Raises:
        ClearwayError: it can't be read, or a field is wrong.
    """
    return _first(Scenario, Path(path))


def load_suite_file(path: str | Path) -> Suite:
    """Read a suite's file, or a scenario's as a suite of one.

    Raises:
        ClearwayError: it or a file that it names can't be read, a field is wrong, or two tests have one name.
    """
    path = Path(path)
    if kind_of(read_toml(path)) is Scenario:
        return suite_of(load_scenario(path), path.stem, path)
    return _suite(_first(SuiteSpec, path), path)


def scenarios_in(path: Path) -> list[Scenario]:
    """The scenarios of a suite's file, or that of a scenario's.

    Raises:
        ClearwayError: as for `load_suite_file`.
    """
    if kind_of(read_toml(path)) is Scenario:
        return [load_scenario(path)]
    return scenarios_of(_first(SuiteSpec, path), path)


def suite_of(scenario: Scenario, name: str, path: Path | None = None) -> Suite:
    """A suite of one scenario, which was read from `path` or was made in Python."""
    return _suite(SuiteSpec(name=name, title=scenario.name, scenario=(scenario,)), path)


def _suite(spec: SuiteSpec, file: Path | None) -> Suite:
    path = file or Path("in-python.toml")  # files that it names are seen from the current folder
    scenarios = scenarios_of(spec, path)
    configurations = dict.fromkeys(s.labels.configuration for s in scenarios)
    return Suite(
        name=spec.name,
        title=spec.title or spec.name,
        description=spec.description,
        batches=tuple(dict.fromkeys(s.labels.batch for s in scenarios)),
        configurations=tuple(configurations),
        make=_Maker(spec, tuple(scenarios)),
        family=spec.family,
        robots=tuple(_beside(r, path) if ".toml" in r else r for r in spec.robots),
        report=spec.report,
        file=None if file is None else str(file),
    )


def scenarios_of(spec: SuiteSpec, path: Path) -> list[Scenario]:
    """The scenarios of a suite, in place and in files, labelled as its own.

    Raises:
        ClearwayError: a file is wrong, or two scenarios have one name.
    """
    found: dict[str, Scenario] = {}
    for scenario in itertools.chain(spec.scenario, (load_scenario(path.parent / f) for f in spec.files)):
        if scenario.name in found:
            raise ClearwayError(f"two scenarios have the name {scenario.name!r}", file=path)
        found[scenario.name] = scenario
    return [_labelled(s, spec.name) for s in found.values()]


class _Maker:
    """Builds a user's suite: every scenario at every speed, repeated."""

    def __init__(self, spec: SuiteSpec, scenarios: tuple[Scenario, ...]) -> None:
        self._spec, self._scenarios = spec, scenarios

    def __call__(self, robot: Robot, selection: Selection, seed: int) -> Sequence[Scenario]:
        repetitions = selection.repetitions or self._spec.repetitions
        refuse_many(len(self._scenarios) * max(1, len(self._spec.speeds)) * repetitions, self._spec.name)
        made = []
        for scenario in self._scenarios:
            for speed in self._spec.speeds or (scenario.speed,):
                for repetition in range(1, repetitions + 1):
                    name = f"{scenario.name}-v{speed:g}-r{repetition}"
                    change: dict[str, Any] = {"name": name, "speed": speed, "seed": scenario_seed(seed, name)}
                    change["labels"] = scenario.labels.model_copy(update={"repetition": repetition})
                    if selection.floor_plan is not None:
                        change["floor_plan"] = selection.floor_plan
                    made.append(scenario.model_copy(update=change))
        return made


_CALLED: dict[type[BaseModel], str] = {
    Scenario: "scenario",
    SuiteSpec: "suite",
    Robot: "robot",
    FloorPlanSpec: "floor plan",
}


def kind_of(table: dict[str, Any]) -> type[BaseModel]:
    """Which kind of file has most of these keys: `Scenario`, `SuiteSpec`, `Robot` or `FloorPlanSpec`."""
    kinds: tuple[type[BaseModel], ...] = (Scenario, SuiteSpec, Robot, FloorPlanSpec)
    common = {"name", "title", "description"}
    return max(kinds, key=lambda kind: len(set(table) & (set(kind.model_fields) - common)))


def _first(model: type[Model], path: Path) -> Model:
    table = read_toml(path)
    found, wrong = parse(model, table, path)
    if found is None:
        if (kind := kind_of(table)) is not model:
            raise ClearwayError(f"is the file of a {_CALLED[kind]}, and a {_CALLED[model]} is wanted", file=path)
        raise wrong[0]
    return found


def _located(model: Any, path: Path) -> Any:
    """The scenario, or the suite with its scenarios, with the files that these name seen from the folder of their own file."""
    if isinstance(model, SuiteSpec):
        return model.model_copy(update={"scenario": tuple(_located(s, path) for s in model.scenario)})
    if not isinstance(model, Scenario):
        return model
    scenario = model
    change: dict[str, Any] = {}
    if is_path(scenario.floor_plan):
        change["floor_plan"] = _beside(scenario.floor_plan, path)
    if scenario.people:
        change["people"] = tuple(_own_code(p, "behaviour", path) for p in scenario.people)
    if scenario.robots:
        change["robots"] = tuple(
            _own_code(r, "navigator", path).model_copy(
                update={"robot": _beside(r.robot, path)} if r.robot and ".toml" in r.robot else {}
            )
            for r in scenario.robots
        )
    obstacles = tuple(
        o.model_copy(update={"shape": o.shape.model_copy(update={"robot": _beside(o.shape.robot, path)})})
        if isinstance(o.shape, RobotBodySpec) and ".toml" in o.shape.robot
        else o
        for o in scenario.obstacles
    )
    return scenario.model_copy(update=change | {"obstacles": obstacles})


def _own_code(part: Any, field: str, path: Path) -> Any:
    """The part of a scenario with the files that one of its fields names, code and a navigator's own, seen from the folder of the scenario's file."""
    named = getattr(part, field)
    if not named:
        return part
    code, colon, rest = named.partition(":") if ".py:" in named else ("", "", named)
    # `nav2[params=FILE]`, `move-base[params=FOLDER+FILE]`, `npz:FILE`: what isn't there is a preset's name, or told where it is read
    seen = re.sub(
        r"(?<=[=:+])[^=:+,\[\]]+", lambda m: _beside(m[0], path) if (path.parent / m[0]).exists() else m[0], rest
    )
    return part.model_copy(update={field: (_beside(code, path) if code else "") + colon + seen})


def _beside(name: str, path: Path) -> str:
    return name if Path(name).is_absolute() else str(path.parent / name)


def _labelled(scenario: Scenario, suite: str) -> Scenario:
    """Labels that the user left open: the suite's name, and the scenario's as its configuration."""
    labels = scenario.labels
    configuration = scenario.name if labels.configuration == "own" else labels.configuration
    return scenario.model_copy(
        update={"labels": labels.model_copy(update={"suite": suite, "configuration": configuration})}
    )
