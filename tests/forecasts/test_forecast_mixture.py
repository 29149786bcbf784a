"""What the mixture says is near the truth, and as uncertain as it says."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.stats import ncx2

from clearway.forecasts.forecast import Forecast
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.models import models
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray
from perceived import obstacles

T, ERROR, N = 0.15, 0.01, 400
LOOKS = [5, 10, 20, 30]


def oscillators() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(N, 2) points, stiffnesses, places and velocities at first: of no generator's, but kept within the bounds."""
    rng = np.random.default_rng(11)
    k, v = np.exp(rng.normal(math.log(0.12), 0.7, (N, 2))), rng.normal(0.0, 0.8, (N, 2))
    off = np.clip(rng.normal(0.0, 2.5, (N, 2)), -1.2 / k, 1.2 / k)
    return off, k, np.zeros((N, 2)), v


def place(t: float) -> FloatArray:
    """(N, 2) m."""
    off, k, x, v = oscillators()
    w = np.sqrt(k)
    return np.asarray(off + (x - off) * np.cos(w * t) + v / w * np.sin(w * t))


@cache
def run(periods: int, only: bool) -> Forecast:
    """After so many periods."""
    rng = np.random.default_rng(1)
    it = Forecaster(ForecastParameters(constant_velocity_only=only, acceleration=4.0), T, 0.1, 30)
    for i in range(periods + 1):
        r, angle = ERROR * np.sqrt(rng.random(N)), rng.uniform(0.0, 2.0 * math.pi, N)
        f, told = it.update(T * i, obstacles(place(T * i) + np.column_stack([r * np.cos(angle), r * np.sin(angle)])))
        assert told == ()
    return f


def truth(periods: int) -> FloatArray:
    """(N, 31, 2)."""
    return np.stack([place(T * periods + 0.1 * j) for j in range(31)], axis=1)


def errors(f: Forecast, true: FloatArray) -> FloatArray:
    """(N, 31) of the weighted mean path, m."""
    return np.asarray(np.hypot(*np.moveaxis(np.einsum("nh,nhkc->nkc", f.weight, f.path) - true, 2, 0)))


def probability(f: Forecast, true: FloatArray) -> FloatArray:
    """(N, 31) the mixture's probability of a place nearer to its mean than the truth."""
    mean = np.einsum("nh,nhkc->nkc", f.weight, f.path)
    d2, total = ((true - mean) ** 2).sum(axis=-1), 0.0
    for h in range(f.weight.shape[1]):
        s2, off = f.sigma[:, h] ** 2, ((f.path[:, h] - mean) ** 2).sum(axis=-1)
        total = total + f.weight[:, h, None] * ncx2.cdf(d2 / s2, 2, off / s2)
    return np.asarray(total)


@pytest.mark.parametrize("periods", [2, 4, 7, 13, 27])
def test_probabilities_are_calibrated(periods: int) -> None:
    u = probability(run(periods, False), truth(periods))[:, LOOKS]
    for level, narrow, wide in ((0.5, 0.1, 0.4), (0.9, 0.06, 0.1), (0.99, 0.03, 0.01)):
        within = (u <= level).mean(axis=0)
        assert (within >= level - narrow).all(), (level, within)
        assert (within <= level + wide).all(), (level, within)


@pytest.mark.parametrize(("periods", "share"), [(4, 0.75), (7, 0.6), (13, 0.6), (27, 0.25)])
def test_an_oscillation_is_learnt(periods: int, share: float) -> None:
    true = truth(periods)
    mixture, straight = (
        np.sqrt((errors(run(periods, only), true)[:, LOOKS] ** 2).mean(axis=0)) for only in (False, True)
    )
    assert (mixture <= share * straight).all(), mixture / straight


def path_of(places: FloatArray, **changes: object) -> tuple[FloatArray, FloatArray, Forecast]:
    """The weighted mean path (31, 2) and the first hypothesis' sigma (31,) after these places."""
    it = Forecaster(ForecastParameters(**changes), T, 0.1, 30)  # type: ignore[arg-type]
    for i, at in enumerate(places):
        f, _ = it.update(T * i, obstacles(at[None], error=ERROR))
    return np.einsum("h,hkc->kc", f.weight[0], f.path[0]), f.sigma[0, 0], f


def test_what_stands_is_expected_to_stand() -> None:
    path, sigma, f = path_of(np.zeros((20, 2)))
    assert np.abs(path).max() < 0.05
    assert sigma[30] < 0.3
    assert f.weight[0, 0] > 0.5


def test_what_goes_straight_is_expected_to_go_straight() -> None:
    t = T * np.arange(20)
    path, _, _ = path_of(np.column_stack([1.2 * t, -0.4 * t]))
    assert path[30] == pytest.approx([1.2 * (t[-1] + 3.0), -0.4 * (t[-1] + 3.0)], abs=0.1)


def test_what_turns_is_expected_to_turn() -> None:
    t = T * np.arange(24)
    w = 0.55  # between the turn rates of the bank
    path, _, _ = path_of(np.column_stack([np.sin(w * t), 1.0 - np.cos(w * t)]) / w)
    end = w * (t[-1] + 2.0)
    assert np.hypot(*(path[20] - np.array([np.sin(end), 1.0 - np.cos(end)]) / w)) < 0.15


def test_what_stops_is_expected_to_stand_soon_after() -> None:
    t = T * np.arange(24)
    x = np.where(t < 2.0, t, 2.0 + 0.5 * (1.0 - np.exp(-2.0 * np.maximum(t - 2.0, 0.0))))
    path, _, _ = path_of(np.column_stack([x, np.zeros(24)]))
    assert np.abs(path[:, 0] - 2.48).max() < 0.3


def test_constant_velocity_only_is_a_straight_line_at_even_pace() -> None:
    t = T * np.arange(14)
    path, _, f = path_of(np.column_stack([np.cos(0.6 * t), np.sin(0.6 * t)]), constant_velocity_only=True)
    np.testing.assert_allclose(np.diff(path, n=2, axis=0), 0.0, atol=1e-9)
    assert f.weight[0].tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("hypotheses", [1, 2, 3])
def test_no_more_hypotheses_than_wanted(hypotheses: int) -> None:
    rng = np.random.default_rng(2)
    it = Forecaster(ForecastParameters(hypotheses=hypotheses), T, 0.1, 30)
    x, v = np.zeros((60, 2)), rng.normal(0.0, 1.0, (60, 2))
    for i in range(12):
        f, _ = it.update(T * i, obstacles(x))
        v = 0.9 * v + rng.normal(0.0, 0.1, v.shape)
        x = x + T * v
        assert f.weight.shape == (60, hypotheses)
        np.testing.assert_allclose(f.weight.sum(axis=1), 1.0)
        used = f.weight > 0.0
        assert (f.weight[used] >= 0.02 * 0.9).all()
    if hypotheses > 1:
        assert used[:, 1].any()


def test_the_same_obstacles_give_the_same_bits() -> None:
    a, b = run.__wrapped__(5, False), run(5, False)
    for x, y in zip(a[1:], b[1:], strict=True):
        np.testing.assert_array_equal(x, y)


def test_turned_and_moved_the_forecast_turns_and_moves_too() -> None:
    rng = np.random.default_rng(4)
    way = np.cumsum(rng.normal(0.1, 0.02, (12, 2)), axis=0)
    path, sigma, _ = path_of(way)
    quarter = np.array([[0.0, 1.0], [-1.0, 0.0]])
    turned, other, _ = path_of(way @ quarter + [7.0, -3.0])
    np.testing.assert_allclose(turned, path @ quarter + [7.0, -3.0], atol=1e-6)
    np.testing.assert_allclose(other, sigma, atol=1e-6)


def test_nothing_is_reckoned_of_which_nothing_is_expected() -> None:
    none, some, steady = (
        len(models(p, 0.1, 30).stiffness)
        for p in (
            ForecastParameters(oscillation=0.0),
            ForecastParameters(),
            ForecastParameters(constant_velocity_only=True),
        )
    )
    assert (none, some, steady) == (0, ForecastParameters().stiffnesses, 0)


def test_who_is_not_expected_to_oscillate_is_foretold_to_go_straight() -> None:
    """Of who walks evenly, seen as a lidar sees legs: places off by centimetres."""
    v = np.random.default_rng(3).normal(0.0, 0.9, (N, 2))
    true = np.stack([v * (T * 10 + 0.1 * j) for j in range(31)], axis=1)
    off = []
    for share in (0.0, ForecastParameters().oscillation):
        it, rng = Forecaster(ForecastParameters(oscillation=share), T, 0.1, 30), np.random.default_rng(4)
        for i in range(11):
            f, _ = it.update(T * i, obstacles(v * T * i + rng.normal(0.0, 0.03, (N, 2)), error=0.09))
        assert np.allclose(f.weight.sum(axis=1), 1.0)
        off.append(errors(f, true)[:, 30].mean())
    assert off[0] < 0.85 * off[1]
