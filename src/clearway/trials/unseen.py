"""What may have been while something was not seen: how near to each other two things can have come, from where each was
last and next seen and from the largest speed that it can have had.

The bound is sure, not tight: whatever they did at no more than their speeds, they stayed at least so far apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from clearway.geometry.distance import min_clearance
from clearway.geometry.shapes import Circle, FloatArray, Shape, circumscribed_radius
from clearway.trials.trial import Attempt

LONGEST_STEP = (0.2, 3.0)
"""s, and in periods: a longer step than both between two samples of a recording is a gap, as if there were NaN between."""
_OVER = 0.1
"""s; speeds are seen over so long at least, so that noise of single samples is none."""
_USUAL = 0.98
"""Share of a recording's speeds that the largest one holds: a leap of a localisation, or a swapped marker, is no speed."""
OVERSHOOT = 1.1
"""So many times its set speed a robot may be driving: limits of a navigator are not those of its base."""
_SAME = 1e-9
"""s; instants that are closer are one."""
_STEP, _FEWEST, _MOST = 0.01, 20, 2000
"""s; how finely a stretch is looked at, in so many steps at least and at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """What a recording shows of how one thing moved.

    Attributes:
        shape: Its outline in its own frame.
        t: (n,) s, increasing.
        pose: (n, 3) x, y [m], theta [rad], NaN where unseen.
        speed: Its largest speed, m/s.
        yaw_rate: Its largest yaw rate, rad/s.
        longest: Steps between samples that are longer are gaps, s.
        visits: Whether it was not there before it was first seen, and after it was last.
    """

    shape: Shape
    t: FloatArray
    pose: FloatArray
    speed: float
    yaw_rate: float
    longest: float = math.inf
    visits: bool = False

    @property
    def seen(self) -> Any:
        """(n,) bool: where its outline is known; a disc needs no heading."""
        needed = self.pose[:, :2] if isinstance(self.shape, Circle) else self.pose
        return np.isfinite(needed).all(axis=1)

    def unseen(self) -> list[tuple[float, float]]:
        """The stretches in which its outline is not known, each from the last sample of it to the next, s."""
        found: list[tuple[float, float]] = []
        seen = self.seen
        open_step = ~(seen[:-1] & seen[1:]) | (np.diff(self.t) > self.longest)
        for i in np.flatnonzero(open_step):
            start, end = float(self.t[i]), float(self.t[i + 1])
            if found and found[-1][1] == start and not seen[i]:
                found[-1] = found[-1][0], end
            else:
                found.append((start, end))
        there = np.flatnonzero(seen)
        if self.visits and len(there):
            found = [(a, b) for a, b in found if b > self.t[there[0]] and a < self.t[there[-1]]]
        if len(self.t) == 1 and not seen[0]:
            found.append((float(self.t[0]), float(self.t[0])))
        return found

    def absent(self, at: FloatArray) -> Any:
        """(k,) bool: whether it was not there yet, or any more."""
        there = np.flatnonzero(self.seen)
        if not self.visits:
            return np.zeros(len(at), dtype=bool)
        if not len(there):
            return np.ones(len(at), dtype=bool)
        return (at < self.t[there[0]]) | (at > self.t[there[-1]])

    def views(self, at: FloatArray) -> Iterator[tuple[Shape, FloatArray, FloatArray]]:
        """Where it was last and next seen, as seen from each of the instants `at` (k,): a shape, its poses (k, 3), NaN where
        there is none, and how far any point of its outline can have come from there (k,) [m].

        As it was seen, and, since a heading may be lost or old, as the disc that holds the outline at any heading.
        """
        reach = circumscribed_radius(self.shape)
        disc = self.pose * [1.0, 1.0, 0.0]
        disc[:, 2] = 0.0
        if isinstance(self.shape, Circle):
            yield from self._around(self.shape, disc, at, 0.0)
        else:
            yield from self._around(self.shape, self.pose, at, reach)
            yield from self._around(Circle(reach), disc, at, 0.0)

    def _around(
        self, shape: Shape, pose: FloatArray, at: FloatArray, arm: float
    ) -> Iterator[tuple[Shape, FloatArray, FloatArray]]:
        rows = np.flatnonzero(np.isfinite(pose).all(axis=1))
        if not len(rows):
            return
        t, where = self.t[rows], pose[rows]
        last = np.searchsorted(t, at + _SAME, side="right") - 1
        following = np.searchsorted(t, at - _SAME)
        i, j = np.maximum(last, 0), np.minimum(following, len(rows) - 1)
        both = (last >= 0) & (following < len(rows))
        lasts = np.where(both, t[j] - t[i], 0.0)
        step = _step(where[i], where[j])
        needed = (np.hypot(step[:, 0], step[:, 1]) + arm * np.abs(step[:, 2])) / np.maximum(lasts, _SAME)
        # faster than it ever was, where it could not have got there otherwise
        rate = np.maximum(self.speed + self.yaw_rate * arm, np.where(both, needed, 0.0))
        tracked = both & (rows[j] - rows[i] <= 1) & (lasts <= self.longest)
        share = np.clip((at - t[i]) / np.maximum(lasts, _SAME), 0.0, 1.0)
        line = where[i] + share[:, None] * step
        for k, there in ((i, last >= 0), (j, following < len(rows))):
            seen = np.where(there[:, None], where[k], np.nan)
            yield shape, np.where(tracked[:, None], line, seen), np.where(tracked, 0.0, rate * np.abs(at - t[k]))
        if arm == 0.0:
            yield shape, *_lens(where[i], step, rate * (at - t[i]), rate * (t[j] - at), both & ~tracked)


def _lens(
    a: FloatArray, step: FloatArray, from_a: FloatArray, to_b: FloatArray, both: Any
) -> tuple[FloatArray, FloatArray]:
    """The discs that hold what is within `from_a` of the points `a` and within `to_b` of `a + step` (k,): centres (k, 3), NaN
    where the smaller one of the two holds it no worse, and radii (k,) [m]."""
    apart = np.hypot(step[:, 0], step[:, 1])
    safe = np.maximum(apart, _SAME)
    along = (apart**2 + from_a**2 - to_b**2) / (2 * safe)  # from a to the chord in which the circles meet
    good = both & (along >= 0.0) & (along <= apart)
    centre = a + (along / safe)[:, None] * step
    centre[~good] = np.nan
    return centre, np.sqrt(np.maximum(from_a**2 - along**2, 0.0))


def _step(a: FloatArray, b: FloatArray) -> FloatArray:
    step = b - a
    step[:, 2] = np.remainder(step[:, 2] + np.pi, 2 * np.pi) - np.pi
    return step


@dataclass(frozen=True, slots=True, eq=False)
class _Alone:
    """A body as `min_clearance` takes a moving one."""

    shape: Shape
    pose: None = None


def least_clearance(a: Way, b: Way, at: FloatArray) -> FloatArray:
    """(k,) m: at least so far apart were the outlines of `a` and `b` at each of the instants `at` (k,) [s]; 0 where they
    may have touched, inf where one of them was not there."""
    least = np.zeros(len(at))
    for (shape, pose, far), (other, where, gone) in product(a.views(at), list(b.views(at))):
        known = np.isfinite(pose).all(axis=1) & np.isfinite(where).all(axis=1)
        if known.any():
            apart = min_clearance(shape, pose[known], [_Alone(other)], np.ascontiguousarray(where[known][:, None, :]))
            least[known] = np.maximum(least[known], apart - far[known] - gone[known])
    least[a.absent(at) | b.absent(at)] = math.inf
    return least


def nearest(a: Way, b: Way, start: float, end: float) -> tuple[float, float]:
    """How near to each other `a` and `b` can have come from `start` to `end` [s], and when first: m, s."""
    count = min(max(math.ceil((end - start) / _STEP), _FEWEST), _MOST) if end > start else 0
    at = np.linspace(start, end, count + 1)
    least = least_clearance(a, b, at)
    within = 0.5 * (end - start) / max(count, 1) * (_rate(a) + _rate(b))  # between two of the instants
    bound = np.maximum(least - within, 0.0)
    k = int(np.argmin(bound))
    return float(bound[k]), float(at[k])


def _rate(way: Way) -> float:
    return way.speed + way.yaw_rate * (0.0 if isinstance(way.shape, Circle) else circumscribed_radius(way.shape))


def longest_step(attempt: Attempt) -> float:
    """Steps between samples of a recording that are longer are gaps, s."""
    least, periods = LONGEST_STEP
    return max(least, periods * attempt.period) + _SAME


def fastest(t: FloatArray, pose: FloatArray, longest: float) -> tuple[float, float]:
    """The largest speed [m/s] and yaw rate [rad/s] that poses (n, 3) at t (n,) [s] show, but for leaps."""
    if len(t) < 2:
        return 0.0, 0.0
    later = np.minimum(np.searchsorted(t, t + _OVER - _SAME), len(t) - 1)
    lasts = t[later] - t
    good = (lasts > 0) & (lasts <= max(2 * _OVER, longest))
    moved = _step(pose[good], pose[later[good]])
    return _usual(np.hypot(moved[:, 0], moved[:, 1]) / lasts[good]), _usual(np.abs(moved[:, 2]) / lasts[good])


def _usual(rates: FloatArray) -> float:
    known = rates[np.isfinite(rates)]
    return float(np.quantile(known, _USUAL)) if len(known) else 0.0


def robot_speeds(attempt: Attempt, t: FloatArray, pose: FloatArray) -> tuple[float, float]:
    """The robot's largest speed [m/s] and yaw rate [rad/s]: hardly more than its base can at its set speed, unless it was seen
    to."""
    v, omega = fastest(t, pose, longest_step(attempt))
    if attempt.limits is not None:
        v, omega = max(v, OVERSHOOT * attempt.limits.fastest), max(omega, OVERSHOOT * attempt.limits.omega_max)
    return max(v, OVERSHOOT * (attempt.speed_limit or 0.0)), omega


def robot_way(attempt: Attempt, t: FloatArray, pose: FloatArray, shape: Shape) -> Way:
    """How the robot, or another shape in its place, moved."""
    return Way(shape, t, pose, *robot_speeds(attempt, t, pose), longest_step(attempt))


def body_ways(attempt: Attempt, t: FloatArray, moving_obstacles: FloatArray) -> list[Way]:
    """How the bodies moved, in their order: one that moves is no faster than the test says that its obstacles are, unless it
    was seen to be; what stands does not move."""
    longest = longest_step(attempt)
    columns = iter(range(moving_obstacles.shape[1]))
    ways = []
    for body in attempt.bodies:
        if body.pose is not None:
            ends = t[[0, -1]] if len(t) > 1 else t
            ways.append(Way(body.shape, ends, np.tile(body.pose, (len(ends), 1)), 0.0, 0.0))
            continue
        pose = moving_obstacles[:, next(columns)]
        v, omega = fastest(t, pose, longest)
        ways.append(Way(body.shape, t, pose, max(v, attempt.labels.obstacle_speed or 0.0), omega, longest, body.visits))
    return ways
