"""The action move_base, asked for as actionlib's client does it: topics for the goal, its cancelling, status and result."""

from __future__ import annotations

import secrets
from typing import Any

from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import FINISHED, GoalState
from clearway.live.ros1.messages import WRITING, message
from clearway.live.ros1.node import Node

_STATES = {
    0: GoalState.SENT, 1: GoalState.ACCEPTED, 2: GoalState.CANCELED, 3: GoalState.SUCCEEDED, 4: GoalState.ABORTED,
    5: GoalState.REJECTED, 6: GoalState.ACCEPTED, 7: GoalState.SENT, 8: GoalState.CANCELED, 9: GoalState.ABORTED,
}  # fmt: skip
"""actionlib_msgs/GoalStatus."""
_FINAL = FINISHED | {GoalState.REJECTED}


class MoveBase:
    """The client of the action.

    Args:
        node: Who asks.
    """

    def __init__(self, node: Node) -> None:
        self._status = node.subscription("move_base/status", "actionlib_msgs/msg/GoalStatusArray")
        self._result = node.subscription("move_base/result", "move_base_msgs/msg/MoveBaseActionResult")
        self._send = node.publisher("move_base/goal", "move_base_msgs/msg/MoveBaseActionGoal")
        self._cancel = node.publisher("move_base/cancel", "actionlib_msgs/msg/GoalID")
        self._name, self._count = f"{node.name}-{secrets.token_hex(4)}", 0
        self._state: GoalState | None = None
        self._goal: Any = None  # its GoalID

    def servers(self) -> set[str]:
        """Names of the nodes that serve it: they hear goals, and what they say of them is heard."""
        heard = self._status.connected() and self._result.connected()
        return self._send.subscribers() & self._cancel.subscribers() if heard else set()

    def pursue(self, stamp: int, goal: FloatArray) -> None:
        """Send a goal, (3,) in the map."""
        self._count += 1
        self._goal = message("actionlib_msgs/msg/GoalID")(WRITING.time_of(stamp), f"{self._name}-{self._count}")
        self._state = GoalState.SENT
        target = message("move_base_msgs/msg/MoveBaseGoal")(WRITING.goal(stamp, goal))
        self._send.publish(
            message("move_base_msgs/msg/MoveBaseActionGoal")(WRITING.header(stamp, ""), self._goal, target)
        )

    def state(self) -> GoalState:
        """How far the stack is with the last goal."""
        statuses = [status for _, array in self._status.take() for status in array.status_list]
        statuses += [result.status for _, result in self._result.take()]
        for status in statuses:
            if status.goal_id.id == self._goal.id and self._state not in _FINAL:
                self._state = _STATES.get(status.status, GoalState.ABORTED)
        assert self._state is not None
        return self._state

    def cancel(self) -> None:
        """Ask the stack to leave the last goal, if it is on its way, and all that were sent before: by its stamp, as actionlib then
        refuses those too that it hears of later."""
        if self._state is not None and self._state not in FINISHED:
            self._cancel.publish(self._goal)
            self._state = GoalState.CANCELED
