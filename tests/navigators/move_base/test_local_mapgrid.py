"""Wavefront grids and footprint costs against plain readings of them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from local_oracle import distances, footprint_cost, plan_cells, robot_cells

from clearway.geometry.shapes import Circle, rectangle
from clearway.navigators.common.costmaps import footprint
from clearway.navigators.move_base.local_planners import mapgrid

ORIGIN, RESOLUTION = np.array([-1.0, -0.5]), 0.05
STAR = np.array([(0.3, 0.0), (0.05, 0.1), (-0.2, 0.2), (-0.1, 0.0), (-0.2, -0.2)])


def random_cost(seed, rows=30, cols=40, density=0.2):
    rng = np.random.default_rng(seed)
    cost = rng.choice(np.array([0, 0, 0, 17, 130, 252], np.uint8), (rows, cols))
    return np.where(
        rng.random((rows, cols)) < density, rng.choice(np.array([253, 254, 255], np.uint8), (rows, cols)), cost
    )


def scene_of(cost, polygon=STAR):
    return footprint.make_scene(np.ascontiguousarray(cost), ORIGIN, RESOLUTION, polygon)


def cost_at(scene, x, y, cosine, sine, scale):
    return footprint.footprint_cost(scene.cost, scene.frame, scene.polygon, x, y, cosine, sine, scale)


def wave_from_plan(cost, plan, wanted_cells=None, pose=None):
    """Distances to the plan as (rows, cols), and the local goal's cell; all cells are wanted unless some are named."""
    scene, room = scene_of(cost), mapgrid.make_room(cost.shape)
    stride = cost.shape[1] + 2
    unreached = mapgrid.clear(scene.cost, room.blank)
    room.path[:] = room.blank
    if pose is not None:
        footprint.free_under_robot(scene, pose, room.path, unreached)
    cells = (
        [(r, c) for r in range(cost.shape[0]) for c in range(cost.shape[1])] if wanted_cells is None else wanted_cells
    )
    flat = np.array([(r + 1) * stride + c + 1 for r, c in cells], np.int32)
    room.wanted[flat] = mapgrid.BODY
    targets, last = mapgrid.lay_plan(scene, plan, plan[-1, 0], plan[-1, 1], room.path, room.queue, True)
    mapgrid.spread(room, room.path, targets, mapgrid.Seek(flat, len(flat)), mapgrid.BODY, stride, unreached)
    grid = np.minimum(room.path, unreached).reshape(cost.shape[0] + 2, stride)[1:-1, 1:-1]
    return grid, ((last // stride - 1, last % stride - 1) if last >= 0 else None)


def random_plan(seed):
    rng = np.random.default_rng(seed)
    return np.column_stack((rng.uniform(-1.1, 1.1, (4, 2)), np.zeros(4)))


@pytest.mark.parametrize("seed", range(12))
def test_distances_are_those_of_a_breadth_first_search(seed):
    cost, plan = random_cost(seed), random_plan(seed)
    targets = plan_cells(plan, cost, ORIGIN, RESOLUTION)
    grid, local_goal = wave_from_plan(cost, plan)
    assert local_goal == (targets[-1] if targets else None)
    assert np.array_equal(grid, distances(cost, targets))


@pytest.mark.parametrize("seed", range(12))
def test_stopping_early_changes_no_wanted_distance(seed):
    cost, plan = random_cost(seed, density=0.35), random_plan(seed)
    rng = np.random.default_rng(seed)
    wanted = list(
        dict.fromkeys((int(r), int(c)) for r, c in zip(rng.integers(0, 30, 9), rng.integers(0, 40, 9), strict=True))
    )
    grid, _ = wave_from_plan(cost, plan, wanted)
    truth = distances(cost, plan_cells(plan, cost, ORIGIN, RESOLUTION))
    assert [grid[cell] for cell in wanted] == [truth[cell] for cell in wanted]


def test_a_wave_in_the_open_is_the_manhattan_distance():
    cost = np.zeros((30, 40), np.uint8)
    grid, _ = wave_from_plan(cost, np.array([[-0.975, -0.475, 0.0]]))
    r, c = np.mgrid[:30, :40]
    assert np.array_equal(grid, r + c)


def test_cells_under_the_robot_let_the_wave_pass():
    cost, plan = random_cost(3, density=0.4), random_plan(3)
    pose = np.array([0.1, 0.2, 0.7])
    free = robot_cells(pose, STAR, ORIGIN, RESOLUTION, cost.shape)
    grid, _ = wave_from_plan(cost, plan, pose=pose)
    truth = distances(cost, plan_cells(plan, cost, ORIGIN, RESOLUTION), free)
    assert len(free) > 20
    assert np.array_equal(grid, truth)


@settings(max_examples=200, deadline=None)
@given(
    st.floats(-1.1, 1.1),
    st.floats(-0.6, 1.1),
    st.floats(-7, 7),
    st.floats(0.8, 1.3),
    st.integers(0, 5),
    st.sampled_from([0, 0.003, 0.03]),
)
def test_footprint_cost_is_the_worst_cell_of_the_outline(x, y, yaw, scale, seed, density):
    cost = random_cost(seed, density=density)
    got = cost_at(scene_of(cost), x, y, math.cos(yaw), math.sin(yaw), scale)
    assert max(got, -1) == footprint_cost((x, y, yaw), STAR, scale, cost, ORIGIN, RESOLUTION)


def test_footprint_cost_tells_why_a_pose_is_illegal():
    cost = np.zeros((30, 40), np.uint8)
    square = footprint.outline(rectangle(0.18, 0.18))
    at = lambda c: cost_at(scene_of(c, square), 0.0, 0.25, 1.0, 0.0, 1.0)  # noqa: E731
    assert at(cost) == 0
    cost[13, 18] = 250  # on the outline's lower left corner (-0.09, 0.16)
    assert at(cost) == 250
    cost[13, 18] = 254
    assert at(cost) == -1
    cost[13, 18] = 255
    assert at(cost) == -2
    cost[:] = 0
    cost[15, 20] = 254  # under the robot but not under its outline
    assert at(cost) == 0
    assert cost_at(scene_of(cost, square), -0.95, 0.25, 1.0, 0.0, 1.0) == -3


def test_a_polygons_corners_are_floats_as_the_real_ones_pass_through_a_string():
    """So HOSBOT's half width of 0.3 m lies not below six cells of 0.05 m, whose product in doubles is a bit more than 0.3."""
    assert 0.3 < 6 * 0.05 <= footprint.outline(rectangle(0.6, 0.6))[2, 0] < 0.3 + 1e-7


def test_a_circle_is_a_polygon_of_sixteen_corners_and_padding_moves_coordinates():
    polygon = footprint.outline(Circle(0.275))
    assert polygon.shape == (16, 2)
    assert np.hypot(*polygon.T) == pytest.approx(0.275)
    assert footprint.outline(rectangle(0.42, 0.33), 0.1).tolist() == pytest.approx(np.array(
        [[-0.31, -0.265], [0.31, -0.265], [0.31, 0.265], [-0.31, 0.265]]))  # fmt: skip
    assert footprint.outline(Circle(0.2), 0.01)[0] == pytest.approx([0.21, 0.0])
