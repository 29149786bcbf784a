"""A genetic algorithm with several populations: one of the two solvers that paper B names.

Each population holds the given starts and random plans. A generation keeps its elite and fills up with children: two
parents by tournament, blend crossover per input, Gaussian mutation of a width drawn per child (of single inputs, of
all from a stage on by the same amount, or of two neighbours by opposite amounts), and projection into the input box
and the rate limits. Fitness is the merit, cost + PENALTY x summed violation. A population ends when its best hasn't
improved for a while; the next one starts from other random plans. One iteration is one roll-out; random numbers are a
function of (key, step, count), so the same call gives the same answer.
"""

from __future__ import annotations

import math
import time

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import normal, uniform
from clearway.navigators.common.tracking.problem import PENALTY, IntArray, Problem, Solution, copy, judge, project
from clearway.navigators.hp_tmpc.tube_mpc.papers_solvers.pattern_search import conclude, keep

SIZE, POPULATIONS, GENERATIONS, STALL = 40, 2, 200, 25
"""Plans in a population, populations, generations at most, and generations without a gain that end a population."""

_ELITE, _TOURNAMENT, _BLEND, _RATE = 2, 3, 0.3, 0.3
_WIDEST, _NARROWEST = 0.3, 1e-3  # of a child's mutations, as a share of an input's range


def genetic(
    problem: Problem,
    starts: FloatArray,
    key: np.uint64,
    step: int,
    *,
    budget: int | None = None,
    deadline: float = math.inf,
) -> Solution:
    """The best plan that a genetic algorithm breeds from `starts` and random plans.

    Args:
        problem: The tracking problem.
        starts: (S, N, 2) plans that join the first population.
        key: Random stream (`clearway.geometry.streams.stream`).
        step: Number of the control period: draws are a function of (key, step, count).
        budget: Evaluations of the cost (one roll-out each), None: to the method's own end.
        deadline: `time.perf_counter()` [s] at which it stops after the generation at work (some hundredths of a
            millisecond).

    Returns:
        The best feasible plan seen so far, else the one with the least merit; `iterations` counts evaluations.
    """
    starts = np.array(starts, dtype=np.float64, order="C")
    people = np.empty((SIZE, *starts.shape[1:]))
    merits, best, marks = np.full(SIZE, math.inf), starts[0].copy(), np.full(2, math.inf)
    cursor = np.zeros(3, dtype=np.int64)
    most = np.iinfo(np.int64).max if budget is None else max(budget, 1)
    ended = False
    for _ in range(POPULATIONS):
        low, stalled = math.inf, 0
        for generation in range(GENERATIONS):
            ended = False
            if cursor[0] >= most or (cursor[0] > 0 and time.perf_counter() >= deadline):
                break
            allowed = most - cursor[0]
            if generation == 0:
                populate(problem, starts, people, merits, best, marks, cursor, key, step, allowed)
            else:
                breed(problem, people, merits, best, marks, cursor, key, step, allowed)
            ended = True
            gained = float(merits.min()) < low - 1e-6 * max(1.0, abs(low)) if low < math.inf else True
            low, stalled = min(low, float(merits.min())), 0 if gained else stalled + 1
            if stalled >= STALL:
                break
        if not ended:
            break
    return conclude(problem, best, int(cursor[0]), ended)


@kernel
def populate(
    problem: Problem,
    starts: FloatArray,
    people: FloatArray,
    merits: FloatArray,
    best: FloatArray,
    marks: FloatArray,
    cursor: IntArray,
    key: np.uint64,
    step: int,
    allowed: int,
) -> None:
    """A first generation (P, N, 2): the starts, as many as fit, and plans of random inputs that change now and then.

    cursor: (3,) roll-outs spent, random numbers drawn, populations begun.
    """
    draw = cursor[1]
    for i in range(len(people)):
        plan = people[i]
        if i < len(starts) and cursor[2] == 0:
            copy(starts[i], plan)
        elif i == 0:
            copy(best, plan)
        else:
            for k in range(len(plan)):
                changes = k == 0 or uniform(key, step, draw) < 0.3
                draw += 1
                for j in range(2):
                    share = uniform(key, step, draw)
                    draw += 1
                    here = problem.low[k, j] + share * (problem.high[k, j] - problem.low[k, j])
                    plan[k, j] = here if changes else plan[k - 1, j]
        project(problem, plan)
        if i < allowed:
            cost, worst, summed = judge(problem, plan)
            keep(cost, worst, summed, plan, best, marks)
            merits[i] = cost + PENALTY * summed
            cursor[0] += 1
        else:
            merits[i] = math.inf
    cursor[1] = draw
    cursor[2] += 1


@kernel
def breed(
    problem: Problem,
    people: FloatArray,
    merits: FloatArray,
    best: FloatArray,
    marks: FloatArray,
    cursor: IntArray,
    key: np.uint64,
    step: int,
    allowed: int,
) -> None:
    """The next generation, in place: elite, and children of parents that won a tournament each."""
    free = problem.control_horizon
    parents, fitness = people.copy(), merits.copy()
    for i in range(len(people)):  # sorted by insertion; equals keep their order
        j = i
        while j > 0 and fitness[j - 1] > merits[i]:
            fitness[j] = fitness[j - 1]
            copy(parents[j - 1], parents[j])
            j -= 1
        fitness[j] = merits[i]
        copy(people[i], parents[j])
    draw = cursor[1]
    for i in range(len(people)):
        if i < _ELITE or i - _ELITE >= allowed:
            copy(parents[i], people[i])
            merits[i] = fitness[i]
            continue
        mother = father = len(people)
        for _ in range(_TOURNAMENT):  # sorted: the smaller index has the lower merit
            mother = min(mother, int(uniform(key, step, draw) * len(people)))
            father = min(father, int(uniform(key, step, draw + 1) * len(people)))
            draw += 2
        width = _WIDEST * (_NARROWEST / _WIDEST) ** uniform(key, step, draw)
        kind = int(3.0 * uniform(key, step, draw + 1))
        first = int(uniform(key, step, draw + 2) * free)
        draw += 3
        plan = people[i]
        for j in range(2):
            spread = width * (problem.high[0, j] - problem.low[0, j])
            move = spread * normal(key, step, draw)
            draw += 1
            for k in range(free):
                a, b = parents[mother, k, j], parents[father, k, j]
                plan[k, j] = a + (uniform(key, step, draw) * (1.0 + 2.0 * _BLEND) - _BLEND) * (b - a)
                if kind == 0:
                    plan[k, j] += move if k >= first else 0.0
                elif kind == 1:
                    plan[k, j] += move if k == first else -move if k == first + 1 else 0.0
                elif uniform(key, step, draw + 1) < _RATE:
                    plan[k, j] += spread * normal(key, step, draw + 2)
                draw += 3
        project(problem, plan)
        cost, worst, summed = judge(problem, plan)
        keep(cost, worst, summed, plan, best, marks)
        merits[i] = cost + PENALTY * summed
        cursor[0] += 1
    cursor[1] = draw
