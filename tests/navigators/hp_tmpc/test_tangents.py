"""Tangents against values by hand, the formulas of geometry books, and sampled arcs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from clearway.navigators.hp_tmpc.heuristic_planner.disc_unions import REACHABLE, SHUT_OFF, nearest_free, shut_off
from clearway.navigators.hp_tmpc.heuristic_planner.tangents import (
    advance,
    arc_enters,
    arc_leaves,
    segment_enters,
    sweep,
    tangent,
)

FREE = np.array([-np.inf, -np.inf, np.inf, np.inf])
EVERYWHERE = np.array([0.0, 0.0, np.inf])

near = st.floats(-5, 5)
radius = st.floats(0.1, 2)


def touching(c: tuple[float, float], r: float, u: tuple[float, float]) -> np.ndarray:
    return np.array([c[0] + r * u[1], c[1] - r * u[0]])


def test_from_a_point_to_a_circle_by_hand() -> None:
    # 3-4-5: from (5, 0) to the circle of radius 3 around the origin, touched at (9/5, +-12/5)
    for r, y in ((-3.0, -2.4), (3.0, 2.4)):
        exists, ux, uy, length = tangent(5.0, 0.0, 0.0, 0.0, 0.0, r)
        assert exists
        assert length == pytest.approx(4.0, abs=1e-14)
        np.testing.assert_allclose(touching((0, 0), r, (ux, uy)), [1.8, y], atol=1e-14)


@given(near, near, near, near, radius)
def test_from_a_point_the_textbook_formula(px: float, py: float, cx: float, cy: float, r: float) -> None:
    p, c = np.array([px, py]), np.array([cx, cy])
    d = math.hypot(px - cx, py - cy)
    assume(d > r + 1e-3)
    perp = np.array([-(p - c)[1], (p - c)[0]])
    expected = [c + (r * r / d**2) * (p - c) + s * (r * math.sqrt(d * d - r * r) / d**2) * perp for s in (1, -1)]
    found = []
    for signed in (r, -r):
        exists, ux, uy, length = tangent(px, py, 0.0, cx, cy, signed)
        assert exists
        end = touching((cx, cy), signed, (ux, uy))
        np.testing.assert_allclose(p + length * np.array([ux, uy]), end, atol=1e-9)
        found.append(end)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_outer_and_inner_bitangents_by_hand() -> None:
    exists, ux, uy, length = tangent(0.0, 0.0, 1.0, 10.0, 0.0, 1.0)  # both counter-clockwise: below both
    assert (exists, ux, uy, length) == (True, 1.0, 0.0, 10.0)
    np.testing.assert_allclose(touching((0, 0), 1.0, (ux, uy)), [0, -1])
    exists, ux, uy, length = tangent(0.0, 0.0, 3.0, 10.0, 0.0, -3.0)  # 6-8-10
    assert exists
    assert (ux, uy, length) == pytest.approx((0.8, 0.6, 8.0), abs=1e-14)
    np.testing.assert_allclose(touching((0, 0), 3.0, (ux, uy)), [1.8, -2.4], atol=1e-14)
    assert not tangent(0.0, 0.0, 1.0, 1.0, 0.0, -1.0)[0]  # they overlap
    assert not tangent(0.0, 0.0, 3.0, 1.0, 0.0, 1.0)[0]  # one inside the other


@given(near, near, st.sampled_from([-1, 0, 1]), radius, near, near, st.sampled_from([-1, 0, 1]), radius)
def test_a_tangent_touches_both(
    ax: float, ay: float, sa: int, ra: float, bx: float, by: float, sb: int, rb: float
) -> None:
    assume(math.hypot(ax - bx, ay - by) > 1e-3)
    exists, ux, uy, length = tangent(ax, ay, sa * ra, bx, by, sb * rb)
    assume(exists)
    a, b = touching((ax, ay), sa * ra, (ux, uy)), touching((bx, by), sb * rb, (ux, uy))
    assert math.hypot(ux, uy) == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(a + length * np.array([ux, uy]), b, atol=1e-6)
    for x, y, s, r in ((ax, ay, sa, ra), (bx, by, sb, rb)):  # the centre lies on the side that the sign says
        assert ux * (y - a[1]) - uy * (x - a[0]) == pytest.approx(s * r, abs=1e-6)


def test_turns() -> None:
    assert sweep(1.0, 0.0, 0.0, 1.0, 2.0) == pytest.approx(math.pi / 2)
    assert sweep(1.0, 0.0, 0.0, 1.0, -2.0) == pytest.approx(1.5 * math.pi)
    assert sweep(1.0, 0.0, 1.0, -1e-15, 2.0) == 0.0  # straight on, not once around
    assert advance(0.1, 0.0, 1.0) == pytest.approx(2 * math.pi - 0.1)
    assert advance(0.1, 0.0, -1.0) == pytest.approx(0.1)


def test_segments_by_hand() -> None:
    assert segment_enters(0.0, 0.0, 1.0, 0.0, 10.0, 5.0, 3.0, 5.0) == pytest.approx(1.0)
    assert segment_enters(0.0, 0.0, 1.0, 0.0, 0.9, 5.0, 3.0, 5.0) == math.inf
    assert segment_enters(0.0, 0.0, 1.0, 0.0, 10.0, 5.0, 5.0, 5.0) == math.inf  # touches only
    assert segment_enters(5.0, 0.0, 1.0, 0.0, 10.0, 5.0, 3.0, 5.0) == 0.0  # starts inside


@given(near, near, radius, st.floats(-3, 3), st.floats(0.05, 6), near, near, radius, st.booleans())
def test_arcs_against_samples(
    cx: float, cy: float, r: float, at: float, turn: float, ox: float, oy: float, inside: float, clockwise: bool
) -> None:
    sign = -1.0 if clockwise else 1.0
    entered = arc_enters(cx, cy, sign * r, cx + r * math.cos(at), cy + r * math.sin(at), turn, ox, oy, inside)
    a = at + sign * np.linspace(0, turn, 2001)
    depth = inside - np.hypot(cx + r * np.cos(a) - ox, cy + r * np.sin(a) - oy)
    step = turn / 2000
    if entered == math.inf:
        assert depth.max() < 1e-6
    else:
        assert depth.max() > -r * step
        if depth.max() > r * step:
            assert abs(np.argmax(depth > 0) * step - entered) < 2 * step + 1e-6 or depth[0] > -1e-6


def test_an_arc_leaves_a_rectangle() -> None:
    box = np.array([-2.0, -2.0, 0.5, 2.0])
    assert arc_leaves(0.0, 0.0, 1.0, 0.0, -1.0, math.pi, box) == pytest.approx(math.pi / 6)  # at x = 0.5
    assert arc_leaves(0.0, 0.0, -1.0, 0.0, -1.0, math.pi, box) == math.inf


@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.3, 1.5)), min_size=1, max_size=6))
def test_nearest_free_point_against_a_grid(rows: list[tuple[float, float, float]]) -> None:
    discs = np.array(rows)
    found, x, y = nearest_free(0.0, 0.0, discs, FREE, EVERYWHERE)
    assert found
    assert (np.hypot(discs[:, 0] - x, discs[:, 1] - y) >= discs[:, 2] - 2e-9).all()
    g = np.linspace(-5, 5, 201)
    gx, gy = np.meshgrid(g, g)
    free = (np.hypot(gx[..., None] - discs[:, 0], gy[..., None] - discs[:, 1]) >= discs[:, 2]).all(-1)
    assert math.hypot(x, y) <= np.hypot(gx, gy)[free].min() + 1e-9


def test_nearest_free_point_in_a_zone() -> None:
    disc = np.array([[0.0, 0.0, 1.0]])
    found, x, y = nearest_free(0.9, 0.0, disc, FREE, np.array([-2.0, 0.0, 2.0]))
    assert found  # not (1, 0): that is outside; where the two circles cross
    assert (x, abs(y)) == pytest.approx((-0.25, math.sqrt(1 - 0.0625)))
    assert not nearest_free(0.0, 0.0, disc, FREE, np.array([0.0, 0.0, 0.5]))[0]
    found, x, y = nearest_free(0.9, 0.1, disc, np.array([-9.0, -9.0, 0.0, 9.0]), EVERYWHERE)
    assert not found or x <= 1e-9


def ring(around: float, count: int, r: float, without: int = -1) -> np.ndarray:
    a = 2 * math.pi * np.arange(count) / count
    rows = np.column_stack([around * np.cos(a), around * np.sin(a), np.full(count, r)])
    return np.delete(rows, without, axis=0) if without >= 0 else rows


def test_a_closed_ring_shuts_off() -> None:
    closed = ring(3.0, 16, 0.7)
    where, x, y = shut_off(0.0, 0.0, 9.0, 1.0, 9.0, 1.0, closed, FREE, EVERYWHERE)
    assert where == SHUT_OFF
    inner = np.abs(np.hypot(closed[:, 0] - x, closed[:, 1] - y) - 0.7).min()
    assert inner < 1e-9  # on the ring's inner boundary,
    assert 2.2 < math.hypot(x, y) < 3  # and on the goal's side
    assert x > 2
    where, x, y = shut_off(9.0, 1.0, 0.0, 0.0, 0.0, 0.0, closed, FREE, EVERYWHERE)
    assert where == SHUT_OFF
    assert math.hypot(x, y) > 3.2
    for at in ((0.0, 0.0), (-9.0, 2.0)):
        opened = ring(3.0, 16, 0.7, without=8)
        assert shut_off(*at, 9.0, 1.0, 9.0, 1.0, opened, FREE, EVERYWHERE)[0] == REACHABLE
    assert shut_off(-9.0, 0.1, 9.0, 0.1, 9.0, 0.1, closed, FREE, EVERYWHERE)[0] == REACHABLE  # around it
