"""Lazy collision checking: no edge is looked at before it lies on the path that would be driven, and none twice.

Obstacles are discs where they are now; nothing is predicted. A disc that the robot already stands in shrinks to the
robot's distance from its centre: the way out stays open, and no way leads deeper in.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.distance import point_to_segment
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hl_rrt.tree import NONE, IntArray, Tree, detach, neighbours, path, reparent

FREE, BLOCKED, INSIDE = 0, 1, 2
"""An edge is free, meets an obstacle, or its second end lies inside one."""

_UNKNOWN = -1


class Scene(NamedTuple):
    """Discs and a grid over them: cell (row, column) meets the discs `item[start[i]:start[i+1]]`, i = row * cells + column.

    Attributes:
        discs: (m, 3) x, y, radius, m.
        start: (cells^2 + 2,) where the discs of each cell begin in `item`.
        item: Indices of discs, cell after cell.
        corner: (2,) lower-left corner of the grid, m.
        cell: Edge of a cell, m.
        cells: Number of cells along a side.
    """

    discs: FloatArray
    start: IntArray
    item: IntArray
    corner: FloatArray
    cell: float
    cells: int


class Checked(NamedTuple):
    """What is known of edges in this tick: a hash table of s places, a power of 2.

    Attributes:
        key: (s,) the edge at each place.
        tick: (s,) the tick in which that was found out.
        state: (s,) what is known of it.
    """

    key: IntArray
    tick: IntArray
    state: IntArray


def make_checked(slots: int) -> Checked:
    """An empty table of `slots` (a power of two)."""
    return Checked(np.zeros(slots, np.int64), np.full(slots, -1, np.int64), np.zeros(slots, np.int64))


@kernel
def look(discs: FloatArray, x: float, y: float, half: float, cell: float) -> Scene:
    """The scene around the robot at (x, y): of `discs` (n, 3) x, y, R [m], those that reach within `half` [m] on both
    axes, shrunk where the robot stands in them.
    """
    cells = math.ceil(2.0 * half / cell)
    corner = np.array((x - half, y - half))
    kept = np.empty_like(discs)
    m = 0
    for i in range(discs.shape[0]):
        dx, dy, radius = discs[i, 0] - x, discs[i, 1] - y, discs[i, 2]
        if abs(dx) < half + radius and abs(dy) < half + radius:
            kept[m, 0], kept[m, 1] = discs[i, 0], discs[i, 1]
            kept[m, 2] = min(radius, math.hypot(dx, dy))
            m += 1
    start = np.zeros(cells * cells + 2, np.int64)
    item = np.empty(0, np.int64)
    for fill in range(2):  # count, then write
        for i in range(m):
            r = kept[i, 2]
            low_c, high_c = _span(kept[i, 0], r, corner[0], cell, cells)
            low_r, high_r = _span(kept[i, 1], r, corner[1], cell, cells)
            for row in range(low_r, high_r + 1):
                for column in range(low_c, high_c + 1):
                    n = row * cells + column + 1
                    if fill == 1:
                        item[start[n]] = i
                        start[n] += 1
                    else:
                        start[n + 1] += 1
        if fill == 0:
            for n in range(1, start.shape[0]):
                start[n] += start[n - 1]
            item = np.empty(start[-1], np.int64)
    return Scene(kept[:m].copy(), start, item, corner, cell, cells)


@kernel
def edge(scene: Scene, ax: float, ay: float, bx: float, by: float) -> int:
    """State of the straight edge from a to b (m): FREE, BLOCKED or INSIDE."""
    state = FREE
    low_c, high_c = _span(0.5 * (ax + bx), 0.5 * abs(ax - bx), scene.corner[0], scene.cell, scene.cells)
    low_r, high_r = _span(0.5 * (ay + by), 0.5 * abs(ay - by), scene.corner[1], scene.cell, scene.cells)
    for row in range(low_r, high_r + 1):
        for n in range(row * scene.cells + low_c, row * scene.cells + high_c + 1):
            for k in range(scene.start[n], scene.start[n + 1]):
                x, y, r = scene.discs[scene.item[k]]
                limit = r * r * (1.0 - 1e-12)  # the robot itself may stand on the rim of a shrunk disc
                if point_to_segment(x, y, ax, ay, bx, by) < limit:
                    state = BLOCKED
                    if (bx - x) * (bx - x) + (by - y) * (by - y) < limit:
                        return INSIDE
    return state


@kernel
def known(checked: Checked, tick: int, tree: Tree, a: int, b: int) -> int:
    """What this tick has found out about the edge a-b; -1: nothing."""
    key = _key(tree, a, b)
    slot = _slot(checked, tick, key)
    return int(checked.state[slot]) if slot != NONE and checked.tick[slot] == tick else _UNKNOWN


@kernel
def check(checked: Checked, tick: int, tree: Tree, scene: Scene, parent: int, node: int) -> int:
    """State of the edge parent-node, looked up or found out and remembered."""
    key = _key(tree, parent, node)
    slot = _slot(checked, tick, key)
    if slot != NONE and checked.tick[slot] == tick:
        return int(checked.state[slot])
    a, b = tree.position[parent], tree.position[node]
    state = edge(scene, a[0], a[1], b[0], b[1])
    if slot != NONE:
        checked.key[slot], checked.tick[slot], checked.state[slot] = key, tick, state
    return state


@kernel
def first_blocked(checked: Checked, tick: int, tree: Tree, scene: Scene, leaf: int) -> int:
    """The first node on the way from the root to `leaf` whose edge is not free now; -1: the path is valid."""
    nodes = path(tree, leaf)
    for k in range(1, nodes.shape[0]):
        state = check(checked, tick, tree, scene, nodes[k - 1], nodes[k])
        if state != FREE:
            if state == INSIDE or known(checked, tick, tree, nodes[k - 1], nodes[k]) != state:
                tree.blocked[nodes[k]] = tick  # also where the table was full: what can't be remembered must not recur
            return int(nodes[k])
    return NONE


@kernel
def cut(
    checked: Checked, tick: int, tree: Tree, node: int, radius: float, found: IntArray, queue: IntArray
) -> None:  # fmt: skip
    """Detach `node` with its subtree, and give what is in it new parents where a connected neighbour within `radius` [m]
    is not known to be barred from it. No collision is tested: that waits until the edge lies on a candidate.

    A node that finds a parent takes its subtree along; below one that finds none, its children look for themselves.
    """
    detach(tree, node)
    queue[0] = node
    count, k = 1, 0
    while k < count:
        top = queue[k]
        k += 1
        parent = NONE if tree.blocked[top] == tick else _best_parent(checked, tick, tree, top, radius, found)
        if parent != NONE:
            reparent(tree, top, parent)
        else:
            below = tree.child[top]
            while below != NONE:
                queue[count] = below
                count += 1
                below = tree.after[below]


@kernel
def _best_parent(checked: Checked, tick: int, tree: Tree, node: int, radius: float, found: IntArray) -> int:
    x, y = tree.position[node]
    best, best_cost = NONE, np.inf
    for k in range(neighbours(tree, x, y, radius, found)):
        other = found[k]
        if other == node or tree.cost[other] == np.inf:
            continue
        cost = tree.cost[other] + math.hypot(tree.position[other, 0] - x, tree.position[other, 1] - y)
        if cost < best_cost and known(checked, tick, tree, other, node) <= FREE:
            best, best_cost = other, cost
    return int(best)


@kernel
def _span(centre: float, radius: float, corner: float, cell: float, cells: int) -> tuple[int, int]:
    """First and last cell of an axis that [centre - radius, centre + radius] meets; beyond the grid, those at its rim."""
    low = min(max(math.floor((centre - radius - corner) / cell), 0.0), cells - 1.0)
    high = min(max(math.floor((centre + radius - corner) / cell), 0.0), cells - 1.0)
    return int(low), int(high)


@kernel
def _key(tree: Tree, a: int, b: int) -> int:
    i, j = tree.name[a], tree.name[b]
    return int((min(i, j) << 32) | max(i, j))


@kernel
def _slot(checked: Checked, tick: int, key: int) -> int:
    """Where `key` stands or may be put; -1 where its part of the table is full (the edge is then checked anew)."""
    mask = checked.key.shape[0] - 1
    at = (key * 0x2545F4914F6CDD1D >> 20) & mask
    for k in range(32):
        slot = (at + k) & mask
        if checked.tick[slot] != tick or checked.key[slot] == key:
            return int(slot)
    return NONE
