"""What a drawn search-and-rescue layout must hold: no overlap, room at start and goal, a static way, a closing gap.

A layout is paper B's square with discs that stand and discs that oscillate. Everything here is a pure function of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.oscillator import amplitude, trajectory
from clearway.geometry.shapes import FloatArray
from clearway.stand_ins import stand_ins

TASK, OBSTACLES, GAP, ROBOT = (stand_ins(name) for name in ("task", "obstacles", "closing_gap", "robot"))
SIZE: float = TASK["size"]
AREA = (0.0, 0.0, SIZE, SIZE)
START, GOAL = (np.array(TASK[end][:2], dtype=np.float64) for end in ("start", "goal"))
RADIUS: float = OBSTACLES["radius"]
APART: float = ROBOT["footprint"]["radius"] + RADIUS
"""Where the robot's centre meets an obstacle's: inflated radius of a disc, m."""
SAMPLE = 0.05
"""Time between two samples of an obstacle's motion, s; on a line between them it is off by less than 1 mm."""


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Obstacles as drawn.

    Attributes:
        static: (n, 2) m. start, velocity, attraction, stiffness: (m, 2) m, m/s, m, 1/s^2 of the moving ones, as in
        `OscillationSpec`.
    """

    static: FloatArray
    start: FloatArray
    velocity: FloatArray
    attraction: FloatArray
    stiffness: FloatArray

    def motion(self, seconds: float) -> FloatArray:
        """(k, m, 4) x, y, v_x, v_y of the moving ones every `SAMPLE` s, for `seconds` and no less."""
        count = math.ceil(seconds / SAMPLE - 1e-9)
        each = zip(self.start, self.velocity, self.attraction, self.stiffness, strict=True)
        tracks = [trajectory(x, v, a, k, SAMPLE, count) for x, v, a, k in each]
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
        speed: of the robot, m/s. time: when it comes between the two, s. first, second: which two, static ones first.
        gap: between their edges then, m. before: the same a while earlier, m.
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
    at = np.concatenate([layout.static, layout.start])
    return any(bool((np.hypot(*(at - end).T) < OBSTACLES["clear"] + RADIUS).any()) for end in (START, GOAL))


def leavers(layout: Layout) -> npt.NDArray[np.bool_]:
    """(m,) which of the moving ones swing across the border of the square, sooner or later."""
    reach = layout.amplitude() + RADIUS
    outside = (layout.attraction - reach < 0.0) | (layout.attraction + reach > SIZE)
    found: npt.NDArray[np.bool_] = outside.any(axis=1)
    return found


def along(path: FloatArray, distance: FloatArray) -> FloatArray:
    """(k, 2) points at `distance` (k,) [m] along the polyline `path` (n, 2)."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    return np.stack([np.interp(distance, reached, path[:, k]) for k in range(2)], axis=1)


def length(path: FloatArray) -> float:
    """Of the polyline `path` (n, 2), m."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def closing_gap(layout: Layout, path: FloatArray) -> ClosingGap | None:
    """The first gap that closes on a robot on `path` (n, 2), by speeds in their order; None if none does.

    At one of the speeds the robot's centre crosses the line between the centres of two obstacles, one of which moves at
    least, while their edges are at most `closed` apart that were at least `open` apart `before` seconds earlier.
    """
    way = length(path)
    n, m = len(layout.static), len(layout.start)
    first, second = (np.array(i, dtype=np.int64) for i in _pairs(n, m))
    seconds = way / min(GAP["speeds"])
    moving = layout.motion(seconds)[:, :, :2]
    at = np.concatenate([np.broadcast_to(layout.static, (len(moving), n, 2)), moving], axis=1)
    a, b = at[:, first], at[:, second]
    gap = np.hypot(*(b - a).transpose(2, 0, 1)) - 2.0 * RADIUS
    times = SAMPLE * np.arange(len(at))
    for speed in GAP["speeds"]:
        count = int(way / speed / SAMPLE) + 1
        p = along(path, speed * times[:count])[:, None]
        side, share = _across(p, a[:count], b[:count])
        between = (share >= 0.0) & (share <= 1.0)
        crosses = (side[1:] > 0.0) != (side[:-1] > 0.0)
        for k, j in np.argwhere(crosses & between[1:] & between[:-1]).tolist():
            t = times[k] + SAMPLE * side[k, j] / (side[k, j] - side[k + 1, j])
            if t < GAP["before"]:
                continue
            now, before = (float(np.interp(s, times, gap[:, j])) for s in (t, t - GAP["before"]))
            if now <= GAP["closed"] and before >= GAP["open"]:
                return ClosingGap(speed, float(t), int(first[j]), int(second[j]), now, before)
    return None


def conflict(layout: Layout, path: FloatArray, speed: float) -> bool:
    """Whether a robot that follows `path` (n, 2) at `speed` [m/s], come what may, hits something that moves."""
    way = length(path)
    moving = layout.motion(way / speed)[:, :, :2]
    p = along(path, speed * SAMPLE * np.arange(len(moving)))
    return bool((np.hypot(*(moving - p[:, None]).transpose(2, 0, 1)) < APART).any())


def _pairs(n: int, m: int) -> tuple[list[int], list[int]]:
    """Both members of each pair of the n + m obstacles of which at least one moves (the last m do)."""
    pairs = [(i, j) for j in range(n, n + m) for i in range(j)]
    return [i for i, _ in pairs], [j for _, j in pairs]


def _across(p: FloatArray, a: FloatArray, b: FloatArray) -> tuple[Any, Any]:
    """On which side of the line a-b each point p lies (its sign), and how far along it (0 at a, 1 at b)."""
    d, r = b - a, p - a
    return d[..., 0] * r[..., 1] - d[..., 1] * r[..., 0], (d * r).sum(-1) / (d * d).sum(-1)
