"""The signed distance from a point to a footprint, against GEOS (by shapely) and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import LinearRing, Point, affinity
from shapely import Polygon as Outline

from clearway.geometry.footprint import Footprint, footprint, gap
from clearway.geometry.shapes import Circle, Polygon, rectangle

L_SHAPE = Polygon(((-0.4, -0.3), (0.5, -0.3), (0.5, 0.1), (0.0, 0.1), (0.0, 0.6), (-0.4, 0.6)))


@pytest.mark.parametrize("shape", [rectangle(0.6, 0.4), L_SHAPE, Polygon(((0.0, 0.0), (0.3, 0.1), (0.1, 0.4)))])
@pytest.mark.parametrize("grown", [0.0, 0.07])
def test_as_geos_says(shape: Polygon, grown: float) -> None:
    rng = np.random.default_rng(3)
    foot = footprint(shape)
    for _ in range(300):
        x, y, theta, px, py = *rng.uniform(-1, 1, 2), rng.uniform(-9, 9), *rng.uniform(-2, 2, 2)
        outline = affinity.translate(affinity.rotate(Outline(shape.vertices), theta, (0, 0), use_radians=True), x, y)
        apart = LinearRing(outline.exterior).distance(Point(px, py))
        expected = (-apart if outline.contains(Point(px, py)) else apart) - grown
        assert gap(foot.vertices, grown, x, y, theta, px, py) == pytest.approx(expected, abs=1e-12)


def test_a_disc_by_hand() -> None:
    foot = footprint(Circle(0.25))
    assert foot.vertices.tolist() == [[0.0, 0.0]]
    assert foot[1:] == (0.25, 0.25, 0.25, 0.0)
    assert gap(foot.vertices, foot.radius, 1.0, 2.0, 0.7, 4.0, 6.0) == pytest.approx(4.75)
    assert gap(foot.vertices, foot.radius, 1.0, 2.0, 0.7, 1.0, 2.1) == pytest.approx(-0.15)
    off_centre = np.array([[0.5, 0.0]])  # turned by 90 degrees: half a metre up
    assert gap(off_centre, 0.25, 1.0, 2.0, math.pi / 2, 1.0, 3.0) == pytest.approx(0.25)


def test_a_square_by_hand() -> None:
    foot = footprint(rectangle(0.6, 0.6))
    assert isinstance(foot, Footprint)
    assert foot.inscribed == pytest.approx(0.3)
    assert foot.circumscribed == foot.lever == pytest.approx(0.3 * math.sqrt(2))
    at = (foot.vertices, foot.radius, 0.0, 0.0, math.pi / 4)
    assert gap(*at, 1.0, 0.0) == pytest.approx(1.0 - 0.3 * math.sqrt(2))  # its corner points there
    assert gap(*at, 0.0, 0.0) == pytest.approx(-0.3)
    assert gap(*at, *(0.25 * np.array([1, 1]) / math.sqrt(2))) == pytest.approx(-0.05)
