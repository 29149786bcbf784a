from __future__ import annotations

import numpy as np
import pytest
from marker_scenes import EIGHT, FOUR, capture, circle, swap
from scipy.spatial.transform import Rotation

from clearway.recordings.motion.rigid import fit, learn, noise_of, spread, variance_at


def turned(points: np.ndarray, degrees: float, shift: tuple[float, float, float]) -> np.ndarray:
    return points @ Rotation.from_euler("z", degrees, degrees=True).as_matrix().T + np.array(shift)


def test_a_quarter_turn_by_hand() -> None:
    model = np.array([(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)])
    seen = np.array([(5.0, 1, 0), (4.0, 0, 0), (5.0, 0, 1)])  # turned by 90 degrees about z, then moved by (5, 0, 0)
    done = fit(seen[None], model)
    np.testing.assert_allclose(done.rotation[0], [(0, -1, 0), (1, 0, 0), (0, 0, 1)], atol=1e-12)
    np.testing.assert_allclose(done.translation[0], (5, 0, 0), atol=1e-12)
    assert done.residual[0] == pytest.approx(0, abs=1e-12)
    assert done.freedom[0] == 3


def test_the_residual_of_a_stretched_square_by_hand() -> None:
    """Corners at 1 m seen at 1.1 m: every one is 0.1 sqrt(2) m off, and none of the pose takes it up."""
    model = np.array([(1.0, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)])
    assert fit(1.1 * model[None], model).residual[0] == pytest.approx(0.1 * np.sqrt(2))


def test_a_mirrored_body_is_never_reflected_back() -> None:
    done = fit((EIGHT * (1, 1, -1))[None], EIGHT)
    assert np.linalg.det(done.rotation[0]) == pytest.approx(1)
    assert done.residual[0] > 0.05


def test_hidden_markers_two_left_and_a_line() -> None:
    seen = np.repeat(turned(EIGHT, 30, (1, 2, 0))[None], 4, axis=0)
    seen[1, 3:] = np.nan
    seen[2, 2:] = np.nan
    seen[3] = np.nan
    done = fit(seen, EIGHT)
    assert done.used.sum(axis=1).tolist() == [8, 3, 0, 0]
    np.testing.assert_allclose(done.translation[1], (1, 2, 0), atol=1e-9)
    assert np.isnan(done.rotation[2:]).all()
    assert np.isnan(done.residual[2:]).all()
    line = np.array([(0.0, 0, 0), (0.3, 0, 0), (0.6, 0.004, 0), (0.1, 0.3, 0)])
    done = fit(np.where(np.arange(4)[:, None] < 3, line, np.nan)[None], line)
    assert np.isnan(done.residual[0])


def test_absurd_numbers_are_unseen() -> None:
    seen = np.repeat(EIGHT[None], 3, axis=0)
    seen[0, 0, 0], seen[1, 1, 1], seen[2, 2, 2] = np.inf, 1e300, -1e6
    done = fit(seen, EIGHT)
    assert done.used.sum(axis=1).tolist() == [7, 7, 7]
    assert done.residual.max() < 1e-12


def test_spread_is_the_distance_from_the_best_line() -> None:
    model = np.array([(0.0, 0.03, 0), (0.2, -0.03, 0), (0.4, 0.03, 0), (0.6, -0.03, 0)])
    lying, all_of_them = spread(model, np.array([(True, True, False, False), (True, True, True, True)]))
    assert lying == 0
    assert 0.02 < all_of_them < 0.03


@pytest.mark.parametrize("hidden", [(), (0, 4), (0, 1, 4, 5, 6)])
def test_variance_at_a_lever_arm_is_what_draws_show(hidden: tuple[int, ...]) -> None:
    rng, noise, n = np.random.default_rng(4), 0.0005, 20_000
    use = np.ones((1, 8), dtype=bool)
    use[:, list(hidden)] = False
    seen = np.where(use[:, :, None], turned(EIGHT, 40, (1, 2, 0)) + noise * rng.standard_normal((n, 8, 3)), np.nan)
    done = fit(seen, EIGHT)
    point = np.array((0.1, -0.3, 0.0))
    at = done.translation + done.rotation @ point
    heading = np.arctan2(done.rotation[:, 1, 0], done.rotation[:, 0, 0])
    position, turning = variance_at(EIGHT, use, point)[0] * noise**2
    assert at[:, :2].var(axis=0).mean() == pytest.approx(position, rel=0.03)
    assert heading.var() == pytest.approx(turning, rel=0.03)


def test_the_noise_by_the_residuals_counts_six_degrees_of_freedom() -> None:
    rng = np.random.default_rng(5)
    for markers in (EIGHT[:3], FOUR, EIGHT):
        seen = markers + 0.0004 * rng.standard_normal((20_000, len(markers), 3))
        assert noise_of(fit(seen, markers)) == pytest.approx(0.0004, rel=0.02)
    assert noise_of(fit(np.full((3, 8, 3), np.nan), EIGHT)) is None


@pytest.mark.parametrize("markers", [EIGHT, FOUR, EIGHT[:3], EIGHT * (1, 1, 0)])
def test_a_layout_is_learnt_from_the_capture(markers: np.ndarray) -> None:
    rng = np.random.default_rng(6)
    seen = capture(*circle(2000), markers, rng=rng, gaps=0.05)
    layout = learn(swap(seen, 0, 1, 300, 700).xyz, 0.01)
    assert layout.kept.all()
    done = fit(layout.model[None], markers)
    assert done.residual[0] < 0.0001
    np.testing.assert_allclose(layout.model.mean(axis=0), 0, atol=1e-12)
    assert done.rotation[0, 2, 2] == pytest.approx(1, abs=1e-5)  # z is up
    assert layout.model[0, 1] == pytest.approx(0, abs=1e-12)  # the first marker is on the x axis
    assert layout.model[0, 0] > 0


def test_a_layout_without_a_frame_that_shows_all_markers() -> None:
    seen = capture(*circle(900), rng=np.random.default_rng(7)).xyz.copy()
    seen[::3, 0] = seen[1::3, 4] = seen[2::3, 6] = np.nan
    assert fit(learn(seen, 0.01).model[None], EIGHT).residual[0] < 0.0001


def test_loose_and_lonely_markers_are_left_out() -> None:
    rng = np.random.default_rng(8)
    t, pose = circle(1500)
    seen = capture(t, pose, rng=rng).xyz.copy()
    seen[:, 5] += np.stack((0.05 * np.sin(t), 0 * t, 0.05 * np.cos(t)), axis=1)  # swings
    seen[:700, 2] = np.nan
    seen[700:, 3] = np.nan  # 2 and 3 are never seen together
    layout = learn(seen, 0.01)
    assert layout.loose.tolist() == [i == 5 for i in range(8)]
    assert layout.never.sum() == 1
    assert layout.never[2] or layout.never[3]
    assert layout.kept.sum() == 6
