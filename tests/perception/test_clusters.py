"""The discs cover every return, however odd the scan, are not too many, and are small along walls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from simulated_room import cast, make_robot, room_map

from clearway.contract import Scan
from clearway.geometry.grid import FREE, OCCUPIED, OccupancyGrid
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle
from clearway.perception.clusters import ClusterParameters, Returns, known_structure, perceive
from clearway.perception.covering import cover

P = ClusterParameters()
ODD = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 1e300])
RANGES = st.one_of(st.floats(0.0625, 6.0, width=32), ODD)


def scan_of(ranges: np.ndarray, fov: float = 2 * math.pi, mount: tuple[float, float, float] = (0.2, 0.1, 0.3)) -> Scan:
    n = len(ranges)
    return Scan(np.asarray(ranges, dtype=float), -fov / 2, fov / max(n, 1), 0.05, 10.0, np.array(mount))


def ends(scan: Scan, pose: np.ndarray, limit: float = P.range_limit) -> np.ndarray:
    """Where the beams end (m, 2), in plain numpy."""
    r = scan.ranges
    with np.errstate(invalid="ignore"):
        good = np.isfinite(r) & (r >= scan.range_min) & (r <= min(limit, scan.range_max))
    c, s = math.cos(pose[2]), math.sin(pose[2])
    eye = pose[:2] + np.array([c * scan.mount[0] - s * scan.mount[1], s * scan.mount[0] + c * scan.mount[1]])
    angle = pose[2] + scan.mount[2] + scan.angle_min + scan.angle_increment * np.arange(len(r))
    return eye + (r[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))[good]


def covered(points: np.ndarray, discs: np.ndarray, tolerance: float = 1e-9) -> bool:
    if not len(points):
        return True
    gap = np.hypot(points[:, None, 0] - discs[:, 0], points[:, None, 1] - discs[:, 1]) - discs[:, 2]
    return bool((gap.min(axis=1) <= tolerance).all())


def everything(returns: Returns) -> np.ndarray:
    return np.ones(len(returns.size), dtype=np.uint8)


@settings(max_examples=150, deadline=None)
@given(
    st.integers(0, 300).flatmap(lambda n: arrays(np.float64, n, elements=RANGES)),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-4, 4)),
    st.integers(16, 300),
    st.booleans(),
)
def test_every_return_is_covered_by_a_bounded_number_of_discs(
    ranges: np.ndarray, pose: tuple[float, float, float], most: int, legs: bool
) -> None:
    scan, at = scan_of(ranges), np.array(pose)
    truth = ends(scan, at)
    returns = perceive(scan, at, P, legs=legs)
    assert np.allclose(returns.points, truth, atol=1e-9)
    assert covered(truth, returns.circles)
    assert returns.size.sum() == len(truth)
    discs, identity, _ = cover(returns, everything(returns), scan.angle_increment, P, most)
    assert covered(truth, discs)
    assert len(discs) <= most
    assert len(set(identity.tolist())) == len(identity)
    assert (identity < 0).all()


def test_nothing_comes_of_nothing() -> None:
    for ranges in (np.empty(0), np.full(90, np.inf), np.full(90, np.nan), np.full(90, 9.0)):
        returns = perceive(scan_of(ranges), np.zeros(3), P)
        assert len(returns.points) == len(returns.circles) == 0
        assert len(cover(returns, everything(returns), 0.1, P, 16)[0]) == 0


@pytest.mark.parametrize(
    ("apart", "radius", "third", "people"),
    [(0.25, 0.06, None, 1), (0.35, 0.06, None, 1), (0.35, 0.06, 0.39, 1), (0.45, 0.06, None, 0), (0.39, 0.14, None, 0)],
)
def test_two_legs_are_one_person(apart: float, radius: float, third: float | None, people: int) -> None:
    """Too far apart or too thick they are two things; a third leg beside two stays alone."""
    rays = beams(1440, -math.pi, math.pi - math.tau / 1440, 0.05, 10.0)
    at = [[0.8, 0.5 * apart, 0.0], [0.8, -0.5 * apart, 0.0]] + ([[0.8, 0.5 * apart + third, 0.0]] if third else [])
    ranges = sweep(scene([Circle(radius)] * len(at), np.array(at)), rays, np.zeros(3))
    scan = Scan(ranges, rays.angle_min, rays.increment, 0.05, 10.0, np.zeros(3))
    single, paired = (perceive(scan, np.zeros(3), P, legs=legs) for legs in (False, True))
    assert len(single.size) == len(at)
    assert len(paired.size) == len(at) - people
    assert paired.size.sum() == single.size.sum()
    if people:
        (k,) = np.flatnonzero(paired.circles[:, 2] > 0.2)
        assert paired.circles[k, :2] == pytest.approx([0.8, 0.0], abs=0.01)
        assert paired.circles[k, 2] == pytest.approx(0.25, abs=0.01)
        assert paired.legs[k] == 1
    assert paired.legs.sum() == people
    assert not single.legs.any()


def test_one_face_of_a_square() -> None:
    """From straight ahead the circle stands on the face: radius e / 2, and half the spacing of the beams."""
    edge, distance, n = 0.6, 2.0, 1200
    angle = -math.pi + 2 * math.pi / n * np.arange(n)
    with np.errstate(divide="ignore"):
        on_face = np.where(np.abs(np.tan(angle)) * distance <= edge / 2, distance / np.cos(angle), np.inf)
    ranges = np.where(np.cos(angle) > 0, on_face, np.inf)
    returns = perceive(scan_of(ranges, mount=(0, 0, 0)), np.zeros(3), P)
    ((x, y, radius),) = returns.circles.tolist()
    assert (x, y) == pytest.approx((distance, 0.0), abs=0.012)
    spacing = 2 * math.pi / n * returns.far[0]
    assert edge / 2 - 0.001 <= radius <= edge / 2 + spacing


def test_a_wall_is_a_chain_of_small_discs_that_stay_while_the_robot_moves() -> None:
    robot = make_robot()
    seen = []
    for x in (3.0, 3.4):
        pose = np.array([x, 1.5, -math.pi / 2])
        scan = cast(pose, robot)
        returns = perceive(scan, pose, P)
        discs, identity, _ = cover(returns, everything(returns), scan.angle_increment, P, P.discs)
        on_wall = np.abs(discs[:, 1]) < 0.05
        assert on_wall.sum() > 20
        assert discs[on_wall, 2].max() < 0.2
        assert discs[:, 2].max() < 2 * P.cell / math.sqrt(2) + scan.angle_increment * P.range_limit
        seen.append(dict(zip(identity.tolist(), discs, strict=True)))
    same = set(seen[0]) & set(seen[1])
    assert len(same) > 20
    shift = [np.hypot(*(seen[0][i] - seen[1][i])[:2]) for i in same]
    assert np.median(shift) < 0.04  # the beams are 0.02 m apart and more
    assert max(shift) < 0.15  # inside one cell


def test_a_doorway_stays_open() -> None:
    """Two walls of 0.2 m with a gap of 0.9 m: a disc on a reveal bulges by 0.71 cell at most, which leaves 0.74 m of it."""
    n = 1200
    angle = -math.pi + 2 * math.pi / n * np.arange(n)
    ranges = np.full(n, np.inf)
    for i, a in enumerate(angle):
        c, s = math.cos(a), math.sin(a)
        if c > 0:
            across = 1.4 * s / c
            if 0.45 <= abs(across) <= 2.0:
                ranges[i] = 1.4 / c
            elif s != 0 and 1.4 <= 0.45 / abs(s) * c <= 1.6:
                ranges[i] = 0.45 / abs(s)  # the reveal
    scan = scan_of(ranges, mount=(0, 0, 0))
    returns = perceive(scan, np.zeros(3), P)
    discs, _, _ = cover(returns, everything(returns), scan.angle_increment, P, P.discs)
    left, right = discs[discs[:, 1] > 0], discs[discs[:, 1] < 0]
    assert (left[:, 1] - left[:, 2]).min() - (right[:, 1] + right[:, 2]).max() > 0.74


def test_clusters_part_where_the_range_jumps_and_join_around_the_back() -> None:
    ranges = np.full(360, np.inf)
    ranges[40:60], ranges[60:80] = 2.0, 2.5
    ranges[-5:], ranges[:5] = 1.0, 1.0  # across the seam
    returns = perceive(scan_of(ranges), np.zeros(3), P)
    assert sorted(returns.size.tolist()) == [10, 20, 20]
    behind = int(np.argmin(returns.size))
    assert returns.circles[behind, 2] < 0.1
    cut = dict(zip(returns.far.round(1).tolist(), returns.cut.tolist(), strict=True))
    assert cut == {1.0: 0, 2.0: 0, 2.5: 1}  # the far one may go on behind the near one


def test_a_cluster_at_the_edge_of_the_view_is_cut() -> None:
    ranges = np.full(100, np.inf)
    ranges[:10] = ranges[50:60] = 2.0
    returns = perceive(scan_of(ranges, fov=2.0), np.zeros(3), P)
    assert returns.cut.tolist() == [1, 0]


def test_the_map_tells_known_from_unknown() -> None:
    """In the simulated room all is on the map; a box that is not is a cluster of its own, though it touches a wall."""
    robot, pose = make_robot(), np.array([5.0, 1.5, -math.pi / 2])
    known = known_structure(room_map(), P.known_within)
    scan = cast(pose, robot, np.random.default_rng(1))
    returns = perceive(scan, pose, P, 0.01, known)
    assert returns.known.mean() > 0.99
    middle = robot.lidar.beams // 2
    scan.ranges[middle - 8 : middle + 9] = 1.4 - 0.35  # 0.35 m before the wall
    returns = perceive(scan, pose, P, 0.01, known)
    unknown = np.flatnonzero([not returns.known[returns.label == k].any() for k in range(len(returns.size))])
    assert returns.size[unknown].tolist() == [17]
    assert returns.circles[unknown[0], :2] == pytest.approx((5.0, 0.35), abs=0.03)


def test_the_map_is_asked_at_the_believed_pose() -> None:
    grid = OccupancyGrid(np.full((40, 40), FREE, dtype=np.int8), 0.1, (0.0, 0.0))
    grid.data[:, 30] = OCCUPIED  # x = 3.0 to 3.1
    known = known_structure(grid, 0.11)
    scan = scan_of(np.array([1.0]), fov=0.0, mount=(0, 0, 0))
    odom, believed = np.array([7.0, 7.0, 1.0]), np.array([2.05, 2.0, 0.0])
    returns = perceive(scan, odom, P, 0.0, known, believed)
    assert returns.known.tolist() == [1]
    assert returns.points[0] == pytest.approx((7 + math.cos(1.0), 7 + math.sin(1.0)))
    assert perceive(scan, odom, P, 0.0, known).known.tolist() == [0]
    off = perceive(scan, odom, P, 0.0, known, np.array([2.05, -5.0, 0.0]))  # beyond the map
    assert off.known.tolist() == [0]
