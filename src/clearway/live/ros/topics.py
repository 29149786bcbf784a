"""The topics that the robot says something on, and when."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from clearway.live.ros.said import Moment, Place
from clearway.live.ros.writing import Writing


class Topic(NamedTuple):
    """A topic of the robot's.

    Attributes:
        name: Without a namespace.
        kind: The type of its messages.
        depth: How many of them are kept for a subscriber that is late.
        latched: Whether who comes later is told the last one too.
        sensor: Whether it is a sensor's data, of which some may be lost.
    """

    name: str
    kind: str
    depth: int = 10
    latched: bool = False
    sensor: bool = False


TOPICS = (
    Topic("clock", "rosgraph_msgs/msg/Clock", 1),
    Topic("tf", "tf2_msgs/msg/TFMessage", 100),
    Topic("tf_static", "tf2_msgs/msg/TFMessage", 1, latched=True),
    Topic("odom", "nav_msgs/msg/Odometry"),
    Topic("scan", "sensor_msgs/msg/LaserScan", 5, sensor=True),
    Topic("map", "nav_msgs/msg/OccupancyGrid", 1, latched=True),
    Topic("amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", 1, latched=True),
    Topic("initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped", 1, latched=True),
)
"""All of them."""


class Saying:
    """Says on each topic what belongs there.

    Args:
        writing: Makes the messages.
        says: Who publishes on a topic.

    Attributes:
        stamp: What `/clock` was told last, or when the trial begins; ns.
    """

    def __init__(self, writing: Writing, says: Callable[[Topic], Callable[[Any], object]]) -> None:
        self._writing = writing
        self._say = {topic.name: says(topic) for topic in TOPICS}
        self.stamp = 0
        self._mounted = False

    def begin(self, place: Place) -> None:
        """Say what stays; the lidar's mount is said with its first sweep."""
        self.stamp, self._mounted = place.stamp, False
        if place.map is not None:
            self._say["map"](self._writing.grid(place.stamp, place.map))
        self._say["initialpose"](self._writing.located(place.stamp, place.start, True))

    def tell(self, moment: Moment) -> None:
        """Say a moment, `/clock` last."""
        stamp = self.stamp = moment.stamp
        self._say["tf"](self._writing.transforms(moment))
        self._say["odom"](self._writing.odometry(moment))
        if moment.pose is not None:
            self._say["amcl_pose"](self._writing.located(stamp, moment.pose, False))
        if (scan := moment.scan) is not None:
            if not self._mounted:
                self._mounted = True
                self._say["tf_static"](self._writing.mount(stamp, scan))
            self._say["scan"](self._writing.sweep(stamp, scan))
        self._say["clock"](self._writing.clock(stamp))
