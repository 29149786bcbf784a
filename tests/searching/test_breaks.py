"""A whole search: found, shrunk, written, and run again from its file."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import clearway
from clearway.errors import ClearwayError
from clearway.reading import read_toml
from clearway.reports.page import first_screen
from clearway.searching.failures import failure_named

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_family.toml"
DRIVEN = {"robot": "rescue", "navigator": "colregs-apf", "workers": 0}
NARROW = """
[family]
start.y = [6.9, 7.1]
obstacles.cart.runs.0.speed = [0.9, 1.1]
obstacles.cart.runs.0.delay = [4.0, 6.0]
obstacles.trolley.runs.0.delay = [11.0, 13.0]
"""


@pytest.fixture
def family(tmp_path: Path) -> Path:
    file = tmp_path / "narrow.toml"
    file.write_text(EXAMPLE.read_text().partition("\n[family]")[0] + NARROW)
    return file


@pytest.mark.slow
def test_a_break_is_found_shrunk_written_and_replayed(family, tmp_path):
    found = clearway.find_breaks(family, **DRIVEN, trials=30, breaks=1, out=tmp_path / "out")
    (one,) = found.breaks
    assert 1 <= found.first <= one.at <= found.trials <= 30
    scenario = read_toml(one.file)
    assert [o["name"] for o in scenario["obstacles"]] == ["cart"]
    assert one.shrunk.dropped == ("trolley", "crate")
    changed = {name: value for name, _, value in one.shrunk.changed}
    assert set(changed) <= {"start.y", "obstacles.cart.runs.0.speed", "obstacles.cart.runs.0.delay"}
    assert all(round(value, 2) == value for value in changed.values())
    assert "touches cart (moving obstacle) while driving at" in one.sentence
    assert one.file.read_text().startswith(f"# {one.sentence}\n# Again:  clearway run ")
    with (tmp_path / "out" / "search.csv").open() as opened:
        rows = list(csv.DictReader(opened))
    assert [float(r["margin"]) > 0 for r in rows].index(False) == found.first - 1
    assert float(rows[one.at - 1]["margin"]) <= 0
    again = clearway.run(one.file, robots=["rescue"], navigators=["colregs-apf"], workers=0, out=tmp_path / "again")
    stored = clearway.open_results(found.results.path)
    for results in (again, stored):
        trial = results.trial(0)
        assert results.trials["failure"].to_pylist() == ["collision"]
        assert trial.t[-1] == one.shrunk.tried.t
        assert tuple(trial.pose[-1, :2]) == one.shrunk.tried.place
    begins = first_screen(stored)
    assert (begins["breaks"], begins["verdicts"]) == (((0, one.sentence),), ())
    assert begins["said"].result.startswith(
        f"1 different break in {found.trials} trials, the first in trial {found.first}."
    )
    (stored.path / "search.json").write_text("[]")
    with pytest.raises(ClearwayError, match="not what `clearway break` writes"):
        first_screen(stored)


def test_how_rare_a_break_is_among_all_members(tmp_path, monkeypatch):
    monkeypatch.setattr("clearway.searching.rarity._ENOUGH", 60)
    file = tmp_path / "short.toml"
    file.write_text(
        """
        name = "short"
        floor_plan = "arena"
        start = [3.0, 7.0, 0.0]
        speed = 0.6
        localisation = "truth"
        legs = [{ name = "way", goal = [4.0, 7.0, 0.0], time_limit = 60.0 }]
        family.start.x = [2.0, 4.0]
        """
    )
    asked = {"failure": "PL>0.5", "trials": 1, "rarity": 500, "out": tmp_path / "out", "shrink": False}
    found = clearway.find_breaks(file, **DRIVEN, **asked)
    assert found.rarity.low < 0.65 < found.rarity.high  # 1.5 m less the goal's tolerance of 0.2 m, of 2 m
    assert str(found).endswith(f"how rare: {found.rarity}")
    assert json.loads((tmp_path / "out" / "search.json").read_text())["rarity"] == found.rarity.to_json()
    assert f"How rare: {found.rarity}." in first_screen(found.results)["said"].result


def test_a_navigator_that_fails_is_no_sign_that_nothing_happens(tmp_path):
    file, own = tmp_path / "short.toml", tmp_path / "raises.py"
    file.write_text(EXAMPLE.read_text())
    own.write_text(
        "class Raises:\n    def reset(self, task, robot, rng): pass\n    def step(self, observation): raise RuntimeError('boom')\n"
    )
    asked = {"trials": 1, "rarity": 500, "out": tmp_path / "out", "shrink": False}
    found = clearway.find_breaks(file, **(DRIVEN | {"navigator": f"{own}:Raises"}), **asked)
    assert found.rarity.failed == found.rarity.trials
    assert f"nothing is known, as the navigator itself failed in all {found.rarity.trials} trials" in str(found)
    with pytest.raises(ClearwayError, match="holds another search"):
        clearway.find_breaks(file, **DRIVEN, **asked)


def test_no_break_is_told_with_the_least_margin(tmp_path):
    file = tmp_path / "far.toml"
    file.write_text(
        EXAMPLE.read_text().partition("\n[family]")[0] + "\n[family]\nobstacles.crate.pose.y = [11.0, 12.0]\n"
    )
    found = clearway.find_breaks(file, **DRIVEN, trials=2, out=tmp_path / "out", failure="CT>50")
    assert (found.breaks, found.first, found.results) == ((), None, None)
    assert 0 < found.least < 50
    assert str(found).startswith("no break in 2 trials; the least margin was ")


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"failure": "colision"}, "unknown failure 'colision'"),
        ({"failure": "MDOO<0.1"}, "unknown indicator 'MDOO'; did you mean 'MDO'"),
        ({"failure": "livelock"}, "livelock = true"),
        ({"failure": "OE>1", "trials": 1}, "in none of 1 trials it can be computed"),
        ({"trials": 0}, "trials: 0 is wrong"),
        ({"breaks": 0}, "breaks: 0 is wrong"),
        ({"rarity": 499}, "rarity: 499 trials are too few: at least 500"),
        ({"method": "best"}, "unknown method 'best'"),
        ({"navigator": "nobody"}, "unknown navigator"),
    ],
)
def test_what_cannot_be_searched_is_told_in_one_sentence(asked, said, family, tmp_path):
    text = family.read_text().replace('name = "way"\n', 'name = "way"\nyaw_tolerance = inf\n')
    family.write_text(text)
    with pytest.raises(ClearwayError, match=said):
        clearway.find_breaks(family, **(DRIVEN | {"out": tmp_path / "out"} | asked))


def test_a_limit_is_read_as_it_is_written():
    found = failure_named(" MDO <  0.1")
    assert (found.indicator, found.limit, found.beyond, found.unit) == ("MDO", 0.1, False, "m")
    assert failure_named("CT > 6e1").name == "CT>60"
    assert failure_named("contact  while moving").unit == "m"
    with pytest.raises(ClearwayError, match="no number"):
        failure_named("MDO<1.2.3")
    with pytest.raises(ClearwayError, match="CT is the better the lower: write 'CT>60'"):
        failure_named("CT<60")
    with pytest.raises(ClearwayError, match="no trial can fail so: success lies from 0"):
        failure_named("success<0")
