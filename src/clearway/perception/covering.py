"""Clusters of returns as discs: those that cover what was seen of structure cell by cell, and those that fill what was seen of bodies."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.enclosing import enclosing_circle
from clearway.geometry.shapes import FloatArray
from clearway.perception.clusters import ClusterParameters, IntArray, Returns, by_label

CORE_STEPS = 8
"""Steps of a radius over which the disc inside a body is pushed back."""


def cover(
    returns: Returns, chosen: npt.NDArray[np.uint8], increment: float, parameters: ClusterParameters, most: int
) -> tuple[FloatArray, IntArray, npt.NDArray[np.uint8]]:
    """Discs that cover the returns of the `chosen` clusters cell by cell, so that they stay where they are while the
    robot moves.

    Args:
        returns: In a frame that does not move.
        chosen: (k,) which clusters.
        increment: Between two beams, rad.
        most: Discs at most; the cells double until that holds.

    Returns:
        Discs (n, 3) x, y, radius; a number (n,) for each that is its cell's, negative; whether all of it is known (n,).
    """
    return _cover(  # type: ignore[no-any-return]
        returns.points, returns.distance, returns.known, returns.label, chosen, increment, parameters.cell,
        parameters.near, most,
    )  # fmt: skip


@kernel
def _cover(
    points: FloatArray, distance: FloatArray, known: np.ndarray, label: IntArray, chosen: np.ndarray,
    increment: float, cell: float, near: float, most: int,
) -> tuple[FloatArray, IntArray, np.ndarray]:  # fmt: skip
    """See `cover`."""
    taken = np.empty(points.shape[0], dtype=np.int64)
    m = 0
    for j in range(points.shape[0]):
        if chosen[label[j]]:
            taken[m] = j
            m += 1
    size = 16
    while size < 2 * m:
        size *= 2
    own, keys = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64)
    slots = np.empty(size, dtype=np.int64)
    level, k = 0, 0
    while True:
        slots[:] = -1
        k = 0
        for i in range(m):
            j = taken[i]
            deep = level + (1 if distance[j] > near else 0)
            edge = cell * 2.0**deep
            column, row = math.floor(points[j, 0] / edge), math.floor(points[j, 1] / edge)
            key = (np.int64(deep) << 48) | ((np.int64(column) & 0xFFFFFF) << 24) | (np.int64(row) & 0xFFFFFF)
            at = ((key * 0x9E3779B1) >> 7) & (size - 1)
            while slots[at] >= 0 and keys[slots[at]] != key:
                at = (at + 1) & (size - 1)
            if slots[at] < 0:
                slots[at], keys[k] = k, key
                k += 1
            own[i] = slots[at]
        if k <= most or level >= 24:
            break
        level += 1
    order, first = by_label(own, k)
    discs, all_known = np.empty((k, 3)), np.ones(k, dtype=np.uint8)
    for c in range(k):
        members = taken[order[first[c] : first[c + 1]]]
        discs[c, 0], discs[c, 1], discs[c, 2] = enclosing_circle(points, members)
        far = 0.0
        for j in members:
            far = max(far, distance[j])
            all_known[c] &= known[j]
        discs[c, 2] += 0.5 * increment * far
    return discs, -1 - keys[:k], all_known


@kernel
def cores(
    points: FloatArray, label: IntArray, circles: FloatArray, sensor: FloatArray, clusters: IntArray
) -> FloatArray:  # fmt: skip
    """Discs (n, 3) inside what is seen of the outlines of `clusters` (n,): what surely, or most likely, fills them.

    Circumscribed circles of radius R hold a square that holds a disc of R / sqrt 2. That disc is put behind the middle
    of the returns, along the line of sight, as near as leaves none of them inside: of a square of which two faces are
    in view it is the inscribed disc, of one face it reaches 0.7 e deep. Without it a way through the body would look
    free, as its far faces are out of view.
    """
    found = np.empty((clusters.shape[0], 3))
    row = np.full(circles.shape[0], -1, dtype=np.int64)
    for i in range(clusters.shape[0]):
        row[clusters[i]] = i
    ahead, nearest = np.zeros(clusters.shape[0]), np.empty(clusters.shape[0])
    for step in range(CORE_STEPS + 1):
        for i in range(clusters.shape[0]):
            found[i, 0], found[i, 1], found[i, 2] = _behind(circles[clusters[i]], sensor, ahead[i])
        nearest[:] = math.inf
        for j in range(points.shape[0]):
            i = row[label[j]]
            if i >= 0:
                nearest[i] = min(nearest[i], math.hypot(points[j, 0] - found[i, 0], points[j, 1] - found[i, 1]))
        pushed = False
        for i in range(clusters.shape[0]):
            if nearest[i] < found[i, 2]:
                found[i, 2], ahead[i], pushed = nearest[i], (step + 1) / CORE_STEPS, True
        if not pushed:
            break
    return found


@light
def _behind(circle: FloatArray, sensor: FloatArray, ahead: float) -> tuple[float, float, float]:
    """The middle of `circle` (3,) pushed away from the sensor by `ahead` radii, and its radius over sqrt 2."""
    dx, dy = circle[0] - sensor[0], circle[1] - sensor[1]
    d = max(math.hypot(dx, dy), 1e-9)
    push = ahead * circle[2] / d
    return circle[0] + push * dx, circle[1] + push * dy, circle[2] / math.sqrt(2.0)
