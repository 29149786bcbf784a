"""Shortest paths of a car that drives forwards only (L. E. Dubins 1957), and how far along such a path leads.

A path is a row of at most five pieces of curvature +1 (left), 0 or -1 (right): lengths are in turning radii, negative
backwards. The six words by the formulas of Shkel and Lumelsky, "Classification of the Dubins set", 2001.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from clearway.geometry.angles import TURN
from clearway.geometry.compiled import kernel, light

_NEARLY = 1e-7
"""An arc this much short of a full turn is none, rad: rounding must not make a loop of a straight line."""


class Pieces(NamedTuple):
    """A path's pieces, one after another, in turning radii; of five, those that a path has not are 0 long.

    Attributes:
        first: Signed length of the first piece.
        second: Of the second.
        third: Of the third.
        fourth: Of the fourth.
        fifth: Of the fifth.
        turn_first: Curvature of the first piece: 1 left, 0 straight on, -1 right.
        turn_second: Of the second.
        turn_third: Of the third.
        turn_fourth: Of the fourth.
        turn_fifth: Of the fifth.
    """

    first: float
    second: float
    third: float
    fourth: float
    fifth: float
    turn_first: float
    turn_second: float
    turn_third: float
    turn_fourth: float
    turn_fifth: float


@kernel
def relative(from_x: float, from_y: float, from_yaw: float, x: float, y: float, yaw: float, radius: float) -> Any:
    """A pose seen from another one, in turning radii: (x, y, yaw)."""
    c, s = math.cos(from_yaw), math.sin(from_yaw)
    dx, dy = (x - from_x) / radius, (y - from_y) / radius
    return c * dx + s * dy, c * dy - s * dx, yaw - from_yaw


@light
def length(pieces: Pieces) -> float:
    """Length of a path, in turning radii."""
    return abs(pieces.first) + abs(pieces.second) + abs(pieces.third) + abs(pieces.fourth) + abs(pieces.fifth)


@light
def changes(pieces: Pieces) -> int:
    """How often a path goes from forwards to backwards or back."""
    count, last = 0, 0.0
    for piece in (pieces.first, pieces.second, pieces.third, pieces.fourth, pieces.fifth):
        if piece != 0.0:
            if last * piece < 0:
                count += 1
            last = piece
    return count


@kernel
def _piece(x: float, y: float, yaw: float, piece: float, turn: float, left: float) -> Any:
    """The pose after a piece, or after the part of it that `left` allows, and what is left."""
    driven = max(-left, piece) if piece < 0 else min(left, piece)
    if turn == 0:
        x, y = x + driven * math.cos(yaw), y + driven * math.sin(yaw)
    else:
        after = yaw + turn * driven
        x += turn * (math.sin(after) - math.sin(yaw))
        y += turn * (math.cos(yaw) - math.cos(after))
        yaw = after
    return x, y, yaw, left - abs(driven)


@kernel
def along(pieces: Pieces, distance: float) -> Any:
    """Where the path that begins at the origin is after `distance`, all in turning radii: (x, y, yaw), yaw unwrapped."""
    x, y, yaw, left = _piece(0.0, 0.0, 0.0, pieces.first, pieces.turn_first, distance)
    if left > 0:
        x, y, yaw, left = _piece(x, y, yaw, pieces.second, pieces.turn_second, left)
    if left > 0:
        x, y, yaw, left = _piece(x, y, yaw, pieces.third, pieces.turn_third, left)
    if left > 0:
        x, y, yaw, left = _piece(x, y, yaw, pieces.fourth, pieces.turn_fourth, left)
    if left > 0:
        x, y, yaw, left = _piece(x, y, yaw, pieces.fifth, pieces.turn_fifth, left)
    return x, y, yaw


@light
def _arc(angle: float) -> float:
    """An angle as an arc in [0, 2 pi)."""
    angle -= TURN * math.floor(angle / TURN)
    return 0.0 if TURN - angle < _NEARLY else angle


@kernel
def dubins(x: float, y: float, yaw: float) -> Pieces:
    """The shortest path forwards from the origin, facing +x, to a pose, in turning radii."""
    d = math.hypot(x, y)
    bearing = math.atan2(y, x)
    alpha, beta = -bearing, yaw - bearing
    sa, ca, sb, cb = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
    same = ca * cb + sa * sb  # cosine of the difference
    best, one, middle, two, a, b, c = math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0

    square = 2 + d * d - 2 * (same - d * (sa - sb))  # left, straight, left
    if square >= 0:
        theta = math.atan2(cb - ca, d + sa - sb)
        t, p, q = _arc(theta - alpha), math.sqrt(square), _arc(beta - theta)
        if t + p + q < best:
            best, one, middle, two, a, b, c = t + p + q, t, p, q, 1.0, 0.0, 1.0
    square = 2 + d * d - 2 * (same - d * (sb - sa))  # right, straight, right
    if square >= 0:
        theta = math.atan2(ca - cb, d - sa + sb)
        t, p, q = _arc(alpha - theta), math.sqrt(square), _arc(theta - beta)
        if t + p + q < best:
            best, one, middle, two, a, b, c = t + p + q, t, p, q, -1.0, 0.0, -1.0
    square = d * d - 2 + 2 * (same - d * (sa + sb))  # right, straight, left
    if square >= 0:
        p = math.sqrt(square)
        theta = math.atan2(ca + cb, d - sa - sb) - math.atan2(2.0, p)
        t, q = _arc(alpha - theta), _arc(beta - theta)
        if t + p + q < best:
            best, one, middle, two, a, b, c = t + p + q, t, p, q, -1.0, 0.0, 1.0
    square = d * d - 2 + 2 * (same + d * (sa + sb))  # left, straight, right
    if square >= 0:
        p = math.sqrt(square)
        theta = math.atan2(-ca - cb, d + sa + sb) - math.atan2(-2.0, p)
        t, q = _arc(theta - alpha), _arc(theta - beta)
        if t + p + q < best:
            best, one, middle, two, a, b, c = t + p + q, t, p, q, 1.0, 0.0, -1.0
    cosine = 0.125 * (6 - d * d + 2 * (same + d * (sa - sb)))  # right, left, right
    if abs(cosine) < 1:
        p = TURN - math.acos(cosine)
        t = _arc(alpha - math.atan2(ca - cb, d - sa + sb) + 0.5 * p)
        q = _arc(alpha - beta - t + p)
        if t + p + q < best:
            best, one, middle, two, a, b, c = t + p + q, t, p, q, -1.0, 1.0, -1.0
    cosine = 0.125 * (6 - d * d + 2 * (same - d * (sa - sb)))  # left, right, left
    if abs(cosine) < 1:
        p = TURN - math.acos(cosine)
        t = _arc(-alpha + math.atan2(cb - ca, d + sa - sb) + 0.5 * p)
        q = _arc(beta - alpha - t + p)
        if t + p + q < best:
            best, one, middle, two, a, b, c = t + p + q, t, p, q, 1.0, -1.0, 1.0
    return Pieces(one, middle, two, 0.0, 0.0, a, b, c, 0.0, 0.0)
