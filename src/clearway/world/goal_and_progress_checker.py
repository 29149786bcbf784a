"""Says when a leg is done and when a trial is over."""

from __future__ import annotations

import math
from collections.abc import Sequence

from clearway.contract import Command, EventKind, Goal
from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.scenario import LegSpec
from clearway.trials import Event, Leg, Outcome, Span

PROGRESS, PATIENCE = 0.5, 20.0
"""Livelock: not once more than 0.5 m away from a place within 20 s (paper B's rule, in the terms of nav2's progress checker)."""
_EPS = 1e-9  # s: instants are multiples of a period, up to rounding


class GoalAndProgressChecker:
    """Follows a trial from leg to leg.

    Attributes:
        leg: index of the leg that is being driven. goal: of that leg; a new object for each.
        spans: of the legs that have ended. events: what happened. reason: why the trial ended, for people.
    """

    def __init__(self, legs: Sequence[Leg], rules: Sequence[LegSpec], livelock: bool, pose: FloatArray) -> None:
        self._legs, self._rules, self._livelock = legs, rules, livelock
        self.spans: list[Span] = []
        self.events: list[Event] = []
        self.reason = ""
        self._clock: float | None = None
        self._baseline = (0.0, 0.0, 0.0)
        self._begin(0, 0.0, pose)

    def judge(self, t: float, pose: FloatArray, estimate: FloatArray, command: Command) -> Outcome | None:
        """Look at one instant: the true `pose` (3, or more behind it), the robot's `estimate` (3,), its `command`.

        Returns:
            How the trial ends, None if it goes on, perhaps with the next leg.
        """
        leg, rule = self._legs[self.leg], self._rules[self.leg]
        x, y = float(pose[0]), float(pose[1])
        if self._clock is None and math.hypot(x - self._from[0], y - self._from[1]) >= rule.clock_starts_after:
            self._clock = t
        if self._arrived(leg, rule, pose, estimate, command):
            self.events.append(Event(t, EventKind.ARRIVED, leg.name))
            self._end(t, reached=True)
            if self.leg + 1 == len(self._legs):
                return Outcome.REACHED
            self._begin(self.leg + 1, t, pose)
            return None
        if command.gave_up is not None:
            return self.stop(t, Outcome.ABORTED, EventKind.GAVE_UP, command.gave_up)
        if t - (self._since if self._clock is None else self._clock) >= leg.time_limit - _EPS:
            return self.stop(
                t, Outcome.TIMEOUT, EventKind.TIMEOUT, f"leg {leg.name!r} took longer than {leg.time_limit:g} s"
            )
        if self._livelock:
            if math.hypot(x - self._baseline[1], y - self._baseline[2]) > PROGRESS:
                self._baseline = (t, x, y)
            elif t - self._baseline[0] >= PATIENCE - _EPS:
                return self.stop(
                    t, Outcome.LIVELOCK, EventKind.LIVELOCK, f"no {PROGRESS:g} m of progress in {PATIENCE:g} s"
                )
        return None

    def stop(
        self,
        t: float,
        outcome: Outcome,
        kind: EventKind,
        detail: str,
        reason: str | None = None,
        body: int | None = None,
    ) -> Outcome:
        """End the trial at `t` [s] in the middle of a leg; `reason` defaults to the event's `detail`."""
        self.events.append(Event(t, kind, detail, body))
        self.reason = detail if reason is None else reason
        self._end(t, reached=False)
        return outcome

    def _arrived(self, leg: Leg, rule: LegSpec, pose: FloatArray, estimate: FloatArray, command: Command) -> bool:
        if rule.arrival == "measured":
            return math.hypot(pose[0] - leg.goal[0], pose[1] - leg.goal[1]) <= leg.xy_tolerance
        if command.arrived is not None:
            return command.arrived
        near = math.hypot(estimate[0] - leg.goal[0], estimate[1] - leg.goal[1]) <= leg.planner_xy_tolerance
        return near and abs(turn_between(float(estimate[2]), float(leg.goal[2]))) <= leg.planner_yaw_tolerance

    def _begin(self, leg: int, t: float, pose: FloatArray) -> None:
        now = self._legs[leg]
        self.leg = leg
        self.goal = Goal(now.goal, now.planner_xy_tolerance, now.planner_yaw_tolerance, leg)
        self._since = t
        self._clock = t if self._rules[leg].clock_starts_after == 0.0 else None
        self._from = float(pose[0]), float(pose[1])
        self._baseline = (t, *self._from)

    def _end(self, t: float, *, reached: bool) -> None:
        start = self._since if self._clock is None else self._clock
        self.spans.append(Span(self.leg, start, t, reached))
