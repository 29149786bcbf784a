"""Clocks: the offset is found without bias, its uncertainty covers the truth, and what can't be told is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from driven import Knots, driven

from clearway.errors import ClearwayError
from clearway.recordings.alignment import clocks
from clearway.recordings.motion.motion import Motion, MotionSpec, Quality
from clearway.recordings.motion.tracks import motion_of_track
from clearway.recordings.recording import Track

TRIAL: Knots = [
    (0, 0, 0), (2, 0, 0), (2.6, 0.6, 0), (5, 0.6, 0.1), (7, 0.5, -0.3), (9.5, 0.6, 0.1), (10.4, 0, 0), (11, 0, 0),
    (11.6, 0, 1.2), (13.5, 0, 1.2), (14, 0, 0), (14.4, 0, 0), (15, 0.6, 0), (19, 0.55, 0.2), (22.4, 0.6, -0.1),
    (23.4, 0, 0), (27, 0, 0),
]  # fmt: skip


def logged(m: Motion, rate: float, seconds: float, *, seed: int, noise: float = 0.01, drift: float = 0.0) -> Motion:
    """The robot's own log of a motion: slower, jittered, with scale errors, its clock `seconds` behind."""
    rng = np.random.default_rng(seed)
    t = np.arange(m.t[0], m.t[-1], 1 / rate)
    t = np.clip(t + rng.uniform(-0.1, 0.1, len(t)) / rate, m.t[0], m.t[-1])
    seen = clocks.resample(m, t)
    v = seen.velocity * [1.02, 0.97] + rng.normal(size=(len(t), 2)) * noise
    return Motion(t * (1 - drift) - seconds, seen.pose, v, None, Quality(rate, 1.0))


def test_the_offset_is_unbiased_and_its_uncertainty_covers_the_truth() -> None:
    exact = driven(TRIAL)
    rng = np.random.default_rng(1)
    errors, stated = [], []
    for seed in range(60):
        seen = driven(TRIAL, noise=5e-4, turn_noise=3e-3, filtered=6.0, seed=seed)
        truth = float(rng.uniform(-1000, 1000))
        found = clocks.offset(seen, logged(exact, 20.0, truth, seed=seed))
        errors.append(found.seconds - truth)
        stated.append(found.sigma)
        assert found.correlation > 0.95
        assert found.drift == 0.0
    assert abs(np.mean(errors)) < 3 * np.std(errors) / np.sqrt(len(errors))
    assert np.std(errors) < 0.003
    assert np.mean(np.abs(errors) < 2 * np.array(stated)) >= 0.9
    assert np.median(stated) < 2 * np.std(errors)  # not by being vague


@pytest.mark.parametrize("rate", [2.5, 10.0, 30.0, 200.0])
def test_sources_of_any_rate(rate: float) -> None:
    found = clocks.offset(driven(TRIAL), logged(driven(TRIAL, 1000.0), rate, 12.345, seed=5))
    assert found.seconds == pytest.approx(12.345, abs=max(0.01, 0.1 / rate))
    assert abs(found.seconds - 12.345) < 3 * found.sigma


def test_exact_copies_and_antisymmetry() -> None:
    m = driven(TRIAL)
    late = replace(m, t=m.t + 4.3217)
    assert clocks.offset(m, late).seconds == pytest.approx(-4.3217, abs=1e-5)
    assert clocks.offset(late, m).seconds == pytest.approx(4.3217, abs=1e-5)


def test_a_capture_within_a_long_log_and_a_log_that_begins_late() -> None:
    long = driven(
        [*TRIAL, *[(t + 27, v, w) for t, v, w in [(1, 0, 0), (2, 0.4, 0.5), (14, 0.4, 0.1), (15, 0, 0), (40, 0, 0)]]]
    )
    short = driven(TRIAL)
    assert clocks.offset(short, replace(long, t=long.t - 7)).seconds == pytest.approx(7, abs=0.005)
    late = clocks.resample(short, np.arange(6.0, 27.0, 0.02))
    assert clocks.offset(short, replace(late, t=late.t + 100)).seconds == pytest.approx(-100, abs=0.005)


def test_gaps_are_not_motion() -> None:
    m = driven(TRIAL)
    v = m.velocity.copy()
    v[300:520] = np.nan
    v[1250:1300] = np.nan
    assert clocks.offset(replace(m, velocity=v), logged(m, 50.0, 3.0, seed=2)).seconds == pytest.approx(3.0, abs=0.005)


def test_without_a_heading_speed_is_enough() -> None:
    m = driven(TRIAL)
    blind = replace(m, velocity=np.stack([m.velocity[:, 0], np.full(len(m.t), np.nan)], axis=1))
    assert clocks.offset(blind, logged(m, 50.0, 3.0, seed=2)).seconds == pytest.approx(3.0, abs=0.01)


def test_drift_is_noticed_and_only_if_it_is_there() -> None:
    many = [((1 + 0.02 * k) * t + 30 * k, v * (1 - 0.05 * k), w) for k in range(8) for t, v, w in TRIAL]
    m = driven(many)
    found = clocks.offset(m, logged(m, 50.0, 0.0, seed=3, drift=2e-4))
    assert found.drift == pytest.approx(2e-4, rel=0.2)
    assert "drift apart" in found.note
    assert found.seconds == pytest.approx(2e-4 * 120, abs=3 * found.sigma)
    assert all(clocks.offset(m, logged(m, 50.0, 0.0, seed=s)).drift == 0.0 for s in range(8))


def test_two_that_differ_much_are_doubted() -> None:
    m = driven(TRIAL)
    wild = replace(m, velocity=1.8 * m.velocity)
    assert clocks.offset(m, wild).correlation == pytest.approx(2 * 1.8 / (1 + 1.8**2), abs=0.01)
    assert "differ much" in clocks.offset(m, wild).note
    assert "differ much" not in clocks.offset(m, replace(m, velocity=1.4 * m.velocity)).note  # agree by 0.946


def test_what_cannot_be_told_is_refused() -> None:
    m = driven(TRIAL)
    with pytest.raises(ClearwayError, match="second source shows the robot at rest"):
        clocks.offset(m, driven([(0, 0, 0), (20, 0, 0)]))
    with pytest.raises(ClearwayError, match="3 s in common"):
        clocks.offset(m, clocks.resample(m, np.arange(2.0, 4.5, 0.01)))
    with pytest.raises(ClearwayError, match="repeats itself"):
        clocks.offset(*[driven([(2.0 * k, 0.3 + 0.3 * (k % 2), 0) for k in range(40)])] * 2)
    thrice = driven([(t + 30 * k, v, w) for k in range(3) for t, v, w in TRIAL])
    with pytest.raises(ClearwayError, match="repeats itself"):
        clocks.offset(m, thrice)
    assert clocks.offset(m, thrice, within=(-35.0, -25.0)).seconds == pytest.approx(-30, abs=0.01)
    with pytest.raises(ClearwayError, match="don't show the same drive"):
        clocks.offset(m, driven([(k, 0.3 * (k % 3), 0.3 * (k % 5 - 2)) for k in range(60)]))
    with pytest.raises(ClearwayError, match="opposite ways"):
        clocks.offset(m, replace(m, velocity=m.velocity * [1, -1]))
    with pytest.raises(ClearwayError, match="with an offset from 900 s"):
        clocks.offset(m, m, within=(900.0, 1000.0))


def test_constant_speed_is_refused_or_vague() -> None:
    steady = driven([(0, 0.5, 0), (30, 0.5, 0)], noise=2e-3, filtered=6.0, turn_noise=1e-3)
    other = driven([(0, 0.5, 0), (30, 0.5, 0)], noise=2e-3, filtered=6.0, turn_noise=1e-3, seed=1)
    with pytest.raises(ClearwayError):
        clocks.offset(steady, other)


def test_resampling_interpolates_and_keeps_gaps_open() -> None:
    t = np.array([0.0, 0.1, 0.2, 0.3, 1.3, 1.4, 1.5])
    pose = np.stack([t, 2 * t, 4 * t], axis=1)  # the heading goes on beyond a turn
    pose[1] = np.nan
    m = Motion(t, pose, np.stack([t, -t], axis=1), np.stack([t, t], axis=1), Quality(10.0, 1.0))
    got = clocks.resample(m, np.array([-0.1, 0.0, 0.05, 0.2, 0.25, 0.3, 0.8, 1.3, 1.45, 1.5, 1.6]))
    assert np.isnan(got.pose[[0, 2, 6, 10]]).all()
    known = [1, 3, 4, 5, 7, 8, 9]
    assert got.pose[known] == pytest.approx(got.t[known, None] * [1, 2, 4])
    assert got.velocity[known] == pytest.approx(got.t[known, None] * [1, -1])
    assert got.sigma is not None
    assert got.sigma[known] == pytest.approx(got.t[known, None] * [1, 1])
    assert clocks.resample(m, np.zeros(0)).pose.shape == (0, 3)


def test_a_gap_that_was_left_open_is_none_that_a_line_fills():
    t = np.concatenate((np.arange(0, 1.0, 0.01), np.arange(1.15, 2.0, 0.01)))
    track = Track("body", "", "", t, np.stack((t, 0 * t, 0 * t), axis=1))
    for longest, known in ((0.05, False), (0.2, True)):
        moved = motion_of_track(track, MotionSpec(spline=longest), None)
        pose = clocks.resample(moved, np.arange(0.5, 1.5, 0.03)).pose
        within = (np.arange(0.5, 1.5, 0.03) > 0.99) & (np.arange(0.5, 1.5, 0.03) < 1.15)
        assert np.isfinite(pose[~within, 0]).all()
        assert np.isfinite(pose[within, 0]).all() == known
