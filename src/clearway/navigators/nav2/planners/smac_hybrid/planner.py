"""Nav2's SmacPlannerHybrid: the costmap, Hybrid-A*, the smoother.

Behaviour read from ros-navigation/navigation2, nav2_smac_planner/include/nav2_smac_planner/smac_planner_hybrid_impl.hpp.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.angles import TURN, wrap
from clearway.geometry.shapes import FloatArray
from clearway.navigators.nav2.planners.grids import Grid, Place, grid_of, place, to_world
from clearway.navigators.nav2.planners.parameters import SmacHybridParameters, SmootherParameters
from clearway.navigators.nav2.planners.smac_hybrid.analytic import Expansion, make_trails
from clearway.navigators.nav2.planners.smac_hybrid.distance_heuristic import Table, make_table
from clearway.navigators.nav2.planners.smac_hybrid.graph import make_graph, make_open
from clearway.navigators.nav2.planners.smac_hybrid.ground import make_ground
from clearway.navigators.nav2.planners.smac_hybrid.motion import Motion, make_motion
from clearway.navigators.nav2.planners.smac_hybrid.obstacle_heuristic import ObstacleHeuristic
from clearway.navigators.nav2.planners.smac_hybrid.search import FOUND, NO_ROOM, OCCUPIED, Ahead, Task, search
from clearway.navigators.nav2.planners.smoother import Smoother
from clearway.navigators.nav2.seams import CostView, GoalOccupied, NoPath, StartOccupied

_WITHOUT_BOUND = 2**31 - 1

_ROOM = 1 << 15
"""Nodes that there is room for at first; a search that needs more begins anew with four times as many."""

_RATE = 1e5
"""Nodes that are visited in a second of `max_planning_time`: a stand-in, see navigators/nav2/DECISIONS.md."""


class SmacHybrid:
    """`nav2_smac_planner::SmacPlannerHybrid`, a `Planner`."""

    def __init__(self, parameters: SmacHybridParameters, smoother: SmootherParameters | None = None) -> None:
        p = self._parameters = parameters
        self._factor = p.downsampling_factor if p.downsample_costmap else 1
        self._smoother_parameters = smoother or SmootherParameters()
        self._obstacles = ObstacleHeuristic(
            p.cost_penalty, p.use_quadratic_cost_penalty, p.downsample_obstacle_heuristic
        )
        self._resolution = 0.0
        self._make_room(_ROOM)
        self.reset()

    def reset(self) -> None:
        """See `Planner`."""
        self._goal: tuple[Place, int] | None = None
        self._obstacles.forget()

    def plan(self, start: FloatArray, goal: FloatArray, view: CostView) -> FloatArray:
        """See `Planner`.

        Raises:
            NoPath: start or goal lie off the map, the goal is occupied, nothing leads there, or it took too long.
        """
        p = self._parameters
        self._fit(view.resolution)
        grid = grid_of(view, self._factor)
        here, there = place(grid.frame, start, "start"), place(grid.frame, goal, "goal")
        first, last = self._heading(start[2]), self._heading(goal[2])
        if (int(here.x), int(here.y), first) == (int(there.x), int(there.y), last):
            return np.array([(start[0], start[1], goal[2])])
        keep = p.cache_obstacle_heuristic and self._goal == (there, last)
        self._goal = there, last
        field = self._obstacles.towards(view.cost, float(there.x), float(there.y), keep)
        bins = p.angle_quantization_bins
        at_goal = {"DEFAULT": [last], "BIDIRECTIONAL": [last, (last + bins // 2) % bins]}
        limit = min(
            p.max_iterations if p.max_iterations > 0 else _WITHOUT_BOUND, math.ceil(p.max_planning_time * _RATE)
        )
        task = Task(
            np.array((here.x, here.y, first), np.float32),
            np.array((there.x, there.y), np.float32),
            np.array(at_goal.get(p.goal_heading_mode, range(bins)), np.int64),
            max(1, p.coarse_search_resolution) if p.goal_heading_mode == "ALL_DIRECTION" else 1,
            np.float32(p.tolerance) / np.float32(grid.frame.resolution),
            limit,
            p.max_on_approach_iterations if p.max_on_approach_iterations > 0 else _WITHOUT_BOUND,
        )
        cells, visited = self._search(grid, view, Ahead(field, self._table), task)
        if len(cells) == 0:
            if visited == 1:
                raise StartOccupied(f"the start is blocked after {visited} nodes")
            why = "no path" if visited < limit else "too many iterations"
            raise NoPath(f"{why} after {visited} nodes")
        path = np.empty((len(cells), 3))
        path[:, :2] = to_world(grid.frame, cells[:, :2].astype(np.float64))
        path[:, 2] = [wrap(float(yaw)) for yaw in np.floor(cells[:, 2]) * self._motion.bin_size]
        if p.smooth_path and visited > 1:
            self._smoother.smooth(path, grid, view)
        return path

    def _search(self, grid: Grid, view: CostView, ahead: Ahead, task: Task) -> tuple[FloatArray, int]:
        """The path's poses (n, 3) in cells and steps of heading, none if there is none, and how many nodes were visited."""
        p = self._parameters
        ground = make_ground(grid, view, p.angle_quantization_bins, p.allow_unknown)
        while True:
            end, cells, visited = search(
                self._graph, self._open, ground, self._motion, self._expansion, self._trails, ahead, task
            )
            if end == OCCUPIED:
                raise GoalOccupied("the goal is occupied")
            if end != NO_ROOM:
                return (cells if end == FOUND else cells[:0]), visited
            self._make_room(4 * len(self._graph.key))

    def _make_room(self, nodes: int) -> None:
        self._graph, self._open = make_graph(nodes), make_open(4 * nodes)

    def _fit(self, resolution: float) -> None:
        """Make what depends on the size of a cell."""
        if resolution == self._resolution:
            return
        p, self._resolution = self._parameters, resolution
        cell = resolution * self._factor
        radius = max(p.minimum_turning_radius, resolution * p.downsampling_factor)
        self._motion: Motion = make_motion(p, radius / cell)
        self._table: Table = make_table(self._motion, float(np.float32(p.lookup_table_size) / np.float32(cell)))
        self._expansion = Expansion(
            np.float32(p.analytic_expansion_ratio),
            np.float32(p.analytic_expansion_max_length / resolution),
            np.float32(p.analytic_expansion_max_cost),
            p.analytic_expansion_max_cost_override,
        )
        self._trails = make_trails(float(self._expansion.longest))
        self._smoother = Smoother(self._smoother_parameters, radius)

    def _heading(self, yaw: float) -> int:
        """The step nearest to a heading, rad."""
        bins = self._parameters.angle_quantization_bins
        steps = yaw / (TURN / bins)
        return int(math.copysign(math.floor(abs(steps) + 0.5), steps)) % bins
