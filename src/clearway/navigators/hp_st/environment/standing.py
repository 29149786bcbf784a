"""What has been seen to stand, kept until it is seen to be gone: so a way that was found blocked stays blocked behind the robot's back.

What hides it is what stands as well: behind somebody who passes it is taken to be gone, until it is seen again.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.sight import Sight, beside

MOST = 600
"""Discs at most; those that were seen last stay."""
SAME = 0.1
"""m: a disc seen now whose centre is no farther off is the same."""
RIM = 0.2
"""m: so near to the end of its range a lidar may miss what it saw before."""
BEARINGS = 360
"""Directions of which it is told apart whether something hides what is behind it."""


class Standing:
    """Discs that stand, in a frame that does not move.

    Args:
        sight: What the robot sees.
    """

    def __init__(self, sight: Sight) -> None:
        self._sight, self._discs = sight, np.empty((0, 3))

    def update(self, eye: FloatArray, seen: FloatArray) -> FloatArray:
        """(n, 3) x, y, R of what stands: what is `seen` (s, 3) from `eye` (3,), and what was seen before and may stand there still."""
        self._discs = np.concatenate((seen, out_of_sight(self._discs, seen, self._sight, eye)))[:MOST]
        return self._discs


@kernel
def out_of_sight(before: FloatArray, seen: FloatArray, sight: Sight, eye: FloatArray) -> FloatArray:
    """(n, 3) those of the discs `before` (m, 3) that can't be seen from `eye` (3,), and are none of the `seen` (s, 3): too far away, beside
    the sector of sight, or behind something nearer of the `seen`."""
    free = np.full(BEARINGS, math.inf)
    step = 2.0 * math.pi / BEARINGS
    x = eye[0] + math.cos(eye[2]) * sight.x - math.sin(eye[2]) * sight.y
    y = eye[1] + math.sin(eye[2]) * sight.x + math.cos(eye[2]) * sight.y
    for i in range(len(seen)):
        dx, dy, r = seen[i, 0] - x, seen[i, 1] - y, seen[i, 2]
        far = math.hypot(dx, dy)
        wide = math.asin(min(r / max(far, 1e-9), 1.0))
        first = math.floor((math.atan2(dy, dx) - wide) / step)
        for k in range(first, first + int(2.0 * wide / step) + 2):
            free[k % BEARINGS] = min(free[k % BEARINGS], far - r)
    kept = np.zeros(len(before), np.bool_)
    for i in range(len(before)):
        dx, dy = before[i, 0] - x, before[i, 1] - y
        far = math.hypot(dx, dy)
        bearing = math.floor(math.atan2(dy, dx) / step) % BEARINGS
        kept[i] = far > sight.range - RIM or free[bearing] < far or beside(sight, eye, before[i, 0], before[i, 1])
        for j in range(len(seen)):
            if kept[i] and math.hypot(seen[j, 0] - before[i, 0], seen[j, 1] - before[i, 1]) <= SAME:
                kept[i] = False
    return before[kept]
