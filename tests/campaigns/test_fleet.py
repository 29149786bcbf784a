"""Campaigns of scenarios with several robots: a trial for each that is tested, of one simulation."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from clearway.campaigns.campaign import run_campaign
from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.rerun import rerun
from clearway.errors import ClearwayError
from clearway.scenarios.check import check_file
from clearway.statistics import compare
from clearway.trials.store import Results

OWN = Path(__file__).with_name("own_navigators.py")
FLEET = f"""
name = "three"
floor_plan = "arena"
start = [2.0, 7.0, 0.0]
speed = 0.6
localisation = "truth"
member = "west"

[[legs]]
name = "there"
goal = [6.0, 7.0, 0.0]
time_limit = 60.0

[[robots]]
name = "east"
start = [12.0, 9.0, 3.1]
[[robots.legs]]
name = "there"
goal = [8.0, 9.0, 3.1]
time_limit = 60.0

[[robots]]
name = "broken"
start = [7.0, 4.0, 0.0]
role = "other"
robot = "hosbot"
navigator = "{OWN}:Raises"
[[robots.legs]]
name = "there"
goal = [9.0, 4.0, 0.0]
time_limit = 60.0
"""


def plan(folder: Path) -> CampaignPlan:
    (folder / "three.toml").write_text(FLEET)
    return CampaignPlan(suites=(str(folder / "three.toml"),), robots=("tiago",), navigators=(f"{OWN}:Drives",))


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("fleet")
    return run_campaign(plan(folder), folder / "out", 1)


def test_each_tested_robot_has_a_trial(results: Results) -> None:
    rows = results.trials.to_pylist()
    assert [row["member"] for row in rows] == ["west", "east"]
    assert len({row["run"] for row in rows}) == 1
    assert [row["outcome"] for row in rows] == ["reached"] * 2  # the third one broke and stood where it was
    assert [row["id"].split("/")[-1] for row in rows] == ["west", "east"]
    west, east = results.trial(0), results.trial(1)
    assert [body.name for body in west.attempt.bodies] == ["east", "broken"]
    assert [body.kind for body in east.attempt.bodies] == ["robot"] * 2
    shared = min(len(west.t), len(east.t))
    assert (west.moving_obstacles[:shared, 0] == east.pose[:shared]).all()
    assert (west.moving_obstacles[:, 1] == [7.0, 4.0, 0.0])[:, :2].all() or abs(
        west.moving_obstacles[0, 1, 0] - 7.0
    ) < 0.1
    assert set(results.campaign["robots"]) == {"tiago", "hosbot"}
    assert f"{OWN}:Raises" in results.campaign["code"]


def test_one_that_is_missing_is_run_again_with_the_others_and_gives_the_same(results: Results, tmp_path: Path) -> None:
    again = rerun(results, 1, out=tmp_path / "alone")
    assert again.difference is None
    assert again.results is not None
    assert again.results.trials.drop(["wall"] if "wall" in again.results.trials.column_names else []).equals(
        results.trials
    )


def test_robots_of_a_run_are_compared_with_themselves(results: Results) -> None:
    assert compare(results.trials, results.trials).pairs == 2


@pytest.mark.parametrize(
    ("before", "after", "field", "problem"),
    [
        ("start = [12.0, 9.0, 3.1]", "start = [2.1, 7.0, 3.1]", "robots.0.start", "'east' at (2.1, 7) would stand in 'west'"),
        ('"east"', '"west"', "", "two robots have the name 'west'"),
        ('"hosbot"', '"hosbit"', "robots.1.robot", "hosbot"),
        ("goal = [9.0, 4.0, 0.0]", "goal = [-3.0, 4.0, 0.0]", "robots.1.legs.0.goal", "outside the floor plan"),
        ("start = [7.0, 4.0, 0.0]", "start = [-7.0, 4.0, 0.0]", "robots.1.start", "outside the floor plan"),
        ('role = "other"', 'role = "tested"', "robots.1", 'has role = "other"'),
        ('role = "other"', 'role = "own"', "robots.1.role", "'tested' or 'other'"),
        ("time_limit = 60.0\n\n[[robots]]\nname = \"broken\"", "time_limit = 1.0\n\n[[robots]]\nname = \"broken\"", "robots.0.legs.0.time_limit", "can't do"),
    ],
)  # fmt: skip
def test_a_wrong_fleet_is_one_clear_error(tmp_path: Path, before: str, after: str, field: str, problem: str) -> None:
    assert before in FLEET
    file = tmp_path / "wrong.toml"
    file.write_text(FLEET.replace(before, after, 1))
    (error,) = check_file(file)
    assert field in str(error)
    assert re.search(re.escape(problem), str(error)), str(error)


def test_a_navigator_that_is_not_there_is_told_before_anything_runs(tmp_path: Path) -> None:
    asked = plan(tmp_path)
    (tmp_path / "three.toml").write_text(FLEET.replace(":Raises", ":Missing"))
    with pytest.raises(ClearwayError, match="Missing"):
        run_campaign(asked, tmp_path / "out", 0)
    assert not (tmp_path / "out").exists()
