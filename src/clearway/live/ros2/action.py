"""The action NavigateToPose, asked for as rclcpp_action does it: three services and the goal's status by get_result.

A request carries the handle of the writer that asks and a number before its fields, and its reply carries the same; that is
rmw_cyclonedds' way, other middlewares of ROS 2 have others.
"""

from __future__ import annotations

import secrets
from typing import Any

from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import FINISHED, GoalState
from clearway.live.ros2 import messages as m
from clearway.live.ros2.node import RELIABLE, Node, taken

_ENDED = {4: GoalState.SUCCEEDED, 5: GoalState.CANCELED, 6: GoalState.ABORTED}
"""action_msgs/GoalStatus."""


class Service:
    """A service as its client.

    Args:
        node: Who asks.
        name: Of the service.
        request: The kind of the requests.
        reply: The kind of the replies; None: they are not read.
    """

    def __init__(self, node: Node, name: str, request: type[Any], reply: type[Any] | None) -> None:
        client = "clientid=" + ".".join(f"{byte:x}" for byte in secrets.token_bytes(16)) + ";"
        self._request, self._number = request, 0
        self._replies = None if reply is None else node.reader(f"{name}Reply", reply, prefix="rr", about=client)
        self._requests = node.writer(f"{name}Request", request, RELIABLE, prefix="rq", about=client)
        self._guid = self._requests.get_instance_handle() % 2**64  # it is given as signed

    def ask(self, *fields: Any) -> int:
        """Send a request; its number."""
        self._number += 1
        self._requests.write(self._request(m.RequestId(self._guid, self._number), *fields))
        return self._number

    def answer(self, number: int) -> Any:
        """The reply to a request; None: not yet. Replies to others are dropped, as each of ours replaces the one before."""
        assert self._replies is not None
        for reply in taken(self._replies):
            if (reply.request.guid, reply.request.seq) == (self._guid, number):
                return reply
        return None

    def served(self) -> bool:
        """Whether there is a server."""
        there = bool(self._requests.get_matched_subscriptions())
        return there and (self._replies is None or bool(self._replies.get_matched_publications()))


class NavigateToPose:
    """The client of the action.

    Args:
        node: Who asks.
    """

    def __init__(self, node: Node) -> None:
        at = "navigate_to_pose/_action/"
        self._send = Service(node, f"{at}send_goal", m.SendGoalRequest, m.SendGoalReply)
        self._result = Service(node, f"{at}get_result", m.GetResultRequest, m.GetResultReply)
        self._cancel = Service(node, f"{at}cancel_goal", m.CancelRequest, None)
        self._state: GoalState | None = None
        self._goal = m.UUID([0] * 16)
        self._asked = 0

    def served(self) -> bool:
        """Whether there is a server."""
        return all(service.served() for service in (self._send, self._result, self._cancel))

    def pursue(self, stamp: int, goal: FloatArray) -> None:
        """Send a goal, (3,) in the map."""
        self._goal = m.UUID(list(secrets.token_bytes(16)))
        self._asked = self._send.ask(self._goal, m.WRITING.goal(stamp, goal), "")
        self._state = GoalState.SENT

    def state(self) -> GoalState:
        """How far the stack is with the last goal."""
        assert self._state is not None
        if self._state is GoalState.SENT and (reply := self._send.answer(self._asked)) is not None:
            self._state = GoalState.ACCEPTED if reply.accepted else GoalState.REJECTED
            if reply.accepted:
                self._asked = self._result.ask(self._goal)
        if self._state is GoalState.ACCEPTED and (reply := self._result.answer(self._asked)) is not None:
            self._state = _ENDED.get(reply.status, GoalState.ABORTED)
        return self._state

    def cancel(self) -> None:
        """Ask the stack to leave the last goal, if it is on its way."""
        if self._state is not None and self._state not in FINISHED | {GoalState.REJECTED}:
            self._cancel.ask(m.GoalInfo(self._goal, m.Time(0, 0)))
            self._state = GoalState.CANCELED
