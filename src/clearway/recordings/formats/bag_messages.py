"""The messages that Clearway understands, and what each says.

Messages are decoded by the standard definitions (`bag_definitions`), never by code made from a file's own. So bags without
definitions are read as well; where a bag has them, they must say the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.typesys import get_types_from_idl, get_types_from_msg
from rosbags.typesys.store import Typestore

from clearway.errors import ClearwayError
from clearway.recordings.formats.bag_definitions import typestores
from clearway.recordings.formats.bag_store import Channel

NAN = float("nan")
_LONGEST = 64 << 10  # characters of a definition that is compared


class Pose(NamedTuple):
    """A pose in a message.

    Attributes:
        name: Name of the body, where a message holds several.
        stamp: Stamp of its header, ns; 0 without one.
        frame: The frame it is given in, as written.
        child: What it is the pose of, as written.
        values: The position x, y, z [m] and the quaternion qx, qy, qz, qw.
        twist: The measured v [m/s] and omega [rad/s]; NaN if the message doesn't say.
        sigma: Standard uncertainty of position [m] and heading [rad]; NaN if the message doesn't say.
    """

    name: str
    stamp: int
    frame: str
    child: str
    values: tuple[float, ...]
    twist: tuple[float, float] = (NAN, NAN)
    sigma: tuple[float, float] = (NAN, NAN)


class State(NamedTuple):
    """What a message says of one goal of an action.

    Attributes:
        goal: The goal's id.
        sent: When it was sent or accepted, by its own stamp, ns; 0 without one.
        seen: Stamp of the message, ns; 0 without one.
        outcome: How it ended: `succeeded`, `canceled`, `aborted` or `rejected`; empty while it is pursued.
    """

    goal: str
    sent: int
    seen: int
    outcome: str


class Kind(NamedTuple):
    """What a type of message is to a recording.

    Attributes:
        kind: Its kind, as in `Entry`.
        poses: Gives the poses of a message; None where other code reads it.
        states: Gives what a message of an action says of its goals; None of any other.
    """

    kind: str
    poses: Callable[[Any], Iterator[Pose]] | None = None
    states: Callable[[Any], Iterator[State]] | None = None


def type_name(written: str) -> str:
    """`package/msg/Name` of a type as any bag writes it."""
    parts = [p for p in written.split("/") if p]
    return f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else written


def kind_of(channel: Channel) -> Kind:
    """What a channel's messages are: `goal` for a pose whose topic speaks of a goal, `other` if not understood."""
    found = KINDS.get(type_name(channel.type))
    if found is None or channel.encoding not in ("cdr", "ros1"):
        return Kind("other")
    if found.kind == "pose" and type_name(channel.type) in _GOALS and _GOAL.search(channel.topic.lower()):
        return Kind("goal", found.poses)
    return found


def decoder(channel: Channel, *, file: Path) -> Callable[[bytes], Any]:
    """What decodes a channel's messages.

    Raises:
        ClearwayError: the bag's own definition of the type isn't the standard one. The decoder: a message is damaged.
    """
    name, ros1 = type_name(channel.type), channel.encoding == "ros1"
    stores = [s for s in typestores(ros1, name) if _same(channel, name, s)]
    if not stores:
        raise ClearwayError(
            f"the bag's own definition of {channel.type} differs from the standard one, by which it would be read",
            file=file,
            field=channel.topic,
        )
    decoders = [s.deserialize_ros1 if ros1 else s.deserialize_cdr for s in stores]

    def read(data: bytes) -> Any:
        wrong: Exception | None = None
        for decode in decoders:
            try:
                return decode(data, name)
            except Exception as error:  # generated code on arbitrary bytes
                wrong = wrong or error
        raise ClearwayError(
            f"a message of {len(data)} bytes is no {channel.type}: {wrong}", file=file, field=channel.topic
        ) from wrong

    return read


def stamp_of(header: Any) -> int:
    """A header's stamp in ns, 0 where nobody set it."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def _same(channel: Channel, name: str, store: Typestore) -> bool:
    """Whether the bag's own definition of the type, if it has one, is that of `store`."""
    if not channel.definition.strip():
        return True
    if len(channel.definition) > _LONGEST:
        return False
    try:
        if channel.schema in ("ros2idl", "omgidl"):
            line = "=" * 80 + "\n"
            texts = [part.partition("\n")[2] for part in channel.definition.split(line) if part.startswith("IDL: ")]
            found: dict[Any, Any] = {}
            for text in texts or [channel.definition]:
                found |= get_types_from_idl(text)
        else:
            found = get_types_from_msg(channel.definition, name)
    except Exception:  # a parser on arbitrary text
        return False
    return name in found and all(
        of not in store.fielddefs or fields == store.fielddefs[of][1] for of, (_, fields) in found.items()
    )


def _odometry(m: Any) -> Iterator[Pose]:
    pose, twist = m.pose, m.twist.twist
    yield Pose(
        "",
        stamp_of(m.header),
        m.header.frame_id,
        m.child_frame_id,
        _pose(pose.pose),
        (twist.linear.x, twist.angular.z),
        _sigma(pose.covariance),
    )


def _with_covariance(m: Any) -> Iterator[Pose]:
    yield Pose("", stamp_of(m.header), m.header.frame_id, "", _pose(m.pose.pose), sigma=_sigma(m.pose.covariance))


def _stamped(m: Any) -> Iterator[Pose]:
    yield Pose("", stamp_of(m.header), m.header.frame_id, "", _pose(m.pose))


def _bare(m: Any) -> Iterator[Pose]:
    yield Pose("", 0, "", "", _pose(m))


def _flat(m: Any) -> Iterator[Pose]:
    half = m.theta / 2 if math.isfinite(m.theta) else NAN
    yield Pose("", 0, "", "", (m.x, m.y, 0.0, 0.0, 0.0, math.sin(half), math.cos(half)))


def _point(m: Any) -> Iterator[Pose]:
    p = m.point
    yield Pose("", stamp_of(m.header), m.header.frame_id, "", (p.x, p.y, p.z, NAN, NAN, NAN, NAN))


def _transform(m: Any) -> Iterator[Pose]:
    p, q = m.transform.translation, m.transform.rotation
    yield Pose("", stamp_of(m.header), m.header.frame_id, m.child_frame_id, (p.x, p.y, p.z, q.x, q.y, q.z, q.w))


def _transforms(m: Any) -> Iterator[Pose]:
    for each in m.transforms:
        yield from _transform(each)


def _goal(m: Any) -> Iterator[Pose]:
    target = m.goal.target_pose
    stamp = stamp_of(target.header) or stamp_of(m.header)
    yield Pose("", stamp, target.header.frame_id, "", _pose(target.pose))


def _bodies(m: Any) -> Iterator[Pose]:
    stamp = stamp_of(m.header)
    for each in m.poses:
        yield Pose(each.name, stamp, m.header.frame_id, each.name, _pose(each.pose))


def _array(m: Any) -> Iterator[Pose]:
    for i, pose in enumerate(m.poses[: MOST_POSES + 1], 1):
        yield Pose(str(i), stamp_of(m.header), m.header.frame_id, "", _pose(pose))


def _rigid_bodies(m: Any) -> Iterator[Pose]:
    for each in m.rigidbodies:
        yield Pose(each.rigid_body_name, stamp_of(m.header), m.header.frame_id, each.rigid_body_name, _pose(each.pose))


def _markers(m: Any) -> Iterator[Pose]:
    for each in m.markers:
        name = each.marker_name if each.id_type != _BY_INDEX and each.marker_name else str(each.marker_index)
        p = each.translation
        yield Pose(name, stamp_of(m.header), m.header.frame_id, "", (p.x, p.y, p.z, NAN, NAN, NAN, NAN))


def _vicon(m: Any) -> Iterator[Pose]:
    at = (m.x_trans, m.y_trans, m.z_trans)  # as the SDK gives them: millimetres
    yield Pose("", 0, "vicon", m.segment_name, (*(x / 1000 for x in at), m.x_rot, m.y_rot, m.z_rot, m.w))


def _people(m: Any) -> Iterator[Pose]:
    for i, each in enumerate(m.people, 1):
        p = each.position
        values = (p.x, p.y, p.z, NAN, NAN, NAN, NAN)
        yield Pose(each.name or str(i), stamp_of(m.header), m.header.frame_id, "", values)


def _people_measured(m: Any) -> Iterator[Pose]:
    for i, each in enumerate(m.people, 1):
        header = each.header if each.header.frame_id else m.header
        values = (each.pos.x, each.pos.y, each.pos.z, NAN, NAN, NAN, NAN)
        yield Pose(each.object_id or each.name or str(i), stamp_of(header), header.frame_id, "", values)


def _tracked_people(m: Any) -> Iterator[Pose]:
    for each in m.tracks:
        if not each.is_occluded:  # where nobody saw the person the tracker guesses
            sigma = _sigma(each.pose.covariance)
            yield Pose(
                str(each.track_id), stamp_of(m.header), m.header.frame_id, "", _pose(each.pose.pose), sigma=sigma
            )


def _feedback(m: Any) -> Iterator[Pose]:
    yield from _stamped(m.feedback.current_pose)


def _feedback_ros1(m: Any) -> Iterator[Pose]:
    yield from _stamped(m.feedback.base_position)


def _statuses(m: Any) -> Iterator[State]:
    for each in m.status_list:
        info = each.goal_info
        sent = int(info.stamp.sec) * 1_000_000_000 + int(info.stamp.nanosec)
        yield State(bytes(info.goal_id.uuid).hex(), sent, 0, _ENDED.get(each.status, ""))


def _statuses_ros1(m: Any) -> Iterator[State]:
    for each in m.status_list:
        goal = each.goal_id
        sent = int(goal.stamp.sec) * 1_000_000_000 + int(goal.stamp.nanosec)
        yield State(goal.id, sent, stamp_of(m.header), _ENDED_ROS1.get(each.status, ""))


def _pose(pose: Any) -> tuple[float, ...]:
    p, q = pose.position, pose.orientation
    return p.x, p.y, p.z, q.x, q.y, q.z, q.w


def _sigma(covariance: Any) -> tuple[float, float]:
    """Standard uncertainty of position (along the worst direction) and heading; zero, negative or absurd: unknown."""
    a, b, d, yaw = float(covariance[0]), float(covariance[1]), float(covariance[7]), float(covariance[35])
    variance = (a + d) / 2 + math.hypot((a - d) / 2, b) if a > 0 and d > 0 else NAN
    return _root(variance), _root(yaw)


def _root(variance: float) -> float:
    return variance**0.5 if 0 < variance < _UNKNOWN else NAN


MOVE_BASE = "move_base_msgs/msg/MoveBaseActionGoal"
"""The goals of move_base, each with its id."""

MOST_POSES = 100
"""Of an array without names that are taken for bodies; a particle filter's cloud has more."""

_BY_INDEX = 1  # mocap4r2_msgs/Marker: USE_INDEX
_ENDED = {4: "succeeded", 5: "canceled", 6: "aborted"}  # action_msgs/GoalStatus
_ENDED_ROS1 = {
    2: "canceled",
    3: "succeeded",
    4: "aborted",
    5: "rejected",
    8: "canceled",
    9: "aborted",
}  # actionlib_msgs

_UNKNOWN = 1e4  # m^2, rad^2: drivers write such numbers for what they don't measure

_GOAL = re.compile(r"(^|[/_])goals?($|[/_])")
_GOALS = {"geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/Pose", "geometry_msgs/msg/Pose2D"}

KINDS = {
    "nav_msgs/msg/Odometry": Kind("odometry", _odometry),
    "geometry_msgs/msg/PoseStamped": Kind("pose", _stamped),
    "geometry_msgs/msg/PoseWithCovarianceStamped": Kind("pose", _with_covariance),
    "geometry_msgs/msg/Pose": Kind("pose", _bare),
    "geometry_msgs/msg/Pose2D": Kind("pose", _flat),
    "geometry_msgs/msg/PointStamped": Kind("pose", _point),
    "geometry_msgs/msg/TransformStamped": Kind("pose", _transform),
    "motion_capture_tracking_interfaces/msg/NamedPoseArray": Kind("body", _bodies),
    "mocap4r2_msgs/msg/RigidBodies": Kind("body", _rigid_bodies),
    "mocap_msgs/msg/RigidBodies": Kind("body", _rigid_bodies),
    "mocap4r2_msgs/msg/Markers": Kind("markers", _markers),
    "mocap_msgs/msg/Markers": Kind("markers", _markers),
    "vicon_receiver/msg/Position": Kind("pose", _vicon),
    "geometry_msgs/msg/PoseArray": Kind("array", _array),
    "people_msgs/msg/People": Kind("person", _people),
    "people_msgs/msg/PositionMeasurementArray": Kind("person", _people_measured),
    "spencer_tracking_msgs/msg/TrackedPersons": Kind("person", _tracked_people),
    "nav2_msgs/action/NavigateToPose_FeedbackMessage": Kind("pose", _feedback),
    "move_base_msgs/msg/MoveBaseActionFeedback": Kind("pose", _feedback_ros1),
    "action_msgs/msg/GoalStatusArray": Kind("action", states=_statuses),
    "actionlib_msgs/msg/GoalStatusArray": Kind("action", states=_statuses_ros1),
    "tf2_msgs/msg/TFMessage": Kind("tf", _transforms),
    "tf/msg/tfMessage": Kind("tf", _transforms),
    "move_base_msgs/msg/MoveBaseActionGoal": Kind("goal", _goal),
    "sensor_msgs/msg/LaserScan": Kind("scan"),
    "nav_msgs/msg/Path": Kind("path"),
    "geometry_msgs/msg/Twist": Kind("command"),
    "geometry_msgs/msg/TwistStamped": Kind("command"),
}
"""By type. /goal_pose and its like are poses whose topic speaks of a goal."""
