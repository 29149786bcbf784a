"""Second, plain readings of Nav2's Smac planners (nav2_smac_planner, branch main): slow, node by node, as its classes have it."""

from __future__ import annotations

import heapq
import itertools
import math

import numpy as np

from clearway.geometry.dubins import along, dubins, length, relative

F = np.float32


def astar_2d(
    cost: np.ndarray,
    start: tuple[int, int],
    goal: tuple[float, float],
    *,
    tolerance: float,
    multiplier: float = 1.0,
    unknown: bool = True,
    limit: int = 10**6,
    approach: int = 1000,
) -> tuple[list[tuple[int, int]], int]:
    """AStarAlgorithm<Node2D>: cells (x, y) from start to end, and the iterations; goal in cells with fractions."""
    rows, columns = cost.shape

    def valid(x: int, y: int) -> bool:
        return cost[y, x] < 253 or (cost[y, x] == 255 and unknown)

    def heuristic(x: int, y: int) -> F:
        dx, dy = F(goal[0]) - F(x), F(goal[1]) - F(y)
        return F(np.sqrt(dx * dx + dy * dy))

    target = int(goal[0]), int(goal[1])
    g = {start: F(0)}
    parent: dict[tuple[int, int], tuple[int, int]] = {}
    visited = set()
    queue = [(F(0), 0, start)]
    pushed = 1
    best, near = np.inf, start
    iterations = approached = 0

    def back(node: tuple[int, int]) -> list[tuple[int, int]]:
        if node not in parent:
            return []
        path = [node]
        while path[-1] in parent:
            path.append(parent[path[-1]])
        return path[::-1]

    while iterations < limit and queue:
        _, _, node = heapq.heappop(queue)
        if node in visited:
            continue
        iterations += 1
        visited.add(node)
        if node == target:
            return back(node), iterations
        if best < F(tolerance):
            approached += 1
            if approached >= approach:
                return back(near), iterations
        for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)):
            other = node[0] + dx, node[1] + dy
            if not (0 <= other[0] < columns and 0 <= other[1] < rows) or not valid(*other) or other in visited:
                continue
            normalized = F(cost[other[1], other[0]] / 252.0)
            travel = 1.0 + float(F(multiplier) * normalized)
            if dx and dy:
                travel = float(F(math.sqrt(2))) * travel
            total = g[node] + F(travel)
            if other not in g or total < g[other]:
                g[other], parent[other] = total, node
                h = heuristic(*other)
                if h < best:
                    best, near = h, other
                heapq.heappush(queue, (F(total + h), pushed, other))
                pushed += 1
    return (back(near) if best < F(tolerance) else []), iterations


def wrapped(angle: float) -> float:
    return math.atan2(math.sin(angle), math.cos(angle))


def drawn_cost(cost: np.ndarray, corners: list[tuple[float, float]]) -> int:
    """FootprintCollisionChecker::footprintCost: the outline in cells' units, drawn edge by edge."""
    rows, columns = cost.shape
    cells = []
    for x, y in corners:
        if x < 0 or y < 0 or int(x) >= columns or int(y) >= rows:
            return 254
        cells.append((int(x), int(y)))
    worst = 0
    edges = [*itertools.pairwise(cells), (cells[0], cells[-1])]
    for number, ((x0, y0), (x1, y1)) in enumerate(edges):
        dx, dy = abs(x1 - x0), abs(y1 - y0)
        sx, sy = (1 if x1 >= x0 else -1), (1 if y1 >= y0 else -1)
        longer, shorter = max(dx, dy), min(dx, dy)
        error, x, y, on_edge = longer // 2, x0, y0, 0
        for _ in range(longer + 1):
            here = int(cost[y, x])
            if here == 254:
                on_edge = 254
                break
            on_edge = max(on_edge, here)
            error += shorter
            if error >= longer:
                error -= longer
                x, y = (x, y + sy) if dx >= dy else (x + sx, y)
            x, y = (x + sx, y) if dx >= dy else (x, y + sy)
        worst = max(worst, on_edge)
        if worst == 254 and number < len(edges) - 1:
            return 254
    return worst


class Smoother:
    """nav2_smac_planner's Smoother, over lists of [x, y, yaw]; `radius` None: a path of cells (holonomic)."""

    def __init__(self, cost, origin, resolution, footprint, weights, radius) -> None:
        self.cost, self.origin, self.resolution, self.footprint = cost, origin, resolution, footprint
        self.tolerance, self.rounds, self.data, self.smooth_weight, self.refinements = weights
        self.radius, self.holonomic = radius, radius is None
        self.laid = 0

    def segments(self, path):
        if self.holonomic:
            return [(0, len(path) - 1)]
        found, start = [], 0
        for i in range(1, len(path) - 1):
            a, b, c = path[i - 1], path[i], path[i + 1]
            if (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0:
                found.append((start, i))
                start = i
            stands = abs(c[0] - b[0]) < 1e-4 and abs(c[1] - b[1]) < 1e-4
            if stands and abs(wrapped(c[2] - b[2])) > 1e-4:
                found.append((start, i))
                start = i
        return [*found, (start, len(path) - 1)]

    def orient(self, path) -> None:
        theta = math.atan2(path[2][1] - path[1][1], path[2][0] - path[1][0])
        self.reversing = not self.holonomic and abs(wrapped(theta - path[1][2])) > math.pi / 2
        for a, b in itertools.pairwise(path):
            dx, dy = b[0] - a[0], b[1] - a[1]
            if abs(dx) < 1e-4 and abs(dy) < 1e-4:
                continue
            a[2] = wrapped(math.atan2(dy, dx) + (math.pi if self.reversing else 0))

    def free(self, pose) -> bool:
        x, y = ((pose[k] - self.origin[k]) / self.resolution for k in range(2))
        if self.footprint is None:
            worst = int(self.cost[int(y), int(x)])
        else:
            c, s = math.cos(pose[2]), math.sin(pose[2])
            worst = drawn_cost(
                self.cost,
                [
                    (x + (c * px - s * py) / self.resolution, y + (s * px + c * py) / self.resolution)
                    for px, py in self.footprint
                ],
            )
        return worst <= 252 or worst == 255

    def implementation(self, path):
        """smoothImpl: the new path and whether it converged."""
        new, last = [list(p) for p in path], [list(p) for p in path]
        rounds, change = 0, self.tolerance
        while change >= self.tolerance:
            rounds, change = rounds + 1, 0.0
            if rounds >= self.rounds:
                self.orient(last)
                return last, False
            for i in range(1, len(path) - 1):
                for j in range(2):
                    y = new[i][j]
                    z = y + (
                        self.data * (path[i][j] - y) + self.smooth_weight * (new[i + 1][j] + new[i - 1][j] - 2.0 * y)
                    )
                    change += abs(z - y)
                    new[i][j] = z
            self.orient(new)
            if not all(self.free(p) for p in new[1:-1]):
                return last, False
            last = [list(p) for p in new]
        if self.left > 0:
            self.left -= 1
            new, _ = self.implementation(new)
        return new, True

    def smooth(self, path):
        for start, end in self.segments(path):
            if end - start > 10:
                self.left = self.refinements
                piece = [list(p) for p in path[start : end + 1]]
                first, last = list(piece[0]), list(piece[-1])
                piece, success = self.implementation(piece)
                if success and not self.holonomic:
                    self.enforce(piece, first, False)
                    self.enforce(piece, last, True)
                path[start : end + 1] = piece
        return path

    def expansion(self, start, end, steps, original):
        """findBoundaryExpansion: points and their length, or None."""
        pieces = dubins(*relative(*start, *end, self.radius))
        d = length(pieces) * self.radius
        if d > 2 * original:
            return None
        points = []
        for i in range(steps + 1):
            x, y, yaw = along(pieces, length(pieces) * i / steps)
            c, s = math.cos(start[2]), math.sin(start[2])
            at = [start[0] + self.radius * (c * x - s * y), start[1] + self.radius * (s * x + c * y), start[2] + yaw]
            column, row = (math.floor((at[k] - self.origin[k]) / self.resolution) for k in range(2))
            inside = 0 <= row < self.cost.shape[0] and 0 <= column < self.cost.shape[1]
            if not inside or self.cost[row, column] >= 253:
                return None
            points.append(at)
        total = sum(math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(points))
        return (total, points) if total > 0 else None

    def enforce(self, path, pose, at_end: bool) -> None:
        """enforceStartBoundaryConditions and enforceEndBoundaryConditions."""
        walked = path[::-1] if at_end else path
        reaches = [self.radius, 2 * self.radius, math.pi * self.radius, 2 * math.pi * self.radius]
        driven, found = 0.0, []
        for k in range(1, len(walked)):
            driven += math.dist(walked[k][:2], walked[k - 1][:2])
            if driven >= reaches[len(found)]:
                found.append((k, driven))
            if len(found) == 4:
                break
        options = []
        for k, original in found:
            ends = (walked[k], pose) if at_end else (pose, walked[k])
            option = self.expansion(*(ends[::-1] if self.reversing else ends), k, original)
            if option:
                options.append(option)
        if options:
            points = min(options, key=lambda option: option[0])[1]
            points = points[::-1] if self.reversing else points
            begin = len(path) - len(points) if at_end else 0
            path[begin : begin + len(points)] = points
            self.laid += 1
