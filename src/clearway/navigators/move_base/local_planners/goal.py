"""What happens at the goal's place: latch, stop, turn (base_local_planner/src/latched_stop_rotate_controller.cpp)."""

from __future__ import annotations

import math

from clearway.geometry.angles import wrap
from clearway.geometry.shapes import FloatArray
from clearway.navigators.move_base.local_planners.parameters import DWAParameters


def slow_down(speed: float, step: float) -> float:
    """`speed` brought nearer to zero by `step`, not past it."""
    return math.copysign(max(0.0, abs(speed) - step), speed)


def turn_rate(difference: float, now: float, acceleration: float, period: float, low: float, high: float) -> float:
    """The yaw rate for turning in place by `difference` rad.

    As fast as the difference is wide, within what one period of `acceleration` [rad/s^2] gives from the rate `now`,
    slow enough to stop in time, but never outside [low, high], which matters most.
    """
    rate = min(high, max(low, abs(difference)))
    rate = min(max(rate, abs(now) - acceleration * period), abs(now) + acceleration * period)
    rate = min(rate, math.sqrt(2.0 * acceleration * abs(difference)))
    return math.copysign(min(high, max(low, rate)), difference)


class StopAndTurn:
    """DWAPlannerROS's end game. It remembers a latched place across cycles and a begun turn across plans."""

    def __init__(self, parameters: DWAParameters, period: float, latch: bool) -> None:
        self._parameters, self._latch = parameters, latch
        self._period = period
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._latched = False
        self._turning = False

    def unlatch(self) -> None:
        """Forget that the place was reached."""
        self._latched = False

    def _near(self, pose: FloatArray, goal: FloatArray) -> bool:
        p = self._parameters
        if self._latch and self._latched:
            return True
        return math.hypot(goal[0] - pose[0], goal[1] - pose[1]) <= p.xy_goal_tolerance

    def at_place(self, pose: FloatArray, goal: FloatArray) -> bool:
        """Whether the robot is at the goal's place, or was and the parameters say to latch that."""
        if not self._near(pose, goal):
            return False
        self._latched = True
        return True

    def reached(self, pose: FloatArray, velocity: FloatArray, goal: FloatArray) -> bool:
        """Whether the robot stands at the goal, turned to it."""
        p = self._parameters
        if not self._near(pose, goal):
            return False
        self._latched = self._latched or self._latch
        return abs(wrap(goal[2] - pose[2])) <= p.yaw_goal_tolerance and self._standing(velocity)

    def _standing(self, velocity: FloatArray) -> bool:
        p = self._parameters
        straight = (abs(speed) <= p.trans_stopped_vel for speed in velocity[::2])
        return bool(abs(velocity[1]) <= p.theta_stopped_vel and all(straight))

    def command(self, pose: FloatArray, velocity: FloatArray, goal: FloatArray) -> tuple[float, float, float]:
        """(v, omega, v_y) at the goal's place: nothing once turned, else brake, then turn in place."""
        p = self._parameters
        difference = wrap(goal[2] - pose[2])
        if abs(difference) <= p.yaw_goal_tolerance:
            self._turning = False
            return 0.0, 0.0, 0.0
        if not self._turning and not self._standing(velocity):
            return (
                slow_down(float(velocity[0]), p.acc_lim_x * self._period),
                slow_down(float(velocity[1]), p.acc_lim_theta * self._period),
                slow_down(float(velocity[2]), p.acc_lim_y * self._period) if len(velocity) > 2 else 0.0,
            )
        self._turning = True
        w = turn_rate(difference, float(velocity[1]), p.acc_lim_theta, self._period, p.min_vel_theta, p.max_vel_theta)
        return 0.0, w, 0.0
