"""The messages that Clearway understands, and what each says.

Messages are decoded by the standard definitions that come with rosbags (Noetic's for ROS 1, the newest distribution's
for ROS 2: what is read here is the same in all of them), never by code made from a file's own. So bags without
definitions are read as well; where a bag has them, they must say the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from clearway.errors import ClearwayError
from clearway.recordings.formats.bag_store import Channel

NAN = float("nan")
_LONGEST = 64 << 10  # characters of a definition that is compared

_OWN = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "tf/msg/tfMessage": "geometry_msgs/TransformStamped[] transforms",
    "move_base_msgs/msg/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose",
    "move_base_msgs/msg/MoveBaseActionGoal": "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\nMoveBaseGoal goal",
    "motion_capture_tracking_interfaces/msg/NamedPose": "string name\ngeometry_msgs/Pose pose",
    "motion_capture_tracking_interfaces/msg/NamedPoseArray": "std_msgs/Header header\nNamedPose[] poses",
}
"""Definitions of what rosbags has none of, by the packages' own files."""


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


class Kind(NamedTuple):
    """What a type of message is to a recording.

    Attributes:
        kind: Its kind, as in `Entry`.
        poses: Gives the poses of a message; None where other code reads it.
    """

    kind: str
    poses: Callable[[Any], Iterator[Pose]] | None = None


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
    name = type_name(channel.type)
    store = _store(channel.encoding == "ros1")
    _compare(channel, name, store, file)
    decode = store.deserialize_ros1 if channel.encoding == "ros1" else store.deserialize_cdr

    def read(data: bytes) -> Any:
        try:
            return decode(data, name)
        except Exception as error:  # generated code on arbitrary bytes
            raise ClearwayError(
                f"a message of {len(data)} bytes is no {channel.type}: {error}", file=file, field=channel.topic
            ) from error

    return read


def stamp_of(header: Any) -> int:
    """A header's stamp in ns, 0 where nobody set it."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


@cache
def _store(ros1: bool) -> Typestore:
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.LATEST)
    missing = {n: text for n, text in _OWN.items() if n not in store.fielddefs}
    types: dict[Any, Any] = {}
    for name, text in missing.items():
        types |= get_types_from_msg(text, name)
    store.register(types)
    return store


def _compare(channel: Channel, name: str, store: Typestore, file: Path) -> None:
    if not channel.definition.strip():
        return
    wrong = ClearwayError(
        f"the bag's own definition of {channel.type} differs from the standard one, by which it would be read",
        file=file,
        field=channel.topic,
    )
    if len(channel.definition) > _LONGEST:
        raise wrong
    try:
        if channel.schema in ("ros2idl", "omgidl"):
            line = "=" * 80 + "\n"
            texts = [part.partition("\n")[2] for part in channel.definition.split(line) if part.startswith("IDL: ")]
            found: dict[Any, Any] = {}
            for text in texts or [channel.definition]:
                found |= get_types_from_idl(text)
        else:
            found = get_types_from_msg(channel.definition, name)
    except Exception as error:  # a parser on arbitrary text
        raise wrong from error
    for of, (_, fields) in found.items():
        if of in store.fielddefs and fields != store.fielddefs[of][1]:
            raise wrong
    if name not in found:
        raise wrong


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


def _pose(pose: Any) -> tuple[float, ...]:
    p, q = pose.position, pose.orientation
    return p.x, p.y, p.z, q.x, q.y, q.z, q.w


def _sigma(covariance: Any) -> tuple[float, float]:
    """Standard uncertainty of position (along the worst direction) and heading; zero, negative or absurd: unknown."""
    a, b, d, yaw = float(covariance[0]), float(covariance[1]), float(covariance[7]), float(covariance[35])
    variance = (a + d) / 2 + (((a - d) / 2) ** 2 + b * b) ** 0.5 if a > 0 and d > 0 else NAN
    return _root(variance), _root(yaw)


def _root(variance: float) -> float:
    return variance**0.5 if 0 < variance < _UNKNOWN else NAN


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
    "tf2_msgs/msg/TFMessage": Kind("tf", _transforms),
    "tf/msg/tfMessage": Kind("tf", _transforms),
    "move_base_msgs/msg/MoveBaseActionGoal": Kind("goal", _goal),
    "sensor_msgs/msg/LaserScan": Kind("scan"),
    "nav_msgs/msg/Path": Kind("path"),
}
"""By type. /goal_pose and its like are poses whose topic speaks of a goal."""
