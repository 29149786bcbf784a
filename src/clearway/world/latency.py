"""Time that passes between sensing, deciding and driving: what was when, and which command the wheels follow.

Messages keep their order: none arrives before one that was sent earlier.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from clearway.contract import Latency
from clearway.geometry.angles import wrap
from clearway.geometry.motion import sinc
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform

_SAME = 1e-12  # s


class Past:
    """Where all were at the instants of the last decisions.

    Args:
        reach: How far back anybody asks, s.
        period: From a decision to the next, s.
    """

    def __init__(self, reach: float, period: float) -> None:
        self._kept: deque[tuple[float, FloatArray, FloatArray]] = deque(maxlen=math.ceil(reach / period) + 2)

    def add(self, t: float, state: FloatArray, moving: FloatArray) -> None:
        """At time `t` [s], later than all before: the robot's `state` as `World.state` has it, and poses (m, 3)."""
        self._kept.append((t, state, moving.copy()))

    def at(self, t: float) -> tuple[FloatArray, FloatArray]:
        """The robot's state (10,) and the moving bodies' poses (m, 3) at time `t` [s]: between two instants each moves
        on evenly, the robot and its odometry on arcs; NaN where a body was absent at either."""
        begin = end = self._kept[0]
        for end in self._kept:
            if end[0] >= t:
                break
            begin = end
        span = end[0] - begin[0]
        share = (t - begin[0]) / span if span > 0.0 else 0.0
        state = begin[1] + share * (end[1] - begin[1])
        for k in (0, 5):  # the true pose, the dead-reckoned one
            state[k : k + 3] = between(begin[1][k : k + 3], end[1][k : k + 3], share)
        moving = begin[2] + share * (end[2] - begin[2])
        moving[:, 2] = [wrap(a + share * wrap(b - a)) for a, b in zip(begin[2][:, 2], end[2][:, 2], strict=True)]
        return state, moving


def between(a: FloatArray, b: FloatArray, share: float) -> FloatArray:
    """The pose (3,) on the arc from pose `a` to pose `b`, after this `share` of it."""
    turn = float(wrap(b[2] - a[2]))
    chord, course = math.hypot(b[0] - a[0], b[1] - a[1]), math.atan2(b[1] - a[1], b[0] - a[0])
    length = chord / sinc(0.5 * turn)
    part = length * share * sinc(0.5 * turn * share)
    direction = course - 0.5 * turn * (1.0 - share)
    return np.array([a[0] + part * math.cos(direction), a[1] + part * math.sin(direction), wrap(a[2] + share * turn)])


class Delays:
    """When what arrives was sensed, and when what is sent is followed.

    Args:
        latency: Of the robot.
        period: From a decision to the next, s.
        seed: Of the trial.

    Attributes:
        rows: How many commands a period may see at most.
    """

    def __init__(self, latency: Latency, period: float, seed: int) -> None:
        self.rows = 2 + math.ceil((latency.command + latency.jitter) / period)
        self._latency, self._key = latency, stream(seed, "latency")
        self._sensed = self._followed = 0.0
        self._sent: list[tuple[float, float, float]] = [(-math.inf, 0.0, 0.0)]

    def stamp(self, t: float, count: int) -> float:
        """When that was sensed which the navigator gets at time `t` [s], in control period `count`."""
        self._sensed = max(self._sensed, t - self._late(self._latency.sensing, count, 0))
        return self._sensed

    def send(self, t: float, count: int, v: float, omega: float) -> None:
        """In control period `count`, at time `t` [s], the navigator commands `v` [m/s] and `omega` [rad/s]."""
        self._followed = max(self._followed, t + self._late(self._latency.command, count, 1))
        self._sent.append((self._followed, v, omega))

    def fill(self, commands: FloatArray, t: float, period: float) -> None:
        """Write into `commands` (k, 3), as `plant.Setting` has it, what is followed in the `period` [s] from `t` [s] on."""
        while len(self._sent) > 1 and self._sent[1][0] <= t + _SAME:
            del self._sent[0]
        commands[:, 0] = math.inf
        commands[0] = 0.0, *self._sent[0][1:]
        for row, (since, v, omega) in zip(commands[1:], self._sent[1:], strict=False):
            if since < t + period - _SAME:
                row[:] = since - t, v, omega

    def _late(self, usual: float, count: int, index: int) -> float:
        jitter = self._latency.jitter
        return usual + jitter * uniform(self._key, count, index) if jitter > 0.0 else usual
