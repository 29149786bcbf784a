"""Nav2's costmaps against a second, plain reading on random scans; what differs from ROS 1's; clearing."""

from __future__ import annotations

import math

import nav2_costmap_oracle as oracle
import numpy as np
import pytest

from clearway.contract import Scan
from clearway.errors import ClearwayError
from clearway.geometry.frames import compose
from clearway.geometry.grid import OccupancyGrid
from clearway.navigators.common.costmaps.footprint import outline
from clearway.navigators.nav2.costmaps import kernels
from clearway.navigators.nav2.costmaps.costmap import Costmap
from clearway.navigators.nav2.costmaps.layers import inflation_costs
from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.costmaps import Costmap as Group
from clearway.robots import load_robot

ORIGIN = np.zeros(3)
SOURCE = {
    "clearing": True,
    "max_obstacle_height": 2.0,
    "obstacle_max_range": 1.7,
    "raytrace_max_range": 2.1,
    "inf_is_valid": True,
}


def source(**changes):
    return SOURCE | changes


def table(kind, layer, scan, **costmap):
    name = kind.lower()
    inflation = {
        "plugin": "nav2_costmap_2d::InflationLayer",
        "inflation_radius": 0.37,
        "cost_scaling_factor": 3.0,
        "inflate_unknown": False,
    }
    seen = {"plugin": f"nav2_costmap_2d::{kind}", "observation_sources": "scan", "scan": scan} | layer
    return {
        "global_frame": "odom",
        "rolling_window": True,
        "width": 3,
        "height": 3,
        "resolution": 0.05,
        "robot_radius": 0.18,
        "plugins": (name, "inflation"),
        name: seen,
        "inflation": inflation,
    } | costmap


def costmap(given, map=None, name="local_costmap"):
    return Costmap(name, settle(Group, given, name, None), load_robot("turtlebot4"), map)


def scan(rng, n=60):
    ranges = rng.uniform(0.1, 3.0, n)
    ranges[rng.random(n) < 0.1] = math.inf
    return Scan(ranges, -math.pi, 2 * math.pi / n, 0.12, 2.9, np.array((0.05, 0.02, 0.4)))


def points_of(scan, pose):
    sensor = compose(pose, scan.mount)
    found = []
    for i, r in enumerate(scan.ranges):
        r = scan.range_max - 0.0001 if math.isinf(r) else r
        if scan.range_min <= r < scan.range_max:
            angle = sensor[2] + scan.angle_min + i * scan.angle_increment
            found.append((sensor[0] + r * math.cos(angle), sensor[1] + r * math.sin(angle)))
    return (sensor[0], sensor[1]), found


def polygon_at(footprint, pose):
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return [(pose[0] + (x * c - y * s), pose[1] + (x * s + y * c)) for x, y in footprint]


def as_array(grid):
    return np.array([[grid.at[i, j] for i in range(grid.nx)] for j in range(grid.ny)])


CASES = [
    ("VoxelLayer", {}, {}, {}),
    ("VoxelLayer", {}, {"raytrace_min_range": 0.4, "obstacle_min_range": 0.5}, {"track_unknown_space": True}),
    ("ObstacleLayer", {}, {}, {}),
    ("ObstacleLayer", {"combination_method": 0}, {"raytrace_min_range": 0.4, "obstacle_min_range": 0.5}, {}),
    (
        "ObstacleLayer",
        {"combination_method": 2, "footprint_clearing_enabled": False},
        {},
        {"track_unknown_space": True},
    ),
    ("ObstacleLayer", {}, {"obstacle_max_range": 9.0, "raytrace_max_range": 9.0}, {"track_unknown_space": True}),
]


@pytest.mark.parametrize(("kind", "layer", "changes", "whole"), CASES)
def test_a_rolling_costmap_is_what_a_plain_reading_makes_of_the_same_scans(kind, layer, changes, whole):
    rng = np.random.default_rng(len(kind) + 7 * len(layer) + 13 * len(changes))
    scanned = source(**changes)
    ours = costmap(table(kind, layer, scanned, **whole))
    unknown = whole.get("track_unknown_space", False)
    default = 255 if unknown else 0
    master = oracle.Grid(60, 60, 0.05, 0.0, 0.0, default)
    options = {"marking": True, "footprint_clearing_enabled": True, "combination_method": 1}
    options |= {"obstacle_min_range": 0.0, "raytrace_min_range": 0.0} | scanned | layer
    seen = oracle.Obstacles(oracle.Grid(60, 60, 0.05, 0.0, 0.0, default), options, kind == "VoxelLayer")
    blow = {"inflation_radius": 0.37, "cost_scaling_factor": 3.0, "inflate_unknown": False}
    inflation = oracle.Inflation(blow | {"inflate_around_unknown": False}, ours.inscribed)
    pose = np.array((0.3, -0.2, 0.5))
    for k in range(6):
        pose = pose + np.array((0.11 * rng.random(), 0.07 * rng.random(), 0.2))
        one = scan(rng)
        ours.buffer(0.2 * k, one, pose)
        ours.update(pose, ORIGIN)
        polygon = polygon_at(ours.footprint, pose)
        seen.scans = [points_of(one, pose)]
        for grid in (master, seen.grid):
            grid.move(pose[0] - 1.5, pose[1] - 1.5)
        bounds = oracle.Bounds()
        seen.widen(bounds, polygon)
        inflation.widen(bounds)
        cells = oracle.window(bounds, master)
        for cell in cells:
            master.at[cell] = default
        seen.lay(master, polygon, cells)
        inflation.lay(master, cells)
        assert np.allclose(ours.origin, (master.x, master.y))
        assert np.array_equal(ours.cost, as_array(master)), f"update {k}"
    assert len(np.unique(ours.cost)) > (0 if layer.get("combination_method") == 2 else 5)  # all stays unknown there


@pytest.mark.parametrize("rolling", [True, False])
@pytest.mark.parametrize("maximum", [True, False])
@pytest.mark.parametrize("below", [True, False])
@pytest.mark.parametrize(("frees", "restores"), [(False, True), (True, True), (True, False)])
def test_a_static_layer_is_what_a_plain_reading_makes_of_the_same_map(rolling, maximum, below, frees, restores):
    rng = np.random.default_rng(8 * rolling + 4 * maximum + 2 * below + frees + restores)
    data = rng.choice(np.array((0, 100, -1), np.int8), (40, 50), p=(0.7, 0.15, 0.15))
    map, unknown = OccupancyGrid(data, 0.1, (-2.3, -1.7)), bool(rng.random() < 0.7)
    free = {"footprint_clearing_enabled": frees, "restore_cleared_footprint": restores}
    given = {
        "global_frame": "odom" if rolling else "map",
        "rolling_window": rolling,
        "width": 3,
        "height": 3,
        "resolution": 0.1,
        "robot_radius": 0.35,
        "track_unknown_space": unknown,
        "use_maximum": maximum,
        "plugins": ("seen", "static") if below else ("static", "seen"),
        "static": {"plugin": "nav2_costmap_2d::StaticLayer"} | free,
        "seen": {"plugin": "nav2_costmap_2d::ObstacleLayer", "observation_sources": "scan", "scan": source()},
    }
    ours, default = costmap(given, map), 255 if unknown else 0
    costs = {100: 254, -1: default, 0: 0}
    known = oracle.Grid(50, 40, 0.1, -2.3, -1.7, 0)
    known.at = {(i, j): costs[int(data[j, i])] for i in range(50) for j in range(40)}
    place = (30, 30, 0.1, 0.0, 0.0, default) if rolling else (50, 40, 0.1, -2.3, -1.7, default)
    master, seen = oracle.Grid(*place), oracle.Grid(*place)
    options = {"marking": True, "footprint_clearing_enabled": True, "combination_method": 1}
    options |= {"obstacle_min_range": 0.0, "raytrace_min_range": 0.0} | source()
    layers = {"seen": oracle.Obstacles(seen, options, False)}
    layers["static"] = static = oracle.Static(known, {"use_maximum": maximum} | free, rolling)
    frame = np.array((0.4, -0.3, 0.7)) if rolling else ORIGIN
    pose = np.array((0.9, -0.4, 0.5))
    for k in range(6):
        pose = pose + np.array((0.31 * rng.random(), 0.27 * rng.random(), 0.2))
        one = scan(rng)
        ours.buffer(0.2 * k, one, pose)
        ours.update(pose, frame)
        polygon = polygon_at(ours.footprint, pose)
        layers["seen"].scans = [points_of(one, pose)]
        if rolling:
            for grid in (master, seen):
                grid.move(pose[0] - 1.5, pose[1] - 1.5)
        bounds = oracle.Bounds()
        for name in given["plugins"]:
            layers[name].widen(bounds, polygon, *([frame] if layers[name] is static else []))
        cells = oracle.window(bounds, master)
        for cell in cells:
            master.at[cell] = default
        for name in given["plugins"]:
            if layers[name] is static:
                static.lay(master, cells, frame)
            else:
                layers[name].lay(master, polygon, cells)
        assert np.array_equal(ours.cost, as_array(master)), f"update {k}"
    assert len(np.unique(ours.cost)) > 1


def test_inflation_is_by_the_exact_distance_and_only_within_the_window():
    rng = np.random.default_rng(3)
    for case in range(12):
        grid = np.where(rng.random((40, 50)) < 0.02, 254, np.where(rng.random((40, 50)) < 0.1, 255, 0)).astype(np.uint8)
        if case % 3 == 0:
            grid[10:20, 15:40] = 254  # a block
        plain = oracle.Grid(50, 40, 0.05, 0.0, 0.0, 0)
        plain.at = {(i, j): int(grid[j, i]) for i in range(50) for j in range(40)}
        r0, c0 = rng.integers(0, 20, 2)
        window = np.array((r0, r0 + 15, c0, c0 + 22))
        options = {"inflation_radius": 0.38, "cost_scaling_factor": 4.0, "inflate_unknown": case % 2 == 0}
        options["inflate_around_unknown"] = case % 4 == 1
        oracle.Inflation(options, 0.19).lay(plain, [(i, j) for i in range(c0, c0 + 22) for j in range(r0, r0 + 15)])
        costs = inflation_costs(8, 0.05, 0.19, 4.0)
        kernels.inflate(grid, window, 8, costs, options["inflate_unknown"], options["inflate_around_unknown"])
        assert np.array_equal(grid, as_array(plain))


def test_small_groups_are_freed():
    rng = np.random.default_rng(4)
    for least in (2, 3, 5):
        for corners in (True, False):
            grid = np.where(rng.random((30, 30)) < 0.25, 254, 0).astype(np.uint8)
            right = grid.copy()
            cells = [(i, j) for j in range(30) for i in range(30) if grid[j, i] == 254]
            for group in oracle.groups(cells, corners):
                for i, j in group:
                    right[j, i] = 254 if len(group) >= least else 0
            kernels.denoise(grid, np.array((0, 30, 0, 30)), least, corners, False)
            assert np.array_equal(grid, right)


def room():
    data = np.zeros((80, 100), np.int8)
    data[0], data[-1], data[:, 0], data[:, -1] = 100, 100, 100, 100
    data[30:50, 40:45] = 100
    data[60:, 70:] = -1
    return OccupancyGrid(data, 0.05, (-1.0, -2.0))


def whole(**changes):
    return {
        "robot_radius": 0.18,
        "track_unknown_space": True,
        "plugins": ("static", "obstacle", "inflation"),
        "static": {"plugin": "nav2_costmap_2d::StaticLayer"},
        "obstacle": {"plugin": "nav2_costmap_2d::ObstacleLayer", "observation_sources": "scan", "scan": source()},
        "inflation": {"plugin": "nav2_costmap_2d::InflationLayer", "inflation_radius": 0.3},
    } | changes


def test_a_costmap_that_stands_has_the_map_what_is_seen_and_what_is_around_it():
    map = room()
    ours = costmap(whole(), map, "global_costmap")
    pose = np.array((0.0, 0.0, 0.0))
    ours.update(pose, ORIGIN)
    known = map.data >= 0
    assert np.array_equal(ours.cost == 254, map.data == 100)
    assert (ours.cost[~known] >= 253).all()
    assert ours.cost[70, 90] == 255
    beams = Scan(np.full(4, 0.6), 0.0, math.pi / 2, 0.1, 3.0, np.zeros(3))
    ours.buffer(0.0, beams, pose)
    ours.update(pose, ORIGIN)
    row, column = int((0.0 + 2.0) / 0.05), int((0.6 + 1.0) / 0.05)
    assert ours.cost[row, column] == 254
    assert ours.cost[row, column - 1] == 253
    assert ours.view().tracks_unknown
    assert ours.view().inflation == 0.3


def test_clearing_forgets_what_was_seen_and_nothing_is_current_until_the_next_update():
    ours = costmap(whole(), room(), "global_costmap")
    pose = np.zeros(3)
    ours.buffer(0.0, Scan(np.full(4, 0.6), 0.0, math.pi / 2, 0.1, 3.0, np.zeros(3)), pose)
    ours.update(pose, ORIGIN)
    before = ours.cost.copy()
    assert ours.current
    assert not ours.clear(("static",), pose, None, around=False)
    assert ours.current
    assert not ours.clear(("nothing",), pose, None, around=False)
    assert ours.clear((), pose, None, around=False)
    assert not ours.current
    assert (ours.cost == 255).all()
    ours.update(pose, ORIGIN)  # the newest scan is still there, and the map
    assert ours.current
    row, column = int(2.0 / 0.05), int(1.6 / 0.05)
    assert ours.cost[row, column] == before[row, column] == 254
    assert ours.clear((), pose, 1.0, around=True)  # a square of 1 m: the marks lie outside
    assert ours.layer_grid("obstacle")[row, column] == 254
    assert ours.layer_grid("obstacle")[row, column - 4] == 255
    assert ours.clear((), pose, 1.0, around=False)
    assert ours.layer_grid("obstacle")[row, column] == 255


def test_a_static_layer_rolls_in_odom_by_the_pose_of_odom_in_the_map():
    map = room()
    given = whole(global_frame="odom", rolling_window=True, width=2, height=2, resolution=0.05)
    given["plugins"] = ("static", "inflation")
    ours = costmap(given, map)
    frame = np.array((0.35, -0.15, 0.0))  # of odom in the map
    ours.update(np.array((0.5, 0.4, 0.3)), frame)
    for row in range(0, 40, 7):
        for column in range(0, 40, 7):
            x, y = ours.origin + (np.array((column, row)) + 0.5) * 0.05 + frame[:2]
            there = map.data[int((y + 2.0) / 0.05), int((x + 1.0) / 0.05)]
            assert (ours.cost[row, column] == 254) == (there == 100)


def test_a_lidar_above_what_a_source_hears_sees_nothing():
    """Nav2's own default of a source's max_obstacle_height is 0."""
    deaf = costmap(table("VoxelLayer", {}, source(max_obstacle_height=0.0)))
    deaf.buffer(0.0, scan(np.random.default_rng(1)), ORIGIN)
    deaf.update(ORIGIN, ORIGIN)
    assert (deaf.cost == 0).all()


def test_a_footprint_of_the_file_wins_over_the_robots_and_a_radius_is_one():
    given = table("ObstacleLayer", {}, source())
    assert costmap(given).round
    square = costmap(given | {"footprint": "[[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]]"})
    assert not square.round
    assert math.isclose(square.inscribed, 0.21, rel_tol=1e-6)  # its corners are floats
    assert square.footprint.shape == (4, 2)
    del given["robot_radius"]
    own = costmap(given)
    assert np.allclose(own.footprint, outline(load_robot("turtlebot4").planner_shape, 0.01))


def test_a_padding_below_zero_takes_off() -> None:
    less = costmap(table("ObstacleLayer", {}, source()) | {"footprint_padding": -0.02})
    assert np.abs(less.footprint[:, 0]).max() == pytest.approx(0.16)


def test_a_static_layer_without_a_map_is_one_clear_error():
    with pytest.raises(ClearwayError, match=r"global_costmap.*static layer"):
        costmap(whole(), None, "global_costmap")
