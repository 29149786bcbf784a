"""A trial as an MCAP of ROS 2 messages, laid out for rosbag2 and for the usual viewers (REP-103, REP-105).

| topic | type | what |
|---|---|---|
| /tf | tf2_msgs/TFMessage | map->odom, odom->base_link: the robot where it believes to be (truly is, without an estimate) |
| /tf_static | tf2_msgs/TFMessage | base_link->base_scan |
| /odom | nav_msgs/Odometry | the true motion since the start: a trial keeps no wheel odometry |
| /amcl_pose | geometry_msgs/PoseWithCovarianceStamped | the estimate |
| /ground_truth/pose | geometry_msgs/PoseWithCovarianceStamped | the true or measured pose, with its uncertainty if known |
| /footprint | geometry_msgs/PolygonStamped | the contact shape at the true pose |
| /cmd_vel | geometry_msgs/Twist | commands |
| /scan | sensor_msgs/LaserScan | made anew from the shapes and the robot's lidar at the true pose, without noise |
| /obstacles/static, /obstacles/moving | visualization_msgs/MarkerArray | walls, furniture and obstacles; what moves |
| /obstacles/NAME/pose | geometry_msgs/PoseWithCovarianceStamped | of what moves, while it is there |
| /goal_pose | geometry_msgs/PoseStamped | each leg's goal when it begins |
| /plan, /local_plan, /plan/NAME | nav_msgs/Path | polylines that the navigator showed |
| /events | std_msgs/String | events, `kind: detail` |

All stamps are the trial's time after `epoch`. The same trial gives the same bytes.
"""

from __future__ import annotations

import heapq
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from clearway.contract import BodyKind
from clearway.errors import ClearwayError
from clearway.geometry.raycast import Beams, beams, cast, cast_moving, scene
from clearway.geometry.shapes import Circle, FloatArray, Shape
from clearway.placing import placed
from clearway.robots import Robot, load_robot
from clearway.trials.trial import Body, Trial

EPOCH = 946684800.0
"""UNIX time [s] of 2000-01-01: a trial does not know when it was."""
SCAN_RATE = 20.0
"""Hz; of a trial that is sampled faster, so many scans are made."""
DISPLAY_RATE = 20.0
"""Hz of footprint and moving markers, likewise."""

_STORE = get_typestore(Stores.ROS2_HUMBLE)
_VERSION: Final = 8  # of metadata.yaml; 9 is only known to the newest distributions
_HEIGHT = 1.0  # m, of what the plan knows no height of, for the eye only
_SIDES = 32  # of a round footprint
_LATCHED = ("/tf_static", "/obstacles/static")
_COLOURS = {
    BodyKind.WALL: (0.3, 0.3, 0.3),
    BodyKind.FURNITURE: (0.5, 0.4, 0.3),
    BodyKind.OBSTACLE: (0.9, 0.5, 0.1),
    BodyKind.MOVING_OBSTACLE: (0.8, 0.1, 0.2),
    BodyKind.PERSON: (0.1, 0.4, 0.8),
}
_PLANS = {"plan": "/plan", "global plan": "/plan", "local plan": "/local_plan"}

_Line = tuple[float, str, str, Any]  # t [s], topic, type, message


def write_trial(path: Path, trial: Trial, *, scans: bool = True, epoch: float = EPOCH) -> None:
    """Write a trial: a bag folder with metadata.yaml, or a bare file where `path` ends in `.mcap`.

    Args:
        scans: Whether to make the lidar's scans anew; without a lidar that Clearway knows there are none.
        epoch: UNIX time [s] of the trial's t = 0.

    Raises:
        ClearwayError: `path` exists, can't be written, or the time is before 1970.
    """
    path = Path(path)
    if not 0 <= epoch + float(trial.t[0] if len(trial.t) else 0.0) < 2**31 - 1e6:
        raise ClearwayError(f"the UNIX time {epoch} s is none that a ROS message can hold", file=path, field="epoch")
    if os.path.exists(path):
        raise ClearwayError("exists already; name a file or folder that doesn't", file=path)
    with placed(path.parent) as new:
        bag = new / (path.stem if path.suffix == ".mcap" else path.name)
        _write(bag, heapq.merge(*_streams(trial, scans), key=lambda line: line[0]), epoch)
        if path.suffix == ".mcap":
            os.replace(bag / f"{bag.name}.mcap", new / path.name)
            shutil.rmtree(bag)


def _write(folder: Path, lines: Iterable[_Line], epoch: float) -> None:
    with Writer(folder, version=_VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
        connections: dict[str, Any] = {}
        for t, topic, kind, message in lines:
            stamp = _ns(epoch, t)
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=_STORE, offered_qos_profiles=(_KEPT,) if topic in _LATCHED else ()
                )
            for header in _headers(message):
                header.stamp = _make("builtin_interfaces/msg/Time", *divmod(stamp, 1_000_000_000))
            writer.write(connections[topic], stamp, _STORE.serialize_cdr(message, kind))


def _streams(trial: Trial, scans: bool) -> list[Iterator[_Line]]:
    """Everything to write, each stream in order of time."""
    lidar = _lidar(trial) if scans else None
    streams = [
        _once(trial, lidar),
        _robot(trial),
        _legs(trial),
        _moving_obstacles(trial),
        _plans(trial),
        _events(trial),
    ]
    return [*streams, _scans(trial, lidar)] if lidar is not None else streams


class _Lidar(NamedTuple):
    beams: Beams
    mount: FloatArray


def _lidar(trial: Trial) -> _Lidar | None:
    try:
        robot: Robot = load_robot(trial.attempt.robot)
    except ClearwayError:  # a robot that only its user knows
        return None
    if (spec := robot.lidar) is None:
        return None
    made = beams(spec.beams, spec.angle_min, spec.angle_max, spec.range_min, spec.range_max)
    return _Lidar(made, np.array(spec.mount, dtype=np.float64))


def _once(trial: Trial, lidar: _Lidar | None) -> Iterator[_Line]:
    t = float(trial.t[0]) if len(trial.t) else 0.0
    if lidar is not None:
        yield _tf(t, "/tf_static", ("base_link", "base_scan", lidar.mount))
    fixed = [(b, b.pose) for b in trial.attempt.bodies if b.pose is not None]
    yield t, "/obstacles/static", *_markers(fixed)


def _robot(trial: Trial) -> Iterator[_Line]:
    pose, estimate, velocity = trial.pose, trial.estimate, trial.velocity
    known = np.flatnonzero(np.isfinite(pose).all(axis=1))
    start = pose[known[0]] if len(known) else np.zeros(3)
    odom = _relative(np.broadcast_to(start, pose.shape), pose)
    believed = pose if estimate is None else estimate
    origin = _compose(believed, _relative(odom, np.zeros_like(odom)))
    shown = _thinned(trial.t, DISPLAY_RATE)
    for i, t in enumerate(trial.t.tolist()):
        if np.isfinite(pose[i, :2]).all():
            sigma = None if trial.sigma is None else trial.sigma[i, 0]
            yield t, "/ground_truth/pose", *_with_covariance("map", pose[i], sigma)
            if shown[i] and trial.attempt.footprint is not None and np.isfinite(pose[i, 2]):
                yield t, "/footprint", *_footprint(trial.attempt.footprint, pose[i])
        if estimate is not None and np.isfinite(estimate[i]).all():
            yield t, "/amcl_pose", *_with_covariance("map", estimate[i], None)
        if np.isfinite(odom[i]).all():
            yield t, "/odom", *_odometry(odom[i], None if velocity is None else velocity[i])
            if np.isfinite(origin[i]).all():
                yield _tf(t, "/tf", ("map", "odom", origin[i]), ("odom", "base_link", odom[i]))
        if trial.command is not None and np.isfinite(trial.command[i]).all():
            yield t, "/cmd_vel", "geometry_msgs/msg/Twist", _twist(*trial.command[i])


def _legs(trial: Trial) -> Iterator[_Line]:
    for span in trial.spans:
        goal = trial.attempt.legs[span.leg].goal
        if np.isfinite(goal[:2]).all():
            message = _make("geometry_msgs/msg/PoseStamped", _header("map"), _pose(goal))
            yield span.start, "/goal_pose", "geometry_msgs/msg/PoseStamped", message


def _moving_obstacles(trial: Trial) -> Iterator[_Line]:
    bodies = [b for b in trial.attempt.bodies if b.pose is None]
    topics = _topics([b.name for b in bodies], "/obstacles/{}/pose")
    shown = _thinned(trial.t, DISPLAY_RATE)
    for i, t in enumerate(trial.t.tolist()):
        there = [k for k in range(len(bodies)) if np.isfinite(trial.moving_obstacles[i, k, :2]).all()]
        for k in there:
            sigma = None if trial.sigma is None else trial.sigma[i, 1 + k]
            yield t, topics[k], *_with_covariance("map", trial.moving_obstacles[i, k], sigma)
        if shown[i] and bodies:
            yield (
                t,
                "/obstacles/moving",
                *_markers([(bodies[k], trial.moving_obstacles[i, k]) for k in there], clear=True),
            )


def _plans(trial: Trial) -> Iterator[_Line]:
    for snapshot in trial.snapshots:
        for name, line in snapshot.diagnostics.polylines.items():
            points = [p for p in np.asarray(line, dtype=np.float64) if np.isfinite(p[:2]).all()]
            poses = [_make("geometry_msgs/msg/PoseStamped", _header("map"), _pose((p[0], p[1], 0.0))) for p in points]
            topic = _PLANS.get(name) or f"/plan/{_plain(name)}"
            yield snapshot.t, topic, "nav_msgs/msg/Path", _make("nav_msgs/msg/Path", _header("map"), poses)


def _events(trial: Trial) -> Iterator[_Line]:
    for event in sorted(trial.events, key=lambda e: e.t):
        text = f"{event.kind}: {event.detail}" if event.detail else event.kind
        yield event.t, "/events", "std_msgs/msg/String", _make("std_msgs/msg/String", text)


def _scans(trial: Trial, lidar: _Lidar) -> Iterator[_Line]:
    outlined = [b for b in trial.attempt.bodies if b.outlined]
    fixed = scene([b.shape for b in outlined if b.pose is not None],
                  np.array([b.pose for b in outlined if b.pose is not None]).reshape(-1, 3))  # fmt: skip
    moving = scene([b.shape for b in outlined if b.pose is None])
    which = [k for k, b in enumerate(b for b in trial.attempt.bodies if b.pose is None) if b.outlined]
    optics, shown = lidar.beams, _thinned(trial.t, SCAN_RATE)
    poses = _compose(trial.pose, np.broadcast_to(lidar.mount, trial.pose.shape))
    count = optics.directions.shape[1]
    for i in np.flatnonzero(shown & np.isfinite(poses).all(axis=1)):
        x, y, theta = poses[i].tolist()
        ranges = np.full(count, np.inf)
        beam = (optics.directions, optics.angle_min, optics.increment, optics.range_max, ranges)
        cast(fixed.segments, fixed.circles, x, y, theta, *beam)
        there = np.ascontiguousarray(trial.moving_obstacles[i, which])
        cast_moving(moving.segments, moving.segment_owner, moving.circles, moving.circle_owner, there,
                    x, y, theta, *beam)  # fmt: skip
        ranges[(ranges < optics.range_min) | (ranges > optics.range_max)] = np.inf
        last = optics.angle_min + (count - 1) * optics.increment
        message = _make("sensor_msgs/msg/LaserScan", _header("base_scan"), optics.angle_min, last, optics.increment,
                        0.0, 0.0, optics.range_min, optics.range_max, ranges.astype(np.float32),
                        np.zeros(0, dtype=np.float32))  # fmt: skip
        yield float(trial.t[i]), "/scan", "sensor_msgs/msg/LaserScan", message


def _markers(bodies: Iterable[tuple[Body, FloatArray]], *, clear: bool = False) -> tuple[str, Any]:
    """Cylinders for circles, closed lines for polygons; `clear`: those shown before are gone."""
    kind = "visualization_msgs/msg/MarkerArray"
    first = [_marker(0, "", 0, 3, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), [])] if clear else []
    return kind, _make(kind, [*first, *(_marker_of(i, body, pose) for i, (body, pose) in enumerate(bodies))])


def _marker_of(number: int, body: Body, pose: FloatArray) -> Any:
    at = tuple(np.nan_to_num(pose).tolist())
    colour = _COLOURS.get(body.kind, (0.5, 0.5, 0.5))
    if isinstance(body.shape, Circle):
        wide = 2 * body.shape.radius
        return _marker(number, body.name, 3, 0, at, (wide, wide, _HEIGHT), colour, [])
    points = [(x, y) for x, y in (*body.shape.vertices, body.shape.vertices[0])]
    return _marker(number, body.name, 4, 0, at, (0.03, 0.0, 0.0), colour, points)


def _marker(number: int, name: str, kind: int, action: int, pose: Any, scale: Any, colour: Any, points: Any) -> Any:
    z = _HEIGHT / 2 if kind == 3 else 0.0
    return _make(
        "visualization_msgs/msg/Marker", _header("map"), name, number, kind, action, _pose(pose, z),
        _vector(*scale), _make("std_msgs/msg/ColorRGBA", *colour, 1.0), _make("builtin_interfaces/msg/Duration", 0, 0),
        False, [_make("geometry_msgs/msg/Point", float(x), float(y), 0.0) for x, y in points], [], "",
        _make("sensor_msgs/msg/CompressedImage", _header(""), "", np.zeros(0, dtype=np.uint8)), [], "", "",
        _make("visualization_msgs/msg/MeshFile", "", np.zeros(0, dtype=np.uint8)), False,
    )  # fmt: skip


def _footprint(shape: Shape, pose: FloatArray) -> tuple[str, Any]:
    if isinstance(shape, Circle):
        angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
        corners = shape.radius * np.column_stack([np.cos(angles), np.sin(angles)])
    else:
        corners = shape.array
    c, s = np.cos(pose[2]), np.sin(pose[2])
    placed = corners @ np.array([[c, s], [-s, c]]) + pose[:2]
    points = [_make("geometry_msgs/msg/Point32", float(x), float(y), 0.0) for x, y in placed]
    kind = "geometry_msgs/msg/PolygonStamped"
    return kind, _make(kind, _header("map"), _make("geometry_msgs/msg/Polygon", points))


def _odometry(pose: FloatArray, velocity: FloatArray | None) -> tuple[str, Any]:
    kind = "nav_msgs/msg/Odometry"
    told = (np.nan, np.nan) if velocity is None else velocity.tolist()
    none = np.zeros(36)
    return kind, _make(kind, _header("odom"), "base_link",
                       _make("geometry_msgs/msg/PoseWithCovariance", _pose(pose), none),
                       _make("geometry_msgs/msg/TwistWithCovariance", _twist(*told), none))  # fmt: skip


def _with_covariance(frame: str, pose: FloatArray, sigma: FloatArray | None) -> tuple[str, Any]:
    """A pose; covariances of zero are what ROS writes for unknown ones."""
    kind, covariance = "geometry_msgs/msg/PoseWithCovarianceStamped", np.zeros(36)
    if sigma is not None:
        place, heading = np.nan_to_num(sigma) ** 2
        covariance[[0, 7, 35]] = place, place, heading
    return kind, _make(kind, _header(frame), _make("geometry_msgs/msg/PoseWithCovariance", _pose(pose), covariance))


def _tf(t: float, topic: str, *edges: tuple[str, str, FloatArray]) -> _Line:
    kind = "tf2_msgs/msg/TFMessage"
    made = []
    for parent, child, pose in edges:
        at = _pose(pose)
        transform = _make("geometry_msgs/msg/Transform", _vector(pose[0], pose[1], 0.0), at.orientation)
        made.append(_make("geometry_msgs/msg/TransformStamped", _header(parent), child, transform))
    return t, topic, kind, _make(kind, made)


def _pose(pose: Any, z: float = 0.0) -> Any:
    """A planar pose; without a heading its quaternion is zeros, which is none."""
    x, y, theta = (float(v) for v in pose)
    q = (np.sin(theta / 2), np.cos(theta / 2)) if np.isfinite(theta) else (0.0, 0.0)
    return _make("geometry_msgs/msg/Pose", _make("geometry_msgs/msg/Point", x, y, z),
                 _make("geometry_msgs/msg/Quaternion", 0.0, 0.0, float(q[0]), float(q[1])))  # fmt: skip


def _twist(v: float, omega: float, v_y: float = 0.0) -> Any:
    return _make("geometry_msgs/msg/Twist", _vector(float(v), float(v_y), 0.0), _vector(0.0, 0.0, float(omega)))


def _vector(x: float, y: float, z: float) -> Any:
    return _make("geometry_msgs/msg/Vector3", float(x), float(y), float(z))


def _header(frame: str) -> Any:
    return _make("std_msgs/msg/Header", _make("builtin_interfaces/msg/Time", 0, 0), frame)


@cache
def _fields(kind: str) -> Callable[..., Any]:
    return _STORE.types[kind]


def _make(kind: str, *values: Any) -> Any:
    return _fields(kind)(*values)


def _headers(message: Any) -> Iterator[Any]:
    """The headers to stamp: the message's own and those of what it lists."""
    if hasattr(message, "header"):
        yield message.header
    for name in ("transforms", "markers", "poses"):
        for part in getattr(message, name, ()):
            yield part.header


def _relative(a: FloatArray, b: FloatArray) -> FloatArray:
    """Poses b (n, 3) as seen from a (n, 3)."""
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    dx, dy = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1]
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, b[:, 2] - a[:, 2]])


def _compose(a: FloatArray, b: FloatArray) -> FloatArray:
    """Poses b (n, 3), given in the frames a (n, 3), in the frame of a."""
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    return np.column_stack(
        [a[:, 0] + c * b[:, 0] - s * b[:, 1], a[:, 1] + s * b[:, 0] + c * b[:, 1], a[:, 2] + b[:, 2]]
    )


def _thinned(t: FloatArray, rate: float) -> Any:
    """Which samples to keep so that there are at most `rate` a second: the first in each period."""
    period = np.floor((t - (t[0] if len(t) else 0.0)) * rate + 1e-6)
    return np.diff(period, prepend=-1.0) > 0


def _topics(names: list[str], pattern: str) -> list[str]:
    """One topic a body; two names that ROS can't tell apart are numbered."""
    topics: list[str] = []
    for name in names:
        topic, k = pattern.format(_plain(name)), 2
        while topic in topics:
            topic, k = pattern.format(f"{_plain(name)}_{k}"), k + 1
        topics.append(topic)
    return topics


def _plain(name: str) -> str:
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name)
    return plain if plain[:1].isalpha() else f"body_{plain}"


def _ns(epoch: float, t: float) -> int:
    return round(epoch * 1e9) + round(t * 1e9)


_ZERO = QosTime(0, 0)
_KEPT = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, _ZERO, _ZERO,
            QosLiveliness.AUTOMATIC, _ZERO, False)  # fmt: skip
