"""Synthetic captures: what is known of them on paper."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from driven_trials import forth_and_back

from clearway.errors import ClearwayError
from clearway.recordings.exports.synthetic import (
    LAB,
    ROBOT,
    System,
    captured,
    held,
    marker_sets,
    moving_obstacle_at,
    robot_at,
    straight,
)


@pytest.fixture(scope="module")
def trial():
    return forth_and_back()


def test_markers_are_where_the_coordinates_say(trial):
    sets = marker_sets(trial)
    points = captured(trial, System(rate=10)).points
    assert [len(s) for s in sets.values()] == [8, 4, 4]
    assert points.names == tuple(name for s in sets.values() for name in s)
    np.testing.assert_allclose(points.t, trial.t, atol=1e-12)
    k = 47
    x, y, theta = trial.pose[k]
    for name, (a, b, z) in sets[ROBOT].items():
        expected = (x + math.cos(theta) * a - math.sin(theta) * b, y + math.sin(theta) * a + math.cos(theta) * b, z)
        np.testing.assert_allclose(points.xyz[k, points.names.index(name)], expected, atol=1e-12)


def test_no_two_distances_of_a_set_are_alike(trial):
    """Else a set could be taken for itself with two names changed, or for its mirror image."""
    for coordinates in marker_sets(trial).values():
        at = np.array(list(coordinates.values()))
        i, j = np.triu_indices(len(at), 1)
        distances = np.sort(np.linalg.norm(at[i] - at[j], axis=1))
        assert np.diff(distances).min() > 1e-4
        assert np.linalg.svd(at - at.mean(axis=0))[1].min() > 0.02  # neither collinear nor flat


def test_capture_frame_is_where_it_is_said(trial):
    """A marker in the capture's frame, taken to the map by hand, is the marker in the map."""
    x, y, turn = 1.0, -2.0, 0.5
    own = captured(trial, System(rate=10, frame=(x, y, turn))).points.xyz
    c, s = math.cos(turn), math.sin(turn)
    there = np.stack(
        [x + c * own[..., 0] - s * own[..., 1], y + s * own[..., 0] + c * own[..., 1], own[..., 2]], axis=2
    )
    np.testing.assert_allclose(there, captured(trial, System(rate=10)).points.xyz, atol=1e-12)


def test_noise_gaps_and_swap_are_what_was_asked(trial):
    clean, dirty = captured(trial, replace(LAB, noise=0.0, gaps=0.0, swaps=0)).points, captured(trial, LAB).points
    robot = slice(0, 8)
    lost = np.isnan(dirty.xyz[:, robot, 0]).mean(axis=0)
    np.testing.assert_allclose(lost, 0.02, atol=0.003)
    off = (dirty.xyz - clean.xyz)[:, robot]
    swapped = np.nan_to_num(np.abs(off)).max(axis=2) > 0.05
    assert sorted(swapped.sum(axis=0) > 0) == [False] * 6 + [True] * 2
    assert 0.2 < swapped.any(axis=1).mean() * (dirty.t[-1] + 0.01) < 0.9
    assert np.nanstd(off[~swapped]) == pytest.approx(0.0005, rel=0.03)


def test_same_seed_same_bits_and_another_seed_others(trial):
    one, again, other = (captured(trial, replace(LAB, seed=s)).points.xyz for s in (3, 3, 4))
    assert one.tobytes() == again.tobytes()
    assert one.tobytes() != other.tobytes()


def test_it_records_before_and_after_the_trial(trial):
    points = captured(trial, System(rate=100, lead=2.0, tail=1.0)).points
    assert points.t[-1] == pytest.approx(trial.t[-1] + 3.0, abs=0.011)
    robot = points.xyz[:, :8]
    assert np.ptp(robot[:201], axis=0).max() == 0.0
    assert np.ptp(robot[-100:], axis=0).max() < 1e-12


def test_between_samples_the_robot_drives_the_formula(trial):
    """Accelerating at 1 m/s^2 from x = -2.5: x(t) = -2.5 + t^2 / 2, which a cubic meets exactly."""
    t = np.linspace(0.0, 0.5, 51)
    np.testing.assert_allclose(robot_at(trial, t)[:, 0], -2.5 + t**2 / 2, atol=1e-12)


def test_heading_is_interpolated_across_pi():
    trial = forth_and_back(moving_obstacle=False)
    pose = trial.pose.copy()
    pose[:, 2] = np.arctan2(np.sin(trial.pose[:, 2] + 1.0), np.cos(trial.pose[:, 2] + 1.0))
    turned = replace(trial, pose=pose, velocity=None)
    theta = robot_at(turned, np.arange(0.0, trial.t[-1], 0.01))[:, 2]
    assert np.abs(np.diff(theta)).max() < 0.0101
    assert theta[-1] == pytest.approx(math.pi + 1.0)


def test_robot_that_still_drives_at_the_end_brakes(trial):
    k = 40
    cut = replace(
        trial,
        t=trial.t[: k + 1],
        pose=trial.pose[: k + 1],
        velocity=trial.velocity[: k + 1],
        moving_obstacles=trial.moving_obstacles[: k + 1],
    )
    end = robot_at(cut, np.array([cut.t[-1], cut.t[-1] + 10.0]))
    assert end[1, 0] - end[0, 0] == pytest.approx(0.6**2 / 2)


def test_moving_obstacle_is_absent_when_the_trial_says_so(trial):
    end = trial.spans[0].end
    track = moving_obstacle_at(trial, 0, np.array([-1.0, 1.25, end - 0.05, end + 0.15]))
    np.testing.assert_allclose(track[:3, 0], [3.4, 2.5, 3.0 - 0.4 * (end - 0.05)])
    assert np.isnan(track[3]).all()
    jumped = trial.moving_obstacles.copy()
    jumped[10:] += [3.0, 0.0, 0.0]
    track = moving_obstacle_at(replace(trial, moving_obstacles=jumped), 0, np.array([0.9, 0.95, 1.0]))
    assert np.isfinite(track[:, 0]).tolist() == [True, False, True]


def test_holds_and_straight_drive_for_the_ties(trial):
    still = held(trial, np.array([1.0, 2.0, 0.3]), System()).points
    assert np.ptp(still.xyz, axis=0).max() == 0.0
    drive = straight(trial, np.array([1.0, 2.0, 0.3]), System(), length=2.0).points.xyz[:, 0]
    way = drive[-1] - drive[0]
    np.testing.assert_allclose(way, [2.0 * math.cos(0.3), 2.0 * math.sin(0.3), 0.0], atol=1e-9)


def test_rigid_bodies_instead_of_markers(trial):
    tracks = captured(trial, System(rate=10), bodies=True).tracks
    assert list(tracks) == ["robot", "square_300", "person_500"]
    np.testing.assert_allclose(tracks["robot"].position[:, :2], trial.pose[:, :2], atol=1e-12)
    turn = 2 * np.arctan2(tracks["robot"].orientation[:, 2], tracks["robot"].orientation[:, 3])
    np.testing.assert_allclose(turn, trial.pose[:, 2], atol=1e-12)
    assert np.isnan(tracks["person_500"].position).any()


@pytest.mark.parametrize(("field", "value"), [("rate", 0), ("gaps", 1.0), ("noise", -1), ("noise", math.nan)])
def test_settings_that_make_no_sense_are_refused(field, value):
    with pytest.raises(ClearwayError, match=field):
        System(**{field: value})
