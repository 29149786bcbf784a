"""The real move_base (and the real AMCL) as `build.sh` has built it: its parameters, and its processes around a master of its own."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from clearway.geometry.shapes import Circle
from clearway.navigators.common.costmaps.parameters import ObstacleLayer
from clearway.robots import Robot

SCAN = {"sensor_frame": "laser", "data_type": "LaserScan", "topic": "/scan", "marking": True, "clearing": True,
        "min_obstacle_height": -2.0, "max_obstacle_height": 2.0}  # fmt: skip
"""The lidar as a source of an obstacle layer; what the robot's file says of it comes on top."""
OF_THE_LAYER = ("enabled", "footprint_clearing_enabled", "combination_method", "track_unknown_space")
"""What an obstacle layer itself reads; its source reads the rest."""
CAPPED = {"DWAPlannerROS": ("max_vel_x", "max_vel_trans"), "TrajectoryPlannerROS": ("max_vel_x",)}
"""Which of a local planner's parameters the set speed of a test caps."""

FRESH_MEMORY = {"cells": 255, "metres": 1}
"""What glibc is told to fill fresh memory with (the byte's complement): zero, or not. TrajectoryPlanner is given `meter_scoring`, never
stores it, and asks a member that nobody has set: its weights count per metre where that happens not to be zero."""


def parameters(robot: Robot, speed: float | None, recording: Path | None) -> dict[str, Any]:
    """What is on the parameter server below `/move_base`: the groups of the robot's file, the layers as ROS names them.

    Args:
        robot: Whose file is read; where it is silent nothing is set, so that the real one's own defaults hold.
        speed: The set speed of the tests, m/s: caps the planners' forward speed, as for ours; None: none.
        recording: What the planners are asked and answer is written there.
    """
    groups: Mapping[str, Any] = robot.navigators["move-base"]
    tree: dict[str, Any] = {**groups.get("move_base", {})}
    behaviors = [dict(one) for one in tree.pop("recovery_behaviors", ())]
    if behaviors:
        tree["recovery_behaviors"] = [{"name": one["name"], "type": one.pop("type")} for one in behaviors]
        tree |= {one.pop("name"): {key: _plain(value) for key, value in one.items()} for one in behaviors}
    tree["global_costmap"] = _costmap(robot, dict(groups.get("global_costmap", {})), standing=True)
    tree["local_costmap"] = _costmap(robot, dict(groups.get("local_costmap", {})), standing=False)
    local = tree.get("base_local_planner", "base_local_planner/TrajectoryPlannerROS")
    global_ = tree.get("base_global_planner", "navfn/NavfnROS")
    tree[global_.rpartition("/")[2]] = dict(groups.get("global_planner", {}))
    told = robot.planner_tolerances
    for name, caps in CAPPED.items():
        table = {"xy_goal_tolerance": told.xy, "yaw_goal_tolerance": told.yaw} | groups.get(name, {})
        table.pop("meter_scoring_honoured", None)
        if speed is not None:
            table |= {cap: min(table.get(cap, 0.55), speed) for cap in caps}  # 0.55: both planners' default
        if name == "DWAPlannerROS" and robot.limits().v_y_max == 0.0:
            table |= {
                "max_vel_y": 0.0,
                "min_vel_y": 0.0,
            }  # as ours; where a file is silent the real one tries 0.1 m/s to either side
        tree[name] = table
    if recording is not None:
        tree["recorder"] = {"file": str(recording), "local": local, "global": global_}
        tree["base_local_planner"] = "clearway_recorder/LocalPlanner"
        tree["base_global_planner"] = "clearway_recorder/GlobalPlanner"
    return tree


def _costmap(robot: Robot, table: dict[str, Any], standing: bool) -> dict[str, Any]:
    usual: dict[str, Any] = {} if standing else {"global_frame": "odom", "rolling_window": True}
    table = {"global_frame": "map", "rolling_window": False} | usual | table
    static = table.pop("static_layer", {} if standing and table["global_frame"] == "map" else None)
    obstacles, inflation = dict(table.pop("obstacle_layer", {})), table.pop("inflation_layer", {})
    name = obstacles.pop("name", ObstacleLayer().name)
    shape = robot.planner_shape
    if "footprint" not in table and "robot_radius" not in table:
        if isinstance(shape, Circle):
            table["robot_radius"] = shape.radius
        else:
            table["footprint"] = _plain(shape.vertices)
    layer = {key: obstacles.pop(key) for key in OF_THE_LAYER if key in obstacles}
    plugins = [{"name": "static_layer", "type": "costmap_2d::StaticLayer"}] if static is not None else []
    plugins += [{"name": name, "type": "costmap_2d::ObstacleLayer"}]
    plugins += [{"name": "inflation_layer", "type": "costmap_2d::InflationLayer"}]
    return table | {
        "robot_base_frame": "base_link", "plugins": plugins, "static_layer": dict(static or {}),
        name: layer | {"observation_sources": "scan", "scan": SCAN | obstacles}, "inflation_layer": dict(inflation),
    }  # fmt: skip


def _plain(value: Any) -> Any:
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


@contextmanager
def real(
    built: Path,
    robot: Robot,
    log: Path,
    *,
    scoring: str = "cells",
    speed: float | None = None,
    recording: Path | None = None,
    amcl: bool = False,
) -> Iterator[str]:
    """A master and the real move_base with a robot's parameters; the master's address.

    Args:
        built: Where `build.sh` has built it.
        robot: Whose parameters it has.
        log: What its processes say.
        scoring: What memory that it has not set holds, by what TrajectoryPlanner's weights then count per.
        speed: See `parameters`.
        recording: Likewise.
        amcl: Whether the real AMCL runs too, with the robot's parameters.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    uri = f"http://127.0.0.1:{port}"
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS"))}
    environment = kept | {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "ROS_HOME": str(log.parent)}
    environment["GLIBC_TUNABLES"] = f"glibc.malloc.perturb={FRESH_MEMORY[scoring]}:glibc.malloc.tcache_count=0"
    tables: dict[str, Any] = {"move_base": parameters(robot, speed, recording)}
    if amcl:
        own = {"use_map_topic": True, "first_map_only": True, "odom_frame_id": "odom", "base_frame_id": "base_link"}
        own |= {
            "transform_tolerance": 0.3
        }  # s: sweeps come once in a control period, and the next one finds the last one's transform
        tables["amcl"] = own | robot.localisation["amcl"]
    with log.open("ab") as says:

        def start(*command: str) -> subprocess.Popen[bytes]:
            return subprocess.Popen(command, env=environment, stdout=says, stderr=says)

        running = [start("rosmaster", "--core", "-p", str(port))]
        try:
            master = xmlrpc.client.ServerProxy(uri)
            until = time.monotonic() + 20.0
            while True:
                with suppress(OSError):
                    master.setParam("/clearway", "/use_sim_time", True)
                    break
                if time.monotonic() > until:
                    sys.exit(f"no rosmaster at {uri}; {log} says why")
                time.sleep(0.05)
            for node, table in tables.items():
                master.setParam("/clearway", f"/{node}", table)
                there = f"{built}/install_isolated"
                running.append(
                    start("sh", "-c", f". '{there}/setup.sh' && exec '{there}/lib/{node}/{node}' __name:={node}")
                )
            yield uri
        finally:
            for process in reversed(running):
                process.terminate()
                try:
                    process.wait(5.0)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
