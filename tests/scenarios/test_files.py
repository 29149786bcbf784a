"""Own scenarios and suites: read from TOML, described by JSON Schemas."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from clearway.errors import ClearwayError
from clearway.recordings.protocol.toml_text import toml
from clearway.robots import load_robot, robot_names
from clearway.robots.robot import RESCUE
from clearway.scenarios.check import floor_plan_schema, load_scenario, robot_schema, scenario_schema, suite_schema
from clearway.scenarios.floor_plan_files import floor_plan_names
from clearway.scenarios.floorplan import load_floor_plan
from clearway.scenarios.suites import Selection, load_suite
from clearway.stand_ins import FILE as STAND_INS

EXAMPLES = Path(__file__).parents[2] / "examples"
SCHEMAS = {
    "scenario": scenario_schema(),
    "suite": suite_schema(),
    "robot": robot_schema(),
    "floor-plan": floor_plan_schema(),
}


def table(path: Any) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("kind", SCHEMAS)
def test_a_schema_is_one(kind: str) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMAS[kind])
    assert SCHEMAS[kind]["additionalProperties"] is False


def test_shipped_files_meet_their_schemas() -> None:
    jsonschema.validate(table(EXAMPLES / "my_corridor.toml"), SCHEMAS["scenario"])
    jsonschema.validate(table(EXAMPLES / "my_suite.toml"), SCHEMAS["suite"])
    for name in robot_names():
        rescue = name == RESCUE  # it stands among the stand-ins
        shipped = STAND_INS if rescue else resources.files("clearway.robots") / f"{name}.toml"
        jsonschema.validate(table(shipped)["robot"] if rescue else table(shipped), SCHEMAS["robot"])
    for name in floor_plan_names():
        jsonschema.validate(
            table(resources.files("clearway.scenarios") / "plans" / f"{name}.toml"), SCHEMAS["floor-plan"]
        )


def test_schemas_refuse_what_the_reader_refuses() -> None:
    good = table(EXAMPLES / "my_corridor.toml")
    for change in ({"speed": -1.0}, {"sped": 1.0}, {"legs": []}, {"start": [1.0, 2.0]}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(good | change, SCHEMAS["scenario"])


def test_every_field_of_the_schemas_is_described() -> None:
    """What a user writes is documented, apart from names and kinds that speak for themselves."""
    plain = {"name", "kind", "title", "description", "batch", "configuration", "suite", "vertices", "shape", "drive",
             "lidar", "odometry", "tolerances", "labels", "obstacles", "walls", "furniture", "beds", "beams", "pose",
             "repetition", "map"}  # fmt: skip
    missing = []
    for kind, schema in SCHEMAS.items():
        parts = {kind: schema} | schema.get("$defs", {})
        for part, definition in parts.items():
            for field, about in definition.get("properties", {}).items():
                if "description" not in about and "$ref" not in about and field not in plain:
                    missing.append(f"{part}.{field}")
    assert missing == []


def test_a_scenario_s_files_are_seen_from_its_folder(tmp_path: Path) -> None:
    (tmp_path / "plans").mkdir()
    (tmp_path / "plans" / "p.toml").write_text('name = "p"\n[[walls]]\nname = "w"\nbox = [0.0, 0.0, 1.0, 1.0]\n')
    path = tmp_path / "s.toml"
    text = (EXAMPLES / "my_corridor.toml").read_text().replace('floor_plan = "ward"', 'floor_plan = "plans/p.toml"')
    path.write_text(text.replace('{ kind = "disc", radius = 0.25 }', '{ kind = "robot", robot = "bot.toml" }'))
    scenario = load_scenario(path)
    assert load_floor_plan(scenario.floor_plan).name == "p"
    assert scenario.obstacles[1].shape.robot == str(tmp_path / "bot.toml")  # type: ignore[union-attr]


@pytest.mark.parametrize("what", ["scenario", "suite with files", "suite in place"])
def test_they_are_seen_from_its_folder_wherever_one_runs_it(
    tmp_path: Path, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a relative path, too: named once, not folder upon folder."""
    monkeypatch.chdir(tmp_path)
    own, bot = Path("own"), '{ kind = "robot", robot = "bot.toml" }'
    own.mkdir()
    text = (EXAMPLES / "my_corridor.toml").read_text().replace('"ward"', '"p.toml"')
    text = text.replace('{ kind = "disc", radius = 0.25 }', bot)
    (own / "s.toml").write_text(text)
    (own / "files.toml").write_text('name = "files"\nfiles = ["s.toml"]\n')
    table = tomllib.loads(text)
    table.pop("family", None)
    (own / "place.toml").write_text('name = "place"\n' + toml({"scenario": [table]}))
    name = {"scenario": "s.toml", "suite with files": "files.toml", "suite in place": "place.toml"}[what]
    (test,) = load_suite(f"own/{name}").build(load_robot("tiago"), Selection(), 0)
    assert test.floor_plan == "own/p.toml"
    assert test.obstacles[1].shape.robot == "own/bot.toml"  # type: ignore[union-attr]


def test_the_floor_plan_s_old_name_is_refused_with_the_new_one(tmp_path: Path) -> None:
    path = tmp_path / "old.toml"
    path.write_text((EXAMPLES / "my_corridor.toml").read_text().replace("floor_plan = ", "plan = "))
    with pytest.raises(ClearwayError, match=r"old\.toml: plan: unknown key; did you mean 'floor_plan'\?"):
        load_scenario(path)


def test_a_suite_runs_its_scenarios_at_every_speed_repeated() -> None:
    suite = load_suite(str(EXAMPLES / "my_suite.toml"))
    assert (suite.name, suite.batches) == ("my-suite", ("doorway", "own"))
    tests = suite.build(load_robot("tiago"), Selection(), 3)
    assert len(tests) == 12
    assert len({t.name for t in tests}) == len({t.seed for t in tests}) == 12
    assert {(t.labels.suite, t.speed, t.labels.repetition) for t in tests} == {
        ("my-suite", v, r) for v in (0.3, 0.6) for r in (1, 2, 3)
    }
    assert {t.labels.configuration for t in tests} == {"room 1", "trolley in the corridor"}
    some = suite.build(load_robot("tiago"), Selection(batches=("doorway",), speeds=(0.6,), repetitions=1), 3)
    assert [t.name for t in some] == ["into room 1-v0.6-r1"]
    assert some[0] in tests
    with pytest.raises(ClearwayError, match=r"unknown batch 'door'; did you mean 'doorway'\?"):
        suite.build(load_robot("tiago"), Selection(batches=("door",)), 3)


def test_a_scenario_s_file_is_a_suite_of_one() -> None:
    suite = load_suite(str(EXAMPLES / "my_corridor.toml"))
    (test,) = suite.build(load_robot("tiago"), None, 0)
    assert test.name == "trolley in the corridor-v0.6-r1"
    assert test.labels.suite == "my_corridor"


def test_a_suite_that_is_not_there() -> None:
    with pytest.raises(ClearwayError, match=r"nowhere\.toml: no such file"):
        load_suite("nowhere.toml")
