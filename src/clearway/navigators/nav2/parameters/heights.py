"""What of a costmap sees nothing of the robot's lidar, by the heights that its file has."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator

from clearway.navigators.common.parameter_table import Row, as_written
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.parameters.costmaps import ObstacleLayer, Source
from clearway.robots import Robot


def with_heights(rows: Iterable[Row], costmap: Branch, robot: Robot | None) -> Iterator[Row]:
    """The rows of a costmap, those of heights that keep out the lidar with a note; one that the file leaves out has a row of its own.

    Args:
        rows: Those of the costmap, named from there on.
        costmap: Its parameters.
        robot: Whose lidar it is; None, or one whose lidar's height is not known: any that is above the ground.
    """
    told = dict(_told(costmap, robot))
    for row in rows:
        found = told.pop(row.name, None)
        yield row if found is None else row._replace(note="; ".join(note for note in (row.note, found.note) if note))
    yield from told.values()


def _told(costmap: Branch, robot: Robot | None) -> Iterator[tuple[str, Row]]:
    known = None if robot is None or robot.lidar is None else robot.lidar.height
    said = "" if robot is None or known is None else f"the lidar of {robot.name} is {known:g} m above the ground: "
    end = " of it" if said else " of a lidar that is above the ground"
    if robot is not None and known is None:
        end += f"; how high that of {robot.name} is, is not known, and it is heard here"
    for where, part, does in _parts(costmap):
        lowest = max(part.min_obstacle_height, sys.float_info.min)  # lidar that it may see
        if (bound := part.keeps_out(lowest if known is None else known)) is not None:
            name, why = f"{where}.{bound}", said
            if bound == "mark_threshold":
                why = f"{said}it marks one voxel of a column, " if said else "a lidar marks one voxel of a column, "
            yield name, Row("default", name, as_written(getattr(part, bound)), note=f"{why}{does} nothing{end}")


def _parts(costmap: Branch) -> Iterator[tuple[str, ObstacleLayer | Source, str]]:
    """What sees with a lidar: the layers and their sensors, each with its name and what it does."""
    for name, layer in costmap.children.items():
        if isinstance(layer.group, ObstacleLayer) and layer.group.enabled:
            yield name, layer.group, "this layer marks"
            for source, sensor in layer.children.items():
                if isinstance(sensor.group, Source) and sensor.group.data_type == "LaserScan":
                    yield f"{name}.{source}", sensor.group, "this sensor hears"
