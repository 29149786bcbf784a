"""The container of ROS 1 bags, version 2.0: records of a header (`name=value` fields) and data; chunks of messages, each
followed by one index a connection; connections at the end (wiki.ros.org/Bags/Format/2.0)."""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.errors import ClearwayError
from clearway.recordings.formats.bag_limits import DEFINITION, TOPICS, Allowance, Broken, decompress
from clearway.recordings.formats.bag_store import EVER, NEVER, Channel, Message, OneFile, Times, joined

MAGIC = b"#ROSBAG V"
MEND = "mend it with `rosbag reindex`"
_MESSAGE, _BAG, _INDEX, _CHUNK, _INFO, _CONNECTION = 2, 3, 4, 5, 6, 7
_U32 = struct.Struct("<I")
_STAMPS = np.dtype([("sec", "<u4"), ("nsec", "<u4"), ("offset", "<u4")])


class _Chunk(NamedTuple):
    at: int
    length: int
    compression: str
    size: int
    indexes: dict[int, Any]  # connection -> _STAMPS


class Ros1Store(OneFile):
    """A ROS 1 bag, open.

    Raises:
        ClearwayError: it is no bag of version 2.0, was not closed, is truncated or damaged, or promises too much.
    """

    def __init__(self, path: Path) -> None:
        self._chunks: list[_Chunk] = []
        super().__init__(path, path, MEND)

    def messages(self, numbers: frozenset[int], start: int = NEVER, end: int = EVER) -> Iterator[Message]:
        for chunk in self._chunks:
            wanted = []
            for number, index in chunk.indexes.items():
                if number in numbers:
                    t = _ns(index)
                    inside = (t >= start) & (t <= end)
                    wanted += [
                        (int(o), number, int(s)) for o, s in zip(index["offset"][inside], t[inside], strict=True)
                    ]
            if not wanted:
                continue
            self._file.seek(chunk.at)
            raw = decompress(self._file.read(chunk.length), chunk.compression, chunk.size, file=self._path)
            for offset, number, stamp in sorted(wanted):
                try:
                    data = _message_at(raw, offset, number)
                except Broken as error:
                    raise self._damaged(f"no message where the index says ({error})") from error
                yield number, stamp, data

    def _walk(self, size: int) -> None:
        version = self._file.readline(64)
        if version != b"#ROSBAG V2.0\n":
            raise ClearwayError(
                f"is a bag of version {version[len(MAGIC) :].decode('ascii', 'replace').strip()!r}, not 2.0;"
                " convert it with `rosbag fix`",
                file=self._path,
            )
        allowance = Allowance(self._path, size)
        times: defaultdict[int, list[Times]] = defaultdict(list)
        at, closed = self._file.tell(), False
        while at < size:
            header, begin, length = self._record(at, size)
            match header.get(b"op"):
                case b"\x03":
                    closed = struct.unpack("<Q", header[b"index_pos"])[0] != 0
                    if header.get(b"encryptor"):
                        raise ClearwayError("is encrypted; decrypt it with `rosbag decrypt`", file=self._path)
                case b"\x05":
                    compression, claimed = header[b"compression"].decode(), _U32.unpack(header[b"size"])[0]
                    allowance.take(length, claimed)
                    self._chunks.append(_Chunk(begin, length, compression, claimed, {}))
                case b"\x04":
                    number, count = _U32.unpack(header[b"conn"])[0], _U32.unpack(header[b"count"])[0]
                    if not self._chunks or length != count * _STAMPS.itemsize or header[b"ver"] != b"\1\0\0\0":
                        raise self._damaged(f"an index of {length} bytes for {count} messages")
                    index = np.frombuffer(self._file.read(length), dtype=_STAMPS)
                    before = self._chunks[-1].indexes
                    before[number] = np.concatenate([before[number], index]) if number in before else index
                    times[number].append(_ns(index))
                case b"\x07":
                    self._connection(header, length)
                case b"\x06":
                    pass
                case op:
                    raise self._damaged(f"a record of kind {op!r}")
            at = begin + length
        if not closed:
            raise ClearwayError(f"was not closed, so that it has no index; {MEND}", file=self._path)
        if lost := sorted(set(times) - set(self.channels)):
            raise self._damaged(f"messages of a connection {lost[0]} that it doesn't describe")
        self.times = joined(times)

    def _record(self, at: int, size: int) -> tuple[dict[bytes, bytes], int, int]:
        """Fields of the record at `at`, and where its data begin and how many bytes they are; the file stands there."""
        self._file.seek(at)
        (length,) = _U32.unpack(self._file.read(4).ljust(4, b"\xff"))
        if at + 8 + length > size:
            raise self._truncated(at)
        if length > DEFINITION:
            raise self._damaged(f"a record's header of {length} bytes")
        fields = _fields(self._file.read(length))
        (data,) = _U32.unpack(self._file.read(4))
        begin = at + 8 + length
        if begin + data > size:
            raise self._truncated(at)
        return fields, begin, data

    def _connection(self, header: dict[bytes, bytes], length: int) -> None:
        if length > DEFINITION:
            raise self._damaged(f"a message definition of {length} bytes")
        about = _fields(self._file.read(length))
        number = _U32.unpack(header[b"conn"])[0]
        if len(self.channels) >= TOPICS:
            raise ClearwayError(f"has more than {TOPICS} topics; this is no recording", file=self._path)
        self.channels[number] = Channel(
            number,
            _topic(header[b"topic"].decode()),
            about[b"type"].decode(),
            "ros1",
            "ros1msg",
            about[b"message_definition"].decode(errors="replace"),
        )

    def _truncated(self, at: int) -> ClearwayError:
        return ClearwayError(f"is truncated: a record at byte {at} ends beyond the file; {MEND}", file=self._path)


def _fields(header: bytes) -> dict[bytes, bytes]:
    fields, at = {}, 0
    while at < len(header):
        (length,) = _U32.unpack_from(header, at)
        name, found, value = header[at + 4 : at + 4 + length].partition(b"=")
        at += 4 + length
        if not found or at > len(header):
            raise ValueError("a header that cannot be parsed")
        fields[name] = value
    return fields


def _message_at(raw: bytes, offset: int, number: int) -> bytes:
    while True:
        (length,) = _U32.unpack_from(raw, offset)
        fields = _fields(raw[offset + 4 : offset + 4 + length])
        begin = offset + 8 + length
        (size,) = _U32.unpack_from(raw, begin - 4)
        if fields[b"op"] != b"\x07":  # a connection may stand before its first message
            break
        offset = begin + size
    if fields[b"op"] != b"\x02" or _U32.unpack(fields[b"conn"])[0] != number or begin + size > len(raw):
        raise ValueError("something else stands there")
    return raw[begin : begin + size]


def _ns(index: Any) -> Times:
    times: Times = index["sec"].astype(np.int64) * 1_000_000_000 + index["nsec"]
    return times


def _topic(name: str) -> str:
    return "/" * name.startswith("/") + "/".join(part for part in name.split("/") if part)
