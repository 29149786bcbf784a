"""One decision of MPC-CBF in compiled code: the reference, the barriers, problem (10), what is sent where it has no solution.

Equations are numbered as in the paper: J. Zeng, B. Zhang, K. Sreenath, "Safety-critical model predictive control with
discrete-time control barrier function", American Control Conference 2021 (arXiv 2007.11718).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.crowds.orca_walls import near_edges
from clearway.crowds.walls import Walls, from_edge
from clearway.crowds.ways import Ways, way_point
from clearway.forecasts.forecast import Forecast
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.motion import reachable
from clearway.navigators.common.tracking.gauss_newton import solve_gauss_newton
from clearway.navigators.common.tracking.problem import (
    ITERATION_LIMIT,
    TOLERANCE,
    Problem,
    judge,
    project,
    roll_out,
    shift,
)
from clearway.robots.drive_limits import DriveLimits

FOLLOWED, RELAXED, BRAKED, LIMITED, PATHLESS = range(5)
"""What a decision came to: (10) solved; it has no solution, and the inputs that break (10f) least; these would touch something, or
break it no less than braking does: it brakes; the budget ended the search; there is no way to the goal."""

COST = 0.1
"""By what the cost of (10a) is multiplied: its minimum is the same, and the penalty by which the solver keeps (10f) outweighs it."""
_FLAT = 20.0  # m, radius at most of the disc that stands for a wall


class Settings(NamedTuple):
    """What doesn't change during a trial.

    Attributes:
        period: Control period, s.
        horizon: N, periods.
        gamma: Share of a barrier that may be lost in a period (6).
        effort: Weight of the inputs in q of (10a).
        terminal: Weight of p in (10a), beside q's.
        heading_weight: Of the heading's error in q and p, m/rad.
        radius: Of the robot with its padding, m.
        distance: What is farther away is overlooked, m.
        ahead: How far along the way the point to head for is looked for, m.
        area: (4,) x_min, y_min, x_max, y_max for the robot's centre, m; X of (10c).
        limits: Of the base; U of (10c).
    """

    period: float
    horizon: int
    gamma: float
    effort: float
    terminal: float
    heading_weight: float
    radius: float
    distance: float
    ahead: float
    area: FloatArray
    limits: DriveLimits


class Decision(NamedTuple):
    """A decision and how it was found.

    Attributes:
        inputs: (N, 2) v [m/s] and omega [rad/s]; the first ones are sent.
        states: (N, 3) poses that they lead to.
        reference: (N, 3) poses that were aimed at.
        outcome: FOLLOWED, RELAXED, BRAKED, LIMITED or PATHLESS.
        violation: By how much (10f) is broken at most, m of the barrier.
        iterations: Of the interior point.
        cut: Whether the budget ended the search.
    """

    inputs: FloatArray
    states: FloatArray
    reference: FloatArray
    outcome: int
    violation: float
    iterations: int
    cut: bool


@kernel
def reference_along(settings: Settings, ways: Ways, pose: FloatArray) -> tuple[FloatArray, bool]:
    """(N, 3) poses along the way to the goal at full speed, slower where the goal is near; and whether there is a way."""
    limits, c = settings.limits, settings.period
    out = np.empty((settings.horizon, 3))
    x, y, theta, leads = pose[0], pose[1], pose[2], True
    for k in range(settings.horizon):
        px, py, left = way_point(ways, x, y, settings.ahead)
        away = math.hypot(px - x, py - y)
        if left == math.inf:
            leads = leads and k > 0
        elif away > 1e-9:
            step = min(c * min(limits.v_max, math.sqrt(2.0 * min(limits.deceleration, 1e6) * left)), away)
            theta = math.atan2(py - y, px - x)
            x, y = x + step * (px - x) / away, y + step * (py - y) / away
        out[k, 0], out[k, 1], out[k, 2] = x, y, theta
    return out, leads


@kernel
def barriers(
    settings: Settings, forecast: Forecast, walls: Walls, pose: FloatArray, states: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(M, 3) x, y, distance of contact [m] of all that h is of (17) now, and (N, M, 3) the same at each stage.

    A wall's edge is a disc that touches it from within where it is nearest to the pose at that stage of the plan `states`
    (N, 3), as large as the edge allows: nearly a half-plane along a wall, a point at its corner.
    """
    n, radius, reach = settings.horizon, settings.radius, settings.distance
    still, moving, edges = len(forecast.still), len(forecast.radius), len(walls.length)
    found, squared = np.empty(edges, np.int64), np.empty(edges)
    near = near_edges(pose[0], pose[1], radius + reach, walls, found, squared)
    now, later = np.empty((still + moving + near, 3)), np.empty((n, still + moving + near, 3))
    m = 0
    for i in range(still + moving):
        j = i - still
        x, y = (
            (forecast.path[j, 0, 0, 0], forecast.path[j, 0, 0, 1])
            if j >= 0
            else (forecast.still[i, 0], forecast.still[i, 1])
        )
        need = radius + (forecast.radius[j] if j >= 0 else forecast.still[i, 2])
        if math.hypot(x - pose[0], y - pose[1]) > need + reach:
            continue
        now[m, 0], now[m, 1], now[m, 2] = x, y, need
        for k in range(n):
            if j >= 0:
                x, y = forecast.path[j, 0, k + 1, 0], forecast.path[j, 0, k + 1, 1]
            later[k, m, 0], later[k, m, 1], later[k, m, 2] = x, y, need
        m += 1
    for i in range(near):
        edge = found[i]
        dx, dy, size = walls.direction[edge, 0], walls.direction[edge, 1], _FLAT
        for k in range(-1, n):
            x, y = (pose[0], pose[1]) if k < 0 else (states[k, 0], states[k, 1])
            ox, oy = from_edge(x, y, edge, walls)
            x, y = x - ox, y - oy
            along = (x - walls.vertex[edge, 0]) * dx + (y - walls.vertex[edge, 1]) * dy
            size = max(min(size, along, walls.length[edge] - along), 0.0)
            if k < 0:
                now[m, 0], now[m, 1] = x, y
            else:
                later[k, m, 0], later[k, m, 1] = x, y
        now[m, 0], now[m, 1], now[m, 2] = now[m, 0] - size * dy, now[m, 1] + size * dx, size + radius
        for k in range(n):
            later[k, m, 0], later[k, m, 1], later[k, m, 2] = (
                later[k, m, 0] - size * dy, later[k, m, 1] + size * dx, size + radius,
            )  # fmt: skip
        m += 1
    return now[:m].copy(), later[:, :m].copy()


@kernel
def pose_problem(
    settings: Settings,
    reference: FloatArray,
    now: FloatArray,
    later: FloatArray,
    pose: FloatArray,
    velocity: FloatArray,
) -> Problem:
    """Problem (10): from `pose` (3,) at `velocity` (2,), past `barriers`."""
    n, c, limits = settings.horizon, settings.period, settings.limits
    low, high = reachable(limits, velocity[0], velocity[1], n, c)
    area, weights = np.empty((n, 4)), np.full(n, COST)
    weights[n - 1] *= settings.terminal
    for k in range(n):
        for j in range(2):  # never beyond where it is: a robot at the rim must not be asked for the impossible
            area[k, j], area[k, 2 + j] = min(settings.area[j], pose[j]), max(settings.area[2 + j], pose[j])
    return Problem(
        pose.copy(), velocity.copy(), reference, np.zeros((n, 2)), later, np.full(n, later.shape[1]), now, settings.gamma,
        pose[:2].copy(), np.full(n, math.inf), area, low, high, np.full(n, c * limits.deceleration), weights,
        COST * settings.effort, settings.heading_weight, c, True, n,
    )  # fmt: skip


@kernel
def touches(later: FloatArray, states: FloatArray) -> bool:
    """Whether one of the poses `states` (N, 3) lies within a distance of contact."""
    for k in range(len(states)):
        for i in range(later.shape[1]):
            if math.hypot(states[k, 0] - later[k, i, 0], states[k, 1] - later[k, i, 1]) < later[k, i, 2] - TOLERANCE:
                return True
    return False


@kernel
def decide(
    settings: Settings, forecast: Forecast, walls: Walls, ways: Ways, pose: FloatArray, velocity: FloatArray,
    plan: FloatArray, budget: int,
) -> Decision:  # fmt: skip
    """The inputs of this period and the next ones.

    Args:
        settings: See there.
        forecast: From the instant of `pose` on, in periods.
        walls: Of the map.
        ways: To the goal.
        pose: (3,) of the robot.
        velocity: (2,) v [m/s] and omega [rad/s].
        plan: (N, 2) inputs of the last decision.
        budget: Interior-point iterations.
    """
    reference, leads = reference_along(settings, ways, pose)
    warm = shift(plan)
    nothing = np.zeros((0, 3))
    free = pose_problem(settings, reference, nothing, np.zeros((settings.horizon, 0, 3)), pose, velocity)
    project(free, warm)
    now, later = barriers(settings, forecast, walls, pose, roll_out(free, warm))
    problem = pose_problem(settings, reference, now, later, pose, velocity)
    solution = solve_gauss_newton(problem, warm, budget)
    inputs, states, violation = solution.inputs, solution.states, solution.violation
    cut = solution.status == ITERATION_LIMIT
    outcome = FOLLOWED if leads else PATHLESS
    if violation > TOLERANCE:
        outcome = LIMITED if cut else RELAXED
        brake = np.zeros_like(inputs)
        project(problem, brake)
        _, worst, summed = judge(problem, brake)
        if touches(later, states) or summed <= judge(problem, inputs)[2] + TOLERANCE:
            outcome, inputs, states, violation = BRAKED, brake, roll_out(problem, brake), worst
    return Decision(inputs, states, reference, outcome, violation, solution.iterations, cut)
