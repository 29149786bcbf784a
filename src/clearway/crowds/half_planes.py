"""The velocity nearest to a wish that lies in a disc and in half-planes, or breaks them least.

The three linear programmes of van den Berg, Guy, Lin, Manocha 2011 ("Reciprocal n-body collision avoidance", section 5.3),
in the order and with the tolerance of their library RVO2. A half-plane is a row px, py, dx, dy of `lines`: what lies to
the left of the line through p in the direction d (a unit vector).
"""

from __future__ import annotations

import math

from clearway.geometry.compiled import light
from clearway.geometry.shapes import FloatArray

EPSILON = 1e-5
"""Below this two directions count as parallel, and a velocity as on a line; RVO2's."""


@light
def solve(
    lines: FloatArray, count: int, hard: int, v_max: float, wx: float, wy: float, spare: FloatArray
) -> tuple[float, float]:
    """The velocity [m/s] nearest to the wish (wx, wy) in the disc of radius `v_max` that keeps to `lines`.

    If there is none: the one that keeps to the first `hard` lines and lies as little as can be outside of the others.

    Args:
        lines: (m, 4) half-planes, of which the first `count` hold.
        spare: (m, 4) overwritten.
    """
    failed, vx, vy = _nearest(lines, count, v_max, wx, wy)
    if failed < count:
        vx, vy = _least_outside(lines, count, hard, failed, v_max, vx, vy, spare)
    return vx, vy


@light
def _on_line(
    lines: FloatArray, k: int, v_max: float, wx: float, wy: float, farthest: bool
) -> tuple[bool, float, float]:
    """On the line `k`, within the disc and the half-planes before it: the point nearest to w, or `farthest` along it."""
    px, py, dx, dy = lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3]
    along = px * dx + py * dy
    inside = along * along + v_max * v_max - (px * px + py * py)
    if inside < 0.0:
        return False, 0.0, 0.0
    half = math.sqrt(inside)
    low, high = -along - half, -along + half
    for j in range(k):
        qx, qy, ex, ey = lines[j, 0], lines[j, 1], lines[j, 2], lines[j, 3]
        across, away = dx * ey - dy * ex, ex * (py - qy) - ey * (px - qx)
        if abs(across) <= EPSILON:
            if away < 0.0:
                return False, 0.0, 0.0
            continue
        t = away / across
        if across >= 0.0:
            high = min(high, t)
        else:
            low = max(low, t)
        if low > high:
            return False, 0.0, 0.0
    t = min(max(dx * (wx - px) + dy * (wy - py), low), high)
    if farthest:
        t = high if wx * dx + wy * dy > 0.0 else low
    return True, px + t * dx, py + t * dy


@light
def _nearest(lines: FloatArray, count: int, v_max: float, wx: float, wy: float) -> tuple[int, float, float]:
    """The point nearest to w in all half-planes, and `count`; or the first that leaves none, and the best before it."""
    speed = math.sqrt(wx * wx + wy * wy)
    vx, vy = (wx, wy) if speed <= v_max else (wx / speed * v_max, wy / speed * v_max)
    return _improve(lines, count, v_max, wx, wy, False, vx, vy)


@light
def _improve(
    lines: FloatArray, count: int, v_max: float, wx: float, wy: float, farthest: bool, vx: float, vy: float
) -> tuple[int, float, float]:
    """Move v, the best in the disc, into one half-plane after the other."""
    for k in range(count):
        if lines[k, 2] * (lines[k, 1] - vy) - lines[k, 3] * (lines[k, 0] - vx) > 0.0:
            found, x, y = _on_line(lines, k, v_max, wx, wy, farthest)
            if not found:
                return k, vx, vy
            vx, vy = x, y
    return count, vx, vy


@light
def _least_outside(
    lines: FloatArray, count: int, hard: int, first: int, v_max: float, vx: float, vy: float, spare: FloatArray
) -> tuple[float, float]:
    """The velocity that is least far outside of the half-planes from `first` on, and not at all of the first `hard`."""
    outside = 0.0
    for i in range(first, count):
        px, py, dx, dy = lines[i, 0], lines[i, 1], lines[i, 2], lines[i, 3]
        if dx * (py - vy) - dy * (px - vx) <= outside:
            continue
        kept = hard
        for j in range(hard):
            for c in range(4):
                spare[j, c] = lines[j, c]
        for j in range(hard, i):  # where it is no farther outside of line i than of line j
            qx, qy, ex, ey = lines[j, 0], lines[j, 1], lines[j, 2], lines[j, 3]
            across = dx * ey - dy * ex
            if abs(across) <= EPSILON:
                if dx * ex + dy * ey > 0.0:
                    continue
                spare[kept, 0], spare[kept, 1] = 0.5 * (px + qx), 0.5 * (py + qy)
            else:
                t = (ex * (py - qy) - ey * (px - qx)) / across
                spare[kept, 0], spare[kept, 1] = px + t * dx, py + t * dy
            nx, ny = ex - dx, ey - dy
            length = math.sqrt(nx * nx + ny * ny)
            spare[kept, 2], spare[kept, 3] = nx / length, ny / length
            kept += 1
        done, x, y = _improve(spare, kept, v_max, -dy, dx, True, -dy * v_max, dx * v_max)
        if done == kept:
            vx, vy = x, y
        outside = dx * (py - vy) - dy * (px - vx)
    return vx, vy
