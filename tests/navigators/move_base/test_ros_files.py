"""A robot's own ROS 1 files: found by their names, put where launch files put them, and read as move_base and its plug-ins do."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from clearway.errors import ClearwayError
from clearway.geometry.shapes import Circle, Polygon
from clearway.navigators.move_base import MoveBase
from clearway.navigators.move_base.ros import is_ros_folder, read, table, yaml_files
from clearway.navigators.move_base.ros.files import files_of
from clearway.robots import load_robot

TURTLEBOT = {
    "costmap_common_params_burger.yaml": "robot_radius: 0.105\n",
    "costmap_common_params_waffle.yaml": """
obstacle_range: 3.0
raytrace_range: 3.5
footprint: [[-0.205, -0.155], [-0.205, 0.155], [0.077, 0.155], [0.077, -0.155]]
inflation_radius: 1.0
cost_scaling_factor: 3.0
map_type: costmap
observation_sources: scan
scan: {sensor_frame: base_scan, data_type: LaserScan, topic: scan, marking: true, clearing: true}
""",
    "local_costmap_params.yaml": """
local_costmap: {global_frame: odom, update_frequency: 10.0, static_map: false, rolling_window: true, width: 3, height: 3}
""",
    "global_costmap_params.yaml": "global_costmap: {global_frame: map, update_frequency: 10.0, static_map: true}\n",
    "move_base_params.yaml": "controller_frequency: 10.0\nshutdown_costmaps: false\noscillation_timeout: 10.0\n",
    "base_local_planner_params.yaml": "TrajectoryPlannerROS: {max_vel_x: 0.18, holonomic_robot: false}\n",
    "dwa_local_planner_params_burger.yaml": "DWAPlannerROS: {max_vel_x: 0.22}\n",
    "dwa_local_planner_params_waffle.yaml": "DWAPlannerROS: {max_vel_x: 0.26, max_vel_theta: 1.82, publish_traj_pc: true}\n",
}
"""Facts of ROBOTIS-GIT/turtlebot3 (noetic, 4ae959e), turtlebot3_navigation/param, Apache-2.0."""

PAL = {
    "move_base.yaml": "planner_frequency: 1.0\nbase_local_planner: dwa_local_planner/DWAPlannerROS\n",
    "recovery_behaviors.yaml": """
recovery_behaviors:
  - {name: far, type: clear_costmap_recovery/ClearCostmapRecovery}
  - {name: slow, type: move_slow_and_clear/MoveSlowAndClear}
far: {reset_distance: 5.5, layer_names: [obstacle_laser_layer]}
""",
    "local_costmap.yaml": """
local_costmap:
  global_frame: $(arg prefix)odom
  rolling_window: true
  width: 5.0
  height: 5.0
  resolution: 0.025
  robot_radius: 0.275
  plugins:
    - {name: obstacle_laser_layer, type: "costmap_2d::ObstacleLayer"}
    - {name: obstacle_vo_layer, type: "costmap_2d::ObstacleLayer"}
    - {name: inflation_layer, type: "costmap_2d::InflationLayer"}
  obstacle_laser_layer:
    observation_sources: base_scan
    combination_method: 0
    base_scan: {data_type: LaserScan, topic: scan, observation_persistence: 1.0, inf_is_valid: true, marking: true, clearing: true,
                raytrace_range: 4.0, obstacle_range: 3.5}
  obstacle_vo_layer:
    observation_sources: vo_cloud
    vo_cloud: {data_type: PointCloud, marking: true}
  inflation_layer: {enabled: false, inflation_radius: 0.55}
""",
    "global_planner.yaml": """
base_global_planner: global_planner/GlobalPlanner
GlobalPlanner: {allow_unknown: false, default_tolerance: 0.5, last_plan_if_blocked: true}
""",
    "local_planner.yaml": "DWAPlannerROS: {max_trans_vel: 1.5, acc_lim_th: 1.5, vtheta_samples: 20, yaw_goal_tolerance: deg(45)}\n",
    "amcl.yaml": "min_particles: 500\nodom_model_type: diff\n",
}
"""Facts of pal-robotics/tiago_navigation (indigo-devel, 52acbc8), tiago_2dnav/config/base, and names of noetic's plug-ins."""


def folder(tmp_path: Path, files: dict[str, str], **more: str) -> str:
    for name, text in (files | {f"{k}.yaml": v for k, v in more.items()}).items():
        (tmp_path / name).write_text(text)
    return str(tmp_path)


def rows(place: str, robot: str = "") -> dict[str, Any]:
    return {row.name: row for row in table(place, robot).rows}


def test_turtlebot3s_files_are_read_as_its_launch_file_loads_them(tmp_path: Path) -> None:
    p = read(folder(tmp_path, TURTLEBOT), "turtlebot3-waffle")
    assert p.move_base.base_local_planner == "dwa_local_planner/DWAPlannerROS"  # as there are parameters for it
    assert (p.move_base.controller_frequency, p.move_base.oscillation_timeout) == (10.0, 10.0)
    assert (p.DWAPlannerROS.max_vel_x, p.DWAPlannerROS.xy_goal_tolerance) == (
        0.26,
        0.1,
    )  # noetic's default, not the robot's
    assert p.TrajectoryPlannerROS.max_vel_x == 0.18
    here, wide = p.local_costmap, p.global_costmap
    assert (here.rolling_window, here.width, here.static_layer, here.global_frame) == (True, 3.0, None, "odom")
    assert wide.static_layer is not None
    assert wide.obstacle_layer is not None
    for costmap in (here, wide):
        assert costmap.obstacle_layer is not None
        assert (costmap.obstacle_layer.obstacle_range, costmap.obstacle_layer.raytrace_range) == (3.0, 3.5)
        assert costmap.inflation_layer is not None
        assert (costmap.inflation_layer.inflation_radius, costmap.inflation_layer.cost_scaling_factor) == (1.0, 3.0)
        assert costmap.footprint is not None
        assert set(costmap.footprint) == {(-0.205, -0.155), (-0.205, 0.155), (0.077, 0.155), (0.077, -0.155)}
        assert isinstance(costmap.outline(Circle(1.0)), Polygon)


def test_a_file_is_chosen_by_the_robots_name(tmp_path: Path) -> None:
    place = folder(tmp_path, TURTLEBOT, costmap_common_params_waffle_pi="robot_radius: 0.3\n")
    assert read(place, "turtlebot3-burger").local_costmap.outline(Circle(1.0)) == Circle(0.105)
    assert "costmap_common_params_waffle.yaml" in {f.name for f in files_of(place, "turtlebot3-waffle")}
    with pytest.raises(ClearwayError, match=r"several files of a kind, costmap_common_params_burger\.yaml, .*'husky'"):
        read(place, "husky")


def test_pals_files_their_layers_recoveries_and_old_names(tmp_path: Path) -> None:
    place = folder(tmp_path, PAL)
    p = read(place, "tiago")
    assert p.move_base.base_global_planner == "global_planner/GlobalPlanner"
    assert (p.global_planner.allow_unknown, p.global_planner.default_tolerance) == (False, 0.5)
    (far,) = p.move_base.recovery_behaviors or ()
    assert (far.name, far.reset_distance, far.layer_names) == ("far", 5.5, ("obstacle_laser_layer",))  # type: ignore[union-attr]
    assert p.local_costmap.global_frame == "odom"
    layer = p.local_costmap.obstacle_layer
    assert layer is not None
    assert layer.name == "obstacle_laser_layer"
    assert (layer.obstacle_range, layer.raytrace_range, layer.observation_persistence) == (3.5, 4.0, 1.0)
    assert (layer.inf_is_valid, layer.combination_method) == (True, 0)
    assert p.local_costmap.inflation_layer is not None
    assert not p.local_costmap.inflation_layer.enabled
    assert p.DWAPlannerROS.yaw_goal_tolerance == pytest.approx(math.pi / 4)
    assert (p.DWAPlannerROS.max_vel_trans, p.DWAPlannerROS.acc_lim_theta) == (0.55, 3.2)  # noetic reads no old name
    told = rows(place, "tiago")
    assert told["DWAPlannerROS.max_trans_vel"].status == "unknown"
    assert "'max_vel_trans'" in told["DWAPlannerROS.max_trans_vel"].note
    assert told["GlobalPlanner.last_plan_if_blocked"].status == "unknown"
    assert told["recovery_behaviors.slow"].status == "missing"
    assert told["local_costmap.obstacle_vo_layer"].status == "missing"
    assert told[str(tmp_path / "amcl.yaml")].status == "ignored"
    assert told["local_costmap.width"][2:4] == ("5.0", "10.0")


LAYERED = """
plugins:
  - {name: static, type: "costmap_2d::StaticLayer"}
  - {name: obstacles, type: "costmap_2d::%s"}
  - {name: inflation, type: "costmap_2d::InflationLayer"}
static: {track_unknown_space: true, lethal_cost_threshold: 100}
obstacles: {observation_sources: scan, track_unknown_space: true, obstacle_range: 1.0, scan: {data_type: LaserScan, clearing: true}}
inflation: {inflation_radius: 0.5, cost_scaling_factor: 5.0, inflate_unknown: true}
track_unknown_space: false
lethal_cost_threshold: 65
obstacle_range: 4.0
raytrace_range: 6.0
inflation_radius: 1.2
"""


def test_a_costmaps_values_are_copied_over_its_layers(tmp_path: Path) -> None:
    place = folder(tmp_path, {"local_costmap.yaml": LAYERED % "ObstacleLayer"})
    costmap = read(place, "").local_costmap
    static, obstacles, inflation = costmap.static_layer, costmap.obstacle_layer, costmap.inflation_layer
    assert static is not None
    assert obstacles is not None
    assert inflation is not None
    assert (static.track_unknown_space, static.lethal_cost_threshold) == (False, 65)
    assert (obstacles.track_unknown_space, obstacles.obstacle_range, obstacles.raytrace_range) == (False, 4.0, 6.0)
    assert (inflation.inflation_radius, inflation.cost_scaling_factor, inflation.inflate_unknown) == (1.2, 5.0, True)
    found = table(place, "")
    assert found.all_known
    assert len({row.name for row in found.rows}) == len(found.rows)
    told = rows(place)
    for name in (
        "track_unknown_space",
        "lethal_cost_threshold",
        "obstacle_range",
        "raytrace_range",
        "inflation_radius",
    ):
        assert told[f"local_costmap.{name}"].status == "read"
    over = told["local_costmap.inflation.inflation_radius"]
    assert (over.status, over.note) == ("ignored", "local_costmap.inflation_radius is copied over it")
    assert told["local_costmap.inflation.cost_scaling_factor"].status == "read"


def test_of_a_voxel_layer_a_costmap_has_ranges_where_the_layer_has_none(tmp_path: Path) -> None:
    place = folder(tmp_path, {"local_costmap.yaml": LAYERED % "VoxelLayer"})
    layer = read(place, "").local_costmap.obstacle_layer
    assert layer is not None
    assert (layer.track_unknown_space, layer.obstacle_range, layer.raytrace_range) == (True, 1.0, 6.0)
    told = rows(place)
    over = told["local_costmap.obstacle_range"]
    assert (over.status, over.note) == ("ignored", "local_costmap.obstacles.obstacle_range holds")
    assert told["local_costmap.raytrace_range"].status == "read"


def test_what_no_layer_gets_of_its_costmap_is_ignored(tmp_path: Path) -> None:
    told = rows(folder(tmp_path, {"local_costmap.yaml": "plugins: []\ninflation_radius: 1.0\n"}))
    assert told["local_costmap.inflation_radius"][0::4] == ("ignored", "no layer is listed that would get it")


def test_without_a_list_of_layers_what_the_costmap_has_is_moved_over_theirs(tmp_path: Path) -> None:
    place = folder(
        tmp_path,
        {
            "global_costmap.yaml": "static_map: true\ntrack_unknown_space: false\nmap_type: voxel\nobstacle_range: 4.0\n"
            "observation_sources: scan\nscan: {data_type: LaserScan, marking: false, clearing: true}\n"
            "obstacle_layer: {obstacle_range: 1.0, scan: {data_type: LaserScan, marking: true}}\n"
        },
    )
    costmap = read(place, "").global_costmap
    assert costmap.static_layer is not None
    assert costmap.obstacle_layer is not None
    assert not costmap.static_layer.track_unknown_space
    layer = costmap.obstacle_layer
    assert (layer.obstacle_range, layer.marking, layer.clearing) == (4.0, False, True)


def test_a_sensors_range_is_looked_for_upwards(tmp_path: Path) -> None:
    layer = "plugins: [{name: o, type: 'costmap_2d::VoxelLayer'}]\no: {observation_sources: a b, a: {data_type: LaserScan%s},"
    sensors = layer + " b: {data_type: LaserScan, marking: false, clearing: true, raytrace_range: 9.0}}\n"
    for inside, outside, expected in (
        (", obstacle_range: 1.5", "", 1.5),
        ("", "obstacle_range: 5.5", 5.5),
        ("", "", 2.5),
    ):
        place = folder(tmp_path, {"costmap_common.yaml": f"{sensors % inside}{outside}\n"})
        found = read(place, "").local_costmap.obstacle_layer
        assert found is not None
        assert (found.obstacle_range, found.raytrace_range, found.marking, found.clearing) == (
            expected,
            9.0,
            True,
            True,
        )


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (
            {"move_base.yaml": "base_local_planner: teb_local_planner/TebLocalPlannerROS\n"},
            "TebLocalPlannerROS' is not built; closest is dwa",
        ),
        ({"move_base.yaml": "a: 1\n", "dwa_local_planner_params.yaml": "a: 2\n"}, r"a: is 1, and 2 in .*joined by \+"),
        ({"costmap_common.yaml": "footprint: [[0.1, 0.1], [0.1]]\n"}, r"footprint: .*is no outline"),
        ({"costmap_common.yaml": "plugins: [a, b]\n"}, "a list of layers, each with name and type"),
        ({"costmap_common.yaml": "plugins: [{name: a, type: b}, {name: a, type: b}]\n"}, "has the layer 'a' twice"),
        ({"move_base.yaml": "controller_frequency: -5.0\n"}, r": controller_frequency: .*-5"),
        (
            {"move_base.yaml": "controller_frequency: 1e-3\n"},
            r": controller_frequency: .*'1e-3'",
        ),  # a text in YAML 1.1
        ({"local_costmap.yaml": "global_frame: /world\n"}, r"local_costmap\.global_frame.*'world'"),
        ({"move_base.yaml": "recovery_behaviors: 5\n"}, "each with name and type"),
        ({"move_base.yaml": "a: &x 1\n"}, "anchors"),
        ({"move_base.yaml": "a:\n\tb: 1\n"}, "line 2 has a tab"),
        ({"move_base.yaml": "- 1\n"}, "is a mapping"),
        ({"move_base.yaml": "a: !!python/object/apply:os.system ['true']\n"}, "not a YAML file"),
        ({"notes.txt": ""}, "holds no file of move_base's parameters"),
    ],
)
def test_what_is_wrong_is_one_error(tmp_path: Path, files: dict[str, str], said: str) -> None:
    with pytest.raises(ClearwayError, match=said) as told:
        read(folder(tmp_path, files), "")
    assert str(tmp_path) in str(told.value)


def test_a_misspelt_name_is_told_with_the_nearest(tmp_path: Path) -> None:
    told = rows(
        folder(
            tmp_path,
            {"move_base.yaml": "recovery_behaviour_enabled: true\nDWAPlanerROS: {a: 1}\nlocal_costmap: {widht: 3}\n"},
        )
    )
    assert told["recovery_behaviour_enabled"].note == "did you mean 'recovery_behavior_enabled'?"
    assert told["DWAPlanerROS"].note == "did you mean 'DWAPlannerROS'?"
    assert told["local_costmap.widht"].note == "did you mean 'width'?"


def test_a_planner_or_list_that_is_wrong_hides_no_other_parameter(tmp_path: Path) -> None:
    place = folder(
        tmp_path,
        {
            "move_base.yaml": "base_local_planner: teb_local_planner/TebLocalPlannerROS\nrecovery_behaviors: 5\n"
            "TebLocalPlannerROS: {max_vel_x: 0.4}\nDWAPlannerROS: {max_vl_x: 1.0}\nplanner_patience: 2.0\n",
            "local_costmap.yaml": "plugins: [a]\nwidth: 4.0\na: {enabled: true}\n",
            "global_costmap.yaml": "inflation_radius: 0.5\n",
        },
    )
    found = table(place, "")
    assert [p.field for p in found.problems] == ["base_local_planner", "recovery_behaviors", "local_costmap.plugins"]
    told = {row.name: row.status for row in found.rows}
    assert told == {
        "planner_patience": "read",
        "TebLocalPlannerROS": "missing",
        "DWAPlannerROS.max_vl_x": "unknown",
        "local_costmap.width": "read",
        "local_costmap.a": "missing",
        "global_costmap.inflation_radius": "read",
        "global_costmap.obstacle_layer.observation_sources": "read",
    }


def test_every_wrong_value_is_told_once(tmp_path: Path) -> None:
    place = folder(
        tmp_path,
        {
            "move_base.yaml": "planner_patience: five\ncontroller_patience: -1.0\nDWAPlannerROS: {vx_samples: many}\n",
            "local_costmap.yaml": "plugins: [{name: o, type: 'costmap_2d::ObstacleLayer'}]\nraytrace_range: far\n"
            "o: {observation_sources: s, combination_method: 7, s: {data_type: LaserScan, marking: maybe, obstacle_range: ~}}\n",
        },
    )
    found = table(place, "")
    wrong = [p.field for p in found.problems]
    assert wrong == [
        "planner_patience",
        "controller_patience",
        "DWAPlannerROS.vx_samples",
        "local_costmap.o.s.marking",
        "local_costmap.o.s.obstacle_range",
        "local_costmap.o.combination_method",
        "local_costmap.raytrace_range",
    ]
    assert not any(row.name in wrong for row in found.rows)
    with pytest.raises(ClearwayError, match="'five' is wrong"):
        read(place, "")


def test_without_a_list_of_layers_a_misspelt_name_of_theirs_is_told_with_the_nearest(tmp_path: Path) -> None:
    told = rows(folder(tmp_path, {"local_costmap.yaml": "cost_scaling_factr: 3.0\nobstacle_rnge: 2.0\n"}))
    assert told["local_costmap.cost_scaling_factr"].note == "did you mean 'cost_scaling_factor'?"
    assert told["local_costmap.obstacle_rnge"].note == "did you mean 'obstacle_range'?"


def test_the_navigator_is_driven_with_them_and_names_their_files(tmp_path: Path) -> None:
    place = folder(tmp_path, TURTLEBOT)
    robot = load_robot("turtlebot3-waffle")
    read_by = MoveBase(params=place).read_parameters(robot)
    assert read_by == read(place, robot.name) != MoveBase().read_parameters(robot)
    assert MoveBase.files(params=place, base_local_planner="DWAPlannerROS") == yaml_files(place)
    assert {f.name for f in yaml_files(place)} == set(TURTLEBOT)
    assert MoveBase.files() == ()


def test_a_folder_of_parameters_is_known_by_its_files(tmp_path: Path) -> None:
    assert not is_ros_folder(str(tmp_path))
    place = folder(tmp_path, TURTLEBOT)
    assert is_ros_folder(place)
    assert is_ros_folder(f"{place}+{tmp_path / 'move_base_params.yaml'}")
    assert not is_ros_folder("tiago")
