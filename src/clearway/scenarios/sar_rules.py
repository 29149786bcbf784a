"""What a drawn search-and-rescue layout must hold: no overlap, room at start and goal, a static way, a closing gap.

A layout is paper B's square with discs that stand and discs that oscillate. Everything here is a pure function of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.oscillator import amplitude, trajectory
from clearway.geometry.shapes import FloatArray
from clearway.scenarios.motions import KNOT, DrivenSpec, states
from clearway.stand_ins import stand_ins

TASK, OBSTACLES, GAP, HARDER, ROBOT = map(stand_ins, ("task", "obstacles", "closing_gap", "harder", "robot"))
SIZE: float = TASK["size"]
AREA = (0.0, 0.0, SIZE, SIZE)
START, GOAL = (np.array(TASK[end][:2], dtype=np.float64) for end in ("start", "goal"))
RADIUS: float = OBSTACLES["radius"]
APART: float = ROBOT["footprint"]["radius"] + RADIUS
"""Where the robot's centre meets an obstacle's: inflated radius of a disc, m."""
SPEED: float = ROBOT["drive"]["v_max"]
TOLERANCE: float = ROBOT["tolerances"]["xy"]
SAMPLE = KNOT
"""Time between two samples of an obstacle's motion, s; on a line between them it is off by less than 1 mm."""


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Obstacles as drawn.

    Attributes:
        static: (n, 2) centres of those that stand, m.
        start: (m, 2) where the moving ones start, m.
        velocity: (m, 2) how fast they start, m/s.
        attraction: (m, 2) what they oscillate about, m.
        stiffness: (m, 2) stiffness of their oscillation along each axis, 1/s^2.
        motions: How they move instead of oscillating, if they do.
    """

    static: FloatArray
    start: FloatArray
    velocity: FloatArray
    attraction: FloatArray
    stiffness: FloatArray
    motions: tuple[DrivenSpec, ...] = ()

    def motion(self, seconds: float) -> FloatArray:
        """(k, m, 4) x, y, v_x, v_y of the moving ones every `SAMPLE` s, for `seconds` and no less."""
        count = math.ceil(seconds / SAMPLE - 1e-9)
        each = zip(self.start, self.velocity, self.attraction, self.stiffness, strict=True)
        tracks = (
            [trajectory(x, v, a, k, SAMPLE, count) for x, v, a, k in each]
            if not self.motions
            else [states(motion, SAMPLE * count) for motion in self.motions]
        )
        return np.stack(tracks, axis=1) if tracks else np.zeros((count + 1, 0, 4))

    def amplitude(self) -> FloatArray:
        """(m, 2) how far each swings from its attraction on each axis, m."""
        each = zip(
            *(a.ravel().tolist() for a in (self.start, self.velocity, self.attraction, self.stiffness)), strict=True
        )
        return np.array([amplitude(x, v, a, k) for x, v, a, k in each]).reshape(-1, 2)


class ClosingGap(NamedTuple):
    """A gap that closes on a robot which follows the static shortest path.

    Attributes:
        speed: Speed of the robot, m/s.
        time: When the robot comes between the two, s.
        first: Index of the one of the two, static ones first.
        second: Index of the other.
        gap: Distance between their edges then, m.
        before: Distance between their edges a while earlier, m.
    """

    speed: float
    time: float
    first: int
    second: int
    gap: float
    before: float


def overlaps(layout: Layout) -> bool:
    """Whether two obstacles overlap at time 0."""
    at = np.concatenate([layout.static, layout.start])
    apart = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1)) + np.where(np.eye(len(at)) > 0, np.inf, 0.0)
    return bool((apart < 2.0 * RADIUS).any())


def crowds_an_end(layout: Layout) -> bool:
    """Whether the edge of an obstacle comes too near to start or goal at time 0."""
    return bool(crowding(np.concatenate([layout.static, layout.start])).any())


def crowding(at: FloatArray) -> npt.NDArray[np.bool_]:
    """(k,) which of the obstacles at `at` (k, 2) do."""
    near = [np.hypot(*(at - end).T) < OBSTACLES["clear"] + RADIUS for end in (START, GOAL)]
    return np.asarray(near[0] | near[1], dtype=np.bool_)


def leavers(layout: Layout) -> npt.NDArray[np.bool_]:
    """(m,) which of the moving ones swing across the border of the square, sooner or later."""
    reach = layout.amplitude() + RADIUS
    outside = (layout.attraction - reach < 0.0) | (layout.attraction + reach > SIZE)
    return np.asarray(outside.any(axis=1), dtype=np.bool_)


def along(path: FloatArray, distance: FloatArray) -> FloatArray:
    """(k, 2) points at `distance` (k,) [m] along the polyline `path` (n, 2)."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    return np.stack([np.interp(distance, reached, path[:, k]) for k in range(2)], axis=1)


def length(path: FloatArray) -> float:
    """Of the polyline `path` (n, 2), m."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def closing_gap(layout: Layout, path: FloatArray, set_speed: float = SPEED) -> ClosingGap | None:
    """The first gap that closes on a robot on `path` (n, 2), at the first speed at which one does; None if none does.

    At one of the speeds (shares of the `set_speed` [m/s]) the robot's centre crosses the line between the centres of two
    obstacles, one of which moves at least, while their edges are at most `closed` apart that were at least `open` apart
    `before` seconds earlier.
    """
    way, n = length(path), len(layout.static)
    speeds = [share * set_speed for share in GAP["speeds"]]
    moving = layout.motion(way / min(speeds))[:, :, :2]
    at = np.concatenate([np.broadcast_to(layout.static, (len(moving), n, 2)), moving], axis=1)
    back = GAP["before"] / SAMPLE
    for speed in speeds:
        p = along(path, speed * SAMPLE * np.arange(int(way / speed / SAMPLE) + 1, dtype=np.float64))
        k, i, j, now, before = _between(p, at, n, back, GAP["closed"] + 2.0 * RADIUS, GAP["open"] + 2.0 * RADIUS)
        if i >= 0:
            return ClosingGap(speed, SAMPLE * k, i, j, now - 2.0 * RADIUS, before - 2.0 * RADIUS)
    return None


@kernel
def _between(
    p: FloatArray, at: FloatArray, still: int, back: float, closed: float, opened: float
) -> tuple[float, int, int, float, float]:
    """When the robot at `p` (k, 2) first crosses the line between two of `at` (k or more, n, 2) that closed in on it.

    Args:
        still: So many of the n stand.
        back: How long before the two were apart, in samples.
        closed: How far apart their centres are at most, m.
        opened: How far apart they were at least, m.

    Returns:
        When, in samples; who (-1: nobody); how far apart they are and were, m.
    """
    for k in range(max(1, math.ceil(back)), p.shape[0]):
        for j in range(still, at.shape[1]):
            for i in range(j):
                if max(abs(at[k, i, 0] - at[k, j, 0]), abs(at[k, i, 1] - at[k, j, 1])) > closed + 1.0:
                    continue
                side, share = _across(p[k - 1], at[k - 1, i], at[k - 1, j])
                beyond, after = _across(p[k], at[k, i], at[k, j])
                if (side > 0.0) == (beyond > 0.0) or not (0.0 <= share <= 1.0 and 0.0 <= after <= 1.0):
                    continue
                when = k - 1 + side / (side - beyond)
                now, before = _apart(at, i, j, when), _apart(at, i, j, when - back)
                if when >= back and now <= closed and before >= opened:
                    return when, i, j, now, before
    return 0.0, -1, -1, 0.0, 0.0


@kernel
def _apart(at: FloatArray, i: int, j: int, when: float) -> float:
    """Distance of two centres at the fractional sample `when`, m."""
    k = min(int(when), at.shape[0] - 2)
    s = when - k
    dx = (1.0 - s) * (at[k, j, 0] - at[k, i, 0]) + s * (at[k + 1, j, 0] - at[k + 1, i, 0])
    dy = (1.0 - s) * (at[k, j, 1] - at[k, i, 1]) + s * (at[k + 1, j, 1] - at[k + 1, i, 1])
    return math.hypot(dx, dy)


@kernel
def _across(p: FloatArray, a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """On which side of the line a-b the point p (2,) lies (its sign), and how far along it (0 at a, 1 at b)."""
    dx, dy, rx, ry = b[0] - a[0], b[1] - a[1], p[0] - a[0], p[1] - a[1]
    return dx * ry - dy * rx, (dx * rx + dy * ry) / (dx * dx + dy * dy)
