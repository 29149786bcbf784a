from __future__ import annotations

import math

import numpy as np
import pytest
from simulated_room import BOXES, cast, drive, make_robot

from clearway.contract import Sensing
from clearway.errors import ClearwayError
from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.perception import MappingParameters
from clearway.perception import scan_matching as sm
from clearway.perception.map_quality import map_quality
from clearway.perception.mapping import GridMapper, render

START = np.array((2.0, 2.5, 0.0))
PARAMETERS = MappingParameters(linearUpdate=0.3, angularUpdate=0.3, particles=5, maxUrange=9.0)
ROBOT = make_robot(
    odometry={"translation_per_metre": 0.02, "rotation_per_metre": 0.03, "rotation_per_radian": 0.03, "scale": 0.01}
)


def tour() -> list[Sensing]:
    """A loop through the room: 5 m ahead, back, and a full turn."""
    straight, turn = np.tile((0.5, 0.0), (90, 1)), np.tile((0.0, math.pi / 4), (40, 1))
    return drive(START, np.vstack((straight, turn, straight, turn)), ROBOT, 4)


def build(sensed: list[Sensing], **how: object) -> tuple[GridMapper, list[int]]:
    mapper = GridMapper(PARAMETERS.model_copy(update=how), START, 0, scan_matching=bool(how.pop("scan_matching", True)))
    used = [k for k, s in enumerate(sensed) if s.scan is not None and mapper.add(s.odom_pose, s.scan)]
    return mapper, used


def truth_of(sensed: list[Sensing], used: list[int]) -> OccupancyGrid:
    poses = np.array([sensed[k].truth for k in used])
    scans = []
    for pose in poses:
        scan = cast(pose, ROBOT)
        scans.append(sm.beams(scan.ranges, scan.angle_min, scan.angle_increment, scan.mount, 9.0, 11.99))
    return render(poses, scans, np.array((0.1, 0.0, 0.0)), 0.05, 0.0)


def test_the_filter_maps_what_odometry_alone_smears() -> None:
    sensed = tour()
    matched, used = build(sensed)
    alone, _ = build(sensed, scan_matching=False)
    truth = truth_of(sensed, used)
    good, bad = map_quality(matched.map(), truth), map_quality(alone.map(), truth)
    assert good.f1 > 0.9
    assert bad.f1 < 0.8
    error = np.hypot(*(matched.path - [sensed[k].truth for k in used])[:, :2].T)
    assert error.max() < 0.12


def test_the_gaussian_proposal_maps_too_and_draws_differ_by_seed() -> None:
    sensed = tour()[:100]
    first, used = build(sensed, proposal="gaussian", particles=3)
    again, _ = build(sensed, proposal="gaussian", particles=3)
    np.testing.assert_array_equal(first.path, again.path)
    assert map_quality(first.map(), truth_of(sensed, used)).f1 > 0.8


def test_odometry_alone_puts_scans_where_the_odometry_says() -> None:
    sensed = tour()[:40]
    mapper, used = build(sensed, scan_matching=False)
    last = sensed[used[-1]].odom_pose  # starts at zero, heading along the start's heading, which is 0
    np.testing.assert_allclose(mapper.path[-1], START + last, atol=1e-12)


def test_a_poor_match_is_not_believed() -> None:
    sensed = tour()[:30]
    mapper, used = build(sensed, minimumScore=1e9, particles=1, srr=0.0, srt=0.0, str=0.0, stt=0.0)
    np.testing.assert_allclose(mapper.path[-1], START + sensed[used[-1]].odom_pose, atol=1e-12)


def test_scans_are_used_once_the_robot_has_moved_far_enough() -> None:
    _, used = build(tour()[:90], particles=1)  # 4.5 m straight ahead, a scan each 0.05 m
    assert used[0] == 0
    assert set(np.diff(used)) <= {5, 6, 7}  # 0.3 m, give or take the odometry's noise


def test_the_map_grows_where_the_robot_sees_beyond_it() -> None:
    sensed = tour()[:20]
    small, _ = build(sensed, xmin=-0.5, xmax=0.5, ymin=-0.5, ymax=0.5, particles=2)
    large, _ = build(sensed, particles=2)
    np.testing.assert_allclose(small.path, large.path, atol=1e-4)  # float32 ends, counted from another corner


def test_matching_finds_the_offset() -> None:
    mapper = GridMapper(PARAMETERS.model_copy(update={"particles": 1}), START, 0)
    scan = cast(START, ROBOT)
    mapper.add(np.zeros(3), scan)
    beams = sm.beams(scan.ranges, scan.angle_min, scan.angle_increment, scan.mount, 9.0, 11.99)
    wrong = START + np.array((0.06, -0.05, 0.02))
    found, score = sm.climb(mapper._cells[0], mapper._origin, 0.05, beams, wrong, (-1, 0, 1), 0.05, 0.05, 0.05, 8)
    np.testing.assert_allclose(found, START, atol=5e-3)
    assert score > sm.fit(mapper._cells[0], mapper._origin, 0.05, beams, wrong, (-1, 0, 1), 0.05, 0.075)[0]


def test_fit_against_the_formula() -> None:
    cells = np.full((3, 20, 20), np.inf, dtype=np.float32)
    cells[2] = 0.0
    cells[:, 10, 10] = 0.52, 0.53, 4.0
    beams = np.array(((0.5, 0.5, 1.0, 0.0, 1.0), (0.2, 0.2, 1.0, 0.0, 1.0)))
    score, likelihood = sm.fit(cells, np.zeros(2), 0.05, beams, np.zeros(3), (-1, 0, 1), 0.05, 0.075)
    d2 = 0.02**2 + 0.03**2
    assert score == pytest.approx(math.exp(-d2 / (2 * 0.05**2)), rel=1e-5)
    assert likelihood == pytest.approx(-d2 / (2 * 0.075**2) - 0.5 / 0.075, rel=1e-5)


def test_a_drawn_map_holds_walls_floor_and_what_nobody_saw() -> None:
    scan = cast(START, ROBOT)
    beams = sm.beams(scan.ranges, scan.angle_min, scan.angle_increment, scan.mount, 9.0, 11.99)
    grid = render(START[None], [beams], scan.mount, 0.05, 0.25)

    def at(x: float, y: float) -> int:
        return int(grid.data[round((y - grid.origin[1]) / 0.05 - 0.5), round((x - grid.origin[0]) / 0.05 - 0.5)])

    assert at(10.0, 2.5) == OCCUPIED  # the wall straight ahead, 7.9 m from the sensor
    assert at(6.0, 2.5) == FREE
    assert at(4.2, 4.7) == UNKNOWN  # inside the pillar
    occupied = np.argwhere(grid.data == OCCUPIED)[:, ::-1] * 0.05 + np.asarray(grid.origin) + 0.025
    gap = np.maximum(np.maximum(BOXES[:, None, :2] - occupied, occupied - BOXES[:, None, 2:]), 0.0)
    assert np.hypot(*np.moveaxis(gap, 2, 0)).min(axis=0).max() < 0.04  # every wall's cell is one of the boxes' faces


def grid_of(cells: list[tuple[int, int]], origin: tuple[float, float] = (0.0, 0.0)) -> OccupancyGrid:
    data = np.full((12, 12), FREE, dtype=np.int8)
    for row, col in cells:
        data[row, col] = OCCUPIED
    return OccupancyGrid(data, 0.1, origin)


def test_quality_by_hand() -> None:
    truth = grid_of([(5, 1), (5, 2), (5, 3), (5, 4)])
    built = grid_of([(5, 1), (6, 2), (8, 8)])  # on it, beside it, nowhere near
    q = map_quality(built, truth)
    assert q.precision == pytest.approx(2 / 3)
    assert q.recall == pytest.approx(3 / 4)  # (5, 4) is two columns from (6, 2)
    assert q.f1 == pytest.approx(2 * (2 / 3) * 0.75 / (2 / 3 + 0.75))
    exact = map_quality(built, truth, tolerance_cells=0)
    assert (exact.precision, exact.recall) == (pytest.approx(1 / 3), pytest.approx(1 / 4))
    assert map_quality(truth, truth).f1 == 1.0
    assert map_quality(grid_of([]), truth).f1 == 0.0
    moved = grid_of([(3, 1), (3, 2), (3, 3), (3, 4)], origin=(0.0, 0.2))  # the same places, another corner
    assert map_quality(moved, truth, tolerance_cells=0).f1 == 1.0
    with pytest.raises(ValueError, match="differ in size"):
        map_quality(OccupancyGrid(truth.data, 0.05, (0.0, 0.0)), truth)


def test_a_wrong_mapping_parameter_is_named() -> None:
    with pytest.raises(ClearwayError, match=r"robot box: mapping.particels: unknown key; did you mean 'particles'"):
        MappingParameters.read(make_robot(mapping={"particels": 3}))
    with pytest.raises(ClearwayError, match="xmax"):
        MappingParameters.read(make_robot(mapping={"xmin": 1.0, "xmax": 0.0}))
