"""Who is out of the lidar's view is where the sonars meet them, and nobody is where their cones are free."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_room import make_robot, room_map

from clearway.contract import Goal, Obstacles, Ranges, Scan, Sensing, Task
from clearway.geometry.raycast import beams, scene, sweep
from clearway.geometry.shapes import Circle, FloatArray, Shape, rectangle
from clearway.perception import make_tracker
from clearway.perception.clusters import known_structure
from clearway.perception.sonars import FIRST, structure_within

MOUNTS = np.array(((-0.183, 0.183, 0.75 * math.pi), (-0.259, 0.0, math.pi), (-0.183, -0.183, -0.75 * math.pi)))
FIELD, REACH, EVERY = 0.5, 1.0, 2
LIDAR = {"beams": 606, "angle_min": -1.745, "angle_max": 1.745, "range_min": 0.05, "range_max": 25.0, "sigma": 0.02}
DT = 0.1
WALLS = [(rectangle(0.2, 6.0), np.array((10.1, 3.0, 0.0))), (rectangle(0.2, 6.0), np.array((-0.1, 3.0, 0.0)))]

Bodies = list[tuple[Shape, list[FloatArray]]]


def hear(pose: FloatArray, shapes: list[Shape], poses: FloatArray, rng: np.random.Generator) -> Ranges:
    """By many rays in each cone."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    ranges = []
    for x, y, theta in MOUNTS:
        eye = np.array((pose[0] + c * x - s * y, pose[1] + s * x + c * y, pose[2] + theta))
        rays = beams(201, -0.5 * FIELD, 0.5 * FIELD, 0.02, REACH)
        ranges.append(sweep(scene(shapes, poses), rays, eye).min() + 0.01 * rng.standard_normal())
    return Ranges(np.array(ranges), MOUNTS, FIELD, REACH)


def told(
    pose: FloatArray, bodies: Bodies, periods: int, sonars: bool = True, seed: int = 0, turned: int = 0
) -> Iterator[Obstacles]:
    """What a robot that stands at `pose` in a known room is told, period by period, of bodies at so many poses one after another; for the
    first `turned` periods it looks the other way."""
    more = {
        "mounts": MOUNTS.tolist(),
        "field": FIELD,
        "range_min": 0.02,
        "range_max": REACH,
        "sigma": 0.01,
        "period": 0.2,
    }
    robot = make_robot(lidar=LIDAR | {"mount": [0.1, 0.0, 0.0]}, **({"sonars": more} if sonars else {}))
    tracker, rng = make_tracker("kalman", robot), np.random.default_rng(seed)
    tracker.reset(Task(DT, 1.0, pose, map=room_map()), robot, rng)
    rays, goal = beams(606, LIDAR["angle_min"], LIDAR["angle_max"], 0.05, 25.0), Goal(np.zeros(3), 0.2, 0.2)
    for k in range(periods):
        pose = pose if k and k != turned else pose + np.array((0.0, 0.0, math.pi if turned else 0.0))
        eye = pose + np.array((0.1 * math.cos(pose[2]), 0.1 * math.sin(pose[2]), 0.0))
        shapes, poses = zip(*WALLS, *((shape, way[k]) for shape, way in bodies), strict=True)
        ranges = sweep(scene(shapes, np.array(poses)), rays, eye) + 0.02 * rng.standard_normal(606)
        scan = Scan(ranges, rays.angle_min, rays.increment, 0.05, 25.0, np.array((0.1, 0.0, 0.0)))
        heard = hear(pose, list(shapes), np.array(poses), rng) if sonars and k % EVERY == 0 else None
        yield tracker.update(Sensing(DT * k, pose.copy(), np.zeros(2), scan, None, goal, pose.copy(), heard), pose)


def person(way: FloatArray) -> Bodies:
    """Two legs about each place of `way` (n, 2), side by side across where they go."""
    going = np.gradient(way, axis=0)
    angle = np.arctan2(going[:, 1], going[:, 0])
    out: Bodies = []
    for side in (0.085, -0.085):
        at = way + side * np.column_stack((-np.sin(angle), np.cos(angle)))
        out.append((Circle(0.06), [np.array((*p, 0.0)) for p in at]))
    return out


def off(out: Obstacles, place: FloatArray) -> float:
    """How far from `place` the nearest is that is told to move, m."""
    return float(np.hypot(*(out.position[out.moving] - place).T).min(initial=math.inf))


def past(pose: FloatArray, radius: float, end: float) -> FloatArray:
    """(n, 2) a way around a robot at `pose`, from its left front to the bearing `end` [rad], at 0.8 m/s; then they stand for 6 s."""
    bearing = np.append(np.arange(0.6, end, 0.8 * DT / radius), np.full(60, end))
    return pose[:2] + radius * np.column_stack((np.cos(pose[2] + bearing), np.sin(pose[2] + bearing)))


@settings(max_examples=15, deadline=None)
@given(
    heading=st.floats(-math.pi, math.pi), radius=st.floats(0.6, 0.9), end=st.floats(2.1, 4.2), seed=st.integers(0, 99)
)  # fmt: skip
def test_who_goes_behind_it_and_stands_there_is_told_where_they_are(
    heading: float, radius: float, end: float, seed: int
) -> None:
    pose = np.array((5.5, 3.0, heading))
    way = past(pose, radius, end)
    apart = [off(out, at) for out, at in zip(told(pose, person(way), len(way), seed=seed), way, strict=True)]
    standing = np.array(apart[-50:])
    mount = MOUNTS[np.abs(np.remainder(end - MOUNTS[:, 2] + math.pi, 2.0 * math.pi) - math.pi).argmin()]
    aside = abs(
        math.remainder(
            math.atan2(radius * math.sin(end) - mount[1], radius * math.cos(end) - mount[0]) - mount[2], 2.0 * math.pi
        )
    )
    if aside < 0.5 * FIELD + 0.05:  # the middle of a person, or nearly, in a cone
        assert np.median(standing) < 0.3
        assert (standing < 0.4).mean() > 0.9
    lost = np.isinf(apart[10 : len(way) - 60])  # as long as they go on
    assert not any(lost[k : k + 5].all() for k in range(len(lost) - 4))


def test_without_sonars_they_are_forgotten() -> None:
    pose = np.array((5.5, 3.0, 0.0))
    way = past(pose, 0.7, math.pi)
    last = [off(out, way[-1]) for out in told(pose, person(way), len(way), sonars=False)][-20:]
    assert min(last) > 0.5


def test_who_comes_from_behind_is_told_once_a_cone_meets_them() -> None:
    pose = np.array((5.5, 3.0, 0.0))
    x = np.append(np.linspace(3.5, 4.8, 20), np.full(10, 4.8))
    way = np.column_stack((x, np.full(30, 3.0)))
    outs = list(told(pose, person(way), 30))
    assert off(outs[-1], way[-1]) < 0.15
    assert (outs[-1].identity[outs[-1].moving] >= FIRST).any()
    assert not outs[0].moving.any()


def test_who_has_gone_from_where_they_were_expected_is_no_longer_told() -> None:
    """The lidar's tracker goes on telling for two seconds of who went out of view; the free cone knows better."""
    pose = np.array((5.5, 3.0, 0.0))
    gone = past(pose, 0.7, 2.3)[:-60]
    way = np.concatenate((gone, np.tile((1.0, 5.0), (8, 1))))
    last = list(told(pose, person(way), len(way)))[-1]
    assert not last.moving.any()


@pytest.mark.parametrize("pose", [(0.45, 3.0, 0.0), (0.45, 3.0, 0.4), (0.6, 3.0, -0.3), (0.9, 3.0, 0.2)])
def test_a_wall_that_the_map_shows_is_nobody(pose: tuple[float, float, float]) -> None:
    post = [(Circle(0.1), [np.array((3.0, 3.0, 0.0))] * 30)]
    assert not any(out.moving.any() for out in told(np.array(pose), post, 30))


def test_what_stood_there_when_the_lidar_looked_is_nobody() -> None:
    """A box in no map, from which it turns away."""
    box = [(rectangle(0.4, 0.4), [np.array((4.8, 3.0, 0.0))] * 40)]
    outs = list(told(np.array((5.5, 3.0, 0.0)), box, 40, turned=10))
    assert not any(out.moving.any() for out in outs)


def test_how_far_off_the_maps_structure_is() -> None:
    known = known_structure(room_map(), 0.0)
    assert structure_within(np.array((0.5, 3.0, math.pi)), 0.25, 1.0, known) == pytest.approx(0.5, abs=0.11)
    assert structure_within(np.array((0.5, 3.0, 0.0)), 0.25, 1.0, known) == 1.0
    assert (
        structure_within(
            np.array((0.5, 3.0, 0.0)),
            0.25,
            1.0,
            known_structure(room_map(), 0.0)._replace(cells=np.zeros((0, 0), np.uint8)),
        )
        == 1.0
    )
