"""Distances to the goal against hand-computed ones, and against exact shortest paths among discs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from space_time_scenes import SQUARE

from clearway.crowds.ways import room_of, ways_to
from clearway.geometry.grid import OccupancyGrid
from clearway.geometry.shapes import FloatArray
from clearway.navigators.common.frame import OdometryFrame
from clearway.navigators.hp_st.environment.field import Field, field_on_map, look, make_field
from clearway.navigators.hp_tmpc.heuristic_planner.exact import FOUND, exact_path


def field_of(goal: tuple[float, float], *discs: tuple[float, float, float]) -> Field:
    return make_field(np.array(goal), np.array(discs, dtype=np.float64).reshape(-1, 3), SQUARE)


def around(d: float, r: float) -> float:
    """Length from a point `d` before the centre of a disc of radius `r` to one `d` behind it: tangent, arc, tangent."""
    return 2.0 * math.sqrt(d * d - r * r) + r * (math.pi - 2.0 * math.acos(r / d))


def length(pieces: FloatArray) -> float:
    straight = np.hypot(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
    arcs = np.abs(pieces[:, 6]) * np.hypot(pieces[:, 0] - pieces[:, 4], pieces[:, 1] - pieces[:, 5])
    return float(np.where(pieces[:, 6] == 0.0, straight, arcs).sum())


def test_in_sight_it_is_the_straight_distance() -> None:
    free, shadowed = field_of((3.0, 4.0)), field_of((3.0, 4.0), (3.0, 5.5, 0.7))
    for x, y in ((0.0, 0.0), (-6.9, 6.9), (3.0, 3.93), (6.5, 4.1)):
        expected = math.hypot(3.0 - x, 4.0 - y)
        for field in (free, shadowed):
            assert look(field, x, y) == pytest.approx((expected, (3.0 - x) / expected, (4.0 - y) / expected))
    assert look(shadowed, 3.0, 6.9)[0] > 3.0


@pytest.mark.parametrize(("d", "r"), [(2.0, 0.6), (4.0, 0.6), (4.0, 1.5), (6.0, 3.0)])
def test_round_one_disc_it_is_tangent_arc_tangent(d: float, r: float) -> None:
    far, ux, uy = look(field_of((d, 0.0), (0.0, 0.0, r)), -d, 0.05)
    assert far == pytest.approx(around(d, r), rel=0.035)
    assert far > 2.0 * d
    tangent = math.asin(r / d)  # left of the disc, as the start is a little left of its axis
    assert math.atan2(uy, ux) == pytest.approx(tangent, abs=0.2)


@pytest.mark.parametrize("angle", np.linspace(0.3, 6.0, 7))
def test_whoever_is_inside_a_disc_is_led_out(angle: float) -> None:
    field = field_of((6.0, 0.0), (0.0, 0.0, 1.5))
    x, y = 1.2 * math.cos(angle), 1.2 * math.sin(angle)
    for _ in range(20):
        _, ux, uy = look(field, x, y)
        assert math.hypot(ux, uy) == pytest.approx(1.0)
        x, y = x + 0.05 * ux, y + 0.05 * uy
        if math.hypot(x, y) >= 1.5:
            break
    assert math.hypot(x, y) >= 1.5  # 0.3 m away; it has walked at most 1 m


def shortest(at: FloatArray, goal: FloatArray, discs: FloatArray) -> float:
    found, pieces = exact_path(at, goal, discs, SQUARE, math.inf)
    return length(pieces) if found == FOUND else math.inf


@pytest.mark.parametrize("seed", range(8))
def test_among_many_discs_it_is_the_shortest_path(seed: int) -> None:
    """By the exact planner: no shorter, and hardly longer than past discs that have grown by a cell, as gaps narrower
    than one may be overlooked."""
    rng = np.random.default_rng(seed)
    discs = np.column_stack([rng.uniform(-4.0, 4.0, (9, 2)), rng.uniform(0.4, 1.0, 9)])
    goal = np.array([6.0, rng.uniform(-5.0, 5.0)])
    field = make_field(goal, discs, SQUARE)
    grown = discs + np.array([0.0, 0.0, field.resolution])
    hidden = 0
    for _ in range(30):
        at = rng.uniform(-6.0, 6.0, 2)
        straight = math.dist(at, goal)
        far, ux, uy = look(field, *at)
        assert far >= straight - 0.5 * field.resolution
        assert math.hypot(ux, uy) == pytest.approx(1.0)
        if (np.hypot(*(discs[:, :2] - at).T) > grown[:, 2]).all():
            hidden += far > straight + 0.01
            assert 0.995 * shortest(at, goal, discs) <= far <= 1.03 * shortest(at, goal, grown) + 0.1
    assert hidden > 0


def test_by_a_map_it_is_the_way_round_the_wall_in_whatever_frame() -> None:
    """A wall from (2, -3) to (2, 1): past its end, whatever the odometry takes for the origin."""
    free = np.zeros((120, 120), np.int8)
    free[:80, 78:82] = 100
    ways = ways_to(np.array((4.0, -1.0)), room_of(OccupancyGrid(free, 0.05, (-2.0, -3.0))), 0.2)
    for pose, odom in ((np.zeros(3), np.zeros(3)), (np.array((0.0, -1.0, 0.3)), np.array((5.0, 2.0, 1.7)))):
        frame = OdometryFrame(pose, odom)
        place, goal = (frame.into(np.array((*p, 0.0)))[:2] for p in ((0.0, -1.0), (4.0, -1.0)))
        field = field_on_map(ways, frame, place, goal, 5.0)
        far, ux, uy = look(field, *place.tolist())
        round_it = 2.0 * math.hypot(2.0, 2.0)
        assert round_it < far < 1.5 * round_it  # a metre beside a wall counts more
        turned = odom[2] - pose[2]
        assert math.remainder(math.atan2(uy, ux) - turned, 2.0 * math.pi) == pytest.approx(math.pi / 4, abs=0.4)
        close = frame.into(np.array((4.3, -0.6, 0.0)))[:2]
        assert look(field, *close.tolist())[0] == pytest.approx(0.5)  # in sight: straight
