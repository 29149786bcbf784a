"""The shortest path among discs: the tangent visibility graph, searched by A* that makes it as it goes.

The shortest path runs along common tangents of the discs' circles and arcs between them. A node of the graph is a
circle with a direction (ring), an edge a tangent from ring to ring; whether it is clear of all discs is looked up only
when the search reaches it, so that most of the graph is never made.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.heap import pop, push
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.heuristic_planner.pieces import put, string_pieces
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import (
    TOUCH,
    advance,
    arc_leaves,
    segment_clear,
    sweep,
    tangent,
)

FOUND, NO_WAY, LESS = 0, 1, 2
"""`exact_path`: the shortest; there is none; free, but of a graph with fewer discs than mattered."""

MOST = 200
"""Discs that the graph holds at most: those that the shortest detours touch. All are looked at for collisions."""


@kernel
def exact_path(
    start: FloatArray, target: FloatArray, discs: FloatArray, area: FloatArray, bound: float
) -> tuple[int, FloatArray]:
    """(FOUND, NO_WAY or LESS, pieces) of the shortest path between two free points.

    Args:
        start: (2,) m, outside of all discs.
        target: (2,) m, outside of all discs.
        discs: (n, 3) x, y, radius [m].
        area: (4,) x_min, y_min, x_max, y_max that the path must keep to; infinite: none.
        bound: Length of a known path, m (inf: none known). Discs outside of the ellipse that it spans play no part.
    """
    sx, sy, tx, ty = start[0], start[1], target[0], target[1]
    near, less = _matter(sx, sy, tx, ty, discs, bound)
    m = len(near)
    rings = 2 * m + 2  # ring 2 i: clockwise around near disc i; 2 i + 1: counter-clockwise; then start, target
    string = np.empty((rings, 3))
    for i in range(m):
        x, y, r = discs[near[i], 0], discs[near[i], 1], discs[near[i], 2]
        put(string, 2 * i, x, y, -r)
        put(string, 2 * i + 1, x, y, r)
    origin, goal = rings - 2, rings - 1
    put(string, origin, sx, sy, 0.0)
    put(string, goal, tx, ty, 0.0)
    # an edge is from * rings + to; `best`: its cost up to its end; `before`: the edge that the search came by
    best = np.full(rings * rings, np.inf)
    before = np.full(rings * rings, -1, np.int64)
    done = np.zeros(rings * rings, np.bool_)
    keys, edges = np.empty(8 * rings), np.empty(8 * rings, np.int64)
    size: Any = np.int64(0)
    bound += 1e-9
    here, cost, last = origin, 0.0, -1
    ux, uy, room = 1.0, 0.0, math.inf
    while True:
        cx, cy, r = string[here, 0], string[here, 1], string[here, 2]
        if size + rings > len(keys):
            keys, edges = _longer(keys, edges, 2 * len(keys) + rings)
        for to in range(rings):
            edge = here * rings + to
            if (to >> 1 == here >> 1 and here != origin) or to == origin or done[edge]:
                continue
            exists, vx, vy, length = tangent(cx, cy, r, string[to, 0], string[to, 1], string[to, 2])
            if not exists:
                continue
            turn = 0.0 if here == origin else sweep(ux, uy, vx, vy, r)
            if turn > room:
                continue
            total = cost + turn * abs(r) + length
            ex, ey = string[to, 0] + string[to, 2] * vy, string[to, 1] - string[to, 2] * vx
            key = total + math.hypot(ex - tx, ey - ty)
            if total >= best[edge] or key > bound:
                continue
            best[edge] = total
            before[edge] = last
            size = push(keys, edges, size, key, edge)
        arrived = False
        while size > 0 and not arrived:
            last = edges[0]
            size = pop(keys, edges, size)
            if done[last]:
                continue
            done[last] = True
            origin_ring, here = last // rings, last % rings
            cx, cy, r = string[origin_ring, 0], string[origin_ring, 1], string[origin_ring, 2]
            _, ux, uy, length = tangent(cx, cy, r, string[here, 0], string[here, 1], string[here, 2])
            ax, ay = cx + r * uy, cy - r * ux
            own = near[origin_ring >> 1] if origin_ring != origin else -1
            other = near[here >> 1] if here != goal else -1
            ex, ey = ax + length * ux, ay + length * uy
            outside = ex < area[0] - TOUCH or ey < area[1] - TOUCH or ex > area[2] + TOUCH or ey > area[3] + TOUCH
            arrived = not outside and segment_clear(ax, ay, ux, uy, length, discs, own, other)
        if not arrived:
            return NO_WAY, np.zeros((0, 7))
        if here == goal:
            return (LESS if less else FOUND), string_pieces(_back(last, before, string, rings))
        cost = best[last]
        room = _room(near[here >> 1], string[here, 2], ux, uy, discs, area)


@kernel
def _matter(sx: float, sy: float, tx: float, ty: float, discs: FloatArray, bound: float) -> Any:
    """(indices of the discs for the graph, whether some that reach into the ellipse had to be left out)."""
    detour = np.empty(len(discs))
    count = 0
    for i in range(len(discs)):
        x, y, r = discs[i, 0], discs[i, 1], discs[i, 2]
        detour[i] = math.hypot(x - sx, y - sy) + math.hypot(x - tx, y - ty) - 2.0 * r
        if detour[i] <= bound + 1e-6:
            count += 1
        else:
            detour[i] = math.inf
    near = np.empty(min(count, MOST), np.int64)
    k = 0
    if count <= MOST:
        for i in range(len(discs)):
            if detour[i] < math.inf:
                near[k] = i
                k += 1
        return near, False
    for k in range(MOST):
        least = 0
        for i in range(len(discs)):
            if detour[i] < detour[least]:
                least = i
        near[k] = least
        detour[least] = math.inf
    return near, True


@kernel
def _room(i: int, r: float, ux: float, uy: float, discs: FloatArray, area: FloatArray) -> float:
    """How far [rad] disc i's circle can be run in r's direction from where heading u touches it."""
    cx, cy = discs[i, 0], discs[i, 1]
    x, y = cx + r * uy, cy - r * ux
    around = abs(r)
    angle = math.atan2(y - cy, x - cx)
    room = arc_leaves(cx, cy, r, x, y, math.inf, area)
    for j in range(len(discs)):
        dx, dy = discs[j, 0] - cx, discs[j, 1] - cy
        inner = discs[j, 2] - TOUCH
        square = dx * dx + dy * dy
        if j == i or square >= (around + inner) ** 2 or square <= (around - inner) ** 2:
            continue
        distance = math.sqrt(square)
        half = math.acos((around * around + square - inner * inner) / (2.0 * distance * around))
        middle = advance(angle, math.atan2(dy, dx), r)
        room = min(room, max(0.0, middle - half))
    return room


@kernel
def _back(edge: int, before: Any, string: FloatArray, rings: int) -> FloatArray:
    """(k, 3) the string of circles by which the search came to the end of `edge`."""
    count, e = 1, edge
    while e >= 0:
        count += 1
        e = before[e]
    path = np.empty((count, 3))
    e = edge
    for k in range(count - 1, 0, -1):
        i = e % rings
        put(path, k, string[i, 0], string[i, 1], string[i, 2])
        if k == 1:
            i = e // rings
            put(path, 0, string[i, 0], string[i, 1], string[i, 2])
        e = before[e]
    return path


@kernel
def _longer(keys: FloatArray, edges: Any, size: int) -> Any:
    more_keys, more_edges = np.empty(size), np.empty(size, np.int64)
    for i in range(len(keys)):
        more_keys[i], more_edges[i] = keys[i], edges[i]
    return more_keys, more_edges
