"""The shipped robots: every value has a source, and the values are those of the papers and of the vendors' files."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from clearway.errors import ClearwayError
from clearway.geometry.shapes import circumscribed_radius, inscribed_radius
from clearway.navigators.move_base.parameters import Parameters
from clearway.robots import GoalChecker, Robot, Tolerances, immediate, load_robot, robot_names
from clearway.robots.robot import _load
from clearway.scenarios.suites import load_suite, suite_names
from clearway.stand_ins import FILE as STAND_INS

PRESETS = {
    "tiago": ["trajectory"],
    "hosbot": ["vendor", "literal", "melodic", "rollout"],
    "rescue": ["unlimited", "lidar", "late", "scout", "carrier", "fast"],
    "jackal": ["hardware", "wide"],
    "turtlebot3-waffle": [],
    "turtlebot4": ["full"],
    "mir100": ["trajectory"],
    "husky": ["replan", "slipping", "trajectory"],
    "whill": [],
    "tiago-omni": [],
    "pepper": [],
    "f1tenth": [],
    "crowdnav-disc": [],
}


def leaves(table: dict[str, Any], path: str = "") -> Iterator[str]:
    for key, value in table.items():
        where = f"{path}.{key}" if path else key
        if isinstance(value, dict):
            yield from leaves(value, where)
        else:
            yield where


def file_of(name: str) -> dict[str, Any]:
    if name == "rescue":  # it stands among the stand-ins
        table: dict[str, Any] = tomllib.loads(STAND_INS.read_text("utf-8"))["robot"]
        return table
    return tomllib.loads((resources.files("clearway.robots") / f"{name}.toml").read_text("utf-8"))


def test_the_robots_ship() -> None:
    assert robot_names() == sorted(PRESETS)


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_every_value_has_a_source(name: str) -> None:
    robot = load_robot(name)
    table = {k: v for k, v in file_of(name).items() if k not in ("name", "title", "sources")}
    assert [f for f in leaves(table) if robot.source(f) is None] == []


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_every_source_belongs_to_a_value(name: str) -> None:
    table = file_of(name)
    fields = list(leaves(table))
    stray = [s for s in table["sources"] if not any(f == s or f.startswith(f"{s}.") for f in fields)]
    assert stray == []


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_sources_are_named_in_full(name: str) -> None:
    for text in file_of(name)["sources"].values():
        assert not text.startswith("the same")


@pytest.mark.parametrize(("name", "preset"), [(n, p) for n, ps in PRESETS.items() for p in ps])
def test_presets_load_and_change_something(name: str, preset: str) -> None:
    changed, plain = load_robot(f"{name}:{preset}"), load_robot(name)
    assert changed.name == f"{name}:{preset}"
    assert changed.model_copy(update={"name": name}) != plain
    assert sorted(plain.presets) == sorted(PRESETS[name])


def test_table_3_of_paper_a() -> None:
    hosbot, tiago = load_robot("hosbot"), load_robot("tiago")
    h, t = (r.navigators["move-base"] for r in (hosbot, tiago))
    assert (h["move_base"]["planner_frequency"], t["move_base"]["planner_frequency"]) == (5.0, 1.0)
    assert (h["global_planner"]["default_tolerance"], t["global_planner"]["default_tolerance"]) == (0.3, 0.3)
    assert (h["move_base"]["controller_frequency"], t["move_base"]["controller_frequency"]) == (10.0, 10.0)
    assert (hosbot.period, tiago.period) == (0.1, 0.1)
    samples = {k: h["DWAPlannerROS"][k] for k in ("vx_samples", "vy_samples", "vth_samples")}
    assert samples == {"vx_samples": 3, "vy_samples": 3, "vth_samples": 10}
    assert (h["TrajectoryPlannerROS"]["vx_samples"], h["TrajectoryPlannerROS"]["vtheta_samples"]) == (3, 10)
    samples = {k: t["DWAPlannerROS"][k] for k in ("vx_samples", "vy_samples", "vtheta_samples")}
    assert samples == {"vx_samples": 10, "vy_samples": 0, "vtheta_samples": 20}
    assert (hosbot.tolerances.xy, tiago.tolerances.xy, tiago.tolerances.yaw) == (0.1, 0.2, 0.2)
    assert load_robot("hosbot:literal").tolerances.yaw == 0.01
    for planner in (h["TrajectoryPlannerROS"], t["DWAPlannerROS"]):
        assert (planner["max_vel_x"], planner["max_vel_theta"]) == (1.5, 2.0)
    for maps, rate, width, cell, ray in ((h, 5.0, 10.0, 0.05, 5.5), (t, 10.0, 5.0, 0.025, 4.0)):
        local = maps["local_costmap"]
        assert local["update_frequency"] == maps["global_costmap"]["update_frequency"] == rate
        assert (local["width"], local["height"], local["resolution"]) == (width, width, cell)
        assert local["obstacle_layer"]["raytrace_range"] == ray
    assert t["local_costmap"]["obstacle_layer"]["obstacle_range"] == 3.5
    literal = load_robot("hosbot:literal").navigators["move-base"]
    assert literal["local_costmap"]["obstacle_layer"]["obstacle_range"] == 0.3


@pytest.mark.parametrize("robot", ["tiago", "hosbot"])
def test_planners_are_told_what_the_test_judges_by(robot: str) -> None:
    for preset in ["", *[f":{p}" for p in PRESETS[robot] if p != "trajectory"]]:
        loaded = load_robot(robot + preset)
        groups = Parameters.read(loaded)
        chosen = getattr(groups, groups.move_base.base_local_planner.split("/")[1])
        assert loaded.planner_tolerances == loaded.tolerances
        assert (chosen.xy_goal_tolerance, chosen.yaw_goal_tolerance) == (loaded.tolerances.xy, loaded.tolerances.yaw)


def test_a_planner_may_be_told_to_aim_deeper() -> None:
    tiago = load_robot("tiago")
    deeper = tiago.model_copy(update={"goal_checker": GoalChecker(xy_goal_tolerance=0.15)})
    assert deeper.tolerances == tiago.tolerances
    assert deeper.planner_tolerances == Tolerances(xy=0.15, yaw=0.2)
    told = Parameters.read(deeper)
    assert (told.DWAPlannerROS.xy_goal_tolerance, told.DWAPlannerROS.yaw_goal_tolerance) == (0.15, 0.2)
    # what the planner's own group says goes before
    assert (
        told.TrajectoryPlannerROS.yaw_goal_tolerance == Parameters.read(tiago).TrajectoryPlannerROS.yaw_goal_tolerance
    )


def test_bodies() -> None:
    assert circumscribed_radius(load_robot("tiago").shape) == load_robot("tiago").d_base / 2
    hosbot = load_robot("hosbot")
    assert circumscribed_radius(hosbot.shape) == pytest.approx(0.4243, abs=1e-4)
    assert inscribed_radius(hosbot.shape) == pytest.approx(hosbot.d_base / 2)
    assert hosbot.planner_shape == hosbot.shape
    assert circumscribed_radius(load_robot("hosbot:vendor").planner_shape) == 0.3
    assert load_robot("hosbot:vendor").shape == hosbot.shape


def test_the_longest_prefix_is_the_source() -> None:
    robot = load_robot("tiago")
    assert robot.source("drive.v_max") == robot.sources["drive"]
    assert robot.source("drive.deceleration") == robot.sources["drive.deceleration"] != robot.sources["drive"]
    assert robot.source("nothing.here") is None


def test_a_source_may_be_named_without_quotes(tmp_path: Path) -> None:
    """TOML takes `drive.v_max` for a table within a table then."""
    text = Path(str(resources.files("clearway.robots") / "jackal.toml")).read_text(encoding="utf-8")
    own = tmp_path / "own.toml"
    own.write_text(text.split("\n[sources]")[0] + '\n[sources]\ndrive.v_max = "a stopwatch"\n', encoding="utf-8")
    robot = load_robot(str(own))
    assert robot.source("drive.v_max") == "a stopwatch"
    assert robot.source("drive.v_min") is None


@pytest.mark.parametrize(
    ("field", "said"),
    [
        ("drive.v_maxx", r"sources names 'drive\.v_maxx', .*; did you mean 'drive\.v_max'\?"),
        ("lidr", r"sources names 'lidr', which is no value of this robot; did you mean 'lidar'\?"),
        ("presets.qqq.drive", r"sources names 'presets\.qqq\.drive', which is no value of this robot$"),
        ("drive.v_max.mean", ""),
        ("camera.range", ""),
    ],
)
def test_a_source_of_a_value_that_is_not_there_is_refused(tmp_path: Path, field: str, said: str) -> None:
    own = tmp_path / "own.toml"
    text = (resources.files("clearway.robots") / "jackal.toml").read_text("utf-8").split("\n[sources]")[0]
    own.write_text(f'{text}\n[sources]\n"{field}" = "a data sheet"\n')
    if not said:
        assert load_robot(str(own)).source(field) == "a data sheet"
        return
    with pytest.raises(ClearwayError, match=said):
        load_robot(str(own))


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ("lidr = 1", r"presets\.mine\.lidr: unknown"),
        ("drive.v_max = -1.0", r"presets\.mine\.drive\.v_max: "),
        ("latency.sensing = 0.0\nlidar.sweep = 1.0", r"own\.toml: half of lidar\.sweep"),  # no field by itself
    ],
)
def test_what_is_wrong_with_a_preset_is_told_as_the_presets(tmp_path: Path, change: str, field: str) -> None:
    own = tmp_path / "own.toml"
    text = (resources.files("clearway.robots") / "turtlebot3-waffle.toml").read_text("utf-8")
    own.write_text(f"{text}\n[presets.mine]\n{change}\n")
    load_robot(str(own))
    with pytest.raises(ClearwayError, match=field):
        load_robot(f"{own}:mine")


def test_only_robots_of_two_papers_are_told_of_obstacles_by_a_camera() -> None:
    """All others know them by their lidars, as paper B's own preset `lidar` does."""
    told = {name for name in robot_names() if load_robot(name).camera is not None}
    assert told == {"rescue", "crowdnav-disc"}
    assert {name for name in robot_names() if load_robot(name).lidar is None} == {"crowdnav-disc"}
    for suite in suite_names():
        assert "rescue" not in load_suite(suite).robots or suite.startswith("sar-")


def test_the_example_can_begin_to_turn_on_the_spot() -> None:
    """DWA drops samples that neither drive nor turn fast enough: what a robot at rest can't reach in a period it never does."""
    tables = load_robot(str(Path(__file__).parents[2] / "examples" / "my_robot.toml")).navigators["move-base"]
    dwa, period = tables["DWAPlannerROS"], 1.0 / tables["move_base"]["controller_frequency"]
    assert dwa["min_vel_theta"] <= dwa["acc_lim_theta"] * period
    assert dwa["min_vel_trans"] <= dwa["acc_lim_x"] * period


def test_a_preset_can_take_a_part_away(tmp_path: Path) -> None:
    plain, lidar = load_robot("rescue"), load_robot("rescue:lidar")
    assert plain.camera is not None
    assert lidar.camera is None
    assert lidar.lidar == plain.lidar
    _load.cache_clear()
    load_robot("rescue:lidar")
    assert load_robot("rescue").camera == plain.camera  # what a preset takes away is there for the others
    own = tmp_path / "own.toml"
    text = Path(str(resources.files("clearway.robots") / "jackal.toml")).read_text(encoding="utf-8")
    own.write_text(text + '\n[presets.blind]\nwithout = ["lidr"]\n', encoding="utf-8")
    with pytest.raises(ClearwayError, match=r"presets\.blind\.without: there is no 'lidr' to take away"):
        load_robot(f"{own}:blind")


def test_a_footprint_holds_base_link(tmp_path: Path) -> None:
    whole, file = (resources.files("clearway.robots") / "mir100.toml").read_text("utf-8"), tmp_path / "mine.toml"

    def outlined(*vertices: tuple[float, float]) -> Robot:
        own = f"vertices = {[list(v) for v in vertices]}"
        file.write_text(re.sub(r"vertices = \[.*\]", own, whole, count=1), "utf-8")
        return load_robot(str(file))

    def behind(x: float) -> tuple[tuple[float, float], ...]:
        return (x, -0.3), (x + 0.9, -0.3), (x + 0.9, 0.3), (x, 0.3)

    assert inscribed_radius(outlined(*behind(-0.4)).shape) == 0.3
    assert inscribed_radius(outlined(*behind(0.0)).shape) == 0.0  # on its edge
    with pytest.raises(
        ClearwayError, match=r"x from 0\.1 to 1 and y from -0\.3 to 0\.3 m leave .* 0\.1 m outside"
    ) as error:
        outlined(*behind(0.1))
    assert (error.value.file, error.value.field) == (str(file), "footprint.vertices")
    with pytest.raises(ClearwayError, match=r"0\.1 m outside"):  # in a notch
        outlined(*behind(-0.4), (-0.4, 0.1), (0.3, 0.1), (0.3, -0.1), (-0.4, -0.1))


def test_limits_are_those_of_the_drive_capped_at_a_speed() -> None:
    hosbot = load_robot("hosbot")
    limits, d = hosbot.limits(0.6), hosbot.drive
    assert (limits.v_min, limits.v_max) == (max(d.v_min, -0.6), min(d.v_max, 0.6))
    assert limits[2:] == hosbot.limits()[2:]
    assert hosbot.limits()[:7] == tuple(getattr(d, name) for name in limits._fields[:7])
    assert not immediate(limits)
    assert immediate(load_robot("rescue:unlimited").limits())
    assert not immediate(load_robot("rescue").limits())


def test_unknown_robot_and_preset_name_what_exists() -> None:
    with pytest.raises(ClearwayError, match=r"unknown robot 'tiagoo'; did you mean 'tiago'\?"):
        load_robot("tiagoo")
    with pytest.raises(ClearwayError, match=r"unknown preset 'vendors'; did you mean 'vendor'\?"):
        load_robot("hosbot:vendors")


def test_robots_that_people_own_start_from_rest_within_their_planners_least_speeds() -> None:
    """Else `dwa_local_planner` drops every sample and the robot never moves."""
    for name in ("turtlebot3-waffle", "turtlebot4", "mir100", "husky", "whill"):
        robot = load_robot(name)
        dwa = Parameters.read(robot).DWAPlannerROS
        starts = (
            dwa.acc_lim_x * robot.period >= dwa.min_vel_trans or dwa.acc_lim_theta * robot.period >= dwa.min_vel_theta
        )
        assert starts, name


def test_the_planners_of_the_robots_that_people_own_are_told_no_more_than_the_base_can() -> None:
    for name in ("turtlebot3-waffle", "turtlebot4", "mir100", "husky", "whill"):
        robot = load_robot(name)
        dwa = Parameters.read(robot).DWAPlannerROS
        assert dwa.max_vel_x <= robot.drive.v_max
        # the chair turns at 0.8 rad/s at most, its user's file leaves the planner's default
        assert dwa.max_vel_theta <= robot.drive.omega_max or name == "whill"


def test_a_body_lies_within_what_its_planner_believes_or_sticks_out_by_little() -> None:
    for name in ("turtlebot3-waffle", "turtlebot4", "mir100", "husky"):
        robot = load_robot(name)
        assert circumscribed_radius(robot.shape) <= circumscribed_radius(robot.planner_shape) + 0.001
