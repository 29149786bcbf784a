"""Ways of distinct topology among the ends of a search: left or right of an obstacle, before or after it, or waiting.

Two ways from the same place are told apart by how far the bearing of each obstacle, seen from the robot, turns on the
way: passing on the other side, or before instead of after, turns it the other way round.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.contact import PredictedObstacles
from clearway.navigators.hp_st.search_tree import TOTAL, IntArray, Tree, X, Y


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
    count = len(obstacles.still) + len(obstacles.radius)
    last_seen, rounds = np.empty((most, count, 2)), np.empty((most, count), np.int64)
    if index < 0 or most == 0:
        return ends[:0]
    ends[0, 0], ends[0, 1] = layer, index
    way = np.empty((len(tree.count), 2))
    _turns(tree, obstacles, stride, layer, index, way, last_seen[0], rounds[0])
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
        _turns(tree, obstacles, stride, last, b, way, last_seen[found], rounds[found])
        new = True
        for p in range(found):
            if not _differ(last_seen[p], rounds[p], last_seen[found], rounds[found], apart):
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


@light
def _turns(
    tree: Tree, obstacles: PredictedObstacles, stride: int, layer: int, index: int, way: FloatArray, seen: FloatArray,
    rounds: IntArray,
) -> None:  # fmt: skip
    """How each obstacle has turned about the robot on the way to a node; those that stand come first.

    Args:
        tree: What the search has found.
        obstacles: As the search saw them.
        stride: Instants of the obstacles in a layer.
        layer: Of the node.
        index: Of the node in its layer.
        way: (L + 1, 2) filled with the places on the way, in metres.
        seen: (n, 2) filled with where each is seen from the node, in metres.
        rounds: (n,) filled with how often its bearing has come past west, counted up to the left.
    """
    still, at, nodes, parent = obstacles.still, obstacles.at, tree.nodes, tree.parent
    s = len(still)
    node = index
    for k in range(layer, -1, -1):
        way[k, 0], way[k, 1] = nodes[k, node, X], nodes[k, node, Y]
        node = parent[k, node]
    for i in range(len(rounds)):
        past, ax, ay = 0, 0.0, 0.0
        for k in range(layer + 1):
            if i < s:
                bx, by = still[i, 0] - way[k, 0], still[i, 1] - way[k, 1]
            else:
                bx, by = at[k * stride, i - s, 0] - way[k, 0], at[k * stride, i - s, 1] - way[k, 1]
            if k > 0 and (ay < 0.0) != (by < 0.0):
                left = ax * by - ay * bx > 0.0
                if left == (by < 0.0):
                    past += 1 if left else -1
            ax, ay = bx, by
        seen[i, 0], seen[i, 1], rounds[i] = ax, ay, past


@light
def _differ(a: FloatArray, rounds_a: IntArray, b: FloatArray, rounds_b: IntArray, apart: float) -> bool:
    """Whether on two ways from one place, see `_turns`, the bearing of an obstacle turns by more than `apart` [rad] apart.

    The rounds and the two last bearings tell; where no round lies between them, their angle's cosine does, without arc tangents.
    """
    least = math.cos(apart) if apart < math.pi else -2.0
    for i in range(len(rounds_a)):
        ax, ay, bx, by = a[i, 0], a[i, 1], b[i, 0], b[i, 1]
        cross, dot = bx * ay - by * ax, bx * ax + by * ay
        more = rounds_a[i] - rounds_b[i]
        if (ay < 0.0) != (by < 0.0):  # the shorter way from b to a may lead past west
            left = cross > 0.0
            if left == (ay < 0.0):
                more += -1 if left else 1
        if more == 0:
            if dot < least * math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)):
                return True
        elif abs(math.atan2(cross, dot) + 2.0 * math.pi * more) > apart:
            return True
    return False
