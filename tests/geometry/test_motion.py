from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arcs import step_arc
from clearway.geometry.angles import turn_between, wrap
from clearway.geometry.motion import arc, ramp

angles = st.floats(-100.0, 100.0)
poses = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3)).map(np.array)


@given(angles)
def test_wrap_keeps_the_direction(a: float) -> None:
    w = wrap(a)
    assert -math.pi < w <= math.pi
    assert math.cos(w) == pytest.approx(math.cos(a), abs=1e-12)
    assert math.sin(w) == pytest.approx(math.sin(a), abs=1e-12)


def test_wrap_at_its_ends() -> None:
    assert wrap(math.pi) == math.pi
    assert wrap(-math.pi) == math.pi
    assert wrap(math.nextafter(math.pi, 4)) == pytest.approx(-math.pi)
    assert wrap(3 * math.pi) == pytest.approx(math.pi)
    assert turn_between(3.0, -3.0) == pytest.approx(2 * math.pi - 6.0)


@given(poses, st.floats(-2, 2), st.floats(-3, 3), st.floats(0.001, 1.0))
def test_an_arc_is_what_fine_euler_steps_tend_to(pose: np.ndarray, v: float, omega: float, dt: float) -> None:
    n = 4000
    h = dt / n
    theta = pose[2] + omega * h * (np.arange(n) + 0.5)  # midpoint rule: error of order h^2
    end = step_arc(pose, v, omega, dt)
    assert end[0] == pytest.approx(pose[0] + v * h * np.cos(theta).sum(), abs=1e-6)
    assert end[1] == pytest.approx(pose[1] + v * h * np.sin(theta).sum(), abs=1e-6)
    assert wrap(end[2] - pose[2] - omega * dt) == pytest.approx(0.0, abs=1e-9)


@given(poses, st.floats(-2, 2), st.floats(-3, 3), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_two_steps_make_one(pose: np.ndarray, v: float, omega: float, a: float, b: float) -> None:
    assert step_arc(step_arc(pose, v, omega, a), v, omega, b)[:2] == pytest.approx(
        step_arc(pose, v, omega, a + b)[:2], abs=1e-9
    )


def test_a_quarter_circle_by_hand() -> None:
    assert arc(0.0, 0.0, 0.0, math.pi / 2, math.pi / 2, 1.0) == pytest.approx((1.0, 1.0, math.pi / 2))


def test_ramp_by_hand() -> None:
    assert ramp(0.0, 1.0, 0.5, 2.0, 0.1) == pytest.approx((0.05, 0.025))
    assert ramp(1.0, 0.0, 0.5, 2.0, 0.1) == pytest.approx((0.8, 0.9))
    assert ramp(-1.0, 0.0, 0.5, 2.0, 0.1) == pytest.approx((-0.8, -0.9))
    assert ramp(0.1, 0.0, 0.5, 2.0, 0.1) == pytest.approx((0.0, 0.025))  # 0.05 s to stop
    assert ramp(0.1, -1.0, 0.5, 2.0, 0.1) == pytest.approx((-0.025, (0.1 - 0.025) / 4))  # and 0.05 s backwards
    assert ramp(0.3, 0.3, 0.5, 2.0, 0.1) == (0.3, 0.3)
    for target in (0.3, 1.0):  # in no time nothing changes
        assert ramp(0.3, target, 0.5, 2.0, 0.0) == ramp(0.3, target, math.inf, math.inf, 0.0) == (0.3, 0.3)


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(0.1, 3), st.floats(0.1, 3), st.floats(0.001, 0.5))
def test_ramp_never_overshoots_nor_exceeds_the_limits(
    now: float, target: float, up: float, down: float, dt: float
) -> None:
    then, mean = ramp(now, target, up, down, dt)
    assert min(now, target) - 1e-12 <= min(then, mean) <= max(then, mean) <= max(now, target) + 1e-12
    assert abs(then - now) <= max(up, down) * dt + 1e-12


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(0.1, 3), st.floats(0.1, 3))
def test_ramp_in_two_parts_goes_as_far_as_in_one(now: float, target: float, up: float, down: float) -> None:
    half, first = ramp(now, target, up, down, 0.2)
    end, second = ramp(half, target, up, down, 0.3)
    whole, mean = ramp(now, target, up, down, 0.5)
    assert end == pytest.approx(whole, abs=1e-12)
    assert 0.2 * first + 0.3 * second == pytest.approx(0.5 * mean, abs=1e-12)
