"""A robot's topics in ROS 1."""

from __future__ import annotations

from contextlib import suppress

from clearway.geometry.shapes import FloatArray
from clearway.live.line import WireError
from clearway.live.ros.said import GoalState, Moment, Place, Twist
from clearway.live.ros.topics import Saying
from clearway.live.ros1.action import MoveBase
from clearway.live.ros1.messages import WRITING
from clearway.live.ros1.node import Node

_CLOCK = "/clearway_clock"
"""The parameter with what `/clock` was told last, ns as text: XML-RPC's numbers have 32 bits."""
_CLEARS = 1.0
"""s that move_base is waited for to clear its costmaps."""


class Tcp:
    """Carries what the robot says by TCPROS, and tells the master's parameters that time is simulated.

    Args:
        master: Where the master listens.
        host: The address of this machine on which other nodes reach this one.
        namespace: Before the topics' names.

    Raises:
        WireError: there is no master, or somebody else publishes the time.
    """

    def __init__(self, master: str, host: str, namespace: str) -> None:
        node = self._node = Node(master, host, namespace)
        try:
            if clocks := node.master.publishers("/clock"):
                raise WireError(f"has {clocks[0]} that publishes /clock; the simulated robot alone may")
            node.master.call("setParam", "/use_sim_time", True)
            kept = node.master.call("getParam", _CLOCK) if node.master.call("hasParam", _CLOCK) else ""
            self.latest = int(kept) if isinstance(kept, str) and kept.isdecimal() else 0
            self._saying = Saying(WRITING, lambda topic: node.publisher(topic.name, topic.kind, topic.latched).publish)
            self._commands = node.subscription("cmd_vel", "geometry_msgs/msg/Twist")
            self._action = MoveBase(node)
        except BaseException:
            node.close()
            raise
        self._seen = False

    def begin(self, place: Place) -> None:
        self.twists()
        self._seen = False
        self._node.call("move_base/clear_costmaps", _CLEARS)
        self._saying.begin(place)

    def tell(self, moment: Moment) -> None:
        self._saying.tell(moment)
        if moment.scan is not None and not self._seen:  # what the last sweep of the trial before marked is there again
            self._seen = True
            self._node.call("move_base/clear_costmaps", _CLEARS)

    def pursue(self, goal: FloatArray) -> None:
        self._keep_clock()
        self._action.pursue(self._saying.stamp, goal)

    def goal(self) -> GoalState:
        return self._action.state()

    def cancel(self) -> None:
        self._action.cancel()

    def twists(self) -> list[Twist]:
        return [Twist(said.linear.x, said.linear.y, said.angular.z, who) for who, said in self._commands.take()]

    def wait(self, seconds: float) -> None:
        self._node.wait(seconds)

    def missing(self) -> str:
        servers = self._action.servers()
        if not servers:
            return "server of the action move_base"
        if not self._commands.connected():
            return f"publisher of /cmd_vel{f' ({self._commands.problem})' if self._commands.problem else ''}"
        on_time = servers & self._node.subscribers("clock")
        if not on_time:
            return f"subscriber of /clock in {min(servers)} (/use_sim_time is to be true before it starts)"
        server = min(on_time)
        # what is said before is lost to it: the transforms of a pose's moment, say
        late = self._node.unconnected(server)
        return f"connection of its subscriber {server} to {late[0]}" if late else ""

    def close(self) -> None:
        self._keep_clock()
        self._node.close()

    def _keep_clock(self) -> None:
        """Leave word how far `/clock` has come, as the stack outlives this process: actionlib refuses goals that are older than the
        last one that was cancelled, and what sleeps by the clock fails where that goes back."""
        if self._saying.stamp:
            with suppress(WireError):  # a stack can do without its master
                self._node.master.call("setParam", _CLOCK, str(self._saying.stamp))
