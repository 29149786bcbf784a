"""The camera: what is seen, how wrong, and that the error depends on nothing but seed, obstacle and period."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from worlds import Pilot, body, constant, make_robot, make_scenario, moving_obstacle, run

from clearway.contract import Command, Obstacles
from clearway.geometry.shapes import Circle, rectangle

CAMERA = {"range": 4.0, "error": 0.05}
LEGS = [{"name": "f", "goal": (99, 0, 0), "time_limit": 8.0}]
BODIES = [
    body(Circle(0.3), 2.0, 2.0, kind="wall", name="wall"),
    body(Circle(0.35), 0.0, 4.3, kind="obstacle", name="reaches in"),
    moving_obstacle(Circle(0.2)),
    body(Circle(0.35), 0.0, -4.4, kind="obstacle", name="too far"),
    body(rectangle(0.6, 0.8), -2.0, 0.0, 0.3, kind="obstacle", name="box"),
    moving_obstacle(Circle(0.1)),
]
KNOTS = [np.array([[0.0, 2.0, 0.0, 0.0], [8.0, 2.0, 3.0, 0.0]]), np.array([[3.0, 0.0, 2.0, 0.0], [4.0, 0.0, 2.0, 0.0]])]


def seen(rule: Any = None, seed: int = 5, error: float = 0.05, **changes: Any) -> list[Obstacles]:
    pilot = Pilot(rule) if rule else constant(0.0)
    robot = make_robot(camera=CAMERA | {"error": error}, lidar=None, **changes)
    run(pilot, BODIES, make_scenario(legs=LEGS, seed=seed), robot, KNOTS)
    found = [s.obstacles for s in pilot.seen]
    assert all(o is not None for o in found)
    return found  # type: ignore[return-value]


def test_without_a_camera_nothing_is_seen() -> None:
    pilot = constant(0.0)
    run(pilot, BODIES, make_scenario(legs=LEGS), make_robot(), KNOTS)
    assert {s.obstacles for s in pilot.seen} == {None}


def test_what_reaches_into_the_circle_is_seen_whatever_stands_before_it() -> None:
    first, later = seen()[0], seen()[35]
    assert first.identity.tolist() == [1, 2, 4]  # indices of bodies; walls are a lidar's work
    assert later.identity.tolist() == [1, 2, 4, 5]  # the second moving obstacle is there from 3 s to 4 s
    assert first.radius.tolist() == [0.35, 0.2, 0.5]  # a box as the disc around it
    assert first.moving.tolist() == [False, True, False]
    assert np.isnan(first.velocity).all()
    assert np.isinf(first.velocity_error).all()
    assert [len(a) for a in (first.position, first.velocity, first.error)] == [3, 3, 3]


def test_what_stands_is_seen_where_it_is_and_what_moves_within_the_error() -> None:
    off = []
    for i, o in enumerate(seen()):
        at = dict(zip(o.identity.tolist(), o.position, strict=True))
        bounds = dict(zip(o.identity.tolist(), o.error.tolist(), strict=True))
        assert at[1].tolist() == [0.0, 4.3]
        assert at[4].tolist() == [-2.0, 0.0]
        assert (bounds[1], bounds[2], bounds[4]) == (0.0, 0.05, 0.0)
        off.append(at[2] - (2.0, 3.0 * i * 0.1 / 8.0))
    apart = np.hypot(*np.array(off).T)
    assert 0.04 < apart.max() <= 0.05
    assert np.median(apart) > 0.02
    assert abs(np.mean(off)) < 0.01
    exact = seen(error=0.0)[20]
    assert exact.position[1].tolist() == [2.0, 3.0 * 2.0 / 8.0]


def test_the_error_is_the_same_whatever_the_robot_does() -> None:
    standing = seen()
    driving = seen(lambda s: Command(0.3 * math.sin(s.t), 1.0))
    compared = 0
    for a, b in zip(standing, driving, strict=True):
        for i in set(a.identity.tolist()) & set(b.identity.tolist()):
            assert (a.position[a.identity == i] == b.position[b.identity == i]).all()
            compared += 1
    assert compared > 150
    assert not np.array_equal(standing[0].position, seen(seed=6)[0].position)
    assert not np.array_equal(standing[0].position[1] - (2, 0), standing[1].position[1] - (2, 0.0375))


def test_the_field_moves_with_the_robot() -> None:
    pilot, behind = constant(1.0), body(Circle(0.5), -2.0, 0.0, kind="obstacle")
    trial = run(pilot, [behind], make_scenario(legs=LEGS), make_robot(camera=CAMERA))
    for sensing, pose in zip(pilot.seen, trial.pose, strict=True):
        assert sensing.obstacles is not None
        assert len(sensing.obstacles) == (pose[0] + 2.0 - 0.5 <= 4.0)
    assert trial.pose[-1, 0] > 5.0


def test_nothing_to_see_and_very_much() -> None:
    empty = constant(0.0)
    run(empty, [], make_scenario(legs=LEGS), make_robot(camera=CAMERA))
    assert {len(s.obstacles) for s in empty.seen if s.obstacles is not None} == {0}
    crowd = [body(Circle(0.1), 3.0 * math.cos(i), 3.0 * math.sin(i), kind="obstacle") for i in range(1000)]
    full = constant(0.0)
    run(full, crowd, make_scenario(legs=LEGS), make_robot(camera=CAMERA))
    assert {len(s.obstacles) for s in full.seen if s.obstacles is not None} == {1000}
