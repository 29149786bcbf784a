"""The ancillary gain against numpy's eigenvalues and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arcs import step_arc
from clearway.navigators.common.tracking.ancillary import gain, linearise, spectral_radius, stability

C = 0.15
POLES = np.array((0.3, 0.4, 0.2))

headings = st.floats(-3.1, 3.1)
speeds = st.floats(0.05, 1.0)
turns = st.floats(-1.5, 1.5)


def literal_step(pose, v, omega, dt):
    """Eq. 1 as printed."""
    x, y, theta = pose
    return np.array(
        (
            x + dt * (v * np.cos(theta) - dt * omega * v * np.sin(theta)),
            y + dt * (v * np.sin(theta) + dt * omega * v * np.cos(theta)),
            theta + dt * omega,
        )
    )


@given(headings, speeds, turns, st.booleans())
def test_linearisation_is_the_derivative_of_the_model(theta, v, omega, literal):
    step = literal_step if literal else step_arc
    a, b = linearise(theta, v, omega, C, literal)
    h = 1e-6
    at = np.array((0.3, -0.2, theta))
    for i in range(3):
        d = np.eye(3)[i] * h
        assert a[:, i] == pytest.approx((step(at + d, v, omega, C) - step(at - d, v, omega, C)) / (2 * h), abs=1e-7)
    assert b[:, 0] == pytest.approx((step(at, v + h, omega, C) - step(at, v - h, omega, C)) / (2 * h), abs=1e-7)
    assert b[:, 1] == pytest.approx((step(at, v, omega + h, C) - step(at, v, omega - h, C)) / (2 * h), abs=1e-7)


@given(headings, st.floats(0.3, 1.0) | st.floats(-1.0, -0.3), turns, st.booleans())
def test_poles_are_where_they_were_asked_for(theta, v, omega, literal):
    a, b = linearise(theta, v, omega, C, literal)
    found = np.sort(np.linalg.eigvals(a + b @ gain(theta, v, omega, C, literal, POLES, 1e6)).real)
    assert found == pytest.approx(np.sort(POLES), abs=1e-7)


@given(headings, speeds, turns, st.booleans())
def test_the_error_dies_out_at_any_speed_above_zero(theta, v, omega, literal):
    k = gain(theta, v, omega, C, literal, POLES, 20.0)
    assert stability(theta, v, omega, C, literal, k) < 1.0
    assert np.abs(k[1, :2]).max() <= 20.0 + 1e-9


def test_at_rest_the_error_to_the_left_stays_and_the_check_says_so():
    k = gain(0.4, 0.0, 0.0, C, False, POLES, 20.0)
    assert np.isfinite(k).all()
    assert stability(0.4, 0.0, 0.0, C, False, k) == pytest.approx(1.0, abs=1e-9)


def test_without_a_gain_nothing_dies_out():
    assert stability(0.0, 0.5, 0.3, C, False, np.zeros((2, 3))) == pytest.approx(1.0, abs=1e-4)


@given(st.lists(st.floats(-2, 2), min_size=9, max_size=9))
def test_spectral_radius_agrees_with_numpy(entries):
    m = np.array(entries).reshape(3, 3)
    assert spectral_radius(m) == pytest.approx(np.abs(np.linalg.eigvals(m)).max(), abs=2e-4)


def test_an_error_to_the_left_turns_right_and_one_ahead_slows_down():
    k = gain(0.0, 0.5, 0.0, C, False, POLES, 20.0)
    assert k[1, 1] < 0 < abs(k[1, 1])
    assert k[0, 0] < 0
