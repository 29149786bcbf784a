"""`clearway score --criteria`: a verdict on recordings, after every trial, and of the day while it goes on."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Shell

import clearway as package
from clearway.campaigns.watching import Round
from clearway.cli._day import _verdict
from clearway.errors import ClearwayError
from clearway.recordings.lab.plan_file import load_test_plan

PLAN = Path(__file__).parents[2] / "examples" / "06_score_recordings" / "plan.toml"
ASKED = '[[criterion]]\nname = "arrives"\nindicator = "success"\nshare = 0.9\n[[criterion]]\nindicator = "DE"\nat_most = 0.5\ntrials = 2\n'


@pytest.fixture(scope="module")
def criteria(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("asked") / "criteria.toml"
    file.write_text(ASKED, encoding="utf-8")
    return file


def test_recordings_are_judged_trial_by_trial(clearway: Shell, criteria: Path, tmp_path: Path):
    said = clearway("score", PLAN, "--criteria", criteria, "--workers", 1, "--out", tmp_path / "lab")
    assert "GO ON  go on, about " in said.out
    assert "2 of the first 2 trials conform" in said.out
    assert "failed: trial 3\n          not to be judged yet: trial 2\n" in said.out
    assert "to be confirmed by a person: trial 2 (no. 3 of the test plan)\n" in said.out
    assert "\nto confirm  trial 2, no. 3 of the test plan: possible contact at " in said.out
    assert "\nnear its tolerance  trial 1, no. 2 of the test plan: DE of leg back" in said.out
    page = (tmp_path / "lab" / "report" / "index.html").read_text(encoding="utf-8")
    assert page.index('id="acceptance"') < page.index('<ul class="said">')
    results = package.open_results(tmp_path / "lab")
    (arrives, errs) = package.accept(criteria, results).criteria
    assert (arrives.trials, arrives.conforming + arrives.failing + arrives.unknown) == (4, 4)
    assert (errs.decision, arrives.failed, arrives.unjudged) == ("accepted", ((0, 3),), ((0, 2),))
    told = _verdict(Round(results, 4, "", {}, {}), criteria, PLAN)[1]
    assert [line[:15] for line in told] == ["verdict  go on,"]
    before = _verdict(Round(None, 4, "", {}, {}), criteria, PLAN)[1]
    assert before == ["verdict  go on, about 33 more trials: 0 of 2 criteria are met, none is broken"]
    assert clearway("accept", criteria, tmp_path / "lab").code == 2


def test_a_group_that_the_plan_does_not_have(criteria: Path, clearway: Shell, tmp_path: Path):
    strange = tmp_path / "criteria.toml"
    strange.write_text('[where]\nbatch = "CE"\n' + ASKED, encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"where\.batch: unknown batch 'CE'"):
        package.accept(strange, test_plan=PLAN)
    assert "unknown batch 'CE'" in clearway.complaint("score", PLAN, "--criteria", strange, "--out", tmp_path / "lab")
    assert not (tmp_path / "lab").exists()
    assert _verdict(Round(None, 4, "", {}, {}), strange, PLAN)[1][0].startswith("problem  ")


def test_a_protocol_has_as_many_trials_as_are_planned_in_a_drawn_order(clearway: Shell, criteria: Path, tmp_path: Path):
    one = tmp_path / "criteria.toml"
    one.write_text('[[criterion]]\nindicator = "success"\nshare = 0.6\nexpected = 0.95\n', encoding="utf-8")
    (planned,) = package.acceptance_plan(one)
    part = ("hospital", "--robot", "tiago", "--batch", "SO", "--configuration", "single", "--speed", 0.6)
    file = tmp_path / "plan.toml"
    assert clearway("protocol", *part, "--criteria", one, "--out", file, "--sheet", tmp_path / "sheet.html").code == 0
    trials = load_test_plan(file).trials
    assert 0 <= len(trials) - planned.planned < 4  # whole rounds of the four tests
    rounds = [[t.size for t in trials[i : i + 4]] for i in range(0, len(trials), 4)]
    assert all(sorted(r) == [0.03, 0.15, 0.3, 0.6] for r in rounds)
    assert len(set(map(tuple, rounds))) > 1
    one.write_text(one.read_text() + 'where = { batch = "CE" }\n', encoding="utf-8")
    assert "unknown batch 'CE'" in clearway.complaint("protocol", *part, "--criteria", one)
