"""MPPI's noise, rollout and update against a second reading of the source."""

import math

import mppi_motion_oracle as oracle
import numpy as np
import pytest

from clearway.navigators.common.mppi.functions import logarithm, sine_cosine, wrapped
from clearway.navigators.common.mppi.noise import draw_noise, philox
from clearway.navigators.common.mppi.samples import make_samples
from clearway.navigators.nav2.controllers.mppi.rollout import (
    Delays,
    Limits,
    roll_out,
    trajectory_of,
)
from clearway.navigators.nav2.controllers.mppi.update import Update, hold_now, shift, update_controls

AXES = ("vx", "vy", "wz")
STEPS, BATCH = 30, 37


def float32(*values):
    return tuple(np.float32(v) for v in values)


def test_functions_of_float32():
    for x in np.linspace(-100.0, 100.0, 3001, dtype=np.float32):
        sine, cosine = sine_cosine(x)
        assert isinstance(sine, float)
        assert abs(sine - math.sin(x)) < 1.2e-7
        assert abs(cosine - math.cos(x)) < 1.2e-7
        assert abs(wrapped(x) - math.remainder(x, math.tau)) < 2e-5
    for x in np.geomspace(2.0**-24, 1.0, 2001, dtype=np.float32):
        assert abs(logarithm(x) - math.log(x)) <= 1.5e-7 * max(1.0, abs(math.log(x)))


@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [
        ((0, 0), 0, (0xFF1DAE59, 0x6CD10DF2)),
        ((0xFFFFFFFF, 0xFFFFFFFF), 0xFFFFFFFF, (0x2C3F628B, 0xAB4FD7AD)),
        ((0x243F6A88, 0x85A308D3), 0x13198A2E, (0xDD7CE038, 0xF62A4C12)),
    ],
)
def test_philox_gives_the_published_words(counter, key, words):
    low, high = counter
    assert philox(np.uint64(low), np.uint64(high), np.uint64(key)) == words


def test_noise_is_normal_and_independent():
    a, b, c = (np.empty((50, 2000), np.float32) for _ in range(3))
    draw_noise(a, b, np.uint64(7), 3, 0.2, 1.0)
    draw_noise(c, np.empty_like(c), np.uint64(7), 4, 0.2, 1.0)
    for drawn, std in ((a, 0.2), (b, 1.0), (c, 0.2)):
        z = np.sort(drawn.ravel().astype(float) / std)
        expected = np.array([0.5 * (1 + math.erf(v / math.sqrt(2))) for v in z[::100]])
        assert np.abs(expected - np.arange(0, len(z), 100) / len(z)).max() < 0.006  # Kolmogorov, p = 0.001 at 100,000
        assert abs(np.corrcoef(drawn[:, :-1].ravel(), drawn[:, 1:].ravel())[0, 1]) < 0.01
        assert abs(np.corrcoef(drawn[:-1].ravel(), drawn[1:].ravel())[0, 1]) < 0.01
    assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.01
    assert abs(np.corrcoef(a.ravel(), c.ravel())[0, 1]) < 0.01
    again = np.empty_like(a)
    draw_noise(again, np.empty_like(a), np.uint64(7), 3, 0.2, 1.0)
    assert np.array_equal(a, again)


def limits_of(rng):
    values = rng.uniform(0.5, 3.0, 4)
    limits = Limits(*float32(0.5, -0.35, 0.4, 1.9, values[0], -values[1], values[2], -values[3], 3.2))
    accelerations = {
        "vx": (float(limits.ax_min), float(limits.ax_max)),
        "vy": (float(limits.ay_min), float(limits.ay_max)),
        "wz": (-float(limits.az_max), float(limits.az_max)),
    }
    return limits, accelerations


@pytest.mark.parametrize("holonomic", [False, True])
@pytest.mark.parametrize("clamp_raw", [False, True])
@pytest.mark.parametrize("delays", [(0.0, 0.0, 0.0), (0.1, 0.05, 0.2), (5.0, 0.0, 0.07)])
def test_rollout(holonomic, clamp_raw, delays):
    rng = np.random.default_rng(5)
    limits, accelerations = limits_of(rng)
    noise = {
        axis: rng.normal(0.0, s, (STEPS, BATCH)).astype(np.float32)
        for axis, s in zip(AXES, (0.3, 0.2, 0.5), strict=True)
    }
    control = rng.normal(0.0, 0.3, (3, STEPS)).astype(np.float32)
    speed, pose = rng.normal(0.0, 0.3, 3).astype(np.float32), np.array([3.0, -2.0, 2.5], np.float32)
    late = np.array([math.floor(d / 0.05 + 0.5) for d in delays])
    commands = rng.normal(0.0, 0.3, (3, max(1, late.max()))).astype(np.float32)
    samples = make_samples(STEPS, BATCH)
    roll_out(
        samples,
        tuple(noise.values()),
        control,
        pose,
        speed,
        limits,
        Delays(late, commands),
        np.float32(0.05),
        holonomic,
        clamp_raw,
    )
    model = {
        "dt": float(np.float32(0.05)), "holonomic": holonomic, "clamp_raw": clamp_raw, "accelerations": accelerations,
        "delays": dict(zip(AXES, delays, strict=True)), "commands": dict(zip(AXES, commands, strict=True)),
    }  # fmt: skip
    velocities, controls = oracle.predict(
        model,
        {a: n.T.astype(float) for a, n in noise.items()},
        dict(zip(AXES, control, strict=True)),
        dict(zip(AXES, speed, strict=True)),
    )
    for axis, expected in velocities.items():
        np.testing.assert_allclose(getattr(samples, axis).T, expected, atol=5e-6)
    for axis, expected in controls.items():
        np.testing.assert_allclose(getattr(samples, f"c{axis}").T, expected, atol=5e-6)
    for name, expected in zip(("x", "y", "yaw"), oracle.integrate(velocities, pose.astype(float), 0.05), strict=True):
        np.testing.assert_allclose(getattr(samples, name).T, expected, atol=2e-5)


@pytest.mark.parametrize("radius", [0.0, 0.6])
@pytest.mark.parametrize("shifts", [False, True])
@pytest.mark.parametrize("holonomic", [False, True])
@pytest.mark.parametrize(("order", "steps"), [(1, STEPS), (2, STEPS), (2, 20), (2, 21)])
def test_update(radius, shifts, holonomic, order, steps):
    rng = np.random.default_rng(9)
    limits, accelerations = limits_of(rng)
    bounds = {"vx": (-0.35, 0.5), "vy": (-0.4, 0.4), "wz": (-1.9, 1.9)}
    axes = AXES if holonomic else ("vx", "wz")
    std = {"vx": 0.2, "vy": 0.25, "wz": 0.0 if radius else 0.4}
    control = rng.normal(0.0, 0.4, (3, steps)).astype(np.float32)
    control[1] *= holonomic
    samples, speed = make_samples(steps, BATCH), rng.normal(0.0, 0.3, 3).astype(np.float32)
    for axis in axes:
        getattr(samples, f"c{axis}")[:] = control[AXES.index(axis)][:, None] + rng.normal(0.0, 0.3, (steps, BATCH))
    costs, history = rng.uniform(0.0, 2.0, BATCH).astype(np.float32), rng.normal(0.0, 0.3, (4, 3)).astype(np.float32)
    history[:, 1] *= holonomic
    plain_history = history.astype(float)
    settings = {
        "gamma": 0.015, "temperature": 0.3, "dt": 0.05, "period": 0.04, "shift": shifts, "sgf_order": order, "radius": radius,
        "speed": dict(zip(AXES, speed.astype(float), strict=True)), "std": std, "bounds": bounds, "accelerations": accelerations,
    }  # fmt: skip
    expected = oracle.update(
        settings,
        dict(zip(AXES, control.astype(float), strict=True)),
        {axis: getattr(samples, f"c{axis}").T.astype(float) for axis in axes},
        costs.astype(float),
        plain_history,
    )
    gamma = np.array([0.015 / s**2 if s else 0.0 for s in std.values()], np.float32)
    how = Update(*float32(0.3), gamma, *float32(0.05, 0.04, radius), order, shifts, holonomic)
    update_controls(control, costs, history, samples, speed, limits, how)
    for axis in axes:
        np.testing.assert_allclose(control[AXES.index(axis)], expected[axis], atol=3e-6)
    np.testing.assert_allclose(history, plain_history, atol=3e-6)


def test_a_sequence_begins_with_what_can_be_had_and_is_shifted():
    limits = Limits(*float32(0.5, -0.35, 0.4, 1.9, 1.0, -2.0, 1.0, -1.0, 3.0))
    speed = np.array([0.2, 0.0, -0.5], np.float32)
    control = np.arange(15, dtype=np.float32).reshape(3, 5)
    for shifts, first in ((False, (0.2 - 0.08, 5.0, -0.5 + 0.12)), (True, (0.2, 5.0, -0.5))):
        how = Update(*float32(0.3), np.zeros(3, np.float32), *float32(0.05, 0.04, 0.0), 2, shifts, False)
        held = control.copy()
        hold_now(held, speed, limits, how)
        np.testing.assert_allclose(held[:, 0], first, atol=1e-6)
        assert np.array_equal(held[:, 1:], control[:, 1:])
    shift(control, False)
    assert control.tolist() == [[1, 2, 3, 4, 4], [5, 6, 7, 8, 9], [11, 12, 13, 14, 14]]


def test_where_a_control_sequence_leads():
    rng = np.random.default_rng(2)
    control, pose = rng.normal(0.0, 0.5, (3, STEPS)).astype(np.float32), np.array([1.0, 2.0, -3.0], np.float32)
    for holonomic in (False, True):
        velocities = {a: control[i][None].astype(float) * (a != "vy" or holonomic) for i, a in enumerate(AXES)}
        expected = np.stack(oracle.integrate(velocities, pose.astype(float), 0.05))[:, 0].T
        np.testing.assert_allclose(trajectory_of(control, pose, np.float32(0.05), holonomic), expected, atol=1e-5)
