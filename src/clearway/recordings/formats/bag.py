"""ROS bags: ROS 1 `.bag`, ROS 2 bag folders (sqlite3 or MCAP, compressed or not), bare `.db3` and `.mcap`. No ROS needed.

A recording's names are topics, `TOPIC/NAME` for one of several things on a topic (bodies, people, markers, the poses of an array),
`parent->child` for how one frame moves in another by /tf and /tf_static, and an action's name for the goals that it was sent. Read without
names, a bag gives poses, odometry, bodies, people, markers, goals, and the pairs of frames that a robot's base is known by; scans, paths and
commands and
arrays of poses are only read by name, and so is anything else of /tf. t = 0 is when the first message was recorded; messages keep their own
stamps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.recordings.formats import bag_mcap, bag_ros1, bag_ros2
from clearway.recordings.formats.bag_actions import ActionOf, action_of
from clearway.recordings.formats.bag_collect import (
    SECOND,
    Clock,
    CommandsOf,
    GoalsOf,
    PathsOf,
    PointsOf,
    SweepsOf,
    TrackOf,
    message_stamp,
    mounted,
)
from clearway.recordings.formats.bag_file import Bag, Part
from clearway.recordings.formats.bag_messages import MOST_POSES, MOVE_BASE, Pose, decoder, kind_of, type_name
from clearway.recordings.formats.bag_ros2 import storage_files
from clearway.recordings.formats.bag_store import Channel
from clearway.recordings.formats.format import Format
from clearway.recordings.formats.tf import split
from clearway.recordings.recording import (
    Commands,
    Contents,
    Entry,
    Goals,
    Paths,
    Points,
    Recording,
    Sweeps,
    Track,
    Want,
    describe,
)

MOST_THINGS = 10_000
"""Bodies, markers and people of a bag."""

_SINKS: dict[str, type[SweepsOf | PathsOf | CommandsOf]] = {"scan": SweepsOf, "path": PathsOf, "command": CommandsOf}

Taker = Callable[[int, bytes], None]
"""Takes a message's time of recording [ns] and its bytes."""


def sniff(path: Path, head: bytes) -> bool:
    """Whether it is a bag: by the first bytes of a file, by what lies in a folder."""
    if head:
        return head.startswith((bag_ros1.MAGIC, bag_mcap.MAGIC, bag_ros2.MAGIC)) or path.name.endswith(
            (".db3.zstd", ".mcap.zstd")
        )
    return bool(storage_files(path)) or (path / "metadata.yaml").is_file()


def look(path: Path) -> Contents:
    """Every topic with its type, count, rate and gaps, from the bag's index; of the first messages also the frames.

    Raises:
        ClearwayError: the bag is truncated, damaged, promises too much, or isn't one.
    """
    with Bag(path) as bag:
        entries, notes = [], list(bag.notes)
        for topic, parts in sorted(bag.topics.items()):
            times = np.sort(np.concatenate([p.times for p in parts]))
            kind = bag.kind(topic)
            types = ", ".join(sorted({p.channel.type for p in parts}))
            entry = describe(topic, kind, (times - bag.epoch) / SECOND, detail=types)
            try:
                frames = bag.frames(topic) if kind != "other" and len(times) else ""
            except ClearwayError as error:  # a topic that can't be read is still there
                entry = Entry(topic, "other", *_rest(entry))
                frames = str(error.problem)
            if frames:
                entry = Entry(entry.name, entry.kind, *_rest(entry, f"{types}, {frames}"))
            entries.append(entry)
        start, end = bag.span()
        return Contents(path, "bag", start, end, bag.epoch / SECOND if start is not None else None,
                        tuple(entries), tuple(notes))  # fmt: skip


def read(path: Path, want: Want) -> Recording:
    """What is wanted of a bag.

    Raises:
        ClearwayError: as for `look`, or it lacks what is wanted, or holds it in messages that can't be understood.
    """
    with Bag(path) as bag:
        topics, pairs = bag.wanted(want)
        reading = _Reading(bag, want)
        for topic in topics:
            if bag.kind(topic) == "action":
                for name in bag.called(topic, want):
                    reading.action(name, topic)
            else:
                reading.topic(topic)
        reading.run()
        tracks, notes = reading.tracks, reading.notes
        if pairs or want.names is None:
            found, said = bag.transforms(pairs, want, reading.clock)
            tracks |= found
            notes = [*notes, *said]
        start, _ = bag.span()
        return Recording(
            path, "bag", reading.points, tracks, reading.goals, reading.scans, reading.paths, reading.commands,
            bag.epoch / SECOND if start is not None else None, (*bag.notes, *notes, *reading.clock.notes()),
        )  # fmt: skip


@dataclass(slots=True)
class _Reading:
    """Topics on their way into a recording."""

    bag: Bag
    want: Want
    clock: Clock = field(init=False)
    tracks: dict[str, Track] = field(default_factory=dict)
    goals: dict[str, Goals] = field(default_factory=dict)
    scans: dict[str, Sweeps] = field(default_factory=dict)
    paths: dict[str, Paths] = field(default_factory=dict)
    commands: dict[str, Commands] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    points: Points | None = None
    _takers: dict[int, dict[int, list[Taker]]] = field(default_factory=dict)
    _collected: dict[str, Any] = field(default_factory=dict)
    _things: set[str] = field(default_factory=set)
    _named: dict[str, str] = field(default_factory=dict)
    _counts: dict[str, set[int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.clock = Clock(self.bag.epoch, self.bag.ahead)

    def topic(self, topic: str) -> None:
        """Prepare to read a topic; one that nobody asked for by name is left out if it can't be read."""
        for part in self.bag.topics[topic]:
            try:
                decode = decoder(part.channel, file=self.bag.path)
            except ClearwayError as error:
                if self.want.names is not None:
                    raise
                self.notes.append(f"{topic}: left out, as {error.problem}")
                continue
            self._add(part, self._taker(part.channel, decode))

    def action(self, name: str, topic: str) -> None:
        """Prepare to read the goals of an action by its topic of states, and by that of its goals where there is one (ROS 1)."""
        sink = self._collected.setdefault(name, ActionOf(name))
        self._named[name] = topic
        for part in self.bag.topics[topic]:
            decode, states = decoder(part.channel, file=self.bag.path), kind_of(part.channel).states

            def take(recorded: int, data: bytes, *, decode: Any = decode, states: Any = states) -> None:
                for state in states(decode(data)) if states else ():
                    seen = self.clock.seconds(topic, state.seen, recorded)
                    sent = self.clock.seconds(topic, state.sent, recorded) if state.sent else seen
                    sink.add_state(sent, seen, state)

            self._add(part, take)
        asked = f"{action_of(topic)}/goal"
        for part in self.bag.topics.get(asked, ()):
            kind = kind_of(part.channel)
            if kind.kind != "goal" or type_name(part.channel.type) != MOVE_BASE:
                continue
            decode, poses = decoder(part.channel, file=self.bag.path), kind.poses

            def take_goal(recorded: int, data: bytes, *, decode: Any = decode, poses: Any = poses) -> None:
                message = decode(data)
                for pose in poses(message):
                    sink.add_pose(self.clock.seconds(asked, pose.stamp, recorded), message.goal_id.id, pose)

            self._add(part, take_goal)

    def _add(self, part: Part, take: Taker) -> None:
        takers = self._takers.setdefault(id(part.store), {})
        takers.setdefault(part.channel.number, []).append(take)

    def run(self) -> None:
        """Read every file once, and finish what was collected."""
        window = self.bag.window(self.want.span)
        for store in self.bag.stores:
            takers = self._takers.get(id(store), {})
            if takers:
                for number, recorded, data in store.messages(frozenset(takers), *window):
                    for take in takers[number]:
                        take(recorded, data)
        for name, what in self._collected.items():
            self._finish(name, what)
        for name in sorted(self.want.names or ()):
            if (
                split(name) is None
                and name not in self._things
                and name not in self.bag.topics
                and name not in self._named
            ):
                raise unknown("body", name, self._things, file=self.bag.path)

    def _finish(self, name: str, what: Any) -> None:
        try:
            if (counts := self._counts.get(name.rpartition("/")[0], set())) and len(counts) > 1:
                raise ClearwayError(
                    f"its messages hold from {min(counts)} to {max(counts)} poses, and nothing says which is which",
                    file=self.bag.path,
                    field=name,
                )
            result, notes = what.finish(self.bag.path, self.want.span)
        except ClearwayError as error:
            if self.want.names is not None:
                raise
            self.notes.append(f"{name}: left out, as {error.problem}")
            return
        self.notes += notes
        match result:
            case Track():
                self.tracks[name] = result
            case Goals():
                self.goals[name] = result
            case Sweeps():
                self.scans[name] = mounted(result, self.bag.placed(result.frame))
            case Commands():
                self.commands[name] = result
            case Points():
                if self.points is not None:
                    raise ClearwayError("has two topics of markers; name those of one", file=self.bag.path, field=name)
                self.points = result
            case _:
                self.paths[name] = result
                track, said = what.track(self.want.span)
                if track is not None:
                    self.tracks[name], self.notes = track, [*self.notes, *said]

    def _count(self, topic: str, count: int) -> None:
        """Remember how many poses an array has: those of a particle filter, or of whoever is seen, are no bodies."""
        if count > MOST_POSES:
            raise ClearwayError(
                f"an array of {count} poses; of more than {MOST_POSES} nothing says whose they are",
                file=self.bag.path,
                field=topic,
            )
        self._counts.setdefault(topic, set()).add(count)

    def _taker(self, channel: Channel, decode: Callable[[bytes], Any]) -> Taker:
        topic, kind, clock = channel.topic, kind_of(channel), self.clock
        collected, things = self._collected, self._things
        if (poses := kind.poses) is None:
            sink = collected.setdefault(topic, _SINKS[kind.kind](topic))

            def take(recorded: int, data: bytes) -> None:
                message = decode(data)
                sink.add(clock.seconds(topic, message_stamp(message), recorded), message)

            return take

        def wanted(pose: Pose) -> str | None:
            """What a pose is called, if it is wanted."""
            name = f"{topic}/{pose.name}" if pose.name else topic
            things.add(name)
            if len(things) > MOST_THINGS:
                raise ClearwayError(
                    f"names more than {MOST_THINGS} things; this is no recording", file=self.bag.path, field=topic
                )
            return name if name == topic or self.want.has(name) or self.want.has(topic) else None

        if kind.kind == "markers":
            points = collected.setdefault(topic, PointsOf(topic))

            def take_markers(recorded: int, data: bytes) -> None:
                message = decode(data)
                there = [(name, pose) for pose in poses(message) if (name := wanted(pose)) is not None]
                points.add(clock.seconds(topic, message_stamp(message), recorded), there)

            return take_markers

        def take_poses(recorded: int, data: bytes) -> None:
            there = tuple(poses(decode(data)))
            if kind.kind == "array":
                self._count(topic, len(there))
            for pose in there:
                name = wanted(pose)
                if name is None:
                    continue
                into = collected.get(name)
                if into is None:
                    into = collected[name] = GoalsOf(name) if kind.kind == "goal" else TrackOf(name, kind.kind)
                into.add(clock.seconds(topic, pose.stamp, recorded), pose)

        return take_poses


def _rest(entry: Entry, detail: str | None = None) -> Iterator[Any]:
    yield from (entry.count, entry.start, entry.end, entry.rate, entry.missing, entry.longest_gap)
    yield entry.detail if detail is None else detail


FORMATS = (Format("bag", "ROS 1 or ROS 2 bag", (".bag", ".db3", ".mcap", ".zstd"), sniff, read, look),)
