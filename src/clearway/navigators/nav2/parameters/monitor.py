"""Parameters of Nav2's collision monitor: its zones and sources (nav2_collision_monitor/src)."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field

from clearway.errors import ClearwayError, shown
from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.outline import Outline, Points
from clearway.navigators.nav2.parameters.plugins import twice
from clearway.quantities import Finite, NonNegative, Positive, Whole

_TOPIC = "there are no topics here"
_NOBODY_LOOKS = "nobody looks at it"


def _four(points: Points) -> Points:
    if 0 < len(points) < 4:
        raise ValueError(f"has {len(points)} points; a zone has 4 or more, as in Nav2")
    return points


_Shape = Annotated[Outline, AfterValidator(_four)]


class Zone(Group):
    """What all zones have (polygon.cpp)."""

    action_type: Literal["stop", "slowdown", "limit", "approach", "none"] = Field(
        description="what becomes of a command while something is inside: none of it, a share of it, no more than a limit, or "
        "what leaves time_before_collision"
    )
    enabled: bool = True
    min_points: Whole = Field(default=4, description="so many points of the scan inside are something")
    max_points: Whole | None = Field(default=None, description="old form of min_points, less one, which it overrides")
    trigger_consecutive_points: Whole = Field(
        default=1, ge=1, description="commands in a row that find something, until it counts"
    )
    release_consecutive_points: Whole = Field(
        default=1, ge=1, description="commands in a row that find nothing, until that counts"
    )
    slowdown_ratio: NonNegative = Field(default=0.5, description="share of the command that `slowdown` leaves")
    linear_limit: NonNegative = Field(default=0.5, description="speed that `limit` leaves, m/s")
    angular_limit: NonNegative = Field(default=0.5, description="yaw rate that `limit` leaves, rad/s")
    time_before_collision: Positive = Field(
        default=2.0, le=100.0, description="how far ahead `approach` looks, s; a contact then takes as long at least"
    )
    simulation_time_step: Positive = Field(default=0.1, ge=0.001, description="in steps of so much, s")
    sources_names: tuple[str, ...] | None = Field(default=None, description="names of its sources; by default all")

    IGNORED: ClassVar[dict[str, str]] = {
        "visualize": _NOBODY_LOOKS,
        "polygon_pub_topic": _TOPIC,
        "polygon_subscribe_transient_local": _TOPIC,
        "footprint_topic": "an `approach` without points has the local costmap's footprint",
    }
    MISSING: ClassVar[dict[str, str]] = {
        "polygon_sub_topic": "points, or radius: a zone without either is never entered"
    }


class PolygonZone(Zone):
    """A zone of type `polygon`."""

    type: Literal["polygon"] = "polygon"
    points: _Shape = Field(
        default=(), description="its outline in base_link, m; without one the footprint for `approach`, else nothing"
    )


class CircleZone(Zone):
    """A zone of type `circle` about base_link."""

    type: Literal["circle"] = "circle"
    radius: NonNegative | None = Field(default=None, description="m; without one it is never entered")


class VelocityRange(Group):
    """The shape of a velocity polygon for some of the commands."""

    points: _Shape = Field(min_length=4, description="its outline in base_link, m")
    linear_min: Finite = Field(
        description="least speed for which it holds, m/s; forwards, or of any direction if `holonomic`"
    )
    linear_max: Finite = Field(description="largest speed, m/s")
    theta_min: Finite = Field(description="least yaw rate, rad/s")
    theta_max: Finite = Field(description="largest yaw rate, rad/s")
    direction_start_angle: Finite = Field(
        default=-math.pi, description="direction of motion from which, if `holonomic`, rad"
    )
    direction_end_angle: Finite = Field(
        default=math.pi, description="direction of motion up to which, if `holonomic`, rad"
    )


class VelocityZone(Zone):
    """A zone of type `velocity_polygon`: one of several outlines, by the command."""

    type: Literal["velocity_polygon"] = "velocity_polygon"
    velocity_polygons: tuple[str, ...] = Field(
        description="names of its outlines; the first that fits the command holds"
    )
    holonomic: bool = Field(
        default=False, description="whether direction and size of the velocity count, not that forwards"
    )

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its outlines."""
        outlines = table.get("velocity_polygons", ())
        return dict.fromkeys(outlines, VelocityRange) | twice(outlines, "velocity_polygons")


class MonitorSource(Group):
    """A sensor of the collision monitor; a scan, whatever its topic, is that of the robot's lidar (source.cpp)."""

    type: Literal["scan", "pointcloud", "range", "polygon", "costmap"] = Field(
        default="scan", description="only a scan is there; the others see nothing here"
    )
    enabled: bool = True
    source_timeout: NonNegative | None = Field(
        default=None, description="a scan older than this stops the robot, s; 0: never; by default the monitor's"
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "topic": _TOPIC,
        "transport_type": _TOPIC,
        "min_height": "a scan has one height",
        "max_height": "a scan has one height",
        "min_range": "a scan keeps to the lidar's own",
        "use_global_height": "a scan has one height",
        "obstacles_angle": "no range sensor is there",
        "sampling_distance": "no polygon is heard as a source",
        "cost_threshold": "the costmap is no source here",
        "treat_unknown_as_obstacle": "the costmap is no source here",
    }
    MISSING: ClassVar[dict[str, str]] = {
        "pointcloud": "scan",
        "range": "scan",
        "polygon": "scan",
        "costmap": "scan",
        "exclusion_zones": "min_points: no points of a scan are left out",
    }


_ZONES: dict[str, type[Zone]] = {"polygon": PolygonZone, "circle": CircleZone, "velocity_polygon": VelocityZone}


class CollisionMonitorParameters(Group):
    """`collision_monitor` (collision_monitor_node.cpp)."""

    polygons: tuple[str, ...] = Field(default=(), description="names of its zones")
    observation_sources: tuple[str, ...] = Field(default=(), description="names of its sensors")
    enabled: bool = True
    source_timeout: NonNegative = Field(default=2.0, description="a scan older than this stops the robot, s; 0: never")
    stop_pub_timeout: NonNegative = Field(
        default=1.0, description="a robot that was told to rest for so long is told nothing, s"
    )

    IGNORED: ClassVar[dict[str, str]] = {
        "base_frame_id": "the robot has one frame",
        "odom_frame_id": "odometry has one frame",
        "cmd_vel_in_topic": _TOPIC,
        "cmd_vel_out_topic": _TOPIC,
        "state_topic": _TOPIC,
        "transform_tolerance": "there are no transforms to wait for",
        "base_shift_correction": "a scan is as old as the robot's pose",
        "collision_points_marker_3d": _NOBODY_LOOKS,
        "use_realtime_priority": "nothing is late here",
    }

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        """Its zones, then its sensors; nothing reads a zone without a type, or one that listens to a sensor that is not there."""
        found: Readers = {}
        sources, zones = table.get("observation_sources", ()), table.get("polygons", ())
        for name in zones:
            space = table.get(name, {})
            kind = space.get("type") if isinstance(space, dict) else None
            heard = space.get("sources_names") if isinstance(space, dict) else None
            deaf = [source for source in heard if source not in sources] if isinstance(heard, tuple) else []
            if not isinstance(kind, str) or kind not in _ZONES:
                found[name] = ClearwayError(
                    f"is {shown(kind)}; a zone is one of {', '.join(_ZONES)}", field=f"{name}.type"
                )
            elif deaf:
                found[name] = ClearwayError(
                    f"names {shown(deaf[0])}, which is not among the observation_sources", field=f"{name}.sources_names"
                )
            else:
                found[name] = _ZONES[kind]
        found |= dict.fromkeys(sources, MonitorSource)
        return found | twice(zones, "polygons") | twice(sources, "observation_sources")
