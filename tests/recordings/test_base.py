from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from marker_scenes import capture, straight

from clearway.errors import ClearwayError
from clearway.recordings.motion import base
from clearway.recordings.motion.markers import MarkerSet, learnt, motion_of_markers
from clearway.recordings.motion.motion import Motion, MotionSpec, Quality

LINK = np.array((-0.08, 0.05, 0.4))
"""base_link's pose in the body's frame."""


def of_body(pose: np.ndarray, link: np.ndarray = LINK) -> np.ndarray:
    """The body's pose (n, 3) where base_link's is `pose`."""
    theta = pose[:, 2] - link[2]
    c, s = np.cos(theta), np.sin(theta)
    x = pose[:, 0] - (c * link[0] - s * link[1])
    y = pose[:, 1] - (s * link[0] + c * link[1])
    return np.stack((x, y, theta), axis=1)


def moved(pose: np.ndarray, noise: float = 0.0, seed: int = 0) -> Motion:
    rng = np.random.default_rng(seed)
    seen = of_body(pose) + noise * rng.standard_normal(pose.shape)
    n = len(pose)
    return Motion(np.arange(n) / 100, seen, np.full((n, 2), np.nan), None, Quality(100.0, 1.0))


def turn(degrees: float, n: int = 600) -> np.ndarray:
    return np.stack((np.full(n, 2.0), np.full(n, 1.0), np.radians(np.linspace(0, degrees, n))), axis=1)


KNOWN = np.array((0.5, -0.3, 0.2))
STANDS = np.tile(KNOWN, (300, 1))
DRIVES = straight(2.0)[1]


def wrapped(base_: base.Base) -> float:
    return float(np.arctan2(base_.rotation[1, 0], base_.rotation[0, 0]))


def test_an_offset_is_the_pose_of_base_link() -> None:
    link = base.from_offset((0.1, -0.2, np.pi / 2), (0.001, 0.01))
    np.testing.assert_allclose(link.rotation @ (1, 0, 0) + link.point, (0.1, 0.8, 0), atol=1e-12)
    assert link.sigma == (0.001, 0.01)


def test_a_static_pose_and_a_straight_drive() -> None:
    link = base.from_static_and_straight(moved(STANDS, 0.0003), KNOWN, moved(DRIVES, 0.0003), placed=(0.002, 0.01))
    np.testing.assert_allclose(link.point, (*LINK[:2], 0), atol=0.0005)
    assert wrapped(link) == pytest.approx(LINK[2], abs=0.001)
    assert 0.002 < link.sigma[0] < 0.003
    assert 0 < link.sigma[1] < 0.002
    assert "2.00 m" in link.note


def test_the_drive_s_heading_counts_where_the_robot_was_placed_askew() -> None:
    askew = KNOWN + np.array((0, 0, 0.05))
    link = base.from_static_and_straight(moved(STANDS), askew, moved(DRIVES))
    assert wrapped(link) == pytest.approx(LINK[2], abs=1e-6)
    assert "differs from the drive's by -2.9 degrees" in link.note


def test_a_turn_in_place_finds_the_centre() -> None:
    link = base.from_static_and_straight(None, None, moved(DRIVES), turn=moved(turn(200), 0.0005))
    np.testing.assert_allclose(link.point[:2], LINK[:2], atol=0.0005)
    assert wrapped(link) == pytest.approx(LINK[2], abs=1e-6)
    assert 0 < link.sigma[0] < 0.001


def test_the_uncertainty_of_a_turn_in_place_that_wanders() -> None:
    off, told = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        pose = turn(270)
        phase, size = rng.uniform(0, 2 * np.pi, 2), 0.003
        pose[:, 0] += size * np.sin(2 * np.linspace(0, 4.7, 600) + phase[0])  # the wheels slip
        pose[:, 1] += size * np.sin(2 * np.linspace(0, 4.7, 600) + phase[1])
        link = base.from_static_and_straight(None, None, moved(DRIVES), turn=moved(pose, 0.0003, seed))
        off.append(link.point[:2] - LINK[:2])
        told.append(link.sigma[0])
    assert np.std(off) < 1.5 * np.mean(told)
    assert np.mean(told) < 4 * np.std(off)


def test_a_static_pose_alone() -> None:
    link = base.from_static(moved(STANDS, 0.0003), KNOWN, placed=(0.002, 0.01))
    np.testing.assert_allclose(link.point, (*LINK[:2], 0), atol=0.0005)
    assert wrapped(link) == pytest.approx(LINK[2], abs=0.0005)
    assert link.sigma[1] == 0.01


def test_the_drive_s_heading_is_as_sure_as_it_says() -> None:
    """A robot that wanders by a few millimetres and a degree about its line."""
    off, told = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        pose = DRIVES.copy()
        s = pose[:, 0]
        for k in (1, 2, 3):
            phase, size = rng.uniform(0, 2 * np.pi), 0.002 * rng.standard_normal()
            pose[:, 1] += size * np.sin(2 * np.pi * k * s / 2.0 + phase)
            pose[:, 2] += size * 2 * np.pi * k / 2.0 * np.cos(2 * np.pi * k * s / 2.0 + phase)
        link = base.from_static_and_straight(moved(STANDS), KNOWN, moved(pose, 0.0003, seed))
        off.append(wrapped(link) - LINK[2])
        told.append(link.sigma[1])
    share = (np.abs(off) < np.array(told)).mean()
    assert share > 0.6
    assert np.sqrt(np.mean(np.square(told))) < 4 * np.std(off)


BEND = np.stack((np.sin(np.linspace(0, 1, 300)), 1 - np.cos(np.linspace(0, 1, 300)), np.linspace(0, 1, 300)), axis=1)


@pytest.mark.parametrize(
    ("static", "pose", "drive", "spin", "told"),
    [
        (STANDS, KNOWN, straight(0.4, 0.2)[1], None, "0.40 m long; at least 0.5 m"),
        (STANDS, KNOWN, BEND, None, "not straight"),
        (STANDS, KNOWN, DRIVES[::-1], None, "driven in reverse"),
        (STANDS, KNOWN, np.concatenate((DRIVES, DRIVES[:200:-1])), None, "comes back by"),
        (DRIVES, KNOWN, DRIVES, None, "not at rest in the static pose"),
        (None, None, DRIVES, None, "gives the heading alone"),
        (None, None, DRIVES, turn(60), "covers 60 degrees; at least 90"),
        (None, None, DRIVES, turn(200) + (0.1, 0, 0) * np.linspace(-1, 1, 600)[:, None], "moves its centre by"),
        (STANDS * (1, 1, np.nan), KNOWN, DRIVES, None, "not seen with its heading"),
    ],
)
def test_what_does_not_tie(static, pose, drive, spin, told: str) -> None:
    with pytest.raises(ClearwayError, match=told) as caught:
        base.from_static_and_straight(
            None if static is None else moved(static),
            pose,
            moved(drive),
            turn=None if spin is None else moved(spin),
            file="plan.toml",
            field="robot",
        )
    assert (caught.value.file, caught.value.field) == ("plan.toml", "robot")


def test_a_straight_drive_that_is_blind_in_places() -> None:
    drive = moved(DRIVES)
    holed = drive.pose.copy()
    holed[200:260] = np.nan
    link = base.from_static_and_straight(moved(STANDS), KNOWN, replace(drive, pose=holed))
    assert wrapped(link) == pytest.approx(LINK[2], abs=1e-6)


def test_from_markers_to_base_link_without_coordinates() -> None:
    """The whole way, as in a lab: learn the markers, stand on a known pose, drive straight; then a trial."""
    rng = np.random.default_rng(2)
    drive = capture(*straight(2.0), rng=rng, gaps=0.02)
    names, spec = MarkerSet(drive.names), MotionSpec()
    own = learnt(drive, names, spec)
    t = np.arange(300) / 100
    stands = motion_of_markers(capture(t, STANDS, rng=rng, gaps=0.02), own, spec, None)
    link = base.from_static_and_straight(stands, KNOWN, motion_of_markers(drive, own, spec, None))
    t, pose = straight(3.0)
    motion = motion_of_markers(capture(t, pose, rng=rng, gaps=0.02), own, spec, link)
    assert np.abs(motion.pose - pose).max() < 0.002
    assert link.note in motion.notes
