"""Robust EM finds how many Gaussians there are, where, and how wide."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.navigators.hl_rrt.robust_em import robust_em

CENTRES = {
    1: [(2.0, -1.0)],
    2: [(0.0, 0.0), (5.0, 1.0)],
    3: [(0.0, 0.0), (6.0, 0.0), (0.0, 7.0)],
    5: [(0.0, 0.0), (6.0, 0.0), (0.0, 7.0), (6.0, 7.0), (12.0, 3.0)],
}


def draw(centres: list[tuple[float, float]], each: int, sigma: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.concatenate([np.array(c) + sigma * rng.normal(size=(each, 2)) for c in centres])


@pytest.mark.parametrize("components", sorted(CENTRES))
@pytest.mark.parametrize("seed", range(4))
def test_it_recovers_number_and_means_of_separated_gaussians(components: int, seed: int) -> None:
    centres, sigma, each = CENTRES[components], 0.5, 300 // max(components, 2)
    alpha, mean, covariance = robust_em(draw(centres, each, sigma, 100 + seed), 1e-4, 300)
    assert len(alpha) == components
    assert alpha.sum() == pytest.approx(1.0)
    assert alpha == pytest.approx(1 / components, abs=0.05)
    for centre in centres:
        assert np.hypot(*(mean - centre).T).min() < 4 * sigma / np.sqrt(each)
    assert covariance[:, [0, 2]] == pytest.approx(sigma**2, rel=0.5)
    assert np.abs(covariance[:, 1]).max() < 0.12


def test_a_single_component_has_the_sample_moments() -> None:
    points = draw([(1.0, 1.0)], 80, 0.3, 5) @ np.array(((2.0, 0.5), (0.0, 1.0)))
    alpha, mean, covariance = robust_em(points, 1e-9, 400)
    assert alpha.tolist() == [1.0]
    assert mean[0] == pytest.approx(points.mean(0), abs=1e-9)
    expected = np.cov(points.T, bias=True)
    assert covariance[0] == pytest.approx([expected[0, 0], expected[0, 1], expected[1, 1]], rel=1e-3)


@pytest.mark.parametrize("points", [np.empty((0, 2)), np.ones((1, 2)), np.ones((7, 2))])
def test_too_few_different_points_give_no_component(points: np.ndarray) -> None:
    alpha, mean, covariance = robust_em(points, 1e-3, 50)
    assert (len(alpha), len(mean), len(covariance)) == (0, 0, 0)


def test_odd_points_give_a_proper_mixture() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-1, 1, (int(rng.integers(2, 60)), 2)) * (1.0, rng.choice([0.0, 1e-6, 1.0]))
        points = np.concatenate([points, points[:3], [(1e3, 0.0)]])
        alpha, mean, covariance = robust_em(points, 1e-3, 60)
        assert alpha.sum() == pytest.approx(1.0)
        assert (alpha > 0).all()
        assert np.isfinite(mean).all()
        assert (covariance[:, 0] * covariance[:, 2] > covariance[:, 1] ** 2).all()
