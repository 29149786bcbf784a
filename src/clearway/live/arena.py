"""Planners of Arena (`arena-planners`, MIT): their step protocol, so that they run as they are.

A planner is a folder with a `planner.py` and a manifest `planner.yaml`, which says what it observes and how it acts. Frames in MessagePack go
over four sockets of ZeroMQ, whose places it finds in its environment: observations, actions, control and its answers. Written from
`arena_planners/bridge/protocol.py` and `sdk.py`, version 2.
"""

from __future__ import annotations

import math
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.contract import Command, Observation, Task
from clearway.crowds.ways import Ways, way_point
from clearway.errors import ClearwayError, shown
from clearway.geometry.shapes import FloatArray, circumscribed_radius
from clearway.live.line import WireError, Words
from clearway.live.navigator import HELLO_LIMIT
from clearway.live.peers import ENDING, Program, fate_of
from clearway.navigators.common.route import Route, seen
from clearway.reading import read_yaml
from clearway.robots import Robot, possible

Array = npt.NDArray[Any]

VERSION = 2
"""Of the protocol."""

_SCHEMA = 1
_SOCKETS = ("OBS", "ACTION", "CONTROL", "CTRL_ACK")
_LOOK = 100  # ms between two looks at whether it is still there
_STEP_OF_PATH, _LONGEST_PATH = 0.25, 400  # m, points
_NEEDS = {
    "RobotPoseTFGenerator": (),
    "nav_msgs/Odometry": (),
    "geometry_msgs/PoseStamped": (),
    "nav_msgs/OccupancyGrid": (),  # for whoever makes the path; planners are never sent it
    "nav_msgs/Path": ("map", "obstacles"),
    "SubgoalGenerator": ("map", "obstacles"),
    "sensor_msgs/LaserScan": ("scan",),
    "arena_people_msgs/Pedestrians": ("obstacles",),
}


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a planner's `planner.yaml` says.

    Attributes:
        action: `differential_drive` or `omnidirectional`.
        sources: What it observes: name -> type and parameters.
        aliases: Other names of these.
        config: What it is configured with.
        observations: All that the file says of observations.
    """

    action: str
    sources: Mapping[str, tuple[str, Mapping[str, Any]]]
    aliases: Mapping[str, str]
    config: Mapping[str, Any]
    observations: Mapping[str, Any]

    @property
    def needs(self) -> frozenset[str]:
        """What of an observation that takes."""
        return frozenset(need for kind, _ in self.sources.values() for need in _NEEDS[kind])


def read_manifest(file: Path) -> Manifest:
    """The manifest in a file.

    Raises:
        ClearwayError: it is none, or asks for what there is not.
    """
    found = _table(read_yaml(file), file, "the file")
    action = found.get("action_type")
    if action not in ("differential_drive", "omnidirectional"):
        raise ClearwayError(
            f"{shown(action)} is none; differential_drive and omnidirectional are", file=file, field="action_type"
        )
    observed = _table(found.get("observations"), file, "observations")
    sources = {}
    for name, source in _table(observed.get("datasources"), file, "observations.datasources").items():
        field = f"observations.datasources.{name}"
        kind = _table(source, file, field).get("type")
        if not isinstance(kind, str) or kind not in _NEEDS:
            raise ClearwayError(
                f"{shown(kind)} is not to be had; {', '.join(_NEEDS)} are", file=file, field=f"{field}.type"
            )
        about = _table(source.get("params"), file, f"{field}.params")
        for key, least in (("lookahead", 0.01), ("canonical_beams", 2)):
            wanted = int | float if key == "lookahead" else int
            if not isinstance(value := about.get(key, least), wanted) or not least <= value <= 100_000:
                raise ClearwayError(
                    f"{shown(value)} is none; {least} or more is", file=file, field=f"{field}.params.{key}"
                )
        sources[name] = (str(kind), about)
    aliases = {n: str(t) for n, t in _table(observed.get("aliases"), file, "observations.aliases").items()}
    return Manifest(action, sources, aliases, _table(found.get("config"), file, "config"), observed)


def _table(value: object, file: Path, field: str) -> dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise ClearwayError(f"{shown(value)} is no table", file=file, field=field)
    return value


class Session:
    """A planner's process, and frames to it and back.

    Args:
        command: Starts it.

    Attributes:
        words: What it writes for people.

    Raises:
        WireError: it can't be started.
    """

    def __init__(self, command: list[str]) -> None:
        import msgpack
        import zmq

        self._pack, self._unpack = msgpack.packb, msgpack.unpackb
        self._folder = tempfile.TemporaryDirectory(prefix="clearway_arena_")
        places = {name: f"ipc://{self._folder.name}/{name.lower()}" for name in _SOCKETS}
        told = {f"ARENA_PLANNER_{name}_ENDPOINT": place for name, place in places.items()}
        self._program = Program(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=os.environ | told
        )
        self._process = self._program.process
        assert self._process.stdout is not None
        self.words = Words(self._process.stdout.fileno())
        self._context, self._poller = zmq.Context(), zmq.Poller()
        self._sockets = {n: self._context.socket(zmq.PUSH if n in ("OBS", "CONTROL") else zmq.PULL) for n in places}
        for name, place in places.items():
            self._sockets[name].bind(place)  # it tries to connect until somebody has
        for name in ("ACTION", "CTRL_ACK"):
            self._poller.register(self._sockets[name], zmq.POLLIN)

    def greet(self, manifest: Manifest) -> None:
        """Open the session.

        Raises:
            WireError: it does not answer as it must.
        """
        frame = {
            "op": "init",
            "protocol_version": VERSION,
            "schema_version": _SCHEMA,
            "obs_schema": dict(manifest.observations),
            "action_schema": {"action_type": manifest.action},
            "planner_config": dict(manifest.config),
            "run_id": "clearway",
        }
        self.ask("CONTROL", frame, "init_ack", HELLO_LIMIT)

    def ask(self, where: str, frame: dict[str, Any], expected: str, limit: float | None = None) -> dict[str, Any]:
        """The answer to a frame.

        Args:
            where: `OBS` or `CONTROL`.
            frame: What it is sent.
            expected: The `op` of the answer.
            limit: How long to wait, s; None: as long as it takes.

        Raises:
            WireError: it has ended, or answers something else.
        """
        left: bytes | None = self._pack(frame, default=_array)
        until = None if limit is None else time.monotonic() + limit
        while True:
            if left is not None and self._sent(where, left):
                left = None
            for socket, _ in self._poller.poll(_LOOK):
                answer = self._read(socket.recv())
                if answer["op"] == expected and answer.get("seq") == frame.get("seq"):
                    return answer
                if answer["op"] != "heartbeat":
                    raise WireError(f"answered {frame['op']} with {shown(answer)}; {expected} is expected")
            self.words.pass_on()
            if self._process.poll() is not None:
                raise WireError(fate_of(self._process))
            if until is not None and time.monotonic() > until:
                raise WireError(f"did not answer {frame['op']} within {limit:g} s")

    def _sent(self, where: str, frame: bytes) -> bool:
        """Whether a frame could be sent: it can't before the planner has connected, nor once it has gone."""
        import zmq

        try:
            self._sockets[where].send(frame, zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True

    def leave(self) -> None:
        """Have it end by itself, for a moment, then end it."""
        with suppress(WireError):
            self.ask("CONTROL", {"op": "shutdown"}, "bye", ENDING)
            fate_of(self._process)
        self.end()

    def end(self) -> None:
        """Let nothing of it go on."""
        self._program.end()
        assert self._process.stdout is not None
        self._process.stdout.close()
        self._context.destroy(linger=0)
        self._folder.cleanup()

    def _read(self, frame: bytes) -> dict[str, Any]:
        try:
            found = self._unpack(frame, raw=False, strict_map_key=False)
        except ValueError as error:
            raise WireError("said what is no frame in MessagePack") from error
        if not isinstance(found, dict) or not isinstance(found.get("op"), str):
            raise WireError(f"said {shown(found)}, which is no frame")
        if found["op"] == "error":
            raise WireError(f"says that it failed: {shown(found.get('msg'))} ({shown(found.get('code'))})")
        return found


def _array(value: Any) -> Any:
    """An array as msgpack-numpy writes it."""
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a {type(value).__name__} is nothing for the wire")
    return {b"nd": True, b"type": value.dtype.str, b"kind": b"", b"shape": value.shape, b"data": value.tobytes()}


class ArenaPlanner:
    """A navigator that is a planner of Arena.

    Args:
        name: By which its errors name it.
        command: Starts it.
        manifest: What it says.

    Attributes:
        needs: What of an observation it takes.
        drives: The kinds of bases that it drives: to a differential one an `omnidirectional` action is projected as Arena does it.

    Raises:
        WireError: it can't be started, or does not answer as it must.
    """

    drives = frozenset({"differential", "omnidirectional"})

    def __init__(self, name: str, command: list[str], manifest: Manifest) -> None:
        self.name, self._command, self._manifest = name, command, manifest
        self.needs = manifest.needs
        self._session: Session | None = None
        self._heard(lambda session: None)

    def reset(self, task: Task, robot: Robot, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._task, self._limits, self._count = task, robot.limits(task.speed_limit), 0
        self._route = Route(task, circumscribed_radius(robot.planner_shape), self._limits, _STEP_OF_PATH)
        episode = f"{int(rng.integers(2**53))}"
        self._heard(lambda session: session.ask("CONTROL", {"op": "reset", "episode_id": episode}, "reset_ack"))

    def step(self, observation: Observation) -> Command:
        """Have it act on its features of an observation."""
        if self._session is None:
            raise WireError(f"{self.name} has failed before, and is begun anew by reset()")
        self._count += 1
        seconds = math.floor(observation.t + 1e-9)
        frame = {
            "op": "obs", "t_sec": seconds, "t_nanosec": max(round(1e9 * (observation.t - seconds)), 0), "seq": self._count,
            "features": self._features(observation),
        }  # fmt: skip
        theta = float(observation.pose[2])

        def acted(session: Session) -> Command:
            answer = session.ask("OBS", frame, "action")
            v, omega, v_y = self._held(*self._driven(answer.get("action"), theta))
            return Command(v, omega, v_y=v_y, arrived=True if answer.get("signal") == "arrived" else None)

        command: Command = self._heard(acted)
        return command

    def close(self) -> None:
        """End it."""
        session, self._session = self._session, None
        if session is not None:
            session.leave()

    def __del__(self) -> None:
        if getattr(self, "_session", None) is not None:
            self.close()

    def _heard(self, ask: Callable[[Session], Any]) -> Any:
        """What it answers; begun anew if it is not there. If anything is wrong with that, it is ended."""
        try:
            if self._session is None:
                self._session = Session(self._command)
                self._session.greet(self._manifest)
            return ask(self._session)
        except BaseException as error:
            session, self._session = self._session, None
            words = "" if session is None else session.words.last()
            if session is not None:
                session.end()
            if not isinstance(error, WireError):
                error.add_note(words)
                raise
            raise WireError(f"{self.name} {error}{words}") from None

    def _driven(self, action: Any, theta: float) -> tuple[float, float, float]:
        """Forward, turning and leftward speed that an action asks of the base."""
        good = isinstance(action, list) and all(isinstance(a, int | float) and math.isfinite(a) for a in action)
        if good and self._manifest.action == "differential_drive" and len(action) == 2:
            return float(action[0]), float(action[1]), 0.0
        if good and self._manifest.action == "omnidirectional" and len(action) in (2, 3):
            vx, vy, omega = (*map(float, action), 0.0)[:3]
            speed, turn = math.hypot(vx, vy), math.remainder(math.atan2(vy, vx) - theta, math.tau)
            if self._limits.v_y_max > 0.0:
                return speed * math.cos(turn), omega, speed * math.sin(turn)
            return speed, omega + (turn / self._task.period if speed >= 1e-6 else 0.0), 0.0
        raise WireError(f"acts {shown(action)}, which is no action of kind {self._manifest.action}")

    def _held(self, v: float, omega: float, v_y: float) -> tuple[float, float, float]:
        """What the base can hold of that: all by one factor, so that the curve stays, as Arena does it."""
        limits = self._limits
        most = ((v, limits.v_max), (-v, -limits.v_min), (abs(v_y), limits.v_y_max), (abs(omega), limits.omega_max))
        over = max(1.0, *(value / limit for value, limit in most if limit > 0.0))
        return possible(limits, v / over, omega / over, v_y / over)

    def _features(self, o: Observation) -> dict[str, Any]:
        found = {name: self._feature(kind, about, o) for name, (kind, about) in self._manifest.sources.items()}
        found |= {alias: found[target] for alias, target in self._manifest.aliases.items() if target in found}
        return {name: value for name, value in found.items() if value is not None}

    def _feature(self, kind: str, about: Mapping[str, Any], o: Observation) -> Array | None:
        v, omega, v_y = (*o.velocity, 0.0)[:3]
        if kind == "RobotPoseTFGenerator":
            return np.array(o.pose)
        if kind == "nav_msgs/Odometry":
            x, y, theta = o.odom_pose
            return np.array((x, y, v, v_y, theta, omega))
        if kind == "geometry_msgs/PoseStamped":
            return np.array(o.goal.pose)
        if kind == "nav_msgs/Path":
            return self._path(o)
        if kind == "SubgoalGenerator":
            point = _ahead(self._ways(o), o.pose, float(about.get("lookahead", 2.0)))
            return np.array((*point, math.atan2(point[1] - o.pose[1], point[0] - o.pose[0])))
        if kind == "sensor_msgs/LaserScan":
            return self._ranges(o, int(about.get("canonical_beams", 0)))
        if kind == "arena_people_msgs/Pedestrians":
            others = o.obstacles
            assert others is not None
            rows = np.column_stack((others.identity, others.position, np.nan_to_num(others.velocity)))
            return rows[others.moving].astype(np.float32)
        return None

    def _ways(self, o: Observation) -> Ways:
        return self._route.ways(o.t, o.pose, o.goal, seen(o.obstacles, self._task.map is not None))

    def _path(self, o: Observation) -> FloatArray:
        """The way to the goal, (n, 3)."""
        ways, points = self._ways(o), [o.pose[:2]]
        while len(points) < _LONGEST_PATH and math.dist(points[-1], o.goal.pose[:2]) > 1e-6:
            point = _ahead(ways, points[-1], _STEP_OF_PATH)
            if math.dist(points[-1], point) < 1e-6:
                break
            points.append(point)
        line = np.array(points)
        along = np.diff(line, axis=0, append=line[-1:])
        theta = np.arctan2(along[:, 1], along[:, 0])
        theta[-1] = o.goal.pose[2]
        return np.column_stack((line, theta))

    def _ranges(self, o: Observation, beams: int) -> Array:
        """Ranges as float32, the longest where nothing came back; around the robot in so many `beams`, if they aren't 0."""
        scan = o.scan
        assert scan is not None
        ranges = np.where(np.isfinite(scan.ranges), scan.ranges, scan.range_max).astype(np.float32)
        if not beams:
            return ranges
        ranges[(ranges <= 0.0) | (ranges < scan.range_min)] = scan.range_max
        theta = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
        asked = math.tau / beams * np.arange(beams)
        around = np.interp(asked, theta, np.minimum(ranges, scan.range_max), period=math.tau)
        nearest = np.abs(np.remainder(asked[:, None] - theta + math.pi, math.tau) - math.pi).min(axis=1)
        around[nearest > 1.5 * abs(scan.angle_increment)] = scan.range_max  # nobody looks there
        return np.asarray(around, dtype=np.float32)


def _ahead(ways: Ways, point: FloatArray, ahead: float) -> FloatArray:
    """The point (2,) so far ahead on the way, at most, in free sight."""
    x, y, _ = way_point(ways, float(point[0]), float(point[1]), ahead)
    step = np.array((x - point[0], y - point[1]))
    away = math.hypot(*step)
    return np.asarray(point[:2] + step * min(1.0, ahead / away if away > 0.0 else 1.0))
