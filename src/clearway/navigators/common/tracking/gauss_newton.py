"""The default solver of the tracking problem: a Gauss-Newton method with a small interior point.

The motion is linearised about a plan, and so are the obstacle rows, to the half-plane that touches the circle where
it is nearest: conservative in position. (Where barriers decay, `Problem.decay` < 1, a row is about two successive poses, and
its part of the earlier one is not.) What remains is convex in the inputs and goes to `interior_point.minimise`;
its answer, projected into the input box and the rate limits, is the next plan if it has the lower merit, else the way
to it is halved. Merit = cost + PENALTY x summed violation, exact for a finite penalty. Rows out of reach are left out.
If the plan from the warm start ends in a violation, the best few of a fixed set of other starts are refined as well.

Deterministic, bounded in interior-point iterations, never raises, always has an answer.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.geometry.angles import turn_between
from clearway.geometry.compiled import kernel
from clearway.geometry.motion import sinc
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.tracking.interior_point import Program, minimise
from clearway.navigators.common.tracking.problem import (
    CONVERGED,
    INFEASIBLE,
    INPUT_LIMIT,
    ITERATION_LIMIT,
    PENALTY,
    TOLERANCE,
    IntArray,
    Problem,
    Solution,
    advance,
    barrier,
    box,
    copy,
    judge,
    project,
    roll_out,
    row_before,
    seeds,
)
from clearway.navigators.common.tracking.riccati import LinearMotion

BUDGET = 400
"""Interior-point iterations after which the answer hardly improves: what an unbounded budget means here."""

_STARTS = 3  # how many other starts are refined
_ROUNDS, _ROUNDS_OTHERS = 10, 5  # linearisations, at most, from the warm start and from each other
_GAIN = 1e-3  # a cost that falls by less than this share of it is the end
_CLOSER = 0.02  # so is, with a violation left, a merit that falls by less than this share of what the violation costs
_SPARE = 2e-4  # m, added to required distances: the motion's curvature, left out by linearising, may use it up
_MARGIN = 0.5  # m: rows whose clearance is larger don't enter the convex program
_MU, _MU_END, _LIMIT = 20.0, 1e-6, 30  # barrier parameter at the start (large: near a warm start's bounds a small one
# costs twice the iterations) and at the end; iterations of one convex program


class Search(NamedTuple):
    """Where a search stands; the kernels write into it.

    Attributes:
        best: (N, 2) the best plan among the starts that are done with.
        plan: (N, 2) the plan being refined.
        others: (S, N, 2) further starts.
        merits: (S,) theirs, inf for one that was taken.
        merit: (2,) of `best` (inf: none yet) and of `plan`.
        cursor: (5,) int64, counters at the indices `_SPENT`, `_DONE`, `_ROUND`, `_FITS` and `_SHORT`.
    """

    best: FloatArray
    plan: FloatArray
    others: FloatArray
    merits: FloatArray
    merit: FloatArray
    cursor: IntArray


_SPENT, _DONE, _ROUND, _FITS, _SHORT = 0, 1, 2, 3, 4
"""Iterations spent; starts done with, the warm one first; rounds of the one at work; whether box and rate limit of the
inputs are compatible; whether the budget ended the refinement of a start."""


@kernel
def solve_gauss_newton(problem: Problem, warm: FloatArray, budget: int) -> Solution:
    """The best plan found within `budget` interior-point iterations.

    Args:
        problem: The tracking problem.
        warm: (N, 2) plan to start from: `shift` of the last answer, or the reference's inputs.
        budget: Interior-point iterations, at least 0; `BUDGET` is as good as no bound. With 0 the answer is the warm
            plan, projected into the input box and rate limits, or braking, if that keeps the constraints better.

    Returns:
        The plan (inputs within box and rate limits whenever such inputs exist), its poses, cost, residual violation,
        iterations spent and status.
    """
    return conclude(problem, begin(problem, warm), budget)


@kernel
def begin(problem: Problem, warm: FloatArray) -> Search:
    """A search that has spent nothing yet."""
    plan, cursor = warm.copy(), np.zeros(5, np.int64)
    if project(problem, plan):
        cursor[_FITS] = 1
    total, _, summed = judge(problem, plan)
    others = seeds(problem)
    merit = np.array((math.inf, total + PENALTY * summed))
    return Search(plan.copy(), plan, others, np.empty(len(others)), merit, cursor)


@kernel
def search_on(problem: Problem, search: Search, budget: int) -> bool:
    """One more linearisation, of at most `_LIMIT` iterations and only if fewer than `budget` are spent; so the answer
    doesn't depend on how often the caller stops to look at a clock. True: the search came to its end."""
    cursor, merit = search.cursor, search.merit
    if cursor[_DONE] > _STARTS:
        return True
    more = cursor[_ROUND] < (_ROUNDS if cursor[_DONE] == 0 else _ROUNDS_OTHERS)
    if more and cursor[_SPENT] >= budget:
        more, cursor[_SHORT] = False, 1
    if more:
        spent, merit[1], more = refine(problem, search.plan, merit[1], budget - cursor[_SPENT])
        cursor[_SPENT] += spent
        cursor[_ROUND] += 1
    if more:
        return False
    total, worst, summed = judge(problem, search.plan)
    if not merit[0] <= total + PENALTY * summed:
        merit[0] = total + PENALTY * summed
        copy(search.plan, search.best)
    if cursor[_DONE] == 0:
        if worst <= TOLERANCE:
            cursor[_DONE] = _STARTS
        else:
            for i in range(len(search.others)):
                total, _, summed = judge(problem, search.others[i])
                search.merits[i] = total + PENALTY * summed
    cursor[_DONE] += 1
    cursor[_ROUND] = 0
    if cursor[_DONE] <= _STARTS:
        i = int(np.argmin(search.merits))
        copy(search.others[i], search.plan)
        merit[1], search.merits[i] = search.merits[i], math.inf
    return bool(cursor[_DONE] > _STARTS)


@kernel
def conclude(problem: Problem, search: Search, budget: int) -> Solution:
    """The answer after what is left of `budget`; 0 ends the search where it stands."""
    while not search_on(problem, search, budget):
        pass
    cursor, best = search.cursor, search.best.copy()
    total, worst, _ = judge(problem, best)
    status = CONVERGED if worst <= TOLERANCE else INFEASIBLE
    if cursor[_SPENT] >= budget and cursor[_SHORT]:
        status = ITERATION_LIMIT
    if not cursor[_FITS]:
        status = INPUT_LIMIT
    return Solution(best, roll_out(problem, best), total, worst, cursor[_SPENT], status)


@kernel
def refine(problem: Problem, plan: FloatArray, merit: float, budget: int) -> tuple[int, float, bool]:
    """Improve a projected plan (N, 2) of this `merit` in place, by one linearisation. Returns iterations spent, the new
    merit, and whether another may pay."""
    n, free = len(plan), problem.control_horizon
    low, high = np.empty((free, 2)), np.empty((free, 2))
    for k in range(free):
        low[k, 0], high[k, 0], low[k, 1], high[k, 1] = box(problem, k)
    room = 0
    for k in range(n):
        room += problem.counts[k] + 5
    motion, error = LinearMotion(np.empty((n, 2)), np.empty((n, 2, 2)), problem.period), np.empty((n, 3))
    stage, normal, lack = np.empty(room, np.int64), np.empty((room, 2)), np.empty(room)
    before = np.zeros((room if problem.decay < 1.0 else 0, 2))
    answer, trial = np.empty((free, 2)), np.empty((n, 2))
    total, worst, summed = 0.0, 0.0, 0.0
    linearise(problem, plan, motion, error)
    count = gather(problem, error, stage, normal, before, lack)
    program = Program(
        motion, error, problem.heading_weight, problem.discount, problem.effort, plan[:free], low, high, problem.smooth,
        problem.previous, stage, normal, before, lack, count, PENALTY,
    )  # fmt: skip
    spent = minimise(program, _MU, _MU_END, min(_LIMIT, budget), answer)
    part, gain = 1.0, 0.0
    for _ in range(4):
        for k in range(n):
            j = min(k, free - 1)
            trial[k, 0] = plan[k, 0] + part * (answer[j, 0] - plan[k, 0])
            trial[k, 1] = plan[k, 1] + part * (answer[j, 1] - plan[k, 1])
        project(problem, trial)
        total, worst, summed = judge(problem, trial)
        gain = merit - (total + PENALTY * summed)
        if gain > 0.0:
            merit -= gain
            copy(trial, plan)
            break
        part *= 0.35
    return spent, merit, gain > (_GAIN * total if worst <= TOLERANCE else _CLOSER * PENALTY * summed)


@kernel
def linearise(problem: Problem, plan: FloatArray, motion: LinearMotion, error: FloatArray) -> None:
    """The poses less the reference, and how they depend on the pose before and on the input, along a plan (N, 2).

    Args:
        problem: The tracking problem.
        plan: (N, 2) v [m/s] and omega [rad/s].
        motion: Filled, but for its period.
        error: (N, 3), filled, its heading wrapped.
    """
    turn, push = motion.turn, motion.push
    c = problem.period
    x, y, theta = problem.start[0], problem.start[1], problem.start[2]
    for k in range(len(plan)):
        v, w = plan[k, 0], plan[k, 1]
        if problem.exact:
            half = 0.5 * w * c
            s = sinc(half)
            bend = (math.cos(half) - s) / half if abs(half) > 1e-4 else -half / 3.0
            cos, sin = math.cos(theta + half), math.sin(theta + half)
            push[k, 0, 0], push[k, 1, 0] = c * s * cos, c * s * sin
            across, along = 0.5 * c * c * v * s, 0.5 * c * c * v * bend
            push[k, 0, 1], push[k, 1, 1] = along * cos - across * sin, along * sin + across * cos
            turn[k, 0], turn[k, 1] = -c * v * s * sin, c * v * s * cos
        else:
            cos, sin = math.cos(theta), math.sin(theta)
            push[k, 0, 0], push[k, 1, 0] = c * (cos - c * w * sin), c * (sin + c * w * cos)
            push[k, 0, 1], push[k, 1, 1] = -c * c * v * sin, c * c * v * cos
            turn[k, 0], turn[k, 1] = -c * v * (sin + c * w * cos), c * v * (cos - c * w * sin)
        x, y, theta = advance(x, y, theta, v, w, c, problem.exact)
        error[k, 0], error[k, 1] = x - problem.reference[k, 0], y - problem.reference[k, 1]
        error[k, 2] = turn_between(problem.reference[k, 2], theta)


@kernel
def gather(
    problem: Problem, error: FloatArray, stage: IntArray, normal: FloatArray, before: FloatArray, lack: FloatArray
) -> int:
    """The soft rows n . dr + m . dr' >= lack of the poses at `error` (N, 3) from the reference that may matter; returns how many.

    Left out: what can't be reached at top speed, and what is farther than the margin.

    Args:
        problem: The tracking problem.
        error: See above.
        stage: Filled, the stage of each.
        normal: Filled, n.
        before: Filled, m, where barriers decay; else it has no rows.
        lack: Filled.
    """
    count = 0
    far = 0.0
    x, y = problem.start[0], problem.start[1]
    for k in range(len(error)):
        x_before, y_before = x, y
        x, y = problem.reference[k, 0] + error[k, 0], problem.reference[k, 1] + error[k, 1]
        fastest = max(abs(problem.low[k, 0]), abs(problem.high[k, 0])) * problem.period
        if not problem.exact:
            fastest *= math.hypot(1.0, problem.period * max(abs(problem.low[k, 1]), abs(problem.high[k, 1])))
        far += fastest
        for i in range(problem.counts[k]):
            dx, dy, need = x - problem.rows[k, i, 0], y - problem.rows[k, i, 1], problem.rows[k, i, 2]
            squared = dx * dx + dy * dy
            if problem.decay < 1.0:
                if need > 0.0:
                    px, py, p_need = row_before(problem, k, i)
                    keep, ax, ay = 1.0 - problem.decay, x_before - px, y_before - py
                    lacking = keep * barrier(ax, ay, p_need) - barrier(dx, dy, need) + _SPARE
                    if lacking * need > -_MARGIN * math.sqrt(squared):
                        stage[count], lack[count] = k, lacking
                        normal[count, 0], normal[count, 1] = dx / need, dy / need
                        before[count, 0], before[count, 1] = -keep * ax / p_need, -keep * ay / p_need
                        count += 1
            elif need > 0.0 and squared < (need + _MARGIN) ** 2:
                sx, sy = problem.start[0] - problem.rows[k, i, 0], problem.start[1] - problem.rows[k, i, 1]
                if sx * sx + sy * sy < (need + far) ** 2:
                    gap = math.sqrt(squared)
                    stage[count], lack[count] = k, need - gap + _SPARE
                    normal[count, 0], normal[count, 1] = (dx / gap, dy / gap) if gap > 1e-9 else (1.0, 0.0)
                    count += 1
        dx, dy = x - problem.centre[0], y - problem.centre[1]
        gap = math.hypot(dx, dy)
        if gap > problem.reach[k] - _MARGIN and gap > 1e-9:
            stage[count], lack[count] = k, gap - problem.reach[k]
            normal[count, 0], normal[count, 1] = -dx / gap, -dy / gap
            count += 1
        for j in range(4):
            axis, sign = j % 2, 1.0 if j < 2 else -1.0
            lacking = sign * (problem.area[k, j] - (x if axis == 0 else y))
            if lacking > -_MARGIN:
                stage[count], lack[count] = k, lacking
                normal[count, axis], normal[count, 1 - axis] = sign, 0.0
                count += 1
    return count
