"""Unions of overlapping discs: which belong together, the nearest point outside of them, and what they shut off.

Discs are (n, 3) x, y, radius [m]. Two overlap if their centres are closer than the sum of their radii; the boundary
of a cluster (discs joined by overlaps) is therefore clear of every other disc. Points on a boundary are free.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import TURN
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import NONE, TOUCH, advance

Labels = npt.NDArray[np.int64]

REACHABLE, SHUT_OFF, UNDECIDED = 0, 1, 2


@kernel
def covered(x: float, y: float, discs: FloatArray) -> bool:
    """Whether the point lies inside a disc."""
    for j in range(len(discs)):
        inner = discs[j, 2] - TOUCH
        if inner > 0.0 and (x - discs[j, 0]) ** 2 + (y - discs[j, 1]) ** 2 < inner * inner:
            return True
    return False


@kernel
def within(x: float, y: float, area: FloatArray, zone: FloatArray) -> bool:
    """Whether the point lies in the rectangle x_min, y_min, x_max, y_max and in the circle x, y, radius."""
    if not (area[0] - TOUCH <= x <= area[2] + TOUCH and area[1] - TOUCH <= y <= area[3] + TOUCH):
        return False
    return math.hypot(x - zone[0], y - zone[1]) <= float(zone[2] + TOUCH)


@kernel
def label_cluster(seed: int, label: int, discs: FloatArray, labels: Labels, stack: Labels) -> None:
    """Give `label` to every disc of the cluster of disc `seed`; unlabelled discs have -1. `stack`: (n,) scratch."""
    labels[seed] = label
    stack[0] = seed
    size = 1
    while size > 0:
        size -= 1
        i = stack[size]
        for j in range(len(discs)):
            if labels[j] < 0:
                reach = discs[i, 2] + discs[j, 2] - TOUCH
                if (discs[i, 0] - discs[j, 0]) ** 2 + (discs[i, 1] - discs[j, 1]) ** 2 < reach * reach:
                    labels[j] = label
                    stack[size] = j
                    size += 1


@kernel
def meeting_points(
    ax: float, ay: float, ra: float, bx: float, by: float, rb: float
) -> tuple[bool, float, float, float, float]:
    """(exist, x1, y1, x2, y2) of the points where two circles cross."""
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    if square <= 0.0 or square > (ra + rb) ** 2 or square < (ra - rb) ** 2:
        return False, 0.0, 0.0, 0.0, 0.0
    along = 0.5 * (1.0 + (ra * ra - rb * rb) / square)
    across = math.sqrt(max(0.0, ra * ra / square - along * along))
    mx, my = ax + along * dx, ay + along * dy
    return True, mx - across * dy, my + across * dx, mx + across * dy, my - across * dx


@kernel
def nearest_free(
    x: float, y: float, discs: FloatArray, area: FloatArray, zone: FloatArray
) -> tuple[bool, float, float]:
    """(found, x, y) of the point nearest to (x, y) that no disc covers, within `area` and `zone` (see `within`).

    Exact but for points on the rectangle's edges, which it does not look at: the nearest point is the point itself,
    or lies on a disc's circle straight out, where two circles cross, or where one crosses the zone's rim.
    """
    if within(x, y, area, zone) and not covered(x, y, discs):
        return True, x, y
    n = len(discs)
    gap = np.empty(n)
    best, bx, by = math.inf, x, y
    for i in range(n):
        cx, cy, radius = discs[i, 0], discs[i, 1], discs[i, 2]
        distance = math.hypot(x - cx, y - cy)
        gap[i] = abs(distance - radius)
        if gap[i] < best:
            ux, uy = ((x - cx) / distance, (y - cy) / distance) if distance > 0.0 else (1.0, 0.0)
            px, py = cx + radius * ux, cy + radius * uy
            if within(px, py, area, zone) and not covered(px, py, discs):
                best, bx, by = gap[i], px, py
    for i in range(n):
        if not gap[i] < best:
            continue
        for j in range(-1, i):  # -1: the zone
            if j >= 0 and not gap[j] < best:
                continue
            ox, oy, r = (discs[j, 0], discs[j, 1], discs[j, 2]) if j >= 0 else (zone[0], zone[1], zone[2])
            exist, x1, y1, x2, y2 = meeting_points(discs[i, 0], discs[i, 1], discs[i, 2], ox, oy, r)
            if not exist:
                continue
            for px, py in ((x1, y1), (x2, y2)):
                distance = math.hypot(px - x, py - y)
                if distance < best and within(px, py, area, zone) and not covered(px, py, discs):
                    best, bx, by = distance, px, py
    return best < math.inf, bx, by


@kernel
def _leave(i: int, angle: float, discs: FloatArray) -> tuple[float, int]:
    """(turn, disc) after which the boundary, run counter-clockwise on circle i from `angle`, goes over to another disc."""
    least, following = TURN, i
    for j in range(len(discs)):
        dx, dy = discs[j, 0] - discs[i, 0], discs[j, 1] - discs[i, 1]
        reach = discs[i, 2] + discs[j, 2] - TOUCH
        square = dx * dx + dy * dy
        if j == i or square >= reach * reach or square <= (discs[i, 2] - discs[j, 2]) ** 2:
            continue
        distance = math.sqrt(square)
        cosine = (discs[i, 2] ** 2 + square - discs[j, 2] ** 2) / (2.0 * distance * discs[i, 2])
        turn = advance(angle, math.atan2(dy, dx) - math.acos(max(-1.0, min(1.0, cosine))), 1.0)
        if turn < least:
            least, following = turn, j
    return least, following


@kernel
def shut_off(
    sx: float,
    sy: float,
    tx: float,
    ty: float,
    gx: float,
    gy: float,
    discs: FloatArray,
    area: FloatArray,
    zone: FloatArray,
) -> tuple[int, float, float]:
    """Whether a cluster separates two free points s and t, and if so, the point reachable from s that is nearest to g.

    Runs along the straight line from s to t; at each cluster it meets, once around the boundary. An odd number of
    crossings between that boundary and the rest of the line means that t lies on its other side.

    Returns:
        (REACHABLE, t), (SHUT_OFF, the nearest point on the boundary within `area` and `zone`; s if there is none), or
        (UNDECIDED, t) where circles touch so closely that rounding decides.
    """
    distance = math.hypot(tx - sx, ty - sy)
    if distance <= 0.0:
        return REACHABLE, tx, ty
    ux, uy = (tx - sx) / distance, (ty - sy) / distance
    n = len(discs)
    at = 0.0
    for _ in range(n + 1):
        hit, where = NONE, distance
        for j in range(n):
            px, py = discs[j, 0] - sx, discs[j, 1] - sy
            rest = discs[j, 2] ** 2 - (ux * py - uy * px) ** 2
            if rest > 0.0:
                middle, half = px * ux + py * uy, math.sqrt(rest)
                if middle - half > at - TOUCH and middle + half > at + TOUCH and middle - half < where - TOUCH:
                    hit, where = j, middle - half
        if hit < 0:
            return REACHABLE, tx, ty
        i = hit
        angle = math.atan2(sy + where * uy - discs[i, 1], sx + where * ux - discs[i, 0])
        first = angle
        crossings, farthest = 0, where
        best, bx, by = math.inf, sx, sy
        closed = False
        for step in range(6 * n + 8):
            turn, following = _leave(i, angle, discs)
            cx, cy, radius = discs[i, 0], discs[i, 1], discs[i, 2]
            if i == hit and step > 0 and advance(angle, first, 1.0) <= turn + 1e-9:
                turn, closed = advance(angle, first, 1.0), True
            elif following == i:
                turn, closed = TURN, True
            px, py = cx - sx, cy - sy
            rest = radius * radius - (ux * py - uy * px) ** 2
            if rest > 0.0:
                middle, half = px * ux + py * uy, math.sqrt(rest)
                for place in (middle - half, middle + half):
                    if where + TOUCH < place < distance - TOUCH:
                        on = advance(angle, math.atan2(place * uy - py, place * ux - px), 1.0)
                        if on < turn:
                            crossings += 1
                            farthest = max(farthest, place)
            toward = advance(angle, math.atan2(gy - cy, gx - cx), 1.0)
            for choice in range(3):
                on = angle + (0.0 if choice == 0 else turn if choice == 1 else min(toward, turn))
                qx, qy = cx + radius * math.cos(on), cy + radius * math.sin(on)
                far = math.hypot(qx - gx, qy - gy)
                if far < best and within(qx, qy, area, zone) and not covered(qx, qy, discs):
                    best, bx, by = far, qx, qy
            if closed:
                break
            on = angle + turn
            angle = math.atan2(
                cy + radius * math.sin(on) - discs[following, 1], cx + radius * math.cos(on) - discs[following, 0]
            )
            i = following
        if not closed:
            return UNDECIDED, tx, ty
        if crossings % 2 == 0:  # with the first one: odd
            return (REACHABLE, tx, ty) if math.hypot(bx - tx, by - ty) < 1e-6 else (SHUT_OFF, bx, by)
        at = farthest
    return UNDECIDED, tx, ty
