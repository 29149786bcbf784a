"""Bags: what is read of every container and compression is what was written, and lies are refused."""

from __future__ import annotations

import math
import sqlite3
import struct
from pathlib import Path

import made_bags
import numpy as np
import pytest
from made_bags import KINDS, SIGMA, SPEED, START, TURN, circle, messages, write_mcap, write_ros1

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.formats import bag_definitions, bag_limits, bag_messages
from clearway.recordings.recording import Recording, Want


def read(path: Path, *names: str, span: tuple[float, float] | None = None) -> Recording:
    return formats.read(path, Want(frozenset(names) or None, span))


def rewritten(path: Path, old: bytes, new: bytes) -> Path:
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new))
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_every_container_and_compression_gives_what_was_driven(tmp_path: Path, kind: str) -> None:
    path = KINDS[kind](tmp_path)
    recording = read(path)
    assert (recording.format, recording.epoch) == ("bag", START / 1e9)
    assert set(recording.tracks) == {"/odom", "map->base_link", "odom->base_link", "map->odom"}
    assert not recording.scans
    assert not recording.paths
    odom = recording.tracks["/odom"]
    assert (odom.kind, odom.frame, odom.child) == ("odometry", "odom", "base_link")
    np.testing.assert_allclose(odom.t, 0.1 * np.arange(40), atol=1e-9)
    np.testing.assert_allclose(odom.position[:, :2], [circle(t)[:2] for t in odom.t])
    yaw = 2 * np.arctan2(odom.orientation[:, 2], odom.orientation[:, 3])
    np.testing.assert_allclose(yaw, TURN * odom.t, atol=1e-12)
    np.testing.assert_allclose(odom.twist, np.tile([SPEED, TURN], (40, 1)))
    np.testing.assert_allclose(odom.sigma, np.tile(SIGMA, (40, 1)))
    held = recording.tracks["map->base_link"]  # map->odom ends at 3.5 s: tf2 doesn't extrapolate either
    assert held.t[-1] == pytest.approx(3.5)
    x, y, _ = circle(3.5)
    np.testing.assert_allclose(held.position[-1], [-10 - y, x, 0], atol=1e-12)
    goals = recording.goals["/goal_pose"]
    assert goals.frame == "map"
    np.testing.assert_allclose(goals.t, [0.0])  # by its stamp, though recorded later
    np.testing.assert_allclose(goals.pose, [[1, 2, 0.5]])


@pytest.mark.parametrize("kind", KINDS)
def test_look_lists_every_topic_with_counts_and_rates(tmp_path: Path, kind: str) -> None:
    contents = formats.look(KINDS[kind](tmp_path))
    assert contents.duration == pytest.approx(3.9)
    found = {e.name: (e.kind, e.count) for e in contents.entries}
    assert found == {
        "/odom": ("odometry", 40),
        "/tf": ("tf", 40),
        "/tf_static": ("tf", 1),
        "/scan": ("scan", 8),
        "/goal_pose": ("goal", 1),
        "/plan": ("path", 1),
        "/odd": ("other", 1),
    }
    entries = {e.name: e for e in contents.entries}
    assert entries["/odom"].rate == pytest.approx(10)
    assert "odom->base_link" in entries["/odom"].detail
    assert "map->odom, odom->base_link" in entries["/tf"].detail
    assert "odd_msgs" in entries["/odd"].detail


@pytest.mark.parametrize("kind", ["ros1", "mcap", "mcap-bare", "db3"])
def test_names_and_span_say_what_is_read(tmp_path: Path, kind: str) -> None:
    path = KINDS[kind](tmp_path)
    recording = read(path, "/scan", "/plan", "/map -> base_scan", span=(1.0, 2.0))
    assert set(recording.tracks) == {"/map -> base_scan"}  # as it was asked for
    assert not recording.goals
    scans = recording.scans["/scan"]
    np.testing.assert_allclose(scans.t, [1.0, 1.5, 2.0])
    np.testing.assert_allclose(scans.ranges[:, 1], [2.0, 2.5, 3.0])
    assert np.isinf(scans.ranges[:, 0]).all()  # 99 m is beyond range_max
    assert (scans.frame, scans.angle_min, scans.angle_increment, scans.range_max) == ("base_scan", -1.0, 0.25, 20.0)
    track = recording.tracks["/map -> base_scan"]
    assert track.t[0] >= 1.0
    assert track.t[-1] <= 2.0
    x, y, yaw = circle(float(track.t[3]))
    ahead = x + 0.2 * math.cos(yaw), y + 0.2 * math.sin(yaw)
    np.testing.assert_allclose(track.position[3], [-10 - ahead[1], ahead[0], 0], atol=1e-12)
    assert recording.paths["/plan"].t.size == 0  # it was stamped at 0 s
    np.testing.assert_allclose(read(path, "/plan").paths["/plan"].lines[0], [[1, 2], [3, 4]])


def test_unknown_names_tell_the_closest(tmp_path: Path) -> None:
    path = KINDS["mcap"](tmp_path)
    for name, hint in (
        ("/odm", "did you mean '/odom'"),
        ("map->base_lnk", "did you mean 'base_link'"),
        ("/odd", "odd_msgs/msg/Odd"),
        ("/tf", "name a pair"),
    ):
        with pytest.raises(ClearwayError, match=hint):
            read(path, name)
    with pytest.raises(ClearwayError, match="nothing between these frames moves"):
        read(path, "base_link->base_scan")


def test_frames_that_are_not_connected_tell_what_is(tmp_path: Path) -> None:
    robot = made_bags.Robot(2)
    tf = "tf2_msgs/msg/TFMessage"
    lines = [
        ("/tf", tf, START + i, robot.make(tf, [robot.transform(START + i, a, b, 0.0, 0.0, 0.0)]))
        for i, (a, b) in enumerate([("odom", "base_link"), ("world", "cart")])
    ]
    path = write_mcap(tmp_path / "a.mcap", lines)
    with pytest.raises(ClearwayError, match="not connected; from 'odom' one gets to base_link; from 'cart' to world"):
        read(path, "odom->cart")


def test_without_a_stamp_the_time_of_recording_stands_for_it(tmp_path: Path) -> None:
    recording = read(write_ros1(tmp_path / "a.bag", messages(1, stamped=False)), "/odom")
    np.testing.assert_allclose(recording.tracks["/odom"].t, 0.1 * np.arange(40), atol=1e-9)
    assert "40 messages have no stamp" in " ".join(recording.notes)


def test_stamps_backwards_twice_and_leaping(tmp_path: Path) -> None:
    robot, kind = made_bags.Robot(2), "geometry_msgs/msg/PoseStamped"

    def bag_of(name: str, *stamps: float) -> Path:
        lines = []
        for i, t in enumerate(stamps):
            at = START + int(t * 1e9)
            lines.append(("/p", kind, START + i, robot.stamped(at, "map", float(i), 0.0, 0.0)))
        return write_mcap(tmp_path / name, lines)

    recording = read(bag_of("a.mcap", 0.0, 2.0, 1.0, 2.0))
    np.testing.assert_array_equal(recording.tracks["/p"].position[:, 0], [0, 2, 1])
    assert "1 samples were out of order" in recording.notes[0]
    assert "1 samples had the stamp of the one before" in recording.notes[1]
    leap = bag_of("b.mcap", -3000.0, 0.0, 3500.0, 3600.0)
    assert len(read(leap).tracks["/p"].t) == 4
    far = write_mcap(
        tmp_path / "c.mcap",
        [("/p", kind, START + s * 10**9, robot.stamped(START + s * 10**9, "map", 0.0, 0.0, 0.0)) for s in (0, 1, 9000)],
    )
    with pytest.raises(ClearwayError, match="/p: time leaps by 8999 s"):
        read(far, "/p")
    left = read(far)
    assert not left.tracks
    assert "/p: left out, as time leaps" in left.notes[0]
    assert len(read(far, "/p", span=(0.0, 5.0)).tracks["/p"].t) == 2


def test_stamps_of_a_simulation_keep_their_distances(tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "a.mcap", messages(2, late=START - 5_000_000_000))  # simulated time from 5 s on
    recording = read(path, "/odom", "odom->base_link")
    for track in recording.tracks.values():
        np.testing.assert_allclose(track.t, 0.1 * np.arange(40), atol=1e-9)
    assert "another clock" in " ".join(recording.notes)
    np.testing.assert_array_equal(read(path, "/odom").tracks["/odom"].t, recording.tracks["/odom"].t)


def test_a_transform_sent_once_before_the_span_still_holds(tmp_path: Path) -> None:
    robot = made_bags.Robot(2)
    tf = "tf2_msgs/msg/TFMessage"
    lines = [("/tf", tf, START, robot.make(tf, [robot.transform(START, "map", "odom", 1.0, 0.0, 0.0)]))]
    for i in range(100):
        at = START + i * 1_000_000_000
        lines.append(("/tf", tf, at, robot.make(tf, [robot.transform(at, "odom", "base_link", float(i), 0.0, 0.0)])))
    track = read(write_mcap(tmp_path / "a.mcap", lines), "map->base_link", span=(50, 60)).tracks["map->base_link"]
    np.testing.assert_allclose(track.position[:, 0], np.arange(51.0, 62.0))


def test_goals_of_move_base_and_poses_of_captured_bodies(tmp_path: Path) -> None:
    robot = made_bags.Robot(1)
    stamp = robot.make("builtin_interfaces/msg/Time", 0, 0)
    target = robot.stamped(START, "/map", 3.0, 4.0, 1.0)
    goal = robot.make(
        "move_base_msgs/msg/MoveBaseActionGoal",
        robot.header(START + 5, ""),
        robot.make("actionlib_msgs/msg/GoalID", stamp, "g"),
        robot.make("move_base_msgs/msg/MoveBaseGoal", target),
    )
    body = robot.transform(START, "world", "vicon/cart/cart", 1.0, 2.0, 0.3)
    lines = [
        ("/move_base/goal", "move_base_msgs/msg/MoveBaseActionGoal", START, goal),
        ("/vicon/cart/cart", "geometry_msgs/msg/TransformStamped", START, body),
        ("/vrpn/goalpost/pose", "geometry_msgs/msg/PoseStamped", START, target),
        ("/move_base/current_goal", "geometry_msgs/msg/PoseStamped", START, target),
    ]
    recording = read(write_ros1(tmp_path / "a.bag", lines))
    for topic in ("/move_base/goal", "/move_base/current_goal"):
        np.testing.assert_allclose(recording.goals[topic].pose, [[3, 4, 1]])
    assert set(recording.tracks) == {"/vicon/cart/cart", "/vrpn/goalpost/pose"}
    track = recording.tracks["/vicon/cart/cart"]
    assert (track.frame, track.child) == ("world", "vicon/cart/cart")
    np.testing.assert_allclose(track.position, [[1, 2, 0]])


def test_one_topic_of_several_bodies_gives_one_track_each(tmp_path: Path) -> None:
    robot, kind = made_bags.Robot(2), "motion_capture_tracking_interfaces/msg/NamedPose"
    lines = []
    for i in range(3):
        seen = [("robot", float(i)), ("cart", -float(i))][: 1 + (i != 1)]  # the cart is out of sight once
        poses = [robot.make(kind, name, robot.pose(x, 1.0, 0.2)) for name, x in seen]
        at = START + i * 10_000_000
        lines.append(("/poses", f"{kind}Array", at, robot.make(f"{kind}Array", robot.header(at, "world"), poses)))
    path = write_mcap(tmp_path / "a.mcap", lines)
    both = read(path).tracks
    assert {name: (t.kind, t.frame, t.child, len(t.t)) for name, t in both.items()} == {
        "/poses/robot": ("body", "world", "robot", 3),
        "/poses/cart": ("body", "world", "cart", 2),
    }
    np.testing.assert_allclose(read(path, "/poses/cart").tracks["/poses/cart"].position[:, 0], [0, -2])
    with pytest.raises(ClearwayError, match="unknown body '/poses/card'; did you mean '/poses/cart'"):
        read(path, "/poses/robot", "/poses/card")


def test_what_was_not_measured_is_unknown(tmp_path: Path) -> None:
    robot = made_bags.Robot(2)
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    lines = []
    for i, variance in enumerate((0.0, 0.04, -1.0, 1e9)):
        covariance = np.zeros(36)
        covariance[[0, 7, 35]] = variance
        pose = robot.pose(1.0, 2.0, 0.0)
        if i == 3:
            pose.orientation.w = 0.0
        held = robot.make("geometry_msgs/msg/PoseWithCovariance", pose, covariance)
        lines.append(("/p", kind, START + i, robot.make(kind, robot.header(START + i, "map"), held)))
    track = read(write_mcap(tmp_path / "a.mcap", lines)).tracks["/p"]
    np.testing.assert_array_equal(track.sigma, [[np.nan] * 2, [0.2, 0.2], [np.nan] * 2, [np.nan] * 2])
    np.testing.assert_array_equal(np.isnan(track.orientation).any(axis=1), [False, False, False, True])


@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize("variance", [1e155, 1e308, np.inf, np.nan])
def test_an_absurd_covariance_is_unknown_whatever_its_size(tmp_path: Path, ros: int, variance: float) -> None:
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    robot, lines = made_bags.Robot(ros), []
    for i, places in enumerate(((0, 7, 35), (1,), (7,))):
        covariance = np.zeros(36)
        covariance[[0, 7, 35]] = 0.04
        covariance[[*places]] = variance
        held = robot.make("geometry_msgs/msg/PoseWithCovariance", robot.pose(1.0, 2.0, 0.0), covariance)
        lines.append(("/p", kind, START + i, robot.make(kind, robot.header(START + i, "map"), held)))
    path = tmp_path / ("a.bag" if ros == 1 else "a.mcap")
    track = read((write_ros1 if ros == 1 else write_mcap)(path, lines)).tracks["/p"]
    assert track.sigma is not None
    assert np.isnan(track.sigma[:, 0]).all()
    np.testing.assert_allclose(track.sigma[:, 1], [np.nan, 0.2, 0.2])


def test_a_definition_that_says_something_else_is_refused(tmp_path: Path) -> None:
    path = rewritten(
        write_mcap(tmp_path / "a.mcap", messages(2), enable_crcs=False),
        b"PoseWithCovariance pose",
        b"PoseWithCovariance pise",
    )
    with pytest.raises(ClearwayError, match=r"/odom: .*definition of nav_msgs/msg/Odometry differs"):
        read(path, "/odom")
    assert "/odom" not in read(path).tracks
    assert {e.name: e.kind for e in formats.look(path).entries}["/odom"] == "other"


def test_bags_without_definitions_are_read_by_the_standard_ones(tmp_path: Path) -> None:
    path = KINDS["db3"](tmp_path)
    with sqlite3.connect(path) as base:
        base.execute("DROP TABLE message_definitions")
    base.close()
    assert len(read(path).tracks["/odom"].t) == 40
    ros1, ros2 = (set(bag_definitions.typestore(old).fielddefs) for old in (True, False))
    assert set(bag_messages.KINDS) <= ros1 | ros2
    assert set(bag_messages.KINDS) - ros1 <= {
        "action_msgs/msg/GoalStatusArray",
        "nav2_msgs/action/NavigateToPose_FeedbackMessage",
    }


@pytest.mark.parametrize(
    ("kind", "mend"),
    [
        ("ros1", "rosbag reindex"),
        ("mcap", "mcap recover"),
        ("mcap-bare", "mcap recover"),
        ("db3", "is truncated"),
    ],
)
def test_a_truncated_bag_is_refused_and_it_says_how_to_mend_it(tmp_path: Path, kind: str, mend: str) -> None:
    path = KINDS[kind](tmp_path)
    whole = path.read_bytes()
    for share in (0.3, 0.6, 0.95):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(ClearwayError, match=mend):
            read(path)
        with pytest.raises(ClearwayError, match=mend):
            formats.look(path)
    path.write_bytes(b"")
    with pytest.raises(ClearwayError, match="is empty"):
        read(path)


def test_a_ros1_bag_that_was_not_closed_is_refused(tmp_path: Path) -> None:
    path = KINDS["ros1"](tmp_path)
    data = path.read_bytes()
    at = data.index(b"index_pos=") + len(b"index_pos=")
    path.write_bytes(data[:at] + bytes(8) + data[at + 8 :])
    with pytest.raises(ClearwayError, match=r"was not closed.*rosbag reindex"):
        read(path)
    path.write_bytes(b"#ROSBAG V1.2\n" + data[13:])
    with pytest.raises(ClearwayError, match=r"version '1.2'.*rosbag fix"):
        read(path)


def test_a_folder_tells_what_it_lacks(tmp_path: Path) -> None:
    folder = KINDS["ros2-mcap"](tmp_path)
    (folder / "metadata.yaml").rename(tmp_path / "metadata.yaml")
    recording = read(folder)
    assert len(recording.tracks["/odom"].t) == 40
    assert "no metadata.yaml" in " ".join(recording.notes)
    (folder / "metadata.yaml").write_text((tmp_path / "metadata.yaml").read_text().replace("- a.mcap", "- b.mcap"))
    with pytest.raises(ClearwayError, match=r"names the file b.mcap, which is missing"):
        read(folder)
    for text in ("nonsense", "[" * 5_000, "- " * 5_000, "rosbag2_bagfile_information: 1"):
        (folder / "metadata.yaml").write_text(text)
        with pytest.raises(ClearwayError, match=r"is no metadata of a ROS 2 bag.*ros2 bag reindex"):
            read(folder)
    base = KINDS["db3"](tmp_path / "b")
    base.with_name("a.db3-wal").write_bytes(b"more")
    with pytest.raises(ClearwayError, match=r"was not closed.*wal_checkpoint"):
        read(base)


def test_absurd_claims_are_refused_before_anything_is_decompressed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bag_limits, "CHUNK", 1 << 20)
    robot = made_bags.Robot(2)
    text = robot.make("std_msgs/msg/String", "\0" * (1 << 20))
    bomb = write_mcap(tmp_path / "bomb.mcap", [("/s", "std_msgs/msg/String", START, text)], compression="zstd")
    assert bomb.stat().st_size < 10_000
    with pytest.raises(ClearwayError, match=r"claims to hold 10487\d+; at most 1048576"):
        formats.look(bomb)
    monkeypatch.setattr(bag_limits, "FREE", 0)
    monkeypatch.setattr(bag_limits, "RATIO", 2)
    with pytest.raises(ClearwayError, match="its chunks claim to hold more than 2 times"):
        formats.look(KINDS["mcap-zstd"](tmp_path))


@pytest.mark.parametrize("compression", ["bz2", "lz4", "zstd"])
def test_a_chunk_that_gives_more_than_it_claims_is_refused(tmp_path: Path, compression: str) -> None:
    if compression == "zstd":
        path, mark = KINDS["mcap-zstd"](tmp_path), struct.pack("<I", 4) + b"zstd"
        data = bytearray(path.read_bytes())
        at = data.index(mark) - 12  # uncompressed size, crc, compression
        data[at : at + 8] = struct.pack("<Q", struct.unpack_from("<Q", data, at)[0] - 1)
    else:
        path = KINDS[f"ros1-{compression}"](tmp_path)
        data = bytearray(path.read_bytes())
        at = data.index(b"size=", data.index(b"compression=")) + 5
        data[at : at + 4] = struct.pack("<I", struct.unpack_from("<I", data, at)[0] - 1)
    path.write_bytes(data)
    with pytest.raises(ClearwayError, match=r"holds not the .* bytes that it claims"):
        read(path)


def test_sniff_knows_bags_by_their_first_bytes(tmp_path: Path) -> None:
    for kind in ("ros1", "mcap", "db3"):
        (tmp_path / kind).mkdir()
        path = KINDS[kind](tmp_path / kind)
        other = path.rename(path.with_suffix(".dat"))
        assert formats.identify(other).name == "bag"
        assert len(read(other).tracks) == 4
    (tmp_path / "empty").mkdir()
    with pytest.raises(ClearwayError, match="no ROS 2 bag"):
        formats.identify(tmp_path / "empty")
