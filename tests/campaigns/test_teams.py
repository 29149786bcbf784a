"""Which robots take part in scenarios of several robots, and which navigator drives which."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import clearway
from clearway.campaigns.by_robot import navigator_of
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.rerun import rerun
from clearway.errors import ClearwayError
from clearway.reports import write_report
from clearway.robots import load_robot
from clearway.scenarios.suite import Selection
from clearway.scenarios.suites import load_suite
from clearway.scenarios.teams import read_team, write_team

OWN = Path(__file__).with_name("own_navigators.py")


@given(st.lists(st.sampled_from(["tiago", "hosbot", "rescue:lidar"]), min_size=1, max_size=40))
def test_a_team_is_read_as_it_is_written(team: list[str]) -> None:
    assert read_team(write_team(team)) == tuple(team)


def test_a_team_is_read() -> None:
    assert read_team("tiago*2+hosbot") == ("tiago", "tiago", "hosbot")
    assert read_team(" tiago * 2 + hosbot ") == ("tiago", "tiago", "hosbot")
    assert write_team(("tiago", "tiago", "hosbot")) == "tiago*2+hosbot"


def built(team: str, suite: str = "meeting-points", **chosen: Any) -> list[Any]:
    members = read_team(team)
    return load_suite(suite).build(load_robot(members[0]), Selection(team=members, **chosen))


def test_scenarios_are_made_for_as_many_robots_as_the_team_has_and_for_its_largest() -> None:
    (alone, *_), (mixed, *_) = built("tiago*3", batches=("doorway",)), built("tiago*2+husky", batches=("doorway",))
    assert [len(s.tested()) for s in (alone, mixed)] == [3, 3]
    assert [r.robot for r in mixed.robots] == ["tiago", "husky"]
    assert (alone.floor_plan, mixed.floor_plan) == ("meeting-points-doorway-0.6", "meeting-points-doorway-1.2")
    assert mixed.labels.configuration == "3"


def test_of_other_suites_those_scenarios_are_chosen_that_are_for_so_many() -> None:
    pair = built("hosbot+tiago", "people")
    assert {s.labels.configuration for s in pair} == {"two robots"}
    assert {s.robots[0].robot for s in pair} == {"tiago"}
    four = CampaignPlan(("people",), selection=Selection(team=read_team("tiago*3+hosbot"), repetitions=1)).specs()
    assert [spec.robots[spec.member] for spec in four] == ["tiago", "tiago", "tiago", "hosbot"]


@pytest.mark.parametrize(
    ("team", "suite", "problem"),
    [
        ("tiago*0", "meeting-points", "'tiago*0' is no part of a team"),
        ("tiago*-1", "meeting-points", "'tiago*-1' is no part of a team"),
        ("tiago*two", "meeting-points", "'tiago*two' is no part of a team"),
        ("tiago++hosbot", "meeting-points", "'' is no part of a team"),
        ("", "meeting-points", "'' is no part of a team"),
        ("tiago*10000", "meeting-points", "has more robots than a scenario may, 101"),
        ("tiago*99999999999", "meeting-points", "is no part of a team"),
        ("tiago*33", "meeting-points", "33 robots are more than the floors of the suite 'meeting-points' hold; at most 32"),
        ("tiago", "meeting-points", "'tiago' is one robot, and no team"),
        ("tiago+tiagoo", "meeting-points", "unknown robot 'tiagoo'; did you mean 'tiago'?"),
        ("tiagoo+tiago", "meeting-points", "unknown robot 'tiagoo'; did you mean 'tiago'?"),
        ("tiago*2", "barn", "its scenarios are for one robot each"),
        ("tiago*3", "people", "its scenarios of several robots are for 2, 4 of them"),
    ],
)  # fmt: skip
def test_a_wrong_team_is_one_clear_error_before_anything_runs(
    tmp_path: Path, team: str, suite: str, problem: str
) -> None:
    with pytest.raises(ClearwayError, match=re.escape(problem)):
        CampaignPlan((suite,), selection=Selection(team=read_team(team))).specs()


def test_a_team_replaces_the_robots() -> None:
    team = Selection(team=("hosbot", "tiago"))
    assert CampaignPlan(("people",), selection=team).robots == ("hosbot",)
    with pytest.raises(ClearwayError, match="a team says which robots take part; leave out --robot"):
        CampaignPlan(("people",), robots=("tiago",), selection=team)
    plan = CampaignPlan(("people",), selection=team)
    assert CampaignPlan.from_json(plan.to_json()) == plan


@pytest.mark.parametrize(
    ("asked", "robot", "driver"),
    [
        ("orca", "tiago", "orca"),
        ("hp-st[without=reverse+contours,layers=3]", "tiago", "hp-st[without=reverse+contours,layers=3]"),
        ("tiago=hp-st,hosbot=orca", "hosbot", "orca"),
        ("orca,tiago=hp-st[without=reverse,layers=3]", "tiago", "hp-st[without=reverse,layers=3]"),
        ("orca,tiago=hp-st", "hosbot", "orca"),
        ("orca,hosbot=hp-st", "hosbot:vendor", "hp-st"),
        ("orca,hosbot=hp-st,hosbot:vendor=move-base", "hosbot:vendor", "move-base"),
    ],
)
def test_a_navigator_by_robot(asked: str, robot: str, driver: str) -> None:
    assert navigator_of(asked, robot) == driver


@pytest.mark.parametrize(
    ("asked", "problem"),
    [
        ("tiago=orca", "does not say who drives the robot 'hosbot'"),
        ("orca,tiago=", "'tiago=' is no part of navigators by robot"),
        ("orca,=hp-st", "'=hp-st' is no part of navigators by robot"),
        ("orca,hp-st,tiago=orca", "says twice who drives"),
        ("orca,tiagoo=hp-st", "unknown robot 'tiagoo'; did you mean 'tiago'?"),
    ],
)
def test_a_wrong_navigator_by_robot_is_one_clear_error(asked: str, problem: str) -> None:
    plan = CampaignPlan(("people",), navigators=(asked,), selection=Selection(team=("tiago", "hosbot")))
    with pytest.raises(ClearwayError, match=re.escape(problem)):
        [spec.navigators for spec in plan.specs()]


def test_a_pair_gets_past_each_other_in_every_batch(tmp_path: Path) -> None:
    results = clearway.run(
        "meeting-points", navigators=["orca"], configurations=["2"], repetitions=1, workers=1, out=tmp_path / "out"
    )
    rows = results.trials.to_pylist()
    assert len(rows) == 10
    assert [row["scenario"] for row in rows if row["outcome"] != "reached"] == []


@pytest.mark.slow
def test_what_a_fleet_did_is_told_though_only_rows_were_kept(tmp_path: Path) -> None:
    asked: dict[str, Any] = {"navigators": ["orca"], "batches": ["doorway"], "configurations": ["2", "4"], "workers": 1}
    told = []
    for keep in ("trajectories", "table"):
        results = clearway.run("meeting-points", keep=keep, repetitions=1, out=tmp_path / keep, **asked)
        page = write_report(results.path)
        assert "Fleets: of the runs in which all arrived" in page.read_text("utf-8")
        told.append((page.parent / "tables" / "fleets.csv").read_text("utf-8"))
    assert told[0] == told[1]
    runs = list(csv.DictReader(told[0].splitlines()))
    assert [(r["configuration"], r["robots"]) for r in runs] == [("2", "2"), ("4", "4")] * (len(runs) // 2)
    for run in runs:
        arrived = [row["arrived"] for row in results.trials.to_pylist() if row["run"] == run["run"]]
        if None in arrived:
            assert run["makespan"] == run["sum_of_times"] == ""
        else:
            assert float(run["makespan"]) == max(arrived)
            assert float(run["sum_of_times"]) == pytest.approx(sum(arrived))
    assert any(run["makespan"] for run in runs)


def test_a_team_of_two_kinds_with_a_navigator_each(tmp_path: Path) -> None:
    drives = f"{OWN}:Drives"
    results = clearway.run(
        "meeting-points",
        team="tiago+hosbot",
        navigators=[f"tiago={drives},hosbot=orca"],
        batches=["crossing"],
        repetitions=1,
        workers=1,
        out=tmp_path / "out",
    )
    rows = results.trials.to_pylist()
    assert [(row["robot"], row["navigator"]) for row in rows] == [("tiago", drives), ("hosbot", "orca")]
    assert {row["run"].split("/")[-1] for row in rows} != {"orca"}
    assert len({row["run"] for row in rows}) == 1
    assert set(results.campaign["robots"]) == {"tiago", "hosbot"}
    again = rerun(results, 1)
    assert again.difference is None
    assert again.navigator == "orca"
