"""HL-RRT*: a tree that lives on from one control period to the next (Chen, He, Li 2019, as paper B describes it).

tick: forward pruning; learn the mixture
  while it may think: grow by a chunk of samples; best candidate, lazily checked
  no candidate at the horizon or the goal: any node nearer to the goal than the robot
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from clearway.contract import Budget
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hl_rrt.checking import Scene, look, make_checked
from clearway.navigators.hl_rrt.growing import Limits, choose, elites, grow, refresh_root
from clearway.navigators.hl_rrt.parameters import Parameters
from clearway.navigators.hl_rrt.robust_em import robust_em
from clearway.navigators.hl_rrt.sampling import Source, WaypointCache, cholesky, window
from clearway.navigators.hl_rrt.tree import NONE, Tree, advance, edges, make_tree, path, plant, restore

_LEARN = (1e-2, 100)
"""Tolerance [m] and iterations of robust EM: it says where to sample, no more."""

_CHECKED = 1 << 15
"""Slots of the table of checked edges."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What a tick found.

    Attributes:
        points: (k, 2) m from the robot to the path's end; (0, 2): no valid path to a node nearer the goal.
        cost: Its length, m; inf without one.
        complete: Whether it ends at the horizon or in the goal region.
        iterations: Samples spent.
        cut: Whether the budget ended the search before it was finished.
    """

    points: FloatArray
    cost: float
    complete: bool
    iterations: int
    cut: bool


class _Incumbent:
    """The best valid path of a tick. Rewiring can spoil it, by an edge that looks shorter until it is checked."""

    def __init__(self) -> None:
        self.value = math.inf
        self._nodes = self._names = np.empty(0, np.int64)

    def update(self, tree: Tree, leaf: int, goal: FloatArray) -> int:
        """The end of the better one of the valid path to `leaf` (-1: there is none) and the best so far, which the tree
        gets back."""
        value = math.inf if leaf == NONE else float(tree.cost[leaf]) + math.dist(tree.position[leaf], goal)
        if self.value < value and restore(tree, self._nodes, self._names):
            return int(self._nodes[-1])
        self.value = value
        if leaf != NONE:
            self._nodes = path(tree, leaf)
            self._names = tree.name[self._nodes]
        return leaf


class Planner:
    """The tree, the waypoint cache and the learnt mixture.

    Args:
        parameters: Those of the method.
        area: (4,) x_min, y_min, x_max, y_max that the path stays in, m.
        rng: For the cache and the key of the samples' stream.
    """

    def __init__(self, parameters: Parameters, area: FloatArray, rng: np.random.Generator) -> None:
        self._p = p = parameters
        self._area = area
        self._reach = p.horizon + p.step
        self._key = np.uint64(rng.integers(0, 2**64, dtype=np.uint64))
        self._cache = WaypointCache(p.cache, rng)
        self._tree = make_tree(p.capacity, self._reach, p.step)
        self._checked = make_checked(_CHECKED)
        self._found, self._queue = np.zeros(p.capacity, np.int64), np.zeros(p.capacity, np.int64)
        self._shares = np.cumsum([p.goal_share, p.horizon_share, p.cache_share, p.mixture_share])
        self._tick = 0
        self._way: list[int] = []  # nodes of the plan, the root first
        self._steps, self._mean, self._covariance = np.empty(0), np.empty((0, 2)), np.empty((0, 3))
        self._scene: Scene | None = None

    def forget(self, at: FloatArray) -> None:
        """A new goal: forget everything but the robot's place `at` (2,)."""
        plant(self._tree, at[0], at[1])
        self._way = []
        self._steps = np.empty(0)
        self._cache.clear()

    def plan(
        self, at: FloatArray, goal: FloatArray, tolerance: float, discs: FloatArray, executed: float,
        budget: Budget, began: float,
    ) -> Plan:  # fmt: skip
        """One tick.

        Args:
            at: (2,) where the robot is, m.
            goal: (2,) where it is to go, m.
            tolerance: Radius of the goal region, m.
            discs: (n, 3) x, y, R [m] that the robot's centre must keep out of, where they are now.
            executed: Nodes of the last plan this near to `at` are behind the robot, m.
            budget: An iteration is one sample.
            began: `time.perf_counter()` at which a budget of seconds began.
        """
        p, tree = self._p, self._tree
        self._tick += 1
        keep = self._prune(at, executed)
        old = NONE if keep == NONE else int(tree.name[keep])
        self._scene = scene = look(discs, at[0], at[1], self._reach, p.step)
        self._learn(goal, scene)
        box = window(at, p.horizon, self._area)
        gamma = p.gamma * math.sqrt(3.0 * float(np.prod(box[2:] - box[:2])) / math.pi)
        limits = Limits(p.step, p.spacing, gamma, p.horizon, self._reach, tolerance, self._area)
        source = Source(
            at, goal, p.horizon, p.cone, self._shares, box, self._cache.points, self._steps, self._mean,
            cholesky(self._covariance),
        )  # fmt: skip
        refresh_root(tree, limits, self._found)
        most = p.cap if budget.iterations is None else min(p.cap, budget.iterations)
        iterations, last, mark, cut = 0, 0, math.inf, False
        best = _Incumbent()
        while True:
            leaf = self._choose(limits, goal, old, any_nearer=False)
            leaf = best.update(tree, leaf, goal)
            if leaf != NONE:
                keep = leaf
                if best.value < mark * (1.0 - p.improvement):
                    mark, last = best.value, iterations
                elif iterations - last >= p.patience:
                    break
            chunk = p.chunk if leaf != NONE else max(p.chunk, iterations // 4)  # a look is dear where there is no way
            count = min(chunk, most - iterations)
            cut = most < p.cap and count == 0
            cut |= budget.seconds is not None and time.perf_counter() - began >= budget.seconds
            if cut or count == 0:
                break
            grow(tree, source, limits, self._key, self._tick, iterations, count, keep, self._found)
            iterations += count
        complete = leaf != NONE
        if not complete:
            leaf = self._choose(limits, goal, old, any_nearer=True)
        return self._take(leaf, complete, iterations, cut)

    def edges(self) -> FloatArray:
        """(n, 4) x0, y0, x1, y1 [m] of the tree."""
        return edges(self._tree)

    @property
    def scene(self) -> Scene | None:
        """The obstacles as the last tick saw them."""
        return self._scene

    @property
    def mixture(self) -> FloatArray:
        """(c, 3) the learnt components: mean [m] and the radius of a disc of their covariance's size, m."""
        size = np.sqrt(0.5 * (self._covariance[:, 0] + self._covariance[:, 2]))
        return np.column_stack([self._mean, size])

    def _choose(self, limits: Limits, goal: FloatArray, last: int, *, any_nearer: bool) -> int:
        assert self._scene is not None
        return choose(
            self._tree, self._scene, self._checked, self._tick, limits, goal, last, any_nearer, self._found, self._queue
        )

    def _prune(self, at: FloatArray, executed: float) -> int:
        """Forward pruning; returns where the last plan's end is now, -1: gone."""
        node, way = 0, self._way
        for k in range(1, len(way)):
            if math.dist(self._tree.position[way[k]], at) > executed:
                break
            node = way[k]
        order = advance(self._tree, node, at[0], at[1], self._reach)
        places = np.flatnonzero(order == (way[-1] if way else NONE))
        return int(places[0]) if len(places) else NONE

    def _learn(self, goal: FloatArray, scene: Scene) -> None:
        p = self._p
        alpha, self._mean, self._covariance = robust_em(
            elites(self._tree, scene, goal, p.elite_share, p.elites), *_LEARN
        )
        self._steps = np.cumsum(alpha)

    def _take(self, leaf: int, complete: bool, iterations: int, cut: bool) -> Plan:
        if leaf == NONE:
            self._way = []
            return Plan(np.empty((0, 2)), math.inf, False, iterations, cut)
        nodes = path(self._tree, leaf)
        points = self._tree.position[nodes]
        self._way = [int(n) for n in nodes]
        self._cache.add(points[1:])
        return Plan(points, float(self._tree.cost[leaf]), complete, iterations, cut)
