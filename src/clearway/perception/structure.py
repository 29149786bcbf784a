"""What stands, remembered for a while: discs steadied over time, and kept while the sensor looks another way.

A lidar that sees 200 degrees loses what it passes as soon as the robot turns. Without memory the way that it has just
found blocked looks free again, and the robot turns to and fro.
"""

from __future__ import annotations

import math
from typing import NamedTuple

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


class _Standing(NamedTuple):
    ids: IntArray  # (n,) sorted
    discs: FloatArray  # (n, 3)
    known: npt.NDArray[np.uint8]  # (n,)
    seen: FloatArray  # (n,) when, s


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
        self._standing = _Standing(
            np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty(0, dtype=np.uint8), np.empty(0)
        )  # fmt: skip

    def update(
        self, ids: IntArray, discs: FloatArray, known: npt.NDArray[np.uint8], scan: Scan, sensor: FloatArray, t: float
    ) -> tuple[IntArray, FloatArray, npt.NDArray[np.uint8]]:
        """What stands at time `t` [s]: what is seen now (n,), (n, 3), (n,), steadied, and what is remembered.

        Args:
            sensor: (3,) where the scan was taken, in the discs' frame.
        """
        if self._seconds <= 0.0:
            return ids, discs, known
        self._standing = _remembered(
            self._standing, ids, discs, known, sensor, scan.angle_min, len(scan.ranges) * scan.angle_increment, scan.range_min,
            self._reach, self._sigma, self._seconds, self._most, t,
        )  # fmt: skip
        return self._standing.ids, self._standing.discs, self._standing.known


@kernel
def _remembered(
    before: _Standing, ids: IntArray, discs: FloatArray, known: npt.NDArray[np.uint8],
    sensor: FloatArray, angle_min: float, field: float, near: float, reach: float, sigma: float, seconds: float, most: int, t: float,
) -> _Standing:  # fmt: skip
    """What stands: see `StructureMemory`, and `unseen` for the view."""
    at, order = kalman.find(before.ids, ids), np.argsort(ids, kind="mergesort")
    kept = unseen(before.discs, sensor, angle_min, field, near, reach) & (t - before.seen <= seconds)
    for i in at:
        if i >= 0:
            kept[i] = False
    n, room = ids.shape[0], max(most - ids.shape[0], 0)
    rows = np.flatnonzero(kept)
    if rows.shape[0] > room:
        kept[rows[np.argsort(-before.seen[rows], kind="mergesort")[room:]]] = False
        rows = np.flatnonzero(kept)
    m = n + rows.shape[0]
    now = _Standing(np.empty(m, dtype=np.int64), np.empty((m, 3)), np.empty(m, dtype=np.uint8), np.empty(m))
    a = b = 0
    for k in range(m):
        if a == n or (b < rows.shape[0] and before.ids[rows[b]] < ids[order[a]]):
            i = rows[b]
            now.ids[k], now.discs[k] = before.ids[i], before.discs[i]
            now.known[k], now.seen[k] = before.known[i], before.seen[i]
            b += 1
            continue
        i, j = at[order[a]], order[a]
        now.ids[k], now.discs[k], now.known[k], now.seen[k] = ids[j], discs[j], known[j], t
        if i >= 0:
            x, y, r = discs[j]
            for d in range(3):
                now.discs[k, d] = before.discs[i, d] + SHARE * (discs[j, d] - before.discs[i, d])
            apart = math.hypot(now.discs[k, 0] - x, now.discs[k, 1] - y)
            now.discs[k, 2] = max(now.discs[k, 2], apart + r - 2.0 * sigma)  # what is new to see is covered at once
        a += 1
    return now


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
