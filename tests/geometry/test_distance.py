from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import affinity

from arcs import step_arc
from clearway.geometry.distance import clearance, closest_approach, min_clearance, path_clearance
from clearway.geometry.shapes import Circle, FloatArray, Polygon, Shape, rectangle

coordinates = st.floats(-2, 2).map(lambda x: round(x, 3))
poses = st.tuples(coordinates, coordinates, st.floats(-3.1, 3.1)).map(np.array)


@st.composite
def polygons(draw: st.DrawFn) -> Polygon:
    """Star-shaped, mostly not convex; sometimes a segment."""
    n = draw(st.integers(2, 7))
    if n == 2:
        a, b = draw(st.tuples(coordinates, coordinates)), draw(st.tuples(coordinates, coordinates))
        assume(math.dist(a, b) > 0.01)
        return Polygon((a, b))
    angles = [2 * math.pi * (i + draw(st.floats(0.1, 0.9))) / n for i in range(n)]
    radii = [draw(st.floats(0.1, 1.5)) for _ in range(n)]
    return Polygon(tuple((r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)))


shapes = st.one_of(st.floats(0.01, 1.0).map(Circle), polygons())


def oracle(shape: Shape, pose: FloatArray) -> tuple[shapely.Geometry, float]:
    """The shape in shapely's terms, and the radius that it is to be thickened by."""
    if isinstance(shape, Circle):
        return shapely.Point(pose[0], pose[1]), shape.radius
    points = shape.vertices
    geometry = shapely.LineString(points) if len(points) == 2 else shapely.Polygon(points)
    turned = affinity.rotate(geometry, pose[2], origin=(0, 0), use_radians=True)
    return affinity.translate(turned, pose[0], pose[1]), 0.0


@given(shapes, poses, shapes, poses)
def test_clearance_agrees_with_shapely(a: Shape, pose_a: FloatArray, b: Shape, pose_b: FloatArray) -> None:
    (ga, ra), (gb, rb) = oracle(a, pose_a), oracle(b, pose_b)
    assume(ga.is_valid and gb.is_valid)
    expected = max(0.0, ga.distance(gb) - ra - rb)
    assert clearance(a, pose_a, b, pose_b) == pytest.approx(expected, abs=1e-9)
    assert clearance(b, pose_b, a, pose_a) == pytest.approx(expected, abs=1e-9)


def test_clearance_by_hand() -> None:
    o = np.zeros(3)
    assert clearance(Circle(1), o, Circle(2), np.array([5.0, 0, 0])) == pytest.approx(2.0)
    assert clearance(rectangle(2, 1), o, Circle(0.5), np.array([0, 3.0, 0])) == pytest.approx(2.0)
    # a square turned by 45 degrees reaches out by half its diagonal
    turned = np.array([3.0, 0, math.pi / 4])
    assert clearance(rectangle(2, 2), o, rectangle(1, 1), turned) == pytest.approx(2 - math.sqrt(0.5))
    # one inside the other, edges far apart
    assert clearance(rectangle(10, 10), o, rectangle(1, 1), o) == 0.0
    assert clearance(rectangle(10, 10), o, Circle(0.1), o) == 0.0
    # inside the notch of a U, not in contact
    u = Polygon(((-2, -1), (2, -1), (2, 2), (1, 2), (1, 0), (-1, 0), (-1, 2), (-2, 2)))
    assert clearance(u, o, Circle(0.25), np.array([0, 1.0, 0])) == pytest.approx(0.75)


@dataclass(frozen=True)
class Thing:
    shape: Shape
    pose: FloatArray | None


def fixed(shape: Shape, x: float, y: float, theta: float = 0.0) -> Thing:
    return Thing(shape, np.array([x, y, theta]))


def test_min_clearance_takes_the_nearest_and_skips_the_absent() -> None:
    path = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    bodies = [fixed(Circle(0.5), 2, 2), Thing(Circle(0.1), None), fixed(rectangle(1, 1), -3, 0)]
    moving_obstacles = np.array([[[0, 1.0, 0]], [[math.nan] * 3], [[2, 0.5, 0]]])
    expected = [0.5, 5**0.5 - 0.9, 0.0]  # the moving obstacle; the disc; the moving obstacle again: 0.5 - 0.4 - 0.1
    assert min_clearance(Circle(0.4), path, bodies, moving_obstacles) == pytest.approx(expected)
    assert min_clearance(Circle(0.4), path, [], np.zeros((3, 0, 3))).tolist() == [math.inf] * 3


@given(
    shapes,
    st.lists(st.tuples(shapes, poses), min_size=1, max_size=3),
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-2, 2)), min_size=1, max_size=4),
    poses,
    poses,
)
def test_path_clearance_misses_no_minimum(
    foot: Shape,
    things: list[tuple[Shape, FloatArray]],
    twists: list[tuple[float, float]],
    begin: FloatArray,
    end: FloatArray,
) -> None:
    """Against 200 samples an interval; a moving obstacle crosses as well."""
    bodies = [Thing(s, p * [2, 2, 1]) for s, p in things] + [Thing(Circle(0.2), None)]
    path = [np.array([0.0, 0, 0])]
    for v, omega in twists:
        path.append(step_arc(path[-1], v, omega, 1.0))
    n, fine = len(path), 200
    share = np.linspace(0, 1, n)[:, None, None]
    moving_obstacle = begin * (1 - share) + end * share
    moving_obstacle[..., 2] = 0.0
    coarse = path_clearance(foot, np.array(path), bodies, moving_obstacle)
    for i, (v, omega) in enumerate(twists):
        s = np.linspace(0, 1, fine + 1)
        dense = np.array([step_arc(path[i], v, omega, x) for x in s])
        between = moving_obstacle[i] * (1 - s)[:, None, None] + moving_obstacle[i + 1] * s[:, None, None]
        seen = min_clearance(foot, dense, bodies, between).min()
        assert coarse[i] <= seen + 1e-3 + 1e-9
        # and it is no lower than what lies between two of the dense samples can be
        assert coarse[i] >= seen - (abs(v) + 4 * abs(omega) + 6) / fine
    assert closest_approach(foot, np.array(path), bodies, moving_obstacle) == pytest.approx(coarse.min(), abs=1e-3)


def test_path_clearance_sees_what_lies_between_two_samples() -> None:
    path = np.array([[-5.0, 0, 0], [5.0, 0, 0]])
    post = [fixed(Circle(0.1), 0.3, 1.0)]
    assert min_clearance(Circle(0.5), path, post, np.zeros((2, 0, 3))).min() > 4
    assert path_clearance(Circle(0.5), path, post, np.zeros((2, 0, 3)))[0] == pytest.approx(0.4, abs=1e-3)
