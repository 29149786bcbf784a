"""Critics of the costmap: CostCritic, ObstaclesCritic.

Behaviour after nav2_mppi_controller/src/critics/{cost,obstacles}_critic.cpp.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.costmaps.footprint import Frame, row_col
from clearway.navigators.common.costmaps.layers import ByteGrid
from clearway.navigators.common.mppi.functions import ZERO, Floats
from clearway.navigators.nav2.controllers.mppi.critics.rollouts import Rollouts, add
from clearway.navigators.nav2.controllers.mppi.parameters import CostParameters, MPPIParameters, ObstaclesParameters
from clearway.navigators.nav2.footprint import cost_at_pose
from clearway.navigators.nav2.seams import CostView

_INSCRIBED, _LETHAL, _UNKNOWN = 253, 254, 255


class Ground(NamedTuple):
    """The costmap as both critics look at it.

    Attributes:
        cost: (rows, columns).
        frame: Where its cells lie.
        polygon: (m, 2) the outline in base_link, m.
        outlined: Whether the outline is laid down where the centre's cost says that it could touch.
        possible: Least cost of the centre from which on the outline could touch; below 1: everywhere in inflated ground.
        tracks_unknown: Whether unknown cells are told from free ones.
    """

    cost: ByteGrid
    frame: Frame
    polygon: FloatArray
    outlined: bool
    possible: float
    tracks_unknown: bool


class CostCritic:
    """The costmap's cost on the way."""

    def __init__(self, parameters: CostParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters
        self._weight = np.float32(parameters.cost_weight) / np.float32(254.0)

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        p, view, samples = self._parameters, rollouts.view, rollouts.samples
        term = np.zeros_like(costs)
        ground = _ground(rollouts, p.consider_footprint, circumscribed_cost(view, within_inflation=True))
        near_goal = bool(rollouts.length < p.near_goal_distance)
        points = (samples.x.shape[0] - 1) // p.trajectory_point_step + 1
        fails = cost_on_the_way(
            samples.x,
            samples.y,
            samples.yaw,
            p.trajectory_point_step,
            ground,
            near_goal,
            p.near_collision_cost,
            p.critical_cost,
            p.collision_cost,
            term,
        )
        add(costs, term, float(self._weight / np.float32(points)), p.cost_power)
        return fails


class ObstaclesCritic:
    """Nearness to obstacles, read from the inflation's cost."""

    def __init__(self, parameters: ObstaclesParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        p, view, samples = self._parameters, rollouts.view, rollouts.samples
        critical, repulsive = np.zeros_like(costs), np.zeros_like(costs)
        ground = _ground(rollouts, p.consider_footprint, circumscribed_cost(view, within_inflation=False))
        fails = nearness_on_the_way(
            samples.x,
            samples.y,
            samples.yaw,
            ground,
            distances(view),
            0.0 if view.scaling == 0.0 else view.inflation,
            p.collision_margin_distance,
            bool(rollouts.length < p.near_goal_distance),
            p.collision_cost,
            critical,
            repulsive,
        )
        share = np.float32(p.repulsion_weight) * ((repulsive - repulsive.min()) / np.float32(samples.x.shape[0]))
        add(costs, np.float32(p.critical_weight) * critical + share, 1.0, p.cost_power)
        return fails


def circumscribed_cost(view: CostView, within_inflation: bool) -> float:
    """The inflation's cost where the outline could just touch; -1 without inflation, 0 where that reaches less far.

    Args:
        within_inflation: Whether the second holds (CostCritic; ObstaclesCritic doesn't look).
    """
    radius = view.circumscribed
    if view.inflation == 0.0:
        return -1.0
    if within_inflation and view.inflation < radius:
        return 0.0
    if radius <= view.inscribed:
        return float(_INSCRIBED)
    return float(int((_INSCRIBED - 1) * math.exp(-view.scaling * (radius - view.inscribed))))


def distances(view: CostView) -> Floats:
    """(2, 256) m to the nearest obstacle that a cost tells of: of the centre's, from the inscribed circle; of the outline's."""
    table = np.zeros((2, 256), np.float32)
    if view.scaling > 0.0:
        table[1, 1:] = view.inscribed + (math.log(_INSCRIBED) - np.log(np.arange(1, 256))) / view.scaling
        table[0, 1:] = table[1, 1:] - np.float32(view.inscribed)
    return table


def _ground(rollouts: Rollouts, outlined: bool, possible: float) -> Ground:
    view = rollouts.view
    return Ground(view.cost, rollouts.frame, view.footprint, outlined, possible, view.tracks_unknown)


@kernel
def _collides(ground: Ground, cost: int) -> bool:
    if cost == _INSCRIBED:
        return not ground.outlined
    if cost == _UNKNOWN:
        return not ground.tracks_unknown
    return cost == _LETHAL


@kernel
def cost_on_the_way(
    x: Floats,
    y: Floats,
    yaw: Floats,
    step: int,
    ground: Ground,
    near_goal: bool,
    near_collision: int,
    critical: float,
    collision: float,
    term: Floats,
) -> bool:
    """Add to `term` (B,) the cost at every `step`-th point of each sample, up to its first collision.

    Args:
        near_goal: Cost below `near_collision` doesn't count.
        near_collision: Cost from which on a point counts `critical`.
        collision: What a sample costs that collides.

    Returns:
        Whether all samples collide.
    """
    cost, frame, polygon, outlined, possible = (
        ground.cost,
        ground.frame,
        ground.polygon,
        ground.outlined,
        ground.possible,
    )
    origin_x, origin_y, edge = np.float32(frame.x), np.float32(frame.y), np.float32(frame.resolution)
    rows, cols = frame.rows, frame.cols
    severe, crash = np.float32(critical), np.float32(collision)
    steps, batch = x.shape
    hit = np.zeros(batch, np.bool_)
    for t in range(0, steps, step):
        row_x, row_y = x[t], y[t]
        for b in range(batch):
            if hit[b]:
                continue
            dx, dy = row_x[b] - origin_x, row_y[b] - origin_y
            here = _UNKNOWN
            if dx >= ZERO and dy >= ZERO:
                col, row = np.int64(dx / edge), np.int64(dy / edge)
                if col < cols and row < rows:
                    here = int(cost[row, col])
            if here == 0:
                continue
            under = here
            if outlined and (here >= possible or possible < 1.0):
                under = cost_at_pose(cost, frame, polygon, float(row_x[b]), float(row_y[b]), float(yaw[t, b]))
            if under >= _INSCRIBED and _collides(ground, under):
                term[b] = crash
                hit[b] = True
            elif here >= near_collision:
                term[b] += severe
            elif not near_goal:
                term[b] += np.float32(here)
    return bool(hit.all())


@kernel
def nearness_on_the_way(
    x: Floats,
    y: Floats,
    yaw: Floats,
    ground: Ground,
    distance: Floats,
    inflation: float,
    margin: float,
    near_goal: bool,
    collision: float,
    critical: Floats,
    repulsive: Floats,
) -> bool:
    """Add up how near each sample comes to obstacles, up to its first collision.

    Args:
        distance: (2, 256) m that a cost of the centre, of the outline tells of.
        inflation: Radius, m; 0 where no distance can be told.
        margin: Distance below which nearness is critical, m.
        near_goal: Nothing repels.
        collision: What is critical in a sample that collides.
        critical: (B,) added to, m.
        repulsive: (B,) added to, m.

    Returns:
        Whether all samples collide.
    """
    cost, frame, polygon, outlined, possible = (
        ground.cost,
        ground.frame,
        ground.polygon,
        ground.outlined,
        ground.possible,
    )
    reach, close = np.float32(inflation), np.float32(margin)
    steps, batch = x.shape
    hit = np.zeros(batch, np.bool_)
    for t in range(steps):
        row_x, row_y = x[t], y[t]
        for b in range(batch):
            if hit[b]:
                continue
            px, py = float(row_x[b]), float(row_y[b])
            row, col = row_col(frame, px, py)
            here, of_outline = _UNKNOWN, 0
            if row >= 0:
                here = int(cost[row, col])
                if outlined and (here >= possible or possible < 1.0):
                    here, of_outline = cost_at_pose(cost, frame, polygon, px, py, float(yaw[t, b])), 1
            if here == 0:
                continue
            if here >= _INSCRIBED and _collides(ground, here):
                hit[b] = True
                critical[b] = np.float32(collision)
                continue
            if reach > ZERO:
                away = distance[of_outline, here]
                if away < close:
                    critical[b] += close - away
                if not near_goal:
                    repulsive[b] += reach - away
    return bool(hit.all())
