"""Costmaps: hand-computed marking and clearing, inflation against scipy's distance transform, persistence by replay."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from clearway.contract import Scan
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import Circle, rectangle
from clearway.navigators.common.costmaps import layers
from clearway.navigators.common.costmaps.costmap import Costmap, inflation_cost
from clearway.navigators.common.costmaps.parameters import Costmap as CostmapParameters
from clearway.navigators.common.costmaps.parameters import InflationLayer, ObstacleLayer, StaticLayer

STILL = np.zeros(3)


def parameters(**given: object) -> CostmapParameters:
    base: dict[str, object] = {
        "global_frame": "odom",
        "rolling_window": True,
        "width": 4.0,
        "height": 4.0,
        "resolution": 0.1,
        "footprint_padding": 0.0,
        "obstacle_layer": {"obstacle_range": 1.5, "raytrace_range": 1.8},
        "inflation_layer": None,
    }
    return CostmapParameters.model_validate(base | given)


def beam(*ranges: float) -> Scan:
    """Beams at 0, 90, 180, ... degrees from base_link's origin."""
    return Scan(np.array(ranges), 0.0, math.pi / 2, 0.05, 10.0, np.zeros(3))


def at(costmap: Costmap, x: float, y: float) -> int:
    cell = costmap.cell(x, y)
    assert cell is not None
    return int(costmap.cost[cell])


def seen(costmap: Costmap, scan: Scan, pose: np.ndarray = STILL, t: float = 0.0) -> None:
    costmap.buffer(t, scan, pose)
    costmap.update(pose, STILL)


def test_marks_within_obstacle_range_only_and_clears_along_the_ray() -> None:
    costmap = Costmap(parameters(), Circle(0.05), None, "local_costmap")
    seen(costmap, beam(1.02, 1.6))
    assert at(costmap, 1.02, 0.0) == layers.LETHAL
    assert (costmap.cost == layers.LETHAL).sum() == 1  # the second is beyond obstacle_range
    seen(costmap, beam(1.42, 1.6))  # it moved back: the ray clears where it was
    assert at(costmap, 1.02, 0.0) == layers.FREE
    assert at(costmap, 1.42, 0.0) == layers.LETHAL


def test_no_return_clears_only_if_inf_is_valid() -> None:
    for valid, left in ((False, layers.LETHAL), (True, layers.FREE)):
        layer = {"obstacle_range": 1.5, "raytrace_range": 1.8, "inf_is_valid": valid}
        costmap = Costmap(parameters(obstacle_layer=layer), Circle(0.05), None, "local_costmap")
        seen(costmap, beam(1.02))
        seen(costmap, beam(math.inf))
        assert at(costmap, 1.02, 0.0) == left


def test_clearing_reaches_as_far_as_raytrace_range() -> None:
    costmap = Costmap(
        parameters(obstacle_layer={"obstacle_range": 1.95, "raytrace_range": 1.0}), Circle(0.05), None, "m"
    )
    seen(costmap, beam(1.51))
    seen(costmap, beam(1.92))
    assert at(costmap, 1.51, 0.0) == layers.LETHAL  # beyond raytrace_range: nothing clears it


def test_a_rolling_window_keeps_the_world_in_place_and_forgets_what_leaves_it() -> None:
    costmap = Costmap(parameters(), Circle(0.05), None, "local_costmap")
    seen(costmap, beam(1.02))
    for k in range(1, 9):
        costmap.buffer(0.1 * k, beam(math.inf), np.array((-0.1 * k, 0.0, 0.0)))
        costmap.update(np.array((-0.1 * k, 0.0, 0.0)), STILL)
    assert at(costmap, 1.02, 0.0) == layers.LETHAL
    assert costmap.origin[0] == pytest.approx(-2.8, abs=0.1)
    costmap.update(np.array((-3.0, 0.0, 0.0)), STILL)
    costmap.update(STILL, STILL)
    assert (costmap.cost == layers.LETHAL).sum() == 0


def test_the_footprint_frees_its_own_cells() -> None:
    costmap = Costmap(parameters(), rectangle(0.6, 0.4), None, "local_costmap")
    seen(costmap, beam(0.25, 0.15, 1.02))
    assert at(costmap, 0.25, 0.0) == layers.FREE == at(costmap, 0.0, 0.15)
    assert at(costmap, -1.02, 0.0) == layers.LETHAL


def test_the_map_lies_below_and_obstacles_combine_by_maximum_or_overwrite() -> None:
    data = np.zeros((40, 40), np.int8)
    data[20, 25], data[20, 22], data[0, 0] = 100, 100, -1
    floor = OccupancyGrid(data, 0.1, (-2.0, -2.0))
    for method, at_wall in ((1, layers.LETHAL), (0, layers.FREE)):
        given = parameters(
            rolling_window=False,
            track_unknown_space=True,
            static_layer={},
            obstacle_layer={"combination_method": method, "obstacle_range": 1.5, "raytrace_range": 1.8},
        )
        costmap = Costmap(given, Circle(0.05), floor, "global_costmap")
        seen(costmap, beam(1.05))  # sees through the wall at 0.5 m, so the map is wrong there
        assert at(costmap, 0.55, 0.05) == at_wall
        assert at(costmap, 1.05, 0.0) == layers.LETHAL
        assert costmap.cost[0, 0] == layers.UNKNOWN


def test_a_static_layer_needs_a_map() -> None:
    with pytest.raises(ClearwayError, match="global_costmap has a static layer, which needs a map"):
        Costmap(parameters(static_layer=StaticLayer()), Circle(0.3), None, "global_costmap")


def test_inflation_cost_is_the_formula() -> None:
    cost = inflation_cost(np.array((0.0, 0.05, 0.3, 0.4, 0.5)), 0.3, 10.0)
    assert cost.tolist() == [254, 253, 253, int(252 * math.exp(-1.0)), int(252 * math.exp(-2.0))]


def test_inflation_equals_the_distance_transform() -> None:
    rng = np.random.default_rng(1)
    data = np.where(rng.random((120, 150)) < 0.004, 100, 0).astype(np.int8)
    floor = OccupancyGrid(data, 0.05, (0.0, 0.0))
    given = parameters(
        rolling_window=False, static_layer={}, obstacle_layer=None, inflation_layer={"inflation_radius": 0.55}
    )
    costmap = Costmap(given, Circle(0.27), floor, "global_costmap")
    costmap.update(np.array((3.0, 3.0, 0.0)), STILL)
    distance = distance_transform_edt(data == 0) * 0.05
    expected = inflation_cost(distance, costmap.inscribed, 10.0)
    expected[distance > 0.55 + 1e-9] = 0
    wrong = costmap.cost != expected
    assert wrong.mean() < 2e-3  # ROS's brushfire goes through four-neighbours and may miss the nearest source
    assert (costmap.cost[wrong] < expected[wrong]).all()
    assert costmap.inscribed == pytest.approx(0.27 * math.cos(math.pi / 16))


def test_updating_windows_equals_updating_everything() -> None:
    rng = np.random.default_rng(2)
    given = parameters(inflation_layer={"inflation_radius": 0.35, "cost_scaling_factor": 3.0})
    one = Costmap(given, Circle(0.1), None, "local_costmap")
    for k in range(30):
        pose = np.array((0.03 * k, 0.01 * k, 0.1 * k))
        seen(one, beam(*(0.5 + rng.random(4))), pose, 0.1 * k)
        lethal = one.cost == layers.LETHAL
        again = lethal.astype(np.uint8) * np.uint8(layers.LETHAL)
        distance = distance_transform_edt(~lethal) * 0.1
        again = inflation_cost(distance, one.inscribed, 3.0)
        again[distance > 0.4 + 1e-9] = 0
        assert (one.cost == again).mean() > 0.99


def test_persistent_scans_equal_a_replay_of_all_of_them() -> None:
    layer = ObstacleLayer(obstacle_range=1.5, raytrace_range=1.8, observation_persistence=0.35, inf_is_valid=True)
    given = parameters(obstacle_layer=layer, rolling_window=False, origin_x=-2.0, origin_y=-2.0)
    costmap = Costmap(given, Circle(0.05), None, "local_costmap")
    angle = np.arange(40) * (2 * math.pi / 40)
    rng = np.random.default_rng(3)
    kept: list[tuple[float, np.ndarray]] = []
    replay = np.zeros((40, 40), np.uint8)
    nothing = np.zeros((0, 0), np.int32)
    for k in range(40):
        t = 0.1 * k
        ranges = np.where(rng.random(40) < 0.3, math.inf, 0.3 + 1.5 * rng.random(40))
        seen(costmap, Scan(ranges, 0.0, angle[1], 0.05, 10.0, np.zeros(3)), STILL, t)
        points = np.where(np.isinf(ranges), 10.0 - 1e-4, ranges)[:, None] * np.stack((np.cos(angle), np.sin(angle)), 1)
        kept = [(s, p) for s, p in kept if t - s <= 0.35 + 1e-9] + [(t, points)]
        bounds, origin = np.zeros(4), np.array((-2.0, -2.0))
        for _, p in kept:
            layers.clear_rays(replay, origin, 0.1, p, 0.0, 0.0, 1.8, bounds, nothing, 0)
        for _, p in kept:
            layers.mark_points(replay, origin, 0.1, p[np.hypot(*p.T) < 1.5], bounds)
        polygon = costmap.footprint
        layers.fill_polygon(replay, origin, 0.1, np.ascontiguousarray(polygon), layers.FREE)
        np.testing.assert_array_equal(costmap.cost, replay)


def test_forget_keeps_a_square_around_the_robot() -> None:
    costmap = Costmap(parameters(), Circle(0.05), None, "local_costmap")
    seen(costmap, beam(0.52, 1.31))
    costmap.buffer(1.0, beam(math.inf), STILL)  # else the next update marks the kept scan again
    costmap.forget(0.0, 0.0, 2.0, False)
    costmap.update(STILL, STILL)
    assert at(costmap, 0.52, 0.0) == layers.LETHAL
    assert at(costmap, 0.0, 1.31) == layers.FREE
    costmap.forget(0.0, 0.0, 2.0, True)
    costmap.update(STILL, STILL)
    assert (costmap.cost == layers.LETHAL).sum() == 0


def test_a_rolling_window_may_lie_over_a_turned_map() -> None:
    data = np.zeros((60, 60), np.int8)
    data[40, 30] = 100  # map point (0.05, 1.05)
    given = parameters(static_layer={}, obstacle_layer=None)
    costmap = Costmap(given, Circle(0.05), OccupancyGrid(data, 0.1, (-3.0, -3.0)), "local_costmap")
    costmap.update(STILL, np.array((0.0, 0.0, math.pi / 2)))  # the odom frame's x axis is the map's y axis
    assert at(costmap, 1.05, -0.05) == layers.LETHAL
    assert (costmap.cost == layers.LETHAL).sum() == 1


def test_inflation_off_leaves_only_lethal_cells() -> None:
    given = parameters(inflation_layer=InflationLayer(enabled=False))
    costmap = Costmap(given, Circle(0.05), None, "local_costmap")
    seen(costmap, beam(1.02))
    assert sorted(np.unique(costmap.cost)) == [0, 254]


def test_rays_are_bresenhams_lines() -> None:
    rng = np.random.default_rng(3)
    for size in (7, 90, 1500):
        grid, no_stamps = np.full((size, size), layers.UNKNOWN, np.uint8), np.zeros((0, 0), np.int32)
        ends = rng.integers(0, size, (20, 2))
        x, y = size // 3, size // 2
        bounds = np.array((1e30, 1e30, -1e30, -1e30))
        layers.clear_rays(grid, np.zeros(2), 1.0, ends + 0.5, x + 0.5, y + 0.5, 1e4, bounds, no_stamps, 0)
        expected = np.full_like(grid, layers.UNKNOWN)
        for dx, dy in (ends - (x, y)).tolist():
            major, minor = max(abs(dx), abs(dy)), min(abs(dx), abs(dy))
            c, r, error = x, y, major // 2
            expected[r, c] = layers.FREE
            for _ in range(major):
                error += minor
                turn = error >= major
                error -= major * turn
                c += int(np.sign(dx)) * (turn or abs(dx) >= abs(dy))
                r += int(np.sign(dy)) * (turn or abs(dx) < abs(dy))
                expected[r, c] = layers.FREE
        assert np.array_equal(grid, expected)
