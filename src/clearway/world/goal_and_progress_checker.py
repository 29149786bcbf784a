"""Says when a leg is done and when a trial is over.

A leg is reached when the robot calls its goal reached *and stands*, by the truth, whoever drives it. While it calls, the base is
told to stand, as move_base and nav2's controller server do with a goal that is reached; whoever takes the call back before it
stands drives on. Where a judge decides (`arrival = "measured"`), only the true place counts, at any speed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum

from clearway.contract import Command, EventKind, Goal
from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import light, uncompiled
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

GOAL_X, GOAL_Y, GOAL_THETA, PLANNER_XY, PLANNER_YAW, XY, TIME_LIMIT, CLOCK_STARTS_AFTER, MEASURED = range(9)
RULES = 9
"""The rules of a leg, a row of numbers: its goal, its planner's tolerances, the judge's, s, m, and whether a judge decides."""
SINCE, CLOCK, FROM_X, FROM_Y, MOVED, MOVED_X, MOVED_Y = range(7)
PROGRESS_STATE = 7
"""How far a leg has come: when it began, when its clock did (NaN: not yet), where it began; when and where there was progress last."""

Row = FloatArray | list[float]
"""The kernels' row of numbers, and ours: a few of them are looked at in Python before an array is taken apart for a kernel."""


class Verdict(IntEnum):
    """Of an instant."""

    GOES_ON = 0
    REACHED = 1
    GAVE_UP = 2
    TIMEOUT = 3
    LIVELOCK = 4


_GOES_ON = int(Verdict.GOES_ON)  # asked for each period, and a member of an enumeration is slow to ask for


class GoalAndProgressChecker:
    """Follows a trial from leg to leg.

    Attributes:
        leg: Index of the leg that is being driven.
        goal: Goal of that leg; a new object for each.
        spans: Spans of the legs that have ended.
        events: What happened.
        reason: Why the trial ended, for people.
        rules: (l, RULES) of each leg.
        progress: (PROGRESS_STATE,) how far this one has come.
    """

    def __init__(self, legs: Sequence[Leg], rules: Sequence[LegSpec], livelock: bool, pose: FloatArray) -> None:
        self._legs, self._livelock = legs, livelock
        self.rules = [_row(leg, rule) for leg, rule in zip(legs, rules, strict=True)]
        self.progress = [math.nan] * PROGRESS_STATE
        self.spans: list[Span] = []
        self.events: list[Event] = []
        self.reason = ""
        self._begin(0, 0.0, pose)

    def called(self, estimate: FloatArray, command: Command) -> bool:
        """Whether the robot calls the goal reached: its navigator by `command`, or, where that leaves it to the run, its
        `estimate` (3,) by the planner's tolerances. Where a judge decides, nobody asks the robot."""
        rule = self.rules[self.leg]
        if command.arrived is not None:
            return bool(command.arrived) and rule[MEASURED] == 0.0
        return _near_goal(rule, *estimate.tolist())

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
        x, y, _, v, omega, *sideways = state.tolist()
        speed = math.hypot(v, *sideways)
        verdict = _judged(
            self.rules[self.leg], self.progress, t, x, y, speed, omega, called, gave_up is not None, self._livelock
        )
        if verdict == _GOES_ON:
            return None
        leg = self._legs[self.leg]
        if verdict == Verdict.REACHED:
            self.events.append(Event(t, EventKind.ARRIVED, leg.name))
            self._end(t, reached=True)
            if self.leg + 1 == len(self._legs):
                return Outcome.REACHED
            self._begin(self.leg + 1, t, state)
            return None
        if gave_up is not None:
            return self.stop(t, Outcome.ABORTED, EventKind.GAVE_UP, gave_up)
        if verdict == Verdict.TIMEOUT:
            return self.stop(
                t, Outcome.TIMEOUT, EventKind.TIMEOUT, f"leg {leg.name!r} took longer than {leg.time_limit:g} s"
            )
        return self.stop(t, Outcome.LIVELOCK, EventKind.LIVELOCK, f"no {PROGRESS:g} m of progress in {PATIENCE:g} s")

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

    def _begin(self, leg: int, t: float, pose: FloatArray) -> None:
        now = self._legs[leg]
        self.leg = leg
        self.goal = Goal(read_only(now.goal), now.planner_xy_tolerance, now.planner_yaw_tolerance, leg)
        _begin_leg(self.rules[leg], self.progress, t, float(pose[0]), float(pose[1]))

    def _end(self, t: float, *, reached: bool) -> None:
        since, clock = self.progress[SINCE], self.progress[CLOCK]
        start = since if math.isnan(clock) else clock
        self.spans.append(Span(self.leg, start, t, reached))


def _row(leg: Leg, rule: LegSpec) -> list[float]:
    return [
        *leg.goal.tolist(), leg.planner_xy_tolerance, leg.planner_yaw_tolerance, leg.xy_tolerance, leg.time_limit,
        rule.clock_starts_after, float(rule.arrival == "measured"),
    ]  # fmt: skip


@light
def near_goal(rule: Row, x: float, y: float, theta: float) -> bool:
    """Whether a robot that takes itself to be at (x, y, theta) calls the goal of the leg `rule` (RULES,) reached."""
    if rule[MEASURED] != 0.0 or math.hypot(x - rule[GOAL_X], y - rule[GOAL_Y]) > rule[PLANNER_XY]:
        return False
    return bool(abs(turn_between(theta, rule[GOAL_THETA])) <= rule[PLANNER_YAW])


@light
def begin_leg(rule: Row, progress: Row, t: float, x: float, y: float) -> None:
    """A leg begins at time `t` [s], with the robot at (x, y) [m]: `progress` (PROGRESS_STATE,) is written."""
    progress[SINCE] = progress[MOVED] = t
    progress[CLOCK] = t if rule[CLOCK_STARTS_AFTER] == 0.0 else math.nan
    progress[FROM_X], progress[FROM_Y], progress[MOVED_X], progress[MOVED_Y] = x, y, x, y


@light
def judged(
    rule: Row, progress: Row, t: float, x: float, y: float, speed: float, omega: float, called: bool,
    gave_up: bool, livelock: bool,
) -> int:  # fmt: skip
    """The `Verdict` on time `t` [s] of a leg.

    Args:
        rule: (RULES,) of the leg.
        progress: (PROGRESS_STATE,) how far it has come; updated.
        t: Now, s.
        x: Where the robot is, by the truth, m.
        y: The same.
        speed: Of base_link, m/s.
        omega: Its yaw rate, rad/s.
        called: Whether it calls the goal reached.
        gave_up: Whether its navigator can't go on.
        livelock: Whether it ends the trial if there is no progress.
    """
    if (
        math.isnan(progress[CLOCK])
        and math.hypot(x - progress[FROM_X], y - progress[FROM_Y]) >= rule[CLOCK_STARTS_AFTER]
    ):
        progress[CLOCK] = t
    if rule[MEASURED] != 0.0:
        reached = math.hypot(x - rule[GOAL_X], y - rule[GOAL_Y]) <= rule[XY]
    else:
        reached = called and speed <= TRANS_STOPPED_VELOCITY and abs(omega) <= ROT_STOPPED_VELOCITY
    if reached:
        return Verdict.REACHED.value
    if gave_up:
        return Verdict.GAVE_UP.value
    if t - (progress[SINCE] if math.isnan(progress[CLOCK]) else progress[CLOCK]) >= rule[TIME_LIMIT] - _EPS:
        return Verdict.TIMEOUT.value
    if livelock:
        if math.hypot(x - progress[MOVED_X], y - progress[MOVED_Y]) > PROGRESS:
            progress[MOVED], progress[MOVED_X], progress[MOVED_Y] = t, x, y
        elif t - progress[MOVED] >= PATIENCE - _EPS:
            return Verdict.LIVELOCK.value
    return Verdict.GOES_ON.value


_near_goal, _begin_leg, _judged = uncompiled(near_goal), uncompiled(begin_leg), uncompiled(judged)
