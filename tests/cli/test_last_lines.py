"""What a run ends with: reasons in words, numbers for machines, and how to go on when the page was not written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Shell

from clearway.api import Results

OWN = f"{Path(__file__).parents[1] / 'campaigns' / 'own_navigators.py'}:Drives"
SHORT = """
name = "short"
floor_plan = "hall"
start = [-1.0, 0.0, 0.0]
speed = 0.5
localisation = "truth"
[[legs]]
name = "forth"
goal = [1.0, 0.0, 0.0]
time_limit = 4.1
"""


@pytest.fixture
def words(tmp_path: Path) -> list[object]:
    file = tmp_path / "short.toml"
    file.write_text(SHORT)
    return ["run", file, "--robot", "tiago", "-n", OWN, "--workers", "0", "--out", tmp_path / "out"]


def test_reasons_are_printed(clearway: Shell, words: list[object]) -> None:
    said = clearway(*words, "--no-report")
    assert "1 of 1 trials failed; most of them because the robot" in said.out
    assert "1 x ran out of time, as in trial 0" in said.out


def test_machines_get_success_intervals_and_reasons(clearway: Shell, words: list[object]) -> None:
    told = json.loads(clearway(*words, "--no-report", "--json").out)
    (row,) = told["summary"]
    assert (row["n"], row["SR"], row["SR_low"]) == (1, 0.0, 0.0)
    assert row["SR_high"] == pytest.approx(97.5)
    assert [(r["words"], r["count"], r["trial"]) for r in told["reasons"]] == [("ran out of time", 1, 0)]


def test_ctrl_c_while_the_page_is_written(
    clearway: Shell, words: list[object], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def stopped(self: Results, *_: object) -> Path:
        raise KeyboardInterrupt

    monkeypatch.setattr(Results, "report", stopped)
    said = clearway(*words)
    assert said.code == 130
    assert f"the results are whole, and `clearway report {tmp_path / 'out'}` writes their page" in said.err
