"""What Nav2's servers are given by a user's file, and what its table tells of each parameter."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest
from user_file import CONTROLLER, Driver, told, written

from clearway.errors import ClearwayError
from clearway.navigators.nav2.parameters import files, plugins, read
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.file import read_nodes
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.parameters.nav2_parameters import ALL, reader_of, tables_of
from clearway.navigators.nav2.parameters.table import table
from clearway.robots import load_robot


@pytest.fixture(autouse=True)
def _drivers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(plugins.PLUGINS["controller"], "t::Driver", f"{Driver.__module__}:Driver")


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


def test_a_rate_that_no_robot_follows_is_told(tmp_path: Path) -> None:
    text = CONTROLLER.replace("controller_plugins:", "controller_frequency: 50.0\n    controller_plugins:")
    rows = {row.name: row for row in table(written(tmp_path, text)).rows}
    assert "at most one command in a control period of the robot" in rows["controller_server.controller_frequency"].note


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
