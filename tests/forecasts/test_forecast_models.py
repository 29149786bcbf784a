"""The filters against batch solutions and integrated motions that know nothing of filters."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import multivariate_normal

from clearway.forecasts import models as m
from clearway.forecasts import oscillations
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray

P = ForecastParameters()
TIMES = np.array([0.0, 0.15, 0.3, 0.6, 0.65, 1.1])  # one was missed, one came early
Z = np.array([[0.0, 1.0], [0.1, 1.02], [0.22, 1.05], [0.4, 1.3], [0.47, 1.28], [0.9, 1.4]])
R = 0.02**2


def square(s: FloatArray) -> FloatArray:
    return np.array([[s[0], s[1], s[2]], [s[1], s[3], s[4]], [s[2], s[4], s[5]]])


@pytest.mark.parametrize("model", [m.STOPPED, m.STEADY, m.FREE, m.BRAKING, m.MANOEUVRE])
def test_a_filter_is_the_batch_solution_and_its_likelihoods_are_exact(model: int) -> None:
    bank = m.models(P, 0.1, 10)
    mean, cov = np.zeros((2, 5, 3)), np.zeros((5, 6))
    turn, turn_cov = np.zeros((6, 4)), np.zeros((6, 4))
    m.begin(P.manoeuvre, 0.0, 0.0, 0.0, 0.0, 1.0, P.usual_speed**2, mean, cov, turn, turn_cov)
    prior = square(cov[model])
    move, spread = np.zeros((5, 3, 3)), np.zeros((5, 6))
    fit, error = np.zeros(5), np.zeros(5)
    joint, crossed = (
        [prior],
        [np.eye(3)],
    )  # covariance of the state at each instant, and its transition from the one before
    for i, t in enumerate(TIMES):
        if i:
            m.transitions(bank.noise, bank.manoeuvre, t - TIMES[i - 1], move, spread)
            m.predict(move, spread, mean, cov)
            joint.append(move[model] @ joint[-1] @ move[model].T + square(spread[model]))
            crossed.append(move[model].copy())
        m.correct(0, *Z[i], R, mean, cov, fit, error)
    score = fit[model]
    n = len(TIMES)
    big = np.zeros((3 * n, 3 * n))
    for i in range(n):
        block = joint[i]
        for j in range(i, n):
            block = block if j == i else crossed[j] @ block
            big[3 * j : 3 * j + 3, 3 * i : 3 * i + 3] = block
            big[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = block.T
    s = big[::3, ::3] + R * np.eye(n)
    gain = np.linalg.solve(s, big[::3, -3:]).T
    for axis in range(2):
        np.testing.assert_allclose(mean[axis, model], gain @ Z[:, axis], atol=1e-9)
    np.testing.assert_allclose(square(cov[model]), big[-3:, -3:] - gain @ big[::3, -3:], atol=1e-9)
    exact = sum(multivariate_normal.logpdf(Z[:, axis], cov=s) for axis in range(2))
    assert score - n * math.log(2.0 * math.pi) == pytest.approx(exact, abs=1e-8)


def test_a_turning_filter_is_the_batch_solution() -> None:
    w = 0.7
    turn, turn_cov, fit, error = np.zeros((1, 4)), np.zeros((1, 4)), np.zeros(1), np.zeros(1)
    turn_cov[0, :2] = 1.0, P.usual_speed**2
    for i, t in enumerate(TIMES):
        if i:
            m.predict_turns(np.array([w]), 0.0, t - TIMES[i - 1], turn, turn_cov)
        m.correct_turns(0, *Z[i], R, turn, turn_cov, fit, error)
    t = TIMES - TIMES[-1]  # least squares over the state now
    g = (np.exp(1j * w * t) - 1.0) / (1j * w)
    rows = np.column_stack([np.ones(len(t)), g])
    back = np.array([[1.0, (np.exp(-1j * w * TIMES[-1]) - 1.0) / (1j * w)], [0.0, np.exp(-1j * w * TIMES[-1])]])
    information = rows.conj().T @ rows / R + back.conj().T @ np.diag([1.0, 1.0 / P.usual_speed**2]) @ back
    state = np.linalg.solve(information, rows.conj().T @ (Z @ [1.0, 1.0j]) / R)
    np.testing.assert_allclose(turn[0] @ np.array([[1, 0], [1j, 0], [0, 1], [0, 1j]]), state, atol=1e-9)
    spread = np.linalg.inv(information)
    np.testing.assert_allclose(turn_cov[0], [spread[0, 0].real, spread[1, 1].real, spread[0, 1].real, spread[0, 1].imag], atol=1e-9)  # fmt: skip


@pytest.mark.parametrize("k", [0.003, 0.08, 0.6])
def test_an_oscillation_goes_on_as_integrated(k: float) -> None:
    state = np.array([[0.4, -0.9, 0.3, k]])
    point = 0.4 + 0.3 / k

    def move(start: FloatArray, t: float) -> FloatArray:
        def slope(_: float, s: FloatArray) -> list[float]:
            return [s[1], s[2], -s[3] * s[1], 0.0]

        return np.asarray(solve_ivp(slope, (0.0, t), start, rtol=1e-11, atol=1e-12).y[:, -1])

    def pulled(_: float, s: FloatArray) -> list[float]:  # the motion as it is usually written
        return [s[1], k * (point - s[0])]

    other = solve_ivp(pulled, (0.0, 1.3), [0.4, -0.9], rtol=1e-11, atol=1e-12).y[:, -1]
    start, t = state[0].copy(), 1.3
    full = np.diag([0.01, 0.2, 0.3, (0.3 * k) ** 2]) + 0.001
    full[3, :3] = full[:3, 3] = 1e-3 * k
    packed = full[np.triu_indices(4)][None].copy()
    oscillations.predict(t, 0.0, state, packed)
    np.testing.assert_allclose(state[0, :2], other, atol=1e-8)
    np.testing.assert_allclose(state[0], move(start, t), atol=1e-8)
    steps = np.diag([1e-4, 1e-4, 1e-4, 1e-3 * k])
    jacobian = np.column_stack([(move(start + h, t) - move(start - h, t)) / (2.0 * h.sum()) for h in steps])
    np.testing.assert_allclose(packed[0], (jacobian @ full @ jacobian.T)[np.triu_indices(4)], rtol=1e-4, atol=1e-7)

    path, var = np.zeros(14), np.zeros(14)
    begun = full[np.triu_indices(4)].copy()
    oscillations.forecast(0.1, 0.0, 1.0, 0.0, start, begun, path, var)
    assert path[13] == pytest.approx(state[0, 0], abs=1e-9)
    assert 2.0 * var[13] - path[13] ** 2 == pytest.approx(packed[0, 0], abs=1e-9)


def test_with_its_stiffness_known_an_oscillation_is_the_batch_solution() -> None:
    k, w = 0.2, math.sqrt(0.2)
    state, cov = np.zeros((1, 4)), np.zeros((1, 10))
    oscillations.begin(np.array([k]), 0.0, np.array([3.0]), 0.0, 0.0, 1.0, 4.0, state, cov)
    fit, error = np.zeros(1), np.zeros(1)
    for i, t in enumerate(TIMES):
        if i:
            oscillations.predict(t - TIMES[i - 1], 0.0, state, cov)
        oscillations.correct(0, Z[i, 0], R, state, cov, fit, error)
    first = np.column_stack([np.ones(6), np.sin(w * TIMES) / w, (1.0 - np.cos(w * TIMES)) / k])
    prior = np.diag([1.0, 1.0 / 4.0, 1.0 / (3.0 * k) ** 2])
    at_first = np.linalg.solve(first.T @ first / R + prior, first.T @ Z[:, 0] / R)
    assert state[0, 0] == pytest.approx(first[-1] @ at_first, abs=1e-9)
    assert state[0, 3] == k


def test_the_stiffness_is_found() -> None:
    k, w = 0.31, math.sqrt(0.31)
    bank = m.models(P, 0.1, 1).stiffness
    state, cov = np.zeros((len(bank), 4)), np.zeros((len(bank), 10))
    spread = 0.5 * math.log(bank[1] / bank[0])
    oscillations.begin(bank, spread, np.full(len(bank), 3.0), 1.5, 0.0, 1e-4, 2.0, state, cov)
    fit, error = np.zeros(len(bank)), np.zeros(len(bank))
    for i in range(1, 40):
        oscillations.predict(0.15, 1e-7, state, cov)
        oscillations.correct(0, 1.5 * math.cos(w * 0.15 * i), 2.5e-5, state, cov, fit, error)
    assert state[fit.argmax(), 3] == pytest.approx(k, rel=0.01)


def test_the_forecast_of_a_linear_model_is_its_prediction() -> None:
    bank = m.models(P, 0.25, 4)
    move, spread = np.zeros((5, 3, 3)), np.zeros((5, 6))
    m.transitions(bank.noise, bank.manoeuvre, 1.0, move, spread)
    np.testing.assert_allclose(bank.row[:, 4], move[:, 0], atol=1e-12)
    for model in (m.STOPPED, m.STEADY, m.FREE):
        assert bank.grown[model, 4] == pytest.approx(spread[model, 0])
    assert (np.diff(bank.grown, axis=1) > 0.0).all()


def test_a_measured_velocity_is_taken_in_as_the_formula_says() -> None:
    mean, cov, turn, turn_cov = np.zeros((2, 5, 3)), np.zeros((5, 6)), np.zeros((1, 4)), np.zeros((1, 4))
    m.begin(P.manoeuvre, 0.0, 0.0, 0.5, 0.1, 0.01, 2.0, mean, cov, turn, turn_cov)
    bank, move, spread = m.models(P, 0.1, 1), np.zeros((5, 3, 3)), np.zeros((5, 6))
    m.transitions(bank.noise, bank.manoeuvre, 0.3, move, spread)
    m.predict(move, spread, mean, cov)
    m.predict_turns(np.array([0.7]), 0.01, 0.3, turn, turn_cov)
    model = m.MANOEUVRE
    p, x, seen, r = square(cov[model]), mean[:, model].copy(), (0.8, -0.2), 0.04
    gain = p[:, 1] / (p[1, 1] + r)
    z, v = turn[0, 0] + 1j * turn[0, 1], turn[0, 2] + 1j * turn[0, 3]
    q = np.array([[turn_cov[0, 0], turn_cov[0, 2] + 1j * turn_cov[0, 3]], [turn_cov[0, 2] - 1j * turn_cov[0, 3], turn_cov[0, 1]]])  # fmt: skip
    m.correct(1, *seen, r, mean, cov, np.zeros(5), np.zeros(5))
    m.correct_turns(1, *seen, r, turn, turn_cov, np.zeros(1), np.zeros(1))
    np.testing.assert_allclose(mean[:, model], x + np.outer(np.array(seen) - x[:, 1], gain), atol=1e-12)
    np.testing.assert_allclose(square(cov[model]), p - np.outer(gain, p[1]), atol=1e-12)
    g = q[:, 1] / (q[1, 1].real + r)
    new = np.array([z, v]) + g * (seen[0] + 1j * seen[1] - v)
    left = q - np.outer(g, q[1])
    np.testing.assert_allclose(turn[0], [new[0].real, new[0].imag, new[1].real, new[1].imag], atol=1e-12)
    np.testing.assert_allclose(turn_cov[0], [left[0, 0].real, left[1, 1].real, left[0, 1].real, left[0, 1].imag], atol=1e-12)  # fmt: skip

    state, other = np.array([[0.1, 0.4, 0.3, 0.2]]), np.diag([0.01, 0.5, 0.2, 0.01]) + 0.002
    packed, column = other[np.triu_indices(4)][None].copy(), other[:, 1] / (other[1, 1] + r)
    expected = state[0] + column * (0.9 - 0.4)
    oscillations.correct(1, 0.9, r, state, packed, np.zeros(1), np.zeros(1))
    np.testing.assert_allclose(state[0], expected, atol=1e-12)
    np.testing.assert_allclose(packed[0], (other - np.outer(column, other[1]))[np.triu_indices(4)], atol=1e-12)
