"""Parameters of Nav2's costmaps and their layers (nav2_costmap_2d: src/costmap_2d_ros.cpp, plugins/*.cpp)."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.outline import Outline
from clearway.navigators.nav2.parameters.plugins import named, twice
from clearway.quantities import Finite, NonNegative, Positive, Whole
from clearway.reading.limits import CELLS, SHORTEST

_TOPIC = "there are no topics: the sensor is the robot's lidar, the map is the one that it is given"
_FRAMES = "there are no transforms to wait for"


def _outside(low: float, high: float, height: float) -> str | None:
    return "max_obstacle_height" if height > high else "min_obstacle_height" if height < low else None


class StaticLayer(Group):
    """`nav2_costmap_2d::StaticLayer`: the map."""

    enabled: bool = True
    footprint_clearing_enabled: bool = Field(
        default=False, description="whether the cells under the footprint are freed"
    )
    restore_cleared_footprint: bool = Field(default=True, description="whether they are as before once the robot left")

    IGNORED: ClassVar[dict[str, str]] = {
        "map_topic": _TOPIC,
        "map_subscribe_transient_local": _TOPIC,
        "subscribe_to_updates": _TOPIC,
        "transform_tolerance": _FRAMES,
    }


class Source(Group):
    """A sensor of an obstacle or voxel layer. Whatever its name and topic are, it is the robot's lidar."""

    data_type: Literal["LaserScan", "PointCloud2"] = Field(
        default="LaserScan", description="only LaserScan is there; a PointCloud2 sees nothing here"
    )
    marking: bool = Field(default=True, description="whether it marks obstacles")
    clearing: bool = Field(default=False, description="whether it clears along its rays")
    obstacle_max_range: NonNegative = Field(default=2.5, description="farthest mark from the sensor, m")
    obstacle_min_range: NonNegative = Field(default=0.0, description="nearest mark from the sensor, m")
    raytrace_max_range: NonNegative = Field(default=3.0, description="farthest clearing from the sensor, m")
    raytrace_min_range: NonNegative = Field(default=0.0, description="nearest clearing from the sensor, m")
    inf_is_valid: bool = Field(default=False, description="whether a ray without return clears as far as it reaches")
    min_obstacle_height: Finite = Field(default=0.0, description="height of the lidar below which it is not heard, m")
    max_obstacle_height: Finite = Field(
        default=0.0,
        description="height of the lidar above which it is not heard, m; by Nav2's default none is heard that is above ground",
    )
    observation_persistence: NonNegative = Field(
        default=0.0, description="how long a scan is kept, s; 0: the newest only"
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "topic": _TOPIC,
        "sensor_frame": _FRAMES,
        "transport_type": _TOPIC,
        "expected_update_rate": "the lidar never falls silent",
    }
    MISSING: ClassVar[dict[str, str]] = {"PointCloud2": "data_type LaserScan; a point cloud sees nothing here"}

    def keeps_out(self, height: float) -> str | None:
        """The bound by which it doesn't hear a lidar of that height [m]; None: it hears it."""
        return _outside(self.min_obstacle_height, self.max_obstacle_height, height)


class ObstacleLayer(Group):
    """`nav2_costmap_2d::ObstacleLayer`."""

    enabled: bool = True
    footprint_clearing_enabled: bool = Field(
        default=True, description="whether the cells under the footprint are freed"
    )
    combination_method: Literal[0, 1, 2] = Field(
        default=1, description="0: overwrite the layers below, 1: maximum, 2: maximum that leaves unknown cells unknown"
    )
    min_obstacle_height: Finite = Field(default=0.0, description="height of the lidar below which it doesn't mark, m")
    max_obstacle_height: Finite = Field(default=2.0, description="height of the lidar above which it doesn't mark, m")
    observation_sources: str = Field(default="", description="names of its sensors, with blanks between them")

    IGNORED: ClassVar[dict[str, str]] = {
        "tf_filter_tolerance": _FRAMES,
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its sensors."""
        sources = str(table.get("observation_sources", "")).split()
        return dict.fromkeys(sources, Source) | twice(sources, "observation_sources")

    def keeps_out(self, height: float) -> str | None:
        """The bound by which it doesn't mark what a lidar of that height [m] sees; None: it marks it."""
        return _outside(self.min_obstacle_height, self.max_obstacle_height, height)


class VoxelLayer(ObstacleLayer):
    """`nav2_costmap_2d::VoxelLayer`, as it shows in the plane: a lidar marks the voxels of one height."""

    z_voxels: Whole = Field(default=10, ge=1, le=16, description="voxels above each other")
    origin_z: Finite = Field(default=0.0, description="height of the lowest, m")
    z_resolution: Positive = Field(default=0.2, description="height of one, m")
    unknown_threshold: Whole = Field(default=15, ge=0, description="unknown voxels from which a column is unknown")
    mark_threshold: Whole = Field(
        default=0, ge=0, description="marked voxels in a column above which it is an obstacle"
    )

    IGNORED: ClassVar[dict[str, str]] = ObstacleLayer.IGNORED | {"publish_voxel_map": "nobody looks at it"}

    @property
    def top(self) -> float:
        """Height at which its voxels end, m."""
        return self.origin_z + self.z_voxels * self.z_resolution

    def keeps_out(self, height: float) -> str | None:
        """As for an obstacle layer; above its voxels it marks nothing either, nor where one of a column is not enough."""
        bound = super().keeps_out(height) or ("z_voxels" if height >= self.top else None)
        return bound or ("mark_threshold" if self.mark_threshold > 0 else None)


class InflationLayer(Group):
    """`nav2_costmap_2d::InflationLayer`."""

    enabled: bool = True
    inflation_radius: NonNegative = Field(default=0.55, le=100.0, description="how far costs reach, m")
    cost_scaling_factor: NonNegative = Field(default=10.0, description="decay of the cost with distance, 1/m")
    inflate_unknown: bool = Field(default=False, description="whether unknown cells get a cost")
    inflate_around_unknown: bool = Field(default=False, description="whether unknown cells are obstacles to inflate")
    custom_inscribed_radius: Finite = Field(
        default=-1.0, description="instead of the footprint's, m; negative: the footprint's"
    )

    IGNORED: ClassVar[dict[str, str]] = {"num_threads": "one thread, whose result is the same"}


class DenoiseLayer(Group):
    """`nav2_costmap_2d::DenoiseLayer`: frees obstacles of a few cells."""

    enabled: bool = True
    minimal_group_size: Whole = Field(default=2, ge=0, description="cells below which a group is freed")
    group_connectivity_type: Literal[4, 8] = Field(default=8, description="neighbours of a cell")


LAYERS = {
    "static_layer": "nav2_costmap_2d::StaticLayer",
    "obstacle_layer": "nav2_costmap_2d::ObstacleLayer",
    "inflation_layer": "nav2_costmap_2d::InflationLayer",
}
"""The layers that a costmap has unless `plugins` says otherwise."""


class Costmap(Group):
    """`nav2_costmap_2d::Costmap2DROS`."""

    global_frame: Literal["map", "odom"] = Field(default="map", description="frame that it lies in")
    rolling_window: bool = Field(default=False, description="whether it follows the robot")
    track_unknown_space: bool = Field(
        default=False, description="whether a cell is unknown until something is known of it"
    )
    update_frequency: Positive = Field(default=5.0, description="Hz")
    width: Whole = Field(default=5, ge=1, description="m; with a static layer and no rolling window, the map's")
    height: Whole = Field(default=5, ge=1, description="m; with a static layer and no rolling window, the map's")
    resolution: Positive = Field(default=0.1, ge=SHORTEST, description="edge of a cell, m; likewise the map's")
    origin_x: Finite = Field(default=0.0, description="of the lower-left corner, m; a rolling window ignores it")
    origin_y: Finite = Field(default=0.0, description="of the lower-left corner, m; a rolling window ignores it")
    footprint: Outline = Field(default=(), description="outline in base_link, m; empty: a circle of `robot_radius`")
    robot_radius: NonNegative = Field(
        default=0.1,
        description="m, where there is no `footprint`; with neither, the robot's own `planner_footprint` holds and not 0.1",
    )
    footprint_padding: Finite = Field(
        default=0.01, description="added to each coordinate of the footprint, m; negative: taken off"
    )
    plugins: tuple[str, ...] = Field(default=tuple(LAYERS), description="names of its layers, from below")
    lethal_cost_threshold: Whole = Field(
        default=100, ge=0, le=100, description="occupancy from which the map's cell is lethal, %"
    )
    trinary_costmap: bool = Field(
        default=True, description="whether the map's cells are free, lethal or unknown and nothing between"
    )
    use_maximum: bool = Field(default=False, description="whether the map combines by maximum instead of overwriting")

    IGNORED: ClassVar[dict[str, str]] = {
        "always_send_full_costmap": "nobody is sent it",
        "publish_frequency": "nobody is sent it",
        "map_vis_z": "nobody looks at it",
        "robot_base_frame": "the robot has one frame",
        "transform_tolerance": _FRAMES,
        "initial_transform_timeout": _FRAMES,
        "subscribe_to_stamped_footprint": "the footprint is the file's",
        "inscribed_obstacle_cost_value": "a map says how certainly a cell is occupied, not what it costs",
        "observation_sources": "each layer has its own",
        "map_topic": _TOPIC,
        "unknown_cost_value": "the map says which of its cells are unknown",
        "filters": "there are no zones on the maps here, so that a filter has nothing to filter",
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its layers."""
        return named("layer", table, table.get("plugins", tuple(LAYERS)), "plugins", LAYERS)

    @model_validator(mode="after")
    def _extent(self) -> Costmap:
        if (cells := self.width * self.height / self.resolution**2) > CELLS:
            raise ValueError(f"a costmap of {cells:.3g} cells is too large; at most {CELLS:,}")
        return self
