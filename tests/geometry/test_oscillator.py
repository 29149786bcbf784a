"""Paper B's oscillating obstacles against the closed form of an undamped oscillator."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.geometry.oscillator import amplitude, oscillate, trajectory

places, speeds, stiffnesses = st.floats(1.5, 12.5), st.floats(-0.5, 0.5), st.floats(0.015, 0.5)


def closed_form(
    x: float, v: float, attraction: float, stiffness: float, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    w = math.sqrt(stiffness)
    c, s = np.cos(w * t), np.sin(w * t)
    return attraction + (x - attraction) * c + v / w * s, v * c - (x - attraction) * w * s


def test_one_step_by_hand() -> None:
    """x = 1, v = 0, attraction 0, stiffness 1, step 1: the rule's polynomial for cos and -sin is Taylor's to order 4."""
    x, v = oscillate(1.0, 0.0, 0.0, 1.0, 1.0)
    assert x == pytest.approx(1 - 1 / 2 + 1 / 24)
    assert v == pytest.approx(-1 + 1 / 6)


@pytest.mark.parametrize(
    ("dt", "within"), [(0.15, 1.2e-3), (0.015, 1e-6)]
)  # the paper's sampling time, and the world's
@given(x=places, v=speeds, attraction=places, stiffness=stiffnesses)
def test_the_motion_is_the_closed_form_for_two_minutes(
    dt: float, within: float, x: float, v: float, attraction: float, stiffness: float
) -> None:
    count = round(120.0 / dt)
    start, velocity = np.array([x, attraction]), np.array([v, 0.0])
    states = trajectory(start, velocity, np.full(2, attraction), np.full(2, stiffness), dt, count)
    exact_x, exact_v = closed_form(x, v, attraction, stiffness, dt * np.arange(count + 1))
    assert np.abs(states[:, 0] - exact_x).max() < within
    assert np.abs(states[:, 2] - exact_v).max() < within
    assert np.abs(states[:, 1] - attraction).max() == 0.0  # at rest on its attraction it stays there
    reach = amplitude(x, v, attraction, stiffness)
    assert np.abs(states[:, 0] - attraction).max() <= reach + 1e-9
    assert np.abs(states[:, 2]).max() <= math.sqrt(stiffness) * reach + 1e-9


@given(places, speeds, places, stiffnesses)
def test_energy_is_kept_and_the_period_is_the_pendulum_s(
    x: float, v: float, attraction: float, stiffness: float
) -> None:
    period = math.tau / math.sqrt(stiffness)
    count = 2000
    each = (np.full(2, value) for value in (x, v, attraction, stiffness))
    states = trajectory(*each, period / count, count)
    energy = states[:, 2] ** 2 + stiffness * (states[:, 0] - attraction) ** 2
    assert np.abs(energy - energy[0]).max() <= 1e-9
    assert states[-1] == pytest.approx(states[0], abs=1e-8)


def test_it_is_of_fourth_order() -> None:
    def error(count: int) -> float:
        one = np.ones(2)
        states = trajectory(one, 0.3 * one, 0.0 * one, 0.7 * one, 12.0 / count, count)
        return math.dist(states[-1, ::2], closed_form(1.0, 0.3, 0.0, 0.7, np.array(12.0)))

    assert error(200) / error(400) == pytest.approx(16.0, rel=0.05)
