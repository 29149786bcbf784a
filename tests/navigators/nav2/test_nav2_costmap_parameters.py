"""What a costmap's layers and sources are given by a user's file, and what its table tells of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from user_file import written

from clearway.errors import ClearwayError
from clearway.navigators.nav2.parameters import read
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.costmaps import Costmap
from clearway.navigators.nav2.parameters.table import table
from clearway.robots import load_robot


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


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        (None, "a lidar marks one voxel of a column, this layer marks nothing of a lidar that is above the ground"),
        ("tiago", "the lidar of tiago is 0.0945 m above the ground: it marks one voxel of a column, this layer marks nothing of it"),
    ],
)  # fmt: skip
def test_a_voxel_layer_that_asks_for_several_voxels_of_a_column_is_told(
    tmp_path: Path, robot: str | None, said: str
) -> None:
    """It marks nothing of what a lidar sees, here as in Nav2, and drove into what stood there without a word."""
    layer = "v: {plugin: 'nav2_costmap_2d::VoxelLayer', mark_threshold: %d, observation_sources: s, s: {max_obstacle_height: 2.0}}"
    text = f"local_costmap: {{local_costmap: {{ros__parameters: {{plugins: [v], {layer}}}}}}}"
    driver = None if robot is None else load_robot(robot)
    notes = [
        {row.name: row.note for row in table(written(tmp_path, text % threshold), driver).rows}[
            "local_costmap.v.mark_threshold"
        ]
        for threshold in (0, 1)
    ]
    assert notes == ["", said]
