"""Nav2's own control nodes and decorators (nav2_behavior_tree/plugins/control, plugins/decorator)."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.behavior_tree.nodes import (
    IGNORED,
    NUMBER,
    POSITIVE,
    TRUTH,
    VALUE,
    WHOLE,
    Control,
    Decorator,
    Node,
    Port,
    Ports,
    Status,
    TreeError,
)
from clearway.navigators.nav2.behavior_tree.paths import length

_DONE = (Status.SUCCESS, Status.FAILURE)


class PipelineSequence(Control):
    """A sequence that asks the earlier children again while a later one runs (pipeline_sequence.cpp)."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._last = 0

    def tick(self) -> Status:
        skipped = 0
        for index, child in enumerate(self.children):
            answer = child.execute()
            if answer is Status.FAILURE:
                self.reset_children()
                self._last = 0
                return answer
            if answer is Status.SKIPPED:
                skipped += 1
            elif answer is Status.RUNNING and index >= self._last:
                self._last = index
                return answer
        self.reset_children()
        self._last = 0
        return Status.SKIPPED if skipped == len(self.children) else Status.SUCCESS

    def halt(self) -> None:
        super().halt()
        self._last = 0


class RecoveryNode(Control):
    """Asks its first child, after a failure the second, then the first again, so many times (recovery_node.cpp)."""

    PORTS: ClassVar[Ports] = {"number_of_retries": Port(WHOLE, 1)}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._at = self._retries = 0

    def tick(self) -> Status:
        most = self.value("number_of_retries")
        if len(self.children) != 2:
            raise TreeError(f"RecoveryNode {self.name!r} has {len(self.children)} children; it needs two")
        self.status = Status.RUNNING
        while self._retries <= most:
            answer = self.children[self._at].execute()
            if answer is Status.RUNNING:
                return answer
            if self._at == 0:
                if answer is not Status.FAILURE or self._retries >= most:
                    self.halt()
                    return answer
                self.halt_child(0)
                self._at = 1
            elif answer is Status.SUCCESS:
                self.halt_child(1)
                self._at, self._retries = 0, self._retries + 1
            elif answer is Status.SKIPPED:
                self._at = 0
                self.halt_child(1)
                return Status.FAILURE
            else:
                break
        self.halt()
        return Status.FAILURE

    def halt(self) -> None:
        super().halt()
        self._at = self._retries = 0


class RoundRobin(Control):
    """Asks one child until it ends; the next time it is asked, the next one (round_robin_node.cpp)."""

    PORTS: ClassVar[Ports] = {"wrap_around": Port(TRUTH, False)}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._at = self._failed = 0

    def tick(self) -> Status:
        n, skipped = len(self.children), 0
        self.status = Status.RUNNING
        while self._failed + skipped < n:
            answer = self.children[self._at].execute()
            if answer is Status.RUNNING:
                return answer
            self._at += 1
            end = self._at == n and not self.value("wrap_around")
            if self._at == n and not end:
                self._at = 0
            if answer is Status.SUCCESS and not end:
                self._failed = 0
                self.reset_children()
                return answer
            skipped += answer is Status.SKIPPED
            self._failed += answer is Status.FAILURE
            if end:
                break
        self.halt()
        return Status.SKIPPED if skipped == n else Status.FAILURE

    def halt(self) -> None:
        super().halt()
        self._at = self._failed = 0


class NonblockingSequence(Control):
    """Asks all children at each tick; succeeds when all do at once (nonblocking_sequence.cpp)."""

    def tick(self) -> Status:
        running = False
        for child in self.children:
            answer = child.execute()
            if answer is Status.FAILURE:
                self.reset_children()
                return answer
            running |= answer is Status.RUNNING
        if running:
            return Status.RUNNING
        self.reset_children()
        return Status.SUCCESS


class RateController(Decorator):
    """Asks its child at once, while it runs, and then so often (rate_controller.cpp)."""

    PORTS: ClassVar[Ports] = {"hz": Port(NUMBER, 10.0)}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._start, self._first = 0.0, False

    def tick(self) -> Status:
        now = self.servers.now
        if not self.active:
            self._start, self._first = now, True
        self.status = Status.RUNNING
        hz = self.value("hz")
        period = 1.0 / hz if hz > 0 else math.inf
        if not (self._first or self.child.status is Status.RUNNING or now - self._start >= period - 1e-6):
            return self.status
        self._first = False
        answer = self.child.execute()
        if answer is Status.SUCCESS:
            self._start = now
        return answer


class DistanceController(Decorator):
    """Asks its child at once, while it runs, and each time the robot went so far (distance_controller.cpp)."""

    PORTS: ClassVar[Ports] = {"distance": Port(NUMBER, 1.0), "global_frame": IGNORED, "robot_base_frame": IGNORED}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._start: FloatArray | None = None
        self._first = False

    def tick(self) -> Status:
        pose = self.servers.pose
        if not self.active or self._start is None:
            self._start, self._first = pose, True
        self.status = Status.RUNNING
        gone = math.hypot(pose[0] - self._start[0], pose[1] - self._start[1])
        if not (self._first or self.child.status is Status.RUNNING or gone >= self.value("distance")):
            return self.status
        self._first = False
        answer = self.child.execute()
        if answer is Status.SUCCESS:
            self._start = pose
        return answer


class SpeedController(Decorator):
    """Asks its child the oftener the faster the robot is (speed_controller.cpp)."""

    PORTS: ClassVar[Ports] = {
        "min_rate": Port(POSITIVE, 0.1),
        "max_rate": Port(POSITIVE, 1.0),
        "min_speed": Port(NUMBER, 0.0),
        "max_speed": Port(NUMBER, 0.5),
        "goals": VALUE,
        "goal": VALUE,
    }

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._goal: Any = None
        self._start, self._period, self._first = 0.0, 1.0, False

    @classmethod
    def wrong(cls, given: dict[str, Any]) -> str:
        low, high = (given.get(port, cls.PORTS[port].default) for port in ("min_speed", "max_speed"))
        return f"min_speed and max_speed are both {low!r}; there has to be a range between them" if low == high else ""

    def tick(self) -> Status:
        now, goal, fastest = self.servers.now, self.value_or_shared("goal"), self.value("max_rate")
        if not self.active or goal is not self._goal:
            self._goal, self._start, self._period, self._first = goal, now, 1.0 / fastest, True
        self.status = Status.RUNNING
        late = now - self._start >= self._period - 1e-6
        if not (self._first or self.child.status is Status.RUNNING or late):
            return self.status
        self._first = False
        if late:
            slowest, low, high = self.value("min_rate"), self.value("min_speed"), self.value("max_speed")
            share = max((self.servers.speed - low) / (high - low), 0.0)
            self._period = 1.0 / max(min(share * (fastest - slowest) + slowest, fastest), slowest)
            self._start = now
        return self.child.execute()


class GoalUpdatedController(Decorator):
    """Asks its child at once, while it runs, and when another goal came (goal_updated_controller.cpp)."""

    PORTS: ClassVar[Ports] = {"goals": VALUE, "goal": VALUE}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._goal: Any = None

    def tick(self) -> Status:
        goal = self.value_or_shared("goal")
        updated = not self.active or goal is not self._goal
        self._goal = goal
        self.status = Status.RUNNING
        return self.child.execute() if updated or self.child.status is Status.RUNNING else self.status


class GoalUpdater(Decorator):
    """Hands the goals on and asks its child (goal_updater_node.cpp). Nobody publishes others: a new one comes to the navigator."""

    PORTS: ClassVar[Ports] = {"input_goal": VALUE, "input_goals": VALUE, "output_goal": VALUE, "output_goals": VALUE}

    def tick(self) -> Status:
        self.give("output_goal", self.value("input_goal"))
        self.give("output_goals", self.value("input_goals"))
        return self.child.execute()


class SingleTrigger(Decorator):
    """Asks its child until it ends, then fails (single_trigger_node.cpp)."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._first = True

    def tick(self) -> Status:
        if not self.active:
            self._first = True
        self.status = Status.RUNNING
        if not self._first:
            return Status.FAILURE
        answer = self.child.execute()
        self._first = answer not in _DONE
        return answer


class PathLongerOnApproach(Decorator):
    """Asks its child when a new path near the goal is much longer than the one before (path_longer_on_approach.cpp)."""

    PORTS: ClassVar[Ports] = {"path": VALUE, "prox_len": Port(NUMBER, 3.0), "length_factor": Port(NUMBER, 2.0)}

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._old: FloatArray | None = None
        self._first = True

    def tick(self) -> Status:
        new, old = self.value("path"), self._old
        self._first |= old is None or new is None or not len(old) or not len(new) or (old[-1] != new[-1]).any()
        self.status = Status.RUNNING
        if not self._first and old is not None and len(new) != len(old):
            before = length(old)
            if before < self.value("prox_len") and length(new) > self.value("length_factor") * before:
                answer = self.child.execute()
                if answer in _DONE:
                    self._old = new
                    self.halt_child(0)
                return answer
        self._old, self._first = new, False
        return Status.SUCCESS


NAV2_FLOW: dict[str, type[Node]] = {
    kind.__name__: kind
    for kind in (
        PipelineSequence,
        RecoveryNode,
        RoundRobin,
        NonblockingSequence,
        RateController,
        DistanceController,
        SpeedController,
        GoalUpdatedController,
        GoalUpdater,
        SingleTrigger,
        PathLongerOnApproach,
    )
}
