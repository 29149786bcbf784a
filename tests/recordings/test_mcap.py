"""Trials as MCAP: what comes out by our own reader is what went in, and the same trial gives the same bytes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from driven_trials import forth_and_back

from clearway.contract import Diagnostics
from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.exports.mcap import EPOCH, write_trial
from clearway.recordings.recording import Recording, Want
from clearway.trials import Body, Event, Snapshot, Trial


def there_and_back(path: Path, trial: Trial, *names: str, **options: object) -> Recording:
    write_trial(path, trial, **options)  # type: ignore[arg-type]
    return formats.read(path, Want(frozenset(names) or None))


def yaw(q: np.ndarray) -> np.ndarray:
    return np.unwrap(2 * np.arctan2(q[:, 2], q[:, 3]))


def test_poses_goals_and_moving_obstacles_come_back(tmp_path: Path) -> None:
    trial = forth_and_back()
    recording = there_and_back(tmp_path / "a.mcap", trial)
    assert recording.epoch == EPOCH
    for name, expected in (("/ground_truth/pose", trial.pose), ("/amcl_pose", trial.estimate)):
        track = recording.tracks[name]
        np.testing.assert_allclose(track.t, trial.t, atol=1e-9)
        np.testing.assert_allclose(track.position[:, :2], expected[:, :2], atol=1e-12)
        np.testing.assert_allclose(yaw(track.orientation), expected[:, 2], atol=1e-12)
        assert track.sigma is None
    believed = recording.tracks["map->base_link"]  # REP-105: map->odom->base_link is where it believes to be
    np.testing.assert_allclose(believed.position[:, :2], trial.estimate[:, :2], atol=1e-12)
    odom = recording.tracks["/odom"]
    np.testing.assert_allclose(odom.position[0], 0, atol=1e-12)
    np.testing.assert_allclose(odom.twist, trial.velocity, atol=1e-12)
    person = recording.tracks["/obstacles/person/pose"]
    seen = np.isfinite(trial.moving_obstacles[:, 0, 0])
    np.testing.assert_allclose(person.t, trial.t[seen], atol=1e-9)
    np.testing.assert_allclose(person.position[:, :2], trial.moving_obstacles[seen, 0, :2], atol=1e-12)
    goals = recording.goals["/goal_pose"]
    np.testing.assert_allclose(goals.t, [s.start for s in trial.spans], atol=1e-9)
    np.testing.assert_allclose(goals.pose, [leg.goal for leg in trial.attempt.legs], atol=1e-12)


def test_scans_meet_the_shapes(tmp_path: Path) -> None:
    trial = forth_and_back()
    scans = there_and_back(tmp_path / "a.mcap", trial, "/scan").scans["/scan"]
    middle = len(scans.t) // 8
    i = int(np.argmin(np.abs(trial.t - scans.t[middle])))
    sensor = trial.pose[i, :2] + [0.202, 0.0]  # tiago's lidar; the robot looks along x on the way forth
    angles = scans.angle_min + scans.angle_increment * np.arange(scans.ranges.shape[1])
    hits = sensor + scans.ranges[middle][:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    hits = hits[np.isfinite(hits).all(axis=1)]
    wall = np.abs(hits[:, 1] - 2.95) < 1e-5
    square = (np.abs(hits - [0.0, 0.2]).max(axis=1) - 0.15) < 1e-5
    person = np.abs(np.hypot(*(hits - trial.moving_obstacles[i, 0, :2]).T) - 0.25) < 1e-5
    assert (wall | square | person).all()
    assert wall.any()
    assert square.any()
    assert person.any()


def test_the_same_trial_gives_the_same_bytes(tmp_path: Path) -> None:
    trial = forth_and_back()
    for folder in ("a", "b"):
        write_trial(tmp_path / folder / "trial.mcap", trial)
        write_trial(tmp_path / folder / "bag", trial, scans=False, epoch=1.7e9)
    for name in ("trial.mcap", "bag/bag.mcap", "bag/metadata.yaml"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert sorted(p.name for p in (tmp_path / "a").iterdir()) == ["bag", "trial.mcap"]
    assert formats.look(tmp_path / "a" / "bag").epoch == 1.7e9
    assert "/scan" not in {e.name for e in formats.look(tmp_path / "a" / "bag").entries}


def test_what_is_unknown_is_left_out(tmp_path: Path) -> None:
    whole = forth_and_back()
    pose = whole.pose.copy()
    pose[5], pose[6, 2] = np.nan, np.nan
    sigma = np.full((len(whole.t), 2, 2), 0.02)
    trial = replace(whole, pose=pose, estimate=None, velocity=None, command=None, sigma=sigma,
                    attempt=replace(whole.attempt, robot="nobody's", footprint=None))  # fmt: skip
    recording = there_and_back(tmp_path / "a.mcap", trial)
    assert set(recording.tracks) == {"/ground_truth/pose", "/odom", "/obstacles/person/pose", "map->base_link",
                                     "odom->base_link", "map->odom"}  # fmt: skip
    track = recording.tracks["/ground_truth/pose"]
    assert len(track.t) == len(whole.t) - 1
    np.testing.assert_allclose(track.sigma, 0.02)
    assert np.isnan(track.orientation[5]).all()
    assert np.isfinite(track.orientation[6]).all()
    assert recording.tracks["/odom"].twist is None


def test_plans_events_and_names_that_ros_does_not_know(tmp_path: Path) -> None:
    trial = forth_and_back()
    bodies = (*trial.attempt.bodies, Body("person", "moving obstacle", trial.attempt.bodies[-1].shape, None),
              Body("2nd cart", "moving obstacle", trial.attempt.bodies[-1].shape, None))  # fmt: skip
    line = np.array([[0.0, 1.0], [2.0, 3.0]])
    trial = replace(
        trial,
        attempt=replace(trial.attempt, bodies=bodies),
        moving_obstacles=np.repeat(trial.moving_obstacles, 3, axis=1),
        events=(Event(2.0, "contact", "wall"), Event(1.0, "status", "ok")),
        snapshots=(Snapshot(0.5, Diagnostics({"global plan": line, "best tree": line + 1})),),
    )
    recording = there_and_back(tmp_path / "a.mcap", trial, "/plan", "/plan/best_tree", "/obstacles/person_2/pose",
                               "/obstacles/body_2nd_cart/pose")  # fmt: skip
    np.testing.assert_allclose(recording.paths["/plan"].lines[0], line)
    np.testing.assert_allclose(recording.paths["/plan"].t, [0.5])
    assert len(recording.tracks) == 2
    assert {e.name: e.count for e in formats.look(tmp_path / "a.mcap").entries}["/events"] == 2


def test_what_cannot_be_written_is_told(tmp_path: Path) -> None:
    trial = forth_and_back()
    (tmp_path / "there.mcap").write_text("x")
    with pytest.raises(ClearwayError, match="exists already"):
        write_trial(tmp_path / "there.mcap", trial)
    with pytest.raises(ClearwayError, match="cannot be written"):
        write_trial(tmp_path / "there.mcap" / "a.mcap", trial)
    with pytest.raises(ClearwayError, match="none that a ROS message can hold"):
        write_trial(tmp_path / "b.mcap", trial, epoch=-5.0)
