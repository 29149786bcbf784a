"""The robot's camera: the obstacles of the test that reach into a circle around the robot, as discs.

Paper B, assumptions A1 and A3: what lies within the perception field is seen, nothing hides anything else, what stands
still is seen where it is, and what moves with a bounded error. Walls and furniture are a lidar's work.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.contract import PLACED, Obstacles
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.robots import Camera
from clearway.trials import Body


class ObstacleSensor:
    """Looks at the obstacles among `bodies`.

    Args:
        camera: Its range and error.
        still_reach: How far the outline of each body without a pose column reaches from its origin, in their order, m: a
            shape is seen as the disc that holds it.
        moving_reach: The same of each body with a pose column.
        seed: Seed of the trial; an obstacle's error in a control period depends on nothing else.

    Attributes:
        range: How far off the edge of what it sees may be, m.
        identity: (n,) int64, which of `bodies` each of those is that it may see.
        moving: (n,) whether it moves.
        radius: (n,) m.
        bound: (n,) of the error of its place, m.
        at: (n, 2) where each stands, or was seen last, m.
    """

    def __init__(
        self, camera: Camera, bodies: Sequence[Body], still_reach: FloatArray, moving_reach: FloatArray, seed: int
    ) -> None:
        self.range = camera.range
        self._key = stream(seed, "camera")
        reach = {True: iter(moving_reach.tolist()), False: iter(still_reach.tolist())}
        seen = [(i, b, next(reach[b.pose is None])) for i, b in enumerate(bodies)]
        seen = [(i, b, r) for i, b, r in seen if b.kind in PLACED]
        self.identity = np.array([i for i, _, _ in seen], dtype=np.int64)
        self.moving = np.array([b.pose is None for _, b, _ in seen], dtype=np.bool_)
        self.radius = np.array([r for _, _, r in seen], dtype=np.float64)
        self.bound = np.where(self.moving, camera.error, 0.0)
        self.at = np.full((len(seen), 2), np.nan)
        for at, (_, b, _) in zip(self.at, seen, strict=True):
            if b.pose is not None:
                at[:] = b.pose[:2]

    def look(self, x: float, y: float, moving_obstacles: FloatArray, count: int) -> Obstacles:
        """What is seen from (x, y) [m] in control period `count`; moving_obstacles: (m, 3) poses, NaN where one is absent."""
        self.at[self.moving] = moving_obstacles[:, :2]
        seen, position = measure(self.at, self.radius, self.bound, self.identity, x, y, self.range, self._key, count)
        n = len(seen)
        return Obstacles(
            position=position,
            velocity=np.full((n, 2), np.nan),
            radius=self.radius[seen],
            error=self.bound[seen],
            velocity_error=np.full(n, np.inf),
            identity=self.identity[seen],
            moving=self.moving[seen],
        )


@kernel
def measure(
    at: FloatArray, radius: FloatArray, bound: FloatArray, identity: np.ndarray, x: float, y: float, limit: float,
    key: np.uint64, count: int,
) -> tuple[np.ndarray, FloatArray]:  # fmt: skip
    """Which of the discs at `at` (n, 2) reach within `limit` [m] of (x, y), as (k,) indices, and (k, 2) where they seem
    to be: with an error uniform in a disc of radius `bound` (n,) [m]."""
    seen, position = np.empty(at.shape[0], dtype=np.int64), np.empty(at.shape)
    k = 0
    for i in range(at.shape[0]):
        if not math.hypot(at[i, 0] - x, at[i, 1] - y) - radius[i] <= limit:  # also where it is absent: NaN
            continue
        off = bound[i] * math.sqrt(uniform(key, count, 2 * identity[i]))
        angle = 2.0 * math.pi * uniform(key, count, 2 * identity[i] + 1)
        seen[k], position[k, 0], position[k, 1] = i, at[i, 0] + off * math.cos(angle), at[i, 1] + off * math.sin(angle)
        k += 1
    return seen[:k].copy(), position[:k].copy()
