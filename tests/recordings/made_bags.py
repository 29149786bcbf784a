"""Bags of a robot that drives a circle, in every container and compression, written by rosbags' and mcap's own writers.

The robot drives a circle of 2 m around (0, 2) at 0.5 m/s, so at t it is at 2 sin(t / 4), 2 - 2 cos(t / 4), t / 4. The map
frame lies 10 m behind odom's origin and is turned by a right angle; the scanner is 0.2 m ahead of base_link.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as PlainMcap
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START = 1_700_000_000_000_000_000
"""ns"""
SPEED, TURN = 0.5, 0.25
SIGMA = (0.02, 0.01)

STORES = {1: get_typestore(Stores.ROS1_NOETIC), 2: get_typestore(Stores.ROS2_HUMBLE)}
for _store in STORES.values():
    _more = {"move_base_msgs/msg/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose",
             "move_base_msgs/msg/MoveBaseActionGoal":
                 "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\nMoveBaseGoal goal",
             "odd_msgs/msg/Odd": "float64 odd"}  # fmt: skip
    _tracking = "motion_capture_tracking_interfaces/msg/"
    _more[f"{_tracking}NamedPose"] = "string name\ngeometry_msgs/Pose pose"
    _more[f"{_tracking}NamedPoseArray"] = "std_msgs/Header header\nNamedPose[] poses"
    if "tf2_msgs/msg/TFMessage" not in _store.fielddefs:
        _more["tf2_msgs/msg/TFMessage"] = "geometry_msgs/TransformStamped[] transforms"
    for _name, _text in _more.items():
        _store.register(get_types_from_msg(_text, _name))


class Robot:
    """Makes messages of one ROS version."""

    def __init__(self, ros: int) -> None:
        self.ros, self.store = ros, STORES[ros]

    def make(self, kind: str, *values: Any) -> Any:
        return self.store.types[kind](*values)

    def header(self, ns: int, frame: str) -> Any:
        stamp = self.make("builtin_interfaces/msg/Time", *divmod(ns, 1_000_000_000))
        return self.make("std_msgs/msg/Header", *(0,) * (self.ros == 1), stamp, frame)

    def vector(self, x: float, y: float, z: float, kind: str = "Vector3") -> Any:
        return self.make(f"geometry_msgs/msg/{kind}", x, y, z)

    def turned(self, yaw: float) -> Any:
        return self.make("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))

    def pose(self, x: float, y: float, yaw: float) -> Any:
        return self.make("geometry_msgs/msg/Pose", self.vector(x, y, 0.0, "Point"), self.turned(yaw))

    def stamped(self, ns: int, frame: str, x: float, y: float, yaw: float) -> Any:
        return self.make("geometry_msgs/msg/PoseStamped", self.header(ns, frame), self.pose(x, y, yaw))

    def transform(self, ns: int, parent: str, child: str, x: float, y: float, yaw: float) -> Any:
        return self.make(
            "geometry_msgs/msg/TransformStamped",
            self.header(ns, parent),
            child,
            self.make("geometry_msgs/msg/Transform", self.vector(x, y, 0.0), self.turned(yaw)),
        )

    def odometry(self, ns: int, x: float, y: float, yaw: float) -> Any:
        covariance = np.zeros(36)
        covariance[[0, 7, 35]] = SIGMA[0] ** 2, SIGMA[0] ** 2, SIGMA[1] ** 2
        twist = self.make("geometry_msgs/msg/Twist", self.vector(SPEED, 0.0, 0.0), self.vector(0.0, 0.0, TURN))
        return self.make(
            "nav_msgs/msg/Odometry",
            self.header(ns, "odom"),
            "base_link",
            self.make("geometry_msgs/msg/PoseWithCovariance", self.pose(x, y, yaw), covariance),
            self.make("geometry_msgs/msg/TwistWithCovariance", twist, np.zeros(36)),
        )


def circle(t: float) -> tuple[float, float, float]:
    """The robot's pose in odom at t [s]."""
    a = TURN * t
    return 2 * math.sin(a), 2 - 2 * math.cos(a), a


def messages(ros: int, n: int = 40, *, stamped: bool = True, late: int = 0) -> list[tuple[str, str, int, Any]]:
    """Topic, type, when it is recorded [ns], message; every 0.1 s. `late`: ns by which stamps lie behind the recording."""
    r = Robot(ros)
    tf = "tf2_msgs/msg/TFMessage"
    static = r.make(tf, [r.transform(START, "base_link", "base_scan", 0.2, 0.0, 0.0)])
    lines: list[tuple[str, str, int, Any]] = [("/tf_static", tf, START, static)]
    for i in range(n):
        at, t = START + i * 100_000_000, i * 0.1
        ns = at - late if stamped else 0
        x, y, yaw = circle(t)
        edges = [r.transform(ns, "/odom" if ros == 1 else "odom", "base_link", x, y, yaw)]
        if i % 5 == 0:
            edges.append(r.transform(ns, "map", "odom", -10.0, 0.0, math.pi / 2))
            ranges = np.full(8, 1.0 + t, dtype=np.float32)
            ranges[0] = 99.0
            intensities = np.zeros(0, dtype=np.float32)
            scan = r.make("sensor_msgs/msg/LaserScan", r.header(ns, "base_scan"), -1.0, 1.0, 0.25, 0.0, 0.1, 0.1, 20.0,
                          ranges, intensities)  # fmt: skip
            lines.append(("/scan", "sensor_msgs/msg/LaserScan", at, scan))
        lines.append(("/tf", tf, at, r.make(tf, edges)))
        lines.append(("/odom", "nav_msgs/msg/Odometry", at, r.odometry(ns, x, y, yaw)))
    goal = r.stamped(START, "map", 1.0, 2.0, 0.5)
    lines.append(("/goal_pose", "geometry_msgs/msg/PoseStamped", START + 1_000_000_000, goal))
    path = r.make("nav_msgs/msg/Path", r.header(START, "map"), [goal, r.stamped(START, "map", 3.0, 4.0, 0.0)])
    lines.append(("/plan", "nav_msgs/msg/Path", START + 1_000_000_000, path))
    lines.append(("/odd", "odd_msgs/msg/Odd", START + 1_500_000_000, r.make("odd_msgs/msg/Odd", 1.0)))
    return sorted(lines, key=lambda line: line[2])


def write_ros1(path: Path, lines: list[tuple[str, str, int, Any]], compression: str = "", chunk: int = 4096) -> Path:
    """A ROS 1 bag; compression: empty, `bz2` or `lz4`."""
    writer = rosbag1.Writer(path)
    if compression:
        writer.set_compression(rosbag1.Writer.CompressionFormat[compression.upper()])
    writer.chunk_threshold = chunk
    with writer:
        open_: dict[str, Any] = {}
        for topic, kind, at, message in lines:
            if topic not in open_:
                open_[topic] = writer.add_connection(topic, kind, typestore=STORES[1])
            writer.write(open_[topic], at, STORES[1].serialize_ros1(message, kind))
    return path


def write_ros2(path: Path, lines: list[tuple[str, str, int, Any]], plugin: str = "mcap", mode: str = "none") -> Path:
    """A ROS 2 bag's folder; plugin: `mcap` or `sqlite3`; mode: `none`, `message`, `file`, or `storage` (MCAP only)."""
    writer = rosbag2.Writer(path, version=9, storage_plugin=StoragePlugin[plugin.upper()])
    writer.set_compression(CompressionMode[mode.upper()], CompressionFormat.ZSTD)
    with writer:
        open_: dict[str, Any] = {}
        for topic, kind, at, message in lines:
            if topic not in open_:
                open_[topic] = writer.add_connection(topic, kind, typestore=STORES[2])
            writer.write(open_[topic], at, STORES[2].serialize_cdr(message, kind))
    return path


def write_mcap(path: Path, lines: list[tuple[str, str, int, Any]], **options: Any) -> Path:
    """A bare MCAP by the format's own writer; options: as of `mcap.writer.Writer`, `compression` by name."""
    buffer = io.BytesIO()
    options["compression"] = CompressionType[options.get("compression", "none").upper()]
    writer = PlainMcap(buffer, chunk_size=4096, **options)
    writer.start(profile="ros2")
    channels: dict[str, int] = {}
    for topic, kind, at, message in lines:
        if topic not in channels:
            text = STORES[2].generate_msgdef(kind, ros_version=2)[0]
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        writer.add_message(channels[topic], at, bytes(STORES[2].serialize_cdr(message, kind)), at)
    writer.finish()
    path.write_bytes(buffer.getvalue())
    return path


KINDS: dict[str, Callable[[Path], Path]] = {
    "ros1": lambda p: write_ros1(p / "a.bag", messages(1)),
    "ros1-bz2": lambda p: write_ros1(p / "a.bag", messages(1), "bz2"),
    "ros1-lz4": lambda p: write_ros1(p / "a.bag", messages(1), "lz4"),
    "ros2-mcap": lambda p: write_ros2(p / "a", messages(2)),
    "ros2-mcap-zstd": lambda p: write_ros2(p / "a", messages(2), mode="storage"),
    "ros2-mcap-file": lambda p: write_ros2(p / "a", messages(2), mode="file"),
    "ros2-sqlite3": lambda p: write_ros2(p / "a", messages(2), "sqlite3"),
    "ros2-sqlite3-message": lambda p: write_ros2(p / "a", messages(2), "sqlite3", "message"),
    "ros2-sqlite3-file": lambda p: write_ros2(p / "a", messages(2), "sqlite3", "file"),
    "db3": lambda p: write_ros2(p / "a", messages(2), "sqlite3") / "a.db3",
    "mcap": lambda p: write_mcap(p / "a.mcap", messages(2)),
    "mcap-lz4": lambda p: write_mcap(p / "a.mcap", messages(2), compression="lz4"),
    "mcap-zstd": lambda p: write_mcap(p / "a.mcap", messages(2), compression="zstd"),
    "mcap-bare": lambda p: write_mcap(p / "a.mcap", messages(2), use_chunking=False),
    "mcap-no-index": lambda p: write_mcap(
        p / "a.mcap",
        messages(2),
        index_types=IndexType.NONE,
        repeat_channels=False,
        repeat_schemas=False,
        use_statistics=False,
    ),
}
"""A bag of `messages` in each container and compression: a folder to the bag in it."""
