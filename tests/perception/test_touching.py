"""Clusters of a scan that are several bodies: parted where these meet, and what is one body left whole."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from simulated_room import make_robot

from clearway.contract import Goal, Scan, Sensing, Task
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle, Shape, rectangle
from clearway.perception import make_tracker
from clearway.perception.clusters import ClusterParameters, Returns, perceive
from clearway.perception.touching import parted

SIGMA = 0.01
RADIUS = 0.35
EYE = np.zeros(3)
SIZES = (0.0, 0.5)
AROUND = {"beams": 360, "angle_min": -math.pi, "angle_max": math.pi * (1 - 2 / 360), "range_min": 0.02}
ROBOT = make_robot(lidar=AROUND | {"range_max": 4.0, "sigma": SIGMA}, period=0.15)
RAYS = beams(360, AROUND["angle_min"], AROUND["angle_max"], 0.02, 4.0)


def scan_of(
    shapes: list[Shape], poses: list[tuple[float, float, float]], rng: np.random.Generator, sigma: float = SIGMA
) -> Scan:
    ranges = sweep(scene(shapes, np.array(poses)), RAYS, EYE) + sigma * rng.standard_normal(360)
    return Scan(ranges, RAYS.angle_min, RAYS.increment, 0.02, 4.0, EYE)


def seen(
    shapes: list[Shape], poses: list[tuple[float, float, float]], seed: int, sigma: float = SIGMA
) -> tuple[Returns, Returns]:
    """The clusters before and after parting."""
    scan = scan_of(shapes, poses, np.random.default_rng(seed), sigma)
    whole = perceive(scan, EYE, ClusterParameters(), sigma)
    return whole, parted(whole, RAYS.increment, SIZES, sigma)


@settings(max_examples=80, deadline=None)
@given(
    st.floats(1.2, 2.6), st.floats(-math.pi, math.pi), st.floats(-0.9, 0.9), st.floats(0.8, 1.0), st.integers(0, 2**31)
)
def test_two_that_touch_or_overlap_are_two(far: float, bearing: float, slant: float, apart: float, seed: int) -> None:
    middle = far * np.array((math.cos(bearing), math.sin(bearing)))
    aside = RADIUS * apart * np.array((-math.sin(bearing + slant), math.cos(bearing + slant)))
    places = [middle + aside, middle - aside]
    whole, parts = seen([Circle(RADIUS)] * 2, [(*p, 0.0) for p in places], seed)
    owner = np.argmin([np.abs(np.hypot(*(whole.raw - p).T) - RADIUS) for p in places], axis=0)
    assume(len(whole.size) == 1)
    assume(min(np.bincount(owner, minlength=2)) >= 8)  # else one hides the other
    assert len(parts.size) == 2
    agreeing = parts.label == owner
    assert max(np.mean(agreeing), np.mean(~agreeing)) > 0.93
    assert np.array_equal(np.bincount(parts.label), parts.size)
    for c in range(2):  # the circles are of the parts
        off = np.hypot(*(parts.points[parts.label == c] - parts.circles[c, :2]).T)
        assert off.max() <= parts.circles[c, 2] + 1e-9


@pytest.mark.parametrize("bearing", [0.0, 1.0, math.pi])
def test_a_row_is_parted_throughout(bearing: float) -> None:
    turn = np.array([[math.cos(bearing), -math.sin(bearing)], [math.sin(bearing), math.cos(bearing)]])
    row = [turn @ (2.2, 0.7 * k) for k in (-1.5, -0.5, 0.5, 1.5)]
    whole, parts = seen([Circle(RADIUS)] * 4, [(*p, 0.0) for p in row], 0)
    assert len(whole.size) == 1
    assert len(parts.size) == 4


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from([Circle(0.35), Circle(0.2), rectangle(0.4, 0.3), rectangle(1.2, 0.6), rectangle(3.0, 0.1)]),
    st.floats(1.0, 2.5), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi), st.integers(0, 2**31),
)  # fmt: skip
def test_what_is_convex_is_left_whole(shape: Shape, far: float, bearing: float, yaw: float, seed: int) -> None:
    whole, parts = seen([shape], [(far * math.cos(bearing), far * math.sin(bearing), yaw)], seed)
    assert np.array_equal(parts.label, whole.label)
    assert np.array_equal(parts.circles, whole.circles)


def test_a_corner_of_walls_is_left_whole() -> None:
    whole, parts = seen([rectangle(0.1, 3.0), rectangle(3.0, 0.1)], [(2.0, 0.0, 0.0), (0.5, 1.5, 0.0)], 1)
    assert np.array_equal(parts.label, whole.label)


def test_who_leans_on_a_wall_is_no_wall() -> None:
    whole, parts = seen([rectangle(0.1, 3.0), Circle(RADIUS)], [(2.3, 0.0, 0.0), (2.3, 0.2, 0.0)], 1)
    assert len(whole.size) == 1
    near = np.hypot(*(parts.circles[:, :2] - (2.3, 0.2)).T)
    assert near.min() < 0.25  # the circle around what is seen lies before the middle
    assert parts.circles[near.argmin(), 2] == pytest.approx(RADIUS, abs=0.06)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("third", [False, True])
def test_who_stands_half_behind_another_is_cut(side: float, third: bool) -> None:
    """In one cluster, as the rim of the nearer one leads on to the other."""
    places = [np.array((1.5, 0.0)), np.array((1.75, 0.5 * side)), np.array((1.5, -0.7 * side))][: 2 + third]
    whole, parts = seen([Circle(RADIUS)] * len(places), [(*p, 0.0) for p in places], 3, sigma=0.001)
    assert len(whole.size) == 1
    assert len(parts.size) == len(places)
    owner = [int(np.hypot(*(parts.circles[:, :2] - p).T).argmin()) for p in places]
    assert parts.cut[owner[:2]].tolist() == [0, 1]


def test_what_the_map_shows_and_two_legs_are_left_whole() -> None:
    whole, parts = seen([Circle(RADIUS)] * 2, [(2.0, 0.35, 0.0), (2.0, -0.35, 0.0)], 2)
    assert len(parts.size) == len(whole.size) + 1
    for told in (
        whole._replace(known=np.ones_like(whole.known)),
        whole._replace(legs=np.ones_like(whole.legs)),
    ):
        assert len(parted(told, RAYS.increment, SIZES, SIGMA).size) == len(whole.size)


def test_two_who_walk_side_by_side_are_two_who_move() -> None:
    """In one cluster they are larger than a body, and so a wall that stands."""
    rng, tracker = np.random.default_rng(3), make_tracker("kalman", ROBOT)
    tracker.reset(Task(0.15, 1.0, np.zeros(3)), ROBOT, np.random.default_rng(0))
    for k in range(16):
        places = [np.array((3.6 - 0.15 * k, y)) for y in (-0.36, 0.36)]
        scan = scan_of([Circle(RADIUS)] * 2, [(*p, 0.0) for p in places], rng)
        out = tracker.update(Sensing(0.15 * k, EYE, np.zeros(2), scan, None, Goal(np.zeros(3), 0.2, 0.2), EYE), EYE)
        if k >= 6:
            assert out.moving.sum() == 2
            for p in places:
                i = np.flatnonzero(out.moving)[np.hypot(*(out.position[out.moving] - p).T).argmin()]
                assert np.hypot(*(out.position[i] - p)) < 0.05
                assert out.velocity[i] == pytest.approx((-1.0, 0.0), abs=0.3)
