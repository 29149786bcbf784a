"""A bag as a whole, whatever its container: which topics it has, of which kinds, which of them are wanted, and its TF tree."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError, unknown
from clearway.geometry.shapes import FloatArray
from clearway.recordings.formats import bag_mcap, bag_ros1, bag_ros2
from clearway.recordings.formats.bag_actions import action_of
from clearway.recordings.formats.bag_collect import LEAP, SECOND, Clock
from clearway.recordings.formats.bag_messages import decoder, kind_of
from clearway.recordings.formats.bag_ros1 import Ros1Store
from clearway.recordings.formats.bag_ros2 import open_file, open_folder
from clearway.recordings.formats.bag_store import EVER, NEVER, Channel, Store, Times
from clearway.recordings.formats.tf import ARROW, Edge, TransformTree, frame_name, split
from clearway.recordings.recording import Track, Want

SAMPLE = 2000
"""Transforms that `look` decodes of a topic, to say which frames there are."""

UNASKED = ("odometry", "pose", "body", "person", "markers", "goal", "action")
"""Kinds of topics that are read where nothing is named."""

SEVERAL = ("body", "person", "markers", "array")
"""Kinds of topics of which each holds several things: `TOPIC/NAME` is one of them."""

_SLACK = 10  # s by which a message may be recorded before or after its stamp, or a transform lie before the span
_AGES = 1e10  # s, longer than anything
_SHOWN = 12  # frames of a topic, for people


@dataclass(frozen=True, slots=True)
class Part:
    """One channel of one of a bag's files.

    Attributes:
        store: The file.
        channel: The channel.
        times: (n,) ns of UNIX time at which its messages were recorded.
    """

    store: Store
    channel: Channel
    times: Times


class Bag:
    """A bag of one or more files, open."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes: list[str] = []
        self.topics: dict[str, list[Part]] = {}
        self._stack = ExitStack()
        try:
            self.stores = self._open()
        except BaseException:
            self._stack.close()
            raise
        empty = np.zeros(0, dtype=np.int64)
        for store in self.stores:
            for channel in store.channels.values():
                part = Part(store, channel, store.times.get(channel.number, empty))
                self.topics.setdefault(channel.topic, []).append(part)
        self._times = [p.times for parts in self.topics.values() for p in parts if len(p.times)]
        self.epoch = min((int(t.min()) for t in self._times), default=0)

    def __enter__(self) -> Bag:
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
            return [t for t in sorted(self.topics) if self.kind(t) in UNASKED], {}
        topics: list[str] = []
        pairs: dict[str, Edge] = {}
        for name in sorted(want.names):
            if pair := split(name) if name not in self.topics else None:
                pairs[name] = pair
                continue
            topic = name if name in self.topics else self._of_several(name) or self._of_action(name)
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

    def _of_several(self, name: str) -> str | None:
        """The topic that holds several things, of which `TOPIC/NAME` is one."""
        return next((t for t in self.topics if name.startswith(f"{t}/") and self.kind(t) in SEVERAL), None)

    def _of_action(self, name: str) -> str | None:
        """The topic on which the action of that name tells the states of its goals."""
        return next((t for t in self.topics if action_of(t) == name and self.kind(t) == "action"), None)

    def called(self, topic: str, want: Want) -> list[str]:
        """What the goals of an action, whose states are on `topic`, are called: as they were asked for."""
        asked = [n for n in (topic, action_of(topic)) if want.names is not None and n in want.names]
        return asked or [action_of(topic)]

    def frames(self, topic: str) -> str:
        """The frames of a topic's first messages, for people."""
        found: dict[str, None] = {}
        for part in self.topics[topic]:
            if not len(part.times):
                continue
            kind = kind_of(part.channel)
            decode, poses = decoder(part.channel, file=self.path), kind.poses
            if kind.states is not None:
                return f"the action {action_of(topic)}"
            end = EVER if poses and self.kind(topic) == "tf" else int(part.times.min())
            for _, _, data in islice(part.store.messages(frozenset({part.channel.number}), NEVER, end), SAMPLE):
                message = decode(data)
                if poses is None:
                    found |= {frame_name(message.header.frame_id): None} if hasattr(message, "header") else {}
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
            for part in parts if self.kind(topic) in (*UNASKED, "tf") else ():
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

    def placed(self, frame: str) -> tuple[FloatArray, FloatArray] | None:
        """Where a frame is on the robot's base by /tf_static: position (3,) [m], quaternion (4,); None if it doesn't say."""
        tree = TransformTree()
        for topic in (t for t in self.topics if self.kind(t) == "tf" and _static(t)):
            for part in self.topics[topic]:
                decode, poses = decoder(part.channel, file=self.path), kind_of(part.channel).poses
                for _, _, data in part.store.messages(frozenset({part.channel.number})):
                    for pose in poses(decode(data)) if poses else ():
                        tree.add(pose.frame, pose.child, 0.0, pose.values, static=True)
        return tree.placed(frame)

    def window(self, span: tuple[float, float] | None) -> tuple[int, int]:
        """ns between which messages stamped within `span` were recorded."""
        if span is None:
            return NEVER, EVER
        start, end = (float(np.clip(x, -_AGES, _AGES)) for x in (span[0] - _SLACK, span[1] + _SLACK))
        return max(NEVER, self.epoch + int(start * SECOND)), min(EVER, self.epoch + int(end * SECOND))


def _static(topic: str) -> bool:
    return topic.rstrip("/").endswith("tf_static")


def _cut(track: Track, span: tuple[float, float]) -> Track:
    inside = (track.t >= span[0]) & (track.t <= span[1])
    q = None if track.orientation is None else track.orientation[inside]
    return Track(track.kind, track.frame, track.child, track.t[inside], track.position[inside], q)
