"""Ways to a place on a floor: a grid of distances to it, and the point that somebody heads for now.

The distance is that of the eikonal equation, solved by fast sweeping (Zhao 2005), where a metre near a wall counts more: so
ways keep off walls where there is room and pass doors in the middle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.grid import FREE, OccupancyGrid
from clearway.geometry.shapes import FloatArray

DETOUR = 3.0
"""A metre that touches a wall counts so much more, falling to nothing over `COMFORT`."""
COMFORT = 0.5
"""Room beyond the own radius that is wanted, m."""
SQUEEZE = 50.0
"""A metre where there is less room than the radius counts so much: whoever is there is led out, and nobody in."""
STRAIGHT = 1.1
"""How much longer than straight a way may be, by walls along it or by the grid, and the straight one is taken."""
ASTRAY = 0.5
"""Whoever is found so far inside a wall is led out, m."""
_ROUNDS = 200


class Room(NamedTuple):
    """Where there is how much room.

    Attributes:
        clearance: (rows, columns) from a cell's centre to the nearest one that is not free, m; 0: it is none itself.
        origin: (2,) corner of cell (0, 0), m.
        resolution: Edge of a cell, m.
        told: Up to which all of it is told, m: a greater clearance may be less.
    """

    clearance: FloatArray
    origin: FloatArray
    resolution: float
    told: float = math.inf


class Ways(NamedTuple):
    """How far it is to a place from everywhere.

    Attributes:
        distance: (rows, columns) from a cell's centre, m; inf: there is no way.
        room: Where they lead.
        goal: (2,) m.
        radius: Of who goes there, m.
    """

    distance: FloatArray
    room: Room
    goal: FloatArray
    radius: float


def room_of(grid: OccupancyGrid, cell: float = 0.1) -> Room:
    """The room on a map, told at every few of its cells, about `cell` [m] apart; what is unknown is not free."""
    from scipy.ndimage import distance_transform_edt

    h = grid.resolution
    every = max(min(round(cell / h), *grid.data.shape), 1)
    clearance = distance_transform_edt(np.pad(grid.data == FREE, 1))[1:-1, 1:-1] * h
    shift = (every // 2 + 0.5 - 0.5 * every) * h
    return Room(
        np.ascontiguousarray(clearance[every // 2 :: every, every // 2 :: every]),
        np.array(grid.origin, np.float64) + shift,
        every * h,
        math.inf,
    )


@kernel
def with_discs(room: Room, discs: FloatArray, within: float) -> Room:
    """`room` less what `discs` (n, 3) x, y, radius [m] take, told up to `within` [m] from them."""
    clearance, origin, h = room.clearance.copy(), room.origin, room.resolution
    rows, columns = clearance.shape
    told = min(room.told, within) if discs.shape[0] > 0 else room.told
    for k in range(discs.shape[0]):
        x, y, reach = discs[k, 0], discs[k, 1], discs[k, 2] + within
        low_r, high_r = max(int((y - reach - origin[1]) / h), 0), min(int((y + reach - origin[1]) / h) + 1, rows)
        low_c, high_c = max(int((x - reach - origin[0]) / h), 0), min(int((x + reach - origin[0]) / h) + 1, columns)
        for r in range(low_r, high_r):
            for c in range(low_c, high_c):
                dx, dy = origin[0] + (c + 0.5) * h - x, origin[1] + (r + 0.5) * h - y
                clearance[r, c] = min(clearance[r, c], max(math.sqrt(dx * dx + dy * dy) - discs[k, 2], 0.0))
    return Room(clearance, origin, h, told)


@kernel
def ways_to(goal: FloatArray, room: Room, radius: float) -> Ways:
    """The ways to `goal` (2,) of a disc of `radius` [m]."""
    clearance, h = room.clearance, room.resolution
    rows, columns = clearance.shape
    cost, d = np.empty((rows, columns)), np.full((rows, columns), math.inf)
    for r in range(rows):
        for c in range(columns):
            spare = clearance[r, c] - radius
            cost[r, c] = h * (1.0 + DETOUR * max(1.0 - max(spare, 0.0) / COMFORT, 0.0) ** 2)
            if spare < 0.0:
                cost[r, c] = h * SQUEEZE
            if clearance[r, c] == 0.0:
                cost[r, c] = math.inf
    gr, gc = _cell(goal[0], goal[1], room)
    for r in range(max(gr - 1, 0), min(gr + 2, rows)):  # distances from the very point
        for c in range(max(gc - 1, 0), min(gc + 2, columns)):
            if cost[r, c] < math.inf or (r == gr and c == gc):
                dx, dy = room.origin[0] + (c + 0.5) * h - goal[0], room.origin[1] + (r + 0.5) * h - goal[1]
                d[r, c] = math.sqrt(dx * dx + dy * dy)
    fresh = np.zeros((rows, columns), np.bool_)  # where a neighbour has changed since: only there is anything to do
    any_fresh = np.zeros(rows, np.bool_)
    for r in range(max(gr - 2, 0), min(gr + 3, rows)):
        fresh[r, max(gc - 2, 0) : min(gc + 3, columns)] = any_fresh[r] = True
    for _ in range(_ROUNDS):
        if not any_fresh.any():
            break
        for way in range(4):
            for a in range(rows):
                r = a if way < 2 else rows - 1 - a
                if any_fresh[r]:
                    any_fresh[r] = False
                    _sweep_row(r, way % 2 == 0, cost, d, fresh, any_fresh)
    return Ways(d, room, goal[:2].copy(), radius)


@light
def _sweep_row(
    r: int,
    rightwards: bool,
    cost: FloatArray,
    d: FloatArray,
    fresh: npt.NDArray[np.bool_],
    any_fresh: npt.NDArray[np.bool_],
) -> None:
    """Lower the distances `d` of row `r`, cell by cell; which others are to be looked at then is noted."""
    rows, columns = d.shape
    for b in range(columns):
        c = b if rightwards else columns - 1 - b
        if not fresh[r, c]:
            continue
        fresh[r, c] = False
        step = cost[r, c]
        if step == math.inf:
            continue
        p = min(d[r - 1, c] if r > 0 else math.inf, d[r + 1, c] if r < rows - 1 else math.inf)
        q = min(d[r, c - 1] if c > 0 else math.inf, d[r, c + 1] if c < columns - 1 else math.inf)
        if min(p, q) >= d[r, c]:
            continue
        new = min(p, q) + step
        if abs(p - q) < step:
            new = 0.5 * (p + q + math.sqrt(2.0 * step * step - (p - q) ** 2))
        if new < d[r, c] - 1e-9:
            d[r, c] = new
            if r > 0:
                fresh[r - 1, c] = any_fresh[r - 1] = True
            if r < rows - 1:
                fresh[r + 1, c] = any_fresh[r + 1] = True
            if c > 0:
                fresh[r, c - 1] = True
                any_fresh[r] = any_fresh[r] or rightwards  # else it still comes
            if c < columns - 1:
                fresh[r, c + 1] = True
                any_fresh[r] = any_fresh[r] or not rightwards


@light
def way_point(ways: Ways, x: float, y: float, ahead: float) -> tuple[float, float, float]:
    """Where to head for from (x, y): the goal where the straight way there is free and hardly dearer than any other; else the last
    point of the way, at most `ahead` [m] along it, that is in free sight.

    Returns:
        The point's x and y [m], and the way left to the goal [m]; inf, and (x, y), where there is none.
    """
    d, room = ways.distance, ways.room
    rows, columns = d.shape
    h = room.resolution
    r, c = _cell(x, y, room)
    left = d[r, c]
    away = math.sqrt((ways.goal[0] - x) ** 2 + (ways.goal[1] - y) ** 2)
    if left <= STRAIGHT * away + 2.0 * h and in_sight(ways, x, y, ways.goal[0], ways.goal[1]):
        return ways.goal[0], ways.goal[1], left
    if room.clearance[r, c] == 0.0:  # in a wall, by an error of its own position: from the nearest cell with a way
        r, c = _nearest_way(d, r, c, int(ASTRAY / h))
        left = d[r, c]
    if left == math.inf:
        return x, y, left
    px, py, gone = room.origin[0] + (c + 0.5) * h, room.origin[1] + (r + 0.5) * h, 0.0
    best_x, best_y = px, py
    while gone < ahead:
        nr, nc, least = r, c, d[r, c]
        for i in range(max(r - 1, 0), min(r + 2, rows)):
            for j in range(max(c - 1, 0), min(c + 2, columns)):
                if d[i, j] < least:
                    nr, nc, least = i, j, d[i, j]
        if nr == r and nc == c:
            break
        gone += h * math.sqrt(float((nr - r) ** 2 + (nc - c) ** 2))
        r, c = nr, nc
        px, py = room.origin[0] + (c + 0.5) * h, room.origin[1] + (r + 0.5) * h
        if not in_sight(ways, x, y, px, py):
            break
        best_x, best_y = px, py
    return best_x, best_y, left


@light
def room_at(room: Room, x: float, y: float) -> float:
    """How much room there is at (x, y) [m], up to a cell."""
    r, c = _cell(x, y, room)
    return float(room.clearance[r, c])


@light
def in_sight(ways: Ways, x: float, y: float, px: float, py: float) -> bool:
    """Whether one that starts at (x, y) gets straight to (px, py) with no less room than its radius, or than it has there."""
    clearance, h, told, origin = ways.room.clearance, ways.room.resolution, ways.room.told, ways.room.origin
    r, c = _cell(x, y, ways.room)
    least = min(ways.radius, clearance[r, c]) - 1e-9
    length = math.sqrt((px - x) ** 2 + (py - y) ** 2)
    steps = int(length / (0.5 * h)) + 1
    per_metre, needed = steps / max(length, h), max(least, 0.0) + 1.5 * h
    k = 1 + int(max(min(clearance[r, c], told) - needed, 0.0) * per_metre)
    # on the grid and from place to place without a division: on the border of two cells it may be the other one, which does for the leap
    columns, rows, per_cell = clearance.shape[1], clearance.shape[0], 1.0 / h
    gx, gy, dx, dy = (x - origin[0]) * per_cell, (y - origin[1]) * per_cell, (px - x) * per_cell, (py - y) * per_cell
    dx, dy = dx / steps, dy / steps
    while k <= steps:
        r, c = min(max(int(gy + k * dy), 0), rows - 1), min(max(int(gx + k * dx), 0), columns - 1)
        spare = min(clearance[r, c], told) - needed
        if spare > 0.0:  # so far on there is enough, whichever cell it is in
            k += 1 + int(spare * per_metre)
            continue
        r, c = _cell(x + (px - x) * k / steps, y + (py - y) * k / steps, ways.room)
        room = clearance[r, c]
        if room == 0.0 or room < least:
            return False
        k += 1
    return True


@light
def _cell(x: float, y: float, room: Room) -> tuple[int, int]:
    rows, columns = room.clearance.shape
    r, c = math.floor((y - room.origin[1]) / room.resolution), math.floor((x - room.origin[0]) / room.resolution)
    return int(min(max(r, 0), rows - 1)), int(min(max(c, 0), columns - 1))


@light
def _nearest_way(d: FloatArray, r: int, c: int, most: int) -> tuple[int, int]:
    """The cell near (r, c), ring by ring, from which there is a way; (r, c) if there is none within `most` rings."""
    for ring in range(1, most + 1):
        best_r, best_c, best = r, c, math.inf
        for i in range(max(r - ring, 0), min(r + ring + 1, d.shape[0])):
            for j in range(max(c - ring, 0), min(c + ring + 1, d.shape[1])):
                away = float((i - r) ** 2 + (j - c) ** 2)
                if d[i, j] < math.inf and away < best:
                    best_r, best_c, best = i, j, away
        if best < math.inf:
            return best_r, best_c
    return r, c
