"""A robot's topics and its action in ROS 2, by whatever middleware."""

from __future__ import annotations

from typing import Any

from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import GoalState, Moment, Place, Twist
from clearway.live.ros.topics import Saying, Topic
from clearway.live.ros2.action import NavigateToPose
from clearway.live.ros2.messages import WRITING
from clearway.live.ros2.node import Node


class Ros2Transport:
    """Carries what the robot says by a node.

    Args:
        node: Of this robot alone; it is closed with this, also where this can't be made.
        stamped: Whether `/cmd_vel` holds TwistStamped; else Twist.
    """

    latest = 0  # nobody keeps it

    def __init__(self, node: Node, stamped: bool) -> None:
        self._node, self._stamped = node, stamped
        commands = Topic("cmd_vel", f"geometry_msgs/msg/Twist{'Stamped' if stamped else ''}")
        try:
            self._saying = Saying(WRITING, node.publisher)
            self._commands = node.subscription(commands)
            self._action = NavigateToPose(node)
        except BaseException:
            node.close()
            raise

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
        return [self._read(said, publisher) for said, publisher in self._commands.taken()]

    def wait(self, seconds: float) -> None:
        self._node.wait(seconds)

    def missing(self) -> str:
        if not self._action.served():
            return "server of the action navigate_to_pose"
        return "" if self._commands.said() else "publisher of /cmd_vel"

    def close(self) -> None:
        self._node.close()

    def _read(self, said: Any, publisher: str) -> Twist:
        if not self._stamped:
            return Twist(said.linear.x, said.linear.y, said.angular.z, publisher)
        time = said.header.stamp
        return Twist(
            said.twist.linear.x, said.twist.linear.y, said.twist.angular.z, publisher,
            said.header.frame_id, time.sec * 10**9 + time.nanosec,
        )  # fmt: skip
