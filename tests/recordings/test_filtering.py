from __future__ import annotations

import numpy as np
import pytest
from marker_scenes import eight, straight
from scipy.signal import butter, sosfreqz

from clearway.recordings.motion import filtering


@pytest.mark.parametrize(("cutoff", "rate"), [(6, 100), (2, 200), (6, 30), (10, 30)])
def test_two_passes_halve_the_power_at_the_cutoff(cutoff: float, rate: float) -> None:
    _, once = sosfreqz(filtering.coefficients(cutoff, rate), worN=[cutoff], fs=rate)
    assert (np.abs(once[0]) ** 2) ** 2 == pytest.approx(0.5, rel=1e-9)


def test_winters_correction_is_the_books() -> None:
    """0.802 of the pass band at two passes, where the cut-off is far below the rate."""
    b = filtering.coefficients(1, 1000)
    np.testing.assert_allclose(b, butter(2, 1 / 0.802, fs=1000, output="sos"), rtol=1e-3)


def test_steady_motion_and_rest_pass_unbent_to_the_ends() -> None:
    s = np.arange(300) / 100
    x = np.stack((np.full_like(s, 3.0), 0.5 * s - 7), axis=1)
    np.testing.assert_allclose(filtering.lowpass(x, 6, 100), x, atol=1e-9)


def test_no_lag() -> None:
    s = np.arange(1000) / 100
    x = np.sin(2 * np.pi * 1.0 * s)[:, None]
    y = filtering.lowpass(x, 6, 100)
    np.testing.assert_allclose(y[100:-100], x[100:-100], atol=0.002)


def test_uneven_stamps() -> None:
    rng = np.random.default_rng(1)
    t, pose = eight(2000)
    keep = np.sort(rng.choice(2000, 1500, replace=False))
    noisy = pose + 0.002 * rng.standard_normal(pose.shape)
    y = filtering.smooth(t[keep], noisy[keep], 3)
    assert not filtering.even(t[keep])
    assert np.sqrt(((y - pose[keep]) ** 2).mean()) < 0.001


def test_gain_is_what_noise_keeps_also_at_the_ends() -> None:
    rng = np.random.default_rng(2)
    y = filtering.lowpass(rng.standard_normal((400, 4000)), 6, 100)
    share = filtering.gain(400, 6, 100)
    np.testing.assert_allclose(y.var(axis=1)[150:250].mean(), share[200], rtol=0.03)
    np.testing.assert_allclose(y.var(axis=1)[[0, 1, 5, -1]], share[[0, 1, 5, -1]], rtol=0.1)
    assert share[200] < 0.2 < share[0] <= 1


def test_gain_of_noise_that_lasts() -> None:
    rng, rho = np.random.default_rng(3), 0.9
    x = np.empty((400, 3000))
    x[0] = rng.standard_normal(3000)
    for i in range(1, 400):
        x[i] = rho * x[i - 1] + np.sqrt(1 - rho**2) * rng.standard_normal(3000)
    share = filtering.gain(400, 6, 100, rho)[200]
    assert filtering.lowpass(x, 6, 100)[150:250].var() == pytest.approx(share, rel=0.05)
    assert share > 3 * filtering.gain(400, 6, 100)[200]


@pytest.mark.parametrize("noise", [0.0002, 0.001, 0.005])
def test_residual_analysis_is_near_the_best_cutoff(noise: float) -> None:
    rng = np.random.default_rng(4)
    t, pose = straight(3.0)
    x = pose[:, :1] + 0.05 * np.sin(2 * np.pi * 1.2 * t)[:, None]
    noisy = x + noise * rng.standard_normal(x.shape)
    every = np.ones(len(x), dtype=bool)
    found = filtering.residual_analysis([(noisy, every)], 100.0)
    assert found.noise == pytest.approx(noise, rel=0.1)
    error = {f: np.sqrt(((filtering.lowpass(noisy, f, 100) - x) ** 2).mean()) for f in np.geomspace(2, 20, 40)}
    own = np.sqrt(((filtering.lowpass(noisy, found.cutoff, 100) - x) ** 2).mean())
    assert own < 1.1 * min(error.values())


def test_residual_analysis_without_anything_to_analyse() -> None:
    nothing = (np.zeros((500, 1)), np.zeros(500, dtype=bool))
    assert filtering.residual_analysis([nothing], 100.0).cutoff == filtering.DEFAULT
    assert filtering.residual_analysis([], 0.0).cutoff == filtering.DEFAULT


def test_jitter_is_the_noise() -> None:
    rng = np.random.default_rng(5)
    _, pose = eight(5000)
    assert filtering.jitter(pose + 0.003 * rng.standard_normal(pose.shape)) == pytest.approx(0.003, rel=0.05)
    assert filtering.jitter(pose[:5]) == 0


def test_rest_is_found() -> None:
    rng, noise = np.random.default_rng(6), np.array((0.0003, 0.0007))
    t, pose = straight(2.0, rest=3.0)
    noisy = pose + noise[[0, 0, 1]] * rng.standard_normal(pose.shape)
    rests = filtering.at_rest(t, noisy, noise)
    (first, last), (again, end) = rests
    assert first == 0
    assert 2.7 < t[last - 1] <= 3.05
    assert t[-1] - 3.05 <= t[again] < t[-1] - 2.7
    assert end == len(t)
    assert len(filtering.at_rest(t, noisy + (0.005 * t)[:, None] * (1, 0, 0), noise)) == 0  # nobody rests at 5 mm/s


def test_noise_that_looks_like_driving_tells_nothing_of_rest() -> None:
    t = np.arange(1000) / 100
    pose = 0.05 * np.random.default_rng(7).standard_normal((1000, 3))
    assert len(filtering.at_rest(t, pose, np.array((0.05, 0.05)))) == 0


def test_velocity_by_hand() -> None:
    t = np.arange(301) / 100
    pose = np.stack((np.sin(t), 1 - np.cos(t), t), axis=1)  # a circle of 1 m at 1 m/s
    v = filtering.velocity(t, pose)
    np.testing.assert_allclose(v, 1.0, atol=1e-5)
    np.testing.assert_allclose(filtering.velocity(t, pose * (-1, -1, 1))[:, 0], -1.0, atol=1e-5)  # in reverse
    unknown = filtering.velocity(t, pose[:, :2])
    np.testing.assert_allclose(unknown[:, 0], 1.0, atol=1e-5)
    assert np.isnan(unknown[:, 1]).all()
    assert np.isnan(filtering.velocity(t[:1], pose[:1])).all()
