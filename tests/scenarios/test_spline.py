"""Motion through key frames is that of Gazebo, read a second time from its source."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from clearway.geometry.shapes import FloatArray
from clearway.scenarios.dynabarn import worlds
from clearway.scenarios.scenario import DiscSpec, ObstacleSpec
from clearway.scenarios.spline import AWAY, CHORD, SplineSpec, knots, position
from clearway.world.tracks import pose_at, tracks

OPEN = ((0.0, -3.0, 0.0), (0.5, 0.0, 1.0), (3.0, 2.0, 1.0), (4.0, 5.0, 4.0))
CLOSED = (*OPEN, (6.0, -3.0, 0.0))


def spline(keyframes: Any, offset: float = 0.0) -> SplineSpec:
    return SplineSpec(kind="spline", keyframes=keyframes, offset=offset)


def gazebo(keyframes: tuple[tuple[float, float, float], ...], time: float) -> tuple[float, float]:
    """Where Gazebo has the model `time` s after the animation began: scalars, and de Casteljau's construction."""
    t = math.fmod(time, keyframes[-1][0])
    second = next(k for k in range(len(keyframes)) if keyframes[k][0] >= t)  # std::lower_bound
    if keyframes[second][0] == t:
        return keyframes[second][1:]
    first = second - 1
    share = (t - keyframes[first][0]) / (keyframes[second][0] - keyframes[first][0])
    points = [complex(x, y) for _, x, y in keyframes]
    row = [
        points[first],
        points[first] + _tangent(points, first) / 3,
        points[second] - _tangent(points, second) / 3,
        points[second],
    ]
    while len(row) > 1:
        row = [(1 - share) * a + share * b for a, b in itertools.pairwise(row)]
    return row[0].real, row[0].imag


def _tangent(points: list[complex], k: int) -> complex:
    """Catmull-Rom without tension; of the ends with one neighbour, unless the way is closed."""
    last = len(points) - 1
    if points[0] == points[last] and k in (0, last):
        return (points[1] - points[last - 1]) / 2
    return (points[min(k + 1, last)] - points[max(k - 1, 0)]) / 2


@pytest.mark.parametrize("keyframes", [OPEN, CLOSED])
@given(time=st.floats(0.0, 40.0), offset=st.floats(0.0, 40.0))
@settings(max_examples=60, deadline=None)
def test_where_gazebo_has_it(keyframes: Any, time: float, offset: float) -> None:
    now = math.fmod(time + offset, keyframes[-1][0])
    if min(now, keyframes[-1][0] - now) > 1e-6:  # the instant of a jump is a matter of rounding
        assert position(spline(keyframes, offset), time) == pytest.approx(gazebo(keyframes, time + offset), abs=1e-8)


def test_dynabarn_s_cylinders_are_where_gazebo_has_them() -> None:
    for number in (300, 329, 359):
        for obstacle in worlds()[number].cylinders[:6]:
            assert isinstance(obstacle.motion, SplineSpec)
            for time in np.random.default_rng(number).uniform(0.0, 200.0, 40):
                expected = gazebo(obstacle.motion.keyframes, float(time))
                assert position(obstacle.motion, float(time)) == pytest.approx(expected, abs=1e-8)


def test_it_is_evenly_spaced_in_the_spline_s_parameter_not_in_time() -> None:
    """By hand: halfway between two key frames, (p + q) / 2 + (m - n) / 8, and its velocity jumps at a key frame."""
    motion = spline(OPEN)
    halfway = np.array([(0.0 + 2.0) / 2 + (2.5 - 2.5) / 8, (1.0 + 1.0) / 2 + (0.5 - 1.5) / 8])
    assert position(motion, 1.75) == pytest.approx(halfway)
    before = (position(motion, 0.5) - position(motion, 0.5 - 1e-6)) / 1e-6
    after = (position(motion, 0.5 + 1e-6) - position(motion, 0.5)) / 1e-6
    assert before == pytest.approx([2.5 / 0.5, 0.5 / 0.5], rel=1e-4)
    assert after == pytest.approx([2.5 / 2.5, 0.5 / 2.5], rel=1e-4)


@pytest.mark.parametrize("keyframes", [OPEN, CLOSED])
@pytest.mark.parametrize("offset", [0.0, 1.3, 4.0, 6.0, 100.0])
def test_lines_between_the_knots_keep_to_it(keyframes: Any, offset: float) -> None:
    motion = spline(keyframes, offset)
    way = knots(motion, 21.0)
    assert way[0, 0] <= 0.0
    assert way[-1, 0] >= 21.0
    assert (np.diff(way[:, 0]) >= 0.0).all()
    jumps = np.flatnonzero(np.isnan(way[:, 1]))
    assert len(jumps) == (0 if keyframes is CLOSED else math.floor((21.0 + offset % 4.0 + AWAY) / 4.0))
    for t in np.random.default_rng(1).uniform(0.0, 21.0, 300):
        k = int(np.searchsorted(way[:, 0], t, side="right")) - 1
        if math.isnan(way[k, 1]):
            assert keyframes is OPEN
            assert math.fmod(t + offset, 4.0) > 4.0 - AWAY
            continue
        share = (t - way[k, 0]) / (way[k + 1, 0] - way[k, 0])
        line = way[k, 1:] + share * (way[k + 1, 1:] - way[k, 1:])
        assert math.dist(line, position(motion, t)) < CHORD + 1e-9


def test_in_the_world_it_is_gone_for_an_instant_before_it_begins_anew_elsewhere() -> None:
    motion = spline(OPEN, 1.0)
    cylinder = ObstacleSpec(name="c", shape=DiscSpec(kind="disc", radius=0.5), motion=motion)
    laid = tracks([cylinder], ["course"], 30.0)
    begin, end = laid.rows[0, 0]

    def at(t: float) -> FloatArray:
        here = np.empty(3)
        pose_at(laid.knots, begin, end, t, here)
        return here

    gone = np.array([math.isnan(at(float(t))[0]) for t in np.arange(0.0, 30.0, 0.01)])
    assert gone.sum() == pytest.approx(7 * AWAY / 0.01, abs=7)
    assert np.isnan(at(3.0 - 1e-6)).all()
    assert at(3.0 - AWAY - 1e-6)[:2] == pytest.approx(position(motion, 3.0 - AWAY), abs=1e-4)
    assert at(3.0)[:2] == pytest.approx([-3.0, 0.0], abs=1e-6)
    assert laid.speed[0] == math.inf


@pytest.mark.parametrize(
    ("keyframes", "says"),
    [
        (((1.0, 0.0, 0.0), (2.0, 1.0, 0.0)), "first key frame is at 1 s"),
        (((0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, 2.0, 0.0)), "at 1 s after one at 1 s"),
        (((0.0, 0.0, 0.0), (1.0, 101.0, 0.0)), "101 m/s after 0 s; at most 100 m/s"),
        (((0.0, 0.0, 0.0),), "at least 2"),
        (((0.0, 0.0, 0.0), (0.5, 1.0, 0.0)), "a round of 0.5 s; it takes at least 1 s"),
    ],
)
def test_what_is_no_way_is_refused(keyframes: Any, says: str) -> None:
    with pytest.raises(ValidationError, match=says):
        spline(keyframes)
