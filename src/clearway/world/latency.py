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
from clearway.world.setting import ODOM_V, ODOM_X, TOLD, WAY, V

_SAME = 1e-12  # s


class Past:
    """Where all were of late.

    Args:
        reach: How far back anybody asks, s.
        period: From a decision to the next, s.
        state: (TOLD,) the robot's, as the plant has it, before anything moved.
        measured: (3,) of v, omega and v_y of the base, how many its odometry measures for one where nothing errs: more where wheels slip.
    """

    def __init__(self, reach: float, period: float, state: FloatArray, measured: FloatArray) -> None:
        most = math.ceil(reach / period) + 1 if reach > 0.0 else 0
        self._driven: deque[tuple[float, float, FloatArray, FloatArray]] = deque(maxlen=most)
        self._moving: deque[tuple[float, FloatArray]] = deque(maxlen=most + 1)
        self._first, self._measured = state[:TOLD].copy(), measured

    def drive(self, t: float, period: float, way: FloatArray, state: FloatArray) -> None:
        """In the `period` [s] from time `t` [s] on the robot drove along `way` (n + 1, WAY), as `setting.Setting` has it, until
        its state was `state`."""
        if self._driven.maxlen:
            self._driven.append((t, period, way.copy(), state[ODOM_V:TOLD] - self._measured * state[V:ODOM_X]))

    def see(self, t: float, moving: FloatArray) -> None:
        """At time `t` [s] the moving bodies had these poses (m, 3)."""
        if self._driven.maxlen:
            self._moving.append((t, moving.copy()))

    def state(self, t: float) -> FloatArray:
        """(TOLD,) the robot's state at time `t` [s]; its measured velocities err as they do over that period."""
        for begin, period, way, error in self._driven:
            if t > begin + period:
                continue
            h = period / (len(way) - 1)
            i = min(max(int((t - begin) / h), 0), len(way) - 2)
            a, b, share = way[i], way[i + 1], min(max((t - begin) / h - i, 0.0), 1.0)
            state = np.empty(TOLD)
            state[:WAY] = a + share * (b - a)
            for k in (0, ODOM_X):  # the true pose, the dead-reckoned one
                state[k : k + 3] = between(a[k : k + 3], b[k : k + 3], share)
            state[ODOM_V:TOLD] = self._measured * state[V:ODOM_X] + error
            return state
        return self._first.copy()

    def seen(self, t: float) -> FloatArray:
        """(m, 3) the moving bodies' poses at the last decision not after time `t` [s]."""
        found = self._moving[0][1]
        for at, moving in self._moving:
            if at > t:
                break
            found = moving
        return found


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
        self.rows = 4 + math.ceil((latency.command + latency.jitter) / period)
        self._latency, self._key = latency, stream(seed, "latency")
        self._sensed, self._followed = -math.inf, 0.0
        self._several, self._prompt = True, latency.command + latency.jitter == 0.0
        self._sent: list[tuple[float, float, float, float]] = [(-math.inf, 0.0, 0.0, 0.0)]

    def stamp(self, t: float, count: int) -> float:
        """When that was sensed which the navigator gets at time `t` [s], in control period `count`."""
        self._sensed = max(self._sensed, t - self._late(self._latency.sensing, count, 0))
        return self._sensed

    def send(self, t: float, count: int, v: float, omega: float, v_y: float = 0.0) -> None:
        """In control period `count`, at time `t` [s], the navigator commands `v` [m/s], `omega` [rad/s] and `v_y` [m/s]."""
        if self._prompt and t >= self._followed:
            self._followed = t
        else:
            self._followed = max(self._followed, t + self._late(self._latency.command, count, 1))
        self._sent.append((self._followed, v, omega, v_y))

    def fill(self, commands: FloatArray, t: float, period: float) -> None:
        """Write into `commands` (k, 4), as `setting.Setting` has it, what is followed in the `period` [s] from `t` [s] on; the first row's
        time is 0 always, and stands there."""
        sent = self._sent
        while len(sent) > 1 and sent[1][0] <= t + _SAME:
            del sent[0]
        if self._several:
            commands[1:, 0] = math.inf
        first = sent[0]
        commands[0, 1], commands[0, 2], commands[0, 3] = first[1], first[2], first[3]
        self._several = len(sent) > 1
        if not self._several:
            return
        for row, (since, v, omega, v_y) in zip(commands[1:], sent[1:], strict=False):
            if since < t + period - _SAME:
                row[:] = since - t, v, omega, v_y

    def _late(self, usual: float, count: int, index: int) -> float:
        jitter = self._latency.jitter
        return usual + jitter * uniform(self._key, count, index) if jitter > 0.0 else usual
