"""The page's first screen: success taken apart on the same tests, what to fix, and three sentences made from the numbers."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from synthetic_results import write_campaign

from clearway.reports.causes import causes, causes_of_all, failures, of_slack, what_happened
from clearway.reports.findings import Findings
from clearway.reports.same_tests import same_tests
from clearway.reports.selection import System, verdict
from clearway.reports.summary import _of_many, _too_fast, _who, summary
from clearway.reports.verdicts import Share, arrived, collision_free, precise, verdicts
from clearway.reports.words import contact
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection
from clearway.statistics import wilson_interval
from clearway.trials.store import Results

PLAIN: dict[str, Any] = {
    "suite": "s", "batch": "SO", "configuration": "single", "speed": 0.6, "obstacle_speed": None, "size": None, "gap": None,
    "repetition": 1, "setup": None, "outcome": "reached", "failure": "", "reason": "", "success": True, "success_self": True,
    "success_slack": True, "CT": 20.0, "MDO": 0.3, "MDO_walls": None, "barn_score": None, "DE_max": 0.1, "OE_max": 0.01,
    "duration": 20.0, "moved_at_contact": "", "avoidable": "", "tuned": "", "source": "simulated", "privileged": False,
}  # fmt: skip
MISSED = {"success": False, "failure": "DE"}
CRASHED = {"outcome": "collision", "failure": "collision", "success": False, "success_self": False, "success_slack": False,
           "CT": None, "moved_at_contact": "both", "reason": "contact with moving obstacle 'm'", "avoidable": "planner's fault"}  # fmt: skip
BUMPED = CRASHED | {"failure": "collision at rest", "moved_at_contact": "obstacle"}


def made_up(*systems: tuple[str, str, list[dict[str, Any]]], privileged: tuple[str, ...] = ()) -> Any:
    """Findings of hand-made rows, of each system a list of what is different in its trials from a plain success."""
    rows: list[dict[str, Any]] = []
    for robot, navigator, trials in systems:
        for i, trial in enumerate(trials):
            rows.append(
                PLAIN | {"robot": robot, "navigator": navigator, "scenario": f"t{i}", "trial": len(rows)} | trial
            )
    found: dict[System, list[dict[str, Any]]] = {}
    for r in rows:
        found.setdefault(System(r["robot"], r["navigator"], None), []).append(r)
    return SimpleNamespace(
        rows=rows, systems=list(found), of=found.__getitem__, privileged=frozenset(privileged), title=str.upper,
        tolerances={(s, "DE_max"): 0.176 for s in found}, planner_tolerances={}, name=lambda s: f"{s.robot} {s.navigator}",
    )  # fmt: skip


def only(f: Any) -> Any:
    (group,) = same_tests(f)
    return verdicts(f, group)


def test_each_question_is_within_the_one_before() -> None:
    for trial, expected in (
        ({}, (True, True, True)), (MISSED, (True, True, False)), (CRASHED, (False, False, False)), (BUMPED, (False, False, False)),
        ({"outcome": "timeout", "failure": "timeout", "success": False, "success_self": False}, (True, False, False)),
        ({"success_self": False}, (True, True, True)),  # a judge ended the test by the true pose
        ({"success": None, "success_self": None, "failure": None}, (True, None, None)),
        ({"outcome": "aborted", "failure": "aborted", "success": False, "success_self": False, "duration": 0}, (None, False, False)),
    ):  # fmt: skip
        row = PLAIN | trial
        assert (collision_free(row), arrived(row), precise(row)) == expected


def test_systems_are_compared_on_the_tests_that_all_of_them_ran() -> None:
    f = made_up(("a", "x", [{}] * 8), ("b", "x", [{}] * 6 + [MISSED] * 2), ("c", "x", [MISSED] * 6), ("d", "x", [{}]))
    together, alone = same_tests(f)
    assert [s.robot for s in together.systems] == ["a", "b", "c"]
    assert (together.n, together.left_out) == (6, 4)
    assert [s.robot for s in alone.systems] == ["d"]  # one test of six: it would take the others' away
    assert {len(rows) for rows in together.rows.values()} == {6}
    for i in range(6):
        assert len({rows[i]["scenario"] for rows in together.rows.values()}) == 1
    assert [line.shares[2].yes for line in verdicts(f, together).lines] == [6, 6, 0]


def test_robots_of_one_simulation_are_paired_by_name_and_their_dependence_is_told() -> None:
    def met(robot: str, *trials: dict[str, Any]) -> tuple[str, str, list[dict[str, Any]]]:
        names = ("robot", "robot 2") if robot == "a" else ("robot 2", "robot")
        return (
            robot,
            "x",
            [t | {"scenario": "s", "run": robot, "member": m} for t, m in zip(trials, names, strict=True)],
        )

    f = made_up(met("a", {}, MISSED), met("b", MISSED, {}))
    (group,) = same_tests(f)
    for s in group.systems:
        assert [r["member"] for r in group.rows[s]] == ["robot", "robot 2"]
        assert [r["success"] for r in group.rows[s]] == [True, False]
    assert (
        "4 of the trials are of robots that met each other in 2 simulations: they are not independent"
        in only(f).caption
    )
    apart = made_up(("a", "x", [{"run": "1", "member": "robot"}, {"run": "2", "member": "robot"}]))
    assert "met each other" not in only(apart).caption


def test_who_drove_what_is_told_where_not_all_drove_all() -> None:
    def who(*systems: tuple[str, str]) -> str:
        f: Any = SimpleNamespace(title=str.upper)
        return _who([System(robot, navigator, None) for robot, navigator in systems], f)

    assert who(("a", "x"), ("a", "y"), ("b", "x"), ("b", "y")) == "A and B, each driven by x and y"
    assert who(("a", "x"), ("b", "y")) == "A driven by x and B driven by y"
    assert who(("a", "recorded")) == "A driven by an unnamed navigator"  # of a test plan that names none


def test_a_difference_is_shown_by_the_paired_test_alone() -> None:
    clear = only(made_up(("a", "x", [{}] * 20), ("b", "x", [{}] * 10 + [MISSED] * 10)))
    first, second = clear.lines
    assert (first.shares[2].against, second.shares[2].against) == ("highest", "−50 points [−70, −24]")
    assert second.shares[2].shown
    assert second.shares[0].against == ""  # none of them touched anything
    i = wilson_interval(10, 20)
    assert "Wilson's 95 % interval, which is shorter than the exact one that SR has" in clear.caption
    assert second.shares[2].percent == f"50 % [{100 * i.low:.0f}, {100 * i.high:.0f}]"
    unclear = only(made_up(("a", "x", [{}] * 20), ("b", "x", [{}] * 15 + [MISSED] * 5)))
    low = unclear.lines[1].shares[2]  # 0 against 5: McNemar's p is 2 / 32
    assert not low.shown
    assert low.doubtful
    assert low.against.endswith("no difference shown")
    assert "some intervals leave out 0 and yet nothing is shown" in unclear.caption
    assert "some intervals" not in clear.caption


def test_times_are_of_the_tests_that_all_finished() -> None:
    fast = [{"CT": 10.0}] * 6 + [{"CT": 90.0}] * 2
    slow = [{"CT": 12.0}] * 6 + [CRASHED] * 2
    found = only(made_up(("a", "x", fast), ("b", "x", slow)))
    assert found.finished == 6
    assert [line.time for line in found.lines] == ["10.0 s", "12.0 s"]
    assert found.timed == "median of 6 tests that all finished"
    few = only(made_up(("a", "x", fast[:4]), ("b", "x", slow[:4])))
    assert [line.time for line in few.lines] == ["–", "–"]
    assert few.timed == "all finished 4 tests: fewer than 5 are not compared"
    assert only(made_up(("a", "x", fast[:1]))).timed == "median of 1 test"


def test_a_navigator_that_was_told_the_truth_is_a_reference() -> None:
    found = only(
        made_up(("a", "x", [MISSED] * 9), ("a", "oracle", [{}] * 9), ("a", "y", [{}] * 9), privileged=("oracle",))
    )
    assert [line.navigator for line in found.lines] == ["y", "x", "oracle (was told the truth)"]
    assert found.lines[2].shares[2].against == ""


def test_almost_all_is_not_called_all() -> None:
    found = only(made_up(("a", "x", [{}] * 499 + [CRASHED])))
    assert found.lines[0].shares[0].percent == "99.8 % [99, 100]"


def test_no_interval_says_that_nothing_will_ever_fail() -> None:
    def percent(yes: int) -> str:
        return Share(yes, 4000, wilson_interval(yes, 4000)).percent

    assert percent(4000) == "100 % [99.9, 100]"
    assert percent(3999) == "100.0 % [99.9, 100]"
    assert percent(0) == "0 % [0, 0.1]"


def test_who_finished_nothing_among_obstacles_is_not_far_from_them() -> None:
    free = {"MDO": None, "MDO_walls": 3.2, "not_computable": '{"MDO": "the test has no obstacle"}'}
    stuck = {"MDO": None, "CT": None, "not_computable": '{"MDO": "leg forth was not finished (timeout)"}'} | MISSED
    near, far = only(made_up(("a", "x", [free, {}, {"MDO": 0.1}]), ("a", "y", [free, stuck, stuck]))).lines
    assert near.nearest == ("0.20 m", "least 0.10 m, of 2 trials")
    assert far.nearest == ("–", "no finished trial with obstacles")
    alone = only(made_up(("a", "y", [free, stuck]))).lines[0]
    assert alone.nearest == ("–", "no finished trial with obstacles")
    walls = only(made_up(("a", "y", [free, free]))).lines[0]
    assert walls.nearest == ("3.20 m", "least 3.20 m, from walls")


def result_of(*trials: list[dict[str, Any]]) -> str:
    return _of_many(only(made_up(*(("a", f"n{i}", rows) for i, rows in enumerate(trials)))).lines)


def test_equally_good_systems_are_told_as_equal() -> None:
    good, bad = [{}] * 4, [{}, MISSED, MISSED, CRASHED]
    assert result_of(good, good, good, good) == (
        "All 4 were equally often successful, 4 of 4 tests each. None of them touched anything."
    )
    assert result_of(good, bad, [{}, {}, MISSED, MISSED], bad) == (
        "Most often successful: A with n0, 4 of 4 tests; least often: A with n1 and A with n3, 1 of 4 tests each. "
        "2 of 4 touched something, A with n1 and A with n3 most often (1 of 4 tests each)."
    )
    assert result_of(*[good] * 4, bad).startswith("Most often successful: 4 systems alike, 4 of 4 tests each; least")


def test_causes_are_counted_and_the_typical_trial_is_the_middle_one() -> None:
    trials = [MISSED | {"DE_max": d} for d in (0.21, 0.4, 0.22)] + [BUMPED] * 2 + [{}] + [CRASHED]
    trials += [{"outcome": "timeout", "failure": "timeout", "success": False, "reason": "too long"}] * 4
    f = made_up(("a", "x", trials))
    found = causes(f, f.systems[0])
    assert [c.count for c in found] == [4, 3, 2]
    assert "too long" in found[0].advice
    assert found[1].trial == 2
    assert found[1].advice.endswith("the worst end is 22.0 cm off (median), 17.6 allowed")
    f.planner_tolerances = {(f.systems[0], "DE_max"): 0.1}
    assert causes(f, f.systems[0])[1].advice.endswith("17.6 allowed, 10.0 told to the planner")
    assert found[2].words == "the moving obstacle drove into it while it stood"
    assert failures(f.rows) == 10
    for row in f.rows:  # nobody is blamed
        assert "fault" not in what_happened(row)
    both = made_up(("a", "x", trials), ("b", "x", [MISSED] * 3 + [{}] * 8))
    assert next((c.count, c.who) for c in causes_of_all(both)) == (6, "a x: 3 of them")


def test_who_is_placed_in_a_wall_is_not_told_that_it_drove_into_it() -> None:
    placed = BUMPED | {
        "reason": "contact with wall 'west' where it was placed",
        "moved_at_contact": "",
        "avoidable": "too late",
    }
    f = made_up(("a", "x", [placed, {}]))
    (cause,) = causes(f, f.systems[0])
    assert cause.words == "it was placed in contact with wall 'west'"
    assert cause.advice.endswith("more room than placement_xy and placement_yaw take")
    assert verdict(f.rows[0]) == "placed in contact"


@pytest.mark.parametrize(
    ("reason", "words", "short", "advice"),
    [
        ("emergency stop", "was stopped by the operator", "stopped", "see the note of the trial: “a cart”"),
        ("aborted by the operator; not recorded", "was stopped by the operator", "stopped", "see the note of the trial: “a cart”"),
        ("emergency stop; the recording cannot be used: a.csv: is empty", "was stopped by the operator", "stopped", "see the note of the trial: “a cart”"),
        ("a person had to help", "a person had to help", "helped", "see the note of the trial: “a cart”"),
        ("attempted; the recording cannot be used: a.csv: is empty", "the recording can't be used: a fault of the data, not of the robot",
         "recording can't be used", "mend the recording: “a.csv: is empty”"),
        ("attempted, not recorded", "nothing was recorded, nor noted how it ended", "not recorded", "see the note of the trial: “a cart”"),
        ("leg back: the recording ends at 3.0 s, while the robot moves", "the recording ends while the robot moves", "recording cut off",
         "give all of it, or note in the test plan what happened: “leg back: the recording ends at 3.0 s, while the robot moves”"),
        ("leg back was not finished", "did not finish", "did not finish", "see in the replay where it stayed: “leg back was not finished”"),
    ],
)  # fmt: skip
def test_only_what_a_person_stopped_is_called_stopped(reason: str, words: str, short: str, advice: str) -> None:
    ended = {
        "outcome": "aborted",
        "failure": "aborted",
        "success": False,
        "source": "recorded",
        "reason": reason,
        "note": "a cart",
    }
    there = not any(said in reason for said in ("not recorded", "cannot be used"))
    f = made_up(("a", "x", [ended | {"duration": 9.0 if there else 0.0}] * 2))
    assert verdict(f.rows[0]) == short
    [found] = causes(f, f.systems[0])
    assert (found.words, found.count, found.advice) == (words, 2, advice)


def test_people_and_robots_are_not_called_obstacles() -> None:
    met = CRASHED | {"reason": "contact with robot 'robot 2'"}
    assert [contact(PLAIN | met | {"touched": kind}) for kind in ("robot", "person", "furniture", None)] == [
        "met another robot while both moved",
        "met a person while both moved",
        "met an obstacle while both moved",
        "met an obstacle while both moved",
    ]


def test_the_localisation_is_named_only_where_the_robot_took_itself_to_be_right() -> None:
    forgiven = MISSED | {"success_slack": True}
    assert (
        of_slack(
            [PLAIN | forgiven, PLAIN | forgiven | {"success_self": False}, PLAIN | MISSED | {"success_slack": False}]
        )
        == 1
    )


def test_the_sentences_say_the_numbers(results: Results) -> None:
    f = Findings(results)
    found = [verdicts(f, group) for group in same_tests(f)]
    said = summary(f, found)
    n, tiago = len(f.of(f.systems[1])), next(line for line in found[0].lines if line.name == "TIAGo")
    assert f"{n} tests each, the same for both" in said.tested
    assert "(simulated)" in said.tested
    good = sum(r["success"] for r in f.rows if r["robot"] == "tiago")
    assert tiago.shares[2].yes == good
    assert f"stood within tolerance by its true pose in {good} of {n} tests" in said.result
    assert "simulated" in said.limits
    assert "only a part of the paper's protocol" in said.limits
    assert "repetitions of one test are alike" in said.limits
    assert "at most" not in said.limits
    slow = load_robot("tiago")
    slow = slow.model_copy(update={"drive": slow.drive.model_copy(update={"v_max": 0.5})})
    f.__dict__["robots"] = dict(f.robots) | {"tiago": slow}
    assert "; TIAGo drives 0.5 m/s at most: its tests at" in summary(f, found).limits


def test_of_many_groups_of_tests_a_few_are_told_and_that_there_are_more(results: Results) -> None:
    f = Findings(results)
    (one,) = (verdicts(f, group) for group in same_tests(f))
    alone, three, five = (summary(f, [one] * k).result for k in (1, 3, 5))
    assert three == " ".join([alone] * 3)
    assert five == f"{three} What came out of 2 other groups of tests stands in the tables."


def test_the_page_begins_with_it_and_has_no_cards(report: Path) -> None:
    page = report.read_text(encoding="utf-8")
    body = page[page.index("<body>") :]
    assert (
        body.index("<strong>Tested.</strong>")
        < body.index('class="verdicts"')
        < body.index('id="fix"')
        < body.index("<nav")
    )
    assert "all batches, finished trials" not in page
    assert 'class="card"' not in page


def test_a_suite_of_one_test_makes_a_page(tmp_path: Path) -> None:
    from clearway.reports import write_report

    one = Selection(batches=("NO",), speeds=(0.6,), repetitions=1)
    page = write_report(write_campaign(tmp_path / "out", robots=("tiago",), selection=one).path)
    assert "1 test" in page.read_text(encoding="utf-8")
    assert pytest.approx(0.2, abs=0.01) == wilson_interval(1, 1).low


def test_set_speeds_beyond_a_robots_own_are_one_test() -> None:
    f = made_up(("a", "x", [{"speed": v} for v in (0.2, 0.6, 1.0)]), ("b", "x", [{"speed": v} for v in (0.2, 0.6)]))
    f.robots = {name: SimpleNamespace(drive=SimpleNamespace(v_max=v)) for name, v in (("a", 0.306), ("b", 0.6))}
    said = _too_fast(f)
    assert said == [
        "A drives 0.306 m/s at most: its tests at 0.6 and 1 m/s are one test at that, but for when moving obstacles meet it"
    ]
    f.rows[2]["source"] = "recorded"
    assert _too_fast(f) == ["A drives 0.306 m/s at most: its tests at 0.6 m/s are driven at that"]
