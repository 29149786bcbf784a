"""The action NavigateToPose, asked for as rclcpp_action does it: three services and the goal's status by get_result."""

from __future__ import annotations

import secrets

from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import FINISHED, GoalState
from clearway.live.ros2 import messages as m
from clearway.live.ros2.node import Node

_ENDED = {4: GoalState.SUCCEEDED, 5: GoalState.CANCELED, 6: GoalState.ABORTED}
"""action_msgs/GoalStatus."""


class NavigateToPose:
    """The client of the action.

    Args:
        node: Who asks.
    """

    def __init__(self, node: Node) -> None:
        at = "navigate_to_pose/_action/"
        self._send = node.service(f"{at}send_goal", m.SEND_GOAL)
        self._result = node.service(f"{at}get_result", m.GET_RESULT)
        self._cancel = node.service(f"{at}cancel_goal", m.CANCEL_GOAL)
        self._state: GoalState | None = None
        self._goal = m.UUID([0] * 16)
        self._asked = 0

    def served(self) -> bool:
        """Whether there is a server."""
        return all(service.served() for service in (self._send, self._result, self._cancel))

    def pursue(self, stamp: int, goal: FloatArray) -> None:
        """Send a goal, (3,) in the map."""
        self._goal = m.UUID(list(secrets.token_bytes(16)))
        self._asked = self._send.ask(m.SendGoalRequest(self._goal, m.WRITING.goal(stamp, goal), ""))
        self._state = GoalState.SENT

    def state(self) -> GoalState:
        """How far the stack is with the last goal."""
        assert self._state is not None
        if self._state is GoalState.SENT and (reply := self._send.answer(self._asked)) is not None:
            self._state = GoalState.ACCEPTED if reply.accepted else GoalState.REJECTED
            if reply.accepted:
                self._asked = self._result.ask(m.GetResultRequest(self._goal))
        if self._state is GoalState.ACCEPTED and (reply := self._result.answer(self._asked)) is not None:
            self._state = _ENDED.get(reply.status, GoalState.ABORTED)
        return self._state

    def cancel(self) -> None:
        """Ask the stack to leave all goals, if the last one is on its way: one that was sent before may have been accepted since."""
        if self._state is not None and self._state not in FINISHED:
            self._cancel.ask(m.CancelRequest(m.GoalInfo(m.UUID([0] * 16), m.Time(0, 0))))  # zeros stand for all
            self._state = GoalState.CANCELED
