"""Messages of other packages in bags, by definitions written out here from those packages' own files: bodies, markers, people, paths that
were driven, and the actions of Nav2 and move_base."""

from __future__ import annotations

import math
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from made_bags import START, STORES, Robot, circle, messages, write_mcap, write_ros1, write_ros2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from test_bag_fuzz import EXAMPLES, damaged, damages

from clearway.errors import ClearwayError
from clearway.recordings import formats
from clearway.recordings.formats.bag_messages import decoder, kind_of
from clearway.recordings.formats.bag_store import Channel
from clearway.recordings.recording import Recording, Want

SECOND = 1_000_000_000
SPENCER = """uint64 track_id
bool is_occluded
bool is_matched
uint64 detection_id
{age} age
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
"""
DEFINITIONS = {
    "mocap4r2_msgs/msg/Marker": "int8 USE_NAME=0\nint8 USE_INDEX=1\nint8 USE_BOTH=2\nint8 id_type\nint32 marker_index\n"
    "string marker_name\ngeometry_msgs/Point translation",
    "mocap4r2_msgs/msg/Markers": "std_msgs/Header header\nuint32 frame_number\nmocap4r2_msgs/Marker[] markers",
    "mocap4r2_msgs/msg/RigidBody": "string rigid_body_name\nMarker[] markers\ngeometry_msgs/Pose pose",
    "mocap4r2_msgs/msg/RigidBodies": "std_msgs/Header header\nuint32 frame_number\nmocap4r2_msgs/RigidBody[] rigidbodies",
    "vicon_receiver/msg/Position": "float32 x_trans\nfloat32 y_trans\nfloat32 z_trans\nfloat32 x_rot\nfloat32 y_rot\nfloat32 z_rot\n"
    "float32 w\nstring segment_name\nstring subject_name\nint32 frame_number\nstring translation_type",
    "people_msgs/msg/Person": "string name\ngeometry_msgs/Point position\ngeometry_msgs/Point velocity\nfloat64 reliability\n"
    "string[] tagnames\nstring[] tags",
    "people_msgs/msg/People": "std_msgs/Header header\npeople_msgs/Person[] people",
    "people_msgs/msg/PositionMeasurement": "std_msgs/Header header\nstring name\nstring object_id\ngeometry_msgs/Point pos\n"
    "float64 reliability\nfloat64[9] covariance\nbyte initialization",
    "people_msgs/msg/PositionMeasurementArray": "std_msgs/Header header\npeople_msgs/PositionMeasurement[] people\n"
    "float32[] cooccurrence",
    "spencer_tracking_msgs/msg/TrackedPersons": "std_msgs/Header header\nTrackedPerson[] tracks",
    "move_base_msgs/msg/MoveBaseFeedback": "geometry_msgs/PoseStamped base_position",
    "move_base_msgs/msg/MoveBaseActionFeedback": "std_msgs/Header header\nactionlib_msgs/GoalStatus status\nMoveBaseFeedback feedback",
}
for ros, store in STORES.items():
    own = dict(DEFINITIONS) | {
        "spencer_tracking_msgs/msg/TrackedPerson": SPENCER.format(
            age="duration" if ros == 1 else "builtin_interfaces/Duration"
        )
    }
    for name, text in own.items():
        store.register(get_types_from_msg(text, name))

Lines = list[tuple[str, str, int, Any]]


def written(folder: Path, lines: Lines, ros: int = 2) -> Path:
    lines = sorted(lines, key=lambda line: line[2])
    return write_ros1(folder / "a.bag", lines) if ros == 1 else write_mcap(folder / "a.mcap", lines)


def read(path: Path, *names: str, span: tuple[float, float] | None = None) -> Recording:
    return formats.read(path, Want(frozenset(names) or None, span))


def at(i: int) -> int:
    return START + i * SECOND // 10


def test_messages_compressed_one_by_one_in_an_mcap(tmp_path: Path) -> None:
    track = read(write_ros2(tmp_path / "a", messages(2), mode="message")).tracks["/odom"]
    np.testing.assert_allclose(track.position[:, :2], [circle(t)[:2] for t in track.t])
    assert len(track.t) == 40


# --- bodies, markers, people -----------------------------------------------------------------------------------------


def mocap(n: int = 5) -> Lines:
    r, lines = Robot(2), []
    for i in range(n):
        x, y, yaw = circle(0.1 * i)
        marks = [
            r.make("mocap4r2_msgs/msg/Marker", 0, 0, "cart:a", r.vector(x, y, 0.3, "Point")),
            r.make("mocap4r2_msgs/msg/Marker", 1, 7, "", r.vector(9.0, y, 0.4, "Point")),
        ]
        bodies = [r.make("mocap4r2_msgs/msg/RigidBody", "cart", [], r.pose(x, y, yaw))]
        head = r.header(at(i), "map")
        lines.append(
            (
                "/markers",
                "mocap4r2_msgs/msg/Markers",
                at(i),
                r.make("mocap4r2_msgs/msg/Markers", head, i, marks[: 1 + i % 2]),
            )
        )
        lines.append(
            (
                "/rigid_bodies",
                "mocap4r2_msgs/msg/RigidBodies",
                at(i),
                r.make("mocap4r2_msgs/msg/RigidBodies", head, i, bodies),
            )
        )
    return lines


def test_mocap4r2_gives_markers_and_bodies(tmp_path: Path) -> None:
    path = written(tmp_path, mocap())
    found = read(path)
    cart = found.tracks["/rigid_bodies/cart"]
    assert (cart.kind, cart.frame) == ("body", "map")
    np.testing.assert_allclose(cart.position[:, :2], [circle(0.1 * i)[:2] for i in range(5)])
    assert found.points is not None
    assert found.points.names == ("/markers/cart:a", "/markers/7")
    np.testing.assert_allclose(found.points.t, 0.1 * np.arange(5))
    np.testing.assert_allclose(found.points.xyz[:, 0], cart.position + np.array([0, 0, 0.3]))
    assert np.isfinite(found.points.xyz[:, 1, 0]).tolist() == [False, True, False, True, False]
    assert {e.name: e.kind for e in formats.look(path).entries} == {"/markers": "markers", "/rigid_bodies": "body"}
    one = read(path, "/markers/cart:a", span=(0.1, 0.3)).points
    assert one is not None
    assert one.names == ("/markers/cart:a",)
    np.testing.assert_allclose(one.t, [0.1, 0.2, 0.3])
    with pytest.raises(ClearwayError, match="did you mean '/markers/cart:a'"):
        read(path, "/markers/cart:b")


def test_vicon_receiver_is_in_millimetres(tmp_path: Path) -> None:
    r, half = Robot(2), math.sqrt(0.5)
    text = "vicon_receiver/msg/Position"
    lines = [
        (
            "/vicon/a/a",
            text,
            at(i),
            r.make(text, 1000.0 + i, -500.0, 250.0, 0.0, 0.0, half, half, "a", "a", i, "Global"),
        )
        for i in range(3)
    ]
    track = read(written(tmp_path, lines)).tracks["/vicon/a/a"]
    np.testing.assert_allclose(track.position[2], [1.002, -0.5, 0.25], atol=1e-6)
    assert track.orientation is not None
    np.testing.assert_allclose(track.orientation[0], [0, 0, half, half], atol=1e-6)


@pytest.mark.parametrize("ros", [1, 2])
def test_people_by_their_names(ros: int, tmp_path: Path) -> None:
    r, lines = Robot(ros), []
    kind = "people_msgs/msg/"
    for i in range(4):
        x, y, _ = circle(0.1 * i)
        people = [
            r.make(
                f"{kind}Person", name, r.vector(x + k, y, 0.0, "Point"), r.vector(0.5, 0.0, 0.0, "Point"), 0.9, [], []
            )
            for k, name in enumerate(["anna", "ben"][: 1 + i % 2])
        ]
        measured = [
            r.make(
                f"{kind}PositionMeasurement",
                r.header(at(i), "laser"),
                "leg",
                "p1",
                r.vector(x, y, 0.0, "Point"),
                1.0,
                np.zeros(9),
                0,
            )
        ]
        lines.append(("/people", f"{kind}People", at(i), r.make(f"{kind}People", r.header(at(i), "map"), people)))
        array = r.make(
            f"{kind}PositionMeasurementArray", r.header(at(i), "map"), measured, np.zeros(0, dtype=np.float32)
        )
        lines.append(("/people_tracker", f"{kind}PositionMeasurementArray", at(i), array))
    found = read(written(tmp_path, lines, ros))
    assert set(found.tracks) == {"/people/anna", "/people/ben", "/people_tracker/p1"}
    assert found.tracks["/people/ben"].kind == "person"
    np.testing.assert_allclose(found.tracks["/people/ben"].t, [0.1, 0.3])
    np.testing.assert_allclose(found.tracks["/people/ben"].position[0, :2], [circle(0.1)[0] + 1, circle(0.1)[1]])
    assert found.tracks["/people/anna"].orientation is None
    assert found.tracks["/people_tracker/p1"].frame == "laser"
    assert set(read(tmp_path / ("a.bag" if ros == 1 else "a.mcap"), "/people/anna").tracks) == {"/people/anna"}


@pytest.mark.parametrize("ros", [1, 2])
def test_a_person_that_the_tracker_only_guesses_was_not_seen(ros: int, tmp_path: Path) -> None:
    r, lines = Robot(ros), []
    covariance = np.zeros(36)
    covariance[[0, 7, 35]] = 0.01, 0.04, 0.09
    kind = "spencer_tracking_msgs/msg/"
    for i in range(6):
        x, y, yaw = circle(0.1 * i)
        pose = r.make("geometry_msgs/msg/PoseWithCovariance", r.pose(x, y, yaw), covariance)
        still = r.make("geometry_msgs/msg/Twist", r.vector(0.0, 0.0, 0.0), r.vector(0.0, 0.0, 0.0))
        twist = r.make("geometry_msgs/msg/TwistWithCovariance", still, np.zeros(36))
        age = r.make("builtin_interfaces/msg/Duration", i, 0)
        track = r.make(f"{kind}TrackedPerson", 42, i in (2, 3), i not in (2, 3), i, age, pose, twist)
        lines.append(
            (
                "/tracks",
                f"{kind}TrackedPersons",
                at(i),
                r.make(f"{kind}TrackedPersons", r.header(at(i), "odom"), [track]),
            )
        )
    track = read(written(tmp_path, lines, ros)).tracks["/tracks/42"]
    assert track.kind == "person"
    np.testing.assert_allclose(track.t, [0.0, 0.1, 0.4, 0.5])
    np.testing.assert_allclose(track.position[-1, :2], circle(0.5)[:2])
    assert track.sigma is not None
    np.testing.assert_allclose(track.sigma[0], [0.2, 0.3])


@pytest.mark.parametrize(
    ("counts", "problem"), [([2, 2, 2], None), ([2, 3, 2], "from 2 to 3 poses"), ([101], "101 poses")]
)
def test_an_array_of_as_many_poses_holds_bodies(counts: list[int], problem: str | None, tmp_path: Path) -> None:
    r, kind = Robot(2), "geometry_msgs/msg/PoseArray"
    lines = [
        ("/bots", kind, at(i), r.make(kind, r.header(at(i), "map"), [r.pose(i, k, 0.1 * k) for k in range(1, n + 1)]))
        for i, n in enumerate(counts)
    ]
    path = written(tmp_path, lines)
    assert not read(path).tracks  # only by name
    if problem is not None:
        with pytest.raises(ClearwayError, match=problem):
            read(path, "/bots")
        return
    assert set(read(path, "/bots").tracks) == {"/bots/1", "/bots/2"}
    np.testing.assert_allclose(read(path, "/bots/2").tracks["/bots/2"].position, [[0, 2, 0], [1, 2, 0], [2, 2, 0]])


# --- paths -----------------------------------------------------------------------------------------------------------


def path_of(r: Robot, sent: int, stamps: list[int], shift: float = 0.0) -> Any:
    poses = [
        r.stamped(ns, "map", circle((ns - START) / 1e9)[0] + shift, *circle((ns - START) / 1e9)[1:]) for ns in stamps
    ]
    return r.make("nav_msgs/msg/Path", r.header(sent, "map"), poses)


def test_a_path_of_stamped_poses_is_what_was_driven(tmp_path: Path) -> None:
    """It grows; its last message moves what was said before, and no longer has the first two poses."""
    r, kind = Robot(2), "nav_msgs/msg/Path"
    grown = [("/trajectory", kind, at(i), path_of(r, at(i), [at(k) for k in range(i + 1)])) for i in range(9)]
    last = ("/trajectory", kind, at(9), path_of(r, at(9), [at(k) for k in range(2, 10)], shift=0.5))
    path = written(tmp_path, [*grown, last])
    found = read(path, "/trajectory")
    track = found.tracks["/trajectory"]
    assert (track.kind, track.frame) == ("path", "map")
    np.testing.assert_allclose(track.t, 0.1 * np.arange(10), atol=1e-9)
    want = np.array([circle(0.1 * i)[:2] for i in range(10)]) + np.outer(np.arange(10) > 1, [0.5, 0.0])
    np.testing.assert_allclose(track.position[:, :2], want)
    assert len(found.paths["/trajectory"].lines) == 10
    assert not read(path).tracks


@pytest.mark.parametrize(
    "stamps",
    [lambda i: [at(i)] * 5, lambda i: [0] * 5, lambda i: [at(i) + k * SECOND for k in range(5)]],
    ids=["one stamp", "no stamps", "the future"],
)
def test_a_plan_is_no_track(stamps: Any, tmp_path: Path) -> None:
    r = Robot(2)
    lines = [("/plan", "nav_msgs/msg/Path", at(i), path_of(r, at(i), stamps(i))) for i in range(4)]
    found = read(written(tmp_path, lines), "/plan")
    assert not found.tracks
    assert len(found.paths["/plan"].lines) == 4


# --- actions ---------------------------------------------------------------------------------------------------------


def status(r: Robot, *goals: tuple[int, int, int]) -> Any:
    """A status array of Nav2; goals: id, when accepted [ns], status."""
    listed = []
    for number, sent, state in goals:
        uuid = r.make("unique_identifier_msgs/msg/UUID", np.full(16, number, dtype=np.uint8))
        info = r.make("action_msgs/msg/GoalInfo", uuid, r.make("builtin_interfaces/msg/Time", *divmod(sent, SECOND)))
        listed.append(r.make("action_msgs/msg/GoalStatus", info, state))
    return r.make("action_msgs/msg/GoalStatusArray", listed)


def nav2(name: str = "/navigate_to_pose") -> Lines:
    """Three goals: reached at 2.5 s, canceled at 3.2 s, under way at the end; and one that was over before."""
    r, kind = Robot(2), "action_msgs/msg/GoalStatusArray"
    old, one, two, three = (9, START - 60 * SECOND, 4), (1, at(5), 2), (2, at(30), 2), (3, at(35), 2)
    said = [
        (at(0), [old]),
        (at(5) + 1000, [old, (1, at(5), 1)]),
        (at(6), [old, one]),
        (at(25), [(1, at(5), 4)]),
        (at(30) + 1000, [(1, at(5), 4), two]),
        (at(32), [(1, at(5), 4), (2, at(30), 5)]),
        (at(35) + 1000, [(2, at(30), 5), three]),
    ]
    return [(f"{name}/_action/status", kind, t, status(r, *goals)) for t, goals in said]


@pytest.mark.parametrize("asked", ["/navigate_to_pose", "/navigate_to_pose/_action/status", None])
def test_nav2_says_when_a_goal_was_sent_and_reached(asked: str | None, tmp_path: Path) -> None:
    path = written(tmp_path, nav2())
    found = read(path, *([asked] if asked else []))
    goals = found.goals[asked or "/navigate_to_pose"]
    np.testing.assert_allclose(goals.t, [0.5, 3.0, 3.5])
    assert goals.ended is not None
    np.testing.assert_allclose(goals.ended, [2.5, 3.2, np.nan])
    assert goals.outcome == ("succeeded", "canceled", "")
    assert np.isnan(goals.pose).all()
    assert any("1 goals were over when the recording began" in n for n in found.notes)
    entry = formats.look(path).entries[0]
    assert entry.kind == "action"
    assert "the action /navigate_to_pose" in entry.detail
    with pytest.raises(ClearwayError, match="unknown topic '/navigate_to_pos'"):
        read(path, "/navigate_to_pos")


def test_move_base_also_says_where_each_goal_was(tmp_path: Path) -> None:
    r, lines = Robot(1), messages(1, 4)
    goal_id = r.make("actionlib_msgs/msg/GoalID", r.header(at(2), "").stamp, "a-1")
    target = r.make("move_base_msgs/msg/MoveBaseGoal", r.stamped(at(2), "map", 3.0, 4.0, 0.7))
    kind = "move_base_msgs/msg/MoveBaseActionGoal"
    lines.append(("/move_base/goal", kind, at(2), r.make(kind, r.header(at(2), ""), goal_id, target)))
    for i in range(3, 12):
        state = r.make("actionlib_msgs/msg/GoalStatus", goal_id, 3 if i >= 9 else 1, "")
        array = r.make("actionlib_msgs/msg/GoalStatusArray", r.header(at(i), ""), [state])
        lines.append(("/move_base/status", "actionlib_msgs/msg/GoalStatusArray", at(i) + 1000, array))
        feedback = r.make("move_base_msgs/msg/MoveBaseFeedback", r.stamped(at(i), "map", 0.1 * i, 0.0, 0.0))
        said = r.make("move_base_msgs/msg/MoveBaseActionFeedback", r.header(at(i), ""), state, feedback)
        lines.append(("/move_base/feedback", "move_base_msgs/msg/MoveBaseActionFeedback", at(i), said))
    path = written(tmp_path, lines, 1)
    goals = read(path, "/move_base").goals["/move_base"]
    assert goals.frame == "map"
    np.testing.assert_allclose(goals.t, [0.2])
    np.testing.assert_allclose(goals.pose, [[3, 4, 0.7]])
    np.testing.assert_allclose(goals.ended, [0.9])
    assert goals.outcome == ("succeeded",)
    feedback = read(path).tracks["/move_base/feedback"]
    np.testing.assert_allclose(feedback.position[:, 0], 0.1 * np.arange(3, 12))


FEEDBACK = "geometry_msgs/PoseStamped current_pose\nbuiltin_interfaces/Duration navigation_time\n"
BETWEEN, LEFT = (
    "builtin_interfaces/Duration estimated_time_remaining\n",
    "int16 number_of_recoveries\nfloat32 distance_remaining\n",
)
ERRORS = "float32 position_tracking_error\nfloat32 heading_tracking_error\n"


@pytest.mark.parametrize("described", [True, False])
@pytest.mark.parametrize("text", [FEEDBACK + LEFT, FEEDBACK + BETWEEN + LEFT, FEEDBACK + BETWEEN + LEFT + ERRORS])
def test_nav2s_feedback_of_every_distribution(text: str, described: bool, tmp_path: Path) -> None:
    store, name = get_typestore(Stores.ROS2_HUMBLE), "nav2_msgs/action/NavigateToPose_Feedback"
    store.register(get_types_from_msg(text, name))
    whole = "unique_identifier_msgs/UUID goal_id\nnav2_msgs/action/NavigateToPose_Feedback feedback\n"
    store.register(get_types_from_msg(whole, f"{name}Message"))
    r = Robot(2)
    r.store = store
    zero = r.make("builtin_interfaces/msg/Duration", 1, 0)
    rest = [zero, *([zero] if BETWEEN in text else []), 0, 1.5, *([0.1, 0.2] if ERRORS in text else [])]
    uuid = r.make("unique_identifier_msgs/msg/UUID", np.ones(16, dtype=np.uint8))
    said = r.make(f"{name}Message", uuid, r.make(name, r.stamped(at(3), "map", 1.0, 2.0, 0.5), *rest))
    channel_type = f"{name}Message"
    definition = f"{whole}{'=' * 80}\nMSG: {name}\n{text}" if described else ""
    channel = Channel(1, "/navigate_to_pose/_action/feedback", channel_type, "cdr", "ros2msg", definition)
    message = decoder(channel, file=tmp_path)(bytes(store.serialize_cdr(said, channel_type)))
    poses = kind_of(channel).poses
    assert poses is not None
    (pose,) = poses(message)
    assert pose.values[:2] == (1.0, 2.0)
    assert (pose.frame, pose.stamp) == ("map", at(3))


# --- damage ----------------------------------------------------------------------------------------------------------


@cache
def everything() -> bytes:
    """A bag without chunks or checksums, so that what is changed in it is read: bodies, markers, people, arrays, a path, an action."""
    r = Robot(2)
    lines = [*mocap(), *nav2()]
    for i in range(4):
        person = r.make(
            "people_msgs/msg/Person",
            "anna",
            r.vector(i, 0.0, 0.0, "Point"),
            r.vector(0.5, 0.0, 0.0, "Point"),
            0.9,
            [],
            [],
        )
        lines += [
            (
                "/people",
                "people_msgs/msg/People",
                at(i),
                r.make("people_msgs/msg/People", r.header(at(i), "map"), [person]),
            ),
            (
                "/bots",
                "geometry_msgs/msg/PoseArray",
                at(i),
                r.make("geometry_msgs/msg/PoseArray", r.header(at(i), "map"), [r.pose(i, 1, 0.1)] * 2),
            ),
            ("/way", "nav_msgs/msg/Path", at(i), path_of(r, at(i), [at(k) for k in range(i + 1)])),
        ]
    with TemporaryDirectory() as folder:
        path = write_mcap(Path(folder) / "a.mcap", sorted(lines, key=lambda line: line[2]), use_chunking=False)
        return path.read_bytes()


NAMES = frozenset({"/bots", "/way", "/navigate_to_pose", "/people/anna", "/markers/cart:a"})


@settings(max_examples=EXAMPLES)
@given(how=damages())
def test_damaged_messages_give_nothing_but_the_own_error(how: list[tuple[str, float, bytes]]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        path.write_bytes(damaged(everything(), how))
        for act in (
            lambda: formats.look(path),
            lambda: formats.read(path),
            lambda: formats.read(path, Want(NAMES, (0.0, 2.0))),
        ):
            with suppress(ClearwayError):
                act()
