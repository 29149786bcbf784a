"""Campaigns end in the same bytes whatever the number of workers, and what goes wrong in one is recorded, or told before it runs."""

from __future__ import annotations

import dataclasses
import json
import re
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from own_plans import LONE, OWN, contents, plan, robot_file

import clearway.robots
import clearway.world
from clearway.campaigns import CampaignPlan, run_campaign
from clearway.campaigns.plan_checks import _cannot_be_made, check_plan
from clearway.campaigns.pool import Fate
from clearway.campaigns.worker import run_trials
from clearway.errors import ClearwayError
from clearway.indicators import score_row
from clearway.reports.findings import Findings
from clearway.robots import load_robot
from clearway.scenarios.suites import Selection
from clearway.trials import Outcome, Trial
from clearway.trials.trial_tables import to_tables


def alone(asked: CampaignPlan, number: int) -> Trial:
    """One trial of a campaign, in this process."""
    specs = asked.specs()
    (trial,) = run_trials(asked, specs[number : number + 1], check_plan(asked, specs))
    return trial


def test_set_speeds_beyond_a_robots_own_are_told_before_the_first_trial(tmp_path: Path) -> None:
    selection = Selection(batches=("NO",), repetitions=1)
    asked = dataclasses.replace(plan(), robots=("turtlebot3-waffle", "tiago"), selection=selection)
    told: list[str] = []
    run_campaign(asked, tmp_path / "r", 1, progress=lambda *_: told.append("runs"), told=told.append)
    title = load_robot("turtlebot3-waffle").title
    assert told[:2] == [
        f"{title} drives 0.26 m/s at most: its tests at 0.6 and 1 m/s are one test at that, but for when moving obstacles meet it",
        "runs",
    ]


def test_the_bytes_do_not_depend_on_the_workers(tmp_path: Path) -> None:
    told: list[tuple[int, int, str]] = []
    one = run_campaign(plan("Drives", "Raises"), tmp_path / "one", 1, progress=lambda *a: told.append(a))
    run_campaign(plan("Drives", "Raises"), tmp_path / "two", 2)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert [t[:2] for t in told] == [(i, 4) for i in range(5)]
    assert told[-1][2].startswith("2 failed: ")
    rows = one.trials.to_pylist()
    assert [r["outcome"] for r in rows] == ["reached"] * 2 + ["navigator_failed"] * 2
    assert rows[0]["id"] == f"hospital/NO-v0.6-r1/tiago/{OWN}:Drives"
    assert one.trial(0).timing["wall"] > 0
    assert one.campaign["run"]["finished"] >= one.campaign["run"]["started"]


@pytest.mark.parametrize(
    ("navigator", "says"),
    [
        ("Raises", "RuntimeError: lost"),
        ("NotANumber", "not finite"),
        ("Exits", "sys.exit(3)"),
        ("Hangs", "took longer than 0.2 s for a decision"),
    ],
)
def test_a_navigator_that_fails_is_recorded(tmp_path: Path, navigator: str, says: str) -> None:
    results = run_campaign(plan(navigator, repetitions=1, decision_limit=0.2), tmp_path, 1)
    trial = results.trial(0)
    assert trial.outcome is Outcome.NAVIGATOR_FAILED
    assert says in trial.reason
    assert results.trials.column("reason")[0].as_py() == trial.reason
    assert any("Traceback" in e.detail for e in trial.events)
    if navigator == "Raises":
        assert any("own_navigators.py" in e.detail for e in trial.events)


def test_what_breaks_in_the_world_is_recorded_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: Any, **__: Any) -> None:
        raise ZeroDivisionError("a bug of ours")

    monkeypatch.setattr(clearway.world, "simulate_all", breaks)
    trial = alone(plan(), 1)
    assert trial.reason == "ZeroDivisionError: a bug of ours"
    assert "in breaks" in trial.events[0].detail
    assert score_row(trial)["success"] is False
    assert trial.attempt.labels.repetition == 2


def test_what_breaks_as_a_scenario_is_built_is_not_the_navigators_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: Any, **__: Any) -> None:
        raise MemoryError("no room for the floor")

    monkeypatch.setattr(sys.modules["clearway.world.simulate"], "behaviours_of", breaks)
    trial = alone(plan(), 1)
    assert (trial.outcome, trial.reason) == (Outcome.SCENARIO_FAILED, "MemoryError: no room for the floor")
    assert score_row(trial)["success"] is None


def test_a_trial_that_broke_says_all_that_it_attempted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    selection = Selection(batches=("CE",), speeds=(0.6,), obstacle_speeds=(0.6,), sizes=(0.3,), repetitions=1)
    asked = dataclasses.replace(plan("Knows", setups=("5 iterations",)), selection=selection)
    (whole,) = run_campaign(asked, tmp_path / "whole", 1)
    monkeypatch.setattr(clearway.world, "simulate_all", lambda *_, **__: 1 / 0)
    broken = alone(asked, 0)
    assert broken.outcome is Outcome.NAVIGATOR_FAILED
    assert whole.attempt.privileged
    assert whole.attempt.tracking == "kalman"
    attempts = [to_tables(0, trial)["attempts"].to_pylist()[0] for trial in (whole, broken)]
    first, second = (json.loads(a["attempt"]) | {"reason": "", "known": []} for a in attempts)
    assert first == second
    assert [b["kind"] for b in first["bodies"]] == ["obstacle", "moving obstacle"]
    assert broken.moving_obstacles.shape == (1, 1, 3)
    assert attempts[0]["fixtures"] == attempts[1]["fixtures"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"suites": ("hospitl",)}, "did you mean 'hospital'"),
        ({"robots": ("tiaggo",)}, "did you mean 'tiago'"),
        ({"navigators": ("move_base",)}, "did you mean 'move-base'"),
        ({"localisation": "gps"}, "unknown localisation 'gps'"),
        ({"selection": Selection(batches=("XX",))}, "unknown batch 'XX'"),
        ({"map": "no/such/map.yaml"}, "map.yaml"),
        ({"navigators": (f"{OWN}:Dodges",), "tracking": "kalmann"}, "unknown tracking 'kalmann'"),
        ({"navigators": (f"{OWN}:Drives",), "options": {f"{OWN}:Drives": {"speed": 1}}}, "unknown option 'speed'"),
    ],
)
def test_what_is_wrong_is_said_before_anything_runs(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    with pytest.raises(ClearwayError, match=says) as caught:
        run_campaign(CampaignPlan(**({"suites": ("hospital",), "robots": ("tiago",)} | change)), tmp_path / "out", 1)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_a_robot_that_sees_nothing_is_one_clear_line(tmp_path: Path) -> None:
    text = (Path(clearway.robots.__file__).parent / "tiago.toml").read_text(encoding="utf-8")
    blind = re.sub(r"^\[lidar\]$.*?(?=^\[)", "", text, flags=re.MULTILINE | re.DOTALL)
    (tmp_path / "blind.toml").write_text(blind.replace('"tiago"', '"blind"', 1), encoding="utf-8")
    asked = CampaignPlan(
        ("hospital",), robots=(str(tmp_path / "blind.toml"),), navigators=(f"{OWN}:Dodges",), localisation="odometry"
    )
    with pytest.raises(ClearwayError, match="neither a camera nor a lidar to perceive obstacles with") as caught:
        run_campaign(asked, tmp_path / "out", 1)
    assert "\n" not in str(caught.value)


def test_obstacles_are_followed_for_a_navigator_that_needs_them(tmp_path: Path) -> None:
    """In the hospital, by the lidar: it is said how in the trial, and the same trial comes out every time."""
    asked = plan("Dodges", repetitions=1, tracking="difference")
    trials = [list(run_campaign(asked, tmp_path / name, 1)) for name in "ab"]
    assert [t.attempt.tracking for t in trials[0]] == ["difference"]
    assert trials[0][0].outcome != Outcome.NAVIGATOR_FAILED
    assert trials[0][0].pose.tobytes() == trials[1][0].pose.tobytes()
    alone = run_campaign(plan("Drives", repetitions=1), tmp_path / "c", 1).trial(0)
    assert alone.attempt.tracking == ""


def test_a_robot_with_the_name_of_another_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=r"mine.toml: name: 'tiago' is the name of the robot 'tiago' too.*another"):
        dataclasses.replace(plan(), robots=(str(robot_file(tmp_path, d_base=0.6)),)).specs()
    with pytest.raises(ClearwayError, match="the same one: take one away"):
        dataclasses.replace(plan(), robots=("tiago", str(robot_file(tmp_path)))).specs()
    assert dataclasses.replace(plan(), robots=(str(robot_file(tmp_path)),)).specs()
    assert dataclasses.replace(plan(), robots=("tiago", str(robot_file(tmp_path, name="mine", d_base=0.6)))).specs()


def test_a_robot_of_a_scenario_with_the_name_of_another_is_refused(tmp_path: Path) -> None:
    """Else its trials would be pooled with those of the other, and told with its parameters."""
    own = tmp_path / "scenario.toml"
    file = robot_file(tmp_path, d_base=0.6)
    legs = 'legs = [{ name = "back", goal = [-2.0, 2.0, 0.0], time_limit = 60.0 }]\n'
    own.write_text(LONE + f'[[robots]]\nname = "east"\nstart = [2.0, 2.0, 3.1]\nrobot = "mine.toml"\n{legs}')
    asked = CampaignPlan((str(own),), robots=("tiago",), navigators=(f"{OWN}:Drives",))
    with pytest.raises(ClearwayError, match=r"mine.toml: name: 'tiago' is the name of the robot 'tiago' too.*another"):
        run_campaign(asked, tmp_path / "out", 1)
    assert not (tmp_path / "out").exists()
    robot_file(file.parent)
    time.sleep(0.01)
    check_plan(asked, asked.specs())  # the very same robot by another way


def test_a_robots_own_file_is_what_the_results_know_of_it(tmp_path: Path) -> None:
    mine = str(robot_file(tmp_path, name="mine", title="My TIAGo", d_base=0.6))
    results = run_campaign(dataclasses.replace(plan(), robots=(mine,)), tmp_path / "out", 1)
    assert results.trials.column("robot").to_pylist() == ["mine"] * len(results)
    assert results.campaign["robots"]["mine"]["d_base"] == 0.6
    assert Findings(results).title("mine") == "My TIAGo"


def test_the_same_trial_twice_is_refused(tmp_path: Path) -> None:
    suites = tmp_path / "suite.toml", tmp_path / "copy.toml"
    legs = '[[legs]]\nname = "forth"\ngoal = [2.0, 0.0, 0.0]\ntime_limit = 60.0\n'
    for suite in suites:
        suite.write_text(
            'name = "s"\n[[scenario]]\nname = "x"\nfloor_plan = "hall"\nstart = [0.0, 0.0, 0.0]\nspeed = 0.5\n'
            + legs.replace("[[legs]]", "[[scenario.legs]]")
        )
    with pytest.raises(ClearwayError, match="one and the same"):
        CampaignPlan(tuple(map(str, suites)), ("tiago",)).specs()


def test_what_a_navigator_cannot_be_made_for_is_one_line() -> None:
    fate = Fate("cannot go on (RuntimeError: first line\nsecond line)", "")
    with pytest.raises(ClearwayError, match=r"^navigator 'own' cannot be made: .*first line second line\)"):
        _cannot_be_made(fate, plan(), dataclasses.replace(plan().specs()[0], navigator="own"), has_map=False)
