"""A ROS stack as a navigator, whatever carries the messages: how it is waited for, and what is said meanwhile."""

from __future__ import annotations

import itertools
import time
from typing import Any

import pytest
from wire_scenes import begin, drive, observations

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.live.line import WireError
from clearway.live.ros.navigator import Pace, RosNavigator
from clearway.live.ros.said import GoalState, Moment, Place, Twist
from clearway.live.ros2.address import stack


class Stack:
    """One that has something to say at once whenever it is waited for, and answers a goal so many s after it was sent first."""

    def __init__(self, answers: float = 0.0, rejects: bool = False) -> None:
        self.answers, self.rejects = answers, rejects
        self.heard: list[tuple[str, float]] = []  # what, and when by the wall clock
        self.stamps: list[float] = []
        self.closed = self.latest = 0

    def _hear(self, what: str) -> None:
        self.heard.append((what, time.monotonic()))

    def begin(self, place: Place) -> None:
        if self.rejects:
            raise WireError("has no ears")

    def tell(self, moment: Moment) -> None:
        self.stamps.append(1e-9 * moment.stamp)
        self._hear("tell")

    def pursue(self, goal: FloatArray) -> None:
        self._hear("pursue")

    def goal(self) -> GoalState:
        since = next(when for what, when in self.heard if what == "pursue")
        return GoalState.ACCEPTED if time.monotonic() - since >= self.answers else GoalState.SENT

    def cancel(self) -> None:
        self._hear("cancel")

    def twists(self) -> list[Twist]:
        return [Twist(0.1, 0.0, 0.0, "me")]

    def wait(self, seconds: float) -> None:
        time.sleep(0.001)

    def missing(self) -> str:
        return ""

    def close(self) -> None:
        self.closed += 1


def navigator(there: Stack, **pace: Any) -> RosNavigator:
    return RosNavigator("navigator 'ros2:'", lambda: there, Pace(**pace), localised=True, alone="ROS 2's domain 0")


def test_while_a_goal_waits_the_clock_keeps_to_the_wall_clock() -> None:
    there = Stack(answers=1.3)
    made = navigator(there, patience=5.0)
    begin(made)
    before = time.monotonic()
    made.step(next(observations(1)))
    assert there.stamps[-1] - there.stamps[0] <= time.monotonic() - before + 0.1
    assert [what for what, _ in there.heard].count("pursue") == 2  # it was sent again after a second


def test_a_goal_is_sent_again_ever_more_seldom_and_not_for_longer_than_it_is_patient() -> None:
    there = Stack(answers=60.0)
    made = navigator(there, patience=3.5)
    begin(made)
    before = time.monotonic()
    with pytest.raises(WireError, match=r"^navigator 'ros2:' does not answer the goal .*, for which it had 3.5 s$"):
        made.step(next(observations(1)))
    assert time.monotonic() - before < made.slowest
    sent = [when for what, when in there.heard if what == "pursue"]
    assert [round(b - a) for a, b in itertools.pairwise(sent)] == [1, 2]
    assert there.closed == 1


def test_it_says_where_it_is_before_it_is_sent_on() -> None:
    there = Stack()
    made = navigator(there)
    begin(made)
    drive(made, 4)
    said = [what for what, _ in there.heard]
    assert said.count("pursue") == 2
    assert all(said[i - 1] == "tell" for i, what in enumerate(said) if what == "pursue")


def test_in_real_time_what_a_later_leg_waits_for_the_stack_is_not_made_up_for() -> None:
    there = Stack()
    made = navigator(there, lockstep=False)
    begin(made)
    *first, again, last = observations(4)
    until = 0.0
    there.missing = lambda: "ears" if time.monotonic() < until else ""  # type: ignore[method-assign]
    for observation in first:
        made.step(observation)
    until = time.monotonic() + 0.5
    made.step(again)  # to a new goal
    before = time.monotonic()
    made.step(last)
    assert time.monotonic() - before > 0.05


def test_the_clock_goes_on_where_another_process_left_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RosNavigator, "_latest", 0)
    there = Stack()
    there.latest = int(time.time() + 1000.0) * 10**9
    made = navigator(there)
    begin(made)
    drive(made, 1)
    assert 1e-9 * there.latest < there.stamps[0] < 1e-9 * there.latest + 5.0


def test_what_goes_wrong_in_reset_is_told_by_its_name_and_left() -> None:
    there = Stack(rejects=True)
    with pytest.raises(WireError, match=r"^navigator 'ros2:' has no ears$"):
        begin(navigator(there))
    assert there.closed == 1


@pytest.mark.parametrize("namespace", ["a//b", "1robot", "a-b", "robot 1", "a__b", "~", "//127.0.0.1", "x*", "röb"])
def test_what_is_no_namespace_is_told(namespace: str) -> None:
    with pytest.raises(ClearwayError, match=r"is no namespace; robot1 is one"):
        stack(namespace)
