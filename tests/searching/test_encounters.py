"""How hard a member looks before any trial, and that it breaks who looks hard."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from clearway.campaigns.plan import CampaignPlan
from clearway.campaigns.pool import pool
from clearway.robots import load_robot
from clearway.scenarios.files import load_scenario
from clearway.scenarios.scenario import Scenario
from clearway.searching.breaks import bench_of
from clearway.searching.encounters import STEP, encounters, hardness
from clearway.searching.failures import MOVING, failure_named
from clearway.searching.search import FamilySpace, search
from clearway.searching.strategies import strategy_named

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_family.toml"
T = STEP * np.arange(101)[:, None]
EAST = np.hstack([0.5 * T, 0.0 * T])
"""A robot at 0.5 m/s."""


def _crossing(ahead: float, speed: float) -> np.ndarray:
    """Who crosses its way from the right at `speed` [m/s], where the robot is after 10 s, or so far ahead [m]."""
    return np.hstack([0.0 * T + 5.0 + ahead, speed * (T - 10.0)])


def _hard(*others: np.ndarray) -> list[float]:
    return encounters(EAST, np.stack(others, axis=1), np.full(len(others), 0.8), 0.5).max(axis=0).tolist()


def test_the_formula_where_both_are_at_one_place_at_once():
    (met,) = _hard(_crossing(0.0, 1.2))
    assert met == pytest.approx(math.hypot(0.5, 1.2) / 0.5, rel=0.02)


def test_who_hits_the_rear_half_is_harder_than_who_hits_the_front_and_who_misses_is_not_hard():
    rear, front, missing, farther = _hard(*(_crossing(a, 1.2) for a in (-0.3, 0.3, 1.5, 3.0)))
    assert rear > 1.5 * front > 0.0 > missing > farther


def test_the_faster_the_harder():
    slow, fast = _hard(_crossing(-0.3, 0.6), _crossing(-0.3, 1.2))
    assert fast > 1.3 * slow


def test_who_is_absent_or_leaps_meets_nobody():
    leap = np.hstack([0.0 * T + 5.0, 0.0 * T + 5.0])
    leap[50:, 1] = -5.0  # through the robot, in no time
    absent = np.full_like(leap, np.nan)
    assert _hard(leap)[0] < 0.0
    assert _hard(absent) == [-math.inf]


def test_who_stands_at_its_goal_is_not_run_into():
    at_rest = encounters(np.zeros((101, 2)), _crossing(-5.0, 1.0)[:, None], np.full(1, 0.8), 0.5)
    assert at_rest.max() == 0.0


def _example(delay: float, **cart: object) -> Scenario:
    scenario = load_scenario(EXAMPLE)
    (run,) = scenario.obstacles[0].runs
    first = scenario.obstacles[0].model_copy(update={"runs": (run.model_copy(update={"delay": delay}),), **cart})
    return scenario.model_copy(update={"obstacles": (first,)})


def test_a_scenario_is_hardest_where_the_timing_makes_them_meet():
    robot = load_robot("rescue")
    # After 6.7 s, and a little for getting up to speed, the robot is where the cart crosses, which takes 7 s to come there.
    found = {delay: hardness(_example(delay), [robot]) for delay in (0.0, 0.5, 1.0, 3.0, 6.0)}
    assert found[0.0] > 1.0
    assert found[0.0] > found[3.0] > found[6.0]
    assert found[6.0] < 0.0


def test_what_comes_long_after_the_first_encounter_does_not_count():
    robot, scenario = load_robot("rescue"), _example(0.0)
    (run,) = scenario.obstacles[0].runs
    second = run.model_copy(update={"path": ((9.0, 12.5), (9.0, 3.5)), "speed": 1.2, "delay": 5.5})
    later = scenario.obstacles[0].model_copy(update={"name": "later", "runs": (second,)})
    alone, both = (scenario.model_copy(update={"obstacles": o}) for o in ((later,), (scenario.obstacles[0], later)))
    assert hardness(alone, [robot]) > 1.3 * hardness(scenario, [robot]) > 1.3
    assert hardness(both, [robot]) == hardness(scenario, [robot])


def test_who_looks_is_laid_out_as_one_who_sees_the_robot():
    from clearway.scenarios.behaviours import OperatorSpec

    robot = load_robot("rescue")
    blind, looks = hardness(_example(0.0), [robot]), hardness(_example(0.0, behaviour=OperatorSpec()), [robot])
    assert looks < 0.2 < 1.0 < blind


def test_where_nobody_moves_nothing_is_hard():
    scenario = load_scenario(EXAMPLE)
    alone = scenario.model_copy(update={"obstacles": scenario.obstacles[2:]})
    assert hardness(alone, [load_robot("rescue")]) == -math.inf


@pytest.mark.slow
def test_who_looks_hard_breaks_a_navigator_four_times_as_often_as_chance(tmp_path):
    plan = CampaignPlan(suites=(str(EXAMPLE),), robots=("rescue",), navigators=("orca",))
    share = {}
    with pool(0, tmp_path) as work:
        bench = bench_of(plan, failure_named(MOVING), work)
        for method, trials in (("screen", 40), ("random", 120)):
            strategy = strategy_named(method, FamilySpace(bench), 1, 0)
            done = search(bench, strategy, trials, trials, lambda *_: None)
            share[method] = sum(one.tried.broken for one in done) / trials
    assert share["screen"] > 0.15
    assert share["screen"] > 4.0 * share["random"]
