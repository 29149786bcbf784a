"""What it takes a base that can't turn on the spot to come to a goal with the right heading: the way in the open.

The length of the shortest way of arcs and lines, forwards and backwards, to each pose around a goal, by value iteration on a
grid that is interpolated: a heuristic of the kind of Dolgov, Thrun, Montemerlo, Diebel 2010 ("Path planning for autonomous
vehicles in unknown semi-structured environments"), who take it as a bound together with the distance past obstacles.
Only the goal itself counts as there. What lies between two cells is therefore taken to be up to 0.8 m farther off than it is, which is
as well: with poses nearby for goals too, a car dithered beside its goal in 12 of 56 tests of the hospital, SO; as it is in none.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from clearway.geometry.angles import wrap
from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray
from clearway.robots import DriveLimits

CELLS, HEADINGS = 25, 32
"""So many cells to each side of the goal, and so many headings."""

WIDE = 3.5
"""Radii of its narrowest turn that the grid reaches to each side."""

_FAR = 1e3
_ROUNDS, _ENOUGH = 200, 1e-3  # m

NONE: FloatArray = np.empty((0, 0, 0))
"""Of a base that turns on the spot."""


def manoeuvres_of(limits: DriveLimits, reverse: float) -> FloatArray:
    """(HEADINGS + 1, n, n) lengths [m] of the ways to a goal at the origin that looks along x, by heading, y and x, and at last
    the size of a cell [m]; `NONE` for a base that turns on the spot. Not to be written.

    Args:
        limits: Of the base.
        reverse: So much more a metre backwards counts than one forwards; inf: it doesn't go backwards.
    """
    if limits.wheelbase == 0.0:
        return NONE
    return _table(limits.wheelbase / math.tan(limits.steering_max), reverse if limits.v_min < 0.0 else math.inf)


@lru_cache(maxsize=8)
def _table(radius: float, reverse: float) -> FloatArray:
    length = np.full((HEADINGS, 2 * CELLS + 1, 2 * CELLS + 1), _FAR)
    iterate(length, radius, WIDE * radius / CELLS, reverse)
    return np.concatenate((length, np.full((1, *length.shape[1:]), WIDE * radius / CELLS)))


@light
def iterate(length: FloatArray, radius: float, cell: float, reverse: float) -> None:
    """Fill `length` (HEADINGS, n, n) of a base whose narrowest turn has `radius` [m], on cells of `cell` [m]."""
    headings, n = length.shape[0], length.shape[1]
    half, bin = n // 2, 2.0 * math.pi / headings
    step = max(1.2 * cell, 1.05 * radius * bin)
    length[0, half, half] = 0.0
    for _ in range(_ROUNDS):
        change = 0.0
        for k in range(headings):
            for i in range(n):
                for j in range(n):
                    if k == 0 and i == half and j == half:
                        continue
                    x, y, theta = (j - half) * cell, (i - half) * cell, k * bin
                    best = length[k, i, j]
                    for way in range(6):
                        bent = (way % 3 - 1) / radius
                        along = step if way < 3 else -step
                        a = 0.5 * bent * along
                        chord = along * (math.sin(a) / a if a != 0.0 else 1.0)
                        count = step if way < 3 else step * (1.0 + reverse)
                        if count == math.inf:
                            continue
                        u, v = (
                            (x + chord * math.cos(theta + a)) / cell + half,
                            (y + chord * math.sin(theta + a)) / cell + half,
                        )
                        if u < 0.0 or v < 0.0 or u > n - 1.0 or v > n - 1.0:
                            continue
                        best = min(best, count + _between(length, (theta + 2.0 * a) / bin, v, u))
                    if best < length[k, i, j]:
                        change = max(change, length[k, i, j] - best)
                        length[k, i, j] = best
        if change < _ENOUGH:
            break


@light
def _between(length: FloatArray, turn: float, v: float, u: float) -> float:
    """The value at heading `turn`, row `v` and column `u`, in cells; headings go round."""
    headings, n = length.shape[0], length.shape[1]
    low = math.floor(turn)
    t, k = turn - low, int(low) % headings
    after = (k + 1) % headings
    i, j = min(int(v), n - 2), min(int(u), n - 2)
    q, p = v - i, u - j
    found = 0.0
    for h, share in ((k, 1.0 - t), (after, t)):
        if share > 0.0:
            near = (1.0 - p) * length[h, i, j] + p * length[h, i, j + 1]
            far = (1.0 - p) * length[h, i + 1, j] + p * length[h, i + 1, j + 1]
            found += share * ((1.0 - q) * near + q * far)
    return found


@kernel
def to_manoeuvre(table: FloatArray, goal: FloatArray, heading: float, x: float, y: float, theta: float) -> float:
    """How long the way is [m] from (x, y, theta) to `goal` (2,) with `heading` [rad]; from beyond the grid to its edge and on."""
    headings, n = table.shape[0] - 1, table.shape[1]
    cell, half = table[headings, 0, 0], n // 2
    c, s = math.cos(heading), math.sin(heading)
    dx, dy = x - goal[0], y - goal[1]
    u, v = (c * dx + s * dy) / cell + half, (c * dy - s * dx) / cell + half
    p, q = min(max(u, 0.0), n - 1.0), min(max(v, 0.0), n - 1.0)
    turn = wrap(theta - heading) * headings / (2.0 * math.pi)
    return float(_between(table[:headings], turn, q, p) + cell * math.hypot(u - p, v - q))
