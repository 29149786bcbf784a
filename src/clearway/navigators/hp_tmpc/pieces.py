"""Paths of straight pieces and arcs: made from a string of circles, measured, cut, sampled.

A piece is a row of 7: x0, y0, x1, y1 [m], centre x, y [m], turn [rad] (> 0 counter-clockwise, 0: straight).
A string is (m, 3) x, y, signed radius of the circles that a path runs along (see `geometry.tangents`); its two ends
are points. It determines the path: tangents from each to the next, arcs between them.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.tangents import TOUCH, arc_leaves, sweep, tangent

NOTHING = 1e-12
"""Pieces shorter than this [m] are left out."""


@kernel
def string_pieces(string: FloatArray) -> FloatArray:
    """(k, 7) the pieces of the path along a string whose tangents exist."""
    m = len(string)
    rows = np.empty((2 * m, 7))
    k = 0
    ux, uy = 0.0, 0.0
    tx, ty = string[0, 0], string[0, 1]  # where the path is
    for i in range(m - 1):
        cx, cy, r = string[i, 0], string[i, 1], string[i, 2]
        _, vx, vy, length = tangent(cx, cy, r, string[i + 1, 0], string[i + 1, 1], string[i + 1, 2])
        fx, fy = cx + r * vy, cy - r * vx
        if i > 0:
            turn = sweep(ux, uy, vx, vy, r)
            if turn * abs(r) > NOTHING:
                rows[k] = (tx, ty, fx, fy, cx, cy, turn if r > 0.0 else -turn)
                k += 1
        tx = string[i + 1, 0] + string[i + 1, 2] * vy
        ty = string[i + 1, 1] - string[i + 1, 2] * vx
        if length > NOTHING:
            rows[k] = (fx, fy, tx, ty, 0.0, 0.0, 0.0)
            k += 1
        ux, uy = vx, vy
    return rows[:k].copy()


@kernel
def string_length(string: FloatArray, m: int) -> float:
    """Length [m] of the path along the first m circles of a string; inf if a tangent does not exist."""
    total, ux, uy = 0.0, 0.0, 0.0
    for i in range(m - 1):
        r = string[i, 2]
        exists, vx, vy, length = tangent(
            string[i, 0], string[i, 1], r, string[i + 1, 0], string[i + 1, 1], string[i + 1, 2]
        )
        if not exists:
            return math.inf
        total += length
        if i > 0:
            total += abs(r) * sweep(ux, uy, vx, vy, r)
        ux, uy = vx, vy
    return total


@kernel
def piece_length(piece: FloatArray) -> float:
    """m, of one row."""
    if piece[6] == 0.0:
        return math.hypot(piece[2] - piece[0], piece[3] - piece[1])
    return abs(piece[6]) * math.hypot(piece[0] - piece[4], piece[1] - piece[5])


@kernel
def path_length(pieces: FloatArray) -> float:
    """m, of all rows."""
    total = 0.0
    for k in range(len(pieces)):
        total += piece_length(pieces[k])
    return total


@kernel
def point_on(piece: FloatArray, share: float) -> tuple[float, float, float]:
    """(x, y, heading) after a share, 0 to 1, of a piece."""
    if piece[6] == 0.0:
        dx, dy = piece[2] - piece[0], piece[3] - piece[1]
        return piece[0] + share * dx, piece[1] + share * dy, math.atan2(dy, dx)
    dx, dy = piece[0] - piece[4], piece[1] - piece[5]
    c, s = math.cos(share * piece[6]), math.sin(share * piece[6])
    rx, ry = c * dx - s * dy, s * dx + c * dy
    return piece[4] + rx, piece[5] + ry, math.atan2(rx, -ry) if piece[6] > 0.0 else math.atan2(-rx, ry)


@kernel
def polyline(pieces: FloatArray, spacing: float) -> FloatArray:
    """(m, 2) the path's corners, and points on its arcs at most `spacing` [m] apart along them."""
    count = 1
    for k in range(len(pieces)):
        count += _chords(pieces[k], spacing)
    points = np.empty((count if len(pieces) > 0 else 0, 2))
    m = 0
    for k in range(len(pieces)):
        chords = _chords(pieces[k], spacing)
        if k == 0:
            points[0] = pieces[0, :2]
            m = 1
        for i in range(1, chords):
            x, y, _ = point_on(pieces[k], i / chords)
            points[m, 0], points[m, 1] = x, y
            m += 1
        points[m] = pieces[k, 2:4]
        m += 1
    return points


@kernel
def _chords(piece: FloatArray, spacing: float) -> int:
    return 1 if piece[6] == 0.0 else max(1, math.ceil(piece_length(piece) / spacing))


@kernel
def sample(pieces: FloatArray, stations: FloatArray, pose: FloatArray) -> FloatArray:
    """(m, 3) x, y, direction of travel at `stations` [m along the path, ascending]; beyond the end: the end.

    Where the path has no pieces the answer is `pose`, (3,).
    """
    points = np.empty((len(stations), 3))
    k, behind = 0, 0.0
    length = piece_length(pieces[0]) if len(pieces) > 0 else 0.0
    for i in range(len(stations)):
        while k + 1 < len(pieces) and stations[i] > behind + length:
            behind += length
            k += 1
            length = piece_length(pieces[k])
        if len(pieces) == 0:
            points[i] = pose[:3]
        else:
            share = min(1.0, max(0.0, (stations[i] - behind) / length))
            x, y, heading = point_on(pieces[k], share)
            points[i, 0], points[i, 1], points[i, 2] = x, y, heading
    return points


@kernel
def leaves(pieces: FloatArray, area: FloatArray) -> bool:
    """Whether the path leaves the rectangle x_min, y_min, x_max, y_max."""
    for k in range(len(pieces)):
        x, y, turn = pieces[k, 2], pieces[k, 3], pieces[k, 6]
        if not (area[0] - TOUCH <= x <= area[2] + TOUCH and area[1] - TOUCH <= y <= area[3] + TOUCH):
            return True
        if turn != 0.0:
            cx, cy = pieces[k, 4], pieces[k, 5]
            r = math.copysign(math.hypot(pieces[k, 0] - cx, pieces[k, 1] - cy), turn)
            if arc_leaves(cx, cy, r, pieces[k, 0], pieces[k, 1], abs(turn), area) < math.inf:
                return True
    return False


@kernel
def _kept(x: float, y: float, area: FloatArray, zone: FloatArray) -> bool:
    if not (area[0] - TOUCH <= x <= area[2] + TOUCH and area[1] - TOUCH <= y <= area[3] + TOUCH):
        return False
    return (x - zone[0]) ** 2 + (y - zone[1]) ** 2 <= (zone[2] + TOUCH) ** 2


@kernel
def cut(pieces: FloatArray, area: FloatArray, zone: FloatArray) -> tuple[bool, FloatArray]:
    """(whether it was cut, pieces) up to where the path first leaves the rectangle or the circle x, y, radius.

    Arcs are looked at every 0.05 rad: an excursion that is shorter goes unseen.
    """
    for k in range(len(pieces)):
        steps = 1 if pieces[k, 6] == 0.0 else max(1, math.ceil(abs(pieces[k, 6]) / 0.05))
        for i in range(1, steps + 1):
            x, y, _ = point_on(pieces[k], i / steps)
            if _kept(x, y, area, zone):
                continue
            low, high = (i - 1) / steps, i / steps
            for _ in range(50):
                middle = 0.5 * (low + high)
                x, y, _ = point_on(pieces[k], middle)
                if _kept(x, y, area, zone):
                    low = middle
                else:
                    high = middle
            kept = pieces[: k + 1].copy()
            x, y, _ = point_on(pieces[k], low)
            kept[k, 2], kept[k, 3], kept[k, 6] = x, y, low * pieces[k, 6]
            return True, kept if low > 0.0 and piece_length(kept[k]) > NOTHING else kept[:k].copy()
    return False, pieces
