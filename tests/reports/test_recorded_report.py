"""The report of recordings: nothing crashes on what they lack, and everything that is missing or unsure is said."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_results import (
    CONDITIONS,
    LACKS,
    aimless,
    blind,
    gapped,
    measured,
    shapeless,
    unrecorded,
    unsure,
    write_recorded,
)
from synthetic_results import glide

from clearway.contract import BodyKind
from clearway.geometry.shapes import Circle
from clearway.reports import conditions, figure, outcomes, recordings, write_replay, write_report
from clearway.reports.causes import causes
from clearway.reports.findings import Findings
from clearway.reports.replay_encoding import Packer, broken, clearance_over_time
from clearway.reports.same_tests import same_tests
from clearway.reports.selection import label, representative, with_uncertainty
from clearway.reports.text import headline, numbers
from clearway.reports.verdicts import Line, verdicts
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection, load_suite
from clearway.statistics import compare_all
from clearway.trials import Outcome, Trial
from clearway.trials.store import Results


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return write_recorded(tmp_path_factory.mktemp("recorded") / "out")


@pytest.fixture(scope="session")
def recorded_page(recorded: Results) -> Path:
    return write_report(recorded.path)


@pytest.fixture(scope="session")
def crossing() -> Trial:
    """A simulated trial with a moving obstacle."""
    robot = load_robot("tiago")
    [scenario, *_] = load_suite("hospital").build(robot, Selection(batches=("CE",), speeds=(0.6,)), 1)
    return glide(scenario, robot)


def facts(pairs: Any) -> dict[str, str]:
    return dict(pairs)


def test_the_page_says_what_a_recording_lacks(recorded_page: Path) -> None:
    page = recorded_page.read_text()
    for part in (
        'id="recordings"', "recording of real robots", "What could not be computed, and why", "To be confirmed",
        "possible contact at 4.2 s (square 1, clearance 0.001 m)", "the goal of leg forth is unknown", "the pose has gaps",
        "of 2 attempts nothing was recorded", "take 2.csv", "mm scaled to m", "a door was open", "tied by 3 holds",
    ):  # fmt: skip
        assert part in page, part
    assert "no motion capture is involved" not in page
    assert "nan" not in re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL).lower().split()


def test_what_could_not_be_computed_is_counted(recorded: Results) -> None:
    f = Findings(recorded)
    found = recordings.missing(f)
    assert found is not None
    rows = {name: row for row in found.rows for name in row[0].text.split(", ")}
    assert rows["PL"][1].text == "15 of 20"
    assert rows["PL"][2].text == "the pose has gaps (3); not recorded (2)"
    assert not {"barn_score", "PL_shortest", "cut"} & set(rows)
    told = [json.loads(r["not_computable"]) for r in f.rows]
    for name, row in rows.items():
        assert row[1].text == f"{sum(name not in t for t in told)} of 20"


def test_what_is_known_within_bounds_says_so(recorded: Results, recorded_page: Path) -> None:
    f = Findings(recorded)
    found = recordings.bounds(f)
    assert found is not None
    gaps = [r for r in f.rows if "the pose has gaps" in r["not_computable"]]
    assert [row[0].trials[0] for row in found.rows] == [r["trial"] for r in gaps]
    first = gaps[0]
    assert first["PL_at_least"] < first["PL_at_most"]
    assert found.rows[0][4].text == f"{first['PL_at_least']:.2f} to {first['PL_at_most']:.2f}"
    page = recorded_page.read_text()
    assert "What the indicators are at least and at most" in page
    trials = json.loads(re.search(r'id="trial-rows">(.*?)</script>', page)[1])  # type: ignore[index]
    keys = [c["key"] for c in trials["columns"]]
    row = next(r for r in trials["rows"] if r[0] == first["trial"])
    shown, why = row[len(keys) + 1][str(keys.index("PL"))]
    assert shown == found.rows[0][4].text
    assert why == f"{shown} m: {json.loads(first['not_computable'])['PL']}"


def first_line(f: Findings) -> Line:
    (group,) = same_tests(f)
    (line,) = verdicts(f, group).lines
    return line


def test_the_first_table_counts_what_is_to_be_confirmed_and_does_not_call_the_unknown_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    f = Findings(write_recorded(tmp_path / "out", lacks=(unsure, blind)))
    precise = first_line(f).shares[2]
    good = [r for r in f.rows if r["success"]]
    assert sum(bool(r["to_confirm"]) for r in good) > 0
    assert f"{sum(bool(r['to_confirm']) for r in good)} of these to be confirmed" in precise.note
    rows = [dict(r) | {"MDO": None, "not_computable": '{"MDO": "the pose has gaps (1.8 s)"}'} for r in f.rows]
    monkeypatch.setattr(Findings, "of", lambda self, system: rows)
    assert first_line(f).nearest == ("–", "not computable: the pose has gaps")


def test_what_is_to_be_confirmed_names_its_trials(recorded: Results) -> None:
    found = recordings.to_confirm(Findings(recorded))
    assert [t.trial for t in found] == [5, 13]
    assert found[0].what == ("possible contact at 4.2 s (square 1, clearance 0.001 m)",)
    assert [t.planned for t in found] == [6, 14], "from 1"
    near = recordings.near_tolerance(Findings(recorded))
    assert [t.trial for t in near] == [5, 13]
    assert all("allowed" in line for line in near[0].what)


def test_conditions_come_from_the_plan(recorded: Results) -> None:
    f = Findings(recorded)
    about = facts(conditions.test(f))
    assert about["kind of test"] == "recording of real robots"
    assert about["floor surface"] == "linoleum (15 trials); wet linoleum (3 trials); not said (2 trials)"
    assert about["place"] == "corridor 3 (18 trials); not said (2 trials)"
    assert about["attempts without a recording"] == "2"
    assert "seed" not in about
    vehicle = facts(conditions.vehicle(f, "tiago"))
    assert vehicle["software"].startswith(CONDITIONS["software"])
    said = " ".join(conditions.deviations(f))
    assert "Of 2 attempts nothing was recorded" in said
    assert "they count as attempted and as failed" in said
    assert "ended early" not in said, "nobody noted how they ended"
    assert "The legs of 16 of 18 recordings were found by motion" in said
    assert "2 of 18 recordings" in said


def test_ends_are_told_by_the_plans_own_tolerances(tmp_path: Path) -> None:
    def strict(trial: Trial) -> Trial:
        own = {"xy_tolerance": 0.0017, "yaw_tolerance": 0.25}
        untold = {"planner_xy_tolerance": np.nan, "planner_yaw_tolerance": np.nan}
        legs = tuple(replace(leg, **own, **untold) for leg in trial.attempt.legs)
        return replace(trial, attempt=replace(trial.attempt, legs=legs))

    f = Findings(write_recorded(tmp_path / "out", lacks=(strict,)))
    [missed] = [c.advice for c in causes(f, f.systems[0]) if "position" in c.words]
    assert missed.endswith(" cm off (median), 0.2 allowed")
    about = facts(conditions.vehicle(f, "tiago"))
    assert about["tolerances at the goal, of the test"] == "0.0017 m, 0.25 rad"
    assert "tolerances at the goal, of the planner" not in about
    assert "judged by a heading tolerance of 0.25 rad" in " ".join(conditions.deviations(f))


def test_an_overview_of_how_recordings_became_trials(recorded: Results) -> None:
    found = recordings.overview(Findings(recorded))
    assert found is not None
    first = [cell.text for cell in found.rows[0]]
    assert first[:2] == ["0", "1"]
    assert first[3:] == [
        "take 0.csv (vicon), take 0.mcap (bag)",
        "100",
        "98.1 %",
        "0.8 (1)",
        "0.42",
        "6.2",
        "−2.500 ± 0.004",
    ]


@pytest.mark.parametrize(
    "told",
    [
        {}, {"sources": None, "motion": 3, "clock": [1], "conditions": {}}, {"sources": {"a": {"file": None}}},
        {"motion": {"robot": {"gaps": ["x", {"start": "a"}], "seen": "much", "residual": float("nan"), "rate": None}}},
        {"clock": {"b": {"seconds": True, "sigma": None}}, "notes": ["<b>", {"k": [1, 2.5, None]}], "deep": {"er": {"still": {}}}},
    ],
)  # fmt: skip
def test_provenance_is_shown_whatever_it_holds(told: dict[str, Any], tmp_path: Path) -> None:
    results = write_recorded(
        tmp_path / "out", lacks=(lambda t: replace(t, provenance=told),), selection=Selection(batches=("NO",), speeds=(0.6,), repetitions=1),
    )  # fmt: skip
    f = Findings(results)
    assert recordings.overview(f) is not None
    [history] = recordings.histories(f)
    assert (history.trial, history.planned) == (0, None)
    page = write_report(results.path).read_text()
    assert "<b>" not in re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def test_uncertainty_stands_beside_values(recorded_page: Path) -> None:
    page = recorded_page.read_text()
    trials = json.loads(re.search(r'id="trial-rows">(.*?)</script>', page)[1])  # type: ignore[index]
    keys = [c["key"] for c in trials["columns"]]
    more = trials["rows"][0][len(keys) + 1]
    assert more[str(keys.index("DE"))] == pytest.approx(0.003)
    assert more[str(keys.index("MDO"))] == ["", "not computable: the test has no obstacle"]
    replayed = json.loads(re.search(r'id="trial-0">(.*?)</script>', page)[1])  # type: ignore[index]
    assert replayed["row"]["DE"].endswith(" ± 0.003 m")
    assert replayed["row"]["MDO"] == "not computable: the test has no obstacle"


@pytest.mark.parametrize(
    ("value", "u", "shown"),
    [(0.0521, 0.0029, "0.052 ± 0.003"), (0.0521, 0.0004, "0.0521 ± 0.0004"), (0.0521, 0.0, "0.052"), (0.0521, None, "0.052"),
     (0.0521, 1e-9, "0.052100 ± 0.000000")],
)  # fmt: skip
def test_an_uncertainty_is_never_rounded_away(value: float, u: float | None, shown: str) -> None:
    assert with_uncertainty({"DE": value, "DE_U": u}, "DE", 3) == shown


@pytest.mark.parametrize("lack", LACKS)
def test_every_figure_and_replay_of_every_kind_of_recording(lack: Any, tmp_path: Path) -> None:
    only = Selection(batches=("CE",), speeds=(0.6,), sizes=(0.15,), repetitions=1, obstacle_speeds=(0.6,))
    results = write_recorded(tmp_path / "out", lacks=(lack,), selection=only)
    for name in ("layout", "trajectories", "bars", "correlations", "trial", "clearance"):
        figure(results, name)
    write_replay(results, 0)
    assert headline(results.trials)
    assert numbers(results)
    assert representative(Findings(results).rows) is not None


def test_a_whole_directory_of_attempts_without_a_recording(tmp_path: Path) -> None:
    results = write_recorded(tmp_path / "out", lacks=(unrecorded, lambda t: unrecorded(aimless(t))))
    page = write_report(results.path).read_text()
    assert "of 20 attempts nothing was recorded" in page
    assert "TIAGo driven by an unnamed navigator" in page
    assert "with recorded" not in page
    empty = measured(next(iter(results)))
    none = replace(
        empty,
        t=np.empty(0),
        pose=np.empty((0, 3)),
        leg=np.empty(0, np.int64),
        moving_obstacles=np.empty((0, 0, 3)),
        sigma=None,
    )
    assert Packer().pack(none, 0, {})["samples"]["n"] == 0


def test_the_representative_trial_was_recorded(recorded: Results) -> None:
    rows = Findings(recorded).rows
    failed = [{**r, "success": False} for r in rows if r["configuration"] == rows[6]["configuration"]]
    assert failed[0]["trial"] == 6, "an attempt without a recording comes first"
    assert representative(failed)["trial"] == 7  # type: ignore[index]
    assert label(rows[3]).startswith("SO single, unknown set speed")


def test_clearance_over_time_of_what_is_known(crossing: Trial) -> None:
    whole = clearance_over_time(measured(crossing))
    assert whole is not None
    gap = clearance_over_time(gapped(measured(crossing)))
    assert gap is not None
    lost = np.isnan(gapped(crossing).pose[:, 0])
    assert lost.any()
    assert np.isnan(gap[lost]).all()
    np.testing.assert_array_equal(gap[~lost], whole[~lost])
    assert np.isnan(clearance_over_time(shapeless(measured(crossing)))).all()  # type: ignore[arg-type]
    flat = measured(crossing)
    turned = replace(flat, attempt=replace(flat.attempt, bodies=tuple(b for b in flat.attempt.bodies if b.pose is not None)),
                     moving_obstacles=np.empty((len(flat.t), 0, 3)), sigma=flat.sigma[:, :1])  # fmt: skip
    np.testing.assert_allclose(clearance_over_time(blind(turned)), clearance_over_time(turned), atol=1e-9)  # type: ignore[arg-type]


def test_clearance_over_time_from_people_who_look_nowhere(crossing: Trial) -> None:
    seen = measured(crossing)
    discs = tuple(replace(b, shape=Circle(0.2)) for b in seen.attempt.bodies)
    looking = replace(seen, attempt=replace(seen.attempt, bodies=discs))
    placed = tuple(b if b.pose is None else replace(b, pose=np.array([*b.pose[:2], np.nan])) for b in discs)
    nowhere = replace(
        seen, attempt=replace(seen.attempt, bodies=placed), moving_obstacles=seen.moving_obstacles * [1.0, 1.0, np.nan]
    )
    assert clearance_over_time(looking).mean() > 0.5  # type: ignore[union-attr]
    np.testing.assert_allclose(clearance_over_time(nowhere), clearance_over_time(looking), atol=1e-9)  # type: ignore[arg-type]


def test_the_replay_knows_people_from_things(crossing: Trial) -> None:
    people = tuple(replace(b, kind=BodyKind.PERSON) if b.pose is None else b for b in crossing.attempt.bodies)
    round_ = [isinstance(b.shape, Circle) for b in people if b.pose is None]
    assert round_
    packed = Packer().pack(replace(crossing, attempt=replace(crossing.attempt, bodies=people)), 0, {})
    assert [m.get("person", False) for m in packed["movingObstacles"]] == round_
    assert not any("person" in m for m in Packer().pack(crossing, 0, {})["movingObstacles"])


def test_what_the_replay_is_given_of_a_recording(crossing: Trial) -> None:
    packed = Packer().pack(aimless(measured(crossing)), 0, {})
    json.dumps(packed, allow_nan=False)
    assert packed["recorded"] is True
    assert packed["legs"][0]["goal"] == [None, None, None]
    assert packed["legs"][0]["xy"] is None
    assert "recorded" not in Packer().pack(crossing, 0, {})
    packer = Packer()
    packed = packer.pack(shapeless(measured(crossing)), 0, {})
    assert all(m["cross"] for m in packed["movingObstacles"])
    assert [b["name"] for b in packed["obstacles"]] == [
        b.name for b in crossing.attempt.bodies if b.kind == "obstacle"
    ], "a body that lies nobody knows where is left out"


def test_lines_break_where_samples_are_missing(crossing: Trial) -> None:
    keep = (crossing.t < 3.0) | (crossing.t > 4.0)
    thinned = replace(
        crossing, t=crossing.t[keep], pose=crossing.pose[keep], velocity=crossing.velocity[keep], estimate=crossing.estimate[keep],
        command=None, leg=crossing.leg[keep], moving_obstacles=crossing.moving_obstacles[keep],
    )  # fmt: skip
    assert broken(thinned) is thinned, "a simulation"
    torn = broken(measured(thinned))
    [hole] = np.flatnonzero(np.isnan(torn.pose[:, 0]))
    assert 3.0 < torn.t[hole] < 4.0
    assert len(torn.t) == len(torn.leg) == len(torn.moving_obstacles) == keep.sum() + 1
    assert broken(measured(crossing)).t is crossing.t
    assert Packer().pack(measured(thinned), 0, {})["samples"]["n"] == keep.sum() + 1


def test_a_simulation_and_its_recording_side_by_side(recorded: Results, results: Results) -> None:
    [found] = compare_all({"sim": results.trials, "real": recorded.trials})
    assert found.kind == "sim-to-real difference"
    rows = {r["indicator"]: r for r in found.differences.to_pylist() if r["batch"] is None}
    assert rows["CT"]["n"] > 5
    assert rows["CT"]["mean_difference"] == pytest.approx(0.0, abs=0.3)
    assert found.matched_by[-1] == "robot"


def test_what_the_page_says_of_an_attempt_without_a_recording(recorded: Results, recorded_page: Path) -> None:
    page = recorded_page.read_text()
    assert "18 of 20 trials were measured" in page
    assert 'trial 6</a>, no. 7 in the test plan; <a href="#replay-14">' in page
    [history] = [h for h in recordings.histories(Findings(recorded)) if h.trial == 6]
    assert facts(history.told) == {"how it ended": "aborted: attempted, not recorded", "note": "drove into the bed"}


def test_what_readers_noticed_is_told_once(recorded: Results) -> None:
    [said] = recordings.reader_notes(Findings(recorded))
    assert re.fullmatch(r"trials 0, 1, .*: mm scaled to m", said)


def test_numbers_of_a_provenance_have_units() -> None:
    told = recordings.tree(
        {"motion": {"robot": {"rate": 50.000000000001, "residual": 0.00060547, "seen": 0.9914, "swapped": 2,
                              "gaps": [{"start": 3.0, "end": 3.8, "filled": ""}, {"start": 7.0, "end": 7.1, "filled": "spline"}]}},
         "clock": {"log": {"seconds": 1.510510607, "sigma": 0.0090572, "note": "+1.51 s +- 0.01 s"}}}
    )  # fmt: skip
    robot, log = (facts(facts(facts(told)[a])[b]) for a, b in (("motion", "robot"), ("clock", "log")))
    assert robot == {"rate": "50 Hz", "residual": "0.6055 mm", "seen": "99.14 %", "swapped": "2 frames",
                     "gaps": "3.00 to 3.80 s (left open); 7.00 to 7.10 s (filled by spline)"}  # fmt: skip
    assert log == {"seconds": "1.511 s", "sigma": "0.009057 s", "note": "+1.51 s ± 0.01 s"}


def test_too_few_trials_for_strong_words(tmp_path: Path) -> None:
    few = Selection(batches=("SO",), speeds=(0.6,), sizes=(0.15,), gaps=(1.0,), repetitions=1)
    f = Findings(write_recorded(tmp_path / "out", lacks=(lambda t: t,), selection=few))
    assert 3 <= len(f.rows) < 10
    table, [kept] = outcomes.correlations(f)
    assert table is not None
    said = [cell.small for row in table.rows for cell in row if cell.small]
    assert said
    assert all(words.startswith("too few trials (n = ") for words in said)
    assert f"too few trials (n = {len(f.rows)}) to call an indicator redundant" in kept


def test_what_nobody_recorded_is_unknown_and_yet_a_failure(recorded: Results, tmp_path: Path) -> None:
    precise = first_line(Findings(recorded)).shares[2]
    assert (precise.yes, precise.judged, precise.note) == (12, 14, "6 not known, 2 of these to be confirmed")
    four = Selection(
        batches=("SO",), configurations=("single",), speeds=(0.6,), sizes=(0.15,), gaps=(1.0,), repetitions=4
    )
    logged = (lambda t: t, lambda t: replace(t, estimate=None), unrecorded)
    results = write_recorded(tmp_path / "out", lacks=logged, selection=four)
    free, arrived, precise = first_line(Findings(results)).shares
    assert (free.yes, free.judged, free.note) == (3, 3, "1 not known")  # of one nothing was recorded
    assert (precise.yes, precise.judged) == (3, 4)
    assert (arrived.yes, arrived.judged, arrived.note) == (2, 3, "1 not known")  # of one nobody knows its own estimate


def test_nothing_is_said_of_the_robots_own_estimate_where_nobody_knows_it(tmp_path: Path) -> None:
    four = Selection(
        batches=("SO",), configurations=("single",), speeds=(0.6,), sizes=(0.15,), gaps=(1.0,), repetitions=4
    )

    def unlogged(trial: Trial) -> Trial:
        return replace(trial, estimate=None)

    def stopped(trial: Trial) -> Trial:
        return replace(unlogged(trial), outcome=Outcome.ABORTED, reason="emergency stop")

    results = write_recorded(tmp_path / "out", lacks=(unlogged, unlogged, stopped, unrecorded), selection=four)
    f = Findings(results)
    assert [r["success_self"] for r in f.rows] == [None, None, None, False]
    _, arrived, precise = first_line(f).shares
    assert (precise.yes, precise.judged) == (2, 4)
    assert (arrived.interval, arrived.note) == (None, "4 not known")
    assert [r["SR_self"] for r in f.rates] == [None]
    assert [row[4].text for row in outcomes.batches(f, f.systems[0]).rows] == ["–"]
    assert re.search(r" 4 +50 \(7-93\) +- +50 ", headline(results.trials))
    cell = r'data-name="Arrived">\s*<span class="share">–</span>\s*<small>4 not known</small></td>'
    assert re.search(cell, write_report(results.path).read_text())


def test_times_of_legs_found_by_motion_are_footnoted(recorded: Results, results: Results) -> None:
    for there, said in ((recorded, True), (results, False)):
        f = Findings(there)
        assert f.by_motion is said
        assert ("the thinking before the first motion" in outcomes.batches(f, f.systems[0]).caption) is said
