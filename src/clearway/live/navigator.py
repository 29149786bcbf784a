"""A navigator at the other end of a wire."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from clearway.campaigns.plain import plain_command
from clearway.contract import Command, Goal, Observation, Task
from clearway.live.encodings import Encoding, Message
from clearway.live.line import WireError
from clearway.live.messages import BYE, Hello, command_of, goal_of, hello_of, ready_of, reset_of, step_of
from clearway.live.peers import Peer
from clearway.robots import Robot

HELLO_LIMIT = 30.0
"""s within which it has to say hello; what takes longer belongs to its first reset."""

_T = TypeVar("_T")


class Remote:
    """A navigator that is asked by wire. After a failure it is begun anew, with the next trial.

    Args:
        name: By which its errors name it.
        connect: Reaches it.

    Attributes:
        needs: What observations must hold, as it says.
        drives: The kinds of bases that it drives, as it says.

    Raises:
        WireError: it can't be reached, or says no sound hello.
    """

    def __init__(self, name: str, connect: Callable[[], Peer]) -> None:
        self.name, self._connect = name, connect
        self._peer: Peer | None = None
        self._goal: Goal | None = None
        self._told: Message = {}
        self._goals = 0
        self._hello = self._begin()
        self.needs, self.drives = self._hello.needs, self._hello.drives

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Tell it its task; where it is not there any more, it is begun anew."""
        self._goal, self._goals = None, 0
        if self._peer is None and (hello := self._begin()) != self._hello:
            self.close()
            raise WireError(f"{self.name} says another hello than before: {hello}, not {self._hello}")
        self._heard(ready_of, reset_of(task, robot, rng, self._encoding.array))

    def step(self, observation: Observation) -> Command:
        """Have it decide."""
        if self._peer is None:
            raise WireError(f"{self.name} has failed before, and is begun anew by reset()")
        if observation.goal is not self._goal:
            self._goal, self._told = observation.goal, goal_of(observation.goal, self._goals)
            self._goals += 1
        return self._heard(_sound_command_of, step_of(observation, self._told, self._encoding.array))

    def close(self) -> None:
        """Say bye, and end it if it doesn't."""
        self.leave()

    def leave(self, bye: bool = True) -> str:
        """Leave it; what is wrong with how it ends, empty for nothing.

        Args:
            bye: Whether it is told.
        """
        peer, self._peer = self._peer, None
        if peer is None:
            return ""
        try:
            if bye:
                peer.line.send(BYE)
            return peer.leave()
        except EOFError:
            return peer.fate()
        except WireError as error:
            return str(error)
        finally:
            peer.end()

    def __del__(self) -> None:
        if getattr(self, "_peer", None) is not None:
            self.close()

    @property
    def encoding(self) -> str:
        """The name of the encoding that it speaks."""
        return self._encoding.name

    @property
    def _encoding(self) -> Encoding:
        assert self._peer is not None
        assert self._peer.line.encoding is not None
        return self._peer.line.encoding

    def _begin(self) -> Hello:
        try:
            self._peer = self._connect()
        except WireError as error:
            raise WireError(f"{self.name} {error}") from error
        return self._heard(hello_of, limit=HELLO_LIMIT)

    def _heard(
        self, understood: Callable[[Message], _T], message: Message | None = None, limit: float | None = None
    ) -> _T:
        """What it answers to a message. If anything is wrong with that, it is ended, and its last words are told."""
        peer = self._peer
        assert peer is not None
        try:
            if message is not None:
                peer.line.send(message)
            return understood(peer.line.receive(limit))
        except BaseException as error:
            self._peer = None
            try:
                problem, words = self._problem(error, peer, limit), peer.line.last_words()
            finally:
                peer.end()
            if problem is None:  # it was broken off
                error.add_note(words)
                raise
            raise WireError(f"{self.name} {problem}{words}") from None

    def _problem(self, error: BaseException, peer: Peer, limit: float | None) -> str | None:
        if isinstance(error, TimeoutError):
            return f"said no hello within {limit:g} s"
        if isinstance(error, EOFError):
            return peer.fate()
        return str(error) if isinstance(error, WireError) else None


def _sound_command_of(message: Message) -> Command:
    """The command that a message is; one whose values are wrong is a failure of its own, which is told with its last words."""
    try:
        return plain_command(command_of(message))
    except (TypeError, ValueError) as error:
        raise WireError(f"gave a command that is none: {error}") from error
