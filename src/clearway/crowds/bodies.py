"""What the rules of a crowd are given: who is there, who decides, and who is near whom."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray

IntArray: TypeAlias = npt.NDArray[np.int64]


class Bodies(NamedTuple):
    """Everything that moves, or could, as discs.

    Attributes:
        position: (n, 2) centre, m.
        velocity: (n, 2) m/s.
        radius: (n,) m.
        layer: (n,) int64, one bit each; who looks at some layers only overlooks the others.
        share: (n,) which part of avoiding it falls to who sees it: 0.5 where it avoids in turn, 1 where it doesn't.
    """

    position: FloatArray
    velocity: FloatArray
    radius: FloatArray
    layer: IntArray
    share: FloatArray


class Wishes(NamedTuple):
    """Those that decide by one rule, and what they want.

    Attributes:
        who: (k,) int64, their indices among the bodies.
        velocity: (k, 2) what they would do alone, m/s.
        v_max: (k,) largest speed, m/s.
        sees: (k,) int64, the layers that they look at, or-ed.
    """

    who: IntArray
    velocity: FloatArray
    v_max: FloatArray
    sees: IntArray


class Sweep(NamedTuple):
    """Bodies from left to right, so that near ones are found without asking all.

    Attributes:
        order: (n,) int64, indices by ascending x.
        rank: (n,) int64, where each stands in `order`.
    """

    order: IntArray
    rank: IntArray


@kernel
def sweep(position: FloatArray) -> Sweep:
    """`Sweep` of bodies at `position` (n, 2)."""
    found = Sweep(np.empty(len(position), np.int64), np.empty(len(position), np.int64))
    sort(position, found)
    return found


@light
def sort(position: FloatArray, out: Sweep) -> None:
    """Write `Sweep` of bodies at `position` (n, 2) to `out`; by Shell's method, which needs no array more."""
    order, n = out.order, len(position)
    for k in range(n):
        order[k] = k
    gap = 1
    while 3 * gap < n:
        gap = 3 * gap + 1
    while gap > 0:
        for k in range(gap, n):
            i, m = order[k], k
            while m >= gap and position[order[m - gap], 0] > position[i, 0]:
                order[m] = order[m - gap]
                m -= gap
            order[m] = i
        gap //= 3
    for k in range(n):
        out.rank[order[k]] = k


@light
def nearest(
    i: int, sees: int, reach: float, bodies: Bodies, sorted_: Sweep, found: IntArray, distance: FloatArray
) -> int:
    """Find whom body `i` sees nearer than `reach` [m], centre to centre: the nearest ones, by ascending distance.

    Of two as far away the one with the lesser x goes first, then the one with the lesser y: so the order in which bodies
    are listed changes nothing.

    Args:
        sees: The layers that it looks at.
        found: (m,) int64, written: their indices; there are at most m.
        distance: (m,) written: their squared distances, m^2.

    Returns:
        How many were found.
    """
    position = bodies.position
    order, most = sorted_.order, found.shape[0]
    limit, count = reach * reach, 0
    if most == 0:
        return 0
    for side in (-1, 1):
        k = sorted_.rank[i] + side
        while 0 <= k < order.shape[0]:
            j = order[k]
            k += side
            dx = position[j, 0] - position[i, 0]
            if dx * dx >= limit and (dx * dx > limit or count < most):
                break
            if bodies.layer[j] & sees == 0:
                continue
            dy = position[j, 1] - position[i, 1]
            d = dx * dx + dy * dy
            if count < most:
                if d >= limit:
                    continue
                count += 1
            elif not _before(d, j, distance[most - 1], found[most - 1], position):
                continue
            m = count - 1
            while m > 0 and _before(d, j, distance[m - 1], found[m - 1], position):
                found[m], distance[m] = found[m - 1], distance[m - 1]
                m -= 1
            found[m], distance[m] = j, d
            if count == most:
                limit = distance[most - 1]
    return count


@light
def _before(d: float, j: int, other: float, k: int, position: FloatArray) -> bool:
    if d != other:
        return d < other
    if position[j, 0] != position[k, 0]:
        return bool(position[j, 0] < position[k, 0])
    return bool(position[j, 1] < position[k, 1])
