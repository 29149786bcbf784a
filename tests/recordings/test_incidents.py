"""Contacts and interventions: how many and when, of what operators said and of the geometry; unknown where nobody knows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.recordings.test_score_resumed import write

import clearway
from clearway.errors import ClearwayError
from clearway.recordings.lab.plan_file import load_test_plan

PLAN = """
test.ticks = "ticks.csv"
sources.capture = { format = "tum", frame.same = true }
robot = { track = "trajectory", shape = { kind = "disc", radius = 0.2 } }
bodies.box.shape = { kind = "disc", radius = 0.1 }
"""
BESIDE, AHEAD = '[{ body = "box", pose = [1.0, 1.0, 0.0] }]', '[{ body = "box", pose = [1.5, 0.0, 0.0] }]'


def scored(folder: Path, ticks: str, *obstacles: str) -> list[dict[str, Any]]:
    trials = ""
    for i, around in enumerate(obstacles, 1):
        write(folder / f"{i}.tum", 2.0)
        trials += f'[[trial]]\nfile = "{i}.tum"\nspan = [0.5, 7.9]\nobstacles = {around}\n'
    (folder / "plan.toml").write_text(PLAN + trials, encoding="utf-8")
    (folder / "ticks.csv").write_text(ticks, encoding="utf-8")
    results = clearway.score(folder / "plan.toml", out=folder / "out", workers=1)
    names = ("contacts", "first_contact", "interventions", "first_intervention", "outcome")
    rows: list[dict[str, Any]] = results.trials.select(names).to_pylist()
    results.report()
    return rows


def test_who_knows_what(tmp_path: Path):
    ticks = "trial,touched,person helped\n2,no,no\n3,x,\n4,3.5 s; 5 s,\n5,no,4.5 s\n6,,x\n"
    rows = scored(tmp_path, ticks, "[]", "[]", "[]", "[]", "[]", "[]", BESIDE, AHEAD)
    assert [tuple(r.values()) for r in rows] == [
        (None, None, None, None, "reached"),  # nobody said, and there is nothing that it could have touched
        (0, None, 0, None, "reached"),
        (1, None, None, None, "collision"),  # nobody said when
        (2, pytest.approx(3.0), None, None, "collision"),
        (0, None, 1, pytest.approx(4.0), "aborted"),
        (None, None, 1, None, "aborted"),
        (0, None, None, None, "reached"),  # by the geometry
        (None, None, None, None, "reached"),  # a possible contact, to be confirmed
    ]
    page = (tmp_path / "out/report/index.html").read_text(encoding="utf-8")
    assert "Contacts and interventions" in page


def test_times_that_are_none(tmp_path: Path):
    with pytest.raises(ClearwayError, match=r"'12 m' is neither yes .* nor when it was"):
        scored(tmp_path, "trial,touched\n1,12 m\n", "[]")
    (tmp_path / "ticks.csv").write_text("trial,touched\n1,99 s\n", encoding="utf-8")
    assert load_test_plan(tmp_path / "plan.toml").trials[0].contact_at == (99.0,)
    with pytest.raises(ClearwayError, match=r"99 s is not in the recording, 0\.5 to 7\.9 s"):
        clearway.score(tmp_path / "plan.toml", out=tmp_path / "out", workers=1)
    plan = tmp_path / "plan.toml"
    plan.write_text(
        plan.read_text().replace("[[trial]]", "[[trial]]\ncontact = false\ncontact_at = [1.0]"), encoding="utf-8"
    )
    with pytest.raises(ClearwayError, match="contact is false, and contact_at says when"):
        load_test_plan(plan)
