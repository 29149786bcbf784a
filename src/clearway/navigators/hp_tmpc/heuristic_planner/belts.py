"""Moving obstacles in the heuristic planner: the dynamic steps 1 to 5 of paper B, and the reference that comes of them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.heuristic_planner.pieces import polyline, put, sample
from clearway.navigators.hp_tmpc.heuristic_planner.planner import BELT_LIMIT, TEMPORARY, plan_path
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import TOUCH

ITERATIONS = 10
"""Most rounds of steps 1 to 4."""

SPACING = 0.05
"""Between points of the polylines on arcs, m."""


class Reference(NamedTuple):
    """What the tracking system follows.

    Attributes:
        status: Sum of the flags in `planner`; 0: all is well.
        points: (count + 1, 3) x_ref, y_ref [m], theta_ref [rad] at steps 0 (the robot's pose itself) to `count`,
            equidistant in time; they stand still at the path's end.
        inputs: (count, 2) v_ref [m/s], omega_ref [rad/s] that lead from point k to k + 1.
        path: (k, 2) polyline of the whole path [m].
        other: (k2, 2) that of the rejected side, empty if none.
        belts: (m, 3) the predicted discs that were united into belts: x, y, inflated radius [m].
        length: Exact length of the path, m.
        target: (2,) where the path was asked to end (the goal, or the temporary target).
        rounds: Iterations of steps 1 to 4.
        side: 1 passes the first obstacle on its left, -1 on its right, 0 goes straight.
    """

    status: int
    points: FloatArray
    inputs: FloatArray
    path: FloatArray
    other: FloatArray
    belts: FloatArray
    length: float
    target: FloatArray
    rounds: int
    side: int


@kernel
def predict(
    position: FloatArray, velocity: FloatArray, radius: FloatArray, margin: FloatArray, period: float
) -> FloatArray:
    """(m, N + 1, 3) x, y, radius [m] of m obstacles at constant velocity, k = 0..N periods [s] from now.

    Args:
        position: (m, 2) of the obstacles, m.
        velocity: (m, 2) of the obstacles, m/s.
        radius: (m,) inflated, rho_rob + rho_obs + margin, m.
        margin: (m, N + 1) what uncertainty adds at step k, m: w_k^dyn (eq. 5) + w_k^rob (eq. 4).
    """
    m, steps = margin.shape
    discs = np.empty((m, steps, 3))
    for o in range(m):
        for k in range(steps):
            discs[o, k, 0] = position[o, 0] + k * period * velocity[o, 0]
            discs[o, k, 1] = position[o, 1] + k * period * velocity[o, 1]
            discs[o, k, 2] = radius[o] + margin[o, k]
    return discs


@kernel
def plan_reference(
    pose: FloatArray,
    goal: FloatArray,
    static: FloatArray,
    predicted: FloatArray,
    area: FloatArray,
    perception: float,
    speed: float,
    period: float,
    count: int,
    draw: float,
    exact: bool,
    keep: float,
) -> Reference:
    """The reference towards `goal` that avoids static discs, and moving ones over their predicted window (steps 1-5).

    Args:
        pose: (3,) of the robot.
        goal: (2,) m, or a pose (3,), whose heading is not used.
        static: (n, 3) x, y, inflated radius [m].
        predicted: (m, N + 1, 3) x, y, inflated radius of the moving discs at steps 0..N (see `predict`); N = N^P >= 1.
        area: (4,) x_min, y_min, x_max, y_max of where the centre may be; infinite: anywhere.
        perception: Radius of the perception field, m (inf: no temporary targets).
        speed: Reference speed v_ref > 0, m/s (see `reference_speed`).
        period: Control period c, s.
        count: How many steps to give, >= 1 (may exceed N).
        draw: Uniform in [0, 1), decides ties.
        exact: The tangent graph instead of the greedy rule.
        keep: As in `plan_path`: it holds on to the side of the plan before in a layout that is nearly symmetric.
    """
    zone = np.array([pose[0], pose[1], perception])
    target, temporary = _target(pose, goal, perception)
    m, steps = predicted.shape[0], predicted.shape[1]
    risky = np.zeros((m, steps), np.bool_)
    stations = np.empty(max(count, steps - 1) + 1)
    for k in range(len(stations)):
        stations[k] = k * speed * period
    discs, belts, rounds = static, 0, 0
    while True:
        path = plan_path(pose, target, discs, area, zone, draw, exact, keep)  # steps 1 and 3
        points = sample(path.pieces, stations, pose)
        rounds += 1
        more = _risks(points, predicted, risky)  # step 4
        if more == 0 or rounds == ITERATIONS:
            break
        belts += more
        discs = _with_belts(static, predicted, risky, belts)
    status = path.status | (TEMPORARY if temporary else 0) | (BELT_LIMIT if more > 0 else 0)
    inputs = np.empty((count, 2))
    put(points, 0, pose[0], pose[1], pose[2])
    for k in range(count):
        inputs[k, 0] = min(speed, max(0.0, path.length / period - k * speed))
        inputs[k, 1] = turn_between(points[k, 2], points[k + 1, 2]) / period
    return Reference(
        status, points[: count + 1].copy(), inputs, polyline(path.pieces, SPACING), polyline(path.other, SPACING),
        discs[len(static) :].copy(), path.length, target, rounds, path.side,
    )  # fmt: skip


@kernel
def _target(pose: FloatArray, goal: FloatArray, perception: float) -> tuple[FloatArray, bool]:
    """The goal, or where the straight line to it leaves the perception field; whether it is the latter."""
    dx, dy = goal[0] - pose[0], goal[1] - pose[1]
    distance = math.hypot(dx, dy)
    if distance <= perception:
        return np.array([goal[0], goal[1]]), False
    share = perception / distance
    return np.array([pose[0] + share * dx, pose[1] + share * dy]), True


@kernel
def _risks(points: FloatArray, predicted: FloatArray, risky: Any) -> int:
    """Mark the predicted discs that the robot meets; how many are new.

    The robot at step k is compared with the disc at steps k - 1, k and k + 1, as constraints (3h) to (3j) do; all steps
    of one obstacle between its first and last risky one are taken, so that its belt has no hole.
    """
    new = 0
    for o in range(predicted.shape[0]):
        steps = predicted.shape[1]
        first, last = steps, -1
        for i in range(steps):
            meets = risky[o, i]
            x, y, r = predicted[o, i, 0], predicted[o, i, 1], predicted[o, i, 2] - TOUCH
            for k in range(max(1, i - 1), min(steps, i + 2)):
                if (points[k, 0] - x) ** 2 + (points[k, 1] - y) ** 2 < r * r:
                    meets = True
            if meets:
                first, last = min(first, i), i
        for i in range(first, last + 1):
            if not risky[o, i]:
                risky[o, i] = True
                new += 1
    return new


@kernel
def _with_belts(static: FloatArray, predicted: FloatArray, risky: Any, belts: int) -> FloatArray:
    """(n + belts, 3) the static discs, then the risky predicted ones."""
    n = len(static)
    discs = np.empty((n + belts, 3))
    for i in range(n):
        put(discs, i, static[i, 0], static[i, 1], static[i, 2])
    for o in range(predicted.shape[0]):
        for i in range(predicted.shape[1]):
            if risky[o, i]:
                put(discs, n, predicted[o, i, 0], predicted[o, i, 1], predicted[o, i, 2])
                n += 1
    return discs


@kernel
def reference_speed(v_min: float, v_max: float, share: float) -> float:
    """v_ref [m/s]: the larger of `share` * v_max and the midpoint (v_min + v_max) / 2 of the robot's range of speeds.
    The paper's share is one half."""
    return max(share * v_max, 0.5 * (v_min + v_max))


@kernel
def turn_first(points: FloatArray, inputs: FloatArray, theta: float, beyond: float, rate: float, c: float) -> int:
    """Begin a reference with a turn on the spot where it leads off in too different a direction, in place.

    A differential drive can't follow a path that starts behind it, and a short horizon doesn't show that turning pays.

    Args:
        points: (n + 1, 3) reference poses.
        inputs: (n, 2) their v, omega.
        theta: Heading of the robot, rad.
        beyond: Deviation up to which the tracking system turns while it drives, rad.
        rate: Yaw rate of the turn, rad/s.
        c: Control period, s.

    Returns:
        How many periods the turn takes, 0: none; the rest of the reference comes that much later.
    """
    n = len(inputs)
    away = turn_between(theta, points[1, 2])
    moves = math.hypot(points[n, 0] - points[0, 0], points[n, 1] - points[0, 1]) > 1e-6
    if abs(away) <= beyond or not moves:
        return 0
    turn = min(math.ceil((abs(away) - 0.5 * beyond) / (rate * c)), n)
    for k in range(n, turn, -1):
        points[k] = points[k - turn]
        inputs[k - 1] = inputs[k - turn - 1]
    each = math.copysign(rate * c, away)
    for k in range(1, turn + 1):
        points[k, 0], points[k, 1] = points[0, 0], points[0, 1]
        points[k, 2] = wrap(theta + each * k)
        inputs[k - 1, 0], inputs[k - 1, 1] = 0.0, each / c
    return turn
