"""The smallest circle is the smallest: compared with all circles that two or three of the points carry."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clearway.geometry.enclosing import enclosing_circle

POINTS = st.integers(1, 9).flatmap(
    lambda n: arrays(np.float64, (n, 2), elements=st.integers(-40, 40).map(lambda v: v / 8))
)


def brute_force(points: np.ndarray) -> float:
    """Radius of the smallest circle over two or three of the points that holds all."""
    best = math.inf if len(np.unique(points, axis=0)) > 1 else 0.0
    for a, b in itertools.combinations(points, 2):
        centre = (a + b) / 2
        best = min(best, *_holding(points, centre))
    for a, b, c in itertools.combinations(points, 3):
        system = 2 * np.array([b - a, c - a])
        if abs(np.linalg.det(system)) > 1e-9:
            centre = np.linalg.solve(system, [b @ b - a @ a, c @ c - a @ a])
            best = min(best, *_holding(points, centre))
    return best


def _holding(points: np.ndarray, centre: np.ndarray) -> tuple[float, float]:
    return math.inf, float(np.hypot(*(points - centre).T).max())


@settings(max_examples=200, deadline=None)
@given(POINTS)
def test_it_is_the_smallest_that_holds_all(points: np.ndarray) -> None:
    x, y, radius = enclosing_circle(points, np.arange(len(points)))
    assert (np.hypot(points[:, 0] - x, points[:, 1] - y) <= radius).all()
    assert radius == pytest.approx(brute_force(points), abs=1e-9)


def test_only_the_chosen_rows_count() -> None:
    points = np.array([[0.0, 0.0], [9.0, 9.0], [2.0, 0.0]])
    assert enclosing_circle(points, np.array([0, 2])) == (1.0, 0.0, 1.0)
    assert enclosing_circle(points, np.array([1])) == (9.0, 9.0, 0.0)


def test_a_long_line_and_a_fine_arc() -> None:
    line = np.linspace(0, 5, 1001)[:, None] * np.array([[0.6, 0.8]])
    x, y, radius = enclosing_circle(line, np.arange(1001))
    assert (x, y, radius) == pytest.approx((1.5, 2.0, 2.5))
    angle = np.linspace(0.0, 1.5 * math.pi, 2001)
    arc = np.stack([3 + np.cos(angle), 4 + np.sin(angle)], axis=1)
    assert enclosing_circle(arc, np.arange(2001)) == pytest.approx((3.0, 4.0, 1.0), abs=1e-9)
