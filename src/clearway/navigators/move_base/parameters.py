"""Parameters of move_base and its plug-ins: ROS's names, ROS's defaults, checked.

A robot's file holds them under `[navigators.move-base]` in the groups that the ROS parameter server has:
`move_base`, `global_costmap`, `local_costmap`, `global_planner`, and one group per local planner. Where a robot's
file is silent, the default is that of the ROS source (ros-planning/navigation, noetic).
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, model_validator

from clearway.navigators.move_base.local_parameters import DWAParameters, TrajectoryParameters
from clearway.quantities import Finite, NonNegative, Positive, Whole
from clearway.reading.limits import CELLS, SHORTEST
from clearway.robots import Robot, RobotTable


class Group(BaseModel):
    """A namespace of ROS parameters."""

    model_config = ConfigDict(frozen=True, extra="forbid")


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
    recovery_behavior_enabled: bool = True
    clearing_rotation_allowed: bool = Field(default=True, description="whether the default recoveries turn in place")
    conservative_reset_dist: NonNegative = Field(default=3.0, description="reset distance of the first recovery, m")
    recovery_behaviors: tuple[RecoveryBehavior, ...] | None = Field(
        default=None, description="in their order; default: conservative reset, rotate, aggressive reset, rotate"
    )


class StaticLayer(Group):
    """`costmap_2d::StaticLayer`: the map."""

    enabled: bool = True
    track_unknown_space: bool = Field(default=True, description="unknown cells stay unknown; else they are free")
    use_maximum: bool = Field(default=False, description="combine by maximum instead of overwriting the layers below")
    lethal_cost_threshold: Whole = Field(
        default=100, ge=0, le=100, description="occupancy from which a cell is lethal, %"
    )
    trinary_costmap: bool = Field(default=True, description="cells below the threshold are free; else scaled")


class ObstacleLayer(Group):
    """`costmap_2d::ObstacleLayer` with one LaserScan source, the robot's lidar."""

    name: str = Field(
        default="obstacle_layer", description="by which ClearCostmapRecovery (`layer_names`) finds it", min_length=1
    )
    enabled: bool = True
    footprint_clearing_enabled: bool = Field(default=True, description="whether the footprint's own cells are freed")
    combination_method: Literal[0, 1] = Field(default=1, description="0: overwrite the layers below, 1: maximum")
    track_unknown_space: bool | None = Field(default=None, description="default: the costmap's")
    marking: bool = Field(default=True, description="whether the scan marks obstacles")
    clearing: bool = Field(default=True, description="whether the scan clears along its rays")
    obstacle_range: NonNegative = Field(default=2.5, description="farthest mark from the sensor, m")
    raytrace_range: NonNegative = Field(default=3.0, description="farthest clearing from the sensor, m")
    inf_is_valid: bool = Field(default=False, description="a ray without return clears as far as it reaches")
    observation_persistence: NonNegative = Field(default=0.0, description="s that a scan is kept; 0: the newest only")


class InflationLayer(Group):
    """`costmap_2d::InflationLayer`."""

    enabled: bool = True
    inflation_radius: NonNegative = Field(default=0.55, le=100.0, description="m")
    cost_scaling_factor: NonNegative = Field(default=10.0, description="decay of the cost with distance, 1/m")
    inflate_unknown: bool = Field(default=False, description="whether unknown cells are inflated too")


class Costmap(Group):
    """`costmap_2d::Costmap2DROS`. Its footprint is the robot's `planner_footprint`. A layer that is None is absent."""

    global_frame: Literal["map", "odom"] = Field(default="map", description="frame that it lies in")
    rolling_window: bool = Field(default=False, description="whether it follows the robot")
    track_unknown_space: bool = Field(default=False, description="unknown by default; else free")
    update_frequency: Positive = Field(default=5.0, description="Hz (at most one update per control period)")
    width: Positive = Field(default=10.0, description="m; with a static layer and no rolling window, the map's")
    height: Positive = Field(default=10.0, description="m; with a static layer and no rolling window, the map's")
    resolution: Positive = Field(
        default=0.05, ge=SHORTEST, description="m; with a static layer and no rolling window, the map's"
    )
    origin_x: Finite = Field(default=0.0, description="of the lower-left corner, m; a rolling window ignores it")
    origin_y: Finite = Field(default=0.0, description="of the lower-left corner, m; a rolling window ignores it")
    footprint_padding: NonNegative = Field(default=0.01, description="added to each footprint coordinate, m")
    static_layer: StaticLayer | None = None
    obstacle_layer: ObstacleLayer | None = ObstacleLayer()
    inflation_layer: InflationLayer | None = InflationLayer()

    @model_validator(mode="after")
    def _extent(self) -> Costmap:
        if (cells := self.width * self.height / self.resolution**2) > CELLS:
            raise ValueError(f"a costmap of {cells:.3g} cells is too large; at most {CELLS:,}")
        return self


class GlobalPlannerGroup(Group):
    """`navfn/NavfnROS` (the first two only) and `global_planner/GlobalPlanner`."""

    allow_unknown: bool = Field(default=True, description="whether a plan may cross unknown cells")
    default_tolerance: NonNegative = Field(
        default=0.0, description="a plan may end this far from an unreachable goal, m (NavfnROS only, as in its source)"
    )
    use_dijkstra: bool = Field(default=True, description="else A*")
    use_quadratic: bool = Field(default=True, description="quadratic approximation of the potential; else plain sum")
    use_grid_path: bool = Field(default=False, description="path along cells; else down the gradient")
    old_navfn_behavior: bool = Field(default=False, description="mirror NavfnROS")
    lethal_cost: Whole = Field(default=253, ge=1, le=255)
    neutral_cost: Whole = Field(default=50, ge=1, le=255)
    cost_factor: Positive = Field(default=3.0, le=5.0, description="multiplies the costmap's cost")
    outline_map: bool = Field(default=True, description="whether the costmap's border is made lethal")
    orientation_mode: Literal[0, 1, 2, 3, 4, 5, 6] = Field(
        default=1, description="0 none, 1 forward, 2 interpolate, 3 forward then interpolate, 4 back, 5 left, 6 right"
    )
    orientation_window_size: Whole = Field(default=1, ge=1, le=255, description="points")


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
