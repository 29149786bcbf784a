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
from clearway.navigators.hp_tmpc.heuristic_planner.disc_unions import within
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import TOUCH, arc_leaves, sweep, tangent

NOTHING = 1e-12
"""Pieces shorter than this [m] are left out."""


@kernel
def put(rows: FloatArray, i: int, x: float, y: float, r: float) -> None:
    """Write a row of a string (slice assignments cost much compile time)."""
    rows[i, 0], rows[i, 1], rows[i, 2] = x, y, r


@kernel
def string_of(ax: float, ay: float, bx: float, by: float) -> FloatArray:
    """(2, 3) the string straight from a to b."""
    string = np.zeros((2, 3))
    put(string, 0, ax, ay, 0.0)
    put(string, 1, bx, by, 0.0)
    return string


@kernel
def string_pieces(string: FloatArray) -> FloatArray:
    """(k, 7) the pieces of the path along a string whose tangents exist."""
    m = len(string)
    rows = np.zeros((2 * m, 7))
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
                _write(rows, k, tx, ty, fx, fy)
                rows[k, 4], rows[k, 5], rows[k, 6] = cx, cy, turn if r > 0.0 else -turn
                k += 1
        tx = string[i + 1, 0] + string[i + 1, 2] * vy
        ty = string[i + 1, 1] - string[i + 1, 2] * vx
        if length > NOTHING:
            _write(rows, k, fx, fy, tx, ty)
            k += 1
        ux, uy = vx, vy
    return rows[:k].copy()


@kernel
def _write(rows: FloatArray, k: int, x0: float, y0: float, x1: float, y1: float) -> None:
    rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = x0, y0, x1, y1


@kernel
def with_lead(ax: float, ay: float, bx: float, by: float, pieces: FloatArray) -> FloatArray:
    """The pieces after a straight one from a to b, if these differ."""
    if math.hypot(bx - ax, by - ay) <= NOTHING:
        return pieces
    rows = np.zeros((len(pieces) + 1, 7))
    _write(rows, 0, ax, ay, bx, by)
    for k in range(len(pieces)):
        for i in range(7):
            rows[k + 1, i] = pieces[k, i]
    return rows


@kernel
def piece_length(piece: FloatArray) -> float:
    """m, of one row."""
    if piece[6] == 0.0:
        return math.hypot(piece[2] - piece[0], piece[3] - piece[1])
    return math.hypot(piece[0] - piece[4], piece[1] - piece[5]) * abs(float(piece[6]))


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
            points[0, 0], points[0, 1] = pieces[0, 0], pieces[0, 1]
            m = 1
        for i in range(1, chords):
            x, y, _ = point_on(pieces[k], i / chords)
            points[m, 0], points[m, 1] = x, y
            m += 1
        points[m, 0], points[m, 1] = pieces[k, 2], pieces[k, 3]
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
            put(points, i, pose[0], pose[1], pose[2])
        else:
            share = min(1.0, max(0.0, (stations[i] - behind) / length))
            x, y, heading = point_on(pieces[k], share)
            put(points, i, x, y, heading)
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
def cut(pieces: FloatArray, area: FloatArray, zone: FloatArray) -> tuple[bool, FloatArray]:
    """(whether it was cut, pieces) up to where the path first leaves the rectangle or the circle x, y, radius.

    Arcs are looked at every 0.05 rad: an excursion that is shorter goes unseen.
    """
    for k in range(len(pieces)):
        steps = 1 if pieces[k, 6] == 0.0 else max(1, math.ceil(abs(pieces[k, 6]) / 0.05))
        for i in range(1, steps + 1):
            x, y, _ = point_on(pieces[k], i / steps)
            if within(x, y, area, zone):
                continue
            low, high = (i - 1) / steps, i / steps
            for _ in range(50):
                middle = 0.5 * (low + high)
                x, y, _ = point_on(pieces[k], middle)
                if within(x, y, area, zone):
                    low = middle
                else:
                    high = middle
            kept = pieces[: k + 1].copy()
            x, y, _ = point_on(pieces[k], low)
            kept[k, 2], kept[k, 3], kept[k, 6] = x, y, low * pieces[k, 6]
            return True, kept if low > 0.0 and piece_length(kept[k]) > NOTHING else kept[:k].copy()
    return False, pieces
