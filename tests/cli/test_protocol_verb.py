"""`clearway protocol`, and what `check`, `schema` and `list` know of test plans."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from command_line import Shell

FEW = ("--batch", "CE", "--speed", 0.6, "--size", 0.3, "--repetitions", 1)


def test_the_plan_is_printed(clearway: Shell):
    said = clearway("protocol", "hospital", "--robot", "tiago", *FEW)
    assert said.code == 0
    plan = tomllib.loads(said.out)
    assert [(t["speed"], t["obstacle_speed"], t["size"]) for t in plan["trial"]] == [(0.6, 0.2, 0.3), (0.6, 0.6, 0.3)]


def test_plan_and_sheet_as_files(clearway: Shell, tmp_path: Path):
    plan, sheet = tmp_path / "plan.toml", tmp_path / "sheet.html"
    said = clearway("protocol", "hospital", *FEW, "--out", plan, "--sheet", sheet)
    assert said.code == 0
    assert "2 trials" in said.out
    assert "forth: hosbot from" in sheet.read_text()
    for words in (("--out", plan), ("--sheet", sheet), ("--out", tmp_path / "other.toml", "--sheet", sheet)):
        assert "there already" in clearway.complaint("protocol", "hospital", *FEW, *words)
    assert not (tmp_path / "other.toml").exists()


def test_the_sheet_alone_goes_to_its_file_and_the_plan_to_the_pipe(clearway: Shell, tmp_path: Path):
    said = clearway("protocol", "hospital", *FEW, "--sheet", tmp_path / "sheet.html")
    assert len(tomllib.loads(said.out)["trial"]) == 2
    assert "run sheet" in said.err


def test_the_sheet_of_a_plan_that_is_there(clearway: Shell, tmp_path: Path):
    plan = tmp_path / "plan.toml"
    clearway("protocol", "hospital", *FEW, "--out", plan)
    text = plan.read_text()
    plan.write_text(text.replace('place = ""', 'place = "Hall 3"'))
    assert clearway("protocol", plan, "--sheet", tmp_path / "sheet.html").code == 0
    page = (tmp_path / "sheet.html").read_text()
    assert "Hall 3" in page
    assert "forth: hosbot from" in page
    assert "--sheet" in clearway.complaint("protocol", plan)


def test_the_page_to_tick_on(clearway: Shell, tmp_path: Path):
    plan, page = tmp_path / "plan.toml", tmp_path / "monday.html"
    assert clearway("protocol", "hospital", *FEW, "--out", plan, "--ticks", page).code == 0
    assert tomllib.loads(plan.read_text())["test"]["ticks"] == "monday.json"
    assert clearway("check", plan).code == 0
    text = page.read_text()
    assert (text.count('<li class="trial"'), "Save monday.json" in text, "forth: hosbot from" in text) == (
        2,
        True,
        True,
    )
    page.unlink()
    assert clearway("protocol", plan, "--ticks", page).code == 0
    assert page.read_text() == text
    assert "there already" in clearway.complaint("protocol", plan, "--ticks", page)


def test_what_is_unknown(clearway: Shell):
    assert "did you mean 'hospital'" in clearway.complaint("protocol", "hopsital")
    assert "known: 0.2, 0.6, 1" in clearway.complaint("protocol", "hospital", "--speed", 0.5)


def test_check_knows_test_plans(clearway: Shell, tmp_path: Path):
    plan = tmp_path / "plan.toml"
    clearway("protocol", "hospital", *FEW, "--out", plan)
    said = clearway("check", plan)
    assert said.code == 0
    assert "2 trials, 0 of them recorded" in said.out
    plan.write_text(plan.read_text().replace('file = ""', 'file = "a.csv"', 1))
    said = clearway("check", plan, "--json")
    assert said.code == 1
    problems = json.loads(said.out)["problems"]
    assert any("trial no. 1: file: no such file: 'a.csv'" in p for p in problems)
    assert any("survey.csv" in p for p in problems)


def test_schema_knows_test_plans(clearway: Shell, tmp_path: Path):
    import jsonschema

    schema = json.loads(clearway("schema", "test-plan").out)
    plan = tomllib.loads(clearway("protocol", "hospital", *FEW).out)
    jsonschema.validate(plan, schema)
    plan["trial"][0]["spede"] = 0.2
    errors = list(jsonschema.Draft202012Validator(schema).iter_errors(plan))
    assert len(errors) == 1
    assert json.loads(clearway("schema", "table").out)["properties"]


def test_a_recording_is_nothing_to_check(clearway: Shell, tmp_path: Path):
    file = tmp_path / "good.csv"
    file.write_text("t,x,y\n0,1,2\n")
    said = clearway.complaint("check", file)
    assert "is no TOML file" in said
    assert "import --list" in said
