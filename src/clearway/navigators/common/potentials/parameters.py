"""Parameters of the global planners, with ROS 1's names and defaults."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from clearway.navigators.common.costmaps.parameters import Group
from clearway.quantities import NonNegative, Positive, Whole


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
