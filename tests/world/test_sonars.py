"""Sonars: each tells the distance to the nearest in its cone, as often as they measure, and none of where in it that is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from worlds import Pilot, body, make_robot, make_scenario, run

from clearway.contract import Command, Sensing
from clearway.geometry.shapes import Circle, FloatArray
from clearway.robots import Robot, load_robot
from clearway.robots.ideal import ideal
from clearway.trials import Body
from clearway.world.legs import APART, RADIUS

MOUNTS = [[-0.183, 0.183, 2.356], [-0.259, 0.0, math.pi], [-0.183, -0.183, -2.356]]
SONARS: dict[str, Any] = {
    "mounts": MOUNTS, "field": 0.5, "range_min": 0.02, "range_max": 1.0, "sigma": 0.0, "period": 0.1,
}  # fmt: skip
STAND = [{"name": "forth", "goal": (99.0, 0.0, 0.0), "time_limit": 1.0}]


def sensed(
    bodies: list[Body], robot: Robot, start: tuple[float, float, float] = (0.0, 0.0, 0.0), **more: Any
) -> list[Sensing]:
    pilot = Pilot(lambda _: Command(0.0, 0.0))
    run(pilot, bodies, make_scenario(start=start, legs=STAND), robot, **more)
    return pilot.seen


def measured(bodies: list[Body], robot: Robot, **more: Any) -> FloatArray:
    """(periods, sonars) m."""
    return np.array([s.sonars.ranges for s in sensed(bodies, robot, **more) if s.sonars is not None])


def nearest(circles: FloatArray, mount: list[float], pose: tuple[float, float, float]) -> float:
    """Of (n, 3) circles in the cone of the sonar at `mount`, by many rays and the formula for where a line meets a circle, m."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    eye = np.array((pose[0] + c * mount[0] - s * mount[1], pose[1] + s * mount[0] + c * mount[1]))
    angle = pose[2] + mount[2] + np.linspace(-0.25, 0.25, 4001)
    ray = np.column_stack((np.cos(angle), np.sin(angle)))
    to = circles[:, :2] - eye
    along = ray @ to.T
    inside = circles[:, 2] ** 2 - ((to**2).sum(axis=1) - along**2)
    with np.errstate(invalid="ignore"):
        far = along - np.sqrt(inside)
    return float(np.where((inside >= 0.0) & (far > 0.0), far, np.inf).min(initial=math.inf))


@settings(max_examples=60, deadline=None)
@given(
    circles=st.lists(st.tuples(st.floats(0.5, 1.6), st.floats(-math.pi, math.pi), st.floats(0.06, 0.2)), min_size=1, max_size=5),
    heading=st.floats(-math.pi, math.pi),
)  # fmt: skip
def test_a_range_is_the_distance_to_the_nearest_in_the_cone(
    circles: list[tuple[float, float, float]], heading: float
) -> None:
    start = (0.3, -0.2, heading)
    placed = np.array([(0.3 + d * math.cos(a), -0.2 + d * math.sin(a), r) for d, a, r in circles])
    bodies = [body(Circle(r), x, y, name=f"post {i}") for i, (x, y, r) in enumerate(placed.tolist())]
    told = measured(bodies, make_robot(sonars=SONARS), start=start)[0]
    for mount, distance in zip(MOUNTS, told.tolist(), strict=True):
        least = nearest(placed, mount, start)
        if least > 1.0:
            assert distance == math.inf
        elif least > 0.02 and (distance < math.inf or least < 0.98):
            assert least - 1e-9 <= distance <= least + 0.02


def test_what_is_beyond_or_beside_the_cone_echoes_not() -> None:
    behind = [
        body(Circle(0.1), -1.5, 0.0),
        body(Circle(0.1), -0.6, 0.6, name="beside"),
        body(Circle(0.1), 0.9, 0.0, name="ahead"),
    ]
    told = measured(behind, make_robot(sonars=SONARS))[0]
    assert told[1] == math.inf
    assert told[2] == math.inf
    assert told[0] < 1.0  # the one beside is the left one's


def test_they_measure_once_in_their_period_with_their_noise_and_the_same_bits() -> None:
    post = [body(Circle(0.1), -0.9, 0.0)]
    robot = make_robot(sonars=SONARS | {"period": 0.2, "sigma": 0.02})
    told = [s.sonars for s in sensed(post, robot)]
    assert [t is not None for t in told] == [k % 2 == 0 for k in range(len(told))]
    often = measured(post, make_robot(sonars=SONARS | {"sigma": 0.02}))[:, 1]
    again = measured(post, make_robot(sonars=SONARS | {"sigma": 0.02}))[:, 1]
    assert (often == again).all()
    assert 0.005 < often.std() < 0.04
    assert measured(post, ideal(make_robot(sonars=SONARS | {"sigma": 0.02}), ["noise"]))[:, 1].std() < 1e-12


def test_low_ones_meet_the_legs_of_a_person() -> None:
    anna = Body("anna", "person", Circle(0.25), None)
    gap = 0.9 - 0.259
    side, behind = math.hypot(gap, 0.5 * APART) - RADIUS, gap - 0.5 * APART - RADIUS
    for turned, expected in (
        (0.0, side),
        (0.5 * math.pi, behind),
    ):  # legs side by side as the sonar sees them, one behind the other
        stands = [np.array([[0.0, -0.9, 0.0, turned], [9.0, -0.9, 0.0, turned]])]
        legs = measured([anna], make_robot(sonars=SONARS | {"height": 0.27}), knots=stands)[:, 1]
        whole = measured([anna], make_robot(sonars=SONARS), knots=stands)[:, 1]
        assert whole == pytest.approx(gap - 0.25, abs=0.01)
        assert legs == pytest.approx(expected, abs=0.02)


def test_the_rest_of_what_is_sensed_is_the_same_bits_without_them() -> None:
    post = [body(Circle(0.1), -0.9, 0.0)]
    noisy = {
        "lidar": {"beams": 91, "angle_min": -1.5, "angle_max": 1.5, "range_min": 0.05, "range_max": 10.0, "sigma": 0.02}
    }
    with_, without = sensed(post, make_robot(sonars=SONARS, **noisy)), sensed(post, make_robot(**noisy))
    assert all((a.scan.ranges == b.scan.ranges).all() for a, b in zip(with_, without, strict=True) if a.scan and b.scan)
    assert without[0].sonars is None


def test_tiago_has_them_as_a_preset() -> None:
    robot = load_robot("tiago:sonars")
    assert robot.sonars is not None
    assert len(robot.sonars.mounts) == 3
    assert robot.source("presets.sonars") is not None
    assert load_robot("tiago").sonars is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"range_min": 1.0}, "range_min 1 must lie below range_max 1"),
        ({"mounts": []}, "at least 1"),
        ({"field": 0.0}, "greater than 0"),
        ({"period": 0.0}, "greater than 0"),
        ({"sigma": -0.1}, "greater than or equal to 0"),
    ],
)
def test_a_wrong_one_is_told(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        make_robot(sonars=SONARS | changes)
