"""The heuristic planner among circles that stand still: greedy tangents and arcs on both sides (paper B, "Heuristic planning").

Everything here is a kernel: call it from compiled code, or from Python with float64 C-contiguous arrays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.heuristic_planner.disc_unions import SHUT_OFF, Labels, covered, nearest_free, shut_off
from clearway.navigators.hp_tmpc.heuristic_planner.exact import LESS, NO_WAY, exact_path
from clearway.navigators.hp_tmpc.heuristic_planner.greedy import greedy_string
from clearway.navigators.hp_tmpc.heuristic_planner.pieces import (
    NOTHING,
    cut,
    leaves,
    path_length,
    string_of,
    string_pieces,
    with_lead,
)
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import NONE, first_on_segment

START_COVERED = 1
"""The start lay inside a disc: the path begins with a straight line to the nearest free point."""
TARGET_COVERED = 2
"""The target lay inside a disc: the path ends at the nearest free point."""
UNREACHABLE = 4
"""The discs shut the target off: the path ends at the reachable point nearest to it."""
FALLBACK = 8
"""The greedy rule did not come to an end; the tangent graph answered."""
NO_PATH = 16
"""Nothing was found: the path is what the straight line allows before it meets a disc (possibly only the start)."""
LIMITED = 32
"""`exact`: more discs than the graph may hold mattered; the path is free, but may not be the shortest."""
OUTSIDE = 64
"""Every path left `area`: the shortest was cut where it leaves."""
CUT = 128
"""The path left the perception field and was cut at its rim."""
TEMPORARY = 256
"""The goal lies beyond the perception field: the path leads to a temporary target on its rim."""
BELT_LIMIT = 512
"""Belts still grew after the last iteration: the path may meet a predicted disc in time."""


class Path(NamedTuple):
    """A path of straight pieces and arcs.

    Attributes:
        status: Sum of the flags above, 0: all is well.
        pieces: (k, 7) x0, y0, x1, y1 [m], centre x, y [m], turn [rad] (> 0 counter-clockwise; 0: straight).
        length: Exact length, m.
        side: 1 passes the first obstacle on its left (as seen from the start), -1 on its right, 0 goes straight.
        other: (k2, 7) the best path of the other side; empty if there is none. From a covered start or to a covered target it
            may go round discs so as to cross itself.
    """

    status: int
    pieces: FloatArray
    length: float
    side: int
    other: FloatArray


@kernel
def plan_path(
    start: FloatArray,
    target: FloatArray,
    discs: FloatArray,
    area: FloatArray,
    zone: FloatArray,
    draw: float,
    exact: bool,
    keep: float,
) -> Path:
    """The shorter of the greedy paths on both sides of the straight line, clear of all discs (within 1e-9 m).

    Args:
        start: (2,) m (more columns are ignored).
        target: (2,) m (more columns are ignored).
        discs: (n, 3) x, y, inflated radius [m], none NaN.
        area: (4,) x_min, y_min, x_max, y_max that the path must keep to; infinite: none.
        zone: (3,) x, y, radius of the perception field: a covered target moves to a point inside of it, and a path that
            leaves it is cut there; infinite radius: none.
        draw: In [0, 1): decides between paths of the same length (left below one half).
        exact: The tangent visibility graph instead of the greedy rule.
        keep: In (-1, 1), the share by which the right side (< 0: the left) has to be shorter to be preferred.
    """
    status = 0
    sx, sy, tx, ty = start[0], start[1], target[0], target[1]
    nowhere = np.zeros((0, 7))
    if covered(sx, sy, discs):
        status |= START_COVERED
        found, sx, sy = nearest_free(sx, sy, discs, area, np.array([sx, sy, np.inf]))
        if not found:
            return Path(status | NO_PATH, nowhere, 0.0, 0, nowhere)
    if covered(tx, ty, discs):
        status |= TARGET_COVERED
        found, tx, ty = nearest_free(tx, ty, discs, area, zone)
        if not found:
            found, tx, ty = nearest_free(tx, ty, discs, area, np.array([tx, ty, np.inf]))
        if not found:
            return Path(status | NO_PATH, with_lead(start[0], start[1], sx, sy, nowhere), 0.0, 0, nowhere)
    labels, stack = np.full(len(discs), -1, np.int64), np.empty(len(discs), np.int64)
    pieces, other, side = nowhere, nowhere, 0
    for thorough in (False, True):
        more, pieces, other, side = _between(sx, sy, tx, ty, discs, area, draw, exact, keep, thorough, labels, stack)
        if more & NO_PATH and not thorough:
            where, bx, by = shut_off(sx, sy, tx, ty, target[0], target[1], discs, area, zone)
            if where == SHUT_OFF:
                status |= UNREACHABLE
                tx, ty = bx, by
            continue
        status |= more
        break
    if status & NO_PATH:
        pieces = _as_far(sx, sy, tx, ty, discs)
    pieces, other = with_lead(start[0], start[1], sx, sy, pieces), with_lead(start[0], start[1], sx, sy, other)
    was_cut, pieces = cut(pieces, area, np.array([0.0, 0.0, np.inf]))
    if was_cut:
        status |= OUTSIDE
    was_cut, pieces = cut(pieces, area, zone)
    if was_cut:
        status |= CUT
    return Path(status, pieces, path_length(pieces), side, other)


@kernel
def _between(
    sx: float, sy: float, tx: float, ty: float, discs: FloatArray, area: FloatArray, draw: float, exact: bool, keep: float,
    thorough: bool, labels: Labels, stack: Labels,
) -> tuple[int, FloatArray, FloatArray, int]:  # fmt: skip
    """(flags, pieces, pieces of the other side, side) between two free points.

    Where the greedy rule fails on one side, the tangent graph answers (bounded by the other side's path, so quickly);
    where it fails on both, only if `thorough`.
    """
    nowhere = np.zeros((0, 7))
    distance = math.hypot(tx - sx, ty - sy)
    if distance <= NOTHING:
        return 0, nowhere, nowhere, 0
    hit, _ = first_on_segment(sx, sy, (tx - sx) / distance, (ty - sy) / distance, distance, discs, NONE, NONE)
    if hit < 0:
        return 0, string_pieces(string_of(sx, sy, tx, ty)), nowhere, 0
    left, left_length, left_inside = nowhere, math.inf, False
    right, right_length, right_inside = nowhere, math.inf, False
    for way in (1, -1):
        path, length, inside = _side(sx, sy, tx, ty, discs, area, way, labels, stack)
        if way > 0:
            left, left_length, left_inside = path, length, inside
        else:
            right, right_length, right_inside = path, length, inside
    best, other, length, side = left, right, left_length, 1
    to_left = draw < 0.5 if abs(left_length - right_length) <= 1e-9 else left_length < right_length
    if keep > 0.0:
        to_left = left_length * (1.0 - keep) <= right_length
    elif keep < 0.0:
        to_left = left_length < right_length * (1.0 + keep)
    if left_inside != right_inside:
        to_left = left_inside
    if not to_left:
        best, other, length, side = right, left, right_length, -1
    inside = left_inside or right_inside
    if length == math.inf and not thorough:
        return NO_PATH, nowhere, nowhere, 0
    if exact or not inside or math.isinf(left_length) or math.isinf(right_length):
        found, path = exact_path(np.array([sx, sy]), np.array([tx, ty]), discs, area, length if inside else math.inf)
        if found != NO_WAY and not (inside and path_length(path) > length):
            flags = (0 if exact else FALLBACK) | (LIMITED if found == LESS else 0)
            return flags, path, other, _side_of(path)
    if length == math.inf:
        return NO_PATH, nowhere, nowhere, 0
    return 0, best, other, side


@kernel
def _side(
    sx: float,
    sy: float,
    tx: float,
    ty: float,
    discs: FloatArray,
    area: FloatArray,
    side: int,
    labels: Labels,
    stack: Labels,
) -> tuple[FloatArray, float, bool]:
    """(pieces, length, whether it keeps to the area) of the better greedy path on one side; inf: none."""
    pieces, length, inside = np.zeros((0, 7)), math.inf, False
    for nearer in (False, True):
        free, matters, string = greedy_string(sx, sy, tx, ty, discs, side, nearer, labels, stack)
        if free:
            path = string_pieces(string)
            total, keeps = path_length(path), not leaves(path, area)
            if (keeps and not inside) or (keeps == inside and total < length):
                pieces, length, inside = path, total, keeps
        if not matters:
            break
    return pieces, length, inside


@kernel
def _side_of(pieces: FloatArray) -> int:
    """1 if the path's first arc leaves its obstacle on the right, -1 on the left, 0 without arcs."""
    for k in range(len(pieces)):
        if pieces[k, 6] != 0.0:
            return 1 if pieces[k, 6] < 0.0 else -1
    return 0


@kernel
def _as_far(sx: float, sy: float, tx: float, ty: float, discs: FloatArray) -> FloatArray:
    """What the straight line allows."""
    distance = math.hypot(tx - sx, ty - sy)
    ux, uy = (tx - sx) / distance, (ty - sy) / distance
    _, where = first_on_segment(sx, sy, ux, uy, distance, discs, NONE, NONE)
    where = min(where, distance)
    return string_pieces(string_of(sx, sy, sx + where * ux, sy + where * uy))
