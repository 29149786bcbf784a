"""`clearway accept`: verdicts as exit codes, wrong input apart from them, JUnit, the page that begins with the verdict."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pyarrow as pa
import pytest
import yaml
from command_line import Shell
from tests.reports.synthetic_results import write_campaign

import clearway
from clearway.errors import ClearwayError
from clearway.scenarios.suites import Selection
from clearway.trials.store import Results

MET = 'title = "Ward 3"\n[[criterion]]\nname = "arrives"\nindicator = "success"\nshare = 0.6\n'
BROKEN = '[[criterion]]\nname = "keeps clear"\nindicator = "MDO"\nat_least = 2.0\nshare = 0.9\n'
OPEN = '[[criterion]]\nindicator = "success"\nshare = 0.9\n'


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    part = Selection(batches=("SO",), configurations=("single",), speeds=(0.6,), repetitions=3)
    return write_campaign(tmp_path_factory.mktemp("accept") / "out", robots=("tiago",), selection=part).path


accept, open_results = clearway.accept, clearway.open_results


def criteria(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "criteria.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_the_exit_code_is_the_verdict(clearway: Shell, results: Path, tmp_path: Path):
    met = clearway("accept", criteria(tmp_path, MET), results)
    assert (met.code, met.out.splitlines()[0]) == (
        0,
        "ACCEPTED  Ward 3: tiago, move-base is accepted: 1 of 1 criteria are met",
    )
    broken = clearway("accept", criteria(tmp_path, MET + BROKEN), results)
    assert (broken.code, broken.out.splitlines()[0]) == (
        1,
        "REJECTED  Ward 3: tiago, move-base is rejected: keeps clear",
    )
    go_on = clearway("accept", criteria(tmp_path, OPEN), results)
    assert (go_on.code, go_on.out.splitlines()[0][:15]) == (2, "GO ON  go on, a")
    said = r"about [\d,]+ more trials, if they go on as so far; at least [\d,]+ more trials before it can be accepted, even if none of "
    assert re.search(said, go_on.out)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("criteria.toml",), "say which results are to be judged"),
        (("nowhere.toml", "RESULTS"), "nowhere.toml: "),
        (("criteria.toml", "nowhere"), "nowhere: no such directory"),
        (("criteria.toml", "RESULTS", "RESULTS"), "is named twice"),
        (("criteria.toml", "RESULTS", "--plan"), "leave the results out"),
        (("criteria.toml", "RESULTS", "--verdict"), "No such option"),
        ((), "Missing argument"),
    ],
)
def test_wrong_input_is_no_verdict(
    clearway: Shell, results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], said: str
):
    monkeypatch.chdir(tmp_path)
    criteria(tmp_path, MET)
    found = clearway("accept", *(str(results) if w == "RESULTS" else w for w in words))
    assert found.code == 64
    assert said in found.err
    assert "Traceback" not in found.err


def test_results_of_another_system_are_no_more_trials_of_this_one(results: Path, tmp_path: Path):
    said, trials = open_results(results).campaign, open_results(results).trials

    def with_(name: str, change: dict[str, object]) -> Results:
        made = Results(tmp_path / name, said | change)
        made.trials = trials
        return made

    (robot,) = said["robots"]
    heavy = with_("heavy", {"robots": {robot: said["robots"][robot] | {"d_base": 0.7}}})
    newer = with_("newer", {"code": said.get("code", {}) | {"clearway": "0123"}})
    spec = {"file": "a.csv", "span": None}
    lab, again = (with_(n, {"attempted": [spec], "files": {"a.csv": "0123"}}) for n in ("lab", "again"))
    asked = criteria(tmp_path, MET)
    for first, second, why in (
        (open_results(results), heavy, r"differ in robots\.tiago\.d_base, which is 0\.7 here and 0\.54 there"),
        (with_("older", {"code": {"clearway": "4567"}}), newer, r"differ in code\.clearway, which is '0123' here"),
        (lab, again, r"again: holds the recording 'a\.csv', as .*lab does; each trial counts once"),
    ):
        with pytest.raises(ClearwayError, match=why):
            accept(asked, first, second)


def test_what_no_trial_that_is_chosen_has_may_differ(results: Path, tmp_path: Path):
    said, trials = open_results(results).campaign, open_results(results).trials
    mine = trials.set_column(
        trials.column_names.index("navigator"), "navigator", pa.array(["mine"] * len(trials), pa.string())
    )

    def with_(name: str, code: str) -> Results:
        made = Results(tmp_path / name, said | {"code": {"mine": code}})
        made.trials = pa.concat_tables([trials, mine])
        return made

    (driver,) = set(trials["navigator"].to_pylist())
    for navigator, why in ((driver, "is the same test as trial"), ("mine", r"differ in code\.mine")):
        asked = criteria(tmp_path, MET + f'[where]\nnavigator = "{navigator}"\n')
        with pytest.raises(ClearwayError, match=why):
            accept(asked, with_("one", "0"), with_("two", "1"))


def test_campaigns_count_in_the_order_in_which_they_were_begun(results: Path, tmp_path: Path):
    trials = open_results(results).trials
    first, second = (
        Results(tmp_path / f"day-{day}", {"plan": {}, "run": {"started": f"2026-11-0{day}T08:00:00+00:00"}})
        for day in (1, 2)
    )
    first.trials = trials
    second.trials = trials.set_column(
        trials.column_names.index("seed"), "seed", pa.array(range(len(trials)), pa.uint64())
    )
    asked = criteria(tmp_path, MET)
    assert accept(asked, first, second).criteria[0].trials == 2 * len(trials)
    with pytest.raises(ClearwayError, match=r"day-2: is not named in the order .* count first: .*day-1 .*day-2"):
        accept(asked, second, first)


def test_a_gap_in_a_test_plan_holds_up_the_trials_behind_it(results: Path, tmp_path: Path):
    trials = open_results(results).trials
    n, at = len(trials), trials.column_names.index("source")
    numbers = [1, 2, *range(4, n + 2)]
    lab = Results(tmp_path / "lab", {"run": {}, "numbers": numbers, "not_attempted": 5})
    lab.trials = trials.set_column(at, "source", pa.array(["recorded"] * n))
    found = accept(criteria(tmp_path, MET), lab)
    assert found.criteria[0].trials == 2
    assert any(
        note.startswith(f"trial 3 of the test plan is not there yet, and the {n - 2} that") for note in found.notes
    )
    simulated = Results(tmp_path / "next", {"run": {}})
    simulated.trials = trials
    both = accept(tmp_path / "criteria.toml", lab, simulated)
    assert any("still to come (5 of " in note and "finish one plan before" in note for note in both.notes)


def test_a_failure_of_ours_is_no_verdict(
    clearway: Shell, results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    for error, code in ((ZeroDivisionError(), 70), (MemoryError(), 70), (KeyboardInterrupt(), 130)):

        def fails(*_: object, error: BaseException = error, **__: object) -> None:
            raise error

        monkeypatch.setattr("clearway.api.accept", fails)
        assert clearway("accept", criteria(tmp_path, MET), results).code == code


def test_junit_has_a_case_a_criterion(clearway: Shell, results: Path, tmp_path: Path):
    file = tmp_path / "made" / "verdict.xml"
    both = MET + BROKEN + OPEN
    assert clearway("accept", criteria(tmp_path, both), results, "--junit", file).code == 1
    suite = ET.parse(file).getroot()
    assert [suite.get(n) for n in ("name", "tests", "failures", "errors")] == ["Ward 3", "3", "1", "1"]
    kinds = [[child.tag for child in case] for case in suite.iter("testcase")]
    assert kinds == [[], ["failure"], ["error"]]


def test_the_action_for_github_does_what_it_says(
    clearway: Shell, results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    action = Path(__file__).parents[2] / "examples" / "08_accept" / "github-action.yml"
    steps = yaml.safe_load(action.read_text("utf-8"))["jobs"]["acceptance"]["steps"]
    run, accept = (shlex.split(s["run"])[1:] for s in steps if s.get("run", "").startswith("clearway"))
    offered = clearway("run", "--help").out
    assert all(word in offered for word in run if word.startswith("--"))
    monkeypatch.chdir(tmp_path)
    criteria(tmp_path, MET)
    shutil.copytree(results, run[run.index("--out") + 1])  # as if the step before had run
    assert clearway(*accept).code == 0
    assert all(Path(kept).exists() for kept in steps[-1]["with"]["path"].splitlines())
    criteria(tmp_path, MET + BROKEN)
    assert clearway(*accept).code == 1
    assert "<failure" in Path("results/verdict.xml").read_text("utf-8")  # kept, as that step runs always
    assert steps[-1]["if"] == "always()"


def test_json_and_python_say_the_same(clearway: Shell, results: Path, tmp_path: Path):
    told = json.loads(clearway("accept", criteria(tmp_path, MET), results, "--json").out)
    verdict = accept(tmp_path / "criteria.toml", results)
    assert (told["decision"], told["criteria"][0]["decided"]) == (verdict.decision, verdict.criteria[0].decided)
    assert told["criteria"][0]["conforming"] == verdict.criteria[0].conforming == 12


def test_the_page_begins_with_the_verdict(clearway: Shell, results: Path, tmp_path: Path):
    said = clearway("accept", criteria(tmp_path, MET.replace("Ward 3", "<b>Ward") + BROKEN), results, "--report")
    page = Path(said.out.strip().splitlines()[-1].removeprefix("report: ")).read_text(encoding="utf-8")
    verdict, first = (
        page.index('<section id="acceptance" class="acceptance rejected">'),
        page.index('<ul class="said">'),
    )
    assert page.index("<h1>") < verdict < first
    assert "&lt;b&gt;Ward: tiago, move-base is rejected: keeps clear." in page
    assert "MDO &gt;= 2 m in 90 % of trials at 95 % confidence" in page[verdict:first]
    names = re.findall(r'\sid="([^"]+)"', page)  # a script that fills one in must not find another
    assert len(names) == len(set(names))
    assert 'id="acceptance"' not in open_results(results).report().read_text(encoding="utf-8")


def test_a_plan_comes_before_the_first_trial(clearway: Shell, tmp_path: Path):
    said = clearway("accept", criteria(tmp_path, OPEN), "--plan", "--rate", 0.99, "--rate", 0.9)
    assert said.code == 0
    assert "33 accept if none fails" in said.out
    (found,) = json.loads(clearway("accept", tmp_path / "criteria.toml", "--plan", "--rate", 0.99, "--json").out)
    assert [p["rate"] for p in found["prospects"]] == [0.95, 0.99]
    assert found["prospects"][1]["accepted"] > 0.99


def test_criteria_are_a_kind_of_file(clearway: Shell, tmp_path: Path):
    file = criteria(tmp_path, MET)
    assert clearway("check", file).code == 0
    assert "list of criteria, and a suite is wanted; `clearway accept`" in clearway.complaint("run", file)
    criteria(tmp_path, MET.replace("0.6", "1.0"))
    assert "no number of trials shows a share of 1" in clearway("check", file).err
    assert set(json.loads(clearway("schema", "criteria").out)["properties"]) >= {"title", "most", "criterion"}
