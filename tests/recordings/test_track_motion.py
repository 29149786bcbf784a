from __future__ import annotations

import numpy as np
import pytest
from marker_scenes import circle, path_length, straight
from scipy.spatial.transform import Rotation

from clearway.errors import ClearwayError
from clearway.recordings.motion import base
from clearway.recordings.motion.markers import motion_of_track
from clearway.recordings.motion.motion import MotionSpec
from clearway.recordings.recording import Track

SPEC = MotionSpec()


def track(t: np.ndarray, pose: np.ndarray, kind: str = "body", *, oriented: bool = True, **more: object) -> Track:
    position = np.concatenate((pose[:, :2], np.full((len(t), 1), 0.5)), axis=1)
    turned = Rotation.from_euler("z", pose[:, 2:]).as_quat().reshape(-1, 4) if oriented else None
    return Track(kind, "map", "base_link", t, position, turned, **more)


def test_a_tracked_body_with_noise() -> None:
    t, pose = circle(2000)
    noisy = pose + 0.0005 * np.random.default_rng(1).standard_normal(pose.shape)
    motion = motion_of_track(track(t, noisy), SPEC, None)
    assert np.sqrt(((motion.pose - pose) ** 2).mean()) < 0.0003
    assert motion.velocity[200:-200, 0] == pytest.approx(0.5, abs=0.02)
    inside = (np.abs(motion.pose - pose) < motion.sigma[:, [0, 0, 1]]).mean()
    assert 0.5 < inside < 0.95
    assert motion.quality.cutoff is not None


def test_base_link_beside_what_is_tracked() -> None:
    t, pose = circle(500)
    link = base.from_offset((0.3, 0.0, 0.1), (0.003, 0.02))
    motion = motion_of_track(track(t, pose), MotionSpec(cutoff="none"), link)
    np.testing.assert_allclose(motion.pose[:, 0], pose[:, 0] + 0.3 * np.cos(pose[:, 2]), atol=1e-9)
    np.testing.assert_allclose(motion.pose[:, 2], pose[:, 2] + 0.1, atol=1e-9)
    assert motion.sigma[:, 0].min() >= 0.003
    assert motion.sigma[:, 1].min() >= 0.02
    assert link.note in motion.notes


def test_headings_go_on_over_a_full_turn_and_holes() -> None:
    t, pose = circle(3000)
    holed = track(t, pose)
    holed.orientation[100:110] = np.nan
    holed.orientation[500] = 0.0
    holed.position[700:760] = np.nan
    motion = motion_of_track(holed, SPEC, None)
    assert np.isfinite(motion.pose[100:110]).all()
    assert np.isnan(motion.pose[700:760]).all()
    assert motion.pose[-1, 2] - motion.pose[0, 2] == pytest.approx(14.995, abs=0.01)
    assert motion.quality.seen == pytest.approx(1 - 71 / 3000)


def test_stamps_without_a_beat() -> None:
    rng = np.random.default_rng(2)
    t = np.sort(rng.uniform(0, 20, 1500))
    a = 0.5 * t
    pose = np.stack((np.cos(a), np.sin(a), a + np.pi / 2), axis=1)
    motion = motion_of_track(track(t, pose + 0.001 * rng.standard_normal(pose.shape)), MotionSpec(cutoff=3), None)
    assert np.sqrt(((motion.pose - pose) ** 2).mean()) < 0.0012
    assert path_length(motion.pose) == pytest.approx(path_length(pose), rel=0.01)


def test_a_localisation_stays_as_it_is_and_its_jumps_are_told() -> None:
    t, pose = straight(3.0, rate=20.0)
    pose[60:, 1] += 0.4
    motion = motion_of_track(track(t, pose, "pose"), SPEC, None)
    np.testing.assert_array_equal(motion.pose[:, :2], pose[:, :2])
    assert any("jumps 1 times, by up to 0.40 m" in note for note in motion.notes)
    assert any("not filtered" in note for note in motion.notes)
    assert motion.sigma is None
    filtered = motion_of_track(track(t, pose, "pose"), MotionSpec(cutoff=3), None)
    assert filtered.pose[60, 1] - filtered.pose[59, 1] == pytest.approx(0.4, abs=1e-6)


def test_what_the_file_states_is_kept() -> None:
    t, pose = straight(3.0)
    stated = np.tile((0.05, 0.1), (len(t), 1))
    twist = np.tile((0.7, 0.2), (len(t), 1))
    twist[5] = np.nan
    motion = motion_of_track(track(t, pose, "odometry", sigma=stated, twist=twist), SPEC, None)
    np.testing.assert_allclose(motion.sigma, stated)
    assert motion.velocity[4].tolist() == [0.7, 0.2]
    assert motion.velocity[5, 0] == pytest.approx(0, abs=0.01)


def test_a_person_looks_where_they_go() -> None:
    t = np.arange(200) * 0.4
    walks = np.minimum(t, 40.0)
    pose = np.stack((walks * 0.6, walks * 0.8, np.zeros(200)), axis=1)
    person = track(t, pose, "person", oriented=False)
    motion = motion_of_track(person, SPEC, None, heading="travel")
    assert motion.pose[:95, 2] == pytest.approx(np.arctan2(0.8, 0.6))
    assert np.isnan(motion.pose[110:, 2]).all()
    assert motion.velocity[:95, 0] == pytest.approx(1.0)
    unknown = motion_of_track(person, SPEC, None)
    assert np.isnan(unknown.pose[:, 2]).all()
    assert unknown.velocity[:95, 0] == pytest.approx(1.0, abs=0.001)
    assert np.isnan(unknown.velocity[:, 1]).all()


def test_travel_around_a_circle_turns_on() -> None:
    t, pose = circle(2600)
    motion = motion_of_track(track(t, pose, oriented=False), SPEC, None, heading="travel")
    assert motion.pose[-1, 2] - motion.pose[0, 2] == pytest.approx(pose[-1, 2] - pose[0, 2], abs=0.01)
    assert motion.velocity[300:-300, 1] == pytest.approx(0.5, abs=0.01)


def test_tracks_that_tell_nothing() -> None:
    t, pose = straight(3.0)
    with pytest.raises(ClearwayError, match=r"t.csv: robot: the track holds no position"):
        motion_of_track(track(t, pose * np.nan, oriented=False), SPEC, None, file="t.csv", field="robot")
    with pytest.raises(ClearwayError, match="no orientation"):
        motion_of_track(Track("body", "", "", t, np.zeros((len(t), 3)), np.zeros((len(t), 4))), SPEC, None)
    with pytest.raises(ClearwayError, match="without a measured heading"):
        motion_of_track(track(t, pose, oriented=False), SPEC, base.from_offset((0.1, 0, 0)))


def test_a_y_up_orientation_is_said() -> None:
    t = np.arange(300) / 100
    lying = Track("body", "", "", t, np.zeros((len(t), 3)), np.tile((np.sqrt(0.5), 0, 0, np.sqrt(0.5)), (len(t), 1)))
    assert any("leans by 90.0 degrees" in note for note in motion_of_track(lying, SPEC, None).notes)


def test_a_single_pose() -> None:
    motion = motion_of_track(track(np.zeros(1), np.zeros((1, 3))), SPEC, None)
    np.testing.assert_allclose(motion.pose, 0)
