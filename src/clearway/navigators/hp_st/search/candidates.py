"""Ways of distinct topology among the ends of a search: left or right of an obstacle, before or after it, or waiting.

Two ways from the same place are told apart by how far the bearing of each obstacle, seen from the robot, turns on the
way: passing on the other side, or before instead of after, turns it the other way round.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_st.environment.contact import PredictedObstacles
from clearway.navigators.hp_st.search.tree import TOTAL, IntArray, Tree, X, Y

Rounds = npt.NDArray[np.int16]


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
    if index < 0 or most == 0:
        return ends[:0]
    ends[0, 0], ends[0, 1] = layer, index
    last = len(tree.count) - 1
    while last > 0 and tree.count[last] == 0:
        last -= 1
    if most == 1 or last == 0:
        return ends[:1]
    rounds = _rounds(tree, obstacles, stride, layer, index, last)
    seen = np.empty((most, rounds.shape[2], 2))
    _see(tree, obstacles, stride, layer, index, seen[0])
    found = 1
    order = np.argsort(tree.nodes[last, : tree.count[last], TOTAL].copy())
    for b in order:
        if last == layer and b == index:
            continue
        _see(tree, obstacles, stride, last, b, seen[found])
        new = True
        for p in range(found):
            if not _differ(seen[p], rounds[ends[p, 0], ends[p, 1]], seen[found], rounds[last, b], apart):
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
def _rounds(tree: Tree, obstacles: PredictedObstacles, stride: int, layer: int, index: int, last: int) -> Rounds:
    """(L + 1, B, n) how often the bearing of each obstacle has come past west on the way to a node, counted up to the left; those that
    stand come first. Filled for the ends, which are all nodes of layer `last` and one of `layer`, and all nodes on the way to them."""
    still, at, nodes, parent, count = obstacles.still, obstacles.at, tree.nodes, tree.parent, tree.count
    needed = np.zeros(parent.shape, np.bool_)
    needed[last, : count[last]] = needed[layer, index] = True
    for k in range(last, 0, -1):
        for b in range(count[k]):
            if needed[k, b]:
                needed[k - 1, parent[k, b]] = True
    rounds = np.empty((*parent.shape, len(still) + len(obstacles.radius)), np.int16)
    rounds[0, 0] = 0
    for k in range(1, last + 1):
        for b in range(count[k]):
            if not needed[k, b]:
                continue
            a = parent[k, b]
            for i in range(rounds.shape[2]):
                ax, ay = _bearing(still, at, (k - 1) * stride, i, nodes[k - 1, a, X], nodes[k - 1, a, Y])
                bx, by = _bearing(still, at, k * stride, i, nodes[k, b, X], nodes[k, b, Y])
                past = rounds[k - 1, a, i]
                if (ay < 0.0) != (by < 0.0):
                    left = ax * by - ay * bx > 0.0
                    if left == (by < 0.0):
                        past += 1 if left else -1
                rounds[k, b, i] = past
    return rounds


@light
def _see(tree: Tree, obstacles: PredictedObstacles, stride: int, layer: int, index: int, seen: FloatArray) -> None:
    """Fill `seen` (n, 2) with where each obstacle is seen from a node, in metres; those that stand come first."""
    x, y = tree.nodes[layer, index, X], tree.nodes[layer, index, Y]
    for i in range(len(seen)):
        seen[i, 0], seen[i, 1] = _bearing(obstacles.still, obstacles.at, layer * stride, i, x, y)


@light
def _bearing(still: FloatArray, at: FloatArray, k: int, i: int, x: float, y: float) -> tuple[float, float]:
    """Where obstacle `i` is at instant `k`, seen from (x, y), in metres; those that stand come first."""
    if i < len(still):
        return still[i, 0] - x, still[i, 1] - y
    return at[k, i - len(still), 0] - x, at[k, i - len(still), 1] - y


@light
def _differ(a: FloatArray, rounds_a: Rounds, b: FloatArray, rounds_b: Rounds, apart: float) -> bool:
    """Whether on two ways from one place, see `_rounds`, the bearing of an obstacle turns by more than `apart` [rad] apart.

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
