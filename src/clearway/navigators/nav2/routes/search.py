"""Dijkstra's search over a route server's graph, and which of its ends are left out.

Behaviour read from ros-navigation/navigation2: nav2_route/src/route_planner.cpp, src/goal_intent_extractor.cpp.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.routes.graph import Edge, Graph


class NoRoute(Exception):
    """Nothing leads from the first node to the last."""


class TookTooLong(Exception):
    """The search reached its number of iterations."""


class Route(NamedTuple):
    """Nodes and the edges between them.

    Attributes:
        first: Index of its first node.
        edges: One after another; none: it is but that node.
    """

    first: int
    edges: tuple[Edge, ...]

    @property
    def nodes(self) -> tuple[int, ...]:
        """Indices of its nodes."""
        return self.first, *(edge.end for edge in self.edges)


def search(graph: Graph, first: int, last: int, cost: Callable[[Edge], float | None], most: int) -> tuple[Route, float]:
    """The cheapest route and what it costs; of routes that cost the same the one that was found first.

    Args:
        graph: Where it leads.
        first: Index of its first node.
        last: Index of its last node.
        cost: What an edge costs, not below 0; None: it is closed.
        most: Iterations.

    Raises:
        NoRoute: There is none.
        TookTooLong: It took so many iterations.
    """
    best: dict[int, float] = {first: 0.0}
    by: dict[int, Edge] = {}
    queue = [(0.0, 0, first)]
    count = iterations = 0
    while queue and iterations < most:
        iterations += 1
        so_far, _, node = heapq.heappop(queue)
        if so_far != best[node]:
            continue
        if node == last:
            return Route(first, _back(by, last, first)), so_far
        for edge in graph.leaving[node]:
            more = cost(edge)
            if more is not None and so_far + more < best.get(edge.end, math.inf):
                best[edge.end], by[edge.end] = so_far + more, edge
                count += 1
                heapq.heappush(queue, (so_far + more, count, edge.end))
    if iterations == most:
        raise TookTooLong(f"the search for a route took {most} iterations")
    raise NoRoute(f"no route leads from node {graph.ids[first]} to node {graph.ids[last]}")


def _back(by: dict[int, Edge], node: int, first: int) -> tuple[Edge, ...]:
    edges: list[Edge] = []
    while node != first:
        edges.append(by[node])
        node = by[node].start
    return tuple(reversed(edges))


def nearest(graph: Graph, pose: FloatArray, count: int) -> npt.NDArray[np.intp]:
    """Indices of the nodes nearest to a pose, the nearest first, at most `count`."""
    apart = np.hypot(graph.places[:, 0] - pose[0], graph.places[:, 1] - pose[1])
    return np.argsort(apart, kind="stable")[:count]


class Pruning(NamedTuple):
    """When the first and the last edge are left out, as the robot begins or ends beside them.

    Attributes:
        goal: Whether the last one may be.
        from_edge: Distance from the edge up to which it is, m.
        from_start: Distance from the first node above which it is, m.
        from_goal: Distance from the last node above which it is, m.
    """

    goal: bool
    from_edge: float
    from_start: float
    from_goal: float


def pruned(route: Route, graph: Graph, start: FloatArray, goal: FloatArray, pruning: Pruning) -> Route:
    """A route without its first edge where the start lies along it, and without its last one where the goal does."""
    if route.edges:
        first, *rest = route.edges
        a, b = graph.places[first.start], graph.places[first.end]
        along = _along(a, b, a, start)
        if along > _NONE and _beside(a, b, a, start, pruning.from_start, pruning.from_edge):
            route = Route(first.end, tuple(rest))
    if route.edges and pruning.goal:
        *rest, last = route.edges
        a, b = graph.places[last.start], graph.places[last.end]
        if _along(a, b, b, goal) < -_NONE and _beside(a, b, b, goal, pruning.from_goal, pruning.from_edge):
            route = Route(route.first, tuple(rest))
    return route


_NONE = 1e-6
"""Cosine and length (m) below which there is none."""


def _along(a: FloatArray, b: FloatArray, node: FloatArray, pose: FloatArray) -> float:
    """Cosine of the angle between an edge from a to b and the line from one of them to a pose; 0 where a line has no length."""
    edge, to_pose = b - a, pose[:2] - node
    lengths = math.hypot(*edge), math.hypot(*to_pose)
    return float(edge @ to_pose) / (lengths[0] * lengths[1]) if min(lengths) >= _NONE else 0.0


def _beside(a: FloatArray, b: FloatArray, node: FloatArray, pose: FloatArray, least: float, most: float) -> bool:
    """Whether a pose is further than `least` from a node of the edge from a to b, and no further than `most` from that edge."""
    edge = b - a
    square = float(edge @ edge)
    share = min(max(float((pose[:2] - a) @ edge) / square, 0.0), 1.0) if square >= _NONE else 0.0
    apart = math.hypot(*(a + share * edge - pose[:2]))
    return math.hypot(*(pose[:2] - node)) > least and apart <= most
