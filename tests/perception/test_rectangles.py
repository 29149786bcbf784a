"""What is pushed is found by its sides, followed while it is cut, turns and stands, and nothing else is taken for it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_room import make_robot, room_map

from clearway.contract import Goal, Obstacles, Scan, Sensing, Task
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle, FloatArray, Shape, rectangle
from clearway.perception import TrackerParameters, make_tracker
from clearway.perception.rectangle_fit import Rectangles, inverse, nothing, product, put
from clearway.perception.rectangles import FIRST, GOES_ON, follow

BED, CHAIR = TrackerParameters().pushed
LIDAR = {"beams": 606, "angle_min": -1.745, "angle_max": 1.745, "range_min": 0.05, "range_max": 25.0, "sigma": 0.02}
EYE = np.array((1.1, 3.0, 0.0))
"""Of the robot's lidar, in a room that is otherwise as its map has it."""
DT = 0.1


def told(bodies: list[tuple[Shape, list[FloatArray]]], seed: int = 0) -> Iterator[Obstacles]:
    """What a robot that stands is told, period by period, of bodies that are at so many poses one after another."""
    robot = make_robot(lidar=LIDAR | {"mount": [0.1, 0.0, 0.0]})
    tracker, rng = make_tracker("kalman", robot), np.random.default_rng(seed)
    pose = EYE - (0.1, 0.0, 0.0)
    tracker.reset(Task(DT, 1.0, pose, map=room_map()), robot, rng)
    rays = beams(606, LIDAR["angle_min"], LIDAR["angle_max"], 0.05, 25.0)
    walls = [(rectangle(0.2, 6.0), np.array((10.1, 3.0, 0.0)))]
    for k in range(len(bodies[0][1])):
        shapes, poses = zip(*walls, *((shape, way[k]) for shape, way in bodies), strict=True)
        ranges = sweep(scene(shapes, np.array(poses)), rays, EYE) + 0.02 * rng.standard_normal(606)
        scan = Scan(ranges, rays.angle_min, rays.increment, 0.05, 25.0, np.array((0.1, 0.0, 0.0)))
        goal = Goal(np.zeros(3), 0.2, 0.2)
        yield tracker.update(Sensing(DT * k, pose.copy(), np.zeros(2), scan, None, goal, pose.copy()), pose)


def straight(start: tuple[float, float, float], speed: float, periods: int) -> list[FloatArray]:
    """Poses of what goes the way that it looks."""
    x, y, heading = start
    return [
        np.array((x + speed * DT * k * math.cos(heading), y + speed * DT * k * math.sin(heading), heading))
        for k in range(periods)
    ]


def middle(out: Obstacles) -> tuple[FloatArray, FloatArray]:
    """Of the row of discs that is told, and its mean velocity; nothing else is told as one that moves."""
    assert (out.moving == (out.identity >= FIRST)).all()
    assert out.moving.any()
    return out.position[out.moving].mean(axis=0), out.velocity[out.moving].mean(axis=0)


@settings(max_examples=25, deadline=None)
@given(
    size=st.sampled_from((BED, CHAIR)),
    x=st.floats(1.8, 3.0),
    y=st.floats(-0.6, 0.6),
    heading=st.floats(-math.pi, math.pi),
    speed=st.floats(0.4, 0.7),
    seed=st.integers(0, 99),
)
def test_what_is_pushed_past_is_where_it_is_told(
    size: tuple[float, float], x: float, y: float, heading: float, speed: float, seed: int
) -> None:
    """It comes along any line; once it is told its place, way and outline are right."""
    way = straight((EYE[0] + x, EYE[1] + y, heading), speed, 20)
    if min(np.hypot(*(at[:2] - EYE[:2])) for at in way) < 1.6:
        return
    off: list[float] = []
    for at, out in zip(way, told([(rectangle(*size), way)], seed), strict=True):
        if not (out.identity >= FIRST).any():
            continue
        place, velocity = middle(out)
        c, s = math.cos(heading), math.sin(heading)
        off.append(np.abs(place - at[:2]).max())
        assert np.linalg.norm(velocity - (speed * c, speed * s)) < 0.35
    half = 0.5 * math.hypot(*size)
    whole = all(np.hypot(*(at[:2] - EYE[:2])) + half < 3.9 and at[0] - EYE[0] > half for at in way)  # in view
    assert not whole or (len(off) >= 3 and np.median(off) < 0.15)


def test_a_bed_that_comes_is_followed_to_where_it_waits_and_told_to_go_on() -> None:
    """Front on, its far end hidden; then it stands, and somebody stands before it."""
    coming = straight((EYE[0] + 3.5, EYE[1] + 0.3, math.pi), 0.6, 25)
    way = coming + [coming[-1]] * 40
    legs = [np.array((EYE[0] + 0.55, EYE[1] + 0.25, 0.0))] * len(way)
    last = way[-1]
    for k, out in enumerate(told([(rectangle(*BED), way), (Circle(0.06), legs)])):
        if k < 12:
            continue
        place, velocity = middle(out)
        assert np.abs(place - way[k][:2]).max() < 0.12
        expected = -0.6 if k < 24 else -GOES_ON
        assert velocity == pytest.approx((expected, 0.0), abs=0.3 if 24 <= k < 34 else 0.15)
    discs = np.column_stack((out.position, out.radius))[out.moving]
    corners = np.array([(sx * BED[0] / 2, sy * BED[1] / 2) for sx in (-1, 1) for sy in (-1, 1)]) + last[:2]
    off = np.linalg.norm(corners[:, None] - discs[None, :, :2], axis=2) - discs[:, 2] - out.error[out.moving]
    assert (off.min(axis=1) < 0.0).all()  # with the error of the place all of it is covered
    assert (discs[:, 2] < 0.6).all()
    assert not (np.abs(out.position[~out.moving] - last[:2]) < np.array(BED) / 2).all(axis=1).any()  # not told twice
    # whoever reckons with the bounds and 1 m/s^2 reckons with its standing, and with its backing off
    t = np.linspace(0.0, 3.0, 301)
    e, v_error = out.error[out.moving].min(), out.velocity_error[out.moving].min()
    assert ((GOES_ON + 0.1) * t <= e + v_error * t + 0.5 * t**2 + 1e-12).all()


def test_who_stands_at_its_side_is_told_all_the_same() -> None:
    """So near that their returns are one cluster."""
    coming = straight((EYE[0] + 3.5, EYE[1] - 0.4, math.pi), 0.6, 25)
    way = coming + [coming[-1]] * 10
    front = way[-1][0] - BED[0] / 2
    shin = np.array((front, EYE[1] + 0.25, 0.0))
    out = list(told([(rectangle(*BED), way), (Circle(0.06), [shin] * len(way))]))[-1]
    assert (out.identity >= FIRST).any()
    far = np.linalg.norm(out.position - shin[:2], axis=1) - out.radius
    assert far[out.identity < FIRST].min() < 0.0


def test_it_is_the_same_one_after_it_was_hidden() -> None:
    coming = straight((EYE[0] + 3.5, EYE[1], math.pi), 0.6, 25)
    way = coming + [coming[-1]] * 80
    away = [np.array((EYE[0] + 0.5, 9.0, 0.0))]
    screen = away * 30 + [np.array((EYE[0] + 0.5, EYE[1], 0.0))] * 50 + away * 25
    out = list(told([(rectangle(*BED), way), (rectangle(0.05, 2.5), screen)]))
    before, after = out[28], out[-1]
    assert before.moving.any()
    assert not out[75].moving.any()  # 3 s after it was seen it is told no more
    assert set(after.identity[after.moving]) == set(before.identity[before.moving])
    assert np.abs(middle(after)[0] - way[-1][:2]).max() < 0.12


@pytest.mark.parametrize(
    "bodies",
    [
        [(rectangle(*BED), [np.array((4.0, 3.0, 0.4))] * 40)],  # parked
        [(rectangle(*CHAIR), [np.array((3.0, 2.5, 1.0))] * 40)],
        [(rectangle(3.0, 0.2), [np.array((4.0, 3.0, 1.3))] * 40)],  # a wall in no map
        [(Circle(0.06), straight((4.5, 3.0 + dy, math.pi), 0.5, 40)) for dy in (-0.45, -0.3, -0.05, 0.1, 0.35, 0.5)],
        [(rectangle(0.6, 0.6), straight((4.5, 3.0, math.pi), 0.5, 40))],  # HOSBOT: a body as before
    ],
)
def test_what_stands_people_and_robots_are_none(bodies: list[tuple[Shape, list[FloatArray]]]) -> None:
    assert all((out.identity < FIRST).all() for out in told(bodies))


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_it_has_moved_only_if_space_has_shown_it(speed: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever its own filter makes of another side that comes into view."""

    def slides(*given: Any) -> tuple[Rectangles, int]:
        now, unused = follow(*given)
        now.way[:] = (-1.0, 0.0)
        return now, unused

    monkeypatch.setattr("clearway.perception.rectangles.follow", slides)
    way = straight((4.6, 3.0, math.pi), speed, 20)
    assert any((out.identity >= FIRST).any() for out in told([(rectangle(*BED), way)])) == (speed > 0.0)


def test_where_sizes_are_alike_it_keeps_its_own() -> None:
    """Of a bed's long side a metre is in view: it may be a wheelchair's, unless it was a bed's before."""
    side = np.column_stack((np.linspace(-0.55, 0.55, 60), np.full(60, 2.0)))
    sizes, r = np.array((BED, CHAIR)), nothing(1)
    assert put(r, 0, side, np.zeros(3), sizes)
    assert r.half[0].tolist() == [CHAIR[0] / 2, CHAIR[1] / 2]
    assert r.pose[0, :2] == pytest.approx((0.0, 2.0 + CHAIR[1] / 2))
    r.half[0] = np.array(BED) / 2
    short = side[np.abs(side[:, 0]) < 0.4]
    assert put(r, 0, short, np.zeros(3), sizes)
    assert sorted(2 * r.half[0]) == sorted(BED)
    assert not put(r, 0, side[::8], np.zeros(3), sizes)  # gaps


@given(st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9))
def test_matrices_are_numpys(values: list[float]) -> None:
    m = np.array(values).reshape(3, 3)
    spd = m @ m.T + 0.1 * np.eye(3)
    assert inverse(spd) == pytest.approx(np.linalg.inv(spd), rel=1e-6, abs=1e-6)
    assert product(m, spd) == pytest.approx(m @ spd, abs=1e-9)
