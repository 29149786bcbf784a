"""Shapes to cells and back, against shapely."""

from __future__ import annotations

import math

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity

from clearway.geometry.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from clearway.geometry.rasterise import boundaries, explored, outline, rasterise
from clearway.geometry.shapes import Circle, Polygon, rectangle

CELL, SIZE, ORIGIN = 0.1, (30, 40), (-2.0, -1.0)


def squares() -> list[list[shapely.Polygon]]:
    rows, cols = SIZE
    x0, y0 = ORIGIN
    return [
        [shapely.box(x0 + c * CELL, y0 + r * CELL, x0 + (c + 1) * CELL, y0 + (r + 1) * CELL) for c in range(cols)]
        for r in range(rows)
    ]


GRID = squares()


@given(
    st.floats(0.05, 1.5), st.floats(0.05, 1.5), st.floats(-2.5, 2.5), st.floats(-1.5, 2.5), st.floats(-math.pi, math.pi)
)
@settings(max_examples=40)
def test_a_rectangle_marks_the_cells_that_it_meets(
    length: float, width: float, x: float, y: float, turn: float
) -> None:
    marked = rasterise([(rectangle(length, width), np.array([x, y, turn]))], SIZE, CELL, ORIGIN)
    box = affinity.translate(
        affinity.rotate(shapely.box(-length / 2, -width / 2, length / 2, width / 2), turn, (0, 0), use_radians=True),
        x,
        y,
    )
    shared = shapely.area(shapely.intersection(box, np.array(GRID)))
    assert marked[shared > 0.01 * CELL**2].all()  # a corner that a boundary barely cuts may be missed
    touched = shapely.distance(box, np.array(GRID)) < 1e-9
    assert not marked[~touched].any()


@given(st.floats(0.02, 1.2), st.floats(-2.5, 2.5), st.floats(-1.5, 2.5))
@settings(max_examples=40)
def test_a_disc_marks_the_cells_within_its_radius(radius: float, x: float, y: float) -> None:
    marked = rasterise([(Circle(radius), np.array([x, y, 0.3]))], SIZE, CELL, ORIGIN)
    away = shapely.distance(shapely.Point(x, y), np.array(GRID))
    sure = np.abs(away - radius) > 1e-9
    assert (marked == (away < radius))[sure].all()


def test_a_segment_marks_the_cells_along_it() -> None:
    marked = rasterise([(Polygon(((0.0, 0.0), (0.33, 0.0))), np.array([-1.95, -0.95, 0.0]))], SIZE, CELL, ORIGIN)
    assert np.argwhere(marked).tolist() == [[0, 0], [0, 1], [0, 2], [0, 3]]


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_boundaries_cover_the_occupied_cells_once(seed: int) -> None:
    data = np.where(np.random.default_rng(seed).random((7, 9)) < 0.5, OCCUPIED, FREE).astype(np.int8)
    polygons = [shapely.Polygon(p.vertices) for p in boundaries(OccupancyGrid(data, 0.5, (1.0, -2.0)))]
    cells = [
        shapely.box(1 + c * 0.5, -2 + r * 0.5, 1 + (c + 1) * 0.5, -2 + (r + 1) * 0.5)
        for r, c in np.argwhere(data == OCCUPIED)
    ]
    union = shapely.union_all(polygons)
    assert math.isclose(sum(p.area for p in polygons), 0.25 * len(cells), abs_tol=1e-9)  # disjoint
    assert math.isclose(union.area, shapely.intersection(union, shapely.union_all(cells)).area, abs_tol=1e-9)


def test_exploration_stops_at_walls() -> None:
    occupied = np.zeros((5, 7), dtype=np.bool_)
    occupied[:, 3] = True
    data = explored(occupied, [(0, 0)])
    assert (data[:, :3] == FREE).all()
    assert (data[:, 3] == OCCUPIED).all()
    assert (data[:, 4:] == UNKNOWN).all()


def test_outline_turns_and_moves() -> None:
    corners = outline(rectangle(2.0, 1.0), np.array([10.0, 20.0, math.pi / 2]))
    assert np.allclose(corners, [[10.5, 19.0], [10.5, 21.0], [9.5, 21.0], [9.5, 19.0]])
