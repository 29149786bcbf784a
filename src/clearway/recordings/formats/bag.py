"""ROS bags: ROS 1 `.bag`, ROS 2 bag folders (sqlite3 or MCAP, compressed or not), bare `.db3` and `.mcap`. No ROS needed.

A recording's names are topics, and `parent->child` for how one frame moves in another by /tf and /tf_static. Read
without names, a bag gives poses, odometry, bodies, goals, and the pairs of frames that a robot's base is known by;
scans and plans are only read by name, and so is anything else of /tf. t = 0 is when the first message was recorded;
messages keep their own stamps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.recordings.formats import bag_mcap, bag_ros1, bag_ros2
from clearway.recordings.formats.bag_collect import (
    LEAP,
    SECOND,
    Clock,
    GoalsOf,
    PathsOf,
    SweepsOf,
    TrackOf,
    message_stamp,
)
from clearway.recordings.formats.bag_messages import decoder, kind_of
from clearway.recordings.formats.bag_ros1 import Ros1Store
from clearway.recordings.formats.bag_ros2 import open_file, open_folder, storage_files
from clearway.recordings.formats.bag_store import EVER, NEVER, Channel, Store, Times
from clearway.recordings.formats.format import Format
from clearway.recordings.formats.tf import ARROW, Edge, TransformTree, frame_name, split
from clearway.recordings.recording import Contents, Entry, Goals, Paths, Recording, Sweeps, Track, Want, describe

SAMPLE = 2000
"""Transforms that `look` decodes of a topic, to say which frames there are."""
_SLACK = 10  # s by which a message may be recorded before or after its stamp, or a transform lie before the span
_AGES = 1e10  # s, longer than anything
_SHOWN = 12  # frames of a topic, for people
_UNASKED = ("odometry", "pose", "body", "goal")


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
    with _Bag(path) as bag:
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
    with _Bag(path) as bag:
        topics, pairs = bag.wanted(want)
        reading = _Reading(bag, want)
        for topic in topics:
            reading.topic(topic)
        reading.run()
        tracks, notes = reading.tracks, reading.notes
        if pairs or want.names is None:
            found, said = bag.transforms(pairs, want, reading.clock)
            tracks |= found
            notes = [*notes, *said]
        start, _ = bag.span()
        return Recording(
            path, "bag", None, tracks, reading.goals, reading.scans, reading.paths,
            bag.epoch / SECOND if start is not None else None, (*bag.notes, *notes, *reading.clock.notes()),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Part:
    """One channel of one of a bag's files."""

    store: Store
    channel: Channel
    times: Times


class _Bag:
    """A bag of one or more files, open."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes: list[str] = []
        self.topics: dict[str, list[_Part]] = {}
        self._stack = ExitStack()
        try:
            self.stores = self._open()
        except BaseException:
            self._stack.close()
            raise
        empty = np.zeros(0, dtype=np.int64)
        for store in self.stores:
            for channel in store.channels.values():
                part = _Part(store, channel, store.times.get(channel.number, empty))
                self.topics.setdefault(channel.topic, []).append(part)
        self._times = [p.times for parts in self.topics.values() for p in parts if len(p.times)]
        self.epoch = min((int(t.min()) for t in self._times), default=0)

    def __enter__(self) -> _Bag:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self._stack.close()
        if isinstance(error, OSError):  # a disk that fails, a share that goes away
            raise ClearwayError(f"cannot be read: {error.strerror}", file=self.path) from error

    def _open(self) -> list[Store]:
        try:
            if self.path.is_dir():
                stores, notes = open_folder(self.path, self._stack)
                self.notes += notes
                return stores
            with open(self.path, "rb") as f:
                head = f.read(len(bag_ros2.MAGIC))
            if not head:
                raise ClearwayError("is empty", file=self.path)
            if head.startswith(bag_ros1.MAGIC):
                store = Ros1Store(self.path)
                self._stack.callback(store.close)
                return [store]
            if head.startswith((bag_mcap.MAGIC, bag_ros2.MAGIC)) or self.path.suffix == ".zstd":
                return [open_file(self.path, self._stack)]
        except FileNotFoundError as error:
            raise ClearwayError("no such file", file=self.path) from error
        except OSError as error:
            raise ClearwayError(f"cannot be read: {error.strerror}", file=self.path) from error
        raise ClearwayError("is neither a ROS 1 bag nor an MCAP nor an SQLite file by its first bytes", file=self.path)

    def span(self) -> tuple[float | None, float | None]:
        """When its first and last message were recorded, s since the first."""
        if not self._times:
            return None, None
        return 0.0, (max(int(t.max()) for t in self._times) - self.epoch) / SECOND

    def kind(self, topic: str) -> str:
        kinds = {kind_of(p.channel).kind for p in self.topics[topic]}
        return kinds.pop() if len(kinds) == 1 else "other"

    def wanted(self, want: Want) -> tuple[list[str], dict[str, Edge]]:
        """Topics to read, and pairs of frames by the names that they were asked for by."""
        if want.names is None:
            return [t for t in sorted(self.topics) if self.kind(t) in _UNASKED], {}
        topics: list[str] = []
        pairs: dict[str, Edge] = {}
        for name in sorted(want.names):
            if pair := split(name) if name not in self.topics else None:
                pairs[name] = pair
                continue
            topic = name if name in self.topics else self._of_body(name)
            if topic is None:
                raise unknown("topic", name, [*self.topics, f"PARENT{ARROW}CHILD"], file=self.path)
            if self.kind(topic) == "other":
                types = ", ".join(sorted({p.channel.type or "unknown" for p in self.topics[topic]}))
                raise ClearwayError(
                    f"its messages of type {types} are none that can be read; `clearway import FILE --list` shows which can",
                    file=self.path,
                    field=topic,
                )
            if self.kind(topic) == "tf":
                raise ClearwayError(
                    f"holds transforms between many frames; name a pair, such as map{ARROW}base_link",
                    file=self.path,
                    field=topic,
                )
            topics.append(topic)
        return list(dict.fromkeys(topics)), pairs

    def _of_body(self, name: str) -> str | None:
        """The topic that holds several bodies, of which `TOPIC/BODY` is one."""
        return next((t for t in self.topics if name.startswith(f"{t}/") and self.kind(t) == "body"), None)

    def frames(self, topic: str) -> str:
        """The frames of a topic's first messages, for people."""
        found: dict[str, None] = {}
        for part in self.topics[topic]:
            if not len(part.times):
                continue
            decode, poses = decoder(part.channel, file=self.path), kind_of(part.channel).poses
            end = EVER if poses and self.kind(topic) == "tf" else int(part.times.min())
            for _, _, data in islice(part.store.messages(frozenset({part.channel.number}), NEVER, end), SAMPLE):
                message = decode(data)
                if poses is None:
                    found[frame_name(message.header.frame_id)] = None
                else:
                    found |= {ARROW.join(frame_name(x) for x in (p.frame, p.child) if x): None for p in poses(message)}
        names = sorted(f for f in found if f)
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        return ", ".join(names[:_SHOWN]) + more

    def ahead(self) -> int:
        """How far the stamps that were taken on another clock lie ahead of the bag's, ns: where it is the most of any
        topic's first message, as that one was recorded the soonest."""
        found = []
        for topic, parts in sorted(self.topics.items()):
            for part in parts if self.kind(topic) in (*_UNASKED, "tf") else ():
                decode, poses = decoder(part.channel, file=self.path), kind_of(part.channel).poses
                first = int(part.times.min()) if len(part.times) else 0
                for _, recorded, data in islice(part.store.messages(frozenset({part.channel.number}), first, first), 1):
                    stamps = [p.stamp for p in poses(decode(data)) if p.stamp] if poses else []
                    found += [s - recorded for s in stamps[:1] if abs(s - recorded) > LEAP]
        return max(found, default=0)

    def transforms(self, pairs: dict[str, Edge], want: Want, clock: Clock) -> tuple[dict[str, Track], list[str]]:
        """The pairs of frames; all that one would ask for where none is, as far as they can be read."""
        named = want.names is not None
        notes: list[str] = []
        tree = self._tree(want.span, pairs, clock, None if named else notes)
        if want.span is not None and not all(tree.connected(*p) for p in pairs.values()):
            tree = self._tree((-np.inf, want.span[1]), pairs, clock, None)  # one may have been sent once, long before
        tracks: dict[str, Track] = {}
        for name, pair in (pairs or {ARROW.join(p): p for p in tree.pairs()}).items():
            if not tree.edges:
                raise ClearwayError("the bag has no transforms", file=self.path, field=name)
            try:
                track, said = tree.track(*pair, file=self.path)
            except ClearwayError as error:
                if named:
                    raise
                notes.append(f"{name}: left out, as {error.problem}")
                continue
            tracks[name] = track if want.span is None else _cut(track, want.span)
            notes += said
        return tracks, [*tree.notes, *notes]

    def _tree(
        self, span: tuple[float, float] | None, pairs: dict[str, Edge], clock: Clock, left_out: list[str] | None
    ) -> TransformTree:
        """All transforms, or those between `pairs`; a topic of them that can't be read is an error, or told in `left_out`."""
        tree, settled = TransformTree(), not pairs
        for topic in sorted((t for t in self.topics if self.kind(t) == "tf"), key=lambda t: (not _static(t), t)):
            start, end = (NEVER, EVER) if _static(topic) else self.window(span)
            for part in self.topics[topic]:
                try:
                    decode, poses = decoder(part.channel, file=self.path), kind_of(part.channel).poses
                except ClearwayError as error:
                    if left_out is None:
                        raise
                    left_out.append(f"{topic}: left out, as {error.problem}")
                    continue
                number = frozenset({part.channel.number})
                for i, (_, recorded, data) in enumerate(part.store.messages(number, start, end)):
                    for pose in poses(decode(data)) if poses else ():
                        t = 0.0 if _static(topic) else clock.seconds(topic, pose.stamp, recorded)
                        tree.add(pose.frame, pose.child, t, pose.values, static=_static(topic))
                    if not settled and i % SAMPLE == SAMPLE - 1:
                        settled = tree.settle(pairs.values())
        return tree

    def window(self, span: tuple[float, float] | None) -> tuple[int, int]:
        """ns between which messages stamped within `span` were recorded."""
        if span is None:
            return NEVER, EVER
        start, end = (float(np.clip(x, -_AGES, _AGES)) for x in (span[0] - _SLACK, span[1] + _SLACK))
        return max(NEVER, self.epoch + int(start * SECOND)), min(EVER, self.epoch + int(end * SECOND))


@dataclass(slots=True)
class _Reading:
    """Topics on their way into a recording."""

    bag: _Bag
    want: Want
    clock: Clock = field(init=False)
    tracks: dict[str, Track] = field(default_factory=dict)
    goals: dict[str, Goals] = field(default_factory=dict)
    scans: dict[str, Sweeps] = field(default_factory=dict)
    paths: dict[str, Paths] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    _takers: dict[int, dict[int, Callable[[int, bytes], None]]] = field(default_factory=dict)
    _collected: dict[str, Any] = field(default_factory=dict)
    _bodies: set[str] = field(default_factory=set)

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
            takers = self._takers.setdefault(id(part.store), {})
            takers[part.channel.number] = self._taker(part.channel, decode)

    def run(self) -> None:
        """Read every file once, and finish what was collected."""
        window = self.bag.window(self.want.span)
        for store in self.bag.stores:
            takers = self._takers.get(id(store), {})
            if takers:
                for number, recorded, data in store.messages(frozenset(takers), *window):
                    takers[number](recorded, data)
        for name, what in self._collected.items():
            self._finish(name, what)
        for name in sorted(self.want.names or ()):
            if split(name) is None and name not in self._bodies and name not in self.bag.topics:
                raise unknown("body", name, self._bodies, file=self.bag.path)

    def _finish(self, name: str, what: Any) -> None:
        try:
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
                self.scans[name] = result
            case _:
                self.paths[name] = result

    def _taker(self, channel: Channel, decode: Callable[[bytes], Any]) -> Callable[[int, bytes], None]:
        topic, kind, clock = channel.topic, kind_of(channel), self.clock
        collected, bodies = self._collected, self._bodies
        if (poses := kind.poses) is None:
            sink = collected.setdefault(topic, SweepsOf(topic) if kind.kind == "scan" else PathsOf(topic))

            def take(recorded: int, data: bytes) -> None:
                message = decode(data)
                sink.add(clock.seconds(topic, message_stamp(message), recorded), message)

            return take

        def take_poses(recorded: int, data: bytes) -> None:
            for pose in poses(decode(data)):
                name = f"{topic}/{pose.name}" if pose.name else topic
                bodies.add(name)
                if name != topic and not (self.want.has(name) or self.want.has(topic)):
                    continue
                into = collected.get(name)
                if into is None:
                    into = collected[name] = GoalsOf(name) if kind.kind == "goal" else TrackOf(name, kind.kind)
                into.add(clock.seconds(topic, pose.stamp, recorded), pose)

        return take_poses


def _static(topic: str) -> bool:
    return topic.rstrip("/").endswith("tf_static")


def _cut(track: Track, span: tuple[float, float]) -> Track:
    inside = (track.t >= span[0]) & (track.t <= span[1])
    q = None if track.orientation is None else track.orientation[inside]
    return Track(track.kind, track.frame, track.child, track.t[inside], track.position[inside], q)


def _rest(entry: Entry, detail: str | None = None) -> Iterator[Any]:
    yield from (entry.count, entry.start, entry.end, entry.rate, entry.missing, entry.longest_gap)
    yield entry.detail if detail is None else detail


FORMATS = (Format("bag", "ROS 1 or ROS 2 bag", (".bag", ".db3", ".mcap", ".zstd"), sniff, read, look),)
