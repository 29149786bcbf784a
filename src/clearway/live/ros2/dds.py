"""ROS 2 over DDS, as rmw_cyclonedds writes it: how topics and services are named, what quality they have, and on which interface."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

from cyclonedds.core import DDSException, InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration

from clearway.errors import ClearwayError
from clearway.live.line import WireError
from clearway.live.ros.topics import Topic
from clearway.live.ros2.messages import message, type_hash

_LOOPBACK = """<CycloneDDS><Domain id="any"><General><AllowMulticast>false</AllowMulticast><Interfaces>
<NetworkInterface address="127.0.0.1"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
_NAMED = '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="{}"/></Interfaces></General></Domain></CycloneDDS>'
_OPEN = Path("/proc/self/fd")
_DOMAINS: dict[int, tuple[str, Domain]] = {}

RELIABLE, SENSOR, LATCHED = "reliable", "sensor", "latched"
"""Qualities of service: rclcpp's default; that of sensor data; that of what stays, which late subscribers get too."""


def quality(kind: str, depth: int, about: str = "") -> Qos:
    """A quality of service; `about` goes into the endpoint's USER_DATA."""
    block = duration(seconds=1)
    policies = [
        Policy.Reliability.BestEffort if kind == SENSOR else Policy.Reliability.Reliable(block),
        Policy.Durability.TransientLocal if kind == LATCHED else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.WriterDataLifecycle(autodispose=False),
    ]
    if about:
        policies.append(Policy.Userdata(about.encode()))
    return Qos(*policies)


RequestId = message("clearway/msg/RequestId")
"""What stands before a request and its reply."""


def headed(kind: str) -> Any:
    """The class of the requests or replies of a type, with that head."""
    return message(kind, ("request", RequestId))


class DdsNode:
    """A participant with what it writes and reads.

    Args:
        domain: The number of the DDS domain (`ROS_DOMAIN_ID`).
        interface: The network interface that it uses; `lo`: nothing leaves this machine.
        namespace: Before the names of all topics but `/clock`; empty: none.

    Attributes:
        participant: In the domain.

    Raises:
        ClearwayError: this process has joined the domain on another interface.
        WireError: there is none such.
    """

    def __init__(self, domain: int, interface: str, namespace: str) -> None:
        config = _LOOPBACK if interface == "lo" else _NAMED.format(interface)
        try:
            if domain not in _DOMAINS:
                before = _sockets()
                _DOMAINS[domain] = config, Domain(domain, config)
                if interface == "lo":
                    _keep_to_loopback(_sockets() - before)
            self.participant = DomainParticipant(domain)
        except DDSException as error:
            raise WireError(f"cannot join domain {domain} on the interface {interface!r}: {error}") from error
        if _DOMAINS[domain][0] != config:
            raise ClearwayError(
                f"domain {domain} is joined already by this process, and not on the interface {interface!r}; a process joins it on one"
            )
        self._namespace = f"{namespace.strip('/')}/" if namespace.strip("/") else ""
        self._waits = WaitSet(self.participant)
        self._kept: list[Any] = []

    def publisher(self, topic: Topic) -> Callable[[Any], object]:
        writer = self.writer(topic.name, message(topic.kind), _how(topic), topic.depth, "rt", _about(topic))
        return lambda said: writer.write(said)

    def subscription(self, topic: Topic) -> DdsSubscription:
        return DdsSubscription(
            self.reader(topic.name, message(topic.kind), _how(topic), topic.depth, "rt", _about(topic))
        )

    def service(self, name: str, kind: str) -> DdsService:
        return DdsService(self, name, kind)

    def wait(self, seconds: float) -> None:
        self._waits.wait(duration(seconds=seconds))

    def close(self) -> None:
        """Leave the domain, at once: the binding knows no other way to, and waits for the collector else."""
        self._kept.clear()
        self.participant.__del__()

    def writer(self, name: str, kind: Any, how: str, depth: int, prefix: str, about: str = "") -> DataWriter[Any]:
        """Somebody who writes messages of a class under a name."""
        writer: DataWriter[Any] = DataWriter(
            self.participant, self._topic(name, kind, prefix), qos=quality(how, depth, about)
        )
        self._kept.append(writer)
        return writer

    def reader(self, name: str, kind: Any, how: str, depth: int, prefix: str, about: str = "") -> DataReader[Any]:
        """Somebody who reads messages of a class under a name; `wait` returns when one comes."""
        reader: DataReader[Any] = DataReader(
            self.participant, self._topic(name, kind, prefix), qos=quality(how, depth, about)
        )
        condition = ReadCondition(reader, ViewState.Any | InstanceState.Any | SampleState.NotRead)
        self._waits.attach(condition)
        self._kept += [condition, reader]
        return reader

    def _topic(self, name: str, kind: Any, prefix: str) -> DdsTopic[Any]:
        return DdsTopic(self.participant, f"{prefix}/{'' if name == 'clock' else self._namespace}{name}", kind)


class DdsSubscription:
    """A topic that is read.

    Args:
        reader: Reads it.
    """

    def __init__(self, reader: DataReader[Any]) -> None:
        self._reader = reader

    def taken(self) -> list[tuple[Any, str]]:
        return [
            (said, f"DDS handle {said.sample_info.publication_handle % 2**64:x}")  # it is given as signed
            for said in taken(self._reader)
        ]

    def said(self) -> bool:
        return bool(self._reader.get_matched_publications())


class DdsService:
    """A service, as its client.

    Args:
        node: Who asks.
        name: Of the service.
        kind: Its type.
    """

    def __init__(self, node: DdsNode, name: str, kind: str) -> None:
        client = "clientid=" + ".".join(f"{byte:x}" for byte in secrets.token_bytes(16)) + ";"
        self._request, self._number = headed(f"{kind}_Request"), 0
        self._replies = node.reader(f"{name}Reply", headed(f"{kind}_Response"), RELIABLE, 10, "rr", client)
        self._requests = node.writer(f"{name}Request", self._request, RELIABLE, 10, "rq", client)
        self._guid = self._requests.get_instance_handle() % 2**64

    def ask(self, request: Any) -> int:
        self._number += 1
        said = (getattr(request, field.name) for field in fields(request))
        self._requests.write(self._request(RequestId(self._guid, self._number), *said))
        return self._number

    def answer(self, number: int) -> Any:
        for reply in taken(self._replies):
            if (reply.request.guid, reply.request.seq) == (self._guid, number):
                return reply
        return None

    def served(self) -> bool:
        return bool(self._requests.get_matched_subscriptions() and self._replies.get_matched_publications())


def _how(topic: Topic) -> str:
    return LATCHED if topic.latched else SENSOR if topic.sensor else RELIABLE


def _about(topic: Topic) -> str:
    """What Jazzy and later expect in the USER_DATA of a topic's endpoints."""
    return f"typehash={type_hash(topic.kind)};"


def taken(reader: DataReader[Any]) -> list[Any]:
    """What came, oldest first, but for the news that a writer left."""
    return [sample for sample in reader.take(100) if sample.sample_info.valid_data]


def _sockets() -> set[int]:
    """File descriptors of this process's sockets, where the system tells (Linux)."""
    if not _OPEN.is_dir():
        return set()
    return {
        int(file.name) for file in _OPEN.iterdir() if file.is_symlink() and file.readlink().name.startswith("socket:")
    }


def _keep_to_loopback(opened: set[int]) -> None:
    """Have sockets take nothing from other interfaces: those of Cyclone DDS are bound to no address, whichever is named
    (eclipse-cyclonedds/cyclonedds, issue 2090)."""
    for file in opened:
        with socket.socket(fileno=os.dup(file)) as opened_socket:
            if opened_socket.family == socket.AF_INET:
                opened_socket.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, b"lo")
