"""Criteria held against made-up trials: each verdict, what counts as unknown, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from clearway.errors import ClearwayError
from clearway.reports.acceptance import plan_text, reasons, sentence
from clearway.statistics import Criteria, Decision, Verdict, judge, load_criteria, outlooks
from clearway.statistics.acceptance import _by_share
from clearway.statistics.acceptance_plan import repetitions
from clearway.statistics.acceptance_trials import in_order
from clearway.statistics.criteria import criteria_problems


def trials(n: int, bad: tuple[int, ...] = (), **cells: Any) -> pa.Table:
    """So many trials of one test each, those of `bad` without success and near an obstacle."""
    rows = []
    for i in range(n):
        row = {
            "trial": i, "suite": "s", "scenario": f"t{i}", "seed": i, "member": "", "run": "", "robot": "tiago", "navigator": "orca",
            "setup": None, "batch": "SO" if i % 2 else "MO", "configuration": "c", "speed": 0.6, "size": None, "gap": None,
            "source": "recorded", "reason": "", "to_confirm": "", "contacts": 0, "moved_at_contact": "", "success": i not in bad,
            "MDO": 0.05 if i in bad else 0.3, "not_computable": "{}",
        }  # fmt: skip
        rows.append(row | {k: v(i) if callable(v) else v for k, v in cells.items()})
    return pa.Table.from_pylist(rows)


def asked(text: str, tmp_path: Path) -> Criteria:
    file = tmp_path / "criteria.toml"
    file.write_text(text, encoding="utf-8")
    return load_criteria(file)


SUCCESS = '[[criterion]]\nindicator = "success"\nshare = 0.9\n'


def verdict(table: pa.Table, tmp_path: Path, text: str = SUCCESS) -> Verdict:
    return judge([table], asked(text, tmp_path))


def test_accepted_rejected_and_go_on(tmp_path: Path):
    assert verdict(trials(33), tmp_path).decision is Decision.ACCEPTED
    before = verdict(trials(32), tmp_path)
    assert (before.decision, before.more, before.criteria[0].least) == (Decision.GO_ON, 1, 1)
    assert str(before) == "go on, about 1 more trial"
    bad = verdict(trials(20, bad=tuple(range(12))), tmp_path)
    assert (bad.decision, bad.criteria[0].decided) == (Decision.REJECTED, 2)
    assert bad.criteria[0].failed == tuple((0, i) for i in range(12))


def test_a_confidence_of_all_but_one(tmp_path: Path):
    text = SUCCESS.replace("0.9", "0.95") + "confidence = 0.9999999999999999\n"
    both = text + text.replace("success", "success_slack")
    for n in (1, 2, 40):
        assert verdict(trials(n, success_slack=lambda i: True), tmp_path, both).decision is Decision.GO_ON
    assert verdict(trials(1, bad=(0,)), tmp_path, text).decision is Decision.GO_ON


def test_what_is_decided_stays_decided(tmp_path: Path):
    later = tuple(range(33, 60))
    found = verdict(trials(60, bad=later), tmp_path)
    assert (found.decision, found.criteria[0].decided) == (Decision.ACCEPTED, 33)
    assert found.criteria[0].failing == len(later)


def test_all_criteria_have_to_be_met_and_one_broken_rejects(tmp_path: Path):
    text = SUCCESS + '[[criterion]]\nindicator = "MDO"\nat_least = 0.1\ntrials = 40\nfailures = 1\n'
    assert verdict(trials(39), tmp_path, text).decision is Decision.GO_ON
    assert verdict(trials(39), tmp_path, text).more == 1
    assert verdict(trials(40, bad=(36,)), tmp_path, text).decision is Decision.ACCEPTED
    broken = verdict(trials(40, bad=(36, 38)), tmp_path, text)
    assert [j.decision for j in broken.criteria] == [Decision.ACCEPTED, Decision.REJECTED]
    assert (broken.decision, broken.criteria[1].decided) == (Decision.REJECTED, 39)


def test_risk_of_a_wrong_rejection_is_divided(tmp_path: Path):
    one = verdict(trials(8, bad=(0, 1)), tmp_path)
    many = "".join(f'[[criterion]]\nname = "{i}"\nindicator = "success"\nshare = {0.9 - i / 1000}\n' for i in range(8))
    assert one.decision is Decision.REJECTED
    assert verdict(trials(8, bad=(0, 1)), tmp_path, many).decision is Decision.GO_ON


def test_what_nobody_can_judge_counts_against_either_verdict(tmp_path: Path):
    for unknown in (
        {"to_confirm": "possible contact"},
        {"reason": "the recording cannot be used: empty", "success": False},
        {"outcome": "scenario_failed", "success": None, "contacts": None},
    ):
        cells = {
            k: (lambda i, v=v, k=k: v if i < 4 else ("" if isinstance(v, str) else True)) for k, v in unknown.items()
        }
        found = verdict(trials(60, **cells), tmp_path)
        assert found.decision is Decision.GO_ON
        assert (found.criteria[0].unknown, found.criteria[0].unjudged) == (4, ((0, 0), (0, 1), (0, 2), (0, 3)))
        assert any("trials 0, 1, 2, 3" in note for note in found.notes)
    all_unknown = verdict(trials(60, to_confirm="possible contact"), tmp_path)
    assert (all_unknown.decision, all_unknown.criteria[0].unknown) == (Decision.GO_ON, 60)


@pytest.mark.slow
def test_no_verdict_is_turned_by_what_a_person_confirms(tmp_path: Path):
    text = SUCCESS.replace("0.9", "0.95")
    two = trials(182, to_confirm=lambda i: "possible contact" if i < 2 else "")
    open_one = verdict(two, tmp_path, text).criteria[0]
    assert (open_one.decision, open_one.more) == (Decision.GO_ON, 0)
    assert open_one.why == "what nobody can judge yet may decide it at trial 2, and has to be judged first"
    assert verdict(trials(182, bad=(0, 1)), tmp_path, text).criteria[0].decided == 2
    assert verdict(trials(182), tmp_path, text).decision is Decision.ACCEPTED

    rng = np.random.default_rng(3)
    decided = 0
    for _ in range(50):
        rate, often = rng.choice((0.6, 0.9, 1.0)), rng.choice((0.02, 0.1))
        bad = tuple(np.flatnonzero(rng.random(80) > rate).tolist())
        unknown = {int(i) for i in np.flatnonzero(rng.random(80) < often)}
        partly = trials(80, bad=tuple({*bad} - unknown), to_confirm=lambda i, u=unknown: "?" if i in u else "")
        found = verdict(partly, tmp_path).decision
        if found is not Decision.GO_ON:
            decided += 1
            some = {i for i in unknown if rng.random() < 0.5}
            for failing in (unknown, set(), some):
                assert verdict(trials(80, bad=tuple({*bad} - unknown | failing)), tmp_path).decision is found
    assert decided > 10


def test_a_missing_value_fails_unless_it_is_called_unknown(tmp_path: Path):
    gone = trials(40, MDO=lambda i: None if i < 5 else 0.3)
    text = '[[criterion]]\nindicator = "MDO"\nat_least = 0.1\nshare = 0.9\n'
    assert verdict(gone, tmp_path, text).decision is Decision.REJECTED
    assert verdict(gone, tmp_path, text).criteria[0].missing == 5
    asked_for = trials(
        40, MDO=lambda i: None if i < 5 else 0.3, to_confirm=lambda i: "possible contact" if i < 5 else ""
    )
    assert verdict(asked_for, tmp_path, text).criteria[0].unknown == 5
    kinder = verdict(gone, tmp_path, text + 'missing = "unknown"\n')
    assert (kinder.decision, kinder.criteria[0].unknown) == (Decision.GO_ON, 5)


def test_bounds_judge_where_both_lie_on_one_side_of_the_limit(tmp_path: Path):
    ends = {0: (0.12, 0.2), 1: (0.02, 0.05), 2: (0.05, 0.2), 3: (0.12, None)}
    cells = {
        "MDO": lambda i: None if i in ends else 0.3,
        "MDO_at_least": lambda i: ends.get(i, (None, None))[0],
        "MDO_at_most": lambda i: ends.get(i, (None, None))[1],
    }
    text = '[[criterion]]\nindicator = "MDO"\nat_least = 0.1\nshare = 0.5\n'
    (found,) = verdict(trials(10, **cells), tmp_path, text).criteria
    assert (found.failed, found.unjudged, found.conforming, found.missing) == (((0, 1),), ((0, 2),), 8, 0)
    (found,) = verdict(trials(10, **cells), tmp_path, text.replace("0.1", "0.03")).criteria
    assert (found.failed, found.unjudged) == ((), ((0, 1),))


def test_very_many_failures(tmp_path: Path):
    text = SUCCESS.replace("0.9", "0.5")
    many = _by_share(asked(text, tmp_path).criterion[0], asked(text, tmp_path), *2 * [np.arange(120_000) % 2 == 0])
    assert many[0] is Decision.GO_ON
    assert many[5] > 1000


def test_no_moving_contact(tmp_path: Path):
    text = '[[criterion]]\nindicator = "moved_at_contact"\nnone_of = ["robot", "both"]\ntrials = 30\n'
    assert verdict(trials(30), tmp_path, text).decision is Decision.ACCEPTED
    moved = trials(30, moved_at_contact=lambda i: "robot" if i == 7 else "", contacts=lambda i: int(i == 7))
    assert verdict(moved, tmp_path, text).criteria[0].failed == ((0, 7),)
    nobody_knows = trials(30, contacts=lambda i: None if i == 7 else 0)
    open_still = verdict(nobody_knows, tmp_path, text)
    assert (open_still.decision, open_still.more, open_still.criteria[0].unjudged) == (Decision.GO_ON, 0, ((0, 7),))
    assert any(
        "nobody knows whether it touched something: trial 7; `contact = true`" in note for note in open_still.notes
    )
    assert "by what nobody could judge yet" in sentence(open_still)
    assert not any("more trials" in line for line in reasons(open_still.criteria[0]))
    at_rest = trials(30, moved_at_contact=lambda i: "obstacle" if i == 7 else "", contacts=lambda i: int(i == 7))
    assert verdict(at_rest, tmp_path, text).decision is Decision.ACCEPTED


def test_each_group_has_to_meet_it(tmp_path: Path):
    text = SUCCESS + 'each = "batch"\nwhere = { batch = ["SO", "MO"] }\n'
    found = verdict(trials(60, bad=(1, 3, 5, 7)), tmp_path, text)
    assert [(j.group, j.decision) for j in found.criteria] == [
        ("batch SO", Decision.REJECTED),
        ("batch MO", Decision.GO_ON),
    ]
    with pytest.raises(ClearwayError, match=r"criterion\.0\.where\.batch: unknown batch 'CE'; .*known: MO, SO"):
        verdict(trials(60), tmp_path, text.replace("MO", "CE"))
    assert judge([trials(60)], asked(text.replace("MO", "CE"), tmp_path), complete=False).criteria[1].trials == 0
    with pytest.raises(ClearwayError, match=r"criterion\.0\.where\.batch: unknown batch 'M0'; did you mean 'MO'"):
        verdict(trials(60), tmp_path, SUCCESS + 'where = { batch = ["SO", "M0"] }\n')


def test_simulated_trials_count_in_a_drawn_order_that_no_robot_changes(tmp_path: Path):
    easy_first = trials(60, bad=tuple(range(40, 60)), source="simulated")
    assert verdict(trials(60, bad=tuple(range(40, 60))), tmp_path).decision is Decision.ACCEPTED
    assert verdict(easy_first, tmp_path).decision is Decision.REJECTED
    shuffled = easy_first.take(pa.array(list(range(59, -1, -1))))
    other = trials(60, bad=tuple(range(40, 60)), source="simulated", navigator="hp-st")
    decided = [verdict(t, tmp_path).criteria[0].decided for t in (easy_first, shuffled, other)]
    assert len(set(decided)) == 1


@pytest.mark.parametrize("grows_by", ["repetition", "seed"])
def test_a_campaign_that_has_grown_begins_with_what_it_was(grows_by: str):
    again = grows_by == "repetition"
    name = (lambda i: f"t{i % 6}-r{i // 6 + 1}") if again else (lambda i: f"t{i % 6}-seed-{i // 6}-r1")
    grown = trials(60, source="simulated", scenario=name, repetition=lambda i: i // 6 + 1 if again else 1)
    whole = [r["trial"] for r in in_order(grown)]
    assert sorted(whole) == list(range(60))
    assert whole[:6] != sorted(whole[:6])
    for n in range(6, 60, 6):
        assert [r["trial"] for r in in_order(grown.slice(0, n))] == whole[:n]


def test_recorded_trials_behind_a_gap_in_the_plan_wait(tmp_path: Path):
    gap = trials(40, _number=lambda i: i + 1 if i < 9 else i + 2)
    found = verdict(gap, tmp_path)
    assert (found.decision, found.criteria[0].trials) == (Decision.GO_ON, 9)
    (note,) = found.notes
    assert note.startswith(
        "trial 10 of the test plan is not there yet, and the 31 that came in of those behind it wait"
    )
    filled = verdict(trials(40, _number=lambda i: i + 1), tmp_path)
    assert (filled.decision, filled.criteria[0].trials, filled.notes) == (Decision.ACCEPTED, 40, ())
    none_counts = verdict(trials(4, _number=lambda i: i + 2), tmp_path)
    assert (none_counts.decision, none_counts.criteria[0].trials) == (Decision.GO_ON, 0)


def test_an_order_that_was_not_drawn_is_told(tmp_path: Path):
    blocks = trials(40, batch="SO", configuration=lambda i: f"c{i // 10}")
    assert any("not driven in a drawn order" in note for note in verdict(blocks, tmp_path).notes)
    assert verdict(trials(40, configuration=lambda i: f"c{i * 7 % 11}"), tmp_path).notes == ()


def test_what_depends_is_refused(tmp_path: Path):
    with pytest.raises(ClearwayError, match="trials 0 and 1 are two robots of one simulation"):
        verdict(trials(4, run=lambda i: f"r{i // 2}"), tmp_path)
    same = trials(4, source="simulated")
    with pytest.raises(ClearwayError, match="trial 0 is the same test as trial 0: 't0' with seed 0"):
        judge([same, same.slice(0, 1)], asked(SUCCESS, tmp_path))
    with pytest.raises(
        ClearwayError, match=r"where\.navigator: a verdict is on one, and there are several: orca, hp-st"
    ):
        verdict(trials(4, navigator=lambda i: "orca" if i < 2 else "hp-st"), tmp_path)
    placed = trials(4, source="simulated", localisation="amcl")
    for other in (same, trials(4, source="simulated", seed=lambda i: 9 + i, localisation="truth")):
        with pytest.raises(
            ClearwayError, match=r"where\.localisation: a verdict is on one, and there are several: amcl,"
        ):
            judge([placed, other], asked(SUCCESS, tmp_path))
    elsewhere = trials(4, source="simulated", suite="other", localisation="truth")  # whose scenarios say so
    assert judge([placed, elsewhere], asked(SUCCESS, tmp_path)).criteria[0].trials == 8
    mixed = trials(80, navigator=lambda i: "orca" if i % 2 else "hp-st")
    assert verdict(mixed, tmp_path, '[where]\nnavigator = "orca"\n' + SUCCESS).criteria[0].trials == 40


def test_an_indicator_that_no_trial_can_have(tmp_path: Path):
    text = '[[criterion]]\nindicator = "MDO"\nat_least = 0.1\nshare = 0.9\n'
    gone = trials(9, MDO=None, not_computable=json.dumps({"MDO": "the test places no obstacle"}))
    gone = gone.set_column(gone.column_names.index("MDO"), "MDO", pa.nulls(9, pa.float64()))
    with pytest.raises(ClearwayError, match=r"not computable in any of the 9 trials.*places no obstacle"):
        verdict(gone, tmp_path, text)


def test_at_the_most_what_is_not_shown_is_rejected(tmp_path: Path):
    half = tuple(range(0, 40, 14))
    found = verdict(trials(40, bad=half), tmp_path, f"most = 40\n{SUCCESS}")
    assert (found.decision, found.criteria[0].decided) == (Decision.REJECTED, 40)
    assert "not shown within 40 trials" in found.criteria[0].why


WRONG = {
    'share = 1.0': "no number of trials shows a share of 1; 300 trials without a failure show 0.99",
    'share = 95': r"did you mean 0\.95\?",
    'share = 0.9\ntrials = 30': "not both",
    'confidence = 0.95': "say how often",
    'share = 0.9\nconfidence = 95': r"no confidence.*did you mean 0\.95\?",
    'share = 0.9\nfailures = 2': "belongs to `trials`",
    'trials = 300\nconfidence = 0.95': r"show a share of 0\.9901 at 0\.95: write share = 0\.99 instead",
    'trials = 3\nfailures = 3': "every robot meets it",
    'share = 0.9999999': "no robot can meet it within 1,000,000 trials",
    'share = 0.9\nexpected = 0.8': "more than 0.9 can be expected",
    'share = 0.9\neach = "batch"': r"say each of which: where = \{ batch",
    'share = 0.9\nwhere = { bach = "SO" }': "unknown column 'bach'; did you mean 'batch'",
    'share = 0.9\nwhere = { speed = "fast" }': "'fast' is wrong: the column holds a number",
    'share = 0.9\nwhere = { success = true }': "where.success: success is known only after a trial",
    'share = 0.9\nwhere = { failure = "" }': "failure is known only after a trial, .*batch, .*are known before",
    'share = 0.9\nat_least = 1': "success is a yes or no; is says what conforms",
    'sahre = 0.9': "unknown key; did you mean 'share'",
}  # fmt: skip
LIMITS = {
    'indicator = "MDOO"\nat_least = 0.1': "unknown indicator 'MDOO'; did you mean 'MDO'",
    'indicator = "MDO"': "MDO needs a limit: at_least or at_most",
    'indicator = "MDO"\nat_most = 0.1': "upside down: MDO is the better the higher; write at_least = 0.1",
    'indicator = "MDO"\nat_least = 0.5\nat_most = 0.1': "upside down: at_least 0.5 is more than at_most 0.1",
    'indicator = "CT"\nat_most = -1.0': "no trial can meet it: CT is never less than 0 s",
    'indicator = "TCS"\nat_least = 101.0': "no trial can meet it: TCS is never more than 100 %",
    'indicator = "MDO"\nat_least = 0.0': "every trial meets it",
    'indicator = "outcome"\nat_least = 1': "outcome is a word; one_of or none_of says what conforms",
    'indicator = "moved_at_contact"\nnone_of = ["Robot"]': "none_of: unknown moved_at_contact 'Robot'; did you mean 'robot'",
    'indicator = "outcome"\none_of = ["sucess"]': "one_of: unknown outcome 'sucess'; .*known: aborted, collision, .*reached",
    'indicator = "failure"\nnone_of = ["colision"]': "unknown failure 'colision'; did you mean 'collision'",
    'indicator = "outcome"\nnone_of = [""]': "unknown outcome ''",
    'indicator = "success"\nwhere = { source = "simulatd" }': "where.source: unknown source 'simulatd'; did you mean 'simulated'",
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "complaint"),
    [(f'[[criterion]]\nindicator = "success"\n{k}\n', v) for k, v in WRONG.items()]
    + [(f"[[criterion]]\nshare = 0.9\n{k}\n", v) for k, v in LIMITS.items()]
    + [("most = 20\n" + SUCCESS, "within most = 20 trials: 0.9 at 0.95 needs 33 even without a failure")]
    + [(SUCCESS + SUCCESS, "asks the same as criterion.0")]
    + [('title = "none"\n', "criterion: is missing")],
)
def test_a_wrong_criterion_is_one_clear_error(text: str, complaint: str, tmp_path: Path):
    with pytest.raises(ClearwayError, match=complaint) as error:
        asked(text, tmp_path)
    assert error.value.file == str(tmp_path / "criteria.toml")
    assert error.value.field


def test_all_that_is_wrong_is_told_at_once(tmp_path: Path):
    file = tmp_path / "criteria.toml"
    one = '[[criterion]]\nindicator = "{}"\n{}\n'
    file.write_text(
        "where = { robt = 'tiago' }\n"
        + one.format("MDO", "at_most = 0.1\nshare = 95\neach = 'batch'")
        + one.format("success", "trials = 3\nfailures = 3")
        + 2 * one.format("success", "share = 0.9")
    )
    assert [(e.file, e.field) for e in criteria_problems(file)] == [
        (str(file), field)
        for field in ("where.robt", "criterion.0.at_most", "criterion.0.each", "criterion.0", "criterion.1.failures", "criterion.3")
    ]  # fmt: skip


def test_the_plan_says_how_many_trials(tmp_path: Path):
    text = SUCCESS + 'expected = 0.99\n[[criterion]]\nindicator = "success"\ntrials = 30\nfailures = 1\n'
    share, count = outlooks(asked(text, tmp_path))
    assert share.least == 33
    assert share.prospects[0].rate == 0.99
    assert share.prospects[0].accepted > 0.99
    assert share.planned == share.prospects[0].ninth
    at_limit = next(p for p in share.prospects if p.rate == 0.9)
    assert at_limit.accepted <= 0.05
    by_hand = 0.98**30 + 30 * 0.02 * 0.98**29
    (at,) = outlooks(asked(text, tmp_path), rates=(0.98,))[1].prospects
    assert (count.least, count.planned, at.rate) == (30, 30, 0.98)
    assert at.accepted == pytest.approx(by_hand)
    with pytest.raises(ClearwayError, match=r"--rate: 99 is no share of trials; 0 to 1 is \(did you mean 0.99\?\)"):
        outlooks(asked(text, tmp_path), rates=(99,))


def test_the_most_trials_that_count_reject_what_is_undecided(tmp_path: Path):
    criteria = asked('confidence = 0.95\nmost = 80\n[[criterion]]\nindicator = "success"\nshare = 0.95\n', tmp_path)
    (outlook,) = outlooks(criteria, rates=(0.975,))
    at = next(p for p in outlook.prospects if p.rate == 0.975)
    assert (at.accepted + at.rejected, at.ninth, outlook.planned) == (pytest.approx(1.0), 80, 80)
    failing = np.random.default_rng(0).random((120, 80)) > 0.975
    found = [judge([trials(80, tuple(np.flatnonzero(row).tolist()))], criteria).decision for row in failing]
    assert np.mean([one is Decision.REJECTED for one in found]) == pytest.approx(at.rejected, abs=0.12)


def test_where_no_number_of_trials_decides_there_is_no_plan(tmp_path: Path):
    criteria = asked(
        'confidence = 0.95\n[[criterion]]\nindicator = "success"\nshare = 0.95\nexpected = 0.96\n', tmp_path
    )
    (outlook,) = outlooks(criteria)
    assert outlook.planned is None
    assert "no plan: 1,340 trials don't decide it in nine of ten cases" in plan_text([outlook])
    with pytest.raises(
        ClearwayError,
        match=r"1,340 trials don't decide it in nine of ten cases, if the true share is 0\.96: set `most`",
    ):
        repetitions(criteria, [{"batch": "SO"}])


def test_what_is_expected_is_a_share(tmp_path: Path):
    with pytest.raises(
        ClearwayError, match=r"expected 95 must lie between 0 and 1, both excluded \(did you mean 0\.95"
    ):
        asked('[[criterion]]\nindicator = "success"\ntrials = 10\nexpected = 95\n', tmp_path)
