"""What Nav2's servers are given by a user's file, and what its table tells of each parameter."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, ClassVar, Literal

import pytest
from pydantic import Field

from clearway.errors import ClearwayError
from clearway.navigators.nav2.parameters import files, plugins, read
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.costmaps import Costmap
from clearway.navigators.nav2.parameters.file import read_nodes
from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.nav2_parameters import ALL, reader_of, tables_of
from clearway.navigators.nav2.parameters.table import table
from clearway.quantities import Finite, Positive, Whole
from clearway.robots import load_robot


class Critic(Group):
    cost_weight: Finite = 4.0


class Driver(Group):
    """A controller of the test's."""

    batch_size: Whole = Field(default=1000, ge=1)
    temperature: Positive = 0.3
    mode: str = "a"
    critics: tuple[str, ...] = ("Goal",)

    IGNORED: ClassVar[dict[str, str]] = {"visualize": "nothing is drawn"}
    MISSING: ClassVar[dict[str, str]] = {"b": "a", "adaptive": "batch_size"}
    RENAMED: ClassVar[dict[str, str]] = {"samples": "batch_size"}
    JAZZY: ClassVar[dict[str, Any]] = {"temperature": 0.25}

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        critics = table.get("critics", ("Goal",))
        return dict.fromkeys(critics, Critic) | plugins.twice(critics, "critics")


@pytest.fixture(autouse=True)
def _drivers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(plugins.PLUGINS["controller"], "t::Driver", f"{__name__}:Driver")


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "nav2_params.yaml"
    path.write_text(text)
    return path


CONTROLLER = """
controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "t/Driver"
"""


def told(tmp_path: Path, lines: str) -> dict[str, Any]:
    found = table(written(tmp_path, CONTROLLER + "".join(f"      {line}\n" for line in lines.splitlines())))
    assert not found.problems
    return {row.name.removeprefix("controller_server.FollowPath."): row for row in found.rows}


def test_the_table_says_of_each_parameter_what_becomes_of_it(tmp_path: Path) -> None:
    rows = told(
        tmp_path,
        "batch_size: 2000\nbacth_size: 500\nvisualize: true\nadaptive: true\nmode: b\nsamples: 3\nGoal.cost_weight: 4.0\n"
        "Goal.cost_wieght: 9.0\nunlisted: {plugin: x, a: 1}\nuse_sim_time: true",
    )
    assert rows["batch_size"][:4] == ("read", "controller_server.FollowPath.batch_size", "2000", "1000")
    assert rows["bacth_size"].status == "unknown"
    assert rows["bacth_size"].note == "did you mean 'batch_size'?"
    assert rows["visualize"][0::4] == ("ignored", "nothing is drawn")
    assert rows["adaptive"][0::4] == ("missing", "closest is batch_size")
    assert rows["mode"][0::4] == ("missing", "b is not built; closest is a")
    assert rows["samples"].status == "unknown"
    assert "'batch_size'" in rows["samples"].note
    assert rows["Goal.cost_weight"][0:4:3] == ("read", "")  # the default, so that none stands beside it
    assert rows["Goal.cost_wieght"].note == "did you mean 'cost_weight'?"
    assert rows["unlisted"].status == "ignored"
    assert rows["use_sim_time"].status == "ignored"
    assert rows["temperature"] == ("default", "controller_server.FollowPath.temperature", "0.3", "", "jazzy has 0.25")


def test_a_misspelt_namespace_is_no_plugin_that_is_not_listed(tmp_path: Path) -> None:
    row = told(tmp_path, "Gaol: {cost_weight: 1.0}")["Gaol"]
    assert row.status == "unknown"
    assert row.note == "did you mean 'Goal'?"


def test_what_a_launch_file_fills_in_is_left_at_its_default(tmp_path: Path) -> None:
    rows = told(tmp_path, "batch_size: $(var samples)\ntemperature: MPPI_TEMPERATURE")
    assert {name: rows[name].status for name in ("batch_size", "temperature")} == {
        "batch_size": "ignored",
        "temperature": "ignored",
    }
    assert rows["batch_size"].note.endswith("1000 holds")


def test_a_wildcards_parameter_is_unknown_only_if_no_server_reads_it(tmp_path: Path) -> None:
    text = CONTROLLER + "/**: {ros__parameters: {use_sim_time: true, cycle_frequency: 5.0, cicle_frequency: 5.0}}\n"
    rows = {row.name: row.status for row in table(written(tmp_path, text)).rows if row.name.startswith("/**")}
    assert rows == {"/**.use_sim_time": "ignored", "/**.cycle_frequency": "read", "/**.cicle_frequency": "unknown"}


def test_a_wildcards_misspelt_name_is_told_with_the_nearest_of_any_server(tmp_path: Path) -> None:
    text = "/**: {ros__parameters: {robot_radis: 0.3, default_bt_xml_filename: a.xml}}\n"
    notes = {row.name: row.note for row in table(written(tmp_path, text)).rows if row.status == "unknown"}
    assert notes == {
        "/**.robot_radis": "did you mean 'robot_radius'?",
        "/**.default_bt_xml_filename": "is called 'default_nav_to_pose_bt_xml' now; the old name does nothing",
    }


def test_a_wildcards_namespace_is_unread_only_if_no_server_reads_what_is_inside(tmp_path: Path) -> None:
    text = CONTROLLER + "/*: {ros__parameters: {FollowPath.batch_size: 500, Spare.a: 1}}\n"
    rows = {row.name: row.status for row in table(written(tmp_path, text)).rows if row.name.startswith("/*")}
    assert rows == {"/*.FollowPath.batch_size": "read", "/*.Spare": "ignored"}


def test_nodes_that_are_none_of_the_servers_are_told(tmp_path: Path) -> None:
    text = CONTROLLER + "".join(
        f"{node}: {{ros__parameters: {{alpha1: 0.1, max_beams: 60, tf_broadcast: true}}}}\n"
        for node in ("amcl", "map_server", "planer_server", "my_driver")
    )
    rows = {row.name: row for row in table(written(tmp_path, text)).rows}
    assert rows["amcl.alpha1"].note.endswith("[localisation.amcl] odom_alpha1")
    assert rows["amcl.tf_broadcast"].status == "ignored"
    assert rows["map_server"].value == "3 parameters"
    assert rows["planer_server"].status == "unknown"
    assert "'planner_server'" in rows["planer_server"].note
    assert rows["my_driver"].status == "ignored"


@pytest.mark.parametrize(
    ("text", "name", "note"),
    [
        (
            "local_costmap: {ros__parameters: {a: 1}}",
            "local_costmap",
            "its node is 'local_costmap.local_costmap': write the name twice, `local_costmap: local_costmap: ros__parameters: ...`",
        ),
        (
            "local_costmp: {local_costmap: {ros__parameters: {a: 1}}}",
            "local_costmp.local_costmap",
            "no node of Nav2 has that name; did you mean 'local_costmap.local_costmap'?",
        ),
        (
            "robot1: {controller_server: {ros__parameters: {}}, global_costmap: {ros__parameters: {a: 1}}}",
            "global_costmap",
            "its node is 'global_costmap.global_costmap': write the name twice, `global_costmap: global_costmap: ros__parameters: ...`",
        ),
    ],
)
def test_a_costmaps_node_has_its_name_twice(tmp_path: Path, text: str, name: str, note: str) -> None:
    rows = {row.name: row for row in table(written(tmp_path, text)).rows}
    assert rows[name][0::4] == ("unknown", note)


@pytest.mark.parametrize(
    ("plugin", "listed", "section", "other"),
    [
        ("nav2_mppi_controller::MPPIController", "GoalCritc", "GoalCritic", "PathAlignCritic"),
        ("dwb_core::DWBLocalPlanner", "RotateToGol", "RotateToGoal", "GoalDist"),
    ],
)
def test_a_misspelt_critic_in_a_list_doesnt_make_its_section_unknown(
    tmp_path: Path, plugin: str, listed: str, section: str, other: str
) -> None:
    lines = f"      critics: [{listed}]\n      {section}.x: 1.0\n      {other}.x: 1.0\n"
    found = table(written(tmp_path, CONTROLLER.replace("t/Driver", plugin) + lines))
    (problem,) = found.problems
    assert problem.field == "controller_server.FollowPath.critics"
    rows = {row.name.removeprefix("controller_server.FollowPath."): row for row in found.rows}
    assert rows[section][0::4] == ("missing", f"the list has {listed!r} in its place: see the problem of that")
    assert rows[other].status == "ignored"  # as a critic that no list names


def test_a_critics_section_is_no_misspelt_one_of_a_critic_that_is_listed(tmp_path: Path) -> None:
    text = CONTROLLER.replace("t/Driver", "nav2_mppi_controller::MPPIController")
    text += "      critics: [GoalAngleCritic]\n      GoalCritic: {cost_weight: 5.0}\n"
    rows = {row.name: row for row in table(written(tmp_path, text)).rows}
    assert rows["controller_server.FollowPath.GoalCritic"].status == "ignored"


@pytest.mark.parametrize(
    ("name", "status", "note"),
    [
        ("/*/controller_server", "unknown", "matches no node; did you mean '/**/controller_server'?"),
        ("/**/controler_server", "unknown", "matches no node; did you mean '/**/controller_server'?"),
        ("/*/*/local_costmap", "unknown", "matches no node; did you mean '/**/local_costmap'?"),
        ("/robot/*", "unknown", "matches no node; did you mean '/**'?"),
        ("/*/map_server", "unknown", "matches no node; did you mean '/**/map_server'?"),
        ("/**/map_server", "ignored", "the map is that of the floor plan"),
        ("/*/my_driver", "ignored", "no node of Nav2's navigation"),
    ],
)
def test_a_wildcard_that_matches_no_node_is_told(tmp_path: Path, name: str, status: str, note: str) -> None:
    text = CONTROLLER + f"{name}: {{ros__parameters: {{a: 1, b: 2}}}}\n"
    (row,) = [row for row in table(written(tmp_path, text)).rows if row.name == name]
    assert (row.status, row.value) == (status, "2 parameters")
    assert row.note.startswith(note)


def test_a_wildcard_before_a_servers_name_is_a_section_for_it(tmp_path: Path) -> None:
    text = "/**/velocity_smoother: {ros__parameters: {smoothing_frequency: 10.0}}\n"
    rows = {row.name: row.status for row in table(written(tmp_path, CONTROLLER + text)).rows}
    assert rows["/**/velocity_smoother.smoothing_frequency"] == "read"
    path = written(tmp_path, text)
    smoother = read(path, load_robot("turtlebot4")).velocity_smoother
    assert smoother is not None
    assert smoother.group.smoothing_frequency == 10.0  # type: ignore[attr-defined]
    for name in ("/**", "/*"):
        path.write_text(f"{name}: {{ros__parameters: {{use_sim_time: true}}}}\n")
        assert read(path, load_robot("turtlebot4")).velocity_smoother is None


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("batch_size: -5", r"FollowPath\.batch_size.*-5"),
        ("batch_size: 2000.0", r"FollowPath\.batch_size: is 2000\.0, a double; ROS takes an integer"),
        (
            "temperature: 1",
            r"FollowPath\.temperature: is 1, an integer; ROS takes a double here and nothing else; write 1\.0",
        ),
        ('temperature: "0.3"', r"temperature: is '0\.3', a string; ROS takes a double"),
        ("critics: Goal", r"critics: is 'Goal', a string; ROS takes a list"),
        ("critics: 1.5", r"critics: is 1\.5, a double; ROS takes a list"),
        ("critics: [Goal, Path, Goal]", r"FollowPath\.critics: has 'Goal' twice"),
        ("Goal: 5", r"FollowPath\.Goal: is 5, and the parameters of a plug-in stand there"),
        ("batch_size: {a: 1}", r"FollowPath\.batch_size: is a value, and the file has a namespace"),
    ],
)
def test_a_wrong_value_is_one_error_and_the_table_goes_on(tmp_path: Path, lines: str, said: str) -> None:
    path = written(tmp_path, f"{CONTROLLER}      {lines}\n      foo: 1\n")
    given = tables_of(read_nodes(path), path)["controller_server"]
    with pytest.raises(ClearwayError, match=said) as raised:
        settle(reader_of("controller_server"), given, "controller_server", path)
    assert str(path) in str(raised.value)
    found = table(path)
    assert [str(p) for p in found.problems] == [str(raised.value)]
    assert any(row.name.endswith("foo") and row.status == "unknown" for row in found.rows)
    assert not any(row.name == raised.value.field for row in found.rows)


@pytest.mark.parametrize(
    ("plugin", "said"),
    [
        ("nav2_graceful_controller::GracefulController", "closest is nav2_regulated_pure_pursuit_controller::Reg"),
        ("t::Drivr", "did you mean 't::Driver'"),
        ("my_pkg::Mine", "there are .*t::Driver"),
    ],
)
def test_a_plugin_that_is_not_there_is_said_by_name(tmp_path: Path, plugin: str, said: str) -> None:
    path = written(tmp_path, CONTROLLER.replace("t/Driver", plugin))
    with pytest.raises(
        ClearwayError, match=f"FollowPath.plugin: the controller '{plugin}' is not built here; .*{said}"
    ):
        settle(
            reader_of("controller_server"),
            tables_of(read_nodes(path), path)["controller_server"],
            "controller_server",
            path,
        )


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("goal_checker_plugins: [g]\n    g: {plugin: 'nav2_controller::AxisGoalChecker', along: 0.3}", "g.plugin"),
        ("goal_checker_plugins: [g]\n    g: {along: 0.3}", "goal_checker_plugins"),
        ("goal_checker_plugins: [g, g]\n    g: {plugin: 'nav2_controller::SimpleGoalChecker'}", "goal_checker_plugins"),
        ("goal_checker_plugins: g\n    g: {plugin: 'nav2_controller::SimpleGoalChecker'}", "goal_checker_plugins"),
    ],
)
def test_a_plugin_that_is_not_there_hides_none_of_the_others(tmp_path: Path, lines: str, said: str) -> None:
    text = f"{CONTROLLER}      batchsize: 500\n      temperature: '0.3'\n    {lines}\n"
    found = table(written(tmp_path, text))
    problems = [(p.field or "").removeprefix("controller_server.") for p in found.problems]
    assert sorted(problems) == sorted(["FollowPath.temperature", said])
    rows = {row.name.removeprefix("controller_server."): row for row in found.rows}
    assert rows["FollowPath.plugin"].status == "read"
    assert rows["FollowPath.batchsize"].note == "did you mean 'batch_size'?"
    assert rows["g"][0:5:4] == ("missing", "what would read it is not there: see the problem of that")


def test_a_layer_that_is_not_there_hides_none_of_the_others(tmp_path: Path) -> None:
    layers = (
        "l: {plugin: 'nav2_costmap_2d::LegacyInflationLayer'}, s: {plugin: 'nav2_costmap_2d::StaticLayer', enabld: 1}"
    )
    text = f"global_costmap: {{global_costmap: {{ros__parameters: {{plugins: [s, l], {layers}}}}}}}"
    found = table(written(tmp_path, text))
    assert [p.field for p in found.problems] == ["global_costmap.l.plugin"]
    assert {row.name: row.status for row in found.rows} == {
        "global_costmap.plugins": "read",
        "global_costmap.l": "missing",
        "global_costmap.s.plugin": "read",
        "global_costmap.s.enabld": "unknown",
    }


def test_a_value_that_is_wrong_hides_no_namespace(tmp_path: Path) -> None:
    found = table(written(tmp_path, CONTROLLER + "    controller_frequency: 20\n    spare: {plugin: x}\n"))
    assert len(found.problems) == 1
    assert [row.status for row in found.rows if row.name == "controller_server.spare"] == ["ignored"]


class Demanding(Group):
    must: float
    kind: Literal["a", "b"]


def test_the_table_goes_on_where_what_must_be_given_is_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(plugins.PLUGINS["controller"], "t::Demanding", f"{__name__}:Demanding")
    text = CONTROLLER.replace("t/Driver", "t::Demanding")
    found = table(written(tmp_path, f"{text}      must: 1.0\n      kind: c\n"))
    assert [p.field for p in found.problems] == ["controller_server.FollowPath.kind"]
    (row,) = [row for row in found.rows if row.name.endswith("must")]
    assert row[0:4:3] == ("read", "")
    (missing,) = table(written(tmp_path, f"{text}      kind: a\n")).problems
    assert str(missing).endswith("controller_server.FollowPath.must: is missing")


@pytest.mark.parametrize(
    ("layer", "said"),
    [
        ("KeepoutFilter", "closest is none: there are no zones on the maps here"),
        ("LegacyInflationLayer", "closest is nav2_costmap_2d::InflationLayer"),
    ],
)
def test_a_layer_of_nav2s_that_is_not_there_has_a_closest(layer: str, said: str) -> None:
    given = {"plugins": ("mine",), "mine": {"plugin": f"nav2_costmap_2d::{layer}"}}
    with pytest.raises(ClearwayError, match=f"the layer 'nav2_costmap_2d::{layer}' is not built here; {said}"):
        settle(Costmap, given, "local_costmap", None)


def test_plugins_without_a_type_and_layers_by_default(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match="names 'mine', and nothing says which layer"):
        settle(Costmap, {"plugins": ("mine",)}, "local_costmap", None)
    assert list(settle(Costmap, {}, "c", None).children) == ["static_layer", "obstacle_layer", "inflation_layer"]


def test_a_rate_that_no_robot_follows_is_told(tmp_path: Path) -> None:
    text = CONTROLLER.replace("controller_plugins:", "controller_frequency: 50.0\n    controller_plugins:")
    rows = {row.name: row for row in table(written(tmp_path, text)).rows}
    assert "at most one command in a control period of the robot" in rows["controller_server.controller_frequency"].note


def test_a_footprint_is_a_text_and_its_points_are_read() -> None:
    square = "[ [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2] ]"
    group = settle(Costmap, {"footprint": square}, "c", None).group
    assert isinstance(group, Costmap)
    assert group.footprint == ((0.3, 0.2), (0.3, -0.2), (-0.3, -0.2), (-0.3, 0.2))
    with pytest.raises(ClearwayError, match=r"c\.footprint: .*is no outline"):
        settle(Costmap, {"footprint": "[[0.3, 0.2], [0.3]]"}, "c", None)
    with pytest.raises(ClearwayError, match=r"c\.footprint: is \(0\.3, 0\.2\), a list; ROS takes a string"):
        settle(Costmap, {"footprint": (0.3, 0.2)}, "c", None)


def test_sources_of_a_layer_are_named_in_a_text() -> None:
    layer = {
        "plugin": "nav2_costmap_2d::ObstacleLayer",
        "observation_sources": "front rear",
        "rear": {"clearing": True},
    }
    found = settle(Costmap, {"plugins": ("o",), "o": layer}, "c", None).children["o"].children
    assert [(name, source.group.clearing) for name, source in found.items()] == [("front", False), ("rear", True)]  # type: ignore[attr-defined]


def test_a_sensor_of_another_type_than_nav2_takes_is_an_error(tmp_path: Path) -> None:
    """It throws on it; a costmap that saw nothing drove into what stood there."""
    layer = "o: {plugin: 'nav2_costmap_2d::ObstacleLayer', observation_sources: a b, a: {data_type: %s}, b: {data_type: PointCloud2}}"
    text = f"local_costmap: {{local_costmap: {{ros__parameters: {{plugins: [o], {layer}}}}}}}"
    said = "local_costmap.o.a.data_type: 'laser_scan' is wrong: input should be 'LaserScan' or 'PointCloud2'"
    path = written(tmp_path, text % "laser_scan")
    assert [str(problem) for problem in table(path).problems] == [f"{path}: {said}"]
    with pytest.raises(ClearwayError, match=said):
        read(path, load_robot("turtlebot4"))
    found = table(written(tmp_path, text % "LaserScan"))
    assert {row.name: row.status for row in found.rows if row.name.endswith("data_type")} == {
        "local_costmap.o.a.data_type": "read",
        "local_costmap.o.b.data_type": "missing",
    }


SEEING = """
local_costmap:
  local_costmap:
    ros__parameters:
      plugins: [o, v, idle]
      o:
        plugin: nav2_costmap_2d::ObstacleLayer
        min_obstacle_height: 0.1
        observation_sources: low silent cloud upside_down
        low: {max_obstacle_height: 0.1}
        cloud: {data_type: PointCloud2}
        upside_down: {min_obstacle_height: 0.3, max_obstacle_height: 0.2}
      v: {plugin: nav2_costmap_2d::VoxelLayer, z_voxels: 1, observation_sources: s, s: {max_obstacle_height: 2.0}}
      idle: {plugin: nav2_costmap_2d::ObstacleLayer, enabled: false, observation_sources: s}
"""


@pytest.mark.parametrize(
    ("robot", "deaf", "said"),
    [
        (None, {"o.silent.max", "o.upside_down.max"}, "hears nothing of a lidar that is above the ground"),
        ("jackal", {"o.silent.max", "o.upside_down.max"}, "how high that of jackal is, is not known, and it is heard here"),
        ("tiago", {"o.min", "o.silent.max", "o.upside_down.min"}, "the lidar of tiago is 0.0945 m above the ground: this "),
        ("tiago-omni", {"o.low.max", "o.silent.max", "o.upside_down.max", "v.z_voxels"}, "the lidar of tiago-omni is 0.209 m"),
    ],
)  # fmt: skip
def test_what_sees_nothing_of_a_lidar_for_its_height_is_told(
    tmp_path: Path, robot: str | None, deaf: set[str], said: str
) -> None:
    found = table(written(tmp_path, SEEING), None if robot is None else load_robot(robot))
    noted = {row.name: row for row in found.rows if "nothing of" in row.note}
    assert {name.removeprefix("local_costmap.").removesuffix("_obstacle_height") for name in noted} == deaf
    assert all(said in row.note for row in noted.values())
    absent = noted["local_costmap.o.silent.max_obstacle_height"]
    assert (absent.status, absent.value) == ("default", "0.0")
    assert found.all_known
    assert len({row.name for row in found.rows}) == len(found.rows)


def test_the_files_whose_content_decides_are_named(tmp_path: Path) -> None:
    tree = tmp_path / "mine.xml"
    tree.write_text("<root/>")
    path = written(tmp_path, "bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: mine.xml}}")
    assert files(path) == (path, tree)
    assert files("turtlebot4") == files(None) == ()


def test_every_plugin_has_its_group() -> None:
    for role, known in plugins.PLUGINS.items():
        for name in known:
            assert issubclass(plugins.group_of(role, name, "plugin"), Group)
    assert all(issubclass(reader_of(server), Group) for server in ALL)


def test_what_nav2s_helpers_read_of_every_node_is_known(tmp_path: Path) -> None:
    text = CONTROLLER.replace("t/Driver", "nav2_mppi_controller::MPPIController")
    text += "      verbose: true\n    warn_on_missing_params: true\n    strict_param_loading: true\n"
    status = {row.name.rpartition(".")[2]: row.status for row in table(written(tmp_path, text)).rows}
    names = ("verbose", "warn_on_missing_params", "strict_param_loading")
    assert [status[name] for name in names] == ["ignored"] * 3


SHIM = CONTROLLER.replace("t/Driver", "nav2_rotation_shim_controller::RotationShimController")
DWB = (
    "max_vel_x: 0.4\n      max_angular_accel: 2.0\n      critics: [GoalDist, Oscillation]\n      GoalDist.scale: 24.0\n"
    "      transform_tolerance: 0.2\n"
)


def test_up_to_kilted_the_primary_controllers_parameters_stand_beside_the_rotation_shims(tmp_path: Path) -> None:
    path = written(tmp_path, f"{SHIM}      primary_controller: dwb_core/DWBLocalPlanner\n      {DWB}")
    given = tables_of(read_nodes(path), path)["controller_server"]
    shim = settle(reader_of("controller_server"), given, "controller_server", path).children["FollowPath"]
    assert shim.group.max_angular_accel == 2.0  # type: ignore[attr-defined]
    primary = shim.children["primary_controller"]
    assert primary.group.max_vel_x == 0.4  # type: ignore[attr-defined]
    assert {name: child.group.scale for name, child in primary.children.items()} == {"GoalDist": 24.0, "Oscillation": 1.0}  # type: ignore[attr-defined]  # fmt: skip
    found = table(path)
    status = {row.name.removeprefix("controller_server.FollowPath."): row.status for row in found.rows}
    assert not found.problems
    assert {name for name, word in status.items() if word == "read"} >= {
        "primary_controller", "max_vel_x", "max_angular_accel", "critics", "GoalDist.scale",
    }  # fmt: skip
    assert status["transform_tolerance"] == "ignored"
    assert found.all_known


def test_a_misspelt_name_beside_the_primary_controllers_is_one_of_either(tmp_path: Path) -> None:
    lines = f"{DWB}      max_vel_thta: 1.0\n      angular_dist_treshold: 1.0\n      GaolDist: {{scale: 1.0}}\n"
    text = (
        f"{SHIM}      primary_controller: dwb_core::DWBLocalPlanner\n      {lines.replace('GoalDist.scale: 24.0', '')}"
    )
    notes = {
        row.name.rpartition(".")[2]: row.note for row in table(written(tmp_path, text)).rows if row.status == "unknown"
    }
    assert notes == {
        "max_vel_thta": "did you mean 'max_vel_theta'?",
        "angular_dist_treshold": "did you mean 'angular_dist_threshold'?",
        "GaolDist": "did you mean 'GoalDist'?",
    }


@pytest.mark.parametrize(
    ("primary", "lines", "said"),
    [
        ("nav2_graceful_controller::GracefulController", "k_phi: 3.0", r"primary_controller: .* is not built here"),
        ("nav2_rotation_shim_controller::RotationShimController", "a: 1", r"FollowPath\.primary_controller: names"),
        ("dwb_core::DWBLocalPlanner", "critics: [GoalDist]\n      max_vel_x: 1", r"FollowPath\.max_vel_x: is 1, an int"),
        (
            "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
            "max_angular_accel: 3",
            r"FollowPath\.max_angular_accel: is 3, an integer",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_primary_controller_beside_is_one_problem(
    tmp_path: Path, primary: str, lines: str, said: str
) -> None:
    found = table(written(tmp_path, f"{SHIM}      primary_controller: {primary}\n      {lines}\n"))
    (problem,) = found.problems
    assert re.search(said, str(problem))
    if "k_phi" in lines:
        assert {row.status for row in found.rows if row.name.endswith("k_phi")} == {"missing"}
