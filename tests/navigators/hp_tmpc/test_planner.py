"""The heuristic planner among discs that stand still, and its exact mode."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from clearway.navigators.hp_tmpc.heuristic_planner import planner
from clearway.navigators.hp_tmpc.heuristic_planner.exact import FOUND, LESS, exact_path
from clearway.navigators.hp_tmpc.heuristic_planner.pieces import path_length, polyline, sample
from clearway.navigators.hp_tmpc.heuristic_planner.planner import (
    NO_PATH,
    START_COVERED,
    TARGET_COVERED,
    UNREACHABLE,
    Path,
)
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import NONE, first_on_segment

FREE = np.array([-np.inf, -np.inf, np.inf, np.inf])
EVERYWHERE = np.array([0.0, 0.0, np.inf])
START, TARGET = np.array([0.0, 0.0]), np.array([10.0, 0.0])
NO_DISCS = np.zeros((0, 3))

disc = st.tuples(st.floats(-1, 11), st.floats(-3, 3), st.floats(0.3, 1.2))
scenes = st.lists(disc, min_size=1, max_size=14).map(np.array)


def plan(
    discs: np.ndarray, *, start: np.ndarray = START, target: np.ndarray = TARGET, area: np.ndarray = FREE,
    zone: np.ndarray = EVERYWHERE, draw: float = 0.25, exact: bool = False, keep: float = 0.0,
) -> Path:  # fmt: skip
    return planner.plan_path(start, target, discs, area, zone, draw, exact, keep)


def deepest(pieces: np.ndarray, discs: np.ndarray) -> float:
    """How deep [m] the path dips into a disc, from many points on it."""
    s = np.linspace(0, path_length(pieces), 4000)
    points = sample(pieces, s, np.zeros(3))
    return float((discs[:, 2] - np.hypot(points[:, :1] - discs[:, 0], points[:, 1:2] - discs[:, 1])).max())


def joined(pieces: np.ndarray) -> bool:
    return bool(np.abs(pieces[1:, :2] - pieces[:-1, 2:4]).max(initial=0.0) < 1e-8)


def test_one_disc_by_hand() -> None:
    path = plan(np.array([[5.0, 0.5, 2.0]]))
    tangent = math.sqrt(25 + 0.25 - 4)
    half = math.atan2(5, 0.5) - math.acos(2 / math.sqrt(25.25))  # of the arc below the centre
    assert path.status == 0
    assert path.side == -1
    assert path.length == pytest.approx(2 * tangent + 2 * 2 * half, abs=1e-12)
    assert path_length(path.other) == pytest.approx(2 * tangent + 2 * 2 * (half + 2 * math.atan2(0.5, 5)), abs=1e-12)
    assert (path.other[1, 6], path.pieces[1, 6]) == pytest.approx((-2 * (half + 2 * math.atan2(0.5, 5)), 2 * half))


def test_a_union_is_passed_by_the_tangent_across_its_outer_circles() -> None:
    # a wall of five discs with a dent in the middle: the string spans the dent
    discs = np.array([[3.0, 0.0, 0.6], [4.0, -0.1, 0.6], [5.0, -0.3, 0.6], [6.0, -0.1, 0.6], [7.0, 0.0, 0.6]])
    path = plan(discs)
    assert path.side == 1
    assert len(path.pieces) == 5  # tangent, arc, straight across, arc, tangent
    np.testing.assert_allclose(path.pieces[2, :4], [3.0, 0.6, 7.0, 0.6], atol=1e-12)


@given(scenes)
@example(np.array([[0.0, 0.0, 1.0]]))
@example(np.array([[10.0, 0.0, 1.0], [0.0, 0.0, 0.5]]))
@example(np.array([[0.0, 1.5, 1.015625], [0.0, 4e-31, 0.5], [-1.0, -0.25, 1.125]]))
@settings(max_examples=250)
def test_a_path_is_clear_of_discs_and_ends_where_it_says(discs: np.ndarray) -> None:
    exact, greedy = plan(discs, exact=True), plan(discs)
    for path in (exact, greedy):
        assert not path.status & NO_PATH
        assert joined(path.pieces)
        at_start = np.hypot(discs[:, 0], discs[:, 1]) < discs[:, 2] - 1e-9
        assert bool(path.status & START_COVERED) == at_start.any()
        end = path.pieces[-1, 2:4]
        np.testing.assert_allclose(path.pieces[0, :2], START, atol=1e-12)
        if not path.status & (TARGET_COVERED | UNREACHABLE):
            np.testing.assert_allclose(end, TARGET, atol=1e-8)
        after = path.pieces[1:] if at_start.any() else path.pieces  # none: the way out ends in a pocket
        assert deepest(after if len(after) else np.array([[*end, *end, 0.0, 0.0, 0.0]]), discs) < 3e-9
        line = polyline(path.pieces, 0.01)
        chords = np.hypot(*np.diff(line, axis=0).T).sum()
        assert chords <= path.length + 1e-9
        assert path.length - chords < 1e-3
    assert greedy.length >= exact.length - 1e-9
    assert bool(greedy.status & UNREACHABLE) == bool(exact.status & UNREACHABLE)


@given(scenes)
@settings(max_examples=120)
def test_it_never_crosses_itself(discs: np.ndarray) -> None:
    path = plan(discs)
    covered = path.status & (START_COVERED | TARGET_COVERED)  # then the longer one may
    for pieces in (path.pieces,) if covered else (path.pieces, path.other):
        if len(pieces) > 1:
            assert shapely.LineString(polyline(pieces, 0.02)).simplify(1e-7).is_simple


def polygons(discs: np.ndarray, corners: int, *, outside: bool) -> tuple[np.ndarray, shapely.Geometry]:
    """Corners of polygons around (or inside of) the discs, and their union a hair smaller."""
    a = 2 * np.pi * (np.arange(corners) + 0.5) / corners
    r = discs[:, 2] / (math.cos(math.pi / corners) if outside else 1.0)
    around = np.stack([np.cos(a), np.sin(a)], -1)
    points = discs[:, None, :2] + r[:, None, None] * around
    shrunk = discs[:, None, :2] + (r - 1e-7)[:, None, None] * around
    return points.reshape(-1, 2), shapely.union_all([shapely.Polygon(p) for p in shrunk])


def among_polygons(discs: np.ndarray, corners: int, *, outside: bool) -> float:
    """The shortest path by a brute-force visibility graph over all corners (shapely, scipy)."""
    points, union = polygons(discs, corners, outside=outside)
    points = points[~shapely.contains_xy(union, points[:, 0], points[:, 1])]
    points = np.concatenate([[START, TARGET], points])
    i, j = np.triu_indices(len(points), 1)
    lines = shapely.linestrings(np.stack([points[i], points[j]], 1))
    shapely.prepare(union)
    sees = ~shapely.intersects(union, lines)
    i, j = i[sees], j[sees]
    graph = csr_matrix((np.hypot(*(points[i] - points[j]).T), (i, j)), (len(points), len(points)))
    return float(dijkstra(graph, directed=False, indices=0)[1])


@given(st.lists(disc, min_size=2, max_size=9).map(np.array))
@settings(max_examples=25)
def test_exact_lies_between_two_brute_force_searches(discs: np.ndarray) -> None:
    assume((np.hypot(discs[:, 0], discs[:, 1]) > 1.05 * discs[:, 2]).all())
    assume((np.hypot(discs[:, 0] - 10, discs[:, 1]) > 1.05 * discs[:, 2]).all())
    path = plan(discs, exact=True)
    shortest, longest = (among_polygons(discs, 28, outside=outside) for outside in (False, True))
    if path.status & UNREACHABLE:
        assert longest == math.inf
    else:
        assert shortest - 1e-6 <= path.length <= longest + 1e-6
    greedy = plan(discs)
    assert greedy.length >= path.length - 1e-9


@given(scenes)
@settings(max_examples=100)
def test_a_known_bound_does_not_change_the_shortest_path(discs: np.ndarray) -> None:
    assume((np.hypot(discs[:, 0], discs[:, 1]) >= discs[:, 2]).all())
    assume((np.hypot(discs[:, 0] - 10, discs[:, 1]) >= discs[:, 2]).all())
    found, pieces = exact_path(START, TARGET, discs, FREE, math.inf)
    assume(found == FOUND)
    length = path_length(pieces)
    for bound in (length, 1.2 * length):
        found, again = exact_path(START, TARGET, discs, FREE, bound)
        assert found == FOUND
        assert path_length(again) == pytest.approx(length, abs=1e-9)


@given(scenes, st.booleans())
@settings(max_examples=100)
def test_the_mirror_image_is_planned_as_the_mirror_image(discs: np.ndarray, exact: bool) -> None:
    path = plan(discs, draw=0.3, exact=exact)
    assume(not path.status & (START_COVERED | TARGET_COVERED))  # a nearest point may be a tie, decided by the order
    mirrored = plan(discs * [1, -1, 1], draw=0.7, exact=exact)
    assert mirrored.length == pytest.approx(path.length, abs=1e-9)
    if abs(path_length(path.other) - path.length) > 1e-6:
        assert mirrored.side == -path.side
    else:
        assert path.other.shape[0] == 0 or mirrored.side in (-1, 1)


def test_a_tie_is_decided_by_the_draw() -> None:
    discs = np.array([[5.0, 0.0, 1.0]])
    assert [plan(discs, draw=u).side for u in (0.0, 0.49, 0.5, 0.99)] == [1, 1, -1, -1]


def test_without_discs_the_path_is_straight() -> None:
    path = plan(NO_DISCS)
    assert (path.status, path.length, path.side, len(path.pieces), len(path.other)) == (0, 10.0, 0, 1, 0)
    nowhere = plan(NO_DISCS, target=START)
    assert (nowhere.status, nowhere.length, len(nowhere.pieces)) == (0, 0.0, 0)


def test_a_start_inside_a_disc_leaves_it_by_the_shortest_way() -> None:
    for x, r in ((-0.4, 1.0), (0.0, 1.0)):
        path = plan(np.array([[x, 0.1, r]]))
        assert path.status == START_COVERED
        assert math.hypot(*path.pieces[0, 2:4]) == pytest.approx(r - math.hypot(x, 0.1))
    centre = plan(np.array([[0.0, 0.0, 1.0]]))  # an obstacle right on top of the robot: any way is the nearest
    assert centre.status == START_COVERED
    assert centre.length == pytest.approx(10.0)


def test_a_covered_target_is_replaced_by_the_nearest_free_point() -> None:
    path = plan(np.array([[10.3, 0.0, 1.0]]))
    assert path.status == TARGET_COVERED
    np.testing.assert_allclose(path.pieces[-1, 2:4], [9.3, 0.0], atol=1e-12)
    behind = plan(np.array([[9.8, 0.0, 1.0]]))
    np.testing.assert_allclose(behind.pieces[-1, 2:4], [10.8, 0.0], atol=1e-8)
    assert behind.length > 10.8
    zone = np.array([0.0, 0.0, 10.0])  # the nearest point that can be seen instead
    seen = plan(np.array([[9.8, 0.0, 1.0]]), zone=zone)
    assert math.hypot(*seen.pieces[-1, 2:4]) <= 10.0 + 1e-9
    assert seen.status == TARGET_COVERED


def ring(x: float, around: float, count: int, r: float) -> np.ndarray:
    a = 2 * math.pi * np.arange(count) / count
    return np.column_stack([x + around * np.cos(a), around * np.sin(a), np.full(count, r)])


@pytest.mark.parametrize("exact", [False, True])
def test_a_target_that_is_shut_off(exact: bool) -> None:
    walls = ring(10.0, 2.0, 12, 0.7)
    path = plan(walls, exact=exact)
    assert path.status == UNREACHABLE
    along, across = 2 * math.cos(math.pi / 12), 2 * math.sin(math.pi / 12)
    notch = math.sqrt(0.7**2 - across**2)  # the reachable points nearest to it: where two discs' circles meet
    assert math.hypot(*(path.pieces[-1, 2:4] - TARGET)) == pytest.approx(along + notch, abs=1e-8)
    assert deepest(path.pieces, walls) < 3e-9
    inside = plan(walls, start=TARGET, target=START, exact=exact)
    assert inside.status == UNREACHABLE
    assert deepest(inside.pieces, walls) < 3e-9
    x, y = inside.pieces[-1, 2:4]
    angle = math.pi / 12
    assert (x, abs(y)) == pytest.approx(
        (10 - (along - notch) * math.cos(angle), (along - notch) * math.sin(angle)), abs=1e-8
    )


def test_out_of_a_pocket() -> None:
    """A horseshoe around the start that opens away from the target: all one cluster."""
    horseshoe = np.delete(ring(0.0, 2.0, 12, 0.7), 6, axis=0)
    greedy, exact = plan(horseshoe), plan(horseshoe, exact=True)
    assert greedy.status == exact.status == 0
    assert deepest(greedy.pieces, horseshoe) < 3e-9
    assert exact.length - 1e-9 <= greedy.length < 1.05 * exact.length
    assert exact.length > 14


def test_all_around_a_crowd_that_touches_the_walls() -> None:
    """A gap that only leads outside of the area is no way."""
    wall = np.array([[5.0, y, 0.7] for y in np.arange(-2.0, 3.0)])
    area = np.array([-1.0, -2.5, 11.0, 4.0])  # 0.2 m short below, wide enough above
    for exact in (False, True):
        path = plan(wall, area=area, exact=exact)
        assert path.status & ~planner.FALLBACK == 0
        assert path.side == 1
        assert polyline(path.pieces, 0.05)[:, 1].max() > 2.6
    shut = plan(wall, area=np.array([-1.0, -2.5, 11.0, 2.5]))
    assert shut.status & planner.OUTSIDE
    assert np.abs(polyline(shut.pieces, 0.05)[:, 1]).max() <= 2.5 + 1e-9


def test_a_path_that_leaves_the_zone_is_cut_there() -> None:
    wall = np.array([[3.0, y, 0.7] for y in np.arange(-4.0, 4.0)])
    path = plan(wall, target=np.array([4.0, 0.0]), zone=np.array([0.0, 0.0, 4.0]))
    assert path.status & planner.CUT
    assert math.hypot(*path.pieces[-1, 2:4]) == pytest.approx(4.0, abs=1e-6)


@pytest.mark.parametrize("exact", [False, True])
def test_a_thousand_discs(exact: bool) -> None:
    rng = np.random.default_rng(1)
    sparse = np.column_stack([rng.uniform(0, 60, 1000), rng.uniform(-30, 30, 1000), np.full(1000, 0.5)])
    path = plan(sparse, start=np.array([-1.0, 0.0]), target=np.array([61.0, 0.0]), exact=exact)
    assert path.status & ~(planner.LIMITED | planner.FALLBACK) == 0
    assert deepest(path.pieces, sparse) < 3e-9
    heap = np.tile([5.0, 0.0, 1.0], (1000, 1))
    assert plan(heap, exact=exact).length == pytest.approx(plan(heap[:1]).length, abs=1e-9)
    dense = np.column_stack([rng.uniform(0, 10, 1000), rng.uniform(-5, 5, 1000), np.full(1000, 0.65)])
    assert math.isfinite(plan(dense, exact=exact).length)


def test_too_many_discs_for_the_graph_say_so() -> None:
    rng = np.random.default_rng(2)
    discs = np.column_stack([rng.uniform(0, 40, 600), rng.uniform(-20, 20, 600), np.full(600, 0.5)])
    found, pieces = exact_path(np.array([-1.0, 0.0]), np.array([41.0, 0.0]), discs, FREE, math.inf)
    assert found == LESS
    assert deepest(pieces, discs) < 3e-9


def test_samples_lie_on_the_path() -> None:
    path = plan(np.array([[5.0, 0.0, 2.0]]))
    stations = np.array([0.0, 1.0, 0.5 * path.length, path.length, path.length + 3])
    points = sample(path.pieces, stations, np.zeros(3))
    np.testing.assert_allclose(points[0, :2], START)
    assert math.hypot(*points[1, :2]) == pytest.approx(1.0)
    assert points[1, 2] == pytest.approx(math.asin(2 / 5))
    np.testing.assert_allclose(points[2], [5.0, 2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(points[3:], [[10.0, 0.0, -math.asin(2 / 5)]] * 2, atol=1e-9)


def test_nothing_is_entered_between_the_pieces() -> None:
    """Both ends of every straight piece see each other."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        discs = np.column_stack([rng.uniform(1, 9, 12), rng.uniform(-2, 2, 12), np.full(12, 0.6)])
        for x0, y0, x1, y1, _, _, turn in plan(discs).pieces:
            if turn == 0:
                length = math.hypot(x1 - x0, y1 - y0)
                smaller = discs - [0, 0, 1e-8]
                hit, _ = first_on_segment(x0, y0, (x1 - x0) / length, (y1 - y0) / length, length, smaller, NONE, NONE)
                assert hit < 0


def test_a_side_is_kept_unless_the_other_is_clearly_shorter():
    """One disc across the line, its centre a little to the left: the right side is shorter, by less than 5 %."""
    discs = np.array([[5.0, 0.1, 1.0]])
    assert plan(discs).side == -1
    assert plan(discs, keep=0.05).side == 1
    assert plan(discs, keep=-0.05).side == -1
    assert plan(np.array([[5.0, -0.1, 1.0]]), keep=-0.05).side == -1
    assert plan(np.array([[5.0, 0.95, 2.5]]), keep=0.05).side == -1
