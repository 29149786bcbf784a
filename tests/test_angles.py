"""Angles in files are radians; degrees by mistake are told as what they are, and can be written as such."""

from __future__ import annotations

import math
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from clearway.errors import ClearwayError
from clearway.recordings.lab.checks import problems_of
from clearway.recordings.lab.plan_file import load_test_plan
from clearway.recordings.protocol.toml_text import toml
from clearway.robots import load_robot
from clearway.scenarios.files import load_scenario
from clearway.scenarios.floorplan import load_floor_plan

PLAN: dict[str, Any] = {
    "robot": {"track": "robot", "offset": [0.1, 0.0, 0.0]},
    "bodies": {"box": {"shape": {"kind": "square", "edge": 0.3}}},
    "poses": {"A": [0.0, 0.0, 0.0]},
    "legs": [{"name": "forth", "start": "A", "goal": [5.0, 0.0, 0.0]}],
    "trial": [{"obstacles": [{"body": "box", "pose": [1.0, 1.0, 0.0]}]}],
}
PLACES = [
    ({"poses": {"A": [0.0, 0.0, "?"]}}, "poses.A.2"),
    ({"legs": [{"name": "forth", "goal": [5.0, 0.0, "?"]}]}, "legs.0.goal.2"),
    ({"robot": {"track": "robot", "offset": [0.1, 0.0, "?"]}}, "robot.offset.2"),
    ({"sources": {"capture": {"frame": {"transform": [0.1, 0.0, "?"]}}}}, "sources.capture.frame.transform.2"),
    (
        {"sources": {"capture": {"frame": {"same": True, "uncertainty": [0.1, "?"]}}}},
        "sources.capture.frame.uncertainty.1",
    ),
    ({"test": {"yaw_tolerance": "?"}}, "test.yaw_tolerance"),
    ({"trial": [{"obstacles": [{"body": "box", "pose": [1.0, 1.0, "?"]}]}]}, "trial no. 1: obstacles.0.pose.2"),
]


def written(path: Path, changed: dict[str, Any], value: str) -> Path:
    path.write_text(toml(PLAN | changed).replace('"?"', value), encoding="utf-8")
    return path


@pytest.mark.parametrize(("changed", "field"), PLACES)
def test_a_plan_in_degrees_is_told_what_they_are_in_radians(
    tmp_path: Path, changed: dict[str, Any], field: str
) -> None:
    (problem,) = problems_of(written(tmp_path / "plan.toml", changed, "30"))
    assert problem.field == field
    assert problem.problem == (
        '30 is more than a full turn; angles are in radians: 30 degrees are 0.523599, and can be written as "30 deg"'
    )
    for text in ('"30 deg"', '"30deg"', '" 30.0 degrees"', '"30°"', "0.5236"):
        assert problems_of(written(tmp_path / "plan.toml", changed, text)) == []
    (problem,) = problems_of(written(tmp_path / "plan.toml", changed, '"a bit"'))
    assert "'a bit' is no angle; radians as a number, or degrees as \"90 deg\"" in str(problem)


def test_degrees_as_text_are_read_as_radians(tmp_path: Path) -> None:
    leg = {"legs": [{"name": "forth", "goal": [5.0, 0.0, "?"]}]}
    assert load_test_plan(written(tmp_path / "plan.toml", leg, '"-180 deg"')).legs[0].goal == (5.0, 0.0, -math.pi)
    free = load_test_plan(written(tmp_path / "plan.toml", {"test": {"yaw_tolerance": "?"}}, "inf"))
    assert free.test.yaw_tolerance == math.inf
    (problem,) = problems_of(written(tmp_path / "plan.toml", {"test": {"yaw_tolerance": "?"}}, "5"))
    assert "5 is more than half a turn" in str(problem)
    assert '"5 deg"; inf: the heading is free' in str(problem)
    full = written(tmp_path / "plan.toml", leg, "6.283185307179586")
    assert problems_of(full) == []


def test_scenarios_floor_plans_and_robots_have_the_same_angles(tmp_path: Path) -> None:
    folder = Path(__file__).parents[1] / "examples"
    scenario = (folder / "my_corridor.toml").read_text(encoding="utf-8")
    start = tomllib.loads(scenario)["start"]
    line = next(row for row in scenario.splitlines() if row.startswith("start"))
    path = tmp_path / "mine.toml"
    path.write_text(scenario.replace(line, f'start = [{start[0]}, {start[1]}, "90 deg"]'), encoding="utf-8")
    assert load_scenario(path).start[2] == math.radians(90)
    path.write_text(scenario.replace(line, f"start = [{start[0]}, {start[1]}, 90]"), encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"start\.2: 90 is more than a full turn"):
        load_scenario(path)
    robot = resources.files("clearway.robots").joinpath("tiago.toml").read_text(encoding="utf-8")
    line = next(row for row in robot.splitlines() if row.startswith("angle_min"))
    path.write_text(robot.replace(line, 'angle_min = "-100 deg"'), encoding="utf-8")
    assert load_robot(str(path)).lidar.angle_min == math.radians(-100)
    path.write_text(robot.replace(line, "angle_min = -100"), encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"-100 degrees are -1\.74533"):
        load_robot(str(path))
    floor = resources.files("clearway.scenarios").joinpath("plans/hall.toml").read_text(encoding="utf-8")
    path.write_text(
        floor.replace("a = [-2.5, 0.0, 0.0]", "a = [-2.5, 0.0, 45]").replace('map = "hall.yaml"\n', ""),
        encoding="utf-8",
    )
    with pytest.raises(ClearwayError, match=r"a\.2: 45 is more than a full turn"):
        load_floor_plan(str(path))
