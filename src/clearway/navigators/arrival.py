"""When a navigator says that it has arrived: not at the first touch of the tolerance."""

from __future__ import annotations

import math

from clearway.contract import Goal
from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray

SHARE = 0.7
"""Of both tolerances: by so much nearer than needed the estimated pose must be, as the true one may lie farther off."""

PATIENCE = 2.0
"""After so long without coming nearer the tolerances themselves will do, s."""

GAIN = 0.01
"""What counts as nearer, as a share of the tolerances: less is the estimate's noise."""


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
