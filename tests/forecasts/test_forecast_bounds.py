"""The discs that hold an obstacle for sure hold it, whatever it does within the assumptions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.forecasts import bounds
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray
from perceived import obstacles

V, A = 4.4, 1.8
FINE = 0.01


def worst_motion(rng: np.random.Generator, n: int, seconds: float) -> tuple[FloatArray, FloatArray]:
    """(k, n, 2) places and velocities of bodies that always accelerate as much as they may, now here, now there."""
    steps = round(seconds / FINE)
    x, v = np.zeros((n, 2)), np.clip(rng.normal(0.0, 1.5, (n, 2)), -3.0, 3.0)
    places, speeds = np.empty((steps + 1, n, 2)), np.empty((steps + 1, n, 2))
    angle = rng.uniform(0.0, 2.0 * math.pi, n)
    often = rng.choice([0.1, 0.5, 2.0, 10.0], n)
    for i in range(steps + 1):
        places[i], speeds[i] = x, v
        turn = rng.random(n) < FINE / often
        angle[turn] = rng.uniform(0.0, 2.0 * math.pi, int(turn.sum()))
        a = A * np.column_stack([np.cos(angle), np.sin(angle)])
        new = v + FINE * a
        fast = np.hypot(*new.T) > V
        a[fast] = 0.0  # as fast as it may be: straight on
        new = v + FINE * a
        x, v = x + 0.5 * FINE * (v + new), new
    return places, speeds


@pytest.mark.parametrize("error", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("adverse", [False, True], ids=["random errors", "errors along the velocity"])
def test_no_motion_within_the_assumptions_leaves_the_bounds(error: float, adverse: bool) -> None:
    rng = np.random.default_rng(5)
    n, period, count = 300, 0.15, 12
    places, speeds = worst_motion(rng, n, 6.0)
    forecaster = Forecaster(ForecastParameters(speed=V, acceleration=A), period, 0.1, count)
    for i in range(28):
        k = round(i * period / FINE)
        if adverse:
            angle = np.arctan2(speeds[k, :, 1], speeds[k, :, 0]) + (math.pi if i % 2 else 0.0)
            off = error
        else:
            angle, off = rng.uniform(0.0, 2.0 * math.pi, n), error * np.sqrt(rng.random(n))
        noise = np.column_stack([off * np.cos(angle), off * np.sin(angle)])
        visible = rng.random(n) < 0.8  # now and then out of view
        o = obstacles((places[k] + noise)[visible], error=error, identity=np.flatnonzero(visible))
        f, told = forecaster.update(i * period, o)
        assert told == ()
        at = k + np.arange(count + 1) * round(0.1 / FINE)
        truth = places[at][:, f.identity].transpose(1, 0, 2)
        assert (np.hypot(*np.moveaxis(truth - f.centre, 2, 0)) <= f.reach + 1e-9).all()
        fastest = np.hypot(*np.moveaxis(speeds[k : at[-1] + 1][:, f.identity], 2, 0)).max(axis=0)
        assert (fastest <= f.speed + 1e-9).all()


@given(
    k=st.tuples(*[st.floats(0.02, 0.4)] * 2), swing=st.tuples(*[st.floats(-2.0, 2.0)] * 2),
    phase=st.tuples(*[st.floats(0.0, 6.3)] * 2), error=st.floats(0.0, 0.05), period=st.floats(0.05, 0.5),
)  # fmt: skip
def test_no_oscillator_leaves_them(
    k: tuple[float, float], swing: tuple[float, float], phase: tuple[float, float], error: float, period: float
) -> None:
    w = np.sqrt(k)

    def place(t: FloatArray) -> FloatArray:
        return np.asarray(np.array(swing) * np.sin(np.multiply.outer(t, w) + np.array(phase)))

    assert np.hypot(*(np.array(swing) * w**2)) <= A
    assert np.hypot(*(np.array(swing) * w)) <= V
    forecaster = Forecaster(ForecastParameters(), period, 0.2, 15)
    for i in range(8):
        t = i * period
        noise = error * np.array([math.cos(3.0 * i), math.sin(3.0 * i)])  # as wrong as it may be
        f, told = forecaster.update(t, obstacles(place(np.array(t))[None] + noise, error=error))
        assert told == ()
        off = np.hypot(*(place(t + 0.2 * np.arange(16)) - f.centre[0]).T)
        assert (off <= f.reach[0] + 1e-9).all()


@pytest.mark.parametrize(
    ("v", "error", "held"), [((0.5, 0.0), 0.2, True), ((0.5, 0.0), math.inf, True), ((9.0, 0.0), 0.2, False)]
)
def test_a_measured_velocity_narrows_the_disc_of_velocities(v: tuple[float, float], error: float, held: bool) -> None:
    disc = np.array((1.0, 2.0, 0.1, 0.2, 0.1, 0.6))
    before = disc.copy()
    bounds.take_velocity(*v, error, disc)
    assert (disc[:3] == before[:3]).all()
    assert (disc[5] < before[5]) == (held and error < 1.0)
    assert disc[5] <= before[5]
    for angle in np.linspace(0.0, 2.0 * math.pi, 50):  # what both allow is still allowed
        for r in (0.2, 0.5, 0.6):
            at = before[3:5] + r * np.array((math.cos(angle), math.sin(angle)))
            if math.hypot(*(at - v)) <= error:
                assert math.hypot(*(at - disc[3:5])) <= disc[5] + 1e-9
    bounds.take_velocity(math.nan, math.nan, 0.1, disc)
    assert np.isfinite(disc).all()


def test_two_places_tell_the_velocity_as_well_as_they_can() -> None:
    f = Forecaster(ForecastParameters(), 0.15, 0.1, 10)
    f.update(0.0, obstacles([[0.0, 0.0]], error=0.01))
    forecast, _ = f.update(0.15, obstacles([[0.15, 0.0]], error=0.01))
    known = 0.02 / 0.15 + 0.5 * A * 0.15  # 0.268 m/s about 1 m/s
    assert forecast.centre[0, 5] == pytest.approx([0.65, 0.0], abs=1e-6)
    assert forecast.reach[0, 5] == pytest.approx(0.01 + 0.5 * known + 0.5 * A * 0.5**2, abs=1e-6)
    assert forecast.speed[0] == pytest.approx(1.0 + known + A * 1.0, abs=1e-6)


def test_a_place_alone_tells_no_more_than_the_greatest_speed() -> None:
    forecast, _ = Forecaster(ForecastParameters(), 0.15, 0.1, 10).update(0.0, obstacles([[1.0, 2.0]], error=0.01))
    assert forecast.centre[0] == pytest.approx(np.broadcast_to([1.0, 2.0], (11, 2)))
    assert forecast.reach[0] == pytest.approx(0.01 + V * 0.1 * np.arange(11))
    assert forecast.speed[0] == V


@given(
    x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0), r=st.floats(0.0, 2.0), s=st.floats(0.0, 2.0),
    angle=st.floats(0.0, 6.3), share=st.floats(0.0, 1.0),
)  # fmt: skip
def test_where_two_discs_meet_nothing_common_is_lost(
    x: float, y: float, r: float, s: float, angle: float, share: float
) -> None:
    cx, cy, radius = bounds.meet(0.0, 0.0, r, x, y, s)
    px, py = share * r * math.cos(angle), share * r * math.sin(angle)
    if math.hypot(px - x, py - y) <= s:
        assert math.hypot(px - cx, py - cy) <= radius + 1e-9
    assert radius <= min(r, s) + 1e-8


def test_what_goes_too_fast_is_told() -> None:
    f = Forecaster(ForecastParameters(), 0.1, 0.1, 5)
    f.update(0.0, obstacles([[0.0, 0.0]], identity=[3]))
    forecast, told = f.update(0.1, obstacles([[1.5, 0.0]], identity=[3]))
    assert told == ("obstacle 3: faster than 4.4 m/s (1.04 m too far in 0.10 s)",)
    assert forecast.reach[0, 5] == pytest.approx(0.01 + V * 0.5)  # nothing is known of its velocity


def test_what_accelerates_too_much_is_told_once() -> None:
    f = Forecaster(ForecastParameters(), 0.1, 0.1, 5)
    told = []
    for i in range(12):
        t = 0.1 * i
        told += f.update(t, obstacles([[max(0.0, 2.0 * (t - 0.45)), 0.0]], identity=[7]))[1]  # from rest to 2 m/s
    assert len(told) <= 2
    assert all(text.startswith("obstacle 7: accelerates by more than 1.8 m/s^2") for text in told)
    assert told
