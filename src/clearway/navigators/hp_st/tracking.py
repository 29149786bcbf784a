"""The tracking problem of a way: paper B's (2)-(3) with rows by time, solved by HP+TMPC's Gauss-Newton method."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.motion import reachable
from clearway.navigators.common.tracking.gauss_newton import refine
from clearway.navigators.common.tracking.problem import PENALTY, Problem, judge, project
from clearway.navigators.hp_st.environment.contact import Base, PredictedObstacles
from clearway.navigators.hp_st.search.costs import SearchCosts

_SURE = 1.5  # standard deviations of a forecast that the rows keep clear of
_LIKELY = 0.2  # hypotheses less probable than that make no rows
_ITERATIONS = 30  # interior-point iterations for each linearisation


@kernel
def track(
    obstacles: PredictedObstacles, costs: SearchCosts, start: FloatArray, states: FloatArray, commands: FloatArray, base: Base, area: FloatArray,
    period: float, rounds: int, effort: float, heading_weight: float,
) -> FloatArray:  # fmt: skip
    """A plan (N, 2) that tracks `states` (N + 1, 5), smoother and clear of the rows where it can be.

    Args:
        obstacles: As the search sees them.
        costs: What the search weighs, of which the distance kept from what stands counts here.
        start: (5,) x, y, theta, v, omega now.
        states: (N + 1, 5) that are to be followed.
        commands: (N, 2) that lead along `states`.
        base: The robot's base.
        area: (4,) x_min, y_min, x_max, y_max of where the robot's centre may be, in metres.
        period: Control period in seconds.
        rounds: Linearisations, at most.
        effort: Weight of the commands' changes against the distance to `states`.
        heading_weight: Weight of the heading's error beside the position's, in metres per radian.
    """
    n = len(commands)
    low, high = reachable(base.limits, start[3], start[4], n, period)
    m, s = len(obstacles.radius), len(obstacles.still)
    rows, counts = np.empty((n, m + s, 3)), np.zeros(n, np.int64)
    outer = base.foot.circumscribed
    for k in range(n):
        x, y = states[k + 1, 0], states[k + 1, 1]
        for i in range(s):
            need = obstacles.still[i, 2] + outer + costs.soft
            if math.hypot(obstacles.still[i, 0] - x, obstacles.still[i, 1] - y) < need + 1.0:
                rows[k, counts[k], 0], rows[k, counts[k], 1] = obstacles.still[i, 0], obstacles.still[i, 1]
                rows[k, counts[k], 2] = need
                counts[k] += 1
        at = min(k + 1, len(obstacles.at) - 1)
        for i in range(m):
            need = obstacles.radius[i] + outer + _SURE * obstacles.spread[at, i]
            if (
                obstacles.chance[i] > _LIKELY
                and math.hypot(obstacles.at[at, i, 0] - x, obstacles.at[at, i, 1] - y) < need + 1.0
            ):
                rows[k, counts[k], 0], rows[k, counts[k], 1] = obstacles.at[at, i, 0], obstacles.at[at, i, 1]
                rows[k, counts[k], 2] = need
                counts[k] += 1
    box = np.empty((n, 4))
    for k in range(n):
        for j in range(2):
            box[k, j], box[k, 2 + j] = min(area[j], start[j]), max(area[2 + j], start[j])
    discount = np.empty(n)
    for k in range(n):
        discount[k] = 0.95**k
    problem = Problem(
        start[:3].copy(), start[3:].copy(), states[1:, :3].copy(), commands, rows, counts, np.zeros((0, 3)), 1.0,
        start[:2].copy(), np.full(n, math.inf), box, low, high, np.full(n, math.inf), discount, effort, heading_weight, period, True, n,
    )  # fmt: skip
    plan = commands.copy()
    project(problem, plan)
    total, _, summed = judge(problem, plan)
    merit = total + PENALTY * summed
    for _ in range(rounds):
        _, merit, more = refine(problem, plan, merit, _ITERATIONS)
        if not more:
            break
    return plan
