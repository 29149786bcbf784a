"""ROS 2 over Zenoh, as rmw_zenoh writes it: key expressions, liveliness tokens and attachments as its design document has them.

https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md, and `liveliness_utils.cpp`, `rmw_publisher_data.cpp`,
`rmw_client_data.cpp` and the default configuration of a session beside it.
"""

from __future__ import annotations

import json
import struct
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple, cast

import xxhash
import zenoh
import zenoh.ext

from clearway.live.line import WireError
from clearway.live.ros.topics import Topic
from clearway.live.ros2.messages import message, type_hash

ROUTER = "tcp/localhost:7447"
"""Where rmw_zenoh's router listens."""

SERVICES = "::,10:,:,:,,"
"""The quality of all services: reliable, the last 10 are kept."""

_NODE_NAME = "clearway"
_DEFAULT_DEPTH = 42
_ATTACHED = struct.Struct("<qqB16s")
_HEARTBEAT = 0.5  # s
_FOREVER = 1e9  # s: a goal's result is asked for as it begins


class Entity(NamedTuple):
    """What somebody tells of itself by a liveliness token.

    Attributes:
        domain: The number of its domain.
        session: Its Zenoh session.
        node: The number of its node in that.
        number: Its own number in that.
        what: `NN` a node, `MP` a publisher, `MS` a subscription, `SS` a server, `SC` a client of a service.
        enclave: Of the node.
        namespace: Of the node.
        name: Of the node.
        topic: With its namespace, also of a service; empty: it is a node.
        kind: The type, as DDS writes it.
        hash: The type's.
        quality: How it is carried.
    """

    domain: str
    session: str
    node: str
    number: str
    what: str
    enclave: str
    namespace: str
    name: str
    topic: str = ""
    kind: str = ""
    hash: str = ""
    quality: str = ""

    @property
    def token(self) -> str:
        """The key of its liveliness token."""
        about = [part for part in self if part]
        return "/".join(("@ros2_lv", *(part.replace("/", "%") for part in about)))

    @property
    def key(self) -> str:
        """The key under which its messages or requests go."""
        return f"{self.domain}/{self.topic.strip('/')}/{self.kind}/{self.hash}"

    @property
    def gid(self) -> bytes:
        """Who it is, in what it attaches to its messages."""
        return bytes(xxhash.xxh3_128_digest(self.token.encode())[::-1])


def entity_of(token: str) -> Entity | None:
    """Who has this token; None: nobody of ours knows."""
    parts = [part.replace("%", "/") for part in token.split("/")[1:]]
    return (
        Entity(*parts[: len(Entity._fields)])
        if len(parts) >= len(Entity._fields) - len(Entity._field_defaults)
        else None
    )


def quality(topic: Topic) -> str:
    """How a topic is carried, in a token: what is rmw_zenoh's default is left out."""
    depth = "" if topic.depth == _DEFAULT_DEPTH else topic.depth
    return f"{'2' if topic.sensor else ''}:{'1' if topic.latched else ''}:,{depth}:,:,:,,"


def attached(number: int, stamp: int, gid: bytes) -> bytes:
    """What goes with a message, a request or a reply: its number, when it was said [ns since 1970], and who said or asked it."""
    return _ATTACHED.pack(number, stamp, len(gid), gid)


def unattached(attachment: bytes) -> tuple[int, int, bytes]:
    """These three.

    Raises:
        struct.error: it is none.
    """
    number, stamp, _, gid = _ATTACHED.unpack(attachment)
    return number, stamp, gid


def _written(kind: str) -> str:
    """A type as DDS writes it."""
    package, space, plain = kind.split("/")
    return f"{package}::{space}::dds_::{plain}_"


class ZenohNode:
    """A session with one node in it.

    It is a peer as rmw_zenoh's are: it finds others by the router, and listens on the loopback interface alone.

    Args:
        domain: `ROS_DOMAIN_ID`.
        router: Where the router listens.
        namespace: Before the names of all topics but `/clock`; empty: none.

    Attributes:
        session: The session.

    Raises:
        WireError: nobody listens there.
    """

    def __init__(self, domain: int, router: str, namespace: str) -> None:
        self._domain, self._namespace = str(domain), f"/{namespace.strip('/')}" if namespace.strip("/") else ""
        self._count = 0
        self._alive: set[str] = set()
        self._came = threading.Event()
        try:
            self.session = zenoh.open(_config(router))
        except zenoh.ZError as error:
            raise WireError(
                f"finds no Zenoh router at {router} ({error}); `ros2 run rmw_zenoh_cpp rmw_zenohd` starts one"
            ) from error
        try:
            tokens = self.session.liveliness()
            self._kept: list[Any] = [tokens.declare_subscriber(f"@ros2_lv/{domain}/**", self._changed, history=True)]
            self.keep(self._entity("NN"), None)
        except BaseException:
            self.close()
            raise

    def publisher(self, topic: Topic) -> Callable[[Any], object]:
        entity = self.entity("MP", topic.name, topic.kind, type_hash(topic.kind), quality(topic))
        late: dict[str, Any] = {}
        if topic.latched:
            late = {
                "cache": zenoh.ext.CacheConfig(topic.depth),
                "publisher_detection": True,
                "sample_miss_detection": zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT),
            }
        publisher = zenoh.ext.declare_advanced_publisher(
            self.session, entity.key, congestion_control=zenoh.CongestionControl.DROP,
            reliability=zenoh.Reliability.BEST_EFFORT if topic.sensor else zenoh.Reliability.RELIABLE, **late,
        )  # fmt: skip
        self.keep(entity, publisher)
        gid, count = entity.gid, 0

        def says(said: Any) -> None:
            nonlocal count
            count += 1
            publisher.put(written(said), attachment=attached(count, time.time_ns(), gid))

        return says

    def subscription(self, topic: Topic) -> ZenohSubscription:
        return ZenohSubscription(self, topic)

    def service(self, name: str, kind: str) -> ZenohService:
        return ZenohService(self, name, kind)

    def wait(self, seconds: float) -> None:
        self._came.wait(seconds)
        self._came.clear()

    def close(self) -> None:
        self.session.close()

    def entity(self, what: str, name: str, kind: str, hash: str, quality: str) -> Entity:
        """Somebody new of this node, of whom nobody is told yet."""
        return self._entity(what, self.resolved(name), _written(kind), hash, quality)

    def keep(self, entity: Entity, made: object) -> None:
        """Tell others of somebody, and keep what was made for it as long as the session lives."""
        self._kept += [made, self.session.liveliness().declare_token(entity.token)]

    def resolved(self, name: str) -> str:
        """The whole name of a topic or a service."""
        return f"{'' if name == 'clock' else self._namespace}/{name}"

    def others(self, what: str, name: str, kind: str) -> list[Entity]:
        """Who is there of some sort, of a whole name and a type."""
        found = (entity_of(token) for token in tuple(self._alive))
        return [e for e in found if e is not None and (e.what, e.topic, e.kind) == (what, name, _written(kind))]

    def woken(self) -> None:
        """Something has come: `wait` returns."""
        self._came.set()

    def _entity(self, what: str, *about: str) -> Entity:
        number, self._count = self._count, self._count + 1
        return Entity(
            self._domain,
            str(self.session.zid()),
            "0",
            str(number),
            what,
            "/",
            self._namespace or "/",
            _NODE_NAME,
            *about,
        )

    def _changed(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._alive.add(token)
        else:
            self._alive.discard(token)
        self.woken()


class ZenohSubscription:
    """A topic that is read.

    Args:
        node: Who reads it.
        topic: Which.
    """

    def __init__(self, node: ZenohNode, topic: Topic) -> None:
        self._node, self._topic, self._kind = node, topic, message(topic.kind)
        self._heard: deque[tuple[bytes, bytes]] = deque(maxlen=topic.depth)
        self._hash = type_hash(topic.kind)
        entity = node.entity("MS", topic.name, topic.kind, self._hash, quality(topic))
        node.keep(entity, node.session.declare_subscriber(entity.key, self._hear))

    def taken(self) -> list[tuple[Any, str]]:
        found = []
        while self._heard:
            said, gid = self._heard.popleft()
            found.append((self._kind.deserialize(said), f"Zenoh gid {gid.hex()}"))
        return found

    def said(self) -> bool:
        there = self._node.others("MP", self._node.resolved(self._topic.name), self._topic.kind)
        return any(entity.hash == self._hash for entity in there)

    def _hear(self, sample: zenoh.Sample) -> None:
        if sample.attachment is not None:  # rmw_zenoh drops what has none, too
            self._heard.append((sample.payload.to_bytes(), unattached(sample.attachment.to_bytes())[2]))
            self._node.woken()


class ZenohService:
    """A service, as its client. Its type's hash is that of its server, as ROS 2's distributions differ in Nav2's types.

    Args:
        node: Who asks.
        name: Of the service.
        kind: Its type.
    """

    def __init__(self, node: ZenohNode, name: str, kind: str) -> None:
        self._node, self._name, self._kind = node, name, kind
        self._reply = message(f"{kind}_Response")
        self._replies: deque[tuple[bytes, int]] = deque(maxlen=10)
        self._client: Entity | None = None
        self._number = 0

    def ask(self, request: Any) -> int:
        assert self._client is not None
        self._number += 1
        self._node.session.get(
            self._client.key, self._hear, payload=written(request),
            attachment=attached(self._number, time.time_ns(), self._client.gid),
            target=zenoh.QueryTarget.ALL_COMPLETE, consolidation=zenoh.ConsolidationMode.NONE, timeout=_FOREVER,
        )  # fmt: skip
        return self._number

    def answer(self, number: int) -> Any:
        while self._replies:
            said, answered = self._replies.popleft()
            if answered == number:
                return self._reply.deserialize(said)
        return None

    def served(self) -> bool:
        servers = self._node.others("SS", self._node.resolved(self._name), self._kind)
        if servers and (self._client is None or self._client.hash != servers[0].hash):
            self._client = self._node.entity("SC", self._name, self._kind, servers[0].hash, SERVICES)
            self._node.keep(self._client, None)
        return bool(servers)

    def _hear(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None and reply.ok.attachment is not None:
            self._replies.append((reply.ok.payload.to_bytes(), unattached(reply.ok.attachment.to_bytes())[0]))
            self._node.woken()


def written(said: Any) -> bytes:
    """A message as CDR, with the four bytes before it that say so."""
    return cast(bytes, said.serialize(use_version_2=False))


def _config(router: str) -> zenoh.Config:
    return zenoh.Config.from_json5(json.dumps({
        "mode": "peer",
        "connect": {"endpoints": [router], "timeout_ms": 2000, "exit_on_failure": True},
        "listen": {"endpoints": ["tcp/localhost:0"]},
        "scouting": {
            "multicast": {"enabled": False},
            "gossip": {"enabled": True, "target": {"router": ["router", "peer"], "peer": ["router"]}},
        },
        "timestamping": {"enabled": {"router": True, "peer": True, "client": True}},
    }))  # fmt: skip
