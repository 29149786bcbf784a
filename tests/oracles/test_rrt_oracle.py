"""HL-RRT* on static scenes against OMPL's RRT* (independent software) and the exact shortest path.

HL-RRT* gets a horizon that holds the whole scene, the same longest edge, and the same number of samples. OMPL's random
numbers can be seeded once a process only, so its cost is compared within the spread that was seen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from clearway.contract import Budget
from clearway.navigators.hl_rrt.parameters import Parameters
from clearway.navigators.hl_rrt.planner import Planner
from clearway.navigators.hp_tmpc.heuristic_planner.exact import exact_path
from clearway.navigators.hp_tmpc.heuristic_planner.pieces import path_length
from clearway.stand_ins import stand_ins

ompl = pytest.importorskip("ompl")  # no wheel for every platform
ob, og, ou = ompl.base, ompl.geometric, ompl.util

AREA = (-1.0, -2.5, 6.0, 2.5)
START, GOAL, STEP, SAMPLES, SHORT = (0.0, 0.0), (5.0, 0.0), 0.5, 4_000, 0.05
"""SHORT: how far before the goal OMPL's path may end, m. The rest as named."""
SCENES = {
    "one disc": [(2.5, 0.0, 1.0)],
    "slalom": [(1.2, 0.5, 0.8), (2.5, -0.5, 0.8), (3.8, 0.5, 0.8)],
    "wall with a gap": [(2.5, y, 0.45) for y in (-2.4, -1.6, -0.8, 0.0, 0.8)],
}

ou.setLogLevel(ou.LogLevel.LOG_ERROR)
ou.RNG.setSeed(1)


def ompl_cost(discs: np.ndarray) -> float:
    """Length [m] of the path that OMPL's RRT* has found after SAMPLES iterations."""
    space, bounds = ob.RealVectorStateSpace(2), ob.RealVectorBounds(2)
    for k in range(2):
        bounds.setLow(k, AREA[k])
        bounds.setHigh(k, AREA[k + 2])
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    rows: Sequence[Sequence[float]] = discs.tolist()
    setup.setStateValidityChecker(lambda s: all((x - s[0]) ** 2 + (y - s[1]) ** 2 >= r * r for x, y, r in rows))
    setup.getSpaceInformation().setStateValidityCheckingResolution(0.003)
    start, goal = space.allocState(), space.allocState()
    start[0], start[1] = START
    goal[0], goal[1] = GOAL
    setup.setStartAndGoalStates(start, goal, SHORT)
    planner = og.RRTstar(setup.getSpaceInformation())
    planner.setRange(STEP)
    setup.setPlanner(planner)
    left = iter(range(SAMPLES))
    setup.solve(ob.PlannerTerminationCondition(lambda: next(left, None) is None))
    return float(setup.getSolutionPath().length())


def our_cost(discs: np.ndarray, seed: int) -> float:
    """The same by HL-RRT*."""
    change = {
        "horizon": 7.0, "step": STEP, "spacing": 0.001, "capacity": SAMPLES, "patience": SAMPLES, "cap": 2 * SAMPLES,
    }  # fmt: skip
    parameters = Parameters.model_validate(stand_ins("hl-rrt") | change)
    planner = Planner(parameters, np.array(AREA), np.random.default_rng(seed))
    planner.forget(np.array(START))
    plan = planner.plan(np.array(START), np.array(GOAL), SHORT, discs, 0.0, Budget(SAMPLES), 0.0)
    assert plan.complete
    return plan.cost + math.dist(plan.points[-1], GOAL)


@pytest.mark.parametrize("scene", sorted(SCENES))
def test_path_cost_on_static_scenes(scene: str) -> None:
    discs = np.array(SCENES[scene])
    _, pieces = exact_path(np.array(START), np.array(GOAL), discs, np.array(AREA), math.inf)
    exact, theirs = path_length(pieces), ompl_cost(discs)
    ours = [our_cost(discs, seed) for seed in range(3)]
    assert min(ours) >= exact - 1e-6
    assert theirs >= 0.99 * exact - SHORT  # it checks points along an edge
    assert max(ours) <= 1.07 * exact
    assert np.mean(ours) <= 1.03 * (theirs + SHORT)
