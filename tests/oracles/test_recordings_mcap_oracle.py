"""Bags against independent readers: MCAP's own with mcap-ros2-support, and rosbags' for every container."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from clearway.recordings import formats
from clearway.recordings.exports.mcap import EPOCH, write_trial
from clearway.recordings.recording import Want

sys.path.insert(0, str(Path(__file__).parents[1] / "recordings"))
from driven_trials import forth_and_back
from made_bags import KINDS

mcap_ros2 = pytest.importorskip("mcap_ros2.reader")


def test_a_trial_is_read_by_mcap_ros2_support(tmp_path: Path) -> None:
    trial = forth_and_back()
    write_trial(tmp_path / "a.mcap", trial)
    found: dict[str, list[tuple[float, object]]] = {}
    for m in mcap_ros2.read_ros2_messages(str(tmp_path / "a.mcap")):
        found.setdefault(m.channel.topic, []).append((m.log_time_ns / 1e9 - EPOCH, m.ros_msg))
    truth = [(t, m.pose.pose) for t, m in found["/ground_truth/pose"]]
    np.testing.assert_allclose([t for t, _ in truth], trial.t, atol=1e-6)
    np.testing.assert_allclose([(p.position.x, p.position.y) for _, p in truth], trial.pose[:, :2], atol=1e-12)
    turn = np.unwrap([2 * np.arctan2(p.orientation.z, p.orientation.w) for _, p in truth])
    np.testing.assert_allclose(turn, trial.pose[:, 2], atol=1e-9)
    for (_, m), (x, y, _theta) in zip(found["/tf"], trial.estimate, strict=True):
        a, b = m.transforms
        assert (a.header.frame_id, a.child_frame_id, b.child_frame_id) == ("map", "odom", "base_link")
        half = np.arctan2(a.transform.rotation.z, a.transform.rotation.w)
        c, s, p = np.cos(2 * half), np.sin(2 * half), b.transform.translation
        at = a.transform.translation
        np.testing.assert_allclose((at.x + c * p.x - s * p.y, at.y + s * p.x + c * p.y), (x, y), atol=1e-9)
    twist = [(m.twist.twist.linear.x, m.twist.twist.angular.z) for _, m in found["/odom"]]
    np.testing.assert_allclose(twist, trial.velocity, atol=1e-12)
    for topic in set(found) - {"/events", "/cmd_vel"}:
        for t, m in found[topic]:
            parts = getattr(m, "transforms", None) or getattr(m, "markers", None) or [m]
            assert all(p.header.stamp.sec + p.header.stamp.nanosec / 1e9 - EPOCH == pytest.approx(t) for p in parts)
    names = [m.ns for m in found["/obstacles/static"][0][1].markers]
    assert names == [b.name for b in trial.attempt.bodies if b.pose is not None]


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "mcap-no-index"])
def test_odometry_is_as_rosbags_reads_it(tmp_path: Path, kind: str) -> None:
    path = KINDS[kind](tmp_path)
    track = formats.read(path, Want(frozenset({"/odom"}))).tracks["/odom"]
    with AnyReader([path]) as bag:
        raw = [
            bag.deserialize(data, c.msgtype)
            for c, _, data in bag.messages([c for c in bag.connections if c.topic == "/odom"])
        ]
        counts = {topic: info.msgcount for topic, info in bag.topics.items()}
    p = [m.pose.pose for m in raw]
    np.testing.assert_array_equal(track.position, [(x.position.x, x.position.y, x.position.z) for x in p])
    q = [(x.orientation.x, x.orientation.y, x.orientation.z, x.orientation.w) for x in p]
    np.testing.assert_allclose(track.orientation, q, atol=1e-15)
    assert counts == {e.name: e.count for e in formats.look(path).entries}
