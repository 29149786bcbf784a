"""What a reader gives: a recording in SI units, in one right-handed z-up frame, with explicit time. Nothing is cleaned yet.

Positions are metres, angles radians, orientations quaternions (x, y, z, w). Time is seconds on the file's own clock;
where the file knows the date, `Recording.epoch` is the UNIX time of t = 0. What was not measured is NaN, never a
guess and never the last value held.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray

FARTHEST, LARGEST_TWIST = 1e9, 1e6
"""m, and m/s or rad/s: a number beyond is none that anybody measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Markers of one capture.

    Attributes:
        names: (m) names as the file has them, unique.
        t: (n,) time, s, strictly increasing.
        xyz: (n, m, 3) position, m, NaN where unseen.
    """

    names: tuple[str, ...]
    t: FloatArray
    xyz: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Poses of one thing: a rigid body of the file, a topic, a pair of frames, a pedestrian.

    Attributes:
        kind: What it comes from: `body` (6DOF), `odometry`, `pose`, `tf`, `person` or `table`.
        frame: What the poses are given in, such as `map` or `odom`; empty: the capture's.
        child: What moves, such as `base_link`; empty where nobody says.
        t: (n,) time, s, strictly increasing.
        position: (n, 3) position, m.
        orientation: (n, 4) quaternion x, y, z, w; None where there is no heading, NaN rows where it was not seen.
        twist: (n, 2) measured v [m/s], omega [rad/s] in `child`, or None.
        sigma: (n, 2) standard uncertainty of position [m] and heading [rad] as the file states it, or None.
    """

    kind: str
    frame: str
    child: str
    t: FloatArray
    position: FloatArray
    orientation: FloatArray | None = None
    twist: FloatArray | None = None
    sigma: FloatArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Goals:
    """Goals that were sent.

    Attributes:
        frame: The frame they are given in.
        t: (k,) when each was sent, s.
        pose: (k, 3) x, y [m], theta [rad]; NaN where only the robot was told.
        ended: (k,) when the robot reported that it was done with each, s, NaN where it didn't; None where nobody asked it.
        outcome: How each ended by that report: `succeeded`, `canceled`, `aborted`, `rejected`, or empty.
    """

    frame: str
    t: FloatArray
    pose: FloatArray
    ended: FloatArray | None = None
    outcome: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Sweeps:
    """Scans of one lidar.

    Attributes:
        frame: The lidar's frame.
        t: (n,) when each was taken, s.
        ranges: (n, b) distance along each beam, m; inf: no return.
        angle_min: Direction of beam 0, rad.
        angle_increment: Angle from a beam to the next, rad.
        range_min: Shortest distance that is measured, m.
        range_max: Longest distance that is measured, m.
        mount: (3,) pose of the lidar in the robot's base: x, y [m], theta [rad]; None if the file doesn't say.
    """

    frame: str
    t: FloatArray
    ranges: FloatArray
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    mount: FloatArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """Plans that were published.

    Attributes:
        frame: The frame they are given in.
        t: (k,) when each was published, s.
        lines: A polyline (p, 2) for each, m.
    """

    frame: str
    t: FloatArray
    lines: tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Commands:
    """Velocities that a base was told.

    Attributes:
        t: (k,) when each was sent, s, strictly increasing.
        velocity: (k, 3) v, v_y [m/s] and omega [rad/s].
    """

    t: FloatArray
    velocity: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """What was read of one file.

    Attributes:
        file: Its path.
        format: The reader's name for its format.
        points: Its markers, or None.
        tracks: What was tracked, by body, topic or `parent->child`.
        goals: Goals that were sent, by topic.
        scans: Scans of lidars, by topic.
        paths: Plans that were published, by topic.
        commands: Velocities that a base was told, by topic.
        epoch: UNIX time of t = 0, s; None if the file doesn't say.
        notes: What the reader had to do or noticed, in sentences (axes turned, mm scaled, duplicates dropped).
        up: The axis of the file that was taken as up, and is z here: `x`, `y`, `z`, `-x`, `-y` or `-z`.
        up_said: Whether the file says so, or the user; else it is the format's convention.
    """

    file: Path
    format: str
    points: Points | None = None
    tracks: Mapping[str, Track] = field(default_factory=dict)
    goals: Mapping[str, Goals] = field(default_factory=dict)
    scans: Mapping[str, Sweeps] = field(default_factory=dict)
    paths: Mapping[str, Paths] = field(default_factory=dict)
    commands: Mapping[str, Commands] = field(default_factory=dict)
    epoch: float | None = None
    notes: tuple[str, ...] = ()
    up: str = "z"
    up_said: bool = False


@dataclass(frozen=True, slots=True)
class Want:
    """What to read of a file, so that a large one need not fit into memory. The default is everything.

    Attributes:
        names: Markers, bodies, topics or `parent->child` pairs; None: all that a reader understands. A name that the
            file doesn't have is an error with the closest one (`clearway.errors.unknown`).
        span: From when to when, s on the file's own clock; None: all of it.
        up: The axis of the file that points up; None: what the file says, or its format's convention.
        time: Unit of its stamps where the format has none, `s`, `ms`, `us` or `ns`; None: the format's convention.
    """

    names: frozenset[str] | None = None
    span: tuple[float, float] | None = None
    up: str | None = None
    time: str | None = None

    def has(self, name: str) -> bool:
        """Whether `name` is wanted."""
        return self.names is None or name in self.names


def believable(recording: Recording) -> Recording:
    """The recording with positions and twists as unseen that nobody can have measured: of damaged bytes, or of a filter that
    diverged."""
    notes: list[str] = []

    def kept(values: FloatArray, most: float, what: str) -> FloatArray:
        flat = values.ravel()
        # NaN doesn't count in these, and nothing as large as the recording is made where all is well
        if not flat.size or (np.fmax.reduce(flat) <= most and np.fmin.reduce(flat) >= -most):
            return values
        wrong: Any = (np.abs(values) > most).any(axis=-1)
        if not wrong.any():
            return values
        notes.append(
            f"{what}: {int(wrong.sum())} samples beyond {most:g} {'m' if most == FARTHEST else 'm/s or rad/s'}; taken as unseen"
        )
        return np.where(wrong[..., None], np.nan, values)

    points = recording.points
    if points is not None:
        points = replace(points, xyz=kept(points.xyz, FARTHEST, "markers"))
    tracks = {
        name: replace(
            track,
            position=kept(track.position, FARTHEST, name),
            twist=None if track.twist is None else kept(track.twist, LARGEST_TWIST, f"twist of {name}"),
        )
        for name, track in recording.tracks.items()
    }
    return replace(recording, points=points, tracks=tracks, notes=(*recording.notes, *notes)) if notes else recording


@dataclass(frozen=True, slots=True)
class Entry:
    """One thing that a file holds.

    Attributes:
        name: Its name, as it is asked for.
        kind: `marker`, `body`, `odometry`, `pose`, `tf`, `scan`, `goal`, `action`, `path`, `command`, `person`, `table`, `markers` or
            `array` (several markers or poses on one topic), or `other` (there, but not understood).
        count: Number of samples in which it is there.
        start: When it is there first, s; None: never.
        end: When it is there last, s; None: never.
        rate: Median sampling rate, Hz; None below two samples.
        missing: Share of the samples between `start` and `end` that lack it.
        longest_gap: Its longest gap, s.
        detail: More for people: type of message, frames.
    """

    name: str
    kind: str
    count: int
    start: float | None = None
    end: float | None = None
    rate: float | None = None
    missing: float = 0.0
    longest_gap: float = 0.0
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Contents:
    """What a file holds, found without any configuration.

    Attributes:
        file: Its path.
        format: The reader's name for its format.
        start: When the first of its samples was taken, s on its clock; None if it is empty.
        end: When the last of its samples was taken, s on its clock; None if it is empty.
        epoch: UNIX time of t = 0, s; None if the file doesn't say.
        entries: What it holds, one by one.
        notes: What the reader noticed, in sentences.
    """

    file: Path
    format: str
    start: float | None
    end: float | None
    epoch: float | None
    entries: tuple[Entry, ...]
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """From the first sample to the last, s; 0 if it is empty."""
        return 0.0 if self.start is None or self.end is None else self.end - self.start

    def only(self, kind: str, asked: str | None) -> str:
        """The topic of a kind that is meant: the one that is asked for, or the only one.

        Raises:
            ClearwayError: It isn't there, or there is none, or more than one of which none is asked for.
        """
        known = [e.name for e in self.entries if e.kind == kind]
        if asked is not None:
            if asked not in known:
                raise unknown(f"topic of {kind}", asked, known, file=self.file)
            return asked
        if len(known) != 1:
            which = (
                f"has {len(known)} topics of {kind} ({', '.join(known)}); say which"
                if known
                else f"has no topic of {kind}"
            )
            raise ClearwayError(which, file=self.file, field=kind)
        return known[0]


def describe(name: str, kind: str, t: FloatArray, seen: npt.NDArray[np.bool_] | None = None, detail: str = "") -> Entry:
    """The entry of something that was sampled at `t` (n,) [s]; `seen` (n,) bool: in which of them it is there."""
    there = t if seen is None else t[seen]
    if not len(there):
        return Entry(name, kind, 0, missing=1.0 if len(t) else 0.0, detail=detail)
    steps = np.diff(there)
    usual = float(np.median(np.diff(t))) if len(t) > 1 else None
    within = int(((t >= there[0]) & (t <= there[-1])).sum())
    rate = 1 / usual if usual else None
    gap = float(steps.max()) if len(steps) and usual and steps.max() > 1.5 * usual else 0.0
    missing = 1 - len(there) / within
    return Entry(name, kind, len(there), float(there[0]), float(there[-1]), rate, missing, gap, detail)


def contents_of(recording: Recording) -> Contents:
    """What a recording that was read whole holds."""
    entries: list[Entry] = []
    if (points := recording.points) is not None:
        seen: Any = np.isfinite(points.xyz).all(axis=2)
        entries += [describe(n, "marker", points.t, seen[:, i]) for i, n in enumerate(points.names)]
    for name, track in recording.tracks.items():
        detail = "->".join(part for part in (track.frame, track.child) if part)
        there: Any = np.isfinite(track.position).all(axis=1)
        entries.append(describe(name, track.kind, track.t, there, detail))
    several: Iterable[tuple[str, Mapping[str, Goals] | Mapping[str, Sweeps] | Mapping[str, Paths]]] = (
        ("goal", recording.goals),
        ("scan", recording.scans),
        ("path", recording.paths),
    )  # commands come in bags alone, which are looked into by their index
    entries += [describe(name, kind, x.t, detail=x.frame) for kind, them in several for name, x in them.items()]
    starts = [e.start for e in entries if e.start is not None]
    ends = [e.end for e in entries if e.end is not None]
    first, last = (min(starts), max(ends)) if starts else (None, None)
    return Contents(recording.file, recording.format, first, last, recording.epoch, tuple(entries), recording.notes)
