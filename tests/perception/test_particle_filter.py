from __future__ import annotations

import math

import numpy as np
import pytest

from clearway.perception import particle_filter as pf

ALPHA = np.array((0.02, 0.002, 0.08, 0.002))


def moved(old: tuple[float, ...], new: tuple[float, ...], corrected: bool = True) -> np.ndarray:
    poses = np.zeros((40_000, 3))
    pf.move(poses, np.array(old), np.array(new), ALPHA, corrected, np.random.default_rng(0))
    return poses


def test_a_straight_step_spreads_as_the_odometry_model_says() -> None:
    poses = moved((1.0, 1.0, 0.5), (1.0 + math.cos(0.5), 1.0 + math.sin(0.5), 0.5))  # 1 m ahead
    assert poses[:, 0].mean() == pytest.approx(1.0, abs=0.01)
    assert np.hypot(poses[:, 0], poses[:, 1]).std() == pytest.approx(math.sqrt(0.08), rel=0.02)
    assert poses[:, 2].std() == pytest.approx(math.sqrt(2 * 0.002), rel=0.02)


def test_the_uncorrected_model_takes_variances_for_deviations() -> None:
    poses = moved((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), corrected=False)
    assert np.hypot(poses[:, 0], poses[:, 1]).std() == pytest.approx(0.08, rel=0.02)


def test_a_turn_on_the_spot_and_reversing_are_no_half_turns() -> None:
    turned = moved((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert turned[:, 2].mean() == pytest.approx(1.0, abs=0.01)
    assert turned[:, 2].std() == pytest.approx(math.sqrt(0.02), rel=0.02)
    back = moved((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
    assert back[:, 0].mean() == pytest.approx(-1.0, abs=0.01)
    heading = (back[:, 2] + math.pi) % (2 * math.pi) - math.pi
    assert heading.std() == pytest.approx(math.sqrt(2 * 0.002), rel=0.02)  # and no share of pi


def test_best_cluster_is_the_mean_of_the_heavier_group() -> None:
    rng = np.random.default_rng(1)
    near = np.array((1.0, 2.0, math.pi)) + 0.02 * rng.standard_normal((60, 3))
    far = np.array((5.0, 2.0, 0.0)) + 0.02 * rng.standard_normal((40, 3))
    weights = np.concatenate((np.full(60, 0.4 / 60), np.full(40, 0.6 / 40)))
    np.testing.assert_allclose(pf.best_cluster(np.vstack((near, far)), weights), far.mean(axis=0), atol=1e-5)
    weights = weights[::-1].copy()
    best = pf.best_cluster(np.vstack((near, far)), np.concatenate((np.full(60, 0.9 / 60), np.full(40, 0.1 / 40))))
    np.testing.assert_allclose(best[:2], near[:, :2].mean(axis=0), atol=1e-12)
    assert math.remainder(best[2] - math.pi, math.tau) == pytest.approx(near[:, 2].mean() - math.pi, abs=1e-4)


def test_touching_bins_are_one_cluster() -> None:
    line = np.column_stack((np.arange(0.25, 5.0, 0.5), np.full(10, 0.25), np.full(10, 0.01)))  # a bin each
    apart = line[:4] + np.array((20.0, 0.0, 0.0))
    poses = np.vstack((line, apart))
    weights = np.concatenate((np.full(10, 0.05), np.full(4, 0.125)))  # 0.5 each, but for the last
    weights[0] += 1e-6
    np.testing.assert_allclose(pf.best_cluster(poses, weights)[0], np.average(line[:, 0], weights=weights[:10]))


def test_resampling_draws_in_proportion_to_the_weights() -> None:
    poses = np.array(((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (6.0, 0.0, 0.0)))
    drawn = np.empty((20_000, 3))
    count = pf.resample(
        poses, np.array((0.2, 0.7, 0.1)), drawn, np.empty((0, 2)), 0.05, 0.0, np.array((20_000, 20_000)),
        0.05, 0.99, np.random.default_rng(0),
    )  # fmt: skip
    assert count == 20_000
    shares = [(drawn[:, 0] == x).mean() for x in (0.0, 3.0, 6.0)]
    np.testing.assert_allclose(shares, (0.2, 0.7, 0.1), atol=0.015)


def test_weights_add_cubes_or_multiply() -> None:
    field = np.array(((0.1, 0.2), (0.3, 0.4)))
    poses = np.array(((0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (-5.0, 0.0, 0.0)))
    ends = np.array(((0.5, 0.5), (0.5, 0.6)))
    weights = np.full(3, 1 / 3)
    mean = pf.weigh(poses, weights, ends, field, 0.05, 0.0, 0.0, 1.0, False)
    expected = np.array((1.2, 1.8, 1.1))
    assert mean == pytest.approx(expected.sum() / 9)
    np.testing.assert_allclose(weights, expected / expected.sum())
    weights = np.full(3, 1 / 3)
    pf.weigh(poses, weights, ends, np.log(field), math.log(0.05), 0.0, 0.0, 1.0, True)
    expected = np.array((0.01, 0.16, 0.0025))
    np.testing.assert_allclose(weights, expected / expected.sum())


def test_beams_without_return_are_left_out() -> None:
    ranges = np.array((1.0, np.inf, 0.01, 2.0, np.nan, 3.0))
    ends = pf.beam_ends(ranges, 0.0, math.pi / 2, np.array((0.1, 0.0, 0.0)), 1, 0.05, 2.5)
    np.testing.assert_allclose(ends, ((1.1, 0.0), (0.1, -2.0)), atol=1e-12)
