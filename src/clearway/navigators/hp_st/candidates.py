"""Ways of distinct topology among the ends of a search: left or right of an obstacle, before or after it, or waiting.

Two ways from the same place are told apart by how far the bearing of each obstacle, seen from the robot, turns on the
way: passing on the other side, or before instead of after, turns it the other way round.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.contact import PredictedObstacles
from clearway.navigators.hp_st.search_tree import TOTAL, IntArray, Tree, X, Y, trace


@kernel
def distinct(
    tree: Tree, obstacles: PredictedObstacles, stride: int, layer: int, index: int, most: int, apart: float
) -> IntArray:
    """(P, 2) layer and node of the best end, then of the best of each other topology, P <= `most`.

    Args:
        tree: What the search has found.
        obstacles: As the search saw them.
        stride: Instants of the obstacles in a layer.
        layer: Of the best end, see `leaf`.
        index: Of the best end in its layer; below 0 there is none.
        most: So many ends are returned at most.
        apart: Two ways differ where the bearing of an obstacle turns by more than that, in radians.
    """
    ends = np.empty((most, 2), np.int64)
    turns = np.empty((most, len(obstacles.still) + len(obstacles.radius)))
    if index < 0 or most == 0:
        return ends[:0]
    ends[0, 0], ends[0, 1] = layer, index
    _turns(tree, obstacles, stride, layer, index, turns[0])
    found = 1
    last = len(tree.count) - 1
    while last > 0 and tree.count[last] == 0:
        last -= 1
    if most == 1 or last == 0:
        return ends[:1]
    order = np.argsort(tree.nodes[last, : tree.count[last], TOTAL].copy())
    for b in order:
        if last == layer and b == index:
            continue
        _turns(tree, obstacles, stride, last, b, turns[found])
        new = True
        for p in range(found):
            widest = 0.0
            for i in range(turns.shape[1]):
                widest = max(widest, abs(turns[p, i] - turns[found, i]))
            if widest <= apart:
                new = False
                break
        if new:
            ends[found, 0], ends[found, 1] = last, b
            found += 1
            if found == most:
                break
    return ends[:found]


@kernel
def by_first_step(tree: Tree) -> IntArray:
    """(P, 2) layer and node of the best end that begins with each node of the first layer, the best of them first."""
    last = len(tree.count) - 1
    while last > 0 and tree.count[last] == 0:
        last -= 1
    ends, total = np.full(tree.count[min(last, 1)], -1), np.full(tree.count[min(last, 1)], np.inf)
    if last == 0:
        return np.empty((0, 2), np.int64)
    for b in range(tree.count[last]):
        at = b
        for k in range(last, 1, -1):
            at = tree.parent[k, at]
        if tree.nodes[last, b, TOTAL] < total[at]:
            ends[at], total[at] = b, tree.nodes[last, b, TOTAL]
    order = np.argsort(total)
    found = np.empty((len(order), 2), np.int64)
    count = 0
    for at in order:
        if ends[at] >= 0:
            found[count, 0], found[count, 1] = last, ends[at]
            count += 1
    return found[:count]


@kernel
def _turns(tree: Tree, obstacles: PredictedObstacles, stride: int, layer: int, index: int, out: FloatArray) -> None:
    """Fill how far the bearing of each obstacle turns on the way to a node, rad; those that stand come first.

    That is how much its bearing has changed in the end, and the rounds: how often it has come past west, which takes no
    arc tangent at each node.
    """
    still, at, s = obstacles.still, obstacles.at, len(obstacles.still)
    way, _ = trace(tree, layer, index)
    for i in range(len(out)):
        first, rounds, ax, ay = 0.0, 0, 0.0, 0.0
        for k in range(layer + 1):
            if i < s:
                bx, by = still[i, 0] - way[k, X], still[i, 1] - way[k, Y]
            else:
                bx, by = at[k * stride, i - s, 0] - way[k, X], at[k * stride, i - s, 1] - way[k, Y]
            if k == 0:
                first = math.atan2(by, bx)
            elif (ay < 0.0) != (by < 0.0):
                left = ax * by - ay * bx > 0.0
                if left == (by < 0.0):
                    rounds += 1 if left else -1
            ax, ay = bx, by
        out[i] = math.atan2(ay, ax) - first + 2.0 * math.pi * rounds
