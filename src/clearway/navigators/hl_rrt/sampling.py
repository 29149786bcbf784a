"""Where HL-RRT* looks next: towards the goal and the horizon first, where samples were good before, anywhere at times.

- goal: the goal itself.
- horizon: an annulus around the root, from half the horizon to the horizon, within a cone about the goal's direction
  (no farther than the goal).
- cache: a waypoint of an old plan (Bruce, Veloso 2002, ERRT: a cache of fixed size in which each new waypoint takes a
  random place).
- mixture: the Gaussians learnt on line from good samples.
- uniform: the part of the area that lies in the horizon's bounding square.

A source that has nothing to offer yet (an empty cache, no mixture) leaves its share to `uniform`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normal, uniform

GOAL, HORIZON, CACHE, MIXTURE, UNIFORM = range(5)

DRAWS = 8
"""Random numbers that one sample may use."""


class Source(NamedTuple):
    """All that a sample depends on. Metres, map frame.

    Attributes:
        root: (2,) where the tree begins, m.
        goal: (2,) where the robot is to go, m.
        horizon: Its distance from the root, H, m.
        cone: Half its angle, rad.
        shares: (4,) upper ends of the shares of goal, horizon, cache and mixture in (0, 1), ascending.
        box: (4,) x_min, y_min, x_max, y_max of the uniform samples.
        waypoints: (w, 2) of old plans, m.
        steps: (c,) upper ends of the components' proportions.
        mean: (c, 2) of the components, m.
        root_of: (c, 3) lower Cholesky factor of each covariance: l11, l21, l22.
    """

    root: FloatArray
    goal: FloatArray
    horizon: float
    cone: float
    shares: FloatArray
    box: FloatArray
    waypoints: FloatArray
    steps: FloatArray
    mean: FloatArray
    root_of: FloatArray


@kernel
def draw(source: Source, key: np.uint64, tick: int, iteration: int) -> tuple[float, float, int]:
    """The sample of an `iteration` of a `tick`: x, y [m] and its kind."""
    first = DRAWS * iteration
    u = uniform(key, tick, first)
    kind = UNIFORM
    for k in range(UNIFORM - 1, -1, -1):
        if u < source.shares[k]:
            kind = k
    a, b = uniform(key, tick, first + 1), uniform(key, tick, first + 2)
    if (kind == CACHE and source.waypoints.shape[0] == 0) or (kind == MIXTURE and source.steps.shape[0] == 0):
        kind = UNIFORM
    if kind == GOAL:
        return source.goal[0], source.goal[1], kind
    if kind == HORIZON:
        dx, dy = source.goal[0] - source.root[0], source.goal[1] - source.root[1]
        far = min(source.horizon, math.hypot(dx, dy))
        r = far * math.sqrt(0.25 + 0.75 * a)  # uniform by area
        angle = math.atan2(dy, dx) + source.cone * (2.0 * b - 1.0)
        return source.root[0] + r * math.cos(angle), source.root[1] + r * math.sin(angle), kind
    if kind == CACHE:
        point = source.waypoints[int(a * source.waypoints.shape[0])]
        return point[0], point[1], kind
    if kind == MIXTURE:
        k = min(int(np.searchsorted(source.steps, a)), source.steps.shape[0] - 1)
        p, q = normal(key, tick, first + 3), normal(key, tick, first + 4)
        l11, l21, l22 = source.root_of[k]
        return source.mean[k, 0] + l11 * p, source.mean[k, 1] + l21 * p + l22 * q, kind
    low_x, low_y, high_x, high_y = source.box
    return low_x + a * (high_x - low_x), low_y + b * (high_y - low_y), kind


def window(root: FloatArray, horizon: float, area: FloatArray) -> FloatArray:
    """x_min, y_min, x_max, y_max (4,) of the horizon's bounding square around `root` (2,) within `area` (4,), m; of the
    square alone where the root has left the area so far that nothing of it is left.
    """
    square = np.concatenate([root - horizon, root + horizon])
    box = np.concatenate([np.maximum(square[:2], area[:2]), np.minimum(square[2:], area[2:])])
    return box if (box[2:] > box[:2]).all() else square


def cholesky(covariance: FloatArray) -> FloatArray:
    """Lower Cholesky factors (c, 3) l11, l21, l22 of covariances (c, 3) xx, xy, yy."""
    l11 = np.sqrt(covariance[:, 0])
    l21 = covariance[:, 1] / l11
    return np.stack([l11, l21, np.sqrt(np.maximum(covariance[:, 2] - l21 * l21, 0.0))], axis=1)


class WaypointCache:
    """Waypoints of old plans: at most `size`; a new one takes a random place once it is full."""

    def __init__(self, size: int, rng: np.random.Generator) -> None:
        self._points, self._rng, self._count = np.empty((size, 2)), rng, 0

    @property
    def points(self) -> FloatArray:
        """(w, 2) m."""
        return self._points[: self._count]

    def clear(self) -> None:
        """Forget them all."""
        self._count = 0

    def add(self, waypoints: FloatArray) -> None:
        """Keep `waypoints` (k, 2)."""
        for point in waypoints:
            if self._count < len(self._points):
                self._points[self._count] = point
                self._count += 1
            elif len(self._points):
                self._points[self._rng.integers(len(self._points))] = point
