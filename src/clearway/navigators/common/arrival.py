"""When a navigator says that it has arrived: not at the first touch of the tolerance."""

from __future__ import annotations

import math

import numpy as np

from clearway.contract import Goal
from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray

SHARE = 0.7
"""Of both tolerances: by so much nearer than needed the estimated pose must be, as the true one may lie farther off."""

PATIENCE = 2.0
"""After so long without coming nearer the tolerances themselves will do, s."""

GAIN = 0.01
"""What counts as nearer, as a share of the tolerances: less is the estimate's noise."""

BEGIN = 0.6
"""Share of the goal's distance tolerance: once it is so near, a planner that ends with a turn begins with it."""

CLOSER = 0.01
"""What counts as nearer to one that does its best to come nearer: m, or rad."""


class Arrival:
    """Judges arrival by the estimated pose, for `Command.arrived`.

    A goal checker that accepts the edge of the tolerance ends many a trial with the true pose just outside.
    """

    def __init__(self) -> None:
        self.reset(None)

    def reset(self, goal: Goal | None) -> None:
        """A new goal: forget how near the last one was. None: there is none yet, nothing is reached."""
        self._goal = goal
        self._least, self._since = math.inf, -math.inf

    def reached(self, pose: FloatArray, t: float) -> bool:
        """Whether `pose` (3,) at time `t` [s] lies within `SHARE` of both the goal's tolerances; or within the tolerances
        themselves, where it has come no nearer for `PATIENCE`. An infinite tolerance leaves the heading free.
        """
        goal = self._goal
        if goal is None:
            return False
        away = _share(math.hypot(pose[0] - goal.pose[0], pose[1] - goal.pose[1]), goal.xy_tolerance)
        turned = _share(abs(turn_between(float(pose[2]), float(goal.pose[2]))), goal.yaw_tolerance)
        share = max(away, turned)
        if share < self._least - GAIN:
            self._least, self._since = share, t
        return share <= SHARE or (share <= 1.0 and t - self._since >= PATIENCE)


def _share(error: float, tolerance: float) -> float:
    return error / tolerance if tolerance > 0.0 else math.inf if error > 0.0 else 0.0


class Approach:
    """Judges arrival for a robot that drives to the goal's place and then turns to its heading on the spot.

    Within the tolerance it tries to come nearer until it hasn't by `CLOSER` for `PATIENCE` in all; then that counts.

    Args:
        period: Between two judgements, s.
        begin: Share of the distance tolerance within which the turn begins.
        heading: Share of the heading's tolerance within which the turn ends.

    Attributes:
        turning: Whether only the heading is left, until the robot is pushed off.
    """

    def __init__(self, period: float, begin: float = BEGIN, heading: float = SHARE) -> None:
        self._period, self._begin, self._heading = period, begin, heading
        self.turning = False

    def reset(self, goal: Goal) -> None:
        """A new goal: forget how near the last one was."""
        self._goal, self.turning = goal, False
        self._nearest, self._idle = np.full(2, math.inf), 0.0

    def reached(self, pose: FloatArray) -> bool:
        """Whether it has arrived at the estimated `pose` (3,), which is `SHARE` of both tolerances from the goal, or as
        near as it can come within them; sets `turning`."""
        goal = self._goal
        heading_counts = goal.yaw_tolerance < math.pi
        off = abs(turn_between(pose[2], goal.pose[2])) if heading_counts else 0.0
        now = np.array((math.hypot(pose[0] - goal.pose[0], pose[1] - goal.pose[1]), off))
        if now[0] <= goal.xy_tolerance:
            which = int(self.turning)
            if now[which] < self._nearest[which] - CLOSER:
                self._nearest[which], self._idle = now[which], 0.0
            else:
                self._idle += self._period
        patient = self._idle < PATIENCE
        arrival, begin, heading = (SHARE, self._begin, self._heading) if patient else (1.0, 1.0, 1.0)
        self.turning = heading_counts and now[0] <= goal.xy_tolerance * (arrival if self.turning else begin)
        return bool(now[0] <= arrival * goal.xy_tolerance and off <= heading * goal.yaw_tolerance)
