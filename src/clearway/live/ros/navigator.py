"""A ROS stack as a navigator: the trial is its simulated robot."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from clearway.contract import Command, Goal, Observation, Task
from clearway.geometry.frames import compose, relative
from clearway.geometry.shapes import FloatArray
from clearway.live.line import WireError
from clearway.live.ros.commands import Commands
from clearway.live.ros.said import FINISHED, GoalState, Moment, Place
from clearway.live.ros.transport import Transport
from clearway.robots import Robot

_ORIGIN = np.zeros(3)
_AGAIN = 1.0
"""s of wall clock after which a goal that is rejected or not answered is sent again; twice as long each time."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How simulated time goes, and how long a stack is waited for.

    Attributes:
        lockstep: Whether `/clock` waits for the command of each period; else it keeps to the wall clock.
        deadline: How long it waits for one, s of wall clock.
        watchdog: How long the base keeps the last command, s of `/clock`.
        patience: How long the stack is waited for: its action and an accepted goal, any command; s of wall clock.
        fastest: How many times as fast as the wall clock it goes at most: what a stack does beside its commands, such as its
            costmaps, has threads of its own, which nothing waits for.
    """

    lockstep: bool = True
    deadline: float = 0.5
    watchdog: float = 0.5
    patience: float = 8.0
    fastest: float = 1000.0


class RosNavigator:
    """A ROS stack that drives our robot.

    `/clock` begins at the wall clock's whole second, or where it was left if that is later, and never goes back, as stacks drop
    their transforms when it does: what counts is the time since the trial began.

    Args:
        name: By which its errors name it.
        connect: Makes what carries the messages.
        pace: How time goes.
        localised: Whether the stack is given our pose (`/amcl_pose`, `map` to `odom`); else it localises itself.
        alone: What it has for itself, as two robots would both say `/clock` there.

    Attributes:
        needs: What observations must hold.
        drives: The kinds of bases that it drives.
        slowest: How long a decision may take, s of wall clock.
        alone: The same.
    """

    needs = frozenset({"map", "scan"})
    drives = frozenset({"differential", "omnidirectional", "ackermann"})
    _latest: ClassVar[int] = 0

    def __init__(self, name: str, connect: Callable[[], Transport], pace: Pace, localised: bool, alone: str) -> None:
        self.name, self._connect, self._pace, self._localised, self.alone = name, connect, pace, localised, alone
        self.slowest = pace.patience + pace.deadline
        self._transport: Transport | None = connect()

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Put the robot to its start."""
        with self._or_close():
            transport = self._transport = self._transport or self._connect()
            transport.cancel()
            self._period = task.period
            self._goal: Goal | None = None
            self._omnidirectional = robot.limits().kind == "omnidirectional"
            self._commands = Commands(_ns(self._pace.watchdog))
            RosNavigator._latest = max(RosNavigator._latest, transport.latest)
            self._epoch = max(math.ceil(time.time()) * 10**9, RosNavigator._latest + _ns(1.0))
            self._begun: float | None = None
            self._told = 0.0
            transport.begin(Place(self._epoch, task.start, task.map))

    def step(self, observation: Observation) -> Command:
        """Tell the stack of a period, and have its command."""
        transport = self._transport
        if transport is None:
            raise WireError(f"{self.name} has failed before, and is begun anew by reset()")
        with self._or_close():
            return self._step(transport, observation)

    def close(self) -> None:
        """Leave its goal and the stack."""
        transport, self._transport = self._transport, None
        if transport is not None:
            transport.cancel()
            transport.close()

    @contextmanager
    def _or_close(self) -> Iterator[None]:
        """Leave the stack where something goes wrong, in words that begin with our name."""
        try:
            yield
        except WireError as error:
            self.close()
            raise WireError(f"{self.name} {error}") from None
        except BaseException:
            self.close()
            raise

    def _step(self, transport: Transport, observation: Observation) -> Command:
        if observation.goal is not self._goal:
            self._pursue(transport, observation)
        if self._begun is None:
            self._begun = self._silent_since = time.monotonic() - observation.t
        due = self._begun + observation.t
        if self._pace.lockstep:
            due = self._told + self._period / self._pace.fastest
        while (left := due - time.monotonic()) > 0.0:
            transport.wait(min(left, 0.05))
        self._told = time.monotonic()
        now = self._tell(transport, observation)
        self._hear(transport, now)
        if (state := transport.goal()) is GoalState.SUCCEEDED:
            return Command(0.0, 0.0, arrived=True, status=state)
        if state in FINISHED:
            return Command(0.0, 0.0, gave_up=f"the stack {state} the goal", status=state)
        twist = self._commands.now(now)
        return Command(twist.v, twist.omega, arrived=False, v_y=twist.v_y if self._omnidirectional else 0.0)

    def _pursue(self, transport: Transport, observation: Observation) -> None:
        """Wait for the stack, and send a goal until it is accepted: the stack's clock runs meanwhile, the trial's stands.

        The robot senses while it waits: a stack that localises itself is up once its localiser has had a sweep.
        """
        goal = self._goal = observation.goal
        came = time.monotonic()
        until = came + self._pace.patience
        while missing := transport.missing():
            if time.monotonic() > until:
                raise WireError(f"has no {missing} within {self._pace.patience:g} s")
            self._stand(transport, observation, lambda: transport.missing() == missing)
        self._tell(transport, observation)  # where the robot is, before it is sent on
        transport.pursue(goal.pose)
        began, pause = time.monotonic(), _AGAIN
        again = began + pause
        while (state := transport.goal()) in (GoalState.SENT, GoalState.REJECTED):
            place = ", ".join(f"{value:.3g}" for value in goal.pose)
            said = "rejects" if state is GoalState.REJECTED else "does not answer"
            if time.monotonic() > until:
                raise WireError(f"{said} the goal ({place}), for which it had {time.monotonic() - began:.2g} s")
            if time.monotonic() > again:  # it may have gone to a stack that ended a moment ago
                transport.pursue(goal.pose)
                pause *= 2.0
                again = time.monotonic() + pause
            self._stand(transport, observation, lambda: transport.goal() is state)
        transport.twists()  # what it said before is for another goal
        if self._begun is not None:
            self._begun += time.monotonic() - came
        self._silent_since = time.monotonic()

    def _hear(self, transport: Transport, now: int) -> None:
        wait = self._pace.deadline if self._pace.lockstep else 0.0
        until = time.monotonic() + wait
        while True:
            twists = transport.twists()
            if twists:
                self._silent_since = time.monotonic()
            if self._commands.hear(twists, now) or transport.goal() in FINISHED:
                return
            if (left := until - time.monotonic()) <= 0.0:
                break
            transport.wait(min(left, 0.05))
        if time.monotonic() - self._silent_since > self._pace.patience:
            raise WireError(f"has said nothing on /cmd_vel for {self._pace.patience:g} s of wall clock")

    def _stand(self, transport: Transport, observation: Observation, still: Callable[[], bool]) -> None:
        """A period of wall clock in which the trial's clock stands; it is over sooner where it is not `still` as it was."""
        self._tell(transport, observation)
        self._epoch += _ns(self._period)
        until = time.monotonic() + self._period
        while still() and (left := until - time.monotonic()) > 0.0:
            transport.twists()  # for no goal of ours; unread, they would end each wait at once
            transport.wait(left)

    def _tell(self, transport: Transport, o: Observation) -> int:
        if (ahead := RosNavigator._latest - self._epoch - _ns(o.t)) > 0:  # a first sensing is older than the trial
            self._epoch += ahead + _ns(self._period)
        stamp = self._epoch + _ns(o.t)
        RosNavigator._latest = max(RosNavigator._latest, stamp)
        pose: FloatArray | None = o.pose if self._localised else None
        back = None if pose is None else compose(pose, relative(o.odom_pose, _ORIGIN))
        transport.tell(Moment(stamp, o.odom_pose, o.velocity, pose, back, o.scan))
        return stamp


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)
