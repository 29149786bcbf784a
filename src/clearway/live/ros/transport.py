"""What a version of ROS has to offer, so that a robot can be driven by a stack that speaks it."""

from __future__ import annotations

from typing import Protocol

from clearway.geometry.shapes import FloatArray
from clearway.live.ros.said import GoalState, Moment, Place, Twist


class Transport(Protocol):
    """Carries what the robot says to the stack, and back what the stack says. Nothing of it blocks but `wait`.

    Attributes:
        latest: What `/clock` was told last by whoever drove the stack before this process, ns; 0: nobody knows.
    """

    latest: int

    def begin(self, place: Place) -> None:
        """Say what stays: the map, the static transforms, the initial pose. What was heard before is forgotten."""

    def tell(self, moment: Moment) -> None:
        """Say what the robot says each period, `/clock` last."""

    def pursue(self, goal: FloatArray) -> None:
        """Send a goal, (3,) in the frame `map`; `goal()` tells of it from now on."""

    def goal(self) -> GoalState:
        """How far the stack is with the last goal."""

    def cancel(self) -> None:
        """Ask the stack to leave the last goal, if it is on its way, and those that were sent before."""

    def twists(self) -> list[Twist]:
        """What came on `/cmd_vel` since it was last asked, oldest first."""

    def wait(self, seconds: float) -> None:
        """Return when something has come, at the latest after so long."""

    def missing(self) -> str:
        """What of the stack is not there (yet), for the end of a sentence; empty: all is."""

    def close(self) -> None:
        """Leave."""
