"""One decision of HP+TMPC in compiled code: pose the tracking problem, solve it, settle on an input.

The nominal motion is committed when a plan is made and carried forward by the inputs that the tracking problem decides
(`Memory.nominal`); the base gets u = u_bar + K (x - x_bar), which is (3k). Its correction is known before the problem
is solved, so the input box and the rate limit of the first stage are shifted by it: what is sent keeps (3d) and (3e).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.tracking.gauss_newton import solve_gauss_newton
from clearway.navigators.common.tracking.problem import (
    INPUT_LIMIT,
    ITERATION_LIMIT,
    TOLERANCE,
    Solution,
    advance,
    judge,
    project,
    roll_out,
)
from clearway.navigators.hp_tmpc.heuristic_planner.belts import Reference
from clearway.navigators.hp_tmpc.heuristic_planner.planner import NO_PATH
from clearway.navigators.hp_tmpc.tube_mpc.posing import (
    AGE,
    FLAGS,
    STEP,
    BoolArray,
    Memory,
    Posed,
    Settings,
    pose_problem,
    sort_out,
)

STATUSES = ("tracking", "infeasible", "iteration limit", "input limit", "braking", "no path")
"""What a decision came to: constraints kept; no inputs keep them, so those that break them least; kept or broken, but the
budget ended the search; box and rate limit of the inputs exclude each other; braking breaks them less than all that the
search found; kept, but the planner found no path."""
TRACKING, INFEASIBLE, LIMIT, INPUTS, BRAKING, PATHLESS = range(6)


class Decision(NamedTuple):
    """A decision and how it was found.

    Attributes:
        v: Speed of the command, m/s.
        omega: Yaw rate of the command, rad/s.
        status: Index into STATUSES.
        cut: Whether the budget ended the search.
        iterations: What the solver spent.
        correction: ||K (x - x_bar)||.
        radius: f^SR(A + B K).
        states: (N, 3) predicted.
        tube: (N + 1,) w_k^rob, m.
        planned: As in `Posed`.
        reference: As in `Posed`.
    """

    v: float
    omega: float
    status: int
    cut: bool
    iterations: int
    correction: float
    radius: float
    states: FloatArray
    tube: FloatArray
    planned: bool
    reference: Reference


@kernel
def settle(settings: Settings, memory: Memory, posed: Posed, solution: Solution) -> Decision:
    """Turn the solver's answer into a command, and carry the nominal motion forward."""
    problem, inputs, violation = posed.problem, solution.inputs, solution.violation
    status = TRACKING
    if settings.feedback:  # (3k) as printed: the reference's inputs, and nothing is left to decide
        inputs = problem.nominal.copy()
        project(problem, inputs)
        _, violation, _ = judge(problem, inputs)
    if violation > TOLERANCE:
        status = INFEASIBLE
        brake = np.zeros_like(inputs)
        project(problem, brake)
        if judge(problem, brake)[2] < judge(problem, inputs)[2] - TOLERANCE:
            status, inputs = BRAKING, brake
    if status != BRAKING:
        if solution.status == INPUT_LIMIT:
            status = INPUTS
        elif solution.status == ITERATION_LIMIT:
            status = LIMIT
        elif status == TRACKING and memory.clock[FLAGS] & NO_PATH:
            status = PATHLESS
    first = inputs[0]
    x, y, theta = advance(
        memory.nominal[0], memory.nominal[1], memory.nominal[2], first[0], first[1], settings.period, not settings.model
    )
    memory.nominal[0], memory.nominal[1], memory.nominal[2] = x, y, theta
    memory.plan[:] = inputs
    limits = settings.limits
    memory.input[0] = min(max(first[0] + posed.correction[0], limits.v_min), limits.v_max)
    memory.input[1] = min(max(first[1] + posed.correction[1], -limits.omega_max), limits.omega_max)
    memory.clock[STEP] += 1
    memory.clock[AGE] += 1
    return Decision(
        memory.input[0], memory.input[1], status, solution.status == ITERATION_LIMIT, solution.iterations,
        math.hypot(posed.correction[0], posed.correction[1]), posed.radius, roll_out(problem, inputs), posed.tube,
        posed.planned, posed.reference,
    )  # fmt: skip


@kernel
def decide(
    settings: Settings,
    memory: Memory,
    position: FloatArray,
    velocity: FloatArray,
    radius: FloatArray,
    error: FloatArray,
    moving: BoolArray,
    pose: FloatArray,
    goal: FloatArray,
    draw: float,
    budget: int,
) -> Decision:
    """A whole decision with the Gauss-Newton solver.

    Args:
        settings: What stays the same in a trial.
        memory: What goes over from period to period; written.
        position: (n, 2) of the obstacles as perceived, m.
        velocity: (n, 2) of the obstacles, m/s.
        radius: (n,) of the obstacles, m.
        error: (n,) bound on their positions' errors, m.
        moving: (n,) bool, whether they are perceived as moving.
        pose: (3,) of the robot.
        goal: (3,) pose to reach.
        draw: Uniform in [0, 1), decides the planner's ties.
        budget: Interior-point iterations.
    """
    still, moving_obstacles = sort_out(position, velocity, radius, error, moving, settings.rho_rob)
    posed = pose_problem(settings, memory, still, moving_obstacles, pose, goal, draw, False)
    solution = solve_gauss_newton(posed.problem, posed.warm, budget)
    if solution.violation > TOLERANCE and not posed.planned:
        spent = solution.iterations
        posed = pose_problem(settings, memory, still, moving_obstacles, pose, goal, draw, True)
        solution = solve_gauss_newton(posed.problem, posed.warm, max(budget - spent, 0))
    return settle(settings, memory, posed, solution)
