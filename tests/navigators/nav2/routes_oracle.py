"""A second, plain reading of what Nav2's route server does beside the search: lines of cells, floods, pruning, paths.

Read from nav2_route/include/nav2_route/{goal_intent_search,corner_smoothing,utils}.hpp, nav2_route/src/{goal_intent_extractor,
path_converter}.cpp and nav2_util/include/nav2_util/line_iterator.hpp; points are tuples, costmaps lists of rows.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

Point = tuple[float, float]
Cell = tuple[int, int]


def cell(grid: Sequence[Sequence[int]], origin: Point, resolution: float, p: Point) -> Cell | None:
    """(column, row) of a point, None off the map."""
    if p[0] < origin[0] or p[1] < origin[1]:
        return None
    x, y = int((p[0] - origin[0]) / resolution), int((p[1] - origin[1]) / resolution)
    return (x, y) if x < len(grid[0]) and y < len(grid) else None


def line(a: Cell, b: Cell) -> Iterator[Cell]:
    """The cells between two."""
    (x, y), (x1, y1) = a, b
    dx, dy = abs(x1 - x), abs(y1 - y)
    sx, sy = 1 if x1 >= x else -1, 1 if y1 >= y else -1
    num = max(dx, dy) // 2
    for _ in range(max(dx, dy) + 1):
        yield x, y
        num += min(dx, dy)
        if num >= max(dx, dy):
            num -= max(dx, dy)
            if dx >= dy:
                y += sy
            else:
                x += sx
        if dx >= dy:
            x += sx
        else:
            y += sy


def hits(cost: int) -> bool:
    """Whether a cell is one that nobody drives over."""
    return cost >= 253 and cost != 255


def reached(
    grid: Sequence[Sequence[int]], origin: Point, resolution: float, pose: Point, places: Sequence[Point], most: int
) -> int:
    """Which of some places is the nearest to a pose over free ground."""
    here, front = cell(grid, origin, resolution, pose), cell(grid, origin, resolution, places[0])
    if here is None or front is None or not any(hits(grid[y][x]) for x, y in line(front, here)):
        return 0
    wanted = [c for p in places if (c := cell(grid, origin, resolution, p)) is not None]
    queue, seen, n = deque([here]), {here}, 0
    while queue and n < most:
        n += 1
        x, y = queue.popleft()
        if (x, y) in wanted:
            return wanted.index((x, y))
        for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)):
            q = (x + dx, y + dy)
            inside = 0 <= q[0] < len(grid[0]) and 0 <= q[1] < len(grid)
            if inside and q not in seen and not hits(grid[q[1]][q[0]]):
                seen.add(q)
                queue.append(q)
    return 0


def closest(p: Point, a: Point, b: Point) -> Point:
    """Point of a segment nearest to p."""
    vx, vy = b[0] - a[0], b[1] - a[1]
    if vx * vx + vy * vy < 1e-6:
        return a
    t = -(vx * (a[0] - p[0]) + vy * (a[1] - p[1])) / (vx * vx + vy * vy)
    return a if t <= 0.0 else b if t >= 1.0 else (a[0] + t * vx, a[1] + t * vy)


def dot(ax: float, ay: float, bx: float, by: float) -> float:
    """Of two directions."""
    a, b = math.hypot(ax, ay), math.hypot(bx, by)
    return 0.0 if a < 1e-6 or b < 1e-6 else ax / a * bx / b + ay / a * by / b


def pruned(nodes: list[Point], start: Point, goal: Point, limits: tuple[bool, float, float, float]) -> list[Point]:
    """Nodes of a route without those at its ends that the robot needn't come to.

    Args:
        nodes: Of the route.
        start: Where it begins.
        goal: Where it ends.
        limits: Whether the goal's end is looked at, distances from edge, first and last node.
    """
    at_goal, edge, first, last = limits
    if len(nodes) < 2:
        return nodes
    a, b = nodes[0], nodes[1]
    ahead = dot(b[0] - a[0], b[1] - a[1], start[0] - a[0], start[1] - a[1]) > 1e-6
    if ahead and math.dist(a, start) > first and math.dist(closest(start, a, b), start) <= edge:
        nodes = nodes[1:]
    if len(nodes) < 2 or not at_goal:
        return nodes
    a, b = nodes[-2], nodes[-1]
    before = dot(b[0] - a[0], b[1] - a[1], goal[0] - b[0], goal[1] - b[1]) < -1e-6
    if before and math.dist(b, goal) > last and math.dist(closest(goal, a, b), goal) <= edge:
        nodes = nodes[:-1]
    return nodes


def path(nodes: list[Point], spacing: float, radius: float, widest: float, *, smooth: bool) -> list[tuple[float, ...]]:
    """The path along a route's nodes."""
    out: list[Point] = []

    def straight(a: Point, b: Point) -> None:
        n = math.ceil(np.float32(math.dist(a, b)) / np.float32(spacing))
        out.extend((a[0] + (b[0] - a[0]) / n * k, a[1] + (b[1] - a[1]) / n * k) for k in range(n))

    here = nodes[0]
    for i in range(1, len(nodes) - 1):
        corner, after = nodes[i], nodes[i + 1]
        arc = round_corner(here, corner, after, radius, widest) if smooth else None
        if arc is None:
            straight(here, corner)
            here = corner
            continue
        begin, end, centre = arc
        straight(here, begin)
        rs, re = (begin[0] - centre[0], begin[1] - centre[1]), (end[0] - centre[0], end[1] - centre[1])
        signed = math.atan2(rs[0] * re[1] - rs[1] * re[0], rs[0] * re[0] + rs[1] * re[1])
        n = max(1, math.ceil(abs(signed) / (spacing / radius)))
        for k in range(n):
            c, s = math.cos(k * signed / n), math.sin(k * signed / n)
            out.append((centre[0] + rs[0] * c - rs[1] * s, centre[1] + rs[0] * s + rs[1] * c))
        here = end
    if len(nodes) > 1:
        straight(here, nodes[-1])
    out.append(nodes[-1])
    yaws = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(out)]
    yaws.append(math.atan2(nodes[-1][1] - nodes[-2][1], nodes[-1][0] - nodes[-2][0]) if len(nodes) > 1 else 0.0)
    return [(*p, yaw) for p, yaw in zip(out, yaws, strict=True)]


def round_corner(
    start: Point, corner: Point, end: Point, radius: float, widest: float
) -> tuple[Point, Point, Point] | None:
    """Begin, end and centre of the arc in a corner."""
    one, two = math.dist(start, corner), math.dist(corner, end)
    if one == 0.0 or two == 0.0:
        return None
    a = ((start[0] - corner[0]) / one, (start[1] - corner[1]) / one)
    b = ((end[0] - corner[0]) / two, (end[1] - corner[1]) / two)
    cosine = a[0] * b[0] + a[1] * b[1]
    if abs(cosine) > 1.0:
        return None
    angle = math.acos(cosine)
    if angle < 1e-6 or angle > widest:
        return None
    tangent = radius / math.tan(angle / 2)
    if not (tangent < one and tangent < two):
        return None
    mx, my = a[0] + b[0], a[1] + b[1]
    far = radius / math.sin(angle / 2) / math.hypot(mx, my)
    return (
        (corner[0] + a[0] * tangent, corner[1] + a[1] * tangent),
        (corner[0] + b[0] * tangent, corner[1] + b[1] * tangent),
        (corner[0] + mx * far, corner[1] + my * far),
    )
