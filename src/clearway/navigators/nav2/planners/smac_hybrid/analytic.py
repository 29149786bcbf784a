"""Analytic expansions: whether the shortest path without obstacles, from a node to a goal, is free and good enough.

Behaviour read from ros-navigation/navigation2, nav2_smac_planner/include/nav2_smac_planner/analytic_expansion_impl.hpp.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import TURN, wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.dubins import along, changes, dubins, length, relative
from clearway.geometry.reeds_shepp import reeds_shepp
from clearway.navigators.nav2.planners.smac_hybrid.graph import Graph, node_at
from clearway.navigators.nav2.planners.smac_hybrid.ground import Ground, is_open
from clearway.navigators.nav2.planners.smac_hybrid.motion import Integers, Motion, Single

_STEP = np.float32(math.sqrt(2.0))
"""Cells between two nodes of such a path: a step that leaves a cell."""

FULL = -1
"""In place of a count of nodes: there was no room for a node."""

CURRENT, TRIAL, BEST = range(3)
"""Rows of `Trails`."""


class Expansion(NamedTuple):
    """What an analytic path must keep to.

    Attributes:
        ratio: How much more often it is tried as the goal comes near, float32.
        longest: Its length, at most, cells, float32.
        max_cost: A cost that it may leave but not enter, float32.
        override: Whether it may where it is shorter than a circle of least radius.
    """

    ratio: Single
    longest: Single
    max_cost: Single
    override: bool


class Trails(NamedTuple):
    """Room for analytic paths: of rows CURRENT, TRIAL and BEST.

    Attributes:
        node: (3, n) int32.
        pose: (3, n, 3) float32 column, row, heading in steps.
        before: (n, 3) float32 the nodes' own poses.
    """

    node: Integers
    pose: npt.NDArray[np.float32]
    before: npt.NDArray[np.float32]


def make_trails(longest: float) -> Trails:
    """Room for paths of `longest` cells."""
    n = int(longest / float(_STEP)) + 2
    return Trails(np.empty((3, n), np.int32), np.empty((3, n, 3), np.float32), np.empty((n, 3), np.float32))


@kernel
def _pose(graph: Graph, n: Any, x: Any, y: Any, heading: Any) -> None:
    graph.x[n], graph.y[n], graph.heading[n] = x, y, heading


@kernel
def _reach(
    graph: Graph,
    ground: Ground,
    motion: Motion,
    expansion: Expansion,
    trails: Trails,
    row: int,
    way: Any,
    radius: float,
) -> Any:
    """Lay the path from one node to another into a row of `trails`.

    Args:
        graph: See there.
        ground: See there.
        motion: See there.
        expansion: See there.
        trails: See there.
        row: Of `trails`.
        way: The two nodes.
        radius: Turning radius, cells.

    Returns:
        how many nodes it has, 0 if it is not free or not wanted, FULL; and how often it changes its direction.
    """
    node, goal = way
    yaw = np.float64(np.float32(int(graph.heading[node])) * motion.bin_size)
    goal_yaw: float = np.float64(np.float32(int(graph.heading[goal])) * motion.bin_size)
    fx, fy = np.float64(graph.x[node]), np.float64(graph.y[node])
    seen = relative(fx, fy, yaw, np.float64(graph.x[goal]), np.float64(graph.y[goal]), goal_yaw, radius)
    pieces = reeds_shepp(seen[0], seen[1], seen[2]) if motion.reverse else dubins(seen[0], seen[1], seen[2])
    turns = changes(pieces)
    whole = length(pieces)
    far = np.float32(radius * whole)
    if far > expansion.longest or far < _STEP:
        return 0, turns
    steps = math.floor(far / _STEP)
    c, s = math.cos(yaw), math.sin(yaw)
    goal_x, goal_y = graph.x[goal], graph.y[goal]
    count, previous, free = 0, node, True
    frame, headings = ground.frame, motion.headings
    for i in range(1, steps + 1):
        if i == steps:
            x, y, theta = np.float64(goal_x), np.float64(goal_y), goal_yaw
        else:
            px, py, turn = along(pieces, whole * np.float64(np.float32(i) / np.float32(steps)))
            x, y = fx + radius * (c * px - s * py), fy + radius * (s * px + c * py)
            theta = wrap(yaw + turn)
        heading = np.float32((theta + TURN if theta < 0 else theta) / motion.bin_size)
        if x < 0 or y < 0 or x >= frame.cols or y >= frame.rows:
            free = False
            break
        m = node_at(graph, (int(y) * frame.cols + int(x)) * headings + int(heading) % headings)
        if m < 0:
            count, free = FULL, False
            break
        ox, oy, oh = graph.x[m], graph.y[m], graph.heading[m]
        _pose(graph, m, x, y, heading)
        if m == previous or not is_open(ground, graph, m):
            _pose(graph, m, ox, oy, oh)
            free = False
            break
        trails.before[count, 0], trails.before[count, 1], trails.before[count, 2] = ox, oy, oh
        trails.node[row, count] = previous = m
        trails.pose[row, count, 0], trails.pose[row, count, 1], trails.pose[row, count, 2] = x, y, heading
        count += 1
    if free and not (expansion.override and far < 2 * math.pi * motion.radius):
        left = False  # the costly ground about the goal, seen from there
        for i in range(count - 1, -1, -1):
            costly = graph.cost[trails.node[row, i]] > expansion.max_cost
            free = free and not (costly and left)
            left = left or not costly
    for i in range(count):
        _pose(graph, trails.node[row, i], trails.before[i, 0], trails.before[i, 1], trails.before[i, 2])
    return (count if free or count == FULL else 0), turns


@kernel
def _score(graph: Graph, motion: Motion, trails: Trails, row: int, count: int) -> Single:
    """What a path costs, as the search counts; infinite for less than two nodes."""
    if count < 2:
        return np.float32(np.inf)
    dx = trails.pose[row, 1, 0] - trails.pose[row, 0, 0]
    dy = trails.pose[row, 1, 1] - trails.pose[row, 0, 1]
    step = np.float32(math.hypot(dx, dy))
    score = np.float32(0)
    for i in range(count):
        normalized = graph.cost[trails.node[row, i]] / np.float32(252)
        score = np.float32(score + step * (1.0 + np.float64(motion.cost_penalty * normalized)))
    return score


@kernel
def _take(trails: Trails, source: int, target: int, count: int) -> None:
    trails.node[target, :count] = trails.node[source, :count]
    trails.pose[target, :count] = trails.pose[source, :count]


@kernel
def _refine(
    graph: Graph, ground: Ground, motion: Motion, expansion: Expansion, trails: Trails, way: Any, count: int, turns: int
) -> Any:
    """Improve the path in row CURRENT: begin it earlier, turn in wider circles. Its score, first node and count."""
    node, goal = way
    earlier = node
    for _ in range(8):
        for _ in range(5):
            earlier = np.int64(graph.parent[earlier]) if earlier >= 0 else -1
        if earlier < 0:
            break
        other, other_turns = _reach(
            graph, ground, motion, expansion, trails, TRIAL, (earlier, goal), np.float64(motion.radius)
        )
        if other <= 0:
            if other == FULL:
                return np.float32(0), node, FULL
            break
        if other_turns <= turns:
            _take(trails, TRIAL, CURRENT, other)
            node, count, turns = earlier, other, other_turns
    original = _score(graph, motion, trails, CURRENT, count)
    best = original
    radius, widest = motion.radius, np.float32(4.0) * motion.radius
    while radius < widest:
        radius = np.float32(radius + 0.5)
        other, other_turns = _reach(graph, ground, motion, expansion, trails, TRIAL, (node, goal), np.float64(radius))
        if other == FULL:
            return np.float32(0), node, FULL
        if other == 0:  # an empty path of the source has no changes of direction
            other_turns = 0
        score = _score(graph, motion, trails, TRIAL, other)
        better = score <= best and other_turns <= turns
        if better or (score <= original and other_turns < turns):
            _take(trails, TRIAL, CURRENT, other)
            count, turns, best = other, other_turns, score
    return best, node, count


@kernel
def expand(
    graph: Graph,
    ground: Ground,
    motion: Motion,
    expansion: Expansion,
    trails: Trails,
    node: Any,
    coarse: Any,
    fine: Any,
) -> Any:
    """The best free path from a node to one of the goals, in row BEST of `trails`.

    Args:
        graph: See there.
        ground: See there.
        motion: See there.
        expansion: See there.
        trails: See there.
        node: Where it begins.
        coarse: (n,) int32 goals.
        fine: (m,) int32 goals that are tried only if one of `coarse` can be reached.

    Returns:
        how many nodes it has, 0 if there is none, FULL; the node where it begins, which may lie before `node`; the goal.
    """
    best, best_count, best_node, best_goal = np.float32(np.inf), 0, node, np.int64(-1)
    found = False
    radius = np.float64(motion.radius)
    for goals in (coarse, fine):
        for i in range(len(goals)):
            goal = np.int64(goals[i])
            count, turns = _reach(graph, ground, motion, expansion, trails, CURRENT, (node, goal), radius)
            if count > 0:
                found = True
                score, begin, count = _refine(graph, ground, motion, expansion, trails, (node, goal), count, turns)
                if count > 0 and score < best:
                    _take(trails, CURRENT, BEST, count)
                    best, best_count, best_node, best_goal = score, count, begin, goal
            if count == FULL:
                return FULL, node, best_goal
        if not found:
            break
    return best_count, best_node, best_goal
