"""The mapping tour: where a person would drive a robot to show it a whole floor, and that person's driving.

Stops are chosen so that from one or another of them every wall can be seen from near that can be seen at all; they are
visited in a short closed round trip.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse
from scipy.ndimage import distance_transform_edt
from scipy.sparse.csgraph import dijkstra

from clearway.contract import Command, Decision, Scan, Sensing, Task
from clearway.errors import ClearwayError
from clearway.geometry.angles import wrap
from clearway.geometry.grid import FREE, OccupancyGrid
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.robots import Robot
from clearway.scenarios.plan import FloorPlan

SIGHT = 6.0
"""m from which a wall counts as seen from a stop."""

ENOUGH = 0.95
"""Share of the walls' cells, of those that can be seen at all, that the stops together must see."""

MARGIN = 0.12
"""m that the driver keeps clear of walls, beyond the robot's largest radius."""

COMFORT = 0.5
"""m of further clearance that the driver likes to have, and takes a detour for."""

SPEED, LOOKAHEAD = 0.4, 0.3
"""m/s that the driver drives, and m along the way that the driver looks ahead."""


def plan_tour(plan: FloorPlan, start: FloatArray, robot: Robot) -> FloatArray:
    """A closed way through the floor, from the start and back to it.

    Args:
        plan: The true floor, with its map.
        start: (3,) pose where the robot stands, map frame: m, m, rad.
        robot: The robot that has to fit through.

    Returns:
        (n, 2) points about 0.1 m apart, m.

    Raises:
        ClearwayError: the plan has no map, or the robot doesn't fit where it is to start.
    """
    if plan.map is None:
        raise ClearwayError("a mapping tour needs a plan with free floor marked in a map", file=plan.name)
    floor = _Floor(plan.map, circumscribed_radius(robot.shape) + MARGIN)
    home = floor.node(start)
    if home < 0:
        raise ClearwayError(f"robot {robot.name!r} does not fit at the start of the tour, {start[:2].tolist()}")
    reached = np.isfinite(dijkstra(floor.graph, indices=home))
    stops = [home, *_stops(plan, floor, home, reached)]
    between, trees = dijkstra(floor.graph, indices=stops, return_predecessors=True)
    between = between[:, stops]
    order = _round_trip(between)
    way = [home]
    for a, b in zip(order, np.roll(order, -1), strict=True):
        leg = [stops[b]]
        while leg[-1] != stops[a]:
            leg.append(int(trees[a][leg[-1]]))
        way += leg[-2::-1]
    return floor.points[way]


def _stops(plan: FloorPlan, floor: _Floor, home: int, reached: np.ndarray) -> list[int]:
    """Where to stop, besides at home: whatever sees most walls that were not seen yet, again and again."""
    coarse = np.round(floor.points / 0.5).astype(int)
    _, first = np.unique(coarse[reached], axis=0, return_index=True)
    candidates = [home, *(int(i) for i in np.nonzero(reached)[0][np.sort(first)])]
    walls = scene([f.shape for f in plan.fixtures], np.array([f.pose for f in plan.fixtures]))
    eye = beams(720, -math.pi, math.pi, 0.0, SIGHT)
    angles = np.linspace(-math.pi, math.pi, 720)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    views = []
    for i in candidates:
        ranges = sweep(walls, eye, np.array((*floor.points[i], 0.0)))
        hit = np.isfinite(ranges)
        cells = np.floor((floor.points[i] + ranges[hit, None] * directions[hit]) / 0.1).astype(int)
        views.append({(int(c), int(r)) for c, r in cells})
    every = set[tuple[int, int]]().union(*views)
    seen, stops = set(views[0]), []
    while len(seen) < ENOUGH * len(every):
        best = max(range(len(candidates)), key=lambda k: len(views[k] - seen))
        stops.append(candidates[best])
        seen |= views[best]
    return stops


class _Floor:
    """The floor that a disc can stand on, as a graph of points about 0.1 m apart; edges grow dearer near walls."""

    def __init__(self, grid: OccupancyGrid, radius: float) -> None:
        every = max(round(0.1 / grid.resolution), 1)
        clearance = distance_transform_edt(grid.data == FREE)[every // 2 :: every, every // 2 :: every]
        clearance = clearance * grid.resolution - 0.5 * grid.resolution
        number = np.full(clearance.shape, -1)
        free = clearance >= radius
        number[free] = np.arange(free.sum())
        row, col = np.nonzero(free)
        step = every * grid.resolution
        corner = np.asarray(grid.origin) + (every // 2 + 0.5) * grid.resolution
        self.points: FloatArray = corner + step * np.column_stack((col, row))
        dear = 1.0 + 2.0 * np.clip((radius + COMFORT - clearance[free]) / COMFORT, 0.0, 1.0)
        ends, costs = [], []
        padded = np.pad(number, 1, constant_values=-1)
        for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
            other = padded[row + 1 + dr, col + 1 + dc]
            here = np.nonzero(other >= 0)[0]
            ends.append(np.column_stack((here, other[here])))
            costs.append(step * math.hypot(dr, dc) * 0.5 * (dear[here] + dear[other[here]]))
        pairs = np.concatenate(ends) if ends else np.empty((0, 2), dtype=int)
        n = len(self.points)
        half = sparse.coo_matrix((np.concatenate(costs), (pairs[:, 0], pairs[:, 1])), shape=(n, n)).tocsr()
        self.graph = half + half.T

    def node(self, pose: FloatArray) -> int:
        """The point nearest to a pose, -1 if none is within 0.3 m."""
        if not len(self.points):
            return -1
        away = np.hypot(*(self.points - pose[:2]).T)
        return int(np.argmin(away)) if away.min() <= 0.3 else -1


def _round_trip(between: FloatArray) -> list[int]:
    """A short closed order of stops from the first: nearest neighbour, then 2-opt until nothing helps."""
    n = len(between)
    order = [0]
    while len(order) < n:
        rest = [i for i in range(n) if i not in order]
        order.append(min(rest, key=lambda i: between[order[-1], i]))
    improved = True
    while improved:
        improved = False
        for i in range(1, n - 1):
            for j in range(i + 1, n):
                a, b, c, d = order[i - 1], order[i], order[j], order[(j + 1) % n]
                if between[a, c] + between[b, d] < between[a, b] + between[c, d] - 1e-9:
                    order[i : j + 1] = order[i : j + 1][::-1]
                    improved = True
    return order


class Teleoperator:
    """A pilot that sees the robot from outside and drives it along a way by pure pursuit; it keeps what was sensed.

    Args:
        way: (n, 2) points to drive along, map frame, m.

    Attributes:
        odometry: A (3,) pose in the odom frame for each control period: m, m, rad.
        scans: What the lidar gave in each control period.
        truth: The true (3,) pose in the map frame for each control period: m, m, rad.
    """

    def __init__(self, way: FloatArray) -> None:
        self._way = way
        self._next = 0
        self.odometry: list[FloatArray] = []
        self.scans: list[Scan] = []
        self.truth: list[FloatArray] = []

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Start at the way's beginning."""
        self._next = 0
        self._turn = min(robot.drive.omega_max, 0.8)
        self._speed = min(robot.drive.v_max, task.speed_limit)

    def decide(self, sensing: Sensing) -> Decision:
        """Steer towards the point ahead; turn on the spot where it lies far to the side."""
        if sensing.scan is not None:
            self.odometry.append(sensing.odom_pose.copy())
            self.scans.append(sensing.scan)
            self.truth.append(sensing.truth.copy())
        x, y, heading = sensing.truth
        last = len(self._way) - 1
        while self._next < last and math.hypot(*(self._way[self._next] - (x, y))) < LOOKAHEAD:
            self._next += 1
        dx, dy = self._way[self._next] - (x, y)
        distance = math.hypot(dx, dy)
        if self._next == last and distance < 0.5 * LOOKAHEAD:
            return Decision(Command(0.0, 0.0, arrived=True), sensing.truth)
        bearing = wrap(math.atan2(dy, dx) - heading)
        if abs(bearing) > 0.6:
            return Decision(Command(0.0, math.copysign(self._turn, bearing), arrived=False), sensing.truth)
        v = self._speed * (1.0 - abs(bearing) / 1.2)
        omega = 2.0 * v * math.sin(bearing) / max(distance, 0.1)
        omega = min(max(omega, -self._turn), self._turn)
        return Decision(Command(v, omega, arrived=False), sensing.truth)
