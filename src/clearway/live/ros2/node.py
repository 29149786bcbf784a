"""Topics of ROS 2 over DDS: how they are named, what quality they have, and on which interface."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import Any

from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from clearway.errors import ClearwayError
from clearway.live.ros2.messages import type_hash

_LOOPBACK = """<CycloneDDS><Domain id="any"><General><AllowMulticast>false</AllowMulticast><Interfaces>
<NetworkInterface address="127.0.0.1"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
_NAMED = '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="{}"/></Interfaces></General></Domain></CycloneDDS>'
_OPEN = Path("/proc/self/fd")
_DOMAINS: dict[int, tuple[str, Domain]] = {}

RELIABLE, SENSOR, LATCHED = "reliable", "sensor", "latched"
"""Qualities of service: rclcpp's default; that of sensor data; that of what stays, which late subscribers get too."""


def quality(kind: str, depth: int = 10, about: str = "") -> Qos:
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


class Node:
    """A participant with what it writes and reads.

    Args:
        domain: The number of the DDS domain (`ROS_DOMAIN_ID`).
        interface: The network interface that it uses; `lo`: nothing leaves this machine.
        namespace: Before the names of all topics but `/clock`; empty: none.

    Attributes:
        participant: In the domain.

    Raises:
        ClearwayError: this process has joined the domain on another interface.
    """

    def __init__(self, domain: int, interface: str, namespace: str) -> None:
        config = _LOOPBACK if interface == "lo" else _NAMED.format(interface)
        if domain not in _DOMAINS:
            before = _sockets()
            _DOMAINS[domain] = config, Domain(domain, config)
            if interface == "lo":
                _keep_to_loopback(_sockets() - before)
        if _DOMAINS[domain][0] != config:
            raise ClearwayError(
                f"domain {domain} is joined already by this process, and not on the interface {interface!r}; a process joins it on one"
            )
        self.participant = DomainParticipant(domain)
        self._namespace = f"{namespace.strip('/')}/" if namespace.strip("/") else ""
        self._waits = WaitSet(self.participant)
        self._kept: list[Any] = []

    def writer(
        self, name: str, kind: type[Any], how: str = RELIABLE, depth: int = 10, prefix: str = "rt", about: str = ""
    ) -> DataWriter[Any]:
        """Somebody who writes messages of a kind under a name."""
        writer: DataWriter[Any] = DataWriter(
            self.participant, self._topic(name, kind, prefix), qos=quality(how, depth, about or type_hash(kind))
        )
        self._kept.append(writer)
        return writer

    def reader(
        self, name: str, kind: type[Any], how: str = RELIABLE, depth: int = 10, prefix: str = "rt", about: str = ""
    ) -> DataReader[Any]:
        """Somebody who reads messages of a kind under a name; `wait` returns when one comes."""
        reader: DataReader[Any] = DataReader(
            self.participant, self._topic(name, kind, prefix), qos=quality(how, depth, about or type_hash(kind))
        )
        condition = ReadCondition(reader, ViewState.Any | InstanceState.Any | SampleState.NotRead)
        self._waits.attach(condition)
        self._kept += [condition, reader]
        return reader

    def wait(self, seconds: float) -> None:
        """Return when a message has come, at the latest after so long."""
        self._waits.wait(duration(seconds=seconds))

    def close(self) -> None:
        """Leave the domain, at once: the binding knows no other way to, and waits for the collector else."""
        self._kept.clear()
        self.participant.__del__()

    def _topic(self, name: str, kind: type[Any], prefix: str) -> Topic[Any]:
        return Topic(self.participant, f"{prefix}/{'' if name == 'clock' else self._namespace}{name}", kind)


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
