"""One tick of HL-RRT* on its tree: grow it by samples, choose the best candidate, check that alone.

Karaman, Frazzoli 2011 (RRT*) for choose-parent and rewiring; edges are straight (lazy steering: how the robot follows
one is worked out when it is driven) and untested until they lie on a candidate (lazy collision checking).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import bits
from clearway.navigators.hl_rrt.checking import Checked, Scene, cut, first_blocked
from clearway.navigators.hl_rrt.sampling import DRAWS, Source, draw
from clearway.navigators.hl_rrt.tree import NONE, IntArray, Tree, insert, nearest, neighbours, reparent, replace_leaf

_TRIES = 64
"""Random slots that are looked at for a leaf to forget when the tree is full."""


class Limits(NamedTuple):
    """How the tree grows.

    Attributes:
        step: The longest new edge, eta, m.
        spacing: A sample this near to a node adds nothing, m.
        gamma: Factor of the RRT* radius min(gamma sqrt(ln n / n), eta), m.
        horizon: Distance from the root at which a path may end, H, m.
        reach: Nodes lie at most this far from the root, m.
        tolerance: Radius of the goal region, m.
        area: (4,) x_min, y_min, x_max, y_max that nodes stay in, m.
    """

    step: float
    spacing: float
    gamma: float
    horizon: float
    reach: float
    tolerance: float
    area: FloatArray


@kernel
def radius_of(limits: Limits, n: int) -> float:
    """The RRT* radius with `n` nodes, m."""
    if n < 2:
        return limits.step
    return min(limits.gamma * math.sqrt(math.log(n) / n), limits.step)


@kernel
def grow(
    tree: Tree, source: Source, limits: Limits, key: np.uint64, tick: int, first: int, count: int, keep: int,
    found: IntArray,
) -> int:  # fmt: skip
    """`count` iterations (samples), from number `first` of this tick on. `keep`: a leaf that must not be forgotten.

    Returns:
        how many of them added a node.
    """
    added = 0
    for iteration in range(first, first + count):
        x, y, _kind = draw(source, key, tick, iteration)
        near = nearest(tree, x, y)
        px, py = tree.position[near]
        far = math.hypot(x - px, y - py)
        if far > limits.step:
            x, y = px + (x - px) * limits.step / far, py + (y - py) * limits.step / far
        if far < limits.spacing or not _allowed(tree, limits, x, y):
            continue
        added += _add(tree, limits, bits(key, tick, DRAWS * iteration + DRAWS - 1), tick, x, y, near, keep, found)
    return added


@kernel
def choose(
    tree: Tree, scene: Scene, checked: Checked, tick: int, limits: Limits, goal: FloatArray, last: int,
    any_nearer: bool, found: IntArray, queue: IntArray,
) -> int:  # fmt: skip
    """The end of the best valid path, or -1.

    Candidates are nodes at or over the horizon (the end of the last plan, named `last`, from which the robot has come nearer,
    up to a step before it) or, once the goal lies within the horizon, in the goal region, by cost-to-come + distance to
    the goal; where none is left and `any_nearer` is set, all nodes, by distance to the goal. Only nodes nearer to the
    goal than the root count. A candidate with a blocked edge loses it, the tree is mended, and the next one is tried.
    """
    while True:
        leaf = _best(tree, limits, goal, last, True)
        if leaf == NONE and any_nearer:
            leaf = _best(tree, limits, goal, last, False)
        if leaf == NONE:
            return NONE
        node = first_blocked(checked, tick, tree, scene, leaf)
        if node == NONE:
            return leaf
        cut(checked, tick, tree, node, limits.step, found, queue)  # far enough to find the parent that it had before


@kernel
def refresh_root(tree: Tree, limits: Limits, found: IntArray) -> None:
    """Rewire the nodes around the root, which has moved, to it where that is shorter."""
    radius = radius_of(limits, tree.meta[0])
    for k in range(neighbours(tree, tree.position[0, 0], tree.position[0, 1], radius, found)):
        _rewire(tree, 0, found[k])


@kernel
def elites(tree: Tree, scene: Scene, goal: FloatArray, share: float, most: int) -> FloatArray:
    """(n, 2) the points of the `share` of the connected nodes with the lowest cost + distance to the goal, without those
    that lie in an obstacle; every so-manieth if they are more than `most`.
    """
    n = tree.meta[0]
    value, node, count = np.empty(n), np.empty(n, np.int64), 0
    for i in range(1, n):
        if tree.cost[i] < np.inf:
            value[count] = tree.cost[i] + math.hypot(tree.position[i, 0] - goal[0], tree.position[i, 1] - goal[1])
            node[count] = i
            count += 1
    order = np.argsort(value[:count], kind="mergesort")
    points, kept = np.empty((count, 2)), 0
    for k in range(math.ceil(share * count)):
        x, y = tree.position[node[order[k]]]
        if not _inside(scene, x, y):
            points[kept, 0], points[kept, 1] = x, y
            kept += 1
    if kept <= most:
        return points[:kept].copy()
    out = np.empty((most, 2))
    for k in range(most):
        out[k] = points[k * kept // most]
    return out


@kernel
def _add(
    tree: Tree, limits: Limits, random: np.uint64, tick: int, x: float, y: float, near: int, keep: int, found: IntArray
) -> int:  # fmt: skip
    """Choose a parent for (x, y) without a collision test, add it, rewire around it likewise; 1, or 0 if there's no slot."""
    n = tree.meta[0]
    leaf = NONE
    if n == tree.cost.shape[0]:
        leaf = _leaf(tree, random, near, keep)
        if leaf == NONE:
            return 0
    count = neighbours(tree, x, y, radius_of(limits, n), found)
    parent, best = near, tree.cost[near] + math.hypot(tree.position[near, 0] - x, tree.position[near, 1] - y)
    for k in range(count):
        other = found[k]
        cost = tree.cost[other] + math.hypot(tree.position[other, 0] - x, tree.position[other, 1] - y)
        if cost < best and other != leaf:
            parent, best = other, cost
    if leaf == NONE:
        node = insert(tree, x, y, parent)
    else:
        node = leaf
        replace_leaf(tree, leaf, x, y, parent)
    for k in range(count):
        if found[k] != node and tree.blocked[found[k]] != tick:
            _rewire(tree, node, found[k])
    return 1


@kernel
def _rewire(tree: Tree, node: int, other: int) -> None:
    cost = tree.cost[node] + math.hypot(
        tree.position[node, 0] - tree.position[other, 0], tree.position[node, 1] - tree.position[other, 1]
    )
    if cost < tree.cost[other]:
        reparent(tree, other, node)


@kernel
def _best(tree: Tree, limits: Limits, goal: FloatArray, last: int, far: bool) -> int:
    root_x, root_y = tree.position[0]
    here = math.hypot(root_x - goal[0], root_y - goal[1])
    best, least, cheapest = NONE, np.inf, np.inf
    for node in range(1, tree.meta[0]):
        cost = tree.cost[node]
        if cost == np.inf:
            continue
        x, y = tree.position[node]
        left = math.hypot(x - goal[0], y - goal[1])
        if left >= here:
            continue
        if far:
            if here <= limits.horizon:
                at = left <= limits.tolerance
            else:
                horizon = limits.horizon - limits.step if tree.name[node] == last else limits.horizon
                at = math.hypot(x - root_x, y - root_y) >= horizon
            if not at:
                continue
            value = cost + left
        else:
            value = left
        if value < least or (value == least and cost < cheapest):
            best, least, cheapest = node, value, cost
    return best


@kernel
def _leaf(tree: Tree, random: np.uint64, near: int, keep: int) -> int:
    """A random childless node other than the two that are needed, as in RRT*FN (Adiyatov, Varol 2013); -1: none found."""
    n = tree.meta[0]
    start = int(random % np.uint64(n))
    for k in range(_TRIES):
        node = (start + k * 7919) % n
        if node != 0 and node != near and node != keep and tree.child[node] == NONE:
            return int(node)
    return NONE


@kernel
def _allowed(tree: Tree, limits: Limits, x: float, y: float) -> bool:
    a = limits.area
    inside = a[0] <= x <= a[2] and a[1] <= y <= a[3]
    return inside and math.hypot(x - tree.position[0, 0], y - tree.position[0, 1]) <= limits.reach


@kernel
def _inside(scene: Scene, x: float, y: float) -> bool:
    for i in range(scene.discs.shape[0]):
        dx, dy, r = x - scene.discs[i, 0], y - scene.discs[i, 1], scene.discs[i, 2]
        if dx * dx + dy * dy < r * r:
            return True
    return False
