"""Every message is byte by byte what others make of the same values."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from mcap_ros2._dynamic import generate_dynamic

from clearway.contract import Scan
from clearway.geometry.grid import OccupancyGrid
from clearway.live.ros.said import Moment
from clearway.live.ros2 import messages as m
from clearway.live.ros2.dds import RequestId, headed

STORE, writing = m.STORE, m.WRITING
STAMP = 1_700_000_000_123_456_789
POSE = np.array((1.5, -2.25, 0.75))
SCAN = Scan(np.array((0.5, np.inf, 3.25)), -1.0, 0.5, 0.05, 10.0, np.array((0.2, 0.0, 0.1)), 1e-3)
MOMENT = Moment(STAMP, POSE, np.array((0.5, -0.25, 0.125)), POSE, np.array((0.1, 0.2, 0.3)), SCAN)
GOAL = m.UUID(list(range(16)))
SAID = [
    m.Clock(writing.time_of(STAMP)),
    writing.transforms(MOMENT),
    writing.odometry(MOMENT),
    writing.sweep(STAMP, SCAN),
    writing.grid(STAMP, OccupancyGrid(np.array([[0, 100, -1], [1, 2, 3]], dtype=np.int8), 0.05, (-1.0, 2.0))),
    writing.located(STAMP, POSE, True),
    m.Twist(m.Vector3(0.5), m.Vector3(z=-0.25)),
    m.TwistStamped(m.Header(writing.time_of(STAMP), "base_link"), m.Twist(m.Vector3(0.5), m.Vector3(z=-0.25))),
    m.PoseStamped(m.Header(writing.time_of(STAMP), "map"), writing.pose_of(POSE)),
    m.GoalInfo(GOAL, writing.time_of(STAMP)),
    m.SendGoalRequest(GOAL, m.PoseStamped(m.Header(writing.time_of(STAMP), "map"), writing.pose_of(POSE)), "tree"),
    m.SendGoalReply(True, writing.time_of(STAMP)),
    m.GetResultRequest(GOAL),
    m.GetResultReply(4),
    m.CancelRequest(m.GoalInfo(GOAL, writing.time_of(STAMP))),
    m.CancelReply(0, [m.GoalInfo(GOAL, writing.time_of(STAMP))]),
    RequestId(2**63 + 5, 7),
]


def ros_name(kind: type) -> str:
    return (
        str(kind.__idl__.idl_transformed_typename).replace("::", "/").replace(".", "/").replace("dds_/", "").rstrip("_")
    )


def as_rosbags(value: Any, like: str) -> Any:
    """The same values in rosbags' class."""
    kind = STORE.types[like]
    given = []
    for field, theirs in zip(
        fields(value), (f for f in fields(kind) if f.init and f.name != "__msgtype__"), strict=True
    ):
        one = getattr(value, field.name)
        if is_dataclass(one):
            one = as_rosbags(one, ros_name(type(one)))
        elif isinstance(one, list) and one and is_dataclass(one[0]):
            one = [as_rosbags(part, ros_name(type(part))) for part in one]
        elif isinstance(one, list):
            one = np.array(one, dtype=DTYPES.get((like, theirs.name), np.float64))
        given.append(one)
    return kind(*given)


DTYPES = {
    ("sensor_msgs/msg/LaserScan", "ranges"): np.float32,
    ("sensor_msgs/msg/LaserScan", "intensities"): np.float32,
    ("nav_msgs/msg/OccupancyGrid", "data"): np.int8,
    ("unique_identifier_msgs/msg/UUID", "uuid"): np.uint8,
}


@pytest.mark.parametrize("said", SAID, ids=lambda said: type(said).__name__)
def test_rosbags_serialises_the_same_bytes(said: Any) -> None:
    name = ros_name(type(said))
    ours, theirs = said.serialize(use_version_2=False), bytes(STORE.serialize_cdr(as_rosbags(said, name), name))
    assert ours[4:].rstrip(b"\0") == theirs[4:].rstrip(b"\0")  # past the four bytes that name the encoding
    assert abs(len(ours) - len(theirs)) < 4  # padding at the end


@pytest.mark.parametrize("said", SAID, ids=lambda said: type(said).__name__)
def test_mcap_reads_the_same_values(said: Any) -> None:
    name = ros_name(type(said))
    definition = STORE.generate_msgdef(name, ros_version=2)[0]
    as_message = "clearway/msg/" + name.split("/")[-1].replace("_", "")  # it knows no services
    read = generate_dynamic(as_message, definition)[as_message](said.serialize(use_version_2=False))
    assert_same(said, read)


def assert_same(ours: Any, theirs: Any) -> None:
    if is_dataclass(ours):
        for field, name in zip(fields(ours), theirs.__slots__, strict=True):
            assert_same(getattr(ours, field.name), getattr(theirs, name))
    elif isinstance(ours, list):
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs, strict=True):
            assert_same(one, other)
    elif isinstance(ours, float):
        assert np.float32(ours) == np.float32(theirs)
    else:
        assert ours == theirs


@pytest.mark.parametrize("said", SAID[-7:-1], ids=lambda said: type(said).__name__)
def test_cyclonedds_puts_who_asks_before_a_request(said: Any) -> None:
    kind = headed(ros_name(type(said)))
    whole = kind(SAID[-1], *(getattr(said, field.name) for field in fields(said)))
    ours, head, rest = (one.serialize(use_version_2=False) for one in (whole, SAID[-1], said))
    assert ours == head + rest[4:]  # the head is of 16 bytes, so that what follows is aligned as before
    assert kind.__idl__.idl_transformed_typename == type(said).__idl__.idl_transformed_typename


def test_the_type_hash_of_a_topic_is_the_published_one() -> None:
    """As `ros2 topic info --verbose` prints it for geometry_msgs/msg/Twist since Iron."""
    assert m.type_hash("geometry_msgs/msg/Twist") == (
        "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
    )


@pytest.mark.parametrize("increment", [2e-3, -2e-3, 0.0])
def test_each_beam_of_a_sweep_has_its_time(increment: float) -> None:
    told = writing.sweep(STAMP, replace(SCAN, time_increment=increment))
    first = told.header.stamp.sec * 10**9 + told.header.stamp.nanosec
    times = [first + round(i * told.time_increment * 1e9) for i in range(3)]
    assert times == [STAMP + round((i - 1) * increment * 1e9) for i in range(3)]
    assert told.scan_time == abs(2 * increment)
