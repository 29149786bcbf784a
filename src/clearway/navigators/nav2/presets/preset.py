"""Finds the public Nav2 file of a robot, or fits Nav2's own to it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from clearway.errors import unknown
from clearway.geometry.shapes import Circle
from clearway.reading import read_toml
from clearway.robots import Robot, overridden
from clearway.robots.tables import TUNED_ON

_FOLDER = Path(__file__).parent
NAV2 = "nav2"
"""The preset that has Nav2's own file."""
TABLE = "nav2"
"""Among the navigators of a robot's file: tables of parameters by server."""

_STATIC = "nav2_costmap_2d::StaticLayer"


class Preset(NamedTuple):
    """The parameters of a public file.

    Attributes:
        source: Repository, commit, file and licence.
        robots: The robots whose own file it is.
        tables: What each server is given, as tables within each other.
    """

    source: str
    robots: tuple[str, ...]
    tables: Mapping[str, dict[str, Any]]


def preset_names() -> list[str]:
    """Names of the presets, sorted."""
    return sorted(file.stem for file in _FOLDER.glob("*.toml"))


@cache
def read_preset(name: str) -> Preset:
    """A preset by its name.

    Raises:
        ClearwayError: there is none of that name.
    """
    if name not in preset_names():
        raise unknown("preset of Nav2's parameters", name, preset_names())
    table = read_toml(_FOLDER / f"{name}.toml")
    source = table["source"]
    said = f"{source['repository']} ({source['commit'][:7]}), {source['file']}, {source['licence']}"
    return Preset(said, tuple(table["robots"]), _frozen(table["nodes"]))


def preset_for(robot: Robot) -> Preset:
    """The robot's own public file; for a robot that has none, Nav2's own with the robot's outline and limits."""
    name = robot.name.partition(":")[0]
    for preset in map(read_preset, preset_names()):
        if name in preset.robots:
            return preset
    return fitted(robot)


def without_map(preset: Preset) -> Preset:
    """The same for a robot that has no map: no static layer, and a global costmap of 40 m about the start, in the odometry's frame.

    So it is done where Nav2 drives in BARN's worlds (Saadmaghani/The-Barn-Challenge-Ros2 (d6c575b), jackal_helper/config/nav2.yaml).
    """
    tables = {**preset.tables}
    for costmap in ("local_costmap", "global_costmap"):
        table = tables[costmap]
        seen = tuple(name for name in table["plugins"] if table[name]["plugin"] != _STATIC)
        tables[costmap] = table | {"plugins": seen}
    tables["global_costmap"] |= {
        "global_frame": "odom", "rolling_window": False, "width": 40, "height": 40, "origin_x": -20.0, "origin_y": -20.0,
    }  # fmt: skip
    return preset._replace(source=f"{preset.source}, without a map", tables=tables)


def own_tables(robot: Robot) -> dict[str, Any]:
    """What a robot's file holds for Nav2's servers."""
    return {server: table for server, table in robot.navigators.get(TABLE, {}).items() if server != TUNED_ON}


def with_own(preset: Preset, robot: Robot) -> Preset:
    """The same with what the robot's file holds for Nav2's servers, in `[navigators.nav2]`, put in."""
    own = own_tables(robot)
    if not own:
        return preset
    tables = _frozen(overridden(preset.tables, own))
    return preset._replace(source=f"{preset.source}, with the robot's [navigators.{TABLE}]", tables=tables)


def fitted(robot: Robot) -> Preset:
    """Nav2's own file as its users begin: the robot's outline, speeds and accelerations put in, the tolerances
    that its planners are told, how often it decides, and how it is steered.

    A limit that the base does not have keeps the file's value. A base that steers like a car gets Smac Hybrid-A* as its planner.
    Samples of a robot that decides less often than the file says have longer steps, and as many fewer.
    """
    preset = read_preset(NAV2)
    shape, limits = robot.planner_shape, robot.limits()
    outline = (
        {"robot_radius": float(shape.radius)}
        if isinstance(shape, Circle)
        else {"footprint": str([[float(x), float(y)] for x, y in shape.vertices])}
    )
    server = preset.tables["controller_server"]
    speeds = {"vx_max": limits.v_max, "vx_min": max(limits.v_min, -limits.v_max), "wz_max": limits.omega_max}
    bounds = {"ax_max": limits.acceleration, "ax_min": -limits.deceleration, "az_max": limits.angular_acceleration}
    if limits.v_y_max > 0.0:
        speeds |= {"vy_max": limits.v_y_max}
        bounds |= {"ay_max": limits.lateral_acceleration, "ay_min": -limits.lateral_deceleration}
    fitted = {name: float(value) for name, value in (speeds | bounds).items() if math.isfinite(value)}
    follow = server["FollowPath"] | fitted
    frequency = min(server["controller_frequency"], 1.0 / robot.period)
    if (step := 1.0 / frequency) > follow["model_dt"]:  # which Nav2 refuses
        follow |= {"model_dt": step, "time_steps": round(follow["time_steps"] * follow["model_dt"] / step)}
    tables = {**preset.tables}
    if limits.v_y_max > 0.0:
        follow |= {"motion_model": "omni", "omni": {"plugin": "mppi::OmniMotionModel"}}
    if limits.wheelbase > 0.0:
        radius = limits.wheelbase / math.tan(limits.steering_max)
        follow |= {
            "motion_model": "ackermann",
            "ackermann": {"plugin": "mppi::AckermannMotionModel", "min_turning_r": radius},
        }
        hybrid = {
            "plugin": "nav2_smac_planner::SmacPlannerHybrid",
            "minimum_turning_radius": radius,
            "motion_model_for_search": "REEDS_SHEPP" if limits.v_min < 0 else "DUBIN",
        }
        tables["planner_server"] = {"planner_plugins": ("GridBased",), "GridBased": hybrid}
    most = (limits.v_max, limits.v_y_max, limits.omega_max)
    smoother = tables["velocity_smoother"] | {
        "max_velocity": tuple(map(float, most)),
        "min_velocity": (float(speeds["vx_min"]), -float(most[1]), -float(most[2])),
    }
    for name, sign in (("max_accel", 1.0), ("max_decel", -1.0)):
        ends = (
            (limits.acceleration, limits.lateral_acceleration, limits.angular_acceleration)
            if sign > 0
            else (limits.deceleration, limits.lateral_deceleration, limits.angular_deceleration)
        )
        before = smoother[name]
        smoother[name] = tuple(sign * float(e) if math.isfinite(e) else b for e, b in zip(ends, before, strict=True))
    told = robot.planner_tolerances
    checker = server["general_goal_checker"] | {"xy_goal_tolerance": told.xy, "yaw_goal_tolerance": told.yaw}
    controller = server | {"controller_frequency": frequency, "FollowPath": follow, "general_goal_checker": checker}
    tables |= {"controller_server": controller, "velocity_smoother": smoother}
    for costmap in ("local_costmap", "global_costmap"):
        kept = {k: v for k, v in tables[costmap].items() if k not in ("robot_radius", "footprint")}
        tables[costmap] = kept | outline
    return Preset(f"{preset.source}, fitted to {robot.name}", (), tables)


def _frozen(value: Any) -> Any:
    """Lists as tuples, as a file of ROS parameters is read."""
    if isinstance(value, dict):
        return {key: _frozen(inside) for key, inside in value.items()}
    return tuple(value) if isinstance(value, list) else value
