"""Frame ties: recovered exactly without noise, with honest uncertainties with it, and mistakes named."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.errors import ClearwayError
from clearway.geometry.frames import compose
from clearway.recordings.alignment import frames
from clearway.recordings.motion.motion import Motion, Quality

FRAME = np.array([1.2, -0.7, 2.1])
HOLDS = np.array([[0.3, 0.4, 0.1], [5.2, 0.1, -3.0], [2.0, -1.5, 1.0], [-1.0, 3.0, 2.0]])


def motion(pose: np.ndarray, rate: float = 100.0, sigma: tuple[float, float] | None = None) -> Motion:
    n = len(pose)
    each = None if sigma is None else np.tile(sigma, (n, 1))
    return Motion(np.arange(n) / rate, np.asarray(pose, float), np.zeros((n, 2)), each, Quality(rate, 1.0))


def mapped(measured: np.ndarray, frame: np.ndarray = FRAME) -> np.ndarray:
    return np.array([compose(frame, m) for m in measured])


def close(pose: np.ndarray, to: np.ndarray) -> bool:
    return bool(np.allclose(pose[:2], to[:2], atol=1e-9) and abs(math.remainder(pose[2] - to[2], math.tau)) < 1e-9)


@given(
    st.floats(-50, 50), st.floats(-50, 50), st.floats(-math.pi, math.pi), st.integers(1, 4),
)  # fmt: skip
def test_a_tie_finds_the_frame_that_made_the_static_poses(x: float, y: float, theta: float, k: int) -> None:
    frame = np.array([x, y, theta])
    tie = frames.tie_by_static_poses(HOLDS[:k], mapped(HOLDS[:k], frame))
    assert close(tie.pose, frame)
    assert tie.residuals == pytest.approx(0, abs=1e-9)


def test_two_places_are_enough_without_headings_and_one_is_not() -> None:
    tie = frames.tie_by_points(HOLDS[:2, :2], mapped(HOLDS)[:2, :2])
    assert close(tie.pose, FRAME)
    with pytest.raises(ClearwayError, match="two places far apart"):
        frames.tie_by_points(HOLDS[:1, :2], mapped(HOLDS)[:1, :2])
    blind = HOLDS.copy()
    blind[:, 2] = np.nan
    assert close(frames.tie_by_static_poses(blind[:2], mapped(HOLDS)[:2]).pose, FRAME)
    with pytest.raises(ClearwayError, match="heading"):
        frames.tie_by_static_poses(blind[:1], mapped(HOLDS)[:1])


@pytest.mark.parametrize("k", [1, 2, 4])
def test_the_uncertainty_covers_what_noise_does(k: int) -> None:
    """Places near to and far from the pivot, over many draws: the rms error is the stated sigma within 8 %."""
    rng = np.random.default_rng(k)
    sigma = (0.005, 0.01)
    place = np.array([4.0, 3.0, 0.0])
    truth = compose(FRAME, place)
    errors, stated = [], []
    for _ in range(1500):
        noisy = mapped(HOLDS[:k]) + rng.normal(size=(k, 3)) * [sigma[0], sigma[0], sigma[1]]
        moved = frames.apply(frames.tie_by_static_poses(HOLDS[:k], noisy, sigma), motion(place[None], sigma=(0.0, 0.0)))
        errors.append([*(moved.pose[0, :2] - truth[:2]), math.remainder(moved.pose[0, 2] - truth[2], math.tau)])
        assert moved.sigma is not None
        stated.append(moved.sigma[0])
    position, heading = np.mean(np.square(errors), axis=0)[:2].sum(), np.mean(np.square(errors), axis=0)[2]
    # the lever arm counts across only: the sum over both axes lies between one and two times the stated variance
    least, most = np.mean(np.square(stated), axis=0)[0], 2.0 * np.mean(np.square(stated), axis=0)[0]
    assert 0.85 * least < position < 1.08 * most
    share = math.sqrt(heading / np.mean(np.square(stated), axis=0)[1])
    assert (0.92 if k == 1 else 0.75) < share < 1.08  # scatter of few residuals only ever enlarges it


def test_headings_and_places_weigh_as_they_should() -> None:
    """Lever arms of 0.1 m say little, headings decide; of 10 m, the places do."""
    for arm, expected in ((0.1, 0.05), (10.0, 0.0)):
        known = np.array([[-arm, 0, 0.0], [arm, 0, 0.0]])
        measured = known - [0, 0, 0.05]
        tie = frames.tie_by_static_poses(measured, known, (0.01, 0.01))
        weight = 2 / 0.01**2 / (2 / 0.01**2 + 2 * arm**2 / 0.01**2)
        assert tie.pose[2] == pytest.approx(0.05 * weight, abs=2e-3 * 0.05)
        assert tie.pose[2] == pytest.approx(expected, abs=0.1 * 0.05)


def test_a_mirrored_frame_is_named() -> None:
    mirrored = HOLDS * [1, -1, -1]
    with pytest.raises(ClearwayError, match=r"mirror image.*left-handed, or Y-up"):
        frames.tie_by_points(mirrored[:, :2], mapped(HOLDS)[:, :2])
    with pytest.raises(ClearwayError, match="mirror image"):
        frames.tie_by_static_poses(mirrored[:2], mapped(HOLDS)[:2])
    assert "mirrored frame as well" in frames.tie_by_points(HOLDS[:2, :2], mapped(HOLDS)[:2, :2]).note
    assert "mirrored" not in frames.tie_by_points(HOLDS[:, :2], mapped(HOLDS)[:, :2]).note


def test_millimetres_are_named() -> None:
    with pytest.raises(ClearwayError, match=r"1000 times as far apart.*unit of length"):
        frames.tie_by_points(1000 * HOLDS[:, :2], mapped(HOLDS)[:, :2])
    with pytest.raises(ClearwayError, match="unit of length"):
        frames.tie_by_points(1000 * HOLDS[:2, :2], mapped(HOLDS)[:2, :2])


@pytest.mark.parametrize("wrong", range(4))
def test_a_wrong_place_is_named(wrong: int) -> None:
    known = mapped(HOLDS)
    known[wrong, :2] += [0.3, -0.2]
    with pytest.raises(ClearwayError, match=rf"surveyed point {wrong + 1} lies 0\.36\d m from where the others"):
        frames.tie_by_points(HOLDS[:, :2], known[:, :2])
    known = mapped(HOLDS)
    known[wrong, 2] += math.pi  # the robot was put down the wrong way round
    with pytest.raises(ClearwayError, match=rf"static pose {wrong + 1} lies 3\.142 rad turned"):
        frames.tie_by_static_poses(HOLDS, known)


def test_two_places_that_disagree_show_a_residual_or_are_refused() -> None:
    known = np.array([[0.0, 0.0], [5.0, 0.0]])
    tie = frames.tie_by_points(np.array([[0.0, 0.0], [5.02, 0.0]]), known)
    assert tie.residuals == pytest.approx([0.01, 0.01])
    assert tie.sigma[0] == pytest.approx(math.sqrt(2 * 0.01**2) / math.sqrt(2))  # by the scatter, not the promise
    with pytest.raises(ClearwayError, match=r"4\.000 m apart in the source, 5\.000 m on the map"):
        frames.tie_by_points(np.array([[0.0, 0.0], [4.0, 0.0]]), known)


def test_applying_moves_the_pose_and_leaves_the_rest() -> None:
    theta = np.linspace(0, 9, 5)  # unwrapped, beyond a turn
    m = motion(np.stack([np.arange(5.0), np.zeros(5), theta], axis=1), sigma=(0.003, 0.002))
    m.pose[2] = np.nan
    tie = frames.given(np.array([1.0, 2.0, math.pi / 2]), (0.004, 0.01))
    moved = frames.apply(tie, m)
    assert moved.pose[1] == pytest.approx([1.0, 3.0, theta[1] + math.pi / 2])
    assert np.isnan(moved.pose[2]).all()
    assert moved.velocity is m.velocity
    assert moved.sigma is not None
    assert moved.sigma[3] == pytest.approx([math.sqrt(0.003**2 + 0.004**2 + 0.03**2), math.hypot(0.002, 0.01)])
    assert frames.apply(frames.given(np.zeros(3)), m).sigma is None


def test_a_static_pose_is_a_robust_mean() -> None:
    rng = np.random.default_rng(3)
    pose = np.array([1.0, 2.0, 0.5]) + rng.normal(size=(400, 3)) * [5e-4, 5e-4, 2e-3]
    pose[37] += 5.0  # a ghost marker
    pose[200:220] = np.nan
    found = frames.static_pose(motion(pose))
    assert found.pose == pytest.approx([1.0, 2.0, 0.5], abs=3e-4)
    assert 1e-5 < found.sigma[0] < 2e-4
    assert 5e-5 < found.sigma[1] < 5e-4


def test_a_static_pose_that_moved_is_refused() -> None:
    pose = np.tile([1.0, 2.0, 0.5], (600, 1))
    pose[500:, 0] += np.linspace(0, 0.3, 100)
    with pytest.raises(ClearwayError, match=r"moved by 0\.\d+ m.*rested longest from 0\.00 s to 5\.0\d s"):
        frames.static_pose(motion(pose))
    assert frames.static_pose(motion(pose), (0.0, 4.9)).pose == pytest.approx([1.0, 2.0, 0.5])
    turning = np.tile([1.0, 2.0, 0.5], (600, 1))
    turning[:, 2] += np.linspace(0, 0.1, 600)
    with pytest.raises(ClearwayError, match="turned by"):
        frames.static_pose(motion(turning))
    with pytest.raises(ClearwayError, match="are needed"):
        frames.static_pose(motion(pose), (100.0, 110.0))
    with pytest.raises(ClearwayError, match="are needed"):
        frames.static_pose(motion(np.zeros((0, 3))))


def test_nonsense_is_refused() -> None:
    with pytest.raises(ClearwayError, match="no finite x and y"):
        frames.tie_by_points(np.array([[0.0, 0.0], [np.nan, 1.0]]), np.zeros((2, 2)))
    with pytest.raises(ClearwayError, match="as many of both"):
        frames.tie_by_points(np.zeros((2, 2)), np.zeros((3, 2)))
    with pytest.raises(ClearwayError, match="no static pose"):
        frames.tie_by_static_poses(np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(ClearwayError, match="above 0"):
        frames.tie_by_points(HOLDS[:, :2], HOLDS[:, :2], 0.0)
    with pytest.raises(ClearwayError, match="far apart"):
        frames.tie_by_points(np.zeros((3, 2)), np.zeros((3, 2)))
    with pytest.raises(ClearwayError, match="not x, y"):
        frames.given(np.array([0.0, np.inf, 0.0]))
    with pytest.raises(ClearwayError, match="at least 0"):
        frames.given(np.zeros(3), (-1.0, 0.0))
