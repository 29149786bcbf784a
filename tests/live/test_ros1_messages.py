"""Every message is byte by byte what its definition says, and each type has the sum that ROS has published for it."""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clearway.contract import Scan
from clearway.geometry.grid import OccupancyGrid
from clearway.live.line import WireError
from clearway.live.ros.said import Moment
from clearway.live.ros.topics import TOPICS
from clearway.live.ros1.messages import STORE, WRITING, kind, message
from clearway.live.ros1.tcpros import fields_of, header_of

STAMP = 1_700_000_000_123_456_789
TIME = struct.pack("<II", 1_700_000_000, 123_456_789)
POSE = np.array((1.5, -2.25, 0.75))
SCAN = Scan(np.array((0.5, np.inf, 3.25)), -1.0, 0.5, 0.05, 10.0, np.array((0.2, 0.0, 0.1)), 1e-3)
MOMENT = Moment(STAMP, POSE, np.array((0.5, -0.25, 0.125)), POSE, np.array((0.1, 0.2, 0.3)), SCAN)

# as `rosmsg md5` prints them in Noetic
PUBLISHED = {
    "rosgraph_msgs/msg/Clock": "a9c97c1d230cfc112e270351a944ee47",
    "tf2_msgs/msg/TFMessage": "94810edda583a504dfda3829e70d7eec",
    "nav_msgs/msg/Odometry": "cd5e73d190d741a2f92e81eda573aca7",
    "sensor_msgs/msg/LaserScan": "90c7ef2dc6895d81024acba2ac42f369",
    "nav_msgs/msg/OccupancyGrid": "3381f2d731d4076ec5c71b0759edbe4e",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "953b798c0f514ff060a53a3498ce6246",
    "geometry_msgs/msg/Twist": "9f195f881246fdfa2798d1d3eebca84a",
    "actionlib_msgs/msg/GoalID": "302881f31927c1df708a2dbab0e80ee8",
    "actionlib_msgs/msg/GoalStatusArray": "8b2b82f13216d0a8ea88bd3af735e619",
    "move_base_msgs/msg/MoveBaseActionGoal": "660d6895a1b9a16dce51fbdd9a64a56b",
    "move_base_msgs/msg/MoveBaseActionResult": "1eb06eeff08fa7ea874431638cb52332",
}


@pytest.mark.parametrize(("name", "md5sum"), PUBLISHED.items())
def test_the_sum_of_a_type_is_the_published_one(name: str, md5sum: str) -> None:
    assert kind(name).md5sum == md5sum


def test_the_sum_of_each_type_that_is_said_is_tested() -> None:
    assert {topic.kind for topic in TOPICS} <= PUBLISHED.keys()


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def head(frame: str, stamp: bytes = TIME) -> bytes:
    return struct.pack("<I", 0) + stamp + text(frame)


def turn(theta: float) -> bytes:
    return struct.pack("<4d", 0.0, 0.0, np.sin(0.5 * theta), np.cos(0.5 * theta))


def pose(where: Any) -> bytes:
    return struct.pack("<3d", where[0], where[1], 0.0) + turn(where[2])


def transform(parent: str, child: str, where: Any) -> bytes:
    return head(parent) + text(child) + pose(where)


MSG = "geometry_msgs/msg/"
CELLS = OccupancyGrid(np.array([[0, 100, -1], [1, 2, 3]], dtype=np.int8), 0.05, (-1.0, 2.0))
ZEROS = bytes(8 * 36)
SAID: list[tuple[str, Any, bytes]] = [
    ("rosgraph_msgs/msg/Clock", WRITING.clock(STAMP), TIME),
    (
        "tf2_msgs/msg/TFMessage", WRITING.transforms(MOMENT),
        struct.pack("<I", 2) + transform("odom", "base_link", POSE) + transform("map", "odom", (0.1, 0.2, 0.3)),
    ),
    ("tf2_msgs/msg/TFMessage", WRITING.mount(STAMP, SCAN), struct.pack("<I", 1) + transform("base_link", "laser", (0.2, 0.0, 0.1))),
    (
        "nav_msgs/msg/Odometry", WRITING.odometry(MOMENT),
        head("odom") + text("base_link") + pose(POSE) + ZEROS + struct.pack("<6d", 0.5, 0.125, 0.0, 0.0, 0.0, -0.25) + ZEROS,
    ),
    (
        "sensor_msgs/msg/LaserScan", WRITING.sweep(STAMP, SCAN),
        head("laser", struct.pack("<II", 1_700_000_000, 122_456_789))
        + struct.pack("<7f", -1.0, 0.0, 0.5, 1e-3, 2e-3, 0.05, 10.0)
        + struct.pack("<I3f", 3, 0.5, np.inf, 3.25) + struct.pack("<I", 0),
    ),
    (
        "nav_msgs/msg/OccupancyGrid", WRITING.grid(STAMP, CELLS),
        head("map") + TIME + struct.pack("<fII", 0.05, 3, 2) + pose((-1.0, 2.0, 0.0)) + struct.pack("<I6b", 6, 0, 100, -1, 1, 2, 3),
    ),
    (f"{MSG}PoseWithCovarianceStamped", WRITING.located(STAMP, POSE, False), head("map") + pose(POSE) + ZEROS),
    (f"{MSG}Twist", message(f"{MSG}Twist")(message(f"{MSG}Vector3")(0.5)), struct.pack("<6d", 0.5, 0, 0, 0, 0, 0)),
    ("actionlib_msgs/msg/GoalID", message("actionlib_msgs/msg/GoalID")(id="one"), bytes(8) + text("one")),
    (
        "move_base_msgs/msg/MoveBaseActionGoal",
        message("move_base_msgs/msg/MoveBaseActionGoal")(
            WRITING.header(STAMP, ""),
            message("actionlib_msgs/msg/GoalID")(WRITING.time_of(STAMP), "one"),
            message("move_base_msgs/msg/MoveBaseGoal")(WRITING.goal(STAMP, POSE)),
        ),
        head("") + TIME + text("one") + head("map") + pose(POSE),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("name", "said", "data"), SAID, ids=lambda value: value if isinstance(value, str) else "")
def test_a_message_has_the_bytes_of_its_definition(name: str, said: Any, data: bytes) -> None:
    packed = kind(name).packed(said)
    assert packed == struct.pack("<I", len(data)) + data
    assert bytes(STORE.serialize_ros1(kind(name).unpacked(data), name)) == data


def test_an_initial_pose_has_the_spread_that_rviz_gives_it() -> None:
    spread = WRITING.located(STAMP, POSE, True).pose.covariance.reshape(6, 6)
    assert spread[0, 0] == spread[1, 1] == 0.25
    assert spread[5, 5] == 0.0685
    assert np.count_nonzero(spread) == 3


def test_a_header_is_as_the_specification_shows_it() -> None:
    """The example of wiki.ros.org/ROS/Connection Header: 0xb0 bytes."""
    fields = {
        "message_definition": "string data\n\n", "callerid": "/rostopic_4767_1316912741557", "latching": "1",
        "md5sum": "992ce8a1687cec8c8bd883ec73ca41d1", "topic": "/chatter", "type": "std_msgs/String",
    }  # fmt: skip
    data = header_of(fields)
    assert len(data) == 4 + 0xB0
    assert data[:40] == b"\xb0\0\0\0\x20\0\0\0message_definition=string data\n\n"
    assert data[40:81] == b"\x25\0\0\0callerid=/rostopic_4767_1316912741557"
    assert data[81:95] == b"\x0a\0\0\0latching=1"
    assert fields_of(data[4:]) == fields


@pytest.mark.parametrize(
    ("data", "says"),
    [(b"\x05\0\0\0ab=c", "ends within a field"), (b"\x05", "ends within"), (b"\x02\0\0\0ab", "'ab' that has no value")],
)
def test_a_header_that_is_none_is_told(data: bytes, says: str) -> None:
    with pytest.raises(WireError, match=says):
        fields_of(data)


@pytest.mark.parametrize("increment", [2e-3, -2e-3, 0.0])
def test_each_beam_of_a_sweep_has_its_time(increment: float) -> None:
    told = WRITING.sweep(STAMP, replace(SCAN, time_increment=increment))
    first = told.header.stamp.sec * 10**9 + told.header.stamp.nanosec
    times = [first + round(i * told.time_increment * 1e9) for i in range(3)]
    assert times == [STAMP + round((i - 1) * increment * 1e9) for i in range(3)]
    assert told.scan_time == abs(2 * increment)
