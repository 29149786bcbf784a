from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given
from hypothesis import strategies as st

from clearway.geometry.packing import boxes, pack, place
from clearway.geometry.raycast import Beams, Scene, beams, cast_moving, scene, sweep
from clearway.geometry.shapes import Circle, FloatArray, Polygon, rectangle

lidars = st.sampled_from(
    [
        beams(1081, -0.75 * math.pi, 0.75 * math.pi, 0.0, 30.0),
        beams(361, -math.pi, math.pi, 0.0, 4.0),
        beams(90, 0.0, 3 * math.pi, 0.0, 10.0),  # looks at some directions twice
        beams(60, 2.0, 9.0, 0.0, 10.0),
        beams(7, -0.3, 0.3, 0.0, 10.0),
        beams(40, 1.0, -2.0, 0.0, 10.0),  # clockwise
        beams(1, 0.4, 0.4, 0.0, 10.0),
    ]
)
coordinates = st.floats(-6, 6)
segments = st.lists(st.tuples(coordinates, coordinates, coordinates, coordinates), max_size=12)
circles = st.lists(st.tuples(coordinates, coordinates, st.floats(0.01, 3)), max_size=8)
poses = st.tuples(coordinates, coordinates, st.floats(-7, 7)).map(np.array)


def brute_force(rows: FloatArray, discs: FloatArray, lidar: Beams, pose: FloatArray) -> FloatArray:
    """Every beam against every primitive, in the world's frame."""
    index = np.arange(lidar.directions.shape[1])
    angle = lidar.angle_min + index * lidar.increment + pose[2]
    d = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    best = np.full(len(d), np.inf)
    with np.errstate(all="ignore"):
        for x0, y0, x1, y1 in rows:
            # solve pose + t d = a + u e
            m = np.array([x0 - pose[0], y0 - pose[1]])
            e = np.array([x1 - x0, y1 - y0])
            det = d[:, 0] * e[1] - d[:, 1] * e[0]
            t = (m[0] * e[1] - m[1] * e[0]) / det
            u = (m[0] * d[:, 1] - m[1] * d[:, 0]) / det
            hit = (t >= 0) & (u >= 0) & (u <= 1)
            best = np.where(hit & (t < best), t, best)
        for x, y, r in discs:
            b = d[:, 0] * (x - pose[0]) + d[:, 1] * (y - pose[1])
            c = (x - pose[0]) ** 2 + (y - pose[1]) ** 2 - r * r
            root = np.sqrt(b * b - c)
            t = np.where(c > 0, b - root, b + root)
            best = np.where((t >= 0) & (t < best), t, best)
    return np.where(best <= lidar.range_max, best, np.inf)


@given(segments, circles, lidars, poses)
def test_sweep_is_brute_force(rows: list, discs: list, lidar: Beams, pose: FloatArray) -> None:  # type: ignore[type-arg]
    r = np.array(rows, dtype=float).reshape(-1, 4)
    k = np.array(discs, dtype=float).reshape(-1, 3)
    here = shapely.Point(pose[:2])  # on an outline it is a matter of rounding which side the sensor looks from
    assume(all(here.distance(shapely.LineString([(a, b), (c, d)])) > 1e-6 for a, b, c, d in rows))
    assume(all(abs(math.dist(pose[:2], disc[:2]) - disc[2]) > 1e-6 for disc in discs))
    assume(all(math.dist((a, b), (c, d)) > 1e-5 for a, b, c, d in rows))  # a speck is grazed at both ends at once
    nobody = np.zeros(0, dtype=np.int64)
    got = sweep(Scene(r, k, nobody, nobody), lidar, pose)
    expected = brute_force(r, k, lidar, pose)
    odd = ~np.isclose(got, expected, rtol=1e-7, atol=1e-7)
    if odd.any():  # only a beam that grazes an end or a rim may differ: move the sensor a little and it doesn't matter
        near = [brute_force(r, k, lidar, pose + np.array(n)) for n in
                [(1e-7, 0, 0), (-1e-7, 0, 0), (0, 1e-7, 0), (0, -1e-7, 0), (0, 0, 1e-7), (0, 0, -1e-7)]]  # fmt: skip
        explained = np.any([np.isclose(got, n, rtol=1e-4, atol=1e-4) for n in near], axis=0)
        assert explained[odd].all()


def test_sweep_agrees_with_shapely_in_a_furnished_room() -> None:
    rng = np.random.default_rng(4)
    things = [rectangle(10, 8)] + [rectangle(0.6, 0.3)] * 10 + [Circle(0.25)] * 10
    at = np.concatenate([np.zeros((1, 3)), np.column_stack([rng.uniform(-4, 4, (20, 2)), rng.uniform(-3, 3, 20)])])
    lidar = beams(1081, -0.75 * math.pi, 0.75 * math.pi, 0.05, 30.0)
    pose = np.array([0.3, -0.2, 0.7])
    world = shapely.union_all(
        [shapely.affinity.translate(
            shapely.affinity.rotate(shapely.Polygon(t.vertices).exterior, p[2], origin=(0, 0), use_radians=True), p[0], p[1])
         if isinstance(t, Polygon) else shapely.Point(p[:2]).buffer(t.radius, quad_segs=4000).exterior
         for t, p in zip(things, at, strict=True)]
    )  # fmt: skip
    got = sweep(scene(things, at), lidar, pose)
    angle = lidar.angle_min + lidar.increment * np.arange(1081) + pose[2]
    here = shapely.Point(pose[:2])
    for i in range(0, 1081, 4):
        ray = shapely.LineString([pose[:2], pose[:2] + 30 * np.array([math.cos(angle[i]), math.sin(angle[i])])])
        assert got[i] == pytest.approx(here.distance(ray.intersection(world)), abs=2e-5)


def test_a_closed_room_leaks_nowhere() -> None:
    """Beams through corners and along the axes, from many places."""
    lidar = beams(721, -math.pi, math.pi, 0.0, 100.0)
    room = scene([rectangle(2, 2)], np.zeros((1, 3)))
    for x in (0.0, 0.5, -0.999):
        for theta in (0.0, math.pi / 4, -math.pi / 2):
            assert np.isfinite(sweep(room, lidar, np.array([x, x, theta]))).all()


def test_ranges_outside_the_sensors_are_no_return() -> None:
    lidar = beams(3, -0.1, 0.1, 0.5, 2.0)
    assert np.isinf(sweep(scene([Circle(0.2)], np.array([[0.4, 0.0, 0.0]])), lidar, np.zeros(3))).all()  # too near
    assert np.isinf(sweep(scene([Circle(0.2)], np.array([[2.4, 0.0, 0.0]])), lidar, np.zeros(3))).all()  # too far
    assert sweep(scene([Circle(0.2)], np.array([[2.0, 0.0, 0.0]])), lidar, np.zeros(3))[1] == pytest.approx(1.8)


@given(poses, st.lists(poses, min_size=3, max_size=3))
def test_moving_obstacles_are_seen_where_they_stand(sensor: FloatArray, at: list[FloatArray]) -> None:
    lidar = beams(181, -1.5, 1.5, 0.0, 20.0)
    shapes = [rectangle(1, 0.5), Circle(0.3), Polygon(((-0.5, 0.0), (0.5, 0.2)))]
    local = scene(shapes)
    there = np.array(at)
    there[1] = math.nan  # absent
    got = np.full(181, np.inf)
    cast_moving(local.segments, local.segment_owner, local.circles, local.circle_owner, there, *map(float, sensor),
                lidar.directions, lidar.angle_min, lidar.increment, lidar.range_max, got)  # fmt: skip
    expected = sweep(scene([shapes[0], shapes[2]], there[[0, 2]]), lidar, sensor)
    finite = np.isfinite(got) == np.isfinite(expected)
    assert (~finite).sum() <= 2  # a beam that just passes a corner
    both = np.isfinite(got) & np.isfinite(expected)
    assert (np.isclose(got[both], expected[both], atol=1e-6)).sum() >= both.sum() - 2


def test_packing() -> None:
    packed = pack([Circle(0.5), rectangle(2, 1)])
    assert packed.reach == pytest.approx([0.5, math.hypot(1, 0.5)])
    placed = place(packed, np.array([[1.0, 2, 3], [1, 0, math.pi / 2]]))
    assert boxes(placed) == pytest.approx(np.array([[0.5, 1.5, 1.5, 2.5], [0.5, -1, 1.5, 1]]))
