"""What stands between a policy that sees scans and a differential base: what it is shown, and what its numbers mean. The same for many
robots that learn and for one that drives.

A policy like this only learns to get by: by itself the base is steered at the goal, what the policy says is added, speed is capped so that
it can stop at the goal, and there it is turned on the spot to the goal's heading, as every local planner of move_base does.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.navigators.learnt.encoding import GOAL, Numbers

Flags = npt.NDArray[np.bool_]

BEAMS = 40
"""In how many parts the sweep is seen."""
LAGS = (0, 3, 9)
"""How old the sweeps are that are seen, control periods."""
SAID = 2
"""Of how many control periods the commands are seen that were said last: by a latency some are not yet in force."""
SIZE = 6 + 2 * SAID + BEAMS * len(LAGS)
"""Numbers that such a policy sees."""
ANSWERS = 2
"""Numbers that it says."""

_NEAR, _FAR = 0.05, 6.0
"""Shorter and longer ranges are seen as these, m: their logarithms are shown."""
_BRAKING = 0.5  # m/s^2, of the cap before the goal
_TURN, _FASTEST = 1.5, 1.2  # 1/s, rad/s: of the turn on the spot
_STEER = 1.5  # 1/s: of the steering at the goal


class Guide:
    """Of n robots.

    Args:
        n: How many.
        turning: The fastest that they turn, rad/s.
    """

    def __init__(self, n: int, turning: float) -> None:
        self._turning = turning
        self._sweeps = np.zeros((max(LAGS) + 1, n, BEAMS), np.float32)
        self._said = np.zeros((SAID, n, ANSWERS), np.float32)

    def begin(self, seen: Numbers, fresh: Flags) -> None:
        """Those that are `fresh` begin, and have seen what is in `seen` for ever."""
        self._sweeps[:, fresh] = _sweep(seen)[fresh]
        self._said[:, fresh] = 0.0

    def keep(self, seen: Numbers) -> None:
        """A control period later all see this."""
        self._sweeps = np.roll(self._sweeps, 1, axis=0)
        self._sweeps[0] = _sweep(seen)

    def shown(self, seen: Numbers, speed: npt.NDArray[np.float64]) -> Numbers:
        """(n, SIZE) what a policy is shown.

        Args:
            seen: (n, 4 + 2 + BEAMS) what is seen now, see `encoding.Seeing`.
            speed: (n,) the set speed of each, m/s.
        """
        x, y = seen[:, 0], seen[:, 1]
        away, bearing = np.hypot(x, y), np.arctan2(y, x)
        own = (np.minimum(away, 5.0), np.cos(bearing), np.sin(bearing), seen[:, GOAL], seen[:, GOAL + 1], speed)
        said = self._said.transpose(1, 0, 2).reshape(len(seen), -1)
        sweeps = [self._sweeps[lag] for lag in LAGS]
        return np.concatenate((np.stack(own, axis=1), said, *sweeps), axis=1).astype(np.float32)

    def commands(
        self, seen: Numbers, speed: npt.NDArray[np.float64], answers: Numbers, tolerance: float
    ) -> npt.NDArray[np.float64]:
        """(n, 2) v [m/s] and omega [rad/s] that come of the policy's `answers` (n, 2).

        Args:
            seen: As for `shown`.
            speed: The same.
            answers: Shares of the set speed and of the fastest turn, which are added to what steers at the goal.
            tolerance: Within which of the goal they turn on the spot, m.
        """
        x, y = seen[:, 0].astype(np.float64), seen[:, 1].astype(np.float64)
        away, bearing = np.hypot(x, y), np.arctan2(y, x)
        said = np.clip(answers, -2.0, 2.0)
        share = np.clip(np.maximum(np.cos(bearing), 0.0) + said[:, 0], 0.0, 1.0)
        v = np.minimum(share * speed, np.sqrt(2.0 * _BRAKING * away))
        omega = np.clip(
            np.clip(_STEER * bearing, -1.0, 1.0) + said[:, 1] * self._turning, -self._turning, self._turning
        )
        turn, turns = np.arctan2(seen[:, 3], seen[:, 2]), (away < tolerance) & (np.hypot(seen[:, 2], seen[:, 3]) > 0.5)
        v = np.where(turns, 0.0, v)
        omega = np.where(turns, np.clip(_TURN * turn, -_FASTEST, _FASTEST), omega)
        self._said = np.roll(self._said, 1, axis=0)
        self._said[0, :, 0], self._said[0, :, 1] = v, omega
        return np.stack((v, omega), axis=1)


def _sweep(seen: Numbers) -> Numbers:
    return np.log(np.clip(seen[:, GOAL + 2 :], _NEAR, _FAR))


def directions(angle_min: float, angle_increment: float, n: int) -> npt.NDArray[np.float64]:
    """(BEAMS,) the middle of each part of a sweep of `n` beams, rad in the sensor's frame."""
    return angle_min + angle_increment * (np.arange(BEAMS) + 0.5) * n / BEAMS
