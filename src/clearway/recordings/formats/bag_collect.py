"""From decoded messages to tracks, goals, scans and paths. A message is dropped as soon as its numbers are taken."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats.bag_messages import Pose, stamp_of
from clearway.recordings.formats.tf import frame_name
from clearway.recordings.recording import LARGEST_TWIST, Commands, Goals, Paths, Points, Sweeps, Track
from clearway.recordings.times import in_order

SECOND = 1_000_000_000
LEAP = 3600 * SECOND
_MOST_BEAMS = 100_000
_MOST_MARKERS = 20_000_000  # markers times messages
_AHEAD = 0.5  # s by which a pose that was driven may be later than the message that tells of it
_WHOLE_DAY = 86_400.0


@dataclass(slots=True)
class Clock:
    """Seconds since the bag's start, from a message's own stamp where it has one, else from when it was recorded.

    Stamps that are hours away from the recording's time were taken on another clock (a simulation's, a robot's that
    was never set); they keep their distances and are moved by `far()` [ns], the same whatever is read of a bag.

    Attributes:
        epoch: When the bag starts, UNIX time in ns.
        far: Computes how far the other clock is ahead of the bag's, ns; asked for once, when the first such stamp
            comes.
        shift: What `far()` said, ns; None if nobody asked.
        unstamped: How many messages of each topic had no stamp.
        shifted: The topics whose stamps are of the other clock.
    """

    epoch: int
    far: Callable[[], int]
    shift: int | None = None
    unstamped: Counter[str] = field(default_factory=Counter)
    shifted: set[str] = field(default_factory=set)

    def seconds(self, topic: str, stamp: int, recorded: int) -> float:
        """t [s] of a message of `topic` with `stamp` (0: none), recorded at `recorded` [ns]."""
        if stamp == 0:
            self.unstamped[topic] += 1
            return (recorded - self.epoch) / SECOND
        ahead = stamp - recorded
        if abs(ahead) > LEAP:
            if self.shift is None:
                self.shift = self.far()
            self.shifted.add(topic)
            stamp = stamp - self.shift if abs(ahead - self.shift) <= LEAP else recorded
        return (stamp - self.epoch) / SECOND

    def notes(self) -> list[str]:
        """What had to be done about stamps."""
        said = [f"{topic}: {n} messages have no stamp; the time of recording stands for it" for topic, n in
                sorted(self.unstamped.items())]  # fmt: skip
        if self.shift is not None:
            said.append(
                f"{', '.join(sorted(self.shifted))}: stamped on another clock than the bag's, {self.shift / SECOND:.3f} s"
                " away; moved by that"
            )
        return said


@dataclass(slots=True)
class TrackOf:
    """Collects the poses of one thing.

    Attributes:
        name: What the track is called in the recording.
        kind: Kind of the track, as in `Track`.
        frame: Frame of the first pose, in which all are wanted; None before it came.
        child: What moves, by the first pose.
        other: How many poses were left out, as they are in another frame.
        rows: Twelve numbers a pose, one after the other: t, x, y, z, qx, qy, qz, qw, v, omega, sigma of position, of
            heading.
    """

    name: str
    kind: str
    frame: str | None = None
    child: str = ""
    other: int = 0
    rows: Any = field(default_factory=lambda: array("d"))  # t, x, y, z, qx, qy, qz, qw, v, omega, sigma, sigma

    def add(self, t: float, pose: Pose) -> None:
        frame = frame_name(pose.frame)
        if self.frame is None:
            self.frame, self.child = frame, frame_name(pose.child)
        if frame != self.frame:
            self.other += 1
            return
        self.rows.append(t)
        self.rows.extend((*pose.values, *pose.twist, *pose.sigma))

    def finish(self, file: Path, span: tuple[float, float] | None) -> tuple[Track, list[str]]:
        rows = np.array(self.rows).reshape(-1, 12)  # a copy: the array can't grow while someone looks at it
        rows = rows[_within(rows[:, 0], span)]
        keep, found = in_order(rows[:, 0], file=file, field=self.name, sort=True)
        rows, notes = rows[keep], list(found)
        if self.other:
            notes.append(f"{self.name}: {self.other} poses in another frame than {self.frame!r} were left out")
        q, said = _orientation(rows[:, 4:8], self.name)
        notes += said
        position = np.where(np.abs(rows[:, 1:4]) < 1e12, rows[:, 1:4], np.nan)
        measured = rows[:, 8:10]
        twist = None if np.isnan(measured).all() else measured
        if twist is not None and not np.nan_to_num(measured).any() and _moves(position):
            twist = None
            notes.append(f"{self.name}: its twist is zero all along though it moves; taken as not measured")
        sigma = None if np.isnan(rows[:, 10:12]).all() else rows[:, 10:12]
        return Track(self.kind, self.frame or "", self.child, rows[:, 0], position, q, twist, sigma), notes


@dataclass(slots=True)
class GoalsOf:
    """Collects the goals of one topic.

    Attributes:
        name: What they are called in the recording.
        frame: Frame of the first goal, in which all are wanted; None before it came.
        other: How many goals were left out, as they are in another frame.
        rows: A tuple t [s], x, y [m], theta [rad] for each goal.
    """

    name: str
    frame: str | None = None
    other: int = 0
    rows: list[tuple[float, float, float, float]] = field(default_factory=list)

    def add(self, t: float, pose: Pose) -> None:
        frame = frame_name(pose.frame)
        if self.frame is None:
            self.frame = frame
        if frame != self.frame:
            self.other += 1
            return
        x, y, _, qx, qy, qz, qw = pose.values
        theta = np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        known = 0.9 < qx * qx + qy * qy + qz * qz + qw * qw < 1.1
        self.rows.append((t, x, y, float(theta) if known else np.nan))

    def finish(self, file: Path, span: tuple[float, float] | None) -> tuple[Goals, list[str]]:
        rows = np.array(self.rows, dtype=np.float64).reshape(-1, 4)
        rows = rows[_within(rows[:, 0], span)]
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        notes = [f"{self.name}: {self.other} goals in another frame than {self.frame!r} were left out"]
        return Goals(self.frame or "", rows[:, 0], rows[:, 1:]), notes if self.other else []


@dataclass(slots=True)
class SweepsOf:
    """Collects the scans of one topic. Those whose beams lie elsewhere than in most are left out.

    Attributes:
        name: What they are called in the recording.
        frame: The lidar's frame.
        t: When each scan was taken, s.
        ranges: (b,) distances of each scan, m.
        beams: Of each scan its number of beams, angle_min, angle_increment [rad], range_min and range_max [m].
    """

    name: str
    frame: str = ""
    t: Any = field(default_factory=lambda: array("d"))
    ranges: list[Any] = field(default_factory=list)
    beams: list[tuple[int, float, float, float, float]] = field(default_factory=list)

    def add(self, t: float, m: Any) -> None:
        self.frame = self.frame or frame_name(m.header.frame_id)
        ranges = np.asarray(m.ranges, dtype=np.float32)
        if len(ranges) > _MOST_BEAMS:
            raise ClearwayError(f"a scan of {len(ranges)} beams; at most {_MOST_BEAMS} are read", field=self.name)
        self.t.append(t)
        self.ranges.append(ranges.copy())
        self.beams.append((len(ranges), m.angle_min, m.angle_increment, m.range_min, m.range_max))

    def finish(self, file: Path, span: tuple[float, float] | None) -> tuple[Sweeps, list[str]]:
        t, layout = np.array(self.t), Counter(self.beams)
        if not layout:
            return Sweeps(self.frame, t, np.zeros((0, 0)), 0.0, 0.0, 0.0, 0.0), []
        usual, count = layout.most_common(1)[0]
        same = np.array([b == usual for b in self.beams]) & _within(t, span)
        keep, found = in_order(t[same], file=file, field=self.name, sort=True)
        which = np.flatnonzero(same)[keep]
        notes = list(found)
        if count < len(t):
            notes.append(f"{self.name}: {len(t) - count} of {len(t)} scans have other beams than the rest; left out")
        n, start, step, low, high = usual
        ranges = np.empty((len(which), n))
        for row, i in enumerate(which):
            ranges[row] = self.ranges[i]
        outside = (ranges < low) | (ranges > high)
        ranges[outside] = np.inf
        return Sweeps(self.frame, t[which], ranges, float(start), float(step), float(low), float(high)), notes


@dataclass(slots=True)
class CommandsOf:
    """Collects the velocities that one topic asks for.

    Attributes:
        name: What they are called in the recording.
        rows: Four numbers a command, one after the other: t [s], v, v_y [m/s] and omega [rad/s].
    """

    name: str
    rows: Any = field(default_factory=lambda: array("d"))

    def add(self, t: float, m: Any) -> None:
        twist = m.twist if hasattr(m, "twist") else m
        self.rows.extend((t, twist.linear.x, twist.linear.y, twist.angular.z))

    def finish(self, file: Path, span: tuple[float, float] | None) -> tuple[Commands, list[str]]:
        rows = np.array(self.rows).reshape(-1, 4)
        rows = rows[_within(rows[:, 0], span)]
        wrong = ~(np.abs(rows[:, 1:]) <= LARGEST_TWIST).all(axis=1)
        keep, notes = in_order(rows[~wrong, 0], file=file, field=self.name, sort=True)
        if wrong.any():
            notes = (*notes, f"{self.name}: {int(wrong.sum())} commands are no velocities; left out")
        rows = rows[~wrong][keep]
        return Commands(rows[:, 0], rows[:, 1:]), list(notes)


def mounted(sweeps: Sweeps, placed: tuple[FloatArray, FloatArray] | None) -> Sweeps:
    """The scans of a lidar that sits there on the robot. One that hangs upside down sweeps the other way round."""
    if placed is None:
        return sweeps
    (x, y, _), (a, b, c, d) = placed
    theta = float(np.arctan2(2 * (a * b + c * d), 1 - 2 * (b * b + c * c)))
    sign = 1.0 if 1 - 2 * (a * a + b * b) > 0 else -1.0
    return replace(
        sweeps,
        angle_min=sign * sweeps.angle_min,
        angle_increment=sign * sweeps.angle_increment,
        mount=np.array((x, y, theta)),
    )


@dataclass(slots=True)
class PathsOf:
    """Collects the plans that one topic published, and, where they are no plans but what was driven, that track.

    A driven path grows as the robot drives: each of its poses has a stamp of its own, none later than the message. What a later message
    says of a time replaces what was said before: a map that closes a loop moves them all.

    Attributes:
        name: What they are called in the recording.
        frame: Frame of the plans.
        t: When each was published, s.
        lines: (p, 2) points of each plan, m.
        driven: Whether all of them may be what was driven.
        stamps: ns by the poses' own stamps less those of the messages, and t [s] of these, of what was driven so far.
        rows: The seven numbers of each pose that was driven.
    """

    name: str
    frame: str = ""
    t: list[float] = field(default_factory=list)
    lines: list[FloatArray] = field(default_factory=list)
    driven: bool = True
    stamps: FloatArray = field(default_factory=lambda: np.zeros(0))
    rows: FloatArray = field(default_factory=lambda: np.zeros((0, 7)))

    def add(self, t: float, m: Any) -> None:
        self.frame = self.frame or frame_name(m.header.frame_id)
        self.t.append(t)
        points = [(p.pose.position.x, p.pose.position.y) for p in m.poses]
        self.lines.append(np.array(points, dtype=np.float64).reshape(-1, 2))
        if self.driven and m.poses:
            own = np.array([stamp_of(p.header) for p in m.poses], dtype=np.int64)
            last = stamp_of(m.header) or int(own[-1])
            ago = (own - last) / SECOND
            self.driven = bool(own.all() and (np.diff(own) > 0).all() and ago[-1] <= _AHEAD and ago[0] > -_WHOLE_DAY)
            self._drive(t + ago, m.poses)

    def _drive(self, stamps: FloatArray, poses: Any) -> None:
        before = self.stamps < stamps[0]
        values = [
            (p.x, p.y, p.z, q.x, q.y, q.z, q.w) for p, q in ((x.pose.position, x.pose.orientation) for x in poses)
        ]
        self.stamps = np.concatenate((self.stamps[before], stamps))
        self.rows = np.concatenate((self.rows[before], np.array(values, dtype=np.float64)))

    def finish(self, file: Path, span: tuple[float, float] | None) -> tuple[Paths, list[str]]:
        t = np.array(self.t, dtype=np.float64)
        order = [int(i) for i in np.argsort(t, kind="stable") if _within(t[i : i + 1], span)[0]]
        return Paths(self.frame, t[order], tuple(self.lines[i] for i in order)), []

    def track(self, span: tuple[float, float] | None) -> tuple[Track | None, list[str]]:
        """What was driven, if it is that."""
        inside = _within(self.stamps, span)
        if not self.driven or inside.sum() < 2:
            return None, []
        q, notes = _orientation(self.rows[inside, 3:], self.name)
        notes.append(f"{self.name}: taken as what was driven: its poses have stamps of their own, none from the future")
        position = np.where(np.abs(self.rows[inside, :3]) < 1e12, self.rows[inside, :3], np.nan)
        return Track("path", self.frame, "", self.stamps[inside], position, q), notes


@dataclass(slots=True)
class PointsOf:
    """Collects the markers of one topic.

    Attributes:
        name: The topic.
        of: The markers' names as the recording has them, in the order in which they came.
        t: When each message was taken, s.
        seen: Each message's markers: number in `of`, x, y, z [m].
    """

    name: str
    of: dict[str, int] = field(default_factory=dict)
    t: Any = field(default_factory=lambda: array("d"))
    seen: list[Any] = field(default_factory=list)

    def add(self, t: float, poses: list[tuple[str, Pose]]) -> None:
        self.t.append(t)
        rows = array("d")
        for name, pose in poses:
            rows.append(self.of.setdefault(name, len(self.of)))
            rows.extend(pose.values[:3])
        self.seen.append(rows)

    def finish(self, file: Path, span: tuple[float, float] | None) -> tuple[Points, list[str]]:
        t = np.array(self.t)
        which = np.flatnonzero(_within(t, span))
        if len(which) * len(self.of) > _MOST_MARKERS:
            raise ClearwayError(
                f"{len(self.of)} markers in {len(which)} messages are more than are read; name those that are wanted",
                file=file,
                field=self.name,
            )
        keep, notes = in_order(t[which], file=file, field=self.name, sort=True)
        which = which[keep]
        xyz = np.full((len(which), len(self.of), 3), np.nan)
        for row, i in enumerate(which):
            found = np.array(self.seen[i]).reshape(-1, 4)
            xyz[row, found[:, 0].astype(np.intp)] = found[:, 1:]
        xyz[~(np.abs(xyz) < 1e12).all(axis=2)] = np.nan
        return Points(tuple(self.of), t[which], xyz), list(notes)


def message_stamp(m: Any) -> int:
    """ns of the message's header, 0 where it has none."""
    return stamp_of(m.header) if hasattr(m, "header") else 0


def _within(t: FloatArray, span: tuple[float, float] | None) -> Any:
    return np.ones(len(t), dtype=bool) if span is None else (t >= span[0]) & (t <= span[1])


def _moves(position: FloatArray) -> bool:
    return len(position) > 0 and bool(np.ptp(np.nan_to_num(position), axis=0).max() > 0.05)


def _orientation(q: FloatArray, name: str) -> tuple[FloatArray | None, list[str]]:
    """Unit quaternions, NaN where a message has none (zeros); None where none has."""
    norm = np.linalg.norm(np.where(np.abs(q) < 1e3, q, np.nan), axis=1)
    bad = ~(norm > 1e-3)
    if not len(q) or bad.all():
        return None, []
    unit = q / np.where(bad, 1.0, norm)[:, None]
    unit[bad] = np.nan
    notes = []
    if bad.any():
        notes.append(f"{name}: {int(bad.sum())} orientations are none (quaternions of zeros)")
    if (off := np.abs(norm[~bad] - 1) > 0.01).any():
        notes.append(f"{name}: {int(off.sum())} quaternions are not of length 1; brought to it")
    return unit, notes
