"""What a middleware of ROS 2 has to offer, so that a robot speaks by it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from clearway.live.ros.topics import Topic


class Subscription(Protocol):
    """A topic that is read."""

    def taken(self) -> list[tuple[Any, str]]:
        """What came since it was last asked, oldest first, and who said it, for people."""

    def said(self) -> bool:
        """Whether somebody publishes there."""


class Service(Protocol):
    """A service, as its client."""

    def ask(self, request: Any) -> int:
        """Send a request; its number."""

    def answer(self, number: int) -> Any:
        """The reply to a request; None: not yet. Replies to others are dropped, as each of ours replaces the one before."""

    def served(self) -> bool:
        """Whether there is a server."""


class Node(Protocol):
    """A node of ROS 2. Nothing of it blocks but `wait`."""

    def publisher(self, topic: Topic) -> Callable[[Any], object]:
        """Who publishes a message on a topic."""

    def subscription(self, topic: Topic) -> Subscription:
        """Who reads a topic."""

    def service(self, name: str, kind: str) -> Service:
        """The client of a service of a type, such as `action_msgs/srv/CancelGoal`."""

    def wait(self, seconds: float) -> None:
        """Return when a message has come, at the latest after so long."""

    def close(self) -> None:
        """Leave."""
