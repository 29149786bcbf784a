"""`clearway check` of a file of Nav2's parameters prints one table, and ends with 1 where something in it is read by nobody."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Shell

from clearway import check_parameters
from clearway.errors import ClearwayError

GOOD = "planner_server: {ros__parameters: {planner_plugins: [GridBased], GridBased: {plugin: nav2_navfn_planner/NavfnPlanner, use_astar: true}}}"
BAD = "planner_server: {ros__parameters: {GridBased: {use_a_star: true}}}"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "nav2_params.yaml"
    path.write_text(text)
    return path


def test_a_file_of_known_names_is_right(clearway: Shell, tmp_path: Path) -> None:
    path = written(tmp_path, GOOD)
    said = clearway("check", path)
    assert said.code == 0
    assert "read      planner_server.GridBased.use_astar = true (default false)" in said.out
    assert "branch main" in said.out.splitlines()[-1]
    assert check_parameters(path).all_known


def test_an_unknown_name_is_told_with_the_nearest(clearway: Shell, tmp_path: Path) -> None:
    said = clearway("check", written(tmp_path, BAD), "--json")
    assert said.code == 1
    answer = json.loads(said.out)
    assert answer["problems"] == ["unknown   planner_server.GridBased.use_a_star = true: did you mean 'use_astar'?"]
    (row,) = answer["parameters"]
    assert (row["status"], row["name"]) == ("unknown", "planner_server.GridBased.use_a_star")


def test_what_is_no_such_file_is_said(clearway: Shell, tmp_path: Path) -> None:
    said = clearway("check", written(tmp_path, "a:\n\tros__parameters: 1"))
    assert said.code == 2
    assert "line 2 has a tab" in said.err
    with pytest.raises(ClearwayError, match="no parameters of Nav2"):
        check_parameters(written(tmp_path, "image: a.pgm"))


def test_whoever_asks_for_json_is_given_some_of_a_broken_file_too(clearway: Shell, tmp_path: Path) -> None:
    said = clearway("check", written(tmp_path, "a:\n\tros__parameters: 1"), "--json")
    assert said.code == 1
    answer = json.loads(said.out)
    assert len(answer["problems"]) == 1
    assert "line 2 has a tab" in answer["problems"][0]
    said = clearway("check", written(tmp_path, GOOD), "--robot", "hosbott", "--json")
    assert said.code == 1
    assert "unknown robot 'hosbott'" in json.loads(said.out)["problems"][0]


def test_a_file_with_too_few_underscores_is_no_map(clearway: Shell, tmp_path: Path) -> None:
    said = clearway.complaint("check", written(tmp_path, GOOD.replace("ros__", "ros_")))
    assert "planner_server.ros_parameters: ROS 2 has no such name" in said
    assert "`ros__parameters:`, with two underscores" in said


def test_heights_are_judged_for_the_robot_that_is_named(clearway: Shell, tmp_path: Path) -> None:
    layer = "o: {plugin: 'nav2_costmap_2d::ObstacleLayer', observation_sources: s, s: {max_obstacle_height: 0.1}}"
    path = written(tmp_path, f"local_costmap: {{local_costmap: {{ros__parameters: {{plugins: [o], {layer}}}}}}}")
    assert "hears nothing" not in clearway("check", path).out
    assert (
        "the lidar of hosbot is 0.136 m above the ground: this sensor hears nothing of it"
        in clearway("check", path, "--robot", "hosbot").out
    )
    said = clearway("check", path, "--robot", "hosbott")
    assert said.code == 2
    assert "did you mean 'hosbot'?" in said.err


def test_a_ros_1_packages_folder_is_told_of_alike(clearway: Shell, tmp_path: Path) -> None:
    (tmp_path / "move_base_params.yaml").write_text("controller_frequency: 10.0\nshutdown_costmaps: true\n")
    (tmp_path / "costmap_common_params_waffle.yaml").write_text("robot_radius: 0.2\n")
    (tmp_path / "costmap_common_params_burger.yaml").write_text("robot_radius: 0.1\n")
    said = clearway("check", tmp_path, "--robot", "turtlebot3-waffle")
    assert said.code == 0
    assert "read      local_costmap.robot_radius = 0.2" in said.out
    assert "ignored   shutdown_costmaps = true: " in said.out
    assert clearway("check", tmp_path).code == 2  # of two robots' files neither is of tiago
    (tmp_path / "move_base_params.yaml").write_text("controler_frequency: 10.0\n")
    assert clearway("check", tmp_path, "--robot", "turtlebot3-waffle").code == 1
