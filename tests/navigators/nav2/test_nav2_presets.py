"""The parameter files that ship, by robot, and what a robot's own file puts into them."""

from __future__ import annotations

import math
from typing import Any

import pytest

from clearway.errors import ClearwayError
from clearway.navigators.nav2.costmaps.costmap import Costmap as CostmapOfLayers
from clearway.navigators.nav2.navigator import Nav2
from clearway.navigators.nav2.parameters import read
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.costmaps import Costmap
from clearway.navigators.nav2.parameters.nav2_parameters import reader_of
from clearway.navigators.nav2.parameters.table import rows_of
from clearway.navigators.nav2.presets import preset_for, preset_names, read_preset
from clearway.robots import load_robot


def test_the_presets_are_the_robots_own_and_hold_what_their_files_say() -> None:
    by_robot = {robot: name for name in preset_names() for robot in read_preset(name).robots}
    assert {"turtlebot3-waffle", "turtlebot4", "tiago", "jackal", "husky"} <= set(by_robot)
    for robot in by_robot:
        load_robot(robot)  # there is such a robot
    turtlebot = preset_for(load_robot("turtlebot4"))
    assert turtlebot.source.startswith("turtlebot/turtlebot4 (d688175)")
    assert turtlebot.tables["local_costmap"]["robot_radius"] == 0.175
    assert turtlebot.tables["controller_server"]["FollowPath"]["max_vel_x"] == 0.26
    assert preset_for(load_robot("turtlebot4:full")) == turtlebot


def test_every_preset_is_read_whole_without_an_unknown_name() -> None:
    for name in preset_names():
        for server, given in read_preset(name).tables.items():
            branch = settle(reader_of(server), given, server, None)
            for row in rows_of(branch, ""):
                assert row.status not in ("unknown", "missing") or row.name.startswith("FollowPath."), (name, row)


def test_nav2s_own_file_is_fitted_to_a_robot_that_has_none() -> None:
    for name in ("pepper", "f1tenth", "hosbot"):
        robot = load_robot(name)
        tables, limits = preset_for(robot).tables, robot.limits()
        follow = tables["controller_server"]["FollowPath"]
        assert follow["vx_max"] == limits.v_max
        assert follow["vx_min"] >= limits.v_min
        assert follow["batch_size"] == 2000  # all else is the file's
        settle(Costmap, tables["global_costmap"], "global_costmap", None)
        kinds = {"differential": "diff_drive", "omnidirectional": "omni", "ackermann": "ackermann"}
        assert follow["motion_model"] == kinds[limits.kind]
        assert tables["velocity_smoother"]["max_velocity"][0] == limits.v_max
        told = tables["controller_server"]["general_goal_checker"]
        assert (told["xy_goal_tolerance"], told["yaw_goal_tolerance"]) == (
            robot.planner_tolerances.xy, robot.planner_tolerances.yaw,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "frequency", "model_dt", "time_steps"), [("hosbot", 10.0, 0.1, 28), ("mir100", 5.0, 0.2, 14)]
)
def test_a_robot_that_decides_less_often_than_nav2s_own_file_has_longer_steps_and_as_many_fewer(
    name: str, frequency: float, model_dt: float, time_steps: int
) -> None:
    server = preset_for(load_robot(name)).tables["controller_server"]
    follow = server["FollowPath"]
    assert (server["controller_frequency"], follow["model_dt"], follow["time_steps"]) == (
        pytest.approx(frequency), pytest.approx(model_dt), time_steps,
    )  # fmt: skip


def test_without_a_map_a_preset_has_no_static_layer_and_a_wide_costmap_about_the_start() -> None:
    robot = load_robot("jackal")
    for name in preset_names():
        p = read(name, robot, mapped=False)
        for costmap, branch in (("local_costmap", p.local_costmap), ("global_costmap", p.global_costmap)):
            made = CostmapOfLayers(costmap, branch, robot, None)  # with a static layer this is an error
            assert made.frame == "odom"
        assert math.isclose(made.cost.shape[0] * made.resolution, 40.0, abs_tol=made.resolution)
        assert made.origin.tolist() == [-20.0, -20.0]


def test_what_a_robots_file_says_is_put_into_its_preset() -> None:
    found = Nav2().read_parameters(load_robot("jackal:wide"), mapped=False).global_costmap.group
    assert (found.width, found.origin_x, found.resolution) == (60, -30.0, 0.06)
    assert Nav2().read_parameters(load_robot("jackal"), mapped=False).global_costmap.group.width == 40
    assert Nav2("jackal").read_parameters(load_robot("jackal:wide"), mapped=False).global_costmap.group.width == 40, (
        "who names a preset gets it as it is"
    )


@pytest.mark.parametrize(
    ("own", "problem", "field"),
    [
        ({"costmap": {}}, "unknown server of Nav2", "costmap"),
        ({"global_costmap": 3}, "is 3; must be a table", "global_costmap"),
        ({"global_costmap": {"width": 60.0}}, "ROS takes an integer", "global_costmap.width"),
        (
            {"bt_navigator": {"default_nav_to_pose_bt_xml": "own.xml"}},
            "names none but trees that Nav2 ships",
            "bt_navigator.default_nav_to_pose_bt_xml",
        ),
        (
            {"bt_navigator": {"default_nav_to_pose_bt_xml": "navigate_on_route_graph_w_recovery.xml"}},
            "asks for routes, whose graph a file of parameters has to name",
            "bt_navigator.default_nav_to_pose_bt_xml",
        ),
        ({"smoother_server": {}}, "the behaviour tree doesn't ask for this server", "smoother_server"),
        ({"global_costmap": {"widht": 60}}, "nothing reads it: .*'width'", "global_costmap.widht"),
    ],
)
def test_what_is_wrong_in_a_robots_table_of_nav2_is_told_by_its_field(
    own: dict[str, Any], problem: str, field: str
) -> None:
    robot = load_robot("jackal").model_copy(update={"navigators": {"nav2": own}})
    with pytest.raises(ClearwayError, match=problem) as caught:
        Nav2().read_parameters(robot, mapped=False)
    assert (caught.value.file, caught.value.field) == ("robot jackal", f"navigators.nav2.{field}")
