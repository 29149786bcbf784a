"""Whether something has moved, told by what the lidar saw through: free space cannot fill by itself.

A return in a place that an earlier scan looked through has come there since; an earlier return in a place that this
scan looks through has gone. A face that comes into view, on the other hand, lay in the shadow before. So a body that
stands is not taken for a moving one merely because more of it is seen, which is what moves the centre of its cluster.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

FEWEST = 2
"""Fewer points than that count as none."""


@kernel
def share_seen_through(
    points: FloatArray, owner: np.ndarray, owners: np.ndarray,
    ranges: FloatArray, sensor: FloatArray, angle_min: float, increment: float, range_max: float,
    margin: float, slack: float,
) -> FloatArray:  # fmt: skip
    """(n,) which share of the points of each of `owners` (n,), which are sorted, lies where a scan saw nothing; 0 if fewer than `FEWEST` do.

    Args:
        points: (m, 2) in a frame that does not move.
        owner: (m,) to whom each belongs; to nobody who isn't among `owners`.
        ranges: (n,) of the scan; inf: nothing up to `range_max`.
        sensor: (3,) where it was taken, in the same frame.
        margin: By so much the beams must have gone beyond the point, m.
        slack: For so far to either side of it, rad.
    """
    found, all_of, k = np.zeros(len(owners)), np.zeros(len(owners)), -1
    n = ranges.shape[0]
    aside = max(1, math.ceil(slack / increment)) if increment > 0.0 else 0
    around = abs(n * increment - 2.0 * math.pi) < 0.5 * increment
    for j in range(points.shape[0]):
        if j == 0 or owner[j] != owner[j - 1]:
            k = np.searchsorted(owners, owner[j])
            if k == len(owners) or owners[k] != owner[j]:
                k = -1
        if k < 0:
            continue
        all_of[k] += 1.0
        dx, dy = points[j, 0] - sensor[0], points[j, 1] - sensor[1]
        d = math.hypot(dx, dy)
        if d + margin >= range_max:
            continue
        bearing = wrap(math.atan2(dy, dx) - sensor[2])
        if bearing < angle_min - 0.5 * increment:
            bearing += 2.0 * math.pi
        middle = math.floor((bearing - angle_min) / increment + 0.5) if increment > 0.0 else 0
        if not around and (middle - aside < 0 or middle + aside >= n):
            continue
        free, i = True, (middle - aside) % n
        for _ in range(2 * aside + 1):
            if not ranges[i] > d + margin:  # NaN: not known to be free
                free = False
                break
            i = i + 1 if i + 1 < n else 0
        if free:
            found[k] += 1.0
    for k in range(len(owners)):
        found[k] = found[k] / all_of[k] if found[k] >= FEWEST else 0.0
    return found
