"""The shortest way past standing discs against closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.scenarios.static_way import least_length, static_way

A, B, AREA = np.array([1.0, 5.0]), np.array([9.0, 5.0]), (0.0, 0.0, 10.0, 10.0)


def way_length(*discs: tuple[float, float, float], area: tuple[float, float, float, float] = AREA) -> float | None:
    way = static_way(A, B, np.array(discs).reshape(-1, 3), area)
    return None if way is None else float(np.hypot(*np.diff(way, axis=0).T).sum())


def test_nothing_in_the_way() -> None:
    assert way_length() == 8.0
    assert way_length((5.0, 7.0, 1.9)) == 8.0


@given(st.floats(0.1, 3.0), st.floats(-2.9, 2.9))
def test_one_disc_is_two_tangents_and_an_arc(radius: float, aside: float) -> None:
    if abs(aside) >= radius:
        assert way_length((5.0, 5.0 + aside, radius)) == pytest.approx(8.0, abs=1e-4)
        return
    d = math.hypot(4.0, aside)
    tangents = 2 * math.sqrt(d * d - radius * radius)
    arc = radius * (2 * math.atan2(4.0, abs(aside)) - 2 * math.acos(radius / d))
    exact = tangents + arc
    found = way_length((5.0, 5.0 + aside, radius), area=(-99, -99, 99, 99))
    assert found is not None
    assert exact - 1e-9 <= found <= exact + 0.002 * radius


@given(st.floats(0.1, 3.0), st.floats(-0.9, 0.9), st.floats(0.0, 0.9))
def test_the_least_length_is_below_two_tangents_and_an_arc(radius: float, aside: float, tolerance: float) -> None:
    aside *= radius
    d = math.hypot(4.0, aside)
    bend = 2 * math.atan2(4.0, abs(aside)) - 2 * math.acos(radius / d)
    exact = 2 * math.sqrt(d * d - radius * radius) + radius * bend - tolerance
    least = least_length(A, B, np.array([(5.0, 5.0 + aside, radius)]), tolerance)
    assert least is not None
    assert exact - 0.002 * radius <= least <= exact + 1e-9


def test_the_least_length_of_no_way() -> None:
    ring = [(9.0 + math.cos(a), 5.0 + math.sin(a), 0.4) for a in np.arange(0.0, math.tau, 0.5)]
    assert least_length(A, B, np.array(ring), 0.1) is None
    assert least_length(A, B, np.zeros((0, 3)), 0.1) == pytest.approx(7.9)


def test_walls_of_discs_and_the_border() -> None:
    fence = [(5.0, y, 0.6) for y in np.arange(0.0, 10.1, 1.0)]
    assert way_length(*fence) is None
    gate = [f for f in fence if f[1] != 8.0]
    through = way_length(*gate)
    assert through is not None
    assert through > 2 * math.hypot(4.0, 2.3)
    assert way_length(*[f for f in fence if f[1] != 0.0]) is not None  # along the border
    assert way_length(*[f for f in fence if f[1] != 0.0], area=(0.0, 0.5, 10.0, 10.0)) is None
    assert way_length((1.2, 5.0, 0.3)) is None  # the start is covered


@settings(max_examples=40)
@given(st.lists(st.tuples(st.floats(2, 8), st.floats(2, 8), st.floats(0.2, 1.2)), max_size=6))
def test_no_way_enters_a_disc(discs: list[tuple[float, float, float]]) -> None:
    way = static_way(A, B, np.array(discs).reshape(-1, 3), AREA)
    if way is None:
        return
    dense = np.concatenate([np.linspace(p, q, 100) for p, q in itertools.pairwise(way)])
    for x, y, r in discs:
        assert np.hypot(dense[:, 0] - x, dense[:, 1] - y).min() >= r - 1e-9
    for i in range(len(discs)):  # with one disc less it is no longer
        fewer = static_way(A, B, np.array(discs[:i] + discs[i + 1 :]).reshape(-1, 3), AREA)
        assert fewer is not None
        # a polygon's corners may lie a little further out than those of the way that they open
        assert np.hypot(*np.diff(fewer, axis=0).T).sum() <= 1.003 * np.hypot(*np.diff(way, axis=0).T).sum()
