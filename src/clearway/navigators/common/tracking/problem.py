"""The tracking problem of paper B (eqs. 1-3) as plain arrays: what a solver sees, and how an answer is judged.

A `Problem` holds numbers only. Whoever fills it has made the predictions (3b) and tightened the bounds (4)-(5) for
every stage. Stage k = 0 .. N-1 is the paper's kappa+1+k for states and obstacles and kappa+k for inputs: `inputs[k]`
leads from state k-1 (the start for k = 0) to state k. N is N^P; the last N^P - N^c inputs equal the one before them.
Frames and units: map frame, m, rad, s.

A plan (N, 2) of (v [m/s], omega [rad/s]) is an answer; solvers give plans that went through `project`, so the input
box (3d), the rate limit (3e) and the held inputs hold by construction wherever they are compatible at all. What can
be violated is told by `judge`.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import arc
from clearway.geometry.shapes import FloatArray

IntArray: TypeAlias = npt.NDArray[np.int64]

TOLERANCE = 1e-4
"""A plan whose largest violation is at most this [m] keeps the constraints."""

PENALTY = 100.0
"""Weight [1/m] of the sum of violations in the merit of a plan: larger than any multiplier, hence exact."""

CONVERGED, ITERATION_LIMIT, INFEASIBLE, INPUT_LIMIT = 0, 1, 2, 3
"""Status of a `Solution`: the method's own end; ended by the budget; no plan found that keeps (3c), (3f)-(3j), at
the method's own end; no input lies both in the box (3d) and within the rate limit (3e), so one of them is broken."""


class Problem(NamedTuple):
    """One tracking problem. All arrays float64 and C-contiguous, except `counts`.

    Attributes:
        start: (3,) measured (or nominal) pose at kappa.
        previous: (2,) input u_{kappa-1}.
        reference: (N, 3) x^ref.
        nominal: (N, 2) u^ref: not in the cost, a start for the search.
        rows: (N, M, 3) x, y, required distance [m] of centres, the tightening included (3g-3j); the first `counts[k]`
            of stage k count.
        counts: (N,) int64, how many rows of a stage count.
        passed: (M, 3) the rows at kappa, for `decay` < 1: row i is then the same obstacle in all stages; (0, 3) where that is 1.
        decay: Which share of its `barrier` a row may lose in a period, in (0, 1]: the condition of a discrete-time control
            barrier function. 1: the paper's (3g-3j), the distance alone.
        centre: (2,) of the circle in which the stages stay (3f): the position at kappa, m.
        reach: (N,) its radius for stage k, m; inf: none.
        area: (N, 4) x_min, y_min, x_max, y_max for the position at stage k (3c), +-inf: none. Headings are angles and
            have no bounds.
        low: (N, 2) lower end of the input box (3d).
        high: (N, 2) upper end of the input box (3d).
        smooth: (N,) bound on |u_k - u_{k-1}| (3e), inf: none; [0] is against `previous`.
        discount: (N,) weight of stage k's error, see `discounts`.
        effort: Weight of the inputs, w_2.
        heading_weight: Scale of the heading's error beside the position's, m/rad.
        period: Control period c, s.
        exact: Whether a period's motion is the exact arc; else eq. 1 as printed.
        control_horizon: N^c: later inputs stay as they are; 1 .. N.
    """

    start: FloatArray
    previous: FloatArray
    reference: FloatArray
    nominal: FloatArray
    rows: FloatArray
    counts: IntArray
    passed: FloatArray
    decay: float
    centre: FloatArray
    reach: FloatArray
    area: FloatArray
    low: FloatArray
    high: FloatArray
    smooth: FloatArray
    discount: FloatArray
    effort: float
    heading_weight: float
    period: float
    exact: bool
    control_horizon: int


class Solution(NamedTuple):
    """A solver's answer.

    Attributes:
        inputs: (N, 2) plan; inputs[0] is u_kappa.
        states: (N, 3) poses that it leads to.
        cost: Its cost (eq. 2).
        violation: The largest violation of (3c), (3f)-(3j), m; at most `TOLERANCE`: the plan keeps the constraints.
        iterations: What was spent, in the solver's own unit.
        status: One of CONVERGED, ITERATION_LIMIT, INFEASIBLE, INPUT_LIMIT.
    """

    inputs: FloatArray
    states: FloatArray
    cost: float
    violation: float
    iterations: int
    status: int


@kernel
def discounts(horizon: int, w1: float, step: int, literal: bool) -> FloatArray:
    """(N,) weights of the errors in eq. 2: w_1^(k-kappa), or as printed w_1^(k/(kappa+1)) with kappa = `step`."""
    out = np.empty(horizon)
    for k in range(horizon):
        out[k] = w1 ** ((step + 1.0 + k) / (step + 1.0)) if literal else w1 ** (k + 1.0)
    return out


@kernel
def advance(
    x: float, y: float, theta: float, v: float, omega: float, period: float, exact: bool
) -> tuple[float, float, float]:
    """The next pose: along the exact arc, or by eqs. 1a-1c as printed (whose second-order term lacks its 1/2)."""
    if exact:
        return arc(x, y, theta, v, omega, period)
    c, s = math.cos(theta), math.sin(theta)
    return (
        x + period * (v * c - period * omega * v * s),
        y + period * (v * s + period * omega * v * c),
        wrap(theta + period * omega),
    )


@kernel
def roll_out(problem: Problem, inputs: FloatArray) -> FloatArray:
    """(N, 3) poses that the plan `inputs` (N, 2) leads to from the start; headings in (-pi, pi]."""
    states = np.empty((len(inputs), 3))
    x, y, theta = problem.start[0], problem.start[1], problem.start[2]
    for k in range(len(inputs)):
        x, y, theta = advance(x, y, theta, inputs[k, 0], inputs[k, 1], problem.period, problem.exact)
        states[k, 0], states[k, 1], states[k, 2] = x, y, theta
    return states


@kernel
def barrier(dx: float, dy: float, need: float) -> float:
    """(|d|^2 - need^2) / (2 need) [m] at (dx, dy) from a row's centre: near its rim the clearance, negative inside."""
    return (dx * dx + dy * dy - need * need) / (2.0 * need)


@kernel
def row_before(problem: Problem, k: int, i: int) -> tuple[float, float, float]:
    """Row `i` one stage before stage `k`: x, y, required distance [m]."""
    if k == 0:
        return problem.passed[i, 0], problem.passed[i, 1], problem.passed[i, 2]
    return problem.rows[k - 1, i, 0], problem.rows[k - 1, i, 1], problem.rows[k - 1, i, 2]


@kernel
def judge(problem: Problem, inputs: FloatArray) -> tuple[float, float, float]:
    """The cost (eq. 2) of a plan, the largest and the summed violation of (3c), (3f)-(3j) [m]."""
    total, worst, summed = 0.0, 0.0, 0.0
    x, y, theta = problem.start[0], problem.start[1], problem.start[2]
    for k in range(len(inputs)):
        v, omega, x_before, y_before = inputs[k, 0], inputs[k, 1], x, y
        x, y, theta = advance(x, y, theta, v, omega, problem.period, problem.exact)
        dx, dy = x - problem.reference[k, 0], y - problem.reference[k, 1]
        turn = problem.heading_weight * turn_between(problem.reference[k, 2], theta)
        total += problem.discount[k] * math.sqrt(dx * dx + dy * dy + turn * turn)
        total += problem.effort * (v * v + omega * omega)
        for excess in (
            problem.area[k, 0] - x,
            problem.area[k, 1] - y,
            x - problem.area[k, 2],
            y - problem.area[k, 3],
            math.hypot(x - problem.centre[0], y - problem.centre[1]) - problem.reach[k],
        ):
            if excess > 0.0:
                worst, summed = max(worst, excess), summed + excess
        for i in range(problem.counts[k]):
            dx, dy, need = x - problem.rows[k, i, 0], y - problem.rows[k, i, 1], problem.rows[k, i, 2]
            squared = dx * dx + dy * dy
            if problem.decay < 1.0 and need > 0.0:
                px, py, p_need = row_before(problem, k, i)
                excess = (1.0 - problem.decay) * barrier(x_before - px, y_before - py, p_need) - barrier(dx, dy, need)
                if excess > 0.0:
                    worst, summed = max(worst, excess), summed + excess
            elif squared < need * need and need > 0.0:
                excess = need - math.sqrt(squared)
                worst, summed = max(worst, excess), summed + excess
    return total, worst, summed


@kernel
def box(problem: Problem, k: int) -> tuple[float, float, float, float]:
    """v_low, v_high, omega_low, omega_high of input k < N^c; for the last one, which is held, of all stages that it
    serves. Where nothing lies in between, the middle counts."""
    a, b, c, d = problem.low[k, 0], problem.high[k, 0], problem.low[k, 1], problem.high[k, 1]
    if k == problem.control_horizon - 1:
        for j in range(k + 1, len(problem.low)):
            a, b = max(a, problem.low[j, 0]), min(b, problem.high[j, 0])
            c, d = max(c, problem.low[j, 1]), min(d, problem.high[j, 1])
    if a > b:
        a = b = 0.5 * (a + b)
    if c > d:
        c = d = 0.5 * (c + d)
    return a, b, c, d


@kernel
def project(problem: Problem, inputs: FloatArray) -> bool:
    """Move a plan (N, 2), in place, into the input boxes (3d) and the rate limits (3e), and hold its last inputs.

    Stage by stage: the plan's input is clipped to its box, then drawn towards the input before it as far as the rate
    limit asks. A plan that keeps all three stays as it is (up to rounding).

    Returns:
        False if some box can't be reached within the rate limit: the box is kept, the rate limit broken.
    """
    fits = True
    free = problem.control_horizon
    v, omega = problem.previous[0], problem.previous[1]
    for k in range(free):
        a, b, c, d = box(problem, k)
        z0, z1 = min(max(inputs[k, 0], a), b), min(max(inputs[k, 1], c), d)
        q0, q1 = min(max(v, a), b), min(max(omega, c), d)  # the box's nearest to the input before
        limit = problem.smooth[k]
        e0, e1 = q0 - v, q1 - omega
        room = limit * limit - e0 * e0 - e1 * e1
        d0, d1 = z0 - q0, z1 - q1
        if room < 0.0:
            fits = False
            t = 0.0
        else:
            long, along = d0 * d0 + d1 * d1, e0 * d0 + e1 * d1
            t = 1.0
            if long + 2.0 * along > room:
                t = max(0.0, (math.sqrt(along * along + long * room) - along) / long)
        v, omega = q0 + t * d0, q1 + t * d1
        inputs[k, 0], inputs[k, 1] = v, omega
    for k in range(free, len(inputs)):
        inputs[k, 0], inputs[k, 1] = v, omega
    return fits


@kernel
def copy(plan: FloatArray, out: FloatArray) -> None:
    """`plan` (N, 2) into `out`. A slice's assignment does the same, but takes seconds to compile."""
    for k in range(len(plan)):
        out[k, 0], out[k, 1] = plan[k, 0], plan[k, 1]


@kernel
def shift(plan: FloatArray) -> FloatArray:
    """The plan (N, 2) of the period before, one stage on, its last input repeated: where to start from now."""
    out = np.empty_like(plan)
    for k in range(len(plan)):
        out[k, 0], out[k, 1] = plan[min(k + 1, len(plan) - 1), 0], plan[min(k + 1, len(plan) - 1), 1]
    return out


@kernel
def seeds(problem: Problem) -> FloatArray:
    """(S, N, 2) plans worth starting from, projected: brake straight, brake while turning left or right, the
    reference's inputs, full speed straight, full speed in wide and tight arcs to either side, half speed."""
    n = len(problem.reference)
    v, fast = problem.high[0, 0], problem.high[0, 1]
    kinds = ((0.0, 0.0), (0.0, fast), (0.0, -fast), (v, 0.0), (v, 0.5 * fast), (v, -0.5 * fast), (v, fast), (v, -fast),
             (0.5 * v, 0.0), (0.5 * v, 0.7 * fast), (0.5 * v, -0.7 * fast))  # fmt: skip
    out = np.empty((len(kinds) + 1, n, 2))
    for i in range(len(kinds)):
        for k in range(n):
            out[i, k, 0], out[i, k, 1] = kinds[i]
    copy(problem.nominal, out[len(kinds)])
    for i in range(len(out)):
        project(problem, out[i])
    return out
