"""Parameters of a costmap and its layers: ROS's names, ROS 1's defaults, checked."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from clearway.geometry.shapes import Circle, Polygon, Shape
from clearway.quantities import Finite, NonNegative, Positive, Vertices, Whole
from clearway.reading.limits import CELLS, SHORTEST


class Group(BaseModel):
    """A namespace of ROS parameters."""

    model_config = ConfigDict(frozen=True, extra="forbid")


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
    """`costmap_2d::Costmap2DROS`. A layer that is None is absent."""

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
    footprint: Vertices | None = Field(default=None, description="m; default: the circle of `robot_radius`")
    robot_radius: Positive | None = Field(default=None, description="m; default: the robot's `planner_footprint`")
    footprint_padding: NonNegative = Field(default=0.01, description="added to each footprint coordinate, m")
    static_layer: StaticLayer | None = None
    obstacle_layer: ObstacleLayer | None = ObstacleLayer()
    inflation_layer: InflationLayer | None = InflationLayer()

    def outline(self, usual: Shape) -> Shape:
        """The robot's footprint in this costmap: its own, or else the `usual` one."""
        if self.footprint is not None:
            return Polygon(self.footprint)
        return usual if self.robot_radius is None else Circle(self.robot_radius)

    @model_validator(mode="after")
    def _extent(self) -> Costmap:
        if (cells := self.width * self.height / self.resolution**2) > CELLS:
            raise ValueError(f"a costmap of {cells:.3g} cells is too large; at most {CELLS:,}")
        return self
