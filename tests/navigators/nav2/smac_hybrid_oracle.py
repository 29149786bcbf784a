"""A second, plain reading of Nav2's Hybrid-A* (nav2_smac_planner, branch main): objects for nodes, as its classes have them.

Shortest paths without obstacles are those of `clearway.geometry`, which have tests of their own against OMPL.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field

import numpy as np
from smac_oracle import drawn_cost

from clearway.geometry.dubins import along, changes, dubins, length, relative
from clearway.geometry.reeds_shepp import reeds_shepp

F = np.float32
NAUGHT, FAR, UNSEEN = F(0), F(np.inf), F(np.nan)


def rounded(value: float) -> int:
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


@dataclass(eq=False)
class Node:
    """NodeHybrid."""

    index: tuple[int, int, int]  # x, y, heading
    pose: tuple[F, F, F] = (NAUGHT, NAUGHT, NAUGHT)
    g: F = FAR
    valid: bool | None = None
    cost: F = UNSEEN
    visited: bool = False
    primitive: int | None = None
    parent: Node | None = None


@dataclass
class Settings:
    """SearchInfo and the rest, in cells."""

    radius: float
    bins: int = 72
    reverse: bool = False
    interpolate: bool = True
    penalties: dict[str, float] = field(default_factory=dict)
    quadratic: bool = False
    ratio: float = 3.5
    longest: float = 60.0
    max_cost: float = 200.0
    override: bool = False
    downsample: bool = True
    table: int = 401
    tolerance: float = 5.0
    limit: int = 1_000_000
    approach: int = 1000
    unknown: bool = True
    possible: int = -1
    outline: np.ndarray | None = None  # in cells
    heading_mode: str = "DEFAULT"
    coarse: int = 1


class ObstacleHeuristic:
    """ObstacleHeuristic, its queue sorted anew for each request."""

    def __init__(self, cost: np.ndarray, s: Settings, goal: tuple[F, F]) -> None:
        self.cost, self.s = cost, s
        self.step = 2 if s.downsample else 1
        self.rows, self.columns = (-(-n // self.step) for n in cost.shape)
        self.table = np.zeros((self.rows, self.columns), F)
        cell = int(goal[1]) // self.step, int(goal[0]) // self.step
        self.table[cell] = F(-0.00001)
        self.queue = [cell]

    def ground(self, r: int, c: int) -> F:
        k = self.step
        return F(self.cost[k * r : k * r + k, k * c : k * c + k].min())

    def __call__(self, x: int, y: int) -> F:
        start = y // self.step, x // self.step
        if self.table[start] <= 0:
            self.expand(start)
        return F(self.step) * self.table[start]

    def expand(self, start: tuple[int, int]) -> None:
        penalty = F(self.s.penalties["cost"])

        def far(cell: tuple[int, int]) -> F:
            return F(math.hypot(cell[0] - start[0], cell[1] - start[1]))

        heap = [(-self.table[cell] + far(cell), cell) for cell in self.queue]
        heapq.heapify(heap)
        while heap:
            _, cell = heapq.heappop(heap)
            if self.table[cell] > 0:
                continue
            here = self.table[cell] = -self.table[cell]
            for dr, dc in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
                other = cell[0] + dr, cell[1] + dc
                if not (3 < other[0] < self.rows - 3 and 3 < other[1] < self.columns - 3):
                    continue
                cost = self.ground(*other)
                if cost >= 253 or self.table[other] > 0:
                    continue
                weight = penalty * cost * cost / F(63504) if self.s.quadratic else penalty * cost / F(252)
                new = here + (np.sqrt(F(2)) if dr and dc else F(1)) * (F(1) + weight)
                if self.table[other] == 0 or -self.table[other] > new:
                    self.table[other] = -new
                    heapq.heappush(heap, (new + far(other), other))
            if cell == start:
                break
        self.queue = [cell for _, cell in heap]


class Search:
    """AStarAlgorithm<NodeHybrid> with its motion table, heuristics, collision checker and analytic expansion."""

    def __init__(self, cost: np.ndarray, s: Settings) -> None:
        self.cost, self.s = cost, s
        self.bin = F(2) * F(math.pi) / F(s.bins)
        self.radius = F(s.radius)
        self.nodes: dict[tuple[int, int, int], Node] = {}
        angle = F(2.0 * math.asin(math.sqrt(2.0) / float(F(2) * self.radius)))
        increments = F(1) if angle < self.bin else np.ceil(angle / self.bin)
        angle = increments * self.bin
        dx, dy = self.radius * np.sin(angle), self.radius - self.radius * np.cos(angle)
        dist = np.hypot(dx, dy)
        self.primitives = [(dist, F(0), F(0), "F"), (dx, dy, increments, "L"), (dx, -dy, -increments, "R")]
        if s.reverse:
            self.primitives += [
                (-dist, F(0), F(0), "F-"),
                (-dx, dy, -increments, "L-"),
                (-dx, -dy, increments, "R-"),
            ]
        if s.interpolate:
            for i in range(1, int(increments)):
                part = F(i) * self.bin
                r = dist / (F(2) * np.sin(part / F(2)))
                dx, dy = r * np.sin(part), r - r * np.cos(part)
                self.primitives += [(dx, dy, F(i), "L"), (dx, -dy, F(-i), "R")]
                if s.reverse:
                    self.primitives += [(-dx, dy, F(-i), "L-"), (-dx, -dy, F(i), "R-")]
        self.travel = []
        for _, _, turn, kind in self.primitives:
            arc = turn * self.bin
            straight = kind in ("F", "F-")
            self.travel.append(dist if straight else dist / (F(2) * np.sin(arc / F(2))) * arc)

    def node(self, x: int, y: int, heading: int) -> Node:
        return self.nodes.setdefault((x, y, heading), Node((x, y, heading)))

    def stands(self, pose: tuple[F, F, F]) -> tuple[bool, F]:
        x, y, heading = pose
        rows, columns = self.cost.shape
        column, row = int(x + F(0.5)), int(y + F(0.5))
        if x < 0 or y < 0 or row >= rows or column >= columns:
            return False, F(254)
        centre = int(self.cost[row, column])
        if self.s.outline is None:
            return centre < 253 or (centre == 255 and self.s.unknown), F(centre)
        if centre < self.s.possible:
            return True, F(centre)
        if centre in (253, 254) or (centre == 255 and not self.s.unknown):
            return False, F(centre)
        yaw = float(self.bin * F(int(heading)))
        c, si = math.cos(yaw), math.sin(yaw)
        worst = drawn_cost(
            self.cost,
            [(int(x) + 0.5 + px * c - py * si, int(y) + 0.5 + px * si + py * c) for px, py in self.s.outline],
        )
        return worst < 254 or (worst == 255 and self.s.unknown), F(centre)

    def valid(self, node: Node) -> bool:
        if node.valid is None:
            node.valid, node.cost = self.stands(node.pose)
        return node.valid

    def inside(self, x: float, y: float) -> bool:
        return 0 <= x < self.cost.shape[1] and 0 <= y < self.cost.shape[0]

    def shortest(self, a: Node, b: Node, radius: float):
        angles = [float(F(int(n.pose[2])) * self.bin) for n in (a, b)]
        ends = [(float(n.pose[0]), float(n.pose[1]), yaw) for n, yaw in zip((a, b), angles, strict=True)]
        seen = relative(*ends[0], *ends[1], float(radius))
        return (reeds_shepp if self.s.reverse else dubins)(*seen), ends

    def distance_heuristic(self, node: Node, goal: tuple[F, F, F], around: F) -> F:
        x, y, heading = node.index
        angle = self.bin * F(int(goal[2]))
        c, si = np.cos(angle), -np.sin(angle)
        dx, dy = F(x) - goal[0], F(y) - goal[1]
        turn = heading - float(goal[2])
        turn += self.s.bins if turn < 0 else 0
        rx, ry, rt = rounded(dx * c - dy * si), rounded(dx * si + dy * c), rounded(turn)
        half = self.s.table // 2
        paths = reeds_shepp if self.s.reverse else dubins
        radius = float(self.radius)
        if abs(rx) < half and abs(ry) < half:
            theta = self.s.bins - rt if ry < 0 else rt
            up = abs(ry)
            if theta == self.s.bins:
                theta, up = 0, up + 1
            start = (float(rx), float(up), theta * float(self.bin))
            return F(radius * length(paths(*relative(*start, 0.0, 0.0, 0.0, radius))))
        if around <= 0:
            start, end = (float(x), float(y), float(heading * self.s.bins)), tuple(map(float, goal))
            return F(radius * length(paths(*relative(*start, *end[:2], end[2] * self.s.bins, radius))))
        return F(0)

    def heuristic(self, node: Node) -> F:
        around = self.obstacles(node.index[0], node.index[1])
        return max(around, min(self.distance_heuristic(node, goal, around) for goal in self.goal_poses))

    def zone(self, goal: Node) -> bool:
        if self.s.tolerance < 1:
            return False
        gx, gy, heading = (float(v) for v in goal.pose)
        return any(
            math.hypot(x - gx, y - gy) <= self.s.tolerance and self.stands((F(x), F(y), F(heading)))[0]
            for x in range(self.cost.shape[1])
            for y in range(self.cost.shape[0])
        )

    def back(self, node: Node) -> list[tuple[float, ...]]:
        path = []
        at: Node | None = node
        while at is not None:
            path.append(tuple(float(v) for v in at.pose))
            at = at.parent
        return path[::-1]

    def run(self, start: tuple[float, float, int], goal: tuple[float, float, int]):
        """createPath: poses (x, y, heading in steps) from start to end, and iterations; None for an occupied goal."""
        s = self.s
        first = self.node(int(start[0]), int(start[1]), start[2])
        first.pose = (F(start[0]), F(start[1]), F(start[2]))
        modes = {"DEFAULT": [goal[2]], "BIDIRECTIONAL": [goal[2], (goal[2] + s.bins // 2) % s.bins]}
        goals = []
        for heading in modes.get(s.heading_mode, range(s.bins)):
            node = self.node(int(goal[0]), int(goal[1]), heading)
            node.pose = (F(goal[0]), F(goal[1]), F(heading))
            goals.append(node)
        self.obstacles = ObstacleHeuristic(self.cost, s, (F(goal[0]), F(goal[1])))
        usable = [(i, node) for i, node in enumerate(goals) if self.valid(node) or self.zone(node)]
        if not usable:
            return None, 0
        self.goals = [node for _, node in usable]
        self.goal_poses = [node.pose for node in self.goals]
        coarse = [node for i, node in usable if i % s.coarse == 0]
        fine = [node for i, node in usable if i % s.coarse]
        first.g = F(0)
        queue = [(F(0), 0, first, first.pose, None)]
        pushed, iterations, approached, wait = 1, 0, 0, 0
        closest = 2**31 - 1
        best, near = F(np.inf), first
        while iterations < s.limit and queue:
            _, _, node, pose, primitive = heapq.heappop(queue)
            if node.visited:
                continue
            node.pose, node.primitive = pose, primitive
            iterations += 1
            node.visited = True
            closest = min(closest, int(self.heuristic(node)))
            wanted = max(int(F(closest) / F(s.ratio)), math.ceil(s.ratio))
            wait = min(wait, wanted)
            if wait <= 0:
                wait = wanted
                found = self.expansion(node, coarse, fine)
                if found:
                    begin, poses, end = found
                    return [*self.back(begin), *poses, tuple(float(v) for v in end.pose)], iterations
            wait -= 1
            if node in self.goals:
                return (self.back(node) if node.parent else []), iterations
            if best < F(s.tolerance):
                approached += 1
                if approached >= s.approach:
                    break
            for child in self.neighbours(node):
                g = node.g + self.traversal(node, child)
                if g < child.g:
                    child.g, child.parent = g, node
                    h = self.heuristic(child)
                    if h < best:
                        best, near = h, child
                    heapq.heappush(queue, (F(g + h), pushed, child, child.pose, child.primitive))
                    pushed += 1
        return (self.back(near) if best < F(s.tolerance) else []), iterations

    def neighbours(self, node: Node) -> list[Node]:
        found = []
        angle = float(np.cos(self.bin * F(int(node.pose[2])))), float(np.sin(self.bin * F(int(node.pose[2]))))
        for k, (px, py, turn, _) in enumerate(self.primitives):
            x = F(float(px) * angle[0] - float(py) * angle[1] + float(node.pose[0]))
            y = F(float(px) * angle[1] + float(py) * angle[0] + float(node.pose[1]))
            heading = node.pose[2] + turn
            heading += F(self.s.bins) if heading < 0 else F(0)
            heading -= F(self.s.bins) if heading >= self.s.bins else F(0)
            if not self.inside(x, y):
                continue
            child = self.node(int(x), int(y), int(heading))
            if child.visited:
                continue
            before, child.pose = child.pose, (x, y, heading)
            if self.valid(child):
                child.primitive = k
                found.append(child)
            else:
                child.pose = before
        return found

    def traversal(self, node: Node, child: Node) -> F:
        p = {name: F(value) for name, value in self.s.penalties.items()}
        normalized = child.cost / F(252)
        kind = self.primitives[child.primitive][3]
        weight = p["cost"] * normalized * (normalized if self.s.quadratic else F(1))
        cost = self.travel[child.primitive] * (F(1) - p["retrospective"] + weight)
        if kind not in ("F", "F-") and node.primitive is not None:
            same = self.primitives[node.primitive][3] == kind
            cost = cost * (p["straight"] if same else p["straight"] + p["change"])
        return cost * p["reverse"] if kind.endswith("-") else cost

    def analytic(self, node: Node, goal: Node, radius: float):
        """getAnalyticPath: [(node, pose)], empty if it will not do, and its changes of direction."""
        pieces, (start, _) = self.shortest(node, goal, radius)
        d = F(float(radius) * length(pieces))
        root = np.sqrt(F(2))
        if d > F(self.s.longest) or d < root:
            return [], 0
        steps = int(d / root)
        nodes, before, previous, failed = [], [], node, False
        for i in range(1, steps + 1):
            if i == steps:
                x, y, theta = float(goal.pose[0]), float(goal.pose[1]), float(F(int(goal.pose[2])) * self.bin)
            else:
                px, py, turn = along(pieces, length(pieces) * float(F(i) / F(steps)))
                c, si = math.cos(start[2]), math.sin(start[2])
                x, y = start[0] + radius * (c * px - si * py), start[1] + radius * (si * px + c * py)
                theta = (start[2] + turn) % (2 * math.pi)
            heading = F(theta / float(self.bin))
            if not self.inside(x, y):
                failed = True
                break
            other = self.node(int(x), int(y), int(heading) % self.s.bins)
            old, other.pose = other.pose, (F(x), F(y), heading)
            if not self.valid(other) or other is previous:
                other.pose, failed = old, True
                break
            nodes.append((other, other.pose))
            before.append((other, old))
            previous = other
        costs = [other.cost for other, _ in nodes]
        if not failed and max(costs) > self.s.max_cost:
            left = False
            for cost in reversed(costs):
                if cost <= self.s.max_cost:
                    left = True
                elif left:
                    failed = True
                    break
            if failed and d < 2 * math.pi * self.radius and self.s.override:
                failed = False
        for other, old in before:
            other.pose = old
        return ([], 0) if failed else (nodes, changes(pieces))

    def score(self, nodes) -> F:
        if len(nodes) < 2:
            return F(np.inf)
        (ax, ay, _), (bx, by, _) = nodes[0][1], nodes[1][1]
        step = np.hypot(bx - ax, by - ay)
        total = F(0)
        for node, _ in nodes:
            normalized = node.cost / F(252)
            total = F(float(total) + float(step) * (1.0 + float(F(self.s.penalties["cost"]) * normalized)))
        return total

    def refined(self, node: Node, goal: Node, nodes, turns: int):
        test: Node | None = node
        for _ in range(8):
            for _ in range(5):
                test = test.parent if test else None
            if test is None:
                break
            other, other_turns = self.analytic(test, goal, float(self.radius))
            if not other:
                break
            if other_turns <= turns:
                node, nodes, turns = test, other, other_turns
        original = best = self.score(nodes)
        radius = self.radius
        while radius < F(4) * self.radius:
            radius = F(radius + F(0.5))
            other, other_turns = self.analytic(node, goal, float(radius))
            score = self.score(other)
            better, simpler = score <= best and other_turns <= turns, score <= original and other_turns < turns
            if better or simpler:
                nodes, turns, best = other, other_turns, score
        return best, node, nodes

    def expansion(self, node: Node, coarse: list[Node], fine: list[Node]):
        best, found = F(np.inf), None
        any_valid = False
        for goals in (coarse, fine):
            for goal in goals:
                nodes, turns = self.analytic(node, goal, float(self.radius))
                if nodes:
                    any_valid = True
                    score, begin, nodes = self.refined(node, goal, nodes, turns)
                    if score < best and nodes:
                        best = score
                        poses = [tuple(float(v) for v in p) for other, p in nodes if other.index != goal.index]
                        found = begin, poses, goal
            if not any_valid:
                break
        return found
