"""What stands between a policy that sees scans and a differential base: what it is shown, and what its numbers mean. The same for many
robots that learn and for one that drives.

A policy like this only learns to do better than a rule: by itself the base is steered into the direction that is nearest to the goal's and
free, as far as the last sweeps show; what the policy says is added, speed is capped so that it can stop at the goal, and there it is turned on
the spot to the goal's heading, as every local planner of move_base does.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import circumscribed_radius
from clearway.navigators.learnt.encoding import GOAL, Numbers
from clearway.robots import Robot

Flags = npt.NDArray[np.bool_]

BEAMS = 40
"""In how many parts the sweep is seen."""
LAGS = (0, 3, 9)
"""How old the sweeps are that are seen, control periods."""
SAID = 2
"""Of how many control periods the commands are seen that were said last: by a latency some are not yet in force."""
HEADINGS = np.deg2rad(np.arange(-100.0, 101.0, 5.0))
"""Directions of which one is chosen, rad in base_link."""
_COS, _SIN = np.cos(HEADINGS), np.sin(HEADINGS)
SIZE = 8 + 2 * SAID + len(HEADINGS) + BEAMS * len(LAGS)
"""Numbers that such a policy sees."""
ANSWERS = 2
"""Numbers that it says."""

_NEAR, _FAR = 0.05, 6.0
"""Shorter and longer ranges are seen as these, m: their logarithms are shown."""
_REMEMBERED, _EVERY = 30, 3
"""For so many control periods it is known where something was that has left the field of view, and by every how manieth sweep."""
_MARGIN, _LOOK = 0.1, 2.0
"""Beyond its radius the robot keeps this from what it passes by, and a direction is as good as it can be that is free so far, m."""
_SLIDE = 0.005
"""What is nearer than that is passed by if it doesn't come nearer by more than this, m."""
_BLOCKED, _SWERVE = 4.0, 0.3
"""A direction in which something stands at once is as bad as one so far from the goal's, rad; another one than before costs this share of the turn."""
_LAST = 0.4
"""So near to the goal the rule drives alone, and from twice as far on it gives way: a policy that may stop anywhere within a tolerance circles about what is nearer, m."""
_BRAKING = 0.5  # m/s^2, of the caps before the goal and before what is ahead
_TURN, _FASTEST = 1.5, 1.2  # 1/s, rad/s: of the turn on the spot
_STEER = 1.5  # 1/s: of the steering into a direction


class Guide:
    """Of n robots of one kind.

    Args:
        n: How many.
        robot: The kind; it has a lidar.
    """

    def __init__(self, n: int, robot: Robot) -> None:
        lidar = robot.lidar
        assert lidar is not None
        step = (lidar.angle_max - lidar.angle_min) / (lidar.beams - 1)
        angles = lidar.angle_min + step * (np.arange(BEAMS) + 0.5) * lidar.beams / BEAMS + lidar.mount[2]
        self._mount, self._rays = complex(*lidar.mount[:2]), np.exp(1j * angles)
        self._field = (lidar.angle_min + lidar.mount[2], lidar.angle_max + lidar.mount[2])
        self._period, self._turning = robot.period, robot.limits().omega_max
        self._reach = circumscribed_radius(robot.shape) + _MARGIN
        self._sweeps = np.zeros((max(LAGS) + 1, n, BEAMS), np.float32)
        self._points = np.zeros((_REMEMBERED, n, BEAMS), np.complex128)
        self._said = np.zeros((SAID, n, ANSWERS), np.float32)
        self._free, self._chosen = np.zeros((n, len(HEADINGS))), np.zeros(n)

    def begin(self, seen: Numbers, fresh: Flags) -> None:
        """Those that are `fresh` begin, and have seen what is in `seen` for ever."""
        self._sweeps[:, fresh] = _sweep(seen)[fresh]
        self._points[:, fresh] = self.points(seen)[fresh]
        self._said[:, fresh] = 0.0
        self._look(seen, np.flatnonzero(fresh), _bearing(seen))

    def keep(self, seen: Numbers) -> None:
        """A control period later all see this."""
        self._sweeps = np.roll(self._sweeps, 1, axis=0)
        self._sweeps[0] = _sweep(seen)
        v, omega = (seen[:, GOAL + k].astype(np.float64) * self._period for k in (0, 1))
        turn = np.exp(-1j * omega)
        self._points[1:] = (self._points[:-1] - v[:, None]) * turn[:, None]
        self._points[0] = self.points(seen)
        self._look(seen, np.arange(len(seen)), self._chosen - omega)

    def points(self, seen: Numbers) -> npt.NDArray[np.complex128]:
        """(n, BEAMS) x + iy of what the lidar sees, in base_link, m."""
        found: npt.NDArray[np.complex128] = self._mount + seen[:, GOAL + 2 :] * self._rays
        return found

    def shown(self, seen: Numbers, speed: npt.NDArray[np.float64]) -> Numbers:
        """(n, SIZE) what a policy is shown.

        Args:
            seen: (n, 4 + 2 + BEAMS) what is seen now, see `encoding.Seeing`.
            speed: (n,) the set speed of each, m/s.
        """
        away, bearing = np.hypot(seen[:, 0], seen[:, 1]), _bearing(seen)
        own = (
            np.minimum(away, 5.0), np.cos(bearing), np.sin(bearing), seen[:, GOAL], seen[:, GOAL + 1], speed,
            np.cos(self._chosen), np.sin(self._chosen),
        )  # fmt: skip
        said = self._said.transpose(1, 0, 2).reshape(len(seen), -1)
        sweeps = [self._sweeps[lag] for lag in LAGS]
        return np.concatenate((np.stack(own, axis=1), said, self._free, *sweeps), axis=1).astype(np.float32)

    def commands(
        self, seen: Numbers, speed: npt.NDArray[np.float64], answers: Numbers, tolerance: float
    ) -> npt.NDArray[np.float64]:
        """(n, 2) v [m/s] and omega [rad/s] that come of the policy's `answers` (n, 2).

        Args:
            seen: As for `shown`.
            speed: The same.
            answers: Shares of the set speed and of the fastest turn, which are added to what the rule says.
            tolerance: Within which of the goal they turn on the spot, m.
        """
        away = np.hypot(seen[:, 0], seen[:, 1]).astype(np.float64)
        said = np.clip(answers, -2.0, 2.0) * np.clip(away / _LAST - 1.0, 0.0, 1.0)[:, None]
        ahead = self._free[:, len(HEADINGS) // 2]
        share = np.minimum(np.maximum(np.cos(self._chosen), 0.0), np.sqrt(2.0 * _BRAKING * ahead) / speed)
        v = np.minimum(np.clip(share + said[:, 0], 0.0, 1.0) * speed, np.sqrt(2.0 * _BRAKING * away))
        omega = np.clip(
            np.clip(_STEER * self._chosen, -1.0, 1.0) + said[:, 1] * self._turning, -self._turning, self._turning
        )
        turn, turns = np.arctan2(seen[:, 3], seen[:, 2]), (away < tolerance) & (np.hypot(seen[:, 2], seen[:, 3]) > 0.5)
        v = np.where(turns, 0.0, v)
        omega = np.where(turns, np.clip(_TURN * turn, -_FASTEST, _FASTEST), omega)
        self._said = np.roll(self._said, 1, axis=0)
        self._said[0, :, 0], self._said[0, :, 1] = v, omega
        return np.stack((v, omega), axis=1)

    def _look(self, seen: Numbers, rows: npt.NDArray[np.int64], before: npt.NDArray[np.float64]) -> None:
        """How far each direction is free of these `rows`, and which is chosen where `before` (n,) was until now."""
        _free(self._points, rows, self._mount, self._field, self._reach, self._free)
        free, bearing = self._free[rows], _bearing(seen)[rows]
        look = np.clip(np.hypot(seen[rows, 0], seen[rows, 1]), 0.1, _LOOK)[:, None]
        cost = np.abs(HEADINGS - bearing[:, None]) + _BLOCKED * (1.0 - np.minimum(free / look, 1.0))
        cost += _SWERVE * np.abs(HEADINGS - before[rows, None])
        best = cost.argmin(1)
        straight = (np.abs(HEADINGS[best] - bearing) < HEADINGS[1] - HEADINGS[0]) & (
            free[np.arange(len(rows)), best] >= look[:, 0]
        )
        self._chosen[rows] = np.where(straight, bearing, HEADINGS[best])


def _bearing(seen: Numbers) -> npt.NDArray[np.float64]:
    bearing: npt.NDArray[np.float64] = np.arctan2(seen[:, 1], seen[:, 0]).astype(np.float64)
    return bearing


def _sweep(seen: Numbers) -> Numbers:
    return np.log(np.clip(seen[:, GOAL + 2 :], _NEAR, _FAR))


@kernel
def _free(
    points: npt.NDArray[np.complex128],
    rows: npt.NDArray[np.int64],
    mount: complex,
    field: tuple[float, float],
    reach: float,
    free: npt.NDArray[np.float64],
) -> None:
    """How far a disc of radius `reach` comes in each direction of HEADINGS, at most _FAR / 2 [m]: past what is seen, and what was seen where
    nothing is seen now. Written into `free` (n, headings) for these `rows`."""
    far = (_FAR / 2.0 + reach) ** 2
    for row in rows:
        free[row] = _FAR / 2.0
        for age in range(0, len(points), _EVERY):
            for point in points[age, row]:
                x, y = point.real, point.imag
                if x * x + y * y > far:
                    continue
                if age > 0 and field[0] < math.atan2(y - mount.imag, x - mount.real) < field[1]:
                    continue
                keeps = min(reach, max(math.sqrt(x * x + y * y) - _SLIDE, reach - _MARGIN))
                for k in range(len(HEADINGS)):
                    along, across = _COS[k] * x + _SIN[k] * y, _COS[k] * y - _SIN[k] * x
                    if along > 0.0 and abs(across) < keeps:
                        free[row, k] = min(free[row, k], max(along - math.sqrt(keeps * keeps - across * across), 0.0))
