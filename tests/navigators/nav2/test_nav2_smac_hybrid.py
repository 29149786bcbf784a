"""Smac Hybrid-A* against a plain reading of its source, on random grids, and what its paths promise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import smac_hybrid_oracle as oracle
from scipy.ndimage import distance_transform_edt

from clearway.navigators.nav2.planners.grids import grid_of, place
from clearway.navigators.nav2.planners.parameters import SmacHybridParameters, SmootherParameters
from clearway.navigators.nav2.planners.smac_hybrid import SmacHybrid
from clearway.navigators.nav2.planners.smac_hybrid.ground import circumscribed_cost
from clearway.navigators.nav2.planners.smac_hybrid.obstacle_heuristic import ObstacleHeuristic, around_obstacles
from clearway.navigators.nav2.seams import CostView, NoPath

pytestmark = pytest.mark.slow  # compiles for long

CAR = np.array([(0.33, 0.12), (-0.1, 0.12), (-0.1, -0.12), (0.33, -0.12)])
INSCRIBED, CIRCUMSCRIBED = 0.1, math.hypot(0.33, 0.12)
RESOLUTION = 0.05


def inflated(lethal: np.ndarray) -> np.ndarray:
    away = distance_transform_edt(~lethal) * RESOLUTION
    cost = np.where(away <= INSCRIBED, 253, 252 * np.exp(-3.0 * (away - INSCRIBED))).astype(np.uint8)
    cost[away > 0.5] = 0
    cost[lethal] = 254
    return cost


def view(cost: np.ndarray, circular: bool = False) -> CostView:
    origin = np.array((-1.0, 2.0))
    return CostView(cost, origin, RESOLUTION, CAR, INSCRIBED, CIRCUMSCRIBED, 3.0, 0.5, True, circular)


def pose(x: float, y: float, yaw: float = 0.0) -> np.ndarray:
    """A place in cells as a pose."""
    return np.array((-1.0 + RESOLUTION * x, 2.0 + RESOLUTION * y, yaw))


def random_cost(rng: np.random.Generator, blocks: int) -> np.ndarray:
    lethal = np.zeros((64, 75), bool)
    for _ in range(blocks):
        r, c = rng.integers(5, 56), rng.integers(5, 66)
        lethal[r : r + rng.integers(1, 7), c : c + rng.integers(1, 7)] = True
    cost = inflated(lethal)
    r, c = rng.integers(0, 40), rng.integers(0, 50)
    cost[r : r + 6, c : c + 6] = 255
    return cost


CASES: dict[str, dict[str, Any]] = {
    "forwards": {},
    "backwards too": {"motion_model_for_search": "REEDS_SHEPP"},
    "few headings": {"angle_quantization_bins": 36, "allow_primitive_interpolation": False},
    "penalties": {
        "motion_model_for_search": "REEDS_SHEPP",
        "change_penalty": 0.4,
        "reverse_penalty": 3.0,
        "non_straight_penalty": 1.05,
        "cost_penalty": 3.5,
        "use_quadratic_cost_penalty": True,
    },
    "shy of cost": {
        "analytic_expansion_max_cost": 60.0,
        "analytic_expansion_max_length": 1.5,
        "max_iterations": 700,
    },
    "override": {"analytic_expansion_max_cost": 20.0, "analytic_expansion_max_cost_override": True},
    "no known ground": {"allow_unknown": False, "downsample_obstacle_heuristic": False},
    "small table": {"lookup_table_size": 1.0, "motion_model_for_search": "REEDS_SHEPP", "tolerance": 0.6},
    "either way": {"goal_heading_mode": "BIDIRECTIONAL"},
    "any heading": {
        "goal_heading_mode": "ALL_DIRECTION",
        "coarse_search_resolution": 4,
        "angle_quantization_bins": 16,
        "max_iterations": 40,
        "motion_model_for_search": "REEDS_SHEPP",
    },
}


def reading(cost: np.ndarray, p: SmacHybridParameters, circular: bool) -> oracle.Search:
    size = int(np.float32(p.lookup_table_size) / np.float32(RESOLUTION))
    penalties = {
        "cost": p.cost_penalty,
        "retrospective": p.retrospective_penalty,
        "straight": p.non_straight_penalty,
        "change": p.change_penalty,
        "reverse": p.reverse_penalty,
    }
    settings = oracle.Settings(
        radius=p.minimum_turning_radius / RESOLUTION,
        bins=p.angle_quantization_bins,
        reverse=p.motion_model_for_search == "REEDS_SHEPP",
        interpolate=p.allow_primitive_interpolation,
        penalties=penalties,
        quadratic=p.use_quadratic_cost_penalty,
        ratio=p.analytic_expansion_ratio,
        longest=p.analytic_expansion_max_length / RESOLUTION,
        max_cost=p.analytic_expansion_max_cost,
        override=p.analytic_expansion_max_cost_override,
        downsample=p.downsample_obstacle_heuristic,
        table=size + (size % 2 == 0),
        tolerance=float(np.float32(p.tolerance) / np.float32(RESOLUTION)),
        limit=p.max_iterations,
        approach=p.max_on_approach_iterations,
        unknown=p.allow_unknown,
        possible=circumscribed_cost(view(cost)),
        outline=None if circular else CAR / RESOLUTION,
        heading_mode=p.goal_heading_mode,
        coarse=p.coarse_search_resolution,
    )
    return oracle.Search(cost, settings)


@pytest.mark.parametrize("case", CASES)
def test_paths_against_a_plain_reading(case: str) -> None:
    rng = np.random.default_rng(3)
    given = {"max_iterations": 150, "max_on_approach_iterations": 60, "smooth_path": False} | CASES[case]
    p = SmacHybridParameters(**given)
    planner = SmacHybrid(p)
    turn = 2 * math.pi / p.angle_quantization_bins
    paths = 0
    for trial in range(6):
        cost = random_cost(rng, 5)
        circular = trial % 3 == 2
        sx, sy, gx, gy = rng.uniform((5, 5, 5, 5), (70, 59, 70, 59))
        first, last = (int(h) for h in rng.integers(0, p.angle_quantization_bins, 2))
        for x, y in ((sx, sy),) if trial % 2 else ((sx, sy), (gx, gy)):
            part = cost[max(0, int(y) - 9) : int(y) + 10, max(0, int(x) - 9) : int(x) + 10]
            part[part > 240] = 90
        start, goal = pose(sx, sy, first * turn), pose(gx, gy, last * turn)
        frame = grid_of(view(cost), 1).frame
        here, there = place(frame, start, ""), place(frame, goal, "")
        search = reading(cost, p, circular)
        expected, iterations = search.run((here.x, here.y, first), (there.x, there.y, last))
        if not expected:
            with pytest.raises(NoPath, match="occupied" if expected is None else f"after {iterations} nodes"):
                planner.plan(start, goal, view(cost, circular))
            continue
        path = planner.plan(start, goal, view(cost, circular))
        paths += 1
        poses = np.array(expected)
        assert len(path) == len(poses)
        np.testing.assert_allclose(path[:, :2], (-1.0, 2.0) + RESOLUTION * poses[:, :2], atol=1e-4)
        assert np.cos(path[:, 2] - np.floor(poses[:, 2]) * turn).min() > 1 - 1e-6
    assert paths > 0


@pytest.mark.parametrize("downsample", [True, False])
def test_obstacle_heuristic_against_a_plain_reading(downsample: bool) -> None:
    rng = np.random.default_rng(8)
    cost = random_cost(rng, 14)
    goal = (40.3, 30.6)
    settings = oracle.Settings(radius=8.0, penalties={"cost": 2.0}, downsample=downsample)
    plain = oracle.ObstacleHeuristic(cost, settings, (np.float32(goal[0]), np.float32(goal[1])))
    field = ObstacleHeuristic(2.0, False, downsample).towards(cost, *goal, False)
    for x, y in rng.integers((0, 0), (75, 64), (150, 2)):
        assert around_obstacles(field, int(y), int(x)) == plain(int(x), int(y))


def test_a_search_that_needs_more_room_begins_anew() -> None:
    lethal = np.zeros((160, 160), bool)
    lethal[40:120, 90] = lethal[40, 40:90] = lethal[119, 40:90] = True
    p = SmacHybridParameters(smooth_path=False)
    start, goal = pose(70, 80), pose(130, 80)
    small, large = SmacHybrid(p), SmacHybrid(p)
    small._make_room(256)
    np.testing.assert_array_equal(
        small.plan(start, goal, view(inflated(lethal))), large.plan(start, goal, view(inflated(lethal)))
    )
    assert len(small._graph.key) > 256


@pytest.mark.parametrize("model", ["DUBIN", "REEDS_SHEPP"])
def test_smoothed_paths_are_free_and_end_where_they_should(model: str) -> None:
    rng = np.random.default_rng(6)
    p = SmacHybridParameters(motion_model_for_search=model, max_iterations=3000)
    planner, raw = SmacHybrid(p), SmacHybrid(p.model_copy(update={"smooth_path": False}))
    found = 0
    for _ in range(8):
        cost = random_cost(rng, 3)
        cost[cost == 255] = 0
        start, goal = (pose(*rng.uniform((10, 10), (65, 54)), rng.uniform(-3, 3)) for _ in range(2))
        try:
            path, rough = planner.plan(start, goal, view(cost)), raw.plan(start, goal, view(cost))
        except NoPath:
            continue
        found += 1
        assert len(path) == len(rough)
        for end, wanted in ((path[0], start), (path[-1], goal)):
            np.testing.assert_allclose(end[:2], wanted[:2], atol=1e-5)
            assert math.cos(end[2] - wanted[2]) > math.cos(math.pi / 72 + 1e-6)
        cells = ((path[:, :2] - (-1.0, 2.0)) / RESOLUTION).astype(int)
        assert (cost[cells[:, 1], cells[:, 0]] < 253).all()
        steps = np.diff(path[:, :2], axis=0)
        ahead = np.einsum("ij,ij->i", steps, np.stack((np.cos(path[:-1, 2]), np.sin(path[:-1, 2])), axis=1))
        driven = np.hypot(*steps.T)
        if model == "DUBIN":
            assert (ahead[driven > 1e-3] > 0).all()
        assert driven.max() < 4 * RESOLUTION
    assert found >= 4


def test_start_in_the_goals_place_and_blocked_ends() -> None:
    cost = np.zeros((64, 75), np.uint8)
    planner = SmacHybrid(SmacHybridParameters())
    start, same = pose(30.2, 30.2, 0.02), pose(30.7, 30.4, -0.03)
    np.testing.assert_array_equal(planner.plan(start, same, view(cost)), [(*start[:2], -0.03)])
    with pytest.raises(NoPath, match=r"the goal .* off the map"):
        planner.plan(start, pose(75.2, 3.0), view(cost))
    cost[20:40, 50:] = 254
    with pytest.raises(NoPath, match="occupied"):
        planner.plan(start, pose(70, 30), view(inflated(cost == 254)))
    cost[:] = 254
    cost[50:60, 50:60] = 0
    with pytest.raises(NoPath, match="blocked"):
        planner.plan(start, pose(55, 55), view(cost, circular=True))


def test_the_obstacle_heuristic_is_kept_while_the_goal_stays() -> None:
    p = SmacHybridParameters(cache_obstacle_heuristic=True)
    planner = SmacHybrid(p)
    cost = np.zeros((64, 75), np.uint8)
    goal = pose(60, 30)
    planner.plan(pose(20, 30), goal, view(cost))
    field = planner._obstacles._field
    assert field is not None
    reached = (field.total > 0).sum()
    planner.plan(pose(40, 30), goal, view(cost))
    assert (planner._obstacles._field.total > 0).sum() >= reached  # type: ignore[union-attr]
    planner.plan(pose(55, 30), pose(60, 31), view(cost))
    assert (planner._obstacles._field.total > 0).sum() < reached  # type: ignore[union-attr]


def test_smoother_parameters_reach_it() -> None:
    lethal = np.zeros((64, 75), bool)
    lethal[31:34, 36:39] = True
    cost = inflated(lethal)
    start, goal = pose(8, 32), pose(66, 32)
    rough = SmacHybrid(SmacHybridParameters(smooth_path=False)).plan(start, goal, view(cost))
    kept = SmacHybrid(SmacHybridParameters(), SmootherParameters(max_iterations=0)).plan(start, goal, view(cost))
    np.testing.assert_array_equal(rough, kept)
    assert np.abs(SmacHybrid(SmacHybridParameters()).plan(start, goal, view(cost)) - rough).max() > 1e-3


def test_a_search_ends_by_the_time_that_is_granted() -> None:
    """A second is 100,000 nodes: a goal in a room without a door."""
    lethal = np.zeros((64, 75), bool)
    lethal[20:40, 40], lethal[20:40, 60], lethal[20, 40:61], lethal[40, 40:61] = True, True, True, True
    for seconds, nodes in ((0.01, 1000), (0.02, 2000)):
        planner = SmacHybrid(SmacHybridParameters(max_planning_time=seconds))
        with pytest.raises(NoPath, match=f"too many iterations after {nodes} nodes"):
            planner.plan(pose(10, 30), pose(50, 30), view(inflated(lethal)))
