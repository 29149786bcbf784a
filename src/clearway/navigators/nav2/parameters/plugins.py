"""Which group reads the parameters of a plug-in, by the names that ROS's pluginlib has for it."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from clearway.errors import ClearwayError, nearest, shown
from clearway.navigators.nav2.parameters.group import Group, Readers

_HERE = "clearway.navigators.nav2"

PLUGINS: dict[str, dict[str, str]] = {
    "controller": {
        "nav2_mppi_controller::MPPIController": f"{_HERE}.controllers.mppi.parameters:MPPIParameters",
        "dwb_core::DWBLocalPlanner": f"{_HERE}.controllers.dwb.parameters:DWBParameters",
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": (
            f"{_HERE}.controllers.parameters:RegulatedPurePursuitParameters"
        ),
        "nav2_rotation_shim_controller::RotationShimController": f"{_HERE}.controllers.parameters:RotationShimParameters",
    },
    "planner": {
        "nav2_navfn_planner::NavfnPlanner": f"{_HERE}.planners.parameters:NavfnParameters",
        "nav2_smac_planner::SmacPlanner2D": f"{_HERE}.planners.parameters:Smac2DParameters",
        "nav2_smac_planner::SmacPlannerHybrid": f"{_HERE}.planners.parameters:SmacHybridParameters",
    },
    "goal checker": {
        "nav2_controller::SimpleGoalChecker": f"{_HERE}.goal_checkers:SimpleGoal",
        "nav2_controller::StoppedGoalChecker": f"{_HERE}.goal_checkers:StoppedGoal",
        "nav2_controller::PositionGoalChecker": f"{_HERE}.goal_checkers:PositionGoal",
    },
    "progress checker": {
        "nav2_controller::SimpleProgressChecker": f"{_HERE}.progress_checkers:SimpleProgress",
        "nav2_controller::PoseProgressChecker": f"{_HERE}.progress_checkers:PoseProgress",
    },
    "DWB critic": {
        f"dwb_critics::{name}Critic": f"{_HERE}.controllers.dwb.parameters:{name}Critic"
        for name in (
            "RotateToGoal",
            "Oscillation",
            "BaseObstacle",
            "ObstacleFootprint",
            "GoalAlign",
            "PathAlign",
            "PathDist",
            "GoalDist",
            "Twirling",
            "PreferForward",
        )
    },
    "path handler": {"nav2_controller::FeasiblePathHandler": f"{_HERE}.path_handler:FeasiblePath"},
    "layer": {
        "nav2_costmap_2d::StaticLayer": f"{_HERE}.parameters.costmaps:StaticLayer",
        "nav2_costmap_2d::ObstacleLayer": f"{_HERE}.parameters.costmaps:ObstacleLayer",
        "nav2_costmap_2d::VoxelLayer": f"{_HERE}.parameters.costmaps:VoxelLayer",
        "nav2_costmap_2d::InflationLayer": f"{_HERE}.parameters.costmaps:InflationLayer",
        "nav2_costmap_2d::DenoiseLayer": f"{_HERE}.parameters.costmaps:DenoiseLayer",
    },
    "graph file loader": {"nav2_route::GeoJsonGraphFileLoader": f"{_HERE}.parameters.routes:GeoJsonGraphFileLoader"},
    "edge scorer": {
        f"nav2_route::{name}Scorer": f"{_HERE}.routes.scorers:{name}Scorer"
        for name in (
            "Distance",
            "Time",
            "Penalty",
            "Costmap",
            "DynamicEdges",
            "GoalOrientation",
            "StartPoseOrientation",
        )
    },
    "smoother": {"nav2_smoother::SimpleSmoother": f"{_HERE}.simple_smoother:SimpleSmoother"},
    "behavior": {
        "nav2_behaviors::Spin": f"{_HERE}.parameters.servers:Spin",
        "nav2_behaviors::BackUp": f"{_HERE}.parameters.servers:DriveOnHeading",
        "nav2_behaviors::DriveOnHeading": f"{_HERE}.parameters.servers:DriveOnHeading",
        "nav2_behaviors::Wait": f"{_HERE}.parameters.servers:Wait",
        "nav2_behaviors::AssistedTeleop": f"{_HERE}.parameters.servers:AssistedTeleop",
    },
}
"""Role -> a plug-in's name -> the group that reads its parameters, as module:Class."""

MISSING: dict[str, str] = {
    "nav2_controller::AxisGoalChecker": "nav2_controller::PositionGoalChecker",
    "nav2_controller::AdaptiveToleranceGoalChecker": "nav2_controller::StoppedGoalChecker",
    "nav2_graceful_controller::GracefulController": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
    "teb_local_planner::TebLocalPlannerROS": "nav2_mppi_controller::MPPIController",
    "nav2_route::SemanticScorer": "nav2_route::PenaltyScorer",
    "nav2_smoother::SavitzkyGolaySmoother": "nav2_smoother::SimpleSmoother",
    "nav2_constrained_smoother/ConstrainedSmoother": "nav2_smoother::SimpleSmoother",
    "nav2_theta_star_planner::ThetaStarPlanner": "nav2_smac_planner::SmacPlanner2D",
    "nav2_smac_planner::SmacPlannerLattice": "nav2_smac_planner::SmacPlannerHybrid",
    "nav2_costmap_2d::RangeSensorLayer": "nav2_costmap_2d::ObstacleLayer",
    "nav2_costmap_2d::NonPersistentVoxelLayer": "nav2_costmap_2d::VoxelLayer",
    "nav2_costmap_2d::LegacyInflationLayer": "nav2_costmap_2d::InflationLayer",
    "nav2_costmap_2d::AsymmetricInflationLayer": "nav2_costmap_2d::InflationLayer",
    **dict.fromkeys(
        (f"nav2_costmap_2d::{kind}Filter" for kind in ("Keepout", "Speed", "Binary", "ZoneParameter")),
        "none: there are no zones on the maps here",
    ),
    "nav2_costmap_2d::PluginContainerLayer": "its layers, listed in `plugins` themselves",
    "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer": "nav2_costmap_2d::VoxelLayer",
}
"""Plug-ins of Nav2's users that are not built, and what is closest."""


def proper(plugin: str) -> str:
    """A plug-in's name as it is since Jazzy: `nav2_navfn_planner/NavfnPlanner` with `::`."""
    return plugin.replace("/", "::")


def group_of(role: str, plugin: str, field: str) -> type[Group] | ClearwayError:
    """What reads the parameters of a plug-in, or that there is no such plug-in.

    Args:
        role: A key of `PLUGINS`.
        plugin: Its name in ROS.
        field: Where that stands, for the message.
    """
    known = PLUGINS[role]
    address = known.get(proper(plugin))
    if address is None:
        instead = {proper(name): closest for name, closest in MISSING.items()}.get(proper(plugin))
        close = nearest(proper(plugin), known, 0.8)
        hint = f"closest is {instead}; " if instead else f"did you mean {close!r}? " if close else ""
        return ClearwayError(
            f"the {role} {shown(plugin)} is not built here; {hint}there are {', '.join(sorted(known)) or 'none'}",
            field=field,
        )
    module, _, name = address.partition(":")
    found: type[Group] = getattr(importlib.import_module(module), name)
    return found


def named(
    role: str, table: Mapping[str, Any], names: Iterable[str], field: str, usual: Mapping[str, str] | None = None
) -> Readers:
    """What reads the namespaces that a list of plug-ins names; nothing does where a name has no plug-in, or one that is not there.

    Args:
        role: A key of `PLUGINS`.
        table: Parameters among which the namespaces stand.
        names: The list.
        field: The name of that list.
        usual: The names that the list has by default, each with its plug-in, which hold where the list is just these.
    """
    listed = tuple(names)
    usual = usual if usual is not None and listed == tuple(usual) else {}
    found: Readers = {}
    for name in listed:
        space = table.get(name, {})
        plugin = space.get("plugin", usual.get(name)) if isinstance(space, dict) else None
        if not isinstance(plugin, str):
            found[name] = ClearwayError(
                f"names {name!r}, and nothing says which {role} that is; write `{name}: {{plugin: ...}}` with one of "
                f"{', '.join(sorted(PLUGINS[role])) or 'none'}",
                field=field,
            )
        else:
            found[name] = group_of(role, plugin, f"{name}.plugin")
    return found | twice(listed, field)


def twice(names: Iterable[str], field: str) -> Readers:
    """The names that stand twice in a list, which nothing reads."""
    return {
        name: ClearwayError(f"has {name!r} twice; each of its names stands once", field=field)
        for name, times in Counter(names).items()
        if times > 1
    }
