"""How far it is to the goal past what stands: a grid of distances, exact where the goal is in sight.

Where a disc hides the goal, the eikonal equation is solved by fast sweeping (Zhao 2005) from the rim of its shadow on,
so that errors of the grid arise in shadows alone. With a map the distances are those of the ways on it, where the robot is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.crowds.ways import Ways, in_sight
from clearway.geometry.compiled import inlined, kernel, light
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.frame import OdometryFrame

CELLS = 6400
"""At most so many cells: the grid is as fine as that allows."""

FINEST = 0.1
"""No grid is finer than that, m."""

THICK = 6.0
"""A metre inside a disc counts as so many: whoever is in there is led out."""

EXACT = 1.0
"""So near to the goal, and in sight of it, the distance on a map is the straight one, m."""

NO_WAY = 1e3
"""Where no way on the map leads to the goal it is so far, m."""

_ROUNDS = 6
_ENOUGH = 1e-3


class Field(NamedTuple):
    """Distances to a goal.

    Attributes:
        distance: (ny, nx) way from the cell (i, j), whose centre is at origin + (j, i) resolution, in metres.
        hidden: (ny, nx) where the goal is not in sight.
        origin: (2,) centre of the first cell, in metres.
        resolution: Distance between two cells, in metres.
        goal: (2,) where all ways lead, in metres.
    """

    distance: FloatArray
    hidden: npt.NDArray[np.bool_]
    origin: FloatArray
    resolution: float
    goal: FloatArray


@kernel
def make_field(goal: FloatArray, discs: FloatArray, area: FloatArray) -> Field:
    """The distances to `goal` (2,) in `area` (4,) x_min, y_min, x_max, y_max past `discs` (n, 3) x, y, R [m]."""
    wide, high = area[2] - area[0], area[3] - area[1]
    h = max(FINEST, math.sqrt(wide * high / CELLS))
    nx, ny = int(wide / h) + 2, int(high / h) + 2
    distance, hidden, slow = np.empty((ny, nx)), np.zeros((ny, nx), np.bool_), np.ones((ny, nx))
    n = len(discs)
    for i in range(ny):
        for j in range(nx):
            x, y = area[0] + j * h, area[1] + i * h
            dx, dy = x - goal[0], y - goal[1]
            far2 = dx * dx + dy * dy
            distance[i, j] = math.sqrt(far2)
            for k in range(n):
                cx, cy, r = discs[k, 0] - goal[0], discs[k, 1] - goal[1], discs[k, 2]
                along = min(max((cx * dx + cy * dy) / max(far2, 1e-12), 0.0), 1.0)
                ex, ey = cx - along * dx, cy - along * dy
                if ex * ex + ey * ey < r * r:
                    hidden[i, j] = True
                    if (cx - dx) ** 2 + (cy - dy) ** 2 < r * r:
                        slow[i, j] = THICK
    if n > 0:
        _sweep(distance, hidden, slow, h)
    return Field(distance, hidden, area[:2].copy(), h, goal[:2].copy())


def field_on_map(ways: Ways, frame: OdometryFrame, place: FloatArray, goal: FloatArray, half: float) -> Field:
    """The distances to `goal` (2,) by `ways` in a square about `place` (2,), `half` [m] to each side.

    Args:
        ways: To the same goal, on the map.
        frame: In which `place`, `goal` and the field are.
        place: Where the robot is, in metres.
        goal: In metres.
        half: In metres.
    """
    h = max(ways.room.resolution, 2.0 * half / math.sqrt(CELLS))
    count = int(2.0 * half / h) + 2
    origin = np.floor(place[:2] / h) * h - half
    steps = h * np.arange(count)
    distance, hidden = _by_ways(ways, frame.grid_back(origin[0] + steps, origin[1] + steps))
    return Field(distance.reshape(count, count), hidden.reshape(count, count), origin, h, goal[:2].copy())


@kernel
def _by_ways(ways: Ways, places: FloatArray) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """(n,) way to the goal from each of `places` (n, 2) on the map, and where it is not straight."""
    d, room, goal = ways.distance, ways.room, ways.goal
    rows, columns = d.shape
    far, hidden = np.empty(len(places)), np.ones(len(places), np.bool_)
    for n in range(len(places)):
        x, y = places[n, 0], places[n, 1]
        away = math.sqrt((x - goal[0]) ** 2 + (y - goal[1]) ** 2)
        if away <= EXACT and in_sight(ways, x, y, goal[0], goal[1]):
            far[n], hidden[n] = away, False
            continue
        a = min(max((x - room.origin[0]) / room.resolution - 0.5, 0.0), columns - 1.001)
        b = min(max((y - room.origin[1]) / room.resolution - 0.5, 0.0), rows - 1.001)
        j, i = int(a), int(b)
        s, t = a - j, b - i
        total, weight = 0.0, 0.0
        for k in range(4):  # walls have no way: the mean of the others
            value = d[i + k // 2, j + k % 2]
            share = (t if k // 2 == 1 else 1.0 - t) * (s if k % 2 == 1 else 1.0 - s)
            if value < math.inf:
                total, weight = total + share * value, weight + share
        far[n] = total / weight if weight > 1e-9 else NO_WAY
    return far, hidden


@light
def _sweep(distance: FloatArray, hidden: npt.NDArray[np.bool_], slow: FloatArray, h: float) -> None:
    """Fill the hidden cells of `distance`, `h` [m] apart, in which a metre counts `slow` times."""
    ny, nx = distance.shape
    for i in range(ny):
        for j in range(nx):
            if hidden[i, j]:
                distance[i, j] = math.inf
    for _ in range(_ROUNDS):
        change = 0.0
        for way in range(4):
            for a in range(ny):
                i = a if way < 2 else ny - 1 - a
                for b in range(nx):
                    j = b if way % 2 == 0 else nx - 1 - b
                    if not hidden[i, j]:
                        continue
                    p = min(distance[i - 1, j] if i > 0 else math.inf, distance[i + 1, j] if i < ny - 1 else math.inf)
                    q = min(distance[i, j - 1] if j > 0 else math.inf, distance[i, j + 1] if j < nx - 1 else math.inf)
                    if p == math.inf and q == math.inf:
                        continue
                    cost = h * slow[i, j]
                    if abs(p - q) >= cost:
                        new = min(p, q) + cost
                    else:
                        new = 0.5 * (p + q + math.sqrt(2.0 * cost * cost - (p - q) ** 2))
                    if new < distance[i, j] - 1e-12:
                        change = max(change, min(distance[i, j], 1e9) - new)
                        distance[i, j] = new
        if change < _ENOUGH:
            break


@light
def look(field: Field, x: float, y: float) -> tuple[float, float, float]:
    """Distance to the goal from (x, y) [m], and the unit direction in which the way leads."""
    return look_at(field.distance, field.hidden, field.origin, field.resolution, field.goal, x, y)


@inlined
def look_at(
    d: FloatArray, hidden: npt.NDArray[np.bool_], origin: FloatArray, h: float, goal: FloatArray, x: float, y: float
) -> tuple[float, float, float]:
    """`look`, on the parts of a field: to take them out of the tuple each time costs more than to look."""
    ny, nx = d.shape
    a = min(max((x - origin[0]) / h, 0.0), nx - 1.001)
    b = min(max((y - origin[1]) / h, 0.0), ny - 1.001)
    j, i = int(a), int(b)
    dx, dy = goal[0] - x, goal[1] - y
    if hidden[i, j] or hidden[i, j + 1] or hidden[i + 1, j] or hidden[i + 1, j + 1]:
        s, t = a - j, b - i
        d00, d01, d10, d11 = d[i, j], d[i, j + 1], d[i + 1, j], d[i + 1, j + 1]
        here = (1 - t) * ((1 - s) * d00 + s * d01) + t * ((1 - s) * d10 + s * d11)
        gx = (1 - t) * (d01 - d00) + t * (d11 - d10)
        gy = (1 - s) * (d10 - d00) + s * (d11 - d01)
        size = math.sqrt(gx * gx + gy * gy)
        if here < math.inf and size > 1e-12:
            return here, -gx / size, -gy / size
    far = max(math.sqrt(dx * dx + dy * dy), 1e-9)
    return far, dx / far, dy / far
