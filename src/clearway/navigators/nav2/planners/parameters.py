"""Parameters of Nav2's planners, each read from its own source (nav2_navfn_planner, nav2_smac_planner)."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.quantities import NonNegative, Positive, Whole


class NavfnParameters(Group):
    """`nav2_navfn_planner::NavfnPlanner` (nav2_navfn_planner/src/parameter_handler.cpp)."""

    tolerance: NonNegative = Field(default=0.5, description="a path may end this far from an unreachable goal, m")
    use_astar: bool = Field(default=False, description="cells nearer to the goal come first; else Dijkstra")
    allow_unknown: bool = Field(default=True, description="whether a path may cross unknown cells")
    max_cycles_factor: Whole = Field(
        default=4, ge=1, le=1000, description="points of a path, at most, for each cell of the map's longer side"
    )
    use_final_approach_orientation: bool = Field(
        default=False, description="the path ends with the heading at which it comes; else with the goal's"
    )


_CLOCK = "no wall clock decides in a trial; max_iterations ends a search"
_SHOWN = "draws for RViz"


class SmootherParameters(Group):
    """The smoother of both Smac planners, their namespace `smoother` (nav2_smac_planner types.hpp, SmootherParams)."""

    tolerance: NonNegative = Field(default=1e-10, description="it ends when all points together move less, m")
    max_iterations: Whole = Field(default=1000, ge=0, le=1_000_000, description="rounds, at most; 0: it does nothing")
    w_data: NonNegative = Field(default=0.2, le=1.0, description="how much a point is drawn to where it was")
    w_smooth: NonNegative = Field(default=0.3, le=1.0, description="how much it is drawn to between its neighbours")
    do_refinement: bool = Field(default=True, description="whether what is smooth is smoothed again")
    refinement_num: Whole = Field(default=2, ge=0, le=1000, description="how often")


class _Smac(Group):
    """What both Smac planners read."""

    allow_unknown: bool = Field(default=True, description="whether a path may cross unknown cells")
    max_iterations: Whole = Field(default=1_000_000, description="nodes visited, at most; 0 or less: as many as needed")
    max_on_approach_iterations: Whole = Field(
        default=1000, description="nodes visited, at most, once within the tolerance; 0 or less: as many as needed"
    )
    downsample_costmap: bool = Field(default=False, description="whether it plans on a coarser costmap")
    downsampling_factor: Whole = Field(default=1, ge=1, le=100, description="cells of the costmap along a coarse one")

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its smoother."""
        return {"smoother": SmootherParameters}


class Smac2DParameters(_Smac):
    """`nav2_smac_planner::SmacPlanner2D` (smac_planner_2d_impl.hpp)."""

    IGNORED: ClassVar[dict[str, str]] = {"max_planning_time": _CLOCK, "terminal_checking_interval": _CLOCK}

    tolerance: NonNegative = Field(default=0.125, description="a path may end this far from an unreachable goal, m")
    cost_travel_multiplier: NonNegative = Field(default=1.0, description="weight of a cell's cost against its length")
    use_final_approach_orientation: bool = Field(
        default=False, description="the path ends with the heading at which it comes; else with the goal's"
    )


class SmacHybridParameters(_Smac):
    """`nav2_smac_planner::SmacPlannerHybrid` (smac_planner_hybrid_impl.hpp)."""

    IGNORED: ClassVar[dict[str, str]] = {
        "terminal_checking_interval": _CLOCK,
        "debug_visualizations": _SHOWN,
        "viz_expansions": _SHOWN,
    }
    JAZZY: ClassVar[dict[str, Any]] = {"allow_primitive_interpolation": False}

    max_planning_time: NonNegative = Field(
        default=5.0,
        description="s that a search may take, counted as 100 000 nodes each: no wall clock decides in a trial",
    )
    tolerance: NonNegative = Field(default=0.25, description="a path may end this far from an unreachable goal, m")
    angle_quantization_bins: Whole = Field(default=72, ge=4, le=720, description="headings in a full turn")
    smooth_path: bool = Field(default=True, description="whether the path is smoothed")
    motion_model_for_search: Literal["DUBIN", "REEDS_SHEPP"] = Field(
        default="DUBIN", description="forwards only, or backwards too"
    )
    minimum_turning_radius: Positive = Field(default=0.4, description="m; at least a cell's edge")
    allow_primitive_interpolation: bool = Field(
        default=True, description="whether wider turns lead to the headings between"
    )
    reverse_penalty: NonNegative = Field(default=2.0, description="multiplies the cost of driving backwards")
    change_penalty: NonNegative = Field(default=0.0, description="added to the next where the turn changes")
    non_straight_penalty: NonNegative = Field(default=1.2, description="multiplies the cost of turning")
    cost_penalty: NonNegative = Field(default=2.0, le=10_000.0, description="weight of a cell's cost against length")
    retrospective_penalty: NonNegative = Field(
        default=0.015, le=1.0, description="by how much a length counts less than 1"
    )
    use_quadratic_cost_penalty: bool = Field(default=False, description="whether a cell's cost counts squared")
    analytic_expansion_ratio: Positive = Field(
        default=3.5, description="how much more often analytic paths to the goal are tried as the goal comes near"
    )
    analytic_expansion_max_length: NonNegative = Field(default=3.0, le=1000.0, description="of an analytic path, m")
    analytic_expansion_max_cost: NonNegative = Field(
        default=200.0, description="a cost that an analytic path may leave but not enter"
    )
    analytic_expansion_max_cost_override: bool = Field(
        default=False, description="whether it may, within a circle of least radius of the goal"
    )
    cache_obstacle_heuristic: bool = Field(
        default=False, description="whether the obstacle heuristic is kept while the goal stays"
    )
    downsample_obstacle_heuristic: bool = Field(
        default=True, description="whether the obstacle heuristic looks at every other cell"
    )
    lookup_table_size: Positive = Field(
        default=20.0,
        le=200.0,
        description="edge of the square about the goal in which paths without obstacles count, m",
    )
    goal_heading_mode: Literal["DEFAULT", "BIDIRECTIONAL", "ALL_DIRECTION"] = Field(
        default="DEFAULT", description="the goal's heading counts; or it or its opposite; or none"
    )
    coarse_search_resolution: Whole = Field(
        default=1, description="of all headings at the goal, each how-manieth is tried first; 0 or less: 1"
    )

    @model_validator(mode="after")
    def _divides(self) -> SmacHybridParameters:
        if self.angle_quantization_bins % max(1, self.coarse_search_resolution):
            raise ValueError(
                f"coarse_search_resolution must divide angle_quantization_bins; {self.coarse_search_resolution} does not "
                f"divide {self.angle_quantization_bins}"
            )
        return self
