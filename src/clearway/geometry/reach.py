"""Where a point can be at all, layer by layer in time: a bound from below on any arrival among moving discs.

The set of reachable nodes of a fine grid is carried forward, 64 nodes in a word. All of it errs on the point's side: a
step of the grid reaches at least as far as the point does in any direction, discs are smaller and the goal larger by
`MARGIN` nodes (a way can be followed on the grid to within that), and discs are looked at only at the layers' times.
So where the grid finds no arrival before a time, there is none.

A grid's step reaches a little too far in most directions. Two steps taken in turn, of all nodes within sqrt(409) and
within sqrt(450), make up a 68-gon that holds a circle of radius 2 x 20.5 and exceeds it by at most 0.53 %, and by
0.16 % on average within 10 degrees of the grid's diagonal: so the diagonal is laid along the line to the goal.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.moving_discs import Scene, centre
from clearway.geometry.shapes import FloatArray

STEPS = (409, 450)
"""Squares of how far the two steps reach, nodes."""

PER_STEP = 20.5
"""How far they reach at least in any direction, on average, nodes."""

MARGIN = 2.0
"""Nodes."""

Words = npt.NDArray[np.uint64]


@kernel
def earliest(scene: Scene, start: FloatArray, t0: float, limit: float, delta: float) -> float:
    """No way from `start` at `t0` arrives before this time; `limit` if there is none that arrives before `limit` [s].

    Args:
        start: (2,) m. delta: between two layers, s; the grid's spacing is v delta / 20.5.
    """
    h = scene.v * delta / PER_STEP
    gx, gy = scene.goal[0] - start[0], scene.goal[1] - start[1]
    turn = 0.25 * math.pi - math.atan2(gy, gx)
    c, s = math.cos(turn) / h, math.sin(turn) / h
    gx, gy = c * gx - s * gy, s * gx + c * gy
    # nodes that any way in time can use: within the ellipse around start and goal
    reach = scene.v * (limit - t0) / h + scene.goal[2] / h + 2.0 * MARGIN
    half = 0.5 * (reach + math.hypot(gx, gy)) + 2.0
    size = int(2.0 * half) + 2 * 22 + 2
    words = size // 64 + 3
    ox, oy = int(half - 0.5 * gx) + 22, int(half - 0.5 * gy) + 22  # the start's node, 64 to the right
    now, then = np.zeros((size, words), np.uint64), np.zeros((size, words), np.uint64)
    low, high = np.full(size, words, np.int64), np.full(size, -1, np.int64)
    low_then, high_then = low.copy(), high.copy()
    now[oy, (ox + 64) // 64] = np.uint64(1) << np.uint64((ox + 64) % 64)
    low[oy] = high[oy] = (ox + 64) // 64
    first, last = oy, oy
    gx, gy = gx + ox + 64, gy + oy
    row = np.empty(words, np.uint64)
    wide = np.empty(2 * len(STEPS) * 23, np.int64).reshape(2 * len(STEPS), 23)
    for i in range(len(STEPS)):
        for dy in range(23):
            rest = STEPS[i] - dy * dy
            wide[i, dy] = math.floor(math.sqrt(rest) + 1e-9) if rest >= 0 else -1
    n = scene.static.shape[0] + scene.radii.shape[0]
    closest = math.inf
    k = 0
    while True:
        t = t0 + k * delta
        # whoever arrives before the next layer is near the goal now
        near = (scene.v * delta + scene.goal[2]) / h + MARGIN
        closest = _closest(now, low, high, max(first, int(gy - near)), min(last, int(gy + near) + 1), gx, gy, near)
        if closest < math.inf:
            return min(limit, t + max(closest - scene.goal[2] / h - MARGIN, 0.0) * h / scene.v)
        if t + delta >= limit:
            return limit
        reaches = wide[k % len(STEPS)]
        top = max(reaches[0], 22)
        _spread(now, low, high, first, last, then, low_then, high_then, reaches, row)
        first, last = max(first - top, 0), min(last + top, size - 1)
        k += 1
        t = t0 + k * delta
        from_start = scene.v * (t - t0) / h + MARGIN
        to_goal = (scene.v * (limit - t) + scene.goal[2]) / h + MARGIN
        found_first, found_last = size, -1
        for y in range(first, last + 1):
            if high_then[y] < low_then[y]:
                continue
            left, right = _chord(ox + 64.0, y - float(oy), from_start)
            a, b = _chord(gx, y - gy, to_goal)
            left, right = max(left, a), min(right, b)
            for side in range(4):  # of the area: nx x + ny y <= reach
                nx = -1.0 if side == 0 else (1.0 if side == 2 else 0.0)
                ny = -1.0 if side == 1 else (1.0 if side == 3 else 0.0)
                edge = scene.area[side] * (nx + ny) - nx * start[0] - ny * start[1]
                if edge == math.inf:
                    continue
                mx, my = (c * nx - s * ny) * h, (s * nx + c * ny) * h
                rest = edge / h + MARGIN - my * (y - oy)
                if mx > 1e-9:
                    right = min(right, rest / mx + ox + 64)
                elif mx < -1e-9:
                    left = max(left, rest / mx + ox + 64)
                elif rest < 0.0:
                    right = -1.0
            _keep(then[y], low_then[y], high_then[y], math.ceil(left), math.floor(right))
        for disc in range(n):
            x, y0, _, _, radius = centre(scene, disc, t)
            if math.isnan(x) or (disc >= scene.static.shape[0] and t >= (scene.moving.shape[0] - 1) * scene.dt):
                continue
            x, y0 = x - start[0], y0 - start[1]
            x, y0 = c * x - s * y0 + ox + 64, s * x + c * y0 + oy
            radius = radius / h - MARGIN
            for y in range(max(first, int(y0 - radius)), min(last, int(y0 + radius) + 1) + 1):
                if high_then[y] < low_then[y]:
                    continue
                a, b = _chord(x, y - y0, radius)
                if a < b:
                    _drop(then[y], low_then[y], high_then[y], math.ceil(a), math.floor(b))
        for y in range(first, last + 1):
            lo, hi = low_then[y], high_then[y]
            while lo <= hi and then[y, lo] == 0:
                lo += 1
            while hi >= lo and then[y, hi] == 0:
                hi -= 1
            low_then[y], high_then[y] = (lo, hi) if lo <= hi else (words, -1)
            if lo <= hi:
                found_first, found_last = min(found_first, y), max(found_last, y)
        if found_last < 0:
            return limit
        first, last = found_first, found_last
        now, then, low, low_then, high, high_then = then, now, low_then, low, high_then, high


@kernel
def _spread(
    now: Words, low: npt.NDArray[np.int64], high: npt.NDArray[np.int64], first: int, last: int,
    then: Words, low_then: npt.NDArray[np.int64], high_then: npt.NDArray[np.int64],
    reaches: npt.NDArray[np.int64], row: Words,
) -> None:  # fmt: skip
    """Carry all nodes of `now` one step on into `then` (which is cleared), and clear nothing else."""
    rows, words = then.shape
    for y in range(rows):
        if high_then[y] >= low_then[y]:
            then[y, low_then[y] : high_then[y] + 1] = 0
        low_then[y], high_then[y] = words, -1
    one, top = np.uint64(1), np.uint64(63)
    for y in range(first, last + 1):
        if high[y] < low[y]:
            continue
        lo, hi = max(low[y] - 1, 0), min(high[y] + 1, words - 1)
        row[lo : hi + 1] = 0
        row[low[y] : high[y] + 1] = now[y, low[y] : high[y] + 1]
        width = 0
        for dy in range(len(reaches) - 1, -1, -1):  # the farther, the narrower
            if reaches[dy] < 0:
                continue
            while width < reaches[dy]:
                before = np.uint64(0)
                for w in range(lo, hi + 1):
                    here = row[w]
                    after = row[w + 1] if w < hi else np.uint64(0)
                    row[w] = here | (here << one) | (here >> one) | (before >> top) | (after << top)
                    before = here
                width += 1
            for sign in range(2 if dy > 0 else 1):
                z = y + dy if sign == 0 else y - dy
                if 0 <= z < rows:
                    for w in range(lo, hi + 1):
                        then[z, w] |= row[w]
                    low_then[z], high_then[z] = min(low_then[z], lo), max(high_then[z], hi)


@kernel
def _chord(x: float, dy: float, radius: float) -> tuple[float, float]:
    """From where to where a row at `dy` from the centre of a circle lies within it; an empty range if it doesn't."""
    rest = radius * radius - dy * dy
    if radius <= 0.0 or rest < 0.0:
        return 0.0, -1.0
    half = math.sqrt(rest)
    return x - half, x + half


@kernel
def _mask(word: int, left: int, right: int) -> np.uint64:
    """The bits of a word that lie in nodes left..right."""
    a, b = max(left - 64 * word, 0), min(right - 64 * word, 63)
    if a > b:
        return np.uint64(0)
    full = ~np.uint64(0)
    return (full << np.uint64(a)) & (full >> np.uint64(63 - b))


@kernel
def _keep(row: Words, low: int, high: int, left: int, right: int) -> None:
    for w in range(low, high + 1):
        row[w] &= _mask(w, left, right)


@kernel
def _drop(row: Words, low: int, high: int, left: int, right: int) -> None:
    for w in range(max(low, left // 64), min(high, right // 64) + 1):
        row[w] &= ~_mask(w, left, right)


@kernel
def _closest(
    now: Words, low: npt.NDArray[np.int64], high: npt.NDArray[np.int64], first: int, last: int, gx: float, gy: float,
    near: float,
) -> float:  # fmt: skip
    """Distance of the reached node that is nearest to the goal, if it is within `near`; else inf."""
    best = near * near
    found = False
    for y in range(first, last + 1):
        for w in range(low[y], high[y] + 1):
            if now[y, w] == 0:
                continue
            for b in range(64):
                if (now[y, w] >> np.uint64(b)) & np.uint64(1):
                    x = 64 * w + b
                    d = (x - gx) * (x - gx) + (y - gy) * (y - gy)
                    if d <= best:
                        best, found = d, True
    return float(math.sqrt(best)) if found else math.inf
