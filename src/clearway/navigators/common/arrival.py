"""How a robot comes to rest at its goal, and when it says that it has arrived: not at the first touch of the tolerance."""

from __future__ import annotations

import math

import numpy as np

from clearway.contract import Goal, Status
from clearway.geometry.angles import turn_between
from clearway.geometry.shapes import FloatArray
from clearway.robots import DriveLimits

BEGIN = 0.5
"""Share of the goal's distance tolerance: a robot that would come to rest so near brakes."""

SHARE = 0.7
"""Share of the distance tolerance within which it stays at rest, and calls the goal reached: the true place may lie farther off."""

HEADING = 0.5
"""Share of the heading's tolerance within which its turn on the spot ends."""

PATIENCE = 2.0
"""After so long within the distance tolerance without coming nearer, the tolerances themselves will do, s."""

CLOSER = 0.01
"""What counts as nearer: m, or rad."""


class Approach:
    """Brings a robot to rest at a goal and says when it has arrived.

    A goal checker that accepts the edge of the tolerance ends many a trial with the true pose just outside. So the robot
    drives on until it would come to rest well within; then it brakes, turns on the spot to the goal's heading and calls the
    goal reached. It takes the call back if it finds itself outside the tolerances. Where it comes no nearer (something
    may stand there), the tolerances themselves will do.

    Args:
        limits: Of the base: how soon it stops.
        period: Between two judgements, s.
        begin: Share of the distance tolerance within which it wants to come to rest.
        heading: Share of the heading's tolerance within which the turn ends.
        turns: Whether the base turns on the spot; if not, it brakes only where its heading will do as well.

    Attributes:
        goal: Where it drives to; None: there is no goal yet.
        stopping: Whether it is to brake, or stand, but for `turn`.
        turn: What is left to turn on the spot, rad; 0 once the goal is called reached, or where the heading is free.
    """

    def __init__(
        self, limits: DriveLimits, period: float, begin: float = BEGIN, heading: float = HEADING, turns: bool = True
    ) -> None:
        self._limits, self._period, self._begin, self._heading, self._turns = limits, period, begin, heading, turns
        self.reset(None)

    def set_out(self, goal: Goal) -> bool:
        """Drive to `goal` from now on. Whether it is another one than so far: then how near that was is forgotten."""
        if goal is self.goal:
            return False
        self.reset(goal)
        return True

    def reset(self, goal: Goal | None) -> None:
        """A new goal: forget how near the last one was. None: there is none yet, nothing is reached."""
        self.goal: Goal | None = goal
        self._called = False
        self.stopping, self.turn, self._stays = False, 0.0, SHARE
        self._nearest, self._idle = np.full(2, math.inf), 0.0

    @property
    def status(self) -> str:
        """What it does: turns on the spot, or comes to rest; empty while the goal is still to be driven to."""
        if not self.stopping:
            return ""
        return Status.ARRIVING if self.turn == 0.0 else Status.TURNING

    def reached(self, pose: FloatArray, velocity: FloatArray) -> bool:
        """Whether the goal is called reached at the estimated `pose` (3,) and `velocity` (2,), v [m/s] and omega [rad/s], or (3,)
        with v_y; sets `stopping` and `turn`."""
        goal = self.goal
        if goal is None:
            return False
        turned = turn_between(float(pose[2]), float(goal.pose[2])) if goal.yaw_tolerance < math.pi else 0.0
        away = math.hypot(pose[0] - goal.pose[0], pose[1] - goal.pose[1])
        patient = self._patient(away, abs(turned))
        begin, heading = (self._begin, self._heading) if patient else (1.0, 1.0)
        if not self.stopping:
            self._stays = SHARE if patient else 1.0
        resting = self._resting(pose, *velocity[::2].tolist())
        self.stopping = resting <= goal.xy_tolerance * (self._stays if self.stopping else begin)
        if not self._turns and abs(turned) > goal.yaw_tolerance * (1.0 if self.stopping and self._called else heading):
            self.stopping = False
        if self._called:
            self._called = away <= goal.xy_tolerance and abs(turned) <= goal.yaw_tolerance
        else:
            near = away <= self._stays * goal.xy_tolerance and abs(turned) <= heading * goal.yaw_tolerance
            self._called = self.stopping and near
        self.stopping = self.stopping or self._called
        self.turn = 0.0 if self._called else turned
        return self._called

    def _patient(self, away: float, turned: float) -> bool:
        """Whether it is worth while to come nearer."""
        assert self.goal is not None
        if away <= self.goal.xy_tolerance:
            which, now = (1, turned) if self.stopping else (0, away)
            if now < self._nearest[which] - CLOSER:
                self._nearest[which], self._idle = now, 0.0
            else:
                self._idle += self._period
        return self._idle < PATIENCE

    def _resting(self, pose: FloatArray, v: float, v_y: float = 0.0) -> float:
        """How far from the goal the robot comes to rest if it brakes now, m."""
        assert self.goal is not None
        way, (x, y, _) = 0.5 * v * abs(v) / self._limits.deceleration, self.goal.pose
        if v_y != 0.0:
            aside = 0.5 * v_y * abs(v_y) / self._limits.lateral_deceleration
            x, y = x + aside * math.sin(pose[2]), y - aside * math.cos(pose[2])
        return math.hypot(pose[0] + way * math.cos(pose[2]) - x, pose[1] + way * math.sin(pose[2]) - y)
