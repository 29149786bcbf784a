"""Critics of the end of the path: GoalCritic, GoalAngleCritic.

Behaviour after nav2_mppi_controller/src/critics/{goal,goal_angle}_critic.cpp. The goal is the last pose of the path that
the path handler hands on.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ZERO, Floats, wrapped
from clearway.navigators.nav2.controllers.mppi.critics.rollouts import Rollouts, add
from clearway.navigators.nav2.controllers.mppi.parameters import (
    GoalAngleParameters,
    GoalParameters,
    MPPIParameters,
)


class GoalCritic:
    """Distance to the goal, near it."""

    def __init__(self, parameters: GoalParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        if rollouts.length <= self._parameters.threshold_to_consider:
            term = np.zeros_like(costs)
            samples, path = rollouts.samples, rollouts.path
            mean_distance(samples.x, samples.y, path.x[-1], path.y[-1], term)
            add(costs, term, self._parameters.cost_weight, self._parameters.cost_power)
        return False


class GoalAngleCritic:
    """Angle to the goal's heading, near it."""

    def __init__(self, parameters: GoalAngleParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        if rollouts.length <= self._parameters.threshold_to_consider:
            term = np.zeros_like(costs)
            mean_angle(rollouts.samples.yaw, rollouts.path.yaw[-1], self._parameters.symmetric_yaw_tolerance, term)
            add(costs, term, self._parameters.cost_weight, self._parameters.cost_power)
        return False


@kernel
def mean_distance(x: Floats, y: Floats, goal_x: np.float32, goal_y: np.float32, term: Floats) -> None:
    """Add to `term` (B,) the mean distance of each sample's points from a point, m."""
    steps, batch = x.shape
    total = np.zeros(batch, np.float32)
    for t in range(steps):
        row_x, row_y = x[t], y[t]
        for b in range(batch):
            dx, dy = row_x[b] - goal_x, row_y[b] - goal_y
            total[b] += np.sqrt(dx * dx + dy * dy)
    for b in range(batch):
        term[b] += total[b] / np.float32(steps)


@kernel
def mean_angle(yaw: Floats, goal: np.float32, symmetric: bool, term: Floats) -> None:
    """Add to `term` (B,) the mean angle between each sample's headings and a heading, or its opposite, if nearer."""
    steps, batch = yaw.shape
    total, half_turn = np.zeros(batch, np.float32), np.float32(math.pi)
    for t in range(steps):
        row = yaw[t]
        for b in range(batch):
            away = abs(wrapped(goal - row[b]))
            other = half_turn - away
            away = other if symmetric and other < away else away
            total[b] += away if away > ZERO else ZERO
    for b in range(batch):
        term[b] += total[b] / np.float32(steps)
