from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.recordings.motion.cleaning import clean
from clearway.recordings.motion.gaps import fill, runs, seen_in_part, stretches
from clearway.recordings.motion.motion import Gap, MotionSpec


def test_runs() -> None:
    assert runs(np.array([1, 1, 0, 1, 0, 0, 1], dtype=bool)).tolist() == [[0, 2], [3, 4], [6, 7]]
    assert runs(np.zeros(3, dtype=bool)).tolist() == []
    assert runs(np.ones(3, dtype=bool)).tolist() == [[0, 3]]


def test_a_cubic_is_filled_exactly_and_a_longer_gap_stays_open() -> None:
    t = np.arange(200) / 100
    pose = np.stack((t**3 - t, 2 * t**2, 0.3 * t), axis=1)
    holed = pose.copy()
    holed[50:69] = np.nan  # 0.20 s from seen to seen
    holed[100:120] = np.nan  # 0.21 s
    holed[:3] = holed[197:] = np.nan
    filled = fill(t, holed, 0.2)
    np.testing.assert_allclose(filled.pose[50:69], pose[50:69], atol=1e-9)
    assert np.isnan(filled.pose[100:120]).all()
    assert filled.gaps == (
        Gap(0.0, 0.02, ""),
        Gap(0.49, 0.69, "spline"),
        Gap(0.99, 1.2, ""),
        Gap(1.97, 1.99, ""),
    )
    assert stretches(t, np.isfinite(filled.pose[:, 0]), 0.2) == [(3, 100), (120, 197)]


def test_noise_is_not_blown_up_in_a_gap_and_its_variance_is_told() -> None:
    rng, noise = np.random.default_rng(1), 0.0005
    t = np.arange(61) / 100
    errors, told = [], []
    for _ in range(400):
        pose = noise * rng.standard_normal((61, 1))
        pose[21:40] = np.nan
        filled = fill(t, pose, 0.2)
        errors.append(filled.pose[21:40, 0])
        told.append(filled.variance[21:40, 0])
    assert np.std(errors) < 2 * noise
    inside = np.abs(np.concatenate(errors)) < 2 * np.sqrt(np.concatenate(told))
    assert 0.90 < inside.mean() <= 1.0


def test_a_leap_of_the_stamps_is_an_open_gap() -> None:
    t = np.concatenate((np.arange(50) / 100, 3 + np.arange(50) / 100))
    pose = np.zeros((100, 3))
    assert fill(t, pose, 0.2).gaps == (Gap(0.49, 3.0, ""),)
    assert stretches(t, np.ones(100, dtype=bool), 0.2) == [(0, 50), (50, 100)]


def test_slow_samples_are_no_gaps() -> None:
    t = np.arange(20) * 0.4
    assert fill(t, np.zeros((20, 2)), 0.2).gaps == ()


def test_too_little_beside_a_gap() -> None:
    t = np.arange(10) / 100
    pose = np.zeros((10, 2))
    pose[2:5] = np.nan
    assert fill(t, pose, 0.2).gaps == (Gap(0.01, 0.05, ""),)


def test_only_long_stretches_of_fewer_markers_are_listed() -> None:
    t = np.arange(100) / 100
    partly = np.zeros(100, dtype=bool)
    partly[10:15] = partly[40:80] = True
    assert seen_in_part(t, partly, 0.2) == (Gap(0.4, 0.79, "markers"),)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_hardly_any_samples(n: int) -> None:
    filled = fill(np.arange(n) * 0.01, np.zeros((n, 3)), 0.2)
    assert filled.pose.shape == (n, 3)
    assert filled.gaps == ()
    nothing = fill(np.arange(n) * 0.01, np.full((n, 3), np.nan), 0.2)
    assert len(nothing.gaps) == (n > 0)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), seen=st.floats(0.05, 0.98), longest=st.sampled_from((0.0, 0.05, 0.2, 1.0)))
def test_what_was_not_seen_is_only_known_within_a_gap_that_is_short_enough(seed: int, seen: float, longest: float):
    """However few frames show a body, and however unevenly: what a curve says beyond the limit is no pose."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.choice((0.01, 0.01, 0.013, 0.3), 300))
    pose = np.stack((t, np.sin(t), 0.1 * t), axis=1)
    there = np.repeat(rng.uniform(size=60) < seen, 5)
    pose[~there] = np.nan
    done = clean(t, pose, np.full((300, 2), 1e-6), MotionSpec(spline=longest))
    last = np.maximum.accumulate(np.where(there, t, -np.inf))
    following = np.minimum.accumulate(np.where(there, t, np.inf)[::-1])[::-1]
    known = np.isfinite(done.pose).all(axis=1)
    assert known[there].all()
    assert ((following - last)[known] <= longest * (1 + 1e-6)).all()
    spline = [g for g in done.gaps if g.filled]
    assert all(any(g.start < at < g.end for g in spline) for at in t[known & ~there])
