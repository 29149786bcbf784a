"""Pattern (compass) search with several starts: one of the two solvers that paper B names.

From each start, every input of every stage is moved up and down by a step; what lowers the merit (cost + PENALTY x
summed violation) is kept, and the step halved after a sweep that found nothing, down to 5e-4 of an input's range.
Moves change an input and all after it, it alone, or it and the next one by as much the other way, sweep by sweep:
the first kind goes on where a rate limit binds, the last where all later poses are best left in place. The work is cut into chunks; one iteration is one roll-out.
"""

from __future__ import annotations

import math
import time

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
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
    copy,
    judge,
    project,
    roll_out,
)

CHUNK = 256
"""Roll-outs between two looks at the clock: about 0.3 ms at N = 5 with 16 obstacles."""

_FIRST, _LAST = 0.25, 5e-4  # steps as a share of an input's range
_MOST = 600  # roll-outs per start and free input pair, at most: a narrow valley can be crawled along for very long


def pattern_search(
    problem: Problem, starts: FloatArray, *, budget: int | None = None, deadline: float = math.inf
) -> Solution:
    """The best plan that a compass search finds from each of `starts`.

    Args:
        problem: The tracking problem.
        starts: (S, N, 2) plans, the most promising first (shifted plan, then `seeds`).
        budget: Evaluations of the cost (one roll-out each), None: to the method's own end.
        deadline: `time.perf_counter()` [s] at which it stops after the chunk at work (some tenths of a millisecond).

    Returns:
        The best feasible plan seen so far, else the one with the least merit; `iterations` counts evaluations.
    """
    starts = np.array(starts, dtype=np.float64, order="C")
    plan, best, marks = starts[0].copy(), starts[0].copy(), np.full(4, math.inf)
    cursor = np.zeros(7, dtype=np.int64)
    most = np.iinfo(np.int64).max if budget is None else max(budget, 1)
    ended = False
    while not ended and cursor[0] < most:
        ended = search_on(problem, starts, plan, best, marks, cursor, min(CHUNK, most - cursor[0]))
        if time.perf_counter() >= deadline:
            break
    return conclude(problem, best, int(cursor[0]), ended)


def conclude(problem: Problem, best: FloatArray, spent: int, ended: bool) -> Solution:
    """The `Solution` that `best` (N, 2) makes after `spent` iterations; `ended`: the method came to its own end."""
    plan = best.copy()
    fits = project(problem, plan)
    cost, worst, _ = judge(problem, plan)
    status = CONVERGED if worst <= TOLERANCE else INFEASIBLE
    if not ended:
        status = ITERATION_LIMIT
    if not fits:
        status = INPUT_LIMIT
    return Solution(plan, roll_out(problem, plan), cost, worst, spent, status)


@kernel
def keep(cost: float, worst: float, summed: float, plan: FloatArray, best: FloatArray, marks: FloatArray) -> None:
    """Remember a plan in `best` if it is feasible and cheaper than the one there, or if none there is feasible and its
    merit is lower. marks: [0] cost of the best feasible plan, [1] least merit without one; inf: none yet."""
    if worst <= TOLERANCE:
        if cost < marks[0]:
            marks[0] = cost
            copy(plan, best)
    elif marks[0] == math.inf and cost + PENALTY * summed < marks[1]:
        marks[1] = cost + PENALTY * summed
        copy(plan, best)


@kernel
def search_on(
    problem: Problem,
    starts: FloatArray,
    plan: FloatArray,
    best: FloatArray,
    marks: FloatArray,
    cursor: IntArray,
    allowed: int,
) -> bool:
    """Go on for `allowed` roll-outs, at least one. True: the search came to its end.

    Args:
        plan: (N, 2) where it stands.
        best: (N, 2) the best so far.
        marks: (4,) as in `keep`, then the merit of `plan` and the step.
        cursor: (7,) roll-outs spent, the start at work, the move to try next, whether the sweep succeeded, whether the
            start was evaluated, the kind of the moves, roll-outs spent on this start.
    """
    free = problem.control_horizon
    trial = np.empty_like(plan)
    for _ in range(allowed):
        if cursor[1] == len(starts):
            return True
        if cursor[4] == 0:
            copy(starts[cursor[1]], plan)
            project(problem, plan)
            cost, worst, summed = judge(problem, plan)
            keep(cost, worst, summed, plan, best, marks)
            marks[2], marks[3] = cost + PENALTY * summed, _FIRST
            cursor[0] += 1
            cursor[2], cursor[3], cursor[4], cursor[5], cursor[6] = 0, 0, 1, 0, 1
            continue
        k, which = cursor[2] // 4, cursor[2] % 4
        j, sign = which // 2, 1.0 - 2.0 * (which % 2)
        size = sign * marks[3] * (problem.high[k, j] - problem.low[k, j])
        copy(plan, trial)
        for i in range(k, free if cursor[5] == 0 else k + 1):
            trial[i, j] += size
        if cursor[5] == 2 and k + 1 < free:
            trial[k + 1, j] -= size
        project(problem, trial)
        cost, worst, summed = judge(problem, trial)
        cursor[0] += 1
        cursor[6] += 1
        keep(cost, worst, summed, trial, best, marks)
        if cost + PENALTY * summed < marks[2] - 1e-7:
            marks[2] = cost + PENALTY * summed
            copy(trial, plan)
            cursor[3] = 1
        cursor[2] += 1
        if cursor[2] == 4 * free:
            cursor[2] = 0
            if cursor[5] < 2:
                cursor[5] += 1
            else:
                cursor[5] = 0
                if cursor[3] == 0:
                    marks[3] *= 0.5
                cursor[3] = 0
                if marks[3] < _LAST or cursor[6] > _MOST * free:
                    cursor[1] += 1
                    cursor[4] = 0
    return bool(cursor[1] == len(starts))
