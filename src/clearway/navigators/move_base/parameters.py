"""Parameters of move_base and its plug-ins: ROS's names, ROS's defaults, checked.

A robot's file holds them under `[navigators.move-base]` in the groups that the ROS parameter server has:
`move_base`, `global_costmap`, `local_costmap`, `global_planner`, and one group per local planner. Where a robot's
file is silent, the default is that of the ROS source (ros-planning/navigation, noetic).
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, model_validator

from clearway.navigators.common.costmaps.parameters import Costmap, Group, StaticLayer
from clearway.navigators.common.potentials.parameters import GlobalPlannerGroup
from clearway.navigators.move_base.local_planners.parameters import DWAParameters, TrajectoryParameters
from clearway.quantities import NonNegative, Positive, Whole
from clearway.robots import Robot, RobotTable


class ClearCostmapRecovery(Group):
    """`clear_costmap_recovery/ClearCostmapRecovery`: forgets what the obstacle layers hold, far from (or near) the robot."""

    type: Literal["clear_costmap_recovery/ClearCostmapRecovery"]
    name: str = Field(min_length=1)
    reset_distance: NonNegative = Field(default=3.0, description="edge of the square around the robot that is kept, m")
    invert_area_to_clear: bool = Field(default=False, description="clear inside the square instead of outside")
    force_updating: bool = Field(default=False, description="update the costmaps at once")
    affected_maps: Literal["both", "local", "global"] = "both"
    layer_names: tuple[str, ...] = Field(
        default=("obstacles",), description="layers that it clears; a layer of another name is left alone, as in ROS"
    )


class RotateRecovery(Group):
    """`rotate_recovery/RotateRecovery`: one turn in place. Its speeds are those of the group TrajectoryPlannerROS."""

    type: Literal["rotate_recovery/RotateRecovery"]
    name: str = Field(min_length=1)
    sim_granularity: Positive = Field(ge=0.001, default=0.017, description="step of its collision check, rad")
    frequency: Positive = Field(default=20.0, description="rate of its commands, Hz (at most one per control period)")


RecoveryBehavior = Annotated[ClearCostmapRecovery | RotateRecovery, Field(discriminator="type")]


class MoveBaseGroup(Group):
    """The node's own parameters (`~`), as in move_base.cpp and MoveBase.cfg."""

    base_global_planner: Literal["navfn/NavfnROS", "global_planner/GlobalPlanner"] = "navfn/NavfnROS"
    base_local_planner: Literal["base_local_planner/TrajectoryPlannerROS", "dwa_local_planner/DWAPlannerROS"] = (
        "base_local_planner/TrajectoryPlannerROS"
    )
    planner_frequency: NonNegative = Field(
        default=0.0, description="Hz; 0: plan for a new goal or after a failure only"
    )
    controller_frequency: Positive = Field(default=20.0, description="Hz (at most one command per control period)")
    planner_patience: NonNegative = Field(default=5.0, description="s without a plan before recovery")
    controller_patience: NonNegative = Field(default=15.0, description="s without a valid command before recovery")
    max_planning_retries: Whole = Field(default=-1, ge=-1, description="attempts to plan before recovery; -1: no bound")
    oscillation_timeout: NonNegative = Field(default=0.0, description="s without progress before recovery; 0: never")
    oscillation_distance: NonNegative = Field(default=0.5, description="what counts as progress, m")
    latch_xy_goal_tolerance: bool = Field(
        default=False,
        description="once at the goal, only turn, even if pushed away: of DWAPlannerROS, which looks for it here and not in its own group",
    )
    recovery_behavior_enabled: bool = True
    clearing_rotation_allowed: bool = Field(default=True, description="whether the default recoveries turn in place")
    conservative_reset_dist: NonNegative = Field(default=3.0, description="reset distance of the first recovery, m")
    recovery_behaviors: tuple[RecoveryBehavior, ...] | None = Field(
        default=None, description="in their order; default: conservative reset, rotate, aggressive reset, rotate"
    )


class Parameters(RobotTable):
    """Everything under `[navigators.move-base]`."""

    TABLE = "navigators.move-base"

    move_base: MoveBaseGroup = MoveBaseGroup()
    global_costmap: Costmap = Costmap(static_layer=StaticLayer())
    local_costmap: Costmap = Costmap(global_frame="odom", rolling_window=True)
    global_planner: GlobalPlannerGroup = GlobalPlannerGroup()
    DWAPlannerROS: DWAParameters = DWAParameters()
    TrajectoryPlannerROS: TrajectoryParameters = TrajectoryParameters()

    @model_validator(mode="before")
    @classmethod
    def _usual(cls, table: Any, about: ValidationInfo) -> Any:
        """Unless its file says otherwise, a global costmap that stands in the map's frame holds the map, a local one rolls in
        odom, and a local planner has the tolerances of the robot's goal checker."""
        if not isinstance(table, dict):
            return table
        usual: dict[str, Any] = {}
        if isinstance(about.context, Robot):
            told = about.context.planner_tolerances
            for planner in ("DWAPlannerROS", "TrajectoryPlannerROS"):
                if isinstance(group := table.get(planner, {}), dict):
                    usual[planner] = {"xy_goal_tolerance": told.xy, "yaw_goal_tolerance": told.yaw} | group
        if isinstance(wide := table.get("global_costmap", {}), dict):
            stands = not wide.get("rolling_window", False) and wide.get("global_frame", "map") == "map"
            usual["global_costmap"] = ({"static_layer": {}} if stands else {}) | wide
        if isinstance(local := table.get("local_costmap", {}), dict):
            usual["local_costmap"] = {"global_frame": "odom", "rolling_window": True} | local
        return table | usual

    @model_validator(mode="after")
    def _navfn_has_few(self) -> Parameters:
        given = self.global_planner.model_fields_set - {"allow_unknown", "default_tolerance"}
        if given and self.move_base.base_global_planner == "navfn/NavfnROS":
            raise ValueError(
                f"global_planner.{sorted(given)[0]} is a parameter of global_planner/GlobalPlanner, "
                "but move_base.base_global_planner is navfn/NavfnROS"
            )
        return self
