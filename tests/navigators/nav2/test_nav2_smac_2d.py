"""Smac 2D and the smoother of both Smac planners against plain readings of their source, on random grids."""

from __future__ import annotations

import math

import numpy as np
import pytest
import smac_oracle as oracle
from pydantic import ValidationError
from scipy.ndimage import distance_transform_edt

from clearway.navigators.nav2.planners.grids import Grid, grid_of, place
from clearway.navigators.nav2.planners.parameters import Smac2DParameters, SmacHybridParameters, SmootherParameters
from clearway.navigators.nav2.planners.smac_2d import Smac2D
from clearway.navigators.nav2.planners.smoother import Smoother
from clearway.navigators.nav2.seams import CostView, NoPath

pytestmark = pytest.mark.slow  # compiles for long

SQUARE = np.array([(0.12, 0.1), (-0.12, 0.1), (-0.12, -0.1), (0.12, -0.1)])


def inflated(lethal: np.ndarray, resolution: float = 0.05) -> np.ndarray:
    """A costmap of obstacles with Nav2's inflation."""
    away = distance_transform_edt(~lethal) * resolution
    cost = np.where(away <= 0.1, 253, 252 * np.exp(-3.0 * (away - 0.1))).astype(np.uint8)
    cost[away > 0.55] = 0
    cost[lethal] = 254
    return cost


def view(cost: np.ndarray, circular: bool = True) -> CostView:
    return CostView(cost, np.array((-1.0, 2.0)), 0.05, SQUARE, 0.1, 0.156, 3.0, 0.55, True, circular)


def pose(x: float, y: float, yaw: float = 0.0) -> np.ndarray:
    """A place in cells as a pose."""
    return np.array((-1.0 + 0.05 * x, 2.0 + 0.05 * y, yaw))


def random_cost(rng: np.random.Generator, blocks: int = 14) -> np.ndarray:
    lethal = np.zeros((60, 70), bool)
    for _ in range(blocks):
        r, c = rng.integers(0, 55), rng.integers(0, 65)
        lethal[r : r + rng.integers(1, 9), c : c + rng.integers(1, 9)] = True
    cost = inflated(lethal)
    r, c = rng.integers(0, 40), rng.integers(0, 50)
    cost[r : r + 8, c : c + 8] = 255
    return cost


@pytest.mark.parametrize("unknown", [True, False])
@pytest.mark.parametrize("multiplier", [0.0, 1.0, 4.0])
def test_paths_against_a_plain_reading(unknown: bool, multiplier: float) -> None:
    rng = np.random.default_rng(11)
    found = 0
    p = Smac2DParameters(
        allow_unknown=unknown, cost_travel_multiplier=multiplier, tolerance=0.3, max_on_approach_iterations=50
    )
    planner = Smac2D(p, SmootherParameters(max_iterations=0))
    for _ in range(8):
        cost = random_cost(rng)
        sx, sy, gx, gy = rng.uniform((1, 1, 1, 1), (69, 59, 69, 59))
        gx, gy = float(np.float32(gx)), float(np.float32(gy))
        cost[int(sy), int(sx)] = 0
        at = place(grid_of(view(cost), 1).frame, pose(gx, gy), "goal")
        cells, iterations = oracle.astar_2d(
            cost,
            (int(sx), int(sy)),
            (float(at.x), float(at.y)),
            tolerance=float(np.float32(0.3) / np.float32(0.05)),
            multiplier=multiplier,
            unknown=unknown,
            approach=50,
        )
        if not cells:
            with pytest.raises(NoPath, match=f"occupied|after {iterations} cells"):
                planner.plan(pose(sx, sy), pose(gx, gy, 1.5), view(cost))
            continue
        path = planner.plan(pose(sx, sy), pose(gx, gy, 1.5), view(cost))
        found += 1
        assert path[-1, 2] == 1.5
        expected = np.array([(-1.0, 2.0)]) + 0.05 * np.array(cells, float)
        np.testing.assert_allclose(path[:-1, :2], expected[:-1], atol=1e-6)
        exact = cells[-1] == (int(gx), int(gy))
        np.testing.assert_allclose(path[-1, :2], pose(gx, gy)[:2] if exact else expected[-1], atol=1e-6)
    assert found >= 4


def test_a_goal_in_an_obstacle_is_approached_within_the_tolerance() -> None:
    lethal = np.zeros((60, 70), bool)
    lethal[25:36, 45:56] = True
    cost = inflated(lethal)
    start, goal = pose(10, 30), pose(50.5, 30.5)
    with pytest.raises(NoPath, match="occupied"):
        Smac2D(Smac2DParameters()).plan(start, goal, view(cost))
    path = Smac2D(Smac2DParameters(tolerance=0.45)).plan(start, goal, view(cost))
    assert 0.35 < math.dist(path[-1, :2], goal[:2]) <= 0.45
    lethal[:, 40] = True
    with pytest.raises(NoPath, match="no path"):
        Smac2D(Smac2DParameters(tolerance=0.45)).plan(start, goal, view(inflated(lethal)))


def test_headings_at_the_end_and_start_in_the_goals_cell() -> None:
    cost = np.zeros((60, 70), np.uint8)
    approach = Smac2D(Smac2DParameters(use_final_approach_orientation=True))
    start, goal = pose(10.2, 30.5, 0.4), pose(50.3, 30.7, 2.0)
    path = approach.plan(start, goal, view(cost))
    assert path[-1, 2] == pytest.approx(0.0, abs=0.5)
    np.testing.assert_array_equal(path[-1, :2], goal[:2])
    here = pose(10.4, 30.6, 2.0)
    np.testing.assert_array_equal(approach.plan(start, here, view(cost)), [(*here[:2], 0.4)])
    np.testing.assert_array_equal(Smac2D(Smac2DParameters()).plan(start, here, view(cost)), [here])
    with pytest.raises(NoPath, match="goal"):
        approach.plan(start, pose(70.1, 3), view(cost))


def test_downsampling_keeps_the_highest_cost() -> None:
    rng = np.random.default_rng(2)
    cost = rng.integers(0, 256, (31, 44)).astype(np.uint8)
    coarse = grid_of(view(cost), 3)
    assert coarse.cost.shape == (11, 15)
    for r in range(11):
        for c in range(15):
            assert coarse.cost[r, c] == cost[3 * r : 3 * r + 3, 3 * c : 3 * c + 3].max()
    assert coarse.frame.resolution == pytest.approx(0.15)
    p = Smac2DParameters(downsample_costmap=True, downsampling_factor=2)
    path = Smac2D(p).plan(pose(5, 5), pose(60, 50), view(np.zeros((60, 70), np.uint8)))
    assert len(path) < 32


@pytest.mark.parametrize("circular", [True, False])
@pytest.mark.parametrize("headings", [True, False])
def test_smoothing_against_a_plain_reading(circular: bool, headings: bool) -> None:
    rng = np.random.default_rng(4)
    hit = laid = 0
    radius = 0.2 if headings else None
    for trial in range(10):
        cost = random_cost(rng, 6)
        cost[cost == 255] = 0
        yaw = np.cumsum(rng.uniform(-0.5, 0.5, 40))
        back = np.where(np.arange(40) < 22, 1, -1) if headings else np.ones(40)
        points = np.cumsum(0.06 * back[:, None] * np.stack((np.cos(yaw), np.sin(yaw)), axis=1), axis=0)
        points += (0.6, 3.0)
        points[:, 0] = points[:, 0].clip(-0.6, 2.2)
        points[:, 1] = points[:, 1].clip(2.3, 4.6)
        path = np.column_stack((points, yaw))
        for r, c in zip(*((points - (-1.0, 2.0)) / 0.05).astype(int).T[::-1], strict=True):
            cost[r - 3 : r + 4, c - 3 : c + 4] = np.minimum(cost[r - 3 : r + 4, c - 3 : c + 4], 200)
        weights = (1e-10, 1000 if trial % 3 else 20, 0.2, 0.3, 2)
        reading = oracle.Smoother(cost, (-1.0, 2.0), 0.05, None if circular else SQUARE, weights, radius)
        expected = np.array(reading.smooth([list(p) for p in path]))
        hit, laid = hit + (reading.left > 0), laid + reading.laid
        p = SmootherParameters(max_iterations=weights[1])
        grid = Grid(cost, grid_of(view(cost), 1).frame)
        Smoother(p, radius).smooth(path, grid, view(cost, circular))
        np.testing.assert_allclose(path[:, :2], expected[:, :2], atol=1e-9)
        assert np.cos(path[:, 2] - expected[:, 2]).min() > 1 - 1e-9
    assert 0 < hit < 10
    assert (laid > 3) == headings


def test_ends_keep_their_headings_and_the_turning_radius() -> None:
    cost = np.zeros((200, 200), np.uint8)
    grid = Grid(cost, grid_of(view(cost), 1).frame)
    angle = np.linspace(0, 1.5 * math.pi, 90)
    arc = np.column_stack((3.0 + np.sin(angle), 6.0 - np.cos(angle), angle))
    for backwards in (False, True):
        path = arc.copy()
        if backwards:
            path[:, 2] += math.pi
        bent, kept = path.copy(), path.copy()
        Smoother(SmootherParameters(), None).smooth(bent, grid, view(cost))
        Smoother(SmootherParameters(), 0.9).smooth(kept, grid, view(cost))
        assert np.abs(bent - path)[:, :2].max() > 0.01
        for i in (0, -1):
            assert math.cos(kept[i, 2] - path[i, 2]) == pytest.approx(1.0, abs=1e-9)
            np.testing.assert_allclose(kept[i, :2], path[i, :2])
        steps = np.diff(kept[:, :2], axis=0)
        turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
        curvature = np.abs(turns) / np.hypot(*steps.T)[1:]
        assert max(curvature[:15].max(), curvature[-15:].max()) < 1.01 / 0.9
        drift = np.cos(np.arctan2(steps[:, 1], steps[:, 0]) - kept[:-1, 2])
        assert (drift < -0.99).all() if backwards else (drift > 0.99).all()


def test_bad_parameters() -> None:
    with pytest.raises(ValidationError, match="downsampling_factor"):
        Smac2DParameters(downsampling_factor=0)
    with pytest.raises(ValidationError, match="coarse_search_resolution must divide"):
        SmacHybridParameters(coarse_search_resolution=5)
    with pytest.raises(ValidationError, match="motion_model_for_search"):
        SmacHybridParameters(motion_model_for_search="MOORE")
