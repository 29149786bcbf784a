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
from clearway.navigators.hp_st.search_tree import TOTAL, IntArray, Tree


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
    """Fill how far the bearing of each obstacle turns on the way to a node, rad; those that stand come first."""
    out[:] = 0.0
    s = len(obstacles.still)
    while layer > 0:
        node, index = tree.nodes[layer, index], tree.parent[layer, index]
        before = tree.nodes[layer - 1, index]
        for i in range(len(out)):
            if i < s:
                ax, ay, bx, by = (
                    obstacles.still[i, 0],
                    obstacles.still[i, 1],
                    obstacles.still[i, 0],
                    obstacles.still[i, 1],
                )
            else:
                ax, ay = obstacles.at[(layer - 1) * stride, i - s, 0], obstacles.at[(layer - 1) * stride, i - s, 1]
                bx, by = obstacles.at[layer * stride, i - s, 0], obstacles.at[layer * stride, i - s, 1]
            ax, ay, bx, by = ax - before[0], ay - before[1], bx - node[0], by - node[1]
            out[i] += math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        layer -= 1
