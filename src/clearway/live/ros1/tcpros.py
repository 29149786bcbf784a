"""TCPROS: what goes over the TCP connections between nodes. Everything has its length before it, 4 bytes, little-endian."""

from __future__ import annotations

import socket
import struct
from collections.abc import Mapping

from clearway.live.line import WireError

LARGEST = 2**20
"""Bytes of a message or a header that are taken."""


def header_of(fields: Mapping[str, str]) -> bytes:
    """What begins a connection: who is there, and what is said on it."""
    parts = [f"{name}={value}".encode() for name, value in fields.items()]
    data = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(data)) + data


def fields_of(data: bytes) -> dict[str, str]:
    """The fields of a header, from what stands behind its length.

    Raises:
        WireError: it is none.
    """
    fields = {}
    while data:
        if len(data) < 4 or len(data) < 4 + (length := struct.unpack_from("<I", data)[0]):
            raise WireError("began a connection with a header that ends within a field")
        name, found, value = data[4 : 4 + length].decode(errors="replace").partition("=")
        if not found:
            raise WireError(f"began a connection with the field {name[:40]!r} that has no value")
        fields[name] = value
        data = data[4 + length :]
    return fields


def received(connection: socket.socket) -> bytes:
    """The next message or header.

    Raises:
        EOFError: the other one has closed the connection.
        WireError: it is larger than anything that is expected.
    """
    (length,) = struct.unpack("<I", _exactly(connection, 4))
    if length > LARGEST:
        raise WireError(f"sent {length} bytes at once; no message that is heard here has more than {LARGEST}")
    return _exactly(connection, length)


def _exactly(connection: socket.socket, count: int) -> bytes:
    data = bytearray()
    while len(data) < count:
        part = connection.recv(count - len(data))
        if not part:
            raise EOFError
        data += part
    return bytes(data)
