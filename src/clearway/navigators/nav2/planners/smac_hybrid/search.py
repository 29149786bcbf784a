"""Hybrid-A*: the search over places and headings, each node with the very pose by which it was reached.

Behaviour read from ros-navigation/navigation2, nav2_smac_planner: a_star_impl.hpp, node_basic.hpp, goal_manager.hpp,
src/node_hybrid.cpp.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.navigators.nav2.planners.smac_hybrid.analytic import BEST, FULL, Expansion, Trails, expand
from clearway.navigators.nav2.planners.smac_hybrid.distance_heuristic import Table, without_obstacles
from clearway.navigators.nav2.planners.smac_hybrid.graph import (
    GOAL,
    VISITED,
    Graph,
    Longs,
    Open,
    cheapest,
    clear,
    enqueue,
    node_at,
)
from clearway.navigators.nav2.planners.smac_hybrid.ground import Ground, is_open, zone_is_open
from clearway.navigators.nav2.planners.smac_hybrid.motion import FORWARD, REVERSE, Integers, Motion, Single, Singles
from clearway.navigators.nav2.planners.smac_hybrid.obstacle_heuristic import Field, around_obstacles

FOUND, NONE, OCCUPIED, NO_ROOM = range(4)
"""How a search ends: with a path; without; no goal may be stood at; there was no room for its nodes."""


class Task(NamedTuple):
    """Where from, where to.

    Attributes:
        start: (3,) float32 column, row, heading in steps.
        goal: (2,) float32 column and row.
        headings: (n,) int64 headings at the goal, in steps.
        coarse: Of these each how-manieth is tried first.
        tolerance: Distance from the goal, in cells, within which the path may end, float32.
        limit: Nodes visited, at most.
        approach: Nodes visited, at most, once one within the tolerance is known.
    """

    start: Singles
    goal: Singles
    headings: Longs
    coarse: int
    tolerance: Single
    limit: int
    approach: int


class Ahead(NamedTuple):
    """The two heuristics.

    Attributes:
        field: Around obstacles.
        table: Without obstacles.
    """

    field: Field
    table: Table


@kernel
def _place(graph: Graph, ground: Ground, headings: int, x: Any, y: Any, heading: Any) -> Any:
    """The node of a pose, which it takes; -1: no room."""
    n = node_at(graph, (int(y) * ground.frame.cols + int(x)) * headings + int(heading))
    if n >= 0:
        graph.x[n], graph.y[n], graph.heading[n] = x, y, heading
    return n


@kernel
def _ahead(graph: Graph, ahead: Ahead, n: Any, cols: int, goals: npt.NDArray[np.float32]) -> Single:
    """What is left from a node to the nearest of `goals` (m, 3), at least."""
    headings = ahead.table.headings
    key = graph.key[n]
    heading, cell = key % headings, key // headings
    row, column = cell // cols, cell % cols
    around = around_obstacles(ahead.field, row, column)
    least = np.float32(np.inf)
    for i in range(len(goals)):
        away = without_obstacles(ahead.table, row, column, heading, goals[i, 0], goals[i, 1], goals[i, 2], around)
        least = min(least, away)
    return max(around, least)


@kernel
def _step_cost(graph: Graph, motion: Motion, node: Any, child: Any) -> Single:
    """What it costs to go from a node to a child of it, by the motion that the child has."""
    normalized = graph.cost[child] / np.float32(252)
    k, before = graph.motion[child], graph.motion[node]
    weighted = motion.cost_penalty * normalized
    if motion.quadratic:
        weighted = weighted * normalized
    cost = motion.travel[k] * (motion.reward + weighted)
    kind = motion.kind[k]
    if kind != FORWARD and kind != REVERSE and before >= 0:
        if motion.kind[before] == kind:
            cost = cost * motion.non_straight_penalty
        else:
            cost = cost * (motion.non_straight_penalty + motion.change_penalty)
    if kind >= REVERSE:
        cost = cost * motion.reverse_penalty
    return cost


@kernel
def _children(graph: Graph, ground: Ground, motion: Motion, node: Any, found: Integers) -> int:
    """The free nodes to which the motions lead, into `found` (motions,), each with the pose that the last of them gives it.

    Returns:
        how many; -1: no room.
    """
    count = 0
    headings = motion.headings
    frame = ground.frame
    h = int(graph.heading[node])
    for k in range(len(motion.turn)):
        x = np.float32(motion.dx[k, h] + graph.x[node])
        y = np.float32(motion.dy[k, h] + graph.y[node])
        if x < 0 or y < 0 or x >= frame.cols or y >= frame.rows:
            continue
        heading = graph.heading[node] + motion.turn[k]
        if heading < 0:
            heading += np.float32(headings)
        if heading >= headings:
            heading -= np.float32(headings)
        m = node_at(graph, (int(y) * frame.cols + int(x)) * headings + int(heading))
        if m < 0:
            return -1
        if graph.mark[m] & VISITED:
            continue
        before_x, before_y, before_heading = graph.x[m], graph.y[m], graph.heading[m]
        graph.x[m], graph.y[m], graph.heading[m] = x, y, heading
        if is_open(ground, graph, m):
            graph.motion[m] = k
            found[count] = m
            count += 1
        else:
            graph.x[m], graph.y[m], graph.heading[m] = before_x, before_y, before_heading
    return count


@kernel
def _path(graph: Graph, node: Any, goal: Any, trails: Trails, count: int) -> npt.NDArray[np.float32]:
    """Poses (n, 3) in cells and steps from the start to a node, and on by row BEST of `trails` to `goal`, unless that is -1."""
    n = 0
    at = node
    while at >= 0:
        n += 1
        at = np.int64(graph.parent[at])
    path = np.empty((n + count + 1, 3), np.float32)
    at = node
    for i in range(n - 1, -1, -1):
        path[i, 0], path[i, 1], path[i, 2] = graph.x[at], graph.y[at], graph.heading[at]
        at = np.int64(graph.parent[at])
    if goal >= 0:
        for i in range(count):
            if trails.node[BEST, i] != goal:
                path[n] = trails.pose[BEST, i]
                n += 1
        path[n, 0], path[n, 1], path[n, 2] = graph.x[goal], graph.y[goal], graph.heading[goal]
        n += 1
    return path[:n]


@kernel
def search(
    graph: Graph,
    queue: Open,
    ground: Ground,
    motion: Motion,
    expansion: Expansion,
    trails: Trails,
    ahead: Ahead,
    task: Task,
) -> Any:
    """Search.

    Args:
        graph: Room for nodes.
        queue: Room for entries.
        ground: What may be entered.
        motion: What leads on.
        expansion: When analytic paths are tried.
        trails: Room for those.
        ahead: The heuristics.
        task: Where from, where to.

    Returns:
        FOUND, NONE, OCCUPIED or NO_ROOM; the path (n, 3) float32 in cells and steps of heading; how many nodes were visited.
    """
    clear(graph, queue)
    cols, headings = ground.frame.cols, motion.headings
    nothing = np.empty((0, 3), np.float32)
    start = _place(graph, ground, headings, task.start[0], task.start[1], task.start[2])
    gx, gy = task.goal[0], task.goal[1]
    nodes = np.empty(len(task.headings), np.int32)
    poses = np.empty((len(task.headings), 3), np.float32)
    rank = np.empty(len(task.headings), np.int64)
    goals = 0
    for i in range(len(task.headings)):
        g = _place(graph, ground, headings, gx, gy, np.float32(task.headings[i]))
        if is_open(ground, graph, g) or zone_is_open(ground, gx, gy, task.headings[i], task.tolerance):
            nodes[goals], rank[goals] = g, i
            poses[goals, 0], poses[goals, 1], poses[goals, 2] = gx, gy, task.headings[i]
            graph.mark[g] |= GOAL
            goals += 1
    if goals == 0:
        return OCCUPIED, nothing, 0
    nodes, poses, rank = nodes[:goals], poses[:goals], rank[:goals]
    coarse, fine = nodes[rank % task.coarse == 0], nodes[rank % task.coarse != 0]
    graph.total[start] = 0.0
    enqueue(graph, queue, start, 0.0)
    nearest, near = np.float32(np.inf), start
    visited, approached, until_analytic = 0, 0, 0
    closest = np.int64(2**31 - 1)
    children = np.empty(len(motion.turn), np.int32)
    while visited < task.limit and queue.size[0] > 0:
        node = cheapest(graph, queue)
        if node < 0:
            continue
        visited += 1
        graph.mark[node] |= VISITED
        closest = min(closest, np.int64(_ahead(graph, ahead, node, cols, poses)))
        wanted = max(int(np.float32(closest) / expansion.ratio), math.ceil(expansion.ratio))
        until_analytic = min(until_analytic, wanted)
        if until_analytic <= 0:
            until_analytic = wanted
            count, begin, goal = expand(graph, ground, motion, expansion, trails, node, coarse, fine)
            if count == FULL:
                return NO_ROOM, nothing, visited
            if count > 0:
                return FOUND, _path(graph, begin, goal, trails, count), visited
        until_analytic -= 1
        if graph.mark[node] & GOAL:
            if graph.parent[node] < 0:
                return NONE, nothing, visited
            return FOUND, _path(graph, node, -1, trails, 0), visited
        if nearest < task.tolerance:
            approached += 1
            if approached >= task.approach:
                break
        found = _children(graph, ground, motion, node, children)
        if found < 0:
            return NO_ROOM, nothing, visited
        for i in range(found):
            child = np.int64(children[i])
            total = graph.total[node] + _step_cost(graph, motion, node, child)
            if total < graph.total[child]:
                graph.total[child], graph.parent[child] = total, node
                left = _ahead(graph, ahead, child, cols, poses)
                if left < nearest:
                    nearest, near = left, child
                if not enqueue(graph, queue, child, total + left):
                    return NO_ROOM, nothing, visited
    if nearest < task.tolerance:
        return FOUND, _path(graph, near, -1, trails, 0), visited
    return NONE, nothing, visited
