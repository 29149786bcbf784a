"""Says when a leg is done and when a trial is over.

A leg is reached when the robot calls its goal reached *and stands*, by the truth, whoever drives it. While it calls, the base is
told to stand, as move_base and nav2's controller server do with a goal that is reached; whoever takes the call back before it
stands drives on. Where a judge decides (`arrival = "measured"`), only the true place counts, at any speed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from clearway.contract import Command, EventKind, Goal
from clearway.geometry.angles import turn_between
from clearway.geometry.read_only import read_only
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.scenario import LegSpec
from clearway.trials import Event, Leg, Outcome, Span

PROGRESS, PATIENCE = 0.5, 20.0
"""Livelock: not once more than 0.5 m away from a place within 20 s (paper B's rule, in the terms of nav2's progress checker)."""
TRANS_STOPPED_VELOCITY, ROT_STOPPED_VELOCITY = 0.01, 0.01
"""m/s and rad/s at or below which a robot stands, in the terms of nav2's stopped goal checker. Its defaults (0.25) let a robot
drive on by centimetres; these are ROS's for the same thing: fixed in TrajectoryPlannerROS, PAL's parameters of TIAGo."""
_EPS = 1e-9  # s: instants are multiples of a period, up to rounding


class GoalAndProgressChecker:
    """Follows a trial from leg to leg.

    Attributes:
        leg: Index of the leg that is being driven.
        goal: Goal of that leg; a new object for each.
        spans: Spans of the legs that have ended.
        events: What happened.
        reason: Why the trial ended, for people.
    """

    def __init__(self, legs: Sequence[Leg], rules: Sequence[LegSpec], livelock: bool, pose: FloatArray) -> None:
        self._legs, self._rules, self._livelock = legs, rules, livelock
        self.spans: list[Span] = []
        self.events: list[Event] = []
        self.reason = ""
        self._clock: float | None = None
        self._baseline = (0.0, 0.0, 0.0)
        self._begin(0, 0.0, pose)

    def called(self, estimate: FloatArray, command: Command) -> bool:
        """Whether the robot calls the goal reached: its navigator by `command`, or, where that leaves it to the run, its
        `estimate` (3,) by the planner's tolerances. Where a judge decides, nobody asks the robot."""
        leg = self._legs[self.leg]
        if self._rules[self.leg].arrival == "measured":
            return False
        if command.arrived is not None:
            return bool(command.arrived)
        near = math.hypot(estimate[0] - leg.goal[0], estimate[1] - leg.goal[1]) <= leg.planner_xy_tolerance
        return near and abs(turn_between(float(estimate[2]), float(leg.goal[2]))) <= leg.planner_yaw_tolerance

    def judge(self, t: float, state: FloatArray, called: bool, gave_up: str | None) -> Outcome | None:
        """Look at one instant.

        Args:
            t: Now, s.
            state: (5,) the true pose, v [m/s] and omega [rad/s]; of an omnidirectional base v_y [m/s] behind them.
            called: Whether the robot calls the goal reached.
            gave_up: Why its navigator can't go on, None if it does.

        Returns:
            How the trial ends, None if it goes on, perhaps with the next leg.
        """
        leg, rule = self._legs[self.leg], self._rules[self.leg]
        x, y = float(state[0]), float(state[1])
        if self._clock is None and math.hypot(x - self._from[0], y - self._from[1]) >= rule.clock_starts_after:
            self._clock = t
        if self._reached(leg, rule, state, called):
            self.events.append(Event(t, EventKind.ARRIVED, leg.name))
            self._end(t, reached=True)
            if self.leg + 1 == len(self._legs):
                return Outcome.REACHED
            self._begin(self.leg + 1, t, state)
            return None
        if gave_up is not None:
            return self.stop(t, Outcome.ABORTED, EventKind.GAVE_UP, gave_up)
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

    @staticmethod
    def _reached(leg: Leg, rule: LegSpec, state: FloatArray, called: bool) -> bool:
        if rule.arrival == "measured":
            return math.hypot(state[0] - leg.goal[0], state[1] - leg.goal[1]) <= leg.xy_tolerance
        return (
            called
            and math.hypot(state[3], *state[5:6]) <= TRANS_STOPPED_VELOCITY
            and abs(state[4]) <= ROT_STOPPED_VELOCITY
        )

    def _begin(self, leg: int, t: float, pose: FloatArray) -> None:
        now = self._legs[leg]
        self.leg = leg
        self.goal = Goal(read_only(now.goal), now.planner_xy_tolerance, now.planner_yaw_tolerance, leg)
        self._since = t
        self._clock = t if self._rules[leg].clock_starts_after == 0.0 else None
        self._from = float(pose[0]), float(pose[1])
        self._baseline = (t, *self._from)

    def _end(self, t: float, *, reached: bool) -> None:
        start = self._since if self._clock is None else self._clock
        self.spans.append(Span(self.leg, start, t, reached))
