"""What stands, remembered for a while: discs steadied over time, and kept while the sensor looks another way.

A lidar that sees 200 degrees loses what it passes as soon as the robot turns. Without memory the way that it has just
found blocked looks free again, and the robot turns to and fro.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.contract import Scan
from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.perception import kalman
from clearway.perception.clusters import IntArray

SHARE = 0.25
"""Of a new disc in the steadied one."""


class StructureMemory:
    """Discs of structure by identity, in a frame that does not move.

    Args:
        seconds: How long a disc is kept that is out of view; 0: nothing is kept or steadied.
        sigma: Standard deviation of a range, m.
        reach: Discs farther from the sensor are dropped, m.
        most: Discs at most; those out of view give way, oldest first.
    """

    def __init__(self, seconds: float, sigma: float, reach: float, most: int) -> None:
        self._seconds, self._sigma, self._reach, self._most = seconds, sigma, reach, most
        self._ids, self._discs = np.empty(0, dtype=np.int64), np.empty((0, 3))
        self._known, self._seen = np.empty(0, dtype=np.uint8), np.empty(0)

    def update(
        self, ids: IntArray, discs: FloatArray, known: npt.NDArray[np.uint8], scan: Scan, sensor: FloatArray, t: float
    ) -> tuple[IntArray, FloatArray, npt.NDArray[np.uint8]]:
        """What stands at time `t` [s]: what is seen now (n,), (n, 3), (n,), steadied, and what is remembered.

        Args:
            sensor: (3,) where the scan was taken, in the discs' frame.
        """
        if self._seconds <= 0.0:
            return ids, discs, known
        order = np.argsort(ids, kind="stable")
        ids, discs, known = ids[order], discs[order], known[order]
        at = kalman.find(self._ids, ids)
        old = at >= 0
        before, now = self._discs[at[old]], discs[old]
        mean = before + SHARE * (now - before)
        apart = np.hypot(mean[:, 0] - now[:, 0], mean[:, 1] - now[:, 1])
        mean[:, 2] = np.maximum(
            mean[:, 2], apart + now[:, 2] - 2.0 * self._sigma
        )  # what is new to see is covered at once
        discs[old] = mean
        kept = np.ones(len(self._ids), dtype=np.bool_)
        kept[at[old]] = False
        kept &= t - self._seen <= self._seconds
        rows = np.flatnonzero(kept)
        n = len(scan.ranges)
        aside = unseen(self._discs[rows], sensor, scan.angle_min, n * scan.angle_increment, scan.range_min, self._reach)
        rows = rows[aside]
        if len(rows) > self._most - len(ids):
            newest = np.argsort(-self._seen[rows], kind="stable")[: max(self._most - len(ids), 0)]
            rows = np.sort(rows[newest])
        all_ids = np.concatenate((ids, self._ids[rows]))
        order = np.argsort(all_ids, kind="stable")
        self._ids = all_ids[order]
        self._discs = np.concatenate((discs, self._discs[rows]))[order]
        self._known = np.concatenate((known, self._known[rows]))[order]
        self._seen = np.concatenate((np.full(len(ids), t), self._seen[rows]))[order]
        return self._ids, self._discs, self._known


@kernel
def unseen(
    discs: FloatArray, sensor: FloatArray, angle_min: float, field: float, near: float, reach: float
) -> npt.NDArray[np.bool_]:
    """Which discs lie outside of the field of view (`field` rad from `angle_min`), or too near to be seen, within reach."""
    out = np.zeros(discs.shape[0], dtype=np.bool_)
    for i in range(discs.shape[0]):
        dx, dy = discs[i, 0] - sensor[0], discs[i, 1] - sensor[1]
        d = math.hypot(dx, dy)
        if d > reach:
            continue
        bearing = wrap(math.atan2(dy, dx) - sensor[2])
        if bearing < angle_min:
            bearing += 2.0 * math.pi
        out[i] = d < near or bearing > angle_min + field
    return out
