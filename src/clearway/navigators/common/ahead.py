"""Where the robot will be when what is decided now takes effect: what a robot with a known latency decides for.

What a navigator is told is `sensing` old, and what it commands is followed `command` later. In between the base follows
commands that were given before. So its pose is rolled on by these, as far as its limits say; what pushes it besides
nobody knows, but by how much at most (`blurred`).

Motors that lag are `lag` behind what they are set to: whatever is set from now on, they end where a base without lag ends that begins
where this one would be had it kept its speed for `lag`, and get there that much later. On a line that is exact (the way is the integral of what is set, and
`lag` times what the speed changes by less); in a turn it is nearly so.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.contract import Latency
from clearway.geometry.compiled import kernel, light
from clearway.geometry.motion import arc, ramp
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.steering import steered
from clearway.robots.drive_limits import DriveLimits, possible

_STEP = 0.01  # s, within which a base is taken to keep its mean speed
_SAME = 1e-9  # s
_MOMENT = 1e-6  # s
_KEPT = 0.5  # s, for which it is known what was followed before the time that is told of


class Way(NamedTuple):
    """How the base moves for a while.

    Attributes:
        pose: (3,) at its end.
        velocity: (2,) v [m/s] and omega [rad/s] at its end.
        low: (2,) the least of each on the way.
        high: (2,) the most of each on the way.
    """

    pose: FloatArray
    velocity: FloatArray
    low: FloatArray
    high: FloatArray


class Ahead:
    """Remembers what was commanded.

    Args:
        latency: Of the robot.
        limits: Of its base.

    Attributes:
        time: From what is told to the instant at which a decision of now is followed, by motors that lag as if at once, s.
    """

    def __init__(self, latency: Latency, limits: DriveLimits) -> None:
        self.time = latency.expected
        self._late, self._lag = latency.sensing + latency.command, latency.lag
        self._limits = limits
        self._given = np.array(((-math.inf, 0.0, 0.0, 0.0, 0.0),))  # see `follow_all`

    def decided(self, t: float, velocity: FloatArray, v: float, omega: float) -> None:
        """On what was told of time `t` [s] a command was given; the base will move at `velocity` (2,) when it is followed."""
        if self.time > 0.0:
            self._given = np.vstack((self._given, (t + self._late, velocity[0], velocity[1], v, omega)))

    def pose(self, t: float, pose: FloatArray, velocity: FloatArray) -> FloatArray:
        """(3,) where a robot that is told to be at `pose` with `velocity` (2 or 3,) at time `t` [s] will be when a decision of now is
        followed; the velocity counts where its motors lag."""
        if self.time == 0.0:
            return pose
        while len(self._given) > 1 and self._given[1, 0] <= t - _KEPT:
            self._given = self._given[1:]
        return self.way(self._coasted(pose, velocity), t, t + self._late).pose

    def state(self, t: float, pose: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `pose`, with the velocity: (2,), or (3,) with v_y of an omnidirectional base, which is taken to go on as it does."""
        late = self.time
        if late == 0.0:
            return pose, velocity
        if len(velocity) == 2:
            begin = t if self._late > 0.0 else t - _MOMENT  # what it is set to now
            way = self.way(self._coasted(pose, velocity), begin, t + self._late)
            return way.pose, way.velocity
        heading = float(pose[2]) + 0.5 * late * float(velocity[1])
        c, s, (v, omega, v_y) = math.cos(heading), math.sin(heading), velocity.tolist()
        return pose + late * np.array((c * v - s * v_y, s * v + c * v_y, omega)), velocity

    def _coasted(self, pose: FloatArray, velocity: FloatArray) -> FloatArray:
        if self._lag == 0.0:
            return pose
        return np.array(arc(pose[0], pose[1], pose[2], velocity[0], velocity[1], self._lag))

    def way(self, pose: FloatArray, begin: float, end: float) -> Way:
        """How the base moves from `pose` (3,) at time `begin` until `end` [s], by what was commanded before."""
        return follow_all(self._given, self._limits, pose, begin, end)


@kernel
def follow_all(given: FloatArray, limits: DriveLimits, pose: FloatArray, begin: float, end: float) -> Way:
    """How a base of these `limits` moves from `pose` (3,) at time `begin` until `end` [s] by the commands `given`: (n, 5) from when on
    each was followed [s], v [m/s] and omega [rad/s] of the base then, and those commanded."""
    at, velocity = pose.copy(), np.zeros(2)
    if end <= begin + _SAME:
        return Way(at, velocity, velocity.copy(), velocity.copy())
    low, high = np.full(2, math.inf), np.full(2, -math.inf)
    for k in range(len(given)):
        since, until = given[k, 0], given[k + 1, 0] if k + 1 < len(given) else math.inf
        if until <= begin + _SAME or since >= end - _SAME:
            continue
        a, b = max(since, begin), min(until, end)
        velocity[:] = given[k, 1:3]
        follow(at, velocity, low, high, given[k, 3:], limits, a - since if since > -math.inf else 0.0, b - a)
    return Way(at, velocity, low, high)


@light
def follow(
    pose: FloatArray, velocity: FloatArray, low: FloatArray, high: FloatArray, command: FloatArray, limits: DriveLimits,
    since: float, duration: float,
) -> None:  # fmt: skip
    """Move `pose` (3,) and `velocity` (2,) on for `duration` [s] of a command that has been followed for `since` [s].

    Args:
        pose: Updated.
        velocity: (2,) when the command was first followed; updated to that at the end.
        low: (2,) lowered to the least velocities on the way.
        high: (2,) raised to the greatest.
        command: (2,) v [m/s] and omega [rad/s].
        limits: Of the base.
        since: See above.
        duration: See above.
    """
    v_goal, w_goal, _ = possible(limits, command[0], command[1], 0.0)
    v, omega, car = velocity[0], velocity[1], limits.wheelbase > 0.0
    if since > 0.0 and car:
        v, _, omega, _ = steered(limits, v, omega, v_goal, w_goal, since)
    elif since > 0.0:
        v, _ = ramp(v, v_goal, limits.acceleration, limits.deceleration, since)
        omega, _ = ramp(omega, w_goal, limits.angular_acceleration, limits.angular_deceleration, since)
    n = max(1, math.ceil(duration / _STEP - 1e-9))
    h = duration / n
    for _ in range(n):
        low[0], low[1] = min(low[0], v), min(low[1], omega)
        high[0], high[1] = max(high[0], v), max(high[1], omega)
        if car:
            v, driven, omega, turned = steered(limits, v, omega, v_goal, w_goal, h)
        else:
            v, driven = ramp(v, v_goal, limits.acceleration, limits.deceleration, h)
            omega, turned = ramp(omega, w_goal, limits.angular_acceleration, limits.angular_deceleration, h)
        pose[0], pose[1], pose[2] = arc(pose[0], pose[1], pose[2], driven, turned, h)
    low[0], low[1] = min(low[0], v), min(low[1], omega)
    high[0], high[1] = max(high[0], v), max(high[1], omega)
    velocity[0], velocity[1] = v, omega


def blurred(start: FloatArray, disturbance: FloatArray, time: float, period: float, speed: float) -> FloatArray:
    """(3,) bounds on |x|, |y| [m] and |theta| [rad] of a pose's error after it has been rolled on for `time` [s].

    Args:
        start: (3,) the same of the perceived pose.
        disturbance: (5,) bounds for each control period: displacement [m] and turn [rad], which grow evenly over it, deviation of v
            [m/s] and omega [rad/s]; the last does not count, as if it also moved a robot that stands.
        time: For how long, s.
        period: Control period, s.
        speed: The most that the robot drives at, m/s.
    """
    if time <= 0.0:
        return start
    periods = time / period  # what happens in a period grows evenly over it
    position, heading, slip, spin = disturbance[:4].tolist()
    turned = start[2] + periods * heading + time * spin
    moved = periods * position + time * slip + time * (speed + slip) * turned
    return np.array((start[0] + moved, start[1] + moved, turned))
