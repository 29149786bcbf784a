"""A test plan that says how its files are named, or where they lie, needs no name typed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.recordings.small_plans import PLAN, drive, write

import clearway
from clearway.errors import ClearwayError
from clearway.recordings.lab.captures import file_names, nobodys
from clearway.recordings.lab.checks import problems_of, summary
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.protocol.run_sheet import sheet_of
from clearway.recordings.protocol.toml_text import toml

SPEEDS = (0.5, 0.8)


def plan(folder: Path, files: str, **log: object) -> Path:
    """Two configurations (speeds) with two repetitions each, none with a file of its own."""
    trials = [{"configuration": "own", "speed": v, "repetition": r} for v in SPEEDS for r in (1, 2)]
    capture = {**PLAN["sources"]["capture"], "files": files}
    path = folder / "plan.toml"
    path.write_text(toml({**PLAN, "sources": {"capture": capture, **log}, "trial": trials}), encoding="utf-8")
    return path


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).touch()


def files(path: Path) -> list[str]:
    return [t.file for t in load_test_plan(path).trials]


def test_a_trial_s_file_is_named_by_what_it_is(tmp_path: Path):
    path = plan(tmp_path, "captures/v{speed:.1f}_{repetition}.csv")
    touch(tmp_path, "captures/v0.8_1.csv", "captures/v0.5_2.csv", "captures/v0.8_3.csv")
    assert files(path) == ["", "captures/v0.5_2.csv", "captures/v0.8_1.csv", ""]
    assert [t.attempted for t in load_test_plan(path).trials] == [False, True, True, False]
    assert summary(path) == [
        "4 trials, 2 of them recorded", "2 not yet done", "1 files are no trial's: captures/v0.8_3.csv"
    ]  # fmt: skip
    assert file_names(load_test_plan(path))[0] == "captures/v0.5_1.csv"
    assert "captures/v0.8_2.csv" in sheet_of(load_test_plan(path))


def test_a_name_may_end_in_what_the_system_adds(tmp_path: Path):
    path = plan(tmp_path, "captures/take {number:02d} *.csv")
    touch(tmp_path, "captures/take 02 2026-05-06.csv")
    assert files(path) == ["", "captures/take 02 2026-05-06.csv", "", ""]
    touch(tmp_path, "captures/take 02 2026-05-07.csv")
    assert "both are trial no. 2's" in str(problems_of(path)[0])


@pytest.mark.parametrize("pattern", ["captures/", "captures", "captures/*.csv"])
def test_files_of_a_folder_go_to_the_trials_in_the_order_of_the_sheet(tmp_path: Path, pattern: str):
    path = plan(tmp_path, pattern)
    touch(
        tmp_path,
        "captures/t2.csv",
        "captures/t10.csv",
        "captures/t10.toml",
        "captures/.t1.csv",
        "captures/straight.csv",
    )
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('track = "robot"', 'track = "robot"\nstraight = {file = "captures/straight.csv"}'))
    assert files(path) == ["captures/t2.csv", "captures/t10.csv", "", ""]
    text = path.read_text(encoding="utf-8").split("[[trial]]")
    text[1] += "recorded = false\n"
    text[3] += 'file = "captures/t10.csv"\n'
    path.write_text("[[trial]]".join(text), encoding="utf-8")
    assert files(path) == ["", "captures/t2.csv", "captures/t10.csv", ""]
    assert [t.attempted for t in load_test_plan(path).trials] == [True, True, True, False]


def test_a_trial_waits_for_the_file_of_another_source_that_measures_something_in_it(tmp_path: Path):
    path = plan(tmp_path, "{number}.csv", log={"files": "{number}.mcap", "frame": {"same": True}})
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("repetition = 1", 'repetition = 1\nobstacles = [{ body = "cart" }]'), encoding="utf-8")
    touch(tmp_path, "1.csv", "2.csv", "2.mcap", "3.mcap")
    assert files(path) == ["1.csv", "2.csv", "", ""]
    path.write_text(path.read_text().replace('track = "cart"', 'track = "cart"\nsource = "log"'), encoding="utf-8")
    assert files(path) == ["", "2.csv", "", ""]
    touch(tmp_path, "1.mcap")
    assert load_test_plan(path).files_of(load_test_plan(path).trials[0]) == {"capture": "1.csv", "log": "1.mcap"}


def test_files_still_written_are_not_there(tmp_path: Path):
    path = plan(tmp_path, "{number}.csv")
    touch(tmp_path, "1.csv", "2.csv")
    assert [t.file for t in load_test_plan(path, {tmp_path / "2.csv"}).trials] == ["1.csv", "", "", ""]


@pytest.mark.parametrize(
    ("pattern", "wrong"),
    [
        ("captures/{repetition}.csv", "gives trials no. 1 and no. 3 the same file"),
        ("captures/{repetitoin}.csv", "did you mean 'repetition'"),
        ("captures/{number.csv", "is no pattern"),
        ("captures/{configuration:02d}.csv", "can't be written as '02d'"),
    ],
)
def test_a_pattern_that_can_not_be(tmp_path: Path, pattern: str, wrong: str):
    found = problems_of(plan(tmp_path, pattern))
    assert len(found) == 1
    assert found[0].field == "sources.capture.files"
    assert wrong in str(found[0])
    with pytest.raises(ClearwayError, match=r"sources\.capture\.files"):
        load_test_plan(tmp_path / "plan.toml")


def test_the_same_figures_as_with_names_that_were_typed(tmp_path: Path):
    path = plan(tmp_path, "{number}.csv")
    write(tmp_path, "1.csv", drive(speed=0.5))
    write(tmp_path, "3.csv", drive(speed=0.8))
    by_pattern = clearway.score(path, out=tmp_path / "a", workers=1)
    assert nobodys(load_test_plan(path), tmp_path) == []
    typed = path.read_text(encoding="utf-8").replace('files = "{number}.csv"\n', "").split("[[trial]]")
    for number, name in enumerate(("1.csv", "", "3.csv", ""), 1):
        typed[number] += f'file = "{name}"\nattempted = false\n'
    path.write_text("[[trial]]".join(typed), encoding="utf-8")
    by_name = clearway.score(path, out=tmp_path / "b", workers=1)
    assert len(by_name) == 2
    assert by_pattern.trials.equals(by_name.trials)
    assert json.loads((tmp_path / "a" / "campaign.json").read_text())["not_attempted"] == 2
