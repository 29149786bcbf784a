"""The action NavigateToPose, of a server that thinks about goals for a while."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from clearway.live.ros.said import GoalState
from clearway.live.ros2 import messages as m
from clearway.live.ros2.action import NavigateToPose

NOBODY = (0,) * 16


class Stack:
    """Answers the oldest goal when it is told to, and cancels at once, as action_msgs/srv/CancelGoal has it.

    Attributes:
        asked: Goals that it has not answered yet: number and id.
        active: Ids of those that it pursues.
    """

    def __init__(self) -> None:
        self.asked: list[tuple[int, tuple[int, ...]]] = []
        self.active: set[tuple[int, ...]] = set()

    def service(self, name: str, kind: str) -> Service:
        return Service(self, kind)

    def answers(self, accepted: bool) -> None:
        self.answered = self.asked.pop(0)
        self.reply = m.SendGoalReply(accepted, m.Time(1, 0))
        if accepted:
            self.active.add(self.answered[1])

    def cancel(self, about: Any) -> None:
        assert (about.stamp.sec, about.stamp.nanosec) == (0, 0)  # else those count that were accepted up to then
        which = tuple(about.goal_id.uuid)
        self.active -= self.active if which == NOBODY else {which}


class Service:
    def __init__(self, stack: Stack, kind: str) -> None:
        self.stack, self.kind, self.number = stack, kind, 0

    def ask(self, request: Any) -> int:
        self.number += 1
        if self.kind == m.SEND_GOAL:
            self.stack.asked.append((self.number, tuple(request.goal_id.uuid)))
        elif self.kind == m.CANCEL_GOAL:
            self.stack.cancel(request.goal_info)
        return self.number

    def answer(self, number: int) -> Any:
        return self.stack.reply if self.kind == m.SEND_GOAL and self.stack.answered[0] == number else None


@pytest.mark.parametrize("last", [None, True, False])
def test_a_cancel_is_for_all_that_was_sent(last: bool | None) -> None:
    stack: Any = Stack()
    action = NavigateToPose(stack)
    for _ in range(2):  # it hadn't answered after a second
        action.pursue(0, np.zeros(3))
    stack.answers(True)
    assert action.state() is GoalState.SENT
    if last is not None:
        stack.answers(last)
        assert action.state() is (GoalState.ACCEPTED if last else GoalState.REJECTED)
    assert stack.active
    action.cancel()
    assert not stack.active
