"""Round bodies in a scan: the circle of an arc, what is no arc, and how bodies are followed by it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from simulated_room import make_robot

from clearway.contract import Goal, Obstacles, Scan, Sensing, Task, Tracker
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle, Shape, rectangle
from clearway.perception import make_tracker
from clearway.perception.arcs import Arc, arc

SIGMA = 0.01
EYE = np.zeros(3)
AROUND = {"beams": 360, "angle_min": -math.pi, "angle_max": math.pi * (1 - 2 / 360), "range_min": 0.02}
ROBOT = make_robot(lidar=AROUND | {"range_max": 4.0, "sigma": SIGMA}, period=0.15)
RAYS = beams(360, AROUND["angle_min"], AROUND["angle_max"], 0.02, 4.0)


def ranges_of(shapes: list[Shape], poses: list[tuple[float, float, float]], rng: np.random.Generator) -> np.ndarray:
    return sweep(scene(shapes, np.array(poses)), RAYS, EYE) + SIGMA * rng.standard_normal(360)


def points_of(ranges: np.ndarray) -> np.ndarray:
    seen = np.isfinite(ranges) & (ranges < 4.0)
    bearing = RAYS.angle_min + RAYS.increment * np.flatnonzero(seen)
    return ranges[seen, None] * np.stack((np.cos(bearing), np.sin(bearing)), axis=1)


def arc_of(points: np.ndarray, radius: float, variance: float) -> Arc:
    return arc(points, np.arange(len(points)), EYE, SIGMA, radius, variance)


@settings(max_examples=60, deadline=None)
@given(st.floats(1.0, 3.0), st.floats(-3.1, 3.1), st.floats(0.15, 0.45), st.integers(0, 2**31))
def test_it_is_the_circle_of_least_squares(far: float, bearing: float, radius: float, seed: int) -> None:
    place = far * math.cos(bearing), far * math.sin(bearing), 0.0
    points = points_of(ranges_of([Circle(radius)], [place], np.random.default_rng(seed)))

    def residuals(c: np.ndarray) -> np.ndarray:
        off = np.hypot(points[:, 0] - c[0], points[:, 1] - c[1]) - c[2]
        return np.append(off / SIGMA, (c[2] - 0.3) / 0.15)

    best = least_squares(residuals, (*place[:2], radius), x_scale=0.1, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    found = arc_of(points, 0.3, 0.15**2)
    assert np.array(found[:3]) == pytest.approx(best.x, abs=1e-4)
    curvature = best.jac.T @ best.jac
    assert found.radius_variance == pytest.approx(np.linalg.inv(curvature)[2, 2], rel=0.02)
    assert found.variance == pytest.approx(0.5 * np.trace(np.linalg.inv(curvature[:2, :2])), rel=0.02)
    at = np.hypot(found.x - place[0], found.y - place[1])
    if found.fits:  # the radius errs along the line of sight as the centre does
        assert at < 5.0 * math.sqrt(2.0 * found.variance + found.radius_variance)


def test_arcs_are_known_as_such_and_their_centres_to_millimetres() -> None:
    rng, off, fits = np.random.default_rng(1), [], []
    for _ in range(200):
        far, bearing = rng.uniform(0.8, 3.0), rng.uniform(-3.0, 3.0)
        place = far * math.cos(bearing), far * math.sin(bearing), 0.0
        found = arc_of(points_of(ranges_of([Circle(0.35)], [place], rng)), 0.35, 0.005**2)
        fits.append(found.fits)
        off.append(math.hypot(found.x - place[0], found.y - place[1]))
    assert np.mean(fits) > 0.97
    assert np.median(off) < 0.006
    assert max(off) < 0.03


@pytest.mark.parametrize("edges", [(0.3, 0.3), (0.6, 0.4), (1.0, 0.05), (0.8, 0.8)])
def test_boxes_and_walls_are_no_arcs(edges: tuple[float, float]) -> None:
    rng, fits = np.random.default_rng(2), []
    for _ in range(200):
        far, bearing, yaw = rng.uniform(0.9, 2.5), rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0)
        place = far * math.cos(bearing), far * math.sin(bearing), yaw
        points = points_of(ranges_of([rectangle(*edges)], [place], rng))
        if len(points) < 5:
            continue
        radius = 0.5 * float(np.ptp(points, axis=0).max())
        found = arc_of(points, radius, (0.5 * radius) ** 2)
        fits.append(found.fits and found.radius <= 0.5)
    assert np.mean(fits) < 0.1


def test_a_hollow_is_no_arc() -> None:
    angle = np.linspace(-0.5, 0.5, 15)
    points = np.stack((1.0 + np.cos(angle), np.sin(angle)), axis=1)  # the far side of a circle about (1, 0)
    assert not arc_of(points, 0.5, 0.25).fits
    assert not arc_of(np.tile((2.0, 0.0), (6, 1)), 0.3, 0.02).fits  # one place six times tells no radius


def fresh(name: str) -> Tracker:
    tracker = make_tracker(name, ROBOT)
    tracker.reset(Task(0.15, 1.0, np.zeros(3)), ROBOT, np.random.default_rng(0))
    return tracker


def look(tracker: Tracker, k: int, ranges: np.ndarray) -> Obstacles:
    scan = Scan(ranges, RAYS.angle_min, RAYS.increment, 0.02, 4.0, EYE)
    goal = Goal(np.zeros(3), 0.2, 0.2)
    return tracker.update(Sensing(0.15 * k, EYE, np.zeros(2), scan, None, goal, EYE), EYE)


@pytest.mark.parametrize(
    ("start", "v"), [((3.9, 1.5), (-1.2, -0.4)), ((2.5, -3.0), (0.0, 1.5)), ((-1.5, 2.0), (0.6, 0.0))]
)
def test_one_who_crosses_an_open_place_is_told_soon_and_sharply(
    start: tuple[float, float], v: tuple[float, float]
) -> None:
    rng, tracker, off, errs, held, first = np.random.default_rng(3), fresh("kalman"), [], [], [], None
    for k in range(16):
        place = np.array(start) + 0.15 * k * np.array(v)
        out = look(tracker, k, ranges_of([Circle(0.35), Circle(0.35)], [(*place, 0.0), (-2.0, -2.0, 0.0)], rng))
        told = np.flatnonzero(out.moving)
        assert len(told) <= 1  # the other one stands
        for i in told:
            first = k if first is None else first
            off.append(np.hypot(*(out.position[i] - place)))
            errs.append(np.hypot(*(out.velocity[i] - v)))
            near = (
                np.hypot(*out.position[i]) - out.radius[i] - (np.hypot(*place) - 0.35)
            )  # how deep it reaches is less known
            held.append(abs(near) <= out.error[i] and errs[-1] <= out.velocity_error[i])
            assert out.radius[i] == pytest.approx(0.35, abs=0.04)
    assert first is not None
    assert first <= 3  # 0.45 s; by space alone it takes three periods of signs
    assert np.median(off) < 0.012
    assert np.median(errs) < 0.12
    assert np.mean(held) >= 0.9


def test_who_is_half_hidden_is_where_he_is() -> None:
    """A post nearer by hides one side and then the other: by the circle around what is in view he would swing to and fro."""
    rng, tracker, off = np.random.default_rng(4), fresh("kalman"), []
    for k in range(20):
        place = np.array((2.2, -1.6 + 0.15 * k))
        out = look(tracker, k, ranges_of([Circle(0.35), Circle(0.08)], [(*place, 0.0), (1.2, 0.0, 0.0)], rng))
        near = np.flatnonzero(out.moving & (np.hypot(*(out.position - place).T) < 0.5))
        off += [np.hypot(*(out.position[i] - place)) for i in near]
    assert len(off) > 12
    assert np.quantile(off, 0.75) < 0.02  # for a moment he is two, one on either side of it


def test_finite_differences_are_of_the_same_circles() -> None:
    rng, tracker, errs = np.random.default_rng(5), fresh("difference"), []
    for k in range(12):
        place = np.array((2.0, -1.2 + 0.15 * k))
        out = look(tracker, k, ranges_of([Circle(0.35)], [(*place, 0.0)], rng))
        (i,) = np.flatnonzero(out.moving)
        assert np.hypot(*(out.position[i] - place)) < 0.08
        errs.append(np.hypot(*(out.velocity[i] - (0.0, 1.0))))
    assert np.median(errs[1:]) < 0.25
