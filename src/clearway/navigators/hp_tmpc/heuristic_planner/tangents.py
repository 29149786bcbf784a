"""Tangents of circles, arcs, and what keeps clear of discs.

A circle that a path runs along has a signed radius: r > 0 is run counter-clockwise, r < 0 clockwise, and 0 is a point.
So one formula holds for all tangents: from a point to a circle, outer (equal signs) and inner ones (opposite signs).
With u the direction of travel and n = (-u_y, u_x) its left normal, a circle of centre c is touched at c - r n.
Metres and radians throughout; a path clears a disc if it enters it by at most `TOUCH`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clearway.geometry.angles import TURN
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

TOUCH = 1e-9
"""How deep [m] a path may enter a disc by rounding and still count as clear of it."""

NONE: Any = np.int64(-1)
"""No disc, where an index is asked for (not a literal: one specialisation to compile)."""


@kernel
def tangent(ax: float, ay: float, ra: float, bx: float, by: float, rb: float) -> tuple[bool, float, float, float]:
    """(exists, u_x, u_y, length) of the one straight line that leads from circle a (signed radius ra) to circle b.

    With D = b - a: n . D = rb - ra and u . D = length. None exists if one circle lies inside the other (equal signs)
    or they overlap (opposite signs); a point that is inside by rounding only counts as on the circle.
    """
    dx, dy = bx - ax, by - ay
    q = rb - ra
    square = dx * dx + dy * dy
    rest = square - q * q
    if rest <= 0.0:
        if rest < -4.0 * TOUCH * abs(q) or square <= 0.0:
            return square <= 0.0 and q == 0.0, 1.0, 0.0, 0.0
        distance = math.sqrt(square)
        turn = 1.0 if q > 0.0 else -1.0
        return True, turn * dy / distance, -turn * dx / distance, 0.0
    length = math.sqrt(rest)
    return True, (length * dx + q * dy) / square, (length * dy - q * dx) / square, length


@kernel
def sweep(ux: float, uy: float, vx: float, vy: float, r: float) -> float:
    """The turn [0, 2 pi) from heading u to heading v (unit vectors) along a circle of signed radius r."""
    turn = math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)
    if r < 0.0:
        turn = -turn
    if turn < 0.0:
        turn += TURN
        if turn > TURN - 1e-9:  # straight on, up to rounding
            turn = 0.0
    return turn


@kernel
def advance(start: float, end: float, r: float) -> float:
    """The turn [0, 2 pi) from angle `start` to angle `end` in the direction of the signed radius r."""
    turn = (end - start) % TURN if r > 0.0 else (start - end) % TURN
    return 0.0 if turn > TURN - 1e-9 else turn


@kernel
def segment_enters(
    ax: float, ay: float, ux: float, uy: float, length: float, cx: float, cy: float, radius: float
) -> float:
    """How far along the segment from a (unit direction u) the open disc is entered, >= 0; inf: not at all."""
    px, py = cx - ax, cy - ay
    across = ux * py - uy * px
    inner = radius - TOUCH
    rest = inner * inner - across * across
    if rest <= 0.0 or inner <= 0.0:
        return math.inf
    along = px * ux + py * uy
    half = math.sqrt(rest)
    if along + half <= 0.0 or along - half >= length:
        return math.inf
    return max(along - half, 0.0)


@kernel
def arc_enters(
    cx: float, cy: float, r: float, x: float, y: float, turn: float, ox: float, oy: float, radius: float
) -> float:
    """After which turn [rad] the arc enters the open disc (o, radius), >= 0; inf: not at all.

    The arc starts at (x, y) on the circle of centre c, signed radius r, and turns by `turn` >= 0 in r's direction.
    """
    dx, dy = ox - cx, oy - cy
    square = dx * dx + dy * dy
    around = abs(r)
    inner = radius - TOUCH
    if inner <= 0.0 or square >= (around + inner) ** 2 or (around >= inner and square <= (around - inner) ** 2):
        return math.inf
    if square <= (inner - around) ** 2:
        return 0.0  # the whole circle lies inside
    distance = math.sqrt(square)
    half = math.acos(max(-1.0, min(1.0, (around * around + square - inner * inner) / (2.0 * distance * around))))
    middle = advance(math.atan2(y - cy, x - cx), math.atan2(dy, dx), r)
    if middle <= half or middle + half > TURN:  # starts inside
        return 0.0 if min(middle, TURN - middle) < half else math.inf
    return middle - half if middle - half < turn else math.inf


@kernel
def first_on_segment(
    ax: float, ay: float, ux: float, uy: float, length: float, discs: FloatArray, skip_a: int, skip_b: int
) -> tuple[int, float]:
    """(index, metres along) of the disc that the segment enters first; -1: none. Two discs are left out of it."""
    first, where = -1, math.inf
    for j in range(len(discs)):
        if j in (skip_a, skip_b):
            continue
        at = segment_enters(ax, ay, ux, uy, length, discs[j, 0], discs[j, 1], discs[j, 2])
        if at < where:
            first, where = j, at
    return first, where


@kernel
def segment_clear(
    ax: float, ay: float, ux: float, uy: float, length: float, discs: FloatArray, skip_a: int, skip_b: int
) -> bool:
    """Whether the segment enters no disc. Two discs are left out of it."""
    for j in range(len(discs)):
        if (
            segment_enters(ax, ay, ux, uy, length, discs[j, 0], discs[j, 1], discs[j, 2]) < math.inf
            and j != skip_a
            and j != skip_b
        ):
            return False
    return True


@kernel
def first_on_arc(
    cx: float, cy: float, r: float, x: float, y: float, turn: float, discs: FloatArray, skip: int
) -> tuple[int, float]:
    """(index, turn until then) of the disc that the arc enters first; -1: none. One disc is left out of it."""
    first, where = -1, math.inf
    for j in range(len(discs)):
        if j == skip:
            continue
        at = arc_enters(cx, cy, r, x, y, turn, discs[j, 0], discs[j, 1], discs[j, 2])
        if at < where:
            first, where = j, at
    return first, where


@kernel
def arc_leaves(cx: float, cy: float, r: float, x: float, y: float, turn: float, area: FloatArray) -> float:
    """After which turn [rad] the arc (as in `arc_enters`) leaves the rectangle x_min, y_min, x_max, y_max; inf: never."""
    around = abs(r)
    start = math.atan2(y - cy, x - cx)
    soonest = math.inf
    for side in range(4):
        reach = (area[2] - cx, area[3] - cy, cx - area[0], cy - area[1])[side] + TOUCH
        if reach >= around:
            continue
        if reach <= -around:
            return 0.0
        half = math.acos(reach / around)
        middle = advance(start, 0.25 * TURN * side, r)
        if middle < half or middle + half > TURN:
            return 0.0
        if middle - half < min(turn, soonest):
            soonest = middle - half
    return soonest
