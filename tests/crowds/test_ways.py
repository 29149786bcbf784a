"""The outlines of a grid, and the ways on it."""

from __future__ import annotations

import heapq
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.crowds.outlines import outlines
from clearway.crowds.walls import walls_of
from clearway.crowds.ways import COMFORT, DETOUR, Ways, in_sight, room_of, way_point, ways_to, with_discs
from clearway.errors import ClearwayError
from clearway.geometry.grid import OccupancyGrid


def grid_of(occupied, resolution=0.1, origin=(-1.0, 2.0)) -> OccupancyGrid:
    return OccupancyGrid(np.where(occupied, 100, 0).astype(np.int8), resolution, origin)


def winding(polygons, x, y) -> int:
    """How often the polygons go around (x, y), counter-clockwise."""
    total = 0.0
    for p in polygons:
        angle = np.unwrap(np.arctan2(p[:, 1] - y, p[:, 0] - x), period=2 * np.pi)
        last = (np.arctan2(p[0, 1] - y, p[0, 0] - x) - angle[-1] + np.pi) % (2 * np.pi) - np.pi
        total += angle[-1] - angle[0] + last
    return round(total / (2 * np.pi))


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.sampled_from((0.2, 0.5, 0.8)))
def test_outlines_go_once_around_every_occupied_cell(seed, share):
    occupied = np.random.default_rng(seed).random((5, 7)) < share
    polygons = outlines(grid_of(occupied), tolerance=0.0)
    for (r, c), solid in np.ndenumerate(occupied):
        assert winding(polygons, -1.0 + (c + 0.5) * 0.1, 2.0 + (r + 0.5) * 0.1) == solid
    walls = walls_of(polygons)
    turned = walls.direction * walls.direction[walls.preceding]
    assert np.abs(turned.sum(1)).max(initial=0.0) < 1e-9  # no corner without a turn


def test_a_slanting_wall_is_no_staircase():
    r, c = np.mgrid[:80, :80]
    occupied = np.abs(0.5 * c + 10.0 - r) < 4.0
    (polygon,) = outlines(grid_of(occupied, 0.05))
    assert len(polygon) <= 8
    exact = outlines(grid_of(occupied, 0.05), tolerance=0.0)
    assert len(exact[0]) > 100


@pytest.mark.parametrize("polygon", [[], [(0, 0), (0, math.nan)], [(0, 0), (0, 0), (1, 1)], 3.0])
def test_a_polygon_that_is_none_is_refused(polygon):
    with pytest.raises(ClearwayError, match=r"polygons\[1\]"):
        walls_of([[(0, 0), (1, 0)], polygon])


def dijkstra(cost: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    """Ways along the eight neighbours, never shorter than those of the eikonal equation, and at most 8.3 % longer."""
    best, queue = np.full(cost.shape, math.inf), [(0.0, goal)]
    while queue:
        d, (r, c) = heapq.heappop(queue)
        if d >= best[r, c]:
            continue
        best[r, c] = d
        for i in range(max(r - 1, 0), min(r + 2, cost.shape[0])):
            for j in range(max(c - 1, 0), min(c + 2, cost.shape[1])):
                if cost[i, j] < math.inf and (i, j) != (r, c):
                    heapq.heappush(queue, (d + 0.5 * (cost[r, c] + cost[i, j]) * math.hypot(i - r, j - c), (i, j)))
    return best


def two_rooms(door=10) -> np.ndarray:
    occupied = np.zeros((60, 80), bool)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    occupied[:, 39:41] = True
    occupied[20 : 20 + door, 39:41] = False
    return occupied


def test_distances_are_those_of_another_search():
    room = room_of(grid_of(two_rooms()))
    ways = ways_to(np.array((5.05, 6.05)), room, 0.3)
    spare = room.clearance - 0.3
    cost = 0.1 * (1.0 + DETOUR * np.clip(1.0 - spare / COMFORT, 0.0, None) ** 2)
    cost[(spare < 0.0)] = math.inf
    other = dijkstra(cost, (40, 60))
    reached = np.isfinite(other) & (other > 1.0)
    assert reached.sum() > 2000
    ratio = ways.distance[reached] / other[reached]
    assert 0.9 < ratio.min() < ratio.max() < 1.2  # a step counts as its last cell, by a wall the dearest
    assert 0.96 < np.median(ratio) < 1.04


@settings(max_examples=30)
@given(st.floats(-0.5, 2.3), st.floats(2.6, 7.3), st.floats(3.4, 6.3), st.floats(2.6, 7.3))
def test_way_points_lead_through_the_door(x, y, gx, gy):
    ways = ways_to(np.array((gx, gy)), room_of(grid_of(two_rooms())), 0.3)
    through = False
    for _ in range(1000):
        px, py, left = way_point(ways, x, y, 2.0)
        away = math.hypot(px - x, py - y)
        assert left < 20.0
        if away < 1e-9:
            break
        x, y = x + (px - x) / away * min(away, 0.05), y + (py - y) / away * min(away, 0.05)
        r, c = int((y - 2.0) / 0.1), int((x + 1.0) / 0.1)
        assert ways.room.clearance[r, c] > 0.2
        through |= 39 <= c <= 40 and 20 <= r < 30
    assert through
    assert math.hypot(x - gx, y - gy) < 0.05


def test_no_distance_can_be_lowered_by_its_neighbours():
    room = room_of(grid_of(two_rooms()))
    d = np.pad(ways_to(np.array((5.05, 6.05)), room, 0.3).distance, 1, constant_values=np.inf)
    p, q = np.minimum(d[:-2, 1:-1], d[2:, 1:-1]), np.minimum(d[1:-1, :-2], d[1:-1, 2:])
    d, spare = d[1:-1, 1:-1], room.clearance - 0.3
    cost = 0.1 * (1.0 + DETOUR * np.clip(1.0 - np.maximum(spare, 0.0) / COMFORT, 0.0, None) ** 2)
    some = (room.clearance > 0.0) & (spare >= 0.0) & np.isfinite(d) & np.isfinite(p) & np.isfinite(q)
    d, p, q, cost = d[some], p[some], q[some], cost[some]
    assert len(d) > 2000
    slanted = 0.5 * (p + q + np.sqrt(np.maximum(2.0 * cost**2 - (p - q) ** 2, 0.0)))
    assert (d <= np.where(abs(p - q) < cost, slanted, np.minimum(p, q) + cost) + 2e-9).all()


@settings(max_examples=60)
@given(st.tuples(*[st.floats(-1.5, 7.5)] * 4), st.floats(0.05, 0.5), st.booleans())
def test_sight_is_that_of_a_plain_reading(points, radius, discs):
    room = room_of(grid_of(two_rooms()))
    if discs:
        room = with_discs(room, np.array(((3.0, 4.5, 0.4), (1.0, 3.0, 0.2))), 0.8)
    x, y, px, py = points
    steps = int(math.hypot(px - x, py - y) / 0.05) + 1
    way = np.linspace((x, y), (px, py), steps + 1)
    column, row = np.clip(np.floor((way - room.origin) / 0.1).astype(int), 0, np.array(room.clearance.T.shape) - 1).T
    clear = room.clearance[row, column]
    free = clear[1:].min() > 0.0 and clear[1:].min() >= min(radius, clear[0]) - 1e-9
    assert in_sight(Ways(room.clearance, room, np.zeros(2), radius), x, y, px, py) == free


def test_where_no_way_leads_is_told():
    ways = ways_to(np.array((5.0, 5.0)), room_of(grid_of(two_rooms(door=0))), 0.3)
    assert way_point(ways, 0.0, 4.0, 2.0) == (0.0, 4.0, math.inf)


def test_what_stands_in_the_door_is_gone_around_by_another():
    occupied = two_rooms()
    occupied[45:57, 39:41] = False  # a second door, farther off
    room = room_of(grid_of(occupied))
    goal, start = np.array((5.0, 4.5)), (0.0, 4.5)
    assert way_point(ways_to(goal, room, 0.3), *start, 9.0)[1] < 5.0
    stood = with_discs(room, np.array(((3.0, 4.5, 0.4),)), 1.0)
    point = way_point(ways_to(goal, stood, 0.3), *start, 9.0)
    assert point[1] > 5.0
    assert point[2] > way_point(ways_to(goal, room, 0.3), *start, 9.0)[2] + 1.0


def test_a_coarser_grid_tells_the_same_places():
    fine, coarse = (room_of(grid_of(two_rooms(), 0.05), cell) for cell in (0.05, 0.1))
    assert coarse.resolution == pytest.approx(0.1)
    assert np.array_equal(coarse.clearance, fine.clearance[1::2, 1::2])
    first = fine.origin + 1.5 * fine.resolution
    assert coarse.origin + 0.5 * coarse.resolution == pytest.approx(first)
