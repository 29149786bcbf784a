"""The robot's camera: the obstacles of the test that reach into a circle around the robot, as discs.

Paper B, assumptions A1 and A3: what lies within the perception field is seen, nothing hides anything else, what stands
still is seen where it is, and what moves with a bounded error. Walls and furniture are a lidar's work.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clearway.contract import Obstacles
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream, uniform
from clearway.robots import Camera
from clearway.trials import Body


class Lens:
    """Looks at the obstacles among `bodies`.

    Args:
        camera: its range and error. still_reach, moving_reach: how far the outline of each body without and with a
            pose column reaches from its origin, in their order, m: a shape is seen as the disc that holds it.
        seed: of the trial; an obstacle's error in a control period depends on nothing else.
    """

    def __init__(
        self, camera: Camera, bodies: Sequence[Body], still_reach: FloatArray, moving_reach: FloatArray, seed: int
    ) -> None:
        self._range, self._error = camera.range, camera.error
        self._key = stream(seed, "camera")
        reach = {True: iter(moving_reach.tolist()), False: iter(still_reach.tolist())}
        seen = [(i, b, next(reach[b.pose is None])) for i, b in enumerate(bodies)]
        seen = [(i, b, r) for i, b, r in seen if b.kind in ("obstacle", "mover")]
        self._identity = np.array([i for i, _, _ in seen], dtype=np.int64)
        self._moving = np.array([b.pose is None for _, b, _ in seen], dtype=np.bool_)
        self._radius = np.array([r for _, _, r in seen], dtype=np.float64)
        self._at = np.full((len(seen), 2), np.nan)
        for at, (_, b, _) in zip(self._at, seen, strict=True):
            if b.pose is not None:
                at[:] = b.pose[:2]

    def look(self, x: float, y: float, movers: FloatArray, count: int) -> Obstacles:
        """What is seen from (x, y) [m] in control period `count`; movers: (m, 3) poses, NaN where one is absent."""
        self._at[self._moving] = movers[:, :2]
        found = np.empty((len(self._at), 2))
        kept = measure(self._at, self._radius, self._moving, self._identity, x, y, self._range, self._error, self._key,
                       count, found)  # fmt: skip
        n, moving = int(kept.sum()), self._moving[kept]
        return Obstacles(
            position=found[kept],
            velocity=np.full((n, 2), np.nan),
            radius=self._radius[kept],
            error=np.where(moving, self._error, 0.0),
            velocity_error=np.full(n, np.inf),
            identity=self._identity[kept],
            moving=moving,
        )


@kernel
def measure(
    at: FloatArray, radius: FloatArray, moving: np.ndarray, identity: np.ndarray, x: float, y: float, limit: float,
    error: float, key: np.uint64, count: int, out: FloatArray,
) -> np.ndarray:  # fmt: skip
    """Which of the discs at `at` (n, 2) reach within `limit` [m] of (x, y), and where they seem to be.

    Args:
        out: (n, 2), filled: the position, of one that moves with an error uniform in a disc of radius `error` [m].
    """
    kept = np.zeros(at.shape[0], dtype=np.bool_)
    for i in range(at.shape[0]):
        kept[i] = math.hypot(at[i, 0] - x, at[i, 1] - y) - radius[i] <= limit  # never where it is absent: NaN
        out[i] = at[i]
        if kept[i] and moving[i]:
            off = error * math.sqrt(uniform(key, count, 2 * identity[i]))
            angle = 2.0 * math.pi * uniform(key, count, 2 * identity[i] + 1)
            out[i, 0] += off * math.cos(angle)
            out[i, 1] += off * math.sin(angle)
    return kept
