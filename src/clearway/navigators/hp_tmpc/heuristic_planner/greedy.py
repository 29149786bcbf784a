"""The greedy rule of the heuristic planner: a string from start to target, pushed to one side of what it meets.

Paper B ("Modified obstacle-avoiding shortest path approach"): tangents and arcs around unions of circles, on a given
side of the straight line; where the string would be non-smooth or cross itself, the tangent across the outer circles
replaces it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.heuristic_planner.disc_unions import Labels, label_cluster
from clearway.navigators.hp_tmpc.heuristic_planner.pieces import put
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import (
    first_on_arc,
    first_on_segment,
    segment_clear,
    segment_enters,
    sweep,
    tangent,
)

MOST_CIRCLES = 160
"""A string of more circles is given up."""

REACH = 12
"""A shortcut skips fewer circles than this."""


@kernel
def greedy_string(
    sx: float,
    sy: float,
    tx: float,
    ty: float,
    discs: FloatArray,
    side: int,
    nearer: bool,
    labels: Labels,
    stack: Labels,
) -> tuple[bool, bool, FloatArray]:
    """(whether the path is free, whether `nearer` makes a difference, string (m, 3)) from s to t.

    The first cluster of overlapping discs that the straight line meets is passed on `side` (1: left of it, -1: right);
    those that come up later on the same side, or (`nearer`) each on the side to which it reaches less far. Each time
    a piece of the string enters a disc, the cluster's disc that sticks out farthest to that side joins the string
    there, and circles that the string no longer bends around leave it.

    Args:
        sx: x of s, a free point, m.
        sy: y of s, m.
        tx: x of t, a free point, m.
        ty: y of t, m.
        discs: (n, 3) x, y, radius [m].
        side: 1 or -1, as above.
        nearer: As above.
        labels: (n,) cluster of each disc, -1 unknown; filled on the way, to be handed to the next call.
        stack: (n,) scratch.
    """
    string = np.empty((MOST_CIRCLES, 3))
    identity = np.full(MOST_CIRCLES, -1, np.int64)
    line = np.empty((MOST_CIRCLES, 3))  # u_x, u_y, length of the tangent from circle k to k + 1
    clear = np.zeros((MOST_CIRCLES, 2), np.bool_)  # the tangent after circle k; the arc on it
    sides = np.zeros(len(discs) + 2, np.int64)  # by cluster; then whether one was met, whether `nearer` matters
    put(string, 0, sx, sy, 0.0)
    put(string, 1, tx, ty, 0.0)
    m: Any = np.int64(2)  # not literals: fewer specialisations to compile
    k: Any = np.int64(0)
    _tie(k, string, line, clear)
    for _ in range(4 * min(len(discs), MOST_CIRCLES) + 16):
        hit, place = -1, 0
        while k < m - 1 and hit < 0:  # everything before circle k is clear
            if k > 0 and not clear[k, 1]:
                r = string[k, 2]
                ux, uy = line[k - 1, 0], line[k - 1, 1]
                turn = sweep(ux, uy, line[k, 0], line[k, 1], r)
                x, y = string[k, 0] + r * uy, string[k, 1] - r * ux
                hit, _ = first_on_arc(string[k, 0], string[k, 1], r, x, y, turn, discs, identity[k])
                if hit >= 0:
                    place = k + 1
                    break
                clear[k, 1] = True
            if not clear[k, 0]:
                hit, place = _outermost(k, string, identity, line, discs, side, nearer, labels, stack, sides)
                if hit >= 0:
                    break
                clear[k, 0] = True
            k += 1
        if hit < 0:
            m = _shorten(string, identity, line, clear, discs, m)
            return True, sides[-1] != 0, string[:m].copy()
        if m == MOST_CIRCLES:
            break
        way = sides[labels[hit]]
        m = _insert(place, discs[hit], hit, way, string, identity, line, clear, m)
        m, place = _tighten(place, string, identity, line, clear, m)
        if m < 0:
            break
        k = max(0, place - 2)
    return False, sides[-1] != 0, string[:0].copy()


@kernel
def _tie(k: int, string: FloatArray, line: FloatArray, clear: Any) -> bool:
    """Lay the tangent from circle k to k + 1; False if there is none."""
    exists, ux, uy, length = tangent(
        string[k, 0], string[k, 1], string[k, 2], string[k + 1, 0], string[k + 1, 1], string[k + 1, 2]
    )
    line[k, 0], line[k, 1], line[k, 2] = ux, uy, length
    clear[k, 0], clear[k, 1], clear[k + 1, 1] = False, False, False
    return exists


@kernel
def _outermost(
    k: int, string: FloatArray, identity: Labels, line: FloatArray, discs: FloatArray, side: int, nearer: bool,
    labels: Labels, stack: Labels, sides: Labels,
) -> tuple[int, int]:  # fmt: skip
    """(disc, place in the string) of what the tangent after circle k has to be pushed around; (-1, ...): it is clear."""
    ux, uy, length = line[k, 0], line[k, 1], line[k, 2]
    ax, ay = string[k, 0] + string[k, 2] * uy, string[k, 1] - string[k, 2] * ux
    first, _ = first_on_segment(ax, ay, ux, uy, length, discs, identity[k], identity[k + 1])
    if first < 0:
        return -1, k + 1
    if labels[first] < 0:
        label_cluster(first, first, discs, labels, stack)
    cluster = labels[first]
    if sides[cluster] == 0:
        sides[cluster] = side
        if sides[-2] == 0:
            sides[-2] = 1
        else:
            left, right = -math.inf, -math.inf
            for j in range(len(discs)):
                if labels[j] == cluster:
                    offset = ux * (discs[j, 1] - ay) - uy * (discs[j, 0] - ax)
                    left, right = max(left, offset + discs[j, 2]), max(right, discs[j, 2] - offset)
            if (side > 0 and right < left) or (side < 0 and left < right):
                sides[-1] = 1
                if nearer:
                    sides[cluster] = -side
    way = sides[cluster]
    chosen, most = first, -math.inf
    for j in range(len(discs)):
        if labels[j] != cluster or j == identity[k] or j == identity[k + 1]:
            continue
        if segment_enters(ax, ay, ux, uy, length, discs[j, 0], discs[j, 1], discs[j, 2]) < math.inf:
            out = way * (ux * (discs[j, 1] - ay) - uy * (discs[j, 0] - ax)) + discs[j, 2]
            if out > most:
                chosen, most = j, out
    return chosen, k + 1


@kernel
def _move(a: int, b: int, string: FloatArray, identity: Labels, line: FloatArray, clear: Any) -> None:
    """Circle a, and the tangent after it, becomes number b."""
    for i in range(3):
        string[b, i], line[b, i] = string[a, i], line[a, i]
    identity[b], clear[b, 0], clear[b, 1] = identity[a], clear[a, 0], clear[a, 1]


@kernel
def _insert(
    place: int, disc: FloatArray, which: int, way: int, string: FloatArray, identity: Labels, line: FloatArray,
    clear: Any, m: int,
) -> int:  # fmt: skip
    for i in range(m, place, -1):
        _move(i - 1, i, string, identity, line, clear)
    put(string, place, disc[0], disc[1], -way * disc[2])
    identity[place] = which
    return m + 1


@kernel
def _remove(place: int, string: FloatArray, identity: Labels, line: FloatArray, clear: Any, m: int) -> int:
    for i in range(place, m - 1):
        _move(i + 1, i, string, identity, line, clear)
    return m - 1


@kernel
def _tighten(place: int, string: FloatArray, identity: Labels, line: FloatArray, clear: Any, m: int) -> tuple[int, int]:
    """(circles left, place) after new tangents around `place`, and without the circles that the string left."""
    laid = _tie(place - 1, string, line, clear)
    laid = _tie(place, string, line, clear) and laid
    for _ in range(2 * MOST_CIRCLES):
        away = -1
        if not laid:  # one circle lies inside the other, or two that overlap are passed on different sides
            laid = True
            for i in range(max(0, place - 2), min(m - 1, place + 2)):
                if not _tie(i, string, line, clear):
                    laid = False
                    away = i if abs(string[i, 2]) < abs(string[i + 1, 2]) else i + 1
                    away = 1 if away == 0 else m - 2 if away == m - 1 else away
                    break
        if laid:
            for i in (place - 1, place + 1, place):
                if 0 < i < m - 1 and _slack(i, string, line):
                    away = i
                    break
        if away < 0:
            return m, max(1, place)
        if m <= 2 or not 0 < away < m - 1:
            return -1, 0
        m = _remove(away, string, identity, line, clear, m)
        laid = _tie(away - 1, string, line, clear) and laid
        place = away if away < place or away == m - 1 else away - 1
        place = min(max(place, 1), max(m - 2, 1))
    return -1, 0


@kernel
def _slack(k: int, string: FloatArray, line: FloatArray) -> bool:
    """Whether the string does not bend around circle k in its direction, or crosses itself there."""
    r = string[k, 2]
    ux, uy, vx, vy = line[k - 1, 0], line[k - 1, 1], line[k, 0], line[k, 1]
    turn = sweep(ux, uy, vx, vy, r)
    if turn <= math.pi:
        return False
    if turn > 1.5 * math.pi:
        return True
    beyond = -abs(r) * math.tan(0.5 * turn)  # from the touching points back to where the two lines cross
    return bool(beyond <= min(line[k - 1, 2], line[k, 2]))


@kernel
def _shorten(string: FloatArray, identity: Labels, line: FloatArray, clear: Any, discs: FloatArray, m: int) -> int:
    """Tangents across the outer circles wherever they are clear: how many circles are left."""
    i: Any = np.int64(0)
    while i < m - 2:
        for j in range(min(m - 1, i + REACH), i + 1, -1):
            if _across(i, j, string, identity, line, discs, m):
                gone = j - i - 1
                for k in range(j, m):
                    _move(k, k - gone, string, identity, line, clear)
                m -= gone
                _tie(i, string, line, clear)
                break
        i += 1
    return m


@kernel
def _across(i: int, j: int, string: FloatArray, identity: Labels, line: FloatArray, discs: FloatArray, m: int) -> bool:
    """Whether the tangent from circle i straight to circle j is clear, with its arcs, and shorter."""
    exists, ux, uy, length = tangent(string[i, 0], string[i, 1], string[i, 2], string[j, 0], string[j, 1], string[j, 2])
    if not exists:
        return False
    rest, was = length, 0.0
    for k in range(i, j):
        was += line[k, 2]
        if k > i:
            was += abs(string[k, 2]) * sweep(line[k - 1, 0], line[k - 1, 1], line[k, 0], line[k, 1], string[k, 2])
    for k in (i, j):
        if 0 < k < m - 1:
            r = string[k, 2]
            px, py, qx, qy = line[k - 1, 0], line[k - 1, 1], line[k, 0], line[k, 1]
            was += abs(r) * sweep(px, py, qx, qy, r)
            turn = sweep(px, py, ux, uy, r) if k == i else sweep(ux, uy, qx, qy, r)
            rest += abs(r) * turn
            wx, wy = (px, py) if k == i else (ux, uy)
            x, y = string[k, 0] + r * wy, string[k, 1] - r * wx
            hit, _ = first_on_arc(string[k, 0], string[k, 1], r, x, y, turn, discs, identity[k])
            if hit >= 0:
                return False
    if rest >= was - 1e-12:
        return False
    ax, ay = string[i, 0] + string[i, 2] * uy, string[i, 1] - string[i, 2] * ux
    return segment_clear(ax, ay, ux, uy, length, discs, identity[i], identity[j])
