"""A robot's topics in ROS 2."""

from __future__ import annotations

from typing import Any

from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import BASE, LASER, GoalState, Moment, Place, Twist
from clearway.live.ros2 import messages as m
from clearway.live.ros2 import writing
from clearway.live.ros2.action import NavigateToPose
from clearway.live.ros2.node import LATCHED, SENSOR, Node, taken


class Dds:
    """Carries what the robot says by DDS.

    Args:
        domain: The number of the DDS domain.
        interface: The network interface.
        namespace: Before the topics' names.
        stamped: Whether `/cmd_vel` holds TwistStamped; else Twist.
    """

    def __init__(self, domain: int, interface: str, namespace: str, stamped: bool) -> None:
        node = self._node = Node(domain, interface, namespace)
        self._clock = node.writer("clock", m.Clock, depth=1)
        self._tf = node.writer("tf", m.TFMessage, depth=100)
        self._tf_static = node.writer("tf_static", m.TFMessage, LATCHED, depth=1)
        self._odom = node.writer("odom", m.Odometry)
        self._scan = node.writer("scan", m.LaserScan, SENSOR, depth=5)
        self._map = node.writer("map", m.OccupancyGrid, LATCHED, depth=1)
        self._pose = node.writer("amcl_pose", m.PoseWithCovarianceStamped, LATCHED, depth=1)
        self._initial = node.writer("initialpose", m.PoseWithCovarianceStamped)
        self._commands = node.reader("cmd_vel", m.TwistStamped if stamped else m.Twist)
        self._action = NavigateToPose(node)
        self._stamped, self._stamp = stamped, 0
        self._mount: FloatArray | None = None

    def begin(self, place: Place) -> None:
        self._stamp, self._mount = place.stamp, None
        self.twists()
        if place.map is not None:
            self._map.write(writing.grid(place.stamp, place.map))
        self._initial.write(writing.located(place.stamp, place.start, True))

    def tell(self, moment: Moment) -> None:
        self._stamp = moment.stamp
        self._tf.write(writing.transforms(moment))
        self._odom.write(writing.odometry(moment))
        if moment.pose is not None:
            self._pose.write(writing.located(moment.stamp, moment.pose, False))
        if (scan := moment.scan) is not None:
            if self._mount is None:
                self._mount = scan.mount
                self._tf_static.write(m.TFMessage([writing.transform(moment.stamp, BASE, LASER, scan.mount)]))
            self._scan.write(writing.sweep(moment.stamp, scan))
        self._clock.write(m.Clock(writing.time_of(moment.stamp)))

    def pursue(self, goal: FloatArray) -> None:
        self._action.pursue(self._stamp, goal)

    def goal(self) -> GoalState:
        return self._action.state()

    def cancel(self) -> None:
        self._action.cancel()

    def twists(self) -> list[Twist]:
        return [self._read(sample) for sample in taken(self._commands)]

    def wait(self, seconds: float) -> None:
        self._node.wait(seconds)

    def missing(self) -> str:
        if not self._action.served():
            return "server of the action navigate_to_pose"
        return "" if self._commands.get_matched_publications() else "publisher of /cmd_vel"

    def close(self) -> None:
        self._node.close()

    def _read(self, said: Any) -> Twist:
        publisher = str(said.sample_info.publication_handle)
        if not self._stamped:
            return Twist(said.linear.x, said.linear.y, said.angular.z, publisher)
        time = said.header.stamp
        return Twist(
            said.twist.linear.x, said.twist.linear.y, said.twist.angular.z, publisher,
            said.header.frame_id, time.sec * 10**9 + time.nanosec,
        )  # fmt: skip
