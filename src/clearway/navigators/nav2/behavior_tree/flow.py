"""BehaviorTree.CPP's own control nodes and decorators (src/controls, src/decorators)."""

from __future__ import annotations

from typing import Any, ClassVar

from clearway.navigators.nav2.behavior_tree.nodes import WHOLE, Control, Decorator, Node, Port, Ports, Status


class _InOrder(Control):
    """Asks its children one after another, going on with the one that ran."""

    go_on: ClassVar[Status]  # the answer after which the next child is asked
    forgets: ClassVar[bool] = True  # whether it begins with the first one after a child ended it

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._at = self._skipped = 0

    def tick(self) -> Status:
        if not self.active:
            self._skipped = 0
        self.status = Status.RUNNING
        while self._at < len(self.children):
            answer = self.children[self._at].execute()
            if answer is Status.RUNNING:
                return answer
            if answer is Status.SKIPPED:
                self._skipped += 1
            elif answer is not self.go_on:
                if self.forgets:
                    self._at = 0
                self.reset_children(self._at)
                return answer
            self._at += 1
        skipped = self._skipped == len(self.children)
        self.reset_children()
        self._at = self._skipped = 0
        return Status.SKIPPED if skipped else self.go_on

    def halt(self) -> None:
        if self.forgets:
            self._at = self._skipped = 0
        super().halt()


class Sequence(_InOrder):
    """Succeeds when all children have, one after another; fails when one fails, and begins with the first then."""

    go_on = Status.SUCCESS


class SequenceWithMemory(_InOrder):
    """The same, but goes on with the child that failed, even after a halt."""

    go_on, forgets = Status.SUCCESS, False


class Fallback(_InOrder):
    """Succeeds when a child does, fails when none is left."""

    go_on = Status.FAILURE


class _Reactive(Control):
    """Asks all children at each tick, from the first on; one that runs halts all others."""

    go_on: ClassVar[Status]

    def tick(self) -> Status:
        self.status = Status.RUNNING
        skipped = True
        for index, child in enumerate(self.children):
            answer = child.execute()
            skipped &= answer is Status.SKIPPED
            if answer is Status.RUNNING:
                for other in range(len(self.children)):
                    if other != index:
                        self.halt_child(other)
                return answer
            if answer is Status.SKIPPED:
                self.halt_child(index)
            elif answer is not self.go_on:
                self.reset_children()
                return answer
        self.reset_children()
        return Status.SKIPPED if skipped else self.go_on


class ReactiveSequence(_Reactive):
    """Fails as soon as a child fails, at each tick from the first on."""

    go_on = Status.SUCCESS


class ReactiveFallback(_Reactive):
    """Succeeds as soon as a child does, at each tick from the first on."""

    go_on = Status.FAILURE


class Inverter(Decorator):
    """Success for failure and the reverse."""

    def tick(self) -> Status:
        self.status = Status.RUNNING
        answer = self.child.execute()
        if answer in (Status.RUNNING, Status.SKIPPED):
            return answer
        self.halt_child(0)
        return Status.FAILURE if answer is Status.SUCCESS else Status.SUCCESS


class _Force(Decorator):
    answer: ClassVar[Status]

    def tick(self) -> Status:
        self.status = Status.RUNNING
        answer = self.child.execute()
        if answer in (Status.RUNNING, Status.SKIPPED):
            return answer
        self.halt_child(0)
        return self.answer


class ForceSuccess(_Force):
    """Success, however the child ends."""

    answer = Status.SUCCESS


class ForceFailure(_Force):
    """Failure, however the child ends."""

    answer = Status.FAILURE


class _Loop(Decorator):
    """Asks its child again and again within a tick, as long as it answers so, at most so many times (-1: any)."""

    again: ClassVar[Status]
    times: ClassVar[str]

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._count = 0

    def tick(self) -> Status:
        most = self.value(self.times)
        self.status = Status.RUNNING
        asked = 0
        while most == -1 or self._count < most:
            answer = self.child.execute()
            if answer is Status.RUNNING:
                return answer
            self.halt_child(0)
            if answer is Status.SKIPPED:
                return answer
            if answer is not self.again:
                self._count = 0
                return answer
            self._count += 1
            asked += 1
            if asked >= 1000 and (most == -1 or self._count < most):
                return Status.RUNNING  # its child never runs: the rest at the next tick
        self._count = 0
        return self.again

    def halt(self) -> None:
        self._count = 0
        super().halt()


class RetryUntilSuccessful(_Loop):
    """Tries until its child succeeds, at most `num_attempts` times."""

    PORTS: ClassVar[Ports] = {"num_attempts": Port(WHOLE, 1)}
    again, times = Status.FAILURE, "num_attempts"


class Repeat(_Loop):
    """Lets its child succeed `num_cycles` times; fails when it fails."""

    PORTS: ClassVar[Ports] = {"num_cycles": Port(WHOLE, 1)}
    again, times = Status.SUCCESS, "num_cycles"


class KeepRunningUntilFailure(Decorator):
    """Runs until its child fails."""

    def tick(self) -> Status:
        self.status = Status.RUNNING
        answer = self.child.execute()
        if answer is Status.RUNNING or answer is Status.SKIPPED:
            return answer
        self.halt_child(0)
        return Status.FAILURE if answer is Status.FAILURE else Status.RUNNING


class AlwaysSuccess(Node):
    """Success."""

    def tick(self) -> Status:
        return Status.SUCCESS


class AlwaysFailure(Node):
    """Failure."""

    def tick(self) -> Status:
        return Status.FAILURE


class SubTree(Decorator):
    """Another tree, with a blackboard of its own."""

    def tick(self) -> Status:
        if self.status is Status.IDLE:
            self.status = Status.RUNNING
        answer = self.child.execute()
        if answer in (Status.SUCCESS, Status.FAILURE):
            self.halt_child(0)
        return answer


FLOW: dict[str, type[Node]] = {
    kind.__name__: kind
    for kind in (
        Sequence,
        SequenceWithMemory,
        Fallback,
        ReactiveSequence,
        ReactiveFallback,
        Inverter,
        ForceSuccess,
        ForceFailure,
        RetryUntilSuccessful,
        Repeat,
        KeepRunningUntilFailure,
        AlwaysSuccess,
        AlwaysFailure,
    )
}
