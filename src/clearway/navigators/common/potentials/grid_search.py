"""Search over grids: navigation potentials (wavefronts from a start cell) and the paths down them.

Cells are numbered row by row: `n = row * columns + column`. A costmap's bytes are turned into costs by a table of
256 entries; a cost of at least `lethal` is never entered, and neither is the grid's outermost ring. Potentials are
float32 and `HIGH` where the wave has not been.

The behaviour is that of the ROS navigation stack, read from ros-planning/navigation: navfn/src/navfn.cpp and
global_planner/src/{dijkstra,astar,quadratic_calculator,gradient_path,grid_path}.cpp.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.heap import pop, push

HIGH = np.float32(1.0e10)
"""Potential of a cell that was not reached."""

BLOCK = 10_000
"""Cells that one priority block of the wave can hold; more are dropped, as in navfn."""

_DIAGONAL = 0.707106781

ByteGrid = npt.NDArray[np.uint8]
PotentialGrid = npt.NDArray[np.float32]


class Workspace:
    """Scratch of the searches for grids of one size; `potential` holds the last result, as (rows * columns,)."""

    def __init__(self, rows: int, columns: int) -> None:
        self.rows, self.columns = rows, columns
        self.potential: PotentialGrid = np.full(rows * columns, HIGH, np.float32)
        closed = np.ones((rows, columns), np.uint8)
        closed[1:-1, 1:-1] = 0
        self.pending: ByteGrid = closed.reshape(-1)  # the outermost ring stays closed for ever
        self.blocks = np.empty((3, BLOCK), np.int32)
        self.extent = np.array([0, -1], np.int64)  # first and last cell whose potential was written

    def fitting(self, rows: int, columns: int) -> Workspace:
        """This one, cleared, if it is of that size; else a new one."""
        if (self.rows, self.columns) != (rows, columns):
            return Workspace(rows, columns)
        self.clear()
        return self

    def clear(self) -> None:
        """Make every potential HIGH again (only where the last search wrote)."""
        first, last = self.extent
        self.potential[first : last + 1] = HIGH
        self.extent[:] = self.potential.size, -1


@kernel
def _potential(left: Any, right: Any, up: Any, down: Any, step: Any, quadratic: bool) -> Any:
    """Potential of a cell of cost `step` from its neighbours' (all float32).

    Quadratic: a plane wave between the two lowest, by navfn's fit. Else: the lowest plus the cost.
    """
    across = left if left < right else right
    low = up if up < down else down
    difference = across - low
    if difference < 0:
        difference = -difference
        low = across
    if difference >= step or not quadratic:
        return low + step
    d = difference / step
    return low + step * (np.float32(-0.2301) * d * d + np.float32(0.5307) * d + np.float32(0.7040))


@kernel
def wave(
    costmap: ByteGrid,
    columns: int,
    table: ByteGrid,
    lethal: int,
    front: npt.NDArray[np.int64],
    target: int,
    increment: int,
    quadratic: bool,
    cycles: int,
    potential: PotentialGrid,
    pending: ByteGrid,
    blocks: npt.NDArray[np.int32],
    extent: npt.NDArray[np.int64],
    bound: float = np.inf,
    least: float = 0.0,
    ahead: float = 0.0,
    head_start: float = 0.0,
) -> bool:
    """Spread the potential in order of cost (Dijkstra with three priority blocks) until `target` is reached.

    Args:
        costmap: (cells,) uint8.
        columns: Width of the grid, cells.
        table: (256,) uint8 cost by costmap value.
        lethal: Cost that can't be entered.
        front: Int64 cells to begin with, next to those whose potential is set.
        target: Cell to reach; -1 spreads over all that can be reached.
        increment: By which the priority threshold is raised.
        quadratic: Whether the potential is the quadratic approximation; else the plain sum.
        cycles: Bound on the passes over a block.
        potential: Of a `Workspace`.
        pending: Of a `Workspace`.
        blocks: Of a `Workspace`.
        extent: Of a `Workspace`.
        bound: The wave does not go on from a cell whose potential, plus `least` for each cell of the straight line to
            the target, is above this. It saves the cells that no path of at most this potential needs.
        least: See `bound`.
        ahead: If positive, cells come in order of their potential plus `ahead` for each cell of the straight line to the
            target (navfn's A*, which also asks this sum of a cell's neighbours before it goes on to them).
        head_start: By how much the first priority threshold is above `lethal`.

    Returns:
        whether the target was reached.
    """
    step = table.astype(np.float32)
    diagonal = np.empty(256, np.float32)  # infinite: a lethal cell never gains
    for v in range(256):
        diagonal[v] = np.float32(_DIAGONAL * table[v]) if table[v] < lethal else np.float32(np.inf)
    current, following, over = 0, 1, 2  # rows of `blocks`
    current_end = 0
    following_end = 0
    over_end = 0
    threshold = np.float32(lethal + head_start)
    first, last = extent[0], extent[1]
    for n in front:
        if 0 <= n < costmap.size and pending[n] == 0 and table[costmap[n]] < lethal:
            blocks[current, current_end] = n
            current_end += 1
            pending[n] = 1
    one, row = np.uint32(1), np.uint32(columns)  # unsigned: no check for negative indices
    neighbours = np.array([-1, 1, -columns, columns]).astype(np.uint32)  # added modulo 2^32
    target_column, target_row = target % columns, target // columns
    reached = False
    for _ in range(cycles):
        if current_end == 0 and following_end == 0:
            break
        for i in range(current_end):
            pending[blocks[current, i]] = 0
        for i in range(current_end):
            n = np.uint32(blocks[current, i])
            left, right, up, down = potential[n - one], potential[n + one], potential[n - row], potential[n + row]
            value = _potential(left, right, up, down, step[costmap[n]], quadratic)
            if value < potential[n]:
                potential[n] = value
                first, last = min(first, np.int64(n)), max(last, np.int64(n))
                if bound < np.inf:
                    up_to = n // row
                    across = np.float64(n - up_to * row) - target_column
                    if value + least * math.sqrt(across**2 + (np.float64(up_to) - target_row) ** 2) > bound:
                        continue
                if ahead > 0:
                    up_to = n // row
                    across = np.float64(n - up_to * row) - target_column
                    rest = np.float32(ahead * math.sqrt(across**2 + (np.float64(up_to) - target_row) ** 2))
                    value += rest
                low = value < threshold
                block, end = (following, following_end) if low else (over, over_end)
                for k in range(4):  # written out: a call that takes arrays costs more than all of this
                    m = np.uint32(n + neighbours[k])
                    if pending[m] == 0 and end < BLOCK and potential[m] > value + diagonal[costmap[m]]:
                        blocks[block, end] = m
                        pending[m] = 1
                        end += 1
                if low:
                    following_end = end
                else:
                    over_end = end
        current, following = following, current
        current_end, following_end = following_end, 0
        if current_end == 0:
            threshold += np.float32(increment)
            current, over = over, current
            current_end, over_end = over_end, 0
        if target >= 0 and potential[target] < HIGH:
            reached = True
            break
    for i in range(current_end):
        pending[blocks[current, i]] = 0
    for i in range(over_end):
        pending[blocks[over, i]] = 0
    extent[0], extent[1] = first, last
    return reached


@kernel
def best_first(
    costmap: ByteGrid,
    columns: int,
    table: ByteGrid,
    lethal: int,
    neutral: int,
    start: int,
    target: int,
    quadratic: bool,
    potential: PotentialGrid,
    pending: ByteGrid,
    extent: npt.NDArray[np.int64],
) -> bool:
    """A* with the Manhattan distance (times `neutral`) as heuristic; each cell's potential is set once.

    Args are those of `wave`; `start` is the cell that it begins at.

    Returns:
        whether the target was reached.
    """
    cells = costmap.size
    keys = np.empty(cells + 1, np.float32)
    queue = np.empty(cells + 1, np.int32)
    keys[0], queue[0] = np.float32(0), start
    size = 1
    potential[start] = np.float32(0)
    first, last = min(extent[0], start), max(extent[1], start)
    tx, ty = target % columns, target // columns
    reached = False
    while size > 0:
        n = queue[0]
        size = pop(keys, queue, size)
        if n == target:
            reached = True
            break
        for m in (n + 1, n - 1, n + columns, n - columns):
            if m < 0 or m >= cells or potential[m] < HIGH or pending[m] != 0 or table[costmap[m]] >= lethal:
                continue
            step = np.float32(table[costmap[m]])
            if quadratic:
                left, right, up, down = (
                    potential[m - 1],
                    potential[m + 1],
                    potential[m - columns],
                    potential[m + columns],
                )
                potential[m] = _potential(left, right, up, down, step, True)
            else:
                potential[m] = potential[n] + step
            first, last = min(first, m), max(last, m)
            ahead = abs(tx - m % columns) + abs(ty - m // columns)
            size = push(keys, queue, size, np.float32(potential[m] + ahead * neutral), m)
    extent[0], extent[1] = first, last
    return reached


@kernel
def fill_around(
    potential: PotentialGrid, costmap: ByteGrid, columns: int, centre: int, neutral: int, quadratic: bool
) -> None:
    """Give unreached cells within two of `centre` a potential from their neighbours, whatever they cost."""
    for across in range(-2, 3):
        for up in range(-2, 3):
            n = centre + across + up * columns
            if potential[n] >= HIGH:
                step = np.float32((np.int64(costmap[n]) + neutral) % 256)  # a byte, which may overflow, in ROS
                left, right, above, below = (
                    potential[n - 1],
                    potential[n + 1],
                    potential[n - columns],
                    potential[n + columns],
                )
                potential[n] = _potential(left, right, above, below, step, quadratic)


@kernel
def _slope(potential: PotentialGrid, columns: int, n: int, lethal: int) -> tuple[float, float]:
    """Unit vector down the potential at cell n; away from an unreached cell towards a reached one."""
    if n < columns or n > potential.size - columns:
        return 0.0, 0.0
    here = potential[n]
    left, right = potential[n - 1], potential[n + 1]
    up, down = potential[n - columns], potential[n + columns]
    dx = 0.0
    dy = 0.0
    if here >= HIGH:
        if left < HIGH:
            dx = -1.0 * lethal
        elif right < HIGH:
            dx = 1.0 * lethal
        if up < HIGH:
            dy = -1.0 * lethal
        elif down < HIGH:
            dy = 1.0 * lethal
    else:
        if left < HIGH:
            dx += left - here
        if right < HIGH:
            dx += here - right
        if up < HIGH:
            dy += up - here
        if down < HIGH:
            dy += here - down
    norm = math.hypot(dx, dy)
    if norm > 0:
        return dx / norm, dy / norm
    return 0.0, 0.0


@kernel
def _round(offset: Any) -> Any:
    """An offset within one cell to the nearest cell, halves away from zero."""
    return math.floor(offset + 0.5) if offset >= 0 else -math.floor(0.5 - offset)


@kernel
def descend(
    potential: PotentialGrid,
    columns: int,
    lethal: int,
    x: float,
    y: float,
    end_x: float,
    end_y: float,
    near: float,
    limit: int,
) -> PotentialGrid:
    """Follow the gradient of the potential down, half a cell at a time, from (x, y) to (end_x, end_y), in cells.

    Where the potential has a hole nearby it follows the lowest of the eight neighbours instead.

    Args:
        potential: (cells,) float32.
        lethal: Slope at the edge of the unreached.
        near: It has arrived where the potential is below this (navfn); if negative, within half a cell of the end
            (global_planner).
        limit: Points at most.

    Returns:
        (n, 2) points from (x, y) to the end; n = 0 if the way is lost.
    """
    path = np.empty((limit + 1, 2), np.float32)
    cells = potential.size
    n = int(y) * columns + int(x)
    dx, dy = np.float32(x - int(x)), np.float32(y - int(y))
    for count in range(limit):
        px, py = np.float32(n % columns + dx), np.float32(n // columns + dy)
        if near >= 0:
            nearest = n + _round(dx) + _round(dy) * columns
            arrived = potential[max(0, min(cells - 1, nearest))] < near
        else:
            arrived = abs(px - end_x) < 0.5 and abs(py - end_y) < 0.5
        if arrived:
            path[count, 0], path[count, 1] = end_x, end_y
            return path[: count + 1]
        if n < columns or n > cells - columns:
            return path[:0]
        path[count, 0], path[count, 1] = px, py
        stuck = count > 1 and path[count - 2, 0] == px and path[count - 2, 1] == py
        for m in (n, n + columns, n - columns):
            if potential[m] >= HIGH or potential[m + 1] >= HIGH or potential[m - 1] >= HIGH:
                stuck = True
        if stuck:
            if potential[n] >= HIGH:
                return path[:0]
            best = n
            lowest = np.float32(int(potential[n]))  # an integer in navfn
            for row in (-columns, 0, columns):
                for column in (-1, 0, 1):
                    m = n + row + column
                    if m != n and potential[m] < lowest:
                        lowest = np.float32(int(potential[m]))
                        best = m
            n = best
            dx, dy = np.float32(0), np.float32(0)
        else:
            ax, ay = _slope(potential, columns, n, lethal)
            bx, by = _slope(potential, columns, n + 1, lethal)
            cx, cy = _slope(potential, columns, n + columns, lethal)
            ex, ey = _slope(potential, columns, n + columns + 1, lethal)
            gx = (1.0 - dy) * ((1.0 - dx) * ax + dx * bx) + dy * ((1.0 - dx) * cx + dx * ex)
            gy = (1.0 - dy) * ((1.0 - dx) * ay + dx * by) + dy * ((1.0 - dx) * cy + dx * ey)
            if gx == 0.0 and gy == 0.0:
                return path[:0]
            step = 0.5 / math.hypot(gx, gy)
            dx, dy = np.float32(dx + gx * step), np.float32(dy + gy * step)
            if dx > 1.0:
                n, dx = n + 1, np.float32(dx - 1.0)
            if dx < -1.0:
                n, dx = n - 1, np.float32(dx + 1.0)
            if dy > 1.0:
                n, dy = n + columns, np.float32(dy - 1.0)
            if dy < -1.0:
                n, dy = n - columns, np.float32(dy + 1.0)
    return path[:0]


@kernel
def descend_cells(potential: PotentialGrid, columns: int, x: float, y: float, end: int, limit: int) -> PotentialGrid:
    """Go from cell to the lowest of its eight neighbours, from (x, y) to the cell `end`; (n, 2), n = 0 if lost."""
    path = np.empty((limit + 1, 2), np.float32)
    path[0, 0], path[0, 1] = x, y
    rows = potential.size // columns
    cx, cy = int(x), int(y)
    count = 1
    while cy * columns + cx != end:
        lowest = HIGH
        best_x, best_y = 0, 0
        for xd in (-1, 0, 1):
            for yd in (-1, 0, 1):
                mx, my = cx + xd, cy + yd
                if (xd == 0 and yd == 0) or not (0 <= mx < columns and 0 <= my < rows):
                    continue
                if potential[my * columns + mx] < lowest:
                    lowest = potential[my * columns + mx]
                    best_x, best_y = mx, my
        if (best_x == 0 and best_y == 0) or count >= limit:
            return path[:0]
        cx, cy = best_x, best_y
        path[count, 0], path[count, 1] = cx, cy
        count += 1
    return path[:count]
