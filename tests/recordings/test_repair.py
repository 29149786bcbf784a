from __future__ import annotations

import numpy as np
import pytest
from marker_scenes import EIGHT, FOUR, capture, circle, swap

from clearway.recordings.motion.repair import Repaired, repair
from clearway.recordings.motion.rigid import fit

SQUARE = np.array([(0.2, 0.2, 0.5), (-0.2, 0.2, 0.5), (-0.2, -0.2, 0.5), (0.2, -0.2, 0.5)])


def repaired(points, markers: np.ndarray) -> Repaired:
    return repair(points.t, points.xyz, markers, fit(points.xyz, markers), 0.0005, 0.01)


def wrong(done: Repaired, pose: np.ndarray) -> np.ndarray:
    heading = np.arctan2(done.fit.rotation[:, 1, 0], done.fit.rotation[:, 0, 0])
    return np.abs(np.remainder(heading - pose[:, 2] + np.pi, 2 * np.pi) - np.pi)


@pytest.mark.parametrize("markers", [EIGHT, FOUR, SQUARE])
def test_two_markers_with_each_others_names(markers: np.ndarray) -> None:
    t, pose = circle(1000)
    points = swap(capture(t, pose, markers, rng=np.random.default_rng(1)), 0, 1, 300, 420)
    done = repaired(points, markers)
    assert done.swapped.sum() == 120
    assert done.swapped[300:420].all()
    assert not done.refused.any()
    assert wrong(done, pose).max() < 0.01
    assert np.abs(done.fit.translation[:, :2] - pose[:, :2]).max() < 0.005


def test_names_that_stay_exchanged_to_the_end_of_a_long_capture() -> None:
    t, pose = circle(
        6000
    )  # half a turn is driven meanwhile, the figure is regular: only going on step by step is right
    done = repaired(swap(capture(t, pose, SQUARE, rng=np.random.default_rng(2)), 0, 1, 100, 6000), SQUARE)
    assert done.swapped.sum() == 5900
    assert wrong(done, pose).max() < 0.02


def test_a_strayed_marker_is_left_out() -> None:
    t, pose = circle(500)
    points = capture(t, pose, rng=np.random.default_rng(3))
    points.xyz[100:200, 2] += (0.05, 0.0, -0.02)
    points.xyz[150:160, 6] -= (0.0, 0.04, 0.0)
    done = repaired(points, EIGHT)
    assert done.thinned.sum() == 100
    assert not done.fit.used[100:200, 2].any()
    assert not done.fit.used[150:160, 6].any()
    assert done.fit.used[:100].all()
    assert np.abs(done.fit.translation[:, :2] - pose[:, :2]).max() < 0.005


def test_what_no_rigid_body_explains_is_refused() -> None:
    rng = np.random.default_rng(4)
    t, pose = circle(300)
    points = capture(t, pose, rng=rng)
    points.xyz[50:60] += 0.1 * rng.standard_normal((10, 8, 3))
    done = repaired(points, EIGHT)
    assert np.flatnonzero(done.refused).tolist() == list(range(50, 60))
    assert np.isnan(done.fit.rotation[50:60]).all()
    assert not done.fit.used[50:60].any()


def test_a_sound_capture_stays_as_it_is() -> None:
    t, pose = circle(3000)
    points = capture(t, pose, rng=np.random.default_rng(5), gaps=0.05)
    before = fit(points.xyz, EIGHT)
    done = repair(points.t, points.xyz, EIGHT, before, 0.0005, 0.01)
    assert not (done.swapped | done.thinned | done.refused).any()
    np.testing.assert_array_equal(done.fit.translation, before.translation)
