"""What a behaviour tree is made of: states, the blackboard, ports, and the four kinds of nodes.

A node is asked by `execute`, which keeps what `tick` answered but for SKIPPED; a node that runs and is no longer asked is
halted by whoever stands above it. Semantics after BehaviorTree.CPP 4: src/tree_node.cpp, control_node.cpp,
decorator_node.cpp, blackboard.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Any, ClassVar, NamedTuple, TypeAlias

from clearway.navigators.nav2.behavior_tree.servers import Servers
from clearway.navigators.nav2.parameters.outline import points_of


class Status(StrEnum):
    """What a node answers, or is in between (IDLE)."""

    IDLE = "idle"
    RUNNING = "running"
    SUCCESS = "success"
    FAILURE = "failure"
    SKIPPED = "skipped"


ACTIVE = frozenset({Status.RUNNING, Status.SUCCESS, Status.FAILURE})
"""States of a node that was asked since it was last reset."""


class TreeError(Exception):
    """The tree can't be ticked on: BehaviorTree.CPP throws, and Nav2 fails the goal. Its text says why."""


class Blackboard:
    """Values by name, which the nodes of a tree share; a subtree has one of its own.

    Args:
        above: That of the tree around it.
        remapped: Name here -> name there.
        autoremap: Whether every other name is the same there, but for those with an underscore in front.
    """

    def __init__(
        self, above: Blackboard | None = None, remapped: dict[str, str] | None = None, *, autoremap: bool = False
    ) -> None:
        self._values: dict[str, Any] = {}
        self._above, self._remapped, self._autoremap = above, remapped or {}, autoremap

    def _place(self, key: str) -> tuple[Blackboard, str]:
        if self._above is not None:
            if key.startswith("@"):
                return self._above._place(key)
            if key in self._remapped:
                return self._above._place(self._remapped[key])
            if self._autoremap and not key.startswith("_"):
                return self._above._place(key)
        return self, key.removeprefix("@")

    def get(self, key: str) -> Any:
        """What stands under a name, None if nothing does."""
        board, name = self._place(key)
        return board._values.get(name)

    def set(self, key: str, value: Any) -> None:
        """Put a value under a name."""
        board, name = self._place(key)
        board._values[name] = value


def _number(text: str) -> float:
    if math.isnan(value := float(text)):
        raise ValueError("not a number")
    return value


def _positive(text: str) -> float:
    if (value := _number(text)) <= 0.0:
        raise ValueError("not above 0")
    return value


def _truth(text: str) -> bool:
    return {"true": True, "1": True, "false": False, "0": False}[text.strip().lower()]


def _whole_numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(";") if part.strip())


def _names(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.replace(";", ",").split(",") if part.strip())


NUMBER, WHOLE, TRUTH, TEXT = (_number, "a number"), (int, "a whole number"), (_truth, "true or false"), (str, "a text")
POSITIVE = (_positive, "a number above 0")
OUTLINE = (points_of, 'an outline such as "[[0.3, 0.2], [0.3, -0.2], [-0.3, 0.0]]", in metres')
WHOLES, NAMES = (_whole_numbers, "whole numbers between semicolons"), (_names, "names between semicolons")


class Port(NamedTuple):
    """What a node takes or gives under an attribute of its XML.

    Attributes:
        kind: How a text is read, and in words what it is to be; None: a value of the blackboard only, `{name}`.
        default: Without the attribute, or where the blackboard holds nothing.
        ignored: Whether it has no meaning here.
    """

    kind: tuple[Callable[[str], Any], str] | None = None
    default: Any = None
    ignored: bool = False


Ports: TypeAlias = dict[str, Port]
"""A node's attributes by their names."""

VALUE = Port()
IGNORED = Port(TEXT, ignored=True)
RESULT = {"error_code_id": VALUE, "error_msg": VALUE}
ROS = {"server_name": IGNORED, "server_timeout": IGNORED}


class Key(NamedTuple):
    """An attribute `{name}`.

    Attributes:
        name: On the blackboard.
    """

    name: str


class Node:
    """A node of a tree.

    Attributes:
        PORTS: Its attributes.
        SERVER: The server that it asks, of those that are started only for trees which do; empty: none of these.
        status: Its state.
        name: By which messages call it.
        children: Those below it.
    """

    PORTS: ClassVar[Ports] = {}
    SERVER: ClassVar[str] = ""

    def __init__(
        self, name: str, given: dict[str, Any], board: Blackboard, servers: Servers, children: Sequence[Node] = ()
    ) -> None:
        """
        Args:
            name: Of the node.
            given: Its attributes, read: a `Key` or a value.
            board: Its tree's blackboard.
            servers: What it may ask and command.
            children: Those below it, in their order.
        """
        self.name, self.status, self.children = name, Status.IDLE, tuple(children)
        self._given, self._board, self.servers = given, board, servers

    @classmethod
    def wrong(cls, given: dict[str, Any]) -> str:
        """What is wrong with attributes together, each of which is right by itself; empty: nothing."""
        return ""

    def execute(self) -> Status:
        """Tick it and keep the answer (TreeNode::executeTick)."""
        answer = self.tick()
        if answer is not Status.SKIPPED:
            self.status = answer
        return answer

    def tick(self) -> Status:
        """What it answers now."""
        raise NotImplementedError

    def halt(self) -> None:
        """Stop: it runs and is no longer asked."""

    def value(self, port: str) -> Any:
        """What an input port holds."""
        given = self._given.get(port)
        found = self._board.get(given.name) if isinstance(given, Key) else given
        return self.PORTS[port].default if found is None else found

    def value_or_shared(self, port: str) -> Any:
        """The same; without the attribute what the blackboard has under the port's name (BT::getInputOrBlackboard)."""
        return self.value(port) if port in self._given else self._board.get(port)

    def give(self, port: str, value: Any) -> None:
        """Write an output port, if the XML names a place for it."""
        given = self._given.get(port)
        if isinstance(given, Key):
            self._board.set(given.name, value)

    @property
    def active(self) -> bool:
        """Whether it was asked since it was last reset (BT::isStatusActive)."""
        return self.status in ACTIVE


class Control(Node):
    """A node with any number of children."""

    def halt_child(self, index: int) -> None:
        """Halt a child if it runs; it is idle then."""
        child = self.children[index]
        if child.status is Status.RUNNING:
            child.halt()
        child.status = Status.IDLE

    def reset_children(self, first: int = 0) -> None:
        """The same for all from the `first` one."""
        for index in range(first, len(self.children)):
            self.halt_child(index)

    def halt(self) -> None:
        """Stop, and everything below."""
        self.reset_children()
        self.status = Status.IDLE


class Decorator(Control):
    """A node with one child."""

    @property
    def child(self) -> Node:
        """The one below."""
        return self.children[0]

    def execute(self) -> Status:
        """Tick it; a child that came to an end is idle afterwards (DecoratorNode::executeTick)."""
        answer = super().execute()
        if self.child.status in (Status.SUCCESS, Status.FAILURE):
            self.child.status = Status.IDLE
        return answer
