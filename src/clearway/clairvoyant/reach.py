"""Where a point can be at all, layer by layer in time: a bound from below on any arrival among moving discs.

The set of reachable nodes of a fine grid is carried forward, 64 nodes in a word. All of it errs on the point's side: a
step of the grid reaches at least as far as the point does, discs are smaller and the goal larger by `MARGIN` nodes, and
discs are looked at only at the layers' times. So where the grid finds no arrival before a time, there is none.

Two steps taken in turn, of all nodes within sqrt(409) and within sqrt(450), hold a circle of radius 2 x 20.5 between
them. They exceed it by at most 1.07 %, and by 0.16 % on average within 10 degrees of the grid's diagonal: so the
diagonal is laid along the line to the goal. What remains of rounding is the margin: the best sequence of nodes stayed
within 2.7 nodes of all ways at full speed that were tried, straight, bent, wandering and zigzag (tested, not proved).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.clairvoyant.moving_discs import Scene, centre, first_hit
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

STEPS = (409, 450)
"""Squares of how far the two steps reach, nodes."""

PER_STEP = 20.5
"""How far they reach at least in any direction, on average, nodes."""

MARGIN = 3.0
"""By how many nodes discs are smaller and the goal larger, against rounding."""

Words = npt.NDArray[np.uint64]
Layers = npt.NDArray[np.uint64]


class Lattice(NamedTuple):
    """A grid laid along the line to the goal: node (64 + ox, oy) is the start.

    Attributes:
        h: Spacing of its nodes, m.
        c: Cosine part of what turns and scales metres to nodes, 1/m.
        s: Sine part of the same, 1/m.
        ox: Offset of the start's column.
        oy: Row of the start.
        size: Number of rows and of columns.
        words: Number of words of 64 nodes in a row.
    """

    h: float
    c: float
    s: float
    ox: int
    oy: int
    size: int
    words: int


def earliest(scene: Scene, start: FloatArray, t0: float, limit: float, delta: float) -> float:
    """No way from `start` at `t0` arrives before this time; `limit` if there is none that arrives before `limit` [s].

    Args:
        start: (2,) where it starts, m.
        delta: Time between two layers, s; the grid's spacing is v delta / 20.5.
    """
    lattice = _lattice(scene, start, t0, limit, scene.v * delta / PER_STEP, MARGIN)
    none = np.zeros((0, 0, 0), np.uint64)
    return float(_flood(scene, start, t0, limit, delta, lattice, np.array(STEPS), MARGIN, none)[0])


def chain(scene: Scene, start: FloatArray, t0: float, limit: float, delta: float) -> FloatArray | None:
    """A clear way from `start` at `t0` to near the goal, along nodes of the grid: (k, 3) t, x, y, or None.

    It errs on the other side than `earliest`: steps no longer than the point's, discs larger by a node. Where no more is
    known than that a way waits for something, it says where and until when.
    """
    lattice = _lattice(scene, start, t0, limit, scene.v * delta / 20.0, 2.0)
    count = int((limit - t0) / delta) + 2
    layers = np.zeros((count, lattice.size, lattice.words), np.uint64)
    squares = np.array((400, 400))
    time, k = _flood(scene, start, t0, limit, delta, lattice, squares, -1.0, layers)
    return _back(scene, start, t0, delta, lattice, layers, k) if time < limit else None


@kernel
def _lattice(scene: Scene, start: FloatArray, t0: float, limit: float, h: float, margin: float) -> Lattice:
    gx, gy = scene.goal[0] - start[0], scene.goal[1] - start[1]
    turn = 0.25 * math.pi - math.atan2(gy, gx)
    c, s = math.cos(turn) / h, math.sin(turn) / h
    gx, gy = c * gx - s * gy, s * gx + c * gy
    # nodes that any way in time can use: within the ellipse around start and goal
    reach = scene.v * (limit - t0) / h + scene.goal[2] / h + 2.0 * margin
    half = 0.5 * (reach + math.hypot(gx, gy)) + 2.0
    size = int(2.0 * half) + 2 * 22 + 2
    return Lattice(h, c, s, int(half - 0.5 * gx) + 22, int(half - 0.5 * gy) + 22, size, size // 64 + 3)


@kernel
def _back(
    scene: Scene, start: FloatArray, t0: float, delta: float, lattice: Lattice, layers: Layers, last: int
) -> FloatArray | None:
    """A clear way back through flooded layers; nodes that turn out to be dead ends are cleared."""
    h, c, s = lattice.h, lattice.c * lattice.h, lattice.s * lattice.h
    path = np.zeros((last + 1, 2), np.int64)
    points = np.zeros((last + 1, 3))
    gx, gy = scene.goal[0] - start[0], scene.goal[1] - start[1]
    path[last, 0], path[last, 1] = -1, -1
    k = last
    tries = 0
    while k <= last and tries < 100_000:
        tries += 1
        # the best node of layer k: for the last layer nearest to the goal, else nearest to the straight line back
        if k == last:
            ax, ay = (c * gx - s * gy) / h + lattice.ox + 64, (s * gx + c * gy) / h + lattice.oy
            reach = 4 * 20 + 2
        else:
            part = k / (k + 1.0)
            ax = lattice.ox + 64 + part * (path[k + 1, 0] - lattice.ox - 64)
            ay = lattice.oy + part * (path[k + 1, 1] - lattice.oy)
            reach = 20
        px, py = (int(ax), int(ay)) if k == last else (path[k + 1, 0], path[k + 1, 1])
        best, bx, by = math.inf, -1, -1
        for y in range(max(py - reach, 0), min(py + reach, lattice.size - 1) + 1):
            for x in range(max(px - reach, 64), min(px + reach, 64 * lattice.words - 1) + 1):
                if not (layers[k, y, x // 64] >> np.uint64(x % 64)) & np.uint64(1):
                    continue
                if k < last and (x - px) * (x - px) + (y - py) * (y - py) > 400:
                    continue
                far = (x - ax) * (x - ax) + (y - ay) * (y - ay)
                if far >= best:
                    continue
                if k < last:
                    wx, wy = (x - lattice.ox - 64) * h, (y - lattice.oy) * h
                    fx, fy = start[0] + c * wx + s * wy, start[1] - s * wx + c * wy
                    vx, vy = (points[k + 1, 1] - fx) / delta, (points[k + 1, 2] - fy) / delta
                    if first_hit(scene, fx, fy, t0 + k * delta, vx, vy, delta, -1, 0.0)[0] >= 0:
                        continue
                best, bx, by = far, x, y
        if bx < 0:
            if k == last:
                return None
            k += 1
            layers[k, path[k, 1], path[k, 0] // 64] &= ~(np.uint64(1) << np.uint64(path[k, 0] % 64))
            continue
        path[k, 0], path[k, 1] = bx, by
        wx, wy = (bx - lattice.ox - 64) * h, (by - lattice.oy) * h
        points[k] = t0 + k * delta, start[0] + c * wx + s * wy, start[1] - s * wx + c * wy
        if k == 0:
            return points
        k -= 1
    return None


@kernel
def _flood(
    scene: Scene, start: FloatArray, t0: float, limit: float, delta: float, lattice: Lattice,
    squares: npt.NDArray[np.int64], margin: float, layers: Layers,
) -> tuple[float, int]:  # fmt: skip
    """Flood layer by layer until the goal may be reached before the next one; `layers` (k, size, words) is filled if it
    isn't empty.

    Returns:
        When it is reached (`limit`: never before that), and the layer.
    """
    h, c, s, ox, oy, size, words = lattice
    gx, gy = scene.goal[0] - start[0], scene.goal[1] - start[1]
    gx, gy = c * gx - s * gy, s * gx + c * gy
    now, then = np.zeros((size, words), np.uint64), np.zeros((size, words), np.uint64)
    low, high = np.full(size, words, np.int64), np.full(size, -1, np.int64)
    low_then, high_then = low.copy(), high.copy()
    now[oy, (ox + 64) // 64] = np.uint64(1) << np.uint64((ox + 64) % 64)
    low[oy] = high[oy] = (ox + 64) // 64
    first, last = oy, oy
    gx, gy = gx + ox + 64, gy + oy
    row = np.empty(words, np.uint64)
    wide = np.empty(len(squares) * 23, np.int64).reshape(len(squares), 23)
    for i in range(len(squares)):
        for dy in range(23):
            rest = squares[i] - dy * dy
            wide[i, dy] = math.floor(math.sqrt(rest) + 1e-9) if rest >= 0 else -1
    n = scene.static.shape[0] + scene.radii.shape[0]
    closest = math.inf
    k = 0
    while True:
        t = t0 + k * delta
        if len(layers):
            for y in range(first, last + 1):
                if high[y] >= low[y]:
                    layers[k, y, low[y] : high[y] + 1] = now[y, low[y] : high[y] + 1]
        # whoever arrives before the next layer is near the goal now
        near = (scene.v * delta + scene.goal[2]) / h + margin
        closest = _closest(now, low, high, max(first, int(gy - near)), min(last, int(gy + near) + 1), gx, gy, near)
        if closest < math.inf:
            return min(limit, t + max(closest - scene.goal[2] / h - margin, 0.0) * h / scene.v), k
        if t + delta >= limit:
            return limit, k
        reaches = wide[k % len(squares)]
        top = max(reaches[0], 22)
        _spread(now, low, high, first, last, then, low_then, high_then, reaches, row)
        first, last = max(first - top, 0), min(last + top, size - 1)
        k += 1
        t = t0 + k * delta
        from_start = scene.v * (t - t0) / h + margin
        to_goal = (scene.v * (limit - t) + scene.goal[2]) / h + margin
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
                rest = edge / h + margin - my * (y - oy)
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
            radius = radius / h - margin
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
            return limit, k
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
