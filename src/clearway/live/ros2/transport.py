"""A robot's topics in ROS 2."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import GoalState, Moment, Place, Twist
from clearway.live.ros.topics import Saying, Topic
from clearway.live.ros2 import messages as m
from clearway.live.ros2.action import NavigateToPose
from clearway.live.ros2.node import LATCHED, RELIABLE, SENSOR, Node, taken


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

        def says(topic: Topic) -> Callable[[Any], object]:
            how = LATCHED if topic.latched else SENSOR if topic.sensor else RELIABLE
            writer = node.writer(topic.name, m.message(topic.kind), how, topic.depth)
            return lambda message: writer.write(message)

        self._saying = Saying(m.WRITING, says)
        self._commands = node.reader("cmd_vel", m.TwistStamped if stamped else m.Twist)
        self._action = NavigateToPose(node)
        self._stamped = stamped

    def begin(self, place: Place) -> None:
        self.twists()
        self._saying.begin(place)

    def tell(self, moment: Moment) -> None:
        self._saying.tell(moment)

    def pursue(self, goal: FloatArray) -> None:
        self._action.pursue(self._saying.stamp, goal)

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
        publisher = f"DDS handle {said.sample_info.publication_handle % 2**64:x}"
        if not self._stamped:
            return Twist(said.linear.x, said.linear.y, said.angular.z, publisher)
        time = said.header.stamp
        return Twist(
            said.twist.linear.x, said.twist.linear.y, said.twist.angular.z, publisher,
            said.header.frame_id, time.sec * 10**9 + time.nanosec,
        )  # fmt: skip
