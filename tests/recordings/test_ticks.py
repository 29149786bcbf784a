"""What the operators ticked comes from a table of its own, and nothing of it is guessed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.recordings.small_plans import PLAN, drive, write

import clearway
from clearway.recordings.lab.checks import problems_of, summary
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.lab.test_plan import RecordedTrialSpec
from clearway.recordings.protocol.toml_text import toml
from clearway.trials import Outcome

TICKS = """Trial;Start;Touched;Person helped;Stopped;Remark
1;09:12;no;;;
2;09:14;x;;;grazed the cart
3;;;1;;
4;;;;;
"""


def plan(folder: Path, name: str = "ticks.csv", text: str = TICKS, **first: object) -> Path:
    path = folder / "plan.toml"
    test = {**PLAN["test"], "ticks": name}
    capture = {**PLAN["sources"]["capture"], "files": "captures/"}
    trials = [first, *({} for _ in range(4))]
    path.write_text(toml({**PLAN, "test": test, "sources": {"capture": capture}, "trial": trials}), encoding="utf-8")
    (folder / name).write_text(text, encoding="utf-8-sig" if name.endswith("csv") else "utf-8")
    return path


def trials(path: Path) -> tuple[RecordedTrialSpec, ...]:
    return load_test_plan(path).trials


def test_a_row_ticks_its_trial(tmp_path: Path):
    first, second, third, fourth, fifth = trials(plan(tmp_path))
    assert (first.contact, first.start, first.attempted) == (False, "09:12", True)
    assert (second.contact, second.note) == (True, "grazed the cart")
    assert (third.contact, third.intervention, third.attempted) == (None, True, True)
    assert not fourth.attempted  # a row of nothing but its number
    assert not fifth.attempted


def test_json_as_the_page_saves_it(tmp_path: Path):
    rows = [{"trial": 2, "start": "", "touched": False, "person helped": True, "remark": None}]
    second = trials(plan(tmp_path, "ticks.json", json.dumps(rows)))[1]
    assert (second.contact, second.intervention, second.attempted, second.note) == (False, True, True, "")


def test_one_that_was_not_recorded_takes_no_file_of_the_folder(tmp_path: Path):
    path = plan(tmp_path, text="trial,recorded,file\n1,no,\n3,,captures/a.csv\n")
    (tmp_path / "captures").mkdir()
    for name in "abc":
        (tmp_path / "captures" / f"{name}.csv").touch()
    assert [t.file for t in trials(path)] == ["", "captures/b.csv", "captures/a.csv", "captures/c.csv", ""]
    assert "touched or not is not ticked of 3 of them: 2, 3, 4" in summary(path)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("trial,touchd\n1,no\n", "line 2: unknown heading 'touchd'"),
        ("trial,touched\n6,no\n", "line 2: trial: '6' is no trial of the plan, which has 1 to 5"),
        ("trial,touched\n1,no\n1,yes\n", "line 3: trial 1 is in line 2, too"),
        ("trial,touched\n1,perhaps\n", "line 2: contact: 'perhaps' is neither yes"),
        ("trial,touched\n1,yes\n", "line 2: contact: is true here and false in the plan"),
        ("trial\n1,yes\n", "line 2: has 2 cells under 1 headings"),
    ],
)
def test_what_can_not_be_read_names_file_and_line(tmp_path: Path, text: str, wrong: str):
    found = problems_of(plan(tmp_path, text=text, contact=False))
    assert len(found) == 1
    assert str(found[0]).startswith(f"{tmp_path / 'ticks.csv'}: {wrong}")


def test_a_table_that_is_missing_is_told_once_something_was_recorded(tmp_path: Path):
    path = plan(tmp_path)
    (tmp_path / "ticks.csv").unlink()
    assert problems_of(path) == []
    (tmp_path / "captures").mkdir()
    (tmp_path / "captures/1.csv").touch()
    assert "test.ticks: no such file: 'ticks.csv'; save it from the page to tick on" in str(problems_of(path)[0])


def test_a_touch_that_was_ticked_is_a_collision(tmp_path: Path):
    path = plan(tmp_path)
    (tmp_path / "captures").mkdir()
    for name in ("1.csv", "2.csv"):
        write(tmp_path / "captures", name, drive())
    results = clearway.score(path, out=tmp_path / "out", workers=1)
    assert [t.outcome for t in results] == [Outcome.REACHED, Outcome.COLLISION, Outcome.ABORTED]
    assert results.trial(0).provenance["start"] == "09:12"
    assert "a person had to help" in results.trial(2).reason
