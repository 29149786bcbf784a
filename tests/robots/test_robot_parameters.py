"""What move_base makes of the shipped robots and their presets."""

from __future__ import annotations

from typing import Any

import pytest

from clearway.navigators.move_base import MoveBase
from clearway.navigators.move_base.parameters import Parameters
from clearway.robots import load_robot, robot_names

DRIVEN = [name for name in robot_names() if (one := load_robot(name)).lidar and one.limits().kind in MoveBase.drives]
ALL = [name + preset for name in DRIVEN for preset in ["", *(f":{p}" for p in load_robot(name).presets)]]


@pytest.mark.parametrize("name", ALL)
def test_move_base_controls_once_a_period(name: str) -> None:
    robot = load_robot(name)
    assert Parameters.read(robot).move_base.controller_frequency == pytest.approx(1 / robot.period)


def test_presets_change_what_they_say() -> None:
    planner = {n: Parameters.read(load_robot(n)).move_base.base_local_planner for n in ("hosbot", "hosbot:rollout")}
    assert planner["hosbot"] == "dwa_local_planner/DWAPlannerROS"
    assert planner["hosbot:rollout"] == "base_local_planner/TrajectoryPlannerROS"
    for name, enabled in (("hosbot", True), ("hosbot:vendor", False)):
        layer = Parameters.read(load_robot(name)).global_costmap.obstacle_layer
        assert layer is not None
        assert layer.enabled is enabled


def test_a_global_costmap_holds_the_map_unless_it_rolls_or_lies_in_odom() -> None:
    tiago = load_robot("tiago")

    def static_layer(table: dict[str, Any]) -> object:
        return Parameters.read(
            tiago.model_copy(update={"navigators": {"move-base": table}})
        ).global_costmap.static_layer

    assert static_layer({}) is not None
    assert static_layer({"global_costmap": {"update_frequency": 2.0}}) is not None
    assert static_layer({"global_costmap": {"rolling_window": True}}) is None
    assert static_layer({"global_costmap": {"global_frame": "odom"}}) is None


def test_jackal_navigates_without_a_map() -> None:
    """BARN grants none."""
    parameters = Parameters.read(load_robot("jackal"))
    assert parameters.global_costmap.static_layer is None
    assert parameters.local_costmap.static_layer is None
