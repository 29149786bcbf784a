"""The nodes of a search and its open set, found by their place: a hash table, as the space of places is far larger."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.heap import pop, push
from clearway.navigators.nav2.planners.queue import order
from clearway.navigators.nav2.planners.smac_hybrid.motion import Integers, Singles

Longs = npt.NDArray[np.int64]

CHECKED, OPEN, VISITED, GOAL = 1, 2, 4, 8
"""A node's marks: it was looked at, and is free; it was expanded; it is a goal."""

_NO_NODE = -1


class Graph(NamedTuple):
    """The nodes, in the order in which they were met.

    Attributes:
        table: (2^k,) int32 node by hash, -1 where there is none.
        key: (n,) int64 its place.
        total: (n,) float32 cost of the way to it.
        x: (n,) float32 column, with fractions.
        y: (n,) float32 row, with fractions.
        heading: (n,) float32 heading, in steps.
        cost: (n,) float32 of the ground.
        mark: (n,) uint8 CHECKED to GOAL.
        motion: (n,) int32 by which it was reached, -1 for none.
        parent: (n,) int32 node from which it was reached, -1 for none.
        filled: (1,) int64 how many there are.
    """

    table: Integers
    key: Longs
    total: Singles
    x: Singles
    y: Singles
    heading: Singles
    cost: Singles
    mark: npt.NDArray[np.uint8]
    motion: Integers
    parent: Integers
    filled: Longs


class Open(NamedTuple):
    """The open set: each entry keeps the pose and the motion with which it came.

    Attributes:
        keys: (m,) int64 heap.
        items: (m,) int32 heap.
        node: (m,) int32.
        x: (m,) float32.
        y: (m,) float32.
        heading: (m,) float32.
        motion: (m,) int32.
        size: (2,) int64 entries in the heap, entries that ever were.
    """

    keys: Longs
    items: Integers
    node: Integers
    x: Singles
    y: Singles
    heading: Singles
    motion: Integers
    size: Longs


def make_graph(capacity: int) -> Graph:
    """An empty graph for `capacity` nodes, a power of two."""
    total, x, y, heading, cost = (np.empty(capacity, np.float32) for _ in range(5))
    motion, parent = np.empty(capacity, np.int32), np.empty(capacity, np.int32)
    table, key, mark = (
        np.full(2 * capacity, _NO_NODE, np.int32),
        np.empty(capacity, np.int64),
        np.empty(capacity, np.uint8),
    )
    return Graph(table, key, total, x, y, heading, cost, mark, motion, parent, np.zeros(1, np.int64))


def make_open(capacity: int) -> Open:
    """An empty open set for `capacity` entries."""
    x, y, heading = (np.empty(capacity, np.float32) for _ in range(3))
    items, node, motion = (np.empty(capacity, np.int32) for _ in range(3))
    return Open(np.empty(capacity, np.int64), items, node, x, y, heading, motion, np.zeros(2, np.int64))


@kernel
def clear(graph: Graph, queue: Open) -> None:
    """Forget all nodes and entries."""
    graph.table[:] = _NO_NODE
    graph.filled[0] = 0
    queue.size[:] = 0


@kernel
def node_at(graph: Graph, key: Any) -> Any:
    """The node of a place, a new one if there is none; -1: there is no room for it."""
    table, keys = graph.table, graph.key
    mask = np.int64(table.size - 1)
    mixed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    slot = np.int64(mixed >> np.uint64(33)) & mask
    while table[slot] >= 0:
        if keys[table[slot]] == key:
            return np.int64(table[slot])
        slot = (slot + 1) & mask
    n = graph.filled[0]
    if n >= keys.size:
        return _NO_NODE
    graph.filled[0] = n + 1
    table[slot], keys[n] = n, key
    graph.total[n] = np.inf
    graph.x[n], graph.y[n], graph.heading[n], graph.cost[n] = 0.0, 0.0, 0.0, 0.0
    graph.mark[n], graph.motion[n], graph.parent[n] = 0, -1, -1
    return n


@kernel
def enqueue(graph: Graph, queue: Open, node: Any, cost: Any) -> bool:
    """Put a node as it is now into the open set; whether there was room."""
    entry = queue.size[1]
    if entry >= queue.keys.size:
        return False
    queue.node[entry], queue.motion[entry] = node, graph.motion[node]
    queue.x[entry], queue.y[entry], queue.heading[entry] = graph.x[node], graph.y[node], graph.heading[node]
    queue.size[0] = push(queue.keys, queue.items, queue.size[0], order(cost, entry), entry)
    queue.size[1] = entry + 1
    return True


@kernel
def cheapest(graph: Graph, queue: Open) -> Any:
    """Take the cheapest entry off the open set that is not empty; its node, as the entry has it, -1 if it was expanded."""
    entry = queue.items[0]
    queue.size[0] = pop(queue.keys, queue.items, queue.size[0])
    node = np.int64(queue.node[entry])
    if graph.mark[node] & VISITED:
        return _NO_NODE
    graph.motion[node] = queue.motion[entry]
    graph.x[node], graph.y[node], graph.heading[node] = queue.x[entry], queue.y[entry], queue.heading[entry]
    return node
