"""All that Nav2's servers are given, from a user's file or a preset."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from clearway.errors import ClearwayError, unknown
from clearway.navigators.nav2.parameters.branch import Branch, settle
from clearway.navigators.nav2.parameters.file import Node, merged, nested, read_nodes
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.presets import preset_for, preset_names, read_preset, with_own, without_map
from clearway.reading import is_there
from clearway.robots import Robot

_PARAMETERS = "clearway.navigators.nav2.parameters"

SERVERS: dict[str, tuple[str, str]] = {
    "controller_server": ("/controller_server", f"{_PARAMETERS}.servers:ControllerServer"),
    "planner_server": ("/planner_server", f"{_PARAMETERS}.servers:PlannerServer"),
    "behavior_server": ("/behavior_server", f"{_PARAMETERS}.servers:BehaviorServer"),
    "bt_navigator": ("/bt_navigator", f"{_PARAMETERS}.servers:BtNavigator"),
    "local_costmap": ("/local_costmap/local_costmap", f"{_PARAMETERS}.costmaps:Costmap"),
    "global_costmap": ("/global_costmap/global_costmap", f"{_PARAMETERS}.costmaps:Costmap"),
}
"""What is started -> the full name of its node, and what reads its parameters."""

OPTIONAL: dict[str, tuple[str, str]] = {
    "velocity_smoother": (
        "/velocity_smoother",
        "clearway.navigators.nav2.velocity_smoother:VelocitySmootherParameters",
    ),
    "collision_monitor": ("/collision_monitor", f"{_PARAMETERS}.monitor:CollisionMonitorParameters"),
}
"""The same of what is started only where the file has parameters for it."""

ASKED: dict[str, tuple[str, str]] = {
    "smoother_server": ("/smoother_server", f"{_PARAMETERS}.servers:SmootherServer"),
    "route_server": ("/route_server", f"{_PARAMETERS}.routes:RouteServer"),
}
"""The same of what is started only for a behaviour tree that asks for it."""

ALL = SERVERS | OPTIONAL | ASKED


@dataclass(frozen=True, slots=True)
class Parameters:
    """What each server of Nav2 is given.

    Attributes:
        source: Where it is from, for people.
        file: The file, None for a preset.
        controller_server: With progress checkers, goal checkers, controllers and path handlers.
        planner_server: With planners.
        behavior_server: With behaviours.
        bt_navigator: The behaviour tree's.
        local_costmap: With layers.
        global_costmap: With layers.
        velocity_smoother: None: it isn't started, as the file has nothing for it.
        collision_monitor: With polygons and sources; None: likewise.
        smoother_server: With smoothers; None: the behaviour tree doesn't ask for it.
        route_server: With edge scorers; None: likewise.
        tables: What each server is given, as tables within each other.
    """

    source: str
    file: Path | None
    controller_server: Branch
    planner_server: Branch
    behavior_server: Branch
    bt_navigator: Branch
    local_costmap: Branch
    global_costmap: Branch
    velocity_smoother: Branch | None = None
    collision_monitor: Branch | None = None
    smoother_server: Branch | None = None
    route_server: Branch | None = None
    tables: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def for_tree(self, asked: Iterable[str]) -> Parameters:
        """The same with those of servers that a behaviour tree asks for.

        Raises:
            ClearwayError: something in them is wrong.
        """
        branches = {server: _branch(server, self.tables, self.file) for server in asked}
        return replace(self, **branches)  # type: ignore[arg-type]  # their names are fields


def read(given: str | Path | None, robot: Robot, *, mapped: bool = True) -> Parameters:
    """What Nav2 is given for `robot`.

    Args:
        given: A file of ROS 2 parameters, or a preset's name; None: the robot's own public file, or, for one that has none, Nav2's
            own fitted to the robot, with what the robot's file says otherwise.
        robot: Who drives.
        mapped: Whether it has a map; without one presets leave out what needs it.

    Raises:
        ClearwayError: the file can't be read, or something in it is wrong.
    """
    if given is None or is_preset(given):
        preset = preset_for(robot) if given is None else read_preset(str(given))
        preset = preset if mapped else without_map(preset)
        preset = with_own(preset, robot) if given is None else preset
        return _settled(preset.tables, preset.source, None)
    path = Path(given)
    if not path.suffix and not path.exists():
        raise unknown("preset or file of Nav2's parameters", str(given), preset_names(), field="params")
    nodes = read_nodes(path)
    return _settled(tables_of(nodes, path), str(path), path)


def is_preset(given: str | Path) -> bool:
    """Whether a preset of that name is there, and no file."""
    return str(given) in preset_names() and not Path(given).exists()


def files(params: str | Path | None = None) -> tuple[Path, ...]:
    """The files of a user whose content decides what the navigator does.

    Args:
        params: The navigator's option.
    """
    if params is None or is_preset(params):
        return ()
    path = Path(params)
    try:
        nodes = read_nodes(path)
        space = namespace(nodes, path)
    except ClearwayError:
        return (path,)
    tree = Path(str(merged(nodes, f"{space}/bt_navigator").get("default_nav_to_pose_bt_xml", "")))
    graph = Path(str(merged(nodes, f"{space}/route_server").get("graph_filepath", "")))
    trees = (file for file in dict.fromkeys((tree, path.parent / tree)) if file.suffix == ".xml" and is_there(file))
    return (path, *trees, *(file for file in (path.parent / graph,) if is_there(file)))


def tables_of(nodes: tuple[Node, ...], path: Path) -> dict[str, dict[str, Any]]:
    """What each server is given, as tables within each other; those that no node of the file is meant for are left out.

    Raises:
        ClearwayError: the file is one of several robots.
    """
    space = namespace(nodes, path)
    found: dict[str, dict[str, Any]] = {}
    for server, (name, _) in ALL.items():
        if any(node.matches(space + name) and (server not in OPTIONAL or node.name.endswith(name)) for node in nodes):
            found[server] = nested(merged(nodes, space + name), path)
    return found


def namespace(nodes: tuple[Node, ...], path: Path) -> str:
    """The namespace in which the nodes of the file are, such as `/robot1`; empty: the root.

    Raises:
        ClearwayError: there are several.
    """
    names = [name for name, _ in (SERVERS | OPTIONAL).values()]
    spaces = {
        node.name.removesuffix(name): None
        for node in nodes
        for name in names
        if not node.wild and node.name.endswith(name)
    }
    if len(spaces) > 1:
        raise ClearwayError(
            f"holds the parameters of several robots: {', '.join(sorted(s or '/' for s in spaces))}; give each a file of its own",
            file=path,
        )
    return next(iter(spaces), "")


def reader_of(server: str) -> type[Group]:
    """What reads the parameters of a server."""
    module, _, name = ALL[server][1].partition(":")
    found: type[Group] = getattr(importlib.import_module(module), name)
    return found


def _settled(tables: Mapping[str, Mapping[str, Any]], source: str, file: Path | None) -> Parameters:
    started = (*SERVERS, *(name for name in OPTIONAL if name in tables))
    branches = {server: _branch(server, tables, file) for server in started}
    return Parameters(source=source, file=file, tables=tables, **branches)


def _branch(server: str, tables: Mapping[str, Mapping[str, Any]], file: Path | None) -> Branch:
    return settle(reader_of(server), tables.get(server, {}), server, file)
