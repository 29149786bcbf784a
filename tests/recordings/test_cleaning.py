from __future__ import annotations

import numpy as np
import pytest
from marker_scenes import path_length, straight
from scipy.signal import lfilter

from clearway.recordings.motion.cleaning import Cleaned, clean
from clearway.recordings.motion.motion import MotionSpec

SPEC = MotionSpec()
NOISE = np.array((0.0003, 0.0003, 0.0007))


def cleaned(t: np.ndarray, pose: np.ndarray, spec: MotionSpec = SPEC, seed: int = 1, **more: object) -> Cleaned:
    noisy = pose + NOISE * np.random.default_rng(seed).standard_normal(pose.shape)
    return clean(t, noisy, np.broadcast_to(np.square(NOISE[[0, 2]]), (len(t), 2)), spec, **more)


def test_a_robot_that_stands_makes_no_path() -> None:
    """0.5 mm on each of eight markers places base_link to 0.3 mm; ten seconds of that are 0.7 m of raw path."""
    t, pose = np.arange(1000) / 100, np.tile((1.0, 2.0, 0.3), (1000, 1))
    assert path_length(cleaned(t, pose, MotionSpec(cutoff="none")).pose) > 0.3
    for seed in range(8):
        assert path_length(cleaned(t, pose, seed=seed).pose) < 0.001
        assert path_length(cleaned(t, pose, MotionSpec(cutoff=6), seed=seed).pose) < 0.001


@pytest.mark.parametrize(("length", "speed"), [(5.0, 0.5), (5.0, 1.0), (2.0, 0.1), (1.0, 0.03)])
def test_the_path_of_a_straight_drive(length: float, speed: float) -> None:
    t, pose = straight(length, speed)
    for seed in range(5):
        done = cleaned(t, pose, seed=seed)
        assert path_length(done.pose) == pytest.approx(length, abs=0.004 + 0.0005 * length)
        assert done.velocity[(t > 3) & (t < 3.5), 0].mean() == pytest.approx(speed, abs=0.004)


@pytest.mark.parametrize("correlation", [0.5, 0.9])
def test_noise_that_lasts_makes_no_path_either(correlation: float) -> None:
    """Taken for white it would pass for motion, the cut-off would be 18 Hz and the slow metre 8 to 27 % longer."""
    t, pose = straight(1.0, 0.05)
    white = np.random.default_rng(3).standard_normal((len(t), 3))
    lasting = lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white, axis=0)
    variance = np.broadcast_to(np.square(NOISE[[0, 2]]), (len(t), 2))
    done = clean(t, pose + NOISE * lasting, variance, SPEC, correlation=correlation)
    assert done.cutoff < 4
    assert path_length(done.pose) == pytest.approx(1.0, abs=0.006)
    still = clean(t, NOISE * lasting, variance, SPEC, correlation=correlation)
    assert path_length(still.pose) < 0.001


def test_a_robot_that_creeps_is_not_held() -> None:
    t = np.arange(1100) / 100
    pose = np.stack((0.001 * t, 0 * t, 0 * t), axis=1)
    done = cleaned(t, pose)
    assert done.pose[-1, 0] - done.pose[0, 0] == pytest.approx(0.011, abs=0.001)
    assert path_length(done.pose) == pytest.approx(0.011, abs=0.005)  # half a millimetre a second of noise


def test_nothing_lags() -> None:
    t, pose = straight(3.0)
    done = cleaned(t, pose)
    speed = np.gradient(pose[:, 0], t)
    lags = [np.abs(np.roll(speed, k)[20:-20] - done.velocity[20:-20, 0]).sum() for k in range(-5, 6)]
    assert np.argmin(lags) == 5


def test_a_long_gap_stays_open_and_a_short_one_does_not() -> None:
    t, pose = straight(3.0)
    holed = pose.copy()
    holed[300:315], holed[400:500] = np.nan, np.nan
    done = cleaned(t, holed)
    assert np.isfinite(done.pose[300:315]).all()
    assert np.abs(done.pose[300:315, 0] - pose[300:315, 0]).max() < 0.002
    assert np.isnan(done.pose[400:500]).all()
    assert np.isnan(done.velocity[400:500]).all()
    assert np.isnan(done.variance[400:500]).all()
    assert [g.filled for g in done.gaps] == ["spline", ""]
    for edge in (399, 500):
        assert abs(done.pose[edge, 0] - pose[edge, 0]) < 0.002


def test_nothing_is_smoothed_across_a_break() -> None:
    t, pose = straight(3.0)
    pose = pose + np.where(t >= 4, 1.0, 0.0)[:, None] * (1, 0, 0)
    done = cleaned(t, pose, breaks=np.array([400]))
    assert done.pose[400, 0] - done.pose[399, 0] == pytest.approx(1.005, abs=0.003)


def test_without_a_heading() -> None:
    t, pose = straight(3.0)
    pose[:, 2] = np.nan
    done = cleaned(t, pose)
    assert np.isfinite(done.pose[:, :2]).all()
    assert np.isnan(done.pose[:, 2]).all()
    assert done.velocity[350, 0] == pytest.approx(0.5, abs=0.01)
    assert np.isnan(done.velocity[:, 1]).all()


def test_a_cutoff_that_the_rate_cannot_carry() -> None:
    t, pose = straight(3.0, rate=10.0)
    done = cleaned(t, pose, MotionSpec(cutoff=6))
    assert done.cutoff is None
    assert "more than 15 samples a second, these are 10" in done.notes[0]


@pytest.mark.parametrize("n", [1, 2, 3, 5, 12])
def test_hardly_any_samples(n: int) -> None:
    done = clean(np.arange(n) / 100, np.ones((n, 3)), np.zeros((n, 2)), MotionSpec())
    np.testing.assert_allclose(done.pose, 1.0)


def test_nothing_known() -> None:
    done = clean(np.arange(5) / 100, np.full((5, 3), np.nan), np.zeros((5, 2)), MotionSpec())
    assert np.isnan(done.pose).all()
    assert len(done.gaps) == 1
